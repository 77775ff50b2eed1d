"""Export of the rows of a study to a table in a file: CSV, Parquet or netCDF."""

import csv
import json
import math
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from tmsopt.errors import Fault, InputError, import_optional, input_error
from tmsopt.files import format_cell, format_header, netcdf_errors, write_atomic
from tmsopt.progress import Listener, Steps, start_steps
from tmsopt.records import frame
from tmsopt.studies.rows import CHUNK_ROWS, PREFIXES, RowTable


def export(
    rows: RowTable,
    path: Path | str,
    metadata: Mapping[str, Any] | None = None,
    progress: Listener | None = None,
) -> None:
    """Write rows to a file; its ending, one of `FORMATS`, determines the format. Doubles are written exactly.

    A missing value is an empty cell in CSV (as is nan), null in Parquet and nan in netCDF. A netCDF file has the
    dimension ``row``. If the rows fill a grid, it also has the group ``grid``, whose dimensions are the varied values.

    Args:
        metadata: plain data such as `Store.about`, written as JSON to Parquet (schema metadata, key ``tmsopt``) and
            netCDF (attribute ``tmsopt``).
        progress: called from time to time with a `tmsopt.Progress`.

    Raises:
        InputError: for an unknown ending, a missing package, or a file that cannot be written.
    """
    path = Path(path)
    write = check_export(path)
    try:
        with write_atomic(path) as temporary:
            write(rows, temporary, metadata or {}, start_steps(progress, f"writing {path.name}", "row"))
    except OSError as error:
        raise InputError([Fault(f"cannot be written: {error.strerror or error}", file=str(path))]) from error


def check_export(path: Path) -> "Writer":
    """Check an export before any work is done, import its packages, and return the function that writes it.

    Raises:
        InputError: for an unknown ending, a missing package or folder, or a path that is not a regular file.
    """
    write, modules = FORMATS.get(path.suffix.lstrip(".").lower(), (None, ()))
    if write is None:
        accepted = ", ".join(f".{e}" for e in FORMATS)
        raise input_error(f"found '{path}'; accepted: a file name ending in {accepted}", "export")
    if (path.exists() and not path.is_file()) or not path.parent.is_dir():
        problem = "is not a regular file" if path.exists() else "is in a folder that does not exist"
        raise input_error(f"'{path}' {problem}; give the path of a file to write", "export")
    for module in modules:
        import_optional(module, "export to a .csv file")
    return write


def _split_columns(rows: RowTable, steps: Steps | None) -> Iterator[dict[str, Any]]:
    """Yield header → column for each chunk of rows (an empty chunk if there are no rows), and report progress."""
    for first in range(0, max(len(rows), 1), CHUNK_ROWS):
        yield {head: rows.column(head, slice(first, first + CHUNK_ROWS)) for head in rows.headers}
        if steps:
            steps(min(first + CHUNK_ROWS, len(rows)), len(rows))


def _write_csv(rows: RowTable, path: Path, metadata: Mapping[str, Any], steps: Steps | None) -> None:
    units = metadata.get("units", {})
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(format_cell(format_header(head, units.get(_strip_header(head), ""))) for head in rows.headers)
        for columns in _split_columns(rows, steps):
            writer.writerows(map(_to_cell, line) for line in zip(*(c.tolist() for c in columns.values()), strict=True))


def _strip_header(header: str) -> str:
    """A header without its prefix and its ending, such as ``.min``: the name whose unit the column has."""
    for table in ("varied", "reports", "violations"):
        header = header.removeprefix(PREFIXES[table])
    return re.sub(r"\.(min|max|limit)$", "", header)


def _to_cell(value: Any) -> Any:
    """The cell for a value: a text, or for nan None, which gives an empty cell."""
    if isinstance(value, bool):
        return str(value).lower()
    return None if value != value else format_cell(value)  # noqa: PLR0124


def _write_parquet(rows: RowTable, path: Path, metadata: Mapping[str, Any], steps: Steps | None) -> None:
    pa, parquet = import_optional("pyarrow"), import_optional("pyarrow.parquet")
    dtypes = {head: rows.column(head, slice(0)).dtype for head in rows.headers}
    types = {head: pa.string() if dtype.hasobject else pa.from_numpy_dtype(dtype) for head, dtype in dtypes.items()}
    schema = pa.schema(types, {"tmsopt": json.dumps(metadata)})
    with parquet.ParquetWriter(path, schema) as writer:
        for columns in _split_columns(rows, steps):
            arrays = [pa.array(c.data, types[head], mask=c.mask, from_pandas=False) for head, c in columns.items()]
            writer.write_table(pa.table(arrays, schema=schema))


def _write_netcdf(rows: RowTable, path: Path, metadata: Mapping[str, Any], _: Steps | None) -> None:
    row_dataset = _build_dataset(rows, _build_table(rows).set_index(rows.numbers).rename_axis("row"))
    with netcdf_errors():
        row_dataset.assign_attrs(tmsopt=json.dumps(metadata)).to_netcdf(path, engine="netcdf4")
        if (grid_dataset := build_grid_dataset(rows)) is not None:
            grid_dataset.to_netcdf(path, mode="a", group="grid", engine="netcdf4")


def build_grid_dataset(rows: RowTable) -> Any:
    """The rows as a dataset over the varied values; None if they do not fill a grid.

    A varied name that has the same value in all rows is not an axis.

    Raises:
        InputError: if xarray is not installed.
    """
    import_optional("xarray")
    table = _build_table(rows)
    sizes = {name: table[name].nunique() for name in table if name.startswith(PREFIXES["varied"])}
    axes = [name for name, size in sizes.items() if size > 1]
    if not axes or math.prod(sizes.values()) != len(table) or table.duplicated(axes).any():
        return None
    return _build_dataset(rows, table.set_index(axes))


def _variable_names(rows: RowTable) -> dict[str, str]:
    """Name of a netCDF variable → header. The name has no slash, and is not ``row``, the name of the dimension."""
    return {head.replace("/", " over ").strip() + "_" * (head == "row"): head for head in rows.headers}


def _build_table(rows: RowTable) -> Any:
    return frame({name: rows.values(head) for name, head in _variable_names(rows).items()})


def _build_dataset(rows: RowTable, table: Any) -> Any:
    dataset = table.to_xarray()
    for name, head in _variable_names(rows).items():
        dataset[name].attrs["long_name"] = head
    return dataset


Writer = Callable[[RowTable, Path, Mapping[str, Any], Steps | None], None]

FORMATS: Mapping[str, tuple[Writer, tuple[str, ...]]] = {
    "csv": (_write_csv, ()),
    "parquet": (_write_parquet, ("pyarrow", "pyarrow.parquet")),
    "nc": (_write_netcdf, ("xarray", "netCDF4")),
}
"""Ending of a file → (function that writes rows, modules that it needs; the extra ``data`` of tmsopt has them)."""
