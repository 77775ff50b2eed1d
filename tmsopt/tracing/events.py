"""Events: functions of the points of a curve, whose zeros are located on the curve itself, to rounding.

What the package looks for and what a user looks for are `Event`s alike. Between two steps a function may have two
zeros: where it comes near 0, `refine` adds the point at which it is nearest.
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
from tmsopt.tracing.continuation import Curve, Walk, between
from tmsopt.tracing.equations import Traced
from tmsopt.tracing.points import NOTHING, Points, margins
from tmsopt.tracing.solving import crossings

TOGETHER = 1e-6
"""Distance, in units of the scale, within which events are one: each is located to 1e-12 or better."""

CHANGES = "stability changes"
"""Detail of the events that count only where they change it."""

_OWN = r"weave|capsize|fold|constraint|end|(double|\d+-fold) zero|\d*C?EP\d\S*"  # names of events of the package
_DIP = 0.5
"""Share of a small value that a parabola must fall further by, for its least to be looked for between the steps."""
_ASTRAY = 2.0  # arclengths: a point further off lies on another curve, as beside a singular point it may
_ROUNDING = 1e-14  # of a variable of order 1


@dataclass(frozen=True)
class Event:
    """What to look for along a curve: a function that changes its sign there.

    Attributes:
        name: shown wherever the curve is, on one line.
        function: of a point, to a number. The point is a mapping: ``p["Fr"]`` is a parameter of the problem, a
            quantity of its model such as ``p["abscissa"]``, or an unknown of the pattern such as ``p["r"]``.
        stop: whether a branch ends there. The curve beyond is another branch.
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
class Found:
    """A zero of an event between two rows of a walk, an arclength s after the first of them."""

    event: Event
    y: Array
    t: Array
    after: int
    s: float


def check_events(events: Any) -> list[Event]:
    """The events that a user gave, as functions of many `Points`, like those of the package.

    Raises:
        InputError: for what is no list of events, and later, where a function raises or gives no finite number.
    """
    faults = list_faults("events", events, "[tmsopt.Event('Fr is 3', lambda p: p['Fr'] - 3)]")
    for k, event in enumerate(() if faults else events):
        if not isinstance(event, Event) or not callable(event.function):
            faults.append(
                Fault(f"found {short(event)}; accepted: an Event of a name and a function", ("events", f"{k}"))
            )
        elif wrong := text_faults(event.name, "events", f"{k}", "name"):
            faults += wrong
        elif re.fullmatch(_OWN, event.name):
            message = f"found '{event.name}', which tmsopt calls an event of its own; accepted: another name"
            faults.append(Fault(message, ("events", f"{k}", "name")))
    if faults:
        raise InputError(faults)
    return [replace(event, function=partial(_each, event)) for event in events]


def _each(event: Event, points: Points) -> Array:
    """The function at every point; nan where there is no point."""
    exist = np.all(np.isfinite(points.x), axis=1)
    return np.array([_value(event, _At(points, k)) if there else np.nan for k, there in enumerate(exist)])


def _value(event: Event, at: Mapping[str, float]) -> float:
    try:
        value = event.function(at)
        if is_number(value):
            return float(value)
        what = f"the function gives {short(value)}"
    except Exception as error:
        what = f"the function raises {type(error).__name__}: {error}"
    place = ", ".join(f"{name} = {at[name]:.6g}" for name in at)
    raise input_error(f"{what} at {place}; accepted: a finite number at every point of the curve", "events", event.name)


@dataclass(frozen=True)
class _At(Mapping[str, float]):
    """One of many points, as a user's function sees it; it lists the free parameters and knows all names."""

    points: Points
    row: int

    def __getitem__(self, name: str) -> float:
        if name not in self.points.names:
            raise KeyError(f"no '{name}' here; {suggest(name, self.points.names)}")
        return float(self.points[name][self.row])

    def __iter__(self) -> Iterator[str]:
        return iter(self.points.ready.problem.free)

    def __len__(self) -> int:
        return len(self.points.ready.problem.free)


def events_of(points: Points) -> Iterator[Event]:
    """Everything that the package looks for along a curve."""
    problem, pattern = points.ready.problem, points.ready.pattern

    def margin(number: int, k: int, points: Points) -> Any:
        return margins(pattern.remaining_factors(points.unknowns)[number])[k]

    for name in pattern.marks:
        yield Event(name, partial(Points.mark, name=name))
    if pattern.form == "EP2" and "2EP2" in points.special:
        # q(r) has a double zero where r is the double root of q
        yield Event("EP4", lambda p: p.unknowns[0] - nearest_pair_mean(pattern.factors(p.unknowns)[-1]))
    for number, factor in enumerate(pattern.remaining_factors(points.unknowns)):
        for k in range(len(margins(factor))):  # the first quantity is the constant term
            yield Event("weave" if k else "capsize", partial(margin, number, k), detail=CHANGES)
    for k, parameter in enumerate(problem.free):
        # by the arclength in the parameters: the unknowns may move much faster
        yield Event("fold", partial(lambda k, p: p.t[:, k] / (p.speed + 1e-300), k), detail=parameter)
    for name, condition in problem.conditions.items():
        if not condition.equality:
            yield Event("constraint", partial(lambda c, p: c(p.values), condition), detail=name)


