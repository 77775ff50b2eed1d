"""Progress of long work: one kind of record for every function, sent to a listener at most 20 times a second."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

from tmsopt.errors import InputError, call_faults

PAUSE = 0.05
"""Least time in s between two records of one task; its first and last are always sent."""

_SETTLED, _STEPS, _PART = 2.0, 8, 0.05
"""The remaining time is estimated after so many seconds, and so many steps or such a part of all. Before that, modules
and processes start, and single steps differ widely."""

_SHARE = 9.0  # pause after a call of the listener, in times that call took: it costs a tenth of the time at most


@dataclass(frozen=True)
class Progress:
    """Progress of one task.

    Attributes:
        what: name of the task, such as ``searching``.
        done: amount done, which never decreases; nan if the task counts nothing.
        most: upper bound of `done`; nan if unknown.
        unit: unit of both: ``start``, ``row``, ``design`` …, or ``s`` for a task with a time limit; empty if the task
            counts nothing.
        seconds: time since the task began.
        left: upper estimate of the remaining time in s; nan while unknown, as after a few steps.
        note: quality so far, such as ``gap 0.001``; often empty.

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

Counts = Callable[..., None]
"""Called by the work with the amount done, its upper bound, and perhaps a note."""


class Steps:
    """Turns counts of one task after the other into records for a listener; a `Counts`."""

    def __init__(self, listener: Listener) -> None:
        self._listener = listener
        self._before: dict[str, float] = {}  # amount done of each task, when it was last left or restarted
        self._what, self._done = "", 0.0

    def begin(self, what: str, unit: str = "") -> None:
        """Begin a task, or continue it if it is the current one."""
        if what != self._what:
            self._before[self._what] = self._done
            self._what, self._unit = what, unit
            self._began, self._due = time.perf_counter(), 0.0
            self._first: tuple[float, float] | None = None
            self._done, self._last = self._before.setdefault(what, 0.0), 0.0
            self._send(self._done if unit else math.nan, math.nan)

    def __call__(self, done: float, most: float, note: str = "") -> None:
        """Report the amount done. If it has decreased, the task was restarted, and the earlier amount is added."""
        if done < self._last:
            self._before[self._what] = self._done
        self._last, before = done, self._before[self._what]
        self._done = before + done
        now = time.perf_counter()
        self._first = self._first or (self._done, now)
        if done >= most or now >= self._due:
            self._send(self._done, before + most, note)
            after = time.perf_counter()
            self._due = after + max(PAUSE, _SHARE * (after - now)) if PAUSE else 0.0

    def _send(self, done: float, most: float, note: str = "") -> None:
        now, left = time.perf_counter(), math.nan
        if self._unit == "s":
            left = most - done
        elif self._first:  # rate since the first report: earlier amounts took no time in this task
            steps, took = done - self._first[0], now - self._first[1]
            if took >= _SETTLED and (steps >= _STEPS or steps > _PART * (most - self._first[0])):
                left = (most - done) * took / steps
        self._listener(Progress(self._what, done, most, self._unit, now - self._began, left, note))


def begin(steps: Steps | None, what: str, unit: str = "") -> None:
    """Begin a task, if there is a listener."""
    if steps is not None:
        steps.begin(what, unit)


def steps_for(listener: Listener | None) -> Steps | None:
    """The `Steps` that report to a listener; None without one.

    Raises:
        InputError: if the listener cannot be called.
    """
    if faults := call_faults("progress", listener):
        raise InputError(faults)
    return None if listener is None else Steps(listener)


def start_steps(listener: Listener | None, what: str, unit: str = "") -> Steps | None:
    """`steps_for` a listener, with its first task begun."""
    steps = steps_for(listener)
    begin(steps, what, unit)
    return steps
