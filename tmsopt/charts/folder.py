"""The folder of a large chart: its arrays as NumPy files, and a record of the tiles that are done.

    NAME.chart/about.json      what was charted, over what, in which layers; never changes
    NAME.chart/axes/Fr.npy     values along an axis
    NAME.chart/layers/kind.npy a layer, shape of the grid
    NAME.chart/tiles.jsonl     a line for every finished tile, with its counts

A tile is recorded once its numbers are on the disk, so that whenever a process ends, what is recorded is right.
"""

import json
import os
import shutil
import sqlite3
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.charts.summary import Tally
from tmsopt.disk import Lock, aside, differences, lock, whole
from tmsopt.errors import Fault, InputError

SCHEMA = 1

ABOUT, TILES = "about.json", "tiles.jsonl"

_SYNC = 1.0  # seconds between two records of finished tiles


@dataclass
class Folder:
    """A chart's folder that is being written, by one process at a time.

    Attributes:
        done: first row → counts of the tiles that are recorded.
    """

    path: Path
    row: int
    done: dict[int, Tally]
    _layers: Mapping[str, tuple[IO[bytes], int]] = field(repr=False)
    _record: IO[bytes] = field(repr=False)
    _waiting: list[bytes] = field(default_factory=list, repr=False)
    _synced: float = field(default_factory=time.monotonic, repr=False)

    def write(self, rows: range, layers: Mapping[str, NDArray[Any]], counts: Tally) -> None:
        """Write the layers of a tile; it is recorded by the next `sync`, which comes once a second."""
        for name, array in layers.items():
            stream, offset = self._layers[name]
            stream.seek(offset + rows.start * self.row * array.itemsize)
            stream.write(np.ascontiguousarray(array).data)
        self.done[rows.start] = counts
        line = {"row": rows.start, "rows": len(rows), **asdict(counts)}
        line = {n: None if isinstance(v, float) and not np.isfinite(v) else v for n, v in line.items()}
        self._waiting.append(json.dumps(line).encode() + b"\n")
        if time.monotonic() - self._synced > _SYNC:
            self.sync()

    def sync(self) -> None:
        """Bring everything written to the disk, then record it."""
        if not self._waiting:
            return
        for stream, _ in self._layers.values():
            stream.flush()
            os.fsync(stream.fileno())
        self._record.write(b"".join(self._waiting))
        self._record.flush()
        os.fsync(self._record.fileno())
        self._waiting.clear()
        self._synced = time.monotonic()


@contextmanager
def writing(path: Path, about: Mapping[str, Any], axes: Mapping[str, NDArray[Any]], fresh: bool) -> Iterator[Folder]:
    """A folder to write tiles to, new or begun earlier for the same chart.

    Args:
        about: plain data with the keys ``shape`` and ``layers`` (name → what it is, with its ``dtype``), and all that
            makes a chart another one.
        fresh: move a folder aside that is there already.

    Raises:
        InputError: for a folder of another chart, or a damaged one, or one that another process is writing; where the
            disk has no room.
    """
    with ExitStack() as stack:
        stack.callback(_locked(path).release)
        if fresh and path.exists():
            aside(path)
        if not path.exists():
            _create(path, about, axes)
        if changed := list(differences(read_about(path), about)):
            said = "; ".join(changed)
            message = f"holds another chart ({said}); give another name, or --fresh to move this one aside"
            raise InputError([Fault(message, (str(path),))])
        read_tiles(path)  # so that a file that is missing is said to be
        record = stack.enter_context((path / TILES).open("r+b"))
        done, end = _read_record(path)
        record.truncate(end)
        record.seek(end)
        offsets = {n: _offset(path, n, about) for n in about["layers"]}
        layers = {n: (stack.enter_context(_layer(path, n).open("r+b")), at) for n, at in offsets.items()}
        folder = Folder(path, int(about["shape"][-1]), done, layers, record)
        try:
            yield folder
        finally:
            folder.sync()


def read_about(path: Path) -> dict[str, Any]:
    """What a folder says that it is.

    Raises:
        InputError: where that is no folder of a chart.
    """
    try:
        about = json.loads((path / ABOUT).read_text(encoding="utf-8"))
    except OSError as error:
        said = f"'{path}' is no chart: {ABOUT} cannot be read ({error.strerror})"
        raise InputError([Fault(f"{said}; give the folder that tmsopt chart FILE --output NAME.chart wrote")]) from None
    except ValueError:
        raise damaged(path, f"{ABOUT} is not JSON") from None
    if not isinstance(about, dict) or about.get("schema") != SCHEMA:
        raise damaged(path, f"{ABOUT} has no schema {SCHEMA}")
    if not {"shape", "layers", "axes", "tile"} <= set(about):
        raise damaged(path, f"{ABOUT} lacks shape, layers, axes or tile")
    return about


def read_tiles(path: Path) -> dict[int, Tally]:
    """First row → counts of the recorded tiles.

    Raises:
        InputError: for a damaged record.
    """
    return _read_record(path)[0]


