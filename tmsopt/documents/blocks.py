"""A document is a result as chapters of blocks. Renderers know the few kinds of blocks, but no kind of result."""

from collections.abc import Callable, Iterator, Sequence, Sized
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from tmsopt.problem.unit_system import Unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawing

Level = Literal["brief", "full", "page"]
"""How much a document holds: ``brief`` a short answer, ``full`` all text, ``page`` also pictures and long tables."""

Tone = Literal["", "answer", "good", "doubt", "bad", "dim"]
"""The role of a sentence, a table or a badge: the answer itself, a verdict, or (dim) something that cannot change."""

NO_UNIT = Unit()
ALL_DIGITS = 12
"""Significant digits of a number that is shown in full."""


@dataclass(frozen=True)
class Cell:
    """A number of a table.

    Attributes:
        value: in SI and rad, or in the model's own units.
        unit: unit in which the number is shown.
        digits: maximum number of significant digits.
        error: error of the value; digits that the error makes uncertain are left out.
        with_unit: whether the unit follows the number; otherwise a heading or another column shows it.
    """

    value: float
    unit: Unit = NO_UNIT
    digits: int = ALL_DIGITS
    error: float = 0.0
    with_unit: bool = False

    def __str__(self) -> str:
        number = self.unit.number(self.value, self.digits, self.error)
        return f"{number} {self.unit.text}" if self.with_unit and self.unit.text and number != "none" else number


Row = Sequence[Cell | str]


@dataclass(frozen=True)
class Sentence:
    """A sentence; with a label if it is one of several facts."""

    text: str
    label: str = ""
    tone: Tone = ""


@dataclass(frozen=True)
class Listing:
    """Labels, each with its text, such as the data of an entry."""

    items: tuple[tuple[str, str], ...]
    title: str = ""


@dataclass(frozen=True)
class TableBlock:
    """A table.

    Attributes:
        rows: headings, then the cells of each row. If all headings are empty, the table has none.
        caption: caption on a page.
        priorities: importance of each column. A narrow screen leaves out the least important column first. If several
            are equally important, it begins with the last of them. By default all columns are equal.
        max_rows: maximum number of rows in a brief document; a line below the table counts the hidden rows.
        kept_rows: indices of rows that are always shown; the other rows shown are then spread evenly.
        hint: the options that print all rows and columns.
        fold: a table without headings that has more rows than this is continued in further columns, if there is room;
            0 if the table is never folded.
    """

    rows: Sequence[Row]
    caption: str = ""
    priorities: Sequence[int] = ()
    max_rows: int | None = None
    kept_rows: frozenset[int] = frozenset()
    hint: str = "--full"
    fold: int = 0
    tone: Tone = ""

    @property
    def texts(self) -> list[list[str]]:
        """The cells as text."""
        return [[str(cell) for cell in row] for row in self.rows]


@dataclass(frozen=True)
class Figure:
    """A picture, which the renderer draws.

    Attributes:
        draw: draws the result. The renderer first removes the titles of the result, which the page shows above.
    """

    draw: "Callable[[Any], Axes | Drawing]"
    result: Any
    caption: str


@dataclass(frozen=True)
class Verbatim:
    """Lines that are shown unchanged, such as a sketch."""

    text: str
    label: str


Block = Sentence | Listing | TableBlock | Figure | Verbatim


@dataclass(frozen=True)
class Chapter:
    """Blocks under a name.

    Attributes:
        name: target of links on a page.
        heading: heading in words; by default the name.
        width: width on a page: empty for a column, ``wide`` or ``whole``.
        blocks: the blocks between this chapter and the next.
    """

    name: str
    heading: str = ""
    width: str = ""
    blocks: tuple[Block, ...] = ()

    @property
    def title(self) -> str:
        """The heading in words."""
        return self.heading or self.name.capitalize()


@dataclass(frozen=True)
class Badge:
    """A few words of a headline, such as a verdict."""

    text: str
    tone: Tone = ""


@dataclass(frozen=True)
class Document:
    """A result in words, tables and pictures.

    Attributes:
        kind: the class of the result.
        title: title of the problem; empty if it has none.
        badges: what the result is and how the computation ended.
    """

    kind: str
    title: str
    badges: tuple[Badge, ...]
    level: Level
    chapters: tuple[Chapter, ...] = ()


Parts = Iterator[tuple[Badge | str, ...] | Chapter | Block | str]
"""A document in reading order: its badges, then chapters, each followed by its blocks. A plain text is a sentence.

`document_of` leaves out empty badges and sentences, and the badges of a result inside another result.
"""


def count_things(things: Sized | int, singular: str, plural: str = "") -> str:
    """Write a number of things, such as ``2 branches``; `plural` is needed only if it is irregular."""
    count = things if isinstance(things, int) else len(things)
    return f"{count} {singular if count == 1 else plural or singular + 's'}"


def write_verdict(holds: bool | None, text: str) -> Badge:
    """Write a verdict: the text, or "not" and the text; empty if the answer is unknown."""
    if holds is None:
        return Badge("")
    return Badge(text, "good") if holds else Badge(f"not {text}", "bad")


def format_bool(value: bool | None) -> str:
    """Write yes or no for a table; empty if the answer is unknown."""
    return "" if value is None else "yes" if value else "no"
