"""Events over one parameter from eigenvalues: complex systems, and matrices without a polynomial."""

import numpy as np
import pytest

import tmsopt
from tmsopt.models import from_hamiltonian, from_matrices


def spin(n):
    """S_x + i g S_z, whose eigenfrequencies are m √(1 − g²): all meet at g = 1."""
    j = (n - 1) / 2
    m = j - np.arange(n)
    rows = np.diag(np.sqrt(j * (j + 1) - m[1:] * (m[1:] + 1)) / 2, 1)
    rows = (rows + rows.T).tolist()
    for k in range(n):
        rows[k][k] = f"1j*g*({m[k]})"
    return from_hamiltonian(rows)


@pytest.mark.parametrize("n", [2, 3, 4, 6, 8])
def test_all_eigenfrequencies_of_a_spin_meet_at_one(n):
    """An EPn at g = 1, and real eigenfrequencies below."""
    problem = tmsopt.Problem(spin(n), fixed={"g": 0.5})
    found = tmsopt.speeds(problem, "g", between=(0, 2))
    (event,) = found.found
    assert (event.kind, event.changes, found.always, found.is_exact) == (f"EP{n}", True, ("weave",), False)
    assert abs(event.at - 1) < 1e-14
    assert found.marginal[0] == pytest.approx((0, 1))


@pytest.mark.parametrize("n", [20, pytest.param(40, marks=pytest.mark.slow)])
def test_a_large_real_matrix_is_stable_from_its_greatest_real_part_on(n):
    """A − c is stable for c > max Re λ(A); each λ crosses at c = Re λ."""
    A = np.random.default_rng(1).standard_normal((n, n))
    rows = A.tolist()
    for k in range(n):
        rows[k][k] = f"{A[k, k]} - c"
    problem = tmsopt.Problem(from_matrices(A=rows), fixed={"c": 4.0})
    found, s = tmsopt.speeds(problem, "c", between=(0, 20)), np.linalg.eigvals(A)
    expected = sorted(z.real for z in s if z.real > 0 and z.imag >= 0)
    assert [c.at for c in found.found] == pytest.approx(expected, abs=1e-11)
    assert found.stable[0] == pytest.approx((max(expected), 20))
    grown = tmsopt.growth(problem, end=20.0)
    assert grown.stable == found.stable
    assert grown.roots.shape == (len(grown.values), n)
    k = len(grown.values) // 2
    assert np.abs(np.sort_complex(s - grown.values[k]) - grown.roots[k]).max() < 1e-11


def test_a_large_mechanical_system_with_one_damper_that_feeds():
    """q″ + (d + L) q′ + k q = 0 for a chain of 8 masses: each mode has damping d + ν, ν the eigenvalues of L."""
    n = 8
    identity = np.eye(n).tolist()
    D = [["d + 2" if a == b else -float(abs(a - b) == 1) for b in range(n)] for a in range(n)]
    problem = tmsopt.Problem(from_matrices(M=identity, D=D, K=(4 * np.eye(n)).tolist()), fixed={"d": 0.0})
    found = tmsopt.speeds(problem, "d", between=(-6, 0.9))
    nu = 2 - 2 * np.cos(np.pi * np.arange(1, n + 1) / (n + 1))
    flutter = [c.at for c in found.found if c.kind == "weave"]
    assert flutter == pytest.approx(sorted(-nu), abs=1e-11)
    doubles = [c.at for c in found.found if c.kind == "EP2"]  # where (d + ν)² = 4 · 4
    assert doubles == pytest.approx(sorted(x for y in nu for x in (4 - y, -4 - y) if -6 < x < 0.9), abs=1e-11)
    assert found.stable[0] == pytest.approx((max(-nu), 0.9))


def test_an_open_range_has_no_grid():
    """The whole half line needs exact root isolation."""
    with pytest.raises(tmsopt.InputError, match="between"):
        tmsopt.speeds(tmsopt.Problem(spin(3), fixed={"g": 0.5}), "g", between=(0, float("inf")))