def read_array(path: Path, part: str, name: str) -> NDArray[Any]:
    """An axis or a layer, as a memory map that is read when it is looked at.

    Raises:
        InputError: for a file that is missing or damaged.
    """
    file = path / part / f"{name}.npy"
    try:
        return np.asanyarray(np.load(file, mmap_mode="r", allow_pickle=False))
    except (OSError, ValueError, EOFError) as error:
        raise damaged(path, f"{part}/{name}.npy cannot be read ({error})") from None


def damaged(path: Path, what: str) -> InputError:
    """The fault of a folder that is not as it was written."""
    return InputError([Fault(f"'{path}' is damaged: {what}; give --fresh to chart anew and move this one aside")])


def _locked(path: Path) -> Lock:
    """The right to write a chart.

    Raises:
        InputError: where another process has it, or nothing can be written.
    """
    try:
        held = lock(path.resolve())
    except (OSError, sqlite3.Error) as error:
        raise _unwritten(path, error) from None
    if held is None:
        message = f"'{path}' is being written by another process; wait for it, or give another name"
        raise InputError([Fault(message, ("--output",))])
    return held


def _unwritten(path: Path, error: Exception) -> InputError:
    reason = getattr(error, "strerror", None) or error
    return InputError([Fault(f"'{path}' cannot be written: {reason}", ("--output",))])


def _create(path: Path, about: Mapping[str, Any], axes: Mapping[str, NDArray[Any]]) -> None:
    try:
        _check_room(path.parent, about)
        with whole(path, locked=True) as new:
            for part in ("axes", "layers"):
                (new / part).mkdir(parents=True)
            for name, values in axes.items():
                np.save(new / "axes" / f"{name}.npy", values)
            shape = tuple(about["shape"])
            for name, layer in about["layers"].items():
                dtype = np.dtype(layer["dtype"])
                with _layer(new, name).open("wb") as stream:
                    header = {"descr": np.lib.format.dtype_to_descr(dtype), "fortran_order": False, "shape": shape}
                    np.lib.format.write_array_header_1_0(stream, header)
                    stream.truncate(stream.tell() + int(np.prod(shape)) * dtype.itemsize)
            (new / TILES).touch()
            (new / ABOUT).write_text(json.dumps(about, indent=2, ensure_ascii=False), encoding="utf-8")
    except OSError as error:
        raise _unwritten(path, error) from None


def _check_room(parent: Path, about: Mapping[str, Any]) -> None:
    each = sum(np.dtype(layer["dtype"]).itemsize for layer in about["layers"].values())
    needed, free = each * int(np.prod(about["shape"])), shutil.disk_usage(parent).free
    if needed > free:
        message = f"takes {needed / 1e9:.1f} GB, and {free / 1e9:.1f} GB are free; ask for fewer layers or points"
        raise InputError([Fault(message, ("--output",))])


def _layer(path: Path, name: str) -> Path:
    return path / "layers" / f"{name}.npy"


def _offset(path: Path, name: str, about: Mapping[str, Any]) -> int:
    """Where the numbers of a layer begin.

    Raises:
        InputError: for a file that is not of the grid's shape, kind of number and length.
    """
    dtype, shape = np.dtype(about["layers"][name]["dtype"]), tuple(about["shape"])
    try:
        with _layer(path, name).open("rb") as stream:
            version = np.lib.format.read_magic(stream)
            header = np.lib.format.read_array_header_1_0(stream) if version == (1, 0) else None
            begin, end = stream.tell(), stream.seek(0, os.SEEK_END)
    except (OSError, ValueError) as error:
        raise damaged(path, f"layers/{name}.npy cannot be read ({error})") from None
    if header != (shape, False, dtype) or end - begin != int(np.prod(shape)) * dtype.itemsize:
        raise damaged(path, f"layers/{name}.npy is not of shape {shape} and type {dtype}")
    return begin


def _read_record(path: Path) -> tuple[dict[int, Tally], int]:
    """The recorded tiles, and where the record's last whole line ends."""
    try:
        lines = (path / TILES).read_bytes().split(b"\n")
    except OSError as error:
        raise damaged(path, f"{TILES} cannot be read ({error.strerror})") from None
    done: dict[int, Tally] = {}
    for number, line in enumerate(lines[:-1], 1):  # what follows the last line break was being written
        try:
            data = json.loads(line)
            counts = {f.name: data[f.name] for f in fields(Tally)}
            counts["classes"] = tuple(counts["classes"])
            counts["least"] = float("nan") if counts["least"] is None else counts["least"]
            done[int(data["row"])] = Tally(**counts)
        except (ValueError, KeyError, TypeError):
            raise damaged(path, f"line {number} of {TILES} is not a tile's") from None
    return done, sum(len(line) + 1 for line in lines[:-1])


def complete(done: Iterable[int], tiles: Iterable[range]) -> list[range]:
    """The tiles that are not recorded."""
    known = set(done)
    return [rows for rows in tiles if rows.start not in known]
