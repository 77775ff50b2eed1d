"""The front of a file with several objectives, a part of `tmsopt solve`."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tmsopt.cli.common import progress, saving, write_json

if TYPE_CHECKING:
    from tmsopt import Problem


def write_front(
    problem: "Problem", asked: dict[str, Any], as_json: bool, plot: Path | None, csv_file: Path | None, full: bool
) -> None:  # fmt: skip
    """Find the front and write it where it is asked for.

    Raises:
        NotSolved: when an objective has no optimum.
    """
    import tmsopt

    with progress("sub-problem") as update:
        front = tmsopt.pareto(problem, progress=update, **asked)
    if as_json:
        write_json(front.to_json())
    else:
        click.echo(front.report(full))
    if csv_file is not None:
        with saving("--csv", csv_file):
            front.write_csv(csv_file)
    if plot is not None:
        with saving("--plot", plot):
            tmsopt.plots.save(tmsopt.plots.front_figure(front), plot)
