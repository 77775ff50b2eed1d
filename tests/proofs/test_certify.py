"""How good a design is at best: bounds by branch and bound against laws, grids, samples; and wrong ones refused."""

import json
import math
import os
import re
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial
from importlib import import_module
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from helpers import hunt, timid
from scipy.optimize import brentq  # type: ignore[import-untyped]

from benchmarks.suites import REFERENCES, random_problem, references
from tmsopt import InputError, Problem, certify, load, models, solve
from tmsopt.cli import command_group as main
from tmsopt.global_search import SCIP, GlobalSolver, SolverPool
from tmsopt.problem import Band, Bound

answering = import_module("tmsopt.global_search.answer")
bounding = import_module("tmsopt.evaluation.bound")
certifying = import_module("tmsopt.proofs.certify")
interlaces = import_module("tmsopt.global_search.interlacing")
started = import_module("tmsopt.killable")
lines = import_module("tmsopt.global_search.half_planes")

pytestmark = pytest.mark.skipif(not SCIP.is_available, reason="SCIP is not installed")

HEIGHTS = {"mu": 0.1, "chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2}
OMEGA0 = -((0.4 * 0.2) ** -0.25)  # where chi_H = 1
TILTED = {**HEIGHTS, "lambda_s": 0.2}
PLANE = {"Fr": (0.5, 3.0), "chi_B": (1.01, 3.0)}
KEPT = references(Path(__file__).parents[2] / REFERENCES)
CLOSED = 1e-4  # a gap that counts as closed, relative to the objective
SECONDS = 8.0  # five times what any of these needs
prove_bound = partial(certify, seconds=SECONDS)


def problem(free=PLANE, **asked):
    """A bicycle with the heights of the paper, tilted unless the tilt is free."""
    return Problem(models.tms, {n: v for n, v in TILTED.items() if n not in free}, free, **asked)


def growth(**design):
    """Abscissae of arrays of designs, by eigenvalues."""
    return hunt.abscissa({**TILTED, **design})


@pytest.fixture(scope="module")
def slow_plane():
    """The least abscissa of the plane, which is an EP3 at a tilt less than that of the EP4: ω0 does not close the gap."""
    return solve(problem(minimize="abscissa"), starts=8)


@pytest.fixture(scope="module")
def bounded_plane(slow_plane):
    return prove_bound(slow_plane)


@pytest.fixture(scope="module")
def slowest():
    """The slowest design of the plane with a decay of 0.2, at which weave and capsize meet that line."""
    return solve(problem(constraints={"s": "abscissa <= -0.2"}, minimize="Fr"), starts=8)


def unsolved(asked, of):
    """What a search that found nothing at all would leave; the design is another problem's."""
    return replace(of, problem=asked, status="not_converged", value=math.nan, bound=Bound())


def optimum(asked, starts=8):
    """The solution of a problem with its bound."""
    return prove_closed(solve(asked, starts=starts))


def check_infeasible(design):
    """Check that a bound proves that no design is feasible."""
    assert design.status == "infeasible"
    assert design.bound.proven
    assert abs(design.bound.value) == math.inf


def prove_closed(design):
    """The design with a bound as it should be: proved by SCIP, on the right side, and not further than it says."""
    design = prove_bound(design)
    check_closed(design)
    return design


def check_closed(design):
    bound = design.bound
    gap = design.problem.posed.sign * (design.value - bound.value)
    assert bound.proven
    assert bound.method == "scip"
    assert 0 <= gap <= CLOSED * max(abs(design.value), 0.1)
    assert bound.gap == pytest.approx(gap, rel=1e-9, abs=1e-15)
    assert bound.nodes >= 0
    assert 0 < bound.seconds < 2 * SECONDS
    assert bound.tolerance == 1e-9


# Global optima


def test_the_least_abscissa_of_a_plane(slow_plane, bounded_plane):
    """At a grid, of which some design comes close: near an EP3 a distance of 0.02 is felt as its cube root, 0.3."""
    assert slow_plane.bound.method == "omega0"
    assert not slow_plane.bound.proven
    check_closed(bounded_plane)
    Fr, chi_B = np.meshgrid(*(np.linspace(*ends, 120) for ends in PLANE.values()))
    least = growth(Fr=Fr, chi_B=chi_B).min()
    assert OMEGA0 < bounded_plane.bound.value <= least <= bounded_plane.value + 0.3
    assert replace(bounded_plane, bound=slow_plane.bound) == slow_plane


def test_the_same_in_si(slow_plane):
    """Froude number v/√(g w), and a scale of 1 m: the same question, the same dimensionless bound."""
    root = math.sqrt(9.81)
    fixed = {"w": 1.0, "lambda_s": 0.2, "m_B": 10.0, "z_B": -0.4, "m_H": 1.0, "x_H": 1.0, "z_H": -0.2}
    asked = Problem(models.tms, fixed, {"v": (0.5 * root, 3 * root), "x_B": (1.01, 3.0)}, minimize="abscissa")
    design = optimum(asked)
    assert design.bound.value == pytest.approx(slow_plane.value, rel=CLOSED)


def test_a_limit_on_the_tilt():
    """Of designs in three parameters, thousands drawn at random and near the optimum; none is below the bound."""
    free = {**PLANE, "lambda_s": (0.02, 1.2)}
    design = prove_closed(solve(problem(free, constraints={"tilt": "lambda_s <= 0.3"}, minimize="abscissa")))
    assert design.bound.value > OMEGA0 + 0.1
    rng = np.random.default_rng(1)
    for spread in (1.0, 0.01, 1e-4):
        at = {n: design.parameters[n] * (1 + spread * rng.uniform(-1, 1, 4000)) for n in free}
        at = {n: np.clip(v, *free[n]) for n, v in at.items()} | {"lambda_s": np.minimum(at["lambda_s"], 0.3)}
        assert growth(**at).min() >= design.bound.value


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fixed", "free", "limits", "goal", "off"),
    [
        ({}, PLANE, {"s": "abscissa <= -0.2"}, {"minimize": "Fr"}, 0.05),  # some are nearly as slow: two steps of Fr
        (
            {"Fr": 2.5},
            {"chi_B": (1.01, 3.0), "lambda_s": (0.02, 1.2)},
            {"s": "abscissa <= -0.1"},
            {"maximize": "lambda_s"},
            0.02,
        ),
        # At a corner, which the grid has. The line must have a root on it, or any line to the right would do.
        ({"Fr": 2.5}, {"chi_B": (1.01, 3.0), "lambda_s": (0.1, 0.5)}, {}, {"maximize": "abscissa"}, 1e-9),
        ({}, PLANE, {"v": "Fr <= 1.6"}, {"maximize": "damping_ratio"}, 0.1),  # below 1, since the speed is
    ],
    ids=lambda given: " ".join(given) if isinstance(given, dict) else "",
)
def test_no_design_of_a_grid_is_beyond_the_bound_and_some_is_nearly_the_optimum(fixed, free, limits, goal, off):
    fixed = {n: v for n, v in {**TILTED, **fixed}.items() if n not in free}
    design = optimum(Problem(models.tms, fixed, free, limits, **goal))
    at = dict(zip(free, np.meshgrid(*(np.linspace(*ends, 120) for ends in free.values())), strict=True))
    quantities = {"abscissa": hunt.abscissa, "damping_ratio": hunt.damping_ratio}
    ((sense, expression),) = goal.items()
    value, violation = hunt.judge(sense, expression, limits.values(), quantities)({**fixed, **at})
    sign = design.problem.posed.sign
    assert sign * design.bound.value <= value[violation <= 0].min() <= sign * design.value + off


