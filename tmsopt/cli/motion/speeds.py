"""The command that finds every speed at which the motion of a design changes."""

from pathlib import Path

import click

import tmsopt
from tmsopt.cli.common import answer, file_argument, json_option, say_nominal
from tmsopt.cli.terminal import shown

_EXAMPLES = """
\b
Examples:
  tmsopt speeds problems/whipple_benchmark.toml
  tmsopt speeds problems/whipple_benchmark.toml --parameter c --between -0.2,0.3
  tmsopt speeds problems/ep4.toml --json

Weave, capsize, roots that meet (EP2, CEP2, …) and roots through infinity: the coefficients are polynomials in the
speed, so these speeds are roots of polynomials, isolated exactly, and none is missed. A file that frees parameters is
solved first, and the design found is looked at; where only the speed is free, its box is the range.

Exit status: 0 done, 2 bad input, 3 infeasible, 4 not converged.
"""


def _ends(_context: click.Context, _option: click.Parameter, value: str | None) -> tuple[float, float] | None:
    if value is None:
        return None
    try:
        low, high = (float(part) for part in value.split(","))
    except ValueError:
        raise click.BadParameter(f"found {value!r}; accepted: two numbers, as in 0,12") from None
    return low, high


@click.command(epilog=_EXAMPLES)
@file_argument
@click.option("--parameter", metavar="NAME", help="What varies. [default: the speed]")
@click.option("--between", callback=_ends, metavar="LOW,HIGH", help="The range to look through. [default: all]")
@json_option
def speeds(file: Path, parameter: str | None, between: tuple[float, float] | None, as_json: bool) -> None:
    """Find every weave and capsize speed of FILE, and every speed at which roots meet."""
    problem = tmsopt.load(file)
    say_nominal(problem.posed, [parameter] if parameter else ("v", "Fr"))
    found = tmsopt.speeds(problem, parameter, between=between, progress=shown())
    answer(as_json, found.to_json, lambda: tmsopt.report.speeds_table(found))
