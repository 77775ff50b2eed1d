"""Bands of speeds, varied problems and conflicts: ``python -m benchmarks.design``."""

import os
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import click
from tqdm import tqdm

from benchmarks.judges.bands import band_problems, ride
from benchmarks.reports.designs.varied_designs import trials
from benchmarks.reports.designs.verdicts import band_section, conflict_section, variety_section
from benchmarks.reports.tables import keep
from benchmarks.suites.conflicts import check, conflicts
from benchmarks.suites.random_designs import SEED

_CONFLICTS = 50


@click.command()
@click.argument("parts", nargs=-1, type=click.Choice(["band", "variety", "conflicts"]))
@click.option("--count", default=200, show_default=True, help="varied problems; a quarter as many conflicts")
@click.option("--seed", default=SEED, show_default=True, help="of the problems")
@click.option("--workers", default=os.cpu_count() or 1, show_default=True, help="processes for what is not timed")
@click.option(
    "--output",
    type=click.Path(dir_okay=False, path_type=Path),
    default=Path("benchmarks/results.md"),
    show_default=True,
    help="file that keeps the tables",
)
def main(parts: tuple[str, ...], count: int, seed: int, workers: int, output: Path) -> None:
    """Run PARTS, by default all of them, print the tables and keep them."""
    for part in parts or tuple(_PARTS):
        command = f"python -m benchmarks.design {part} --count {count} --seed {seed}"
        text = _PARTS[part](count, seed, workers, command)
        click.echo(text)
        keep(output, part, text)


def _band(count: int, seed: int, workers: int, command: str) -> str:
    boxes = band_problems().items()
    return band_section([ride(name, problem) for name, problem in tqdm(boxes, desc="bands of speeds")], command)


def _variety(count: int, seed: int, workers: int, command: str) -> str:
    return variety_section(trials(count, seed, workers), command)


def _conflicts(count: int, seed: int, workers: int, command: str) -> str:
    wanted = conflicts(max(1, count // 4), seed)
    with ProcessPoolExecutor(workers) as pool:
        return conflict_section(list(tqdm(pool.map(check, wanted), desc="conflicts", total=len(wanted))), command)


_PARTS: Mapping[str, Callable[[int, int, int, str], str]] = {
    "band": _band,
    "variety": _variety,
    "conflicts": _conflicts,
}


if __name__ == "__main__":
    main()