@pytest.mark.slow
def test_over_a_band_of_speeds():
    """No design is better at its worst speed, which is one of a grid or worse."""
    asked = problem({"chi_B": (1.01, 3.0)}, minimize="abscissa", scenarios={"Fr": Band(1.5, 2.5)})
    design = optimum(asked, starts=4)
    Fr, chi_B = np.meshgrid(np.linspace(1.5, 2.5, 60), np.linspace(1.01, 3.0, 400))
    assert design.bound.value <= growth(Fr=Fr, chi_B=chi_B).max(axis=1).min() <= design.value + 0.01


def test_a_damping_ratio_is_never_above_1():
    design = prove_bound(solve(problem(maximize="damping_ratio"), starts=8))
    assert design.bound == Bound(1.0, 0.0, True, "definition")


@pytest.mark.slow
def test_the_slowest_ep4():
    """By the law of χ_H = 1: with r = √(ζ_B/ζ_H), h = √(ζ_B ζ_H), T = (r−1)(r²+6r+1)/(16h(r+1)), Fr = … 4√h (r+1).

    Along it Fr falls with the tilt, so the slowest has the least tilt.
    """

    def law(zeta_H):
        r, h = math.sqrt(0.4 / -zeta_H), math.sqrt(0.4 * -zeta_H)
        top = r * r + 6 * r + 1
        return (r - 1) * top / (16 * h * (r + 1)), top / (4 * math.sqrt(h) * (r + 1))

    at = brentq(lambda z: law(z)[0] - math.tan(0.02), -0.399, -0.3, xtol=1e-15)
    assert law(at)[1] == min(law(z)[1] for z in np.linspace(-0.1, at, 1000))
    free = {"zeta_H": (-0.4, -0.1), "Fr": (0.5, 6.0), "chi_B": (1.01, 3.0), "lambda_s": (0.02, 1.2)}
    design = optimum(problem(free, locate="EP4", minimize="Fr"))
    assert design.bound.value <= law(at)[1] <= design.value + 1e-9


