"""What a worker process of this machine does."""

import os
import pickle
import signal
import threading
import time
from multiprocessing.connection import Connection
from queue import SimpleQueue

from tmsopt.studies.engines.work import Unit, attempt

READY = "ready"
"""The first message of a worker that has the work; any other text says why it has not."""


def serve(pipe: Connection, blob: bytes) -> None:
    """Solve the units that come by the pipe, in order, and send back each when it is finished.

    The other end closes when it needs no more or has been killed; then this process ends at once, in the middle of a
    unit if need be.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches every process of a terminal; the parent decides
    units: SimpleQueue[Unit] = SimpleQueue()
    threading.Thread(target=_listen, args=(pipe, units), daemon=True).start()
    try:
        try:
            work = pickle.loads(blob)
        except Exception as error:
            pipe.send(repr(error))
            return
        pipe.send(READY)
        while True:
            unit = units.get()
            started = time.perf_counter()
            rows = attempt(work, unit)
            pipe.send((unit, rows, time.perf_counter() - started))
    except OSError:  # nobody reads any more
        os._exit(0)


def _listen(pipe: Connection, units: SimpleQueue[Unit]) -> None:
    while True:
        try:
            batch = pipe.recv()
        except (EOFError, OSError):
            os._exit(0)
        for unit in batch:
            units.put(unit)
