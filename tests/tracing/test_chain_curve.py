"""Curves of exceptional points by Jordan chains, against closed forms."""

import numpy as np
import pytest

import tmsopt
from tmsopt.models import from_hamiltonian, from_matrices

EXACT = 1e-11


def traced(model, free, locate, **others):
    return tmsopt.trace(tmsopt.Problem(model, free=free, locate=locate), **others).branches


def test_a_dimer_with_detuning_and_its_diabolic_point():
    """[[d + i g, k], [k, −i g]] has its EP2 at d = 0 and g = ±k, and two eigenvectors where both are 0."""
    model = from_hamiltonian([["d + 1j*g", "k"], ["k", "-1j*g"]])
    (branch,) = traced(model, {"g": (0.1, 3), "k": (0.2, 3), "d": (-1, 1)}, "EP2", starts=3, step=0.02)
    assert np.abs(branch.parameters["g"] - branch.parameters["k"]).max() <= EXACT
    assert np.abs(branch.parameters["d"]).max() <= EXACT
    assert sorted(np.round(branch.parameters["k"][[0, -1]], 12)) == [0.2, 3.0]  # from end to end of the box
    crossed = traced(
        from_hamiltonian([["1j*g", "k"], ["k", "-1j*g"]]), {"g": (-1, 1.3), "k": (-1, 1.2)}, "EP2", starts=6
    )
    assert len(crossed) == 2
    for branch in crossed:
        (event,) = [e for e in branch.events if e.name == "crossing"]
        assert max(abs(event.parameters[n]) for n in "gk") <= EXACT


def test_an_ep3_on_curves_of_ep2():
    """A trimer has an EP3 at g = l = √2, d = 0: the characteristic polynomial is ω³ there."""
    model = from_hamiltonian([["d + 1j*g", "1", "0"], ["1", "0", "1"], ["0", "1", "-1j*l"]])
    branches = traced(model, {"g": (0.1, 2.5), "l": (0.1, 2.5), "d": (-1.0, 1.0)}, "EP2", starts=2, step=0.05)
    points = [e.parameters for b in branches for e in b.events if e.name == "EP3"]
    assert points
    for point in points:
        assert [point[n] for n in "gld"] == pytest.approx([2**0.5, 2**0.5, 0], abs=EXACT)


def test_a_spin_chain_has_an_EP7_where_gain_is_coupling():
    """k S_x + i g S_z has the eigenvalues m √(k² − g²); six conditions follow from one."""
    n = 7
    H = [["0"] * n for _ in range(n)]
    for i in range(n):
        H[i][i] = f"1j*g*({(n - 1) / 2 - i})"
        if i + 1 < n:
            H[i][i + 1] = H[i + 1][i] = f"k*sqrt({(i + 1) * (n - 1 - i)})/2"
    (branch,) = traced(from_hamiltonian(H), {"g": (0.1, 3), "k": (0.2, 3)}, "EP7", starts=1, step=0.05)
    assert np.abs(branch.parameters["g"] - branch.parameters["k"]).max() <= EXACT
    dimer = from_hamiltonian([["d + 1j*g", "1"], ["1", "-1j*g"]])
    with pytest.raises(tmsopt.InputError, match="free 1 more"):  # one point, no curve
        traced(dimer, {"g": (0.1, 3), "d": (-1, 1)}, "EP2")


def hide(table):
    """A symmetric matrix with these eigenvalues: the first as text, in a basis without zeros."""
    n = len(table)
    Q = np.linalg.qr(np.random.default_rng(1).normal(size=(n, n)))[0]
    rest = (Q[:, 1:] * np.array(table[1:], dtype=float)) @ Q[:, 1:].T
    return [[f"{float(Q[i, 0] * Q[j, 0])!r}*{table[0]} + ({float(rest[i, j])!r})" for j in range(n)] for i in range(n)]


def test_critical_damping_of_one_of_eight_oscillators():
    """s² + d s + k has a double root at d² = 4 k; the other oscillators do not take part."""
    D, K = ["d", *(0.1 * (i + 1) for i in range(1, 8))], ["k", *((2 + 0.7 * i) ** 2 for i in range(1, 8))]
    model = from_matrices(M=np.eye(8).astype(int).tolist(), D=hide(D), K=hide(K))
    assert model.polynomial is None
    (branch,) = traced(model, {"d": (0.5, 4), "k": (0.2, 3)}, "EP2", starts=3, step=0.02)
    assert np.abs(branch.parameters["d"] ** 2 - 4 * branch.parameters["k"]).max() <= EXACT
    assert branch.stable.all()


def test_gyroscopes_have_a_curve_in_two_parameters():
    """s⁴ + (g² − 1 − k) s² + k has a double pair where g² − 1 − k = 2 √k; the other condition holds by symmetry."""
    model = from_matrices(M=[[1, 0], [0, 1]], D=[[0, "g"], ["-g", 0]], K=[[-1, 0], [0, "-k"]])
    (branch,) = traced(model, {"g": (2, 4), "k": (2, 6)}, "CEP2", starts=4)
    g, k = (branch.parameters[n] for n in "gk")
    assert np.abs(g**2 - 1 - k - 2 * np.sqrt(k)).max() <= EXACT
    assert not branch.abscissa.any()


def test_resonance_on_a_curve_of_complex_double_roots():
    """Two oscillators with dampers ±d and a spring c = 0.6 between them, all roots moved by −r.

    At e = 0 the roots satisfy ((s + r)² + 1)² = d² (s + r)² + c², with double roots at d² = 2 − 2 √(1 − c²) = 0.4.
    """
    A = [[f"-{i} - r" if i == j > 3 else "0" for j in range(14)] for i in range(14)]
    A[0][:4], A[1][:4] = ["-r", "1", "0", "0"], ["-1", "-d - r", "-0.6", "0"]
    A[2][:4], A[3][:4] = ["0", "0", "-r", "1"], ["-0.6", "0", "-1 - e", "d - r"]
    free = {"r": (-1, 1), "d": (0.1, 1), "e": (-0.2, 0.25)}
    (branch,) = traced(from_matrices(A=A), free, "CEP2", starts=3, step=0.02)
    (event,) = [e for e in branch.events if e.name == "resonance"]
    assert [event.parameters[n] for n in "rde"] == pytest.approx([0, 0.4**0.5, 0], abs=EXACT)


def test_the_order_and_the_abscissa_where_two_ep2_meet():
    """The PT chain of four, with gain and loss at its ends, has ω⁴ − (2c² + 1 − g²) ω² + c⁴ − g²: ω⁴ at g = c² = 1 + √2.

    Computed eigenvalues are off by 1e-4 there. All eigenfrequencies of the curve nearby are real.
    """
    H = [["1j*g", "c", 0, 0], ["c", 0, 1, 0], [0, 1, 0, "c"], [0, 0, "c", "-1j*g"]]
    free = {"g": (2.3, 2.6), "c": (1.5, 1.6)}
    branch, event = next(
        (b, e) for b in traced(from_hamiltonian(H), free, "EP2", starts=2) for e in b.events if "EP" in e.name
    )
    assert event.name == "EP4"
    assert "weave" not in [e.name for e in branch.events]
    assert [event.parameters[n] for n in "gc"] == pytest.approx([1 + 2**0.5, (1 + 2**0.5) ** 0.5], abs=EXACT)
    assert branch.abscissa[event.index] == 0
