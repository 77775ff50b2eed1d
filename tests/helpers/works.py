"""Work for engines: rows that cost nothing, and some that end their worker, once or always."""

import os
import signal
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tmsopt.records import Table
from tmsopt.studies import Row


@dataclass(frozen=True)
class Fake:
    """Rows whose values follow from the unit they are solved in.

    Attributes:
        folder: where every start of a row leaves a mark.
        seconds: of sleep per row.
        once, always: rows that end their worker by SIGKILL the first time, or every time.
        leaves: rows that end it by ``os._exit(3)``.
        raises: rows that raise.
    """

    folder: Path
    seconds: float = 0.0
    once: tuple[int, ...] = ()
    always: tuple[int, ...] = ()
    leaves: tuple[int, ...] = ()
    raises: tuple[int, ...] = ()

    def __call__(self, numbers: tuple[int, ...]) -> Sequence[Row]:
        rows: list[Row] = []
        for number in numbers:
            before = self.tries(number)
            with (self.folder / str(number)).open("a") as marks:
                marks.write("x")
            if number in self.always or (number in self.once and not before):
                os.kill(os.getpid(), signal.SIGKILL)
            if number in self.leaves:
                os._exit(3)
            if number in self.raises:
                raise KeyError(number)
            time.sleep(self.seconds)
            value = (rows[-1].objective if rows else 0.1) / 3 + number / 7
            rows.append(Row(number, number, Table({"Fr": value}), "optimal", objective=value, host=str(os.getpid())))
        return rows

    def lost(self, number: int, cause: str) -> Row:
        return Row(number, number, Table(), "quarantined", cause)

    def tries(self, number: int) -> int:
        """How often a row was started."""
        marks = self.folder / str(number)
        return marks.stat().st_size if marks.exists() else 0


@dataclass(frozen=True)
class Unloadable(Fake):
    """Work that no worker can load."""

    def __reduce__(self) -> tuple[type[int], tuple[str]]:
        return int, ("not a study",)


def main(folder: str) -> None:
    """A program whose workers would never end by themselves: the ids of two of them, then nothing."""
    from tmsopt.studies.engines import processes

    seen: set[str] = set()
    try:
        for row in processes(Fake(Path(folder), 0.01), [(n,) for n in range(10**5)], workers=2):
            if row.host not in seen:
                seen.add(row.host)
                print(row.host, flush=True)
    except KeyboardInterrupt:
        print("interrupted", flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
