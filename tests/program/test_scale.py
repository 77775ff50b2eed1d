"""The unit of the roots: what is decided about sizes is decided alike in every unit of time."""

import math

import casadi as ca
import pytest

import tmsopt
from tmsopt.models import from_coefficients
from tmsopt.program import scale_of
from tmsopt.roots import product
from tmsopt.search import same_objective


def powers(rate, **asked):
    """2 (s + r)⁵ for r about a rate."""
    r = ca.SX.sym("r")
    model = from_coefficients([2 * c for c in product(*[[1, r]] * 5)])
    return tmsopt.Problem(model=model, free={"r": (0.5 * rate, 1.5 * rate)}, **asked)


@pytest.mark.parametrize("rate", [1e-6, 0.01, 1.0, 300.0, 1e5])
def test_the_unit_is_that_of_the_roots(rate):
    """All roots are −r with the median r at the rate: the nearest power of 2 is at most √2 off, and so is 2."""
    found = scale_of(powers(rate, minimize="abscissa").posed)
    assert abs(math.log2(found.unit / rate)) <= 0.55  # the median over the designs is a little off the middle
    assert found.a0_unit == 2.0
    assert math.frexp(found.unit)[0] == 0.5


@pytest.mark.parametrize("unit", [1.0, 2.0**-20, 2.0**-60])
def test_what_is_the_same_optimum_does_not_depend_on_the_unit(unit):
    for a, b, expected in ((-1.0, -1.0 - 1e-8, True), (-1.0, -1.0 - 1e-6, False), (0.0, 1e-8, True)):
        assert same_objective(a * unit, b * unit, unit) is expected
