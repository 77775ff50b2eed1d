"""Roots of a design over its speed, or another parameter, with the stable and heavily damped values of it."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.design.solution import Solution
from tmsopt.errors import Fault, InputError, suggest
from tmsopt.models import Parameter, ParameterSet, Values
from tmsopt.records import Array
from tmsopt.roots import is_stable, roots

Band = tuple[float, float]

SPEEDS = ("Fr", "v")
"""Native parameters that roots are shown over unless another is named; of a model without a speed, the first free."""

_POINTS = 801
_BISECTIONS = 60


@dataclass(frozen=True)
class Growth:
    """Roots of one design over one parameter.

    Attributes:
        over: the parameter.
        values: of it, ascending, shape (n,).
        roots: shape (n, degree); columns are not modes, for modes cannot be told apart at an exceptional point.
        critical: critical value that the model knows, such as Fr_c, nan if there is none.
        design: value of the design.
        structure: structure of its rightmost roots.
        stable, heavily_damped: bands of values with all Re s < 0; with all s real and negative.
    """

    over: Parameter
    values: Array
    roots: NDArray[np.complex128]
    critical: float
    design: float
    structure: str
    stable: tuple[Band, ...]
    heavily_damped: tuple[Band, ...]


def growth(design: Solution, end: float | None = None, over: str | None = None) -> Growth:
    """Roots over a parameter, all else as designed.

    Points crowd around the design, where roots near an exceptional point move like a fractional power of the parameter.

    Args:
        end: of a range that begins at 0; by default twice the larger of the design's and the critical speed, or for
            another parameter its box if it is free, and else up to twice the design's value.
        over: a native parameter or one of the problem; by default the speed, or the first free one.

    Raises:
        InputError: for an unknown parameter.
    """
    of, parameters, name = _written(design, over)
    model = design.problem.model
    at, critical = parameters[name], _critical(design, of, parameters, name)
    low, high = _ends(design, name, end, at, critical)
    crowd = np.linspace(-1, 1, 301) ** 5 * (high - low)
    first = low + (high - low) / _POINTS if name in SPEEDS else low  # at rest a speed leaves roots 0
    grid = np.unique(np.concatenate([np.linspace(first, high, _POINTS), at + crowd]))
    values = grid[(grid > low) & (grid <= high)] if name in SPEEDS else grid[(grid >= low) & (grid <= high)]

    def coefficients(along: Array) -> Array:
        columns: Mapping[str, Any] = {**parameters, name: along}
        return np.stack(np.broadcast_arrays(*model.coefficients(columns, of), along)[:-1], axis=-1).astype(float)

    def heavily_damped(along: Array) -> NDArray[np.bool_]:
        a = coefficients(along)
        return np.asarray(is_stable(a) & np.all(roots(a).imag == 0, axis=-1))

    def stable(along: Array) -> NDArray[np.bool_]:
        return is_stable(coefficients(along))

    values = values[coefficients(values)[:, 0] != 0]  # a root at infinity cannot be shown
    return Growth(
        over=of[name],
        values=values,
        roots=roots(coefficients(values)),
        critical=critical,
        design=at,
        structure=design.structure,
        stable=_bands(values, stable),
        heavily_damped=_bands(values, heavily_damped),
    )


def _written(design: Solution, over: str | None) -> tuple[ParameterSet, dict[str, float], str]:
    """The parameters of a design in the set that has the one asked for, and its name."""
    problem = design.problem
    native = problem.model.sets[0]
    if over is None:
        over = next((n for n in SPEEDS if n in native.names), None) or next(iter(problem.free), native.names[0])
    if over in native.names:
        return native, dict(design.dimensionless), over
    if over in problem.parameter_set.names:
        return problem.parameter_set, dict(design.parameters), over
    accepted = dict.fromkeys((*native.names, *problem.parameter_set.names))
    raise InputError([Fault(f"found '{over}'; {suggest(over, accepted)}", ("over",))])


def _critical(design: Solution, of: ParameterSet, parameters: Mapping[str, float], name: str) -> float:
    model = design.problem.model
    known = f"{name}_c" in model.quantity_names(of)
    return float(Values(model, of, parameters)[f"{name}_c"]) if known else math.nan


def _ends(design: Solution, name: str, end: float | None, at: float, critical: float) -> Band:
    if end is not None:
        return min(end, 0.0), max(end, 0.0)
    if name in SPEEDS:
        return 0.0, 2 * max(at, critical if math.isfinite(critical) else 0.0, 0.5)
    low, high = design.problem.free.get(name, (min(2 * at, 0.0), max(2 * at, 0.0)))
    return (low, high) if low < high else (low - 1.0, high + 1.0)


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
