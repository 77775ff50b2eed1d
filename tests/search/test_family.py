"""A family solves each of its problems as if it were alone, whatever it solved before."""

import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from tmsopt import laws
from tmsopt.models import from_coefficients, tms
from tmsopt.problem import Problem, load, with_limit
from tmsopt.program import formulate
from tmsopt.search import Family, solve

EP4 = Problem(
    model=tms,
    fixed={"chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2, "mu": 0.1},
    free={"Fr": (0.01, 10), "chi_B": (1.01, 5), "lambda_s": (0.02, 1.4)},
    minimize="abscissa",
)


def with_fixed(problem, **values):
    return replace(problem, fixed={**problem.fixed, **values})


def limited(problem, name, value):
    return replace(problem, constraints={**problem.constraints, name: with_limit(problem.constraints[name], value)})


def test_every_member_obeys_the_laws_of_ep4():
    family = Family(["zeta_H", "zeta_B", "mu"])
    for zeta_B, zeta_H in ((-0.4, -0.2), (-1.0, -0.3), (-0.5, -0.45)):
        found = solve(with_fixed(EP4, zeta_B=zeta_B, zeta_H=zeta_H, mu=0.3), family=family)
        assert found.structure == "EP4"
        assert found.abscissa == pytest.approx(laws.w01(zeta_B, zeta_H), rel=1e-12)
        assert found.parameters["chi_B"] == pytest.approx(laws.chib1(zeta_B, zeta_H), rel=1e-12)
        assert math.tan(found.parameters["lambda_s"]) == pytest.approx(laws.tls(zeta_B, zeta_H), rel=1e-11)
        assert found.parameters["Fr"] == pytest.approx(laws.frep4(zeta_B, zeta_H)[0], rel=1e-11)


MEMBERS = {
    "matching": (["zeta_H"], lambda v: with_fixed(load("problems/ep4_matching.toml"), zeta_H=v), (-0.2, -0.25)),
    "constraint": (
        ["trail.limit"],
        lambda v: limited(replace(EP4, constraints={"trail": "0.05 <= nu_H"}), "trail", v),
        (0.09, 0.12),
    ),
    "tolerance": (["z_H"], lambda v: with_fixed(load("problems/workshop.toml"), z_H=v), (-0.2, -0.22)),
    "heavy damping or not": (
        ["damped.limit"],
        lambda v: limited(
            replace(EP4, minimize="Fr", constraints={"damped": "damping_ratio >= 0.5", "fast": "abscissa <= -0.5"}),
            "damped",
            v,
        ),
        (0.5, 1.0, 0.7),
    ),
    "quantity in pieces": (
        ["weight.limit"],
        lambda v: limited(replace(EP4, constraints={"weight": "ballast_rear <= 0.3"}), "weight", v),
        (0.3, 0.35),
    ),
    "a fixed tilt": (
        ["lambda_s"],
        lambda v: replace(EP4, fixed={**EP4.fixed, "lambda_s": v}, free={n: EP4.free[n] for n in ("Fr", "chi_B")}),
        (0.3, 0.5),
    ),
}


@pytest.mark.parametrize("name", MEMBERS)
@pytest.mark.slow
def test_a_member_is_solved_as_alone_and_whatever_came_before(name):
    """The same optimum as without a family; the very same bits in a family of its own."""
    varied, member, values = MEMBERS[name]
    family = Family(varied)
    shared = [solve(member(v), family=family) for v in values]
    for value, found in zip(values, shared, strict=True):
        fresh = solve(member(value), family=Family(varied))
        assert dict(fresh.parameters) == dict(found.parameters)
        assert fresh.value == found.value or (math.isnan(fresh.value) and math.isnan(found.value))
        alone = solve(member(value))
        # Where two corners of the tolerances are equally bad, either one's roots are told.
        assert alone.structure == found.structure or (name == "tolerance" and found.problem.tolerances)
        # IPOPT ends at 1e-12 and the polish at rounding; flat directions of an optimum are known to the root of it.
        assert found.value == pytest.approx(alone.value, rel=1e-10, nan_ok=True)
        assert found.abscissa == pytest.approx(alone.abscissa, rel=1e-6)


def test_the_box_of_a_member_is_its_own():
    family = Family(["mu"])
    for most in (0.3, 0.35):
        problem = replace(EP4, free={**EP4.free, "lambda_s": (0.02, most)})
        found = solve(problem, family=family)
        assert found.parameters["lambda_s"] == pytest.approx(most, abs=1e-12)  # the tilt of EP4 is 0.41
        assert family.formulate(problem).upper == formulate(problem).upper


def test_a_design_nearby_leads_to_the_same_optimum():
    start = solve(EP4)
    problem = with_fixed(EP4, zeta_H=-0.21)
    warm = solve(problem, near=start.parameters, starts=1)
    assert warm.starts.tried == 1
    assert warm.abscissa == pytest.approx(laws.w01(-0.4, -0.21), rel=1e-12)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_design_nearby_decides_on_the_side(sign):
    """Where both signs of the tilt would be searched, only that of the given design is."""
    problem = load("problems/realistic.toml")
    there = {n: (lo + hi) / 2 for n, (lo, hi) in problem.free.items()} | {"lambda_s": 0.2 * sign}
    found = solve(problem, near=there, starts=8, throw=False)
    assert sign * found.parameters["lambda_s"] >= 0  # reversed rake has no stable design: 0 is its best
    assert len(found.sides) == 1


def test_nothing_grows_without_end():
    """Boxes of a pattern without an objective are part of its NLP: each is another one."""
    family = Family(["mu"])
    problem = replace(EP4, minimize=None, locate="EP3")
    for k in range(40):
        family.formulate(replace(problem, free={**problem.free, "Fr": (0.01, 10.0 + k)}))
    assert len(family._nlps) == 32


ALIKE = {
    "a weight that is 1 at 0": (replace(EP4, minimize=None, maximize="radius"), "chi_H", (0.5, 0.0, -0.3), None),
    "a piece that is a number": (
        replace(
            EP4,
            fixed={**EP4.fixed, "chi_B": 1.4},
            free={n: EP4.free[n] for n in ("Fr", "lambda_s")},
            constraints={"weight": "ballast_rear <= 0.4"},
        ),
        "chi_B",
        (0.8, 1.4),
        None,
    ),
    "a second limit on the damping ratio": (
        replace(EP4, minimize="Fr", constraints={"low": "damping_ratio >= 0.2", "high": "damping_ratio <= 1"}),
        "high.limit",
        (1.0, 0.5, 2.0),
        None,
    ),
    "a damping ratio that is given": (
        replace(EP4, minimize="Fr", constraints={"damped": "damping_ratio >= 0.5"}),
        "damped.limit",
        (0.5, 1.5, -1.0),
        -1.0,
    ),
}


@pytest.mark.parametrize("name", ALIKE)
def test_a_member_has_the_rows_that_it_has_alone(name):
    """Whichever member was formulated first: the same rows, limits and values at a point."""
    problem, varied, values, ratio = ALIKE[name]
    for order in (values, values[::-1]):
        family = Family([varied])
        for value in order:
            stem = varied.removesuffix(".limit")
            member = limited(problem, stem, value) if stem != varied else with_fixed(problem, **{varied: value})
            shared = family.formulate(member, member.cases, ratio)
            own = formulate(member, member.cases, damping_ratio=ratio)
            for of in ("variables", "rows", "lower", "upper", "row_lower", "row_upper"):
                assert getattr(shared, of) == getattr(own, of)
            x = np.linspace(0.3, 1.2, len(own.variables))
            for a, b in zip(shared.at(x), own.at(x), strict=True):
                np.testing.assert_allclose(np.array(a), np.array(b), rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("varied", ["r", "k"])
def test_a_member_of_another_size_is_solved_in_units_of_its_own(varied):
    """s³ + a r s² + b r² s + r³, least k·abscissa: (s + r)³ by the product of the roots, with the bits it has alone."""
    a, b, r, k = (ca.SX.sym(n) for n in ("a", "b", "r", "k"))
    model = from_coefficients([1, a * r, b * r**2, r**3], quantities={"price": k * 1.0})
    family = Family((varied,))
    for size in (1.0, 1e-6, 1e3):
        fixed = {"r": 1.0, "k": 1.0} | {varied: size}
        free = {"a": (0.5, 6.0), "b": (0.5, 6.0)}
        problem = Problem(model=model, fixed=fixed, free=free, minimize="k*abscissa", constraints={"tie": "a >= 0.6"})
        units = [f.formulate(problem).objective_unit for f in (family, Family((varied,)))]
        assert units[0] == units[1]
        found, alone = (solve(problem, family=f) for f in (family, Family((varied,))))
        assert dict(found.parameters) == dict(alone.parameters)
        assert found.abscissa == pytest.approx(-fixed["r"], rel=1e-9)


def test_a_pole_in_the_box_of_one_member_is_none_in_that_of_another():
    """1/x becomes a variable where x may be 0, and there alone, whichever box came first."""
    x, y = (ca.SX.sym(n) for n in "xy")
    model = from_coefficients([1, x, y])
    ends = ((0.5, 3.0), (-0.5, 3.0))
    boxes = [Problem(model, fixed={"y": 2.0}, free={"x": e}, minimize="abscissa + 0.1/x") for e in ends]
    for order in (boxes, boxes[::-1]):
        family = Family(("y",))
        sizes = {problem.free["x"]: len(family.formulate(problem).variables) for problem in order}
        assert sizes[ends[1]] == sizes[ends[0]] + 1
