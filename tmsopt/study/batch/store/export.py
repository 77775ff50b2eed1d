"""Rows of a study as a table in a file: CSV, Parquet or netCDF."""

import csv
import json
from collections.abc import Callable, Iterable, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from tmsopt.disk import whole
from tmsopt.errors import Fault, InputError
from tmsopt.study.batch.row import Row
from tmsopt.study.batch.store.columns import Column, columns
from tmsopt.study.batch.store.grid import levels, places

ENDINGS = ("csv", "parquet", "nc")

_CHUNK = 10_000  # rows turned into text at once


def export(rows: Iterable[Row], path: Path | str, metadata: Mapping[str, Any] | None = None) -> None:
    """Write rows to a file whose ending says how: ``.csv``, ``.parquet`` or ``.nc``; doubles come back bit by bit.

    Headers are those of `columns`. A blank in CSV is nan or absent; Parquet has null for what is absent; netCDF nan, on
    the dimension ``row``, and where the rows fill a grid also in the group ``grid``, over the values that vary.

    Args:
        metadata: plain data to go with the rows in Parquet (schema metadata, key ``tmsopt``) and netCDF (attribute
            ``tmsopt``), as JSON; `Store.about` makes it.

    Raises:
        InputError: for another ending, a missing package, or a file that cannot be written.
    """
    path = Path(path)
    check_export(path)
    try:
        with whole(path) as temporary:
            _WRITERS[_ending(path)](columns(rows), temporary, json.dumps(metadata or {}))
    except OSError as error:
        raise InputError([Fault(f"cannot be written: {error.strerror or error}", file=str(path))]) from error


def check_export(path: Path) -> None:
    """That rows can be exported to a file, before any work is done; imports what is needed for it.

    Raises:
        InputError: for another ending, a missing package or folder, or what is there and is no file.
    """
    if _ending(path) not in _WRITERS:
        accepted = ", ".join(f".{e}" for e in ENDINGS)
        raise InputError([Fault(f"found '{path}'; accepted: a file name ending in {accepted}", ("export",))])
    if (path.exists() and not path.is_file()) or not path.parent.is_dir():
        problem = "is no regular file" if path.exists() else "is in a folder that does not exist"
        raise InputError([Fault(f"'{path}' {problem}; give the path of a file to write", ("export",))])
    for module in _NEEDED.get(_ending(path), ()):
        _needed(module)


def _ending(path: Path) -> str:
    return path.suffix.lstrip(".").lower()


def _csv(table: Mapping[str, Column], path: Path, _: str) -> None:
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(table)
        for first in range(0, len(next(iter(table.values())).values), _CHUNK):
            texts = [_texts(c.values[first : first + _CHUNK]) for c in table.values()]
            writer.writerows(zip(*texts, strict=True))


def _texts(values: np.ndarray[Any, Any]) -> list[str]:
    if values.dtype == np.bool_:
        return ["true" if v else "false" for v in values.tolist()]
    if values.dtype == np.float64:
        return ["" if v != v else repr(v) for v in values.tolist()]  # noqa: PLR0124
    return [str(v) for v in values.tolist()]


def _parquet(table: Mapping[str, Column], path: Path, metadata: str) -> None:
    pa, parquet = _needed("pyarrow"), _needed("pyarrow.parquet")
    arrays = {name: pa.array(c.values, _kind(pa, c), mask=~c.present, from_pandas=False) for name, c in table.items()}
    parquet.write_table(pa.table(arrays).replace_schema_metadata({"tmsopt": metadata}), path)


def _kind(pa: Any, column: Column) -> Any:
    return pa.string() if column.values.dtype == object else pa.from_numpy_dtype(column.values.dtype)


def _netcdf(table: Mapping[str, Column], path: Path, metadata: str) -> None:
    xarray = _needed("xarray")
    rows = table["number"].values
    names = _names(table)
    try:
        over_rows = {names[n]: ("row", c.values, {"long_name": n}) for n, c in table.items()}
        made = xarray.Dataset(over_rows, {"row": rows}, {"tmsopt": metadata})
        made.to_netcdf(path, engine="netcdf4", encoding={name: {"_FillValue": None} for name in made.variables})
        axes = levels(table)
        if axes:
            order = np.argsort(places(table, axes))
            shape, axis_names = tuple(len(v) for v in axes.values()), [names[n] for n in axes]
            over_grid = {
                names[n]: (axis_names, c.values[order].reshape(shape), {"long_name": n})
                for n, c in table.items()
                if n not in axes
            }
            made = xarray.Dataset(over_grid, {names[n]: v for n, v in axes.items()})
            encoding = {name: {"_FillValue": None} for name in made.variables}
            made.to_netcdf(path, mode="a", group="grid", engine="netcdf4", encoding=encoding)
    except RuntimeError as error:  # what the HDF5 library says of a full disk
        raise OSError(str(error)) from error


def _names(headers: Iterable[str]) -> dict[str, str]:
    """Header → name of a variable: netCDF knows no slash; ``row`` is the dimension. All differ."""
    made: dict[str, str] = {}
    for header in headers:
        name = header.replace("/", " over ").strip()
        while name in made.values() or name == "row":
            name += "_"
        made[header] = name
    return made


def _needed(module: str) -> Any:
    try:
        return import_module(module)
    except ImportError as error:
        message = f'{module} is not installed; pip install "tmsopt[data]", or export to a .csv file'
        raise InputError([Fault(message, ("export",))]) from error


_NEEDED = {"parquet": ("pyarrow", "pyarrow.parquet"), "nc": ("xarray", "netCDF4")}

_NEEDED = {"parquet": ("pyarrow", "pyarrow.parquet"), "nc": ("xarray", "netCDF4")}

_WRITERS: Mapping[str, Callable[[Mapping[str, Column], Path, str], None]] = {
    "csv": _csv,
    "parquet": _parquet,
    "nc": _netcdf,
}
