"""Phase rigidity, Petermann factor and condition number of the eigenvalues of solutions, against closed forms."""

import math
import pickle

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize

import tmsopt
from tmsopt.models import from_coefficients, from_hamiltonian, from_matrices


def eigenvalues(model, **fixed):
    return tmsopt.eigenvalues(tmsopt.Problem(model, fixed=fixed))


def test_two_lossy_modes():
    """K = k²/(k² − k₀²), k₀ = |g1 − g2|/2, and ω = −i (g1 + g2)/2 ± √(k² − k₀²); the condition is √K."""
    found = eigenvalues(from_hamiltonian([["-1j*g1", "k"], ["k", "-1j*g2"]]), g1=1.0, g2=0.2, k=0.5)
    assert sorted(s.eigenfrequency.real for s in found.entries) == pytest.approx([-0.3, 0.3], rel=1e-12)
    for s in found.entries:
        assert (s.re, s.im) == pytest.approx((-0.6, -s.eigenfrequency.real), rel=1e-12)
        assert s.petermann == pytest.approx(0.25 / 0.09, rel=1e-12)
        assert s.phase_rigidity == pytest.approx(0.6, rel=1e-12)
        assert s.condition == pytest.approx(1 / 0.6, rel=1e-12)


def test_a_semisimple_eigenvalue_has_the_norm_of_its_projector():
    """[[1, 0, −1], [0, 1, −2], [0, 0, 0]] on the two of −a; that of −b is (1, 2, 1) (0, 0, 1)."""
    A = [["-a", 0, "a - b"], [0, "-a", "2*a - 2*b"], [0, 0, "-b"]]
    problem = tmsopt.Problem(from_matrices(A=A), fixed={"a": 1.0, "b": 3.0})
    (diagnosis,) = tmsopt.diagnose(problem)
    found = {s.multiplicity: s for s in tmsopt.eigenvalues(problem).entries}
    assert diagnosis.kind == "semisimple"
    for s in (diagnosis, found[2]):
        assert (s.phase_rigidity, s.condition) == pytest.approx((6**-0.5, 6**0.5), rel=1e-9)
    assert found[1].condition == pytest.approx(6**0.5, rel=1e-12)


def test_coefficients_are_a_matrix_with_one_entry():
    """s² + c s + k: κ = (|s|² + c |s| + k)/|2 s + c|."""
    found = eigenvalues(from_coefficients([1, "c", "k"]), c=0.6, k=2.0)
    for s in found.entries:
        z = complex(s.re, s.im)
        assert s.condition == pytest.approx((4 + 0.6 * math.sqrt(2)) / abs(2 * z + 0.6), rel=1e-13)


def test_defective_and_simple_eigenvalues_of_one_design():
    """A chain of 3 next to a simple one with K = 10/9."""
    A = [["-a", 1, 0, 0], [0, "-a", 1, 0], [0, 0, "-a", 0], [0, 0, 1, "-b"]]
    problem = tmsopt.Problem(from_matrices(A=A), fixed={"a": 2.0, "b": 5.0})
    found = tmsopt.eigenvalues(problem)
    simple, multiple = sorted(found.entries, key=lambda s: s.re)
    assert (multiple.multiplicity, multiple.phase_rigidity) == (3, 0)
    assert multiple.petermann == multiple.condition == math.inf
    assert (simple.multiplicity, simple.petermann) == (1, pytest.approx(10 / 9, rel=1e-12))
    (diagnosis,) = tmsopt.diagnose(problem)
    assert (diagnosis.kind, diagnosis.phase_rigidity, diagnosis.petermann) == ("defective", 0, math.inf)


def test_a_chain_without_a_polynomial_at_its_exceptional_point():
    """Eight modes with gain g and loss g at the ends merge at ω = 0 for g = 1; the others against SciPy."""
    n = 8
    hopping = np.eye(n, k=1) + np.eye(n, k=-1)
    H = hopping.tolist()
    H[0][0], H[-1][-1] = "1j*g", "-1j*g"
    model = from_hamiltonian(H)
    assert model.polynomial is None
    multiple, *others = sorted(eigenvalues(model, g=1.0).entries, key=lambda s: -s.multiplicity)
    assert (multiple.multiplicity, multiple.petermann) == (2, math.inf)
    values, left, right = scipy.linalg.eig(hopping + np.diag([1j, *(n - 2) * [0], -1j]), left=True)
    assert len(others) == n - 2
    for s in others:
        k = abs(values - s.eigenfrequency).argmin()
        assert s.phase_rigidity == pytest.approx(abs(left[:, k].conj() @ right[:, k]), rel=1e-7)


def test_what_a_result_of_eigenvalues_can_do():
    found = tmsopt.eigenvalues("problems/whipple_benchmark.toml")
    assert pickle.loads(pickle.dumps(found)).entries == found.entries
    frame = found.to_frame()
    assert list(frame["petermann"]) == [s.petermann for s in found.entries]
    assert "Petermann" in found.report()


@pytest.mark.parametrize("change", [1e-2, 1e-6, -1e-6, -0.05])
def test_the_nearest_EP2_of_two_modes_and_the_angle_of_their_eigenvectors(change):
    """[[i g, 1], [1, −i g]] has its EP2 at g = 1, and |x₁* x₂| is 1/g for g > 1 and g for g < 1."""
    g = 1 + change
    found = eigenvalues(from_hamiltonian([["1j*g", 1], [1, "-1j*g"]]), g=g)
    near = found.nearest_EP2
    assert near.parameters["g"] == pytest.approx(1, abs=1e-14)
    assert (near.changes["g"], near.distance) == pytest.approx((-change, abs(change) / g), rel=1e-7)
    assert near.angle == pytest.approx(math.acos(min(g, 1 / g)), rel=1e-8)
    assert found.to_json()["nearest_EP2"]["changes"] == near.changes
    assert "nearest EP2 found: g = 1 " in str(found)


def test_the_nearest_EP2_of_an_oscillator():
    """s² + 2 d s + k has its EP2 at d² = k; of all such points the nearest in relative changes is found."""
    near = eigenvalues(from_matrices(M=[[1]], D=[["2*d"]], K=[["k"]]), d=1.02, k=1.0).nearest_EP2
    best = scipy.optimize.minimize_scalar(lambda d: math.hypot(d / 1.02 - 1, d * d - 1), (1.0, 1.02), tol=1e-12)
    assert (near.parameters["d"], near.distance) == pytest.approx((best.x, best.fun), abs=1e-7)


@pytest.mark.parametrize(
    ("H", "fixed"),
    [
        ([["a", "b - c"], ["b - c", 1]], {"a": 1 + 1e-6, "b": 1 + 1e-6, "c": 1.0}),  # a diabolic point is near
        ([["1j*g", 1], [1, "-1j*g"]], {"g": 1.5}),  # 50 % away
    ],
)
def test_where_no_EP2_is_near(H, fixed):
    assert eigenvalues(from_hamiltonian(H), **fixed).nearest_EP2 is None
