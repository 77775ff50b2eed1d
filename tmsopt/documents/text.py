"""A document as text, laid out for a width: the one place that breaks lines, leaves out columns, and colours."""

import math
import re
import textwrap
import unicodedata
from collections.abc import Collection, Iterable, Iterator, Sequence

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
Columns = list[list[str]]


def to_text(document: Document, width: int = WIDTH, colour: bool = False, ascii_only: bool = False) -> str:
    """Lines of at most `width` columns.

    Args:
        colour: with escape codes that a terminal shows as colours.
        ascii_only: without letters that an encoding may not have.
    """
    lines = ((line.rstrip(), tone) for line, tone in _lay_out(document, width, ascii_only))
    text = "\n".join(_colour(line, tone) if colour else line for line, tone in lines)
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
            tone = block.tone if isinstance(block, Sentence | TableBlock) else ""
            yield from ((line, tone) for line in _lay_out_block(block, width, ascii_only, full))
        if not full:
            yield "", ""


def _lay_out_block(block: Block, width: int, ascii_only: bool, full: bool) -> Iterator[str]:
    match block:
        case Sentence(text, label):
            yield from wrap(_spell(f"{label}: {text}" if label else text, ascii_only), width)
        case Listing(items, title):
            if title:
                yield from wrap(_spell(title, ascii_only), width)
            yield from _lay_out_list(items, width, ascii_only)
        case TableBlock():
            yield from _lay_out_table(block, width, ascii_only, full)
        case Verbatim(text):
            yield from (_spell(line, ascii_only)[:width] for line in text.splitlines())


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
    head, *body = grid.texts
    shown = range(len(body)) if full or grid.most is None else _choose_rows(len(body), grid.most, grid.keep)
    cells = zip(head, *(body[k] for k in shown), strict=True)
    columns = [[_spell(cell, ascii_only) for cell in column] for column in cells]
    used = [k for k, column in enumerate(columns) if any(column)]  # without empty columns
    if not any(head):
        yield from _align(_fold([columns[k][1:] for k in used], grid.fold, width), width)
    elif full:
        for number, part in enumerate(_split_columns([columns[k] for k in used], width)):
            yield from [""] * (number > 0)
            yield from _align(part, width)
    else:
        kept = list(used)
        while len(kept) > 1 and _measure_width([columns[k] for k in kept]) > width:
            kept.remove(min(reversed(kept), key=lambda k: grid.needs[k] if grid.needs else 0))
        yield from _align([columns[k] for k in kept], width)
        left, gone = len(body) - len(shown), [columns[k][0] for k in used if k not in kept and head[k]]
        said = [f"{left} more row{'s' * (left > 1)}"] if left else []
        said += [f"more columns: {', '.join(gone)}"] if gone else []
        if said:
            yield from wrap(_spell(f"… {'; '.join(said)} ({grid.rest})", ascii_only), width, "  ", "    ")


def _choose_rows(count: int, most: int, keep: Collection[int]) -> Sequence[int]:
    """The first rows; where some are to stay, the others are spread evenly."""
    if count <= most or not keep:
        return range(min(count, most))
    room = most - len(keep)
    return sorted({*keep, *(round(k * (count - 1) / max(room - 1, 1)) for k in range(room))})[:most]


def _measure_width(columns: Columns) -> int:
    """The last column counts as narrow where its words can be wrapped."""
    *first, last = (max(map(len, column)) for column in columns)
    if any(" " in cell for cell in columns[-1]):
        last = min(last, max(_NARROW, *(len(word) for cell in columns[-1] for word in cell.split())))
    return sum(first) + 2 * len(columns) + last


def _split_columns(columns: Columns, width: int) -> Iterator[Columns]:
    """The table as it is where it fits; else in parts below each other, each with the first column."""
    first, *others = columns
    part = [first]
    for column in others:
        if len(part) > 1 and _measure_width([*part, column]) > width:
            yield part
            part = [first]
        part.append(column)
    yield part


def _fold(columns: Columns, fold: int, width: int) -> Columns:
    """Rows side by side, down the first column first, where they are many and there is room."""
    count = len(columns[0])
    if not fold or count <= fold:
        return columns
    room = (width - 2) // (sum(max(map(len, column)) + 2 for column in columns) + 2) or 1
    height = math.ceil(count / min(room, math.ceil(count / fold)))
    padded = [column + [""] * height for column in columns]
    return [column[k : k + height] for k in range(0, count, height) for column in padded]


def _align(columns: Columns, width: int) -> Iterator[str]:
    """Columns as wide as their widest cells; the last one is wrapped."""
    widths = [max(map(len, column)) for column in columns[:-1]]
    for *first, last in zip(*columns, strict=True):
        before = "  " + "".join(f"{cell:{w}}  " for cell, w in zip(first, widths, strict=True))
        if len(before) + len(last) <= width or " " not in last:
            yield before + last
        else:
            yield from wrap(last, width, before, " " * len(before))


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
