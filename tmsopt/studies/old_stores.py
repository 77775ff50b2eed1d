"""Reads stores of tmsopt 1.0 and 1.1 (schemas 1 and 2).

Schema 1 has a line of JSON for each row. Schema 2 also has blocks of rows that were evaluated together. A block
consists of a head, which is a line of JSON, and of columns as bytes.
"""

import sqlite3
import zlib
from collections.abc import Generator
from contextlib import closing

import numpy as np

from tmsopt.files import from_json
from tmsopt.studies.rows import Batch, Row, batch_rows
from tmsopt.studies.solving import build_evaluated_batch

_MAX_LINE_LENGTH = 1_000_000  # largest number of characters of a row, or of the head of a block
_CHUNK_ROWS = 1000  # number of rows that are copied at once


def read_columns(old: sqlite3.Connection) -> dict[str, bytes]:
    """The columns of the study as little-endian doubles.

    Raises:
        zlib.error: for damaged columns.
    """
    columns = old.execute("SELECT name, doubles FROM columns").fetchall()
    return {name: zlib.decompress(doubles) for name, doubles in columns}


def read_batches(old: sqlite3.Connection) -> Generator[Batch]:
    """The rows of the store.

    Raises:
        ValueError, KeyError, TypeError: for damaged rows.
    """
    with closing(old.execute("SELECT data FROM rows ORDER BY number")) as lines:
        while chunk := lines.fetchmany(_CHUNK_ROWS):
            yield batch_rows([Row.from_json(from_json(data, _MAX_LINE_LENGTH)) for (data,) in chunk])
    if old.execute("SELECT 1 FROM sqlite_schema WHERE name = 'blocks'").fetchall():
        with closing(old.execute("SELECT data FROM blocks ORDER BY first")) as blocks:
            for (data,) in blocks:
                yield _unpack_block(data)


def _unpack_block(data: bytes) -> Batch:
    """The rows of a block, in which the row numbers are the first column."""
    line, _, body = data.partition(b"\n")
    head = from_json(line.decode(), _MAX_LINE_LENGTH)
    numbers, *columns = np.frombuffer(body, "<f8").reshape(-1, int(head["rows"]))
    table = {name: values for name, values in zip(head["columns"], columns, strict=True) if name[:7] != "varied."}
    return build_evaluated_batch(numbers.view("<i8"), table, float(head["seconds"]), str(head["host"]))
