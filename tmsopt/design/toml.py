"""A TOML file that knows at which line each of its keys is, so that every fault can be placed."""

import re
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from os import PathLike
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, StrictFloat, StrictInt, StrictStr, ValidationError

from tmsopt.design.advice.lines import line_advice
from tmsopt.disk import path_of, read_text
from tmsopt.errors import Fault, InputError

Number = StrictFloat | StrictInt | StrictStr
"""A number, or a text with a unit."""


class Section(BaseModel):
    """A table of a file, in which no other key may stand."""

    model_config = ConfigDict(extra="forbid")


S = TypeVar("S", bound=Section)
Key = tuple[str, ...]


@dataclass(frozen=True)
class Page:
    """A TOML file as read.

    Attributes:
        data: its tables.
        lines: section or key that begins a line → number of that line.
    """

    file: str
    data: Mapping[str, Any]
    lines: Mapping[Key, int]

    def error(self, faults: Iterable[Fault]) -> InputError:
        """The faults, each at its line of this file unless it is placed already, in the order of the lines."""
        placed = [f if f.file else f.at(self.file, self._line_of(f.key)) for f in faults]
        return InputError(sorted(placed, key=lambda f: f.line))

    def _line_of(self, key: Key) -> int:
        """Line of the longest part of a key path that the file has; 1 for something missing altogether."""
        for end in range(len(key), 0, -1):
            if key[:end] in self.lines:
                return self.lines[key[:end]]
        return 1


def read_page(path: str | PathLike[str], kind: str) -> Page:
    """Read a TOML file of some kind, such as ``problem``.

    Raises:
        InputError: for a file that cannot be read, or is not TOML.
    """
    path_of(path, f"a {kind} file")
    file = str(path) or "."
    text = read_text(file, f"TOML {kind} file")
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        place = re.search(r"line (\d+)", str(error))
        line = _unclosed(text) or (int(place[1]) if place else text.count("\n") + 1)
        written = "".join(text.splitlines()[line - 1 : line])  # none where the end of the file is at fault
        raise InputError([Fault(f"not TOML: {error}{line_advice(written)}").at(file, line)]) from None
    except RecursionError:
        raise InputError([Fault("not TOML: nested too deeply", file=file)]) from None
    return Page(file, data, _lines(text))


def fitted(
    data: Mapping[str, Any], schema: type[S], explain: Callable[[tuple[int | str, ...], str, Any], Fault]
) -> tuple[list[Fault], S | None]:
    """Faults of shape, and what is left of the data without the faulty keys.

    Args:
        explain: place, kind and found value of a complaint → the fault in the words of the file.
    """
    faults: dict[Key, Fault] = {}
    pruned: dict[str, Any] = dict(data)
    for _ in range(2):
        try:
            return list(faults.values()), schema.model_validate(pruned)
        except ValidationError as error:
            found = [explain(d["loc"], d["type"], d.get("input")) for d in error.errors(include_url=False)]
            deepest = {f.key[:2]: max(len(g.key) for g in found if g.key[:2] == f.key[:2]) for f in found}
            for fault in found:
                if len(fault.key) == deepest[fault.key[:2]]:
                    faults.setdefault(fault.key, fault)
        for key in faults:
            pruned = _without(pruned, key[:2])
    return list(faults.values()), None


def within(section: str, faults: Iterable[Fault]) -> list[Fault]:
    """Faults of a table that is itself in a section."""
    return [replace(f, key=(section, *f.key)) for f in faults]


def _without(data: Mapping[str, Any], key: Key) -> dict[str, Any]:
    inner = data.get(key[0])
    if len(key) == 2 and isinstance(inner, dict):
        return {**data, key[0]: {k: v for k, v in inner.items() if k != key[1]}}
    return {k: v for k, v in data.items() if k != key[0]}


_HEADER = re.compile(r"\s*\[+\s*([^\]]+?)\s*\]+")
_KEY = re.compile(r"\s*([A-Za-z0-9_\-.\"' ]+?)\s*=")
_SECTION = re.compile(r"\[[A-Za-z_][\w.]*\]\s*(#.*)?$")
_LONG_QUOTES = ('"""', "'''")
_TOKEN = re.compile(r"""\"{3}|'{3}|\"(?:[^\"\\]|\\.)*\"|'[^']*'|[][{}#]""")
_PART = re.compile(r"\"[^\"]*\"|'[^']*'|[^.\"']+")


def _lines(text: str) -> dict[Key, int]:
    """Line number of every section and key that begins a line, but for lines inside a list or a text of several."""
    section: Key = ()
    lines: dict[Key, int] = {}
    depth, inside = 0, ""
    for number, line in enumerate(text.splitlines(), start=1):
        if depth == 0 and not inside:
            if header := _HEADER.match(line):
                section = _path(header[1])
                lines.setdefault(section, number)
                continue
            if key := _KEY.match(line):
                lines.setdefault((*section, *_path(key[1])), number)
        depth, inside = _open(line, depth, inside)
    return lines


def _unclosed(text: str) -> int:
    """Line of a list that is still open where another key or section begins; 0 for none."""
    depth, inside, begun = 0, "", 0
    for number, line in enumerate(text.splitlines(), start=1):
        if depth == 0:
            begun = number
        elif not inside and (_KEY.match(line) or _SECTION.match(line)):
            return begun
        if depth > 0 or not _HEADER.match(line):
            depth, inside = _open(line, depth, inside)
    return begun if depth > 0 else 0


def _open(line: str, depth: int, inside: str) -> tuple[int, str]:
    """How many brackets are open after a line, and the quotes of a text that goes on."""
    for token in _TOKEN.findall(line):
        if inside:
            inside = "" if token == inside else inside
        elif token in _LONG_QUOTES:
            inside = token
        elif token == "#":
            break
        elif token in "[{":
            depth += 1
        elif token in "]}":
            depth -= 1
    return depth, inside


def _path(dotted: str) -> Key:
    parts = (part.strip() for part in _PART.findall(dotted))
    return tuple(part.strip("\"'") for part in parts if part)
