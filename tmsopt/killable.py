"""A process for calls that may crash or have to end at a deadline: of SCIP.

It is no child of `multiprocessing`, for workers of Dask may have none of those.
"""

import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from queue import SimpleQueue
from typing import IO, Any


class ProcessEnded(RuntimeError):
    """The process ended before it had an answer."""


class Killable:
    """A process that makes one call at a time. It never hears Ctrl-C, and ends with this program however that ends.

    Args:
        prepare: called there at once; what it raises is not heard.
    """

    def __init__(self, prepare: Callable[[], object] = bool) -> None:
        self._process = start()
        with suppress(OSError):  # it has ended, as its first call tells
            self._send(prepare)

    def _send(self, message: object) -> None:
        pickle.dump(message, self._process.stdin)
        self._process.stdin.flush()

    def call(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """What the function returns or raises there; `ProcessEnded` where the process does not answer."""
        future = Future[Any]()
        threading.Thread(target=self._exchange, args=(future, (function, arguments)), daemon=True).start()
        return future

    def _exchange(self, future: "Future[Any]", call: object) -> None:
        try:
            self._send(call)
            answer, error = pickle.load(self._process.stdout)
        except Exception as ended:
            answer, error = None, ProcessEnded(str(ended))
        if error is None:
            future.set_result(answer)
        else:
            future.set_exception(error)

    def end(self) -> None:
        """Kill the process."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            with suppress(OSError):  # what is left in it cannot be sent
                pipe.close()


def start() -> Any:
    """A process that serves. It finds what this one finds, but neither copies it nor runs its script again."""
    code = "import sys; sys.path[:] = sys.argv[1:]; from tmsopt.killable import serve; serve()"
    return subprocess.Popen(
        [sys.executable, "-c", code, *sys.path],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,  # out of reach of Ctrl-C; systems give its session the time of one more user
    )


def serve() -> None:
    """Make calls until nobody is left to answer to, even in the midst of one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    calls, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    silence = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1):  # what is printed is no answer
        os.dup2(silence, stream)
    waiting = SimpleQueue[Any]()
    threading.Thread(target=_listen, args=(calls, waiting), daemon=True).start()
    with suppress(Exception):
        waiting.get()()
    while True:
        function, arguments = waiting.get()
        answer, error = None, None
        try:
            answer = function(*arguments)
        except Exception as raised:
            error = raised
        with suppress(OSError):  # nobody reads any more
            pickle.dump((answer, error), answers, protocol=pickle.HIGHEST_PROTOCOL)
            answers.flush()


def _listen(calls: IO[bytes], waiting: SimpleQueue[Any]) -> None:
    while True:
        try:
            waiting.put(pickle.load(calls))
        except (EOFError, OSError):
            os._exit(0)
