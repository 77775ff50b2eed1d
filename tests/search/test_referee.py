"""The sample as referee: no claim stands that a design contradicts which was looked at; optima that no design has."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

import tmsopt
from tmsopt.models import from_coefficients
from tmsopt.roots import product

x, y = ca.SX.sym("x"), ca.SX.sym("y")
MET = 1e-8  # what is asked of every value


def problem(coefficients, free=None, limits=(), **asked):
    constraints = {f"limit{k}": text for k, text in enumerate(limits)}
    asked = asked or {"minimize": "abscissa"}
    return tmsopt.Problem(
        from_coefficients(list(coefficients)), free=free or {"x": (0.0, 1.0)}, constraints=constraints, **asked
    )


def own_roots(design, coefficients):
    """By NumPy, of the design's parameters."""
    at = {"x": design.parameters["x"], "y": design.parameters.get("y", 0.0)}
    f = ca.Function("a", [x, y], [ca.vertcat(*map(ca.SX, coefficients))])
    return np.roots(np.array(f(at["x"], at["y"])).ravel())


# Claims that the sample contradicts: s + 1 − x⁴/4 + x²/2 − x/10, wells near −1.05 and 0.95, the left one deeper

WELLS = [1, 1 - (x**4 / 4 - x**2 / 2 + x / 10)]
WIDE = {"x": (-2.0, 2.0)}
LEFT, HUMP, RIGHT = sorted(np.roots([1, 0, -1, 0.1]).real.tolist())


def depth(at):
    return at**4 / 4 - at**2 / 2 + at / 10 - 1


def stuck(at, feasible=True):
    """A policy that ends where one start ends, whatever the start is."""

    def local(state, start):
        found = tmsopt.POLICY.local(state, replace(start, design={"x": at}))
        return found if feasible else replace(found, feasible=False)

    return replace(tmsopt.POLICY, local=local)


def started(at):
    """A policy that starts at one design, again and again."""
    return replace(tmsopt.POLICY, starts=lambda state: iter([tmsopt.Start({"x": at})] * 64))


@pytest.mark.parametrize("objective", ["abscissa", "x**4/4 - x**2/2 + x/10 - 1"])
def test_a_search_in_the_wrong_basin_is_taken_up_again(objective):
    design = tmsopt.solve(problem(WELLS, WIDE, minimize=objective), policy=started(0.9))
    assert design.value == pytest.approx(depth(LEFT), abs=MET)
    assert design.status == "optimal"


def test_the_neighbourhood_of_an_end_is_looked_at_too():
    """Where neither the sample nor the starts know of the other basin."""

    def half(state):
        whole = tmsopt.POLICY.sample(state)
        kept = (seen.take(np.flatnonzero(seen.u[:, 0] > 0.6)) for seen in (whole.refined, whole.boldest))
        return replace(whole, **dict(zip(("refined", "boldest"), kept, strict=True)))

    design = tmsopt.solve(problem(WELLS, WIDE), policy=replace(started(0.9), sample=half))
    assert design.value == pytest.approx(depth(LEFT), abs=MET)
    assert design.status == "optimal"


def test_an_end_that_a_design_contradicts_is_no_optimum():
    """If no start leaves the basin on the right, what was looked at on the left is said, and that it is no optimum."""
    design = tmsopt.solve(problem(WELLS, WIDE), throw=False, policy=stuck(0.9))
    assert design.status == "not_converged"
    assert not design.violations
    assert any("the best design that was looked at" in note for note in design.notes)
    assert depth(LEFT) - 1e-12 <= design.value < depth(RIGHT) - 0.1
    assert design.value == pytest.approx(depth(LEFT), abs=1e-6)


def test_the_right_basin_is_left_alone():
    design = tmsopt.solve(problem(WELLS, WIDE), throw=False, policy=stuck(-1.2))
    assert (design.status, design.notes) == ("optimal", ())
    assert design.value == pytest.approx(depth(LEFT), abs=MET)


