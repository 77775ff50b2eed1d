"""Answers compared with those of the net, number by number, each within what its condition lets it keep.

The net holds several runs of the same program: on other processors' arithmetic and from other seeds. Where they differ
in words, the words were never settled; where they differ in a number, that is its condition.
"""

import json
import lzma
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

NET = Path(__file__).with_name("net.json.xz")

SIZE = 1e-9
"""Of a number, up to which it is the same."""

SPREAD = 10.0
"""Times the greatest difference between runs of the net: there are only a few of them."""

_UNCOMPARED = ("seconds", "per_second", "host", "versions", "left")  # keys: how long something took, and where
_STORED = ("realised", "stored", "roots", "scatter")  # parts of keys: what the doubles of a multiple root do
_NUMBER = re.compile(r"[-+−]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
_SECONDS = re.compile(r"\b[\d.]+ (?:ms|s)\b")

Leaf = str | bool | float | None


@dataclass(frozen=True)
class Difference:
    """Something that is not the same.

    Attributes:
        case: its name.
        path: of the value in the answer.
        before, now: the values.
    """

    case: str
    path: str
    before: Any
    now: Any

    def __str__(self) -> str:
        return f"{self.case} {self.path}: {_short(self.before)} → {_short(self.now)}"


def _short(value: Any, most: int = 160) -> str:
    text = repr(value)
    return text if len(text) <= most else f"{text[:most]}…"


def read_net() -> list[dict[str, Any]]:
    """The runs of the net: case → answer."""
    runs: list[dict[str, Any]] = json.loads(lzma.decompress(NET.read_bytes()))
    return runs


def write_net(runs: Sequence[Mapping[str, Any]]) -> None:
    """Keep runs as the net."""
    NET.write_bytes(lzma.compress(json.dumps(runs, ensure_ascii=False).encode(), preset=9 | lzma.PRESET_EXTREME))


def compare(case: str, known: Sequence[Any], now: Any) -> list[Difference]:
    """Where an answer differs from those that are known."""
    runs = [dict(_leaves(answer)) for answer in known]
    found = dict(_leaves(now))
    power = 1.0 / max([1.0, *(v for p, v in runs[0].items() if p.endswith("multiplicity") and isinstance(v, float))])
    differences = []
    for path in dict.fromkeys((*runs[0], *found)):
        if not all((path in run) == (path in runs[0]) for run in runs):
            continue  # the runs of the net have it or not: it was never settled
        values = [run.get(path, "absent") for run in runs]
        value = found.get(path, "absent")
        if not _same(values, value, SIZE**power if any(part in path for part in _STORED) else SIZE):
            differences.append(Difference(case, path, values[0], value))
    return differences


def _same(values: Sequence[Leaf], now: Leaf, size: float) -> bool:
    first = values[0]
    if all(isinstance(value, float) and math.isfinite(value) for value in (*values, now)):
        numbers = [float(value) for value in values]  # type: ignore[arg-type]
        spread = max(numbers) - min(numbers)
        assert isinstance(now, float)
        return min(abs(now - x) for x in numbers) <= max(size * max(1e-3, *map(abs, numbers)), SPREAD * spread)
    if any(value != first and not (value is None and first is None) for value in values[1:]):
        return _as_text(first) == _as_text(now) or any(value != first for value in values[1:])
    return now == first or _as_text(first) == _as_text(now)


def _as_text(value: Leaf) -> str:
    return str(value)


def _leaves(value: Any, path: str = "") -> Iterator[tuple[str, Leaf]]:
    """Path → value of everything in plain data; texts as their words and their numbers."""
    match value:
        case dict():
            yield f"{path}{{}}", " ".join(sorted(value))
            for name, inner in value.items():
                if name not in _UNCOMPARED:
                    yield from _leaves(inner, f"{path}.{name}")
        case list():
            yield f"{path}[]", float(len(value))
            for index, inner in enumerate(value):
                yield from _leaves(inner, f"{path}[{index}]")
        case str() if "\n" in value or " " in value:
            for number, line in enumerate(_SECONDS.sub("", value).splitlines()):
                yield f"{path}:{number}", " ".join(_NUMBER.sub("#", line).split())
                for index, text in enumerate(_NUMBER.findall(line)):
                    yield f"{path}:{number}#{index}", float(text.replace("−", "-"))
        case bool() | str() | None:
            yield path, value
        case _:
            yield path, float(value)
