"""Pareto fronts against closed forms and exhaustive grids of designs."""

import csv
import json
import math
import pickle
from dataclasses import FrozenInstanceError, replace
from importlib import import_module
from itertools import pairwise
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from click.testing import CliRunner
from helpers.curves import epset_Fr
from scipy.optimize import brentq, minimize_scalar

import tmsopt
from tmsopt import InputError, NotSolved, Problem
from tmsopt.cli import command_group as main
from tmsopt.models import from_coefficients, tms
from tmsopt.search import solve_any_status

cases = import_module("tmsopt.problem.cases")
front_data = import_module("tmsopt.fronts.front")
options = import_module("tmsopt.program.options")
subproblems = import_module("tmsopt.fronts.subproblems")

BASE = {"chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2, "mu": 0.1}
Z_B, Z_H = -0.4, -0.2
H2 = Z_B * Z_H
T_MIN = math.tan(math.radians(2))
SQRT2 = math.sqrt(2)
EP4 = (-(H2**-0.25), 3 * math.sqrt(110 * SQRT2 - 120) / 8)
"""Abscissa and Froude number of EP4: equation w0 and Table 1."""

ROUNDING = 1e-8
"""A limit holds to 1e-9 on recheck, and Fr changes by up to 2.6 per unit of the abscissa along this front."""


# The front of problems/pareto.toml, from the monic coefficients alone


def inverse(c1, c2, c3):
    """Fr, chi_B, T of the chi_H = 1 bicycle with given monic coefficients; c4 is 1/(zeta_B zeta_H) for all of them.

    From copo at chi_H = 1, with u = Fr/T: c1 h² = u (chi_B ζ_H − ζ_B), c3 h² = u (chi_B − 1),
    c2 h² = ζ_B + ζ_H − u² T (ζ_B − ζ_H), where h² = ζ_B ζ_H.
    """
    u = H2 * (c1 - Z_H * c3) / (Z_H - Z_B)
    T = (Z_B + Z_H - c2 * H2) / (u * u * (Z_B - Z_H))
    return u * T, 1 + c3 * H2 / u, T


def on_one_line(sigma, W):
    """Fr, chi_B, T with roots −σ, −σ ± i√W and a fourth, which follows from c4."""
    f = 1 / (H2 * sigma * (sigma**2 + W))
    p = np.polymul(np.polymul([1, sigma], [1, 2 * sigma, sigma**2 + W]), [1, f])
    return inverse(p[1], p[2], p[3])


def best_W(sigma):
    """The W ≥ 0 of least Fr, any tilt allowed."""
    found = minimize_scalar(
        lambda W: on_one_line(sigma, W)[0], bounds=(0, 2), method="bounded", options={"xatol": 1e-13}
    )
    zero = on_one_line(sigma, 0.0)[0]
    return 0.0 if zero <= found.fun + 1e-15 else float(found.x)


def least_Fr(sigma):
    """Least Fr with abscissa −σ and tilt of 2 degrees or more."""
    W = best_W(sigma)
    if on_one_line(sigma, W)[2] < T_MIN:  # the tilt binds: W on its level
        W = tilted(sigma, W)
    return on_one_line(sigma, W)[0]


def tilted(sigma, W):
    def slack(w):
        return on_one_line(sigma, w)[2] - T_MIN

    levels = [W * k / 20 for k in range(21)] + [W + 3 * k / 30 for k in range(1, 31)]
    crossings = [brentq(slack, a, b, xtol=1e-15) for a, b in pairwise(levels) if slack(a) * slack(b) <= 0]
    return min(crossings, key=lambda w: on_one_line(sigma, w)[0])


def ep3_kink():
    """σ where dFr/dW = 0 at W = 0: beyond it the triple root is best."""
    return brentq(lambda sigma: on_one_line(sigma, 1e-6)[0] - on_one_line(sigma, 0.0)[0], 1.5, 1.87)


def tilt_kink():
    """σ where the best tilt is 2 degrees."""
    return brentq(lambda sigma: on_one_line(sigma, best_W(sigma))[2] - T_MIN, 0.35, 0.6)


def problem(**changes):
    free = {"Fr": (0.01, 10), "chi_B": (1.01, 5), "lambda_s": (math.radians(2), 1.4)}
    asked = {"fixed": BASE, "free": free, "pareto": ["abscissa", "Fr"], "constraints": {"decay": "abscissa <= -0.3"}}
    return Problem(**{"model": tms, **asked, **changes})


@pytest.fixture(scope="module")
def front():
    return tmsopt.pareto(tmsopt.load("problems/pareto.toml"), 6, workers=1)


def test_every_point_is_on_the_closed_form(front):
    for p in front.points:
        abscissa, Fr = p.objectives
        assert Fr == pytest.approx(least_Fr(-abscissa), abs=ROUNDING)
        assert p.solution.status == "optimal"
        assert (abscissa, Fr) == (p.solution.abscissa, p.solution.parameters["Fr"])


def test_ends_are_EP4_and_the_decay_that_is_asked_for(front):
    first, last = front.points[0], front.points[-1]
    assert first.objectives == pytest.approx(EP4, abs=1e-12)  # a polished optimum
    assert (first.structure, first.label) == ("EP4", "least abscissa")
    assert last.objectives == pytest.approx((-0.3, least_Fr(0.3)), abs=ROUNDING)
    assert last.label == "least Fr"
    assert set(last.limits) == {"decay", "lambda_s.min"}


def test_kinks_are_where_the_theory_has_them(front):
    names = [(k.name, k.index) for k in front.kinks]
    assert [n for n, _ in names] == ["EP3 -> pair+real", "lambda_s.min becomes active"]
    width = 2e-4 * (front.nadir[0] - front.ideal[0])  # what kinks are located to
    for (name, index), sigma in zip(names, (ep3_kink(), tilt_kink()), strict=True):
        assert front.points[index].objectives[0] == pytest.approx(-sigma, abs=width)
        assert name in front.points[index].label
    assert {p.structure for p in front.points[1 : names[0][1] + 1]} == {"EP3"}
    assert all(("lambda_s.min" in p.limits) == (k > names[1][1]) for k, p in enumerate(front.points))


def test_points_do_not_dominate_one_another_and_are_spread(front):
    values = np.array([p.objectives for p in front.points])
    assert np.all(np.diff(values[:, 0]) > 0)
    assert np.all(np.diff(values[:, 1]) < 0)
    lengths = np.hypot(*(np.diff(values, axis=0) / np.ptp(values, axis=0)).T)
    assert lengths.max() <= 2 * lengths.sum() / 5  # the longest is split until there are 6 points
    assert front.gaps == ()


@pytest.mark.slow
def test_the_order_of_objectives_does_not_matter(front):
    other = tmsopt.pareto(problem(pareto=["Fr", "abscissa"]), 3, starts=0)
    for p in other.points:
        assert p.objectives[0] == pytest.approx(least_Fr(-p.objectives[1]), abs=ROUNDING)
    ends = [other.points[k].objectives[::-1] for k in (-1, 0)]
    assert ends == [pytest.approx(front.points[k].objectives, abs=ROUNDING) for k in (0, -1)]
    assert [k.name for k in other.kinks] == ["lambda_s.min becomes inactive", "pair+real -> EP3"]


WAVE = {"fixed": {**BASE, "lambda_s": 0.4, "Fr": 0.01}, "free": {"chi_B": (0.0, 4.0)}, "constraints": {}}
"""One free parameter x: a front of x and of a wave in x is known by hand. So slow, all roots are real: no kinks."""


@pytest.mark.slow
def test_a_gap_is_reported_where_it_is():
    """x against sin 2x − 0.3 x: efficient are 0, and from the zero at 1.36 to the minimum, where cos 2x = 0.15."""
    found = tmsopt.pareto(problem(**WAVE, pareto=["chi_B", "sin(2*chi_B) - 0.3*chi_B"]), 6)
    zero = brentq(lambda x: math.sin(2 * x) - 0.3 * x, 1, 2)
    least = math.pi - math.acos(0.15) / 2
    assert [g.index for g in found.gaps] == [0]
    assert not found.gaps[0].failed
    x = [p.objectives[0] for p in found.points]
    assert x[0] == pytest.approx(0, abs=1e-8)
    assert zero <= x[1] <= zero + 1e-3 * least  # what the end of a gap is located to
    assert x[-1] == pytest.approx(least, abs=1e-7)
    assert all(
        p.objectives[1] == pytest.approx(math.sin(2 * v) - 0.3 * v, abs=1e-12)
        for p, v in zip(found.points, x, strict=True)
    )
    assert "gap begins" in found.points[0].label
    assert "gap ends" in found.points[1].label


@pytest.mark.slow
def test_what_is_not_solved_is_reported_as_a_gap(monkeypatch):
    """Sub-problems with a limit between 1.5 and 2.5 are made to fail; the front is the whole box, 0 to 4."""

    def failing(asked, options, *more):
        found = solve_any_status(asked, options, *more)
        values = (abs(float(text.split("<=")[1])) for text in asked.constraints.values())
        return replace(found, status="not_converged") if any(1.5 < v < 2.5 for v in values) else found

    monkeypatch.setattr(subproblems, "solve_any_status", failing)
    found = tmsopt.pareto(problem(**WAVE, pareto=["chi_B", "-chi_B"]), 6, workers=1)
    assert [g.failed for g in found.gaps] == [True]
    assert "try more starts" in found.gaps[0].reason
    k = found.gaps[0].index
    assert 1.3 - 1e-8 <= found.points[k].objectives[0] <= 1.5  # to 5 % of the range
    assert 2.5 <= found.points[k + 1].objectives[0] <= 2.7 + 1e-8


def test_objectives_without_conflict_give_one_point():
    found = tmsopt.pareto(problem(**WAVE, pareto=["chi_B", "3*chi_B - 1"]))
    assert len(found) == 1
    assert found.points[0].objectives == pytest.approx((0, -1), abs=1e-8)
    assert "do not conflict" in found.notes[0]


@pytest.mark.slow
def test_a_front_over_a_pattern_is_the_ep_set():
    """From EP4, the greatest tilt with two real double roots, to the fold at Fr = √5 (equation epset)."""
    around = {"Fr": (1.5, 4.0), "chi_B": (1.2, 2.0), "lambda_s": (math.radians(2), 0.6)}  # the set, and room about it
    found = tmsopt.pareto(problem(free=around, locate="2EP2", pareto=["-lambda_s", "Fr"], constraints={}), 3, starts=0)
    assert found.points[0].objectives == pytest.approx((-math.atan(15 / 4 - 75 * SQRT2 / 32), EP4[1]), abs=1e-8)
    assert found.points[0].label == "greatest lambda_s"
    assert found.points[-1].objectives[1] == pytest.approx(math.sqrt(5), abs=1e-10)
    for p in found.points:
        assert p.objectives[1] == pytest.approx(float(epset_Fr(Z_B, Z_H, -p.objectives[0])), abs=1e-10)


@pytest.mark.slow
def test_an_end_at_a_bound_is_best_in_the_others_too():
    """At the greatest tilt the least abscissa is that of CEP2 (equation epset), however the tilt was reached."""
    found = tmsopt.pareto(problem(pareto=["abscissa", "Fr", "-lambda_s"]), 2, starts=0)
    end = next(p for p in found.points if p.label == "greatest lambda_s")
    assert end.objectives[2] == -1.4
    assert end.objectives[1] == pytest.approx(float(epset_Fr(Z_B, Z_H, 1.4)), abs=1e-9)
    assert (end.structure, end.limits) == ("CEP2", ("lambda_s.max",))


TILTED = {"Fr": (0.01, 10), "chi_B": (1.01, 5), "lambda_s": (-1.4, 1.4)}


def sides(forward, backward):
    return SimpleNamespace(sides={"normal rake": forward, "reversed rake": backward})


@pytest.mark.parametrize(
    ("halves", "k", "limits", "end", "out"),
    [
        (sides(-1.0, 0.1), 1, {0: -0.3}, (0.0, 9.0), {"reversed rake"}),
        (sides(-1.0, 0.1), 1, {0: -2.0}, (0.0, 9.0), set()),  # no half is left
        (sides(-1.0, math.nan), 1, {0: -0.3}, (0.0, 9.0), set()),  # a half of which nothing is known
        (sides(-1.0, 0.1), 0, {1: 1.0}, (-0.5, 0.9), {"reversed rake"}),  # an end that meets the limit is better
        (sides(-1.0, 0.1), 0, {1: 1.0}, (-0.5, 1.1), set()),  # an end that does not
    ],
)
def test_a_half_of_the_box_is_left_out_where_its_best_without_limits_is_worse(halves, k, limits, end, out):
    end = front_data.FrontPoint(end, None, ())
    ask = subproblems.FrontSolver(problem(free=TILTED).posed, options.Options(), ends=(end,), single_optima={0: halves})
    assert ask._worse_sides(subproblems.build_subproblem(ask, k, limits), ()) == out


def test_a_half_that_is_left_out_is_not_searched():
    searched, asked = set(), problem(free=TILTED, pareto=[], minimize="abscissa")
    policy = replace(tmsopt.POLICY, enough=lambda state: bool(searched.add(state.side)) or tmsopt.POLICY.enough(state))
    start = {"Fr": 2.2, "chi_B": 1.4, "lambda_s": 0.7}
    without = ["reversed rake"]
    found = solve_any_status(asked, extra_starts=[start], without_sample=True, skipped_parts=without, policy=policy)
    assert searched == {"normal rake"}
    assert found.value == pytest.approx(EP4[0], abs=1e-8)


@pytest.mark.slow
def test_points_over_a_band_are_proved_as_a_solution_is():
    free, band = {"chi_B": (1.01, 3), "lambda_s": (0.05, 1.2)}, {"Fr": cases.Band(1.2, 1.8, 3)}
    asked = problem(free=free, constraints={}, pareto=["abscissa", "chi_B"], scenarios=band)
    front = tmsopt.pareto(asked, points=3)
    assert len(front.points) >= 3
    for p in front.points:
        assert p.solution.cover.proven


@pytest.mark.slow
def test_three_objectives_on_a_sphere():
    """x² + y² + z² ≥ 1: the efficient designs are the sphere, which weighted sums of x, y, z would miss."""
    free = {"Fr": (0.1, 1.0), "chi_B": (0.1, 1.0), "mu": (0.1, 1.0)}
    fixed = {"chi_H": 1.2, "zeta_B": -0.4, "zeta_H": -0.2, "lambda_s": 0.3}
    sphere = {"sphere": "Fr**2 + chi_B**2 + mu**2 >= 1"}
    found = tmsopt.pareto(problem(free=free, fixed=fixed, constraints=sphere, pareto=["Fr", "chi_B", "mu"]), 4)
    assert len(found) >= 6
    for p in found.points:
        assert math.hypot(*p.objectives) == pytest.approx(1, abs=1e-8)
    assert found.ideal == pytest.approx((0.1, 0.1, 0.1), abs=1e-8)
    labels = {p.label for p in found.points} - {""}
    assert labels == {"least Fr", "least chi_B", "least mu"}
    assert found.to_json()["nadir"] == pytest.approx([max(p.objectives[k] for p in found.points) for k in range(3)])


def test_a_rounded_tie_does_not_decide_the_order_of_a_front():
    values = [(1 + 1e-13, 1.0, 3.0), (1.0, 2.0, 2.0), (1 - 1e-13, 3.0, 1.0)]
    points = [front_data.FrontPoint(each, None, ()) for each in values]
    assert [p.objectives for p in front_data.efficient_points(points, [1e-12] * 3)] == values


FLAT = {
    "free": {"Fr": (0.5, 1.5), "chi_B": (1.1, 1.9)},
    "fixed": {"chi_H": 1.2, "zeta_B": -0.4, "zeta_H": -0.2, "lambda_s": 0.3, "mu": 0.1},
    "constraints": {},
    "pareto": ["1 + 0.1*((Fr - 1)**2 + (chi_B - 1.5)**2)", "Fr", "chi_B - 0.5*Fr"],
}


def test_a_flat_end_of_three_objectives_is_on_the_front():
    """Its slack of 2e-9 buys 1e-4 of the others there, which makes no better end of a neighbour."""
    found = tmsopt.pareto(problem(**FLAT), 2, workers=1)
    assert [p.label for p in found.points if p.label] == [f"least {FLAT['pareto'][k]}" for k in (0, 1, 2)]
    assert found.points[0].objectives == pytest.approx((1.0, 1.0, 1.0), abs=1e-12)
    assert found.points[0].solution.parameters["chi_B"] == pytest.approx(1.5, abs=1e-8)


@pytest.mark.slow
def test_points_of_three_objectives_are_limits_on_each_of_two():
    told = []
    found = tmsopt.pareto(problem(**FLAT), 3, workers=1, progress=told.append)
    assert {t.most for t in told if t.what == "following the front" and t.most == t.most} == {3 * 3 - 1}
    assert 3 < len(found) <= 3 * 3 + 2


@pytest.mark.slow
def test_constraints_of_the_user_keep_their_names():
    crowded = {"Fr <= eps": "chi_B >= 0.5", "chi_B <= eps": "chi_B <= 3.5"}
    found = tmsopt.pareto(problem(**{**WAVE, "constraints": crowded}, pareto=["chi_B", "-chi_B"]), 4)
    assert (found.ideal[0], found.nadir[0]) == pytest.approx((0.5, 3.5), abs=1e-8)
    assert found.points[0].limits == ("Fr <= eps",)
    assert found.points[-1].limits == ("chi_B <= eps",)


def test_infeasible_is_raised_with_the_least_violating_design():
    with pytest.raises(NotSolved) as raised:
        tmsopt.pareto(problem(constraints={"decay": "abscissa <= -3"}))  # below omega0 = -1.88
    assert raised.value.solution.status == "infeasible"
    assert "decay" in raised.value.solution.violations


def test_a_front_is_frozen_data(front):
    assert pickle.loads(pickle.dumps(front)).points[1].objectives == front.points[1].objectives
    with pytest.raises(FrozenInstanceError):
        front.points = ()
    data = json.loads(json.dumps(front.to_json(), allow_nan=False))
    assert (data["schema"], data["status"]) == (1, "optimal")
    assert data["objective"] == {"sense": "pareto", "expressions": ["abscissa", "Fr"]}
    assert [p["structure"] for p in data["points"]] == [p.structure for p in front.points]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"pareto": ["abscissa"]}, "two or three"),
        ({"pareto": ["Fr", "mu", "chi_B", "chi_H"]}, "two or three"),
        ({"pareto": ["Fr", " Fr"]}, "different"),
        ({"pareto": "Fr"}, "two or three"),
        ({"pareto": 3}, "two or three"),
        ({"pareto": ["Fr", 1]}, "in quotes"),
        ({"pareto": ["Fr", "speed"]}, "unknown name 'speed'"),
        ({"pareto": ["Fr", "mu <= 1"]}, "is a comparison"),
        ({"minimize": "abscissa"}, "pareto and minimize"),
        ({"maximize": "Fr"}, "pareto and maximize"),
    ],
)
def test_faults_are_named(changes, words):
    with pytest.raises(InputError, match="objective") as raised:
        problem(**changes)
    assert words in str(raised.value)


