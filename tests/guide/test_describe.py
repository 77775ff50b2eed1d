"""Descriptions: every name that an expression may use, with its meaning; of a file, what it says, as it was typed."""

import json
import re
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import casadi as ca
import pytest

import tmsopt
from tmsopt.guide import schema_text
from tmsopt.problem import parse_value

PROBLEMS = sorted(Path("problems").glob("*.toml"))
BUILT_IN = ("tms", "whipple")


def names(found):
    return {s.name for of in found.sets for s in (*of.parameters, *of.quantities)}


@pytest.mark.parametrize("name", BUILT_IN)
def test_a_model_is_described_by_its_own_tables(name):
    model = getattr(tmsopt.models, name)
    found = tmsopt.describe(name)
    assert found == tmsopt.describe(model)
    for of, described in zip(model.sets, found.sets, strict=True):
        assert [(s.name, s.unit, s.meaning) for s in described.parameters] == [
            (p.name, p.unit, p.meaning) for p in of.parameters
        ]
        meant = {s.name: s.meaning for s in described.quantities}
        assert all(meant[q.name] == q.meaning for q in (*model.quantities, *of.quantities))
        assert {"abscissa", "damping_ratio", "radius", "a0", "a4"} <= set(meant)
        assert all(meant.values())
        assert not set(meant) & set(of.names)


@pytest.mark.parametrize("path", PROBLEMS, ids=lambda p: p.stem)
def test_a_file_is_described_by_every_name_that_it_may_use(path):
    found = tmsopt.describe(path)
    if "study" not in path.stem:
        problem = tmsopt.load(path)
        hidden = () if not problem.model.is_complex else problem.model.coefficient_names()
        assert names(found) == set(problem.posed.vocabulary) - set(hidden)
        assert (found.title, found.model) == (problem.title, problem.model.name)
        assert dict(found.asked.get("constraints", {})) == problem.constraints
    assert max(map(len, str(found).splitlines())) <= 100
    assert all(re.search(rf"^  {re.escape(name)}( |$)", str(found), re.MULTILINE) for name in names(found))
    assert str(found) == found.report()
    assert "\n" not in repr(found)
    assert json.loads(json.dumps(found.to_json(), allow_nan=False))["model"] == found.model


def test_numbers_stand_as_they_were_typed():
    (of,) = tmsopt.describe("problems/point_mass_robot.toml").sets
    expected = {"w": "80 cm", "v": "1 m/s … 4 m/s", "lambda_s": "-35 deg … 35 deg", "g": "9.81 m/s^2"}
    assert {s.name: s.given for s in of.parameters if s.name in expected} == expected
    assert tmsopt.describe("problems/workshop.toml").asked["tolerances"] == {"x_B": "5 mm", "lambda_s": "0.5 deg"}


