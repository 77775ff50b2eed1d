"""What was compiled for one problem serves others of its structure, and each is solved as if it were alone."""

import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from helpers.skates import skate

from tmsopt import laws
from tmsopt.algebra import FLOATS
from tmsopt.models import from_coefficients
from tmsopt.problem import Problem, load, replace_limit
from tmsopt.program import forget_solvers, formulate
from tmsopt.search import solve

EP4 = skate({"Fr": (0.01, 10), "chi_B": (1.01, 5), "lambda_s": (0.02, 1.4)}, minimize="abscissa")


def with_fixed(problem, **values):
    return replace(problem, fixed={**problem.fixed, **values})


def test_every_member_obeys_the_laws_of_ep4():
    for zeta_B, zeta_H in ((-0.4, -0.2), (-1.0, -0.3), (-0.5, -0.45)):
        found = solve(with_fixed(EP4, zeta_B=zeta_B, zeta_H=zeta_H, mu=0.3))
        assert found.structure == "EP4"
        assert found.abscissa == pytest.approx(laws.w01(zeta_B, zeta_H), rel=1e-12)
        assert found.parameters["chi_B"] == pytest.approx(laws.chib1(zeta_B, zeta_H), rel=1e-12)
        assert math.tan(found.parameters["lambda_s"]) == pytest.approx(laws.tls(zeta_B, zeta_H), rel=1e-11)
        assert found.parameters["Fr"] == pytest.approx(laws.frep4(zeta_B, zeta_H)[0], rel=1e-11)


MEMBERS = {
    "matching": (lambda v: with_fixed(load("problems/ep4_matching.toml"), zeta_H=v), (-0.2, -0.25)),
    "constraint": (lambda v: replace(EP4, constraints={"trail": replace_limit("0.05 <= nu_H", v)}), (0.09, 0.12)),
    "tolerance": (lambda v: with_fixed(load("problems/workshop.toml"), z_H=v), (-0.2, -0.22)),
    "heavy damping or not": (
        lambda v: replace(EP4, minimize="Fr", constraints={"d": f"damping_ratio >= {v}", "f": "abscissa <= -0.5"}),
        (0.5, 1.0, 0.7),
    ),
    "quantity in pieces": (lambda v: replace(EP4, constraints={"weight": f"ballast_rear <= {v}"}), (0.3, 0.35)),
    "a fixed tilt": (
        lambda v: replace(EP4, fixed={**EP4.fixed, "lambda_s": v}, free={n: EP4.free[n] for n in ("Fr", "chi_B")}),
        (0.3, 0.5),
    ),
}


@pytest.mark.parametrize("name", MEMBERS)
@pytest.mark.slow
def test_a_member_is_solved_as_alone_and_whatever_came_before(name):
    """The very same bits as of what is compiled anew."""
    member, values = MEMBERS[name]
    forget_solvers()
    shared = [solve(member(v)) for v in values]
    for value, found in zip(values, shared, strict=True):
        forget_solvers()
        fresh = solve(member(value))
        assert dict(fresh.parameters) == dict(found.parameters)
        assert fresh.value == found.value or (math.isnan(fresh.value) and math.isnan(found.value))


def test_the_box_of_a_member_is_its_own():
    for most in (0.3, 0.35):
        problem = replace(EP4, free={**EP4.free, "lambda_s": (0.02, most)})
        assert solve(problem).parameters["lambda_s"] == pytest.approx(most, abs=1e-12)  # the tilt of EP4 is 0.41


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


def test_a_number_is_a_parameter_unless_it_is_nothing():
    """What differs in numbers alone is the same formula; a 0 leaves terms out."""
    ours, others = (formulate(with_fixed(EP4, chi_H=1.02, mu=mu).posed) for mu in (0.1, 0.7))
    assert ours.formula == others.formula
    assert ours.program is others.program
    assert ours.constants != others.constants
    lighter = formulate(with_fixed(EP4, chi_H=1.02, mu=0.0).posed)
    assert len(lighter.formula.steps) < len(ours.formula.steps)
    x = np.linspace(0.3, 1.2, len(ours.variables))
    own = np.array([ours.evaluate(x)[0], *ours.evaluate(x)[1]])
    np.testing.assert_allclose(own, np.array(ours.fold(x, FLOATS), dtype=float), rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("varied", ["r", "k"])
def test_a_member_of_another_size_is_solved_in_units_of_its_own(varied):
    """s³ + a r s² + b r² s + r³, least k·abscissa: (s + r)³ by the product of the roots, with the bits it has alone."""
    a, b, r, k = (ca.SX.sym(n) for n in ("a", "b", "r", "k"))
    model = from_coefficients([1, a * r, b * r**2, r**3], quantities={"price": k * 1.0})
    for size in (1.0, 1e-6, 1e3):
        fixed, free = {"r": 1.0, "k": 1.0} | {varied: size}, {"a": (0.5, 6.0), "b": (0.5, 6.0)}
        problem = Problem(model, fixed=fixed, free=free, minimize="k*abscissa", constraints={"tie": "a >= 0.6"})
        found = solve(problem)
        forget_solvers()
        alone = solve(problem)
        assert dict(found.parameters) == dict(alone.parameters)
        assert found.abscissa == pytest.approx(-fixed["r"], rel=1e-9)


def test_a_pole_in_the_box_of_one_member_is_none_in_that_of_another():
    """1/x becomes a variable where x may be 0, and there alone, whichever box came first."""
    x, y = (ca.SX.sym(n) for n in "xy")
    model = from_coefficients([1, x, y])
    ends = ((0.5, 3.0), (-0.5, 3.0))
    boxes = [Problem(model, fixed={"y": 2.0}, free={"x": e}, minimize="abscissa + 0.1/x") for e in ends]
    for order in (boxes, boxes[::-1]):
        sizes = {problem.free["x"]: len(formulate(problem.posed).variables) for problem in order}
        assert sizes[ends[1]] == sizes[ends[0]] + 1
