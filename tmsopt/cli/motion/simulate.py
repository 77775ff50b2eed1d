"""The command that shows what a design does after a push."""

from pathlib import Path
from typing import Any

import click

import tmsopt
from tmsopt.cli.common import (
    answer,
    csv_option,
    file_argument,
    json_option,
    named,
    options,
    plot_option,
    report_option,
    say_nominal,
    write_file,
    write_report,
)
from tmsopt.cli.terminal import shown
from tmsopt.errors import input_error

_EXAMPLES = """
\b
Examples:
  tmsopt simulate problems/whipple_benchmark.toml
  tmsopt simulate problems/whipple_benchmark.toml --lean 5 --push 2 --seconds 3 --csv motion.csv --plot motion.png
  tmsopt simulate problems/ep4.toml --push 0.001 --json
  tmsopt simulate problems/whipple_benchmark.toml --noise 0.2 --seed 7
  tmsopt simulate problems/gain_schedule.toml --at v=1.5
  tmsopt simulate problems/ziegler.toml --start q2=0.1

The linear equations of the design are solved by matrix exponentials, exact also at an exceptional point: peaks,
overshoots, settling times, and the shape of every mode. A file that frees parameters is solved first. Where nothing is
asked, a bicycle starts with a lean of 1 degree, a system of your own with 1 in its first coordinate. For parameters
without units, torques are in m_B g w and times in sqrt(w/g).

The table has the columns t, phi, delta, phidot, deltadot (lean and steer to the right, in s and rad), of your own
matrices t, q1, ..., q1dot, ... or t, x1, ..., of a complex H t, psi1_re, psi1_im, ...

Exit status: 0 done, stable or not, 2 bad input, 3 infeasible, 4 not converged.
"""


@click.command(epilog=_EXAMPLES)
@file_argument
@click.option("--lean", type=float, metavar="DEGREES", help="Lean to the right at the start.")
@click.option("--steer", type=float, metavar="DEGREES", help="Steer to the right at the start.")
@click.option("--push", type=float, metavar="IMPULSE", help="Of steer torque at the start, in N m s.")
@click.option("--lean-push", type=float, metavar="IMPULSE", help="Of lean torque at the start, in N m s.")
@click.option("--start", multiple=True, metavar="NAME=VALUE", help="Any state at the start, in rad and s: phidot=0.1.")
@click.option("--at", multiple=True, metavar="NAME=VALUE", help="Another value of a parameter, in SI: v=1.5.")
@click.option("--noise", type=float, metavar="INTENSITY", help="White noise on the steer torque, in N m sqrt(s).")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the noise.")
@click.option("--seconds", type=float, help="How long. [default: until it has settled]")
@click.option(
    "--points", type=click.IntRange(2, 1_000_000), default=1001, show_default=True, help="Times in the table."
)
@json_option
@csv_option("Write the motion.")
@click.option("--path", "whole", is_flag=True, help="With --csv: a controller's torques and the wheels' path too.")
@plot_option("Draw the motion")
@report_option
def simulate(
    file: Path,
    as_json: bool,
    csv_file: Path | None,
    whole: bool,
    plot: Path | None,
    report: Path | None,
    start: tuple[str, ...],
    at: tuple[str, ...],
    **asked: Any,
) -> None:
    """Show what the design of FILE does after a lean, a push of the handlebar, or in noise."""
    if whole and csv_file is None:
        raise input_error("says what --csv writes; add --csv FILE", "--path")
    states = _numbers("--start", start, "phidot=0.1")
    problem = tmsopt.load(file)
    values = _numbers("--at", at, "v=1.5")
    say_nominal(problem.posed, values)
    found = tmsopt.simulate(problem, start=states or None, at=values or None, progress=shown(), **options(**asked))
    answer(as_json, found.to_json, found.report)
    write_file("--csv", csv_file, lambda path: found.write_csv(path, whole=whole))
    write_file("--plot", plot, lambda path: tmsopt.plots.save(tmsopt.plots.motion_figure(found), path))
    write_report(found, report, file, seed=asked["seed"])


def _numbers(option: str, given: tuple[str, ...], example: str) -> dict[str, float]:
    """What NAME=VALUE options give."""
    found = {}
    for name, text in named(option, given, example).items():
        try:
            found[name] = float(text)
        except ValueError:
            raise input_error(f"found '{text}'; accepted: a number", option, name) from None
    return found
