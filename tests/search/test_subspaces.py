"""The least abscissa of matrices without a polynomial, beside closed forms and eigenvalues at 40 digits."""

from importlib import import_module

import mpmath
import numpy as np
import pytest

import tmsopt
from tmsopt.models import from_hamiltonian, from_matrices

EXACT = 1e-13  # of the size of the eigenvalues


def chain(size, H):
    """H beside modes that lose 1 each."""
    rows = [[f"{i} - 1j" if i == j else 0 for j in range(size)] for i in range(size)]
    for i, row in enumerate(H):
        rows[i][: len(row)] = row
    return from_hamiltonian(rows)


DIMER = [["d - 1j*g", "k"], ["k", "-0.2j"]]
"""Beyond k = |g − 0.2|/2, both modes lose (g + 0.2)/2; before, the slower one loses less."""


@pytest.mark.parametrize("size", [2, 7, pytest.param(20, marks=pytest.mark.slow)])
def test_a_lossy_dimer_loses_its_mean_beside_any_number_of_modes(size):
    problem = tmsopt.Problem(
        chain(size, DIMER), free={"d": (-1, 1), "g": (0.0, 1.0), "k": (0.0, 0.3)}, minimize="abscissa"
    )
    found = tmsopt.solve(problem)
    assert found.status == "optimal"
    assert found.parameters["g"] == pytest.approx(0.8, abs=1e-7)  # the EP2 at the greatest coupling 0.3
    assert found.abscissa == pytest.approx(-0.5, abs=EXACT)
    assert found.structure == "EP2"
    assert "k.max" in found.active
    if size == 2:  # no mean of the losses is greater than that at g = 1
        assert found.bound.value == pytest.approx(-0.6, abs=1e-15)


@pytest.mark.slow
def test_an_ep2_beside_a_single_mode_has_the_digits_of_40():
    """Three parameters put an EP2 and a third eigenvalue on one line; Newton's method at 40 digits finds it too."""
    rng = np.random.default_rng([11, 6, 3])
    H = [np.round(rng.normal(size=(6, 6)) + 1j * rng.normal(size=(6, 6)), 2) for _ in range(4)]
    rows = [
        ["".join(f" + ({M[i, j]})*{n}" for M, n in zip(H, ("1", "x", "y", "z"), strict=True)) for j in range(6)]
        for i in range(6)
    ]
    found = tmsopt.solve(
        tmsopt.Problem(from_hamiltonian(rows), free=dict.fromkeys("xyz", (-1, 1)), minimize="abscissa"), stability=0
    )
    assert (found.status, found.structure) == ("optimal", "EP2+single")
    with mpmath.workdps(40):
        matrices = [mpmath.matrix([[mpmath.mpc(str(z.real), str(z.imag)) for z in row] for row in M]) for M in H]

        def equations(x, y, z, re, double, single):
            A = -1j * (matrices[0] + x * matrices[1] + y * matrices[2] + z * matrices[3])
            step = mpmath.mpf(10) ** -18

            def p(s):
                return mpmath.det(A - s * mpmath.eye(6))

            s = mpmath.mpc(re, double)
            values = p(s), (p(s + step) - p(s - step)) / (2 * step), p(mpmath.mpc(re, single))
            return [part for v in values for part in (v.real, v.imag)]

        pair = next(r for r in found.roots if r.multiplicity == 2)
        other = next(r for r in found.roots if r.multiplicity == 1)
        start = [*(found.parameters[n] for n in "xyz"), pair.re, pair.im, other.im]
        least = float(mpmath.findroot(equations, start, tol=1e-25, verify=False)[3])
    assert found.abscissa == pytest.approx(least, abs=1e-13)


@pytest.mark.slow
def test_a_limit_on_the_decay_of_seven_oscillators():
    """x″ + c x′ + k x, and others with more stiffness: the decay rate is c/2 up to c = 2 √k, so a rate a needs k ≥ a²."""
    n = 7
    block = [[0] * n + [int(i == j) for j in range(n)] for i in range(n)]
    stiff = [[f"-k*{1 + i / n}" if i == j else 0 for j in range(n)] for i in range(n)]
    lower = [[*row, *("-c" if i == j else 0 for j in range(n))] for i, row in enumerate(stiff)]
    model = from_matrices(A=block + lower)
    problem = tmsopt.Problem(
        model, free={"k": (0.1, 4.0), "c": (0.0, 3.0)}, minimize="c + k", constraints={"decay": "abscissa <= -0.5"}
    )
    found = tmsopt.solve(problem)
    assert found.status == "optimal"
    assert dict(found.parameters) == pytest.approx({"k": 0.25, "c": 1.0}, abs=1e-6)
    assert found.abscissa_realised <= -0.5 + 1e-9


