"""How far long work is: one record, the same for every verb, told to whoever called no oftener than one can read."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

from tmsopt.errors import InputError, call_faults

PAUSE = 0.05
"""Seconds between two records of one piece of work, but for its first and its last."""

_SETTLED, _STEPS, _PART = 2.0, 8, 0.05
"""Seconds, and steps or a part of all of them, from which on a rate is one: before, processes start and modules are
loaded, and one step may take many times as long as another."""

_SHARE = 9.0  # times as long as a listener takes it is left alone, so that it costs a tenth of the time at most


@dataclass(frozen=True)
class Progress:
    """How far a piece of work is.

    Attributes:
        what: is being done, in words, such as ``searching``.
        done: how much of it is, never less than before; nan where nothing is counted.
        most: of how much, at most; nan where that is not known.
        unit: of both: ``start``, ``row``, ``design`` …, ``s`` of work that ends with its time; empty where nothing is
            counted.
        seconds: since this piece of work began.
        left: seconds that it takes at most at its rate so far; nan where that cannot be known, as after a few steps.
        note: how good it is so far, such as ``gap 0.001``; often empty.

    Example:
        >>> from itertools import pairwise
        >>> told = []
        >>> design = tmsopt.solve("problems/ep4.toml", progress=told.append)
        >>> all(now.done <= then.done for now, then in pairwise(told) if now.what == then.what == "searching")
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
"""What is called meanwhile. What it raises ends the work: KeyboardInterrupt as Ctrl-C does."""

Counts = Callable[..., None]
"""What work calls inside, with what is done, what there is at most, and perhaps a note."""


class Steps:
    """What work counts, one piece after the other, told as records: a `Counts`."""

    def __init__(self, told: Listener) -> None:
        self._told = told
        self._before: dict[str, float] = {}  # done of each piece of work, when it was last left or begun anew
        self._what, self._done = "", 0.0

    def begin(self, what: str, unit: str = "") -> None:
        """Another piece of work, or more of the same."""
        if what != self._what:
            self._before[self._what] = self._done
            self._what, self._unit, self._note = what, unit, ""
            self._began, self._due = time.perf_counter(), 0.0
            self._first: tuple[float, float] | None = None
            self._done, self._last = self._before.setdefault(what, 0.0), 0.0
            self._tell(self._done if unit else math.nan, math.nan)

    def __call__(self, done: float, most: float, note: str = "") -> None:
        """How far it is; where it has less than before, it was begun anew, and what was done before counts too."""
        if done < self._last:
            self._before[self._what] = self._done
        self._last, before = done, self._before[self._what]
        self._done, self._note = before + done, note
        now = time.perf_counter()
        self._first = self._first or (self._done, now)
        if done >= most or now >= self._due:
            self._tell(self._done, before + most)
            after = time.perf_counter()
            self._due = after + max(PAUSE, _SHARE * (after - now)) if PAUSE else 0.0

    def _tell(self, done: float, most: float) -> None:
        now, left = time.perf_counter(), math.nan
        if self._unit == "s":
            left = most - done
        elif self._first:  # from the first on: what was there before took no time now
            steps, took = done - self._first[0], now - self._first[1]
            if took >= _SETTLED and (steps >= _STEPS or steps > _PART * (most - self._first[0])):
                left = (most - done) * took / steps
        self._told(Progress(self._what, done, most, self._unit, now - self._began, left, self._note))


def begin(steps: Steps | None, what: str, unit: str = "") -> None:
    """Say what is done next, if anybody listens."""
    if steps is not None:
        steps.begin(what, unit)


def steps_for(told: Listener | None) -> Steps | None:
    """The counts of a verb, for whoever listens to it.

    Raises:
        InputError: for what cannot be called.
    """
    if faults := call_faults("progress", told):
        raise InputError(faults)
    return None if told is None else Steps(told)


def start_steps(told: Listener | None, what: str, unit: str = "") -> Steps | None:
    """The same for one piece of work, which begins."""
    steps = steps_for(told)
    begin(steps, what, unit)
    return steps
