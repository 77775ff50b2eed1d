"""`tmsopt explore`: a page in which the reader moves the parameters."""

import webbrowser
from pathlib import Path

import click

import tmsopt
from tmsopt.cli.command import OnFile, WithSearch, option
from tmsopt.cli.ending import hold_signals
from tmsopt.cli.outputs import PAGES, check_output, report_writing


class ExploreCommand(WithSearch, OnFile):
    """Write a page for a browser: sliders, chart, roots, growth rates, the bicycle in motion.

    Examples:
      tmsopt explore problems/ep4.toml
      tmsopt explore problems/delivery_robot.toml --output robot.html --open

    Exit status: 0 done, whatever the search found, 2 bad input.
    """

    output: Path | None = option("The page.  [default: FILE's name, .html]", None, "-o")
    open: bool = option("Show it in the browser.")

    def run(self) -> None:
        path = self.output or Path(f"{self.file.stem}.html")
        check_output("--output", path, PAGES)
        page = tmsopt.explore(self.file, **self.search)
        with hold_signals(), report_writing("--output", path):
            page.save(path)
        solution = page.solution
        if solution is not None and solution.status != "optimal":
            status = solution.status.replace("_", " ")
            click.echo(f"{status}: the page opens with the nearest that was found", err=True)
        if self.open and not webbrowser.open(path.resolve().as_uri()):
            click.echo(f"no browser was found here; open {path} in one", err=True)
