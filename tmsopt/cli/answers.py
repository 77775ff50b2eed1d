"""Answers of commands: JSON or text on stdout, laid out for a terminal or a pipe, and the files that options name.

A file name is checked before any work is done. A file is written completely or not at all; its name goes to stderr.
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

FIGURE_ENDINGS = ("png", "pdf", "svg")
"""Endings of the file names of figures."""

PAGE_ENDINGS = ("html", "htm")
"""Endings of the file names of pages for a browser."""

WORDS_KEY = "tmsopt.words"
"""Key under which the `meta` of click's context has the words of the command line."""

_PIPE_COLUMNS = 100  # width of lines in a pipe
_MIN_COLUMNS, _MAX_COLUMNS = 40, 160  # limits of the width of lines in a terminal
_ROWS_PER_WRITE = 5000  # number of JSON rows that are formatted and written at once
_REPORT_LETTERS = "√±×…−ωε"  # letters of reports that some encodings lack


@dataclass(frozen=True)
class Reply:
    """The answer of a command.

    Attributes:
        result: a result, or a text.
        status: exit status.
        data: the JSON; by default the `to_json` of the result.
        level: how much the document and the page of the result show, brief or full.
        draw: makes the figure; by default `plot` of the result.
        write_csv: writes the table; by default `write_csv` of the result.
        page: options of `tmsopt.save_report`.
        content: what is printed instead of the result: its document, or a list of results and texts.
        skipped_options: names of options, separated by blanks, whose files are not written.
    """

    result: Any
    status: int = 0
    data: Any = None
    level: str = "brief"
    draw: Callable[[], Any] | None = None
    write_csv: Callable[[Path], object] | None = None
    page: Mapping[str, Any] = field(default_factory=dict)
    content: Any = None
    skipped_options: str = ""


def deliver(command: Any, reply: Reply) -> int:
    """Write the answer of a command, then the files that its options name; return its exit status."""
    answer(command.json, reply.content or reply.result, lambda: reply.data or reply.result.to_json(), reply.level)
    write_files(command, reply)
    return reply.status


def write_files(command: Any, reply: Reply, *files: Path) -> None:
    """Write the files that the options of a command name.

    Args:
        files: the files with the problem, by default FILE.
    """
    result = reply.result

    def save_page(path: Path) -> None:
        texts = {file.name: read_text(str(file), "TOML problem file") for file in files or [command.file]}
        line = shlex.join(["tmsopt", *click.get_current_context().meta.get(WORDS_KEY, ())])
        seed = {"seed": command.seed} if hasattr(command, "seed") else {}
        is_full, progress = reply.level == "full", progress_listener()
        tmsopt.save_report(
            result, path, command=line, files=texts, full=is_full, progress=progress, **seed, **reply.page
        )

    def write_table(path: Path) -> None:
        (reply.write_csv or result.write_csv)(path)

    def draw(path: Path) -> None:
        tmsopt.plots.save((reply.draw or result.plot)(), path)

    for name, write in {"csv": write_table, "plot": draw, "report": save_page}.items():
        if name not in reply.skipped_options:
            write_file(f"--{name}", getattr(command, name, None), write)


def answer(as_json: bool, content: Any, data: Callable[[], Any], level: str = "brief") -> None:
    """Write JSON, or results, documents and texts, to stdout; a signal is handled after they are written."""
    show_step("writing the answer")
    results = content if isinstance(content, list | tuple) else [content]
    documents = [] if as_json else [make_document(result, level) for result in results]
    with hold_signals():
        text = format_json(data()) if as_json else "\n\n".join(map(lay_out, documents))
        click.echo(text, color=is_coloured())  # without this, click removes colours in a pipe


def make_document(result: Any, level: Any = "brief", **options: Any) -> Any:
    """The document of a result, while progress is shown. A text stays a text."""
    from tmsopt.documents import Document, document_of

    if isinstance(result, str | Document):
        return result
    with result.analysis.report_progress(progress_listener()) if hasattr(result, "analysis") else nullcontext():
        return document_of(result, level, **options)


