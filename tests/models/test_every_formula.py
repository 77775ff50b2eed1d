"""Every formula of every model in every kind of numbers: what each kind says lies in the ball of the others.

The ball of a value is that of 106 bits; what doubles may be off is bounded by arithmetic that carries the error along.
"""

import math
from functools import lru_cache
from importlib import import_module

import casadi as ca
import flint
import numpy as np
import pytest
from helpers.javascript import run

from tmsopt.algebra import BALLS, CASADI, FLOATS, INTERVALS, NODES, Bounded, UnsupportedOperation, fold
from tmsopt.models import Values, controlled, from_coefficients, from_hamiltonian, from_matrices, tms, whipple
from tmsopt.program import NLP

formula, make_node, symbol = (
    getattr(import_module("tmsopt.algebra.formula"), n) for n in ("formula", "make_node", "symbol")
)
multiply_out = import_module("tmsopt.algebra.identity").multiply_out
function = import_module("tmsopt.explorer.javascript").function
pruning, translation = (import_module(f"tmsopt.global_search.{n}") for n in ("pruning", "translation"))

POINTS, FEW = 300, 20
COUNTS = (FEW, pytest.param(POINTS, marks=[pytest.mark.slow, pytest.mark.long]))
NOTHING = NLP("test", (), formula([0], ()), {}, (), (), (), (), ())
SHORT = 60  # steps of what is multiplied out

GAINS = ("k_phi", "k_phidot_v", "k_deltadot", "lag")
MODELS = {
    "tms": tms,
    "tms with a controller": controlled(tms, ("k_phi", "k_phidot", "lean_phidot")),
    "whipple": whipple,
    "whipple with a controller": controlled(whipple, GAINS),
    "matrices": from_matrices(
        M=[["m*(1 + x**2)", "x"], ["x", 2]],
        D=[["0.1*x", 0], [0, "c"]],
        K=[["k + sqrt(c)", "-k/3"], ["-k/3", "exp(-x)"]],
        quantities={"size": "abs(x - k) + max(c, 0.3)", "angle": "atan(x/k)**2"},
    ),
    "coefficients": from_coefficients(["1", "sqrt(2)*c", "k**-2", "c*k/7", "min(c, k)"]),
    "complex H": from_hamiltonian([["w - 1j*g/3", "k*exp(1j*w)"], ["k", "2 - 0.1j"]]),
}
SETS = [(name, of) for name, model in MODELS.items() for of in range(len(model.sets))]
OF_ROOTS = ("abscissa", "damping_ratio", "angular_frequency")


def asked(name, of, tangents=False):
    """Native parameters, coefficients, quantities and matrices of a model in one formula, of angles or their tangents."""
    model = MODELS[name]
    own = model.sets[of]
    given = {
        p.name: make_node("atan", symbol(p.name)) if tangents and p.tangent else symbol(p.name) for p in own.parameters
    }
    values = Values(model, own, given).with_known({root: symbol(root) for root in OF_ROOTS})
    listed = [values[n] for n in model.quantity_names(own)]
    matrices = [] if model.pencil is None else model.pencil(own.native(given))
    entries = [x for P in matrices for row in P for x in row]
    every = [*listed, *(part for x in entries for part in ((x.re, x.im) if hasattr(x, "re") else (x,)))]
    return formula(every, (*own.names, *OF_ROOTS))


def coefficients_of(name, of):
    """The places of the coefficients among these; none where pruning lacks a function that they have."""
    model = MODELS[name]
    names = list(model.quantity_names(model.sets[of]))
    return [names.index(n) for n in model.coefficient_names() if name != "coefficients"]


def drawn(name, of, count):
    """Designs within their physical ranges, near 1, both signs where these are allowed; and root quantities."""
    rng = np.random.default_rng([count, of, len(name)])
    columns = {}
    for p in MODELS[name].sets[of].parameters:
        size = rng.uniform(0.2, 1.4, count) * rng.choice([-1.0, 1.0], count)
        least, most = max(p.range.lower, -2.0), min(p.range.upper, 2.0)
        columns[p.name] = np.where((size >= least) & (size <= most), size, -size)
    return columns | {n: rng.uniform(-1.0, 1.0, count) for n in OF_ROOTS}


def balls(own, columns, count):
    """Exact values of some designs, shape (outputs, count)."""
    with flint.ctx.workprec(106):
        rows = [{n: flint.fmpq(*float(x[k]).as_integer_ratio()) for n, x in columns.items()} for k in range(count)]
        return [[flint.arb(x) for x in fold(own, row, BALLS)] for row in rows]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "of"), SETS)
