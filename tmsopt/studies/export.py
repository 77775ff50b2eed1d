"""Rows of a study as a table in a file: CSV, Parquet or netCDF."""

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
from tmsopt.studies.rows import BLOCK, PREFIXES, RowTable


def export(
    rows: RowTable,
    path: Path | str,
    metadata: Mapping[str, Any] | None = None,
    progress: Listener | None = None,
) -> None:
    """Write rows to a file in the format of its ending, one of `FORMATS`; doubles are exact.

    Absent values are blank in CSV (as is nan), null in Parquet and nan in netCDF. netCDF has the dimension ``row``, and
    for rows that fill a grid also the group ``grid`` over the varied values.

    Args:
        metadata: plain data such as `Store.about`, written as JSON to Parquet (schema metadata, key ``tmsopt``) and
            netCDF (attribute ``tmsopt``).
        progress: called with a `tmsopt.Progress` now and then.

    Raises:
        InputError: for another ending, a missing package, or a file that cannot be written.
    """
    path = Path(path)
    write = check_export(path)
    try:
        with write_atomic(path) as temporary:
            write(rows, temporary, metadata or {}, start_steps(progress, f"writing {path.name}", "row"))
    except OSError as error:
        raise InputError([Fault(f"cannot be written: {error.strerror or error}", file=str(path))]) from error


def check_export(path: Path) -> "Writer":
    """The function that exports rows to a file, before any work is done; imports the packages for it.

    Raises:
        InputError: for another ending, a missing package or folder, or a path that is not a regular file.
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


def _batches(rows: RowTable, steps: Steps | None) -> Iterator[dict[str, Any]]:
    """Columns of successive rows, at least one batch even without rows; reports progress."""
    for first in range(0, max(len(rows), 1), BLOCK):
        yield {head: rows.column(head, slice(first, first + BLOCK)) for head in rows.headers}
        if steps:
            steps(min(first + BLOCK, len(rows)), len(rows))


def _csv(rows: RowTable, path: Path, metadata: Mapping[str, Any], steps: Steps | None) -> None:
    units = metadata.get("units", {})
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(format_cell(format_header(head, units.get(_bare(head), ""))) for head in rows.headers)
        for columns in _batches(rows, steps):
            writer.writerows(map(_cell, line) for line in zip(*(c.tolist() for c in columns.values()), strict=True))


def _bare(header: str) -> str:
    """The name whose unit a column has: a header without prefix and end."""
    for table in ("varied", "reports", "violations"):
        header = header.removeprefix(PREFIXES[table])
    return re.sub(r"\.(min|max|limit)$", "", header)


def _cell(value: Any) -> Any:
    """A blank for nan."""
    if isinstance(value, bool):
        return str(value).lower()
    return None if value != value else format_cell(value)  # noqa: PLR0124


def _parquet(rows: RowTable, path: Path, metadata: Mapping[str, Any], steps: Steps | None) -> None:
    pa, parquet = import_optional("pyarrow"), import_optional("pyarrow.parquet")
    kinds = {head: rows.column(head, slice(0)).dtype for head in rows.headers}
    types = {head: pa.string() if kind.hasobject else pa.from_numpy_dtype(kind) for head, kind in kinds.items()}
    schema = pa.schema(types, {"tmsopt": json.dumps(metadata)})
    with parquet.ParquetWriter(path, schema) as writer:
        for columns in _batches(rows, steps):
            arrays = [pa.array(c.data, types[head], mask=c.mask, from_pandas=False) for head, c in columns.items()]
            writer.write_table(pa.table(arrays, schema=schema))


def _netcdf(rows: RowTable, path: Path, metadata: Mapping[str, Any], _: Steps | None) -> None:
    over_rows = _dataset(rows, _table(rows).set_index(rows.numbers).rename_axis("row"))
    with netcdf_errors():
        over_rows.assign_attrs(tmsopt=json.dumps(metadata)).to_netcdf(path, engine="netcdf4")
        if (over_grid := build_grid_dataset(rows)) is not None:
            over_grid.to_netcdf(path, mode="a", group="grid", engine="netcdf4")


def build_grid_dataset(rows: RowTable) -> Any:
    """Rows that fill a grid as a dataset over the varied values; None for others.

    A name with one value in all rows is not an axis.

    Raises:
        InputError: if xarray is not installed.
    """
    import_optional("xarray")
    table = _table(rows)
    sizes = {name: table[name].nunique() for name in table if name.startswith(PREFIXES["varied"])}
    axes = [name for name, size in sizes.items() if size > 1]
    if not axes or math.prod(sizes.values()) != len(table) or table.duplicated(axes).any():
        return None
    return _dataset(rows, table.set_index(axes))


def _names(rows: RowTable) -> dict[str, str]:
    """Name of a variable → header; netCDF allows no slash, and ``row`` is the dimension."""
    return {head.replace("/", " over ").strip() + "_" * (head == "row"): head for head in rows.headers}


def _table(rows: RowTable) -> Any:
    return frame({name: rows.values(head) for name, head in _names(rows).items()})


def _dataset(rows: RowTable, table: Any) -> Any:
    dataset = table.to_xarray()
    for name, head in _names(rows).items():
        dataset[name].attrs["long_name"] = head
    return dataset


Writer = Callable[[RowTable, Path, Mapping[str, Any], Steps | None], None]

FORMATS: Mapping[str, tuple[Writer, tuple[str, ...]]] = {
    "csv": (_csv, ()),
    "parquet": (_parquet, ("pyarrow", "pyarrow.parquet")),
    "nc": (_netcdf, ("xarray", "netCDF4")),
}
"""Ending → function that writes rows, and its modules from the extra ``data``."""
