"""Roots of a design over its speed, or another parameter, with the stable and heavily damped values of it."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.dynamics.crossings import Crossing, Crossings, Stretch, crossings, user_crossings
from tmsopt.dynamics.modes import Mode, modes
from tmsopt.dynamics.speeds import coefficients_over, speed_of
from tmsopt.dynamics.system import is_bicycle
from tmsopt.errors import InputError, input_error, is_number, short, suggest
from tmsopt.models import Parameter, ParameterSet, Values
from tmsopt.models.user_spectrum import user_root_array
from tmsopt.problem.files import Given
from tmsopt.problem.problem import Problem
from tmsopt.problem.solution import Solution
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Array, Tabular, Truth, plain
from tmsopt.roots import Root, is_stable, roots
from tmsopt.search.solve import solve_if_needed

SPEEDS = ("Fr", "v")
"""Parameters that are speeds."""

_BICYCLE = 4  # degree of a bicycle whose modes have names
_POINTS = 801
_HALVINGS = 60  # of a step of the grid, to rounding
_CROWD = np.linspace(-1, 1, 301) ** 5
_MARGIN = 1.25  # times the last event
_FAR = 3  # times the design and all that meets the axis: beyond, roots that meet are not waited for


@dataclass(frozen=True, repr=False)
class Growth(Tabular):
    """Roots of one design over one parameter.

    Attributes:
        over: the parameter.
        values: of it, ascending, shape (n,).
        roots: shape (n, degree), of a complex H s = −i ω, shape (n, size of H); columns are not modes, for modes cannot
            be told apart at an exceptional point.
        critical: critical value that the model knows, such as Fr_c, nan if there is none.
        design: value of the design.
        structure: structure of its rightmost roots.
        stable, heavily_damped: bands of values with all Re s < 0; with all s real and negative. Exact where the
            coefficients are polynomials in the parameter; else `stable` by halving, the other from point to point.
        problem: that the design solves; its parameters, where `over` is one of them, have the units of its file.
        modes: the roots again, each followed from meeting to meeting, with a name.
        events: where roots cross the axis or meet, exact; where the coefficients are no polynomials in `over`, those
            where stability changes alone.
        rate: how many 1/s a rate of 1 is, for each value; None without a unit of time.
        multiple: multiple roots of the design, which its numbers give to half of their digits or less.

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


