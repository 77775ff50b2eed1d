"""How a command ends early: by signals, or because a stream accepts no more text. Only this module handles them.

The first signal, of any kind, raises KeyboardInterrupt, so that a search can return its best result. A second signal,
at least half a second later, ends the program; if it takes longer than one second, the process exits at once. The exit
status is always that of the first signal.
"""

import atexit
import errno
import io
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.machinery import ExtensionFileLoader
from types import FrameType
from typing import Any, TextIO, cast

from tmsopt.cli.terminal import close_progress, hide_progress

BAD_INPUT, INFEASIBLE, NOT_CONVERGED, INTERRUPTED, UNREAD = 2, 3, 4, 130, 141
"""Exit statuses. `UNREAD`: the program that reads the answer has ended; other programs use this status too."""

STATUSES = {"optimal": 0, "infeasible": INFEASIBLE, "not_converged": NOT_CONVERGED}
"""Status of a solution → exit status."""

_SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
_LOADERS = {getattr(ExtensionFileLoader, name).__code__ for name in ("create_module", "exec_module")}
_CASADI = "casadi.casadi"  # wrappers in Python; compiled code calls them, and loses the exceptions that they raise
_WRITE_ERRORS = {errno.ENOSPC, errno.EBADF, errno.EIO, errno.EFBIG}
_RETRY_SECONDS = 0.01  # time until an interrupt is raised again
_REPEAT_SECONDS = 0.5  # timeout(1) sends one signal twice within this time, to a process and to its group
_CLEANUP_SECONDS = 1.0  # time for tidying up after a second signal


