"""The sections of ``python -m benchmarks``: which there are, and how a failure costs only its section.

A section is a module with ``report(asked) -> str``, in Markdown.
"""

import os
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, cast

import click

from benchmarks import leave_out
from benchmarks.reports.tables import RESULTS, Asked, keep


@dataclass(frozen=True)
class Section:
    """A part of the benchmark: a letter and a name to call it by, and where it is.

    Attributes:
        long: run only when it is named.
    """

    letter: str
    name: str
    module: str
    about: str
    long: bool = False

    def report(self) -> Callable[[Asked], str]:
        """What makes its report."""
        return cast(Callable[[Asked], str], import_module(self.module).report)


_DESIGNS, _SYSTEMS, _SPEED = (f"benchmarks.reports.{room}" for room in ("designs", "systems", "speed"))

SECTIONS = (
    Section("a", "solving", f"{_DESIGNS}.solving", "solving at equal accuracy, beside SciPy, CMA-ES and PyGRANSO"),
    Section("b", "charts", f"{_SPEED}.charts", "charts, beside stacked eigvals, numpy.roots and copying memory"),
    Section("b", "kernels", f"{_SPEED}.kernels", "roots and classes of many quartics, beside stacked eigvals"),
    Section("c", "studies", f"{_SPEED}.studies", "studies, beside bare solves in a loop, over cores and Dask workers"),
    Section("d", "trace", f"{_SPEED}.tracing", "tracing, beside scipy.optimize.root and a contour"),
    Section("e", "startup", f"{_SPEED}.startup", "start-up and import times, beside Python, NumPy and CasADi"),
    Section("e", "hostile", f"{_SPEED}.hostile", "how long hostile files are read, and in how much memory"),
    Section("e", "explorer", f"{_SPEED}.explorer", "pages of the explorer: size, writing, drawing in Chromium"),
    Section("e", "beside", f"{_SPEED}.beside", "time of a solve, beside an earlier checkout", long=True),
    Section("f", "growth", f"{_SPEED}.growth", "growth with free parameters and scenarios"),
    Section("h", "tiles", f"{_SPEED}.folders", "charts to a folder; 1e8 designs in bounded memory"),
    Section("i", "systems", f"{_SYSTEMS}.sixfold", "a 6-fold root from random starts, beside HANSO and PyGRANSO"),
    Section("j", "random", f"{_SYSTEMS}.random_systems", "random systems of degree 3 to 12, beside evolution"),
    Section("j", "designs", f"{_SYSTEMS}.all_designs", "all designs with a pattern, proved, beside a search"),
    Section("j", "beyond", f"{_SYSTEMS}.feedback", "a controller, beside python-control and SciPy"),
    Section("k", "solve", f"{_DESIGNS}.random_designs", "200 random designs, beside SciPy", long=True),
    Section("l", "variety", f"{_DESIGNS}.varied_designs", "varied problems, judged by eigenvalues", long=True),
    Section("m", "band", f"{_DESIGNS}.bands", "bands of speeds, proved between the scenarios", long=True),
    Section("n", "conflicts", f"{_DESIGNS}.conflicts", "relaxations of infeasible problems", long=True),
    Section("n", "remedies", f"{_DESIGNS}.remedies", "what is advised for infeasible problems, obeyed", long=True),
    Section("o", "certificates", f"{_DESIGNS}.certificates", "random designs proved globally best", long=True),
    Section("p", "proofs", "benchmarks.reports.proofs", "exceptional points of the paper, proved", long=True),
    Section("p", "rescues", f"{_DESIGNS}.rescues", "problems that need each rescue of the search", long=True),
    Section("p", "matrices", f"{_SYSTEMS}.matrices", "exceptional points of 70 matrices of size 2 to 100", long=True),
    Section("p", "pencils", f"{_SYSTEMS}.random_matrices", "random pencils and diabolic points", long=True),
    Section("q", "references", f"{_DESIGNS}.references", "the best values of the random designs, kept", long=True),
    Section("r", "known", f"{_SYSTEMS}.known", "the best values of the random systems, kept", long=True),
    Section("s", "hard", f"{_DESIGNS}.hard_designs", "hard problems: is optimal the best known", long=True),
    Section("s", "narrow", f"{_DESIGNS}.narrow_optima", "narrow basins and plateaus: is optimal the best", long=True),
    Section("t", "targets", f"{_DESIGNS}.hard_references", "the best values of the hard problems, kept", long=True),
    Section("u", "statements", "benchmarks.reports.statements", "statements that a closed form can refute", long=True),
    Section("v", "fresh", "benchmarks.reports.fresh", "fresh random problems, judged independently", long=True),
)
"""In the order in which they are run."""