def growth(
    design: Given, end: float | None = None, over: str | None = None, *, progress: Listener | None = None
) -> Growth:
    """Roots over a parameter, all else as designed.

    Points crowd around the design and where roots meet: there they move like a fractional power of the parameter.

    Args:
        design: a solution, or a problem or its file, solved first.
        end: of a range that begins at 0; by default of a speed a little beyond the last weave, capsize or meeting of
            roots (one that is farther than 3 times all else is left out), or for another parameter its box if it is
            free, and else up to twice the design's value.
        over: a parameter of the problem or a native one; by default the speed, or the first free one.
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
    of, parameters, name = _written(design, over)
    model = design.problem.model
    known = f"{name}_c" in model.quantity_names(of)
    at, critical = parameters[name], float(Values(model, of, parameters)[f"{name}_c"]) if known else math.nan
    speed = name in SPEEDS
    low, high = _ends(design, name, end, at)

    def coefficients(x: Array) -> Array:
        """Of shape (n, degree + 1)."""
        a = model.coefficients({**parameters, name: x}, of)
        return np.stack(np.broadcast_arrays(*a, x)[:-1], axis=-1).astype(float)

    is_open, is_polynomial = speed and end is None, True
    try:
        a = coefficients_over(design.problem.posed, of, parameters, name)
        met = crossings(a, low, math.inf if is_open else high)
    except InputError:
        is_open = is_polynomial = False
        met = Crossings(tuple(_changes(coefficients, np.linspace(low, high, _POINTS))), (), ())
    met = user_crossings(model, met)
    if is_open:
        high = _last(met.found, at)
    events = tuple(c for c in met.found if low < c.at < high)
    centres = [at, *(c.at for c in events if "EP" in c.kind)]
    first = low + (high - low) / _POINTS if speed else low  # at rest a speed leaves roots 0
    grid = np.unique(np.concatenate([np.linspace(first, high, _POINTS), *(c + _CROWD * (high - low) for c in centres)]))
    values = grid[(grid > low if speed else grid >= low) & (grid <= high)]

    c = coefficients(values)
    shown = np.isfinite(c).all(axis=1) & (c[:, 0] != 0)  # neither a pole nor a root at infinity can be shown
    values, c = values[shown], c[shown]
    found = roots(c)
    if is_polynomial:
        stable, heavily_damped = _within(met.stable, low, high), _within(met.heavily_damped, low, high)
    else:
        inside = is_stable(c)
        stable = tuple(_runs(values, inside, events))
        heavily_damped = tuple(_runs(values, inside & np.all(found.imag == 0, axis=-1), ()))
    rate = None if of.rate is None else np.zeros(values.shape) + of.rate({**parameters, name: values})
    many = [c.at for c in events if _crowded(c.kind)] + [at] * _crowded(design.structure)
    followed = modes(values, found, at, many, bicycle=is_bicycle(model) and model.degree == _BICYCLE, speed=speed)
    if model.carrier is not None:
        found = user_root_array(model, found)
        followed = tuple(
            replace(m, name=m.name.replace("pair", "mode"), roots=m.roots.conj() + 1j * model.carrier) for m in followed
        )
    return Growth(
        of[name],
        values,
        found,
        critical,
        at,
        design.structure,
        stable,
        heavily_damped,
        design.problem,
        followed,
        events,
        rate,
        tuple(r for r in design.roots if r.multiplicity > 1),
    )


def _written(design: Solution, over: str | None) -> tuple[ParameterSet, dict[str, float], str]:
    """The parameters of a design in the set that has the one asked for, and its name."""
    problem = design.problem.posed
    own, native = problem.parameter_set, problem.model.sets[0]
    if over is None:
        over = speed_of(own) or next(iter(problem.free), own.names[0])
    if over in own.names:
        return own, dict(design.parameters), over
    if over in native.names:
        return native, dict(design.dimensionless), over
    accepted = dict.fromkeys((*own.names, *native.names))
    raise input_error(f"found '{over}'; {suggest(over, accepted)}", "over")


def _ends(design: Solution, name: str, end: float | None, at: float) -> Stretch:
    if end is not None:
        return min(end, 0.0), max(end, 0.0)
    if name in SPEEDS:
        return 0.0, 2 * max(at, 0.5)
    low, high = design.problem.free.get(name, (min(2 * at, 0.0), max(2 * at, 0.0)))
    return (low, high) if low < high else (low - 1.0, high + 1.0)


def _last(found: Sequence[Crossing], at: float) -> float:
    """The end of a range of speeds that shows all that happens."""
    crossed = max((c.at for c in found if c.kind in ("weave", "capsize", "infinity")), default=0.0)
    near = _FAR * max(at, crossed, 0.5)
    last = max((c.at for c in found if c.at <= near), default=0.0)
    return _MARGIN * max(last, crossed, at) if last else 2 * max(at, 0.5)


def _within(bands: Sequence[Stretch], low: float, high: float) -> tuple[Stretch, ...]:
    return tuple((max(a, low), min(b, high)) for a, b in bands if a < high and b > low)


def _crowded(structure: str) -> bool:
    """Whether more than two roots meet at a design."""
    return "EP" in structure and structure != "EP2"


def _changes(coefficients: Callable[[Array], Array], grid: Array) -> Iterator[Crossing]:
    """Where stability begins or ends between points of a grid, by halving."""
    inside = is_stable(coefficients(grid))
    k = np.flatnonzero(inside[1:] != inside[:-1])
    low, high = grid[k], grid[k + 1]
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        same = is_stable(coefficients(middle)) == inside[k]
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    for at, there in zip(high.tolist(), coefficients(high), strict=True):
        if np.all(np.isfinite(there)) and there[0] != 0:  # no pole nor root at infinity, where nothing crosses the axis
            omega = abs(min(roots(there).tolist(), key=lambda z: abs(z.real)).imag)
            yield Crossing(at, "weave" if omega else "capsize", Root(0.0, omega), rightmost=True, changes=True)


def _runs(values: Array, inside: Truth, events: Sequence[Crossing]) -> Iterator[Stretch]:
    """First and last value of each run of points in which something holds, up to events between these and the next."""
    changes = np.flatnonzero(np.diff(inside.astype(int), prepend=0, append=0))
    padded = np.concatenate([values[:1], values, values[-1:]])
    for k, m in changes.reshape(-1, 2):
        begin = [c.at for c in events if padded[k] <= c.at <= values[k]]
        end = [c.at for c in events if values[m - 1] <= c.at <= padded[m + 1]]
        yield float(max(begin, default=values[k])), float(min(end, default=values[m - 1]))
