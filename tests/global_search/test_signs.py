"""That no design of a box is stable, by signs: never said where one is, by eigenvalues on dense grids."""

from importlib import import_module

import casadi as ca
import numpy as np
import pytest

import tmsopt
from tmsopt.models import from_coefficients
from tmsopt.roots import roots

none_stable = import_module("tmsopt.global_search.signs").has_no_stable_design

x, y = ca.SX.sym("x"), ca.SX.sym("y")
GRID = 33


def stated(coefficients, free, **asked):
    return tmsopt.Problem(from_coefficients(list(coefficients)), free=free, **{"minimize": "abscissa", **asked}).posed


def least_abscissa(terms):
    """Least abscissa on a grid of [−1, 1]², of coefficients c0 + c1 x + c2 y + c3 x y, by numeric roots."""
    u, v = np.meshgrid(*[np.linspace(-1, 1, GRID)] * 2)
    a = np.tensordot(np.stack([np.ones_like(u), u, v, u * v], axis=-1), terms, axes=(-1, 1)).reshape(GRID**2, -1)
    return float(roots(a[a[:, 0] != 0]).real.max(axis=1).min())


@pytest.mark.slow
@pytest.mark.parametrize("degree", [2, 3, 4, 5])
def test_never_where_a_grid_has_a_stable_design(degree):
    """Random models whose coefficients mostly have one sign, or all but one of them: of either kind of answer many."""
    rng = np.random.default_rng(degree)
    told = {True: 0, False: 0}
    for _ in range(60):
        terms = rng.normal(size=(degree + 1, 4)) * rng.uniform(0.02, 0.6)
        terms[:, 0] = rng.uniform(0.3, 2, degree + 1) * np.where(rng.random(degree + 1) < 0.15, -1, 1)
        terms *= rng.choice([-1, 1])  # a0 of either sign
        a = [float(c[0]) + float(c[1]) * x + float(c[2]) * y + float(c[3]) * x * y for c in terms]
        said = none_stable(stated(a, {"x": (-1, 1), "y": (-1, 1)}))
        assert not (said and least_abscissa(terms) < 0)
        told[said] += 1
    assert min(told.values()) >= 10


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("coefficients", "ends", "wider_ends"),
    [
        ([1, x - 2, 1], (0, 1.9), (0, 2.001)),
        ([1, 2, x], (-3, -0.1), None),  # a positive real root
        ([1, x, 1, 1], (0.1, 0.99), (0.1, 1.001)),  # Hurwitz, degree 3: stable where x > 1
        ([x, 1, 1, 2], (0.51, 5), (0.499, 5)),  # a1 a2 > a0 a3 where x < 1/2
        ([1, 1, x, 1, 1], (0.1, 1.95), (0.1, 2.001)),  # degree 4: a1 a2 a3 > a0 a3² + a4 a1² where x > 2
        ([x, 1, 2, 1, 1], (1.1, 3), (0.999, 3)),  # where x < 1
        ([1, 1, 1, 1, -1 - x * x, 1], (-2, 2), None),
        ([1, 2, x, -0.1 - x, 1, 1], (-1, 1), None),  # one of two is negative: parts of the box tell
    ],
)
def test_clearly_unstable_boxes_and_one_stable_design_in_a_corner(coefficients, ends, wider_ends, sign):
    """The wider box reaches a hair beyond the edge of stability, which is enough for a stable design."""
    signed = [sign * c for c in coefficients]
    assert none_stable(stated(signed, {"x": ends}))
    assert wider_ends is None or not none_stable(stated(signed, {"x": wider_ends}))


def test_of_several_cases_and_of_no_box_nothing_is_said():
    assert not none_stable(stated([1, x - 2, 1 + y], {"x": (0, 1)}, scenarios={"y": [0.0, 1.0]}))
    fixed = tmsopt.Problem(from_coefficients([1, x - 2, 1]), fixed={"x": 1.0}, minimize="abscissa")
    assert not none_stable(fixed.posed)
