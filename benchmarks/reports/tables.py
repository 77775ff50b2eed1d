"""Pages of results.md: what was asked for, tables, numbers with their units, and the file that keeps them."""

import math
import os
import platform
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from benchmarks.suites import SEED
from benchmarks.timing import quantile
from tmsopt.files import write_text

RESULTS = Path("benchmarks/results.md")
"""The file that keeps the tables."""

_PACKAGES = ("casadi", "numpy", "scipy")


@dataclass(frozen=True)
class Asked:
    """What a report is asked for.

    Attributes:
        name: of its section.
        quick: small sizes, to see that everything runs.
        count: problems or rows, 0 for as many as the section has.
        seconds: limit for each problem where the section has one, 0 for its own.
        seed: of random problems.
        workers: processes for what is not timed.
    """

    name: str
    quick: bool = False
    count: int = 0
    seconds: float = 0.0
    seed: int = SEED
    workers: int = os.cpu_count() or 1

    @property
    def command(self) -> str:
        """What makes the report again."""
        parts = [f"python -m benchmarks --only {self.name}"]
        parts += ["--quick"] if self.quick else []
        parts += [f"--count {self.count}"] if self.count else []
        parts += [f"--seconds {self.seconds:g}"] if self.seconds else []
        parts += [f"--seed {self.seed}"] if self.seed != SEED else []
        return " ".join(parts)

    def of(self, whole: int, few: int) -> int:
        """How many: those asked for, else all, or few where it is to be quick."""
        return self.count or (few if self.quick else whole)

    def within(self, limit: float, short: float) -> float:
        """Seconds: those asked for, else the section's own, or short ones where it is to be quick."""
        return self.seconds or (short if self.quick else limit)


def page(title: str, asked: Asked, *parts: str) -> str:
    """A section in Markdown: its title, where and with what it was made, and its paragraphs."""
    return "\n\n".join([f"## {title}", origin(asked.command), *filter(None, parts)]) + "\n"


def origin(command: str) -> str:
    """Where and with what something was made."""
    versions = ", ".join([f"Python {platform.python_version()}", *(f"{p} {version(p)}" for p in _PACKAGES)])
    return f"`{command}`, {datetime.now(UTC):%Y-%m-%d}, {versions}, {os.cpu_count()} cores."


def keep(path: Path, name: str, text: str) -> None:
    """Write a section between its markers, in place of an earlier one."""
    first, last = f"<!-- {name} -->", f"<!-- /{name} -->"
    known = path.read_text(encoding="utf-8") if path.exists() else "# Benchmarks\n"
    before, found, rest = known.partition(first)
    after = rest.partition(last)[2] if found else ""
    write_text(path, f"{before.rstrip()}\n\n{first}\n\n{text}\n{last}\n{after.lstrip(chr(10))}")


def table(header: Sequence[object], rows: Iterable[Sequence[object]], empty: str = "") -> str:
    """A table in Markdown; without rows, what is to be said then."""
    lines = [header, ["---"] * len(header), *rows]
    return empty if empty and len(lines) == 2 else "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)


def facts(rows: Iterable[tuple[str, object]]) -> str:
    """A table of words and what they amount to."""
    return table(("", ""), rows)


def share(flags: Iterable[bool]) -> str:
    """How many are true: ``3 of 4 (75.0 %)``."""
    found = list(flags)
    return f"{sum(found)} of {len(found)} ({100 * sum(found) / len(found):.1f} %)" if found else "–"


def duration(seconds: float) -> str:
    """With its unit, to two or three digits."""
    if not math.isfinite(seconds):
        return "–"
    scale, unit = next(((f, u) for f, u in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs")) if seconds >= f), (1e-9, "ns"))
    number = seconds / scale
    return f"{number:.0f} {unit}" if number >= 100 else f"{number:.3g} {unit}"


def median(seconds: Iterable[float], q: float = 0.5) -> str:
    """The median of some times, or another quantile, with its unit."""
    return duration(quantile(seconds, q))


def times(ratio: float) -> str:
    """A ratio, to two digits."""
    return "–" if not math.isfinite(ratio) else f"{ratio:.0f}" if ratio >= 10 else f"{ratio:.2g}"
