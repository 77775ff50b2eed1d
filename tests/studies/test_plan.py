"""Studies as data: rows in the order promised, samples with the properties they are known for, faults at their place."""

import itertools
import json
import math
import pickle
import random
from dataclasses import replace

import numpy as np
import pytest
from helpers import hunt
from helpers.rows import faults
from hypothesis import given, settings, strategies as st

import tmsopt
from tmsopt.problem import ExpressionError, limit_value, replace_limit
from tmsopt.records import Column, Table
from tmsopt.studies import (
    Row,
    RowTable,
    Sampling,
    Share,
    Span,
    Study,
    batch_rows,
    compute_yield,
    definition,
    grid,
    latin_hypercube,
    load_study,
    monte_carlo,
    over_grid,
    prepare_study,
    read_csv,
    sobol,
    sobol_note,
    split_into_blocks,
)

PROBLEM = tmsopt.Problem(
    tmsopt.models.tms,
    fixed={"chi_H": 1.0, "zeta_H": -0.2, "zeta_B": -0.4, "mu": 0.1},
    free={"chi_B": (1.01, 3.0), "Fr": (0.1, 5.0), "lambda_s": (0.05, 1.2)},
    constraints={"decay": "abscissa <= -0.8", "arm": "nu_H >= 0.01", "layout": "chi_B >= chi_H"},
    minimize="Fr",
    start={"Fr": 4.0},
)
ABOUT = {"mu": [0.1, 0.2]}


# Rows


def test_grid_is_the_product_of_its_axes_in_order():
    axes = {"mu": (0.1, 0.3, 0.2), "zeta_H": (-0.2, -0.3), "decay.limit": (-1.0, -0.5, 0.0, -0.7)}
    study = over_grid(PROBLEM, axes)
    assert [tuple(study.varied(k).values()) for k in range(len(study))] == list(itertools.product(*axes.values()))
    assert dict(study.grid_shape) == {"mu": 3, "zeta_H": 2, "decay.limit": 4}


def test_points_of_an_axis():
    even = Span(-1.6, -0.1).points(31)
    assert even == [-(16 - k / 2) / 10 for k in range(30)] + [-0.1]  # the doubles nearest to -1.6, -1.55, …
    ends = (math.radians(1), math.radians(80))
    assert (Span(*ends).points(7)[0], Span(*ends).points(7)[-1]) == ends
    assert Span(0.001, 1000, log=True).points(7) == [0.001, 0.01, 0.1, 1, 10, 100, 1000]
    assert Span(-0.2, -3.2, log=True).points(5) == pytest.approx([-0.2, -0.4, -0.8, -1.6, -3.2], rel=1e-14)
    assert Span(-1, 2).points(4) == [-1, 0, 1, 2]


def test_latin_hypercube_has_one_row_in_every_part_of_every_range():
    rows, ranges = 50, {"a": (0, 1), "b": Span(1, 2**50, log=True), "c": (0, 50)}
    sample = latin_hypercube(ranges, rows, seed=3)
    for part in (np.asarray(sample["a"]) * rows, np.log2(sample["b"]), np.asarray(sample["c"])):
        assert sorted(np.floor(part).astype(int)) == list(range(rows))
    assert sample == latin_hypercube(ranges, rows, seed=3) != latin_hypercube(ranges, rows, seed=4)


def test_sobol_rows_begin_the_longer_sample_and_say_what_they_lack():
    sample, longer = (sobol({"a": (0, 1), "b": (2, 3)}, rows, seed=1) for rows in (100, 128))  # warnings are errors
    for name, column in sample.items():
        assert column == longer[name][:100]
    assert "128" in sobol_note(100)
    assert sobol_note(128) == ""
    assert len(sobol({"a": (0, 1)}, 1, seed=1)["a"]) == 1


@given(st.floats(-100, 100), st.floats(-100, 100), st.integers(0, 9), st.booleans())
@settings(max_examples=30, deadline=None)
def test_samples_stay_in_their_ranges(low, high, seed, log):
    low, high = min(low, high), max(low, high)
    least, most = sorted((abs(low), abs(high)))
    # A range whose ends have a ratio beyond doubles is refused on a logarithmic scale.
    span = Span(low, high, log and low * high > 0 and most / 1e300 < least)
    for values in (latin_hypercube({"a": span}, 9, seed)["a"], sobol({"a": span}, 9, seed)["a"]):
        assert all(low <= value <= high for value in values)


def test_seeds_are_those_of_independent_streams():
    study = Study(PROBLEM, {"mu": [0.1] * 300}, seed=7)
    seeds = [study.seed_of(k) for k in range(300)]
    children = np.random.SeedSequence(7).spawn(300)
    assert seeds == [int(child.generate_state(1)[0]) % 2**31 for child in children]
    assert len(set(seeds)) == 300
    assert not set(seeds) & {replace(study, seed=8).seed_of(k) for k in range(300)}