def locate(ready: Traced, walked: Walk, events: Sequence[Event] = ()) -> Iterator[Found]:
    """Every zero of an event of the package, and of others, between the rows that show its change of sign."""
    points, free = Points(ready, walked.y, walked.t), list(ready.problem.free)
    for event, values in _live(points, events):
        for found in locate_zeros(ready.on, walked, partial(Points, ready), event, values):
            y, row = found.y, found.after
            changes = event.name not in ("weave", "capsize") or points.stable[row] != points.stable[row + 1]
            if changes and (event.name != "fold" or _turns(walked, row, y, free.index(event.detail))):
                yield found


def locate_zeros(
    on: Curve, walked: Walk, at: Callable[[Array, Array], Any], event: Event, values: Array
) -> Iterator[Found]:
    """Zeros of an event between rows where its values change sign; its function takes what `at` makes of y and t."""
    rows = np.flatnonzero(has_turned(values))
    here, along = walked.y[rows], walked.t[rows]
    ends = np.sum(along * (walked.y[rows + 1] - here), axis=1)
    if rows.size:
        s = crossings(lambda s: event.function(at(*between(on, here, along, s))), ends)
        real = np.isfinite(s)  # else a jump through infinity, noise, or nan
        found = zip(*between(on, here[real], along[real], s[real]), rows[real].tolist(), s[real].tolist(), strict=True)
        for y, t, row, length in found:
            if np.abs(y - walked.y[row]).max() <= _ASTRAY * length + TOGETHER:  # else on another curve
                yield Found(event, y, t, row, length)


def has_turned(value: Array) -> Truth:
    """Where a sequence changes sign from one entry to the next; a 0 has the sign before it, or that after the first."""
    sign = np.sign(value)
    if (known := np.flatnonzero(sign)).size:
        sign = sign[known[np.maximum(np.searchsorted(known, range(len(sign)), side="right") - 1, 0)]]
    return np.asarray(sign[1:] * sign[:-1] < 0)


def refine(ready: Traced, walked: Walk, events: Sequence[Event] = ()) -> Walk:
    """The walk with a point wherever an event comes nearest to 0 between two steps: two zeros then show two signs."""
    steps = np.sum(walked.t[:-1] * np.diff(walked.y, axis=0), axis=1)
    before, after = steps[:-1], steps[1:]
    added: dict[tuple[int, float], Found] = {}
    for event, value in _live(Points(ready, walked.y, walked.t), events):
        side = np.sign(value[1:-1])
        left, here, right = side * value[:-2], side * value[1:-1], side * value[2:]
        with np.errstate(all="ignore"):  # slope and second derivative of the parabola through three values
            back, ahead = (here - left) / before, (right - here) / after
            slope, bend = (back * after + ahead * before) / (before + after), 2 * (ahead - back) / (before + after)
            dips = (here <= left) & (here <= right) & (bend > 0) & (slope**2 / (2 * bend) > _DIP * here)
        for k in np.flatnonzero(dips & (before > 0) & (after > 0) & (here > 0)).tolist():
            row = walked.y[[k + 1]], walked.t[[k + 1]]

            def height(s: float, event: Event = event, row: tuple[Array, Array] = row, sign: float = side[k]) -> float:
                return sign * float(event.function(Points(ready, *between(ready.on, *row, np.array([s]))))[0])

            from scipy.optimize import minimize_scalar  # a fifth of a second, paid only where it is needed

            least = minimize_scalar(height, bounds=(-before[k], after[k]), method="bounded", options={"xatol": 1e-14})
            s, nearby = float(least.x), between(ready.on, *row, np.array([least.x]))
            (y,), (t,) = between(ready.on, *nearby, np.zeros(1))  # once more: beside a singular point Newton is slow
            if np.abs(y - row[0][0]).max() <= _ASTRAY * abs(s) and t @ row[1][0] > 0:
                place = (k + 1, s) if s >= 0 else (k, before[k] + s)
                added.setdefault(place, Found(event, y, t, *place))
    return insert(walked, [added[place] for place in sorted(added)])[1]


def insert(walked: Walk, found: Sequence[Found]) -> tuple[list[int], Walk]:
    """Rows of what was found, in order, and the walk with it among its points."""
    order = np.argsort([*range(len(walked.y)), *(f.after + 0.5 for f in found)], kind="stable")
    y, t = np.array([*walked.y, *(f.y for f in found)]), np.array([*walked.t, *(f.t for f in found)])
    return np.flatnonzero(order >= len(walked.y)).tolist(), replace(walked, y=y[order], t=t[order])


def _live(points: Points, events: Iterable[Event]) -> Iterator[tuple[Event, Array]]:
    """The events whose functions are not 0 all along the curve, with their values."""
    special = points.special
    for event in (*events_of(points), *events):
        value = points.column(event.function(points))
        if event.name not in special and (event.name != "fold" or np.abs(value).max() > NOTHING):
            yield event, value


def _turns(walked: Walk, i: int, y: Array, k: int) -> bool:
    """Whether a variable has its neighbours, next or next but one, on one side of it by more than rounding.

    Where the equations are singular the tangent alone may say so.
    """
    rows = np.clip([[i, i - 1], [i + 1, i + 2]], 0, len(walked.y) - 1)
    back, ahead = walked.y[rows, k] - y[k]
    return bool(np.any((back * ahead > 0) & (np.minimum(abs(back), abs(ahead)) > _ROUNDING * (1 + abs(y[k])))))
