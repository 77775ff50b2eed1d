"""The parts of a report on one screen: what is left out where there is not room for all, and what never is."""

import re
import textwrap
from dataclasses import dataclass, replace
from itertools import takewhile

from tmsopt.report.text import HEIGHT, WIDTH

KEPT = "\xa0"  # a space where no line is broken


_GIVING_WAY = (("warnings", 0), ("limits", 0), ("design", 0), ("limits", 1), ("answer", 0), ("conflict", 0))
"""Parts that get shorter where there is not room for all, one after the other, to how few lines; 0: their `least`."""


@dataclass(frozen=True)
class Block:
    """A part of the report.

    Attributes:
        name: under which the full report has it.
        lines: on one screen.
        rest: what the full report has below its lines, or in place of them where it `replaces` them.
        least: lines that stay where there is not room for all.
    """

    name: str
    lines: list[str]
    rest: tuple[str, ...] = ()
    replaces: bool = False
    least: int = 1


def named(part: Block) -> list[str]:
    """A part of the full report, under its name."""
    lines = [] if part.replaces else wrapped(part.lines)
    for line in part.rest:
        lines += [line] if line.startswith("  ") else wrapped([line])
    return ["", part.name, "-" * len(part.name), *(line.rstrip() for line in lines)]


def wrapped(lines: list[str]) -> list[str]:
    """Lines of `WIDTH` at most; rows of a table are cut."""
    found = []
    for line in lines:
        if line.startswith("  "):
            found.append(line if len(line) <= WIDTH else f"{line[: WIDTH - 1]}…")
        else:
            whole = re.sub(r"(?<=\d) (?=[^\W\d_]|[√%])", KEPT, line)  # a number stays with its unit
            wrapped = textwrap.wrap(whole, WIDTH, subsequent_indent="  ", break_on_hyphens=False)
            found += [part.replace(KEPT, " ") for part in wrapped] or [""]
    return found


def fitted(parts: list[Block]) -> list[Block]:
    """Parts that fit the screen: the last lines of those that may be shorter are left out, and counted."""
    cut = {part.name: len(part.lines) for part in parts}

    def shown(part: Block) -> Block:
        kept = cut[part.name]
        if kept == len(part.lines):
            return part
        return Block(part.name, [*part.lines[:kept], f"  … {_counted(len(part.lines) - kept, part.name)}: --full"])

    def height() -> int:
        return 2 + sum(len(wrapped(shown(part).lines)) for part in parts)

    for name, fewest in _GIVING_WAY:
        at = next((k for k, p in enumerate(parts) if p.name == name), None)
        if at is None:
            continue
        if name == "design" and height() > HEIGHT:  # what is to be built is shown, two numbers a line
            parts[at] = replace(parts[at], lines=_paired(parts[at].lines))
            cut[name] = len(parts[at].lines)
            continue
        while height() > HEIGHT and cut[name] > (fewest or parts[at].least):
            cut[name] -= 1
    while height() > HEIGHT and "design" in cut and cut["design"] > 1:
        cut["design"] -= 1
    return [shown(part) for part in parts]


def _paired(lines: list[str]) -> list[str]:
    """Rows side by side where two fit, down the left column first; what follows them stays below."""
    rows = [line.rstrip() for line in takewhile(lambda line: line.startswith("  "), lines)]
    half, wide = (len(rows) + 1) // 2, max(map(len, rows), default=0)
    if 2 * wide + 2 > WIDTH:
        return lines
    right = [*rows[half:], *[""] * (2 * half - len(rows))]
    return [f"{a:{wide + 2}}{b}".rstrip() for a, b in zip(rows[:half], right, strict=True)] + lines[len(rows) :]


def _counted(count: int, name: str) -> str:
    if name in ("limits", "warnings"):
        return f"{count} more {name if count > 1 else name[:-1]}"
    return f"{count} more line{'s' if count > 1 else ''} of the {name}"
