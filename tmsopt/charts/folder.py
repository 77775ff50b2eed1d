"""The layers of a chart, in memory or in a folder of NumPy files with a record of the finished tiles.

    NAME.chart/about.json      description: problem, grid, layers; never changes
    NAME.chart/axes/Fr.npy     values along an axis, for other programs
    NAME.chart/layers/kind.npy a layer, with the shape of the grid
    NAME.chart/tiles.jsonl     a line for every finished tile, with its counts
    NAME.chart/chart.lock      locked by the process that writes

A tile is recorded after its numbers are on the disk, so the record is correct whenever the process is stopped.
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

from tmsopt.charts.survey import MAX_AXIS_POINTS, MAX_DESIGNS, MAX_TILES, Grid, Tally
from tmsopt.errors import InputError, input_error
from tmsopt.files import from_json, list_differences, move_aside, read_lines, read_text, write_text
from tmsopt.models import MODELS
from tmsopt.problem.problem import Problem

SCHEMA = 1

_ABOUT_FILE, _TILES_FILE, _LOCK_FILE = "about.json", "tiles.jsonl", "chart.lock"
_MAX_ABOUT_BYTES = 16_000_000  # largest size of about.json
_MAX_LINE_BYTES = 10_000  # largest size of a line of tiles.jsonl
_SYNC_INTERVAL = 1.0  # seconds from one record of finished tiles to the next

Layers = Mapping[str, NDArray[Any]]


@dataclass
class Tiles:
    """Layers that are filled tile by tile.

    Attributes:
        layers: arrays or memory maps. Memory maps are written through their files, so that a full disk raises an error.
        tile: number of designs of a tile.
        tallies: first row of a finished tile → its counts.
        record: file that lists the finished tiles, for memory maps.
        end: position in this file after its last complete line.
    """

    layers: Layers
    tile: int
    tallies: dict[int, Tally] = field(default_factory=dict)
    record: Path | None = None
    end: int = 0
    _unrecorded: bytes = b""
    _sync_time: float = field(default_factory=time.monotonic)

    def write(self, rows: range, layers: Layers, counts: Tally) -> None:
        """Write a tile. In a folder it is recorded by the next call of `sync`, which happens about once a second."""
        for name, array in layers.items():
            layer = self.layers[name]
            if isinstance(layer, np.memmap):
                with open(str(layer.filename), "r+b") as stream:
                    stream.seek(layer.offset + rows.start * array[0].nbytes)
                    stream.write(array.data)
            else:
                layer.reshape(-1, layer.shape[-1])[rows.start : rows.stop] = array
        self.tallies[rows.start] = counts
        least = counts.least if counts.place >= 0 else None  # JSON has no nan
        self._unrecorded += f"{json.dumps({'row': rows.start, **asdict(counts), 'least': least})}\n".encode()
        if time.monotonic() - self._sync_time > _SYNC_INTERVAL:
            self.sync()

    def sync(self) -> None:
        """Write all layers to the disk, then record the tiles."""
        if self.record is None or not self._unrecorded:
            return
        for name in self.layers:
            with (self.record.parent / _layer_path(name)).open("r+b") as stream:
                os.fsync(stream.fileno())
        with self.record.open("r+b") as stream:
            stream.truncate(self.end)
            stream.seek(self.end)
            stream.write(self._unrecorded)
            stream.flush()
            os.fsync(stream.fileno())
        self.end += len(self._unrecorded)
        self._unrecorded, self._sync_time = b"", time.monotonic()


@contextmanager
def write_folder(path: Path, about: dict[str, Any], grid: Grid, fresh: bool) -> Iterator[Tiles]:
    """Open the layers of a new or unfinished chart in a folder; one process at a time writes them.

    Args:
        about: description that identifies the chart; versions and tile size may differ.
        fresh: move an existing folder aside.

    Raises:
        InputError: if the folder is damaged, holds another chart or is written by another process, or if the disk is
            full.
    """
    lock = FileLock(path / _LOCK_FILE, timeout=0)
    with _refuse_write_errors(path):
        if fresh and os.path.lexists(path):
            with lock:
                move_aside(path)
        if not path.exists():
            bytes_per_design = sum(np.dtype(layer["dtype"]).itemsize for layer in about["layers"].values())
            needed_bytes, free_bytes = bytes_per_design * grid.size, shutil.disk_usage(path.parent).free
            if needed_bytes > free_bytes:
                raise OSError(
                    errno.ENOSPC, f"takes {needed_bytes / 1e9:.1f} GB, and {free_bytes / 1e9:.1f} GB are free"
                )
            path.mkdir()
        elif not any((path / n).exists() for n in (_ABOUT_FILE, _LOCK_FILE)):
            raise _make_no_chart_error(path)
        held_lock = lock.acquire()
    with held_lock:
        if not os.path.lexists(path / _ABOUT_FILE):
            with _refuse_write_errors(path):
                _create(path, about, grid)
        existing, _, tiles = read_folder(path)
        ignored_keys = {"versions": None, "tile": None}
        if differences := list(list_differences(existing | ignored_keys, about | ignored_keys)):
            message = f"holds another chart ({'; '.join(differences)}); give another name, or --fresh to move it aside"
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
    return input_error(f"'{path}' is no chart: it has no {_ABOUT_FILE}; give a chart's folder or a new name")


def _create(path: Path, about: Mapping[str, Any], grid: Grid) -> None:
    """Create the files of a new chart. The last one is about.json: without it, the next run starts again."""
    for part in ("axes", "layers"):
        shutil.rmtree(path / part, ignore_errors=True)  # a killed process may have left it
        (path / part).mkdir()
    for name, values in zip(grid.axes, grid.values, strict=True):
        np.save(path / "axes" / f"{name}.npy", values)
    for name, layer in about["layers"].items():
        np.lib.format.open_memmap(path / _layer_path(name), "w+", np.dtype(layer["dtype"]), grid.shape)
    (path / _TILES_FILE).touch()
    write_text(path / _ABOUT_FILE, json.dumps(about, indent=2, ensure_ascii=False))


# Reading


class _Axis(BaseModel):
    min: FiniteFloat
    max: FiniteFloat
    points: Annotated[int, Field(ge=2, le=MAX_AXIS_POINTS)]


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


_TALLY_ADAPTER = TypeAdapter(Tally)


def read_folder(path: Path) -> tuple[dict[str, Any], Problem | None, Tiles]:
    """Read and validate a folder: its description, its problem (None if it does not hold the model), its layers.

    Raises:
        InputError: if it is not the folder of a chart, or is damaged.
    """
    if not (path / _ABOUT_FILE).exists():
        raise _make_no_chart_error(path)
    name = _ABOUT_FILE
    try:
        about = from_json(read_text(str(_find_file(path, name)), "JSON file", _MAX_ABOUT_BYTES), _MAX_ABOUT_BYTES)
        _About.model_validate(about, strict=True)
        problem, grid, layers = _state_problem(about), grid_of(about), {}
        if grid.size > MAX_DESIGNS:
            raise ValueError(f"more than {MAX_DESIGNS:.0e} designs")
        for layer, description in about["layers"].items():
            name = _layer_path(layer)
            layers[layer] = array = np.lib.format.open_memmap(_find_file(path, name), "r")
            if array.shape != grid.shape or array.dtype.str != description.get("dtype") or not array.flags.c_contiguous:
                raise ValueError(f"not an array of shape {grid.shape} and type {description.get('dtype')}")
        name = _TILES_FILE
        record = _find_file(path, name)
        tallies, end = _read_record(record, about["tile"], grid)
    except Exception as error:  # a damaged folder can raise any error; a link to itself raises a RuntimeError
        reason = " ".join(str(error).split())[:300]
        raise input_error(
            f"'{path}' is damaged: {name}: {reason}; give --fresh to move it aside and start anew"
        ) from None
    return about, problem, Tiles(layers, about["tile"], tallies, record, end)


def grid_of(about: Mapping[str, Any]) -> Grid:
    """The grid that about.json describes."""
    axes = about["axes"]
    return Grid(tuple(axes), tuple(np.linspace(a["min"], a["max"], a["points"]) for a in axes.values()))


def _state_problem(about: Mapping[str, Any]) -> Problem | None:
    """The problem without equality constraints; None for a model that the user defined."""
    statement = about["problem"]
    if "statement" in statement or statement["model"] not in MODELS:
        return None
    free = {n: (axis["min"], axis["max"]) for n, axis in about["axes"].items()}
    return Problem(MODELS[statement["model"]], statement["fixed"], free, statement["constraints"], title=about["title"])


def _find_file(path: Path, name: str) -> Path:
    """Path of a regular file in the folder; links are refused, so that nothing outside of the folder is written."""
    file_path = path.resolve() / name
    if file_path.resolve() != file_path or not file_path.is_file():
        raise ValueError("no file, or a link")
    return file_path


def _read_record(record: Path, tile: int, grid: Grid) -> tuple[dict[int, Tally], int]:
    """Read the record of tiles.

    Returns:
        First row → counts of each recorded tile, and the position after the last complete line.
    """
    tallies, end = dict[int, Tally](), 0
    tiles = {rows.start: rows for rows in grid.tiles(tile)}
    for line in read_lines(str(record), "JSON record", MAX_TILES * _MAX_LINE_BYTES, _MAX_LINE_BYTES):
        if not line.endswith("\n"):
            break  # the process was stopped while it wrote this line
        end += len(line)
        entry = {n: x for n, x in from_json(line).items() if x is not None}
        row, counts = entry["row"], _TALLY_ADAPTER.validate_python(entry)
        if counts.designs != len(tiles.get(row, ())) * grid.shape[-1] or not -1 <= counts.place < grid.size:
            raise ValueError(f"{line:.100} is no tile")
        tallies[row] = counts
    return tallies, end
