"""A document as HTML: a page in one file, or a fragment for a notebook.

Texts of a problem file are escaped: they never become markup.
"""

import base64
import io
import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import fields, is_dataclass, replace
from html import escape
from importlib.resources import files as resources
from itertools import groupby
from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes

from tmsopt.documents.blocks import Badge, Block, Chapter, Document, Figure, Listing, Sentence, TableBlock, Verbatim

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$|none$")
_CONTROL_CHARACTERS = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
_LONG_CELL = 24
"""A column that has a cell with more characters stays wide."""
_MIN_FILTER_ROWS = 12
"""A table with at least this many rows has a field that filters them."""
_MAX_PAPER_ROWS = 100
"""Maximum number of rows of a table on paper; document.css has the same number."""
_TITLED_FIELDS = ("problem", "asked", "study", "design")
"""Attributes of a result that may have a title."""
_MAX_DRAWING_BYTES = 500_000
"""A drawing with more bytes, such as one of thousands of marks, is saved as a bitmap."""
_DOTS_PER_INCH = 160
_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"
"""Content Security Policy: the page loads nothing from any server."""
_BADGE_STYLE = "border:1px solid currentColor;border-radius:.7em;padding:0 .6em;margin-right:.4em;white-space:nowrap"
_TONE_COLOURS = {"good": "rgba(0,158,115,.35)", "bad": "rgba(213,94,0,.45)", "doubt": "rgba(230,159,0,.4)"}