def test_each_verb_refuses_the_other_kind_of_problem():
    assert problem().posed.sense == "pareto"
    with pytest.raises(InputError, match=r"tmsopt\.pareto"):
        tmsopt.solve(problem())
    with pytest.raises(InputError, match="no front is asked for"):
        tmsopt.pareto(problem(pareto=(), minimize="Fr"))
    with pytest.raises(ValueError, match="from 2 to 10000"):
        tmsopt.pareto(problem(), 1)


# The command


FILE = """
[parameters]
chi_H = 1.0
zeta_H = -0.2
zeta_B = -0.4
mu = 0.1
Fr = 0.01
lambda_s = 0.4
chi_B = { min = 0, max = 4 }

[objective]
pareto = ["chi_B", "sin(2*chi_B) - 0.3*chi_B"]
"""


def command(*arguments):
    return CliRunner().invoke(main, [str(a) for a in arguments])


@pytest.mark.slow
def test_designs_that_are_not_stable_are_marked(tmp_path):
    """s² + (x − 2) s + 1 + y is stable where x > 2 alone."""
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    free, pareto = {"x": (0, 3), "y": (0, 1)}, ("abscissa", "x", "-y")
    problem = Problem(from_coefficients([1, x - 2, 1 + y]), free=free, pareto=pareto)
    front = tmsopt.pareto(problem, points=8)
    stable = [p.solution.parameters["x"] > 2 for p in front.points]
    assert set(stable) == {True, False}
    assert [p.stable for p in front.points] == stable
    assert [p["stable"] for p in front.to_json()["points"]] == stable
    front.write_csv(tmp_path / "front.csv")
    rows = csv.DictReader((tmp_path / "front.csv").read_text(encoding="utf-8").splitlines())
    assert [row["stable"] == "true" for row in rows] == stable
    table = front.report().splitlines()
    at = next(line for line in table if " stable" in line).index("stable")
    shown = [line[at : at + 3].strip() for line in table]
    assert [word == "yes" for word in shown if word in ("yes", "no")] == stable
    lines = tmsopt.plots.front_figure(front).axes[0].get_lines()
    unstable = {p.objectives[:2] for p, s in zip(front.points, stable, strict=True) if not s}
    marked = [line for line in lines if line.get_label() == "not stable"]
    assert {tuple(xy) for line in marked for xy in line.get_xydata()} == unstable


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "wave.toml"
    path.write_text(FILE)
    return path


