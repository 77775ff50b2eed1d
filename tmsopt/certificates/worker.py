"""A process that runs SCIP: questions in on its standard input, decisions out on its standard output, pickled.

SCIP can crash, and two of it in the threads of one process do. In a process of its own it takes nothing with it, can be
stopped at any moment, and what it prints is not seen.
"""

import os
import pickle
import queue
import threading
from typing import IO, Any

from tmsopt.arithmetic.walk import NotAccepted
from tmsopt.certificates.scip import Decision, Task, decide


def serve() -> None:
    """Answer until there are no more questions."""
    questions, decisions = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    silence = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(silence, stream)
    waiting: queue.SimpleQueue[Any] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(questions, waiting), daemon=True).start()
    while True:
        task = waiting.get()
        assert isinstance(task, Task)
        try:
            answer: Decision | NotAccepted = decide(task)
        except NotAccepted as error:
            answer = error
        pickle.dump(answer, decisions)
        decisions.flush()


def _listen(questions: IO[bytes], waiting: "queue.SimpleQueue[Any]") -> None:
    """Pass questions on; end the process when there is nobody left to answer to."""
    while True:
        try:
            waiting.put(pickle.load(questions))
        except (EOFError, OSError):
            os._exit(0)


if __name__ == "__main__":
    serve()
