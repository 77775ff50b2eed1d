"""A process for calls of SCIP, which may crash or must end at a deadline.

It does not use `multiprocessing`, because Dask workers may not have such children.
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
    """The process ended before it answered."""


class Killable:
    """A process that makes one call at a time. It ignores Ctrl-C, and ends with this program even after a crash.

    Args:
        prepare: called there first; its exceptions are ignored.
    """

    def __init__(self, prepare: Callable[[], object] = bool) -> None:
        self._process = start()
        with suppress(OSError):  # it has ended: the first call raises that
            self._send(prepare)

    def _send(self, message: object) -> None:
        pickle.dump(message, self._process.stdin)
        self._process.stdin.flush()

    def call(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """A future of the result or exception of a call in the process; `ProcessEnded` if it does not answer."""
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
            with suppress(OSError):  # unsent data in the pipe
                pipe.close()


def start() -> Any:
    """Start a process that runs `serve`, with this import path; it does not run the user's script again."""
    code = "import sys; sys.path[:] = sys.argv[1:]; from tmsopt.killable import serve; serve()"
    return subprocess.Popen(
        [sys.executable, "-c", code, *sys.path],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,  # Ctrl-C does not reach it; some schedulers share time between sessions
    )


def serve() -> None:
    """Answer calls until the parent ends, even during a call."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    calls, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    silence = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1):  # printed text must not reach the pipe of answers
        os.dup2(silence, stream)
    queue = SimpleQueue[Any]()
    threading.Thread(target=_listen, args=(calls, queue), daemon=True).start()
    with suppress(Exception):
        queue.get()()
    while True:
        function, arguments = queue.get()
        answer, error = None, None
        try:
            answer = function(*arguments)
        except Exception as raised:
            error = raised
        with suppress(OSError):  # the parent has ended
            pickle.dump((answer, error), answers, protocol=pickle.HIGHEST_PROTOCOL)
            answers.flush()


def _listen(calls: IO[bytes], queue: SimpleQueue[Any]) -> None:
    while True:
        try:
            queue.put(pickle.load(calls))
        except (EOFError, OSError):
            os._exit(0)
