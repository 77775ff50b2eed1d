"""The definition of a study as data: kept compactly, and what differs between two of them."""

import json
import sys
import zlib
from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isnan
from typing import Any

COLUMNS = "columns"
"""The key of a definition that holds name → one number per row."""

_WIDTH = 80  # of a value in a message


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
        return Definition(json.loads(json.dumps(plain)), {name: array("d", values) for name, values in columns.items()})

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``, columns as lists."""
        return self.plain | ({COLUMNS: {name: values.tolist() for name, values in self.columns.items()}})


def pack(values: "array[float]") -> bytes:
    """Doubles as compressed little-endian bytes."""
    return zlib.compress(_little(values).tobytes(), 1)


def unpack(packed: bytes) -> "array[float]":
    """What `pack` made.

    Raises:
        ValueError, zlib.error: for bytes that are damaged.
    """
    values = array("d")
    values.frombytes(zlib.decompress(packed))
    return _little(values)


def differences(store: Definition, file: Definition) -> list[str]:
    """What differs between two definitions, one line each; none where they define the same study."""
    return [*_plain("", store.plain, file.plain), *_columns(store.columns, file.columns)]


def _plain(place: str, one: Any, other: Any) -> Iterator[str]:
    if isinstance(one, dict) and isinstance(other, dict):
        for name in dict.fromkeys([*one, *other]):
            inner = f"{place}.{name}" if place else name
            if name not in one:
                yield f"{inner}: absent in the store, {_shown(other[name])} in the file"
            elif name not in other:
                yield f"{inner}: {_shown(one[name])} in the store, absent in the file"
            else:
                yield from _plain(inner, one[name], other[name])
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for index, (a, b) in enumerate(zip(one, other, strict=True)):
            yield from _plain(f"{place}[{index}]", a, b)
    elif not _same(one, other):
        yield f"{place}: {_shown(one)} in the store, {_shown(other)} in the file"


def _columns(one: Mapping[str, Sequence[float]], other: Mapping[str, Sequence[float]]) -> Iterator[str]:
    for name in dict.fromkeys([*one, *other]):
        place = f"{COLUMNS}.{name}"
        if name not in one or name not in other:
            there = [f"{len(columns[name])} values" if name in columns else "absent" for columns in (one, other)]
            yield f"{place}: {there[0]} in the store, {there[1]} in the file"
            continue
        a, b = one[name], other[name]
        if len(a) != len(b):
            yield f"{place}: {len(a)} values in the store, {len(b)} in the file"
        if array("d", a).tobytes() == array("d", b).tobytes():
            continue
        differ = [row for row, (x, y) in enumerate(zip(a, b, strict=False)) if not _same(x, y)]
        if differ:
            first = differ[0]
            values = f"{a[first]!r} in the store, {b[first]!r} in the file"
            yield f"{place}: {len(differ)} of {min(len(a), len(b))} values differ, the first in row {first}: {values}"


def _same(a: Any, b: Any) -> bool:
    """Equal as a study sees it: 1 is 1.0, but 0.0 is not −0.0, true is not 1, and nan is nan."""
    if isinstance(a, bool) or isinstance(b, bool) or not (isinstance(a, int | float) and isinstance(b, int | float)):
        return type(a) is type(b) and bool(a == b)
    return repr(float(a)) == repr(float(b)) and (a == b or isnan(a))


def _shown(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= _WIDTH else f"{text[: _WIDTH - 1]}…"


def _little(values: "array[float]") -> "array[float]":
    if sys.byteorder == "big":
        values = values[:]
        values.byteswap()
    return values
