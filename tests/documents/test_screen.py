"""What the report of every problem holds to: one screen, one unit per quantity, that of the file, and no noise."""

import math
import re
from collections import defaultdict
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest

import tmsopt
from tmsopt.problem import unit_of

NUMBER = r"-?\d[\d.]*(?:e[+-]?\d+)?"
QUICK = ("coupled_pair", "ep4", "pt_pair", "realistic", "ziegler_undamped")
FILES = sorted(p for p in Path("problems").glob("*.toml") if not re.match("study|chart|pareto", p.stem))
SOME = [p for k, p in enumerate(FILES) if k % 2 or p.stem in QUICK]
LINES, COLUMNS = 34, 100


def one_each(names, report):
    """Units that stand behind the numbers of each name: ``v  3.7 m/s``, ``v = 4 m/s``, ``v.max:  <= 4 m/s``."""
    found = defaultdict(set)
    for name in names:
        value = rf"(?<![\w.]){name}(?:\.min|\.max)?(?::? +(?:[<>]?=)? *| at least | at most | found is )"
        rest = r"(?: (?:m )?(?:m\^2|s\^2/rad|s/rad|m/rad))?"  # of kg m^2, N m/rad, N m s/rad
        for unit in re.findall(rf"{value}{NUMBER}(?: ([^\W\d_][^\s,;:]*{rest})(?=[\s,;:]|$))?", report):
            found[name].add(unit)
    return found


@pytest.mark.parametrize(
    "file", [pytest.param(p, id=p.stem, marks=() if p.stem in QUICK else pytest.mark.slow) for p in SOME]
)
def test_it_fits_a_screen_in_one_unit_each(file):
    design = tmsopt.solve(tmsopt.load(file), throw=False)
    report = str(design)
    assert report == design.report()
    lines = report.splitlines()
    assert len(lines) <= LINES
    assert max(map(len, lines)) <= COLUMNS
    assert not re.search(r"(?<![\d.])-0(?![.\d])|e-1[3-9]|\bnan\b", report)
    alone = [line for line in lines[1:] if not re.match(r"(min|max)imize .* [+*/-] .* = ", line)]  # its own unit
    first = "\n".join(lines[:13])  # is there an answer, is it stable, how sure, what to build, which limits are active
    assert all(re.search(rf"^  (.*  )?{n} ", first, re.MULTILINE) for n in list(design.problem.free)[:8])
    assert "proof: " in first
    assert all(name in first for name in design.active)
    found = one_each(list(design.parameters), "\n".join(alone))
    assert found
    for name, units in found.items():
        assert units <= {unit_of(design.problem.posed, name).text}, name
    full = design.report(full=True).splitlines() if file.stem in QUICK else []
    headed = [name for name, below in pairwise(full) if below and set(below) == {"-"}]
    order = [
        "Answer",
        "Conflict",
        "Parameters",
        "Motion",
        "Cases",
        "Limits",
        "Robustness, rounding and optimality",
        "Roots",
    ]
    order += ["Derived quantities", "Search"]
    assert headed == [name for name in order if name in headed]


@pytest.fixture(scope="module")
def robot():
    return tmsopt.solve(tmsopt.load("problems/benchmark.toml"))


@pytest.mark.parametrize(("written", "shown"), [("km/h", "14.4 km/h"), ("m/s", "4 m/s"), ("cm/s", "400 cm/s")])
def test_a_speed_is_shown_as_it_was_typed(robot, written, shown):
    problem = replace(robot.problem, units={**robot.problem.units, "v": written})
    assert f"v = {shown}" in str(tmsopt.solve(problem))


def test_numbers_with_units_in_python_are_those_of_a_file():
    """25 cm is 0.25 m, 18 km/h 5 m/s, 90 deg π/2, to the last bit; what is typed is how it is shown."""
    typed = {"w": "80 cm", "v": "18 km/h", "m_B": "2e4 g", "x_B": 0.4, "z_B": "-40 cm", "m_H": 3.0, "x_H": 0.9}
    free = {"z_H": ("-60 cm", "-0.2 m"), "lambda_s": ("-30 deg", 0.5)}
    asked = {"minimize": "abscissa", "start": {"z_H": "-300 mm"}, "tolerances": {"x_B": "5 mm"}}
    problem = tmsopt.Problem(tmsopt.models.tms, fixed=typed, free=free, **asked)
    assert problem.fixed == {**problem.fixed, "w": 0.8, "v": 5.0, "m_B": 20.0, "x_B": 0.4, "z_B": -0.4}
    assert problem.free == {"z_H": (-0.6, -0.2), "lambda_s": (-30 * 0.017453292519943295, 0.5)}
    assert (problem.start, problem.tolerances) == ({"z_H": -0.3}, {"x_B": 0.005})
    texts = ("v", "m_B", "x_B", "z_H", "lambda_s.min", "u_H", "N_R", "v_c", "w * m_B", "tan(lambda_s)", "v**2/w/g")
    shown = [unit_of(problem.posed, text).text for text in texts]
    # u_H is a length, and two of the three lengths that were typed with a unit are in cm
    assert shown == ["km/h", "g", "m", "cm", "deg", "cm", "N", "km/h", "kg m", "", ""]
    with pytest.raises(tmsopt.InputError, match=r"parameters\.w: found the unit 'furlong/h'"):
        tmsopt.Problem(tmsopt.models.tms, fixed={**typed, "w": "1 furlong/h"}, free=problem.free)