def test_the_instant_bound_is_kept_where_it_proves_more():
    """The EP4 of χ_H = 1 is at ω0, whatever SCIP would say."""
    free = {"Fr": (0.5, 6.0), "chi_B": (1.01, 3.0), "lambda_s": (0.02, 1.2)}
    design = prove_bound(problem(free, minimize="abscissa"))
    assert (design.bound.proven, design.bound.method) == (True, "omega0")
    assert design.bound.value == pytest.approx(OMEGA0, rel=1e-14)


def test_json(slow_plane, bounded_plane):
    assert set(slow_plane.to_json()["bound"]) == {"value", "gap", "proven", "method"}
    bound = json.loads(json.dumps(bounded_plane.to_json()))["bound"]
    assert set(bound) == {"value", "gap", "proven", "method", "seconds", "nodes", "feasibility_tolerance"}
    assert bound["proven"]
    assert bound["value"] + bound["gap"] == pytest.approx(slow_plane.value, rel=1e-15)
    assert bound["feasibility_tolerance"] == 1e-9


# Wrong bounds, made for the purpose


def check_unclaimed(design, names):
    """Check that nothing is claimed, and the reason told."""
    design = prove_bound(design)
    (note,) = [note for note in design.notes if note.startswith("no bound: ") and "excludes" in note]
    assert names in note
    assert not design.bound.proven
    assert not design.bound.tolerance


def test_a_bound_on_the_roots_that_is_too_small(slowest, monkeypatch):
    """A tenth, for frequencies of some 1: x1 is the square of one."""
    monkeypatch.setattr(lines, "bound_roots", lambda coefficients: 0.1)
    check_unclaimed(slowest, "x1.0")


@pytest.mark.parametrize("which", [None, 0, 1, 2, 3])
def test_a_wrong_condition(slowest, monkeypatch, which):
    """The equation c3 + x c1 = 0 for c3 − x c1 = 0, or the sign of one coefficient of p(t − 0.2)."""
    right = interlaces.interlacing_conditions

    def wrong(coefficients, squares):
        equations, nonnegative = right(coefficients, squares)
        if which is None:
            ((x, y),) = squares
            equations = [coefficients[3] * y + x * coefficients[1]]
        return equations, [-e if k == which else e for k, e in enumerate(nonnegative)]

    monkeypatch.setattr(interlaces, "interlacing_conditions", wrong)
    check_unclaimed(slowest, "abscissa")


def test_a_forged_bound_is_not_believed(slow_plane):
    forged = replace(slow_plane, bound=Bound(slow_plane.value + 0.1, 0.0, True, "omega0"))
    prove_closed(forged)


def test_a_forged_value_is_not_believed(slow_plane):
    """A design that is not as good as it says: whatever is better than that excludes the design itself."""
    check_unclaimed(replace(slow_plane, value=slow_plane.value - 0.1), "")


def test_a_forged_infeasibility_is_not_believed(slow_plane):
    design = prove_closed(replace(slow_plane, status="infeasible", value=math.nan))
    assert design.status == "optimal"
    assert design.value <= slow_plane.value + 1e-9


