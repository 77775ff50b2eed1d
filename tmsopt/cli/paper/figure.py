"""Command that draws the figures of the paper."""

import sys
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tmsopt.cli.common import FIGURES, bad_input, check_output, write_json
from tmsopt.cli.ending import BAD_INPUT
from tmsopt.cli.terminal import shown
from tmsopt.progress import counted

if TYPE_CHECKING:
    from tmsopt.plots.paper import Item

_EXAMPLES = """
\b
Examples:
  tmsopt figure --list
  tmsopt figure root-locus
  tmsopt figure fig3 --output locus.pdf
  tmsopt figure all --output figures --format svg

'all' takes ten seconds or so.

Exit status: 0 drawn, 2 bad input.
"""


@click.command(epilog=_EXAMPLES)
@click.argument("name", required=False)
@click.option(
    "--output", type=click.Path(path_type=Path),
    help="File to write, or with 'all' a directory. [default: NAME.png in the current directory]",
)  # fmt: skip
@click.option(
    "--format", "ending", type=click.Choice(FIGURES), default=None,
    help="Kind of file. [default: the ending of --output, else png]",
)  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="Write names, captions and files as JSON to stdout.")
@click.option("--list", "as_list", is_flag=True, help="List the figures and draw nothing.")
def figure(name: str | None, output: Path | None, ending: str | None, as_json: bool, as_list: bool) -> None:
    """Draw the figure NAME, or all of them.

    NAME is one of those that --list shows, or its label in the paper, such as fig3.
    """
    from tmsopt.plots.paper import GALLERY

    if as_list:
        _write_list(list(GALLERY.values()), as_json)
        return
    with bad_input():
        wanted = _wanted(name)
        files = _files(wanted, name == "all", output, ending)
    _draw(wanted, files)
    if as_json:
        written = zip(wanted, files, strict=True)
        write_json({"schema": 1, "figures": [{**_described(item), "file": str(path)} for item, path in written]})


def _wanted(name: str | None) -> "list[Item]":
    from tmsopt import Fault, InputError
    from tmsopt.plots.paper import GALLERY, find

    if not name:  # no label of the paper is one either
        raise InputError([Fault(f"missing; accepted: {' '.join(GALLERY)} all", ("NAME",))])
    return list(GALLERY.values()) if name == "all" else [find(name)]


def _files(wanted: "list[Item]", every: bool, output: Path | None, ending: str | None) -> list[Path]:
    """The files to write, refused before anything is drawn if one could not be."""
    from tmsopt import Fault, InputError

    if every:
        folder = output or Path()
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError([Fault(f"'{folder}' cannot be a directory: {error.strerror}", ("--output",))]) from None
        files = [folder / f"{item.name}.{ending or 'png'}" for item in wanted]
    else:
        files = [output or Path(f"{wanted[0].name}.{ending or 'png'}")]
    for path in files:
        check_output("--output", path, FIGURES if ending is None else (ending,))
    return files


def _draw(wanted: "list[Item]", files: list[Path]) -> None:
    from tmsopt.disk import whole
    from tmsopt.plots.paper import pictures

    steps = counted(shown(), "drawing", "figure")
    with closing(pictures(wanted, [path.suffix[1:].lower() for path in files])) as drawn:
        for done, (k, picture) in enumerate(drawn, start=1):
            if steps:
                steps(done, len(wanted), wanted[k].name)
            try:
                with whole(files[k]) as temporary:
                    temporary.write_bytes(picture)
            except OSError as error:
                click.echo(f"--output: '{files[k]}' cannot be written: {error.strerror or error}", err=True)
                sys.exit(BAD_INPUT)
    for path in files:
        click.echo(f"wrote {path}", err=True)


def _described(item: "Item") -> dict[str, str]:
    return {"name": item.name, "alias": item.alias, "caption": item.caption}


def _write_list(items: "list[Item]", as_json: bool) -> None:
    if as_json:
        write_json({"schema": 1, "figures": [_described(item) for item in items]})
        return
    for item in items:
        click.echo(f"{item.name} ({item.alias})" if item.alias else item.name)
        click.echo(click.wrap_text(item.caption, 100, "    ", "    "))