def test_floats_casadi_javascript_and_nodes_lie_in_the_ball(name, of):
    own, columns = asked(name, of), drawn(name, of, POINTS)
    exact = balls(own, columns, POINTS)
    known = np.array([[x.is_finite() for x in row] for row in exact]).T
    middle = np.array([[float(x.mid()) if x.is_finite() else 0.0 for x in row] for row in exact]).T
    with np.errstate(all="ignore"):
        bounded = [Bounded(*np.broadcast_arrays(*_parts(x), columns["abscissa"])[:2]) for x in _bounded(own, columns)]
        error = np.array([x.error for x in bounded])
        inside = np.abs(np.array([x.value for x in bounded]) - middle) <= error
        assert np.all(inside | ~np.isfinite(error) | ~known)
        room = 2 * error + 1e-300
        at_once = np.array([np.broadcast_to(x, POINTS) for x in fold(own, columns, FLOATS)], dtype=float)
        again = fold(own, {n: symbol(n) for n in own.names}, NODES)
        once_more = np.array([np.broadcast_to(x, POINTS) for x in fold(formula(again), columns, FLOATS)], dtype=float)
    assert np.array_equal(at_once, once_more, equal_nan=True)
    x = ca.SX.sym("x", len(own.names))
    written = ca.Function("f", [x], [ca.vertcat(*(ca.SX(e) for e in _symbolic(own, x)))]).map(POINTS)
    by_casadi = written(np.array([columns[n] for n in own.names])).full()
    script = function("const at = function", ("x", "y"), own, {n: f"x[{k}]" for k, n in enumerate(own.names)})
    rows = np.array([columns[n] for n in own.names]).T.tolist()
    answer = f"(rows) => rows.map((x) => {{const y = Array({len(exact[0])}); at(x, y); return y;}})"
    by_script = np.array(run([script], answer, rows), dtype=float).T
    for found in (at_once, by_casadi, by_script):
        off = np.abs(found - middle)
        assert np.all((off <= room) | ~known | ~np.isfinite(error))
        assert not np.any(np.isfinite(found) & ~known & np.isfinite(error))
    assert known.mean() > 0.6


def _parts(x):
    return (x.value, x.error) if isinstance(x, Bounded) else (float(flint.arb(x)), abs(float(flint.arb(x))) * 2.0**-52)


def _bounded(own, columns):
    return fold(own, {n: Bounded(x, np.zeros_like(x)) for n, x in columns.items()}, BALLS)


def _symbolic(own, x):
    return fold(own, {n: x[k] for k, n in enumerate(own.names)}, CASADI)


@pytest.mark.slow
@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize(("name", "of"), SETS)
def test_intervals_scip_and_fractions_hold_the_ball(name, of, count):
    """Output by output: intervals take all of them, SCIP the coefficients at least, fractions what is rational."""
    own, columns, needed = asked(name, of, tangents=True), drawn(name, of, count), coefficients_of(name, of)
    exact, met = balls(own, columns, count), dict.fromkeys(("intervals", "scip", "fractions"), 0)
    pytest.importorskip("pyscipopt")
    for k in range(len(own.outputs)):
        part, built = own.extract([own.outputs[k]]), translation.Translation(NOTHING)
        for j in range(count):
            point = {n: float(x[j]) for n, x in columns.items()}
            for kind in met if exact[j][k].is_finite() else ():
                try:
                    over = HOLDS[kind](built, part, point)
                except (UnsupportedOperation, ZeroDivisionError):
                    assert kind == "fractions" or (kind == "scip" and k not in needed), (kind, k)
                    continue
                met[kind] += 1
                assert not over.is_finite() or over.overlaps(exact[j][k]), (kind, k)
    assert all(met.values())


def _by_intervals(built, part, point):
    return fold(part, {n: flint.arb(x, 1e-9) for n, x in point.items()}, INTERVALS)[0]


def _by_scip(built, part, point):
    terms = {n: built.add_variable(x - 1e-9, x + 1e-9) for n, x in point.items()}
    ball = fold(part, terms, built.kind(), built.as_affine)[0].ball
    return flint.arb(ball) * flint.arb(1, 2**-52)  # SCIP's constants are doubles


def _by_fractions(built, part, point):
    if len(part.steps) > SHORT or any(math.isnan(x) for x in part.constants if isinstance(x, float)):
        raise UnsupportedOperation("what takes long to multiply out, and what is no number")
    with flint.ctx.workprec(212):
        exact = {n: flint.fmpq(*x.as_integer_ratio()) for n, x in point.items()}
        return flint.arb(fold(_multiplied_out(part), exact, BALLS)[0])


_multiplied_out = lru_cache(maxsize=1)(multiply_out)


HOLDS = {"intervals": _by_intervals, "scip": _by_scip, "fractions": _by_fractions}


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize(("name", "of"), SETS)
def test_intervals_of_branch_and_prune_hold_the_ball(name, of, count):
    """Many boxes at once, with slopes; they take the coefficients at least."""
    own, columns, needed = asked(name, of, tangents=True), drawn(name, of, count), coefficients_of(name, of)
    exact, points = balls(own, columns, count), np.array([columns[n] for n in own.names])
    for k, output in enumerate(own.outputs):
        part = own.extract([output])
        try:
            part = pruning.prepare_formula(part)
        except UnsupportedOperation:
            assert k not in needed
            continue
        with np.errstate(all="ignore"):
            found = pruning._evaluate_ranges(part, np.stack([points - 1e-12, points + 1e-12]))[part.outputs[0]]
        low, high = np.broadcast_to(found, (2, count))
        known = [j for j in range(count) if np.isfinite([low[j], high[j]]).all()]
        assert known or k not in needed
        for j in known:
            if exact[j][k].is_finite():
                assert flint.arb(low[j]).union(flint.arb(high[j])).overlaps(exact[j][k]), k
