"""`tmsopt chart`: stability over a plane or a space of parameters."""

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

import tmsopt
from tmsopt.cli.answers import Reply, write_file
from tmsopt.cli.command import OnFile, WithPage, WithPlot, option, parse_number, split_names, take_nominal
from tmsopt.cli.ending import INTERRUPTED
from tmsopt.cli.terminal import progress_listener
from tmsopt.deprecated import no_longer_needed
from tmsopt.errors import input_error, suggest

_LAYERS = ("kind", "abscissa", "damping_ratio", "real_roots", "satisfied", "margin")
_EIGENVECTOR_LAYERS = ("petermann", "phase_rigidity")
"""Layers that are computed only if an option names them."""
_MAX_FIGURE_POINTS = (800, 600)
"""Largest number of points along the axes of a figure of a large chart."""


def _parse_points(text: str) -> tuple[int, ...]:
    try:
        return tuple(map(int, text.replace("×", "x").split("x")))
    except ValueError:
        message = f"found {text!r}; accepted: one to three numbers of at least 2, as in 400x300"
        raise click.BadParameter(message) from None


class ChartCommand(WithPage, WithPlot, OnFile):
    """Chart stability over the two or three free parameters of FILE.

    Examples:
      tmsopt chart problems/chart.toml --plot chart.png --output chart.npz
      tmsopt chart problems/chart.toml --layer abscissa --plot abscissa.pdf
      tmsopt chart problems/chart.toml --points 10000x10000 --output big.chart
      tmsopt chart problems/ep_set.toml --points 99 --quantity "excess=Fr - Fr_c"

    Exit status: 0 done, 2 bad input.
    """

    points: Any = option("Points.  [default: 400x300 or 120x100x80]", type=_parse_points, metavar="N[xM[xL]]")
    axes: Any = option("Axes, the horizontal one first.", type=split_names, metavar="NAMES")
    output: Path | None = option("Write the arrays (npz, nc, chart).", None, "-o", endings=("npz", "nc", "chart"))
    layers: Any = option("Arrays in --output, e.g. kind,abscissa.", type=split_names, metavar="NAMES")
    quantity: Mapping[str, str] = option(
        "Also compute an expression.", metavar="NAME=EXPRESSION", example="excess=Fr - Fr_c"
    )
    single: bool = option("Write numbers in single precision.")
    fresh: bool = option("Start anew; rename an old --output folder.")
    engine: str | None = option("", hidden=True)
    workers: int = option("Number of processes.", 1, type=click.IntRange(1, 256))
    layer: str = option("Layer that --plot shows.", "kind")
    slice: Mapping[str, str] = option(
        "Fix one of three parameters for --plot.", metavar="NAME=VALUE", example="lambda_s=0.4", multiple=False
    )
    boundaries: bool = option("Trace the boundaries exactly.", True)

    def run(self) -> Reply:
        if self.engine is not None:
            click.echo(no_longer_needed("--engine"), err=True)
        folder = self.output if self.output is not None and self.output.suffix.lower() == ".chart" else None
        try:
            return self._chart(folder)
        except KeyboardInterrupt:
            is_kept = folder is not None and folder.exists()
            text = f"the tiles done so far are in {folder}; the same command continues the work"
            click.echo(f"stopped: {text if is_kept else 'nothing was written'}", err=True)
            sys.exit(INTERRUPTED)

    def _chart(self, folder: Path | None) -> Reply:
        from tmsopt.charts import DEFAULT_LAYERS, axes_of, check_netcdf

        if self.output is not None and self.output.suffix.lower() == ".nc":
            check_netcdf()
        problem = take_nominal(tmsopt.load(self.file).posed)
        figure_layers = (*_LAYERS, *(n for n in _EIGENVECTOR_LAYERS if n == self.layer))
        names, layers = axes_of(problem, self.axes), self.layers or DEFAULT_LAYERS
        is_plane_in_memory = folder is None and len(names) == 2  # such a chart has all layers and boundaries
        self._check_plot(len(names))
        slice_values = self._read_slice(problem)
        options: dict[str, Any] = {"quantities": self.quantity, "single": self.single, "progress": progress_listener()}
        with _report_folder(folder) if folder else nullcontext():
            chart = tmsopt.chart(
                problem,
                names,
                folder=folder,
                points=self.points * len(names) if self.points and len(self.points) == 1 else self.points,
                layers=(*figure_layers, *layers) if is_plane_in_memory else layers,
                workers=self.workers,
                fresh=self.fresh,
                boundaries=self.boundaries and is_plane_in_memory,
                **options,
            )
        if folder is None:
            write_file("--output", self.output, lambda path: chart.save(path, (*dict.fromkeys(layers), *self.quantity)))

        def draw() -> Any:
            figure_options = options | {"boundaries": self.boundaries, "layers": figure_layers}
            figure_chart = (
                chart if is_plane_in_memory else tmsopt.chart(**_cut_plane(chart, slice_values), **figure_options)
            )
            return tmsopt.plots.chart_figure(figure_chart, self.layer)

        return Reply(chart, draw=draw)

    def _check_plot(self, axis_count: int) -> None:
        accepted = (*_LAYERS[:4], *_EIGENVECTOR_LAYERS, *self.quantity)
        if self.layer not in accepted:
            raise input_error(f"found '{self.layer}'; {suggest(self.layer, accepted)}", "--layer")
        if self.plot is not None and axis_count == 3 and not self.slice:
            message = "three parameters are free, and a figure shows two; fix one, as in --slice lambda_s=0.4"
            raise input_error(message, "--plot")
        if self.slice and axis_count == 2:
            raise input_error("two parameters are free, so there is nothing to fix; leave the option out", "--slice")

    def _read_slice(self, problem: Any) -> dict[str, float]:
        """The value at which --slice fixes a parameter, checked against its range."""
        values = {}
        for name, text in self.slice.items():
            if name not in problem.free:
                raise input_error(f"found '{name}'; {suggest(name, problem.free)}", "--slice")
            low, high = problem.free[name]
            values[name] = parse_number(text, problem.parameter_set[name].unit, "--slice", name)
            if not low <= values[name] <= high:
                raise input_error(f"found {text}; accepted: {low:.6g} to {high:.6g}", "--slice", name)
        return values


