"""The command that writes a page on which a problem can be played with."""

import webbrowser
from pathlib import Path

import click

import tmsopt
from tmsopt.cli.common import PATH, REPORTS, check_output, file_argument, options, saving, seed_option, starts_option
from tmsopt.cli.ending import answering
from tmsopt.cli.terminal import shown

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
@file_argument
@click.option("--output", "-o", type=PATH, help="The page to write. [default: FILE's name, ending in html]")
@click.option("--open", "opened", is_flag=True, help="Show it in the browser.")
@starts_option("Tried at most. [default: 64]")
@seed_option
def explore(file: Path, output: Path | None, opened: bool, starts: int | None, seed: int) -> None:
    """Write one page that shows why a design of FILE is stable: sliders, chart, roots, growth, motion."""
    path = output or Path(f"{file.stem}.html")
    check_output("--output", path, REPORTS)
    page = tmsopt.explore(file, progress=shown(), **options(starts=starts, seed=seed))
    with answering(), saving("--output", path):
        page.save(path)
    solution = page.solution
    if solution is not None and solution.status != "optimal":
        click.echo(f"{solution.status.replace('_', ' ')}: the page opens with the nearest that was found", err=True)
    if opened and not webbrowser.open(path.resolve().as_uri()):
        click.echo(f"no browser was found here; open {path} in one", err=True)
