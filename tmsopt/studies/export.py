"""Rows of a study as a table in a file: CSV, Parquet or netCDF."""

import csv
import json
import re
from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.disk import cell, headed, netcdf_errors, whole
from tmsopt.errors import Fault, InputError, needed
from tmsopt.progress import Listener, Steps, counted
from tmsopt.records import Array
from tmsopt.studies.judging import RowsInBlocks, table
from tmsopt.studies.row import Row

PREFIXES = {"varied": "varied.", "parameters": "", "reports": "report.", "laws": "law.", "violations": "violation."}
"""Of the header for the names in each table of a row. Parameters have none; one called as a field of the row, such as
``seed``, is ``parameter.seed``. The header of a value so depends on nothing but its own name."""
_FIELDS: dict[str, Any] = {}
for _field in fields(Row):
    _FIELDS[_field.name] = _field.type
    if _field.name == "structure":
        _FIELDS["stable"] = bool  # or None
_LARGEST = 2**63 - 1
Names = Mapping[str, Iterable[str]]
_NO_NAMES: Names = {}


@dataclass(frozen=True)
class PartialColumn:
    """The values of one name, one per row.

    Attributes:
        values: of float, int or bool; an object array of strings; nan where a number is absent.
        present: which rows have a value: nan may also be one.
    """

    values: NDArray[Any]
    present: NDArray[np.bool_]

    @property
    def numbers(self) -> NDArray[Any]:
        """The values; truths of which some are absent as 1, 0 and nan."""
        lacking = self.values.dtype == np.bool_ and not self.present.all()
        return np.where(self.present, self.values, np.nan) if lacking else self.values


class _Sparse:
    def __init__(self) -> None:
        self.values, self.places = array("d"), array("q")

    def full(self, count: int) -> PartialColumn:
        places = np.array(self.places, dtype=np.int64)
        values, present = np.full(count, np.nan), np.zeros(count, dtype=bool)
        values[places], present[places] = np.array(self.values), True
        return PartialColumn(values, present)


@dataclass(frozen=True)
class Format:
    """How rows are written to a file of one ending.

    Attributes:
        write: takes header → column, the path, metadata as JSON, and what counts.
        needs: modules that the extra ``data`` brings.
    """

    write: Callable[[Mapping[str, PartialColumn], Path, str, Steps | None], None]
    needs: tuple[str, ...] = ()


_CHUNK = 10_000  # rows turned into text at once
_GROUP = 2**16  # rows of Parquet written at once


def export(
    rows: Iterable[Row],
    path: Path | str,
    metadata: Mapping[str, Any] | None = None,
    names: Names = _NO_NAMES,
    progress: Listener | None = None,
) -> None:
    """Write rows to a file whose ending says how, one of `FORMATS`; doubles come back bit by bit.

    Headers are those of `columns`. A blank in CSV is nan or absent; Parquet has null for what is absent; netCDF nan, on
    the dimension ``row``, and where the rows fill a grid also in the group ``grid``, over the values that vary.

    Args:
        progress: called with a `tmsopt.Progress` now and then.
        names: that have a column anyway; see `columns`.
        metadata: plain data to go with the rows in Parquet (schema metadata, key ``tmsopt``) and netCDF (attribute
            ``tmsopt``), as JSON; `Store.about` makes it.

    Raises:
        InputError: for another ending, a missing package, or a file that cannot be written.
    """
    path = Path(path)
    check_export(path)
    try:
        with whole(path) as temporary:
            steps = counted(progress, f"writing {path.name}", "row")
            FORMATS[_ending(path)].write(columns(rows, names), temporary, json.dumps(metadata or {}), steps)
    except OSError as error:
        raise InputError([Fault(f"cannot be written: {error.strerror or error}", file=str(path))]) from error


def check_export(path: Path) -> None:
    """That rows can be exported to a file, before any work is done; imports what is needed for it.

    Raises:
        InputError: for another ending, a missing package or folder, or what is there and is no file.
    """
    if _ending(path) not in FORMATS:
        accepted = ", ".join(f".{e}" for e in FORMATS)
        raise InputError([Fault(f"found '{path}'; accepted: a file name ending in {accepted}", ("export",))])
    if (path.exists() and not path.is_file()) or not path.parent.is_dir():
        problem = "is no regular file" if path.exists() else "is in a folder that does not exist"
        raise InputError([Fault(f"'{path}' {problem}; give the path of a file to write", ("export",))])
    for module in FORMATS[_ending(path)].needs:
        needed(module, "export to a .csv file")


def _ending(path: Path) -> str:
    return path.suffix.lstrip(".").lower()


