"""Phase rigidity, Petermann factor and condition number against closed forms, SciPy's left eigenvectors and shifts."""

from math import sqrt

import numpy as np
import pytest
import scipy.linalg

from tmsopt.roots import condition_eigenvalue, find_conditioning

RNG = np.random.default_rng(20)


def complex_normal(*shape):
    return RNG.normal(size=shape) + 1j * RNG.normal(size=shape)


def pencil(H):
    """I and i H of s + i H."""
    return np.stack(np.broadcast_arrays(np.eye(H.shape[-1]), 1j * H), axis=-3)


def dimer(d, k, g1=1.0, g2=0.2):
    """[[d − i g1, k], [k, −i g2]], for arrays."""
    d, k = np.broadcast_arrays(d, k)
    return np.moveaxis(np.array([[d - 1j * g1, k + 0j], [k + 0j, 0 * k - 1j * g2]]), (0, 1), (-2, -1))


def test_the_petermann_factor_of_two_modes():
    """K = (1 + Tr(H₀†H₀)/|Tr H₀²|)/2, H₀ = H without its trace (Wang et al., Nature Communications 11, 1610, 2020)."""
    H = dimer(*np.meshgrid(np.linspace(-1, 1, 12), np.linspace(0.05, 2, 9)))
    H0 = H - np.trace(H, axis1=-2, axis2=-1)[..., None, None] / 2 * np.eye(2)
    wanted = (1 + (abs(H0) ** 2).sum(axis=(-2, -1)) / abs(np.trace(H0 @ H0, axis1=-2, axis2=-1))) / 2
    found = find_conditioning(pencil(H))
    assert found.petermann.shape == (9, 12, 2)
    assert found.petermann == pytest.approx(np.stack([wanted, wanted], -1), rel=1e-12)
    assert found.condition == pytest.approx(1 / found.phase_rigidity, rel=1e-12)


def test_the_petermann_factor_over_the_coupling():
    """Without detuning, K = k²/(k² − k₀²) above the exceptional point k₀ = |g1 − g2|/2, and k₀²/(k₀² − k²) below."""
    k, k0 = np.array([0.1, 0.3, 0.399, 0.39999, 0.401, 0.5, 3.0]), 0.4
    found = find_conditioning(pencil(dimer(0.0, k))).petermann
    wanted = np.maximum(k, k0) ** 2 / abs(k**2 - k0**2)
    # near the point, the difference 1 − k/k₀ has lost digits in the matrix, and K is 1/(2 |1 − k/k₀|)
    assert found == pytest.approx(np.stack([wanted, wanted], -1), rel=1e-9)


@pytest.mark.parametrize("draw", [RNG.normal, lambda size: complex_normal(*size)], ids=["real", "complex"])
@pytest.mark.parametrize("n", [1, 2, 5, 12])
def test_left_eigenvectors_are_those_of_lapack(n, draw):
    A = draw(size=(7, n, n))
    found = find_conditioning(np.stack(np.broadcast_arrays(np.eye(n), -A), axis=1))
    for matrix, s, rigidity in zip(A, found.eigenvalues, found.phase_rigidity, strict=True):
        values, left, right = scipy.linalg.eig(matrix, left=True)
        order = abs(values - s[:, None]).argmin(axis=1)
        assert sorted(order) == list(range(n))
        wanted = abs((left.conj() * right).sum(axis=0)) / np.linalg.norm(left, axis=0) / np.linalg.norm(right, axis=0)
        assert rigidity == pytest.approx(wanted[order], rel=1e-10)


def null_vectors(L):
    U, _, V = np.linalg.svd(L)
    return U[:, -1], V[-1].conj()