@pytest.mark.slow
def test_a_singular_mass_matrix_within_the_box():
    """ν_H = (χ_H − 1) cos λ_s − ζ_H sin λ_s vanishes where χ_H = 1 + ζ_H tan λ_s = 0.9595, and a root is at infinity."""
    free = {"Fr": (0.5, 3.0), "chi_H": (0.9, 1.1)}
    design = certify(
        solve(problem(free | {"chi_B": (1.3, 1.3)}, minimize="abscissa"), starts=4, throw=False), seconds=1.0
    )
    singular = 1 - 0.2 * math.tan(0.2)
    offsets = np.concatenate([s * np.geomspace(1e-9, 0.05, 60) for s in (-1, 1)])
    Fr, chi_H = np.meshgrid(np.linspace(*free["Fr"], 60), singular + offsets)
    assert design.bound.value <= growth(Fr=Fr, chi_H=chi_H, chi_B=1.3).min()


# Problems without a design, and with hardly any


@pytest.mark.parametrize("index", [4, 5, 11])
def test_infeasible_problems_are_proved_to_be(slow_plane, index):
    """That they are is kept beside the suite. 11 asks for ω0 ≥ −1.17 and ω0 ≤ −1.3; 4 for exp(−Fr) ≤ −1.12 − μ/10."""
    design = prove_bound(unsolved(random_problem(index), slow_plane))
    check_infeasible(design)
    assert design.bound.value > 0
    assert design.to_json()["bound"]["value"] is None


@pytest.mark.parametrize(
    ("limit", "asked"),
    [
        ("Fr*chi_B >= 9.001", {"maximize": "lambda_s"}),  # 3 · 3 = 9
        (f"abscissa <= {1.01 * OMEGA0}", {"minimize": "Fr"}),  # no root configuration is left of ω0
        ("damping_ratio >= 1.001", {"minimize": "Fr"}),
    ],
)
def test_what_a_law_excludes(slow_plane, limit, asked):
    free = {**PLANE, "lambda_s": (0.1, 0.5)}
    check_infeasible(prove_bound(unsolved(problem(free, constraints={"limit": limit}, **asked), slow_plane)))


@pytest.mark.slow
def test_a_corner_is_enough():
    """Of the plane only a 1e-12th, at the corner Fr = χ_B = 3, has a product of 8.99999; found there or not."""
    asked = problem(constraints={"corner": "Fr*chi_B >= 8.99999"}, minimize="abscissa")
    found = solve(asked, starts=2, throw=False)
    for design in (found, unsolved(asked, found)):
        certified = prove_closed(design)
        assert certified.status == "optimal"
        assert certified.bound.value <= growth(Fr=3.0, chi_B=3.0)


@pytest.mark.parametrize("limit", ["sqrt((Fr - 2)**2 + 0.01) <= 0.2", "1/((Fr - 1.5)**2 + 0.1) >= 9"])
def test_a_square_is_least_at_nought(slow_plane, limit):
    """At Fr = 2, and at Fr = 1.5, in the midst of the range of a difference."""
    asked = problem(constraints={"limit": limit}, minimize="abscissa")
    assert prove_bound(unsolved(asked, slow_plane)).status == "optimal"


@pytest.mark.parametrize("width", [1e-6, 1e-10])
def test_hardly_any_room(slow_plane, width):
    """A box so narrow that differences in it are roundings; it is feasible, and a bound is no better than any of it.

    In the narrowest SCIP cannot find even the known design again, and its word does not count.
    """
    at = {"Fr": 2.0, "chi_B": 1.3, "lambda_s": 0.2}
    asked = problem(
        {n: (v, v + width) for n, v in at.items()}, constraints={"c": "sin(lambda_s)*Fr <= 0.5"}, minimize="abscissa"
    )
    design = prove_bound(unsolved(asked, slow_plane))
    assert design.status == "optimal"
    if width > 1e-8:
        check_closed(design)
    assert design.bound.value <= growth(**at)


# Better designs


