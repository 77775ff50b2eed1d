"""Pieces of a page: whatever was given is text in them, never markup."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$|none$")
_UNSHOWN = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
_LONG = 24  # characters of a cell in a column that stays wide
_FILTERED = 12  # rows from which a table has a field that filters them
_ON_PAPER = 100  # rows of a table at most, in document.css too

Rows = Sequence[Sequence[str]]
"""Headings, then rows of cells."""


@dataclass(frozen=True)
class Chapter:
    """A part of a page.

    Attributes:
        name: by which the page links to it.
        heading: in words.
        body: markup; without any, the section is left out.
        width: how much of the page it takes: a column, ``wide``, or the ``whole``.
    """

    name: str
    heading: str
    body: str
    width: str = ""

    @property
    def markup(self) -> str:
        """The whole element."""
        kind, head = f' class="{self.width}"' if self.width else "", f"{self.name}-heading"
        return (
            f'<section id="{self.name}"{kind} aria-labelledby="{head}">\n<h2 id="{head}">{words(self.heading)}</h2>\n'
            f"{self.body}\n</section>"
        )


def words(text: str) -> str:
    """A text inside an element or an attribute; controls, of what is shown too, become marks."""
    return escape(_UNSHOWN.sub("\ufffd", text))


def paragraphs(lines: Iterable[str]) -> str:
    """Sentences; a line that is indented goes on with the one before it."""
    joined = "\n".join(lines).replace("\n  ", " ")
    return "\n".join(f"<p>{words(line)}</p>" for line in joined.splitlines() if line.strip())


def facts(pairs: Iterable[tuple[str, str]]) -> str:
    """Names with what there is to say of each."""
    listed = "\n".join(f"<div><dt>{words(name)}</dt><dd>{words(said)}</dd></div>" for name, said in pairs if said)
    return f"<dl>\n{listed}\n</dl>" if listed else ""


def verbatim(text: str, label: str) -> str:
    """A text as it is; it may be wider than the page, and is then reached by the keyboard too."""
    return f'<pre tabindex="0" role="group" aria-label="{words(label)}">\n{words(text)}</pre>'


def table(caption: str, rows: Rows, blank: str = "remark") -> str:
    """A table that can be sorted, a long one filtered too, without columns in which nothing stands; empty without rows.

    Args:
        blank: for a heading that is empty.
    """
    columns = [column for column in zip(*rows, strict=True) if any(column[1:])]
    if not columns:
        return ""
    kinds = [_kind(column[1:]) for column in columns]
    headed = zip(columns, kinds, strict=True)
    heads = "".join(f'<th scope="col"{kind}>{words(column[0] or blank)}</th>' for column, kind in headed)
    body = [*zip(*(column[1:] for column in columns), strict=True)]
    lines = "\n".join(f"<tr>{_cells(row, kinds)}</tr>" for row in body)
    kind = "sortable filterable" if len(body) >= _FILTERED else "sortable"
    said = f"On paper are the first {_ON_PAPER} of the rows that are shown."
    paper = f'\n<p class="print">{said}</p>' if len(body) > _ON_PAPER else ""
    return (
        f'<div class="rows" role="group" tabindex="0" aria-label="{words(caption)}"><table class="{kind}">\n'
        f"<caption>{words(caption)}</caption>\n<thead><tr>{heads}</tr></thead>\n<tbody>\n{lines}\n</tbody>\n"
        f"</table></div>{paper}"
    )


def _cells(row: Sequence[str], kinds: Sequence[str]) -> str:
    first, *rest = (f"{kind}>{words(cell)}" for cell, kind in zip(row, kinds, strict=True))
    return f'<th scope="row"{first}</th>' + "".join(f"<td{cell}</td>" for cell in rest)


def _kind(cells: Sequence[str]) -> str:
    """Of a column, which is of numbers, of long words, or of short ones."""
    if all(_NUMBER.match(cell) for cell in cells if cell):
        return ' class="number"'
    return ' class="long"' if max(map(len, cells)) > _LONG else ""
