"""Rows of a study as a table in a file: CSV, Parquet or netCDF."""

import csv
import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.errors import Fault, InputError, import_optional
from tmsopt.files import cell, headed, netcdf_errors, write_atomic
from tmsopt.progress import Listener, Steps, start_steps
from tmsopt.records import Array
from tmsopt.studies.rows import PREFIXES, Names, PartialColumn, Row, columns


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
    names: Names = MappingProxyType({}),
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
        with write_atomic(path) as temporary:
            steps = start_steps(progress, f"writing {path.name}", "row")
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
        import_optional(module, "export to a .csv file")


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
    pa, parquet = import_optional("pyarrow"), import_optional("pyarrow.parquet")
    arrays = {name: pa.array(c.values, _kind(pa, c), mask=~c.present, from_pandas=False) for name, c in table.items()}
    whole = pa.table(arrays).replace_schema_metadata({"tmsopt": metadata})
    with parquet.ParquetWriter(path, whole.schema) as writer:
        for first in _parts(len(whole), _GROUP, steps):
            writer.write_table(whole.slice(first, _GROUP))


def _kind(pa: Any, column: PartialColumn) -> Any:
    return pa.string() if column.values.dtype == object else pa.from_numpy_dtype(column.values.dtype)


def _netcdf(table: Mapping[str, PartialColumn], path: Path, metadata: str, _: Steps | None) -> None:
    xarray = import_optional("xarray")
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
    xarray, names, axes = import_optional("xarray"), _names(table), levels(table)
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
