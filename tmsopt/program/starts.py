"""Chooses designs to start from, spread over the box, and starting values of the variables that an NLP adds."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice, product

import numpy as np

from tmsopt.algebra.sequence import golden_steps
from tmsopt.models import Values
from tmsopt.problem.evaluate import coefficients_of
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import RADIUS, regularise
from tmsopt.program.design_scores import score_designs
from tmsopt.program.formulate import default_start, variables_of
from tmsopt.program.nlp import NLP
from tmsopt.records import Array
from tmsopt.roots import is_stable, roots
from tmsopt.roots.patterns.pattern import Roots
from tmsopt.roots.patterns.structure import guess_distance

_CANDIDATES_PER_START = 16
"""Number of candidates for each start; a start near good designs needs half the iterations."""

_RADII = tuple(float(r) for r in np.geomspace(0.5, 1e-3, 28))
"""Robustness radii that a start may have, the largest first."""

_MAX_CORNER_PARAMETERS = 10  # with at most this many free parameters, all corners of the box are candidates

_STARTS_PER_BATCH = 16  # number of starts whose candidates are scored together


def choose_starts(problem: Posed, seed: int, count: int) -> Iterator[dict[str, float]]:
    """`count` designs to start from: each is the best of a few candidates of a quasi-random sequence over the box.

    Every second start is chosen by the constraints alone, so that the starts do not all lie in one good region. Every
    third start comes from candidates that are moved to the faces of the box, because many optima are found only from
    such starts. The first start is the best corner.
    """
    if count > 1 and len(problem.free) <= _MAX_CORNER_PARAMETERS:
        corners = np.array(list(product(*problem.free.values())))
        objective, violation = _measure_merit(problem, dict(zip(problem.free, corners.T, strict=True)))
        best = corners[int(np.argmin(objective + violation))]
        yield dict(zip(problem.free, best.tolist(), strict=True))
        count -= 1
    designs = sample_box(problem, seed)
    for first_index in range(0, count, _STARTS_PER_BATCH):
        size = min(_STARTS_PER_BATCH, count - first_index)
        pool = list(islice(designs, _CANDIDATES_PER_START * size))
        pool = [_move_to_faces(problem, d) if k // _CANDIDATES_PER_START % 3 == 2 else d for k, d in enumerate(pool)]
        columns = {n: np.array([d[n] for d in pool]) for n in problem.free}
        objective, violation = (m.reshape(size, _CANDIDATES_PER_START) for m in _measure_merit(problem, columns))
        merit = violation + objective * (np.arange(size) % 2 == 0)[:, None]
        yield from (pool[row * _CANDIDATES_PER_START + int(np.argmin(merit[row]))] for row in range(size))


def _find_stable_radius(nlp: NLP, problem: Posed, nominal: Mapping[str, float]) -> float:
    """A radius at which the design is stable in all directions of the cases; the smallest one if there is none."""
    direction_cases = [case for case in nlp.cases if case.direction and not case.edge]
    upper_bounds = (float(np.linalg.norm(list(case.direction.values()))) for case in nlp.cases if case.edge)
    max_radius = min(upper_bounds, default=np.inf)
    if not direction_cases and np.isfinite(max_radius):
        return max_radius
    for radius in (r for r in _RADII if direction_cases and r <= max_radius):
        designs = [case.applied(nominal, radius, problem.weights) for case in direction_cases]
        if np.all(is_stable([[float(c) for c in problem.values(p).coefficients] for p in designs])):
            return radius
    return _RADII[-1]


def _move_to_faces(problem: Posed, design: Mapping[str, float]) -> dict[str, float]:
    """The design, in which each parameter in an outer third of its range is moved to the end of the range."""
    values = {}
    for name, (lower, upper) in problem.free.items():
        position = (design[name] - lower) / (upper - lower)
        values[name] = lower if position < 1 / 3 else upper if position > 2 / 3 else design[name]
    return values


def initial_point(
    nlp: NLP, problem: Posed, design: Mapping[str, float], is_near: bool = False, known: Sequence[float] = ()
) -> Array:
    """The starting point of an NLP: the design, and values of the added variables that satisfy their equations.

    Args:
        is_near: whether the design is near a solution.
        known: values of the variables between the design and the lifts.
    """
    nominal = problem.ordered(design)
    radius = _find_stable_radius(nlp, problem, nominal)
    case_parameters = (case.applied(nominal, radius, problem.weights) for case in nlp.cases)
    values = [problem.values(nominal).with_known({RADIUS: radius}), *map(problem.values, case_parameters)]
    z = _compute_roots(nlp, values)
    x = [*variables_of(problem, design), *known]
    for lift in nlp.lifts:
        guess = lift.guess_near if is_near and lift.guess_near else lift.guess
        guesses = guess(values, z) or [[0.0] * lift.size]
        mismatches = [_measure_mismatch(nlp, x, guess) for guess in guesses] if len(guesses) > 1 else [0.0]
        x = x + guesses[int(np.argmin(mismatches))]
    return nlp.set_kinks(np.array(x))


def complete_starts(nlp: NLP, problem: Posed, design: Mapping[str, float]) -> Iterator[Array]:
    """Starts from a design with every combination of guesses for the added variables."""
    values = [problem.values(problem.ordered(design))]
    z = _compute_roots(nlp, values)
    for guesses in product(*(lift.guess(values, z) for lift in nlp.lifts)):
        yield np.array([*variables_of(problem, design), *(x for guess in guesses for x in guess)])


def _compute_roots(nlp: NLP, values: Sequence[Values]) -> list[Roots]:
    """Roots in each case, in the unit of the NLP; none without a polynomial."""
    if values[0].model.polynomial is None:
        return [np.empty(0, dtype=complex)] * len(values)
    return list(roots(regularise(np.array([[float(c) for c in v.coefficients] for v in values]))) / nlp.unit)


def sample_box(problem: Posed, seed: int) -> Iterator[dict[str, float]]:
    """The default start, then an endless quasi-random sequence."""
    yield default_start(problem)
    names = list(problem.free)
    steps = golden_steps(len(names))
    offset = np.random.default_rng(seed).random(len(names))
    lower, upper = np.array([problem.free[n] for n in names]).reshape(-1, 2).T
    k = 1
    while True:
        point = lower + (upper - lower) * ((offset + k * steps) % 1.0)
        yield dict(zip(names, point.tolist(), strict=True))
        k += 1


def _measure_merit(problem: Posed, columns: Mapping[str, Array]) -> tuple[Array, Array]:
    """Objective and constraint violation of many designs in their worst cases, each relative to its spread."""
    scores = score_designs(problem, columns)
    shape = next(iter(columns.values())).shape
    objective, violation = np.zeros(shape), np.zeros(shape)
    if scores.objective is not None:
        objective += _divide_by_spread(scores.objective)
    if problem.pattern is not None:
        coefficients = coefficients_of(problem, problem.ordered(columns))
        a = regularise(np.stack([np.broadcast_to(c, shape) for c in coefficients], axis=-1))
        mismatch = [guess_distance(problem.pattern, c, z) for c, z in zip(a, roots(a), strict=True)]
        violation += 3 * _divide_by_spread(np.array(mismatch))
    for excess in scores.excess:
        violation += 3 * _divide_by_spread(excess)
    return objective, violation


def _divide_by_spread(column: Array) -> Array:
    """A column in units of its interquartile range; a value that is not finite becomes huge."""
    finite_values = column[np.isfinite(column)]
    spread = float(np.subtract(*np.percentile(finite_values, [75, 25]))) if finite_values.size else 0.0
    return np.where(np.isfinite(column), column, 1e6) / (spread or 1.0)


def _measure_mismatch(nlp: NLP, x: list[float], guess: list[float]) -> float:
    """Sum of |g| over the rows, with 0 for the variables that have no starting values yet."""
    trial = np.zeros(len(nlp.variables))
    trial[: len(x) + len(guess)] = x + guess
    g = nlp.evaluate(trial)[1]
    return float(np.abs(g[np.isfinite(g)]).sum())
