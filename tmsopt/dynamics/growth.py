"""Roots of a design over its speed or another parameter, with its stable and heavily damped values."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.dynamics.crossings import Crossing, Crossings, Stretch, find_crossings
from tmsopt.dynamics.eigenvalue_crossings import choose_grid_size, find_eigenvalue_crossings
from tmsopt.dynamics.modes import Mode, follow_modes
from tmsopt.dynamics.speeds import coefficients_over, speed_of
from tmsopt.dynamics.system import is_bicycle
from tmsopt.errors import InputError, input_error, is_number, short, suggest
from tmsopt.files import write_csv
from tmsopt.models import Model, Parameter, ParameterSet, Values
from tmsopt.problem.evaluate import find_eigenvalues
from tmsopt.problem.files import ProblemSource
from tmsopt.problem.problem import Problem
from tmsopt.problem.solution import Solution
from tmsopt.progress import Listener, start_steps
from tmsopt.records import AnyNumbers, Array, Complex, Tabular, Truth, plain
from tmsopt.roots import Root, is_stable, roots
from tmsopt.search.solve import solve_if_needed

SPEEDS = ("Fr", "v")
"""Parameters that are speeds."""

_BICYCLE_DEGREE = 4  # degree of a bicycle whose modes have names
_GRID_POINTS = 801  # number of evenly spaced values of the parameter
_HALVINGS = 60  # number of halvings of a step of the grid, until only rounding errors remain
_DENSE_OFFSETS = np.linspace(-1, 1, 301) ** 5
"""Offsets of additional values from a meeting of roots, in widths of the range."""
_END_RATIO = 1.25  # end of the range relative to the last event
_FEWER_OFFSETS = 3  # every third of them is used for many eigenvalues
_FAR_RATIO = 3  # farthest meeting of roots that is shown, relative to the design or the last axis crossing


@dataclass(frozen=True, repr=False)
class Growth(Tabular):
    """Roots of one design over one parameter.

    Attributes:
        over: the parameter.
        values: values of the parameter, ascending, shape (n,).
        roots: shape (n, degree). For a complex H, s = −i ω, and the shape is (n, size of H). Columns are not modes,
            because modes are not distinct at an exceptional point.
        critical: critical value that the model knows, such as Fr_c; nan without a critical value.
        design: value of the parameter at the design.
        structure: structure of the rightmost roots of the design.
        stable, heavily_damped: bands of values with all Re s < 0, and with all s real and negative. They are exact if
            the coefficients are polynomials in the parameter. Otherwise `stable` is found by bisection, and
            `heavily_damped` from the grid.
        problem: the problem that the design solves. If `over` is a parameter of the problem, it has the unit of the
            problem file.
        modes: the same roots as named modes; a mode ends where roots meet.
        events: exact values at which roots cross the axis or meet. If the coefficients are not polynomials in `over`,
            only changes of stability are listed. For complex or large matrices, a grid shows the events
            (`tmsopt.speeds`).
        rate: the unit of rates in 1/s, for each value; None without a unit of time.
        multiple: multiple roots of the design. Double precision gives them to half of its digits at most.
        petermann: Petermann factor of each root (`tmsopt.roots.find_conditioning`), in the shape of `roots`; None if
            not requested.

    Example:
        >>> bands = tmsopt.growth("problems/whipple_benchmark.toml").stable
        >>> [(f"{a:.4f}", f"{b:.4f}") for a, b in bands]  # weave and capsize speed of Meijaard et al. (2007), m/s
        [('4.2924', '6.0243')]

    More: docs/explanation/weave_and_capsize.md
    """

    over: Parameter
    values: Array
    roots: NDArray[np.complex128]
    critical: float
    design: float
    structure: str
    stable: tuple[Stretch, ...]
    heavily_damped: tuple[Stretch, ...]
    problem: Problem
    modes: tuple[Mode, ...] = ()
    events: tuple[Crossing, ...] = ()
    rate: Array | None = None
    multiple: tuple[Root, ...] = ()
    petermann: Array | None = None

    def records(self) -> Iterable[dict[str, Any]]:
        """The roots and, if requested, their Petermann factors, one row for each value of the parameter."""
        names = [f"{part}_{k}" for k in range(1, self.roots.shape[1] + 1) for part in ("re", "im")]
        parts = np.stack([self.roots.real, self.roots.imag], axis=-1).reshape(len(self.values), -1)
        if self.petermann is not None:
            names += [f"petermann_{k}" for k in range(1, self.roots.shape[1] + 1)]
            parts = np.concatenate([parts, self.petermann], axis=1)
        for value, row in zip(self.values.tolist(), parts.tolist(), strict=True):
            yield {self.over.name: value, **dict(zip(names, row, strict=True))}

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; numbers that do not exist are None."""
        names = "critical design structure stable heavily_damped values roots"
        return {"parameter": self.over.name, "unit": self.over.unit} | plain(
            self, names if self.petermann is None else f"{names} petermann"
        )

    def write_csv(self, path: str | PathLike[str]) -> None:
        """Write the records as a CSV table; its header has names and units.

        Raises:
            OSError: if the file cannot be written.
        """
        write_csv(path, list(self.records()), {self.over.name: self.over.unit})


