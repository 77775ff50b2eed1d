"""Work for executors: items that cost nothing, and some that end their worker, once or always."""

import os
import signal
import sys
import time
from collections.abc import Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Fake:
    """A function of a number, which leaves a mark in a folder whenever it is called.

    Attributes:
        seconds: of sleep in each call.
        once, always: numbers that end their worker by SIGKILL the first time, or every time.
        leaves: numbers that end it by ``os._exit(3)``.
        raises: numbers that raise.
    """

    folder: Path
    seconds: float = 0.0
    once: Sequence[int] = ()
    always: Sequence[int] = ()
    leaves: Sequence[int] = ()
    raises: Sequence[int] = ()

    def __call__(self, number):
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
        return number / 7, os.getpid()

    def tries(self, number):
        """How often it was called with a number."""
        marks = self.folder / str(number)
        return marks.stat().st_size if marks.exists() else 0


@dataclass(frozen=True)
class Unloadable(Fake):
    """Work that no worker can load."""

    def __reduce__(self):
        return int, ("not a number",)


@dataclass(frozen=True)
class Big(Fake):
    """Answers of a megabyte, which no pipe takes at once."""

    def __call__(self, number):
        x, process = super().__call__(number)
        return float(len(str(x) * 10**5)), process


@contextmanager
def little_room(most):
    """No file may grow beyond so many bytes, as on a full disk; modules that are imported are not cached cut off."""
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, hard))
    caches, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        yield
    finally:
        sys.dont_write_bytecode = caches
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def main(folder):
    """A program whose workers would never end by themselves: the ids of two of them, then nothing."""
    from tmsopt.executor import processes

    seen = set()
    try:
        with processes(2) as executor:
            for _, (_, process) in executor.map(Fake(Path(folder), 0.01), range(10**5)):
                if process not in seen:
                    seen.add(process)
                    print(process, flush=True)
    except KeyboardInterrupt:
        print("interrupted", flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
