"""The printed gains of limits against the first-order conditions, set up another way and solved at 60 digits.

The structure of the optimum is imposed exactly, as equations between the coefficients and its factors. The gradient of
the objective is then a combination of the gradients of these equations and of the active limits; the weights of the
limits are the gains. Polynomial and quantities are those of test_digits, from the paper's matrices.
"""

import json

import pytest
from helpers.hunt import PROBLEMS
from helpers.oracles import polynomial_60
from helpers.structures import FORMS, native_60, pair, quantities_60, times
from mpmath import mp
from mpmath.calculus.optimization import jacobian

import tmsopt
from tmsopt.models import from_coefficients


def names_60(parameters, unknowns):
    """What the objectives and limits below speak of; the first unknown is the abscissa."""
    found = quantities_60(parameters)
    overhang = (found["chi_T"] - 1) * (1 + found["mu"])  # where the rear wheel lifts, or is about to
    return {**parameters, **found, "abscissa": unknowns[0], "ballast_rear": overhang}


def gains_60(data, problem):
    """Gain of each active limit, at the printed parameters."""
    free = list(problem.free)
    z = [mp.mpc(r["re"], r["im"]) for r in data["roots"] for _ in range(r["multiplicity"])]
    if data["structure"] == "pair":
        unknowns = [z[0].real, z[0].imag ** 2, -(z[2] + z[3]).real, (z[2] * z[3]).real]

        def factors(*u):
            return [pair(u[0], u[1]), [1, u[2], u[3]]]
    else:
        factors, _, of_roots = FORMS[data["structure"]]
        unknowns = of_roots(z)

    def every(y):
        """Objective, the four equations of the structure, and what each limit forbids to be positive."""
        p = {name: mp.mpf(v) for name, v in data["parameters"].items()} | dict(zip(free, y, strict=False))
        names = {**names_60(p, y[len(free) :]), "abs": abs, "__builtins__": {}}
        a = polynomial_60(**native_60(p))
        found = [eval(data["objective"]["expression"], names)]
        found += [c * a[0] - b for c, b in zip(times(*factors(*y[len(free) :]))[1:], a[1:], strict=True)]
        for limit in data["active"]:
            if limit in problem.constraints:
                text = problem.constraints[limit]
                sign, comparison = (1, "<=") if "<=" in text else (-1, ">=")
                left, right = text.split(comparison)
                found.append(sign * (eval(left, names) - eval(right, names)))
            else:
                name, end = limit.rsplit(".", 1)
                found.append(p[name] * (1 if end == "max" else -1))
        return found

    y = [mp.mpf(data["parameters"][name]) for name in free] + list(unknowns)
    slopes = jacobian(mp, lambda *y: mp.matrix(every(y)), y).T  # by differences of half the digits
    weights = mp.lu_solve(slopes[:, 1:], -slopes[:, 0])  # least squares where there is freedom left
    return {name: weights[4 + k] for k, name in enumerate(data["active"])}


@pytest.mark.parametrize(
    "name", ["ballast_free", "childs_bicycle", pytest.param("point_mass_robot", marks=pytest.mark.slow), "least_speed"]
)
def test_printed_gains_are_right_to_the_last_of_their_six_digits(name):
    """At optima with a pair, an EP4 and three roots on a line; one limit is on the kink of a quantity that is 0."""
    problem = tmsopt.load(PROBLEMS / f"{name}.toml")
    data = json.loads(json.dumps(tmsopt.solve(problem).to_json()))
    assert data["active"]
    with mp.workdps(80):
        assert data["active"] == {n: float(mp.nstr(gain, 6)) for n, gain in gains_60(data, problem).items()}


def test_a_limit_that_one_design_alone_meets_buys_what_that_design_may_move():
    """s² + 2xs + 1: abscissa −x up to x = 1, and more beyond; the least x with abscissa ≤ −1 + t is 1 − t."""
    oscillator, edge = from_coefficients([1, "2*x", 1]), {"c": "abscissa <= -1"}
    design = tmsopt.solve(tmsopt.Problem(oscillator, free={"x": (0, 5)}, minimize="x", constraints=edge))
    assert design.active == pytest.approx({"c": 1}, abs=1e-6)


def test_limits_that_say_the_same_buy_nothing_alone():
    """Of x ≥ 1, 2x ≥ 2 and, at y = 0, x + y ≥ 1 any two remain when one is moved."""
    limits = {"c": "x >= 1", "d": "2*x >= 2", "e": "x + y >= 1"}
    box = {"x": (0, 5), "y": (0, 5)}
    oscillator = from_coefficients([1, "2*x", "1 + y"])
    design = tmsopt.solve(tmsopt.Problem(oscillator, free=box, minimize="x + 0.1*y", constraints=limits))
    assert design.parameters == pytest.approx({"x": 1, "y": 0}, abs=1e-9)
    assert design.active == pytest.approx(dict.fromkeys([*limits, "y.min"], 0), abs=1e-9)