@pytest.mark.parametrize("limits", [(), ("x <= -0.5", "abscissa <= -1.3")])
def test_a_design_that_meets_all_limits_forbids_infeasible(limits):
    design = tmsopt.solve(problem(WELLS, WIDE, limits), throw=False, policy=stuck(0.9, feasible=False))
    assert design.status == "not_converged"
    assert not design.violations
    assert design.value == pytest.approx(depth(LEFT), abs=1e-6)
    assert design.starts.converged == 0


# A singular mass matrix: the best is where one root is at infinity, and the design is none


def slow(*fast):
    """(x s + 1)(s + 2 − x) …: the abscissa is x − 2 for small x, −2 at best where x = 0, and −1/x is far off."""
    return product([x, 1], [1, 2 - x], *fast)


def swaying(*fast):
    """(x s + 1)(s² + 2 z s + 1) …, z = 0.5 − 0.3 x: the damping ratio."""
    return product([x, 1], [1, 1 - 0.6 * x, 1], *fast)


OPEN = [
    (slow(), {"minimize": "abscissa"}, -2.0),
    (slow([1, 6, 10]), {"minimize": "abscissa"}, -2.0),  # a pair at −3 ± i beside
    (slow([1, 6]), {"minimize": "abscissa"}, -2.0),
    (slow([1, 6], [1, 6, 10]), {"minimize": "abscissa"}, -2.0),
    (swaying(), {"maximize": "damping_ratio"}, 0.5),
    (swaying([1, 3]), {"maximize": "damping_ratio"}, 0.5),
    (swaying([1, 4, 5]), {"maximize": "damping_ratio"}, 0.5),  # 4/√20 is more
]


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("coefficients", "asked", "best"), OPEN)
@pytest.mark.slow
def test_there_is_no_best_design_where_a_root_goes_to_infinity(coefficients, asked, best, sign):
    design = tmsopt.solve(problem([sign * c for c in coefficients], **asked), throw=False)
    assert design.status == "not_converged"
    assert any(note.startswith("no best design: it improves towards a singular mass matrix") for note in design.notes)
    assert any(f"to {best:g};" in note for note in design.notes)
    assert design.value == pytest.approx(best, abs=MET)
    assert not design.violations
    assert 0 < design.parameters["x"] <= 1e-8
    z = own_roots(design, coefficients)
    z = z[np.abs(z) < 1e3]
    own = z.real.max() if "minimize" in asked else np.min(-z.real / np.abs(z))
    assert own == pytest.approx(best, abs=1e-6)  # simple roots beside one 1e12 times as large


@pytest.mark.parametrize(("coefficients", "asked", "best"), OPEN)
def test_a_limit_makes_it_an_optimum(coefficients, asked, best):
    design = tmsopt.solve(problem(coefficients, {"x": (0.1, 1.0)}, **asked))
    assert (design.status, design.notes) == ("optimal", ())
    assert design.parameters["x"] == pytest.approx(0.1, abs=MET)
    assert design.value == pytest.approx(-1.9 if best < 0 else 0.47, abs=MET)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("coefficients", "free"),
    [
        ([x, 1], {"x": (-1.0, 1.0)}),
        ([x, 1], {"x": (0.0, 1.0)}),
        (product([x, 1], [x, 2]), {"x": (0.0, 1.0)}),
        ([x, 1 + y], {"x": (-1.0, 1.0), "y": (0.0, 1.0)}),
    ],
    ids=["both signs", "one sign", "two roots", "two parameters"],
)
def test_an_abscissa_without_a_lower_bound_is_said_to_have_none(coefficients, free):
    """It is −1/x, or −(1 + y)/x: below anything as x goes to 0 from above."""
    design = tmsopt.solve(problem(coefficients, free), throw=False)
    assert design.status == "not_converged"
    assert any("unbounded" in note for note in design.notes)
    assert design.value < -1e6
    assert not design.violations
    numerator = 1 + design.parameters.get("y", 0.0)
    assert design.value == pytest.approx(-numerator / design.parameters["x"], rel=1e-9)


