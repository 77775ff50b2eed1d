"""The greatest imaginary part of the roots, in objectives, constraints and cases: closed forms, and other computations.

The oscillator s² + 2 z s + 1 has the angular frequency √(1 − z²) up to z = 1, and 0 beyond.
"""

import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from helpers import hunt
from helpers.bicycles import BENCHMARK
from helpers.skates import EP4, skate

import tmsopt
from tmsopt.models import from_coefficients

pytestmark = pytest.mark.slow

c, z = ca.SX.sym("c"), ca.SX.sym("z")
OSCILLATOR = from_coefficients([1, 2 * z, 1])
THIRD = from_coefficients([1, 2 * z + c, 1 + 2 * z * c, c])  # (s² + 2 z s + 1) (s + c)
TWO = from_coefficients([1, 2 * z + 2 * c, 5 + 4 * z * c, 8 * z + 2 * c, 4])  # (s² + 2 z s + 1) (s² + 2 c s + 4)
TOLERANCE = 1e-8
SKATE = {"w": 1.0, "g": 9.81, "m_B": 10.0, "m_H": 1.0, "x_H": 1.0, "z_B": -0.4, "z_H": -0.2}
BOX = {"v": (2.0, 5.0), "x_B": (1.05, 1.2), "lambda_s": (0.09, 0.7)}
SLOW = {"slow": "decay_rate >= 1"}


def asked(free=BOX, fixed=(), **rest):
    return tmsopt.Problem(tmsopt.models.tms, fixed={**SKATE, **dict(fixed)}, free=free, **rest)


WEAVE = 4.46486771378823
"""Of the benchmark bicycle at 5 m/s: Meijaard, Papadopoulos, Ruina and Schwab (2007), table 2."""

# objective, constraints, optimum for z from 0.05 to 3
MINIMA = (
    ("angular_frequency", (), 0.0),
    ("angular_frequency", ("z <= 0.6",), 0.8),
    ("-angular_frequency", (), -math.sqrt(1 - 0.05**2)),
    ("z", ("angular_frequency <= 0.6",), 0.8),
    ("-z", ("angular_frequency >= 0.6",), -0.8),
    ("z", ("angular_frequency == 0.6",), 0.8),
    ("z", ("angular_frequency <= 0",), 1.0),
    ("abs(angular_frequency - 0.6)", (), 0.0),
    ("angular_frequency + abscissa", (), -1.0),
    ("abscissa * angular_frequency", (), -0.5),  # −z √(1 − z²)
    ("-abscissa", ("angular_frequency <= 0.6",), 3 - math.sqrt(8)),  # the slower of two real roots, at z = 3
    ("angular_frequency / 2 - damping_ratio", (), -1.0),
    ("abs(angular_frequency - 0.7) + abs(abscissa + 0.7)", (), math.sqrt(0.51) - 0.7),
    ("z", ("max(angular_frequency, 0.3) <= 0.6",), 0.8),
)


@pytest.mark.parametrize(("objective", "constraints", "optimum"), MINIMA)
def test_the_oscillator_in_closed_form(objective, constraints, optimum):
    limits = {f"c{k}": text for k, text in enumerate(constraints)}
    design = tmsopt.solve(tmsopt.Problem(OSCILLATOR, free={"z": (0.05, 3.0)}, minimize=objective, constraints=limits))
    assert design.value == pytest.approx(optimum, abs=TOLERANCE)


@pytest.mark.parametrize(
    ("model", "most", "sense", "expression", "limit", "optimum"),
    [
        (THIRD, (0.6, 3.0), "minimize", "angular_frequency", "c >= 0.2", 0.8),
        (THIRD, (3.0, 3.0), "minimize", "z - c/10", "angular_frequency <= 0.6", 0.8 - 0.3),
        (TWO, (0.9, 1.9), "minimize", "angular_frequency", "c >= 0.2", math.sqrt(4 - 1.9**2)),  # of the second pair
        (TWO, (0.9, 3.0), "minimize", "angular_frequency", "c >= 0.2", math.sqrt(1 - 0.9**2)),  # of the first
        (TWO, (3.0, 3.0), "minimize", "z + c", "angular_frequency <= 0.5", math.sqrt(0.75) + math.sqrt(3.75)),
        (TWO, (3.0, 3.0), "maximize", "z + c/2", "angular_frequency >= 0.5", 3 + math.sqrt(3.75) / 2),
    ],
)
def test_several_factors_in_closed_form(model, most, sense, expression, limit, optimum):
    free = {"z": (0.05, most[0]), "c": (0.1, most[1])}
    design = tmsopt.solve(tmsopt.Problem(model, free=free, constraints={"limit": limit}, **{sense: expression}))
    assert design.value == pytest.approx(optimum, abs=TOLERANCE)


