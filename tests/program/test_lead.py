"""Factors that reach a singular mass matrix: they hold at any design, and at a0 = 0 where a root is at infinity."""

import casadi as ca
import numpy as np
import pytest

import tmsopt
from tmsopt.models import from_coefficients
from tmsopt.program import formulate, initial_point

NAMES = [f"c{k}" for k in range(6)]


def asked(degree: int, objective: str) -> tmsopt.Problem:
    """All coefficients free."""
    names = NAMES[: degree + 1]
    free = dict.fromkeys(names, (-9.0, 9.0))
    return tmsopt.Problem(from_coefficients([ca.SX.sym(n) for n in names]), free=free, **dict([objective.split(" ")]))


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("objective", ["minimize abscissa", "maximize damping_ratio", "minimize angular_frequency"])
@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5])
def test_any_design_has_such_factors(degree: int, objective: str, sign: int) -> None:
    """With a0 of either sign, small or not: a start meets all rows, and says of the roots what NumPy does."""
    problem, rng = asked(degree, objective), np.random.default_rng(degree)
    nlp = formulate(problem, lead=sign)
    names = nlp.variables[degree + 1 :]
    for a0 in (1.0, 0.3, 1e-2, 1e-3):
        a = sign * np.array([a0, *rng.uniform(0.5, 2, degree)])
        x = initial_point(nlp, problem, dict(zip(NAMES, a.tolist(), strict=False)), False)
        rows = np.array(nlp.at(x)[1]).ravel()
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


@pytest.mark.parametrize("degree", [2, 3, 4, 5])
def test_at_a_singular_mass_matrix_the_rest_of_the_roots_count(degree: int) -> None:
    """a0 = 0 and a1 … those of (s + 1)(s + 2) …: the factors hold with γ = −1 and no other root right of it."""
    rest = np.poly(-np.arange(1.0, degree))  # of degree − 1
    free = {"c0": (0.0, 1.0)}
    model = from_coefficients([ca.SX.sym("c0"), *rest.tolist()])
    nlp = formulate(tmsopt.Problem(model, free=free, minimize="abscissa"), lead=1)
    assert len(nlp.variables) == degree + 2
    names = list(nlp.variables)
    unit, lead = nlp.unit, np.array(nlp.at(np.eye(len(names))[0])[1]).ravel()[nlp.rows.index("a0")]
    scaled = rest * unit ** -np.arange(1.0, degree + 1) * lead  # coefficients in the NLP's own units, a0 being 1
    x = np.zeros(len(names))
    x[names.index("abscissa")] = -1 / unit
    distances = sorted((k - 1) / unit for k in range(1, degree))  # of the finite roots from the line
    if degree % 2:
        pairs = [distances[k : k + 2] for k in range(0, degree - 1, 2)]
        x[names.index("delta.0")] = scaled[0]
        factors = [np.poly([-d for d in pair]) for pair in pairs]
    else:  # the first factor is linear: β t + κ
        pairs = [distances[k : k + 2] for k in range(0, degree - 2, 2)]
        factors = [scaled[0] * np.array([0.0, 1.0, distances[-1]]), *(np.poly([-d for d in pair]) for pair in pairs)]
    for k, factor in enumerate(factors, start=1):
        x[names.index(f"beta{k}.0")], x[names.index(f"kappa{k}.0")] = factor[1:]
    rows = np.array(nlp.at(x)[1]).ravel()
    assert rows == pytest.approx(np.zeros(len(rows)), abs=1e-12 * np.abs(scaled).max())
