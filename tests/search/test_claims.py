"""No claim stands that a design contradicts: optima that others beat, that no design has, that rounding makes."""

from dataclasses import replace
from importlib import import_module
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from helpers.wells import LEFT, RIGHT, begun, depth, wells

import tmsopt
from tmsopt.models import from_coefficients
from tmsopt.roots import Root, product

x, y = ca.SX.sym("x"), ca.SX.sym("y")
MET = 1e-8  # what is asked of every value
POLICY = tmsopt.POLICY


def problem(coefficients, free=None, limits=(), **asked):
    constraints = {f"limit{k}": text for k, text in enumerate(limits)}
    free, asked = free or {"x": (0.0, 1.0)}, asked or {"minimize": "abscissa"}
    return tmsopt.Problem(from_coefficients(list(coefficients)), free=free, constraints=constraints, **asked)


def own_roots(design, coefficients):
    """By NumPy, of the design's parameters."""
    f = ca.Function("a", [x, y], [ca.vertcat(*map(ca.SX, coefficients))])
    return np.roots(np.array(f(design.parameters["x"], design.parameters.get("y", 0.0))).ravel())


# Claims that the sample contradicts


def stuck(at, feasible=True):
    """A policy that ends where one start ends, whatever the start is."""

    def local(state, start):
        found = POLICY.local(state, replace(start, design={"x": at}))
        return found if feasible else replace(found, feasible=False)

    return replace(POLICY, local=local)


def started(at, **stages):
    """A policy that starts at one design, again and again."""
    return replace(POLICY, starts=lambda state: iter([tmsopt.Start({"x": at})] * 64), **stages)


def half(state):
    """A sample that knows of the right half alone."""
    whole = POLICY.sample(state)
    kept = {name: getattr(whole, name) for name in ("refined", "boldest")}
    return replace(whole, **{n: seen.take(np.flatnonzero(seen.u[:, 0] > 0.6)) for n, seen in kept.items()})


@pytest.mark.parametrize(
    ("policy", "asked"),
    [
        (started(0.9), {}),  # a search in the wrong basin is taken up again
        (started(0.9), {"minimize": "abscissa"}),
        (started(0.9, sample=half), {"minimize": "abscissa"}),  # the neighbourhood of an end is looked at too
        (stuck(-1.2), {}),  # the right basin is left alone
    ],
)
def test_the_deeper_well_is_found(policy, asked):
    design = tmsopt.solve(wells(**asked), policy=policy)
    assert (design.status, design.notes) == ("optimal", ())
    assert design.value == pytest.approx(depth(LEFT), abs=MET)


@pytest.mark.parametrize(
    ("feasible", "limits"), [(True, {}), (False, {}), (False, {"c": "x <= -0.5", "d": "abscissa <= -1.3"})]
)
def test_an_end_that_a_design_contradicts_is_no_optimum(feasible, limits):
    """If no start leaves the basin on the right, what was looked at on the left is said, and that it is no optimum."""
    asked = wells(constraints=limits, minimize="abscissa")
    design = tmsopt.solve(asked, throw=False, policy=stuck(0.9, feasible))
    assert design.status == "not_converged"
    assert not design.violations
    assert design.value >= depth(LEFT) - 1e-12
    assert design.value == pytest.approx(depth(LEFT), abs=1e-6)
    assert feasible or design.starts.converged == 0
    assert any("the best design that was looked at" in note for note in design.notes)


@pytest.mark.parametrize(
    ("found", "between", "status", "value"),
    [
        (RIGHT, -2.0, "not_converged", depth(LEFT)),
        (LEFT, -2.0, "optimal", depth(LEFT)),
        (RIGHT, 2.0, "optimal", depth(RIGHT)),
    ],
)
def test_no_optimum_stands_that_an_end_beats(found, between, status, value):
    """On the left designs change between the three values of a band that are looked at first, for better or worse."""
    worse = between * ca.sin(2 * np.pi * y) ** 2 * (x - RIGHT) ** 2
    band = {"y": tmsopt.Band(0.0, 1.0, 3)}
    model = from_coefficients([1, -depth(x) - worse])
    state = begun(sampled=True, model=model, scenarios=band, minimize="abscissa")
    ends = {at: POLICY.local(state, tmsopt.Start({"x": at})) for at in (LEFT, RIGHT)}
    one = POLICY.accept(replace(state, ends=(ends[found],)))
    searching = import_module("tmsopt.search.search")
    own = searching.add_worst_cases(one, POLICY, tmsopt.Starts())
    assert own.status == "optimal"
    left = searching.demote_if_beaten(replace(one, ends=tuple(ends.values())), own)
    assert left.status == status
    assert left.checked.objective == pytest.approx(value, abs=MET)


# A singular mass matrix: the best is where one root is at infinity, and the design is none


def slow(*fast):
    """(x s + 1)(s + 2 − x) …: the abscissa is x − 2 for small x, −2 at best where x = 0, and −1/x is far off."""
    return product([x, 1], [1, 2 - x], *fast), {"minimize": "abscissa"}, -2.0


def swaying(*fast):
    """(x s + 1)(s² + 2 z s + 1) …, z = 0.5 − 0.3 x: the damping ratio."""
    return product([x, 1], [1, 1 - 0.6 * x, 1], *fast), {"maximize": "damping_ratio"}, 0.5


OPEN = [
    slow(),
    slow([1, 6, 10]),  # a pair at −3 ± i beside
    slow([1, 6]),
    slow([1, 6], [1, 6, 10]),
    swaying(),
    swaying([1, 3]),
    swaying([1, 4, 5]),  # 4/√20 is more
]


