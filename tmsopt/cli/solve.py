"""Commands that solve one problem."""

import math
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import tmsopt
from tmsopt.cli.common import (
    DONE,
    INFEASIBLE,
    NOT_CONVERGED,
    answer,
    csv_option,
    file_argument,
    json_option,
    nominal_of,
    number,
    options,
    plot_option,
    report_option,
    seed_option,
    starts_option,
    write_file,
    write_report,
)
from tmsopt.cli.ending import INTERRUPTED
from tmsopt.cli.terminal import shown
from tmsopt.errors import MOST_POINTS, Fault, InputError, input_error

if TYPE_CHECKING:
    from tmsopt.report import Findings

_EXIT = {"optimal": DONE, "infeasible": INFEASIBLE, "not_converged": NOT_CONVERGED}

_CONTRACT = (
    "schema title model status objective parameters units abscissa abscissa_realised stable any_stable verdict growth "
    "verdict_is_exact multiplicity_is_exact defective geometric_multiplicity roots eigenfrequencies structure active "
    "violations missed_as_stored bound starts seconds inertia_margin relaxation worst_case notes interrupted"
)
"""Keys of JSON without --full."""

_SOLVE_EXAMPLES = """
\b
Examples:
  tmsopt solve problems/ep4.toml
  tmsopt solve problems/realistic.toml --plot growth.png
  tmsopt solve problems/realistic.toml --full
  tmsopt solve problems/realistic.toml --report design.html
  tmsopt solve problems/realistic.toml --certify 30
  tmsopt solve problems/benchmark.toml --json | python -m json.tool
  tmsopt solve problems/ep4_matching.toml --all
  tmsopt solve problems/pareto.toml --points 40 --plot front.png --csv front.csv

A file with pareto = ["abscissa", "Fr"] under [objective] gives the front: two or three expressions, each minimised; a
minus sign maximises, as in "-lambda_s".

Exit status: 0 solved, 2 bad input, 3 infeasible, 4 not converged.
"""

_COMPARE_EXAMPLES = """
\b
Examples:
  tmsopt compare problems/ep4.toml
  tmsopt compare problems/optimised_benchmark.toml --json

Exit status: that of solving the problem.
"""

Command = Callable[..., Any]


def _common(command: Command) -> Command:
    """Options that every solving command has."""
    for option in (
        json_option,
        starts_option("Starts tried at most; of a front, new ones per point. [default: 64, of a front 2]"),
        seed_option,
        click.option(
            "--linear-solver",
            type=click.Choice(["mumps", "spral"]),
            default="mumps",
            show_default=True,
            help="Inside IPOPT.",
        ),
    ):
        command = option(command)
    return command


def _seconds(ctx: click.Context, param: click.Parameter, value: Any) -> float | None:
    """A time, or what was meant for another argument."""
    try:
        seconds = None if value is None else float(value)
    except ValueError:
        seconds = math.nan
    if seconds is None or 0 < seconds < math.inf:
        return seconds
    found = f"found {value!r}; accepted: a positive number of seconds, or none. Write FILE before --certify."
    raise click.BadParameter(found)


@click.command(epilog=_SOLVE_EXAMPLES)
@file_argument
@_common
@plot_option("Draw growth rates and frequencies over the speed, or the front")
@report_option
@click.option("--over", help="What --plot draws over, e.g. lambda_s. [default: the speed, or the first free one]")
@csv_option("Write the points of a front.")
@click.option(
    "--points",
    type=click.IntRange(2, MOST_POINTS),
    help="Points of a front; of three objectives limits on each of two, 12 at most: about as many points as their "
    "square. [default: 25, or 12]",
)
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    help="Processes for a front, which is the same for any number. [default: as many as cores, up to 4]",
)
@click.option(
    "--wheelbase",
    help="Of a dimensionless bicycle (tms): show SI beside, for this wheelbase in m or with a unit. [1 if left out]",
)
@click.option("--rear-mass", help="Likewise, for this mass m_B of the rear frame, in kg or with a unit.")
@click.option(
    "--full",
    is_flag=True,
    help="All there is to say, each part under its name: every number to 12 digits, gains of limits solved again, "
    "rounding, robustness, how multiple roots split. JSON has everything then.",
)
@click.option(
    "--certify",
    callback=_seconds,
    is_flag=False,
    flag_value="60",
    metavar="[SECONDS]",
    help="Prove within SECONDS that nothing better exists, or find it (SCIP). Write it after FILE. [60 if left out]",
)
@click.option(
    "--all",
    "every",
    is_flag=True,
    help="Of a pattern that leaves no freedom: all designs in the box that have it, with a proof that they are all "
    "or a search.",
)
@click.option("--seconds", type=click.FloatRange(0, min_open=True), help="Time for the proof of --all. [default: 60]")
@click.pass_context
def solve(
    context: click.Context,
    /,
    file: Path,
    as_json: bool,
    plot: Path | None,
    report: Path | None,
    over: str | None,
    csv_file: Path | None,
    points: int | None,
    workers: int | None,
    wheelbase: str | None,
    rear_mass: str | None,
    full: bool,
    certify: float | None,
    every: bool,
    seconds: float | None,
    **search: Any,
) -> None:
    """Find the best design that the problem FILE asks for, or the front of the best ones."""
    from tmsopt.problem import as_solvable

    w, m_B = _scale("--wheelbase", wheelbase or "1", "m"), _scale("--rear-mass", rear_mass or "1", "kg")
    problem = as_solvable(file, front=True)
    _check_options(problem.problem, _given(context), every)
    if certify:
        from tmsopt.proofs import check_installed

        check_installed()
    asked, seed = options(**search), search["seed"]
    if every:
        designs = tmsopt.solve_all(problem, progress=shown(), **asked, **options(seconds=seconds))
        answer(as_json, lambda: problem.heading | designs.to_json(), lambda: tmsopt.report.every_table(designs))
        write_report(designs, report, file, seed=seed)
        sys.exit(DONE if designs.solutions else INFEASIBLE)
    if problem.pareto:
        try:
            front = tmsopt.pareto(problem, progress=shown(), **asked, **options(points=points, workers=workers))
        except tmsopt.NotSolved as error:
            solution, plot = error.solution, None
        else:
            answer(as_json, front.to_json, lambda: front.report(full))
            write_file("--csv", csv_file, front.write_csv)
            write_file("--plot", plot, lambda path: tmsopt.plots.save(tmsopt.plots.front_figure(front), path))
            write_report(front, report, file, seed=seed, full=full)
            sys.exit(INTERRUPTED if front.interrupted else DONE)
    else:
        solution = tmsopt.solve(problem, throw=False, progress=shown(), **asked)
        if certify and not solution.interrupted:
            solution = tmsopt.certify(solution, seconds=certify, progress=shown())
    found = tmsopt.report.Findings()
    try:
        if full or not as_json:
            found = tmsopt.report.findings(solution, full, shown())
    except KeyboardInterrupt:
        solution = replace(solution, interrupted=True)
    si = tmsopt.report.si_parameters(solution, w, m_B) if wheelbase or rear_mass else None
    answer(
        as_json,
        lambda: _as_json(solution, found, full),
        lambda: tmsopt.report.design_report(solution, found, full, si),
    )
    if plot is not None:
        _draw(solution, plot, over, w, m_B)
    write_report(solution, report, file, seed=seed, full=full)
    sys.exit(INTERRUPTED if solution.interrupted else _EXIT[solution.status])


