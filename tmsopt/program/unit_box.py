"""The box of a problem scaled to a unit cube, in which designs are drawn and compared."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tmsopt.problem.problem import Posed
from tmsopt.records import Array

_STEEPNESS = 7.0  # c of the scale near 0: its inner half covers 3 % of a range, its inner tenth 0.2 % of the range
_MAX_LINEAR_RATIO = 100.0  # if the ratio of the ends of a range is larger, its scale is logarithmic


@dataclass(frozen=True)
class UnitBox:
    """The box of a problem as a unit cube: angles are scaled by their tangent, ranges over decades by the logarithm."""

    problem: Posed

    @property
    def size(self) -> int:
        """Number of free parameters."""
        return len(self.problem.free)

    def designs(self, u: Array) -> dict[str, Array]:
        """Columns of parameters for points of shape (…, size)."""
        lower, upper, scaled_lower, scaled_width = self._ends.reshape(4, -1, *[1] * (u.ndim - 1))
        rows = np.moveaxis(u, -1, 0)
        scaled_rows = scaled_lower + scaled_width * rows
        values = [inverse(row) for (_, inverse), row in zip(self._scales, scaled_rows, strict=True)]
        x = np.minimum(np.maximum(np.stack(values), lower), upper)
        x = np.where(rows <= 0, lower, np.where(rows >= 1, upper, x))  # ends are exact, without rounding
        return dict(zip(self.problem.free, x, strict=True))

    def point(self, design: Mapping[str, float]) -> Array:
        """The point of one design."""
        coordinates = []
        for (name, ends), (scale, _) in zip(self.problem.free.items(), self._scales, strict=True):
            lower, upper, x = scale(np.array([*ends, design[name]]))
            coordinates.append((x - lower) / (upper - lower))
        return np.asarray(np.clip(coordinates, 0.0, 1.0))

    def resolve_near_zero(self, u: Array) -> tuple[Array, Array]:
        """Move points to a scale that resolves values near 0. Return the points and the slopes of this map.

        The scale is halfway between the scale of the cube and x = b sinh(c y)/sinh(c).
        """
        rows, size, ends = self._zero_scales
        points, slopes = u.copy(), np.ones_like(u)
        x = (self._ends[2] + self._ends[3] * u)[..., rows]
        points[..., rows] = (u[..., rows] + (np.arcsinh(x / size) - ends[0]) / (ends[1] - ends[0])) / 2
        slopes[..., rows] = (1 + self._ends[3][rows] / np.hypot(x, size) / (ends[1] - ends[0])) / 2
        return np.clip(points, 0.0, 1.0), slopes

    def spread_near_zero(self, u: Array) -> Array:
        """The inverse of `sample_near_zero`."""
        rows, size, ends = self._zero_scales
        points = u.copy()
        x = (self._ends[2] + self._ends[3] * u)[..., rows]
        points[..., rows] = np.clip((np.arcsinh(x / size) - ends[0]) / (ends[1] - ends[0]), 0.0, 1.0)
        return points

    def sample_near_zero(self, u: Array) -> Array:
        """Spread points along x = b sinh(c y)/sinh(c) in each range that contains 0."""
        rows, size, ends = self._zero_scales
        points = u.copy()
        x = size * np.sinh(ends[0] + (ends[1] - ends[0]) * u[..., rows])
        points[..., rows] = np.clip((x - self._ends[2][rows]) / self._ends[3][rows], 0.0, 1.0)
        return points

    @cached_property
    def _zero_scales(self) -> tuple[NDArray[np.int_], Array, Array]:
        """Indices of the parameters whose range contains 0, the units of their scales, and their ends, shape (2, n)."""
        is_unscaled = np.array([scale is np.positive for scale, _ in self._scales], dtype=bool)
        rows = np.flatnonzero(is_unscaled & (self._ends[0] <= 0) & (self._ends[1] >= 0))
        ends = self._ends[:2][:, rows]
        size = np.abs(ends).max(axis=0, initial=0.0) / np.sinh(_STEEPNESS)
        return rows, size, np.arcsinh(ends / size)

    @cached_property
    def _ends(self) -> Array:
        """Lower ends, upper ends, scaled lower ends and scaled widths of the ranges. Shape (4, size)."""
        ranges = np.array([*self.problem.free.values()]).reshape(-1, 2)
        ends = np.array([scale(e) for (scale, _), e in zip(self._scales, ranges, strict=True)]).reshape(-1, 2)
        return np.stack([*ranges.T, ends[:, 0], ends[:, 1] - ends[:, 0]])

    @cached_property
    def _scales(self) -> list[tuple[np.ufunc, np.ufunc]]:
        """For each free parameter, the function that spreads its values evenly, and its inverse."""
        scales = list[tuple[np.ufunc, np.ufunc]]()
        for name, (lower, upper) in self.problem.free.items():
            if self.problem.parameter_set[name].tangent:
                scales.append((np.tan, np.arctan))
            elif lower > 0 and upper > _MAX_LINEAR_RATIO * lower:
                scales.append((np.log, np.exp))
            else:
                scales.append((np.positive, np.positive))
        return scales
