"""Roots of a design over the Froude number, with its stable and heavily damped speeds."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.design.solution import Solution
from tmsopt.models import Values
from tmsopt.roots import is_stable, roots

Array = NDArray[np.float64]
Band = tuple[float, float]

_POINTS = 801
_BISECTIONS = 60


@dataclass(frozen=True)
class Growth:
    """Roots of one design over the Froude number.

    Attributes:
        Fr: Froude numbers, ascending, shape (n,).
        roots: shape (n, 4); columns are not modes, for modes cannot be told apart at an exceptional point.
        Fr_c: critical Froude number, nan if there is none.
        Fr_design: Froude number of the design.
        structure: structure of its rightmost roots.
        stable, heavily_damped: bands of Fr with all Re s < 0; with all s real and negative.
    """

    Fr: Array
    roots: NDArray[np.complex128]
    Fr_c: float
    Fr_design: float
    structure: str
    stable: tuple[Band, ...]
    heavily_damped: tuple[Band, ...]


def growth(design: Solution, Fr_max: float | None = None) -> Growth:
    """Roots over 0 < Fr ≤ Fr_max (default: twice the larger of the design's Fr and Fr_c), all else as designed.

    Points crowd around the design, where roots near an exceptional point move like a fractional power of Fr.
    """
    model = design.problem.model
    native: dict[str, float] = dict(design.dimensionless)
    at, critical = native["Fr"], float(Values(model, model.sets[0], native)["Fr_c"])
    end = Fr_max or 2 * max(at, critical if math.isfinite(critical) else 0.0, 0.5)
    crowd = np.linspace(-1, 1, 301) ** 5 * end
    grid = np.unique(np.concatenate([np.linspace(end / _POINTS, end, _POINTS), at + crowd]))
    Fr = grid[(grid > 0) & (grid <= end)]

    def coefficients(speeds: Array) -> Array:
        columns: Mapping[str, Any] = {**native, "Fr": speeds}
        return np.stack(np.broadcast_arrays(*model.coefficients(columns)), axis=-1).astype(float)

    def heavily_damped(speeds: Array) -> NDArray[np.bool_]:
        a = coefficients(speeds)
        return np.asarray(is_stable(a) & np.all(roots(a).imag == 0, axis=-1))

    def stable(speeds: Array) -> NDArray[np.bool_]:
        return is_stable(coefficients(speeds))

    return Growth(
        Fr=Fr,
        roots=roots(coefficients(Fr)),
        Fr_c=critical,
        Fr_design=at,
        structure=design.structure,
        stable=_bands(Fr, stable),
        heavily_damped=_bands(Fr, heavily_damped),
    )


def _bands(grid: Array, holds: Callable[[Array], NDArray[np.bool_]]) -> tuple[Band, ...]:
    """Intervals where a property holds, their ends bisected between grid points."""
    inside = holds(grid)
    edges = np.flatnonzero(inside[1:] != inside[:-1])
    low, high, left = grid[edges], grid[edges + 1], inside[edges]
    for _ in range(_BISECTIONS if edges.size else 0):
        middle = (low + high) / 2
        same = holds(middle) == left
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    ends = [*([float(grid[0])] if inside[0] else []), *high.tolist(), *([float(grid[-1])] if inside[-1] else [])]
    return tuple(zip(ends[0::2], ends[1::2], strict=True))
