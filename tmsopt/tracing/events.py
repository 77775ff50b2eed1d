"""Events: functions of the points of a curve, whose zeros are located on the curve to rounding.

Events of the package and of the user are treated in the same way. A function may have two zeros between two steps.
Where a function comes near 0, `refine_walk` adds the point at which it is nearest to 0.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from tmsopt.errors import Fault, InputError, input_error, is_number, list_faults, short, suggest, text_faults
from tmsopt.records import Array, Truth
from tmsopt.roots.sign_tests import nearest_pair_mean
from tmsopt.tracing.continuation import Curve, Walk, step_along
from tmsopt.tracing.equations import TracedProblem
from tmsopt.tracing.points import NOTHING, Points, axis_functions
from tmsopt.tracing.solving import find_zeros

SAME_PLACE = 1e-6
"""Distance, in units of the scale, up to which events are at one place; each is located to 1e-12 or better."""

CHANGES = "stability changes"
"""Detail of weave and capsize events, which are listed only where stability changes."""

_PACKAGE_NAMES = (
    r"weave|capsize|fold|constraint|end|(double|\d+-fold) zero|\d*C?EP\d\S*"  # names of events of the package
)
_MIN_DIP = 0.5
"""A minimum between two steps is searched if a parabola predicts a fall by at least this share of the value."""
_MAX_DEVIATION = 2.0  # in arclengths; a point farther away lies on another curve, as may happen near a singular point
_ROUNDING = 1e-14  # rounding error of a variable of order 1


@dataclass(frozen=True)
class Event:
    """A place on a curve where a function changes its sign.

    Attributes:
        name: one line of text, which is shown with the curve.
        function: point → number. The point is a mapping: ``p["Fr"]`` is a parameter of the problem, ``p["abscissa"]`` a
            quantity of its model, ``p["r"]`` an unknown of the pattern.
        stop: whether the branch ends at the event. The curve after the event is another branch.
        detail: words to show next to the name.

    Example:
        >>> half = tmsopt.Event("half a radian", lambda p: p["lambda_s"] - 0.5)
        >>> found = tmsopt.trace("problems/ep_set.toml", events=[half])
        >>> [f"{e.parameters['Fr']:.9f}" for e in found.events if e.name == "half a radian"]
        ['2.289532730']
        >>> f"{tmsopt.laws.epset(-0.4, -0.2, 0.5):.9f}"  # the law of the paper
        '2.289532730'

    More: docs/how_to/tracing.md
    """

    name: str
    function: Callable[[Any], Any] = field(repr=False)
    stop: bool = False
    detail: str = ""


@dataclass(frozen=True)
class LocatedEvent:
    """A zero of an event at an arclength s after a row of a walk."""

    event: Event
    y: Array
    t: Array
    row: int
    s: float


def check_events(events: Any) -> list[Event]:
    """The events of a user as functions of many `Points`, as the events of the package are.

    Raises:
        InputError: if this is no list of events. Later, the functions raise it if a user's function raises or returns
            no finite number.
    """
    faults = list_faults("events", events, "[tmsopt.Event('Fr is 3', lambda p: p['Fr'] - 3)]")
    for k, event in enumerate(() if faults else events):
        if not isinstance(event, Event) or not callable(event.function):
            faults.append(
                Fault(f"found {short(event)}; accepted: an Event of a name and a function", ("events", f"{k}"))
            )
        elif wrong := text_faults(event.name, "events", f"{k}", "name"):
            faults += wrong
        elif re.fullmatch(_PACKAGE_NAMES, event.name):
            message = f"found '{event.name}', the name of a built-in event; accepted: another name"
            faults.append(Fault(message, ("events", f"{k}", "name")))
    if faults:
        raise InputError(faults)
    return [replace(event, function=partial(_evaluate_points, event)) for event in events]


def _evaluate_points(event: Event, points: Points) -> Array:
    """The user's function at every point; nan where the point does not exist."""
    is_finite = np.all(np.isfinite(points.x), axis=1)
    return np.array(
        [_evaluate_at(event, _PointView(points, k)) if exists else np.nan for k, exists in enumerate(is_finite)]
    )


