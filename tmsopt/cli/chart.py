"""The command that charts stability over a plane or a space of parameters."""

import math
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tmsopt.cli.common import (
    answer,
    check_output,
    file_argument,
    json_option,
    nominal_of,
    number,
    plane,
    plot_option,
    report_option,
    saving,
    write_report,
)
from tmsopt.cli.ending import INTERRUPTED
from tmsopt.cli.terminal import shown
from tmsopt.deprecated import no_longer_needed
from tmsopt.errors import input_error, suggest

if TYPE_CHECKING:
    from tmsopt.charts import Chart
    from tmsopt.problem import Posed

_EXAMPLES = """
\b
Examples:
  tmsopt chart problems/chart.toml --plot chart.png
  tmsopt chart problems/chart.toml --points 1000x800 --output chart.npz
  tmsopt chart problems/chart.toml --axes lambda_s,Fr --layer abscissa --plot abscissa.pdf
  tmsopt chart problems/chart.toml --points 10000x10000 --output big.chart --workers 2
  tmsopt chart problems/ep_set.toml --points 400x300x50 --output space.chart --quantity "excess=Fr - Fr_c"

FILE frees two or three parameters; it needs no [objective]. --output holds the axes under their names and the arrays
kind (0 undefined, 1 capsize, 2 weave, 3 stable, 4 heavily damped), abscissa, damping_ratio, real_roots and satisfied
(every constraint holds), and the quantities. A name ending in npz is a NumPy archive, in nc netCDF; both are made in
memory. A name ending in chart is a folder of NumPy files for up to 1e9 designs: it is written in tiles, and the same
command goes on where an earlier one was ended.

Exit status: 0 done, 2 bad input.
"""

_LAYERS = ("kind", "abscissa", "damping_ratio", "real_roots", "satisfied", "margin")
_SHOWN = (800, 600)
"""Points of a large chart that a figure shows."""


def _points(_context: click.Context, _option: click.Parameter, value: str | None) -> tuple[int, ...] | None:
    if value is None:
        return None
    found = re.fullmatch(r"\d{1,7}(?:[x×]\d{1,7}){0,2}", value)
    if found is None or min(sizes := tuple(map(int, re.split("[x×]", value)))) < 2:
        message = f"found {value!r}; accepted: a number from 2 to 1000000, or two or three as in 400x300"
        raise click.BadParameter(message)
    return sizes


def _named(_context: click.Context, _option: click.Parameter, values: tuple[str, ...]) -> dict[str, str]:
    parts = {v.partition("=")[0].strip(): v.partition("=")[2].strip() for v in values}
    if len(parts) < len(values) or not all(n and t for n, t in parts.items()):
        raise click.BadParameter(f"found {', '.join(values)!r}; accepted: NAME=EXPRESSION, each name once")
    return parts


@click.command(epilog=_EXAMPLES)
@file_argument
@click.option(
    "--points", callback=_points, metavar="N[xM[xL]]", help="Grid points along the axes. [default: 400x300, 120x100x80]"
)
@click.option("--axes", help="Parameters, the horizontal one first, e.g. Fr,lambda_s. [default: as in FILE]")
@json_option
@click.option("--output", "-o", type=click.Path(path_type=Path), help="Write the arrays (npz, nc, chart).")
@click.option("--layers", help=f"Arrays of --output, among {','.join(_LAYERS)}. [default: all but margin]")
@click.option(
    "--quantity",
    "quantities",
    multiple=True,
    callback=_named,
    metavar="NAME=EXPRESSION",
    help="Also compute an expression; may be given several times.",
)
@click.option("--single", is_flag=True, help="Write numbers in single precision.")
@click.option("--fresh", is_flag=True, help="Move a folder of --output aside instead of going on with it.")
@click.option("--engine", hidden=True)
@click.option("--workers", type=click.IntRange(1, 256), default=1, show_default=True, help="Processes.")
@plot_option("Draw the chart")
@report_option
@click.option(
    "--layer",
    default="kind",
    show_default=True,
    help="What --plot shows: kind, abscissa, damping_ratio, real_roots or a quantity.",
)
@click.option(
    "--slice",
    "cut",
    callback=lambda c, o, v: _named(c, o, (v,)) if v else {},
    metavar="NAME=VALUE",
    help="Of three parameters, the one that --plot holds, e.g. lambda_s=0.4.",
)
@click.option("--boundaries/--no-boundaries", default=True, show_default=True, help="Trace the exact boundary curves.")
def chart(
    file: Path,
    points: tuple[int, ...] | None,
    axes: str | None,
    as_json: bool,
    output: Path | None,
    layers: str | None,
    quantities: dict[str, str],
    single: bool,
    fresh: bool,
    engine: str | None,
    workers: int,
    plot: Path | None,
    report: Path | None,
    layer: str,
    cut: dict[str, str],
    boundaries: bool,
) -> None:
    """Chart stability over the free parameters of FILE: capsize, weave, stable, heavily damped."""
    if engine is not None:
        click.echo(no_longer_needed("--engine"), err=True)
    with _stopped(output):
        import tmsopt
        from tmsopt.charts import USUAL, axes_of

        check_output("--output", output, ("npz", "nc", "chart"), folders=("chart",))
        problem = nominal_of(tmsopt.load(file).posed)
        free = axes_of(problem)
        names = plane(problem, axes) if len(free) == 2 else _space(free, axes)
        kept = tuple(n.strip() for n in layers.split(",")) if layers is not None else USUAL
        folder = output if output is not None and output.suffix.lower() == ".chart" else None
        whole = folder is None and len(free) == 2  # in memory, and shown with all its layers and boundaries
        _check_plot(plot, layer, (*_LAYERS[:4], *quantities), len(free), cut)
        held = _held(problem, cut)
        how: dict[str, Any] = {"quantities": quantities, "single": single}
        sizes = _sizes(points, len(free))
        if folder is None:
            _check_memory(sizes, output)
        with _moved_aside(folder):
            found = tmsopt.chart(
                problem,
                names,
                folder=folder,
                points=sizes,
                layers=(*_LAYERS, *kept) if whole else kept,
                **how,
                workers=workers,
                fresh=fresh,
                boundaries=boundaries and whole,
                progress=shown(),
            )
        if output is not None and folder is None:
            with saving("--output", output):
                found.save(output, (*dict.fromkeys(kept), *quantities))
    answer(as_json, found.to_json, lambda: tmsopt.report.chart_table(found))
    if folder is not None:
        click.echo(f"wrote {folder}", err=True)
    if plot is not None:
        how |= {"boundaries": boundaries, "progress": shown()}
        drawn = found if whole else tmsopt.chart(**_shown(found, held), **how)
        with saving("--plot", plot):
            tmsopt.plots.save(tmsopt.plots.chart_figure(drawn, layer), plot)
    write_report(found, report, file)


