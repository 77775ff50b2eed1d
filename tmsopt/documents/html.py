"""A document as HTML: a page that needs nothing from elsewhere, or a fragment for a notebook.

Whatever was given is text there, never markup.
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
_UNSHOWN = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
_LONG = 24  # characters of a cell in a column that stays wide
_FILTERED = 12  # rows from which a table has a field that filters them
_ON_PAPER = 100  # rows of a table at most, in document.css too
_HOLDERS = ("problem", "asked", "study", "design")  # attributes of a result that may have a title
_LARGEST = 500_000  # bytes of a drawing; one with more, such as of thousands of marks, is an image of dots
_DOTS = 160  # an inch
_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"
"""Nothing is asked of any server, whatever the page holds."""
_BADGE = "border:1px solid currentColor;border-radius:.7em;padding:0 .6em;margin-right:.4em;white-space:nowrap"
_MARKS = {"good": "rgba(0,158,115,.35)", "bad": "rgba(213,94,0,.45)", "doubt": "rgba(230,159,0,.4)"}


def to_page(document: Document, more: Iterable[tuple[Chapter, str]] = ()) -> str:
    """The whole page.

    Args:
        more: further sections, with markup that stands in them.
    """
    title = escape_text(document.title or "untitled")
    parts = [(section, _mark_up(section.blocks)) for section in document.sections] + list(more)
    parts = [(section, body) for section, body in parts if body]
    links = " ".join(f'<a href="#{section.name}">{escape_text(section.title)}</a>' for section, _ in parts)
    body = "\n".join(_mark_section(section, markup) for section, markup in parts)
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
<p class="badges">{mark_badges(document.words)}</p>
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
    """A fragment without colours of text or background of its own: it can be read in dark and in light.

    Args:
        draw: draws the picture at its end.
    """
    kind = f" <small>{document.kind}</small>" if document.title else ""
    head = f"<div><strong>{escape_text(document.title or document.kind)}</strong>{kind}</div>"
    body = "\n".join(_mark_up(section.blocks, plain=True) for section in document.sections)
    image = _draw_thumbnail(draw, document.kind) if draw else ""
    return (
        f'<div class="tmsopt">{head}<div style="margin:.4em 0">{mark_badges(document.words)}</div>\n{body}{image}</div>'
    )


def mark_badges(said: Iterable[Badge]) -> str:
    """What a result is and how it ended, a mark for each word."""
    return " ".join(
        f'<span style="{_BADGE};background:{_MARKS.get(word.tone, "none")}">{escape_text(word.text)}</span>'
        for word in said
    )


def escape_text(text: str) -> str:
    """A text inside an element or an attribute; controls, of what is shown too, become marks."""
    return escape(_UNSHOWN.sub("\ufffd", text))


def mark_verbatim(text: str, label: str) -> str:
    """A text as it is; it may be wider than the page, and is then reached by the keyboard too."""
    return f'<pre tabindex="0" role="group" aria-label="{escape_text(label)}">\n{escape_text(text)}</pre>'


def mark_list(items: Iterable[tuple[str, str]]) -> str:
    """Labels with what there is to say of each."""
    listed = "\n".join(
        f"<div><dt>{escape_text(name)}</dt><dd>{escape_text(said)}</dd></div>" for name, said in items if said
    )
    return f"<dl>\n{listed}\n</dl>" if listed else ""


def _mark_section(section: Chapter, body: str) -> str:
    kind, head = f' class="{section.width}"' if section.width else "", f"{section.name}-heading"
    title = f'<h2 id="{head}">{escape_text(section.title)}</h2>'
    return f'<section id="{section.name}"{kind} aria-labelledby="{head}">\n{title}\n{body}\n</section>'


def _mark_up(blocks: Sequence[Block], plain: bool = False) -> str:
    return "\n".join(part for part in _mark_up_runs(blocks, plain) if part)


def _mark_up_runs(blocks: Sequence[Block], plain: bool) -> Iterator[str]:
    """Facts that follow each other are one list; pictures that do stand beside each other where there is room."""
    for (kind, labelled), run in groupby(blocks, key=lambda b: (type(b), isinstance(b, Sentence) and bool(b.label))):
        some: list[Any] = list(run)
        if labelled:
            yield mark_list((one.label, one.text) for one in some)
        elif kind is Figure and len(some) > 1:
            drawn = "\n".join(map(draw_figure, some))
            yield f'<div class="beside">\n{drawn}\n</div>'
        else:
            yield from (_mark_up_block(one, plain) for one in some)


def _mark_up_block(block: Block, plain: bool) -> str:
    match block:
        case Sentence(text, _, tone):
            lead = ' class="lead"' if tone in ("answer", "good", "doubt", "bad") else ""
            return f"<p{lead}>{escape_text(text)}</p>"
        case Listing(items, title):
            return (f"<p><strong>{escape_text(title)}</strong></p>\n" if title else "") + mark_list(items)
        case Verbatim(text, label):
            return mark_verbatim(text.strip("\n"), label)
        case Figure():
            return draw_figure(block)
        case TableBlock():
            return _mark_table(block, plain)


def _mark_table(grid: TableBlock, plain: bool) -> str:
    """A table that can be sorted, a long one filtered too, without columns in which nothing stands."""
    rows, most = grid.texts, grid.most
    if plain and most is not None and len(rows) > most:
        rows = [*rows[:most], ["…"] * len(rows[0])]
    columns = [column for column in zip(*rows, strict=True) if any(column[1:])]
    if not columns:
        return ""
    kinds = [_classify_column(column[1:]) for column in columns]
    heads, *body = zip(*columns, strict=True)
    cells = "".join(f'<th scope="col"{k}>{escape_text(c or "remark")}</th>' for c, k in zip(heads, kinds, strict=True))
    head = f"<thead><tr>{cells}</tr></thead>" if any(heads) else ""
    lines = "\n".join(f"<tr>{_mark_cells(row, kinds)}</tr>" for row in body)
    if plain:
        return f"<table>{head}<tbody>{lines}</tbody></table>"
    said = f"On paper are the first {_ON_PAPER} of the rows that are shown."
    paper = f'\n<p class="print">{said}</p>' if len(body) > _ON_PAPER else ""
    caption = escape_text(grid.caption)
    kind = f' class="sortable{" filterable" if len(body) >= _FILTERED else ""}"' if head else ""
    return (
        f'<div class="rows" role="group" tabindex="0" aria-label="{caption}"><table{kind}>\n'
        f"<caption>{caption}</caption>\n{head}\n<tbody>\n{lines}\n</tbody>\n</table></div>{paper}"
    )


def _mark_cells(row: Sequence[str], kinds: Sequence[str]) -> str:
    first, *rest = (f"{kind}>{escape_text(cell)}" for cell, kind in zip(row, kinds, strict=True))
    return f'<th scope="row"{first}</th>' + "".join(f"<td{cell}</td>" for cell in rest)


def _classify_column(cells: Sequence[str]) -> str:
    """Whether a column is of numbers, of long words, or of short ones."""
    if all(_NUMBER.match(cell) for cell in cells if cell):
        return ' class="number"'
    return ' class="long"' if max(map(len, cells)) > _LONG else ""


def draw_figure(figure: Figure) -> str:
    """A figure with its caption; empty where it cannot be drawn, for the rest of the page says what there is.

    Letters are outlines, and a drawing is an image apart from the page: nothing in it is markup of the page.
    """
    try:
        drawn = figure.draw(_remove_titles(figure.result))
        data, kind = _save_image(drawn, "svg"), "svg+xml"
        if len(data) > _LARGEST:
            data, kind = _save_image(drawn, "png"), "png"
    except Exception:  # of a design without roots, of a chart over three parameters, …
        return ""
    said = escape_text(figure.caption)
    source = f"data:image/{kind};base64,{base64.b64encode(data).decode()}"
    return f'<figure><img alt="{said}" src="{source}"><figcaption>{said}</figcaption></figure>'


def _remove_titles(result: Any) -> Any:
    names = {f.name for f in fields(result) if f.init}
    held = {n: _remove_titles(v) for n in _HOLDERS if n in names and is_dataclass(v := getattr(result, n))}
    return replace(result, **held, **({"title": ""} if "title" in names else {}))


def _draw_thumbnail(draw: Callable[[], Axes], name: str) -> str:
    """The picture for a notebook; none where it cannot be drawn: a display must not break over it."""
    try:
        coded = base64.b64encode(_save_image(draw(), "png", 100)).decode()
    except Exception:  # whatever it was, the rest says what the result is
        return ""
    return f'<img alt="{escape_text(name)}" style="max-width:100%" src="data:image/png;base64,{coded}">'


def _save_image(drawn: Any, kind: str, dots: int = _DOTS) -> bytes:
    """The same bytes for the same figure, whenever it is drawn."""
    image = io.BytesIO()
    figure = drawn.figure.figure if isinstance(drawn, Axes) else drawn
    about = {"Date": None} if kind == "svg" else {}
    with rc_context({"svg.hashsalt": "tmsopt", "svg.fonttype": "path"}), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph", UserWarning)  # of letters that no font here has: boxes show that
        figure.savefig(image, format=kind, dpi=dots, bbox_inches="tight", metadata=about)
    return image.getvalue()