def to_page(document: Document, extra_chapters: Iterable[tuple[Chapter, str]] = ()) -> str:
    """Write the whole page.

    Args:
        extra_chapters: chapters that follow the chapters of the document, each with its markup.
    """
    title = escape_text(document.title or "untitled")
    parts = [(chapter, _mark_up(chapter.blocks)) for chapter in document.chapters] + list(extra_chapters)
    parts = [(chapter, markup) for chapter, markup in parts if markup]
    links = " ".join(f'<a href="#{chapter.name}">{escape_text(chapter.title)}</a>' for chapter, _ in parts)
    body = "\n".join(_mark_chapter(chapter, markup) for chapter, markup in parts)
    style, script = (resources("tmsopt.documents").joinpath("page_files", f"document.{e}") for e in ("css", "js"))
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{_POLICY}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{title}</title>
<link rel="icon" href="data:,">
<style>
{style.read_text(encoding="utf-8")}</style>
</head>
<body>
<header>
<h1>{title}</h1>
<p class="badges">{mark_badges(document.badges)}</p>
<nav aria-label="Parts of this {document.kind.lower()}">{links}</nav>
</header>
<main>
{body}
</main>
<script>
{script.read_text(encoding="utf-8")}</script>
</body>
</html>
"""


def to_fragment(document: Document, draw: Callable[[], Axes] | None = None) -> str:
    """Write a fragment that sets no colours of text or background, so that dark and light themes can show it.

    Args:
        draw: draws the picture at the end of the fragment.
    """
    kind = f" <small>{document.kind}</small>" if document.title else ""
    head = f"<div><strong>{escape_text(document.title or document.kind)}</strong>{kind}</div>"
    body = "\n".join(_mark_up(chapter.blocks, is_fragment=True) for chapter in document.chapters)
    image = _draw_thumbnail(draw, document.kind) if draw else ""
    badges = f'<div style="margin:.4em 0">{mark_badges(document.badges)}</div>'
    return f'<div class="tmsopt">{head}{badges}\n{body}{image}</div>'


def mark_badges(badges: Iterable[Badge]) -> str:
    """Mark up the badges of a headline."""
    return " ".join(
        f'<span style="{_BADGE_STYLE};background:{_TONE_COLOURS.get(b.tone, "none")}">{escape_text(b.text)}</span>'
        for b in badges
    )


def escape_text(text: str) -> str:
    """Escape a text for an element or an attribute; control characters, also for the text direction, become �."""
    return escape(_CONTROL_CHARACTERS.sub("\ufffd", text))


def mark_verbatim(text: str, label: str) -> str:
    """Mark up an unchanged text; if it is wider than the page, the keyboard can scroll it too."""
    return f'<pre tabindex="0" role="group" aria-label="{escape_text(label)}">\n{escape_text(text)}</pre>'


def mark_list(items: Iterable[tuple[str, str]]) -> str:
    """Mark up labels with their texts; empty texts are left out."""
    listed = "\n".join(
        f"<div><dt>{escape_text(name)}</dt><dd>{escape_text(text)}</dd></div>" for name, text in items if text
    )
    return f"<dl>\n{listed}\n</dl>" if listed else ""


def _mark_chapter(chapter: Chapter, body: str) -> str:
    width_class, heading_id = f' class="{chapter.width}"' if chapter.width else "", f"{chapter.name}-heading"
    heading = f'<h2 id="{heading_id}">{escape_text(chapter.title)}</h2>'
    return f'<section id="{chapter.name}"{width_class} aria-labelledby="{heading_id}">\n{heading}\n{body}\n</section>'


def _mark_up(blocks: Sequence[Block], is_fragment: bool = False) -> str:
    return "\n".join(part for part in _mark_up_runs(blocks, is_fragment) if part)


def _mark_up_runs(blocks: Sequence[Block], is_fragment: bool) -> Iterator[str]:
    """Mark up blocks; consecutive sentences with labels become one list, and consecutive pictures one row."""
    for (kind, is_labelled), run in groupby(blocks, key=lambda b: (type(b), isinstance(b, Sentence) and bool(b.label))):
        members: list[Any] = list(run)
        if is_labelled:
            yield mark_list((sentence.label, sentence.text) for sentence in members)
        elif kind is Figure and len(members) > 1:
            figures = "\n".join(map(draw_figure, members))
            yield f'<div class="figures">\n{figures}\n</div>'
        else:
            yield from (_mark_up_block(block, is_fragment) for block in members)


def _mark_up_block(block: Block, is_fragment: bool) -> str:
    match block:
        case Sentence(text, _, tone):
            answer_class = ' class="answer"' if tone in ("answer", "good", "doubt", "bad") else ""
            return f"<p{answer_class}>{escape_text(text)}</p>"
        case Listing(items, title):
            return (f"<p><strong>{escape_text(title)}</strong></p>\n" if title else "") + mark_list(items)
        case Verbatim(text, label):
            return mark_verbatim(text.strip("\n"), label)
        case Figure():
            return draw_figure(block)
        case TableBlock():
            return _mark_table(block, is_fragment)


def _mark_table(table: TableBlock, is_fragment: bool) -> str:
    """Mark up a table without its empty columns. On a page, readers can sort it, and filter it if it is long."""
    rows, max_rows = table.texts, table.max_rows
    if is_fragment and max_rows is not None and len(rows) > max_rows:
        rows = [*rows[:max_rows], ["…"] * len(rows[0])]
    columns = [column for column in zip(*rows, strict=True) if any(column[1:])]
    if not columns:
        return ""
    classes = [_classify_column(column[1:]) for column in columns]
    headings, *body = zip(*columns, strict=True)
    cells = "".join(
        f'<th scope="col"{k}>{escape_text(c or "remark")}</th>' for c, k in zip(headings, classes, strict=True)
    )
    head = f"<thead><tr>{cells}</tr></thead>" if any(headings) else ""
    lines = "\n".join(f"<tr>{_mark_cells(row, classes)}</tr>" for row in body)
    if is_fragment:
        return f"<table>{head}<tbody>{lines}</tbody></table>"
    note = f"On paper, the table has only the first {_MAX_PAPER_ROWS} of the rows shown."
    paper_note = f'\n<p class="print">{note}</p>' if len(body) > _MAX_PAPER_ROWS else ""
    caption = escape_text(table.caption)
    table_class = f' class="sortable{" filterable" if len(body) >= _MIN_FILTER_ROWS else ""}"' if head else ""
    return (
        f'<div class="rows" role="group" tabindex="0" aria-label="{caption}"><table{table_class}>\n'
        f"<caption>{caption}</caption>\n{head}\n<tbody>\n{lines}\n</tbody>\n</table></div>{paper_note}"
    )


def _mark_cells(row: Sequence[str], classes: Sequence[str]) -> str:
    first, *rest = (f"{k}>{escape_text(cell)}" for cell, k in zip(row, classes, strict=True))
    return f'<th scope="row"{first}</th>' + "".join(f"<td{cell}</td>" for cell in rest)


def _classify_column(cells: Sequence[str]) -> str:
    """Return the class attribute of a column of numbers or of long texts; empty for short texts."""
    if all(_NUMBER.match(cell) for cell in cells if cell):
        return ' class="number"'
    return ' class="long"' if max(map(len, cells)) > _LONG_CELL else ""


def draw_figure(figure: Figure) -> str:
    """Mark up a figure with its caption; return an empty text if the figure cannot be drawn.

    Letters are drawn as outlines, so that no font is needed. The drawing is an embedded image, so that nothing in it
    becomes markup of the page.
    """
    try:
        picture = figure.draw(_remove_titles(figure.result))
        data, media_type = _save_image(picture, "svg"), "svg+xml"
        if len(data) > _MAX_DRAWING_BYTES:
            data, media_type = _save_image(picture, "png"), "png"
    except Exception:  # such as a design without roots, or a chart over three parameters
        return ""
    caption = escape_text(figure.caption)
    source = f"data:image/{media_type};base64,{base64.b64encode(data).decode()}"
    return f'<figure><img alt="{caption}" src="{source}"><figcaption>{caption}</figcaption></figure>'


def _remove_titles(result: Any) -> Any:
    names = {f.name for f in fields(result) if f.init}
    stripped_fields = {
        n: _remove_titles(v) for n in _TITLED_FIELDS if n in names and is_dataclass(v := getattr(result, n))
    }
    return replace(result, **stripped_fields, **({"title": ""} if "title" in names else {}))


def _draw_thumbnail(draw: Callable[[], Axes], name: str) -> str:
    """Mark up the picture for a notebook; empty if it cannot be drawn, because a display must not fail."""
    try:
        data = base64.b64encode(_save_image(draw(), "png", 100)).decode()
    except Exception:  # the rest of the fragment shows the result
        return ""
    return f'<img alt="{escape_text(name)}" style="max-width:100%" src="data:image/png;base64,{data}">'


def _save_image(picture: Any, file_format: str, dots_per_inch: int = _DOTS_PER_INCH) -> bytes:
    """Save a picture as an image; the same figure always gives the same bytes."""
    image = io.BytesIO()
    figure = picture.figure.figure if isinstance(picture, Axes) else picture
    metadata = {"Date": None} if file_format == "svg" else {}
    with rc_context({"svg.hashsalt": "tmsopt", "svg.fonttype": "path"}), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph", UserWarning)  # letters that no font has are shown as boxes
        figure.savefig(image, format=file_format, dpi=dots_per_inch, bbox_inches="tight", metadata=metadata)
    return image.getvalue()
