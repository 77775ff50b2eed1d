"""A row as a line of the store, with a checksum: SQLite itself does not notice a changed bit."""

import json
import zlib

from tmsopt.studies.row import Row

Line = tuple[int, str, int, str]

SELECT = "SELECT number, CAST(status AS BLOB), checksum, CAST(data AS BLOB) FROM rows"
"""The lines as `unpacked` takes them: as bytes, since damaged text may be no text."""


def packed(row: Row) -> Line:
    """Number, status, checksum of everything, and the row as JSON."""
    data = json.dumps(row.to_json(), separators=(",", ":"))
    return row.number, row.status, _checksum(row.number, row.status.encode(), data.encode()), data


def unpacked(number: int, status: bytes, checksum: int, data: bytes) -> Row:
    """The row that `packed` was given.

    Raises:
        ValueError: when the line is damaged.
    """
    try:
        if _checksum(number, status, data) == checksum:
            return Row.from_json(json.loads(data))
    except TypeError as error:
        raise ValueError(str(error)) from error
    raise ValueError("its checksum is wrong")


def _checksum(number: int, status: bytes, data: bytes) -> int:
    return zlib.crc32(b"%d:%b:%b" % (number, status, data))
