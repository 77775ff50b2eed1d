"""A coarse grid over the plane of two free parameters, to see where branches of a pattern may be missing."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from tmsopt.design.problem import Problem
from tmsopt.records import Array, Truth
from tmsopt.roots.meetings import CLOSED

POINTS = 256
"""Along each axis; an edge of the grid is as long as a step of a trace."""

FEWER = 96
"""Likewise where the tests take roots, above the degrees with closed forms: 9 216 polynomials take a second or two."""

_PATIENCE = 32  # designs in a row that lead to nothing new


def coefficients(problem: Problem, columns: Mapping[str, Array]) -> Array:
    """Coefficients of the designs given by columns of the free parameters, shape (designs, n + 1)."""
    a = problem.model.coefficients(problem.ordered(columns), problem.parameter_set)
    shape = np.shape(next(iter(columns.values())))
    return np.stack([np.broadcast_to(np.asarray(c, dtype=float), shape) for c in a], axis=-1)


def unexplained(
    problem: Problem, test: Callable[[Sequence[Any]], Any], lines: Sequence[Mapping[str, Array]]
) -> Iterator[dict[str, float]]:
    """Designs by which a function of the coefficients changes sign, far from every line; `lines` may grow meanwhile.

    Those between which a0 changes sign too come last, and only while they lead to new lines: mostly it is a0 alone.
    """
    regular, others = changes(problem, test)
    yield from _apart_from(lines, problem, regular, np.inf)
    yield from _apart_from(lines, problem, others, _PATIENCE)


def _apart_from(
    lines: Sequence[Mapping[str, Array]], problem: Problem, left: Array, patience: float
) -> Iterator[dict[str, float]]:
    low, high = np.array(list(problem.free.values())).T
    np.random.default_rng(0).shuffle(left)  # neighbours likely belong to one branch, which is then found at once
    vain, known, seen = 0, len(lines), 0
    while len(left) and vain < patience:
        for line in lines[seen:]:
            points = np.stack([line[n] for n in problem.free], axis=-1)
            left = left[apart(left, (points - low) / (high - low), 1 / (points_of(problem) - 1))]
        seen = len(lines)
        if len(left):
            yield dict(zip(problem.free, (low + left[0] * (high - low)).tolist(), strict=True))
            left = left[1:]
            vain, known = (vain + 1 if len(lines) == known else 0), len(lines)


def points_of(problem: Problem) -> int:
    """Points of the grid along each axis."""
    return POINTS if problem.model.degree <= CLOSED else FEWER


def changes(problem: Problem, test: Callable[[Sequence[Any]], Any], points: int | None = None) -> tuple[Array, Array]:
    """Middles of the edges over which a function of the coefficients changes sign, in shares of the box, shape (n, 2).

    Two parts: those where a0 keeps its sign, or is the function, and the others. Where it is nan it does not count.
    """
    points = points or points_of(problem)
    share = np.linspace(0, 1, points)
    x, y = np.meshgrid(share, share, indexing="ij")
    ends = problem.free.items()
    columns = {n: low + part * (high - low) for (n, (low, high)), part in zip(ends, (x, y), strict=True)}
    with np.errstate(all="ignore"):
        a = np.moveaxis(coefficients(problem, columns), -1, 0)
        value = np.broadcast_to(np.asarray(test(list(a)), dtype=float), x.shape)
    same = np.array_equal(value, a[0], equal_nan=True)
    parts: list[list[Array]] = [[], []]
    for axis, offset in ((0, np.array([0.5, 0.0])), (1, np.array([0.0, 0.5]))):
        turns, through = _turns(value, axis), _turns(a[0], axis)
        if same:
            through[:] = False
        parts[0].append(np.argwhere(turns & ~through) + offset)
        parts[1].append(np.argwhere(turns & through) + offset)
    regular, others = (np.concatenate(part) / (points - 1) for part in parts)
    return regular, others


def _turns(value: Array, axis: int) -> Truth:
    """Where the sign changes from one grid point to the next; a 0 on the way counts on either side."""
    sign = np.sign(value)
    ahead, back = np.take(sign, range(1, sign.shape[axis]), axis), np.take(sign, range(sign.shape[axis] - 1), axis)
    return np.asarray((ahead != back) & np.isfinite(ahead) & np.isfinite(back))


def apart(points: Array, line: Array, distance: float) -> Truth:
    """Which of the points, shape (n, 2), are further than a distance from a polyline of shape (m, 2)."""
    start, along = line[:-1], np.diff(line, axis=0)
    length = np.maximum(np.sum(along**2, axis=1), 1e-300)
    far = np.ones(len(points), dtype=bool)
    for rows in _blocks(len(points)):
        offset = points[rows, None] - start
        share = np.clip(np.sum(offset * along, axis=2) / length, 0, 1)
        far[rows] = np.min(np.sum((offset - share[..., None] * along) ** 2, axis=2), axis=1) > distance**2
    return far


def _blocks(count: int, size: int = 256) -> Iterator[slice]:
    return (slice(k, k + size) for k in range(0, count, size))