def test_problem_of_a_row():
    columns = {"mu": [0.3], "lambda_s.max": [0.9], "chi_B.min": [1.1], "Fr.max": [3.0], "decay.limit": [-1 / 3]}
    problem = Study(PROBLEM, columns).row_problem(0)
    assert problem.fixed == {**PROBLEM.fixed, "mu": 0.3}
    assert problem.free == {"chi_B": (1.1, 3.0), "Fr": (0.1, 3.0), "lambda_s": (0.05, 0.9)}
    assert problem.constraints == {**PROBLEM.constraints, "decay": f"abscissa <= {-1 / 3!r}"}
    assert problem.posed.conditions["decay"].sides({"abscissa": 2.0}) == (2.0, -1 / 3)
    assert problem.start == {"Fr": 3.0}  # moved to the nearer of the row's own bounds
    assert Study(PROBLEM, {"Fr.min": [5.0]}).row_problem(0).fixed["Fr"] == 5.0  # no room left: fixed


def test_row_that_cannot_be_posed_says_why():
    pose = Study(PROBLEM, {"lambda_s.min": [1.3, 0.1], "zeta_H": [-0.1, 0.2]}).row_problem
    for row, words in enumerate(("min = 1.3 is greater than max = 1.2", "zeta_H = 0.2 is not physical", "0 to 1")):
        assert words in faults(pose, row)


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("nu_H >= 0.02", 0.02),
        ("abscissa<=-0.8", -0.8),
        ("abscissa <= - 0.8", -0.8),
        ("1e-3 <= nu_H", 1e-3),
        ("(chi_B - 1)*2 >= +.5", 0.5),
        ("chi_B >= chi_H", None),
        ("chi_B - 1 >= 2*3", None),
        ("nu_H >= pi", None),
        ("(0.2) <= (nu_H - 1)", 0.2),
    ],
)
def test_number_that_a_constraint_compares_with(text, number):
    assert limit_value(text) == number
    if number is None:
        with pytest.raises(ValueError, match="two expressions"):
            replace_limit(text, 1.0)
        return
    for value in (0.1 + 0.2, -5e-324, 1e300, 0.0):
        problem = replace(PROBLEM, constraints={"c": replace_limit(text, value)})
        own = replace(PROBLEM, constraints={"c": text}).posed.conditions["c"]
        values = dict.fromkeys(PROBLEM.posed.vocabulary, 0.7)
        sides, before = problem.posed.conditions["c"].sides(values), own.sides(values)
        assert (problem.posed.conditions["c"].comparison, value in sides) == (own.comparison, True)
        assert {*sides} - {value} == {*before} - {number}  # the other side is what it was


def test_limit_of_no_comparison():
    with pytest.raises(ExpressionError):
        limit_value("nu_H + 1")


# Neighbours


def steps(study, order):
    """Number of axes in which consecutive rows differ, and the largest step in an axis, in places."""
    places = [np.unique(np.asarray(c), return_inverse=True)[1] for c in study.columns.values()]
    walk = np.diff(np.array(places)[:, order], axis=1)
    return (walk != 0).sum(axis=0), np.abs(walk).max()


@given(st.lists(st.integers(1, 5), min_size=1, max_size=4), st.integers(1, 40), st.randoms())
@settings(max_examples=30, deadline=None)
def test_grid_is_walked_one_step_in_one_axis_at_a_time(sizes, size, shuffler):
    names = ("mu", "chi_H", "zeta_B", "decay.limit")
    axes = {name: shuffler.sample(range(50), n) for name, n in zip(names, sizes, strict=False)}
    study = over_grid(PROBLEM, axes)
    cut = split_into_blocks(study, size)
    order = [row for block in cut for row in block]
    assert sorted(order) == list(range(len(study)))
    assert all(len(block) == size for block in cut[:-1])
    if len(study) > 1:
        changed, largest = steps(study, order)
        assert (set(changed), largest) == ({1}, 1)


@pytest.mark.parametrize("axes", [{"mu": 16, "chi_H": 16}, {"mu": 8, "chi_H": 8, "zeta_B": 8}, {"mu": 256}])
def test_other_rows_follow_a_hilbert_curve(axes):
    """Its property: on a cube of 2^n cells a side, consecutive cells share a face (Hilbert 1891)."""
    points = list(itertools.product(*(range(n) for n in axes.values())))
    random.Random(0).shuffle(points)
    study = Study(PROBLEM, dict(zip(axes, np.array(points, float).T, strict=True)))
    changed, largest = steps(study, [row for block in split_into_blocks(study) for row in block])
    assert (set(changed), largest) == ({1}, 1)


