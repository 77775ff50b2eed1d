"""Files and folders: bounded reads, atomic writes, comparisons and backups."""

import csv
import errno
import io
import json
import os
import re
import shutil
import tempfile
from array import array
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from itertools import count, islice
from math import isnan
from os import PathLike
from pathlib import Path
from typing import Any, BinaryIO

from tmsopt.errors import Fault, InputError, nearest, short

LARGEST = 500_000
"""Most bytes of a problem file."""

LARGEST_JSON = 24_000_000
"""Most characters of a JSON text, some 1 200 000 numbers."""

_DEEPEST, _MARKS = 100, 1_000_000  # most levels of JSON; most lists, tables, texts and keys
_WIDTH = 80  # most characters of a value in a message
_UNDECODED = re.compile("[\udc80-\udcff]")
_NEAR = 3  # close names that a message offers
_NEIGHBOURS = 1000  # most files of a folder compared with a misspelled name


@contextmanager
def write_atomic(path: Path, *, locked: bool = False) -> Iterator[Path]:
    """Yield a temporary path, which replaces `path` if no exception is raised; links are followed.

    A device or a pipe receives the finished contents.

    Args:
        locked: no other process writes `path`: the temporary name is fixed, and leftovers are deleted.

    Raises:
        OSError: naming `path`, if it cannot be written.
    """
    try:
        try:
            target = path.resolve()
        except RuntimeError as error:  # links in a circle
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP)) from error
        special = target.exists() and not (target.is_file() or target.is_dir())
        if locked:
            temporary = target.with_name(f".{target.name}.unfinished")
            _remove(temporary)
        else:  # the caller may replace this file by a folder
            folder = None if special else target.parent
            handle, name = tempfile.mkstemp(dir=folder, prefix=".tmsopt-", suffix=target.suffix)
            os.close(handle)
            temporary = Path(name)
        try:
            yield temporary
            if special:
                target.write_bytes(temporary.read_bytes())
                return
            if not locked:  # temporary files are private to their owner
                umask = os.umask(0)
                os.umask(umask)
                os.chmod(temporary, 0o666 & ~umask)
            os.replace(temporary, target)
        finally:
            _remove(temporary)
    except OSError as error:  # it may name no file, or the temporary one
        raise OSError(error.errno or errno.EIO, error.strerror or str(error), str(path)) from error


@contextmanager
def netcdf_errors() -> Iterator[None]:
    """Turn RuntimeErrors of the HDF5 library, e.g. about a full disk, into OSErrors."""
    try:
        yield
    except RuntimeError as error:
        raise OSError(errno.EIO, str(error)) from error


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def move_aside(path: Path, companions: tuple[str, ...] = ()) -> Path:
    """Move a file or folder to ``name.1.ending``, or the first free number, and return its new path.

    Args:
        companions: suffixes after the whole name, for files that move with it if they exist.

    Raises:
        OSError: if it cannot be moved, e.g. while a program reads it on Windows.
    """
    suffixes = ("", *companions)
    names = (path.with_name(f"{path.stem}.{number}{path.suffix}") for number in count(1))
    target = next(name for name in names if not any(os.path.lexists(f"{name}{suffix}") for suffix in suffixes))
    for suffix in suffixes:
        if os.path.lexists(f"{path}{suffix}"):
            os.rename(f"{path}{suffix}", f"{target}{suffix}")
    return target


def list_differences(
    known: Any, asked: Any, sides: tuple[str, str] = ("there", "asked for"), key: str = ""
) -> Iterator[str]:
    """One phrase for each difference between two pieces of plain data; numbers are compared as doubles, bit by bit.

    Args:
        known, asked: JSON data, with columns as ``array("d")``.
        sides: words that follow a value of `known` and of `asked`.
    """
    there, here = sides
    match known, asked:
        case Mapping(), Mapping():
            for name in dict.fromkeys((*known, *asked)):
                inner = f"{key}.{name}" if key else str(name)
                if name in known and name in asked:
                    yield from list_differences(known[name], asked[name], sides, inner)
                else:
                    one, other = (_format_value(side[name]) if name in side else "none" for side in (known, asked))
                    yield f"{inner}: {one} {there}, {other} {here}"
        case array(), array():
            if len(known) != len(asked):
                yield f"{key}: {len(known)} values {there}, {len(asked)} {here}"
            pairs = [] if known.tobytes() == asked.tobytes() else list(zip(known, asked, strict=False))
            if differ := [row for row, pair in enumerate(pairs) if not _is_same(*pair)]:
                one, other = pairs[differ[0]]
                values = f"{one!r} {there}, {other!r} {here}"
                yield f"{key}: {len(differ)} of {len(pairs)} values differ, the first in row {differ[0]}: {values}"
        case list(), list() if len(known) == len(asked):
            for index, (one, other) in enumerate(zip(known, asked, strict=True)):
                yield from list_differences(one, other, sides, f"{key}[{index}]")
        case _ if not _is_same(known, asked):
            yield f"{key}: {_format_value(known)} {there}, {_format_value(asked)} {here}"


def _is_same(a: Any, b: Any) -> bool:
    """Equality of doubles bit by bit: 1 equals 1.0 and nan equals nan, but 0.0 differs from −0.0, and true from 1."""
    if all(isinstance(x, int | float) and not isinstance(x, bool) for x in (a, b)):
        return repr(float(a)) == repr(float(b)) and (a == b or isnan(a))
    return type(a) is type(b) and bool(a == b)


