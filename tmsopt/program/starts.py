"""Designs to start from, spread over the box, and starting values of the lifted variables that fit them."""

from collections.abc import Iterator, Mapping
from itertools import islice, product

import numpy as np

from tmsopt.algebra.sequence import golden_steps
from tmsopt.problem.evaluate import coefficients_of
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import RADIUS, regularise
from tmsopt.program.formulate import middle, variables_of
from tmsopt.program.judgement import judge
from tmsopt.program.nlp import NLP
from tmsopt.records import Array
from tmsopt.roots import is_stable, roots
from tmsopt.roots.patterns.structure import guess_distance

_CANDIDATES = 16
"""Designs looked at for each that is started from: a start near the good ones needs half the iterations."""

_RADII = tuple(float(r) for r in np.geomspace(0.5, 1e-3, 28))

_CORNERS = 10  # free parameters up to which all corners of the box are looked at

_BATCH = 16  # starts whose candidates are looked at together


def designs(problem: Posed, seed: int, count: int) -> Iterator[dict[str, float]]:
    """`count` designs to start from: the most promising of each few of a quasi-random sequence over the box.

    Every other one is chosen by the constraints alone, lest all starts fall into the basin of one good region; every
    third from designs moved to the faces of the box, where many optima lie in basins of their own. The first one is
    the most promising corner.
    """
    if count > 1 and len(problem.free) <= _CORNERS:
        corners = np.array(list(product(*problem.free.values())))
        objective, violation = _merit(problem, dict(zip(problem.free, corners.T, strict=True)))
        best = corners[int(np.argmin(objective + violation))]
        yield dict(zip(problem.free, best.tolist(), strict=True))
        count -= 1
    pool_of = spread(problem, seed)
    for done in range(0, count, _BATCH):
        size = min(_BATCH, count - done)
        pool = list(islice(pool_of, _CANDIDATES * size))
        pool = [_cornered(problem, d) if k // _CANDIDATES % 3 == 2 else d for k, d in enumerate(pool)]
        columns = {n: np.array([d[n] for d in pool]) for n in problem.free}
        objective, violation = (m.reshape(size, _CANDIDATES) for m in _merit(problem, columns))
        merit = violation + objective * (np.arange(size) % 2 == 0)[:, None]
        yield from (pool[row * _CANDIDATES + int(np.argmin(merit[row]))] for row in range(size))


def _stable_radius(nlp: NLP, problem: Posed, nominal: Mapping[str, float]) -> float:
    """A radius at which the design is stable in all directions of an NLP; small where there is none."""
    directed = [case for case in nlp.cases if case.direction and not case.edge]
    feet = (float(np.linalg.norm(list(case.direction.values()))) for case in nlp.cases if case.edge)
    most = min(feet, default=np.inf)
    if not directed and np.isfinite(most):
        return most
    for radius in (r for r in _RADII if directed and r <= most):
        at = [case.applied(nominal, radius, problem.weights) for case in directed]
        if np.all(is_stable([[float(c) for c in problem.values(p).coefficients] for p in at])):
            return radius
    return _RADII[-1]


def _cornered(problem: Posed, design: Mapping[str, float]) -> dict[str, float]:
    """A design with each parameter in the outer thirds of its range moved to the end of it."""
    moved = {}
    for name, (lower, upper) in problem.free.items():
        share = (design[name] - lower) / (upper - lower)
        moved[name] = lower if share < 1 / 3 else upper if share > 2 / 3 else design[name]
    return moved


def initial_point(nlp: NLP, problem: Posed, design: Mapping[str, float], near: bool = False) -> Array:
    """Start of all variables of an NLP: the design, and lifted variables that satisfy their equations with it.

    Args:
        near: whether the design is close to a solution.
    """
    nominal = problem.ordered(design)
    radius = _stable_radius(nlp, problem, nominal)
    varied = (case.applied(nominal, radius, problem.weights) for case in nlp.cases)
    values = [problem.values(nominal).with_known({RADIUS: radius}), *map(problem.values, varied)]
    z = list(roots(regularise(np.array([[float(c) for c in v.coefficients] for v in values]))) / nlp.unit)
    x = variables_of(problem, design)
    for lift in nlp.lifts:
        guess = lift.close if near and lift.close else lift.guess
        guesses = guess(values, z) or [[0.0] * lift.size]
        mismatches = [_mismatch(nlp, x, guess) for guess in guesses] if len(guesses) > 1 else [0.0]
        x = x + guesses[int(np.argmin(mismatches))]
    return nlp.filled(np.array(x))


def completions(nlp: NLP, problem: Posed, design: Mapping[str, float]) -> Iterator[Array]:
    """Starts from a design with every guess of what an NLP lifts, such as a pattern's unknowns."""
    values = [problem.values(problem.ordered(design))]
    z = list(roots(regularise(np.array([[float(c) for c in v.coefficients] for v in values]))) / nlp.unit)
    for guesses in product(*(lift.guess(values, z) for lift in nlp.lifts)):
        yield np.array([*variables_of(problem, design), *(x for guess in guesses for x in guess)])


def spread(problem: Posed, seed: int) -> Iterator[dict[str, float]]:
    """The middle of the box, then a quasi-random sequence without end."""
    yield middle(problem)
    names = list(problem.free)
    steps = golden_steps(len(names))
    offset = np.random.default_rng(seed).random(len(names))
    lower, upper = np.array([problem.free[n] for n in names]).reshape(-1, 2).T
    k = 1
    while True:
        point = lower + (upper - lower) * ((offset + k * steps) % 1.0)
        yield dict(zip(names, point.tolist(), strict=True))
        k += 1


def _merit(problem: Posed, columns: Mapping[str, Array]) -> tuple[Array, Array]:
    """Objective, and violated constraints, of many designs in their worst cases, each in units of its own spread."""
    found = judge(problem, columns)
    shape = next(iter(columns.values())).shape
    objective, violation = np.zeros(shape), np.zeros(shape)
    if found.worth is not None:
        objective += _in_spreads(found.worth)
    if problem.pattern is not None:
        each = coefficients_of(problem, problem.ordered(columns))
        a = regularise(np.stack([np.broadcast_to(c, shape) for c in each], axis=-1))
        mismatch = [guess_distance(problem.pattern, c, z) for c, z in zip(a, roots(a), strict=True)]
        violation += 3 * _in_spreads(np.array(mismatch))
    for excess in found.excess:
        violation += 3 * _in_spreads(excess)
    return objective, violation


def _in_spreads(column: Array) -> Array:
    """A column in units of its interquartile range, huge where it does not exist."""
    known = column[np.isfinite(column)]
    spread = float(np.subtract(*np.percentile(known, [75, 25]))) if known.size else 0.0
    return np.where(np.isfinite(column), column, 1e6) / (spread or 1.0)


def _mismatch(nlp: NLP, x: list[float], guess: list[float]) -> float:
    """Size of the rows when the lifts that follow are still unknown (at 0)."""
    trial = np.zeros(len(nlp.variables))
    trial[: len(x) + len(guess)] = x + guess
    g = nlp.at(trial)[1]
    return float(np.abs(g[np.isfinite(g)]).sum())
