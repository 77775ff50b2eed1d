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
from tmsopt.tracing.chain_curve import ChainSetup, name_target
from tmsopt.tracing.continuation import Curve, Walk, step_along
from tmsopt.tracing.equations import Setup
from tmsopt.tracing.points import ZERO_TOLERANCE, Points, axis_functions
from tmsopt.tracing.solving import find_zeros

SAME_PLACE = 1e-6
"""Distance, in units of the scale, up to which events are at one place; each is located to 1e-12 or better."""

STABILITY_CHANGES = "stability changes"
"""Detail of weave and capsize events, which are listed only where stability changes."""

_PACKAGE_NAMES = r"weave|capsize|fold|constraint|end|resonance|crossing|(double|\d+-fold) zero|\d*C?EP\d\S*"
"""Names of the events of the package."""

_MIN_DIP = 0.5
"""A minimum between two steps is searched if a parabola predicts a fall by at least this share of the value."""
_MAX_DEVIATION = 2.0  # largest distance of a zero from its row, in arclengths; a zero farther away is on another curve
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
    """A zero of an event: the point y and its tangent t, at an arclength s after a row of a walk."""

    event: Event
    y: Array
    t: Array
    row: int
    s: float


def check_events(events: Any) -> list[Event]:
    """Convert the functions of a user's events to functions of many `Points`, as in the events of the package.

    Raises:
        InputError: if `events` is not a list of events. The converted functions raise it if a user's function raises
            an exception or returns something other than a finite number.
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
        cause = f"the function returns {short(value)}"
    except Exception as error:
        cause = f"the function raises {type(error).__name__}: {error}"
    point_text = ", ".join(f"{name} = {point[name]:.6g}" for name in point)
    raise input_error(
        f"{cause} at {point_text}; accepted: a finite number at every point of the curve", "events", event.name
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
        return iter(self.points.setup.problem.free)

    def __len__(self) -> int:
        return len(self.points.setup.problem.free)


def list_package_events(points: Points) -> Iterator[Event]:
    """All events that the package locates along a curve."""
    problem, pattern = points.setup.problem, points.setup.pattern

    def evaluate_axis_function(factor_index: int, k: int, points: Points) -> Any:
        return axis_functions(pattern.remaining_factors(points.unknowns)[factor_index])[k]

    for name in pattern.marks:
        yield Event(name, partial(Points.mark, name=name))
    if pattern.form == "EP2" and "2EP2" in points.special_cases:
        yield Event("EP4", lambda p: p.unknowns[0] - nearest_pair_mean(pattern.factors(p.unknowns)[-1]))
    for factor_index, factor in enumerate(pattern.remaining_factors(points.unknowns)):
        for k in range(len(axis_functions(factor))):  # the first function is the constant term
            yield Event(
                "weave" if k else "capsize", partial(evaluate_axis_function, factor_index, k), detail=STABILITY_CHANGES
            )
    if isinstance(points.setup, ChainSetup):
        for k, target in enumerate(points.setup.targets):
            if target.axis == "real" or (target.axis == "complex" and target.order == 2):
                name = name_target(replace(target, axis="zero" if target.axis == "real" else "imaginary"))
                yield Event(name, partial(lambda k, p: p.setup.multiple_roots(p.y)[:, k].real / p.setup.unit, k))
        for name in ("weave", "capsize") if not problem.model.is_complex else ("weave",):
            yield Event(name, partial(_rightmost, name), detail=STABILITY_CHANGES)
    for k, parameter in enumerate(problem.free):
        # derivative by the arclength of the parameters, since the unknowns may move much faster
        yield Event("fold", partial(lambda k, p: p.t[:, k] / (p.speed + 1e-300), k), detail=parameter)
    for name, condition in problem.conditions.items():
        if not condition.equality:
            yield Event("constraint", partial(lambda c, p: c(p.values), condition), detail=name)


def _rightmost(name: str, points: Points) -> Array:
    """Real part of the rightmost root; nan where the root is real and its passage is no weave, or the reverse."""
    z = np.where(np.isnan(points.other_roots), -np.inf, points.other_roots)
    root = z[range(len(z)), np.argmax(z.real, axis=1)]
    is_weave = (root.imag != 0) | points.setup.problem.model.is_complex
    return np.where(is_weave == (name == "weave"), root.real, np.nan)


def locate_events(setup: Setup, walk: Walk, events: Sequence[Event] = ()) -> Iterator[LocatedEvent]:
    """Every zero of an event between two rows at which its function has different signs."""
    points, free_names = Points(setup, walk.y, walk.t), list(setup.problem.free)
    for event, values in _list_active(points, events):
        for located_event in locate_zeros(setup.curve, walk, partial(Points, setup), event, values):
            y, row = located_event.y, located_event.row
            has_change = event.name not in ("weave", "capsize") or points.stable[row] != points.stable[row + 1]
            if has_change and (event.name != "fold" or _is_fold(walk, row, y, free_names.index(event.detail))):
                yield located_event


def locate_zeros(
    curve: Curve, walk: Walk, make_points: Callable[[Array, Array], Any], event: Event, values: Array
) -> Iterator[LocatedEvent]:
    """Zeros of an event between rows with a change of sign; `make_points` makes the argument of its function."""
    rows = np.flatnonzero(has_sign_change(values))
    points, tangents = walk.y[rows], walk.t[rows]
    ends = np.sum(tangents * (walk.y[rows + 1] - points), axis=1)
    if rows.size:
        s = find_zeros(lambda s: event.function(make_points(*step_along(curve, points, tangents, s))), ends)
        is_zero = np.isfinite(s)  # otherwise the sign changes at a pole, by noise, or at nan
        zeros = zip(
            *step_along(curve, points[is_zero], tangents[is_zero], s[is_zero]),
            rows[is_zero].tolist(),
            s[is_zero].tolist(),
            strict=True,
        )
        for y, t, row, length in zeros:
            # a zero farther away is on another curve
            if np.abs(y - walk.y[row]).max() <= _MAX_DEVIATION * length + SAME_PLACE:
                yield LocatedEvent(event, y, t, row, length)


def has_sign_change(value: Array) -> Truth:
    """Whether a sequence changes sign from each entry to the next.

    A 0 has the sign of the last entry before it that is not 0. Without such an entry, it has the sign after it.
    """
    sign = np.sign(value)
    if (nonzero := np.flatnonzero(sign)).size:
        sign = sign[nonzero[np.maximum(np.searchsorted(nonzero, range(len(sign)), side="right") - 1, 0)]]
    return sign[1:] * sign[:-1] < 0


def refine_walk(setup: Setup, walk: Walk, events: Sequence[Event] = ()) -> Walk:
    """The walk with additional points where the function of an event is nearest to 0 between two steps.

    Without these points, two zeros between two steps would show no change of sign.
    """
    steps = np.sum(walk.t[:-1] * np.diff(walk.y, axis=0), axis=1)
    step_before, step_after = steps[:-1], steps[1:]
    minima: dict[tuple[int, float], LocatedEvent] = {}
    for event, value in _list_active(Points(setup, walk.y, walk.t), events):
        sign = np.sign(value[1:-1])
        value_before, value_here, value_after = sign * value[:-2], sign * value[1:-1], sign * value[2:]
        with np.errstate(all="ignore"):  # slope and second derivative of the parabola through three values
            slope_before = (value_here - value_before) / step_before
            slope_after = (value_after - value_here) / step_after
            slope = (slope_before * step_after + slope_after * step_before) / (step_before + step_after)
            second_derivative = 2 * (slope_after - slope_before) / (step_before + step_after)
            is_dip = (
                (value_here <= value_before)
                & (value_here <= value_after)
                & (second_derivative > 0)
                & (slope**2 / (2 * second_derivative) > _MIN_DIP * value_here)
            )
        for k in np.flatnonzero(is_dip & (step_before > 0) & (step_after > 0) & (value_here > 0)).tolist():
            point = walk.y[[k + 1]], walk.t[[k + 1]]

            def height(
                s: float, event: Event = event, point: tuple[Array, Array] = point, sign_here: float = sign[k]
            ) -> float:
                points = Points(setup, *step_along(setup.curve, *point, np.array([s])))
                return sign_here * float(event.function(points)[0])

            from scipy.optimize import minimize_scalar  # importing it takes 0.2 s

            minimum = minimize_scalar(
                height, bounds=(-step_before[k], step_after[k]), method="bounded", options={"xatol": 1e-14}
            )
            s, minimum_point = float(minimum.x), step_along(setup.curve, *point, np.array([minimum.x]))
            # correct the point again, since Newton's method converges slowly near singular points
            (y,), (t,) = step_along(setup.curve, *minimum_point, np.zeros(1))
            if np.abs(y - walk.y[k + 1]).max() <= _MAX_DEVIATION * abs(s) and t @ walk.t[k + 1] > 0:
                row_and_s = (k + 1, s) if s >= 0 else (k, step_before[k] + s)
                minima.setdefault(row_and_s, LocatedEvent(event, y, t, *row_and_s))
    _, refined_walk = insert_events(walk, [minima[key] for key in sorted(minima)])
    return refined_walk


def insert_events(walk: Walk, located_events: Sequence[LocatedEvent]) -> tuple[list[int], Walk]:
    """Return the rows of the events, in ascending order, and the walk with the events among its points."""
    order = np.argsort([*range(len(walk.y)), *(f.row + 0.5 for f in located_events)], kind="stable")
    y, t = np.array([*walk.y, *(f.y for f in located_events)]), np.array([*walk.t, *(f.t for f in located_events)])
    return np.flatnonzero(order >= len(walk.y)).tolist(), replace(walk, y=y[order], t=t[order])


def _list_active(points: Points, events: Iterable[Event]) -> Iterator[tuple[Event, Array]]:
    """The events whose functions are not 0 along the whole curve, with their values at the points."""
    special_cases = points.special_cases
    for event in (*list_package_events(points), *events):
        value = points.column(event.function(points))
        may_vanish = event.name in ("fold", "resonance")
        if event.name not in special_cases and (not may_vanish or np.abs(value).max() > ZERO_TOLERANCE):
            yield event, value


def _is_fold(walk: Walk, row: int, y: Array, variable: int) -> bool:
    """Whether a variable turns back at a point y between a row and the next.

    It turns back if its values before and after y lie on the same side of its value at y, by more than rounding errors.
    The tangent alone does not show this reliably where the equations are singular.
    """
    rows = np.clip([[row, row - 1], [row + 1, row + 2]], 0, len(walk.y) - 1)
    offset_before, offset_after = walk.y[rows, variable] - y[variable]
    return bool(
        np.any(
            (offset_before * offset_after > 0)
            & (np.minimum(abs(offset_before), abs(offset_after)) > _ROUNDING * (1 + abs(y[variable])))
        )
    )