def run(section: Section, asked: Asked) -> tuple[str, bool]:
    """The report of a section, and whether it failed; whatever it raises becomes its report."""
    load, began = _load(), time.perf_counter()
    try:
        text, failed = section.report()(asked), False
    except ModuleNotFoundError as error:
        text, failed = _refused(section, f"not installed: {error.name}"), True
    except Exception as error:
        traceback.print_exc()
        text, failed = _refused(section, f"failed: {type(error).__name__}: {error}"), True
    took = f"Took {time.perf_counter() - began:.0f} s; load average before {load}, after {_load()}."
    return f"{text.rstrip()}\n\n{took}\n", failed


def _refused(section: Section, why: str) -> str:
    return f"## {section.name.capitalize()}\n\n| {section.about} |\n| --- |\n| {why} |\n"


def _load() -> str:
    return f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"


def chosen(only: str, sections: Sequence[Section]) -> list[Section]:
    """Sections by letters or names, separated by commas; for an empty text all that are not long.

    Raises:
        click.BadParameter: for a word that is neither.
    """
    words = [word.strip() for word in only.split(",") if word.strip()]
    for word in words:
        if not any(word in (s.letter, s.name) for s in sections):
            known = ", ".join(f"{s.letter} or {s.name}" for s in sections)
            raise click.BadParameter(f"found {word!r}; accepted: {known}", param_hint="--only")
    return [s for s in sections if (not words and not s.long) or s.letter in words or s.name in words]


@click.command(
    epilog="""\b
Examples:
  python -m benchmarks                     all sections but the long ones, about 25 minutes
  python -m benchmarks --quick             small sizes, a few minutes, kept nowhere
  python -m benchmarks --only a,growth     two of them
  python -m benchmarks --only solve        a long one: 200 random designs beside SciPy
  python -m benchmarks --only hard --without aside
  python -m benchmarks --output mine.md    kept in another file

Every ratio compares times of the same run. Other load on the machine spoils them: each section says how much there was.
"""
)
@click.option("--only", default="", metavar="LIST", help="letters or names of sections, separated by commas")
@click.option("--quick", is_flag=True, help="small sizes, to see that everything runs")
@click.option("--list", "listed", is_flag=True, help="name the sections and stop")
@click.option("--count", type=click.IntRange(1), default=None, help="problems, systems or rows of a section")
@click.option("--seconds", type=float, default=None, help="limit for each problem: solving, certificates")
@click.option("--seed", default=Asked.seed, show_default=True, help="of random problems")
@click.option("--workers", default=Asked.workers, show_default=True, help="processes for what is not timed")
@click.option("--without", default="", metavar="NAME", help="a rescue of the search to do without; kept nowhere")
@click.option(
    "--output",
    type=click.Path(dir_okay=False, path_type=Path),
    help=f"file that keeps the tables; by default {RESULTS}, and with --quick none",
)
def main(only: str, listed: bool, without: str, output: Path | None, **sizes: Any) -> None:
    """Measure tmsopt beside what one would use without it, print the tables and keep them.

    Sections that fail say so and the others go on; the exit status is then 1.
    """
    sections = chosen(only, SECTIONS)
    if listed:
        shown = sections if only else SECTIONS
        click.echo("\n".join(f"{s.letter}  {s.name:12}  {s.about}{', when named' * s.long}" for s in shown))
        return
    if without:
        try:
            leave_out(without)
        except KeyError as error:
            message = f"found {without!r}; accepted: {error.args[0]}"
            raise click.BadParameter(message, param_hint="--without") from error
    path = output or (None if sizes["quick"] or without else RESULTS)
    failed = []
    for section in sections:
        click.echo(f"{section.letter}  {section.name}: {section.about}", err=True)
        text, bad = run(section, Asked(section.name, **{n: v for n, v in sizes.items() if v is not None}))
        click.echo(text)
        if path:
            keep(path, section.name, text)
        failed += [section.name] if bad else []
    if failed:
        raise SystemExit(f"not measured: {', '.join(failed)}")
