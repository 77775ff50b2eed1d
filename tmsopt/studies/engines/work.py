"""What engines carry out: units of rows."""

import pickle
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Protocol

from tmsopt.studies.row import Row

Unit = tuple[int, ...]
"""Numbers of rows that are solved together: usually one, a block where neighbours start each other."""

Note = Callable[[str], None]
"""Takes one line about workers that come, go and end."""


class Work(Protocol):
    """A study as engines see it. It is pickled once per worker; what it keeps for its process is its own."""

    def __call__(self, numbers: Unit, /) -> Sequence[Row]:
        """Solve the rows of one unit; their values depend on the unit alone."""
        ...

    def lost(self, number: int, cause: str, /) -> Row:
        """The row, status ``quarantined``, of a number that cannot be solved because it ends its worker."""
        ...


class EngineError(RuntimeError):
    """An engine that cannot go on; the rows it has yielded stand, and the others can be asked for again."""


def silent(line: str) -> None:
    """A `Note` that is not taken."""


def attempt(work: Work, unit: Unit) -> list[Row]:
    """The rows of a unit, whatever happens: an exception makes ``failed`` rows.

    Where a unit of several rows raises, each is solved on its own, so that only the one at fault fails. Every engine
    goes this way, so all of them come to the same rows.
    """
    try:
        rows = list(work(unit))
        if sorted(row.number for row in rows) != sorted(unit):
            raise ValueError(f"rows {[row.number for row in rows]} came back for {list(unit)}")
    except Exception as error:
        if len(unit) > 1:
            return [row for number in unit for row in attempt(work, (number,))]
        return [replace(work.lost(unit[0], repr(error)), status="failed")]
    return rows


_WORKS: dict[str, Work] = {}
"""Of this process: digest → work with the solvers it has built."""
_KEPT = 4  # studies that a worker keeps the solvers of


def keep(digest: str, blob: bytes) -> None:
    """Have the work at hand in this process, the last of a few."""
    _WORKS[digest] = _WORKS.pop(digest) if digest in _WORKS else pickle.loads(blob)
    while len(_WORKS) > _KEPT:
        del _WORKS[next(iter(_WORKS))]


def timed(digest: str, unit: Unit) -> tuple[Unit, list[Row], float]:
    """A unit of work that is kept here: its rows, and the seconds that they took."""
    started = time.perf_counter()
    rows = attempt(_WORKS[digest], unit)
    return unit, rows, time.perf_counter() - started


def pickled(work: Work) -> bytes:
    """The work as bytes, also where its class is written in a script or notebook."""
    import cloudpickle

    blob: bytes = cloudpickle.dumps(work, protocol=pickle.HIGHEST_PROTOCOL)
    return blob


def called(unit: Unit) -> str:
    """How notes name a unit: row 7, rows 32 to 63."""
    return f"row {unit[0]}" if len(unit) == 1 else f"rows {unit[0]} to {unit[-1]}"
