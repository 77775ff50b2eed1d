"""No optimum stands that another end beats, in the worst case between those listed too."""

from dataclasses import replace
from importlib import import_module

import casadi as ca
import numpy as np
import pytest

import tmsopt
from tmsopt.models import from_coefficients
from tmsopt.search import begin_search

x, y = ca.SX.sym("x"), ca.SX.sym("y")
LEFT, _, RIGHT = sorted(np.roots([1, 0, -1, 0.1]).real.tolist())
"""Wells of x⁴/4 − x²/2 + x/10, the left one deeper."""


def depth(at):
    return at**4 / 4 - at**2 / 2 + at / 10 - 1


@pytest.mark.parametrize(
    ("found", "between", "status", "value"),
    [
        (RIGHT, -2.0, "not_converged", depth(LEFT)),
        (LEFT, -2.0, "optimal", depth(LEFT)),
        (RIGHT, 2.0, "optimal", depth(RIGHT)),
    ],
)
def test_no_optimum_stands_that_an_end_beats(found, between, status, value):
    """On the left designs change between the three values of a band that are looked at first, for better or worse."""
    worse = between * ca.sin(2 * np.pi * y) ** 2 * (x - RIGHT) ** 2
    model = from_coefficients([1, 1 - (x**4 / 4 - x**2 / 2 + x / 10) - worse])
    band = {"y": tmsopt.Band(0.0, 1.0, 3)}
    asked = tmsopt.Problem(model, free={"x": (-2.0, 2.0)}, scenarios=band, minimize="abscissa").posed
    (state,) = begin_search(asked)
    state = replace(state, sample=tmsopt.POLICY.sample(state))
    ends = {at: tmsopt.POLICY.local(state, tmsopt.Start({"x": at})) for at in (LEFT, RIGHT)}
    one = tmsopt.POLICY.accept(replace(state, ends=(ends[found],)))
    own = import_module("tmsopt.search.search").cover_cases(one, tmsopt.POLICY, tmsopt.Starts())
    assert own.status == "optimal"
    left = import_module("tmsopt.search.outcome").demote_if_beaten(replace(one, ends=tuple(ends.values())), own)
    assert left.status == status
    assert left.checked.objective == pytest.approx(value, abs=1e-8)
