"""Rounded designs beside the same by exact roots of decimals, worked out one by one."""

import math
from dataclasses import replace
from fractions import Fraction

import flint
import pytest

import tmsopt
from tmsopt import Problem, models
from tmsopt.analysis import list_rounded_designs, round_design
from tmsopt.evaluation import find_worst_cases, realised_abscissa, recheck
from tmsopt.problem import unit_of
from tmsopt.roots import exact_roots

QUARTIC = models.from_coefficients(["1", "a", "b", "c", "d"], name="quartic")
BOX = {"a": (1.0, 9.0), "b": (1.0, 9.0), "c": (1.0, 9.0), "d": (0.5, 3.0)}

PROBLEMS = {
    "tms": "problems/ep4.toml",
    "tms with limits": "problems/realistic.toml",
    "wheels": "problems/whipple_ep4.toml",
    "stated, limits, EP5": "problems/chocolate_limit.toml",
    "constants that are no doubles": "problems/transport_aircraft.toml",
    "band": "problems/speed_band.toml",
    "tolerances": "problems/workshop.toml",
    "limits that differ between cases": Problem(
        models.tms,
        fixed={"chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2},
        scenarios={"mu": [0.1, 0.2, 0.3]},
        free={"Fr": (0.01, 10.0), "chi_B": (1.01, 5.0), "lambda_s": (0.02, 1.4)},
        minimize="abscissa",
        constraints={"layout": "chi_B + mu <= 1.5567"},
    ),
    "whole numbers with EP4": Problem(QUARTIC, free=BOX, locate="EP4", constraints={"place": "d == 1"}),
    "whole numbers with EP4, and limits that it passes": Problem(
        QUARTIC,
        fixed={"c": 4.0, "d": 1.0},
        free={n: BOX[n] for n in "ab"},
        locate="EP4",
        constraints={"fast": "abscissa <= -0.99", "calm": "angular_frequency <= 1e-6"},
    ),
}


@pytest.fixture(scope="module", params=PROBLEMS)
def solution(request):
    return tmsopt.solve(PROBLEMS[request.param])


def exact(solution, written):
    """The decimals, at 140 digits, and the other parameters as stored."""
    found = dict(solution.parameters)
    for name, text in written.items():
        one = unit_of(solution.problem.posed, name).factor
        share = Fraction(one).limit_denominator(10**6)
        degrees = flint.arb.pi() / 180
        whole = degrees if one == math.pi / 180 else flint.arb(flint.fmpq(share.numerator, share.denominator))
        found[name] = flint.arb(text.split()[0]) * whole
    return found


def roots_of(problem, design):
    with flint.ctx.workdps(140):
        return exact_roots(
            problem.model.coefficients({n: flint.arb(x) for n, x in design.items()}, problem.parameter_set)
        )


def one_by_one(solution, row):
    """Abscissa, damping ratio and violations of a rounded design."""
    problem = solution.problem.posed
    with flint.ctx.workdps(140):
        design = exact(solution, row.written)
        plain = {n: float(x) for n, x in design.items()}
        listed = [case for case in problem.cases if not case.direction]
        cases = [*listed, solution.worst, *(w.case for w in find_worst_cases(problem, plain).values())]
        each = [case.applied(design) for case in cases] if listed else [design]
        motion = [roots_of(problem, one) for one in each]
        realised = max(realised_abscissa(problem, one) for one in each)
    ratio = min(-r.re / (math.hypot(r.re, r.im) or 1) for found in motion for r in found)  # 0 of a root at 0
    known = {"abscissa": realised, "damping_ratio": ratio}
    known["angular_frequency"] = max(abs(r.im) for found in motion for r in found)
    found = [problem.values(plain), *(problem.values({n: float(x) for n, x in one.items()}) for one in each)]
    found = [values.with_known(known) for values in found]
    violated = {}
    for name, condition in problem.conditions.items():
        amounts = [(condition.violation(v), float(condition.excess(condition(v)))) for v in found]
        if max(amounts)[0] > 1e-9:
            violated[name] = max(amounts)[1]
    for name, ends in problem.free.items():
        for end, amount, limit in zip(
            ("min", "max"), (ends[0] - plain[name], plain[name] - ends[1]), ends, strict=True
        ):
            if amount > 1e-9 * max(1, abs(limit)):
                violated[f"{name}.{end}"] = amount
    return realised, ratio, violated, problem.objective and float(problem.objective(found[0]))


@pytest.mark.slow
def test_at_once_they_are_those_of_one_by_one(solution):
    alone, together = list_rounded_designs(solution)
    assert [row.digits for row in together] == [2, 3, 4, 6]
    found = [*alone.values(), *together]
    for row in found:
        realised, ratio, violated, objective = one_by_one(solution, row)
        # the nearest double, both; over a band or a box a smooth peak is met within 1e-6 of its width, and so to 1e-12
        near = 1e-12 if solution.problem.scenarios or solution.problem.tolerances else 0
        assert row.realised == pytest.approx(realised, rel=near, abs=0)
        assert row.loss == row.realised - solution.abscissa
        assert row.damping_ratio == pytest.approx(ratio, rel=1e-15 + near)
        assert dict(row.violations) == {n: pytest.approx(x, rel=1e-12, abs=1e-12) for n, x in violated.items()}
        assert (
            math.isnan(row.objective)
            if objective is None
            else row.objective == pytest.approx(objective, rel=1e-15 + near)
        )
    if solution.problem.model is QUARTIC:  # numeric roots beside this one are 1e-4 off
        assert [(row.realised, row.damping_ratio) for row in together] == [(-1.0, 1.0)] * 4
        assert not any(row.violations for row in together)


def test_a_limit_is_violated_by_as_much_as_in_the_recheck():
    """(Fr - 2.2004)**4 <= 0 is met at one speed alone, which five digits have and two or three miss by 4e-4."""
    problem = replace(tmsopt.load("problems/ep4.toml"), constraints={"speed": "(Fr - 2.2004)**4 <= 0"})
    solution = replace(tmsopt.solve("problems/ep4.toml"), problem=problem)
    solution = replace(solution, parameters={**solution.parameters, "Fr": 2.2004})
    for row in round_design(solution, [(["Fr"], digits) for digits in (2, 3, 5)]):
        checked = recheck(problem.posed, {**solution.parameters, "Fr": float(row.written["Fr"])})
        assert dict(row.violations) == dict(checked.amounts)
        assert dict(row.violations) == ({"speed": pytest.approx(4e-4**4, rel=1e-9)} if row.digits < 4 else {})


def test_what_has_no_motion_is_judged_too():
    """At two digits the leading coefficient is 0: one root is at infinity, and the abscissa is that of the cubic."""
    quartic = models.from_coefficients(["m - 0.25", "4", "6 + 0*m", "4", "1"], name="lead")
    problem = Problem(quartic, free={"m": (0.2, 2.0)}, minimize="(m - 0.2500001)**2")
    solution = tmsopt.solve(problem, throw=False)
    _, together = list_rounded_designs(solution)
    row = together[0]
    assert dict(row.written) == {"m": "0.25"}
    assert row.realised == pytest.approx(-0.5, rel=1e-15)  # 4 s³ + 6 s² + 4 s + 1 = (2 s + 1)(2 s² + 2 s + 1)
    assert math.isnan(row.damping_ratio)