def test_a_problem_of_python_has_the_units_of_the_model():
    free = {"lambda_s": (0.1, 1.0), "Fr": (1, 2)}
    fixed = {"chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2, "mu": 0.1, "chi_B": 1.5}
    asked = {"minimize": "abscissa", "scenarios": {"mu": (0.1, 0.2)}}
    found = tmsopt.describe(tmsopt.Problem(tmsopt.models.tms, fixed=fixed, free=free, **asked))
    (of,) = found.sets
    assert {s.name: s.given for s in of.parameters}["lambda_s"] == "0.1 rad … 1 rad"
    assert found.asked == {"objective": {"minimize": "abscissa"}, "scenarios": {"mu": "0.1, 0.2"}}


def test_a_problem_of_python_has_the_units_in_which_it_was_typed():
    path = "problems/point_mass_robot.toml"
    assert tmsopt.describe(tmsopt.load(path)) == tmsopt.describe(path)
    problem = replace(tmsopt.load(path), scenarios={"m_B": ("12 kg", "500 g")}, tolerances={"w": 0.005})
    found = tmsopt.describe(problem)
    assert found.asked["tolerances"] == {"w": "0.5 cm"}  # w was typed in cm
    assert found.asked["scenarios"] == {"m_B": "12 kg, 0.5 kg"}


def test_a_system_of_ones_own_shows_its_matrices():
    found = tmsopt.describe("problems/coupled_pair.toml")
    assert found.matrices["K"] == (("1 + k", "-k"), ("-k", "w + k"))
    assert "K = [1 + k     -k]\n    [   -k  w + k]" in str(found)
    assert found.sketch == ""
    k, m = ca.SX.sym("k"), ca.SX.sym("m")
    stated = tmsopt.describe(tmsopt.models.from_coefficients([m, 0, k], name="spring", quantities={"ratio": k / m}))
    assert stated.matrices["coefficients"] == (("m", "0", "k"),)
    (of,) = stated.sets
    assert {q.name: q.meaning for q in of.quantities}["ratio"] == "= (k / m)"


def test_the_functions_are_those_of_expressions():
    called = {*tmsopt.describe("tms").functions} - {"pi"}
    assert called >= {"sqrt", "atan", "abs"}
    for name in called:
        assert parse_value(f"{name}(v, 1)" if name in ("min", "max") else f"{name}(v)", ["v"]).names == ("v",)


def test_the_patterns_are_those_that_a_problem_may_locate():
    patterns = tmsopt.describe("problems/three_masses.toml").patterns  # degree 6
    assert all(patterns.values())
    assert [tmsopt.roots.pattern(name, 6).name for name in patterns] == list(patterns)
    assert "EP6" in patterns
    assert "EP5" not in tmsopt.describe("tms").patterns


@pytest.mark.parametrize("name", BUILT_IN)
def test_the_sketch_has_every_length_mass_and_angle(name):
    """And nothing else that looks like a symbol."""
    found = tmsopt.describe(name)
    drawn = set(re.findall(r"\b[A-Za-z]+_[A-Za-z]+\b|(?<=[ <])[wcvg](?=[ ,;>)])", found.sketch))
    assert drawn - {"u_H"} == {p.name for p in found.sets[-1].parameters}
    assert max(map(len, found.sketch.splitlines())) <= 100
    assert found.sketch.isascii()


@pytest.mark.parametrize("name", BUILT_IN)
def test_the_sketch_is_drawn_to_the_signs(name):
    """The axis leans back at its top, to the left of a bicycle that goes right, and meets the ground by the trail ahead."""
    lines = tmsopt.describe(name).sketch.strip("\n").splitlines()
    ground = next(k for k, line in enumerate(lines) if line.endswith("ground"))
    front = lines[ground].index("F")
    axis = [line.rindex("\\", 0, front + 1) for line in lines[1:5]]  # above the wheels
    assert axis == sorted(axis)
    reach = axis[0] + ground - 1  # one column a line
    trail = re.search(r"\|<c>\|", lines[ground + 1])
    assert reach == (front if trail is None else trail.end() - 1)
    assert trail is None or trail.start() == front


def test_signs_are_said():
    found = tmsopt.describe("tms")
    said = " ".join(found.conventions)
    assert "z down" in said
    assert "heights are negative" in said
    ranges = {s.name: s.range for s in found.sets[1].parameters}
    assert (ranges["z_B"], ranges["z_H"], ranges["lambda_s"]) == ("<= 0", "<= 0", "> -90 and < 90 deg")


@pytest.mark.parametrize("wrong", [3, None, ["tms"]], ids=repr)
def test_anything_else_is_refused_in_words(wrong):
    with pytest.raises(tmsopt.InputError, match="accepted: the name of a model"):
        tmsopt.describe(wrong)  # type: ignore[arg-type]


def test_a_word_that_is_no_file_is_answered_with_the_models(tmp_path):
    with pytest.raises(tmsopt.InputError, match="no such file; models: tms whipple"):
        tmsopt.describe("bicycle")
    (tmp_path / "bad.toml").write_text("[parameters]\nw = 1\n")
    with pytest.raises(tmsopt.InputError, match=r"bad\.toml:1: parameters: missing parameter"):
        tmsopt.describe(tmp_path / "bad.toml")


def test_a_model_of_another_kind_may_come_with_the_package(monkeypatch, tmp_path):
    """Named in the table of models alone, it is described, solved, and in the schema; no controller is for it."""
    pendulum = replace(tmsopt.models.from_coefficients([1, "c", "k - 1"]), name="pendulum", statement=None)
    monkeypatch.setitem(import_module("tmsopt.models.built_in").MODELS, "pendulum", pendulum)
    file = tmp_path / "pendulum.toml"
    asked = 'model = "pendulum"\nparameters = { c = 4, k = { min = 1.5, max = 9 } }\nobjective = { minimize = "abscissa" }\n'
    file.write_text(asked, encoding="utf-8")
    assert tmsopt.solve(file).abscissa == pytest.approx(-2, abs=1e-12)  # from k = 1 + c²/4 on
    assert names(tmsopt.describe(file)) >= {"c", "k", "a0", "abscissa"}
    assert not any(words.parameters for words in tmsopt.describe("pendulum").feedback)
    assert "parameters_pendulum" in schema_text()
    file.write_text(f"{asked}feedback = {{ k_phi = 1 }}\n", encoding="utf-8")
    with pytest.raises(tmsopt.InputError, match="for the bicycles tms and whipple"):
        tmsopt.load(file)
