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
    """Write rows to a file whose ending says how, one of `FORMATS`; doubles come back bit by bit.

    A blank in CSV is nan or absent; Parquet has null for what is absent; netCDF nan, on the dimension ``row``, and
    where the rows fill a grid also in the group ``grid``, over the values that vary.

    Args:
        progress: called with a `tmsopt.Progress` now and then.
        metadata: plain data to go with the rows in Parquet (schema metadata, key ``tmsopt``) and netCDF (attribute
            ``tmsopt``), as JSON; `Store.about` makes it.

    Raises:
        InputError: for another ending, a missing package, or a file that cannot be written.
    """
    path = Path(path)
    check_export(path)
    write, _ = FORMATS[_ending(path)]
    try:
        with write_atomic(path) as temporary:
            write(rows, temporary, metadata or {}, start_steps(progress, f"writing {path.name}", "row"))
    except OSError as error:
        raise InputError([Fault(f"cannot be written: {error.strerror or error}", file=str(path))]) from error


def check_export(path: Path) -> None:
    """That rows can be exported to a file, before any work is done; imports what is needed for it.

    Raises:
        InputError: for another ending, a missing package or folder, or what is there and is no file.
    """
    if _ending(path) not in FORMATS:
        accepted = ", ".join(f".{e}" for e in FORMATS)
        raise input_error(f"found '{path}'; accepted: a file name ending in {accepted}", "export")
    if (path.exists() and not path.is_file()) or not path.parent.is_dir():
        problem = "is no regular file" if path.exists() else "is in a folder that does not exist"
        raise input_error(f"'{path}' {problem}; give the path of a file to write", "export")
    for module in FORMATS[_ending(path)][1]:
        import_optional(module, "export to a .csv file")


def _ending(path: Path) -> str:
    return path.suffix.lstrip(".").lower()


def _blocks(rows: RowTable, steps: Steps | None) -> Iterator[dict[str, Any]]:
    """Columns of some rows after others, at least of none, counted as they are done."""
    for first in range(0, max(len(rows), 1), BLOCK):
        yield {head: rows.column(head, slice(first, first + BLOCK)) for head in rows.headers}
        if steps:
            steps(min(first + BLOCK, len(rows)), len(rows))


def _csv(rows: RowTable, path: Path, metadata: Mapping[str, Any], steps: Steps | None) -> None:
    units = metadata.get("units", {})
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(format_cell(format_header(head, units.get(_bare(head), ""))) for head in rows.headers)
        for columns in _blocks(rows, steps):
            writer.writerows(map(_cell, line) for line in zip(*(c.tolist() for c in columns.values()), strict=True))


def _bare(header: str) -> str:
    """The name whose unit a column has: of what varies, is reported or violated, that without its prefix and end."""
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
        for columns in _blocks(rows, steps):
            arrays = [pa.array(c.data, types[head], mask=c.mask, from_pandas=False) for head, c in columns.items()]
            writer.write_table(pa.table(arrays, schema=schema))


def _netcdf(rows: RowTable, path: Path, metadata: Mapping[str, Any], _: Steps | None) -> None:
    over_rows = _dataset(rows, _table(rows).set_index(rows.numbers).rename_axis("row"))
    with netcdf_errors():
        over_rows.assign_attrs(tmsopt=json.dumps(metadata)).to_netcdf(path, engine="netcdf4")
        if (over_grid := gridded(rows)) is not None:
            over_grid.to_netcdf(path, mode="a", group="grid", engine="netcdf4")


def gridded(rows: RowTable) -> Any:
    """Rows that fill a grid as a dataset over the values that vary; None for others.

    What has one value in all rows is no axis.

    Raises:
        InputError: where xarray is not installed.
    """
    import_optional("xarray")
    table = _table(rows)
    sizes = {name: table[name].nunique() for name in table if name.startswith(PREFIXES["varied"])}
    axes = [name for name, size in sizes.items() if size > 1]
    if not axes or math.prod(sizes.values()) != len(table) or table.duplicated(axes).any():
        return None
    return _dataset(rows, table.set_index(axes))


def _names(rows: RowTable) -> dict[str, str]:
    """Name of a variable → header: netCDF knows no slash; ``row`` is the dimension. All differ."""
    names: dict[str, str] = {}
    for head in rows.headers:
        name = head.replace("/", " over ").strip()
        while name in names or name == "row":
            name += "_"
        names[name] = head
    return names


def _table(rows: RowTable) -> Any:
    return frame({name: rows.values(head) for name, head in _names(rows).items()})


def _dataset(rows: RowTable, table: Any) -> Any:
    made = table.to_xarray()
    for name, head in _names(rows).items():
        made[name].attrs["long_name"] = head
    return made


FORMATS: Mapping[str, tuple[Callable[[RowTable, Path, Mapping[str, Any], Steps | None], None], tuple[str, ...]]] = {
    "csv": (_csv, ()),
    "parquet": (_parquet, ("pyarrow", "pyarrow.parquet")),
    "nc": (_netcdf, ("xarray", "netCDF4")),
}
"""Ending → how rows are written, and modules that the extra ``data`` brings; another one is added here."""