def _parts(count: int, each: int, steps: Steps | None) -> Iterator[int]:
    """Where parts of so many rows begin, counted as they are done."""
    for first in range(0, count, each):
        yield first
        if steps:
            steps(min(first + each, count), count)


def _csv(table: Mapping[str, PartialColumn], path: Path, metadata: str, steps: Steps | None) -> None:
    units = json.loads(metadata).get("units", {})
    columns = list(table.values())
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(cell(headed(name, units.get(_bare(name), ""))) for name in table)
        for first in _parts(len(columns[0].values), _CHUNK, steps):
            known: dict[bytes, list[str]] = {}  # columns may be equal, as the abscissa and the objective are
            some = [(c.values[first : first + _CHUNK], c.present[first : first + _CHUNK]) for c in columns]
            writer.writerows(zip(*(_texts(*part, known) for part in some), strict=True))


def _bare(header: str) -> str:
    """The name whose unit a column has: of what varies, is reported or violated, that without its prefix and end."""
    for prefix in (PREFIXES["varied"], PREFIXES["reports"], PREFIXES["violations"]):
        header = header.removeprefix(prefix)
    return re.sub(r"\.(min|max|limit)$", "", header)


def _texts(values: NDArray[Any], present: NDArray[np.bool_], known: dict[bytes, list[str]]) -> list[str]:
    if values.dtype == np.bool_:
        return [("true" if v else "false") if p else "" for v, p in zip(values.tolist(), present.tolist(), strict=True)]
    if values.dtype != np.float64:
        cells = {v: cell(v) if isinstance(v, str) else str(v) for v in set(values.tolist())}
        return [cells[v] for v in values.tolist()]
    if (key := values.tobytes()) not in known:
        same = len(values) > 0 and key == key[:8] * len(values)
        some = values[:1] if same else values
        texts = ["" if v != v else repr(v) for v in some.tolist()]  # noqa: PLR0124
        known[key] = texts * len(values) if same else texts
    return known[key]


def _parquet(table: Mapping[str, PartialColumn], path: Path, metadata: str, steps: Steps | None) -> None:
    pa, parquet = needed("pyarrow"), needed("pyarrow.parquet")
    arrays = {name: pa.array(c.values, _kind(pa, c), mask=~c.present, from_pandas=False) for name, c in table.items()}
    whole = pa.table(arrays).replace_schema_metadata({"tmsopt": metadata})
    with parquet.ParquetWriter(path, whole.schema) as writer:
        for first in _parts(len(whole), _GROUP, steps):
            writer.write_table(whole.slice(first, _GROUP))


def _kind(pa: Any, column: PartialColumn) -> Any:
    return pa.string() if column.values.dtype == object else pa.from_numpy_dtype(column.values.dtype)


def _netcdf(table: Mapping[str, PartialColumn], path: Path, metadata: str, _: Steps | None) -> None:
    xarray = needed("xarray")
    names = _names(table)
    over_rows = {names[n]: ("row", c.numbers, {"long_name": n}) for n, c in table.items()}
    made = xarray.Dataset(over_rows, {"row": table["number"].values}, {"tmsopt": metadata})
    with netcdf_errors():
        made.to_netcdf(path, engine="netcdf4", encoding={name: {"_FillValue": None} for name in made.variables})
        if (made := gridded(table)) is not None:
            encoding = {name: {"_FillValue": None} for name in made.variables}
            made.to_netcdf(path, mode="a", group="grid", engine="netcdf4", encoding=encoding)


def gridded(table: Mapping[str, PartialColumn]) -> Any:
    """Rows that fill a grid as a dataset over the values that vary; None for others.

    Raises:
        InputError: where xarray is not installed.
    """
    xarray, names, axes = needed("xarray"), _names(table), levels(table)
    if not axes:
        return None
    order = np.argsort(places(table, axes))
    shape, axis_names = tuple(len(v) for v in axes.values()), [names[n] for n in axes]
    over_grid = {
        names[n]: (axis_names, c.numbers[order].reshape(shape), {"long_name": n})
        for n, c in table.items()
        if n not in axes
    }
    return xarray.Dataset(over_grid, {names[n]: v for n, v in axes.items()})


def _names(headers: Iterable[str]) -> dict[str, str]:
    """Header → name of a variable: netCDF knows no slash; ``row`` is the dimension. All differ."""
    made: dict[str, str] = {}
    for header in headers:
        name = header.replace("/", " over ").strip()
        while name in made.values() or name == "row":
            name += "_"
        made[header] = name
    return made


