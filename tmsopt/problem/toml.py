"""Reads a TOML file with the line of each key, so that every fault has its line."""

import re
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from os import PathLike
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, StrictFloat, StrictInt, StrictStr, ValidationError

from tmsopt.errors import MAX_LISTED, Fault, InputError, short
from tmsopt.files import as_path, read_text
from tmsopt.problem.advice.lines import suggest_line

MAX_KEY_PARTS = 10
"""Greatest number of parts of a dotted key."""

MAX_DEPTH = 50
"""Greatest depth of lists and tables."""

_MAX_WORD_LENGTH = 1000  # greatest number of characters of a number or of a name without quotes
_MAX_EXPLAINED = 10 * MAX_LISTED  # greatest number of explained error messages of pydantic; a key may have several

Number = StrictFloat | StrictInt | StrictStr
"""A number, or a text with a unit."""


class Section(BaseModel):
    """A table of a file that allows no other keys than its fields; the docstring of a field describes the key."""

    model_config = ConfigDict(extra="forbid", use_attribute_docstrings=True)


S = TypeVar("S", bound=Section)
Key = tuple[str, ...]
Tables = Mapping[str, Any]
"""The tables of a file, or a table."""


@dataclass(frozen=True)
class Page:
    """A TOML file as read.

    Attributes:
        data: its tables.
        lines: section or key → number of its line.
    """

    file: str
    data: Tables
    lines: Mapping[Key, int]

    def error(self, faults: Iterable[Fault]) -> InputError:
        """The error with the faults in the order of their lines; a fault without a file is located in this file."""
        located_faults = [f if f.file else f.at(self.file, self._line_of(f.key)) for f in faults]
        return InputError(sorted(located_faults, key=lambda f: f.line))

    def _line_of(self, key: Key) -> int:
        """Line of the longest prefix of a key path that the file has; 1 if it has none."""
        return next((self.lines[key[:end]] for end in range(len(key), 0, -1) if key[:end] in self.lines), 1)


def read_page(path: str | PathLike[str], kind: str) -> Page:
    """Read a TOML file of a kind such as ``problem``.

    Raises:
        InputError: if the file cannot be read or is not TOML.
    """
    as_path(path, f"a {kind} file")
    file = str(path) or "."
    text = read_text(file, f"TOML {kind} file")
    scan = _scan_lines(text)
    if scan.fault:
        raise InputError([scan.fault.at(file, scan.fault.line)])
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        match = re.search(r"line (\d+)", str(error))
        line = scan.unclosed_line or (int(match[1]) if match else text.count("\n") + 1)
        line_text = "".join(text.split("\n")[line - 1 : line])  # empty at the end of the file
        raise InputError([Fault(f"not TOML: {error}{suggest_line(line_text)}").at(file, line)]) from None
    return Page(file, data, scan.lines)


def validate_tables(
    data: Tables, schema: type[S], explain: Callable[[tuple[int | str, ...], str, Any], Fault]
) -> tuple[list[Fault], S | None]:
    """The faults in the types and keys of the data, and the data without the faulty keys.

    The data are None if they do not fit the schema without these keys either.

    Args:
        explain: turns the location, kind and value of a pydantic error into a fault in the words of the file.
    """
    faults: dict[Key, Fault] = {}
    remaining_data: dict[str, Any] = dict(data)
    for _ in range(2):
        try:
            return list(faults.values()), schema.model_validate(remaining_data)
        except ValidationError as error:
            errors = error.errors(include_url=False, include_context=False)
            new_faults = [explain(d["loc"], d["type"], d["input"]) for d in errors[:_MAX_EXPLAINED]]
            remaining_keys = dict.fromkeys(tuple(map(str, d["loc"][:2])) for d in errors[_MAX_EXPLAINED:])
            new_faults += [Fault("accepted: see the other faults", key) for key in remaining_keys]
            max_depths: dict[Key, int] = {}
            for fault in new_faults:
                max_depths[fault.key[:2]] = max(len(fault.key), max_depths.get(fault.key[:2], 0))
            for fault in new_faults:
                if len(fault.key) == max_depths[fault.key[:2]]:
                    faults.setdefault(fault.key, fault)
        remaining_data = _drop_keys(remaining_data, {key[:2] for key in faults})
    return list(faults.values()), None