def _evaluate_at(event: Event, point: Mapping[str, float]) -> float:
    try:
        value = event.function(point)
        if is_number(value):
            return float(value)
        problem_text = f"the function returns {short(value)}"
    except Exception as error:
        problem_text = f"the function raises {type(error).__name__}: {error}"
    place = ", ".join(f"{name} = {point[name]:.6g}" for name in point)
    raise input_error(
        f"{problem_text} at {place}; accepted: a finite number at every point of the curve", "events", event.name
    )


@dataclass(frozen=True)
class _PointView(Mapping[str, float]):
    """One point as the argument of a user's function; iteration lists the free parameters."""

    points: Points
    row: int

    def __getitem__(self, name: str) -> float:
        if name not in self.points.names:
            raise KeyError(f"no '{name}' here; {suggest(name, self.points.names)}")
        return float(self.points[name][self.row])

    def __iter__(self) -> Iterator[str]:
        return iter(self.points.traced.problem.free)

    def __len__(self) -> int:
        return len(self.points.traced.problem.free)


def list_package_events(points: Points) -> Iterator[Event]:
    """All events that the package locates along a curve."""
    problem, pattern = points.traced.problem, points.traced.pattern

    def margin(number: int, k: int, points: Points) -> Any:
        return axis_functions(pattern.remaining_factors(points.unknowns)[number])[k]

    for name in pattern.marks:
        yield Event(name, partial(Points.mark, name=name))
    if pattern.form == "EP2" and "2EP2" in points.special:
        yield Event("EP4", lambda p: p.unknowns[0] - nearest_pair_mean(pattern.factors(p.unknowns)[-1]))
    for number, factor in enumerate(pattern.remaining_factors(points.unknowns)):
        for k in range(len(axis_functions(factor))):  # the first function is the constant term
            yield Event("weave" if k else "capsize", partial(margin, number, k), detail=CHANGES)
    for k, parameter in enumerate(problem.free):
        # per arclength of the parameters, since the unknowns may move much faster
        yield Event("fold", partial(lambda k, p: p.t[:, k] / (p.speed + 1e-300), k), detail=parameter)
    for name, condition in problem.conditions.items():
        if not condition.equality:
            yield Event("constraint", partial(lambda c, p: c(p.values), condition), detail=name)


def locate_events(traced: TracedProblem, walk: Walk, events: Sequence[Event] = ()) -> Iterator[LocatedEvent]:
    """Every zero of an event between two rows at which its function has different signs."""
    points, free = Points(traced, walk.y, walk.t), list(traced.problem.free)
    for event, values in _list_active(points, events):
        for located in locate_zeros(traced.curve, walk, partial(Points, traced), event, values):
            y, row = located.y, located.row
            changes = event.name not in ("weave", "capsize") or points.stable[row] != points.stable[row + 1]
            if changes and (event.name != "fold" or _is_fold(walk, row, y, free.index(event.detail))):
                yield located


def locate_zeros(
    curve: Curve, walk: Walk, make_points: Callable[[Array, Array], Any], event: Event, values: Array
) -> Iterator[LocatedEvent]:
    """Zeros of an event between rows with a change of sign; `make_points` makes the argument of its function."""
    rows = np.flatnonzero(has_sign_change(values))
    points, tangents = walk.y[rows], walk.t[rows]
    ends = np.sum(tangents * (walk.y[rows + 1] - points), axis=1)
    if rows.size:
        s = find_zeros(lambda s: event.function(make_points(*step_along(curve, points, tangents, s))), ends)
        real = np.isfinite(s)  # otherwise the sign changes at a pole, by noise, or at nan
        zeros = zip(
            *step_along(curve, points[real], tangents[real], s[real]),
            rows[real].tolist(),
            s[real].tolist(),
            strict=True,
        )
        for y, t, row, length in zeros:
            if (
                np.abs(y - walk.y[row]).max() <= _MAX_DEVIATION * length + SAME_PLACE
            ):  # otherwise it is on another curve
                yield LocatedEvent(event, y, t, row, length)


def has_sign_change(value: Array) -> Truth:
    """Where a sequence changes sign from an entry to the next. A 0 takes the sign before it, or the sign after it."""
    sign = np.sign(value)
    if (nonzero := np.flatnonzero(sign)).size:
        sign = sign[nonzero[np.maximum(np.searchsorted(nonzero, range(len(sign)), side="right") - 1, 0)]]
    return sign[1:] * sign[:-1] < 0


