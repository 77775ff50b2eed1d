"""The command that traces a root pattern."""

from pathlib import Path

import click

from tmsopt.cli.common import (
    FIGURES,
    REPORTS,
    answer,
    bad_input,
    check_output,
    nominal_of,
    plane,
    report_option,
    saving,
    write_report,
)
from tmsopt.cli.terminal import shown
from tmsopt.errors import MOST_STARTS

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
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--pattern", help="Pattern to trace. [default: the one that FILE locates]")
@click.option("--json", "as_json", is_flag=True, help="Write JSON to stdout instead of a table.")
@click.option("--csv", "csv_file", type=click.Path(path_type=Path), help="Write every point of every branch.")
@click.option("--plot", type=click.Path(path_type=Path), help="Draw the branches (png, pdf, svg).")
@report_option
@click.option("--axes", help="Two parameters to draw over, e.g. Fr,chi_B. [default: two that vary]")
@click.option(
    "--step", type=click.FloatRange(min=1e-6, max=0.1), default=0.005, show_default=True,
    help="Longest step, in widths of the box.",
)  # fmt: skip
@click.option(
    "--starts", type=click.IntRange(1, MOST_STARTS), default=48, show_default=True, help="Fruitless in a row, to stop."
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the starts.")
def trace(
    file: Path, pattern: str | None, as_json: bool, csv_file: Path | None, plot: Path | None,
    report: Path | None, axes: str | None, step: float, starts: int, seed: int,
) -> None:  # fmt: skip
    """Trace a root pattern of FILE through parameter space, every branch in the box, with its events."""
    with bad_input():
        import tmsopt

        check_output("--plot", plot, FIGURES)
        check_output("--csv", csv_file, ("csv",))
        check_output("--report", report, REPORTS)
        problem = nominal_of(tmsopt.load(file))
        if plot is None and axes is not None:
            raise tmsopt.InputError([tmsopt.Fault("says what --plot draws; add --plot FILE", ("--axes",))])
        if axes is not None:
            plane(problem, axes)
        found = tmsopt.trace(problem, pattern, step=step, starts=starts, seed=seed, progress=shown())
    answer(as_json, found.to_json, lambda: tmsopt.report.trace_table(found))
    write_report(found, report, file, seed=seed)
    if not found.branches:
        click.echo(f"no {found.pattern} found in the box; widen it, or try more --starts", err=True)
        raise SystemExit(3)
    if csv_file is not None:
        with saving("--csv", csv_file):
            found.write_csv(csv_file)
    if plot is not None:
        with saving("--plot", plot):
            drawn = plane(problem, axes or ",".join(found.varying[:2]))
            tmsopt.plots.save(tmsopt.plots.trace_figure(found, *drawn), plot)
