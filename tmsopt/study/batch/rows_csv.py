"""Rows of a study from a CSV file: a header of names, then numbers or texts with a unit."""

import csv
import io
import math
from collections.abc import Callable, Iterator
from os import PathLike

from tmsopt.design.toml import read_text
from tmsopt.design.units import with_unit
from tmsopt.errors import Fault, InputError
from tmsopt.records import Column

LARGEST = 1_000_000_000
"""Bytes."""

_SHOWN = 20  # faults of cells; a file in another format has one in each


def read_csv(path: str | PathLike[str], unit_of: Callable[[str], str] | None = None) -> dict[str, Column]:
    """The columns of a CSV file by the names in its first line, which may vary in a study.

    Cells are numbers in rad and SI units, separated by commas, or texts such as ``20 deg`` where units are known. A
    byte order mark and empty lines at the end do not matter.

    Args:
        unit_of: name of a column → unit of its numbers, empty for one that has none.

    Raises:
        InputError: listing every fault with file, line and column.
    """
    file = str(path)
    text = read_text(file, "CSV file of numbers", LARGEST)
    reader = csv.reader(io.StringIO(text, newline=""), strict=True, skipinitialspace=True)
    try:
        names = [name.strip() for name in next(reader, [])]
        if found := list(_header_faults(names)):
            raise InputError([f.at(file, 1) for f in found])
        return _columns(file, reader, names, unit_of)
    except csv.Error as error:
        raise InputError([Fault(f"not CSV: {error}").at(file, reader.line_num)]) from None


def _header_faults(names: list[str]) -> Iterator[Fault]:
    header = ",".join(names)
    example = "accepted: names of what varies, separated by commas, such as: mu,lambda_s.max"
    if not header:
        yield Fault(f"the first line is empty; {example}")
        return
    for mark, word in ((";", "semicolons"), ("\t", "tabs")):
        if mark in header:
            yield Fault(f"columns separated by {word}; separate them by commas, with decimal points in the numbers")
            return
    for number, name in enumerate(names, start=1):
        if not name:
            yield Fault(f"column {number} has no name; {example}")
        elif _number(name) is not None:
            yield Fault(f"found the number {name} for the name of column {number}; {example}")
        elif name in names[: number - 1]:
            yield Fault(f"'{name}' names two columns; leave one out")


def _columns(
    file: str, reader: Iterator[list[str]], names: list[str], unit_of: Callable[[str], str] | None
) -> dict[str, Column]:
    columns: list[list[float]] = [[] for _ in names]
    units = ["" if unit_of is None else unit_of(name) for name in names]
    faults: list[Fault] = []
    empty = 0
    for cells in reader:
        line: int = reader.line_num  # type: ignore[attr-defined]
        if not cells:
            empty = empty or line
            continue
        if empty:
            faults.append(Fault("an empty line among the rows; leave it out").at(file, empty))
            empty = 0
        if len(cells) != len(names):
            message = f"found {len(cells)} cells; accepted: {len(names)}, one per column, with decimal points"
            faults.append(Fault(message).at(file, line))
        else:
            for column, cell, name, unit in zip(columns, cells, names, units, strict=True):
                number = _number(cell)
                if number is None:
                    number = _with_unit(cell, unit, Fault("", (name,)).at(file, line), faults)
                column.append(number)
        if len(faults) > _SHOWN:
            faults = [*faults[:_SHOWN], Fault("and more after these").at(file, line)]
            break
    if not faults and not columns[0]:
        faults.append(Fault("no rows below the names").at(file, 1))
    if faults:
        raise InputError(faults)
    return {name: Column(column) for name, column in zip(names, columns, strict=True)}


def _number(cell: str) -> float | None:
    """A finite number as TOML and other languages write it; Python takes more."""
    try:
        number = float(cell)
    except ValueError:
        return None
    return number if math.isfinite(number) and "_" not in cell else None


def _with_unit(cell: str, unit: str, place: Fault, faults: list[Fault]) -> float:
    """A cell that is no plain number, in `unit`; a fault is added where it is nothing else either."""
    if not cell.strip():
        message = "an empty cell; accepted: a number in every cell"
    elif not unit:
        message = f"found '{cell[:60]}'; accepted: a finite number"
    else:
        try:
            return with_unit(cell, unit)
        except ValueError as error:
            message = str(error).replace(", or a number without quotes in", ", or a number in")
    faults.append(Fault(message, place.key, place.file, place.line))
    return math.nan