def test_blocks_of_rows_that_are_all_alike():
    assert split_into_blocks(Study(PROBLEM, {"mu": [0.1] * 5}), 2) == [(0, 1), (2, 3), (4,)]


# Definitions


def test_definition_is_plain_data_and_the_same_for_the_same_rows():
    study = over_grid(PROBLEM, {"mu": [0.1, 0.2], "zeta_H": [-0.2, -0.3, -0.4]}, report=["nu_H"])
    text = json.dumps(definition(study), allow_nan=False)
    assert json.loads(text) == definition(study)
    assert definition(pickle.loads(pickle.dumps(study))) == definition(study)
    assert pickle.loads(pickle.dumps(study)) == study
    renamed = replace(study, title="another", problem=replace(PROBLEM, title="another"), notes=["read this"])
    assert definition(renamed) == definition(study)


BASE = Study(PROBLEM, ABOUT)
IN_ANOTHER_ORDER = {name: PROBLEM.free[name] for name in ("Fr", "chi_B", "lambda_s")}
CHANGED = [
    {"seed": 1},
    {"starts": 3},
    {"warm": True},
    {"report": ["nu_H"]},
    {"columns": {"mu": [0.1, np.nextafter(0.2, 1)]}},
    {"columns": {"mu": [0.1, 0.2, 0.3]}},
    {"columns": {"chi_H": [0.1, 0.2]}},
    {"columns": {"mu": [0.2, 0.1]}},
]
BAND = {"min": 0.9, "max": 1.0}
ASKED = [
    {"free": IN_ANOTHER_ORDER},
    {"fixed": {**PROBLEM.fixed, "zeta_B": np.nextafter(-0.4, 0)}},
    {"free": {**PROBLEM.free, "Fr": (0.1, 6.0)}},
    {"constraints": {**PROBLEM.constraints, "arm": "nu_H >= 0.03"}},
    {"minimize": "Fr + 0"},
    {"minimize": None, "maximize": "Fr"},
    {"locate": "EP4"},
    {"start": {"Fr": 3.0}},
    {"scenarios": {"chi_H": [0.9, 1.0]}},
    {"scenarios": {"chi_H": BAND}},
    {"scenarios": {"chi_H": {**BAND, "points": 3}}},
    {"tolerances": {"zeta_B": 0.01}},
    {"weights": {"Fr": 1.0}},
]


def test_definition_changes_with_everything_that_a_row_follows_from():
    changes = [{}, *CHANGED, *({"problem": replace(PROBLEM, **asked)} for asked in ASKED)]
    assert len({json.dumps(definition(replace(BASE, **change))) for change in changes}) == len(changes)


def test_column_cannot_be_changed():
    column = Column([1, 2.5])
    for one in (column, pickle.loads(pickle.dumps(column))):
        with pytest.raises(ValueError, match="read-only"):
            np.asarray(one)[0] = 3
    assert (list(column), column[-1], len(column[1:])) == ([1.0, 2.5], 2.5, 1)


# Faults of a study


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"mu.max": [1.0]}, "mu is fixed; vary mu itself"),
        ({"arms.limit": [1.0]}, "did you mean 'arm.limit'"),
        ({"layout.limit": [1.0]}, "chi_B >= chi_H; number alone on one side"),
        ({"mu": [0.1, 0.2], "chi_H": [1.0]}, "different lengths; mu has 2; chi_H has 1"),
        ({"mu": [0.1, math.nan, math.inf]}, "nan in row 1 and 1 more; finite"),
        ({"mu": []}, "0 rows; accepted: 1 to 10000000"),
        ({"mu": np.zeros(10_000_001)}, "10000001 rows; accepted: 1 to 10000000"),
        ({}, "nothing varies; decay.limit"),
        ([0.1], "[0.1]; such as {'mu': [0.1, 0.2]}"),
        ({"mu": 0.1}, "0.1; a list of numbers"),
        ({"mu": "0.1"}, "'0.1'; a list of numbers"),
        ({"mu": [True]}, "True; a list of numbers"),
    ],
)
def test_faults_of_columns(columns, words):
    assert_faults(words, Study, PROBLEM, columns)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"seed": -1}, "-1; 0 or more"),
        ({"report": "nu_H"}, "'nu_H'; a list, such as"),
        ({"report": ["nu_H >= 1"]}, "is a comparison"),
        ({"grid_shape": {"mu": 3}}, "'mu': 3} for 2 rows"),
        ({"grid_shape": {"chi_H": 2}}, "chi_H; each column; (mu)"),
        (
            {"columns": {"mu": [1, 2, 1, 2], "chi_H": [1, 1, 2, 2]}, "grid_shape": {"mu": 2, "chi_H": 2}},
            "'chi_H': 2} for 4 rows; last axis changes fastest",
        ),
        ({"problem": "least_speed.toml"}, "a Problem"),
        ({"problem": replace(PROBLEM, minimize=None)}, "no objective"),
        ({"problem": replace(PROBLEM, minimize=None, pareto=["Fr", "abscissa"])}, "asks for a front"),
        ({"problem": replace(PROBLEM, scenarios={"mu": [0.1, 0.2]})}, "mu has a scenario"),
    ],
)
def test_faults_of_a_study(options, words):
    assert_faults(words, Study, **({"problem": PROBLEM, "columns": ABOUT} | options))


