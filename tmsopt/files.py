"""Files and folders: reads with limits of size, atomic writes, comparisons and backups."""

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

from tmsopt.errors import Fault, InputError, find_similar, short

MAX_FILE_BYTES = 500_000
"""Largest number of bytes of a problem file."""

MAX_JSON_CHARACTERS = 24_000_000
"""Largest number of characters of a JSON text, enough for about 1 200 000 numbers."""

_MAX_DEPTH = 100  # largest number of nested levels of JSON
_MAX_ITEMS = 1_000_000  # largest number of lists, tables, texts and keys of JSON together
_MAX_WIDTH = 80  # largest number of characters of a value in a message
_UNDECODED = re.compile("[\udc80-\udcff]")
_MAX_SUGGESTIONS = 3  # largest number of similar names that a message suggests
_MAX_COMPARED = 1000  # largest number of files of a folder that are compared with a misspelled name


@contextmanager
def write_atomic(path: Path, *, is_locked: bool = False) -> Iterator[Path]:
    """Yield a temporary path, which replaces `path` if no exception is raised; links are followed.

    A device or a pipe receives the finished contents.

    Args:
        is_locked: whether the caller ensures that no other process writes `path`. Then the temporary file always has
            the same name, and an old one is deleted.

    Raises:
        OSError: if `path` cannot be written; the error has this name.
    """
    try:
        try:
            target = path.resolve()
        except RuntimeError as error:  # links in a circle
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP)) from error
        is_special = target.exists() and not (target.is_file() or target.is_dir())
        if is_locked:
            temporary = target.with_name(f".{target.name}.unfinished")
            _remove(temporary)
        else:  # the caller may replace this temporary file by a folder
            folder = None if is_special else target.parent
            handle, name = tempfile.mkstemp(dir=folder, prefix=".tmsopt-", suffix=target.suffix)
            os.close(handle)
            temporary = Path(name)
        try:
            yield temporary
            if is_special:
                target.write_bytes(temporary.read_bytes())
                return
            if not is_locked:  # temporary files are private to their owner
                umask = os.umask(0)
                os.umask(umask)
                os.chmod(temporary, 0o666 & ~umask)
            os.replace(temporary, target)
        finally:
            _remove(temporary)
    except OSError as error:  # the error may have no file name, or the name of the temporary file
        raise OSError(error.errno or errno.EIO, error.strerror or str(error), str(path)) from error


@contextmanager
def netcdf_errors() -> Iterator[None]:
    """Turn a RuntimeError of the HDF5 library, e.g. about a full disk, into an OSError."""
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
        companions: suffixes after the whole name. Files with these longer names are moved, too, if they exist.

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
    old: Any, new: Any, labels: tuple[str, str] = ("there", "asked for"), key: str = ""
) -> Iterator[str]:
    """One phrase for each difference between two pieces of plain data; numbers are compared as doubles, bit by bit.

    Args:
        old, new: JSON data, with columns as ``array("d")``.
        labels: words after a value of `old`, and words after a value of `new`.
    """
    old_words, new_words = labels
    match old, new:
        case Mapping(), Mapping():
            for name in dict.fromkeys((*old, *new)):
                inner = f"{key}.{name}" if key else str(name)
                if name in old and name in new:
                    yield from list_differences(old[name], new[name], labels, inner)
                else:
                    old_value, new_value = (
                        _format_value(side[name]) if name in side else "none" for side in (old, new)
                    )
                    yield f"{inner}: {old_value} {old_words}, {new_value} {new_words}"
        case array(), array():
            if len(old) != len(new):
                yield f"{key}: {len(old)} values {old_words}, {len(new)} {new_words}"
            pairs = [] if old.tobytes() == new.tobytes() else list(zip(old, new, strict=False))
            if rows := [row for row, pair in enumerate(pairs) if not _is_same(*pair)]:
                old_value, new_value = pairs[rows[0]]
                values = f"{old_value!r} {old_words}, {new_value!r} {new_words}"
                yield f"{key}: {len(rows)} of {len(pairs)} values differ, the first in row {rows[0]}: {values}"
        case list(), list() if len(old) == len(new):
            for index, (old_value, new_value) in enumerate(zip(old, new, strict=True)):
                yield from list_differences(old_value, new_value, labels, f"{key}[{index}]")
        case _ if not _is_same(old, new):
            yield f"{key}: {_format_value(old)} {old_words}, {_format_value(new)} {new_words}"


def _is_same(a: Any, b: Any) -> bool:
    """Equality of doubles bit by bit: 1 equals 1.0 and nan equals nan, but 0.0 differs from −0.0, and true from 1."""
    if all(isinstance(x, int | float) and not isinstance(x, bool) for x in (a, b)):
        return repr(float(a)) == repr(float(b)) and (a == b or isnan(a))
    return type(a) is type(b) and bool(a == b)


def _format_value(value: Any) -> str:
    if isinstance(value, array):
        return f"{len(value)} values"
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= _MAX_WIDTH else f"{text[: _MAX_WIDTH - 1]}…"


def read_text(file: str, kind: str, max_bytes: int = MAX_FILE_BYTES) -> str:
    """The text of a UTF-8 file, without a byte order mark.

    Args:
        kind: kind of file for messages, such as ``TOML problem file``; the first word is the format.

    Raises:
        InputError: if the file is missing, irregular, too long or not UTF-8.
    """
    return "".join(read_lines(file, kind, max_bytes, max_bytes))


