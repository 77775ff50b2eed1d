"""`tmsopt speeds` and `simulate`: one design in motion."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import click

import tmsopt
from tmsopt.cli.answers import Reply
from tmsopt.cli.command import OnFile, WithCsv, WithPage, WithPlot, option
from tmsopt.cli.problems import note_scenarios
from tmsopt.cli.terminal import progress_listener


def _parse_range(text: str) -> tuple[float, float]:
    try:
        low, high = map(float, text.split(","))
    except ValueError:
        raise click.BadParameter(f"found {text!r}; accepted: two numbers, as in 0,12") from None
    return low, high


class SpeedsCommand(WithPlot, OnFile):
    """Find every weave and capsize speed of FILE, and every speed at which roots meet, exactly.

    Examples:
      tmsopt speeds problems/whipple_benchmark.toml
      tmsopt speeds problems/whipple_benchmark.toml --parameter c --between -0.2,0.3
      tmsopt speeds problems/ep4.toml --plot speeds.png

    Exit status: 0 done, 2 bad input, 3 infeasible, 4 not converged.
    """

    parameter: str | None = option("Parameter that varies.  [default: the speed]", metavar="NAME")
    between: Any = option("Range to look through.  [default: all]", parse=_parse_range, metavar="LOW,HIGH")

    def run(self) -> Reply:
        problem = tmsopt.load(self.file)
        note_scenarios(problem.posed, [self.parameter] if self.parameter else ("v", "Fr"))
        return Reply(tmsopt.speeds(problem, self.parameter, between=self.between, progress=progress_listener()))


class SimulateCommand(WithCsv, WithPage, WithPlot, OnFile):
    """Show what the design of FILE does after a lean, a push, or in noise.

    Examples:
      tmsopt simulate problems/whipple_benchmark.toml --lean 5 --plot motion.png
      tmsopt simulate problems/ep4.toml --push 0.001 --json
      tmsopt simulate problems/gain_schedule.toml --at v=1.5
      tmsopt simulate problems/ziegler.toml --start q2=0.1

    Exit status: 0 done, stable or not, 2 bad input, 3 infeasible, 4 not converged.
    """

    lean: float | None = option("Lean to the right at the start.", metavar="DEGREES")
    steer: float | None = option("Steer to the right at the start.", metavar="DEGREES")
    push: float | None = option("Impulse of steer torque, in N m s.", metavar="IMPULSE")
    lean_push: float | None = option("Impulse of lean torque, in N m s.", metavar="IMPULSE")
    start: Mapping[str, float] = option(
        "A state at the start, in rad and s.", metavar="NAME=VALUE", example="phidot=0.1"
    )
    at: Mapping[str, float] = option("Another value of a parameter, in SI.", metavar="NAME=VALUE", example="v=1.5")
    noise: float | None = option("Noise of steer torque, in N m sqrt(s).", metavar="INTENSITY")
    seed: int = option("Seed of the noise.", 0, type=click.IntRange(0))
    seconds: float | None = option("How long.  [default: until it has settled]")
    points: int = option("Times in the table.", 1001, type=click.IntRange(2, 1_000_000))
    path: bool = option("With --csv: torques and the wheels' path too.")

    def run(self) -> Reply:
        self.refuse_useless((not self.csv, "path", "says what --csv writes; add --csv FILE"))
        problem = tmsopt.load(self.file)
        note_scenarios(problem.posed, self.at)
        given = self.select("lean steer push lean_push noise seed seconds points")
        states: Any = {"start": self.start or None, "at": self.at or None}
        motion = tmsopt.simulate(problem, **states, **given, progress=progress_listener())
        draw = partial(tmsopt.plots.motion_figure, motion)
        return Reply(motion, draw=draw, write_csv=partial(motion.write_csv, whole=self.path))
