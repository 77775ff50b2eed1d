"""Random designs proved globally best, and what each idea does for it: ``python -m benchmarks.certificates``."""

from pathlib import Path

import click

from benchmarks.reports.designs.certificates import prove_suite, proved_section
from benchmarks.reports.designs.ladder import ladder as climb_ladder
from benchmarks.reports.designs.ladder import ladder_section
from benchmarks.reports.tables import keep, kept
from benchmarks.suites.random_designs import SEED


@click.group()
def main() -> None:
    """Global bounds on the random designs of the solve benchmark."""


@main.command()
@click.option("--count", default=200, show_default=True, help="problems")
@click.option("--seconds", default=60.0, show_default=True, help="for each proof")
@kept
def suite(count: int, seconds: float, output: Path) -> None:
    """Prove each random design best, or each infeasible problem infeasible, and judge the bounds by the references."""
    command = f"python -m benchmarks.certificates suite --count {count} --seconds {seconds:g}"
    text = proved_section(prove_suite(count, SEED, seconds), command)
    click.echo(text)
    keep(output, "certificates", text)


@main.command()
@click.option("--seconds", default=10.0, show_default=True, help="for each proof")
@click.option("--workers", default=2, show_default=True, help="processes")
@kept
def ladder(seconds: float, workers: int, output: Path) -> None:
    """Start from the plain model for SCIP and add one idea after the other."""
    command = f"python -m benchmarks.certificates ladder --seconds {seconds:g}"
    text = ladder_section(climb_ladder(seconds, workers), seconds, command)
    click.echo(text)
    keep(output, "ladder", text)


if __name__ == "__main__":
    main()