@contextmanager
def _stopped(output: Path | None) -> Iterator[None]:
    """What Ctrl-C leaves."""
    try:
        yield
    except KeyboardInterrupt:
        kept = output is not None and output.suffix.lower() == ".chart" and output.exists()
        said = f"the tiles done so far are in {output}; the same command goes on" if kept else "nothing was written"
        click.echo(f"stopped: {said}", err=True)
        sys.exit(INTERRUPTED)


@contextmanager
def _moved_aside(folder: Path | None) -> Iterator[None]:
    """Say where an old folder of that name went, or why the new one cannot be written."""

    there = set(folder.parent.glob("*.chart")) if folder is not None else set()
    try:
        yield
    except OSError as error:
        if folder is None:
            raise
        message = f"'{folder}' cannot be written: {error.strerror}; the same command will go on where it was"
        raise input_error(message, "--output") from None
    if folder is not None:
        for aside in sorted(set(folder.parent.glob("*.chart")) - there - {folder}):
            click.echo(f"moved the old folder to {aside}", err=True)


def _shown(found: "Chart", held: dict[str, float]) -> dict[str, Any]:
    """The plane that a figure shows of a space or a folder: what is held is fixed, and points are fewer."""
    problem, sizes = found.problem, dict(zip(found.axes, map(len, found.grid), strict=True))
    title = ", ".join([problem.title, *(f"{n} = {v:.6g}" for n, v in held.items())]).removeprefix(", ")
    free = {n: ends for n, ends in problem.free.items() if n not in held}
    axes = [n for n in found.axes if n not in held]
    return {
        "problem": replace(problem, fixed={**problem.fixed, **held}, free=free, start={}, title=title),
        "axes": axes,
        "points": [min(sizes[n], most) for n, most in zip(axes, _SHOWN, strict=True)],
    }


def _space(free: tuple[str, ...], axes: str | None) -> tuple[str, ...]:

    names = tuple(n.strip() for n in axes.split(",")) if axes is not None else free
    if sorted(names) != sorted(free):
        raise input_error(f"found {axes}; accepted: {', '.join(free)} in any order", "--axes")
    return names


def _sizes(points: tuple[int, ...] | None, axes: int) -> tuple[int, ...]:
    from tmsopt.charts import USUAL_POINTS

    if points is None:
        return USUAL_POINTS[axes]
    sizes = points * axes if len(points) == 1 else points
    if len(sizes) != axes:
        message = f"found {'x'.join(map(str, points))}; accepted: one number, or one for each of the {axes} axes"
        raise input_error(message, "--points")
    return sizes


def _check_memory(sizes: tuple[int, ...], output: Path | None) -> None:
    """Refuse what could not be held or written, before any work is done."""
    from tmsopt.charts import LARGEST, check_netcdf

    if (designs := math.prod(sizes)) > LARGEST:
        message = f"{designs:.3g} designs do not fit into memory; give an --output that ends in chart, or fewer"
        raise input_error(message, "--points")
    if output is not None and output.suffix.lower() == ".nc":
        check_netcdf()


def _check_plot(plot: Path | None, layer: str, accepted: tuple[str, ...], axes: int, cut: dict[str, str]) -> None:

    if layer not in accepted:
        raise input_error(f"found '{layer}'; {suggest(layer, accepted)}", "--layer")
    if plot is not None and axes == 3 and not cut:
        message = "three parameters are free, and a figure shows two; hold one, as in --slice lambda_s=0.4"
        raise input_error(message, "--plot")
    if cut and axes == 2:
        raise input_error("two parameters are free, so there is nothing to hold; leave it out", "--slice")


def _held(problem: "Posed", cut: dict[str, str]) -> dict[str, float]:
    """The parameter that a figure holds, as a number in its box."""

    held = {}
    for name, text in cut.items():
        if name not in problem.free:
            raise input_error(f"found '{name}'; {suggest(name, problem.free)}", "--slice")
        low, high = problem.free[name]
        held[name] = number(text, problem.parameter_set[name].unit, "--slice", name)
        if not low <= held[name] <= high:
            raise input_error(f"found {text}; accepted: {low:.6g} to {high:.6g}", "--slice", name)
    return held