@pytest.mark.parametrize("degree", [2, 3])
def test_polynomials_of_matrices(degree):
    """The rigidity by SciPy for the matrix of the states, the condition of Tisseur (2000) by null vectors of L(s)."""
    n = 3
    P = RNG.normal(size=(degree + 1, n, n))
    state = np.eye(degree * n, k=n)
    for j in range(degree):
        state[-n:, j * n : (j + 1) * n] = -np.linalg.inv(P[0]) @ P[degree - j]
    values, left, right = scipy.linalg.eig(state, left=True)
    found = find_conditioning(P)
    for s, rigidity, condition in zip(found.eigenvalues, found.phase_rigidity, found.condition, strict=True):
        k = abs(values - s).argmin()
        assert rigidity == pytest.approx(abs(left[:, k].conj() @ right[:, k]), rel=1e-10)
        powers = s ** np.arange(degree, -1, -1)
        slopes = np.arange(degree, 0, -1) * powers[1:]
        y, x = null_vectors(np.tensordot(powers, P, 1))
        size = abs(powers) @ np.linalg.norm(P, 2, axis=(1, 2))
        assert condition == pytest.approx(size / abs(y.conj() @ np.tensordot(slopes, P[:-1], 1) @ x), rel=1e-9)
        alone = condition_eigenvalue(P.astype(complex), s)
        assert alone == pytest.approx((rigidity, condition), rel=1e-9)


def test_a_chain_of_a_hundred_modes():
    """Hopping that is stronger in one direction (Hatano and Nelson): ψₘ = ρ^(±m) sin(m θ) on the two sides."""
    n, rho = 100, 1.02
    found = find_conditioning(pencil(np.diag(np.full(n - 1, rho), -1) + np.diag(np.full(n - 1, 1 / rho), 1)))
    m = np.arange(1, n + 1)
    sines = np.sin(np.pi * np.outer(m, m) / (n + 1)) ** 2
    norms = [(rho ** (sign * 2 * m) * sines).sum(axis=1) for sign in (1, -1)]
    wanted = sines.sum(axis=1) / np.sqrt(norms[0] * norms[1])
    order = np.argsort(-found.eigenvalues.imag)[::-1]  # s = −2i cos θ
    assert found.phase_rigidity[order] == pytest.approx(wanted, rel=1e-8)


# Exceptional points


def test_an_exact_exceptional_point_next_to_a_simple_eigenvalue():
    """What merges is below any limit, and what inverted eigenvectors do not tell of the other one is not told."""
    A = np.array([[2.0, 1, 0], [0, 2, 0], [0, 1, 5]])  # 5 has the left eigenvector (0, 1, 3)
    found = find_conditioning([np.eye(3), -A])
    order = abs(found.eigenvalues - 5).argsort()
    other, *merging = found.phase_rigidity[order]
    assert max(merging) < 1e-12
    assert np.isnan(other) or other == pytest.approx(3 / sqrt(10), rel=1e-3)
    assert condition_eigenvalue(np.array([np.eye(3), -A], dtype=complex), 5.0) == pytest.approx(
        (3 / sqrt(10), sqrt(10) / 3), rel=1e-14
    )


def test_matrices_without_eigenvalues_are_undefined_alone():
    """A singular mass, an infinite entry; the designs next to them have the same bits as alone."""
    good = RNG.normal(size=(3, 2, 2))
    massless, infinite = good.copy(), good.copy()
    massless[0] = [[1, 0], [0, 0]]
    infinite[2, 0, 0] = np.inf
    found = find_conditioning([massless, good, infinite, good * np.nan])
    for numbers, alone in zip(vars(found).values(), vars(find_conditioning(good)).values(), strict=True):
        assert np.isnan(numbers[[0, 2, 3]]).all()
        assert numbers[1].tobytes() == alone.tobytes()
    assert np.isnan(condition_eigenvalue(massless.astype(complex), 1.0)).all()


def test_semisimple_eigenvalues_have_the_norm_of_their_projector():
    S = RNG.normal(size=(4, 4))
    projector = S @ np.diag([1, 1, 0, 0]) @ np.linalg.inv(S)
    A = S @ np.diag([1, 1, 2, 3]) @ np.linalg.inv(S)
    wanted = np.linalg.norm(projector, 2)
    rigidity, condition = condition_eigenvalue(np.array([np.eye(4), -A], dtype=complex), 1.0, 2)
    assert (1 / rigidity, condition) == pytest.approx((wanted, wanted), rel=1e-10)