FORMATS: Mapping[str, Format] = {
    "csv": Format(_csv),
    "parquet": Format(_parquet, ("pyarrow", "pyarrow.parquet")),
    "nc": Format(_netcdf, ("xarray", "netCDF4")),
}
"""Ending → format; another one is added here."""


def columns(rows: Iterable[Row], names: Names = _NO_NAMES) -> Mapping[str, PartialColumn]:
    """Header → column, in the order of the fields of a row; 8 bytes per number while they are collected.

    Args:
        names: table of a row, such as ``laws`` → names that have a column whatever the rows have.
    """
    return _of_blocks(rows, names) if isinstance(rows, RowsInBlocks) else _of_each(rows, names)


def _of_blocks(rows: RowsInBlocks, names: Names) -> Mapping[str, PartialColumn]:
    """Columns made when they are asked for."""
    single, count = _of_each(rows.singles, _NO_NAMES), len(rows.singles)
    absent = PartialColumn(np.full(count, np.nan), np.zeros(count, dtype=bool))

    def made(of: Callable[..., Any], *names: str, header: str) -> Callable[[], PartialColumn]:
        alone = single.get(header, absent)
        return lambda: PartialColumn(*of(rows, *names, (alone.values, alone.present)))

    found: dict[str, Callable[[], PartialColumn]] = {}
    for name in _FIELDS:
        if name not in PREFIXES:
            found[name] = made(table.field, name, header=name)
            continue
        starts = {key: c.present for h, c in single.items() if (key := _key(name, h)) is not None}
        for key in dict.fromkeys([*names.get(name, ()), *table.keys(rows, name, starts)]):
            found[header(name, key)] = made(table.keyed, name, key, header=header(name, key))
    return table.Lazily(found)


def _key(of: str, head: str) -> str | None:
    """The name in a table of the rows that a header is of; None of another one's."""
    others = (*(p for p in PREFIXES.values() if p), "parameter.")
    if of != "parameters":
        return head.removeprefix(PREFIXES[of]) if head.startswith(PREFIXES[of]) else None
    if head.startswith("parameter.") and head.removeprefix("parameter.") in _FIELDS:
        return head.removeprefix("parameter.")
    return None if head in _FIELDS or head.startswith(others) else head


def _of_each(rows: Iterable[Row], names: Names) -> dict[str, PartialColumn]:
    plain: dict[str, list[Any] | array[float]] = {
        name: array("d") if kind is float else [] for name, kind in _FIELDS.items() if name not in PREFIXES
    }
    tables = {name: {key: _Sparse() for key in names.get(name, ())} for name in PREFIXES}
    count = 0
    for row in rows:
        for name, values in plain.items():
            values.append(getattr(row, name))
        for name, found in tables.items():
            _collect(found, getattr(row, name), count)
        count += 1
    made: dict[str, PartialColumn] = {}
    for name, kind in _FIELDS.items():
        if name in plain:
            present = (
                np.array([v is not None for v in plain[name]], bool) if name == "stable" else np.ones(count, dtype=bool)
            )
            made[name] = PartialColumn(_array(plain[name], kind), present)
        else:
            made |= {header(name, key): sparse.full(count) for key, sparse in tables[name].items()}
    return made


def header(table: str, key: str) -> str:
    """Of the values of one name in one table of the rows."""
    return f"parameter.{key}" if table == "parameters" and key in _FIELDS else f"{PREFIXES[table]}{key}"


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


def levels(columns: Mapping[str, PartialColumn]) -> dict[str, Array]:
    """Header → ascending values along that axis, where every combination of them is one row; else empty.

    What has one value in all rows is no axis.
    """
    varied = {name: c for name, c in columns.items() if name.startswith(PREFIXES["varied"])}
    if not varied or not all(c.present.all() and np.isfinite(c.values).all() for c in varied.values()):
        return {}
    found = {name: np.unique(c.values) for name, c in varied.items()}
    axes = {name: values for name, values in found.items() if len(values) > 1}
    count = len(next(iter(varied.values())).values)
    if not axes or np.prod([float(len(v)) for v in axes.values()]) != count:
        return {}
    return axes if len(np.unique(places(columns, axes))) == count else {}


def places(columns: Mapping[str, PartialColumn], axes: Mapping[str, Array]) -> NDArray[np.int64]:
    """Where each row stands in the grid, flattened with the last axis fastest."""
    indices = tuple(np.searchsorted(values, columns[name].values) for name, values in axes.items())
    return np.asarray(np.ravel_multi_index(indices, tuple(len(v) for v in axes.values())), dtype=np.int64)