def test_the_worst_of_two_scenarios():
    """With losses g and 1.4 − g of two modes that are not coupled, the least loss is greatest at g = 0.7."""
    model = from_hamiltonian([["-1j*(g + e)", 0], [0, "2 - 1j*(1.4 - g + e)"]])
    problem = tmsopt.Problem(model, free={"g": (0.0, 1.4)}, scenarios={"e": [0.0, 0.1]}, minimize="abscissa")
    found = tmsopt.solve(problem)
    assert found.parameters["g"] == pytest.approx(0.7, abs=1e-8)
    assert found.abscissa == pytest.approx(-0.7, abs=1e-8)
    assert found.worst is not None
    assert found.worst.at["e"] == 0.0


@pytest.mark.slow
def test_a_limit_that_no_loss_reaches_is_infeasible():
    problem = tmsopt.Problem(
        chain(3, DIMER),
        free={"g": (0.0, 1.0), "k": (0.0, 0.3)},
        fixed={"d": 0.0},
        minimize="k",
        constraints={"loss": "abscissa <= -2"},
    )
    found = tmsopt.solve(problem, throw=False)
    assert found.status == "infeasible"
    assert found.violations


def test_an_exceptional_point_within_a_limit_on_the_loss():
    """EP2 at k = |g − 0.2|/2 with the loss (g + 0.2)/2 ≥ 0.4: the least coupling is 0.2."""
    problem = tmsopt.Problem(
        chain(2, DIMER),
        free={"d": (-1, 1), "g": (0.3, 1.0), "k": (0.01, 1.0)},
        locate="EP2",
        minimize="k",
        constraints={"loss": "abscissa <= -0.4"},
    )
    found = tmsopt.solve(problem)
    assert dict(found.parameters) == pytest.approx({"d": 0.0, "g": 0.6, "k": 0.2}, abs=1e-7)


def test_a_damping_ratio_needs_the_polynomial():
    model = from_matrices(A=[["-a" if i == j else 0 for j in range(13)] for i in range(13)])
    with pytest.raises(tmsopt.InputError, match="characteristic polynomial"):
        tmsopt.solve(tmsopt.Problem(model, free={"a": (0.1, 1)}, maximize="damping_ratio"))


def test_complex_masses_in_any_unit_of_time():
    """Modes s² + (c + i e) s + (9 + 6 i e) w²: at e = 0 the decay is fastest for c = 6 w, where s = −3 w twice."""
    w = 1e4
    D, K = [["c + 1j*e", 0], [0, f"{8 * w}"]], [[f"{9 * w * w} + 1j*e*{3 * w}", 0], [0, f"{16 * w * w}"]]
    model = from_matrices(M=[[1, 0], [0, 1]], D=D, K=K)
    found = tmsopt.solve(tmsopt.Problem(model, fixed={"e": 0.0}, free={"c": (w, 12 * w)}, minimize="abscissa"))
    assert found.parameters["c"] == pytest.approx(6 * w, rel=1e-7)
    assert found.abscissa == pytest.approx(-3 * w, rel=1e-12)


@pytest.mark.slow
def test_the_lowest_ep2_below_which_other_modes_cross():
    """EP2 at x = ±1/2, y = 0 with loss z; the loss of the best other mode is 2 − z, so z = 1 is best."""
    n = 14
    rows = [[f"{i} - 1j*(2 + 0.1*{i - 2} - z)" if i == j else 0 for j in range(n)] for i in range(n)]
    rows[0][:2], rows[1][:2] = ["x + 1j*y - 1j*z", 1], [-0.25, "-x - 1j*y - 1j*z"]
    free = {"x": (-1, 1), "y": (-1, 1), "z": (0, 3)}
    found = tmsopt.solve(tmsopt.Problem(from_hamiltonian(rows), free=free, locate="EP2", minimize="abscissa"))
    assert (found.status, found.parameters["z"]) == ("optimal", pytest.approx(1, abs=1e-7))
    assert found.abscissa == pytest.approx(-1, abs=1e-7)


def test_the_least_loss_at_a_corner():
    """A mode that loses nothing, coupled to a lossy one: the abscissa is greatest with the least coupling."""
    dimer = from_hamiltonian([["w - 1j*g", "k"], ["k", "-0.3j"]])
    free = {"w": (-1, 1), "g": (0, 0.2), "k": (0.1, 1)}
    found = tmsopt.solve(tmsopt.Problem(dimer, free=free, maximize="abscissa"))
    assert found.status == "optimal"
    assert {n: abs(x) for n, x in found.parameters.items()} == pytest.approx({"w": 1, "g": 0, "k": 0.1}, abs=1e-8)
    s = np.linalg.eigvals([[-1j, -0.1j], [-0.1j, -0.3]])
    assert found.abscissa == pytest.approx(s.real.max(), abs=EXACT)


