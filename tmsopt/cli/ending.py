"""How commands end from outside: signals, and streams that take no more. Only this module knows of them.

The first signal raises KeyboardInterrupt, whatever the signal, so that work that has something in hand leaves it. A
second one, half a second later or more, ends everything; a second after it the process exits without a word. The exit
status is that of the signal in any case.
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
"""Exit statuses; `UNREAD` says, as of other programs, that the reader of the answer is gone."""

STATUSES = {"optimal": 0, "infeasible": INFEASIBLE, "not_converged": NOT_CONVERGED}
"""Status of a solution → exit status."""

_SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
_LOADING = {getattr(ExtensionFileLoader, name).__code__ for name in ("create_module", "exec_module")}
_CASADI = "casadi.casadi"  # its wrappers in Python: compiled code that calls Python drops exceptions there
_NO_ROOM = {errno.ENOSPC, errno.EBADF, errno.EIO, errno.EFBIG}
_SOON = 0.01  # seconds until a signal is tried again
_AGAIN = 0.5  # seconds in which timeout(1) sends one signal twice, to a process and to its group
_LEFT = 1.0  # seconds for tidying up after a second signal


class Signals:
    """The signals that one command receives.

    Attributes:
        status: of a program that the first one ended; 0 before.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        self.status, self._held, self._due, self._again = 0, False, False, 0.0

    def handle(self, number: int, frame: FrameType | None) -> None:
        now = time.monotonic()
        if not self.status:
            self.status, self._due, self._again = 128 + number, True, now + _AGAIN
            self.interrupt(number, frame)
        elif now >= self._again:
            threading.Thread(target=self._exit_soon, daemon=True).start()
            raise SystemExit(self.status)

    def interrupt(self, _number: int, frame: FrameType | None) -> None:
        """Raise the interrupt that is due, but later while compiled modules load or CasADi calls, which lose it."""
        if not self._due or self._held:
            return
        if _loses_exceptions(frame) and hasattr(signal, "setitimer"):
            self._try_again()
            return
        self._due = False
        raise KeyboardInterrupt

    def recover(self, event: Any) -> None:
        """Raise an interrupt again that Python could not raise where it was; the hook of unraisable exceptions."""
        if not self.status or not isinstance(event.exc_value, KeyboardInterrupt):
            sys.__unraisablehook__(event)
        elif hasattr(signal, "setitimer"):
            self._due = True
            self._try_again()

    @contextmanager
    def hold(self) -> Iterator[None]:
        """Let the first signal wait."""
        self._held = True
        try:
            yield
        finally:
            self._held = False
        self.interrupt(0, None)

    def _try_again(self) -> None:
        signal.signal(signal.SIGALRM, self.interrupt)
        signal.setitimer(signal.ITIMER_REAL, _SOON)

    def _exit_soon(self) -> None:
        time.sleep(_LEFT)
        erasing = threading.Thread(target=close_progress, daemon=True)
        erasing.start()
        erasing.join(_LEFT)  # a terminal that was stopped takes nothing
        os._exit(self.status)


_HEARD = Signals()

hold_signals = _HEARD.hold
"""A context in which an answer is written as a whole: the first signal waits."""


@contextmanager
def handle_signals(for_good: bool) -> Iterator[Signals]:
    """Handle signals, but for those that the caller of this program has it ignore.

    Args:
        for_good: the process ends afterwards, and later signals do not change its status.
    """
    _HEARD.reset()
    if threading.current_thread() is not threading.main_thread():
        yield _HEARD
        return
    found = {number: signal.getsignal(number) for number in _SIGNALS}
    before = {number: handler for number, handler in found.items() if handler not in (signal.SIG_IGN, None)}
    hook, sys.unraisablehook = sys.unraisablehook, _HEARD.recover
    for number in before:
        signal.signal(number, _HEARD.handle)
    try:
        yield _HEARD
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_IGN if for_good else handler)
        sys.unraisablehook = hook


def exit_now(status: int) -> None:
    """End the process. Python itself would wait for threads such as a compiler; and after an interrupted exec, as of
    dataclasses while modules load, it would end by SIGINT whatever the status."""
    atexit._run_exitfuncs()
    os._exit(status)


@contextmanager
def report_end() -> Iterator[None]:
    """Turn an end from outside into one line on stderr and an exit status."""
    try:
        yield
    except KeyboardInterrupt:
        print("stopped; what was printed before stands", file=sys.stderr)
        sys.exit(INTERRUPTED)
    except BrokenPipeError:
        sys.exit(UNREAD)  # quietly, as other programs do
    except OSError as error:
        reason = error.strerror or error
        if error.filename:
            text = f"'{error.filename}' cannot be read or written: {reason}"
        elif error.errno in _NO_ROOM:
            text = f"the answer cannot be written: {reason}; give a file or a device with room"
        else:
            text = f"the system refuses what is needed: {reason}"
        print(text, file=sys.stderr)
        sys.exit(BAD_INPUT)


class _Stream:
    """A stream before whose text the progress line is erased.

    Attributes:
        ignored: exceptions that do not matter: a lost diagnostic must not cost the answer.
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
    """Streams that exist and take every character; gives stderr itself.

    A stream that was closed when the program began reads as empty, drops diagnostics, and refuses an answer. Otherwise
    the next file that opens would take its number, and receive the text.
    """
    for number, name, way in ((0, "stdin", os.O_RDONLY), (1, "stdout", os.O_RDONLY), (2, "stderr", os.O_WRONLY)):
        if getattr(sys, name) is None:
            handle = os.open(os.devnull, way)  # the least free number, which is that of the stream
            setattr(sys, name, os.fdopen(handle, "w" if number else "r", encoding="utf-8"))
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # a narrow encoding must not lose a result
    given = out = sys.stdout
    if isinstance(getattr(given, "buffer", None), io.RawIOBase):  # python -u loses the rest of what a signal interrupts
        out = os.fdopen(given.fileno(), "w", encoding=given.encoding, errors="replace", closefd=False)
    err = sys.stderr
    sys.stdout = cast(TextIO, _Stream(out))
    sys.stderr = cast(TextIO, _Stream(err, OSError, ValueError))
    try:
        yield err
    finally:
        sys.stdout, sys.stderr = given, err
        for stream in (out, err):
            try:
                stream.flush()
            except (OSError, ValueError):  # Python would try again at its end, and report it
                with suppress(OSError, ValueError):
                    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _loses_exceptions(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code in _LOADING or frame.f_globals.get("__name__") == _CASADI:
            return True
        frame = frame.f_back
    return False
