"""The command that traces a root pattern."""

from pathlib import Path
from typing import Any

import click

import tmsopt
from tmsopt.cli.common import (
    answer,
    csv_option,
    file_argument,
    json_option,
    nominal_of,
    plane,
    plot_option,
    report_option,
    seed_option,
    starts_option,
    write_file,
    write_report,
)
from tmsopt.cli.terminal import shown
from tmsopt.errors import input_error

_EXAMPLES = """
\b
Examples:
  tmsopt trace problems/ep_set.toml
  tmsopt trace problems/ep_set.toml --plot ep_set.png --axes Fr,lambda_s
  tmsopt trace problems/off_law.toml --pattern weave --csv weave.csv

A curve takes one free parameter more than the pattern has conditions (EP2, weave, capsize: 1; EP3, 2EP2, CEP2: 2;
EP4, resonance: 3; EPk: k - 1, CEPk: 2k - 2; those of EP2+CEP2 add up) and == constraints add; other constraints are
marked where they are crossed. Where two parameters are free, a grid shows the branches that the starts missed, if they
are no thinner than 1/256 of the box, or 1/96 for polynomials of degree 5 and more.

Exit status: 0 traced, 2 bad input, 3 nothing of the pattern found in the box.
"""


@click.command(epilog=_EXAMPLES)
@file_argument
@click.option("--pattern", help="Pattern to trace. [default: the one that FILE locates]")
@json_option
@csv_option("Write every point of every branch.")
@plot_option("Draw the branches")
@report_option
@click.option("--axes", help="Two parameters to draw over, e.g. Fr,chi_B. [default: two that vary]")
@click.option(
    "--step",
    type=click.FloatRange(1e-6, 0.1),
    default=0.005,
    show_default=True,
    help="Longest step, in widths of the box.",
)
@starts_option("Fruitless in a row, to stop.", 48)
@seed_option
def trace(
    file: Path,
    pattern: str | None,
    as_json: bool,
    csv_file: Path | None,
    plot: Path | None,
    report: Path | None,
    axes: str | None,
    **asked: Any,
) -> None:
    """Trace a root pattern of FILE through parameter space, every branch in the box, with its events."""
    problem = nominal_of(tmsopt.load(file).posed)
    if axes is not None:
        if plot is None:
            raise input_error("says what --plot draws; add --plot FILE", "--axes")
        plane(problem, axes)
    found = tmsopt.trace(problem, pattern, progress=shown(), **asked)
    answer(as_json, found.to_json, lambda: tmsopt.report.trace_table(found))
    write_report(found, report, file, seed=asked["seed"])
    if not found.branches:
        click.echo(f"no {found.pattern} found in the box; widen it, or try more --starts", err=True)
        raise SystemExit(3)
    write_file("--csv", csv_file, found.write_csv)
    if plot is not None:
        drawn = tmsopt.plots.trace_figure(found, *plane(problem, axes or ",".join(found.varying[:2])))
        write_file("--plot", plot, lambda path: tmsopt.plots.save(drawn, path))