@contextmanager
def _report_folder(folder: Path) -> Iterator[None]:
    """Name the folder that was written, and the new name of an old one; if it could not be written, say why."""
    old_folders = {folder, *folder.parent.glob("*.chart")}
    try:
        yield
    except OSError as error:
        message = f"'{folder}' cannot be written: {error.strerror}; the same command will continue the work"
        raise input_error(message, "--output") from None
    for moved_folder in sorted(set(folder.parent.glob("*.chart")) - old_folders):
        click.echo(f"moved the old folder to {moved_folder}", err=True)
    click.echo(f"wrote {folder}", err=True)


def _cut_plane(chart: Any, slice_values: dict[str, float]) -> dict[str, Any]:
    """Arguments of `tmsopt.chart` for the figure: the parameter of --slice is fixed, and there are fewer points."""
    problem, sizes = chart.problem, dict(zip(chart.axes, map(len, chart.grid), strict=True))
    title = ", ".join([problem.title, *(f"{n} = {v:.6g}" for n, v in slice_values.items())]).removeprefix(", ")
    free = {n: ends for n, ends in problem.free.items() if n not in slice_values}
    axes = [n for n in chart.axes if n not in slice_values]
    return {
        "problem": replace(problem, fixed={**problem.fixed, **slice_values}, free=free, start={}, title=title),
        "axes": axes,
        "points": [min(sizes[n], max_points) for n, max_points in zip(axes, _MAX_FIGURE_POINTS, strict=True)],
    }
