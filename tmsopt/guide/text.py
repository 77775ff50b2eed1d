"""Tables, sentences and matrices as lines of at most 100 columns."""

import textwrap
from collections.abc import Iterable, Iterator, Sequence

WIDTH = 100


def table(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Columns, empty ones left out, the last one wrapped."""
    if not rows:
        yield "  none"
        return
    kept = [k for k in range(len(rows[0])) if any(row[k] for row in rows)]
    widths = [max(len(row[k]) for row in rows) for k in kept[:-1]]
    indent = 2 + sum(widths) + 2 * len(widths)
    for row in rows:
        cells = "".join(f"{row[k].ljust(width)}  " for k, width in zip(kept, widths, strict=False))
        first, *others = textwrap.wrap(row[kept[-1]], WIDTH - indent) or [""]
        yield f"  {cells}{first}".rstrip()
        yield from (" " * indent + line for line in others)


def wrapped(sentences: Iterable[str]) -> Iterator[str]:
    for sentence in sentences:
        yield from textwrap.wrap(sentence, WIDTH, initial_indent="  ", subsequent_indent="    ", break_on_hyphens=False)


def matrix(name: str, rows: Sequence[Sequence[str]]) -> list[str]:
    """Columns side by side where they fit, else a row after the other."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    lines = ["  ".join(e.rjust(w) for e, w in zip(row, widths, strict=True)) for row in rows]
    lead = f"{name} = "
    if all(len(line) + len(lead) + 2 <= WIDTH for line in lines):
        return [f"{lead if k == 0 else ' ' * len(lead)}[{line}]" for k, line in enumerate(lines)]
    listed = [f"{lead if k == 0 else ' ' * len(lead)}[{', '.join(row)}]" for k, row in enumerate(rows)]
    return [part for line in listed for part in textwrap.wrap(line, WIDTH, subsequent_indent=" " * (len(lead) + 1))]
