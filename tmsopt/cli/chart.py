"""The command that charts stability over a plane."""

import re
from pathlib import Path

import click

from tmsopt.cli.common import FIGURES, bad_input, check_output, nominal_of, plane, progress, saving, write_json

_EXAMPLES = """
\b
Examples:
  tmsopt chart problems/chart.toml --plot chart.png
  tmsopt chart problems/chart.toml --points 1000x800 --output chart.npz
  tmsopt chart problems/chart.toml --axes lambda_s,Fr --layer abscissa --plot abscissa.pdf

FILE frees two parameters; it needs no [objective]. The archive of --output holds both axes under their names and the
arrays kind (0 undefined, 1 capsize, 2 weave, 3 stable, 4 heavily damped), abscissa, damping_ratio, real_roots and
satisfied (every constraint holds).

Exit status: 0 done, 2 bad input.
"""


def _points(_context: click.Context, _option: click.Parameter, value: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d{1,5})(?:[x×](\d{1,5}))?", value)
    if found is None or min(sizes := (int(found[1]), int(found[2] or found[1]))) < 2:
        raise click.BadParameter(f"found {value!r}; accepted: a number from 2 to 99999, or two as in 400x300")
    return sizes


@click.command(epilog=_EXAMPLES)
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--points",
    callback=_points,
    default="400x300",
    show_default=True,
    metavar="N[xM]",
    help="Grid points along the axes.",
)
@click.option("--axes", help="Horizontal and vertical parameter, e.g. Fr,lambda_s. [default: as in FILE]")
@click.option("--json", "as_json", is_flag=True, help="Write JSON to stdout instead of a table.")
@click.option("--output", "-o", type=click.Path(path_type=Path), help="Write the arrays (npz).")
@click.option("--plot", type=click.Path(path_type=Path), help="Draw the chart (png, pdf, svg).")
@click.option(
    "--layer",
    type=click.Choice(["kind", "abscissa", "damping_ratio", "real_roots"]),
    default="kind",
    show_default=True,
    help="What --plot shows.",
)
@click.option("--boundaries/--no-boundaries", default=True, show_default=True, help="Trace the exact boundary curves.")
def chart(
    file: Path,
    points: tuple[int, int],
    axes: str | None,
    as_json: bool,
    output: Path | None,
    plot: Path | None,
    layer: str,
    boundaries: bool,
) -> None:
    """Chart stability over the two free parameters of FILE: capsize, weave, stable, heavily damped."""
    with bad_input():
        from tmsopt.design.files import load
        from tmsopt.study.chart import chart as chart_problem
        from tmsopt.study.chart import plane_of, save_arrays

        check_output("--plot", plot, FIGURES)
        check_output("--output", output, ("npz",))
        problem = nominal_of(load(file, asks=False))
        plane_of(problem)
        names = plane(problem, axes)
        with progress("design") as update:
            found = chart_problem(problem, names, points=points, boundaries=boundaries, progress=update)
    if as_json:
        write_json(found.to_json())
    else:
        from tmsopt.show.chart import chart_table

        click.echo(chart_table(found))
    if output is not None:
        with saving("--output", output):
            save_arrays(found, output)
    if plot is not None:
        from tmsopt.show.chart import chart_figure
        from tmsopt.show.style import save

        with saving("--plot", plot):
            save(chart_figure(found, layer), plot)
