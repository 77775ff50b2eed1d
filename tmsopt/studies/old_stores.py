"""Stores of tmsopt 1.0 and 1.1 (schemas 1 and 2) as columns.

Schema 1 has a line of JSON for each row. Schema 2 also has blocks of rows evaluated together, with columns as bytes.
"""

import sqlite3
import zlib
from collections.abc import Iterator

import numpy as np

from tmsopt.files import from_json
from tmsopt.studies.rows import Batch, Row, batch_rows
from tmsopt.studies.solving import evaluated_batch

_LONGEST = 1_000_000  # characters of a row, or of the head of a block
_CHUNK = 1000  # rows copied at once


def read_columns(old: sqlite3.Connection) -> dict[str, bytes]:
    """The columns of the study as little-endian doubles.

    Raises:
        ValueError: for damaged columns.
    """
    found = old.execute("SELECT name, count, doubles FROM columns").fetchall()
    return {name: _unpack(count, doubles) for name, count, doubles in found}


def read_batches(old: sqlite3.Connection) -> Iterator[Batch]:
    """The rows of the store.

    Raises:
        ValueError, KeyError, TypeError: for damaged rows.
    """
    lines = old.execute("SELECT data FROM rows ORDER BY number")
    while some := lines.fetchmany(_CHUNK):
        yield batch_rows([Row.from_json(from_json(data, _LONGEST)) for (data,) in some])
    if old.execute("SELECT 1 FROM sqlite_schema WHERE name = 'blocks'").fetchall():
        for (data,) in old.execute("SELECT data FROM blocks ORDER BY first"):
            yield _unpack_block(data)


def _unpack(count: int, doubles: bytes) -> bytes:
    """A column of the study; the size is limited, because few bytes can decompress to very many."""
    stream = zlib.decompressobj()
    try:
        values = stream.decompress(doubles, 8 * count + 1)
    except zlib.error as error:
        raise ValueError(str(error)) from error
    if len(values) != 8 * count or not stream.eof:
        raise ValueError(f"found other than {count} numbers")
    return values


def _unpack_block(data: bytes) -> Batch:
    """A block: a line of JSON, the numbers of the rows, and the columns."""
    line, _, rest = data.partition(b"\n")
    head = from_json(line.decode(), _LONGEST)
    count = int(head["rows"])
    numbers, *columns = np.frombuffer(rest, "<f8").reshape(-1, count)
    given = {name: values for name, values in zip(head["columns"], columns, strict=True) if name[:7] != "varied."}
    return evaluated_batch(numbers.view("<i8"), given, float(head["seconds"]), str(head["host"]))
