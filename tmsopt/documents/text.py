"""A document as text, laid out for a width: the one place that breaks lines, leaves out columns, and colours."""

import math
import re
import textwrap
import unicodedata
from collections.abc import Iterable, Iterator, Sequence

from tmsopt.documents.blocks import Block, Document, Figure, Listing, Sentence, TableBlock, Tone, Verbatim

WIDTH = 100
"""Columns where nobody looks: of pipes and of `str`."""

_NARROW, _TIED = 24, "\xa0"  # columns in which words are still wrapped; a space where no line is broken
_STYLES: dict[Tone, str] = {"answer": "bold", "good": "green", "doubt": "yellow", "bad": "red", "dim": "dim"}
_ASCII = str.maketrans(
    {
        **{"√": "sqrt", "±": "+-", "·": " ", "…": "...", "−": "-", "–": "-", "×": "x", "→": "->", "≤": "<=", "≥": ">="},
        **{"²": "^2", "³": "^3", "⁴": "^4", "½": "1/2", "°": " deg", "’": "'", "µ": "u"},
    }
)

Line = tuple[str, Tone]


def to_text(document: Document, width: int = WIDTH, colour: bool = False, ascii_only: bool = False) -> str:
    """Lines of at most `width` columns.

    Args:
        colour: with escape codes that a terminal shows as colours.
        ascii_only: without letters that an encoding may not have.
    """
    lines = [(line, tone) for line, tone in _lay_out(document, width, ascii_only)]
    text = "\n".join(_colour(line.rstrip(), tone) if colour else line.rstrip() for line, tone in lines)
    return re.sub(r"\n{3,}", "\n\n", text).strip("\n")


def to_headline(document: Document, width: int = WIDTH) -> str:
    """The kind of result and its words in one line, then its title as far as there is room."""
    said = ", ".join(" ".join(word.text.split()) for word in document.words if word.text != "stable")
    room = width - len(document.kind) - 2
    text = said + (f"; {document.title}" if document.title else "")
    return f"{document.kind}({text if len(text) <= room else text[: room - 1].rstrip() + '…'})"


def _lay_out(document: Document, width: int, ascii_only: bool) -> Iterator[Line]:
    full = document.level != "brief"
    if document.title:
        yield from ((line, "") for line in wrap(_spell(document.title, ascii_only), width))
    for section in document.sections:
        shown = [block for block in section.blocks if not isinstance(block, Figure)]
        if not shown:
            continue
        if full and len(document.sections) > 1:
            yield from (("", ""), (section.title, "answer"), ("-" * len(section.title), ""))
        for block in shown:
            yield from _lay_out_block(block, width, ascii_only, full)
        if not full:
            yield "", ""


def _lay_out_block(block: Block, width: int, ascii_only: bool, full: bool) -> Iterator[Line]:
    match block:
        case Sentence(text, label, tone):
            said = f"{label}: {text}" if label else text
            yield from ((line, tone) for line in wrap(_spell(said, ascii_only), width))
        case Listing(items, title):
            yield from ((line, "") for line in wrap(_spell(title, ascii_only), width) if title)
            yield from ((line, "") for line in _lay_out_list(items, width, ascii_only))
        case TableBlock():
            yield from ((line, block.tone) for line in _lay_out_table(block, width, ascii_only, full))
        case Verbatim(text):
            yield from ((_spell(line, ascii_only)[:width], "") for line in text.splitlines())


def wrap(text: str, width: int, first: str = "", rest: str = "  ") -> list[str]:
    """A text in lines: no word is broken, and a number stays with its unit.

    Args:
        first: before the first line.
        rest: before the others.
    """
    tied = re.sub(
        r"(?<=\d) (?=[^\W\d_]|[√%])|(?<=[<>=]) (?=[-\d])|(?<=\w) (?=[<>=]{1,2} [-\d])|(?<=\bkg) (?=m)|(?<=\bN) (?=m)",
        _TIED,
        text,
    )
    lines = textwrap.wrap(
        tied, width, initial_indent=first, subsequent_indent=rest, break_long_words=False, break_on_hyphens=False
    )
    return [line.replace(_TIED, " ") for line in lines] or [""]


def _lay_out_list(items: Iterable[tuple[str, str]], width: int, ascii_only: bool) -> Iterator[str]:
    items = [(_spell(label, ascii_only), _spell(text, ascii_only)) for label, text in items]
    indent = 4 + max((len(label) for label, _ in items), default=0)
    indent = min(indent, max(width - _NARROW, 2))
    for label, text in items:
        yield from wrap(text, width, f"  {label}".ljust(indent), " " * indent)


