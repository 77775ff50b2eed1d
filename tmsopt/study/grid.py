"""A coarse grid over the plane of two free parameters, to see where branches of a pattern may be missing."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.design.problem import Problem

Array = NDArray[np.float64]
Truth = NDArray[np.bool_]

POINTS = 256
"""Along each axis; an edge of the grid is as long as a step of a trace."""


def coefficients(problem: Problem, columns: Mapping[str, Array]) -> Array:
    """Coefficients of the designs given by columns of the free parameters, shape (designs, n + 1)."""
    a = problem.model.coefficients(problem.ordered(columns), problem.parameter_set)
    shape = np.shape(next(iter(columns.values())))
    return np.stack([np.broadcast_to(np.asarray(c, dtype=float), shape) for c in a], axis=-1)


def unexplained(
    problem: Problem, test: Callable[[Sequence[Any]], Any], lines: Sequence[Mapping[str, Array]], proper: bool = True
) -> Iterator[dict[str, float]]:
    """Designs by which a function of the coefficients changes sign, far from every line; `lines` may grow meanwhile.

    Edges over which a0 changes sign as well are left aside where the polynomial is to be `proper`.
    """
    low, high = np.array(list(problem.free.values())).T
    left = changes(problem, test, proper)
    np.random.default_rng(0).shuffle(left)  # neighbours likely belong to one branch, which is then found at once
    seen = 0
    while len(left):
        for line in lines[seen:]:
            points = np.stack([line[n] for n in problem.free], axis=-1)
            left = left[apart(left, (points - low) / (high - low), 1 / (POINTS - 1))]
        seen = len(lines)
        if len(left):
            yield dict(zip(problem.free, (low + left[0] * (high - low)).tolist(), strict=True))
            left = left[1:]


def changes(problem: Problem, test: Callable[[Sequence[Any]], Any], proper: bool, points: int = POINTS) -> Array:
    """Middles of the edges over which a function of the coefficients changes sign, in shares of the box, shape (n, 2).

    Where the function is nan it does not count.
    """
    share = np.linspace(0, 1, points)
    x, y = np.meshgrid(share, share, indexing="ij")
    columns = {
        n: low + part * (high - low) for (n, (low, high)), part in zip(problem.free.items(), (x, y), strict=True)
    }
    with np.errstate(all="ignore"):
        a = np.moveaxis(coefficients(problem, columns), -1, 0)
        value = np.broadcast_to(np.asarray(test(list(a)), dtype=float), x.shape)
        along = [np.argwhere(_turns(value, axis) & ~(proper & _turns(a[0], axis))) for axis in (0, 1)]
    middles = [rows + offset for rows, offset in zip(along, ([0.5, 0.0], [0.0, 0.5]), strict=True)]
    return np.asarray(np.concatenate(middles) / (points - 1))


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
