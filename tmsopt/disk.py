"""Files that are written as a whole or not at all."""

import csv
import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import Any

from tmsopt.errors import Fault, InputError, suggest

LARGEST = 1_000_000
"""Bytes; a longer file is not a problem file."""


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """The name of a temporary file beside `path`, which takes its place if all went well; a link stays one.

    Raises:
        OSError: when the file cannot be written.
    """
    path = path.resolve()
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=".tmsopt-", suffix=path.suffix)
    os.close(handle)
    try:
        yield Path(temporary)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)
        os.replace(temporary, path)
    finally:
        Path(temporary).unlink(missing_ok=True)


def read_text(file: str, kind: str, largest: int = LARGEST) -> str:
    """The text of a file in UTF-8, a byte order mark left out.

    Args:
        kind: what is accepted, such as ``TOML problem file``; its first word is the format.

    Raises:
        InputError: for a file that is not there, no file, too long, or no text.
    """
    path, form = Path(file), kind.split(maxsplit=1)[0]
    try:
        if path.is_dir():
            raise InputError([Fault(f"is a directory; accepted: a {kind}", file=file)])
        if not path.exists():
            others = path.parent.glob(f"*.{form.lower()}") if path.parent.is_dir() else ()
            near = suggest(path.name, sorted(p.name for p in others))
            hint = f"; {near}" if "did you mean" in near else ""
            raise InputError([Fault(f"no such file{hint}", file=file)])
        if not path.is_file():
            raise InputError([Fault(f"is not a regular file; accepted: a {kind}", file=file)])
        with path.open("rb") as stream:
            raw = stream.read(largest + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        if isinstance(error, InputError):
            raise
        raise InputError([Fault(f"cannot be read: {reason}", file=file)]) from None
    if len(raw) > largest:
        raise InputError([Fault(f"is larger than {largest} bytes; accepted: a {kind} of less", file=file)])
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        raise InputError([Fault(f"not {form}: byte {raw[error.start]:#x} is not UTF-8").at(file, line)]) from None


def write_csv(path: str | PathLike[str], rows: Sequence[Mapping[str, Any]]) -> None:
    """Write rows with the same names as one table.

    Raises:
        OSError: when the file cannot be written.
    """
    with open(path, "w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, fieldnames=list(rows[0]) if rows else [])
        writer.writeheader()
        writer.writerows(rows)