def _lay_out_table(grid: TableBlock, width: int, ascii_only: bool, full: bool) -> Iterator[str]:
    rows = [[_spell(cell, ascii_only) for cell in row] for row in grid.texts]
    rows, left = (rows, 0) if full or grid.most is None else _thin(rows, grid.most, grid.keep)
    used = [k for k in range(len(rows[0])) if any(row[k] for row in rows)]  # without empty columns
    rows = [[row[k] for k in used] for row in rows]
    head, *body = rows
    if not any(head):
        yield from _align(_fold(body, grid.fold, width), width)
    elif full:
        parts = list(_split_columns(rows, width))
        for number, part in enumerate(parts):
            yield from _align(part, width)
            yield from [""] * (number < len(parts) - 1)
    else:
        needs = [grid.needs[k] if grid.needs else 0 for k in used]
        kept = _choose_columns(rows, needs, width)
        yield from _align([[row[k] for k in kept] for row in rows], width)
        gone = [head[k] for k in range(len(head)) if k not in kept and head[k]]
        said = [f"{left} more row{'s' * (left > 1)}"] if left else []
        said += [f"more columns: {', '.join(gone)}"] if gone else []
        yield from wrap(_spell(f"… {'; '.join(said)} ({grid.rest})", ascii_only), width, "  ", "    ") if said else ()
        return
    yield from [_spell(f"  … {left} more: {grid.rest}", ascii_only)] if left else ()


def _thin(rows: list[list[str]], most: int, keep: Iterable[int]) -> tuple[list[list[str]], int]:
    head, *body = rows
    if len(body) <= most:
        return rows, 0
    kept, chosen = set(keep), list(range(most))
    if kept:  # the others are spread evenly
        room = most - len(kept)
        chosen = sorted({*kept, *(round(k * (len(body) - 1) / max(room - 1, 1)) for k in range(room))})[:most]
    return [head, *(body[k] for k in chosen)], len(body) - len(chosen)


def _choose_columns(rows: list[list[str]], needs: Sequence[int], width: int) -> list[int]:
    """Columns that fit; the last one counts as narrow, for its words are wrapped."""
    kept = list(range(len(rows[0])))
    while len(kept) > 1 and _measure_width([[row[k] for k in kept] for row in rows]) > width:
        kept.remove(min(reversed(kept), key=lambda k: needs[k]))
    return kept


def _measure_width(rows: list[list[str]]) -> int:
    columns = [max(map(len, column)) for column in zip(*rows, strict=True)]
    words = any(" " in row[-1] for row in rows)
    last = (
        min(columns[-1], max(_NARROW, *(len(w) for row in rows for w in row[-1].split()), 0)) if words else columns[-1]
    )
    return sum(columns[:-1]) + 2 * len(columns) + last


def _split_columns(rows: list[list[str]], width: int) -> Iterator[list[list[str]]]:
    """The table as it is where it fits; else in parts below each other, each with the first column."""
    start = 1
    while True:
        end = start + 1
        while end < len(rows[0]) and _measure_width([[row[0], *row[start : end + 1]] for row in rows]) <= width:
            end += 1
        yield [[row[0], *row[start:end]] for row in rows] if len(rows[0]) > 1 else rows
        if end >= len(rows[0]):
            return
        start = end


def _fold(rows: list[list[str]], fold: int, width: int) -> list[list[str]]:
    """Rows side by side, down the first column first, where they are many and there is room."""
    if not fold or len(rows) <= fold:
        return rows
    room = (width - 2) // (sum(max(map(len, column)) + 2 for column in zip(*rows, strict=True)) + 2) or 1
    height = math.ceil(len(rows) / min(room, math.ceil(len(rows) / fold)))
    blank = [""] * len(rows[0])
    blocks = [rows[k : k + height] for k in range(0, len(rows), height)]
    return [[cell for b in blocks for cell in (b[k] if k < len(b) else blank)] for k in range(height)]


def _align(rows: list[list[str]], width: int) -> Iterator[str]:
    """Columns as wide as their widest cells; the last one is wrapped."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    indent = 2 + sum(w + 2 for w in widths[:-1])
    for row in rows:
        before = "  " + "".join(f"{cell:{w}}  " for cell, w in zip(row[:-1], widths, strict=False))
        if len(before) + len(row[-1]) <= width or " " not in row[-1]:
            yield before + row[-1]
        else:
            yield from wrap(row[-1], width, before, " " * indent)


def _spell(text: str, ascii_only: bool) -> str:
    """Without controls, which may come from anybody's file, and where asked for without letters beyond ASCII."""
    text = "".join(c if c.isprintable() or c == "\n" else "\ufffd" for c in text)
    return "".join(map(_name_letter, text.translate(_ASCII))) if ascii_only else text


def _name_letter(letter: str) -> str:
    """A letter beyond ASCII by its name where it is Greek, else without its accents, or as a question mark."""
    if letter.isascii():
        return letter
    if (name := unicodedata.name(letter, "")).startswith("GREEK SMALL LETTER "):
        return name.removeprefix("GREEK SMALL LETTER ").lower()
    return unicodedata.normalize("NFKD", letter).encode("ascii", "ignore").decode() or "?"


def _colour(line: str, tone: Tone) -> str:
    if not tone or not line:
        return line
    from rich.color import ColorSystem  # and nothing of it where nothing is coloured
    from rich.style import Style

    return Style.parse(_STYLES[tone]).render(line, color_system=ColorSystem.STANDARD)
