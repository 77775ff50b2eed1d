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
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.charts.received import ABOUT, TILES, array_file, read_about, read_record
from tmsopt.charts.summary import Tally
from tmsopt.disk import aside, differences, resolved, whole
from tmsopt.errors import Fault, InputError
from tmsopt.locks import Lock, lock

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
        done, end = read_record(path, about)
        places = {
            n: array_file(path, f"layers/{n}.npy", about["shape"], layer["dtype"])
            for n, layer in about["layers"].items()
        }
        record = stack.enter_context((path / TILES).open("r+b"))
        record.truncate(end)
        record.seek(end)
        layers = {n: (stack.enter_context(place.open("r+b")), at) for n, (place, at) in places.items()}
        folder = Folder(path, int(about["shape"][-1]), done, layers, record)
        try:
            yield folder
        finally:
            folder.sync()


def _locked(path: Path) -> Lock:
    """The right to write a chart.

    Raises:
        InputError: where another process has it, or nothing can be written.
    """
    try:
        held = lock(resolved(path))
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
                with (new / "layers" / f"{name}.npy").open("wb") as stream:
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


def complete(done: Iterable[int], tiles: Iterable[range]) -> list[range]:
    """The tiles that are not recorded."""
    known = set(done)
    return [rows for rows in tiles if rows.start not in known]
