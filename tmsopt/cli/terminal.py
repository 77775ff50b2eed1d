"""The progress line: one line on a terminal's stderr while a command works, erased before anything else is written.

A thread draws it, so that it appears within a second and its seconds pass whatever the command does, such as loading
modules. Rich's Live takes longer to load than all of this, hides the cursor, and ends its line with a line feed.
"""

import math
import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

from tmsopt.progress import Listener, Progress

_FIRST, _NEXT = 0.4, 0.1  # seconds until the line is drawn first, and again
_WIDTH = 80  # columns of a terminal that does not know its own
_ERASE = "\r\033[K"
_MINUTE, _HOUR = 60, 3600


class _Line:
    """The progress line of one command."""

    def __init__(self, stream: Any) -> None:
        self._stream, self._lock, self._closed = stream, threading.RLock(), threading.Event()
        self._progress, self._since = Progress("starting"), time.perf_counter()
        self._due, self._is_drawn, self._holders = self._since + _FIRST, False, 0
        threading.Thread(target=self._keep_drawing, daemon=True).start()

    def update(self, progress: Progress) -> None:
        with self._lock:
            self._progress, self._since = progress, time.perf_counter()
            self._draw()

    def hold(self, count: int) -> None:
        """Erase the line; it comes back when all holders have let go and the work goes on."""
        with self._lock:
            self._holders += count
            if self._is_drawn:
                self._write(_ERASE)
            self._is_drawn, self._due = False, max(self._due, time.perf_counter() + _NEXT)

    def close(self) -> None:
        self._closed.set()
        self.hold(1)

    def _keep_drawing(self) -> None:
        while not self._closed.wait(_NEXT):
            self._draw()

    def _draw(self) -> None:
        with self._lock:
            now = time.perf_counter()
            if now >= self._due and not self._holders:
                self._due, self._is_drawn = now + _NEXT, True
                text = describe_progress(self._progress, now - self._since, count_columns(self._stream) - 1)
                self._write(f"\r{text}\033[K")

    def _write(self, text: str) -> None:
        with suppress(OSError, ValueError):  # the terminal is gone
            self._stream.write(text)
            self._stream.flush()


_LINES: list[_Line] = []  # of this command, after those of the commands that called it


@contextmanager
def show_progress(stream: Any) -> Iterator[None]:
    """Show progress on a stream if it is a terminal that can erase a line."""
    if not stream.isatty() or os.environ.get("TERM") == "dumb":
        yield
        return
    _LINES.append(_Line(stream))
    try:
        yield
    finally:
        _LINES.pop().close()


def close_progress() -> None:
    """Erase the line for good, because the process ends."""
    for line in _LINES:
        line.close()


def progress_listener() -> Listener | None:
    """A function for the `progress` of tmsopt's verbs; None if nobody looks."""
    return _LINES[-1].update if _LINES else None


def show_step(what: str) -> None:
    """Show what the command does next."""
    if _LINES:
        _LINES[-1].update(Progress(what))


@contextmanager
def hide_progress() -> Iterator[None]:
    """Show no progress while something else is written."""
    lines = _LINES[-1:]
    for line in lines:
        line.hold(1)
    try:
        yield
    finally:
        for line in lines:
            line.hold(-1)


def count_columns(stream: Any) -> int:
    """Columns of a terminal."""
    try:
        return os.get_terminal_size(stream.fileno()).columns or _WIDTH
    except (OSError, ValueError):
        return _WIDTH


def describe_progress(told: Progress, since: float = 0.0, width: int = 1000) -> str:
    """A record as one line, some seconds after it was told; if it does not fit, a shorter one."""
    has_end, is_counted = math.isfinite(told.most), bool(told.unit) and math.isfinite(told.done)
    seconds, text = told.seconds + since, told.what
    if told.unit == "s" and has_end:
        text += f": {min(told.done + since, told.most):.0f} of {told.most:.0f} s"
    elif is_counted:
        text += f": {told.done:,.0f}{f' of {told.most:,.0f}' * has_end} {told.unit}"
        text += "s" * ((told.most if has_end else told.done) != 1)
        text += f", about {_format_time(told.left - since)} left" if told.left > since else ""
    text += f"; {told.note}" if told.note else ""
    if told.unit != "s" and seconds >= 1:
        text += f" ({_format_time(math.floor(seconds))})"
    if len(text) > width and is_counted:
        most = f"/{told.most:,.0f}" if has_end else f" {told.unit}"
        left = f", {_format_time(max(told.left - since, 1))} left" if math.isfinite(told.left) else ""
        text = f"{told.what}: {told.done:,.0f}{most}{left}"
    return text[:width]


def _format_time(seconds: float) -> str:
    seconds = math.ceil(seconds)
    if seconds < _MINUTE:
        return f"{seconds} s"
    if seconds < _HOUR:
        return f"{seconds // _MINUTE} min {seconds % _MINUTE} s"
    return f"{seconds // _HOUR} h {seconds % _HOUR // _MINUTE} min"
