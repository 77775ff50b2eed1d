"""Points on the curves of a pattern: from many designs, from a grid over two parameters, and from beyond infinity."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import chain, cycle, islice
from typing import Any

import numpy as np

from tmsopt.problem.problem import Posed
from tmsopt.program.starts import sample_box
from tmsopt.records import Array, Truth
from tmsopt.roots.sign_tests import CLOSED
from tmsopt.tracing.continuation import INFINITE, Curve, Walk, is_on_walk, walk_both_ways
from tmsopt.tracing.equations import TracedProblem, compute_coefficients, design_at
from tmsopt.tracing.solving import project_rows

_BACK = 300.0  # size of an unknown at which extrapolation through infinity begins
_FAR = 1e5  # largest unknown of a seed, in units of its scale: above it a0 nearly vanishes
_ROUNDS = 8  # the search uses at most this many times `starts` designs
_GUESSES = 4  # starting values of the unknowns tried at each design

POINTS = 256
"""Grid points along each axis; an edge of the grid is about as long as a step of a trace."""

FEWER = 96
"""The same for degrees without closed forms, where tests compute roots: 9,216 polynomials take one or two seconds."""

_PATIENCE = 32  # designs in a row that lead to nothing new
_BLOCK = 256  # points per block of distances


def find_unexplained(
    problem: Posed, curve: Curve, test: Callable[[Sequence[Any]], Any], walks: Sequence[Walk]
) -> Iterator[dict[str, float]]:
    """Designs near sign changes of a function of the coefficients that no walk explains; `walks` may grow meanwhile.

    They are midpoints of edges of a grid over the box; nan values do not count. Edges on which a0 changes sign too come
    last, and only while they lead to new curves, since a0 alone explains most of them.
    """
    low, high = np.array(list(problem.free.values())).T
    points = POINTS if problem.model.degree <= CLOSED else FEWER
    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, points)] * 2, indexing="ij"), axis=-1)
    with np.errstate(all="ignore"):
        a = compute_coefficients(
            problem, dict(zip(problem.free, np.moveaxis(low + grid * (high - low), -1, 0), strict=True))
        )
        value = np.broadcast_to(np.asarray(test(list(np.moveaxis(a, -1, 0))), dtype=float), grid.shape[:2])
    for last in (False, True):
        middles = []
        for axis in (0, 1):
            turns, through = (np.nan_to_num(np.diff(np.sign(v), axis=axis)) != 0 for v in (value, a[..., 0]))
            middles.append(np.argwhere(turns & (through == last)) + np.eye(2)[axis] / 2)
        left = np.concatenate(middles) / (points - 1)
        np.random.default_rng(0).shuffle(left)  # neighbours mostly belong to one branch
        fruitless = seen = 0
        while len(left) and (fruitless < _PATIENCE or not last):
            fruitless = fruitless + 1 if seen == len(walks) else 0
            for walk in walks[seen:]:
                line = np.stack([*design_at(problem, walk.y * curve.scale).values()], axis=-1)
                left = left[is_far_from_line(left, (line - low) / (high - low), 1 / (points - 1))]
            seen = len(walks)
            if len(left):
                yield dict(zip(problem.free, (low + left[0] * (high - low)).tolist(), strict=True))
                left = left[1:]


def is_far_from_line(points: Array, line: Array, distance: float) -> Truth:
    """Which of the points, shape (n, 2), are further than a distance from a polyline of shape (m, 2)."""
    start, along, far = line[:-1] @ (1, 1j), np.diff(line, axis=0) @ (1, 1j) + 1e-300, []  # in the complex plane
    for block in np.array_split(points @ (1, 1j), len(points) // _BLOCK + 1):
        offset = block[:, None] - start
        share = np.clip((offset / along).real, 0, 1)
        far.append(np.abs(offset - share * along).min(axis=1) > distance)
    return np.concatenate(far)


def walk_new_curves(
    curve: Curve, points: Iterable[Iterable[Array]], step_and_most: tuple[float, int], walks: list[Walk]
) -> None:
    """Walk the curves through those points, shape (points, n + 1) each, that are on none of the `walks` yet."""
    for y in chain.from_iterable(points):
        if (
            not any(is_on_walk(curve, known, y) for known in walks)
            and (found := walk_both_ways(curve, y, *step_and_most)) is not None
        ):
            walks.append(found)


def find_seeds(
    traced: TracedProblem, starts: int, seed: int, through: Sequence[Mapping[str, float]], walks: Sequence[Walk]
) -> Iterator[tuple[int, list[Array]]]:
    """Points of the pattern's curves in the box, from each of many designs, with the count of designs so far.

    Without a grid test, the search goes on until `starts` designs in a row find nothing new; `walks` grows meanwhile.
    """
    problem = traced.problem
    free = len(problem.free)
    given = [*through, *([problem.start] if set(problem.start) == set(problem.free) else [])]
    yield from ((0, found) for found in _project_designs(traced, given, [None] * len(given), _GUESSES))
    fruitless, known, count = 0, len(walks), 0
    ways = cycle([None, *range(free)])
    designs = sample_box(problem, seed)
    while count < (starts if _has_grid_test(traced) else _ROUNDS * starts):
        for found in _project_designs(traced, list(islice(designs, starts)), list(islice(ways, starts)), _GUESSES):
            if fruitless >= starts:
                return
            count += 1
            yield count, found
            fruitless, known = (fruitless + 1 if len(walks) == known else 0), len(walks)


def _has_grid_test(traced: TracedProblem) -> bool:
    """Whether a grid over two free parameters shows every branch that is not too short for it."""
    return traced.pattern.test is not None and len(traced.problem.free) == 2


def find_missed(traced: TracedProblem, walks: Sequence[Walk]) -> Iterator[tuple[int, list[Array]]]:
    """Points of the curves where a test function of the pattern changes sign on a grid, off the walks so far."""
    if traced.pattern.test is not None and _has_grid_test(traced):
        for design in find_unexplained(traced.problem, traced.curve, traced.pattern.test, walks):
            yield 0, _project_designs(traced, [design])[0]


def find_beyond_infinity(traced: TracedProblem, walks: Sequence[Walk]) -> Iterator[tuple[int, list[Array]]]:
    """Points where a curve may return from infinity: a root changes sides there, and the parameters continue.

    The parameters approach a0 = 0 with the inverse of the unknown that grows, so two points give the limit and a point
    beyond it.
    """
    free = len(traced.problem.free)
    for walk in walks:  # `walks` grows meanwhile
        for end, y in zip(walk.ends, (walk.y[::-1], walk.y), strict=True):
            if end.reason != INFINITE:
                continue
            size = np.abs(y[:, free:]).max(axis=1)
            begin = np.max(np.flatnonzero(size < _BACK), initial=0)
            if begin < len(y) - 2:
                (here, far), weight = (y[begin, :free], y[-1, :free]), size[begin] / size[-1]
                limit = (far - weight * here) / (1 - weight)
                x = (2 * limit - here) * traced.curve.scale[:free]
                yield 0, _project_designs(traced, [design_at(traced.problem, x)])[0]


def _project_designs(
    traced: TracedProblem, designs: Sequence[Mapping[str, float]], held: Sequence[int | None] = (None,), most: int = 1
) -> list[list[Array]]:
    """Points of the curves in the box near each design, from the best guesses, with one variable held."""
    curve, free = traced.curve, len(traced.problem.free)
    tried = [
        (k, y) for k, design in enumerate(designs) for y in traced.list_starts(design, best_first=most == 1)[:most]
    ]
    if not tried:
        return [[] for _ in designs]
    owner = [k for k, _ in tried]
    y = project_rows(curve.evaluate, np.array([y for _, y in tried]), [held[k] for k in owner])
    inside = np.all((y >= curve.lower - 1e-12) & (y <= curve.upper + 1e-12), axis=1)  # never for nan
    inside &= np.abs(y[:, free:]).max(axis=1) <= _FAR
    y = np.clip(y, curve.lower, curve.upper)
    inside[inside] = traced.has_leading_coefficient(
        compute_coefficients(traced.problem, design_at(traced.problem, y[inside] * curve.scale))
    )
    return [[y[i] for i, of in enumerate(owner) if of == k and inside[i]] for k in range(len(designs))]
