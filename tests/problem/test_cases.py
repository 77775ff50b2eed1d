"""Scenarios, tolerances and weights: as written, refused with their place, and held at their worst beside dense samples."""

from dataclasses import replace
from functools import cache
from itertools import product
from math import radians

import numpy as np
import pytest
from helpers import hunt
from helpers.texts import load

import tmsopt
from tmsopt import laws
from tmsopt.problem import Band

TMS = tmsopt.models.tms
FIXED = {"chi_H": 1.0, "mu": 0.1, "zeta_B": -0.4, "zeta_H": -0.2}
BOX = {"chi_B": (1.01, 3.0), "lambda_s": (0.05, 1.2)}
SPEEDS = np.linspace(1.2, 2.4, 2000)

FILE = """\
[parameters]
chi_H = 1.0
zeta_H = -0.2
zeta_B = -0.4
mu = 0.1
chi_B = { min = 1.01, max = 3 }
lambda_s = { min = 0.05, max = 1.2 }
[objective]
minimize = "abscissa"
"""


def problem(fixed=FIXED, free=BOX, **asked):
    return tmsopt.Problem(TMS, fixed=fixed, free=free, **{"minimize": "abscissa", **asked})


def spread(d):
    """A design as arrays of one axis, for `hunt` to vary beside it."""
    return {n: np.asarray(v, float)[..., None] for n, v in d.items()}


# What is written


def test_file_and_python_are_one_problem(tmp_path):
    loaded = load(
        tmp_path,
        FILE + '[scenarios]\nFr = { min = 1.2, max = 2.4, points = 3 }\n[tolerances]\nzeta_H = "5 mm"\nchi_B = 0.01\n',
    )
    stated = problem(
        scenarios={"Fr": {"min": 1.2, "max": 2.4, "points": 3}}, tolerances={"zeta_H": 0.005, "chi_B": 0.01}
    )
    assert loaded.scenarios == stated.scenarios == {"Fr": Band(1.2, 2.4, 3)}
    assert replace(loaded, title="") == stated
    assert stated.fixed["Fr"] == pytest.approx(1.8)  # the middle, where nothing else is written
    assert sorted({c.at["Fr"] for c in stated.posed.cases}) == pytest.approx([1.2, 1.8, 2.4])
    assert {tuple(c.offset.values()) for c in stated.posed.cases} == set(product((-0.005, 0.005), (-0.01, 0.01)))
    assert problem({**FIXED, "Fr": 2.2}, scenarios={"Fr": [1.2, 2.4]}).fixed["Fr"] == 2.2


def test_units_of_scenarios_tolerances_and_weights(tmp_path):
    dimensionless = load(
        tmp_path,
        FILE
        + '[scenarios]\nFr = [2]\n[tolerances]\nzeta_H = "5 mm"\nlambda_s = "1 deg"\nmu = "20 g"\n[weights]\nchi_B = "1 cm"\n',
    )
    assert dimensionless.tolerances == pytest.approx(
        {"zeta_H": 0.005, "lambda_s": radians(1), "mu": 0.02}
    )  # of 1 m, 1 kg
    assert dimensionless.weights == pytest.approx({"chi_B": 0.01})
    si = """
[parameters]
w = "80 cm"
m_B = "10 kg"
x_H = "80 cm"
z_B = "-40 cm"
z_H = "-20 cm"
x_B = { min = "1.05 m", max = "2 m" }
lambda_s = { min = "5 deg", max = "45 deg" }
[objective]
minimize = "abscissa"
[scenarios]
v = { min = "9 km/h", max = "5 m/s", points = 2 }
m_H = ["500 g", 2]
[tolerances]
z_H = "5 mm"
"""
    built = load(tmp_path, si)
    assert built.scenarios == {"v": Band(2.5, 5.0, 2), "m_H": (0.5, 2)}
    assert built.tolerances == pytest.approx({"z_H": 0.005})
    assert len(built.posed.cases) == 2 * 2 * 2


