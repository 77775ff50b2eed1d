"""Commands that solve one problem."""

import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from tmsopt.cli.common import (
    DONE,
    FIGURES,
    INFEASIBLE,
    NOT_CONVERGED,
    bad_input,
    check_output,
    nominal_of,
    progress,
    saving,
    write_json,
)

if TYPE_CHECKING:
    from tmsopt.design.problem import Problem
    from tmsopt.design.solution import Solution
    from tmsopt.diagnosis.diagnosis import Diagnosis
    from tmsopt.explanation.explain import Explanation
    from tmsopt.margins.nearest import Robustness

_EXIT = {"optimal": DONE, "infeasible": INFEASIBLE, "not_converged": NOT_CONVERGED}

_SOLVE_EXAMPLES = """
\b
Examples:
  tmsopt solve problems/ep4.toml
  tmsopt solve problems/realistic.toml --plot growth.png
  tmsopt solve problems/realistic.toml --brief
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
        click.option("--json", "as_json", is_flag=True, help="Write JSON to stdout instead of a table."),
        click.option(
            "--starts", type=click.IntRange(min=1), default=None,
            help="Starts tried at most; of a front, new ones per point. [default: 64, of a front 2]",
        ),
        click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the starts."),
        click.option(
            "--linear-solver", type=click.Choice(["mumps", "spral"]), default="mumps", show_default=True,
            help="Inside IPOPT.",
        ),
    ):  # fmt: skip
        command = option(command)
    return command


class _Seconds(click.ParamType[float]):
    """A time, or what was meant for another argument."""

    name = "seconds"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """The number of seconds."""
        try:
            seconds = float(value)
        except ValueError:
            seconds = math.nan
        if not 0 < seconds < math.inf:
            self.fail(f"found {value!r}; accepted: a positive number of seconds, or none. Write FILE before --certify.")
        return seconds


@click.command(epilog=_SOLVE_EXAMPLES)
@click.argument("file", type=click.Path(path_type=Path))
@_common
@click.option(
    "--plot",
    type=click.Path(path_type=Path),
    help="Draw growth rates and frequencies over Fr, or the front (png, pdf, svg).",
)
@click.option("--csv", "csv_file", type=click.Path(path_type=Path), help="Write the points of a front.")
@click.option("--points", type=click.IntRange(min=2), default=None, help="Points of a front. [default: 25]")
@click.option(
    "--wheelbase",
    default="1",
    show_default=True,
    help="For SI numbers of a dimensionless problem, in m or with a unit.",
)
@click.option(
    "--rear-mass",
    default="1",
    show_default=True,
    help="Likewise, the mass m_B of the rear frame, in kg or with a unit.",
)
@click.option(
    "--brief", is_flag=True, help="Leave out what the optimum means: gains of limits moved, rounding, robustness."
)
@click.option(
    "--diagnose",
    "details",
    is_flag=True,
    help="Of multiple roots, show how they split when each parameter changes. JSON has this always, but for --brief.",
)
@click.option(
    "--certify",
    type=_Seconds(),
    is_flag=False,
    flag_value=60.0,
    default=None,
    metavar="[SECONDS]",
    help="Prove within SECONDS that nothing better exists, or find it (SCIP). Write it after FILE. [60 if left out]",
)
@click.option(
    "--all", "every", is_flag=True, help="Of a pattern that leaves no freedom: all designs in the box that have it."
)
@click.pass_context
def solve(
    context: click.Context,
    file: Path,
    as_json: bool,
    starts: int | None,
    seed: int,
    linear_solver: str,
    plot: Path | None,
    csv_file: Path | None,
    points: int | None,
    wheelbase: str,
    rear_mass: str,
    brief: bool,
    details: bool,
    certify: float | None,
    every: bool,
) -> None:
    """Find the best design that the problem FILE asks for, or the front of the best ones."""
    with bad_input():
        from tmsopt.cli.front import check_options, write_front
        from tmsopt.design.files import load

        w, m_B = _scale("--wheelbase", wheelbase, "m"), _scale("--rear-mass", rear_mass, "kg")
        check_output("--plot", plot, FIGURES)
        check_output("--csv", csv_file, ("csv",))
        problem = load(file)
        check_options(problem, _given(context))
        if certify:
            from tmsopt.certificates.certify import check_installed

            check_installed()
    if every:
        _solve_all(problem, as_json=as_json, starts=starts, seed=seed, linear_solver=linear_solver)
    from tmsopt.design.solution import NotSolved
    from tmsopt.solver.multistart import STARTS
    from tmsopt.solver.solve import solve as solve_problem

    if problem.pareto:
        try:
            write_front(
                problem, points=points, as_json=as_json, starts=starts, seed=seed, linear_solver=linear_solver,
                plot=plot, csv_file=csv_file,
            )  # fmt: skip
            return
        except NotSolved as error:
            solution, plot = error.solution, None
    else:
        with progress() as update:
            solution = solve_problem(
                problem, starts=starts or STARTS, seed=seed, linear_solver=linear_solver, throw=False, progress=update
            )
        if certify:
            solution = _certified(solution, certify)
    if as_json:
        explanation, near, multiple = _meaning(solution, brief, details=False)
        meaning = {
            "meaning": explanation and explanation.to_json(),
            "robustness": near and near.to_json(),
            "diagnosis": [root.to_json() for root in multiple],
        }
        write_json(solution.to_json() | {name: found for name, found in meaning.items() if found})
    else:
        from tmsopt.report.design import solution_table
        from tmsopt.report.explanation import meaning_lines

        click.echo(solution_table(solution, w, m_B))
        for line in meaning_lines(solution, *_meaning(solution, brief, details), details):
            click.echo(line)
    if plot is not None:
        _draw(solution, plot, w, m_B)
    sys.exit(_EXIT[solution.status])


def _meaning(
    solution: "Solution", brief: bool, details: bool
) -> "tuple[Explanation | None, Robustness | None, tuple[Diagnosis, ...]]":
    """What an optimum leans on, how far its boundaries are, and how its multiple roots split, as far as asked for."""
    from tmsopt import diagnose, explain, robustness

    near = not brief and math.isfinite(solution.abscissa) and solution.status != "infeasible"
    split = (details or not brief) and solution.status == "optimal"
    return (
        None if brief else explain(solution),
        robustness(solution) if near else None,
        diagnose(solution) if split else (),
    )


def _solve_all(problem: "Problem", as_json: bool, starts: int | None, **options: Any) -> NoReturn:
    """Write all designs with a pattern, and end."""
    from tmsopt.solver.all_designs import MOST, solve_all

    with bad_input(), progress() as update:
        found = solve_all(problem, starts=starts or MOST, progress=update, **options)
    if as_json:
        write_json(problem.heading | found.to_json())
    else:
        from tmsopt.report.design import every_table

        click.echo(every_table(found))
    sys.exit(DONE if found.solutions else INFEASIBLE)


@click.command(epilog=_COMPARE_EXAMPLES)
@click.argument("file", type=click.Path(path_type=Path))
@_common
def compare(file: Path, as_json: bool, starts: int | None, seed: int, linear_solver: str) -> None:
    """Set the optimum of FILE beside the closed-form laws, and one formulation beside the other."""
    with bad_input():
        from tmsopt.design.files import load
        from tmsopt.design.problem import unasked
        from tmsopt.errors import InputError

        problem = nominal_of(load(file))
        if problem.pareto:
            raise InputError(unasked(problem))
    from tmsopt.paper.compare import compare as compare_design
    from tmsopt.report.comparison import comparison_table
    from tmsopt.solver.multistart import STARTS

    with progress() as update:
        comparison = compare_design(
            problem, starts=starts or STARTS, seed=seed, linear_solver=linear_solver, progress=update
        )
    if as_json:
        write_json(comparison.to_json())
    else:
        click.echo(comparison_table(comparison))
    sys.exit(_EXIT[comparison.design.status])


def _certified(solution: "Solution", seconds: float) -> "Solution":
    """The solution with its bound, within seconds."""
    from tmsopt.certificates.certify import certify

    with progress("second") as update:
        return certify(solution, seconds=seconds, progress=lambda done, most: update(round(done), round(most)))


def _given(context: click.Context) -> list[str]:
    """Options that were written on the command line."""
    written = click.core.ParameterSource.COMMANDLINE
    named = [p for p in context.command.params if p.name and context.get_parameter_source(p.name) == written]
    return [p.opts[0] for p in named]


def _scale(option: str, text: str, unit: str) -> float:
    """A positive length or mass of the command line."""
    from tmsopt.design.units import with_unit
    from tmsopt.errors import Fault, InputError

    try:
        try:
            value = float(text)
        except ValueError:
            value = with_unit(text, unit)
        if not 0 < value < float("inf"):
            raise ValueError(f"found {text}; accepted: a positive number of {unit}")
    except ValueError as error:
        raise InputError([Fault(str(error), (option,))]) from None
    return value


def _draw(solution: "Solution", path: Path, w: float, m_B: float) -> None:
    from tmsopt.critical_speeds.growth import growth
    from tmsopt.models import tms
    from tmsopt.plots.growth import growth_figure
    from tmsopt.plots.style import save
    from tmsopt.report.design import si_parameters

    if not math.isfinite(solution.abscissa):
        click.echo("--plot: nothing to draw, a root is at infinity", err=True)
        return
    unit = None
    if solution.problem.model is tms:
        si = si_parameters(solution, w, m_B)
        unit = (si["g"] * si["w"]) ** 0.5
    with saving("--plot", path):
        save(growth_figure(growth(solution), solution.problem.title, unit), path)
