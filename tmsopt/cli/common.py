"""What commands share: exit status, bad input, progress, files to write."""

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

DONE, BAD_INPUT, INFEASIBLE, NOT_CONVERGED = 0, 2, 3, 4
"""Exit status."""

FIGURES = ("png", "pdf", "svg")
"""Endings of figure files."""


@contextmanager
def bad_input() -> Iterator[None]:
    """Turn bad input into its messages on stderr and exit status 2."""
    from tmsopt.design.errors import InputError

    try:
        yield
    except InputError as error:
        click.echo(str(error), err=True)
        sys.exit(BAD_INPUT)


@contextmanager
def progress(what: str = "start") -> Iterator[Callable[[int, int], None]]:
    """A progress bar on stderr, shown on a terminal when the work takes longer than a second."""
    from tqdm import tqdm

    with tqdm(desc=f"{what}s", unit=what, delay=1, disable=None, leave=False, file=sys.stderr) as bar:

        def update(done: int, most: int) -> None:
            bar.total = most
            bar.update(done - bar.n)

        yield update


def check_output(option: str, path: Path | None, endings: Sequence[str]) -> None:
    """Refuse a file that could not be written, before any work is done."""
    if path is None:
        return
    from tmsopt.design.errors import Fault, InputError

    if path.suffix.lstrip(".").lower() not in endings:
        raise InputError([Fault(f"found '{path}'; accepted: a file name ending in {', '.join(endings)}", (option,))])
    if path.is_dir() or not path.parent.is_dir():
        problem = "is a directory" if path.is_dir() else "is in a directory that does not exist"
        raise InputError([Fault(f"'{path}' {problem}; give the path of a file to write", (option,))])


def write_json(data: dict[str, Any]) -> None:
    click.echo(json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False))