def test_an_exceptional_point_that_no_limit_admits_names_the_limit():
    problem = tmsopt.Problem(
        chain(2, DIMER),
        free={"d": (-1, 1), "g": (0.3, 1.0)},
        fixed={"k": 0.2},
        locate="EP2",
        constraints={"loss": "abscissa <= -0.6"},
    )
    found = tmsopt.solve(problem, throw=False)
    assert found.status == "not_converged"
    assert "violate loss" in " ".join(found.notes)


@pytest.mark.parametrize("entry", ["log(w - 2)", "sqrt(w)"])
def test_entries_that_are_undefined_in_the_box(entry):
    """log(w − 2) nowhere has a value; sqrt(w) has one for w ≥ 0, where g and 0.1 have the mean loss 1.05."""
    rows = [[f"{entry} - 1j*g", "k"], ["k", "-0.1j"]]
    free = {"w": (-1, 1), "g": (0, 2), "k": (0.1, 1)}
    found = tmsopt.solve(tmsopt.Problem(from_hamiltonian(rows), free=free, minimize="abscissa"), throw=False)
    assert str(found)
    if entry == "sqrt(w)":
        assert found.abscissa == pytest.approx(-1.05, abs=1e-8)  # the slope of sqrt(w) is infinite at w = 0
    else:
        assert found.status != "optimal"


def test_a_mode_outside_the_subspace_that_crosses_the_line(monkeypatch):
    """Losses z, 2 and 4 − 3z: from z = 0, where the third mode is far, the subspace must take it in to end at z = 1."""
    search = import_module("tmsopt.search.subspace_search")
    monkeypatch.setattr(search, "_descend", lambda state, space, design: design)
    modes = from_hamiltonian([["-1j*z", 0, 0], [0, "1 - 2j", 0], [0, 0, "2 - 1j*(4 - 3*z)"]])
    (state,) = import_module("tmsopt.search.state").begin_search(
        tmsopt.Problem(modes, free={"z": (0, 1.3)}, minimize="abscissa").posed
    )
    end = search.solve_by_subspaces(state, tmsopt.Start({"z": 0.0}))
    assert end.feasible
    assert state.design_at(end)["z"] == pytest.approx(1, abs=1e-6)
    assert end.objective == pytest.approx(-1, abs=1e-6)


def test_the_slopes_of_the_descent_are_those_of_differences():
    rng = np.random.default_rng(5)
    A = [[f"{a:.3f} + {b:.3f}*x + {c:.3f}*y + e" for a, b, c in rng.normal(size=(4, 3))] for _ in range(4)]
    problem = tmsopt.Problem(
        from_matrices(A=A),
        free={"x": (-1, 1), "y": (0.1, 2)},
        scenarios={"e": [0.0, 0.3]},
        minimize="abscissa**2 + x*y",
        constraints={"c": "abscissa + x <= -5"},
    )
    space = import_module("tmsopt.program.unit_box").UnitBox(problem.posed)
    descent = import_module("tmsopt.search.descent").Descent(space, 2.0, np.array([3.0]))
    y, step = np.array([0.3, -0.4]), 1e-6
    heights = [[descent._value(y + sign * step * e).height for sign in (1, -1)] for e in np.eye(2)]
    assert descent._value(y).slope == pytest.approx([(a - b) / (2 * step) for a, b in heights], rel=1e-6)


def test_stored_doubles_keep_a_limit_that_an_ep2_reaches():
    """The least coupling with the loss 1.3/3 is that of the EP2 k = (g − 0.2)/2 with (g + 0.2)/2 = 1.3/3."""
    loss = 1.3 / 3
    problem = tmsopt.Problem(
        chain(2, DIMER),
        free={"d": (-1, 1), "g": (0.3, 1.0), "k": (0.0, 1.0)},
        minimize="k",
        constraints={"loss": f"abscissa <= -{loss!r}"},
    )
    found = tmsopt.solve(problem)
    assert found.parameters["k"] == pytest.approx(loss - 0.2, abs=1e-6)
    d, g, k = (found.parameters[n] for n in "dgk")
    with mpmath.workdps(50):
        s, _ = mpmath.eig(-1j * mpmath.matrix([[mpmath.mpc(d, -g), k], [k, mpmath.mpc(0, -0.2)]]))
        assert max(float(z.real) for z in s) <= -loss + 1e-9
    assert not found.missed
