"""What a chart's folder holds, checked where it is read: it may come from anybody, and be damaged."""

import math
import re
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from tmsopt.charts.summary import Tally
from tmsopt.charts.survey import LONGEST, MOST
from tmsopt.disk import from_json
from tmsopt.errors import Fault, InputError
from tmsopt.roots import CLASSES

SCHEMA = 1

ABOUT, TILES = "about.json", "tiles.jsonl"

MOST_TILES = 1_000_000
"""Of one chart."""

_LONG_ABOUT, _LONG_LINE = 16_000_000, 10_000  # bytes
_HEAD = 1024  # bytes, more than the head of an array takes
_NPY = re.compile(  # of `numpy.save`: no pickle, no archive, no list of fields
    rb"\x93NUMPY\x01\x00(..)(\{'descr': '([|<>][bif]\d)', 'fortran_order': False, "
    rb"'shape': \((\d{1,10}(?:, \d{1,10})*),?\), \} *\n)",
    re.DOTALL,
)

Count = Annotated[int, Field(ge=0)]
Name = Annotated[str, Field(pattern=r"^\w{1,200}$")]


class _Section(BaseModel):
    model_config = ConfigDict(strict=True)


class _Axis(_Section):
    min: FiniteFloat
    max: FiniteFloat
    points: Annotated[int, Field(ge=2, le=LONGEST)]


class _Layer(_Section):
    dtype: Literal["|i1", "|b1", "<f4", "<f8", ">f4", ">f8"]
    expression: str = ""


class _Problem(_Section):
    model: str
    fixed: dict[str, FiniteFloat]
    constraints: dict[str, str]


class _About(_Section):
    title: Annotated[str, Field(pattern=r"^[^\x00-\x08\x0b-\x1f\x7f-\x9f]*$")]  # it is shown on terminals
    problem: _Problem
    axes: Annotated[dict[Name, _Axis], Field(min_length=2, max_length=3)]
    shape: list[int]
    layers: Annotated[dict[Name, _Layer], Field(min_length=1)]
    tile: Annotated[int, Field(ge=1)]


class _Line(_Section):
    model_config = ConfigDict(extra="forbid")

    row: Count
    rows: Annotated[int, Field(ge=1)]
    designs: Count
    classes: list[Count]
    satisfied: Count | None
    least: FiniteFloat | None
    place: Annotated[int, Field(ge=-1)]
    fallbacks: Count
    seconds: FiniteFloat


def damaged(path: Path, what: str) -> InputError:
    """The fault of a folder that is not as it was written."""
    return InputError([Fault(f"'{path}' is damaged: {what}; give --fresh to chart anew and move this one aside")])


def regular(path: Path, name: str) -> Path:
    """A file in a folder, neither a link nor reached through one.

    Raises:
        InputError: where it is none.
    """
    place = path
    try:
        for part in (*(parts := Path(name).parts[:-1]), Path(name).name):
            place /= part
            mode = place.lstat().st_mode
            if not (stat.S_ISDIR(mode) if part in parts else stat.S_ISREG(mode)):
                what = "a symbolic link" if stat.S_ISLNK(mode) else "no file"
                raise damaged(path, f"{place.relative_to(path)} is {what}")
    except OSError as error:
        raise damaged(path, f"{name} cannot be read ({error.strerror})") from None
    return place


def read_about(path: Path) -> dict[str, Any]:
    """What a folder says that it is, checked: title, problem, axes, shape, layers and tile can be relied on.

    Raises:
        InputError: where that is no folder of a chart.
    """
    if not (path / ABOUT).is_symlink() and not (path / ABOUT).exists():
        said = f"'{path}' is no chart: {ABOUT} cannot be read (No such file or directory)"
        raise InputError([Fault(f"{said}; give the folder that tmsopt chart FILE --output NAME.chart wrote")])
    try:
        with regular(path, ABOUT).open("rb") as stream:
            about = from_json(stream.read(_LONG_ABOUT + 1).decode(), _LONG_ABOUT)
    except OSError as error:
        raise damaged(path, f"{ABOUT} cannot be read ({error.strerror})") from None
    except ValueError as error:
        raise error if isinstance(error, InputError) else damaged(path, f"{ABOUT} is not JSON ({error})") from None
    if not isinstance(about, dict) or about.get("schema") != SCHEMA:
        raise damaged(path, f"{ABOUT} has no schema {SCHEMA}")
    if fault := _about_fault(about):
        raise damaged(path, f"{ABOUT} does not say what was charted ({fault})")
    return about


def _about_fault(about: Mapping[str, Any]) -> str:
    try:
        said = _About.model_validate(about)
    except ValidationError as error:
        return _first(error)
    shape = [axis.points for axis in said.axes.values()][::-1]
    if said.shape != shape or math.prod(shape) > MOST:
        return f"shape: found {said.shape}; the axes have {shape} points, and accepted are {MOST:.0e} in all"
    if (tiles := number_of_tiles(shape, said.tile)) > MOST_TILES:
        return f"tile: found {said.tile}, which makes {tiles} tiles; accepted: {MOST_TILES}"
    return ""


