"""What commands share: exit status, bad input, files to write."""

import json
import shlex
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tmsopt.cli.ending import BAD_INPUT, answering
from tmsopt.cli.terminal import doing, quiet, shown
from tmsopt.errors import MOST_STARTS, Fault, InputError, refusal

if TYPE_CHECKING:
    from tmsopt.problem import Posed

DONE, INFEASIBLE, NOT_CONVERGED = 0, 3, 4
"""Exit status, beside those of `ending`."""

FIGURES = ("png", "pdf", "svg")
"""Endings of figure files."""

REPORTS = ("html", "htm")
"""Endings of pages to hand on."""

PATH = click.Path(path_type=Path)

Option = Callable[[Callable[..., Any]], Callable[..., Any]]
"""A decorator of a command."""

_BLOCK = 5000  # rows of JSON made and written at once

TYPED = "tmsopt.words"
"""Where the words of the command line are kept, in what click hands from a command to the next."""


@contextmanager
def bad_input() -> Iterator[None]:
    """Turn bad input into its messages on stderr and exit status 2.

    Where a problem has no design to look at, say so on stderr, with exit status 3 or 4.
    """
    from tmsopt import NotSolved

    try:
        yield
    except InputError as error:
        click.echo(str(error), err=True)
        sys.exit(BAD_INPUT)
    except NotSolved as error:
        problem, status = error.solution.problem, error.solution.status
        click.echo(f"{problem.title}: {status.replace('_', ' ')}; there is no design to look at", err=True)
        sys.exit(INFEASIBLE if status == "infeasible" else NOT_CONVERGED)


def named(option: str, given: Sequence[str], example: str) -> dict[str, str]:
    """What an option that may be repeated gives as NAME=VALUE, by name."""
    pairs = [text.partition("=") for text in given]
    faults = [Fault(f"found '{n}'; accepted: NAME=VALUE, such as {example}", (option,)) for n, e, _ in pairs if not e]
    if faults:
        raise InputError(faults)
    return {name.strip(): value.strip() for name, _, value in pairs}


def number(text: str, unit: str, *key: str) -> float:
    """A number of the command line, plain or with a unit."""
    from tmsopt.problem.units import parse_quantity

    try:
        return float(text)
    except ValueError:
        try:
            return parse_quantity(text, unit)
        except ValueError as error:
            raise refusal(str(error), *key) from None


def check_output(option: str, path: Path | None, endings: Sequence[str], folders: Sequence[str] = ()) -> None:
    """Refuse a file that could not be written, before any work is done; what ends in one of `folders` is a folder."""
    if path is None:
        return
    ending = path.suffix.lstrip(".").lower()
    if ending not in endings:
        raise refusal(f"found '{path}'; accepted: a file name ending in {', '.join(endings)}", option)
    try:
        problem = "is a directory" if path.is_dir() and ending not in folders else ""
        problem = problem or ("" if path.parent.is_dir() else "is in a directory that does not exist")
    except OSError as error:  # a name longer than the file system takes
        problem = f"is no name for a file here ({error.strerror})"
    if problem:
        raise refusal(f"'{path}' {problem}; give the path of a file to write", option)


file_argument = click.argument("file", type=PATH)
json_option = click.option("--json", "as_json", is_flag=True, help="Write JSON to stdout instead of text.")
seed_option = click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the starts.")


def starts_option(text: str = "Starts tried at most. [default: 64]", default: int | None = None) -> Option:
    """The option that limits how many starts a search has."""
    many = click.IntRange(1, MOST_STARTS)
    return click.option("--starts", type=many, default=default, show_default=default is not None, help=text)


def output_option(endings: Sequence[str], text: str, *names: str) -> Option:
    """An option that names a file to write, refused before any work is done where it could not be written."""

    def check(_context: click.Context, option: click.Parameter, path: Path | None) -> Path | None:
        check_output(option.opts[0], path, endings)
        return path

    return click.option(*(names or ("--output", "-o")), type=PATH, callback=check, help=text)


def plot_option(what: str) -> Option:
    """The option of commands that draw."""
    return output_option(FIGURES, f"{what} (png, pdf, svg).", "--plot")


def csv_option(what: str) -> Option:
    """The option of commands that write a table."""
    return output_option(("csv",), what, "--csv", "csv_file")


report_option = output_option(
    REPORTS, "Write one page to hand on, with pictures, tables and the explorer (html).", "--report"
)


