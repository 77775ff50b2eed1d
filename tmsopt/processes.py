"""Worker processes: functions called in processes of their own, which may crash, and can be ended at any moment.

What a worker is told goes in by its standard input, pickled, and what comes of it goes to an inbox, which workers may
share. A worker never hears Ctrl-C, and ends with this program however that ends, in the midst of a call if need be.
"""

import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from queue import SimpleQueue
from typing import IO, Any

Inbox = SimpleQueue[tuple["Worker", Any]]
"""Workers, each with what a function returned there, as it comes; with None, once, when it has ended."""


def cores() -> int:
    """How many processes this one may keep busy: cores, less what affinity, quotas and LOKY_MAX_CPU_COUNT deny it."""
    import loky

    return int(loky.cpu_count())


class Worker:
    """A process that calls functions, one after the other; to be ended.

    Args:
        environment: variables set for it.
        apart: in a session of its own, to which systems give the time of one more user; its errors are not seen.
    """

    def __init__(self, inbox: Inbox, environment: Mapping[str, str] | None = None, apart: bool = False) -> None:
        self._process = start(environment or {}, apart)
        self._thread = threading.Thread(target=self._hear, args=(inbox,), daemon=True)
        self._thread.start()

    @property
    def name(self) -> str:
        """The id of the process."""
        return str(self._process.pid)

    def send(self, function: Callable[..., Any], *arguments: Any) -> None:
        """Have a function called when those before it are done; what it returns comes to the inbox, unless it is None.

        A function that raises ends the process.
        """
        call = pickle.dumps((function, arguments), protocol=pickle.HIGHEST_PROTOCOL)
        with suppress(OSError):  # it has ended, as the inbox says
            pickle.dump(call, self._process.stdin)
            self._process.stdin.flush()

    def end(self, patience: float = 0.0) -> str:
        """How the process ended, ``signal 9`` or ``exit code 1``; killed if it does not end in so many seconds."""
        try:
            self._process.wait(patience)
        except subprocess.TimeoutExpired:
            self._process.kill()
        self._thread.join()
        with suppress(OSError), self._process:  # closes the pipes; what is left in one of them cannot be sent
            pass
        code = self._process.wait()
        return f"signal {-code}" if code < 0 else f"exit code {code}"

    def _hear(self, inbox: Inbox) -> None:
        try:
            while True:
                inbox.put((self, pickle.load(self._process.stdout)))
        except (EOFError, OSError, pickle.UnpicklingError):
            pass
        finally:
            inbox.put((self, None))


def start(environment: Mapping[str, str], apart: bool) -> Any:
    """A process that serves. It finds what this one finds, but neither copies it nor runs its script again."""
    code = "import sys; sys.path[:] = sys.argv[1:]; from tmsopt.processes import serve; serve()"
    return subprocess.Popen(
        [sys.executable, "-c", code, *sys.path],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL if apart else None,
        env=os.environ | environment,
        start_new_session=apart,
        process_group=None if apart else 0,  # Ctrl-C reaches every process of the group that a terminal runs
    )


def serve() -> None:
    """What a worker does: it calls what it is told to, until there is nobody left to answer to."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    calls, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    silence = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1):  # what is printed is no answer
        os.dup2(silence, stream)
    waiting: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_listen, args=(calls, waiting), daemon=True).start()
    while True:
        function, arguments = pickle.loads(waiting.get())
        answer = function(*arguments)
        if answer is not None:
            with suppress(OSError):  # nobody reads any more
                pickle.dump(answer, answers, protocol=pickle.HIGHEST_PROTOCOL)
                answers.flush()


def _listen(calls: IO[bytes], waiting: SimpleQueue[bytes]) -> None:
    while True:
        try:
            waiting.put(pickle.load(calls))
        except (EOFError, OSError):
            os._exit(0)
