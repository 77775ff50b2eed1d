"""Roots of a design over its speed, or another parameter, with the stable and heavily damped values of it."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.arithmetic.elementary import exact
from tmsopt.critical_speeds.crossings import Stretch, crossings
from tmsopt.critical_speeds.speeds import coefficients_over
from tmsopt.design.files import Given
from tmsopt.design.solution import Solution
from tmsopt.errors import Fault, InputError, is_number, short, suggest
from tmsopt.models import Parameter, ParameterSet, Values
from tmsopt.records import Array, Tabular, Truth, plain
from tmsopt.roots import is_stable, roots
from tmsopt.solver.solve import solved

SPEEDS = ("Fr", "v")
"""Native parameters that roots are shown over unless another is named; of a model without a speed, the first free."""

_POINTS = 801


@dataclass(frozen=True, repr=False)
class Growth(Tabular):
    """Roots of one design over one parameter.

    Attributes:
        over: the parameter.
        values: of it, ascending, shape (n,).
        roots: shape (n, degree); columns are not modes, for modes cannot be told apart at an exceptional point.
        critical: critical value that the model knows, such as Fr_c, nan if there is none.
        design: value of the design.
        structure: structure of its rightmost roots.
        stable, heavily_damped: bands of values with all Re s < 0; with all s real and negative. Exact where the
            coefficients are polynomials in the parameter, else from point to point.
    """

    over: Parameter
    values: Array
    roots: NDArray[np.complex128]
    critical: float
    design: float
    structure: str
    stable: tuple[Stretch, ...]
    heavily_damped: tuple[Stretch, ...]

    def records(self) -> Iterable[dict[str, Any]]:
        """The roots at each value, one a row."""
        names = [f"{part}_{k}" for k in range(1, self.roots.shape[1] + 1) for part in ("re", "im")]
        parts = np.stack([self.roots.real, self.roots.imag], axis=-1).reshape(len(self.values), -1)
        for value, row in zip(self.values.tolist(), parts.tolist(), strict=True):
            yield {self.over.name: value, **dict(zip(names, row, strict=True))}

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; numbers that do not exist are None."""
        return {"parameter": self.over.name, "unit": self.over.unit} | plain(
            self, "critical design structure stable heavily_damped values roots"
        )


def growth(design: Given, end: float | None = None, over: str | None = None) -> Growth:
    """Roots over a parameter, all else as designed.

    Points crowd around the design, where roots near an exceptional point move like a fractional power of the parameter.

    Args:
        design: a solution, or a problem or its file, solved first.
        end: of a range that begins at 0; by default twice the larger of the design's and the critical speed, or for
            another parameter its box if it is free, and else up to twice the design's value.
        over: a native parameter or one of the problem; by default the speed, or the first free one.

    Raises:
        InputError: for an unknown parameter.
    """
    design = solved(design)
    if not (end is None or (is_number(end) and end != 0)):
        raise InputError([Fault(f"found {short(end)}; accepted: a number other than 0", ("end",))])
    of, parameters, name = _written(design, over)
    model = design.problem.model
    known = f"{name}_c" in model.quantity_names(of)
    at, critical = parameters[name], float(Values(model, of, parameters)[f"{name}_c"]) if known else math.nan
    low, high = _ends(design, name, end, at, critical)
    crowd = np.linspace(-1, 1, 301) ** 5 * (high - low)
    first = low + (high - low) / _POINTS if name in SPEEDS else low  # at rest a speed leaves roots 0
    grid = np.unique(np.concatenate([np.linspace(first, high, _POINTS), at + crowd]))
    values = grid[(grid > low) & (grid <= high)] if name in SPEEDS else grid[(grid >= low) & (grid <= high)]

    columns: Mapping[str, Any] = {**parameters, name: values}
    a = np.stack(np.broadcast_arrays(*model.coefficients(columns, of), values)[:-1], axis=-1).astype(float)
    shown = a[:, 0] != 0  # a root at infinity cannot be shown
    values, a = values[shown], a[shown]
    found = roots(a)
    try:
        bands = crossings(coefficients_over(model, of, parameters, name), exact(low), exact(high), bands_alone=True)
        stable, heavily_damped = bands.stable, bands.heavily_damped
    except InputError:  # no polynomials in it
        inside = is_stable(a)
        stable, heavily_damped = _runs(values, inside), _runs(values, inside & np.all(found.imag == 0, axis=-1))
    return Growth(of[name], values, found, critical, at, design.structure, stable, heavily_damped)


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


def _ends(design: Solution, name: str, end: float | None, at: float, critical: float) -> Stretch:
    if end is not None:
        return min(end, 0.0), max(end, 0.0)
    if name in SPEEDS:
        return 0.0, 2 * max(at, critical if math.isfinite(critical) else 0.0, 0.5)
    low, high = design.problem.free.get(name, (min(2 * at, 0.0), max(2 * at, 0.0)))
    return (low, high) if low < high else (low - 1.0, high + 1.0)


def _runs(values: Array, inside: Truth) -> tuple[Stretch, ...]:
    """First and last value of each run of points in which something holds."""
    changes = np.flatnonzero(np.diff(inside.astype(int), prepend=0, append=0))
    return tuple((float(values[k]), float(values[m - 1])) for k, m in changes.reshape(-1, 2))