FAULTS = {
    "scenarios": {
        "Fr = { min = 2.4, max = 1.2 }": ("Fr", ["min = 2.4", "max = 1.2", "swap"]),
        "Fr = { min = 1.2, max = 2.4, points = 1 }": ("Fr.points", ["points = 1", "2 to 99"]),
        "Fr = { min = 1.2, max = 2.4, steps = 3 }": ("Fr.steps", ["'steps'", "min max points"]),
        "Fr = { min = 1.2 }": ("Fr.max", ["missing max", "points = 7"]),
        "Fr = 1.2": ("Fr", ["1.2", "[1, 2.5]"]),
        "Fr = [1, -2]": ("Fr", ["Fr = -2", ">= 0"]),
        "chi_B = [1.2]": ("chi_B", ["both free and in scenarios", "keep one"]),
        "speed = [1, 2]": ("speed", ["'speed'", "Fr mu chi_B"]),
    },
    "tolerances": {
        "zeta_H = 0.3": ("zeta_H", ["reaches 0.1", "<= 0", "by the tolerance"]),
        'lambda_s = "30 deg"': ("lambda_s", ["reaches 1.7236", "1.5708"]),  # 1.2 rad and 30 degrees
        'zeta_H = "5 deg"': ("zeta_H", ["'deg'", "unit of m"]),
        "lambda_s = true": ("lambda_s", ["True", "'5 mm'"]),
        'Fr = "5 mm"': ("Fr", ["'5 mm'", "dimensionless"]),
    },
    "weights": {
        "zeta_H = -0.1": ("zeta_H", ["-0.1", "0 or greater"]),
    },
}
"""Section → what is written → its key, and what the message must name."""


@pytest.mark.parametrize(("section", "line"), [(section, line) for section, lines in FAULTS.items() for line in lines])
def test_faults_name_their_place_value_and_what_is_accepted(tmp_path, section, line):
    key, named = FAULTS[section][line]
    filled = FILE.replace("mu = 0.1\n", "mu = 0.1\nFr = 2.0\n") if section != "scenarios" or "Fr" not in line else FILE
    with pytest.raises(tmsopt.InputError) as error:
        load(tmp_path, f"{filled}[{section}]\n{line}\n")
    found = [f for f in error.value.faults if ".".join(f.key) == f"{section}.{key}"]
    assert len(found) == 1
    assert found[0].line == filled.count("\n") + 2
    assert found[0].file.endswith("problem.toml")
    for words in named:
        assert words in str(found[0])


def test_a_tolerance_just_inside_the_range_is_accepted():
    assert problem({**FIXED, "Fr": 2.0}, tolerances={"mu": 0.1}).tolerances == {"mu": 0.1}
    with pytest.raises(tmsopt.InputError):
        problem({**FIXED, "Fr": 2.0}, tolerances={"mu": 0.1000001})


# A band of speeds


def over_band(d, speeds=SPEEDS):
    return hunt.abscissa({**spread(d), "Fr": speeds}).max(axis=-1)


@cache
def best_of_band():
    merit = lambda d: (over_band(d, np.linspace(1.2, 2.4, 31)), 0 * d["chi_B"])  # noqa: E731
    point, _ = hunt.least(merit, FIXED, BOX, generations=25, rounds=5, population=8)
    return float(over_band(point))


