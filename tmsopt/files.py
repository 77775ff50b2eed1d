"""Files and folders: read within limits, written as a whole or not at all, compared and moved aside."""

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
from itertools import islice
from math import isnan
from os import PathLike
from pathlib import Path
from typing import Any, BinaryIO

from tmsopt.errors import Fault, InputError, short, suggest

LARGEST = 500_000
"""Bytes; a longer file is not a problem file."""

LARGEST_JSON = 24_000_000
"""Characters of JSON that is read, some 1 200 000 numbers."""

_DEEPEST, _MARKS = 100, 1_000_000  # lists and tables inside each other; lists, tables, texts and keys of JSON in all
_WIDTH = 80  # of a value in a message
_UNDECODED = re.compile("[\udc80-\udcff]")
_NEIGHBOURS = 1000  # files of a folder that are looked at for one that was meant


@contextmanager
def write_atomic(path: Path, *, locked: bool = False) -> Iterator[Path]:
    """A free name for a file or folder, which takes the place of `path` if all went well; a link stays one.

    A device or a pipe is given what is finished.

    Args:
        locked: nobody else writes here: the name is always the same, and what a killed process left there goes.

    Raises:
        OSError: with the name of `path`, when it cannot be written.
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
        else:  # a file, for a folder takes an open file to be removed
            handle, name = tempfile.mkstemp(
                dir=None if special else target.parent, prefix=".tmsopt-", suffix=target.suffix
            )
            os.close(handle)
            temporary = Path(name)
        try:
            yield temporary
            if special:
                with temporary.open("rb") as source, target.open("wb") as sink:
                    shutil.copyfileobj(source, sink)
                return
            if not locked:  # a temporary file is for its owner alone
                umask = os.umask(0)
                os.umask(umask)
                os.chmod(temporary, 0o666 & ~umask)
            os.replace(temporary, target)
        finally:
            _remove(temporary)
    except OSError as error:  # some know no file, or only the temporary one
        raise OSError(error.errno or errno.EIO, error.strerror or str(error), str(path)) from error


@contextmanager
def netcdf_errors() -> Iterator[None]:
    """What the HDF5 library says of a full disk, in a RuntimeError, as the OSError that it is."""
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
    """Move a file or folder to ``name.1.ending``, or the first number that is free; its new place.

    Args:
        companions: what the names of files beside it end in, after its own; they go with it where they are.

    Raises:
        OSError: when it cannot be moved, e.g. while somebody reads it on Windows.
    """
    parts, number = ("", *companions), 1
    while any(os.path.lexists(f"{_numbered(path, number)}{part}") for part in parts):
        number += 1
    moved = _numbered(path, number)
    for part in parts:
        if os.path.lexists(f"{path}{part}"):
            os.rename(f"{path}{part}", f"{moved}{part}")
    return moved


def _numbered(path: Path, number: int) -> Path:
    return path.with_name(f"{path.stem}.{number}{path.suffix}")


def list_differences(
    known: Any, asked: Any, sides: tuple[str, str] = ("there", "asked for"), key: str = ""
) -> Iterator[str]:
    """Where two pieces of plain data differ, one phrase each; numbers differ where any bit of their doubles does.

    Args:
        known, asked: what JSON knows, and columns as ``array("d")``.
        sides: what follows a value of the one and of the other.
    """
    match known, asked:
        case Mapping(), Mapping():
            for name in dict.fromkeys((*known, *asked)):
                inner = f"{key}.{name}" if key else str(name)
                if name in known and name in asked:
                    yield from list_differences(known[name], asked[name], sides, inner)
                else:
                    one, other = (_shown(side[name]) if name in side else "none" for side in (known, asked))
                    yield f"{inner}: {one} {sides[0]}, {other} {sides[1]}"
        case array(), array():
            if len(known) != len(asked):
                yield f"{key}: {len(known)} values {sides[0]}, {len(asked)} {sides[1]}"
            if known.tobytes() == asked.tobytes():
                return
            if differ := [row for row, pair in enumerate(zip(known, asked, strict=False)) if not _same(*pair)]:
                most, first = min(len(known), len(asked)), differ[0]
                values = f"{known[first]!r} {sides[0]}, {asked[first]!r} {sides[1]}"
                yield f"{key}: {len(differ)} of {most} values differ, the first in row {first}: {values}"
        case list(), list() if len(known) == len(asked):
            for index, (one, other) in enumerate(zip(known, asked, strict=True)):
                yield from list_differences(one, other, sides, f"{key}[{index}]")
        case _ if not _same(known, asked):
            yield f"{key}: {_shown(known)} {sides[0]}, {_shown(asked)} {sides[1]}"


def _same(a: Any, b: Any) -> bool:
    """Equal to the bit: 1 is 1.0, but 0.0 is not −0.0, true is not 1, and nan is nan."""
    if isinstance(a, bool) or isinstance(b, bool) or not (isinstance(a, int | float) and isinstance(b, int | float)):
        return type(a) is type(b) and bool(a == b)
    return repr(float(a)) == repr(float(b)) and (a == b or isnan(a))


def _shown(value: Any) -> str:
    if isinstance(value, array):
        return f"{len(value)} values"
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= _WIDTH else f"{text[: _WIDTH - 1]}…"


def read_text(file: str, kind: str, largest: int = LARGEST) -> str:
    """The text of a file in UTF-8, a byte order mark left out.

    Args:
        kind: what is accepted, such as ``TOML problem file``; its first word is the format.

    Raises:
        InputError: for a file that is not there, no file, too long, or no text.
    """
    with _opened(file, kind, largest) as stream:
        raw = stream.read(largest)
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise _not_text(file, kind, raw[error.start], raw[: error.start].count(b"\n") + 1) from None


def read_lines(file: str, kind: str, largest: int, longest: int) -> Generator[str]:
    """The lines of such a file with their ends, one after the other, none of more than `longest` characters.

    Raises:
        InputError: likewise, when the line at fault is asked for.
    """
    with _opened(file, kind, largest) as stream:
        text = io.TextIOWrapper(stream, encoding="utf-8-sig", errors="surrogateescape", newline="")
        for number, line in enumerate(iter(partial(text.readline, longest + 1), ""), start=1):
            if len(line) > longest:
                message = f"is longer than {longest} characters; accepted: lines of up to {longest}"
                raise InputError([Fault(f"the line {message}").at(file, number)])
            if not line.isascii() and (wrong := _UNDECODED.search(line)):
                raise _not_text(file, kind, ord(wrong[0]) - 0xDC00, number)
            yield line


@contextmanager
def _opened(file: str, kind: str, largest: int) -> Iterator[BinaryIO]:
    """A regular file of up to `largest` bytes; nothing else is opened, for a pipe or a device may have no end."""
    path, form = Path(file), kind.split(maxsplit=1)[0]
    try:
        if path.is_dir():
            raise InputError([Fault(f"is a directory; accepted: a {kind}", file=file)])
        if path.is_symlink() and not path.exists():
            raise InputError([Fault(f"is a link to no file; accepted: a {kind}", file=file)])
        if not path.exists():
            others = path.parent.glob(f"*.{form.lower()}") if path.parent.is_dir() else ()
            near = suggest(path.name, sorted(p.name for p in islice(others, _NEIGHBOURS)))
            hint = f"; {near}" if "did you mean" in near else ""
            raise InputError([Fault(f"no such file{hint}", file=file)])
        if not path.is_file():
            raise InputError([Fault(f"is not a regular file; accepted: a {kind}", file=file)])
        with path.open("rb") as stream:
            if os.fstat(stream.fileno()).st_size > largest:
                raise InputError([Fault(f"is larger than {largest} bytes; accepted: a {kind} of less", file=file)])
            yield stream
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise InputError([Fault(f"cannot be read: {reason}", file=file)]) from None


def _not_text(file: str, kind: str, byte: int, line: int) -> InputError:
    form = kind.split(maxsplit=1)[0]
    return InputError([Fault(f"not {form}: byte {byte:#x} is not UTF-8").at(file, line)])


def from_json(text: str, largest: int = LARGEST_JSON) -> Any:
    """What a text in JSON says, which may come from anybody: its length, depth and memory have limits.

    Raises:
        ValueError: for another text.
    """
    if len(text) > largest or sum(map(text.count, '[{:"')) > _MARKS:
        raise ValueError(f"more than {largest} characters of JSON, or {_MARKS} lists, tables and texts")
    with suppress(RecursionError):
        made = json.loads(text)
        level, depth = [made], 0
        while depth <= _DEEPEST:
            inner = [v.values() if isinstance(v, dict) else v for v in level if isinstance(v, dict | list)]
            if not inner:
                return made
            level, depth = [value for values in inner for value in values], depth + 1
    raise ValueError(f"lists and tables more than {_DEEPEST} deep")


def as_path(given: object, what: str) -> Path:
    """The path of a file that a user names.

    Raises:
        InputError: for what is none.
    """
    if not isinstance(given, str | PathLike):
        raise InputError([Fault(f"found {short(given)}; accepted: the path of {what}", ("path",))])
    return Path(given)


def write_csv(path: str | PathLike[str], rows: Sequence[Mapping[str, Any]], units: Mapping[str, str]) -> None:
    """Write rows with the same names as one table, headed by the names with the units that they have.

    Raises:
        OSError: when the file cannot be written.
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
    """Write a text in UTF-8, as a whole or not at all, line breaks as they are.

    Args:
        new: only where nothing has that name.

    Raises:
        OSError: when the file cannot be written.
    """
    path = as_path(path, "the file to write")
    if new and os.path.lexists(path):
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))
    with write_atomic(path) as place:
        place.write_bytes(text.encode())


def format_cell(value: Any) -> Any:
    """What stands in a cell of a CSV.

    A text that a spreadsheet would take for a formula gets an apostrophe, and a carriage return, at which some begin
    another row, becomes a line feed.
    """
    if not isinstance(value, str):
        return value
    text = value.replace("\r\n", "\n").replace("\r", "\n")
    return f"'{text}" if text.startswith(("=", "+", "-", "@", "\t", "\n")) else text


def format_header(name: str, unit: str) -> str:
    """The head of a column: ``v (m/s)``."""
    return f"{name} ({unit})" if unit else name
