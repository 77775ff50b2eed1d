"""Answers: JSON or text on stdout, laid out for the terminal or pipe that reads it, and the files that go with them."""

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click

from tmsopt.cli.context import is_coloured
from tmsopt.cli.ending import hold_signals
from tmsopt.cli.outputs import write_file, write_plot, write_report
from tmsopt.cli.terminal import count_columns, hide_progress, progress_listener, show_step

_PIPE, _NARROWEST, _WIDEST = 100, 40, 160  # columns of a pipe; least and most of a terminal
_BLOCK = 5000  # rows of JSON made and written at once
_LETTERS = "√±×…−ωε"  # of reports


@dataclass(frozen=True)
class Reply:
    """What a command found.

    Attributes:
        result: a result, or a text.
        data: the JSON; by default the `to_json` of the result.
        draw, write_csv: make the figure and the table; by default `plot` and `write_csv` of the result.
        page: options of `tmsopt.save_report`.
        shown: on stdout instead of the result: its document, or a list of results and texts.
        without: names of files that are not written.
    """

    result: Any
    status: int = 0
    data: Any = None
    level: str = "brief"
    draw: Callable[[], Any] | None = None
    write_csv: Callable[[Path], object] | None = None
    page: Mapping[str, Any] = field(default_factory=dict)
    shown: Any = None
    without: str = ""


def deliver(command: Any, found: Reply) -> int:
    """Write the answer of a command, then the files that its options name; its exit status."""
    answer(command.json, found.shown or found.result, lambda: found.data or found.result.to_json(), found.level)
    write_files(command, found)
    return found.status


def write_files(command: Any, found: Reply, *files: Path) -> None:
    """Write what the options of a command name; `files` state its problem, by default FILE."""
    paths = {n: getattr(command, n, None) for n in ("csv", "plot", "report") if n not in found.without}
    if path := paths.get("csv"):
        write_file("--csv", path, found.write_csv or found.result.write_csv)
    if path := paths.get("plot"):
        write_plot(path, found.draw or found.result.plot)
    if path := paths.get("report"):
        page: Mapping[str, Any] = {"seed": command.seed} if hasattr(command, "seed") else {}
        write_report(found.result, path, *files or (command.file,), **page, **found.page)


def answer(as_json: bool, shown: Any, data: Callable[[], Any], level: str = "brief") -> None:
    """Write JSON, or results, documents and texts, to stdout; a signal waits until they are written."""
    show_step("writing the answer")
    several = shown if isinstance(shown, list | tuple) else [shown]
    documents = [] if as_json else [make_document(one, level) for one in several]
    with hold_signals():
        text = format_json(data()) if as_json else "\n\n".join(map(lay_out, documents))
        click.echo(text, color=is_coloured())  # or else click takes colours out of a pipe


def make_document(result: Any, level: Any = "brief", **options: Any) -> Any:
    """The document of a result; progress shows what is computed for it. A text stays a text."""
    from tmsopt.documents import Document, document_of

    if isinstance(result, str | Document):
        return result
    with result.analysis.report_progress(progress_listener()) if hasattr(result, "analysis") else nullcontext():
        return document_of(result, level, **options)


def lay_out(document: Any) -> str:
    """The text of a document for this stdout."""
    if isinstance(document, str):
        return document
    from tmsopt.documents import to_text

    width = min(max(count_columns(sys.stdout), _NARROWEST), _WIDEST) if sys.stdout.isatty() else _PIPE
    encoded = _LETTERS.encode(sys.stdout.encoding or "utf-8", "ignore")
    return to_text(document, width, is_coloured(), len(encoded) < len(_LETTERS))


def format_json(data: Any) -> str:
    """JSON for stdout; it escapes what stdout cannot encode."""
    narrow = not (sys.stdout.encoding or "utf").lower().startswith("utf")
    return json.dumps(data, indent=2, ensure_ascii=narrow, allow_nan=False)


def answer_rows(data: dict[str, Any], key: str, rows: Sequence[Any]) -> None:
    """Write JSON with a long list of rows under a key, block by block.

    Args:
        data: with an empty list under the key.
        rows: that have `to_json`.
    """
    from tmsopt.progress import start_steps

    before, head, after = format_json(data).partition(f'\n  "{key}": [')
    steps = start_steps(progress_listener(), "writing the answer", "row")
    with hide_progress() if sys.stdout.isatty() else nullcontext():
        click.echo(before + head, nl=False)
        for first in range(0, len(rows), _BLOCK):
            block = [row.to_json() for row in rows[first : first + _BLOCK]]
            text = format_json(block)[1:-2].replace("\n", "\n  ")  # without brackets, further in
            click.echo("," * (first > 0) + text, nl=False)
            if steps:
                steps(first + len(block), len(rows))
        click.echo("\n  " * bool(rows) + after)
