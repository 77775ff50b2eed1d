"""The independent judge: its bicycles are the published ones, and each false statement is caught."""

import json
import math
from dataclasses import replace

import mpmath
import numpy as np
import pytest
from helpers.bicycles import MATRICES

from benchmarks.suites.fresh import FAMILIES, judge, known, problems
from benchmarks.suites.fresh.bicycles import BENCHMARK, SI, TMS, whipple
from benchmarks.suites.fresh.formulas import FLOATS, evaluate
from benchmarks.suites.fresh.problem import System, eigenvalues, measure_exactly, state_matrix


def test_whipple_has_the_published_matrices():
    """Meijaard, Papadopoulos, Ruina and Schwab (2007), equations 6.2 to 6.5, at v = 1 m/s."""
    mass, damping, stiffness = whipple({**BENCHMARK, "lambda_s": math.pi / 10, "g": 9.81, "v": 1}, math.sin, math.cos)
    M, C1, still, with_speed = map(np.array, MATRICES)
    assert np.allclose(mass, M, atol=1e-13)
    assert np.allclose(damping, C1, atol=1e-13)
    assert np.allclose(stiffness, 9.81 * still + with_speed, atol=1e-11)


def test_whipple_without_wheels_is_the_skates():
    """Two point masses on skates: equation copo of Kirillov (2018), in units of √(g/w)."""
    robot = {"w": 0.8, "v": 3.0, "g": 9.81, "lambda_s": 0.3, "m_B": 10.0, "x_B": 0.5, "z_B": -0.5}
    robot |= {"m_H": 2.0, "x_H": 0.85, "z_H": -0.3}
    values = dict(robot)
    for name, text in SI:
        values[name] = evaluate(text, values, FLOATS)
    skates = state_matrix(System("coefficients", ((TMS,),)), values, 1)
    wheels = state_matrix(System("whipple"), {**robot, "time": math.sqrt(0.8 / 9.81)}, 1)
    assert np.allclose(*(np.sort_complex(eigenvalues(m)[0]) for m in (skates, wheels)), atol=1e-12)


def test_problems_are_480_different_ones():
    """Forty of each of twelve families, the same at every call."""
    some = problems()
    assert len(some) == len({p.text for p in some}) == 40 * len(FAMILIES) == 480
    assert [p.text for p in problems(2)] == [p.text for p in problems(2)]


def said(**data):
    """A solution as the command line would print it."""
    text = {"bound": {}, "starts": {}, "roots": [], "violations": {}, "any_stable": None, "notes": [], **data}
    return {"solve": {"out": json.dumps(text), "error": ""}, "prove": {"out": "{}", "error": ""}}


def test_an_optimum_that_is_beaten_is_false():
    """The least speed of an upright pendulum's gain: kd = 0.9 top is feasible, the reference is better."""
    problem = FAMILIES["barely"](3)
    best = {"design": problem.feasible, "value": 1.0, "violation": 0.0, "abscissa": -1.0}
    real = measure_exactly(problem, problem.feasible)
    assert not real.violations
    answer = said(status="optimal", objective={"value": real.objective}, parameters=dict(problem.feasible))
    assert set(judge(problem, best, answer).false) == {"optimum"}
    assert not judge(problem, {**best, "value": real.objective}, answer).false


def test_a_violated_limit_must_be_told():
    """A tenth of the gain violates the decay."""
    problem = FAMILIES["barely"](3)
    design = {n: x / 10 for n, x in problem.feasible.items()}
    real = measure_exactly(problem, design)
    answer = {"status": "optimal", "objective": {"value": real.objective}, "parameters": design}
    best = {"design": design, "value": real.objective, "violation": 1.0, "abscissa": 0.0}
    assert set(judge(problem, best, said(**answer)).false) == {"feasible"}
    told = judge(problem, best, said(**answer, missed_as_stored=dict(real.violations)))
    assert told.missed
    assert not told.false


def test_fixed_parameters_are_doubles_too():
    """Beside a triple root -0.693 and the double nearest to it are 1e-5 of the abscissa apart: the polynomial at 60 digits."""
    problem = FAMILIES["barely"](1)
    design = {"Fr": 1.6553436965986843, "chi_B": 1.3779074395029411, "lambda_s": 0.21701901450517716}

    def abscissa(number):
        Fr, chi_B, t = mpmath.mpf(design["Fr"]), mpmath.mpf(design["chi_B"]), mpmath.tan(design["lambda_s"])
        B, H = map(number, ("-0.693", "-0.365"))
        a = [
            -H * t * B**2,
            Fr * (B - H * chi_B) * B,
            Fr**2 * (B - H) * B - B * (B + H) * t,
            -Fr * (chi_B - 1) * B,
            -B * t,
        ]
        return max(mpmath.re(r) for r in mpmath.polyroots(a, maxsteps=500, extraprec=500))

    with mpmath.workdps(60):
        typed, stored = abscissa(mpmath.mpf), abscissa(lambda text: mpmath.mpf(float(text)))
    assert abs(typed - stored) > 1e-5
    assert measure_exactly(problem, design).abscissa == pytest.approx(float(stored), abs=1e-12)


def test_both_abscissae_of_a_multiple_root_are_told_or_it_is_false():
    """A triple root, claimed 1e-5 away from where the doubles have theirs."""
    problem = replace(FAMILIES["gains"](12), limits={})
    design = {"g1": 1.9361163917467337, "g2": 0.20417357404563558, "g3": 0.1449650269857808}
    stored = measure_exactly(problem, design).abscissa
    answer = {"status": "optimal", "parameters": design, "roots": [{"re": 0.0507, "im": 0.0, "multiplicity": 3}]}
    best = {"design": design, "value": stored, "violation": 0.0, "abscissa": stored}

    def verdict(value, realised):
        return set(judge(problem, best, said(**answer, objective={"value": value}, abscissa_realised=realised)).false)

    assert verdict(0.99999 * stored, stored) == set()
    assert verdict(0.99999 * stored, 1.1 * stored) == {"value"}
    assert verdict(0.9 * stored, stored) == {"value"}
    assert "value" in verdict(0.99999 * stored, None)


def test_false_infeasible_and_false_proofs():
    """A feasible design refutes *infeasible*, a stable one *none is stable*, a better one a bound."""
    problem = FAMILIES["barely"](0)
    best = {"design": problem.feasible, "value": 1.0, "violation": 0.0, "abscissa": -1.0}
    answer = said(status="infeasible", any_stable=False, bound={"proven": True, "value": 2.0})
    assert set(judge(problem, best, answer).false) == {"infeasible", "proved"}


@pytest.mark.parametrize("number", range(8))
def test_points_that_are_missing_or_none(number):
    """Complete and empty is false where a point is known; a semisimple crossing is none."""
    problem = FAMILIES["points"](number)
    points = known(problem)
    verdict = judge(problem, points, said(solutions=[], complete=True))
    assert set(verdict.false) == ({"complete"} if points["points"] else set())
    design = points["points"][0] if points["points"] else dict.fromkeys(problem.free, 0.0)
    verdict = judge(problem, points, said(solutions=[{"parameters": design, "proved": True}], complete=False))
    assert set(verdict.false) == (set() if points["points"] else {"proved"})