class Signals:
    """Handles the signals that a command receives.

    Attributes:
        status: exit status after the first signal; 0 before it.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        self.status, self._is_held, self._is_due, self._repeat_end = 0, False, False, 0.0

    def handle(self, number: int, frame: FrameType | None) -> None:
        now = time.monotonic()
        if not self.status:
            self.status, self._is_due, self._repeat_end = 128 + number, True, now + _REPEAT_SECONDS
            self.interrupt(number, frame)
        elif now >= self._repeat_end:
            threading.Thread(target=self._exit_soon, daemon=True).start()
            raise SystemExit(self.status)

    def interrupt(self, _number: int, frame: FrameType | None) -> None:
        """Raise the interrupt if it is due. While compiled code runs that would lose the interrupt, try again later."""
        if not self._is_due or self._is_held:
            return
        if _loses_exceptions(frame) and hasattr(signal, "setitimer"):
            self._try_again()
            return
        self._is_due = False
        raise KeyboardInterrupt

    def recover(self, event: Any) -> None:
        """Raise an interrupt again that Python could not raise. This is the hook for unraisable exceptions."""
        if not self.status or not isinstance(event.exc_value, KeyboardInterrupt):
            sys.__unraisablehook__(event)
        elif hasattr(signal, "setitimer"):
            self._is_due = True
            self._try_again()

    @contextmanager
    def hold(self) -> Iterator[None]:
        """Delay the interrupt of the first signal until the context ends."""
        self._is_held = True
        try:
            yield
        finally:
            self._is_held = False
        self.interrupt(0, None)

    def _try_again(self) -> None:
        signal.signal(signal.SIGALRM, self.interrupt)
        signal.setitimer(signal.ITIMER_REAL, _RETRY_SECONDS)

    def _exit_soon(self) -> None:
        time.sleep(_CLEANUP_SECONDS)
        eraser = threading.Thread(target=close_progress, daemon=True)
        eraser.start()
        eraser.join(_CLEANUP_SECONDS)  # a limit, because a stopped terminal never accepts the text
        os._exit(self.status)


_HANDLER = Signals()

hold_signals = _HANDLER.hold
"""A context in which an answer is written completely, before the first signal interrupts the command."""


@contextmanager
def handle_signals(ends_process: bool) -> Iterator[Signals]:
    """Handle signals in a context, except signals that the caller of this program has set to be ignored.

    Args:
        ends_process: whether the process ends afterwards; then later signals do not change its exit status.
    """
    _HANDLER.reset()
    if threading.current_thread() is not threading.main_thread():
        yield _HANDLER
        return
    handlers = {number: signal.getsignal(number) for number in _SIGNALS}
    old_handlers = {number: handler for number, handler in handlers.items() if handler not in (signal.SIG_IGN, None)}
    hook, sys.unraisablehook = sys.unraisablehook, _HANDLER.recover
    for number in old_handlers:
        signal.signal(number, _HANDLER.handle)
    try:
        yield _HANDLER
    finally:
        for number, handler in old_handlers.items():
            signal.signal(number, signal.SIG_IGN if ends_process else handler)
        sys.unraisablehook = hook


def exit_now(status: int) -> None:
    """End the process at once. The usual exit of Python would wait for threads. It would also end by SIGINT instead of
    the status, if the interrupt came in an `exec`, which dataclasses use while modules load."""
    atexit._run_exitfuncs()
    os._exit(status)


@contextmanager
def report_end() -> Iterator[None]:
    """Report an interrupt or a failed stream by one line on stderr and an exit status."""
    try:
        yield
    except KeyboardInterrupt:
        print("stopped; all text printed before is valid", file=sys.stderr)
        sys.exit(INTERRUPTED)
    except BrokenPipeError:
        sys.exit(UNREAD)  # quietly, as other programs do
    except OSError as error:
        reason = error.strerror or error
        if error.filename:
            text = f"'{error.filename}' cannot be read or written: {reason}"
        elif error.errno in _WRITE_ERRORS:
            text = f"the answer cannot be written: {reason}; give a file or a device with free space"
        else:
            text = f"the operating system reports an error: {reason}"
        print(text, file=sys.stderr)
        sys.exit(BAD_INPUT)


class _Stream:
    """A stream that erases the progress line before it writes text.

    Args:
        ignored: exceptions that are ignored, because a lost diagnostic must not lose the answer.
    """

    def __init__(self, stream: Any, *ignored: type[Exception]) -> None:
        self._stream, self._ignored = stream, ignored

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        with hide_progress(), suppress(*self._ignored):
            self._stream.write(text)
            if self._stream.isatty():
                self._stream.flush()
        return len(text)

    def flush(self) -> None:
        with suppress(*self._ignored):
            self._stream.flush()


@contextmanager
def open_streams() -> Iterator[TextIO]:
    """Make the standard streams exist and accept every character; yield the original stderr.

    A stream that was closed when the program began is replaced: stdin is empty, stderr drops its text, and stdout
    raises an error. Otherwise the next file that is opened would get the number of the stream, and receive its text.
    """
    for number, name, mode in ((0, "stdin", os.O_RDONLY), (1, "stdout", os.O_RDONLY), (2, "stderr", os.O_WRONLY)):
        if getattr(sys, name) is None:
            handle = os.open(os.devnull, mode)  # gets the smallest free number: the number of the closed stream
            setattr(sys, name, os.fdopen(handle, "w" if number else "r", encoding="utf-8"))
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # an encoding without some characters must not lose a result
    original = out = sys.stdout
    # With python -u, a write that a signal interrupts would lose the rest of its text.
    if isinstance(getattr(original, "buffer", None), io.RawIOBase):
        out = os.fdopen(original.fileno(), "w", encoding=original.encoding, errors="replace", closefd=False)
    err = sys.stderr
    sys.stdout = cast(TextIO, _Stream(out))
    sys.stderr = cast(TextIO, _Stream(err, OSError, ValueError))
    try:
        yield err
    finally:
        sys.stdout, sys.stderr = original, err
        for stream in (out, err):
            try:
                stream.flush()
            except (OSError, ValueError):  # Python would try again at its end, and report it
                with suppress(OSError, ValueError):
                    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _loses_exceptions(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code in _LOADERS or frame.f_globals.get("__name__") == _CASADI:
            return True
        frame = frame.f_back
    return False
