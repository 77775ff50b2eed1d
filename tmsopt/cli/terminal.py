"""What a terminal shows while a command works: one line on stderr, gone before anything else is written there.

A thread draws it, so that it shows within a second whatever the command is doing, modules being loaded included, and
that the seconds pass. It writes nothing but this line, and nothing where stderr is no terminal.
"""

import math
import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

from tmsopt.progress import Listener, Progress

_FIRST, _NEXT = 0.4, 0.1  # seconds until the line is drawn, and until it is drawn again
_WIDTH = 80  # columns of a terminal that does not know its own
_ERASED = "\r\033[K"
_MINUTE, _HOUR = 60, 3600


class _Display:
    """The line of one command, on a stream of its own until it is closed."""

    def __init__(self, stream: Any) -> None:
        self._stream, self._lock, self._over = stream, threading.RLock(), threading.Event()
        self._told, self._at = Progress("starting"), time.perf_counter()
        self._due, self._shown, self._held = self._at + _FIRST, False, 0
        threading.Thread(target=self._drawing, daemon=True).start()

    def tell(self, told: Progress) -> None:
        """What is to be shown from now on."""
        with self._lock:
            self._told, self._at = told, time.perf_counter()
            self.draw()

    def draw(self) -> None:
        """Draw it, if that is due."""
        with self._lock:
            now = time.perf_counter()
            if now >= self._due and not self._held and not self._over.is_set():
                self._due, self._shown = now + _NEXT, True
                self._write(f"\r{words(self._told, now - self._at, self._width() - 1)}\033[K")

    def hold(self, count: int) -> None:
        """Erase it, and draw nothing until all who hold it have let go."""
        with self._lock:
            self._held += count
            self.erase()

    def erase(self) -> None:
        """Make room for what others write; it comes back where the work goes on."""
        with self._lock:
            if self._shown:
                self._write(_ERASED)
            self._shown, self._due = False, max(self._due, time.perf_counter() + _NEXT)

    def close(self) -> None:
        """Erase it for good."""
        self._over.set()
        self.erase()

    def _drawing(self) -> None:
        while not self._over.wait(_NEXT):
            self.draw()

    def _write(self, text: str) -> None:
        with suppress(OSError, ValueError):  # a terminal that is gone
            self._stream.write(text)
            self._stream.flush()

    def _width(self) -> int:
        try:
            return os.get_terminal_size(self._stream.fileno()).columns or _WIDTH
        except (OSError, ValueError):
            return _WIDTH


_SHOWN: list[_Display] = []  # of the command at work, and of one that called it


@contextmanager
def showing(stream: Any) -> Iterator[None]:
    """Show how far a command is, where a stream is a terminal that can erase a line."""
    if not stream.isatty() or os.environ.get("TERM") == "dumb":
        yield
        return
    _SHOWN.append(_Display(stream))
    try:
        yield
    finally:
        _SHOWN.pop().close()


def erased() -> None:
    """Nothing is shown any more: the process ends."""
    for line in _SHOWN:
        line.close()


def shown() -> Listener | None:
    """What the verbs of tmsopt are to call; None where nobody looks."""
    return _SHOWN[-1].tell if _SHOWN else None


def doing(what: str) -> None:
    """Say what is done next, where no verb says it."""
    if _SHOWN:
        _SHOWN[-1].tell(Progress(what))


@contextmanager
def quiet() -> Iterator[None]:
    """Nothing is shown while something else is written."""
    held = _SHOWN[-1:]
    for line in held:
        line.hold(1)
    try:
        yield
    finally:
        for line in held:
            line.hold(-1)


def words(told: Progress, since: float = 0.0, width: int = 1000) -> str:
    """A record as one line of so many columns, some seconds after it was told; what does not fit is said shorter."""
    whole = _words(told, since)
    if len(whole) <= width or not (told.unit and math.isfinite(told.done)):
        return whole[:width]
    text = f"{told.what}: {told.done:,.0f}" + (f"/{told.most:,.0f}" if math.isfinite(told.most) else f" {told.unit}")
    text += f", {_time(max(math.ceil(told.left - since), 1))} left" if math.isfinite(told.left) else ""
    return text[:width]


def _words(told: Progress, since: float) -> str:
    seconds, text = told.seconds + since, told.what
    if told.unit == "s" and math.isfinite(told.most):
        text += f": {min(told.done + since, told.most):.0f} of {told.most:.0f} s"
    elif told.unit and math.isfinite(told.done):
        known = math.isfinite(told.most)
        text += f": {told.done:,.0f}{f' of {told.most:,.0f}' * known} {told.unit}"
        text += "" if (told.most if known else told.done) == 1 else "s"
        left = told.left - since  # below 0 it was estimated too short
        text += f", about {_time(math.ceil(left))} left" if left > 0 else ""
    text += f"; {told.note}" if told.note else ""
    return text if told.unit == "s" or seconds < 1 else f"{text} ({_time(seconds)})"


def _time(seconds: float) -> str:
    if seconds < _MINUTE:
        return f"{seconds:.0f} s"
    if seconds < _HOUR:
        return f"{seconds // _MINUTE:.0f} min {seconds % _MINUTE:.0f} s"
    return f"{seconds // _HOUR:.0f} h {seconds % _HOUR // _MINUTE:.0f} min"
