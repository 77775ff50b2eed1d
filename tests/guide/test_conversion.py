"""Problems of point masses as problems of bodies: the same answer without inertia, boxes as in a table of formulas."""

import math
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

import tmsopt
from tmsopt.cli import command_group as main
from tmsopt.guide import converted_file

PROBLEMS = Path("problems")
ROBOT = PROBLEMS / "point_mass_robot.toml"
RATE = math.sqrt(9.81 / 0.8)
"""√(g/w) of the robot, in 1/s."""


def file_of(tmp_path, text):
    file = tmp_path / "problem.toml"
    file.write_text(text, encoding="utf-8")
    return file


TWO_MASSES = """[parameters]
w = "80 cm"
v = { min = "2 m/s", max = "4 m/s", start = "3 m/s" }
m_B = "20 kg"
m_H = "3000 g"
x_B = { min = "30 cm", max = "100 cm" }
z_B = "-25 cm"
x_H = "10/9 m"
z_H = "-10 cm"
lambda_s = { min = "-35 deg", max = "35 deg" }
[feedback]
k_phi = -2
[objective]
minimize = "abscissa"
[constraints]
arm = "abs(nu_H) >= 0.02"
"steady sway" = "damping_ratio + 0*abscissa >= -2"
[tolerances]
x_B = "5 mm"
"""


def test_without_inertia_the_answer_is_that_of_the_law():
    """−12.5^(1/4) √(g/w) at x_B = √2 w (Kirillov 2018): the EP4 of skates, from a problem that was converted."""
    fixed = {"w": 2.0, "m_B": 10.0, "z_B": -0.8, "m_H": 1.0, "x_H": 2.0, "z_H": -0.4}
    free = {"v": (0.1, 20.0), "x_B": (2.02, 10.0), "lambda_s": (0.02, 1.4)}
    skates = tmsopt.Problem(tmsopt.models.tms, fixed=fixed, free=free, minimize="abscissa")
    design = tmsopt.solve(tmsopt.convert(skates, inertia="none"))
    assert design.problem.model is tmsopt.models.whipple
    assert design.structure == "EP4"
    assert design.value == pytest.approx(-(12.5**0.25) * math.sqrt(9.81 / 2), rel=1e-10)
    assert design.parameters["x_B"] == pytest.approx(2 * math.sqrt(2), rel=1e-9)


@pytest.mark.slow
def test_without_inertia_the_robot_is_the_same(tmp_path):
    """An EP4 in √(g/w) and in 1/s: the models are one, so are the optima, within what two searches agree to."""
    file = tmp_path / "same.toml"
    text = converted_file(ROBOT, inertia="none")
    file.write_text(text)
    old, new = tmsopt.solve(ROBOT), tmsopt.solve(file)
    assert new.problem.model is tmsopt.models.whipple
    assert new.structure == old.structure == "EP4"
    assert new.abscissa == pytest.approx(old.abscissa * RATE, rel=1e-9)
    for name in old.problem.free:
        assert new.parameters[name] == pytest.approx(old.parameters[name], rel=1e-6)


@pytest.mark.parametrize("name", ["childs_bicycle", "physical_machine", "workshop", "benchmark"])
def test_each_file_in_si_has_the_same_designs(name, tmp_path):
    """Every limit and objective has the same value at the same design, the abscissa in √(g/w) where it is written so."""
    old = tmsopt.load(PROBLEMS / f"{name}.toml").posed
    file = tmp_path / "new.toml"
    file.write_text(converted_file(old, inertia="none"), encoding="utf-8")
    new = tmsopt.load(file).posed
    assert (new.free, new.tolerances, new.scenarios, new.title) == (old.free, old.tolerances, old.scenarios, old.title)
    assert new.units == {n: u for n, u in old.units.items() if n in new.units}
    middle = old.ordered({n: (0.4 * low + 0.6 * high) for n, (low, high) in old.free.items()})
    one, other = old.values(middle), new.values({**new.fixed, **middle})
    rate = math.sqrt(middle["g"] / middle["w"])
    for limit in old.constraints:
        there, here = (p.conditions[limit](v) for p, v in ((new, other), (old, one)))
        assert there == pytest.approx(here, rel=1e-9)
    assert other["abscissa"] == pytest.approx(one["abscissa"] * rate, rel=1e-7)


def test_boxes_have_the_inertia_of_solid_boxes():
    """m (b² + h²)/12 about a forward axis, m (l² + b²)/12 about the vertical, to the six digits that are kept."""
    problem = tmsopt.convert(ROBOT, body="40x20x30 cm", front=(0.1, 0.2, 0.3))
    assert problem.fixed["I_Bxx"] == pytest.approx(20 * (0.2**2 + 0.3**2) / 12, rel=1e-5)
    assert problem.fixed["I_Bzz"] == pytest.approx(20 * (0.4**2 + 0.2**2) / 12, rel=1e-5)
    share = (0.2**2 + 0.3**2) / 12, (0.1**2 + 0.2**2) / 12
    ties = [text.split(" == ") for text in problem.constraints.values() if "==" in text]
    assert [name for name, _ in ties] == ["I_Hxx", "I_Hzz"]
    for (name, right), per_mass in zip(ties, share, strict=True):
        assert float(right.removesuffix("*m_H")) == pytest.approx(per_mass, rel=1e-9)
        low, high = problem.free[name]
        assert low < per_mass * 1 < per_mass * 6 < high