def test_violations_are_in_their_own_units():
    """The benchmark carries 127.7262 N on the front wheel (13.02 · 9.81), so 150 N are missed by 22.2738 N."""
    problem = replace(tmsopt.load("problems/benchmark.toml"), constraints={"front": "N_F >= 150", "arm": "u_H >= 0.1"})
    design = tmsopt.solve(problem, throw=False)
    assert design.violations["front"] == pytest.approx(150 - 13.02 * 9.81, rel=1e-12)
    assert design.violations["arm"] == pytest.approx(0.1 - design.quantities["u_H"], rel=1e-12)
    assert design.to_json()["units"]["front"] == "N"
    assert "violated: front (N_F >= 150 N) by 22.27 N" in str(design)


@pytest.mark.parametrize(("sense", "expression"), [("maximize", "decay_rate"), ("minimize", "decay_time")])
def test_the_fastest_decay_in_seconds(sense, expression):
    """At fixed w it is the least abscissa: −1.880301546543197 √(g/w) of ep4.toml, for w = 1 m."""
    ep4 = tmsopt.load("problems/ep4.toml")
    si = {"w": 1.0, "m_B": 1.0, "m_H": 0.1, "x_H": 1.0, "z_H": -0.2, "z_B": -0.4}
    free = {"v": (0.1, 30.0), "x_B": ep4.free["chi_B"], "lambda_s": ep4.free["lambda_s"]}
    design = tmsopt.solve(tmsopt.Problem(tmsopt.models.tms, fixed=si, free=free, **{sense: expression}))
    rate = 1.880301546543197 * 9.81**0.5
    assert design.value == pytest.approx(rate if sense == "maximize" else 1 / rate, rel=1e-9)
    assert design.quantities["decay_rate"] * design.quantities["decay_time"] == pytest.approx(1, rel=1e-14)
    assert design.structure == "EP4"


def test_who_may_vary_the_unit_of_time_is_warned():
    """No parameter of one's own is, called w, in a system whose roots have no unit."""
    known = tmsopt.load("problems/point_mass_robot.toml")
    fixed = {n: v for n, v in known.fixed.items() if n != "w"}
    varied = replace(known, fixed=fixed, free={**known.free, "w": (0.6, 1.0)})
    model = tmsopt.models.from_coefficients(["1", "c", "w"])
    own = tmsopt.solve(tmsopt.Problem(model, fixed={"c": 2.0}, free={"w": (0.5, 2.0)}, minimize="abscissa"))
    designs = [replace(tmsopt.solve("problems/benchmark.toml"), problem=problem) for problem in (varied, known)]
    told = [" ".join(tmsopt.explain(design, resolve=False).warnings) for design in (*designs, own)]
    assert ["decay_rate" in words for words in told] == [True, False, False]
    assert "√(g/w)" not in told[-1]


def test_the_stable_range_does_not_end_where_the_box_does():
    """Fr from 2 to 2.5 lies inside what is stable, from Fr_c = 1.59308273713602 (equation flus) on: not "everywhere"."""
    problem = tmsopt.load("problems/ep4.toml")
    design = tmsopt.solve(replace(problem, free={**problem.free, "Fr": (2.0, 2.5)}))
    assert "stable range of Fr: from 1.5931; this design has Fr = 2.2363" in str(design)


@pytest.mark.slow
def test_a_proof_names_the_designs_that_it_is_about():
    """Of those beyond a limit some are better: Fr = 1 is below any that decays at 0.5, and in the box."""
    problem = replace(tmsopt.load("problems/ep4.toml"), minimize="Fr", constraints={"fast": "abscissa <= -0.5"})
    design = tmsopt.solve(problem)
    told = str(replace(design, bound=replace(design.bound, value=design.value, gap=0.0, proven=True)))
    assert "proof: no design within the limits has a smaller Fr" in told


def test_a_located_root_that_is_not_rightmost_is_one_root():
    """(s + 2)² (s² + 0.2 s + 1): the double root stands left of the pair."""
    model = tmsopt.models.from_coefficients(["1", "4.2", "5.8", "b", "c"])  # b = 4.8, c = 4
    problem = tmsopt.Problem(model, free={"b": (4.5, 5.1), "c": (3.9, 4.1)}, locate="EP2", constraints={"c": "c == 4"})
    design = tmsopt.solve(problem)
    assert [(round(r.re, 6), r.multiplicity) for r in design.roots if r.im == 0] == [(-2.0, 2)]
    assert "(2-fold)" in str(design)


