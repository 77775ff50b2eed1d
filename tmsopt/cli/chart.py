"""`tmsopt chart`: stability over a plane or a space of parameters."""

import math
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import tmsopt
from tmsopt.cli.answers import Reply
from tmsopt.cli.command import OnFile, WithPage, WithPlot, option
from tmsopt.cli.ending import INTERRUPTED
from tmsopt.cli.outputs import check_output, report_writing
from tmsopt.cli.problems import parse_number, split_names, take_nominal
from tmsopt.cli.terminal import progress_listener
from tmsopt.deprecated import no_longer_needed
from tmsopt.errors import input_error, suggest

if TYPE_CHECKING:
    from tmsopt.problem import Posed

_LAYERS = ("kind", "abscissa", "damping_ratio", "real_roots", "satisfied", "margin")
_DRAWN = (800, 600)
"""Most points along the axes of a figure of a large chart."""


def _parse_points(text: str) -> tuple[int, ...]:
    try:
        return tuple(map(int, text.replace("×", "x").split("x")))
    except ValueError:
        message = f"found {text!r}; accepted: a number from 2, or two or three as in 400x300"
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

    points: Any = option("Points.  [default: 400x300, 120x100x80]", parse=_parse_points, metavar="N[xM[xL]]")
    axes: str | None = option("Parameters, the horizontal one first.")
    output: Path | None = option("Write the arrays (npz, nc, chart).", None, "-o")
    layers: str | None = option("Arrays of --output, e.g. kind,abscissa.")
    quantity: Mapping[str, str] = option(
        "Compute an expression too.", metavar="NAME=EXPRESSION", example="excess=Fr - Fr_c"
    )
    single: bool = option("Write numbers in single precision.")
    fresh: bool = option("Move the folder of --output aside.")
    engine: str | None = option("", hidden=True)
    workers: int = option("Processes.", 1, type=click.IntRange(1, 256))
    layer: str = option("Layer that --plot shows.", "kind")
    slice: Mapping[str, str] = option(
        "Parameter of three that --plot holds.", metavar="NAME=VALUE", example="lambda_s=0.4", multiple=False
    )
    boundaries: bool = option("Trace the boundaries exactly.", True)

    def run(self) -> Reply:
        if self.engine is not None:
            click.echo(no_longer_needed("--engine"), err=True)
        try:
            return self._chart()
        except KeyboardInterrupt:
            is_kept = self._folder is not None and self._folder.exists()
            kept = f"the tiles done so far are in {self.output}; the same command goes on"
            click.echo(f"stopped: {kept if is_kept else 'nothing was written'}", err=True)
            sys.exit(INTERRUPTED)

    def _chart(self) -> Reply:
        from tmsopt.charts import USUAL, axes_of

        check_output("--output", self.output, ("npz", "nc", "chart"), folders=("chart",))
        problem = take_nominal(tmsopt.load(self.file).posed)
        names = axes_of(problem, split_names(self.axes) if self.axes is not None else None)
        layers = split_names(self.layers) if self.layers is not None else USUAL
        is_whole = self._folder is None and len(names) == 2  # in memory, shown with all its layers and boundaries
        self._check_plot(len(names))
        held = self._read_slice(problem)
        sizes = self._choose_sizes(len(names))
        options: dict[str, Any] = {"quantities": self.quantity, "single": self.single}
        with self._report_moved():
            chart = tmsopt.chart(
                problem,
                names,
                folder=self._folder,
                points=sizes,
                layers=(*_LAYERS, *layers) if is_whole else layers,
                **options,
                workers=self.workers,
                fresh=self.fresh,
                boundaries=self.boundaries and is_whole,
                progress=progress_listener(),
            )
        if self.output is not None and self._folder is None:
            with report_writing("--output", self.output):
                chart.save(self.output, (*dict.fromkeys(layers), *self.quantity))
        if self._folder is not None:
            click.echo(f"wrote {self._folder}", err=True)

        def draw() -> Any:
            more = options | {"boundaries": self.boundaries, "progress": progress_listener()}
            drawn = chart if is_whole else tmsopt.chart(**_cut_plane(chart, held), **more)
            return tmsopt.plots.chart_figure(drawn, self.layer)

        return Reply(chart, draw=draw)

    @property
    def _folder(self) -> Path | None:
        """The folder that --output names, if it names one."""
        return self.output if self.output is not None and self.output.suffix.lower() == ".chart" else None

    @contextmanager
    def _report_moved(self) -> Iterator[None]:
        """Say where an old folder of that name went, or why the new one cannot be written."""
        folder = self._folder
        if folder is None:
            yield
            return
        before = {folder, *folder.parent.glob("*.chart")}
        try:
            yield
        except OSError as error:
            message = f"'{folder}' cannot be written: {error.strerror}; the same command will go on where it was"
            raise input_error(message, "--output") from None
        for moved in sorted(set(folder.parent.glob("*.chart")) - before):
            click.echo(f"moved the old folder to {moved}", err=True)

    def _check_plot(self, axes: int) -> None:
        accepted = (*_LAYERS[:4], *self.quantity)
        if self.layer not in accepted:
            raise input_error(f"found '{self.layer}'; {suggest(self.layer, accepted)}", "--layer")
        if self.plot is not None and axes == 3 and not self.slice:
            message = "three parameters are free, and a figure shows two; hold one, as in --slice lambda_s=0.4"
            raise input_error(message, "--plot")
        if self.slice and axes == 2:
            raise input_error("two parameters are free, so there is nothing to hold; leave it out", "--slice")

    def _read_slice(self, problem: "Posed") -> dict[str, float]:
        """The parameter that a figure holds, as a number in its range."""
        held = {}
        for name, text in self.slice.items():
            if name not in problem.free:
                raise input_error(f"found '{name}'; {suggest(name, problem.free)}", "--slice")
            low, high = problem.free[name]
            held[name] = parse_number(text, problem.parameter_set[name].unit, "--slice", name)
            if not low <= held[name] <= high:
                raise input_error(f"found {text}; accepted: {low:.6g} to {high:.6g}", "--slice", name)
        return held

    def _choose_sizes(self, axes: int) -> tuple[int, ...]:
        """Points along each axis, unless memory or the format of the file cannot take them."""
        from tmsopt.charts import LARGEST, USUAL_POINTS, check_netcdf

        sizes: tuple[int, ...] = self.points or USUAL_POINTS[axes]
        sizes = sizes * axes if len(sizes) == 1 else sizes
        if self._folder is None and (designs := math.prod(sizes)) > LARGEST:
            message = f"{designs:.3g} designs do not fit into memory; give an --output that ends in chart, or fewer"
            raise input_error(message, "--points")
        if self.output is not None and self.output.suffix.lower() == ".nc":
            check_netcdf()
        return sizes


def _cut_plane(chart: Any, held: dict[str, float]) -> dict[str, Any]:
    """The plane of a space or a folder that a figure shows: the held parameter is fixed, and points are fewer."""
    problem, sizes = chart.problem, dict(zip(chart.axes, map(len, chart.grid), strict=True))
    title = ", ".join([problem.title, *(f"{n} = {v:.6g}" for n, v in held.items())]).removeprefix(", ")
    free = {n: ends for n, ends in problem.free.items() if n not in held}
    axes = [n for n in chart.axes if n not in held]
    return {
        "problem": replace(problem, fixed={**problem.fixed, **held}, free=free, start={}, title=title),
        "axes": axes,
        "points": [min(sizes[n], most) for n, most in zip(axes, _DRAWN, strict=True)],
    }
