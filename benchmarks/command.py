"""The sections of ``python -m benchmarks``: which there are, and how a failure costs only its section.

A section is a module with ``section(command, quick) -> str``, the report in Markdown.
"""

import os
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import cast

import click

from benchmarks.reports.tables import keep

Report = Callable[[str, bool], str]


@dataclass(frozen=True)
class Section:
    """A part of the benchmark: a letter and a name to call it by, and where it is."""

    letter: str
    name: str
    module: str
    about: str

    def report(self) -> Report:
        """Its report: (command, quick) → Markdown."""
        return cast(Report, import_module(self.module).section)


SECTIONS = (
    Section(
        "a",
        "solving",
        "benchmarks.reports.designs.solving",
        "solving at equal accuracy, beside SciPy, CMA-ES and PyGRANSO",
    ),
    Section(
        "b",
        "charts",
        "benchmarks.reports.speed.charts",
        "charts, beside stacked eigvals, numpy.roots and copying memory",
    ),
    Section(
        "b", "kernels", "benchmarks.reports.speed.kernels", "roots and classes of many quartics, beside stacked eigvals"
    ),
    Section(
        "c",
        "studies",
        "benchmarks.reports.speed.studies",
        "studies, beside bare solves in a loop, over cores and Dask workers",
    ),
    Section("d", "trace", "benchmarks.reports.speed.tracing", "tracing, beside scipy.optimize.root and a contour"),
    Section(
        "e", "startup", "benchmarks.reports.speed.startup", "start-up and import times, beside Python, NumPy and CasADi"
    ),
    Section("f", "growth", "benchmarks.reports.speed.growth", "growth with free parameters, scenarios and grid points"),
    Section(
        "g",
        "arrays",
        "benchmarks.reports.speed.arrays",
        "expressions over grids, beside one design at a time and CasADi's map",
    ),
    Section(
        "h",
        "tiles",
        "benchmarks.reports.speed.folders",
        "charts to a folder and their parts; 1e8 designs in bounded memory",
    ),
    Section(
        "i",
        "systems",
        "benchmarks.reports.systems.sixfold",
        "a 6-fold root from random starts, beside HANSO and PyGRANSO",
    ),
    Section(
        "j",
        "random",
        "benchmarks.reports.systems.random_systems",
        "random systems of degree 3 to 12, beside differential evolution",
    ),
)
"""In the order in which they are run."""


@dataclass(frozen=True)
class Outcome:
    """What a section ended with: its report, or a report that says why there is none."""

    section: Section
    text: str
    failed: bool


def run(section: Section, command: str, quick: bool) -> Outcome:
    """One section; whatever it raises becomes its report."""
    load, began = _load(), time.perf_counter()
    try:
        text, failed = section.report()(command, quick), False
    except ModuleNotFoundError as error:
        text, failed = _refused(section, f"not installed: {error.name}"), True
    except Exception as error:
        traceback.print_exc()
        text, failed = _refused(section, f"failed: {type(error).__name__}: {error}"), True
    took = f"Took {time.perf_counter() - began:.0f} s; load average before {load}, after {_load()}."
    return Outcome(section, f"{text.rstrip()}\n\n{took}\n", failed)


def _refused(section: Section, why: str) -> str:
    return f"## {section.name.capitalize()}\n\n| {section.about} |\n| --- |\n| {why} |\n"


def _load() -> str:
    return f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"


def chosen(only: str, sections: Sequence[Section]) -> list[Section]:
    """Sections by letters or names, separated by commas; all of them for an empty text.

    Raises:
        click.BadParameter: for a word that is neither.
    """
    words = [word.strip() for word in only.split(",") if word.strip()]
    for word in words:
        if not any(word in (s.letter, s.name) for s in sections):
            known = ", ".join(f"{s.letter} or {s.name}" for s in sections)
            raise click.BadParameter(f"found {word!r}; accepted: {known}", param_hint="--only")
    return [s for s in sections if not words or s.letter in words or s.name in words]


@click.command(
    epilog="""\b
Examples:
  python -m benchmarks                     all sections, about 25 minutes
  python -m benchmarks --quick             small sizes, a few minutes, kept nowhere
  python -m benchmarks --only a,growth     two of them
  python -m benchmarks --output mine.md    kept in another file

\b
Longer ones have commands of their own:
  python -m benchmarks.solve               200 random designs beside SciPy
  python -m benchmarks.design              bands of speeds, varied problems, conflicts
  python -m benchmarks.certificates        designs proved globally best
  python -m benchmarks.proofs              exceptional points of the paper, proved

Every ratio compares times of the same run. Other load on the machine spoils them: each section says how much there was.
"""
)
@click.option("--only", default="", metavar="LIST", help="letters or names of sections, separated by commas")
@click.option("--quick", is_flag=True, help="small sizes, to see that everything runs")
@click.option("--list", "listed", is_flag=True, help="name the sections and stop")
@click.option(
    "--output",
    type=click.Path(dir_okay=False, path_type=Path),
    help="file that keeps the tables; by default benchmarks/results.md, and with --quick none",
)
def main(only: str, quick: bool, listed: bool, output: Path | None) -> None:
    """Measure tmsopt beside what one would use without it, print the tables and keep them.

    Sections that fail say so and the others go on; the exit status is then 1.
    """
    sections = chosen(only, SECTIONS)
    if listed:
        click.echo("\n".join(f"{s.letter}  {s.name:8}  {s.about}" for s in sections))
        return
    path = output or (None if quick else Path("benchmarks/results.md"))
    failed = []
    for section in sections:
        click.echo(f"{section.letter}  {section.name}: {section.about}", err=True)
        command = f"python -m benchmarks --only {section.name}{' --quick' if quick else ''}"
        outcome = run(section, command, quick)
        click.echo(outcome.text)
        if path:
            keep(path, section.name, outcome.text)
        failed += [section.name] if outcome.failed else []
    if failed:
        raise SystemExit(f"not measured: {', '.join(failed)}")
