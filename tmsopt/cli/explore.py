"""The command that writes a page on which a problem can be played with."""

import webbrowser
from pathlib import Path

import click

from tmsopt.cli.common import bad_input, check_output, options, saving
from tmsopt.cli.ending import answering
from tmsopt.cli.terminal import shown
from tmsopt.errors import MOST_STARTS

_EXAMPLES = """
\b
Examples:
  tmsopt explore problems/ep4.toml
  tmsopt explore problems/delivery_robot.toml --output robot.html --open
  tmsopt explore problems/pt_pair.toml

The page has sliders for every parameter, the stability chart, the roots and their path, growth rates and frequencies,
the bicycle in motion, and every limit with its margin. It is one file that asks nothing of any server: mail it, put it
beside a paper. What it shows can be saved as a problem file, which tmsopt solve takes, or as a link.

FILE is solved first if it asks something; of a front the first objective is minimised.

Exit status: 0 done, whatever the search found, 2 bad input.
"""


@click.command(epilog=_EXAMPLES)
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--output", "-o", type=click.Path(path_type=Path), help="The page to write. [default: FILE's name, ending in html]"
)
@click.option("--open", "opened", is_flag=True, help="Show it in the browser.")
@click.option("--starts", type=click.IntRange(1, MOST_STARTS), default=None, help="Tried at most. [default: 64]")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the starts.")
def explore(file: Path, output: Path | None, opened: bool, starts: int | None, seed: int) -> None:
    """Write one page that shows why a design of FILE is stable: sliders, chart, roots, growth, motion."""
    with bad_input():
        import tmsopt

        path = Path(f"{file.stem}.html") if output is None else output
        check_output("--output", path, ("html", "htm"))
        page = tmsopt.explore(file, progress=shown(), **options(starts=starts, seed=seed))
    with answering(), saving("--output", path):
        page.save(path)
    solution = page.solution
    if solution is not None and solution.status != "optimal":
        click.echo(f"{solution.status.replace('_', ' ')}: the page opens with the nearest that was found", err=True)
    if opened and not webbrowser.open(path.resolve().as_uri()):
        click.echo(f"no browser was found here; open {path} in one", err=True)
