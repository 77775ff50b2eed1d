"""Nearest points of large models, whose derivatives CasADi takes without expanding: those of the expressions."""

from importlib import import_module

import numpy as np
import pytest

import tmsopt
from tmsopt.models import from_matrices

nlp = import_module("tmsopt.program.nlp")

STATE = (np.diag([-3.0] * 5) + np.random.default_rng(1).normal(size=(5, 5)).round(2)).tolist()
STATE[0][1], STATE[2][2], STATE[4][0] = "x*y", "x*z - 3", "3*x*y"
PENCIL = (
    [["1+x*y", "x", 0], ["x", "2", "z/(2+x)"], [0, "z", "3"]],
    [["3-x", "sin(y)", 0], [0, "3+y*z", 1], ["z", 0, "5+x**2"]],
    [["2-x", "-x", 0], ["y", "3+z", "-1"], [0, "-z", "exp(y)"]],
)


@pytest.mark.parametrize(("model", "edge"), [(from_matrices(A=STATE), "capsize"), (from_matrices(*PENCIL), "weave")])
def test_a_nearest_point_is_the_same_by_either_second_derivative(model, edge, monkeypatch):
    found = []
    for large in (0, np.inf):  # operations from which expressions are not expanded
        monkeypatch.setattr(nlp, "_MAX_EXPRESSION_COST", large)
        nlp._PROGRAMS.get.cache_clear()
        problem = tmsopt.Problem(model, fixed={"x": 0.3, "y": 0.4, "z": 0.2})
        found.append(tmsopt.nearest(problem, edge, weights={"x": 1.0, "y": 0.5}))
    assert found[0].refined
    assert found[0].distance == pytest.approx(found[1].distance, rel=1e-9)