def test_a_bound_far_away_is_still_one():
    """The same from x = 1e-4 on: −1e4 is the optimum."""
    design = tmsopt.solve(problem([x, 1], {"x": (1e-4, 1.0)}))
    assert design.status == "optimal"
    assert design.value == pytest.approx(-1e4, rel=1e-9)


# Ends at which a root has no sign, and values that cannot be beaten


@pytest.mark.parametrize("lower", [0.0, -1.0])
@pytest.mark.parametrize("sign", [1, -1])
def test_an_end_at_a_root_at_0_is_moved_by_a_hair(lower, sign):
    """(s + x)(s² + 0.6 s + 1) has the damping ratio 0.3 for x > 0, 0 at x = 0 and −1 below: no least x, but a limit.

    What is not told to be the limit is no optimum.
    """
    a = [sign * c for c in product([1, x], [1, 0.6, 1])]
    design = tmsopt.solve(problem(a, {"x": (lower, 1.0)}, ("damping_ratio >= 0.1",), minimize="x"), throw=False)
    assert 0 < design.value <= (1e-7 if design.status == "optimal" else 1e-3)
    assert not design.violations


@pytest.mark.parametrize(
    ("coefficients", "free"),
    [
        ([1, 2 * x, 1], {"x": (0.1, 3.0)}),
        (product([1, 2 * x, 1], [1, 3 * y, 2]), {"x": (0.1, 3.0), "y": (0.1, 3.0)}),
        (product([1, 2 * x, 1], [1, y]), {"x": (0.1, 3.0), "y": (-1.0, 1.0)}),
    ],
)
def test_a_damping_ratio_of_1_is_not_beaten(coefficients, free):
    """Where all roots are real and negative; exactly 1."""
    design = tmsopt.solve(problem(coefficients, free, maximize="damping_ratio"))
    assert (design.status, design.value) == ("optimal", 1.0)
    z = own_roots(design, coefficients)
    assert np.all(z.imag == 0)
    assert np.all(z.real < 0)


def test_a_damping_ratio_of_1_in_all_cases_and_one_that_is_not_reached():
    """s² + 2 x s + k: 1 from x = √k on, √k being 2 at most; and x/2 = 0.75 where x ends at 1.5."""
    for most, best in ((3.0, 1.0), (1.5, 0.75)):
        stated = problem([1, 2 * x, y], {"x": (0.1, most)}, scenarios={"y": [1.0, 4.0]}, maximize="damping_ratio")
        design = tmsopt.solve(stated)
        assert design.status == "optimal"
        assert design.value == pytest.approx(best, abs=MET)


# Progress


def test_long_work_tells_how_far_it_is(monkeypatch):
    """Starts of a search, and those of a relaxation."""
    monkeypatch.setattr("tmsopt.progress.PAUSE", 0.0)
    told = []
    tmsopt.solve(problem(WELLS, WIDE), progress=told.append)
    assert {0, 1} <= {t.done for t in told if t.what == "searching"}
    told.clear()
    beyond = problem([1, x, 1], WIDE, ("x >= 10",))
    assert tmsopt.solve(beyond, throw=False, progress=told.append).status == "infeasible"
    assert any(1 <= t.done <= t.most for t in told if "change of limits" in t.what)


@pytest.mark.parametrize("coefficients", [[1, "c", 0], ["m", "c", 0]])
def test_a_root_that_is_0_in_every_design_is_no_reason_to_see_another_run_away(coefficients):
    """m s² + c s: roots 0 and −c/m, so that every design of positive c is as good as any."""
    free = {"c": (0.1, 3)} | ({"m": (0.5, 2)} if "m" in coefficients else {})
    design = tmsopt.solve(problem(coefficients, free))
    assert (design.status, design.value, design.without_best) == ("optimal", 0, False)