def _first(error: ValidationError) -> str:
    first = error.errors(include_url=False, include_input=False, include_context=False)[0]
    return f"{'.'.join(map(str, first['loc']))[:200]}: {first['msg']}"


def number_of_tiles(shape: "list[int] | tuple[int, ...]", tile: int) -> int:
    """Of a grid of this shape, in tiles of about so many designs."""
    return -(-math.prod(shape[:-1]) // max(1, tile // shape[-1]))


def read_record(path: Path, about: Mapping[str, Any]) -> tuple[dict[int, Tally], int]:
    """First row → counts of the recorded tiles, and where the record's last whole line ends.

    Raises:
        InputError: for a damaged record.
    """
    done: dict[int, Tally] = {}
    end = number = 0
    try:
        with regular(path, TILES).open("rb") as stream:
            while line := stream.readline(_LONG_LINE):
                if len(line) < _LONG_LINE and not line.endswith(b"\n"):
                    break  # it was being written
                number, end = number + 1, end + len(line)
                row, counts = _tile(line, about)
                done[row] = counts
    except OSError as error:
        raise damaged(path, f"{TILES} cannot be read ({error.strerror})") from None
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        why = _first(error) if isinstance(error, ValidationError) else error
        raise damaged(path, f"line {number} of {TILES} is not a tile's ({why})") from None
    return done, end


def _tile(text: bytes, about: Mapping[str, Any]) -> tuple[int, Tally]:
    """First row and counts of one tile.

    Raises:
        ValueError: for a line that is none of this chart's.
    """
    line, shape = _Line.model_validate_json(text), about["shape"]
    each, most, kind = max(1, about["tile"] // shape[-1]), math.prod(shape[:-1]), "kind" in about["layers"]
    first, after = line.row * shape[-1], line.row * shape[-1] + line.designs
    if line.row % each or line.rows != min(each, most - line.row) or line.designs != line.rows * shape[-1]:
        raise ValueError(f"{line.designs} designs of {line.rows} rows from row {line.row}")
    if len(line.classes) != len(CLASSES) * kind or sum(line.classes) > line.designs:
        raise ValueError(f"{len(line.classes)} classes, {sum(line.classes)} of {line.designs} designs")
    if (line.satisfied is None) == ("satisfied" in about["layers"]) or (line.satisfied or 0) > line.designs:
        raise ValueError(f"{line.satisfied} of {line.designs} designs satisfied")
    if (line.least is None) != (line.place < 0) or (line.place >= 0 and not first <= line.place < after):
        raise ValueError(f"least abscissa {line.least} at {line.place}")
    least = math.nan if line.least is None else line.least
    return line.row, Tally(
        line.designs, tuple(line.classes), line.satisfied, least, line.place, line.fallbacks, line.seconds
    )


def array_file(path: Path, name: str, shape: "list[int] | tuple[int, ...]", dtype: Any) -> tuple[Path, int]:
    """The file of an axis or a layer, and where its numbers begin.

    Raises:
        InputError: for one that is missing, or not of this shape, kind of number and length.
    """
    place = regular(path, name)
    try:
        with place.open("rb") as stream:
            head, length = stream.read(_HEAD), stream.seek(0, 2)
    except OSError as error:
        raise damaged(path, f"{name} cannot be read ({error.strerror})") from None
    wanted, found = np.dtype(dtype), _NPY.match(head)
    if not (
        found
        and int.from_bytes(found[1], "little") == len(found[2])
        and found[3].decode() == np.lib.format.dtype_to_descr(wanted)
        and [int(n) for n in found[4].split(b",")] == list(shape)
        and length - found.end() == math.prod(shape) * wanted.itemsize
    ):
        raise damaged(path, f"{name} is not an array of shape {tuple(shape)} and type {wanted}")
    return place, found.end()


def read_axis(path: Path, name: str, axis: Mapping[str, Any]) -> NDArray[np.float64]:
    """The values along an axis, ascending from its least to its greatest.

    Raises:
        InputError: for a file that is missing or damaged.
    """
    place, offset = array_file(path, f"axes/{name}.npy", [axis["points"]], np.float64)
    values = np.fromfile(place, np.float64, offset=offset)
    if not (values[0] == axis["min"] and values[-1] == axis["max"] and np.all(np.diff(values) > 0)):
        raise damaged(path, f"axes/{name}.npy does not go up from {axis['min']} to {axis['max']}")
    return values


def read_layer(path: Path, name: str, about: Mapping[str, Any]) -> NDArray[Any]:
    """A layer, as a memory map that is read when it is looked at.

    Raises:
        InputError: for a file that is missing or damaged.
    """
    shape, dtype = tuple(about["shape"]), np.dtype(about["layers"][name]["dtype"])
    place, offset = array_file(path, f"layers/{name}.npy", shape, dtype)
    return np.memmap(place, dtype, "r", offset, shape)
