"""Limits on the roots hold for the parameters as they are stored: roots at 60 digits of the doubles."""

from importlib import import_module

import numpy as np
import pytest
from helpers.oracles import roots_60
from mpmath import mp

import tmsopt
from tmsopt.evaluation import recheck
from tmsopt.models import from_coefficients

held = import_module("tmsopt.evaluation.stored").find_storable_design
KEPT = 1e-9  # relative to the greater of 1 and the limit


def least_sum(n, limits, top=30.0, **more):
    """The polynomial sⁿ + a sⁿ⁻¹ + … with the least sum of coefficients."""
    names = "abcde"[:n]
    free = dict.fromkeys(names, (0.0, top))
    model = from_coefficients([1, *names])
    return tmsopt.solve(tmsopt.Problem(model, free=free, minimize=" + ".join(names), constraints=limits, **more))


def stored_roots(found, coefficients=None):
    return list(roots_60([mp.mpf(1), *(mp.mpf(x) for x in coefficients or found.parameters.values())]))


@pytest.mark.parametrize(("n", "decay"), [(2, 1.1), (3, 1.1), (4, 0.3)])
def test_a_multiple_root_on_a_limit_is_stored_left_of_it(n, decay):
    """(s + decay)ⁿ has the least coefficients; the nearest doubles have roots right of −decay by up to 1e-3."""
    found = least_sum(n, {"fast": f"abscissa <= {-decay}"})
    assert max(z.real for z in stored_roots(found)) <= -decay + KEPT
    assert found.abscissa_realised <= -decay + KEPT
    assert found.structure == f"EP{n}"
    assert not found.missed
    assert found.value == pytest.approx((1 + decay) ** n - 1, rel=1e-6)  # at s = 1, less the leading 1
    assert found.abscissa == pytest.approx(-decay, abs=5e-7)


def test_a_double_pair_on_a_limit_of_the_damping_ratio():
    """(s² + 2 ζ s + 1)² among quartics with one product of the roots; ζ² = 0.36."""
    free = dict.fromkeys("abc", (0.0, 30.0))
    limits = {"damped": "damping_ratio >= 0.6", "even": "a == c", "low": "b <= 3.44"}
    problem = tmsopt.Problem(from_coefficients([1, *"abc", 1]), free=free, minimize="a", constraints=limits)
    found = tmsopt.solve(problem)
    roots = stored_roots(found, [*found.parameters.values(), 1])
    assert min(-z.real / abs(z) for z in roots) >= 0.6 - KEPT
    assert found.value == pytest.approx(2.4, abs=1e-6)


def test_the_limit_holds_in_every_scenario():
    """s³ + a s² + b s + c + m is slowest where m is least or greatest."""
    free = dict.fromkeys("abc", (0.0, 20.0))
    problem = tmsopt.Problem(
        from_coefficients([1, "a", "b", "c + m"]),
        free=free,
        minimize="a + b + c",
        constraints={"fast": "abscissa <= -0.7"},
        scenarios={"m": (0.25, 0.75)},
    )
    found = tmsopt.solve(problem)
    a, b, c = (found.parameters[n] for n in "abc")
    worst = max(z.real for m in (0.25, 0.75) for z in stored_roots(found, [a, b, mp.mpf(c) + m]))
    assert worst <= -0.7 + KEPT


def test_what_a_given_design_misses_is_told():
    """(s + 1.1)³ in decimals: a triple root as far as a structure tells, at −1.0999… as stored."""
    fixed = {"a": 3.3000000000000003, "b": 3.63, "c": 1.3310000000000002}
    problem = tmsopt.Problem(
        from_coefficients([1, *"abc"]), fixed=fixed, minimize="a", constraints={"fast": "abscissa <= -1.1"}
    )
    found = tmsopt.solve(problem)
    miss = float(max(z.real for z in stored_roots(found)) + mp.mpf(1.1))
    assert miss > 1e-6
    assert found.missed["fast"] == pytest.approx(miss, rel=1e-6)
    assert found.to_json()["missed_as_stored"]["fast"] == pytest.approx(miss, rel=1e-5)
    told = f"fast by {miss:.3g}"
    assert told in found.report()
    assert told in repr(found)


def test_the_headline_has_the_abscissa_of_the_doubles_too():
    """At the EP4 of the benchmark heights rounding alone moves the rightmost root by some 1e-4."""
    found = tmsopt.solve("problems/ep4.toml")
    assert abs(found.abscissa_realised - found.abscissa) > 1e-6
    for text in (repr(found), found.report()):
        assert f"{found.abscissa_realised:.7g} in double precision" in text
    assert "double precision" not in repr(tmsopt.solve("problems/least_speed.toml"))  # of simple roots


def test_roots_near_a_4_fold_one_are_those_of_the_doubles():
    """Roots −1 ± 0.005 i and −1.003 ± 0.01 i are no multiple ones to 1e-11; numeric ones are off by 1e-9."""
    a = np.polymul([1, 2, 1 + 2.5e-5], [1, 2.006, 1.003**2 + 1e-4])
    fixed = dict(zip("abcd", a[1:].tolist(), strict=True))
    found = recheck(tmsopt.Problem(from_coefficients([1, *"abcd"]), fixed=fixed).posed, fixed)
    exact = float(max(z.real for z in roots_60([mp.mpf(1), *map(mp.mpf, fixed.values())])))
    assert found.structure.abscissa == pytest.approx(exact, abs=1e-14)
    assert found.abscissa_realised == pytest.approx(exact, abs=1e-14)


@pytest.mark.parametrize("end", [0.36, 0.30956709128158444])
def test_the_objective_exists_at_the_design_as_stored(end, monkeypatch):
    """The weave speed ends at 0: at this design, the optimum but for rounding, its square is -1e-15 by 60 digits."""
    free = {"x_B": (0.03, 0.4), "x_H": (0.15, end)}
    fixed = {"w": 0.25, "v": 2.0924341065944914, "g": 9.81, "lambda_s": 0.09586586422163405, "m_B": 9.0, "z_B": -0.153}
    fixed |= {"m_H": 2.0207325532013756, "z_H": -0.0857}
    problem = tmsopt.Problem(tmsopt.models.tms, fixed=fixed, free=free, minimize="v_c").posed
    design = problem.ordered({"x_B": 0.30707257323404263, "x_H": 0.30956709128158444})
    monkeypatch.setattr(tmsopt.laws, "_tan", mp.tan)

    def square(given):
        p = {n: mp.mpf(x) for n, x in given.items()}
        heights = [p[n] / p["w"] for n in ("x_B", "x_H", "z_B", "z_H")]
        return tmsopt.laws.flus.__wrapped__(p["m_H"] / p["m_B"], *heights, p["lambda_s"])

    with mp.workdps(60):
        assert -1e-14 < square(design) < 0
        stored, checked, _ = held(problem, design, recheck(problem, design), problem.cases)
        assert 0 < square(stored) < 1e-12
        assert checked.objective**2 == pytest.approx(float(square(stored)) * 9.81 * 0.25, rel=0.2)
    assert {n: stored[n] for n in stored if n not in free} == fixed
    assert all(stored[n] == pytest.approx(design[n], rel=1e-13) and stored[n] <= free[n][1] for n in free)