@pytest.mark.slow
def test_the_command_writes_table_csv_and_plot(file, tmp_path):
    done = command("solve", file, "--points", 4, "--csv", tmp_path / "front.csv", "--plot", tmp_path / "front.png")
    assert done.exit_code == 0, done.output
    assert "least chi_B; gap begins" in done.stdout
    assert "gap: no efficient design was found with chi_B from 0 to 1.36" in done.stdout
    lines = (tmp_path / "front.csv").read_text(encoding="utf-8").splitlines()
    objectives, others = "chi_B,sin(2*chi_B) - 0.3*chi_B", "Fr,mu,chi_H,zeta_B,zeta_H,lambda_s (rad)"
    assert lines[0] == f"{objectives},{others},abscissa,structure,stable,limits,label"
    rows = list(csv.DictReader(lines))
    shown = done.stdout.split("sub-problems")[1].split("\n\n")[1].splitlines()
    assert len(rows) == sum(line.startswith("  ") for line in shown) - 2  # a heading, a row a point, what is left out
    x = np.array([float(r["chi_B"]) for r in rows])
    assert np.array([float(r["sin(2*chi_B) - 0.3*chi_B"]) for r in rows]) == pytest.approx(np.sin(2 * x) - 0.3 * x)
    assert (tmp_path / "front.png").read_bytes()[:4] == b"\x89PNG"
    done = command("solve", file, "--points", 2, "--json")
    assert (done.exit_code, [g["index"] for g in json.loads(done.stdout)["gaps"]]) == (0, [0])


