"""Factors that reach a singular mass matrix hold at any design."""

import casadi as ca
import numpy as np
import pytest

import tmsopt
from tmsopt.models import from_coefficients
from tmsopt.program import formulate, initial_point

NAMES = [f"c{k}" for k in range(6)]


def asked(degree, objective):
    """All coefficients free."""
    names = NAMES[: degree + 1]
    free = dict.fromkeys(names, (-9.0, 9.0))
    return tmsopt.Problem(from_coefficients([ca.SX.sym(n) for n in names]), free=free, **dict([objective.split(" ")]))


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("objective", ["minimize abscissa", "maximize damping_ratio", "minimize angular_frequency"])
@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5])
def test_any_design_has_such_factors(degree, objective, sign):
    """With a0 of either sign, small or not: a start meets all rows, and says of the roots what NumPy does."""
    problem, rng = asked(degree, objective), np.random.default_rng(degree)
    nlp = formulate(problem.posed, a0_sign=sign)
    names = nlp.variables[degree + 1 :]
    for a0 in (1.0, 0.3, 1e-2, 1e-3):
        a = sign * np.array([a0, *rng.uniform(0.5, 2, degree)])
        x = initial_point(nlp, problem.posed, dict(zip(NAMES, a.tolist(), strict=False)), False)
        rows = np.array(nlp.evaluate(x)[1]).ravel()
        size = np.abs(x).max()
        assert np.all(rows >= np.array(nlp.row_lower) - 1e-9 * size)
        assert np.all(rows <= np.array(nlp.row_upper) + 1e-9 * size)
        z = np.roots(a)
        value = float(x[degree + 1 + names.index(objective.split(" ")[1])])
        if "abscissa" in objective:
            assert value * nlp.unit >= z.real.max()
        elif "angular" in objective:
            assert value * nlp.unit >= z.imag.max()
        else:
            assert value <= np.min(-z.real / np.abs(z)) + 1e-9
