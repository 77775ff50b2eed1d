"""Files that commands write: refused before any work is done, written as a whole, named on stderr."""

import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from tmsopt.cli.context import WORDS
from tmsopt.cli.ending import BAD_INPUT
from tmsopt.cli.terminal import progress_listener, show_step
from tmsopt.errors import input_error

FIGURES, PAGES = ("png", "pdf", "svg"), ("html", "htm")
"""Endings of figures, and of pages to hand on."""


def check_output(option: str, path: Path | None, endings: Sequence[str], folders: Sequence[str] = ()) -> None:
    """Refuse a file that cannot be written; a name that ends in one of `folders` may be a folder."""
    if path is None:
        return
    ending = path.suffix.lstrip(".").lower()
    if ending not in endings:
        raise input_error(f"found '{path}'; accepted: a file name ending in {', '.join(endings)}", option)
    try:
        problem = "is a directory" if path.is_dir() and ending not in folders else ""
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


def write_plot(path: Path, draw: Callable[[], Any]) -> None:
    """Draw a figure and write it."""
    import tmsopt

    drawn = draw()
    write_file("--plot", path, lambda path: tmsopt.plots.save(drawn, path))


def write_report(result: Any, path: Path, *files: Path, **options: Any) -> None:
    """Write the page of a result, with the command and its files."""
    import tmsopt
    from tmsopt.files import read_text

    words = click.get_current_context().meta.get(WORDS, ())
    texts = {file.name: read_text(str(file), "TOML problem file") for file in files}
    options |= {"command": shlex.join(("tmsopt", *words)), "files": texts, "progress": progress_listener()}
    write_file("--report", path, lambda path: tmsopt.save_report(result, path, **options))


def write_new(option: str, path: Path, text: str) -> None:
    """Write a new file, and the files that a problem refers to unless they exist."""
    from tmsopt.files import write_text
    from tmsopt.guide import companions

    others = companions(text) if path.suffix == ".toml" else {}
    places: dict[Path, list[tuple[Path, str]]] = {path: [(path, text)]}  # folders beside it are named as a whole
    for file, content in ((path.parent / name, other) for name, other in others.items()):
        if not file.exists():
            places.setdefault(file if file.parent == path.parent else file.parent, []).append((file, content))
    for place, files in places.items():
        with report_writing(option, place):
            for file, content in files:
                file.parent.mkdir(exist_ok=True)
                write_text(file, content, new=True)


def print_or_write(text: str, path: Path | None) -> None:
    """Print a text, or write it into the new file of --output."""
    if path is None:
        click.echo(text, nl=False)
    else:
        write_new("--output", path, text)