def growth(
    design: ProblemSource,
    end: float | None = None,
    over: str | None = None,
    *,
    petermann: bool = False,
    progress: Listener | None = None,
) -> Growth:
    """Roots over one parameter; all other parameters are those of the design.

    Points are dense around the design and where roots meet, because roots move fast there, by a fractional power.

    Args:
        design: a solution, or a problem or its file, which is solved first.
        end: end of a range that begins at 0. The default for a speed is a little larger than the last weave speed,
            capsize speed or speed at which roots meet. A meeting of roots at more than 3 times the other speeds is left
            out. The default for another parameter is its range if it is free, otherwise twice the design's value.
        over: a parameter of the problem, or a native parameter of the model. The default is the speed, or without a
            speed the first free parameter.
        petermann: whether to compute the Petermann factor of each root.
        progress: called with a `tmsopt.Progress` now and then.

    Raises:
        InputError: for an unknown parameter.

    Example:
        >>> swing = tmsopt.models.from_coefficients([1, "c", 1])  # real roots from c = 2 on
        >>> roots = tmsopt.growth(tmsopt.Problem(swing, fixed={"c": 1.0}), end=4.0, over="c")
        >>> [(round(low, 9), round(high, 9)) for low, high in roots.heavily_damped]
        [(2.0, 4.0)]

    More: docs/explanation/weave_and_capsize.md
    """
    design = solve_if_needed(design, progress)
    start_steps(progress, "following the roots")
    if not (end is None or (is_number(end) and end != 0)):
        raise input_error(f"found {short(end)}; accepted: a number other than 0", "end")
    parameter_set, parameters, name = _find_parameter(design, over)
    model = design.problem.model
    has_critical = f"{name}_c" in model.quantity_names(parameter_set)
    design_value = parameters[name]
    critical = float(Values(model, parameter_set, parameters)[f"{name}_c"]) if has_critical else math.nan
    is_speed = name in SPEEDS
    low, high = _choose_range(design, name, end, design_value)

    def coefficients(x: Array) -> Array:
        """Coefficients at values x of the parameter, shape (n, degree + 1)."""
        a = model.coefficients({**parameters, name: x}, parameter_set)
        return np.stack(np.broadcast_arrays(*a, x)[:-1], axis=-1).astype(float)

    is_open, is_polynomial = is_speed and end is None and model.polynomial is not None, True
    count = _GRID_POINTS if model.polynomial is not None else choose_grid_size(model.degree)
    try:
        if model.polynomial is not None:
            a = coefficients_over(design.problem.posed, parameter_set, parameters, name)
            crossings = find_crossings(a, low, math.inf if is_open else high)
        else:
            crossings = find_eigenvalue_crossings(design.problem.posed.nominal, parameters, name, low, high)
    except InputError:
        is_open = is_polynomial = False
        crossings = Crossings(
            tuple(_find_stability_changes(coefficients, np.linspace(low, high, _GRID_POINTS))), (), ()
        )
    if is_open:
        high = _choose_end(crossings.found, design_value)
    events = tuple(c for c in crossings.found if low < c.at < high)
    centres = [design_value, *(c.at for c in events if "EP" in c.kind)]
    offsets = _DENSE_OFFSETS[:: 1 if count == _GRID_POINTS else _FEWER_OFFSETS] * (high - low)
    grid_start = low + (high - low) / count if is_speed else low  # at speed 0, roots are 0
    grid = np.unique(np.concatenate([np.linspace(grid_start, high, count), *(c + offsets for c in centres)]))
    values = grid[(grid > low if is_speed else grid >= low) & (grid <= high)]

    root_values = (
        _find_roots(coefficients(values))
        if model.polynomial is not None
        else np.sort(find_eigenvalues(model, parameter_set, {**parameters, name: values}).eigenvalues)
    )
    is_finite = np.isfinite(root_values).all(axis=1)  # leave out poles and roots at infinity
    values, root_values = values[is_finite], root_values[is_finite]
    if is_polynomial:
        stable, heavily_damped = (
            _clip_bands(bands, low, high) for bands in (crossings.stable, crossings.heavily_damped)
        )
    else:
        is_inside = is_stable(coefficients(values))
        stable = tuple(_find_runs(values, is_inside, events))
        heavily_damped = tuple(_find_runs(values, is_inside & np.all(root_values.imag == 0, axis=-1), ()))
    meetings = [(c.kind, c.at) for c in events] + [(design.structure, design_value)]
    modes = follow_modes(
        values,
        root_values,
        design_value,
        [at for kind, at in meetings if _has_many_roots(kind)],
        is_bicycle=is_bicycle(model) and model.degree == _BICYCLE_DEGREE,
        over_speed=is_speed,
        is_complex=model.is_complex,
    )
    if model.is_complex:
        modes = tuple(replace(m, name=m.name.replace("pair", "mode")) for m in modes)
    return Growth(
        parameter_set[name],
        values,
        root_values,
        critical,
        design_value,
        design.structure,
        stable,
        heavily_damped,
        design.problem,
        modes,
        events,
        parameter_set.rate and np.zeros(values.shape) + parameter_set.rate({**parameters, name: values}),
        tuple(r for r in design.roots if r.multiplicity > 1),
        _find_petermann(model, parameter_set, {**parameters, name: values}, root_values) if petermann else None,
    )


