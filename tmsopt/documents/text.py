"""A document as text. Only this module breaks lines, leaves out columns and colours lines."""

import math
import re
import textwrap
import unicodedata
from collections.abc import Collection, Iterable, Iterator, Sequence

from tmsopt.documents.blocks import Block, Document, Figure, Listing, Sentence, TableBlock, Tone, Verbatim

WIDTH = 100
"""Characters in a line if there is no terminal, as in a pipe or in `str`."""

_MIN_WRAP_WIDTH = 24
"""Minimum width of a column whose words are wrapped."""
_FIXED_SPACE = "\xa0"
"""A space at which no line is broken."""
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
    """Write lines of at most `width` characters.

    Args:
        colour: whether to add escape codes that a terminal shows as colours.
        ascii_only: whether to replace letters that are not in ASCII, because some encodings do not have them.
    """
    lines = ((line.rstrip(), tone) for line, tone in _lay_out(document, width, ascii_only))
    text = "\n".join(_colour(line, tone) if colour else line for line, tone in lines)
    return re.sub(r"\n{3,}", "\n\n", text).strip("\n")


def to_headline(document: Document, width: int = WIDTH) -> str:
    """Write the kind of result, its badges, and its title as far as it fits, in one line."""
    words = ", ".join(" ".join(badge.text.split()) for badge in document.badges if badge.text != "stable")
    room = width - len(document.kind) - 2
    text = words + (f"; {document.title}" if document.title else "")
    return f"{document.kind}({text if len(text) <= room else text[: room - 1].rstrip() + '…'})"


def _lay_out(document: Document, width: int, ascii_only: bool) -> Iterator[Line]:
    full = document.level != "brief"
    if document.title:
        yield from ((line, "") for line in wrap(_spell(document.title, ascii_only), width))
    for chapter in document.chapters:
        blocks = [block for block in chapter.blocks if not isinstance(block, Figure)]
        if not blocks:
            continue
        if full and len(document.chapters) > 1:
            yield from (("", ""), (chapter.title, "answer"), ("-" * len(chapter.title), ""))
        for block in blocks:
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