def _check_options(problem: "tmsopt.Problem", given: list[str], every: bool) -> None:
    """Refuse options that mean nothing for this problem.

    Raises:
        InputError: naming each of them.
    """
    alone, scaled = ("--certify", "--full"), ("--wheelbase", "--rear-mass")
    wrong: dict[str, str] = {}
    if every:
        message = "is for one design, and --all looks for all of them; leave one of the two out"
        wrong |= dict.fromkeys((*alone, *scaled, "--plot"), message)
    else:
        wrong["--seconds"] = "is for the proof of --all; write --all too, or leave it out"
    if "--plot" not in given:
        wrong["--over"] = "says what --plot draws over; add --plot FILE, or leave it out"
    if problem.pareto:
        message = "is for one design, and the file asks for a front; write minimize with one of the expressions"
        wrong |= dict.fromkeys(("--certify", "--over"), message)
        message = "scales one design, and the file asks for a front; write the problem in SI instead"
        wrong |= dict.fromkeys(scaled, message)
    else:
        message = 'is for a front; write pareto = ["abscissa", "Fr"] under [objective], or leave the option out'
        wrong |= dict.fromkeys(("--points", "--csv", "--workers"), message)
    if problem.model.name != "tms" or problem.posed.parameter_set.rate is not None:
        message = "scales a dimensionless bicycle, and the file is not one; leave it out"
        wrong |= dict.fromkeys(scaled, message)
    if faults := [Fault(wrong[option], (option,)) for option in given if option in wrong]:
        raise InputError(faults)


def _as_json(solution: "tmsopt.Solution", found: "Findings", full: bool) -> dict[str, Any]:
    """The keys of the contract; everything, and what was found out beside, where all is wanted."""
    data = solution.to_json()
    if not full:
        return {name: value for name, value in data.items() if name in _CONTRACT.split()}
    meaning = {
        "meaning": found.explanation and found.explanation.to_json(),
        "robustness": found.robustness and found.robustness.to_json(),
        "diagnosis": [root.to_json() for root in found.diagnoses],
    }
    return data | {name: value for name, value in meaning.items() if value}


@click.command(epilog=_COMPARE_EXAMPLES)
@file_argument
@_common
def compare(file: Path, as_json: bool, **search: Any) -> None:
    """Set the optimum of FILE beside the closed-form laws, and one formulation beside the other."""
    from tmsopt.problem import as_solvable

    problem = nominal_of(as_solvable(file))
    comparison = tmsopt.compare(problem, progress=shown(), **options(**search))
    answer(as_json, comparison.to_json, lambda: tmsopt.report.comparison_table(comparison))
    sys.exit(_EXIT[comparison.design.status])


def _given(context: click.Context) -> list[str]:
    """Options that were written on the command line."""
    written = click.core.ParameterSource.COMMANDLINE
    named = [p for p in context.command.params if p.name and context.get_parameter_source(p.name) == written]
    return [p.opts[0] for p in named]


def _scale(option: str, text: str, unit: str) -> float:
    """A positive length or mass of the command line."""
    value = number(text, unit, option)
    if not 0 < value < math.inf:
        raise input_error(f"found {text}; accepted: a positive number of {unit}", option)
    return value


def _draw(solution: "tmsopt.Solution", path: Path, over: str | None, w: float, m_B: float) -> None:
    if not math.isfinite(solution.abscissa):
        click.echo("--plot: nothing to draw, a root is at infinity", err=True)
        return
    unit = None
    if solution.problem.model is tmsopt.models.tms:
        si = tmsopt.report.si_parameters(solution, w, m_B)
        unit = (si["g"] * si["w"]) ** 0.5
    drawn = tmsopt.growth(solution, over=over, progress=shown())
    figure = tmsopt.plots.growth_figure(drawn, solution.problem.title, unit)
    write_file("--plot", path, lambda path: tmsopt.plots.save(figure, path))