def test_the_greatest_over_cases_is_limited():
    """With stiffness k the angular frequency is √(k − z²), greatest at the stiffest."""
    k = ca.SX.sym("k")
    model, limits = from_coefficients([1, 2 * z, k]), {"slow": "angular_frequency <= 0.5"}
    asked = {"free": {"z": (0.05, 3.0)}, "minimize": "z", "constraints": limits}
    for k_of in ((0.5, 2.0, 1.0), tmsopt.Band(0.5, 2.0, 2)):
        design = tmsopt.solve(tmsopt.Problem(model, scenarios={"k": k_of}, **asked))
        assert design.value == pytest.approx(math.sqrt(1.75), abs=TOLERANCE)
        assert design.quantities["angular_frequency"] == pytest.approx(0.5, abs=TOLERANCE)
    fixed = {"z": 0.5}
    alone = tmsopt.Problem(model, fixed=fixed, free={"k": (1.0, 4.0)}, tolerances={"k": 0.5}, maximize="k")
    design = tmsopt.solve(replace(alone, constraints={"slow": "angular_frequency <= 1.5"}))
    assert design.parameters["k"] == pytest.approx(1.5**2 + 0.25 - 0.5, abs=TOLERANCE)


def test_the_fastest_case_may_be_another_than_the_worst():
    """Slow, a skate swings fast; fast, it decays slowly."""
    band = {"scenarios": {"Fr": tmsopt.Band(1.2, 2.4, 3)}, "constraints": {"f": "angular_frequency <= 0.7"}}
    asked = skate({"chi_B": (1.01, 1.3), "lambda_s": (0.05, 1.2)}, minimize="abscissa", **band)
    design = tmsopt.solve(asked)
    each = {Fr: eigenvalues(asked, {**design.parameters, "Fr": Fr}) for Fr in np.linspace(1.2, 2.4, 501)}
    assert max(s.imag.max() for s in each.values()) == pytest.approx(0.7, abs=TOLERANCE)
    assert design.fastest.at["Fr"] == pytest.approx(max(each, key=lambda Fr: each[Fr].imag.max()), abs=0.003)
    assert design.worst.at["Fr"] == pytest.approx(max(each, key=lambda Fr: each[Fr].real.max()), abs=0.003)
    assert design.fastest != design.worst
    assert f"fastest case: Fr = {design.fastest.at['Fr']:.4g}" in design.report()


def test_units_of_the_roots_far_from_1():
    """s² + 2 z s + 10⁶ k has the angular frequency √(10⁶ k − z²)."""
    k = ca.SX.sym("k")
    model, free = from_coefficients([1, 2 * z, 1e6 * k]), {"z": (10.0, 900.0), "k": (0.5, 2.0)}
    least = tmsopt.Problem(model, free=free, minimize="angular_frequency", constraints={"k": "k >= 1"})
    assert tmsopt.solve(least).value == pytest.approx(math.sqrt(1e6 - 900**2), rel=1e-9)
    limits = {"f": "angular_frequency <= 500", "d": "abscissa <= -700"}
    stiffest = tmsopt.Problem(model, free=free, maximize="k", constraints=limits)
    assert tmsopt.solve(stiffest).value == pytest.approx((500**2 + 900**2) / 1e6, rel=1e-9)
    loose = {"f": "angular_frequency <= 500", "k": "k >= 1"}  # does not bind: √(10⁶ k − 900²) is 436 at k = 1
    judged = tmsopt.optimality(tmsopt.Problem(model, free=free, minimize="abscissa", constraints=loose))
    assert "frequency" not in judged.report()


def test_a_multiple_root_does_not_oscillate():
    """The EP4 of the scaling law, whose eigenvalues as stored are a pair 1e-4 off the real axis or so."""
    fixed = {n: float(getattr(EP4, n)) for n in ("Fr", "chi_B", "lambda_s")}
    design = tmsopt.solve(skate({}, fixed, minimize="angular_frequency"))
    assert (design.structure, design.value) == ("EP4", 0.0)


