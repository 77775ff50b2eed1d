"""A result as a document: sections of a few kinds of blocks. Renderers know these kinds, and no result."""

from collections.abc import Callable, Iterator, Sequence, Sized
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from tmsopt.problem.unit_system import Unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawing

Level = Literal["brief", "full", "page"]
"""How much a document holds: the answer on a screen, everything as text, everything with pictures and long tables."""

Tone = Literal["", "answer", "good", "doubt", "bad", "dim"]
"""What a sentence, a table or a word tells: the answer itself, a verdict, or what is fixed anyway."""

NO_UNIT = Unit()
ALL = 12
"""Digits of a number that is shown in full."""


@dataclass(frozen=True)
class Cell:
    """A number of a table.

    Attributes:
        value: in SI and rad, or in the model's own units.
        unit: in which it is shown.
        digits: at most.
        error: of the value; digits that it makes uncertain are left out.
        named: whether the unit stands behind the number; else in a heading or in a column of its own.
    """

    value: float
    unit: Unit = NO_UNIT
    digits: int = ALL
    error: float = 0.0
    named: bool = False

    def __str__(self) -> str:
        number = self.unit.number(self.value, self.digits, self.error)
        return f"{number} {self.unit.text}" if self.named and self.unit.text and number != "none" else number


Row = Sequence[Cell | str]


@dataclass(frozen=True)
class Sentence:
    """A sentence, under a label where it is one of several facts."""

    text: str
    label: str = ""
    tone: Tone = ""


@dataclass(frozen=True)
class Listing:
    """Labels with what belongs to each, such as the data of an entry."""

    items: tuple[tuple[str, str], ...]
    title: str = ""


@dataclass(frozen=True)
class TableBlock:
    """A table.

    Attributes:
        rows: headings, then the cells of each row; without headings where the first row is empty.
        caption: for a page.
        needs: how much each column is needed; on a narrow screen the least needed one is left out first, and of equals
            the last one. By default each column is needed as much as any.
        most: rows that a brief document shows; the others are counted.
        keep: numbers of rows that stay; the others that are shown are spread evenly, and not just the first.
        rest: where all rows and columns are.
        fold: rows from which a table without headings stands in several columns, where there is room.
    """

    rows: Sequence[Row]
    caption: str = ""
    needs: Sequence[int] = ()
    most: int | None = None
    keep: frozenset[int] = frozenset()
    rest: str = "--full"
    fold: int = 0
    tone: Tone = ""

    @property
    def texts(self) -> list[list[str]]:
        """The cells as text."""
        return [[str(cell) for cell in row] for row in self.rows]


@dataclass(frozen=True)
class Figure:
    """A picture, drawn where it is shown.

    Attributes:
        draw: of a result, which it gets without its titles: they stand above its pictures already.
    """

    draw: "Callable[[Any], Axes | Drawing]"
    result: Any
    caption: str


@dataclass(frozen=True)
class Verbatim:
    """Lines to be shown as they are, such as a sketch."""

    text: str
    label: str


Block = Sentence | Listing | TableBlock | Figure | Verbatim


@dataclass(frozen=True)
class Chapter:
    """Blocks under a name.

    Attributes:
        name: by which a page links to it.
        heading: in words; by default the name.
        width: how much of a page it takes: a column, ``wide`` or ``whole``.
        blocks: those that follow it, until the next chapter.
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
    """A word or two of a headline, such as a verdict."""

    text: str
    tone: Tone = ""


@dataclass(frozen=True)
class Document:
    """A result in words, tables and pictures.

    Attributes:
        kind: the class of the result.
        title: of its problem; empty without one.
        words: what it is and how it ended.
    """

    kind: str
    title: str
    words: tuple[Badge, ...]
    level: Level
    sections: tuple[Chapter, ...] = ()


Parts = Iterator[tuple[Badge | str, ...] | Chapter | Block | str]
"""A document in the order in which it is read: its words, then chapters, each before its blocks; a text is a sentence.

Empty words and sentences are left out, and the words of a result that is a part of another one.
"""


def count_things(things: Sized | int, one: str, many: str = "") -> str:
    """A number of things in words, such as ``2 branches``."""
    count = things if isinstance(things, int) else len(things)
    return f"{count} {one if count == 1 else many or one + 's'}"


def judge(holds: bool | None, text: str) -> Badge:
    """A verdict: a text, or that it is not so; empty where it is not known."""
    if holds is None:
        return Badge("")
    return Badge(text, "good") if holds else Badge(f"not {text}", "bad")


def say_whether(value: bool | None) -> str:
    """For a table; empty where it is not known."""
    return "" if value is None else "yes" if value else "no"
