"""The layers of a chart, in memory or in a folder of NumPy files with a record of the finished tiles.

    NAME.chart/about.json      description: problem, grid, layers; never changes
    NAME.chart/axes/Fr.npy     values along an axis, for other programs
    NAME.chart/layers/kind.npy a layer, shape of the grid
    NAME.chart/tiles.jsonl     a line for every finished tile, with its counts
    NAME.chart/chart.lock      locked by the process that writes

A tile is recorded after its numbers are on the disk, so the record is right whenever a process ends.
"""

import errno
import json
import os
import shutil
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from filelock import FileLock, Timeout
from numpy.typing import NDArray
from pydantic import BaseModel, Field, FiniteFloat, TypeAdapter

from tmsopt.charts.survey import LONGEST, MOST, MOST_TILES, Grid, Tally
from tmsopt.errors import InputError, input_error
from tmsopt.files import from_json, list_differences, move_aside, read_lines, read_text, write_text
from tmsopt.models import MODELS
from tmsopt.problem.problem import Problem

SCHEMA = 1

_ABOUT, _TILES, _LOCK = "about.json", "tiles.jsonl", "chart.lock"
_LONG_ABOUT, _LONG_LINE = 16_000_000, 10_000  # bytes
_SYNC = 1.0  # seconds between records of finished tiles

Layers = Mapping[str, NDArray[Any]]


@dataclass
class Tiles:
    """Layers that are filled tile by tile.

    Attributes:
        layers: arrays, or memory maps; these are written as files, so that a full disk raises an error.
        tile: designs of a tile.
        done: first row → counts of a finished tile.
        record: file of finished tiles, for memory maps.
        end: where its last whole line ends.
    """

    layers: Layers
    tile: int
    done: dict[int, Tally] = field(default_factory=dict)
    record: Path | None = None
    end: int = 0
    _waiting: bytes = b""
    _synced: float = field(default_factory=time.monotonic)

    def write(self, rows: range, layers: Layers, counts: Tally) -> None:
        """Write a tile; in a folder, the next `sync` records it, about once a second."""
        for name, array in layers.items():
            layer = self.layers[name]
            if isinstance(layer, np.memmap):
                with open(str(layer.filename), "r+b") as stream:
                    stream.seek(layer.offset + rows.start * array[0].nbytes)
                    stream.write(array.data)
            else:
                layer.reshape(-1, layer.shape[-1])[rows.start : rows.stop] = array
        self.done[rows.start] = counts
        least = counts.least if counts.place >= 0 else None  # JSON has no nan
        self._waiting += f"{json.dumps({'row': rows.start, **asdict(counts), 'least': least})}\n".encode()
        if time.monotonic() - self._synced > _SYNC:
            self.sync()

    def sync(self) -> None:
        """Flush all layers to the disk, then record the tiles."""
        if self.record is None or not self._waiting:
            return
        for name in self.layers:
            with (self.record.parent / _layer_path(name)).open("r+b") as stream:
                os.fsync(stream.fileno())
        with self.record.open("r+b") as stream:
            stream.truncate(self.end)
            stream.seek(self.end)
            stream.write(self._waiting)
            stream.flush()
            os.fsync(stream.fileno())
        self.end += len(self._waiting)
        self._waiting, self._synced = b"", time.monotonic()


@contextmanager
def write_folder(path: Path, about: dict[str, Any], grid: Grid, fresh: bool) -> Iterator[Tiles]:
    """Open the layers of a new or unfinished chart in a folder; one process at a time writes them.

    Args:
        about: identifies the chart, except for versions and tile size.
        fresh: move an existing folder aside.

    Raises:
        InputError: for a damaged folder, another chart, or a folder that another process writes; if the disk is full.
    """
    lock = FileLock(path / _LOCK, timeout=0)
    with _refuse_write_errors(path):
        if fresh and os.path.lexists(path):
            with lock:
                move_aside(path)
        if not path.exists():
            each = sum(np.dtype(layer["dtype"]).itemsize for layer in about["layers"].values())
            needed, free = each * grid.size, shutil.disk_usage(path.parent).free
            if needed > free:
                raise OSError(errno.ENOSPC, f"takes {needed / 1e9:.1f} GB, and {free / 1e9:.1f} GB are free")
            path.mkdir()
        elif not any((path / n).exists() for n in (_ABOUT, _LOCK)):
            raise _make_no_chart_error(path)
        held = lock.acquire()
    with held:
        if not os.path.lexists(path / _ABOUT):
            with _refuse_write_errors(path):
                _create(path, about, grid)
        existing, _, tiles = read_folder(path)
        ignored = {"versions": None, "tile": None}
        if changed := list(list_differences(existing | ignored, about | ignored)):
            message = f"holds another chart ({'; '.join(changed)}); give another name, or --fresh to move it aside"
            raise input_error(message, str(path))
        try:
            yield tiles
        finally:
            tiles.sync()


@contextmanager
def _refuse_write_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except Timeout:
        message = f"'{path}' is being written by another process; wait for it, or give another name"
        raise input_error(message, "--output") from None
    except OSError as error:
        raise input_error(f"'{path}' cannot be written: {error.strerror or error}", "--output") from None


