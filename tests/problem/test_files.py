"""Problem files: the contract's example loads, and every kind of bad input is refused with its place."""

import math
import pickle
from pathlib import Path

import pytest

import tmsopt
from tmsopt.files import MAX_FILE_BYTES
from tmsopt.problem import as_solvable

STUDIES = set(Path("problems").glob("study_*.toml"))

GOOD = """\
title = "EP4 of the chi_H = 1 bicycle"
model = "tms"

[parameters]                  # a number fixes; a table frees
chi_H = 1.0
zeta_H = -0.2
zeta_B = -0.4
mu = 0.1
chi_B = { min = 1.01, max = 5 }
Fr = { min = 0.01, max = 10, start = 2 }
lambda_s = { min = "1 deg", max = "80 deg" }

[objective]
minimize = "abscissa"

[constraints]
trail = "nu_H >= 0.02"
layout = "chi_B - chi_H >= 0.1"
"""


@pytest.fixture
def write(tmp_path):
    def write(text):
        path = tmp_path / "problem.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_the_example_of_the_contract(write):
    problem = tmsopt.load(write(GOOD))
    assert problem.title == "EP4 of the chi_H = 1 bicycle"
    assert problem.fixed == {"chi_H": 1.0, "zeta_H": -0.2, "zeta_B": -0.4, "mu": 0.1}
    assert problem.free["lambda_s"] == pytest.approx((math.radians(1), math.radians(80)), rel=1e-15)
    assert problem.start == {"Fr": 2.0}
    assert problem.constraints == {"trail": "nu_H >= 0.02", "layout": "chi_B - chi_H >= 0.1"}
    assert (problem.minimize, problem.maximize, problem.locate) == ("abscissa", None, None)
    assert pickle.loads(pickle.dumps(problem)) == problem


def test_si_units_and_the_default_gravity(write):
    text = """
[parameters]
w = "110 cm"
v = { min = "5 km/h", max = "15 km/h" }
lambda_s = "5 deg"
m_B = "10 kg"
x_B = 1.2
z_B = "-400 mm"
m_H = "500 g"
x_H = "1.02 m"
z_H = -0.2
[objective]
maximize = "v - v_c"
"""
    problem = tmsopt.load(write(text))
    assert problem.fixed["g"] == 9.81
    assert problem.fixed["w"] == pytest.approx(1.1, rel=1e-15)
    assert problem.fixed["m_H"] == pytest.approx(0.5, rel=1e-15)
    assert problem.free["v"] == pytest.approx((5 / 3.6, 15 / 3.6), rel=1e-15)
    assert problem.posed.parameter_set.name == "SI"


# part of the good file, what is written instead, line at fault, words that the message must contain
BAD = {
    "unknown section": (GOOD, "[paramters]\nx = 1\n" + GOOD, 1, ["paramters", "did you mean 'parameters'"]),
    "unknown key of a parameter": ("start = 2", "strat = 2", 10, ["strat", "did you mean 'start'"]),
    "misspelt parameter": ("chi_H = 1.0", "chi_h = 1.0", 5, ["chi_h", "did you mean 'chi_H'"]),
    "missing parameter": ("mu = 0.1\n", "", 4, ["missing parameter mu"]),
    "min above max": ("min = 1.01", "min = 7", 9, ["7", "5", "swap"]),
    "missing max": ("{ min = 1.01, max = 5 }", "{ min = 1.01 }", 9, ["missing max"]),
    "start outside": ("start = 2", "start = 20", 10, ["start", "20", "0.01", "10"]),
    "wrong unit": ('"1 deg"', '"1 kg"', 11, ["kg", "deg"]),
    "unit on a dimensionless number": ("mu = 0.1", 'mu = "0.1 kg"', 8, ["0.1 kg", "dimensionless"]),
    "not physical": ("zeta_B = -0.4", "zeta_B = 0.4", 7, ["zeta_B", "0.4", "<= 0"]),
    "tilt beyond 90 degrees": ('"80 deg"', '"95 deg"', 11, ["lambda_s", "1.5708"]),
    "nan": ("mu = 0.1", "mu = nan", 8, ["nan", "finite"]),
    "mixed sets": ("mu = 0.1", "mu = 0.1\nm_B = 10", 9, ["m_B", "SI", "do not mix"]),
    "both objectives": ('"abscissa"', '"abscissa"\nmaximize = "Fr"', 13, ["minimize and maximize"]),
    "no objective": ('minimize = "abscissa"\n', "", 13, ["minimize, maximize or locate"]),
    "unknown pattern": ('minimize = "abscissa"', 'locate = "EP5"', 14, ["EP5", "EP4"]),
    "objective does not parse": ('"abscissa"', '"abscissa +"', 14, ["abscissa +", "does not parse"]),
    "unknown name": ("nu_H >=", "nuh >=", 17, ["nuh", "did you mean 'nu_H'"]),
    "not a comparison": ("nu_H >= 0.02", "nu_H", 17, ["not a comparison", ">="]),
    "constraint is a number": ('"nu_H >= 0.02"', "3", 17, ["3", "quotes"]),
    "parameters is a number": (GOOD, "parameters = 3\n", 1, ["parameters", "3"]),
    "no parameters": (GOOD, 'title = "x"\n', 1, ["parameters", "missing"]),
    "not TOML": ("mu = 0.1", "mu = = 0.1", 8, ["not TOML"]),
}