def assert_faults(words, call, *given, **options):
    text = faults(call, *given, **options)
    assert all(word in text for word in words.split("; ")), text


@pytest.mark.parametrize(
    ("sample", "ranges", "rows", "words"),
    [
        (sobol, {"a": (1, 0)}, 8, "min = 1 is greater than max = 0"),
        (sobol, {"a": Span(-1, 1, log=True)}, 8, "both ends positive, or both negative"),
        (sobol, {"a": (-1e308, 1e308)}, 8, "wider than a double can hold"),
        (sobol, {"a": Span(-1e308, -5e-324, log=True)}, 8, "wider than a double can hold"),
        (latin_hypercube, {"a": (0, math.inf)}, 8, "accepted: finite numbers"),
        (latin_hypercube, {"a": 3}, 8, "found 3"),
        (latin_hypercube, {}, 8, "nothing varies"),
        (latin_hypercube, {"a": (0, 1)}, 0, "found 0; accepted: a whole number from 1 to 10000000"),
    ],
)
def test_faults_of_a_sample(sample, ranges, rows, words):
    assert_faults(words, sample, ranges, rows)


def test_a_grid_of_too_many_rows_is_refused():
    assert_faults("10000 x 1001 = 10010000 rows", grid, {"a": range(10_000), "b": range(1001)})


# Study files

