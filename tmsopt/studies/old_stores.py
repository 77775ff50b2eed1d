"""Stores of tmsopt 1.0 and 1.1 (schemas 1 and 2) as columns.

Schema 1 has a line of JSON for each row. Schema 2 also has blocks of rows evaluated together, with columns as bytes.
"""

import sqlite3
import zlib
from collections.abc import Generator
from contextlib import closing

import numpy as np

from tmsopt.files import from_json
from tmsopt.studies.rows import Batch, Row, batch_rows
from tmsopt.studies.solving import evaluated_batch

_LONGEST = 1_000_000  # characters of a row, or of the head of a block
_CHUNK = 1000  # rows copied at once


def read_columns(old: sqlite3.Connection) -> dict[str, bytes]:
    """The columns of the study as little-endian doubles.

    Raises:
        zlib.error: for damaged columns.
    """
    found = old.execute("SELECT name, doubles FROM columns").fetchall()
    return {name: zlib.decompress(doubles) for name, doubles in found}


def read_batches(old: sqlite3.Connection) -> Generator[Batch]:
    """The rows of the store.

    Raises:
        ValueError, KeyError, TypeError: for damaged rows.
    """
    with closing(old.execute("SELECT data FROM rows ORDER BY number")) as lines:
        while some := lines.fetchmany(_CHUNK):
            yield batch_rows([Row.from_json(from_json(data, _LONGEST)) for (data,) in some])
    if old.execute("SELECT 1 FROM sqlite_schema WHERE name = 'blocks'").fetchall():
        with closing(old.execute("SELECT data FROM blocks ORDER BY first")) as blocks:
            for (data,) in blocks:
                yield _unpack_block(data)


def _unpack_block(data: bytes) -> Batch:
    """A block: a line of JSON, the numbers of the rows, and the columns."""
    line, _, rest = data.partition(b"\n")
    head = from_json(line.decode(), _LONGEST)
    count = int(head["rows"])
    numbers, *columns = np.frombuffer(rest, "<f8").reshape(-1, count)
    given = {name: values for name, values in zip(head["columns"], columns, strict=True) if name[:7] != "varied."}
    return evaluated_batch(numbers.view("<i8"), given, float(head["seconds"]), str(head["host"]))