def test_a_box_stands_on_the_ground_at_most(tmp_path):
    """By default 1/2, 1/4, 3/8 and 1/8, 1/8, 3/8 of 80 cm; the front mass is 10 cm high, and its box 20."""
    problem = tmsopt.convert(file_of(tmp_path, TWO_MASSES))
    assert problem.fixed["I_Bxx"] == pytest.approx(20 * (0.2**2 + 0.3**2) / 12, rel=1e-5)
    assert problem.fixed["I_Hxx"] == pytest.approx(3 * (0.1**2 + 0.2**2) / 12, rel=1e-5)
    assert problem.fixed["I_Hzz"] == pytest.approx(3 * (0.1**2 + 0.1**2) / 12, rel=1e-5)


def test_all_that_a_file_says_is_kept(tmp_path):
    old = tmsopt.load(file_of(tmp_path, TWO_MASSES))
    text = converted_file(old)
    assert 'm_H = "3000 g"' in text
    assert 'x_H = "10/9 m"' in text
    file = tmp_path / "new.toml"
    file.write_text(text, encoding="utf-8")
    new = tmsopt.load(file)
    assert new.model.name == "whipple"
    assert new.fixed["k_phi"] == -2
    assert new.posed.typed(new.fixed)["x_H"] == "10/9"
    assert "[feedback]" in text
    assert (new.free, new.start, new.tolerances) == (old.free, old.start, old.tolerances)
    assert new.minimize == "abscissa"
    assert new.constraints["arm"] == "abs((u_H/w)) >= 0.02"
    assert "abscissa/sqrt(g/w)" in new.constraints["steady sway"]
    assert new == replace(tmsopt.convert(old), units=new.units)
    free = {**dict(old.free), "w": (0.7, 0.9)}
    wider = replace(old, fixed={n: x for n, x in old.fixed.items() if n != "w"}, free=free)
    assert "sqrt(g/w)" in tmsopt.convert(wider).minimize


@pytest.mark.parametrize(
    ("change", "options", "words"),
    [
        (("abs(nu_H)", "a2"), {}, ("constraints.arm", "a2")),
        (("abs(nu_H)", "m_ballast_front"), {}, ("constraints.arm", "m_ballast_front")),
        (('minimize = "abscissa"', 'minimize = "mass_margin"'), {}, ("objective.minimize", "mass_margin")),
        (("[tolerances]", "[scenarios]\nm_H = [3, 4]\n[tolerances]"), {}, ("scenarios.m_H", "box")),
        (("", ""), {"to": "tms"}, ("to", "whipple")),
        (("", ""), {"inertia": "box"}, ("inertia", "boxes")),
        (("", ""), {"body": "40x20 cm"}, ("body", "40x20x30 cm")),
        (("", ""), {"body": "0x20x30 cm", "front": "1x1x1 s"}, ("body", "front")),
    ],
)
def test_what_has_no_counterpart_is_named(change, options, words, tmp_path):
    text = TWO_MASSES.replace(*change) if change[0] else TWO_MASSES
    text = text.replace('m_H = "3000 g"\n', "") if "m_H = [" in text else text
    with pytest.raises(tmsopt.InputError) as error:
        tmsopt.convert(file_of(tmp_path, text), **options)
    assert all(word in str(error.value) for word in words)


@pytest.mark.parametrize(("name", "words"), [("ep4", "SI"), ("whipple_ep4", "tms"), ("absorber", "tms")])
def test_what_is_no_bicycle_of_masses_in_si_is_refused(name, words, tmp_path):
    file = PROBLEMS / f"{name}.toml"
    given = file if file.exists() else file_of(tmp_path, '[model]\ncoefficients = [1, "c", 1]\n[parameters]\nc = 1\n')
    with pytest.raises(tmsopt.InputError, match=words):
        tmsopt.convert(given)


def test_command_writes_a_new_file_only(tmp_path):
    runner, output = CliRunner(), tmp_path / "boxes.toml"
    command = ["convert", str(ROBOT), "--to", "whipple", "--inertia", "boxes", "-o", str(output)]
    assert runner.invoke(main, command).exit_code == 0
    data = tomllib.loads(output.read_text())
    assert data["model"] == "whipple"
    assert (tmp_path / "tmsopt.schema.json").is_file()
    output.write_text("mine")
    again = runner.invoke(main, command)
    assert (again.exit_code, output.read_text()) == (2, "mine")
    assert "boxes.toml" in again.stderr
    printed = runner.invoke(main, command[:-2])
    assert tomllib.loads(printed.stdout) == data