def lay_out(document: Any) -> str:
    """The text of a document, or a text of one line, with the width, colours and letters of this stdout."""
    from tmsopt.documents import to_text, wrap

    width = min(max(count_columns(sys.stdout), _MIN_COLUMNS), _MAX_COLUMNS) if sys.stdout.isatty() else _PIPE_COLUMNS
    if isinstance(document, str):
        return document if "\n" in document else "\n".join(wrap(document, width))
    kept_letters = _REPORT_LETTERS.encode(sys.stdout.encoding or "utf-8", "ignore")
    return to_text(document, width, is_coloured(), ascii_only=len(kept_letters) < len(_REPORT_LETTERS))


def is_coloured() -> bool:
    """Whether to colour the text: --color decides, otherwise the terminal and its environment."""
    context = click.get_current_context(silent=True)
    if context and context.color is not None:
        return context.color
    return sys.stdout.isatty() and os.environ.get("TERM") != "dumb" and not os.environ.get("NO_COLOR")


def format_json(data: Any) -> str:
    """JSON for stdout; characters that stdout cannot encode are escaped."""
    is_narrow = not (sys.stdout.encoding or "utf").lower().startswith("utf")
    return json.dumps(data, indent=2, ensure_ascii=is_narrow, allow_nan=False)


def answer_rows(data: dict[str, Any], key: str, rows: Sequence[Any]) -> None:
    """Write JSON with a long list of rows under a key, block by block.

    Args:
        data: the JSON, with an empty list under the key.
        rows: objects with `to_json`.
    """
    show_step("writing the answer")
    head, row_list, tail = format_json(data).partition(f'\n  "{key}": [')
    with hide_progress() if sys.stdout.isatty() else nullcontext():
        click.echo(head + row_list, nl=False)
        for first in range(0, len(rows), _ROWS_PER_WRITE):
            block = [row.to_json() for row in rows[first : first + _ROWS_PER_WRITE]]
            text = format_json(block)[1:-2].replace("\n", "\n  ")  # without brackets, and indented
            click.echo("," * (first > 0) + text, nl=False)
        click.echo("\n  " * bool(rows) + tail)


def check_output(option: str, path: Path | None, endings: Sequence[str]) -> None:
    """Check that a file, or the folder of a chart, can be written."""
    if path is None:
        return
    ending = path.suffix.lstrip(".").lower()
    if ending not in endings:
        raise input_error(f"found '{path}'; accepted: a file name ending in {', '.join(endings)}", option)
    try:
        reason = "is a directory" if path.is_dir() and ending != "chart" else ""
        reason = reason or ("" if path.parent.is_dir() else "is in a directory that does not exist")
    except OSError as error:  # the name is longer than the file system allows
        reason = f"is not accepted as a file name here ({error.strerror})"
    if reason:
        raise input_error(f"'{path}' {reason}; give the path of a file to write", option)


@contextmanager
def report_writing(option: str, path: Path) -> Iterator[None]:
    """Name the file that was written; if it could not be written, say why and exit with status 2."""
    show_step(f"writing the file of {option}")
    try:
        yield
    except OSError as error:
        exists = isinstance(error, FileExistsError)
        reason = "exists already; give another name" if exists else f"cannot be written: {error.strerror or error}"
        click.echo(f"{option}: '{path}' {reason}", err=True)
        sys.exit(BAD_INPUT)
    click.echo(f"wrote {path}", err=True)


def write_file(option: str, path: Path | None, write: Callable[[Path], object]) -> None:
    """Write a file if the user named one."""
    if path is not None:
        with report_writing(option, path):
            write(path)


def write_new(option: str, path: Path, text: str) -> None:
    """Write a new file, and the files that a problem refers to if they do not exist.

    The message on stderr names a folder once, even if several files are written to it."""
    from tmsopt.guide import companions

    companion_texts = companions(text) if path.suffix == ".toml" else {}
    files = {path: text} | {
        f: companion for n, companion in companion_texts.items() if not (f := path.parent / n).exists()
    }
    for named_path, group in groupby(files, lambda file: file if file.parent == path.parent else file.parent):
        with report_writing(option, named_path):
            for file in group:
                file.parent.mkdir(exist_ok=True)
                write_text(file, files[file], must_be_new=True)


def print_or_write(text: str, path: Path | None) -> None:
    """Print a text, or write it to the new file that --output names."""
    if path is None:
        click.echo(text, nl=False)
    else:
        write_new("--output", path, text)
