"""`tmsopt trace`: a root pattern as curves."""

from functools import partial

import click

import tmsopt
from tmsopt.cli.answers import Reply
from tmsopt.cli.command import OnFile, WithCsv, WithPage, WithPlot, WithSearch, option
from tmsopt.cli.ending import INFEASIBLE
from tmsopt.cli.problems import choose_plane, take_nominal
from tmsopt.errors import MOST_STARTS


class TraceCommand(WithSearch, WithCsv, WithPage, WithPlot, OnFile):
    """Trace a root pattern of FILE through parameter space: every branch, with its events.

    Examples:
      tmsopt trace problems/ep_set.toml
      tmsopt trace problems/ep_set.toml --plot ep_set.png --axes Fr,lambda_s
      tmsopt trace problems/off_law.toml --pattern weave --csv weave.csv

    Exit status: 0 traced, 2 bad input, 3 nothing of the pattern found in the box.
    """

    pattern: str | None = option("Pattern.  [default: the one that FILE locates]")
    axes: str | None = option("Two parameters to draw over, e.g. Fr,chi_B.")
    step: float = option("Longest step, in widths of the box.", 0.005, type=click.FloatRange(1e-6, 0.1))
    starts: int = option("Fruitless starts in a row, to stop.", 48, type=click.IntRange(1, MOST_STARTS))

    def run(self) -> Reply:
        self.refuse_useless((not self.plot, "axes", "says what --plot draws; add --plot FILE"))
        problem = take_nominal(tmsopt.load(self.file).posed)
        if self.axes is not None:
            choose_plane(problem, self.axes)
        found = tmsopt.trace(problem, self.pattern, step=self.step, **self.search)
        if not found.branches:
            click.echo(f"no {found.pattern} found in the box; widen it, or try more --starts", err=True)
            return Reply(found, INFEASIBLE, without="csv plot")
        axes = choose_plane(problem, self.axes or ",".join(found.varying[:2])) if self.plot else ()
        return Reply(found, draw=partial(tmsopt.plots.trace_figure, found, *axes))
