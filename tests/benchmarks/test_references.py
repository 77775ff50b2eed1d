"""The kept values of the random designs, at 60 digits and without the package's formulas; how they are chosen and kept."""

import json
import math
from dataclasses import replace
from pathlib import Path

import click
import pytest
from helpers.oracles import DIGITS, abscissa_60, polynomial_60, roots_60
from mpmath import mp

from benchmarks.judges import Attempt, confirmed
from benchmarks.reports.designs import Settings, best_of, run
from benchmarks.suites import REFERENCES, random_problem, references
from tmsopt import Problem, models

KEPT = references(Path(__file__).parents[2] / REFERENCES)
SOLVABLE = [i for i, one in KEPT.items() if one.solvable]
SOME = SOLVABLE[::9]
HEIGHTS = {"mu": 0.1, "chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2, "lambda_s": 0.2, "chi_B": 1.3}
FUNCTIONS = {f: getattr(mp, f) for f in ("sin", "cos", "tan", "sqrt", "exp", "log")} | {"abs": abs, "max": max}


def weave_squared(p):
    """Fr² where the Hurwitz determinant vanishes, which is linear in it once a factor Fr² is divided out.

    Where zeta_B = zeta_H the determinant is 0 at any speed and the limit counts: hence the shift.
    """
    shifted = {**p, "zeta_B": mp.mpf(p["zeta_B"]) * (1 + mp.mpf("1e-25"))}

    def hurwitz(Fr):
        a0, a1, a2, a3, a4 = polynomial_60(**{**shifted, "Fr": Fr})
        return (a1 * a2 * a3 - a0 * a3**2 - a1**2 * a4) / Fr**2

    one, two = hurwitz(1), hurwitz(2)
    return 1 - 3 * one / (two - one) if two != one else mp.nan


def least_weave(p):
    """The least Fr_c of the designs that round to this one: a root turns a rounding at 0 into 1e-8."""
    squared = weave_squared(p)
    spread = sum(abs(weave_squared({**p, n: mp.mpf(p[n]) * (1 + mp.mpf(2) ** -53)}) - squared) for n in p)
    return mp.sqrt(max(squared - spread, 0)) if squared + spread >= 0 else mp.nan


def quantities(p):
    """What the constraints of the suite name, from definitions: moments, geometry, product of the roots."""
    x = {n: mp.mpf(v) for n, v in p.items()}
    a = polynomial_60(**p)
    return x | {
        "chi_T": (x["chi_B"] + x["mu"] * x["chi_H"]) / (1 + x["mu"]),
        "nu_H": (x["chi_H"] - 1) * mp.cos(x["lambda_s"]) - x["zeta_H"] * mp.sin(x["lambda_s"]),
        "omega0": -((a[-1] / a[0]) ** mp.mpf("0.25")) if a[-1] / a[0] >= 0 else mp.nan,
    }


def violation(constraint, p):
    """Relative to the size of the two sides, at 60 digits."""
    comparison = next(c for c in ("<=", ">=", "==") if c in constraint)
    known = FUNCTIONS | quantities(p)
    if "Fr_c" in constraint:  # the suite limits it from above alone
        known["Fr_c"] = least_weave(p)
    left, right = (mp.mpf(eval(side, {}, known)) for side in constraint.split(comparison))
    beyond = {"<=": left - right, ">=": right - left, "==": abs(left - right)}[comparison]
    return max(beyond, 0) / max(1, abs(left), abs(right)) if mp.isfinite(beyond) else mp.inf


def test_every_problem_is_there():
    assert sorted(KEPT) == list(range(200))
    assert len(SOLVABLE) > 150  # the suite has a few that contradict themselves
    assert not any(one.doubtful for one in KEPT.values())


@pytest.mark.parametrize("index", SOLVABLE)
def test_a_kept_design_is_feasible(index):
    """Free parameters in the box, the others as given, every constraint at 60 digits within what the row says."""
    problem, one = random_problem(index), KEPT[index]
    assert {n: one.parameters[n] for n in problem.fixed} == dict(problem.fixed)
    assert all(lo <= one.parameters[n] <= hi for n, (lo, hi) in problem.free.items())
    with mp.workdps(DIGITS):
        worst = max(violation(text, dict(one.parameters)) for text in problem.constraints.values())
    assert one.violation <= 1e-9
    assert worst <= one.violation + 1e-14  # a hundred roundings of the judge's doubles


@pytest.mark.parametrize("index", SOME)
def test_the_stored_design_has_the_realised_abscissa(index):
    """Roots at 60 digits of the polynomial from the matrices; the kept number is that, rounded to a double."""
    one = KEPT[index]
    found = abscissa_60(polynomial_60(**one.parameters))
    assert float(found) == pytest.approx(one.realised, rel=4e-16, abs=1e-300)


@pytest.mark.parametrize("index", [i for i in SOLVABLE if KEPT[i].value != pytest.approx(KEPT[i].realised, rel=1e-8)])
def test_the_ideal_value_is_the_middle_of_a_scattered_root(index):
    """Rounding of coefficients scatters a multiple root as a cluster, whose mean it moves by no more than itself."""
    one = KEPT[index]
    real = sorted((float(root.real) for root in roots_60(polynomial_60(**one.parameters))), reverse=True)
    means = [sum(real[:k]) / k for k in (2, 3, 4)]
    assert min(abs(m - one.value) for m in means) <= 1e-8 * max(1, abs(one.value))
    assert one.value <= one.realised


def test_the_value_is_the_least_known():
    for i in SOLVABLE:
        one = KEPT[i]
        assert one.by
        assert one.value == pytest.approx(min(one.known.values()), rel=1e-8, abs=1e-11)
    for i in KEPT.keys() - SOLVABLE:
        assert math.isnan(KEPT[i].value)
        assert KEPT[i].violation > 1e-9


# Claims at exceptional points


def test_the_rounded_point_of_the_paper_confirms_its_value_and_no_other():
    """EP4: abscissa −(zeta_B zeta_H)^(−1/4), which the stored design misses by 1e-4 and its coefficients by 1e-15."""
    root = math.sqrt(2)
    design = {"Fr": 3 * math.sqrt(110 * root - 120) / 8, "chi_B": root, "lambda_s": math.atan(15 / 4 - 75 * root / 32)}
    box = {n: (0.9 * x, 1.1 * x) for n, x in design.items()}
    fixed = {n: x for n, x in HEIGHTS.items() if n not in box}
    problem = Problem(model=models.tms, fixed=fixed, free=box, minimize="abscissa")
    claimed = -((0.4 * 0.2) ** -0.25)

    def says(value, Fr=design["Fr"]):
        return confirmed(problem, {**fixed, **design, "Fr": Fr}, value)

    assert says(claimed)
    assert not says(claimed - 1e-6)
    assert not says(claimed, Fr=design["Fr"] * (1 + 1e-6))  # that design rounds no EP4


# How the best is chosen: Fr from 1 to 2, at most 1.5

PROBLEM = Problem(
    model=models.tms,
    fixed=HEIGHTS,
    free={"Fr": (1.0, 2.0)},
    constraints={"slow": "Fr <= 1.5"},
    minimize="abscissa",
)


def claim(source, Fr, violation=0.0, excess=0.0):
    """A claim of `solve`, true but for the excess; the violation is the judge's."""
    value = float(abscissa_60(polynomial_60(**{**HEIGHTS, "Fr": Fr}))) + excess
    return Attempt(source, "optimal", value, {**HEIGHTS, "Fr": Fr}, 0.1, 1, violation)


def test_a_violating_claim_and_a_false_one_do_not_count():
    claims = [claim("default", 1.5), claim("starts", 1.5, violation=2e-9), claim("from evolution", 1.5, excess=-1e-6)]
    found = best_of(PROBLEM, 0, claims, [])
    assert found.value == found.known["default"] == claims[0].value
    assert (found.by, found.doubtful) == (("default",), ("from evolution", "starts"))


def test_of_equal_values_the_cleanest_design_is_kept():
    lower, other = sorted((claim("a", 1.5), claim("b", 1.5 - 1e-11)), key=lambda c: c.value)
    assert 0 < other.value - lower.value < 1e-10
    found = best_of(PROBLEM, 0, [replace(lower, violation=5e-10), other], [])
    assert (found.value, found.violation, set(found.by)) == (other.value, 0.0, {"a", "b"})


def test_an_end_of_evolution_counts_with_its_exact_abscissa_and_only_if_feasible():
    ends = [{**HEIGHTS, "Fr": Fr} for Fr in (1.2, 1.5, 1.5 + 1e-10, 1.9)]
    found = best_of(PROBLEM, 0, [claim("default", 1.1, violation=1.0)], ends)
    least = min(abscissa_60(polynomial_60(**end)) for end in ends[:2])
    assert found.value == found.realised == pytest.approx(float(least), rel=4e-16)
    assert found.by == ("evolution",)
    assert found.violation == 0


def test_without_a_feasible_design_the_least_violation_is_kept():
    """Fr = 1.9 exceeds 1.5 by 0.4, relative to 1.9; Fr = 1.8 by 0.3, relative to 1.8."""
    found = best_of(PROBLEM, 0, [], [{**HEIGHTS, "Fr": Fr} for Fr in (1.9, 1.8)])
    assert not found.solvable
    assert math.isnan(found.value)
    assert found.violation == pytest.approx(0.3 / 1.8, rel=1e-13)


def test_what_is_kept_is_not_computed_again(tmp_path):
    """A value in the file that no computation could give is still there after a run."""
    path = tmp_path / "references.json"
    row = {
        "index": 0,
        "solvable": True,
        "value": -77.0,
        "realised": -77.0,
        "violation": 0.0,
        "parameters": {"Fr": 1.0},
        "known": {"default": -77.0},
        "doubtful": [],
    }
    settings = Settings(starts=1, evolutions=1)
    path.write_text(json.dumps({"settings": {"seed": 2018, "starts": 1, "evolutions": 1}, "problems": [row]}))
    assert run(1, settings, 1, path, "test")[0].value == -77
    assert references(path)[0].by == ("default",)
    with pytest.raises(click.UsageError, match="move it aside"):
        run(1, Settings(starts=2, evolutions=1), 1, path, "test")