FILE = """\
title = "How low"
problem = "least.toml"

[study]
seed = 3
starts = 5
warm = true
report = ["nu_H", "2*Fr_c"]

[vary]
mu = { min = 0.05, max = 0.8, points = 5, log = true }
zeta_H = [-0.2, -0.25]
"lambda_s.max" = ["20 deg", "30 deg"]
arm.limit = [0.02, 0.05, 0.1]
# end
"""
LEAST = """\
[parameters]
chi_H = 1.0
zeta_H = -0.2
zeta_B = -0.4
mu = 0.1
chi_B = { min = 1.01, max = 3 }
Fr = { min = 0.1, max = 5 }
lambda_s = { min = 0.05, max = 1.2 }
[objective]
minimize = "Fr"
[constraints]
arm = "nu_H >= 0.02"
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "least.toml").write_text(LEAST, encoding="utf-8")
    return tmp_path


def loaded(folder, text):
    (folder / "study.toml").write_text(text, encoding="utf-8")
    return load_study(folder / "study.toml")


def test_the_example_of_a_grid(folder):
    study = loaded(folder, FILE)
    assert (study.title, study.seed, study.starts, study.warm, study.method) == ("How low", 3, 5, True, "grid")
    assert study.report == ("nu_H", "2*Fr_c")
    assert dict(study.grid_shape) == {"mu": 5, "zeta_H": 2, "lambda_s.max": 2, "arm.limit": 3}
    assert study.problem == tmsopt.load(folder / "least.toml")
    assert sorted({*study.columns["mu"]}) == pytest.approx([0.05, 0.1, 0.2, 0.4, 0.8], rel=1e-14)
    assert dict(study.varied(3)) == {"mu": 0.05, "zeta_H": -0.2, "lambda_s.max": math.radians(30), "arm.limit": 0.02}


def test_problem_inside_a_study_file(folder):
    inside = LEAST.replace("[parameters]", "[problem.parameters]").replace("[objective]", "[problem.objective]")
    inside = inside.replace("[constraints]", "[problem.constraints]")
    text = FILE.replace('problem = "least.toml"\n', "").replace("[study]", inside + "[study]")
    assert definition(loaded(folder, text)) == definition(loaded(folder, FILE))


def test_other_methods_of_a_file(folder):
    head = 'problem = "least.toml"\n[study]\nrows = 8\nmethod = '
    span = "[vary]\nmu = { min = 0.1, max = 10, log = true }\nlambda_s.max = { min = '20 deg', max = 1 }\n"
    ranges = {"mu": Span(0.1, 10, log=True), "lambda_s.max": (math.radians(20), 1.0)}
    assert loaded(folder, head + '"sobol"\n' + span).columns == Table(sobol(ranges, 8))
    assert loaded(folder, head + '"latin_hypercube"\nseed = 5\n' + span).columns == Table(latin_hypercube(ranges, 8, 5))
    lists = 'problem = "least.toml"\n[study]\nmethod = "list"\n[vary]\nmu = [1, 2]\nFr.max = [3, 4.5]\n'
    assert loaded(folder, lists).columns == Table({"mu": Column([1, 2]), "Fr.max": Column([3, 4.5])})
    (folder / "rows.csv").write_text("mu,lambda_s.max\n0.1,20 deg\n0.2,0.5\n", encoding="utf-8")
    rows = loaded(folder, 'problem = "least.toml"\n[study]\nmethod = "csv"\ncsv = "rows.csv"\n')
    assert rows.columns == Table({"mu": Column([0.1, 0.2]), "lambda_s.max": Column([math.radians(20), 0.5])})
    assert rows.grid_shape is None
    drawn = loaded(folder, head + '"monte_carlo"\nseed = 2\n[tolerances]\nlambda_s = "1 deg"\nchi_B = "5 mm"\n')
    assert isinstance(drawn, Sampling)
    assert (drawn.rows, drawn.seed, drawn.distribution) == (8, 2, "uniform")
    assert dict(drawn.tolerances) == {"lambda_s": math.radians(1), "chi_B": 0.005}


HEAD = 'problem = "least.toml"\n[study]\nmethod = "{}"\nrows = 8\n[{}]\n# end\n'
BASES = {"grid": FILE, "sobol": HEAD.format("sobol", "vary"), "drawn": HEAD.format("monte_carlo", "tolerances")}
BAD = r"""
grid  | [vary] => [varied]                         | 10 | varied; did you mean 'vary'
grid  | warm => wram                               | 7  | wram; did you mean 'warm'
grid  | # end => [constraints]\na = 'Fr >= 1'      | 15 | [problem.constraints]
grid  | problem = "least.toml" =>                  | 1  | missing problem
grid  | least.toml => last.toml                    | 2  | last.toml; did you mean 'least.toml'; relative
grid  | "least.toml" => 3                          | 2  | 3; problem file
grid  | seed = 3 => seed = "3"                     | 5  | '3'; a whole number, 0 or more
grid  | starts = 5 => starts = 0                   | 6  | 0; from 1 to
grid  | warm = true => warm = 1                    | 7  | 1; true or false
grid  | ["nu_H", "2*Fr_c"] => "nu_H"               | 8  | nu_H; a list of expressions
grid  | 2*Fr_c => 2*Frc                            | 8  | Frc; did you mean
grid  | seed = 3 => method = "gird"                | 5  | gird; did you mean 'grid'
grid  | seed = 3 => rows = 3                       | 5  | rows does not go with method = "grid"
grid  | seed = 3 => csv = "r.csv"                  | 5  | accepted for csv
grid  | # end => [tolerances]\nmu = 0.01           | 15 | monte_carlo
grid  | zeta_H => zeta_h                           | 12 | zeta_h; did you mean 'zeta_H'
grid  | zeta_H => Fr                               | 12 | Fr is free; fix it, or vary Fr.min or Fr.max
grid  | points = 5, =>                             | 11 | missing points of mu; points = 10
grid  | points = 5 => points = 1                   | 11 | 1; from 2
grid  | points = 5 => point = 5                    | 11 | point; did you mean 'points'
grid  | min = 0.05 => min = -0.05                  | 11 | -0.05; both ends positive
grid  | min = 0.05 => min = 5                      | 11 | min = 5; swap them
grid  | log = true => log = 1                      | 11 | 1; true or false
grid  | [-0.2, -0.25] => -0.2                      | 12 | -0.2; a list of values
grid  | [-0.2, -0.25] => []                        | 12 | []; a list of values
grid  | -0.25 => nan                               | 12 | nan; finite
grid  | -0.25 => true                              | 12 | True; finite
grid  | 20 deg => 20 m                             | 13 | 'm'; 5 deg
grid  | 0.02, 0.05 => "2 deg", 0.05                | 14 | 2 deg; dimensionless
grid  | points = 5 => points = 9999999             | 10 | accepted: up to 10000000
grid  | seed = 3 => seed = = 3                     | 5  | not TOML
sobol | # end =>                                   | 5  | nothing varies; such as mu
sobol | # end => mu = { min = 1, max = 2, points = 3 } | 6 | a sample has rows
sobol | # end => mu = [1, 2]                       | 6  | [1, 2]; { min = 0.1, max = 1 }
sobol | rows = 8\n => & # end => mu = { min = 1, max = 2 } | 3 | missing rows; 1024
sobol | rows = 8 => rows = 0 & # end => mu = { min = 1, max = 2 } | 4 | 0; from 1
sobol | rows = 8\n => & sobol => list & # end => mu = [1, 2]\nFr.max = [3] | 4 | Fr.max has 1
sobol | rows = 8\n[vary] => csv = "r.csv" & sobol => csv | 4 | r.csv; no such
sobol | rows = 8\n[vary] => & sobol => csv         | 3  | missing csv
drawn | # end =>                                   | 5  | no tolerances
drawn | # end => chi_b = 1                         | 6  | chi_b; did you mean 'chi_B'
drawn | # end => chi_B = "5 kg"                    | 6  | kg
drawn | # end => chi_B = 0                         | 6  | 0; greater than 0
drawn | rows = 8 => rows = 8\ndistribution = "gauss" | 5 | gauss; uniform normal
drawn | rows = 8 => rows = 8\nwarm = true          | 5  | no free parameters
drawn | # end => mu = 0.1\n[vary]\nmu = [1]        | 7  | [vary] does not go with
"""
"""File, what is changed in it, line at fault, words that the message must contain."""


@pytest.mark.parametrize("case", BAD.strip().splitlines())
def test_faults_of_a_file_are_placed_and_explained(folder, case):
    base, changes, line, words = (part.strip() for part in case.split("|"))
    text = BASES[base]
    for change in changes.split("&"):
        old, new = (part.strip().replace(r"\n", "\n") for part in change.split("=>"))
        assert old in text
        text = text.replace(old, new)
    with pytest.raises(tmsopt.InputError) as caught:
        loaded(folder, text)
    message = "\n".join(str(f) for f in caught.value.faults if f.line == int(line))
    assert all(word in message for word in (*words.split("; "), str(folder / "study.toml"))), str(caught.value)


def test_all_faults_of_a_file_at_once(folder):
    text = FILE.replace("seed = 3", "seed = -3").replace("2*Fr_c", "nuh").replace("-0.25", "nan").replace("deg", "m")
    with pytest.raises(tmsopt.InputError) as caught:
        loaded(folder, text)
    assert [f.line for f in caught.value.faults] == [5, 8, 12, 13, 13]


def test_faults_of_the_problem_are_placed_in_its_own_file_or_section(folder):
    (folder / "least.toml").write_text(LEAST.replace("mu = 0.1", "mu = nan"), encoding="utf-8")
    text = faults(loaded, folder, FILE)
    assert f"{folder / 'least.toml'}:5: parameters.mu" in text
    inside = FILE.replace('problem = "least.toml"', "") + "[problem.parameters]\nchi_h = 1\n"
    assert f"{folder / 'study.toml'}:17: problem.parameters.chi_h: unknown" in faults(loaded, folder, inside)


def test_a_problem_is_told_from_a_study(folder):
    text = faults(load_study, folder / "least.toml")
    assert "tmsopt solve" in text
    assert 'problem = "least.toml"' in text


# CSV


@given(st.lists(st.tuples(*[st.floats(allow_nan=False, allow_infinity=False)] * 2), min_size=1, max_size=20))
@settings(max_examples=30, deadline=None)
def test_csv_gives_every_bit_back(tmp_path_factory, rows):
    path = tmp_path_factory.mktemp("rows") / "rows.csv"
    lines = ["mu,decay.limit", *(f"{a!r}, {b!r}" for a, b in rows), ""]
    path.write_bytes(b"\xef\xbb\xbf" + "\r\n".join(lines).encode())  # as spreadsheets write it
    columns = read_csv(path)
    assert list(columns) == ["mu", "decay.limit"]
    assert [c.hex() for c in columns["mu"]] == [a.hex() for a, _ in rows]
    assert [c.hex() for c in columns["decay.limit"]] == [b.hex() for _, b in rows]


CELLS = r"""
                             | 1 | the first line is empty
