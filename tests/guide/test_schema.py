"""The JSON Schema: every file that is read fits it, and what it finds wrong no reader takes."""

import json
import tomllib
from pathlib import Path

import jsonschema
import pytest

import tmsopt
from tmsopt.guide import SCHEMA_FILE, TEMPLATES, new_problem, schema_text
from tmsopt.models import gain_names

PROBLEMS = sorted(Path("problems").glob("*.toml"))
SCHEMA = tmsopt.schema()
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)


def faults(text):
    """Where a file does not fit, each as keys joined by dots."""
    return [".".join(map(str, e.absolute_path)) for e in VALIDATOR.iter_errors(tomllib.loads(text))]


def test_it_is_a_schema_of_its_draft():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    assert SCHEMA["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert json.loads(schema_text()) == SCHEMA


def test_the_file_for_editors_is_the_schema():
    """Where this fails: tmsopt schema > problems/tmsopt.schema.json"""
    assert (Path("problems") / SCHEMA_FILE).read_text(encoding="utf-8") == schema_text()


@pytest.mark.parametrize("path", PROBLEMS, ids=lambda p: p.stem)
def test_every_example_refers_to_it_and_fits(path):
    text = path.read_text(encoding="utf-8")
    assert text.startswith(f"#:schema ./{SCHEMA_FILE}\n")  # the directive of Taplo, a comment to TOML
    assert faults(text) == []


GOOD = """model = "tms"
[parameters]
w = "80 cm"
v = { min = "1 m/s", max = 4, start = 2 }
m_B = "20 kg"
m_H = 3
x_B = { min = "20 cm", max = 1 }
z_B = "-30 cm"
x_H = "70 cm"
z_H = "-60 cm"
lambda_s = { min = "-35 deg", max = "35 deg" }
[objective]
minimize = "abscissa"
[constraints]
arm = "u_H >= 0.02"
[tolerances]
x_B = "5 mm"
"""
STEERED = """model = "whipple"
[parameters]
w = 1
v = { min = 1, max = 2 }
x_B = 0.3
z_B = -0.9
m_B = 85
x_H = 0.9
z_H = -0.7
m_H = 4
lambda_s = 0.3
k_phi = -10
[feedback]
k_phidot = { min = -100, max = "5 N m s/rad" }
lean_delta_v = "1 N s/rad"
lag = "50 ms"
[tolerances]
k_phidot = 2
[objective]
minimize = "abscissa"
"""
STUDY = """problem = "ep4.toml"
[study]
method = "sobol"
rows = 8
[vary]
mu = { min = 0.1, max = 1 }
"""
OWN = """[model]
M = [[1]]
K = [["k"]]
[parameters]
k = 1
"""

WRONG = {
    "unknown section": (GOOD, "[tolerances]", "[tolerance]", ""),
    "two senses": (GOOD, '"abscissa"', '"abscissa"\nmaximize = "v"', "objective"),
    "strict comparison": (GOOD, "u_H >= 0.02", "u_H > 0.02", "constraints.arm"),
    "a number for a limit": (GOOD, '"u_H >= 0.02"', "0.02", "constraints.arm"),
    "unknown parameter": (GOOD, "m_H = 3", "m_H = 3\ntrail = 0.1", "parameters"),
    "sets mixed": (GOOD, "m_H = 3", "m_H = 3\nmu = 0.1", "parameters"),
    "degrees for radians": (GOOD, '"35 deg"', "35", "parameters.lambda_s.max"),
    "height upward": (GOOD, '"-30 cm"', "0.3", "parameters.z_B"),
    "no greatest value": (GOOD, "max = 4, ", "", "parameters.v"),
    "misspelt start": (GOOD, "start", "strat", "parameters.v"),
    "number in quotes": (GOOD, '"20 kg"', '"20"', "parameters.m_B"),
    "unknown model": (GOOD, '"tms"', '"TMS"', "model"),
    "unknown pattern": (GOOD, 'minimize = "abscissa"', 'locate = "EP1"', "objective.locate"),
    "tolerance of nothing": (GOOD, 'x_B = "5 mm"', 'c = "5 mm"', "tolerances"),
    "no parameters": ('title = "x"\n', "x", "y", ""),
    "unknown gain": (STEERED, "k_phidot = {", "k_phidott = {", "feedback"),
    "dimensionless gain of wheels": (STEERED, "k_phidot = {", "kappa_phidot = {", "feedback"),
    "unknown gain among parameters": (STEERED, "k_phi = -10", "k_fi = -10", "parameters"),
    "no lag": (STEERED, '"50 ms"', "0", "feedback.lag"),
    "feedback of one's own system": (OWN, "[parameters]", "[feedback]\nk_phi = 1\n[parameters]", "feedback"),
    "feedback that is no table": (GOOD, 'model = "tms"', 'model = "tms"\nfeedback = 3', "feedback"),
    "method misspelt": (STUDY, "sobol", "sobel", "study.method"),
    "rows below 1": (STUDY, "rows = 8", "rows = 0", "study.rows"),
    "nothing to vary over": (STUDY, "{ min = 0.1, max = 1 }", "3", "vary.mu"),
    "study without problem": (STUDY, 'problem = "ep4.toml"\n', "", ""),
    "objective beside a study": (STUDY, "[vary]", '[objective]\nminimize = "Fr"\n[vary]', ""),
    "unknown matrix": (OWN, "M =", "Q =", "model"),
}


@pytest.mark.parametrize("text", [GOOD, STEERED, STUDY, OWN, *map(new_problem, TEMPLATES)])
def test_what_they_are_made_from_fits_and_every_new_problem(text):
    assert faults(text) == []


@pytest.mark.parametrize("kind", WRONG)
def test_what_is_wrong_is_marked_where_it_stands_and_is_not_read(kind, tmp_path):
    text, old, new, place = WRONG[kind]
    assert old in text
    wrong = text.replace(old, new, 1)
    assert place in faults(wrong)
    file = tmp_path / "wrong.toml"
    file.write_text(wrong, encoding="utf-8")
    (tmp_path / "ep4.toml").write_text(Path("problems/ep4.toml").read_text(encoding="utf-8"), encoding="utf-8")
    with pytest.raises(tmsopt.InputError):
        (tmsopt.load_study if text == STUDY else tmsopt.load)(file)


def test_parameters_are_explained_by_their_meanings():
    for name in ("tms", "whipple"):
        explained = SCHEMA["$defs"][f"parameters_{name}"]["properties"]
        model = getattr(tmsopt.models, name)
        assert set(explained) == {n for of in model.sets for n in of.names} | set(gain_names(name))
        assert set(SCHEMA["$defs"][f"feedback_{name}"]["properties"]) == set(gain_names(name))
        assert all(explained[p.name]["description"].startswith(p.meaning) for of in model.sets for p in of.parameters)


def test_every_key_is_explained():
    problem, study = (SCHEMA["$defs"][name]["properties"] for name in ("problem", "study_file"))
    inner = (problem, study, problem["objective"]["properties"], study["study"]["properties"])
    assert [key for keys in inner for key, found in keys.items() if not found.get("description")] == []


def test_a_bicycle_of_its_own_file_needs_no_parameters():
    assert faults('bicycle = "Browser.txt"\n[parameters]\nv = 5\n') == []
    assert faults('bicycle = "Browser.txt"\n[parameters]\nFr = 5\n') == ["parameters"]
