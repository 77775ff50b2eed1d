"""Command that draws the figures of the paper."""

from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tmsopt.cli.common import FIGURES, PATH, check_output, saving, write_json
from tmsopt.cli.terminal import shown
from tmsopt.errors import input_error
from tmsopt.progress import start_steps

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
    "--output",
    type=PATH,
    help="File to write, or with 'all' a directory. [default: NAME.png in the current directory]",
)
@click.option(
    "--format",
    "ending",
    type=click.Choice(FIGURES),
    help="Kind of file. [default: the ending of --output, else png]",
)
@click.option("--json", "as_json", is_flag=True, help="Write names, captions and files as JSON to stdout.")
@click.option("--list", "as_list", is_flag=True, help="List the figures and draw nothing.")
def figure(name: str | None, output: Path | None, ending: str | None, as_json: bool, as_list: bool) -> None:
    """Draw the figure NAME, or all of them.

    NAME is one of those that --list shows, or its label in the paper, such as fig3.
    """
    from tmsopt.plots.paper import GALLERY, find

    if not (name or as_list):  # no label of the paper is empty either
        raise input_error(f"missing; accepted: {' '.join(GALLERY)} all", "NAME")
    every = as_list or name == "all"
    items = list(GALLERY.values()) if every else [find(str(name))]
    data = [{"name": item.name, "alias": item.alias, "caption": item.caption} for item in items]
    if not as_list:
        files = _files([item.name for item in items], every, output, ending)
        _draw(items, files)
        data = [{**one, "file": str(path)} for one, path in zip(data, files, strict=True)]
    if as_json:
        write_json({"schema": 1, "figures": data})
    elif as_list:
        for item in items:
            click.echo(f"{item.name} ({item.alias})" if item.alias else item.name)
            click.echo(click.wrap_text(item.caption, 100, "    ", "    "))


def _files(names: list[str], every: bool, output: Path | None, ending: str | None) -> list[Path]:
    """The files to write, refused before anything is drawn if one could not be."""
    if every:
        folder = output or Path()
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise input_error(f"'{folder}' cannot be a directory: {error.strerror}", "--output") from None
        files = [folder / f"{name}.{ending or 'png'}" for name in names]
    else:
        files = [output or Path(f"{names[0]}.{ending or 'png'}")]
    for path in files:
        check_output("--output", path, FIGURES if ending is None else (ending,))
    return files


def _draw(wanted: "list[Item]", files: list[Path]) -> None:
    from tmsopt.files import write_atomic
    from tmsopt.plots.paper import pictures

    steps = start_steps(shown(), "drawing", "figure")
    with closing(pictures(wanted, [path.suffix[1:].lower() for path in files])) as drawn:
        for done, (k, picture) in enumerate(drawn, start=1):
            with saving("--output", files[k]), write_atomic(files[k]) as temporary:
                temporary.write_bytes(picture)
            if steps:
                steps(done, len(wanted), wanted[k].name)
