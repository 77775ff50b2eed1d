"""Processes that can be killed: workers of executors, and the solver SCIP, which may crash and has a time limit.

They do not use `multiprocessing`, because Dask workers may not have such child processes.
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

from tmsopt.threads import ONE_THREAD


class ProcessEnded(RuntimeError):
    """The process ended before it answered."""


class KillableProcess:
    """A process that runs one call at a time. It ignores Ctrl-C, and ends when this program ends, even by a crash.

    Args:
        prepare: function that the process calls first; exceptions in it are ignored.
    """

    def __init__(self, prepare: Callable[[], object] = bool) -> None:
        self._process = start_process()
        with suppress(OSError):  # the process has ended; the first call then raises the error
            self._send(prepare)

    def _send(self, message: object) -> None:
        pickle.dump(message, self._process.stdin)
        self._process.stdin.flush()

    def answer(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Call a function in the process; return its result or raise its exception.

        Raises:
            ProcessEnded: if the process ends before it answers.
        """
        try:
            self._send((function, arguments))
            answer, error = pickle.load(self._process.stdout)
        except Exception as cause:
            raise ProcessEnded(str(cause)) from cause
        if error is not None:
            raise error
        return answer

    def call(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """Start a call in the process; the future gets its `answer`."""
        future = Future[Any]()

        def wait() -> None:
            try:
                future.set_result(self.answer(function, *arguments))
            except Exception as error:
                future.set_exception(error)

        threading.Thread(target=wait, daemon=True).start()
        return future

    def end(self) -> str:
        """Kill the process; return how it ended, such as ``signal 9``, or ``exit code 1`` if it had ended before."""
        self._process.kill()
        code = self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            with suppress(OSError):  # unsent data in the pipe
                pipe.close()
        return f"signal {-code}" if code < 0 else f"exit code {code}"


def start_process() -> Any:
    """Start a process that runs `serve_calls` with the import path of this process, without the user's script."""
    code = "import sys; sys.path[:] = sys.argv[1:]; from tmsopt.killable import serve_calls; serve_calls()"
    return subprocess.Popen(
        [sys.executable, "-c", code, *sys.path],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=os.environ | ONE_THREAD,
        start_new_session=True,  # Ctrl-C does not reach the process; some schedulers share time between sessions
    )


def serve_calls() -> None:
    """Answer calls until the parent process ends; then end, even during a call."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    calls, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    null_device = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1):  # printed text must not reach the pipe of answers
        os.dup2(null_device, stream)
    queue = SimpleQueue[Any]()
    threading.Thread(target=_listen, args=(calls, queue), daemon=True).start()
    with suppress(Exception):
        queue.get()()
    while True:
        function, arguments = queue.get()
        answer, error = None, None
        try:
            answer = function(*arguments)
        except Exception as exception:
            error = exception
        with suppress(OSError):  # the parent has ended
            pickle.dump((answer, error), answers, protocol=pickle.HIGHEST_PROTOCOL)
            answers.flush()


def _listen(calls: IO[bytes], queue: SimpleQueue[Any]) -> None:
    """Put the calls from the parent into a queue; end this process when the parent ends."""
    with suppress(Exception):  # the parent has ended, perhaps while it wrote, or a call cannot be loaded here
        while True:
            queue.put(pickle.load(calls))
    os._exit(1)