def _drop_keys(data: Tables, keys: set[Key]) -> dict[str, Any]:
    tables = {n: t for n, t in data.items() if isinstance(t, dict)}
    inner_tables = {n: {k: v for k, v in t.items() if (n, k) not in keys} for n, t in tables.items()}
    dropped_names = {n for n, *rest in keys if not rest or n not in inner_tables}
    return {n: inner_tables.get(n, value) for n, value in data.items() if n not in dropped_names}


_TOKEN = re.compile(
    r"""\"{3}(?:[^"\\]++|\\.|"(?!""))*+(?:"{3,5})?|'{3}(?:[^']++|'(?!''))*+(?:'{3,5})?"""
    r"""|\"(?:[^"\\\n]++|\\[^\n])*+"?|'[^'\n]*+'?|\#[^\n]*+|[\w+:-]++|[^ \t\r]""",
    re.DOTALL,
)
"""Matches a token. Possessive quantifiers give linear time for any text. An unclosed string ends with the file."""

_PUNCTUATION = frozenset("[]{}=.,")

_STATEMENT = re.compile(r"[ \t]*+(?:[\w.\-\"' \t]++=|\[[A-Za-z_][\w.]*+\][ \t]*+(?:\#[^\n]*+)?$)", re.MULTILINE)
"""Matches the beginning of a line with a key or a section."""


@dataclass
class _Scan:
    """The result of a scan before a file is parsed: the lines of keys, and a fault that prevents parsing.

    Attributes:
        lines: section or key → number of its line, except inside lists and multi-line strings.
        unclosed_line: line of a list that is still open where another key or section begins; 0 for none.
    """

    lines: dict[Key, int] = field(default_factory=dict)
    unclosed_line: int = 0
    fault: Fault | None = None


def _scan_lines(text: str) -> _Scan:
    """Find the lines of sections and keys. The scan stops at text that the parser could not parse in time or memory."""
    scan = _Scan()
    section: Key = ()
    line, statement_line, depth, key_parts = 1, 1, 0, 0
    head: list[str] | None = []  # parts of the current section or key; None inside a value
    head_end = "="  # the token after the head: "=" for a key, "]" for a section
    previous_token = ""
    for match in _TOKEN.finditer(text):
        token = match[0]
        if token == "\n":
            if depth == 0:
                head, head_end, statement_line = [], "=", line + 1
            elif not scan.unclosed_line and _STATEMENT.match(text, match.end()):
                scan.unclosed_line = statement_line
        elif token in _PUNCTUATION:
            if head is None:
                depth = max(0, depth + (token in "[{") - (token in "]}"))
            elif token == "[" and not head:
                head_end = "]"
            elif token == head_end:
                key = tuple(head)
                section, key = (key, key) if head_end == "]" else (section, (*section, *key))
                scan.lines.setdefault(key, line)
                head = None
        elif token[0] != "#":
            key_parts = key_parts + 1 if previous_token == "." else 1
            if head is not None:
                head.append(token.strip("\"'"))
        if message := _size_problem(token, key_parts, depth):
            scan.fault = Fault(message, line=line)
            break
        line += token.count("\n")
        previous_token = token
    scan.unclosed_line = scan.unclosed_line or (statement_line if depth else 0)
    return scan


def _size_problem(token: str, parts: int, depth: int) -> str:
    """The message for a key, depth or word above its limit; empty if all are within the limits."""
    if parts > MAX_KEY_PARTS:
        return f"found a key of more than {MAX_KEY_PARTS} parts; accepted: up to {MAX_KEY_PARTS}"
    if depth > MAX_DEPTH:
        return f"found lists or tables more than {MAX_DEPTH} deep; accepted: up to {MAX_DEPTH}"
    if len(token) > _MAX_WORD_LENGTH and token[0] not in "\"'#":
        accepted = f"numbers, and names without quotes, of up to {_MAX_WORD_LENGTH}"
        return f"found {len(token)} characters, {short(token)}; accepted: {accepted}"
    return ""