mu,chi_H\n                   | 1 | no rows below the names
0.1,0.2\n0.3,0.4\n           | 1 | the number 0.1 for the name of column 1
mu,,chi_H\n1,2,3\n           | 1 | column 2 has no name
mu,mu\n1,2\n                 | 1 | names two columns
mu;chi_H\n0,1;0,2\n          | 1 | separated by semicolons
mu\tchi_H\n0.1\t0.2\n        | 1 | separated by tabs
mu,chi_H\n1,2\n0,1,0,2\n     | 3 | found 4 cells; accepted: 2
mu,chi_H\n\n1\n              | 3 | found 1 cells; accepted: 2
mu,chi_H\n1,2\n3,\n          | 3 | chi_H: an empty cell
mu,chi_H\n1,two\n            | 2 | chi_H: found 'two'
mu,chi_H\nnan,2\n            | 2 | mu: found 'nan'
mu,chi_H\n1,1e999\n          | 2 | chi_H: found '1e999'
mu,chi_H\n1_0,2\n            | 2 | mu: found '1_0'
mu,chi_H\n1,20 deg\n         | 2 | chi_H: found '20 deg'
mu,chi_H\n1,"2\n             | 2 | not CSV
"""
"""Text of the file, line at fault, words of the message."""


@pytest.mark.parametrize("case", CELLS.splitlines()[1:])
def test_faults_of_a_csv_file(tmp_path, case):
    text, line, words = (part.strip() for part in case.split(" | "))
    path = tmp_path / "rows.csv"
    path.write_text(text.replace(r"\n", "\n").replace(r"\t", "\t"), encoding="utf-8", newline="")
    found = faults(read_csv, path)
    assert f"{path}:{line}: " in found
    assert words in found


def test_faults_of_a_csv_file_as_a_whole(tmp_path):
    path = tmp_path / "rows.csv"
    path.write_bytes("mu\n1\n".encode("utf-16"))
    assert f"{path}:1: not CSV: byte 0xff is not UTF-8" in faults(read_csv, path)
    assert "is a directory" in faults(read_csv, tmp_path)
    path.write_text("mu\n" + "x\n" * 1000, encoding="utf-8")
    assert len(faults(read_csv, path).splitlines()) == 21


def test_names_of_a_csv_file_are_checked_at_its_first_line(folder):
    (folder / "rows.csv").write_text("mu,zeta_h\n1,2\n", encoding="utf-8")
    text = faults(loaded, folder, 'problem = "least.toml"\n[study]\nmethod = "csv"\ncsv = "rows.csv"\n')
    assert f"{folder / 'rows.csv'}:1: zeta_h: unknown name 'zeta_h'; did you mean 'zeta_H'?" in text


# Monte Carlo


@pytest.fixture(scope="module")
def design():
    """The EP4 of the paper; tolerances that its search did not know of."""
    constraints = {"arm": "nu_H >= 0.01", "equal": "omega0 == -1.8803015465431968"}
    found = tmsopt.solve(replace(PROBLEM, constraints=constraints, minimize="abscissa"))
    return replace(found, problem=replace(found.problem, tolerances={"chi_B": 0.01, "lambda_s": 0.02}))


def test_monte_carlo_draws_around_the_design(design):
    study = monte_carlo(design, 4000, seed=1)
    assert (study.problem.free, study.problem.tolerances, list(study.columns)) == ({}, {}, ["chi_B", "lambda_s"])
    assert study.problem.fixed == dict(design.parameters)
    assert list(study.problem.constraints) == ["arm"]
    assert "equal" in study.notes[0]
    for name, tolerance in design.problem.tolerances.items():
        errors = (np.asarray(study.columns[name]) - design.parameters[name]) / tolerance
        assert np.abs(errors).max() <= 1 + 1e-13  # of a sum that is rounded
        assert errors.mean() == pytest.approx(0, abs=4 / math.sqrt(3 * 4000))  # four standard errors
        assert errors.var() == pytest.approx(1 / 3, abs=4 * math.sqrt(4 / 45 / 4000))
    problem = study.row_problem(17)
    assert (problem.free, problem.fixed["chi_B"]) == ({}, study.columns["chi_B"][17])


def test_monte_carlo_normal(design):
    study = monte_carlo(design, 4000, 1, "normal", {"Fr": 0.3})
    errors = (np.asarray(study.columns["Fr"]) - design.parameters["Fr"]) / 0.1
    assert np.abs(errors).max() <= 3 + 1e-13
    density = math.exp(-4.5) / math.sqrt(2 * math.pi)
    variance = 1 - 6 * density / math.erf(3 / math.sqrt(2))  # of a normal distribution cut at three deviations
    assert errors.var() == pytest.approx(variance, abs=4 * math.sqrt(2 / 4000))
    assert np.mean(np.abs(errors) < 1) == pytest.approx(0.6827 / 0.9973, abs=4 * math.sqrt(0.22 / 4000))


def test_parameters_are_drawn_independently_of_each_other_and_of_the_row_before(design):
    study = monte_carlo(design, 4000, 1, "normal", {"Fr": 0.3, "mu": 0.01, "chi_B": 0.02})
    columns = np.array([np.asarray(column) for column in study.columns.values()])
    every = np.concatenate([columns[:, 1:], columns[:, :-1]])
    correlation = np.corrcoef(every) - np.eye(len(every))
    assert np.abs(correlation).max() < 5 / math.sqrt(4000)  # five standard errors, for the greatest of fifteen


def test_monte_carlo_is_reproducible_and_longer_ones_begin_alike(design):
    study = monte_carlo(design, 50, seed=1)
    assert study.columns == monte_carlo(design, 50, seed=1).columns != monte_carlo(design, 50, seed=2).columns
    for name, column in monte_carlo(design, 80, seed=1).columns.items():
        assert column[:50] == study.columns[name]


def test_monte_carlo_plans_from_its_problem(design):
    tolerances = dict(design.problem.tolerances)
    sampling = Sampling(design.problem.posed.nominal, 20, seed=1, tolerances=tolerances)
    assert prepare_study(sampling).columns == monte_carlo(design, 20, seed=1).columns
    study = Study(PROBLEM, ABOUT)
    assert prepare_study(study) is study
    with pytest.raises(tmsopt.NotSolved):
        monte_carlo(replace(design, status="infeasible"), 20)


def test_faults_of_monte_carlo(design):
    words = "from 1 to; 0 or more; accepted: uniform normal; did you mean 'chi_B'; greater than 0"
    assert_faults(words, monte_carlo, design, 0, -1, "gauss", {"chi_b": 1.0, "chi_B": -1.0})
    assert_faults("not physical", monte_carlo, design, 5, tolerances={"zeta_H": 0.3})
    problem = replace(PROBLEM, scenarios={"mu": [0.1, 0.2]}, tolerances={"mu": 0.01})
    assert_faults("mu has a scenario", Sampling, problem, 10)


@pytest.mark.parametrize(
    ("count", "of", "low", "high"),
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_wilson_interval_of_newcombe(count, of, low, high):
    """Table I of R. G. Newcombe, Stat. Med. 17, 857 (1998), method 3, printed to 4 decimals."""
    assert Share(count, of).interval == pytest.approx((low, high), abs=5e-5)
    assert Share(of - count, of).interval == pytest.approx((1 - high, 1 - low), abs=5e-5)


def test_yield_counts_rows_by_what_they_are():
    kinds = [("optimal", -1.0), ("optimal", 0.5), ("infeasible", -2.0), ("infeasible", math.nan), ("failed", math.nan)]
    study = Study(PROBLEM, {"mu": [0.1] * 5})
    rows = [Row(k, 0, Table(), status, abscissa=abscissa) for k, (status, abscissa) in enumerate(kinds)]
    found = compute_yield(RowTable(study, [batch_rows(rows)]))
    assert (found.stable, found.feasible, found.good) == (Share(2, 4), Share(2, 4), Share(1, 4))
    assert found.failed == 1
    assert dict(found.abscissa) == {"0.05": -2.0, "0.25": -2.0, "0.5": -1.0, "0.75": 0.5, "0.95": math.inf}
    assert json.loads(json.dumps(found.to_json(), allow_nan=False))["stable"]["share"] == 0.5
    assert math.isnan(compute_yield(RowTable(study, [])).stable.share)


# The studies in problems/


@pytest.mark.parametrize(
    ("name", "rows"), [("study_sway", 15), ("study_heights", 32), ("study_decay", 31), ("study_built", 500)]
)
def test_rows_of_the_studies_in_the_repository(name, rows):
    study = prepare_study(load_study(hunt.PROBLEMS / f"{name}.toml"))
    assert (len(study), study.notes) == (rows, ())
    for row in range(0, rows, 7):
        study.row_problem(row)


def test_what_study_built_promises():
    """By eigenvalues of the rows; a design that is a little off has simple roots, good to 1e-8."""
    study = prepare_study(load_study(hunt.PROBLEMS / "study_built.toml"))
    fixed = {name: np.asarray(value) for name, value in study.problem.fixed.items()}
    found = hunt.abscissa({**fixed, **{name: np.asarray(column) for name, column in study.columns.items()}})
    assert np.median(found) == pytest.approx(-1.36, abs=0.005)
    assert found.max() == pytest.approx(-1.1, abs=0.05)


@pytest.mark.slow
def test_what_study_sway_promises():
    study = load_study(hunt.PROBLEMS / "study_sway.toml")
    at = {
        (round(study.varied(k)["little_sway.limit"], 9), round(math.degrees(study.varied(k)["lambda_s.max"]))): k
        for k in range(len(study))
    }
    value = {
        place: tmsopt.solve(study.row_problem(at[place])).value
        for place in ((0.1, 10), (0.7, 10), (0.9, 20), (0.9, 30))
    }
    assert value[0.1, 10] < value[0.7, 10] < 0.985 * value[0.1, 10]
    assert value[0.9, 20] == pytest.approx(value[0.9, 30], abs=1e-8)