def _layer_path(name: str) -> str:
    return f"layers/{name}.npy"


def _make_no_chart_error(path: Path) -> InputError:
    return input_error(f"'{path}' is no chart: it has no {_ABOUT}; give a chart's folder or a new name")


def _create(path: Path, about: Mapping[str, Any], grid: Grid) -> None:
    """Create the files of a new chart, about.json last: without it the next run starts anew."""
    for part in ("axes", "layers"):
        shutil.rmtree(path / part, ignore_errors=True)  # left by a killed process
        (path / part).mkdir()
    for name, values in zip(grid.axes, grid.values, strict=True):
        np.save(path / "axes" / f"{name}.npy", values)
    for name, layer in about["layers"].items():
        np.lib.format.open_memmap(path / _layer_path(name), "w+", np.dtype(layer["dtype"]), grid.shape)
    (path / _TILES).touch()
    write_text(path / _ABOUT, json.dumps(about, indent=2, ensure_ascii=False))


# Reading


class _Axis(BaseModel):
    min: FiniteFloat
    max: FiniteFloat
    points: Annotated[int, Field(ge=2, le=LONGEST)]


class _Problem(BaseModel):
    model: str
    fixed: dict[str, FiniteFloat]
    constraints: dict[str, str]


_Name = Annotated[str, Field(pattern=r"^\w{1,200}$")]


class _About(BaseModel):
    number: Literal[1] = Field(alias="schema")
    title: Annotated[str, Field(pattern=r"^[^\x00-\x08\x0b-\x1f\x7f-\x9f]*$")]  # shown on terminals
    problem: _Problem
    axes: Annotated[dict[_Name, _Axis], Field(min_length=2, max_length=3)]
    layers: Annotated[dict[_Name, dict[str, str]], Field(min_length=1)]
    tile: Annotated[int, Field(ge=1)]


_TALLY = TypeAdapter(Tally)


def read_folder(path: Path) -> tuple[dict[str, Any], Problem | None, Tiles]:
    """Read and validate a folder: its description, its problem (None if it does not hold the model), its layers.

    Raises:
        InputError: if it is no folder of a chart, or a damaged one.
    """
    if not (path / _ABOUT).exists():
        raise _make_no_chart_error(path)
    name = _ABOUT
    try:
        about = from_json(read_text(str(_find_file(path, name)), "JSON file", _LONG_ABOUT), _LONG_ABOUT)
        _About.model_validate(about, strict=True)
        problem, grid, layers = _state_problem(about), grid_of(about), {}
        if grid.size > MOST:
            raise ValueError(f"more than {MOST:.0e} designs")
        for layer, stated in about["layers"].items():
            name = _layer_path(layer)
            layers[layer] = array = np.lib.format.open_memmap(_find_file(path, name), "r")
            if array.shape != grid.shape or array.dtype.str != stated.get("dtype") or not array.flags.c_contiguous:
                raise ValueError(f"not an array of shape {grid.shape} and type {stated.get('dtype')}")
        name = _TILES
        record = _find_file(path, name)
        done, end = _read_record(record, about["tile"], grid)
    except Exception as error:  # a damaged folder can raise anything, such as a link to itself a RuntimeError
        reason = " ".join(str(error).split())[:300]
        raise input_error(
            f"'{path}' is damaged: {name}: {reason}; give --fresh to move it aside and start anew"
        ) from None
    return about, problem, Tiles(layers, about["tile"], done, record, end)


def grid_of(about: Mapping[str, Any]) -> Grid:
    """The grid that about.json describes."""
    axes = about["axes"]
    return Grid(tuple(axes), tuple(np.linspace(a["min"], a["max"], a["points"]) for a in axes.values()))


def _state_problem(about: Mapping[str, Any]) -> Problem | None:
    """The problem without equality constraints; None for a model of the user."""
    stated = about["problem"]
    if "statement" in stated or stated["model"] not in MODELS:
        return None
    free = {n: (axis["min"], axis["max"]) for n, axis in about["axes"].items()}
    return Problem(MODELS[stated["model"]], stated["fixed"], free, stated["constraints"], title=about["title"])


def _find_file(path: Path, name: str) -> Path:
    """Path of a regular file in the folder; refuses links, so that nothing outside is written."""
    place = path.resolve() / name
    if place.resolve() != place or not place.is_file():
        raise ValueError("no file, or a link")
    return place


def _read_record(place: Path, tile: int, grid: Grid) -> tuple[dict[int, Tally], int]:
    """First row → counts of each recorded tile; and where the last whole line ends."""
    done, end = dict[int, Tally](), 0
    tiles = {rows.start: rows for rows in grid.tiles(tile)}
    for line in read_lines(str(place), "JSON record", MOST_TILES * _LONG_LINE, _LONG_LINE):
        if not line.endswith("\n"):
            break  # cut off while it was written
        end += len(line)
        entry = {n: x for n, x in from_json(line).items() if x is not None}
        row, counts = entry["row"], _TALLY.validate_python(entry)
        if counts.designs != len(tiles.get(row, ())) * grid.shape[-1] or not -1 <= counts.place < grid.size:
            raise ValueError(f"{line:.100} is no tile")
        done[row] = counts
    return done, end
