"""A row as a line of the store, with a checksum: SQLite itself does not notice a changed bit."""

import json
import zlib

from tmsopt.disk import from_json
from tmsopt.errors import Fault, InputError
from tmsopt.studies.row import Row

Line = tuple[int, str, int, str]

LONGEST = 1_000_000
"""Characters of a row."""

SELECT = (
    "SELECT number, CAST(substr(status, 1, 20) AS BLOB), checksum, "
    f"CAST(substr(data, 1, {LONGEST + 1}) AS BLOB) FROM rows"
)
"""The lines as `unpacked` takes them: as bytes, since damaged text may be no text, cut where no row is as long."""


def packed(row: Row) -> Line:
    """Number, status, checksum of everything, and the row as JSON.

    Raises:
        InputError: for a row that is longer than any that is read.
    """
    data = json.dumps(row.to_json(), separators=(",", ":"))
    if len(data) > LONGEST:
        message = f"row {row.number} has {len(data)} characters; accepted: {LONGEST}; ask for fewer expressions"
        raise InputError([Fault(message, ("report",))])
    return row.number, row.status, _checksum(row.number, row.status.encode(), data.encode()), data


def unpacked(number: int, status: bytes, checksum: int, data: bytes) -> Row:
    """The row that `packed` was given.

    Raises:
        ValueError: when the line is damaged.
    """
    if None in (status, data) or _checksum(number, status, data) != checksum:
        raise ValueError("its checksum is wrong")
    row = Row.from_json(from_json(data.decode(), LONGEST))
    if (row.number, row.status) != (number, status.decode()):
        raise ValueError(f"it says to be row {row.number}, {row.status}")
    return row


def _checksum(number: int, status: bytes, data: bytes) -> int:
    return zlib.crc32(b"%d:%b:%b" % (number, status, data))