@pytest.mark.parametrize("points", [2, 7])
def test_the_worst_of_a_band_is_least_however_few_points_it_starts_with(points):
    design = tmsopt.solve(problem(scenarios={"Fr": Band(1.2, 2.4, points)}))
    assert over_band(design.parameters) == pytest.approx(design.value, abs=1e-7)  # speeds 6e-4 apart
    assert over_band(design.parameters) <= design.value + 1e-9
    assert design.value <= best_of_band() + 1e-9
    assert design.value == pytest.approx(best_of_band(), abs=1e-4)  # 31 speeds miss the worst by their spacing squared
    assert design.cover.proven
    assert design.cover.limit >= over_band(design.parameters)
    assert design.cover.limit == pytest.approx(design.abscissa, abs=2e-6)
    report = design.to_json()
    assert report["cover"] == {"limit": design.cover.limit, "proven": True, "boxes": design.cover.boxes}
    worst = float(hunt.abscissa({**design.parameters, **report["worst_case"]["at"]}))
    assert worst == pytest.approx(design.value, abs=1e-7)


def test_separate_values_ask_nothing_in_between():
    ends = np.array([1.2, 2.4])
    design = tmsopt.solve(problem(scenarios={"Fr": [1.2, 2.4]}))
    _, best = hunt.least(lambda d: (over_band(d, ends), 0 * d["chi_B"]), FIXED, BOX, generations=60)
    assert design.value == pytest.approx(best, abs=1e-6)
    assert design.value < best_of_band() - 5e-3  # what nothing in between is worth
    assert over_band(design.parameters) > design.value + 5e-3
    assert design.cover.proven
    assert set(design.worst.at.values()) <= {1.2, 2.4}


def test_the_damping_ratio_and_constraints_hold_in_every_case():
    """The least weave speed is under every speed, so Fr >= Fr_c + 0.1 binds at the slowest; sway is worst at an end."""
    asked = {"sway": "damping_ratio >= 0.3", "clear": "Fr - Fr_c >= 0.6"}
    design = tmsopt.solve(problem(scenarios={"Fr": Band(1.2, 2.4, 3)}, constraints=asked, minimize="chi_B"))

    def violation(d, speeds):
        ratio = hunt.damping_ratio({**spread(d), "Fr": speeds}).min(axis=-1)
        square = laws.flus(**{n: v for n, v in d.items() if n != "Fr"})
        return np.maximum(0.3 - ratio, np.sqrt(np.maximum(square, 0)) - 0.6)

    _, best = hunt.least(lambda d: (d["chi_B"], violation(d, SPEEDS[::100])), FIXED, BOX, generations=25)
    assert violation({n: np.asarray(v) for n, v in design.parameters.items()}, SPEEDS) <= 1e-7
    assert design.value == pytest.approx(best, abs=1e-5)


# Tolerances


OFF = {"chi_B": 0.02, "lambda_s": 0.02, "zeta_B": 0.01, "zeta_H": 0.01}


def in_box(d, offsets):
    shifted = {n: np.asarray(d[n])[..., None] + t * offsets[k] for k, (n, t) in enumerate(OFF.items())}
    return hunt.abscissa({**spread({n: v for n, v in d.items() if n not in OFF}), **shifted}).max(axis=-1)


@pytest.mark.slow
def test_the_worst_of_a_tolerance_box_is_least():
    free = {"chi_B": (1.1, 2.0), "lambda_s": (0.1, 0.8)}
    design = tmsopt.solve(problem({**FIXED, "Fr": 2.2}, free, tolerances=OFF))
    dense = np.array(list(product(np.linspace(-1, 1, 7), repeat=4))).T
    assert in_box(design.parameters, dense) <= design.value + 1e-9
    corners = np.array(list(product((-1.0, 1.0), repeat=4))).T
    _, best = hunt.least(
        lambda d: (in_box(d, corners), 0 * d["chi_B"]),
        design.problem.fixed,
        free,
        generations=25,
        rounds=4,
        population=8,
    )
    assert design.value == pytest.approx(best, abs=1e-5)  # what more than the corners asks is less
    assert design.cover.limit >= in_box(design.parameters, dense)
    at_worst = {n: design.parameters[n] + x for n, x in design.worst.offset.items()}
    assert float(hunt.abscissa({**design.parameters, **at_worst})) == pytest.approx(design.value, abs=1e-7)
