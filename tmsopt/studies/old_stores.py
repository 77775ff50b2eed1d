"""Stores that tmsopt 1.0 and 1.1 wrote, of schemas 1 and 2, as columns.

Schema 1 has a line of JSON for each row; schema 2 also blocks of rows that were judged at once, their columns as bytes.
"""

import sqlite3
import zlib
from collections.abc import Generator
from contextlib import closing

import numpy as np

from tmsopt.files import from_json
from tmsopt.studies.rows import Part, Row, part_of
from tmsopt.studies.solving import judged_part

_LONGEST = 1_000_000  # characters of a row, or of the head of a block
_CHUNK = 1000  # rows copied at once


def about_of(old: sqlite3.Connection) -> dict[str, str]:
    """What a store says of itself."""
    return dict(old.execute("SELECT name, value FROM about ORDER BY rowid").fetchall())


def columns_of(old: sqlite3.Connection) -> dict[str, bytes]:
    """The columns of its study, as little-endian doubles.

    Raises:
        ValueError: for damaged ones.
    """
    found = old.execute("SELECT name, count, doubles FROM columns").fetchall()
    return {name: _unpacked(count, doubles) for name, count, doubles in found}


def parts_of(old: sqlite3.Connection) -> Generator[Part]:
    """Its rows.

    Raises:
        ValueError, KeyError, TypeError: for damaged ones.
    """
    with closing(old.execute("SELECT data FROM rows ORDER BY number")) as lines:
        while some := lines.fetchmany(_CHUNK):
            yield part_of([Row.from_json(from_json(data, _LONGEST)) for (data,) in some])
    if old.execute("SELECT 1 FROM sqlite_schema WHERE name = 'blocks'").fetchall():
        with closing(old.execute("SELECT data FROM blocks ORDER BY first")) as blocks:
            for (data,) in blocks:
                yield _part(data)


def _unpacked(count: int, doubles: bytes) -> bytes:
    """A column of the study; a few bytes may say that they are many more."""
    stream = zlib.decompressobj()
    try:
        values = stream.decompress(doubles, 8 * count + 1)
    except zlib.error as error:
        raise ValueError(str(error)) from error
    if len(values) != 8 * count or not stream.eof:
        raise ValueError(f"no {count} numbers")
    return values


def _part(data: bytes) -> Part:
    """A block: a line of JSON, then the numbers of the rows, then its columns."""
    line, _, rest = data.partition(b"\n")
    head = from_json(line.decode(), _LONGEST)
    count = int(head["rows"])
    numbers, *columns = np.frombuffer(rest, "<f8").reshape(-1, count)
    given = {name: values for name, values in zip(head["columns"], columns, strict=True) if name[:7] != "varied."}
    return judged_part(numbers.view("<i8"), given, float(head["seconds"]), str(head["host"]))
