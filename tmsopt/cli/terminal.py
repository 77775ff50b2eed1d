"""The progress line: one line on stderr of a terminal while a command works. It is erased before other text is written.

A thread draws the line, so that it appears within a second, and its seconds go on whatever the command does. `Live` of
Rich is not used, because it takes long to load, hides the cursor, and ends its line with a line feed.
"""

import math
import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

from tmsopt.progress import Listener, Progress

_FIRST_DELAY = 0.4  # seconds until the line is drawn for the first time
_REDRAW_DELAY = 0.1  # seconds until the line is drawn again
_DEFAULT_WIDTH = 80  # columns of a terminal whose width is unknown
_ERASE = "\r\033[K"  # characters that erase a line of a terminal
_MINUTE, _HOUR = 60, 3600


class _Line:
    """The progress line of one command."""

    def __init__(self, stream: Any) -> None:
        self._stream, self._lock, self._closed = stream, threading.RLock(), threading.Event()
        self._progress, self._update_time = Progress("starting"), time.perf_counter()
        self._draw_time, self._is_drawn, self._holder_count = self._update_time + _FIRST_DELAY, False, 0
        threading.Thread(target=self._keep_drawing, daemon=True).start()

    def update(self, progress: Progress) -> None:
        with self._lock:
            self._progress, self._update_time = progress, time.perf_counter()
            self._draw()

    def hold(self, count: int) -> None:
        """Add `count` holders, and erase the line. It is drawn again when there are no holders."""
        with self._lock:
            self._holder_count += count
            if self._is_drawn:
                self._write(_ERASE)
            self._is_drawn, self._draw_time = False, max(self._draw_time, time.perf_counter() + _REDRAW_DELAY)

    def close(self) -> None:
        self._closed.set()
        self.hold(1)

    def _keep_drawing(self) -> None:
        while not self._closed.wait(_REDRAW_DELAY):
            self._draw()

    def _draw(self) -> None:
        with self._lock:
            now = time.perf_counter()
            if now >= self._draw_time and not self._holder_count:
                self._draw_time, self._is_drawn = now + _REDRAW_DELAY, True
                text = describe_progress(self._progress, now - self._update_time, count_columns(self._stream) - 1)
                self._write(f"\r{text}\033[K")

    def _write(self, text: str) -> None:
        with suppress(OSError, ValueError):  # the terminal is gone
            self._stream.write(text)
            self._stream.flush()


_OPEN_LINES: list[_Line] = []  # the last line belongs to this command, the others to commands that called it


@contextmanager
def show_progress(stream: Any) -> Iterator[None]:
    """Show progress on a stream if it is a terminal that can erase a line."""
    if not stream.isatty() or os.environ.get("TERM") == "dumb":
        yield
        return
    _OPEN_LINES.append(_Line(stream))
    try:
        yield
    finally:
        _OPEN_LINES.pop().close()


def close_progress() -> None:
    """Erase all lines, because the process ends."""
    for line in _OPEN_LINES:
        line.close()


def progress_listener() -> Listener | None:
    """A function for the argument `progress` of tmsopt's functions; None if no line is shown."""
    return _OPEN_LINES[-1].update if _OPEN_LINES else None


def show_step(step: str) -> None:
    """Show the next step of the command."""
    if _OPEN_LINES:
        _OPEN_LINES[-1].update(Progress(step))


@contextmanager
def hide_progress() -> Iterator[None]:
    """Show no progress in a context that writes other text."""
    lines = _OPEN_LINES[-1:]
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
        return os.get_terminal_size(stream.fileno()).columns or _DEFAULT_WIDTH
    except (OSError, ValueError):
        return _DEFAULT_WIDTH


def describe_progress(progress: Progress, elapsed: float = 0.0, width: int = 1000) -> str:
    """A progress record as one line, `elapsed` seconds after it was sent; a shorter line if it does not fit."""
    has_end, is_counted = math.isfinite(progress.most), bool(progress.unit) and math.isfinite(progress.done)
    seconds, text = progress.seconds + elapsed, progress.what
    if progress.unit == "s" and has_end:
        text += f": {min(progress.done + elapsed, progress.most):.0f} of {progress.most:.0f} s"
    elif is_counted:
        text += f": {progress.done:,.0f}{f' of {progress.most:,.0f}' * has_end} {progress.unit}"
        text += "s" * ((progress.most if has_end else progress.done) != 1)
        text += f", about {_format_time(progress.left - elapsed)} left" if progress.left > elapsed else ""
    text += f"; {progress.note}" if progress.note else ""
    if progress.unit != "s" and seconds >= 1:
        text += f" ({_format_time(math.floor(seconds))})"
    if len(text) > width and is_counted:
        end = f"/{progress.most:,.0f}" if has_end else f" {progress.unit}"
        time_left = f", {_format_time(max(progress.left - elapsed, 1))} left" if math.isfinite(progress.left) else ""
        text = f"{progress.what}: {progress.done:,.0f}{end}{time_left}"
    return text[:width]


def _format_time(seconds: float) -> str:
    seconds = math.ceil(seconds)
    if seconds < _MINUTE:
        return f"{seconds} s"
    if seconds < _HOUR:
        return f"{seconds // _MINUTE} min {seconds % _MINUTE} s"
    return f"{seconds // _HOUR} h {seconds % _HOUR // _MINUTE} min"