def test_the_benchmark_bicycle():
    """In Hz of its weave, Im s over 2π."""
    problem = tmsopt.Problem(tmsopt.models.whipple, fixed=BENCHMARK, constraints={"f": "frequency <= 0.7"})
    design = tmsopt.solve(replace(problem, minimize="frequency"), throw=False)
    assert design.value == pytest.approx(WEAVE / (2 * math.pi), rel=1e-13)
    assert design.quantities["frequency"] == design.value
    assert design.to_json()["units"]["frequency"] == "Hz"
    assert "0.71060577 Hz" in design.report()
    assert design.quantities["angular_frequency"] == pytest.approx(WEAVE, rel=1e-13)
    assert design.violations["f"] == pytest.approx(WEAVE / (2 * math.pi) - 0.7, rel=1e-10)
    assert tmsopt.solve(replace(problem, constraints={"f": "frequency <= 0.7107"})).status == "optimal"


def eigenvalues(problem, parameters):
    return np.roots([float(x) for x in problem.posed.values(dict(parameters)).coefficients])


RATE = math.sqrt(SKATE["g"] / SKATE["w"])


def decay(design):
    """In 1/s, of two-mass skates, by eigenvalues of companion matrices."""
    return -hunt.abscissa({**SKATE, **design}) * RATE


def frequency(design):
    """Likewise in Hz."""
    return hunt.roots({**SKATE, **design}).imag.max(axis=-1) * RATE / (2 * math.pi)


@pytest.mark.parametrize(
    ("sense", "expression", "limits"),
    [
        ("minimize", "frequency", SLOW),
        ("maximize", "decay_rate", {"f": "frequency <= 0.24"}),
        ("maximize", "frequency", {"d": "decay_rate >= 0.5"}),
    ],
    ids=["least", "limited", "greatest"],
)
def test_no_search_finds_a_better_skate(sense, expression, limits):
    design = tmsopt.solve(asked(constraints=limits, **{sense: expression}))
    judged = hunt.judge(sense, expression, limits.values(), {"decay_rate": decay, "frequency": frequency})
    value, violation = judged({n: design.parameters[n] for n in BOX})
    assert value == pytest.approx(design.value if sense == "minimize" else -design.value, abs=TOLERANCE)
    assert violation <= TOLERANCE
    if "f" in limits:
        assert design.active["f"] > 0
        assert frequency(design.parameters) == pytest.approx(float(limits["f"].split()[-1]), abs=TOLERANCE)
    _, best = hunt.least(judged, SKATE, BOX, 1, 45, 6)
    assert value <= best + 1e-7
    assert value == pytest.approx(best, abs=1e-5 * (1 + abs(best)))  # so near the search came, too


def test_what_does_not_judge_it_says_so():
    pytest.importorskip("pyscipopt")
    design = tmsopt.certify(asked(constraints=SLOW, minimize="frequency"), seconds=5)
    assert not math.isfinite(design.bound.value)
    assert any("angular_frequency" in note for note in design.notes)
    assert "does not cover frequencies" in design.report()
    judged = tmsopt.optimality(design)
    assert "the angular frequency is active" in judged.report()


def test_a_frequency_of_0_is_the_least_there_is():
    """Of two real roots, by definition."""
    pytest.importorskip("pyscipopt")
    design = tmsopt.certify(tmsopt.Problem(OSCILLATOR, free={"z": (0.05, 3.0)}, minimize="angular_frequency"))
    assert design.bound.proven
    assert (design.value, design.bound.value) == (0, 0)


def test_an_equality_is_met_and_neither_proved_nor_counted():
    free = {"v": (2.0, 8.0), "x_B": (1.05, 2.0)}
    equal = asked(free, {"lambda_s": 0.3}, locate="EP2", constraints={"f": "frequency == 0.3"})
    with pytest.raises(tmsopt.InputError, match="the constraints use angular_frequency"):
        tmsopt.solve_all(equal)
    design = tmsopt.solve(equal)
    assert eigenvalues(equal, design.parameters).imag.max() * math.sqrt(9.81) / (2 * math.pi) == pytest.approx(0.3)
    assert "angular_frequency" in tmsopt.prove(design).report()
