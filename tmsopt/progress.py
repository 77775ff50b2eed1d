"""Progress of long work: every function sends the same kind of record to a listener, at most 20 times a second."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

from tmsopt.errors import InputError, callback_faults

PAUSE = 0.05
"""Shortest time in s between two records of one task; its first and last record are always sent."""

# The remaining time is estimated only after some seconds, and after some steps or some share of all steps. Before that,
# modules and processes start, and the times of single steps differ widely.

_MIN_SECONDS = 2.0  # least time since the first report
_MIN_STEPS = 8  # least number of steps since the first report
_MIN_SHARE = 0.05  # or least share of all steps
_PAUSE_PER_CALL = 9.0  # pause after a call of the listener, in durations of the call; so calls take 10 % of the time


@dataclass(frozen=True)
class Progress:
    """Progress of one task.

    Attributes:
        what: name of the task, such as ``searching``.
        done: amount done, which never decreases; nan if the task counts nothing.
        most: upper bound of `done`; nan if unknown.
        unit: unit of `done` and `most`: ``start``, ``row``, ``design`` …, or ``s`` for a task with a time limit; empty
            if the task counts nothing.
        seconds: time since the task began.
        left: upper estimate of the remaining time in s; nan while unknown, as after a few steps.
        note: quality of the result so far, such as ``gap 0.001``; often empty.

    Example:
        >>> from itertools import pairwise
        >>> records = []
        >>> design = tmsopt.solve("problems/ep4.toml", progress=records.append)
        >>> all(now.done <= then.done for now, then in pairwise(records) if now.what == then.what == "searching")
        True

    More: docs/reference/python.md
    """

    what: str
    done: float = math.nan
    most: float = math.nan
    unit: str = ""
    seconds: float = 0.0
    left: float = math.nan
    note: str = ""


Listener = Callable[[Progress], None]
"""A callback. An exception raised in it stops the work; KeyboardInterrupt acts like Ctrl-C."""

ReportCount = Callable[..., None]
"""A function that the work calls with the amount done, its upper bound, and optionally a note."""


class Steps:
    """Turns counts of successive tasks into records for a listener. It can be called as a `ReportCount`."""

    def __init__(self, listener: Listener) -> None:
        self._listener = listener
        self._earlier_amounts: dict[str, float] = {}  # amount done of each task before it was left or restarted
        self._what, self._done = "", 0.0

    def begin(self, what: str, unit: str = "") -> None:
        """Begin a task, or continue it if it is the current one."""
        if what != self._what:
            self._earlier_amounts[self._what] = self._done
            self._what, self._unit = what, unit
            self._start_time, self._next_report_time = time.perf_counter(), 0.0
            self._first_report: tuple[float, float] | None = None
            self._done, self._last_count = self._earlier_amounts.setdefault(what, 0.0), 0.0
            self._send(self._done if unit else math.nan, math.nan)

    def __call__(self, done: float, most: float, note: str = "") -> None:
        """Report the amount done. If it has decreased, the task was restarted, and the earlier amount is added."""
        if done < self._last_count:
            self._earlier_amounts[self._what] = self._done
        self._last_count, earlier_amount = done, self._earlier_amounts[self._what]
        self._done = earlier_amount + done
        now = time.perf_counter()
        self._first_report = self._first_report or (self._done, now)
        if done >= most or now >= self._next_report_time:
            self._send(self._done, earlier_amount + most, note)
            end = time.perf_counter()
            self._next_report_time = end + max(PAUSE, _PAUSE_PER_CALL * (end - now)) if PAUSE else 0.0

    def _send(self, done: float, most: float, note: str = "") -> None:
        now, remaining_time = time.perf_counter(), math.nan
        if self._unit == "s":
            remaining_time = most - done
        elif self._first_report:  # the rate since the first report, because earlier amounts took no time in this task
            steps, duration = done - self._first_report[0], now - self._first_report[1]
            if duration >= _MIN_SECONDS and (
                steps >= _MIN_STEPS or steps > _MIN_SHARE * (most - self._first_report[0])
            ):
                remaining_time = (most - done) * duration / steps
        self._listener(Progress(self._what, done, most, self._unit, now - self._start_time, remaining_time, note))


def begin(steps: Steps | None, what: str, unit: str = "") -> None:
    """Begin a task, if there is a listener."""
    if steps is not None:
        steps.begin(what, unit)


def steps_for(listener: Listener | None) -> Steps | None:
    """The `Steps` that report to a listener; None without a listener.

    Raises:
        InputError: if the listener cannot be called.
    """
    if faults := callback_faults("progress", listener):
        raise InputError(faults)
    return None if listener is None else Steps(listener)


def start_steps(listener: Listener | None, what: str, unit: str = "") -> Steps | None:
    """Make the `Steps` of a listener, and begin their first task."""
    steps = steps_for(listener)
    begin(steps, what, unit)
    return steps