def write_report(result: Any, path: Path | None, *files: Path, **more: Any) -> None:
    """Write the page of a result where one is asked for, with the words of the command and what they name.

    Args:
        files: by which the result was asked for.
        more: for `tmsopt.save_report`.
    """
    if path is None:
        return
    import tmsopt
    from tmsopt.files import read_text

    words = click.get_current_context().meta.get(TYPED, ())
    texts = {file.name: read_text(str(file), "TOML problem file") for file in files}
    with saving("--report", path):
        command = shlex.join(("tmsopt", *words))
        tmsopt.save_report(result, path, command=command, files=texts, progress=shown(), **more)


@contextmanager
def saving(option: str, path: Path) -> Iterator[None]:
    """Say that a file was written, or why it could not be, with exit status 2."""
    doing(f"writing what {option} asks for")
    try:
        yield
    except OSError as error:
        there = isinstance(error, FileExistsError)
        found = "is there already; give another name" if there else f"cannot be written: {error.strerror or error}"
        click.echo(f"{option}: '{path}' {found}", err=True)
        sys.exit(BAD_INPUT)
    click.echo(f"wrote {path}", err=True)


def write_file(option: str, path: Path | None, write: Callable[[Path], object]) -> None:
    """Write a file where one is asked for."""
    if path is not None:
        with saving(option, path):
            write(path)


def plane(problem: "Posed", axes: str | None) -> tuple[str, str]:
    """Two parameters to draw over: the given ones, or the first two that are free.

    Raises:
        InputError: unless there are two, both free.
    """
    free = list(problem.free)
    names = [n.strip() for n in axes.split(",")] if axes is not None else free[:2]
    if len(names) != 2 or names[0] == names[1] or not set(names) <= set(free):
        found = axes or ", ".join(names) or "none"
        raise refusal(f"found {found}; accepted: two of the free parameters ({', '.join(free)})", "--axes")
    return names[0], names[1]


def options(**given: Any) -> dict[str, Any]:
    """The options that were given, for a function with defaults of its own."""
    return {name: value for name, value in given.items() if value is not None}


def nominal_of(problem: "Posed") -> "Posed":
    """A problem about one design; says so where it has scenarios or tolerances."""
    if problem.nominal is not problem:
        values = ", ".join(f"{n} = {problem.fixed[n]:.6g}" for n in problem.scenarios)
        click.echo(f"scenarios and tolerances are left aside{': ' + values if values else ''}", err=True)
    return problem.nominal


def say_nominal(problem: "Posed", varied: Iterable[str] = ()) -> None:
    """Where a design is the one for several scenarios, say which of them it is looked at in."""
    if values := ", ".join(f"{n} = {problem.fixed[n]:.6g}" for n in problem.scenarios if n not in varied):
        click.echo(f"the design for all scenarios, looked at for {values}", err=True)


def _json_text(data: Any) -> str:
    """JSON for stdout; characters that it does not take are escaped."""
    narrow = not (sys.stdout.encoding or "utf").lower().startswith("utf")
    return json.dumps(data, indent=2, ensure_ascii=narrow, allow_nan=False)


def write_json(data: dict[str, Any]) -> None:
    """Write JSON to stdout."""
    said = _json_text(data)
    with quiet():
        click.echo(said)


def write_json_rows(data: dict[str, Any], key: str, rows: Sequence[Any]) -> None:
    """The same with a long list under a key, made and written a block after the other, and counted.

    Args:
        data: with an empty list there.
        rows: that have `to_json`.
    """
    from tmsopt.progress import start_steps

    head = f'\n  "{key}": ['
    before, _, after = _json_text(data).partition(f"{head}]")
    if not rows:
        write_json(data)
        return
    steps = start_steps(None if sys.stdout.isatty() else shown(), "writing the answer", "row")
    for first in range(0, len(rows), _BLOCK):
        some = [row.to_json() for row in rows[first : first + _BLOCK]]
        text = _json_text(some)[1:-2].replace("\n", "\n  ")  # without brackets, further in
        with quiet() if sys.stdout.isatty() else nullcontext():
            click.echo(f"{',' if first else before + head}{text}", nl=False)
        if steps:
            steps(first + len(some), len(rows))
    click.echo(f"\n  ]{after}")


def answer(as_json: bool, data: Callable[[], dict[str, Any]], text: Callable[[], str]) -> None:
    """Write an answer that is in hand, as JSON or as text; a signal waits until it is written."""
    doing("writing the answer")
    with answering():
        said = _json_text(data()) if as_json else text()
        with quiet():
            click.echo(said)