@pytest.mark.slow
def test_a_better_design_takes_the_place_of_a_worse_one():
    """The optimum of a part of the plane, sold as that of all of it."""
    all_of_it = problem(minimize="abscissa")
    part = solve(problem({**PLANE, "Fr": (0.5, 1.2)}, minimize="abscissa"), starts=4)
    design = prove_closed(replace(part, problem=all_of_it))
    assert design.problem == all_of_it
    assert design.value < part.value - 0.1
    assert any("found a better design" in note and f"{part.value:.9g} before" in note for note in design.notes)


@pytest.mark.slow
def test_a_basin_that_many_starts_miss():
    """Where a dozen starts agree on +0.0138; the value that is kept was found by differential evolution."""
    design = certify(random_problem(32), seconds=5.0)
    assert design.value == pytest.approx(KEPT[32].value, rel=1e-6)
    assert design.bound.value <= KEPT[32].value


# Processes


@pytest.fixture
def children(monkeypatch):
    """The processes that are started, none of which is left at the end."""
    seen = []
    start = started.start_process

    def noted(*given):
        seen.append(start(*given))
        return seen[-1]

    monkeypatch.setattr(started, "start_process", noted)
    yield seen
    assert seen
    assert all(child.poll() is not None for child in seen)


def check_instant(design, solution):
    """Check that a design has only the bound without a search."""
    assert design.value == solution.value
    assert not design.bound.proven
    assert design.bound.value == solution.bound.value


def test_an_interrupt_keeps_the_design(slow_plane, children):
    def stop(told):
        if told.done > 0:
            raise KeyboardInterrupt

    design = prove_bound(slow_plane, progress=stop)
    assert "the proof was interrupted" in design.notes
    assert (design.interrupted, design.value, design.bound.proven) == (True, slow_plane.value, False)


@pytest.mark.slow
def test_a_process_that_crashes_costs_no_result(slow_plane, monkeypatch):
    """At once, every time: nothing is decided, in the time that was given and that of one process more."""
    crashed = []

    def crash(*_):
        command = [sys.executable, "-S", "-c", "import os; os._exit(1)"]
        crashed.append(subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE))
        return crashed[-1]

    monkeypatch.setattr(started, "start_process", crash)
    before = len(os.listdir("/proc/self/fd")) if os.path.isdir("/proc/self/fd") else 0
    began = time.perf_counter()
    design = certify(slow_plane, seconds=1.0)
    assert time.perf_counter() - began < 4.0
    check_instant(design, slow_plane)
    assert crashed
    assert all(child.poll() is not None for child in crashed)
    if before:
        assert len(os.listdir("/proc/self/fd")) <= before + 2


def test_one_crash_of_two(slow_plane, monkeypatch, children):
    """The other one answers."""
    start = started.start_process

    def every_other(*given):
        child = start(*given)
        if len(children) % 2:
            child.kill()
        return child

    monkeypatch.setattr(started, "start_process", every_other)
    prove_closed(slow_plane)


def test_hardly_any_time(slow_plane):
    check_instant(certify(slow_plane, seconds=1e-3), slow_plane)


def test_progress_is_told(slow_plane):
    """Seconds, and the gap as it closes."""
    told = []
    prove_bound(slow_plane, progress=told.append)
    assert {t.what for t in told} == {"bounding the optimum"}
    assert [t.done for t in told] == sorted(t.done for t in told)
    assert all(0 <= t.done <= t.most == SECONDS and t.left == t.most - t.done for t in told[1:])
    gaps = [float(t.note.split()[1].rstrip(",")) for t in told if t.note.startswith("gap")]
    assert gaps == sorted(gaps, reverse=True)
    assert gaps[-1] < gaps[0]


def test_a_crew_is_closed_whatever_happens(children):
    def fail():
        with SolverPool(SCIP) as pool:
            pool.start_processes(2)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert len(children) == 2


# What is refused


@pytest.mark.parametrize("seconds", [0.0, -1.0, math.nan])
def test_time_must_be_positive(slow_plane, seconds):
    with pytest.raises(InputError, match=r"seconds.*found.*accepted: a positive number"):
        certify(slow_plane, seconds=seconds)


@pytest.mark.slow
def test_that_branch_and_bound_cannot_take_a_radius_is_said():
    """Branch and bound would know nothing of the radius, and any bound without it is none."""
    asked = replace(
        load("problems/tolerant.toml"), maximize=None, minimize="Fr", constraints={"near": "radius >= 0.05"}
    )
    design = certify(asked, seconds=5)
    assert any("branch and bound" in note and "radius" in note for note in design.notes)
    assert not design.bound.proven