@pytest.mark.parametrize("kind", BAD)
def test_bad_input_is_placed_and_explained(write, kind):
    old, new, line, words = BAD[kind]
    assert old in GOOD
    path = write(GOOD.replace(old, new))
    with pytest.raises(tmsopt.InputError) as caught:
        as_solvable(path)
    at_line = [f for f in caught.value.faults if f.line == line]
    assert at_line, str(caught.value)
    message = "\n".join(map(str, at_line))
    assert all(word in message for word in words), message
    assert str(path) in message


def test_all_faults_of_a_file_at_once(write):
    text = GOOD.replace("mu = 0.1", "mu = nan").replace("zeta_B = -0.4", "zeta_B = 4").replace("nu_H >=", "nuh >=")
    with pytest.raises(tmsopt.InputError) as caught:
        tmsopt.load(write(text))
    assert [f.line for f in caught.value.faults] == [7, 8, 17]


UNREADABLE = {
    "huge": b"# " + b"x" * (10 * MAX_FILE_BYTES),
    "not text": b'title = "\xff\xfe"\n',
    "nul": b"title = \x00\n",
    "empty": b"",
    "nested": b"x = " + b"[" * 5000,
}


@pytest.mark.parametrize("name", ["directory", "missing", *UNREADABLE])
def test_files_that_cannot_be_problems(tmp_path, name):
    path = tmp_path if name == "directory" else tmp_path / "x.toml"
    if name in UNREADABLE:
        path.write_bytes(UNREADABLE[name])
    with pytest.raises(tmsopt.InputError) as caught:
        tmsopt.load(path)
    assert str(path) in str(caught.value)


def test_missing_file_suggests_a_neighbour(write):
    path = write(GOOD)
    with pytest.raises(tmsopt.InputError, match=r"did you mean 'problem\.toml'"):
        tmsopt.load(path.with_name("problm.toml"))


@pytest.mark.parametrize("path", sorted(set(Path("problems").glob("*.toml")) - STUDIES), ids=lambda p: p.stem)
def test_every_problem_in_the_repository_loads(path):
    assert tmsopt.load(path).title


def test_a_study_is_told_from_a_problem():
    assert len(STUDIES) >= 4
    for path in STUDIES:
        with pytest.raises(tmsopt.InputError, match="tmsopt study"):
            tmsopt.load(path)


def test_a_problem_with_a_table_of_studies_has_an_unknown_key(write):
    with pytest.raises(tmsopt.InputError, match="unknown key 'vary'"):
        tmsopt.load(write(GOOD + "[vary]\nmu = [0.1]\n"))


def test_what_a_problem_had_still_answers_and_says_where_it_is():
    problem = tmsopt.load("problems/ep4.toml")
    with pytest.warns(DeprecationWarning, match="problem.posed.sense"):
        assert problem.sense == problem.posed.sense == "minimize"
    with pytest.raises(AttributeError, match="no attribute 'speed'"):
        problem.speed  # noqa: B018
    assert problem.posed.problem is problem
    assert pickle.loads(pickle.dumps(problem)) == problem
