"""How much rotational inertia point masses on skates bear, against Whipple's matrices as they are printed."""

import json
import math

import numpy as np
import pytest
from helpers.bicycles import BODIES, abscissa as abscissa_of
from helpers.texts import write

import tmsopt
from benchmarks.suites.fresh.bicycles import largest_real_part
from tmsopt.models import inertia_margin

ROBOT = {
    "w": 0.8,
    "v": 3.718577772,
    "g": 9.81,
    "lambda_s": math.radians(-24.7171588),
    "m_B": 20.0,
    "x_B": 0.467199284,
    "z_B": -0.25,
    "m_H": 6.0,
    "x_H": 1.1,
    "z_H": -0.699557,
}
"""Near the EP4 of problems/point_mass_robot.toml."""

NOTHING = dict.fromkeys(BODIES.split(), 0.0) | {"r_R": 1.0, "r_F": 1.0}
"""No wheels; appendix A divides by their radii."""


def abscissa(p, **inertia):
    """In 1/s, by eigenvalues of the matrices of appendix A without wheels and trail."""
    return abscissa_of(NOTHING | p | inertia, p["v"])


def test_the_robot_of_point_masses():
    """−10.9 1/s without inertia; −4.9, −0.84 and +1.44 with 0.001, 0.003 and 0.01 kg m² of I_Hzz."""
    found = inertia_margin(ROBOT)
    assert [round(abscissa(ROBOT, I_Hzz=x), 1) for x in (0.001, 0.003, 0.01)] == [-4.9, -0.8, 1.4]
    assert found["I_Bzz"] is found["I_Hxx"] is None
    for name in ("I_Bxx", "I_Hzz"):
        assert abscissa(ROBOT, **{name: 0.99 * found[name]}) < 0 < abscissa(ROBOT, **{name: 1.01 * found[name]})
        assert abs(abscissa(ROBOT, **{name: found[name]})) < 1e-6  # a pair or a root on the axis
    assert max(abscissa(ROBOT, I_Bzz=x) for x in np.geomspace(1e-6, 1e4, 50)) < 0


def test_margin_is_the_least_of_several_crossings():
    """Random designs: stable for every inertia below the margin, on a grid; most that have one lose it for good."""
    rng = np.random.default_rng(0)
    margins = []
    while len(margins) < 40:
        low, high = (1, 1, 9.81, -1, 10, 0.2, -1, 0.2, 0.7, -1), (1, 12, 9.81, 1, 10, 2, -0.1, 9, 1.3, -0.1)
        p = dict(zip(ROBOT, rng.uniform(low, high).tolist(), strict=True))
        found = inertia_margin(p)
        assert (found is not None) == (abscissa(p) < 0)
        for name, x in (found or {}).items():
            if x is not None:
                margins.append(x)
                assert all(abscissa(p, **{name: part * x}) < 0 for part in np.linspace(0, 0.99, 12))
                assert abscissa(p, **{name: 1.001 * x}) > 0


@pytest.mark.parametrize(("gains", "least"), [({"k_phidot": -5.0}, 4), ({"k_phidot": -5.0, "lag": 0.01}, 5)])
def test_a_controller_has_its_part(gains, least):
    """With the steer torque of a motor, with a lag too: eigenvalues of the loop change sign at the margin."""
    p = {**ROBOT, "v": 1.5, "lambda_s": 0.3, "x_H": 0.8, "k_phi": -60.0, "k_delta": 10.0, "k_deltadot": 1.0, **gains}
    found = inertia_margin(p)
    assert largest_real_part(p) < 0
    assert any(x is not None for x in found.values())
    for name, x in found.items():
        if x is not None:
            assert largest_real_part({**p, name: 0.99 * x}) < 0 < largest_real_part({**p, name: 1.01 * x})


FILE = "[parameters]\n" + "\n".join(f"{n} = {x!r}" for n, x in ROBOT.items()) + "\n"


def test_report_and_json_have_it(tmp_path, run):
    file = write(tmp_path, FILE)
    margin = json.loads(run("solve", file, "--json")[1])["inertia_margin"]
    assert margin == dict(inertia_margin(ROBOT))
    text = " ".join(run("solve", file)[1].split())
    assert f"I_Hzz {margin['I_Hzz']:.4g} kg m^2 ({math.sqrt(margin['I_Hzz'] / 6):.3g} m)" in text
    assert "I_Bzz without limit" in text
    assert "without wheels, rotational inertia or trail" in text


def test_a_design_that_is_not_stable_has_none(tmp_path, run):
    file = write(tmp_path, FILE.replace("v = 3.7", "v = 1.7"))
    assert json.loads(run("solve", file, "--json")[1])["inertia_margin"] is None
    assert "radius of gyration" not in run("solve", file)[1]


@pytest.mark.slow
def test_who_says_what_is_left_out():
    words = "without wheels, rotational inertia or trail"
    design = tmsopt.solve("problems/benchmark.toml")
    told = [design, tmsopt.speeds(design), tmsopt.simulate(design), tmsopt.describe("tms"), tmsopt.compare(design)]
    told += [tmsopt.solve("problems/ep4.toml").report(full=True), tmsopt.explore(design).html]
    assert [words in " ".join(str(text).split()) for text in told] == [True] * 7
    assert "inertia_margin" not in tmsopt.solve("problems/ep4.toml").to_json()
    assert "model: " not in tmsopt.solve("problems/whipple_benchmark.toml").report()


def test_the_delivery_robot_balances_as_built():
    """With errors up to 5 mm, 0.5°, 5 % of masses and 10 % of inertias, at corners too; boxes and discs."""
    problem = tmsopt.load("problems/delivery_robot.toml")
    p = dict(tmsopt.solve(problem).parameters)
    boxes = {"B": (20, 0.4, 0.2, 0.3), "H": (3, 0.1, 0.1, 0.3)}
    for body, (m, length, width, height) in boxes.items():
        assert p[f"m_{body}"] == m
        assert p[f"I_{body}xx"] == pytest.approx(m * (width**2 + height**2) / 12, rel=1e-3)
        assert p[f"I_{body}zz"] == pytest.approx(m * (length**2 + width**2) / 12, rel=1e-3)
    assert p["I_Ryy"] == p["I_Fyy"] == pytest.approx(1 * 0.1**2 / 2)
    assert p["x_H"] - p["x_B"] >= 0.25  # half a box each: they do not touch
    assert abscissa(p) == pytest.approx(-5.91, abs=0.05)  # an EP4, by eigenvalues
    names = [name for name in (*BODIES.split(), "lambda_s") if p[name]]
    size = {"m": 0.05, "I": 0.1}
    errors = [
        math.radians(0.5) if n == "lambda_s" else size[n[0]] * abs(p[n]) if n[0] in size else 0.005 for n in names
    ]

    def greatest(how):
        """The greatest real part of robots, a row of errors each, as parts of the largest."""
        return abscissa_of(p | {n: p[n] + how[:, k] * errors[k] for k, n in enumerate(names)}, p["v"])

    rng = np.random.default_rng(0)
    assert greatest(rng.uniform(-1, 1, (4_000, len(names)))).max() < -1
    assert greatest(rng.choice([-1.0, 1.0], (4_000, len(names)))).max() < -0.9
