"""What is answered to what others write: each message says what to write, and what it says is accepted."""

import math
import re

import pytest
from helpers.texts import faults, load

import tmsopt

ROBOT = """title = "robot"
model = "tms"
[parameters]
w = "80 cm"
v = { min = "1 m/s", max = "4 m/s" }
m_B = "20 kg"
m_H = "3 kg"
x_B = "60 cm"
z_B = "-30 cm"
x_H = "70 cm"
z_H = "-60 cm"
lambda_s = { min = "-35 deg", max = "35 deg" }
[objective]
minimize = "abscissa"
[constraints]
arm = "LIMIT"
"""


@pytest.mark.parametrize(
    ("written", "meant"),
    {
        "u_H => 0.02": "u_H >= 0.02",
        "u_H =< 0.02": "u_H <= 0.02",
        "u_H > 0.02": "u_H >= 0.02",
        "u_H < 0.02": "u_H <= 0.02",
        "u_H = 0.02": "u_H == 0.02",
        "u_H ≥ 0.02": "u_H >= 0.02",
        "u_H^2 <= 4": "u_H**2 <= 4",
        "2 u_H >= 0.04": "2*u_H >= 0.04",
        "u_H >= 0,02": "u_H >= 0.02",
        "load_front >= 30 %": "load_front >= 0.3",
        "lambda_s <= 35 deg": "lambda_s <= 35*pi/180",
        "lambda_s <= 35°": "lambda_s <= 35*pi/180",
        "λ <= 0.3": "lambda_s <= 0.3",
        "N_F >= 2 kN": "N_F >= 2000",
        "u_H >= 2 cm": "u_H >= 0.02",
        "v <= 18 km/h": "v <= 5",
        "2 m_H <= 500 kg": "2*m_H <= 500",
    }.items(),
)
def test_a_limit_is_written_as_it_should_be(tmp_path, written, meant):
    """And so written it is accepted."""
    (found,) = faults(tmp_path, ROBOT.replace("LIMIT", written))
    assert found.startswith(f"16: constraints.arm: '{written}'")
    assert f"write '{meant}'" in found
    assert load(tmp_path, ROBOT.replace("LIMIT", meant)).constraints == {"arm": meant}


@pytest.mark.parametrize(
    ("written", "said"),
    {
        "abs(u_H >= 0.02": r"a \) is missing",
        "abs(u_H)) >= 0.02": r"a \( is missing",
        "1j*u_H >= 1": "expressions are real",
        "lambda <= 0.3": "reserved word.*lambda_s",
        "trail >= 0.02": r"skates have no trail.*write .*'u_H >= 0.02'",
        "wheelbase >= 0.02": r"write w \(wheelbase\)",
        "Froude >= 2": r"write Fr \(Froude number",
        "speed >= 2": r"write v \(forward speed\)",
        "absissa <= 0": "did you mean 'abscissa'",
    }.items(),
)
def test_a_limit_that_cannot_be_mended_is_explained(tmp_path, written, said):
    (found,) = faults(tmp_path, ROBOT.replace("LIMIT", written))
    assert re.match(rf"16: constraints\.arm: .*{said}", found), found


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        ('max = "35 deg"', "max = 35", 12, 'write "35 deg" for degrees'),
        ("minimize", "optimise", 14, "write minimize or maximize"),
        ("minimize", "minimise", 14, "did you mean 'minimize'"),
        ("minimize", "maximise", 14, "did you mean 'maximize'"),
        ("minimize", "goal", 14, "write minimize or maximize"),
        ("[objective]", "[objectives]", 13, "did you mean 'objective'"),
        ("[objective]", "[goal]", 13, "write [objective]"),
        ("[constraints]", "[constraint]", 15, "did you mean 'constraints'"),
        ("[parameters]", "[parameter]", 3, "did you mean 'parameters'"),
        ('"tms"', '"TMS"', 2, "did you mean 'tms'"),
        ('"tms"', "tms", 2, 'write a text in quotes: model = "tms"'),
        ('"80 cm"', "80 cm", 4, 'in quotes: "80 cm"'),
        ('"80 cm"', "0,8", 4, "write a decimal point: 0.8"),
        ('"80 cm"', '"0,8 m"', 4, 'write a decimal point: "0.8 m"'),
        ('max = "35 deg" }', 'max = "35 deg"', 12, "a } is missing"),
        ('min = "-35 deg",', 'min = "-35 deg"', 12, "write a comma"),
        ("[parameters]", "[parameters", 3, "a ] is missing"),
        ('"abscissa"', '"abscissa', 14, "a quote is missing"),
        ('"abscissa"', "abscissa", 14, 'write a text in quotes: minimize = "abscissa"'),
        ('"tms"', "[1, [2]", 2, "a ] is missing"),
    ],
)
def test_a_line_is_answered_with_what_to_write(tmp_path, old, new, line, said):
    """One fault, at its line."""
    (found,) = faults(tmp_path, ROBOT.replace("LIMIT", "u_H >= 0.02").replace(old, new))
    assert found.startswith(f"{line}: ")
    assert said in found


def test_a_list_that_is_not_closed_is_found_where_it_begins(tmp_path):
    text = '[model]\nM = [[1]]\nD = [["c"]\nK = [["k"]]\n[parameters]\nc = 1\nk = 1\n'
    (found,) = faults(tmp_path, text)
    assert found.startswith("3: ")
    assert "a ] is missing" in found
    assert set(load(tmp_path, text.replace('"c"]\n', '"c"]]\n')).fixed) == {"c", "k"}


def test_a_wheelbase_of_whipple_has_a_trail():
    with pytest.raises(tmsopt.InputError, match=r"write c \(trail,"):
        tmsopt.Problem(model=tmsopt.models.whipple, fixed={"trail": 0.08})


def test_degrees_are_offered_for_angles_alone():
    with pytest.raises(tmsopt.InputError) as caught:
        tmsopt.Problem(model=tmsopt.models.tms, fixed={"zeta_B": 0.4, "lambda_s": math.tau})
    messages = [fault.message for fault in caught.value.faults]
    assert ["deg" in message for message in messages if "not physical" in message] == [False, True]


def test_a_file_with_anything_left_out_is_answered_in_words(tmp_path):
    """Every file with a piece cut away is read, or refused as bad input, with its lines."""
    text = ROBOT.replace("LIMIT", "abs(u_H - 2*v) >= 0.02").replace('"robot"', '"""\na\n"""')
    assert load(tmp_path, text).constraints
    refused = 0
    for size in (2, 9):
        for start in range(0, len(text), size):
            try:
                load(tmp_path, text[:start] + text[start + size :])
            except tmsopt.InputError as error:
                refused += 1
                assert all(fault.line >= 1 and fault.message for fault in error.faults)
    assert refused > 60
