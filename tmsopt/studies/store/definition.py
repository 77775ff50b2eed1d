"""The definition of a study as data, kept compactly."""

import json
import sys
import zlib
from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

COLUMNS = "columns"
"""The key of a definition that holds name → one number per row."""


@dataclass(frozen=True)
class Definition:
    """What defines a study: its columns as doubles, everything else as JSON data."""

    plain: dict[str, Any]
    columns: dict[str, "array[float]"]

    @staticmethod
    def of(data: Mapping[str, Any]) -> "Definition":
        """From plain data; tuples become lists, and whole numbers in columns doubles."""
        columns = data.get(COLUMNS, {})
        plain = {name: value for name, value in data.items() if name != COLUMNS}
        made = {name: v if isinstance(v, array) else array("d", v) for name, v in columns.items()}
        return Definition(json.loads(json.dumps(plain)), made)

    @property
    def data(self) -> dict[str, Any]:
        """Everything, for `disk.differences`."""
        return self.plain | {COLUMNS: self.columns}

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``, columns as lists."""
        return self.plain | {COLUMNS: {name: values.tolist() for name, values in self.columns.items()}}


def doubles(values: Sequence[float]) -> "array[float]":
    """Numbers as a column of a definition."""
    return array("d", np.asarray(values, dtype=np.float64).tobytes())


def pack(values: "array[float]") -> bytes:
    """Doubles as compressed little-endian bytes."""
    return zlib.compress(_little(values).tobytes(), 1)


def unpack(packed: bytes, count: int) -> "array[float]":
    """What `pack` made of so many numbers; a few bytes may say that they are many more.

    Raises:
        ValueError, zlib.error: for bytes that are damaged.
    """
    values, stream = array("d"), zlib.decompressobj()
    values.frombytes(stream.decompress(packed, 8 * count + 1))
    if len(values) != count or not stream.eof or stream.unused_data:
        raise ValueError(f"no {count} numbers")
    return _little(values)


def _little(values: "array[float]") -> "array[float]":
    if sys.byteorder == "big":
        values = values[:]
        values.byteswap()
    return values
