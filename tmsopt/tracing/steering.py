"""Follows one curve point by point, by an iterator that a user can stop and reverse."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from tmsopt.errors import input_error
from tmsopt.problem import Solution
from tmsopt.problem.files import ProblemSource, pose
from tmsopt.tracing.branch import BranchPoint, table_at
from tmsopt.tracing.continuation import CLOSED, CurvePoint, End, Walk, compute_tangent, follow
from tmsopt.tracing.description import describe_end, find_events, make_branch
from tmsopt.tracing.equations import Setup, prepare_tracing
from tmsopt.tracing.events import SAME_PLACE, Event, check_events
from tmsopt.tracing.seeds import find_seeds
from tmsopt.tracing.trace import STARTS, STEP, check_options, locate_pattern


def continue_from(
    problem: ProblemSource,
    pattern: str | None = None,
    *,
    through: Mapping[str, float] | None = None,
    step: float = STEP,
    events: Sequence[Event] = (),
) -> "Continuation":
    """Follow one curve of a pattern point by point, from a point near a design.

    Args:
        problem: as for `trace`. For a solution, the curve begins at its parameters.
        pattern: name of the pattern; by default the pattern that the problem locates.
        through: a design near which the curve begins, with a value for every free parameter. The default is the
            parameters of a solution, or the first design from which the search of `trace` finds a point.
        step: longest step, in widths of the box.
        events: events to locate in addition to the built-in ones.

    Raises:
        InputError: as for `trace`, and if no point of the pattern is found.

    Example:
        >>> fast = tmsopt.Event("Fr is 3", lambda p: p["Fr"] - 3)
        >>> curve = tmsopt.continue_from("problems/ep_set.toml", events=[fast])
        >>> reached = next(point for point in curve if "Fr is 3" in point.events)
        >>> f"{reached.parameters['Fr']:.9f}"
        '3.000000000'

    More: docs/how_to/tracing.md
    """
    if through is None and isinstance(problem, Solution):
        through = {name: problem.parameters[name] for name in problem.problem.free}
    problem_with_pattern, checked_events = locate_pattern(pose(problem), pattern), check_events(events)
    designs = [] if through is None else [through]
    check_options(problem_with_pattern, step, through=designs)
    setup = prepare_tracing(problem_with_pattern)
    for _, points in find_seeds(setup, 0 if designs else STARTS, 0, designs, []):
        for y in points:
            try:
                return Continuation(setup, CurvePoint(y, compute_tangent(setup.curve, y)), step, checked_events)
            except ValueError:  # not a regular point of a curve
                continue
    place = "near the design" if designs else "in the box"
    raise input_error(
        f"no point of {problem_with_pattern.locate} found {place}; give another point to begin at", "through"
    )


class Continuation(Iterator[BranchPoint]):
    """Iterator over the points of one curve, which include its events; `continue_from` makes it.

    The iterator ends where the curve leaves the box, closes or has no direction, and at an event that stops the curve.

    Attributes:
        end: why there are no more points, in words; empty as long as there are more points.

    Example:
        >>> curve = tmsopt.continue_from("problems/ep_set.toml", step=0.02)
        >>> ahead = [point.parameters["lambda_s"] for point in curve]
        >>> curve.end
        'Fr.max'
        >>> curve.reverse()
        >>> back = [point.parameters["lambda_s"] for point in curve]
        >>> curve.end, ahead[0] in (min(back), max(back)), len(back) > len(ahead)
        ('Fr.max', False, True)

    More: docs/how_to/tracing.md
    """

    end: str

    def __init__(self, setup: Setup, start: CurvePoint, step: float, events: Sequence[Event]) -> None:
        self._setup, self._step, self._events = setup, step, events
        self._sign, self._arclength, self._last_point, self.end = 1, 0.0, start, ""
        self._points = self._follow(start, yields_start=True)

    def __next__(self) -> BranchPoint:
        return next(self._points)

    def reverse(self) -> None:
        """Turn around at the last point; the next point lies behind it."""
        self._sign, self.end = -self._sign, ""
        self._points = self._follow(CurvePoint(self._last_point.y, -self._last_point.t), yields_start=False)

    def _follow(self, start: CurvePoint, yields_start: bool) -> Iterator[BranchPoint]:
        """Yield the points after a start, also the start itself if `yields_start`; then set `end`."""
        previous_points = [start]
        for point in follow(self._setup.curve, start, self._step):
            if isinstance(point, End):
                self.end = describe_end(self._setup, point) or CLOSED
                return
            y, t = (np.array([getattr(p, name) for p in (*previous_points, point)]) for name in "yt")
            walk, row_events = find_events(self._setup, Walk(y, t, (End(""), End(""))), self._events)
            branch, arclength = make_branch(self._setup, walk, row_events), self._arclength
            first_row = int(np.flatnonzero(np.all(walk.y == previous_points[-1].y, axis=1))[-1])
            for row in range(first_row + (not yields_start), len(walk.y)):
                events = [event for event_row, event in row_events if event_row == row]
                # the user turned around at this event
                is_repeated = len(previous_points) == 1 and np.abs(walk.y[row] - start.y).max() <= SAME_PLACE
                if (events and not is_repeated) or row == len(walk.y) - 1 or (yields_start and row == first_row):
                    self._last_point = CurvePoint(walk.y[row], walk.t[row])
                    self._arclength = arclength + self._sign * float(
                        branch.arclength[row] - branch.arclength[first_row]
                    )
                    yield BranchPoint(
                        table_at(branch.parameters, row),
                        table_at(branch.unknowns, row),
                        table_at(branch.tangent, row),
                        self._arclength,
                        str(branch.kinds[row]),
                        bool(branch.stable[row]),
                        float(branch.abscissa[row]),
                        tuple(event.name for event in events),
                    )
                    if stop := [event.name for event in events if event.stop]:
                        self.end = stop[0]
                        return
            previous_points, yields_start = [previous_points[-1], point], False
