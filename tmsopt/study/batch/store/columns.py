"""Rows as flat columns: one header for all, blanks where a row has no value."""

from array import array
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.study.batch.row import Row

PREFIXES = {"varied": "varied.", "parameters": "", "reports": "report.", "laws": "law.", "violations": "violation."}
"""Of the header for the names in each table of a row. Parameters have none; one called as a field of the row, such as
``seed``, is ``parameter.seed``. The header of a value so depends on nothing but its own name."""

_FIELDS = {f.name: f.type for f in fields(Row)}
_LARGEST = 2**63 - 1


@dataclass(frozen=True)
class Column:
    """The values of one name, one per row.

    Attributes:
        values: of float, int or bool; an object array of strings; nan where a number is absent.
        present: which rows have a value: nan may also be one.
    """

    values: NDArray[Any]
    present: NDArray[np.bool_]


def columns(rows: Iterable[Row]) -> dict[str, Column]:
    """Header → column, in the order of the fields of a row; 8 bytes per number while they are collected."""
    plain: dict[str, list[Any] | array[float]] = {
        name: array("d") if kind is float else [] for name, kind in _FIELDS.items() if name not in PREFIXES
    }
    tables: dict[str, dict[str, _Sparse]] = {name: {} for name in PREFIXES}
    count = 0
    for row in rows:
        for name, values in plain.items():
            values.append(getattr(row, name))
        for name, found in tables.items():
            _collect(found, getattr(row, name), count)
        count += 1
    everywhere = np.ones(count, dtype=bool)
    made: dict[str, Column] = {}
    for name, kind in _FIELDS.items():
        if name in plain:
            made[name] = Column(_array(plain[name], kind), everywhere)
        else:
            made |= {header(name, key): sparse.full(count) for key, sparse in tables[name].items()}
    return made


def header(table: str, key: str) -> str:
    """Of the values of one name in one table of the rows."""
    return f"parameter.{key}" if table == "parameters" and key in _FIELDS else f"{PREFIXES[table]}{key}"


class _Sparse:
    def __init__(self) -> None:
        self.values, self.places = array("d"), array("q")

    def full(self, count: int) -> Column:
        places = np.array(self.places, dtype=np.int64)
        values, present = np.full(count, np.nan), np.zeros(count, dtype=bool)
        values[places], present[places] = np.array(self.values), True
        return Column(values, present)


def _collect(found: dict[str, _Sparse], table: Mapping[str, float], place: int) -> None:
    for key, value in table.items():
        sparse = found.setdefault(key, _Sparse())
        sparse.values.append(value)
        sparse.places.append(place)


def _array(values: "list[Any] | array[float]", kind: Any) -> NDArray[Any]:
    if kind is int:
        fits = all(-_LARGEST <= v <= _LARGEST for v in values)  # a seed may be longer: then all are text
        return np.array(values, dtype=np.int64) if fits else np.array([str(v) for v in values], dtype=object)
    return np.array(values, dtype=object if kind is str else kind)