def refine_walk(traced: TracedProblem, walk: Walk, events: Sequence[Event] = ()) -> Walk:
    """The walk with added points where an event is nearest to 0 between two steps.

    Without these points, two zeros between two steps would show no change of sign.
    """
    steps = np.sum(walk.t[:-1] * np.diff(walk.y, axis=0), axis=1)
    step_before, step_after = steps[:-1], steps[1:]
    minima: dict[tuple[int, float], LocatedEvent] = {}
    for event, value in _list_active(Points(traced, walk.y, walk.t), events):
        side = np.sign(value[1:-1])
        value_before, value_here, value_after = side * value[:-2], side * value[1:-1], side * value[2:]
        with np.errstate(all="ignore"):  # slope and second derivative of the parabola through three values
            slope_before = (value_here - value_before) / step_before
            slope_after = (value_after - value_here) / step_after
            slope = (slope_before * step_after + slope_after * step_before) / (step_before + step_after)
            bend = 2 * (slope_after - slope_before) / (step_before + step_after)
            dips = (
                (value_here <= value_before)
                & (value_here <= value_after)
                & (bend > 0)
                & (slope**2 / (2 * bend) > _MIN_DIP * value_here)
            )
        for k in np.flatnonzero(dips & (step_before > 0) & (step_after > 0) & (value_here > 0)).tolist():
            row = walk.y[[k + 1]], walk.t[[k + 1]]

            def height(s: float, event: Event = event, row: tuple[Array, Array] = row, sign: float = side[k]) -> float:
                return sign * float(event.function(Points(traced, *step_along(traced.curve, *row, np.array([s]))))[0])

            from scipy.optimize import minimize_scalar  # importing it takes 0.2 s

            minimum = minimize_scalar(
                height, bounds=(-step_before[k], step_after[k]), method="bounded", options={"xatol": 1e-14}
            )
            s, nearby = float(minimum.x), step_along(traced.curve, *row, np.array([minimum.x]))
            # correct the point again, since Newton's method converges slowly near singular points
            (y,), (t,) = step_along(traced.curve, *nearby, np.zeros(1))
            if np.abs(y - row[0][0]).max() <= _MAX_DEVIATION * abs(s) and t @ row[1][0] > 0:
                place = (k + 1, s) if s >= 0 else (k, step_before[k] + s)
                minima.setdefault(place, LocatedEvent(event, y, t, *place))
    return insert_events(walk, [minima[place] for place in sorted(minima)])[1]


def insert_events(walk: Walk, located: Sequence[LocatedEvent]) -> tuple[list[int], Walk]:
    """The rows of the events, in order, and the walk with them among its points."""
    order = np.argsort([*range(len(walk.y)), *(f.row + 0.5 for f in located)], kind="stable")
    y, t = np.array([*walk.y, *(f.y for f in located)]), np.array([*walk.t, *(f.t for f in located)])
    return np.flatnonzero(order >= len(walk.y)).tolist(), replace(walk, y=y[order], t=t[order])


def _list_active(points: Points, events: Iterable[Event]) -> Iterator[tuple[Event, Array]]:
    """The events whose functions are not 0 all along the curve, with their values."""
    special_names = points.special
    for event in (*list_package_events(points), *events):
        value = points.column(event.function(points))
        if event.name not in special_names and (event.name != "fold" or np.abs(value).max() > NOTHING):
            yield event, value


def _is_fold(walk: Walk, i: int, y: Array, k: int) -> bool:
    """Whether the next points, or the points after them, are on the same side of y by more than rounding errors.

    Where the equations are singular, the tangent alone is not reliable.
    """
    rows = np.clip([[i, i - 1], [i + 1, i + 2]], 0, len(walk.y) - 1)
    offset_before, offset_after = walk.y[rows, k] - y[k]
    return bool(
        np.any(
            (offset_before * offset_after > 0)
            & (np.minimum(abs(offset_before), abs(offset_after)) > _ROUNDING * (1 + abs(y[k])))
        )
    )
