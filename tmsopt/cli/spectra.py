"""`tmsopt encircle` and `tmsopt sheets`: eigenvalues over a plane of two parameters."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import click

import tmsopt
from tmsopt.cli.answers import Reply
from tmsopt.cli.command import OnFile, WithCsv, WithPage, WithPlot, option, split_names, take_nominal
from tmsopt.cli.terminal import progress_listener
from tmsopt.errors import MOST_STARTS


class EncircleCommand(WithPage, WithPlot, OnFile):
    """Follow the eigenvalues of FILE around a circle: how they exchange, and their geometric phases.

    Examples:
      tmsopt encircle problems/loss_only_dimer.toml --plot loop.png
      tmsopt encircle problems/pt_trimer.toml --plane d1,gain --radius 0.5
      tmsopt encircle problems/loss_only_dimer.toml --centre k=1 --radius 0.2

    Exit status: 0 done, 2 bad input, 3 infeasible, 4 not converged.
    """

    radius: float = option("Radius, in SI units and rad.", 0.1)
    plane: Any = option("The two parameters.  [default: the first two]", type=split_names, metavar="NAMES")
    centre: Mapping[str, float] = option("Another centre, in SI.", metavar="NAME=VALUE", example="k=0.5")
    points: int | None = option("Number of points at first.  [default: 64]")
    starts: int | None = option("Starts of the search inside.  [default: 16]", type=click.IntRange(0, MOST_STARTS))

    def run(self) -> Reply:
        options = self.select("radius plane centre points starts")
        loop = tmsopt.encircle(take_nominal(tmsopt.load(self.file).posed), **options, progress=progress_listener())
        return Reply(loop, draw=partial(tmsopt.plots.loop_figure, loop))


def _parse_grid(text: str) -> tuple[int, ...]:
    try:
        return tuple(map(int, text.replace("×", "x").split("x")))
    except ValueError:
        raise click.BadParameter(f"found {text!r}; accepted: two whole numbers, as in 81x81") from None


class SheetsCommand(WithCsv, WithPage, WithPlot, OnFile):
    """Compute all eigenvalues of FILE over the ranges of two parameters, as Riemann sheets.

    Examples:
      tmsopt sheets problems/loss_only_dimer.toml --plot sheets.png
      tmsopt sheets problems/pt_trimer.toml --over d1,gain --grid 41x41 --csv s.csv

    Exit status: 0 done, 2 bad input.
    """

    over: Any = option("The two parameters.  [default: the first two]", type=split_names, metavar="NAMES")
    grid: Any = option("Numbers of points.  [default: 81x81]", type=_parse_grid, metavar="NxM")

    def run(self) -> Reply:
        options = self.select("over grid")
        sheets = tmsopt.sheets(take_nominal(tmsopt.load(self.file).posed), **options, progress=progress_listener())
        return Reply(sheets, draw=partial(tmsopt.plots.sheets_figure, sheets))
