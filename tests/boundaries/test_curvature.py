"""The Hessian of nearest points from inverses, against the one that CasADi derives of the coefficients."""

import casadi as ca
import numpy as np
import pytest

from tmsopt.boundaries import curvature, edges
from tmsopt.models import from_coefficients, from_matrices

ALWAYS = 10**9  # operations of the coefficients: enough to be worth it
CLOSE = 1e-11  # of the largest entry: some hundred operations on numbers of order 1


def pencil():
    """Entries of every power that are products, sines and quotients of the parameters."""
    M = [["1+x*y", "x", 0], ["x", "2", "z/(2+x)"], [0, "z", "3"]]
    D = [["x", "sin(y)", 0], [0, "y*z", 1], ["z", 0, "x**2"]]
    return from_matrices(M, D, [[2, "-x", 0], ["y", "3+z", "-1"], [0, "-z", "exp(y)"]])


def state():
    rows = np.random.default_rng(1).normal(size=(7, 7)).round(2).tolist()
    rows[0][1], rows[3][2], rows[6][0] = "x", "y", "x*z"
    return from_matrices(A=rows)


@pytest.mark.parametrize("model", [pencil(), state()], ids=["pencil", "state"])
@pytest.mark.parametrize("name", list(edges(6)))
def test_it_is_the_hessian_of_the_lagrangian(model, name):
    edge, of, weights = edges(model.degree)[name], model.sets[0], ("y", "z", "x")[:2]
    n, extra, size = len(weights), len(edge.unknowns), model.degree + 1
    found = curvature(model, of, weights, edge, ALWAYS)
    x, p = ca.SX.sym("x", n + extra), ca.SX.sym("p", len(of.names) + n + 2 * size + 2)
    numbers, units, scale, sizes, rest = (
        ca.vertsplit(part) for part in ca.vertsplit(p, [0, 3, 3 + n, 3 + n + size, 3 + n + 2 * size, p.numel()])
    )
    at = dict(zip(of.names, numbers, strict=True))
    at |= {m: at[m] + units[k] * rest[1] * x[k] for k, m in enumerate(weights)}
    c = [rest[0] * a / s for a, s in zip(model.coefficients(at, of), scale, strict=True)]
    own = [x[n + k] for k in range(extra)]
    rows = [e / sizes[k] for e, k in zip(edge.equations(c, own), edge.powers, strict=True)]
    g = ca.vertcat(*rows, *edge.nonnegative(c, own))
    objective, pull = ca.SX.sym("f"), ca.SX.sym("g", g.numel())
    lagrangian = objective * ca.sumsqr(x[:n]) + ca.dot(pull, g)
    known = ca.Function("known", [x, p, objective, pull], [ca.triu(ca.hessian(lagrangian, x)[0])])
    random = np.random.default_rng(0)
    ratio = 1.3 ** np.arange(size)
    settings = [
        *random.uniform(0.2, 0.8, 3),
        *random.uniform(0.5, 1, n),
        *ratio,
        *random.uniform(1, 2, size),
        -1.0,
        0.7,
    ]
    given = (random.uniform(0.1, 0.3, n + extra), settings, 1.5, random.normal(size=g.numel()))
    expected = known(*given).full()
    assert np.abs(found(*given).full() - expected).max() <= CLOSE * np.abs(expected).max()


def test_small_models_and_those_without_matrices_keep_their_expressions():
    model = from_coefficients([1, "x", "y", "x*y", 2, 1])
    assert curvature(model, model.sets[0], ("x",), edges(5)["weave"], ALWAYS) is None
    assert curvature(state(), state().sets[0], ("x",), edges(7)["weave"], 100) is None
