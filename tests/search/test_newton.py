"""Solutions of square systems: those on paper, from their mirror images too, and none of a continuum."""

from importlib import import_module

import casadi as ca
import numpy as np
import pytest

from tmsopt.program import NLP

solutions = import_module("tmsopt.search.newton").solutions


X, Y = ca.SX.sym("x"), ca.SX.sym("y")


def system(*equations: ca.SX) -> NLP:
    """Each of these is 0."""
    f = ca.Function("nlp", [ca.vertcat(X, Y)], [X * 0, ca.vertcat(*equations)])
    n = len(equations)
    return NLP("test", ("x", "y"), f, (-9.0,) * 2, (9.0,) * 2, tuple(map(str, range(n))), (0.0,) * n, (0.0,) * n)


def found(nlp: NLP, *starts: tuple[float, float], mirrored: int = 0) -> list[tuple[float, float]]:
    return [tuple(np.round(x, 12).tolist()) for x in solutions(nlp, map(np.array, starts), mirrored)]


def test_a_solution_near_each_start() -> None:
    """x² = 4, x y = 2: (2, 1) and (−2, −1)."""
    assert found(system(X**2 - 4, X * Y - 2), (1.5, 1.5), (-1.0, -1.0)) == [(2.0, 1.0), (-2.0, -1.0)]


def test_images_reach_what_lies_on_the_other_side() -> None:
    nlp = system(X**2 - 4, Y**2 - 9)
    assert set(found(nlp, (1.0, 1.0))) == {(2.0, 3.0)}
    assert set(found(nlp, (1.0, 1.0), mirrored=1)) == {(2.0, 3.0), (-2.0, 3.0)}
    assert set(found(nlp, (1.0, 1.0), mirrored=2)) == {(2.0, 3.0), (-2.0, 3.0), (2.0, -3.0)}


@pytest.mark.parametrize("equations", [(X * Y, X * (Y - 1)), (X - Y, 2 * X - 2 * Y)], ids=["x = 0", "x = y"])
def test_one_of_a_continuum_is_none(equations: tuple[ca.SX, ca.SX]) -> None:
    """All of x = 0, and all of x = y."""
    assert found(system(*equations), (0.5, 0.3), (-1.0, 2.0)) == []


def test_fewer_equations_than_unknowns_have_none() -> None:
    assert found(system(X - 1), (0.5, 0.5)) == []
