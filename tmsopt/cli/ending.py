"""What ends a command from outside: signals, and streams that take no more. The one place that knows of them.

A signal raises KeyboardInterrupt, so that work that has something in hand leaves it, whatever the signal; a second one,
half a second later or more, ends all of that, and what is left of this process a second after it goes without a word.
The status is that of the signal, however the command would have ended.
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

from tmsopt.cli.terminal import erased, quiet

BAD_INPUT, INTERRUPTED, UNREAD = 2, 130, 141
"""Exit status: what cannot be written, Ctrl-C, a reader who has gone; as a shell tells it of programs."""

STATUS = """
Of every command: 1 a fault of tmsopt itself, 2 something cannot be written, 130 stopped by Ctrl-C, 143 by SIGTERM,
129 by SIGHUP, 141 the reader of the answer is gone. The best so far is written, where there is one.
"""
"""For the help of every command."""

_SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
_LOADING = {getattr(ExtensionFileLoader, name).__code__ for name in ("create_module", "exec_module")}
_CASADI = "casadi.casadi"  # its wrappers in Python; what is raised in one that compiled code called is dropped there
_NO_ROOM = {errno.ENOSPC, errno.EBADF, errno.EIO, errno.EFBIG}
_SOON = 0.01  # seconds
_AGAIN = 0.5  # seconds in which the same is told twice, as by timeout(1), to a process and to its group
_LEFT = 1.0  # seconds for tidying up after a second signal


class Heard:
    """Signals of one command.

    Attributes:
        number: of the first one; None before.
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Begin anew."""
        self.number: int | None = None
        self._held, self._due, self._again = False, False, 0.0

    @property
    def status(self) -> int:
        """The exit status of a program that a signal ended."""
        return 128 + (self.number or 0)

    def hear(self, number: int, frame: FrameType | None) -> None:
        """The handler."""
        if self.number is not None and time.monotonic() < self._again:
            return
        if self.number is not None:
            threading.Thread(target=self._gone, daemon=True).start()
            raise SystemExit(self.status)
        self.number, self._due, self._again = number, True, time.monotonic() + _AGAIN
        self.raised(number, frame)

    def raised(self, _number: int, frame: FrameType | None) -> None:
        """Raise what is due, now or soon: compiled modules being loaded make another error of it, CasADi loses it."""
        if not self._due or self._held:
            return
        if _deaf(frame) and hasattr(signal, "setitimer"):
            signal.signal(signal.SIGALRM, self.raised)
            signal.setitimer(signal.ITIMER_REAL, _SOON)
            return
        self._due = False
        raise KeyboardInterrupt

    def lost(self, event: Any) -> None:
        """What to do with an exception that cannot be raised where it was: once more, if it is ours."""
        if self.number is None or not isinstance(event.exc_value, KeyboardInterrupt):
            sys.__unraisablehook__(event)
        elif hasattr(signal, "setitimer"):
            self._due = True
            signal.signal(signal.SIGALRM, self.raised)
            signal.setitimer(signal.ITIMER_REAL, _SOON)

    @contextmanager
    def held(self) -> Iterator[None]:
        """While an answer is written, which is short, the first signal waits."""
        self._held = True
        try:
            yield
        finally:
            self._held = False
        self.raised(0, None)

    def _gone(self) -> None:
        threading.Event().wait(_LEFT)
        erasing = threading.Thread(target=erased, daemon=True)
        erasing.start()
        erasing.join(_LEFT)  # a terminal that was stopped takes nothing
        os._exit(self.status)


_HEARD = Heard()


def answering() -> Any:
    """A context in which an answer is written as a whole: what is in hand is not lost to a signal any more."""
    return _HEARD.held()


@contextmanager
def listening(for_good: bool) -> Iterator[Heard]:
    """Hear signals, but for those that whoever started this program has it ignore.

    Args:
        for_good: the process ends after it: what is heard then comes too late to change its status.
    """
    _HEARD.forget()
    if threading.current_thread() is not threading.main_thread():
        yield _HEARD
        return
    before = {number: signal.getsignal(number) for number in _SIGNALS}
    before = {number: handler for number, handler in before.items() if handler not in (signal.SIG_IGN, None)}
    hook, sys.unraisablehook = sys.unraisablehook, _HEARD.lost
    for number in before:
        signal.signal(number, _HEARD.hear)
    try:
        yield _HEARD
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_IGN if for_good else handler)
        sys.unraisablehook = hook


def gone(status: int) -> None:
    """End now: Python would wait for threads at work, such as a compiler, and where an exec was interrupted, as those
    of dataclasses are while modules are loaded, it would end by SIGINT, whatever the signal and the status."""
    atexit._run_exitfuncs()
    os._exit(status)


@contextmanager
def ended() -> Iterator[None]:
    """What ends a command from outside, as one line on stderr and an exit status."""
    try:
        yield
    except KeyboardInterrupt:
        print("stopped; what was printed before stands", file=sys.stderr)
        sys.exit(INTERRUPTED)
    except BrokenPipeError:
        sys.exit(UNREAD)  # quietly, as a program that knows nothing of it
    except OSError as error:
        reason = error.strerror or error
        if error.filename:
            said = f"'{error.filename}' cannot be read or written: {reason}"
        elif error.errno in _NO_ROOM:
            said = f"the answer cannot be written: {reason}; give a file or a device with room"
        else:
            said = f"the system refuses what is needed: {reason}"
        print(said, file=sys.stderr)
        sys.exit(BAD_INPUT)


class _Diagnostics:
    """A stream on which nothing fails: what cannot be said must not become of more weight than the answer."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write, if anybody takes it, where progress is shown before."""
        with quiet(), suppress(OSError, ValueError):
            self._stream.write(text)
        return len(text)

    def flush(self) -> None:
        """Likewise."""
        with suppress(OSError, ValueError):
            self._stream.flush()


@contextmanager
def streams() -> Iterator[TextIO]:
    """Streams that are there and take every character, and stderr itself; what one takes not in the end goes nowhere.

    What was closed when the program began reads as empty, hears what is said, and refuses an answer. Otherwise the next
    file that is opened would stand in its place, and be written into.
    """
    for number, name, way in ((0, "stdin", os.O_RDONLY), (1, "stdout", os.O_RDONLY), (2, "stderr", os.O_WRONLY)):
        if getattr(sys, name) is None:
            handle = os.open(os.devnull, way)  # the least number that is free, which is that of the stream
            setattr(sys, name, os.fdopen(handle, "w" if number else "r", encoding="utf-8"))
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # a narrow terminal encoding must not lose a result
    given = sys.stdout
    if isinstance(getattr(given, "buffer", None), io.RawIOBase):  # python -u loses the rest of what a signal interrupts
        sys.stdout = os.fdopen(given.fileno(), "w", encoding=given.encoding, errors="replace", closefd=False)
    out, err = sys.stdout, sys.stderr
    sys.stderr = cast(TextIO, _Diagnostics(err))
    try:
        yield err
    finally:
        sys.stdout, sys.stderr = given, err
        for stream in (out, err):
            try:
                stream.flush()
            except (OSError, ValueError):  # Python would try again when it ends, and say so
                with suppress(OSError, ValueError):
                    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _deaf(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code in _LOADING or frame.f_globals.get("__name__") == _CASADI:
            return True
        frame = frame.f_back
    return False