@pytest.fixture
def without_scip(monkeypatch):
    missing = replace(SCIP, module="no_such_module")
    monkeypatch.setattr(certifying, "SOLVER", missing)


TIMID = GlobalSolver("Timid", "math", "", 0.0, timid.prepare, timid.decide)


@pytest.mark.slow
def test_another_global_solver_is_asked_and_named(slow_plane, monkeypatch):
    """Whoever searched, the bound that holds without a search stays, under its own name."""
    monkeypatch.setattr(certifying, "SOLVER", TIMID)
    monkeypatch.setattr(answering, "count", lambda: count(2000))  # one that gives up at once comes to so many turns
    bound = certify(slow_plane, seconds=8.0).bound  # its process takes one of them to start
    assert (bound.method, bound.value, bound.proven) == ("omega0", slow_plane.bound.value, False)
    assert (bound.solver, bound.nodes > 0) == ("Timid", True)
    report = replace(slow_plane, bound=bound).report(full=True)
    assert re.search(r"branch and bound with Timid, \d+ nodes, .* s found none better in time", report)
    assert "optimal (proved)" not in report


def test_a_front_has_no_bound():
    with pytest.raises(InputError, match="pareto"):
        certify(problem(pareto=["abscissa", "Fr"]))


def test_nothing_to_bound():
    located = prove_bound(problem({**PLANE, "lambda_s": (0.02, 1.2)}, locate="EP4"))
    assert any("nothing is minimised or maximised" in note for note in located.notes)
    fixed = prove_bound(Problem(models.tms, {**TILTED, "Fr": 1.0, "chi_B": 1.3}, minimize="abscissa"))
    assert any("nothing is free" in note for note in fixed.notes)


FILE = """
model = "tms"
[parameters]
chi_H = 1.0
zeta_H = -0.2
zeta_B = -0.4
mu = 0.1
lambda_s = 0.2
chi_B = { min = 1.01, max = 3 }
Fr = { min = 0.5, max = 3 }
[objective]
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "plane.toml"
    path.write_text(FILE + 'minimize = "abscissa"\n')
    return path


def run(*arguments):
    result = CliRunner().invoke(main, [*map(str, arguments)])
    return result.exit_code, result.stdout, result.stderr


def test_command(file, slow_plane):
    code, out, _ = run("solve", file, "--starts", "8", "--json", "--certify", "8")
    bound = json.loads(out)["bound"]
    assert (code, bound["proven"], bound["method"]) == (0, True, "scip")
    assert bound["value"] == pytest.approx(slow_plane.value, rel=CLOSED)


@pytest.mark.usefixtures("without_scip")
def test_command_without_scip(file):
    code, out, err = run("solve", file, "--certify")
    assert (code, out) == (2, "")
    assert "pip install 'tmsopt[certify]'" in err


@pytest.mark.parametrize("seconds", ["0", "soon"])
def test_command_with_a_bad_time(file, seconds):
    code, _, err = run("solve", file, f"--certify={seconds}")
    assert (code, "--certify" in err) == (2, True)


@pytest.mark.parametrize(
    ("coefficients", "design"),
    [
        (["a - 0.5", "b", "1"], {"a": 0.51, "b": 0.2}),  # a0 changes its sign between the ends
        (["(a - 0.3)*(a - 0.7)", "b", "a - 0.5"], {"a": 0.71, "b": 2 * (0.0041 * 0.21) ** 0.5}),  # twice, aₙ between
    ],
)
def test_the_product_of_the_roots_bounds_nothing_where_a0_vanishes(coefficients, design):
    """Next to a0 = 0 a double root is as far left as one likes, whatever aₙ/a0 is at the ends of the box."""
    a, b, c = (eval(text, {}, design) for text in coefficients)
    root = -b / (2 * a)
    assert a * root * root + b * root + c == pytest.approx(0, abs=1e-12)
    model = models.from_coefficients(coefficients)
    asked = Problem(model, free={"a": (0, 1), "b": (0, 2)}, minimize="abscissa")
    bound = bounding.instant_bound(asked.posed, 0.0)  # asked of a worse design, which does not contradict it
    assert bound.value <= root