def wrap(text: str, width: int, first_indent: str = "", later_indent: str = "  ") -> list[str]:
    """Break a text into lines, but never inside a word or between a number and its unit.

    Args:
        first_indent: text before the first line.
        later_indent: text before the other lines.
    """
    tied = re.sub(
        r"(?<=\d) (?=[^\W\d_]|[√%])|(?<=[<>=]) (?=[-\d])|(?<=\w) (?=[<>=]{1,2} [-\d])|(?<=\bkg) (?=m)|(?<=\bN) (?=m)",
        _FIXED_SPACE,
        text,
    )
    lines = textwrap.wrap(
        tied,
        width,
        initial_indent=first_indent,
        subsequent_indent=later_indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [line.replace(_FIXED_SPACE, " ") for line in lines] or [""]


def _lay_out_list(items: Iterable[tuple[str, str]], width: int, ascii_only: bool) -> Iterator[str]:
    items = [(_spell(label, ascii_only), _spell(text, ascii_only)) for label, text in items]
    indent = 4 + max((len(label) for label, _ in items), default=0)
    indent = min(indent, max(width - _MIN_WRAP_WIDTH, 2))
    for label, text in items:
        yield from wrap(text, width, f"  {label}".ljust(indent), " " * indent)


def _lay_out_table(table: TableBlock, width: int, ascii_only: bool, full: bool) -> Iterator[str]:
    head, *body = table.texts
    max_rows = len(body) if full or table.max_rows is None else table.max_rows
    row_numbers = _choose_rows(len(body), max_rows, table.kept_rows)
    cells = zip(head, *(body[k] for k in row_numbers), strict=True)
    columns = [[_spell(cell, ascii_only) for cell in column] for column in cells]
    filled_columns = [k for k, column in enumerate(columns) if any(column)]  # empty columns are left out
    if not any(head):
        yield from _align(_fold([columns[k][1:] for k in filled_columns], table.fold, width), width)
    elif full:
        for number, part in enumerate(_split_columns([columns[k] for k in filled_columns], width)):
            yield from [""] * (number > 0)
            yield from _align(part, width)
    else:
        visible_columns = list(filled_columns)
        while len(visible_columns) > 1 and _measure_width([columns[k] for k in visible_columns]) > width:
            column_number = min(reversed(visible_columns), key=lambda k: table.priorities[k] if table.priorities else 0)
            visible_columns.remove(column_number)
        yield from _align([columns[k] for k in visible_columns], width)
        hidden_rows = len(body) - len(row_numbers)
        hidden_columns = [columns[k][0] for k in filled_columns if k not in visible_columns and head[k]]
        notes = [f"{hidden_rows} more row{'s' * (hidden_rows > 1)}"] if hidden_rows else []
        notes += [f"more columns: {', '.join(hidden_columns)}"] if hidden_columns else []
        if notes:
            yield from wrap(_spell(f"… {'; '.join(notes)} ({table.hint})", ascii_only), width, "  ", "    ")


def _choose_rows(count: int, max_rows: int, kept_rows: Collection[int]) -> Sequence[int]:
    """Choose the first rows; if some rows must be kept, choose the other rows spread evenly. Return their indices."""
    if count <= max_rows or not kept_rows:
        return range(min(count, max_rows))
    room = max_rows - len(kept_rows)
    return sorted({*kept_rows, *(round(k * (count - 1) / max(room - 1, 1)) for k in range(room))})[:max_rows]


def _measure_width(columns: Columns) -> int:
    """Measure the width of columns; the last column is narrow if its words can be wrapped."""
    *first, last = (max(map(len, column)) for column in columns)
    if any(" " in cell for cell in columns[-1]):
        last = min(last, max(_MIN_WRAP_WIDTH, *(len(word) for cell in columns[-1] for word in cell.split())))
    return sum(first) + 2 * len(columns) + last


def _split_columns(columns: Columns, width: int) -> Iterator[Columns]:
    """Split a table that is too wide into parts, each with the first column."""
    first, *other_columns = columns
    part = [first]
    for column in other_columns:
        if len(part) > 1 and _measure_width([*part, column]) > width:
            yield part
            part = [first]
        part.append(column)
    yield part


def _fold(columns: Columns, fold: int, width: int) -> Columns:
    """Arrange more than `fold` rows in several columns side by side, if there is room."""
    count = len(columns[0])
    if not fold or count <= fold:
        return columns
    room = (width - 2) // (sum(max(map(len, column)) + 2 for column in columns) + 2) or 1
    height = math.ceil(count / min(room, math.ceil(count / fold)))
    padded = [column + [""] * height for column in columns]
    return [column[k : k + height] for k in range(0, count, height) for column in padded]


def _align(columns: Columns, width: int) -> Iterator[str]:
    """Write columns as wide as their widest cells; the last column is wrapped."""
    widths = [max(map(len, column)) for column in columns[:-1]]
    for *first, last in zip(*columns, strict=True):
        line_start = "  " + "".join(f"{cell:{w}}  " for cell, w in zip(first, widths, strict=True))
        if len(line_start) + len(last) <= width or " " not in last:
            yield line_start + last
        else:
            yield from wrap(last, width, line_start, " " * len(line_start))


def _spell(text: str, ascii_only: bool) -> str:
    """Replace control characters, which a file may contain; if `ascii_only`, also all letters that are not in ASCII."""
    text = "".join(c if c.isprintable() or c == "\n" else "\ufffd" for c in text)
    return "".join(map(_name_letter, text.translate(_ASCII))) if ascii_only else text


def _name_letter(letter: str) -> str:
    """Spell a letter in ASCII: a Greek letter by its name, another letter without accents, or as a question mark."""
    if letter.isascii():
        return letter
    if (name := unicodedata.name(letter, "")).startswith("GREEK SMALL LETTER "):
        return name.removeprefix("GREEK SMALL LETTER ").lower()
    return unicodedata.normalize("NFKD", letter).encode("ascii", "ignore").decode() or "?"


def _colour(line: str, tone: Tone) -> str:
    if not tone or not line:
        return line
    from rich.color import ColorSystem  # imported only if a line is coloured
    from rich.style import Style

    return Style.parse(_STYLES[tone]).render(line, color_system=ColorSystem.STANDARD)