def test_a_design_on_the_axis_is_on_the_edge():
    """s² + 1: neither decay nor growth, whatever rounding makes of the roots."""
    told = str(tmsopt.solve(tmsopt.Problem(tmsopt.models.from_coefficients(["1", "d", "1"]), fixed={"d": 0.0})))
    assert "marginally stable\n" in told  # exactly: its coefficients are fractions
    assert "neither decay nor growth" in told


def test_a_scale_is_refused_where_there_is_one(run):
    status, _, said = run("solve", "problems/benchmark.toml", "--wheelbase", "1 m")
    assert status == 2
    assert "--wheelbase: scales a dimensionless bicycle" in said


def test_a_band_that_is_one_speed_is_told_as_one():
    """Beside the EP3 that is heavily damped at the least speed the band is narrower than a double can tell."""
    problem = tmsopt.load("problems/heavily_damped.toml")
    beside = {"chi_B": 1.300190264265, "lambda_s": math.radians(10)}  # the EP3 is at 1.3001902642636
    told = str(tmsopt.speeds(replace(problem, fixed={**problem.fixed, **beside}, free={"Fr": (0.1, 5)})))
    assert "\nheavily damped: at 1.9872866" in told


CROWDED = {
    "model": tmsopt.models.tms,
    "fixed": {"w": 0.6, "m_B": 15},
    "free": {
        "m_H": (1, 6),
        "x_B": (0.1, 0.6),
        "z_B": (-0.7, -0.2),
        "x_H": (0.3, 0.9),
        "z_H": (-0.7, -0.1),
        "lambda_s": ("-35 deg", "35 deg"),
    },
    "constraints": {"steer_arm": "abs(u_H) >= 0.02", "rear": "N_R >= 20", "front": "N_F >= 20"},
    "scenarios": {"v": [2.0, 3.0]},
    "tolerances": dict.fromkeys(("x_B", "z_B", "x_H", "z_H"), 0.003),
    "minimize": "abscissa",
}
"""A robot whose report has more lines than a screen: limits, cases, a side of the tilt that loses."""


@pytest.mark.slow
def test_what_is_to_be_built_is_on_the_screen_however_crowded_it_is():
    design = tmsopt.solve(tmsopt.Problem(**CROWDED))
    told = str(design).splitlines()
    assert len(told) <= 36
    for name in (*design.problem.free, "fixed: w = "):
        assert any(line.lstrip().startswith(name) or f"  {name}  " in line for line in told), name
    assert any("reversed rake is better" in line for line in told)


@pytest.mark.slow
def test_how_near_a_design_comes_is_said_of_its_worst_case():
    """The smallest change, which was solved again, asks for no less than the nearest design has."""
    asked = {**CROWDED, "constraints": {**CROWDED["constraints"], "fast": "decay_time <= 0.167"}}
    told = str(tmsopt.solve(tmsopt.Problem(**asked), throw=False)).replace("\n  ", " ")
    near, least = re.findall(r"decay_time (?:=|<=) ([\d.]+) (?:s in its worst case|instead of 0.167)", told)
    assert 0.167 < float(near) <= float(least)


@pytest.mark.slow
def test_a_load_of_zero_is_zero_in_newtons_too():
    """The active limit load_rear >= 0 leaves a rounding error of 1e-17."""
    design = tmsopt.solve("problems/realistic.toml")
    report = design.report(full=True)
    assert re.search(r"load_rear +0 +% +N_R = 0 N", report)
    counts = re.search(r"starts: (\d+) .*?; (\d+) lead to an optimum, (\d+)", report, re.DOTALL).groups()
    assert [*map(int, counts)] == [design.starts.tried, design.starts.converged, design.starts.at_best]


@pytest.mark.slow
def test_a_bound_for_every_case_is_printed_on_its_safe_side():
    """And a column without any cell is left out: the quantities of a problem in SI have no other form."""
    design = tmsopt.solve("problems/speed_band.toml")
    printed = re.search(r"every case: abscissa at most (\S+),", design.report())
    assert design.cover.proven
    assert design.cover.limit <= float(printed[1]) < design.cover.limit + 1e-11
    table = tmsopt.solve("problems/delivery_robot.toml").report(full=True).split("Derived quantities")[1]
    assert "without units" not in table


def test_a_proof_that_was_tried_in_vain_is_told_so():
    design = tmsopt.solve("problems/realistic.toml")
    assert "proof: not proved to be the best; --certify" in design.report()
    tried = replace(design, bound=replace(design.bound, solver="SCIP", seconds=19.8))
    assert "proof: not proved to be the best after 20 s of SCIP; --certify 40" in tried.report()


def test_a_pattern_that_is_missed_is_called_one_whatever_its_name():
    """``EP2+EP2`` is 2EP2; between 0.1 and 0.2 this damping is too weak for any real root."""
    weak = tmsopt.models.from_matrices(M=[[1, 0], [0, 1]], D=[["c", 0], [0, "d"]], K=[[1, 0], [0, 2]])
    problem = tmsopt.Problem(weak, free={"c": (0.1, 0.2), "d": (0.1, 0.2)}, locate="EP2+EP2")
    assert "violated: 2EP2 (pattern)" in str(tmsopt.solve(problem, throw=False, starts=4))