def _find_roots(c: Array) -> Complex:
    """Roots of the rows of coefficients; nan if one is not finite or at infinity."""
    is_finite = np.isfinite(c).all(axis=1) & (c[:, 0] != 0)
    found = np.full((len(c), c.shape[1] - 1), np.nan, dtype=complex)
    found[is_finite] = roots(c[is_finite])
    return found


def _find_petermann(model: Model, parameter_set: ParameterSet, columns: AnyNumbers, roots: Complex) -> Array:
    """The Petermann factor of the eigenvalue nearest to each root."""
    found = find_eigenvalues(model, parameter_set, columns)
    nearest = np.abs(found.eigenvalues[:, None, :] - roots[:, :, None]).argmin(axis=-1)
    return np.take_along_axis(found.petermann, nearest, axis=-1)


def _find_parameter(design: Solution, over: str | None) -> tuple[ParameterSet, dict[str, float], str]:
    """The parameter set that has the parameter, the design in this set, and the name of the parameter."""
    problem = design.problem.posed
    parameter_set, native = problem.parameter_set, problem.model.sets[0]
    if over is None:
        over = speed_of(parameter_set) or next(iter(problem.free), parameter_set.names[0])
    if over in parameter_set.names:
        return parameter_set, dict(design.parameters), over
    if over in native.names:
        return native, dict(design.dimensionless), over
    accepted = dict.fromkeys((*parameter_set.names, *native.names))
    raise input_error(f"found '{over}'; {suggest(over, accepted)}", "over")


def _choose_range(design: Solution, name: str, end: float | None, design_value: float) -> Stretch:
    if end is not None:
        return min(end, 0.0), max(end, 0.0)
    if name in SPEEDS:
        return 0.0, 2 * max(design_value, 0.5)
    low, high = design.problem.free.get(name, (min(2 * design_value, 0.0), max(2 * design_value, 0.0)))
    return (low, high) if low < high else (low - 1.0, high + 1.0)


def _choose_end(crossings: Sequence[Crossing], design_value: float) -> float:
    """The end of a range of speeds that shows all events."""
    last_crossing = max((c.at for c in crossings if c.kind in ("weave", "capsize", "infinity")), default=0.0)
    shown_end = _FAR_RATIO * max(design_value, last_crossing, 0.5)
    last_event = max((c.at for c in crossings if c.at <= shown_end), default=0.0)
    return _END_RATIO * max(last_event, last_crossing, design_value) if last_event else 2 * max(design_value, 0.5)


def _clip_bands(bands: Sequence[Stretch], low: float, high: float) -> tuple[Stretch, ...]:
    return tuple((max(a, low), min(b, high)) for a, b in bands if a < high and b > low)


def _has_many_roots(structure: str) -> bool:
    """Whether more than two roots meet in a structure."""
    return "EP" in structure and structure != "EP2"


def _find_stability_changes(coefficients: Callable[[Array], Array], grid: Array) -> Iterator[Crossing]:
    """Changes of stability between points of a grid, by bisection."""
    is_inside = is_stable(coefficients(grid))
    k = np.flatnonzero(is_inside[1:] != is_inside[:-1])
    low, high = grid[k], grid[k + 1]
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        on_low_side = is_stable(coefficients(middle)) == is_inside[k]
        low, high = np.where(on_low_side, middle, low), np.where(on_low_side, high, middle)
    for value, a in zip(high.tolist(), coefficients(high), strict=True):
        if np.all(np.isfinite(a)) and a[0] != 0:  # nothing crosses the axis at a pole or with a root at infinity
            omega = abs(min(roots(a).tolist(), key=lambda z: abs(z.real)).imag)
            yield Crossing(value, "weave" if omega else "capsize", Root(0.0, omega), rightmost=True, changes=True)


def _find_runs(values: Array, is_inside: Truth, events: Sequence[Crossing]) -> Iterator[Stretch]:
    """First and last value of each run of points inside, extended to an event between it and the next point outside."""
    changes = np.flatnonzero(np.diff(is_inside.astype(int), prepend=0, append=0))
    padded = np.concatenate([values[:1], values, values[-1:]])
    for start, stop in changes.reshape(-1, 2):
        begins = [c.at for c in events if padded[start] <= c.at <= values[start]]
        ends = [c.at for c in events if values[stop - 1] <= c.at <= padded[stop + 1]]
        yield float(max(begins, default=values[start])), float(min(ends, default=values[stop - 1]))