@pytest.mark.parametrize(
    ("number", "sign"), [(0, 1), *(pytest.param(k, (-1) ** k, marks=pytest.mark.slow) for k in range(1, len(OPEN)))]
)
def test_there_is_no_best_design_where_a_root_goes_to_infinity(number, sign):
    coefficients, asked, best = OPEN[number]
    design = tmsopt.solve(problem([sign * c for c in coefficients], **asked), throw=False)
    assert design.status == "not_converged"
    assert "no best design exists" in str(design)
    assert any(
        note.startswith("no best design: the objective improves towards a singular mass matrix")
        for note in design.notes
    )
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
        (product([x, 1], [x, 2]), {"x": (0.0, 1.0)}),
        ([x, 1 + y], {"x": (-1.0, 1.0), "y": (0.0, 1.0)}),
    ],
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
        ([1, 2 * x, 1], {}),
        (product([1, 2 * x, 1], [1, 3 * y, 2]), {"y": (0.1, 3.0)}),
        (product([1, 2 * x, 1], [1, y]), {"y": (-1.0, 1.0)}),
    ],
)
def test_a_damping_ratio_of_1_is_not_beaten(coefficients, free):
    """Where all roots are real and negative; exactly 1."""
    design = tmsopt.solve(problem(coefficients, {"x": (0.1, 3.0), **free}, maximize="damping_ratio"))
    assert (design.status, design.value) == ("optimal", 1.0)
    z = own_roots(design, coefficients)
    assert np.all(z.imag == 0)
    assert np.all(z.real < 0)


@pytest.mark.parametrize(("most", "best"), [(3.0, 1.0), (1.5, 0.75)])
def test_a_damping_ratio_of_1_in_all_cases_and_one_that_is_not_reached(most, best):
    """s² + 2 x s + k: 1 from x = √k on, √k being 2 at most; and x/2 = 0.75 where x ends at 1.5."""
    stated = problem([1, 2 * x, y], {"x": (0.1, most)}, scenarios={"y": [1.0, 4.0]}, maximize="damping_ratio")
    design = tmsopt.solve(stated)
    assert design.status == "optimal"
    assert design.value == pytest.approx(best, abs=MET)


@pytest.mark.parametrize("coefficients", [[1, "c", 0], ["m", "c", 0]])
def test_a_root_that_is_0_in_every_design_is_no_reason_to_see_another_run_away(coefficients):
    """m s² + c s: roots 0 and −c/m, so that every design of positive c is as good as any."""
    free = {"c": (0.1, 3)} | ({"m": (0.5, 2)} if "m" in coefficients else {})
    design = tmsopt.solve(problem(coefficients, free))
    assert (design.status, design.value, design.without_best) == ("optimal", 0, False)


# What rounding makes of multiple roots and of values

PLAIN = problem([1, 3 + x, 2])


@pytest.mark.parametrize(
    ("roots", "stored", "said", "asked"),
    [
        ([(-1.0, 4)], -1 + 4e-4, False, {}),  # what doubles leave of a 4-fold root
        ([(-1.0, 4)], -1 + 4e-2, True, {}),
        ([(-1.0, 2), (-9.0, 1)], -1 + 1e-7, False, {}),
        ([(-1.0, 2), (-9.0, 1)], -1 + 1e-2, True, {}),
        ([(-1e-16, 3), (-1.0, 1)], 5e-6, True, {}),  # a triple root at 0 that is one of rounding alone
        ([(0.0, 2), (-1.0, 1)], 0.0, False, {}),  # one that is there
        ([(-1e-17, 1), (-1.0, 1)], 1e-17, False, {}),  # a simple one at 0 but for rounding
        ([(-1e-16, 2), (-1.0, 1)], -1e-16, False, {}),
        # Roots at 0 but for rounding have no damping ratio.
        ([(-1e-16, 2), (-1.0, 1)], -1e-16, True, {"minimize": None, "maximize": "damping_ratio"}),
    ],
)
def test_roots_as_stored_lie_where_the_multiple_ones_allow(roots, stored, said, asked):
    """An m-fold root is off by the m-th root of what its coefficients are: 1e-8 at most."""
    listed = [Root(re, 0.0, m) for re, m in roots]
    structure = SimpleNamespace(roots=listed, abscissa=max(re for re, _ in roots))
    checked = SimpleNamespace(structure=structure, abscissa_realised=stored)
    unclear = import_module("tmsopt.search.outcome").is_unclear(replace(PLAIN, **asked).posed, checked)
    assert bool(unclear) is said


@pytest.mark.parametrize(("off", "status"), [(1e-9, "optimal"), (1e-4, "not_converged")])
def test_a_value_that_hangs_on_rounding_is_no_optimum(monkeypatch, off, status):
    module = import_module("tmsopt.search.solve")
    plain = module.certified_numbers

    def exact(*given):
        numbers = plain(*given)
        return replace(numbers, value=numbers.value + off)

    monkeypatch.setattr(module, "certified_numbers", exact)
    assert tmsopt.solve(PLAIN, throw=False).status == status


def test_every_optimum_is_asked(monkeypatch):
    assert tmsopt.solve(PLAIN, throw=False).status == "optimal"
    monkeypatch.setattr("tmsopt.search.outcome.is_unclear", lambda problem, checked: True)
    assert tmsopt.solve(PLAIN, throw=False).status == "not_converged"
