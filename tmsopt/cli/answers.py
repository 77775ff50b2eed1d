"""Answers: JSON or text on stdout, laid out for the terminal or pipe that reads it, and the files that go with them.

Files are refused before any work is done, written as a whole, and named on stderr.
"""

import json
import os
import shlex
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import Any

import click

import tmsopt
from tmsopt.cli.ending import BAD_INPUT, hold_signals
from tmsopt.cli.terminal import count_columns, hide_progress, progress_listener, show_step
from tmsopt.errors import input_error
from tmsopt.files import read_text, write_text

FIGURES, PAGES = ("png", "pdf", "svg"), ("html", "htm")
"""Endings of figures, and of pages to hand on."""

WORDS = "tmsopt.words"
"""Key of the words of the command line in what click's context keeps."""

_PIPE, _NARROWEST, _WIDEST = 100, 40, 160  # columns of a pipe; least and most of a terminal
_BLOCK = 5000  # rows of JSON made and written at once
_LETTERS = "√±×…−ωε"  # of reports


@dataclass(frozen=True)
class Reply:
    """What a command found.

    Attributes:
        result: a result, or a text.
        data: the JSON; by default the `to_json` of the result.
        level: of its document and its page, brief or full.
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
    result = found.result

    def save_page(path: Path) -> None:
        texts = {file.name: read_text(str(file), "TOML problem file") for file in files or [command.file]}
        line = shlex.join(["tmsopt", *click.get_current_context().meta.get(WORDS, ())])
        seed = {"seed": command.seed} if hasattr(command, "seed") else {}
        is_full, progress = found.level == "full", progress_listener()
        tmsopt.save_report(
            result, path, command=line, files=texts, full=is_full, progress=progress, **seed, **found.page
        )

    def write_table(path: Path) -> None:
        (found.write_csv or result.write_csv)(path)

    def draw(path: Path) -> None:
        tmsopt.plots.save((found.draw or result.plot)(), path)

    for name, write in {"csv": write_table, "plot": draw, "report": save_page}.items():
        if name not in found.without:
            write_file(f"--{name}", getattr(command, name, None), write)


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


def is_coloured() -> bool:
    """Whether --color, or else the terminal and its environment, ask for colours."""
    context = click.get_current_context(silent=True)
    if context and context.color is not None:
        return context.color
    return sys.stdout.isatty() and os.environ.get("TERM") != "dumb" and not os.environ.get("NO_COLOR")


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
    show_step("writing the answer")
    before, head, after = format_json(data).partition(f'\n  "{key}": [')
    with hide_progress() if sys.stdout.isatty() else nullcontext():
        click.echo(before + head, nl=False)
        for first in range(0, len(rows), _BLOCK):
            block = [row.to_json() for row in rows[first : first + _BLOCK]]
            text = format_json(block)[1:-2].replace("\n", "\n  ")  # without brackets, further in
            click.echo("," * (first > 0) + text, nl=False)
        click.echo("\n  " * bool(rows) + after)


def check_output(option: str, path: Path | None, endings: Sequence[str]) -> None:
    """Refuse a file, or the folder of a chart, that cannot be written."""
    if path is None:
        return
    ending = path.suffix.lstrip(".").lower()
    if ending not in endings:
        raise input_error(f"found '{path}'; accepted: a file name ending in {', '.join(endings)}", option)
    try:
        problem = "is a directory" if path.is_dir() and ending != "chart" else ""
        problem = problem or ("" if path.parent.is_dir() else "is in a directory that does not exist")
    except OSError as error:  # a name longer than the file system takes
        problem = f"is no name for a file here ({error.strerror})"
    if problem:
        raise input_error(f"'{path}' {problem}; give the path of a file to write", option)


@contextmanager
def report_writing(option: str, path: Path) -> Iterator[None]:
    """Name the file that was written, or say why it was not and exit with status 2."""
    show_step(f"writing what {option} asks for")
    try:
        yield
    except OSError as error:
        exists = isinstance(error, FileExistsError)
        reason = "is there already; give another name" if exists else f"cannot be written: {error.strerror or error}"
        click.echo(f"{option}: '{path}' {reason}", err=True)
        sys.exit(BAD_INPUT)
    click.echo(f"wrote {path}", err=True)


def write_file(option: str, path: Path | None, write: Callable[[Path], object]) -> None:
    """Write a file if the user named one."""
    if path is not None:
        with report_writing(option, path):
            write(path)


def write_new(option: str, path: Path, text: str) -> None:
    """Write a new file, and the files that a problem refers to unless they exist; folders are named as a whole."""
    from tmsopt.guide import companions

    others = companions(text) if path.suffix == ".toml" else {}
    files = {path: text} | {f: other for n, other in others.items() if not (f := path.parent / n).exists()}
    for place, group in groupby(files, lambda file: file if file.parent == path.parent else file.parent):
        with report_writing(option, place):
            for file in group:
                file.parent.mkdir(exist_ok=True)
                write_text(file, files[file], new=True)


def print_or_write(text: str, path: Path | None) -> None:
    """Print a text, or write it into the new file of --output."""
    if path is None:
        click.echo(text, nl=False)
    else:
        write_new("--output", path, text)