def _format_value(value: Any) -> str:
    if isinstance(value, array):
        return f"{len(value)} values"
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= _WIDTH else f"{text[: _WIDTH - 1]}…"


def read_text(file: str, kind: str, largest: int = LARGEST) -> str:
    """The text of a UTF-8 file, without a byte order mark.

    Args:
        kind: kind of file for messages, such as ``TOML problem file``; its first word is the format.

    Raises:
        InputError: if the file is missing, irregular, too long or not UTF-8.
    """
    return "".join(read_lines(file, kind, largest, largest))


def read_lines(file: str, kind: str, largest: int, longest: int) -> Generator[str]:
    """Yield the lines of a UTF-8 file, line ends included, of up to `longest` characters each.

    Raises:
        InputError: as `read_text`, at the line at fault.
    """
    with _open(file, kind, largest) as stream:
        text = io.TextIOWrapper(stream, encoding="utf-8-sig", errors="surrogateescape", newline="")
        for number, line in enumerate(iter(partial(text.readline, longest + 1), ""), start=1):
            message = ""
            if len(line) > longest:
                message = f"the line is longer than {longest} characters; accepted: lines of up to {longest}"
            elif not line.isascii() and (wrong := _UNDECODED.search(line)):
                message = f"not {kind.split(maxsplit=1)[0]}: byte {ord(wrong[0]) - 0xDC00:#x} is not UTF-8"
            if message:
                raise InputError([Fault(message, file=file, line=number)])
            yield line


@contextmanager
def _open(file: str, kind: str, largest: int) -> Iterator[BinaryIO]:
    """Open a regular file of up to `largest` bytes; a pipe or a device might never end."""
    path = Path(file)
    try:
        if wrong := _path_fault(path, kind, largest):
            raise InputError([Fault(wrong, file=file)])
        with path.open("rb") as stream:
            yield stream
    except InputError:
        raise
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise InputError([Fault(f"cannot be read: {reason}", file=file)]) from None


def _path_fault(path: Path, kind: str, largest: int) -> str:
    if path.is_file():
        return f"is larger than {largest} bytes; accepted: a {kind} of less" if path.stat().st_size > largest else ""
    if os.path.lexists(path):
        found = "a directory" if path.is_dir() else "not a regular file" if path.exists() else "a link to no file"
        return f"is {found}; accepted: a {kind}"
    others = path.parent.glob(f"*.{kind.split(maxsplit=1)[0].lower()}") if path.parent.is_dir() else ()
    near = nearest(path.name, sorted(p.name for p in islice(others, _NEIGHBOURS)), most=_NEAR)
    return f"no such file; did you mean {' or '.join(map(repr, near))}?" if near else "no such file"


def from_json(text: str, largest: int = LARGEST_JSON) -> Any:
    """Parse JSON from an untrusted source, within limits of length, depth and memory.

    Raises:
        ValueError: if the text is not JSON, or beyond a limit.
    """
    if len(text) > largest or sum(map(text.count, '[{:"')) > _MARKS:
        raise ValueError(f"more than {largest} characters of JSON, or {_MARKS} lists, tables and texts")
    with suppress(RecursionError):
        data = json.loads(text)
        if _depth(data) <= _DEEPEST:
            return data
    raise ValueError(f"lists and tables more than {_DEEPEST} deep")


def _depth(data: Any) -> int:
    """Levels of lists and tables."""
    inner = data.values() if isinstance(data, dict) else data if isinstance(data, list) else None
    return 0 if inner is None else 1 + max((_depth(v) for v in inner if isinstance(v, dict | list)), default=0)


def as_path(given: object, what: str) -> Path:
    """A path that a user gave as text or path.

    Args:
        what: the file in words, for messages.

    Raises:
        InputError: if it is neither.
    """
    if not isinstance(given, str | PathLike):
        raise InputError([Fault(f"found {short(given)}; accepted: the path of {what}", ("path",))])
    return Path(given)


def write_csv(path: str | PathLike[str], rows: Sequence[Mapping[str, Any]], units: Mapping[str, str]) -> None:
    """Write rows with the same names as a CSV table; its header has names and units.

    Raises:
        OSError: if the file cannot be written.
    """
    with (
        write_atomic(as_path(path, "the file to write")) as place,
        place.open("w", newline="", encoding="utf-8") as stream,
    ):
        names = list(rows[0]) if rows else []
        writer = csv.writer(stream)
        writer.writerow(format_cell(format_header(n, units.get(n, ""))) for n in names)
        writer.writerows([format_cell(row[n]) for n in names] for row in rows)


def write_text(path: str | PathLike[str], text: str, *, new: bool = False) -> None:
    """Write a text atomically in UTF-8, line breaks unchanged.

    Args:
        new: fail if `path` exists.

    Raises:
        OSError: if the file cannot be written.
    """
    path = as_path(path, "the file to write")
    if new and os.path.lexists(path):
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))
    with write_atomic(path) as place:
        place.write_bytes(text.encode())


def format_cell(value: Any) -> Any:
    """A value as a cell of a CSV file.

    A text that a spreadsheet would evaluate as a formula gets an apostrophe. A carriage return, at which some programs
    begin another row, becomes a line feed.
    """
    if not isinstance(value, str):
        return value
    text = value.replace("\r\n", "\n").replace("\r", "\n")
    return f"'{text}" if text.startswith(("=", "+", "-", "@", "\t", "\n")) else text


def format_header(name: str, unit: str) -> str:
    """The header of a column, such as ``v (m/s)``."""
    return f"{name} ({unit})" if unit else name
