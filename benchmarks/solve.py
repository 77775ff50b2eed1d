"""How often, how well and how fast random constrained designs are solved: ``python -m benchmarks.solve``."""

import os
from pathlib import Path

import click

from benchmarks.reports.designs.random_designs import measure
from benchmarks.reports.tables import keep, section
from benchmarks.suites.random_designs import SEED


@click.command()
@click.option("--count", default=200, show_default=True, help="problems")
@click.option("--seed", default=SEED, show_default=True, help="of the problems")
@click.option("--de", "evolved", default=25, show_default=True, help="problems for scalar differential evolution")
@click.option("--local", default=24, show_default=True, help="problems for SLSQP, Nelder-Mead and COBYLA")
@click.option("--workers", default=os.cpu_count() or 1, show_default=True, help="processes for what is not timed")
@click.option(
    "--output",
    type=click.Path(dir_okay=False, path_type=Path),
    default=Path("benchmarks/results.md"),
    show_default=True,
    help="file that keeps the table",
)
def main(count: int, seed: int, evolved: int, local: int, workers: int, output: Path) -> None:
    """Solve a suite of random designs, compare with SciPy, print the tables and keep them."""
    command = f"python -m benchmarks.solve --count {count} --seed {seed} --de {evolved} --local {local}"
    text = section(measure(count, seed, evolved, local, workers), command)
    click.echo(text)
    keep(output, "solve", text)


if __name__ == "__main__":
    main()
