"""Two wells: x⁴/4 − x²/2 + x/10 − 1, the root of s − f(x), is least near x = −1.05 and has another well near 0.95."""

from dataclasses import replace

import casadi as ca
import numpy as np

import tmsopt
from tmsopt.models import from_coefficients
from tmsopt.search import begin_search

x = ca.SX.sym("x")
LEFT, RIDGE, RIGHT = sorted(np.roots([1, 0, -1, 0.1]).real.tolist())


def depth(at):
    return at**4 / 4 - at**2 / 2 + at / 10 - 1


def wells(**asked):
    """The problem of the wells, in which the objective is no root quantity by default."""
    stated = {"model": from_coefficients([1, -depth(x)]), "free": {"x": (-2.0, 2.0)}}
    return tmsopt.Problem(**{**stated, "minimize": "x**4/4 - x**2/2 + x/10 - 1", **asked})


def begun(sampled=False, **asked):
    """The state at the beginning of a search, or after its sample."""
    (state,) = begin_search(wells(**asked).posed)
    return replace(state, sample=tmsopt.POLICY.sample(state)) if sampled else state