OBJECTIVE = 'pareto = ["chi_B", "sin(2*chi_B) - 0.3*chi_B"]'


@pytest.mark.parametrize(
    ("objective", "arguments", "status", "words"),
    [
        (OBJECTIVE, ["--wheelbase", "1 m"], 2, "--wheelbase: "),
        (OBJECTIVE, ["--rear-mass", "1"], 2, "--rear-mass: "),
        (OBJECTIVE, ["--csv", "front.txt"], 2, "--csv: "),
        ('minimize = "chi_B"', ["--points", "3"], 2, "--points: "),
        ('minimize = "chi_B"', ["--csv", "f.csv"], 2, "--csv: "),
        ('pareto = "chi_B"', [], 2, "wave.toml:12: objective.pareto: found 'chi_B'"),
        ('pareto = ["Fr", 2]', [], 2, "wave.toml:12: objective.pareto: found 2"),
        ("pareto = []", [], 2, "no objective"),
        (f"{OBJECTIVE}\n[constraints]\nx = 'chi_B >= 5'", [], 3, ""),
    ],
)
def test_the_command_says_what_is_wrong(file, objective, arguments, status, words):
    file.write_text(FILE.replace(OBJECTIVE, objective))
    done = command("solve", file, *arguments)
    assert done.exit_code == status, done.output
    assert words in done.stderr


def test_compare_refuses_a_front(file):
    done = command("compare", file)
    assert done.exit_code == 2
    assert "tmsopt.pareto" in done.stderr