def read_lines(file: str, kind: str, max_bytes: int, max_line_length: int) -> Generator[str]:
    """Yield the lines of a UTF-8 file with their line ends; a line may have up to `max_line_length` characters.

    Raises:
        InputError: like `read_text`, with the number of the line.
    """
    with _open(file, kind, max_bytes) as stream:
        text = io.TextIOWrapper(stream, encoding="utf-8-sig", errors="surrogateescape", newline="")
        for number, line in enumerate(iter(partial(text.readline, max_line_length + 1), ""), start=1):
            message = ""
            if len(line) > max_line_length:
                message = (
                    f"the line is longer than {max_line_length} characters; accepted: lines of up to {max_line_length}"
                )
            elif not line.isascii() and (byte := _UNDECODED.search(line)):
                message = f"not {kind.split(maxsplit=1)[0]}: byte {ord(byte[0]) - 0xDC00:#x} is not UTF-8"
            if message:
                raise InputError([Fault(message, file=file, line=number)])
            yield line


@contextmanager
def _open(file: str, kind: str, max_bytes: int) -> Iterator[BinaryIO]:
    """Open a regular file of up to `max_bytes` bytes. A pipe or a device is an error, because it may never end."""
    path = Path(file)
    try:
        if fault := _path_fault(path, kind, max_bytes):
            raise InputError([Fault(fault, file=file)])
        with path.open("rb") as stream:
            yield stream
    except InputError:
        raise
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise InputError([Fault(f"cannot be read: {reason}", file=file)]) from None


def _path_fault(path: Path, kind: str, max_bytes: int) -> str:
    if path.is_file():
        return (
            f"is larger than {max_bytes} bytes; accepted: a smaller {kind}" if path.stat().st_size > max_bytes else ""
        )
    if os.path.lexists(path):
        kind_found = "a directory" if path.is_dir() else "not a regular file" if path.exists() else "a link to no file"
        return f"is {kind_found}; accepted: a {kind}"
    candidates = path.parent.glob(f"*.{kind.split(maxsplit=1)[0].lower()}") if path.parent.is_dir() else ()
    names = find_similar(
        path.name, sorted(p.name for p in islice(candidates, _MAX_COMPARED)), max_count=_MAX_SUGGESTIONS
    )
    return f"no such file; did you mean {' or '.join(map(repr, names))}?" if names else "no such file"


def from_json(text: str, max_characters: int = MAX_JSON_CHARACTERS) -> Any:
    """Parse JSON from an untrusted source, with limits for length, depth and memory.

    Raises:
        ValueError: if the text is not JSON, or exceeds a limit.
    """
    if len(text) > max_characters or sum(map(text.count, '[{:"')) > _MAX_ITEMS:
        raise ValueError(f"more than {max_characters} characters of JSON, or {_MAX_ITEMS} lists, tables and texts")
    with suppress(RecursionError):
        data = json.loads(text)
        if _measure_depth(data) <= _MAX_DEPTH:
            return data
    raise ValueError(f"lists and tables more than {_MAX_DEPTH} deep")


def _measure_depth(data: Any) -> int:
    """Number of nested levels of lists and tables."""
    inner = data.values() if isinstance(data, dict) else data if isinstance(data, list) else None
    return 0 if inner is None else 1 + max((_measure_depth(v) for v in inner if isinstance(v, dict | list)), default=0)


def as_path(value: object, description: str) -> Path:
    """Convert an argument of a user to a path; it must be a text or a path.

    Args:
        description: the file in words, for messages.

    Raises:
        InputError: if it is neither a text nor a path.
    """
    if not isinstance(value, str | PathLike):
        raise InputError([Fault(f"found {short(value)}; accepted: the path of {description}", ("path",))])
    return Path(value)


def write_csv(path: str | PathLike[str], rows: Sequence[Mapping[str, Any]], units: Mapping[str, str]) -> None:
    """Write rows, which all have the same names, as a CSV table; its header has names and units.

    Raises:
        OSError: if the file cannot be written.
    """
    with (
        write_atomic(as_path(path, "the file to write")) as temporary,
        temporary.open("w", newline="", encoding="utf-8") as stream,
    ):
        names = list(rows[0]) if rows else []
        writer = csv.writer(stream)
        writer.writerow(format_cell(format_header(n, units.get(n, ""))) for n in names)
        writer.writerows([format_cell(row[n]) for n in names] for row in rows)


def write_text(path: str | PathLike[str], text: str, *, must_be_new: bool = False) -> None:
    """Write a text atomically in UTF-8; line breaks stay unchanged.

    Args:
        must_be_new: raise an error if `path` exists.

    Raises:
        OSError: if the file cannot be written.
    """
    path = as_path(path, "the file to write")
    if must_be_new and os.path.lexists(path):
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))
    with write_atomic(path) as temporary:
        temporary.write_bytes(text.encode())


def format_cell(value: Any) -> Any:
    """A value as a cell of a CSV file.

    A text that a spreadsheet would evaluate as a formula gets an apostrophe. A carriage return becomes a line feed,
    because some programs begin another row at it.
    """
    if not isinstance(value, str):
        return value
    text = value.replace("\r\n", "\n").replace("\r", "\n")
    return f"'{text}" if text.startswith(("=", "+", "-", "@", "\t", "\n")) else text


def format_header(name: str, unit: str) -> str:
    """The header of a column, such as ``v (m/s)``."""
    return f"{name} ({unit})" if unit else name
