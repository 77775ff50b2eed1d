"""`tmsopt solve`: the best design, all designs with a pattern, or a front."""

import math
from dataclasses import replace
from functools import partial
from typing import Any

import click

import tmsopt
from tmsopt.cli.answers import Reply, make_document
from tmsopt.cli.command import OnFile, WithCsv, WithIpopt, WithPage, WithPlot, option
from tmsopt.cli.ending import INFEASIBLE, INTERRUPTED, STATUSES
from tmsopt.cli.problems import parse_number
from tmsopt.cli.terminal import progress_listener
from tmsopt.errors import MOST_POINTS, MOST_STARTS, input_error

_KEYS = (
    "schema title model status objective parameters units abscissa abscissa_realised stable any_stable verdict growth "
    "verdict_is_exact multiplicity_is_exact defective geometric_multiplicity roots eigenfrequencies structure active "
    "violations missed_as_stored bound starts seconds inertia_margin relaxation worst_case notes interrupted"
)
"""Keys of JSON without --full: the contract."""

_FRONT = "is for one design, and the file asks for a front; write minimize with one of the expressions"
_NO_FRONT = 'is for a front; write pareto = ["abscissa", "Fr"] under [objective], or leave the option out'
_ALL = "is for one design, and --all looks for all of them; leave one of the two out"
_SCALED = "scales one design, and the file asks for a front; write the problem in SI instead"
_NOT_SCALED = "scales a dimensionless bicycle, and the file is not one; leave it out"


def _parse_seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if 0 < seconds < math.inf:
        return seconds
    accepted = "a positive number of seconds, or none. Write FILE before --certify."  # which may have taken it
    raise click.BadParameter(f"found {text!r}; accepted: {accepted}")


class SolveCommand(WithIpopt, WithCsv, WithPage, WithPlot, OnFile):
    """Find the best design that FILE asks for, or the front of the best ones.

    Examples:
      tmsopt solve problems/ep4.toml --full
      tmsopt solve problems/realistic.toml --plot growth.png --certify 30
      tmsopt solve problems/pareto.toml --points 40 --csv front.csv

    Exit status: 0 solved, 2 bad input, 3 infeasible, 4 not converged.
    """

    over: str | None = option("Parameter that --plot draws over.")
    full: bool = option("Show everything, each part under its name.")
    certify: Any = option(
        "Prove the optimum.  [default: 60]", parse=_parse_seconds, metavar="[SECONDS]", is_flag=False, flag_value="60"
    )
    all: bool = option("Find all designs that have the pattern.")
    seconds: float | None = option("Time for --all.  [default: 60]", type=click.FloatRange(0, min_open=True))
    points: int | None = option("Points of a front.  [default: 25, or 12]", type=click.IntRange(2, MOST_POINTS))
    workers: int | None = option("Processes for a front.  [default: up to 4]", type=click.IntRange(1))
    wheelbase: str | None = option("Show SI for this wheelbase, e.g. 25cm.")
    rear_mass: str | None = option("Show SI for this rear mass m_B, e.g. 9kg.")
    starts: int | None = option("Most starts.  [default: 64, of a front 2]", type=click.IntRange(1, MOST_STARTS))

    def run(self) -> Reply:
        from tmsopt.problem import as_solvable

        scale = _parse_scale("--wheelbase", self.wheelbase, "m"), _parse_scale("--rear-mass", self.rear_mass, "kg")
        problem = as_solvable(self.file, front=True)
        is_scaled = problem.model.name == "tms" and problem.parameter_set.rate is None
        self.refuse_useless(
            (not self.all, "seconds", "is for the proof of --all; write --all too, or leave it out"),
            (not self.plot, "over", "says what --plot draws over; add --plot FILE, or leave it out"),
            (not problem.pareto, "points csv workers", _NO_FRONT),
            (self.all, "certify full over wheelbase rear_mass", _ALL),
            (problem.pareto, "certify over", _FRONT),
            (problem.pareto, "wheelbase rear_mass", _SCALED),
            (not is_scaled, "wheelbase rear_mass", _NOT_SCALED),
        )
        if self.certify:
            from tmsopt.proofs import check_installed

            check_installed()
        if self.all:
            designs = tmsopt.solve_all(problem, **self.search, **self.select("seconds"))
            data = problem.heading | designs.to_json()
            return Reply(designs, 0 if designs.solutions else INFEASIBLE, data)
        if not problem.pareto:
            solution = tmsopt.solve(problem, throw=False, **self.search)
            if self.certify and not solution.interrupted:
                solution = tmsopt.certify(solution, seconds=self.certify, progress=progress_listener())
            return self._show(solution, *scale)
        try:
            front = tmsopt.pareto(problem, **self.search, **self.select("points workers"))
        except tmsopt.NotSolved as error:
            return replace(self._show(error.solution, *scale), without="csv plot")
        figure = partial(tmsopt.plots.front_figure, front)
        status = INTERRUPTED if front.interrupted else 0
        return Reply(front, status, None, self._level, figure, page={"full": self.full})

    @property
    def _level(self) -> str:
        return "full" if self.full else "brief"

    def _show(self, solution: tmsopt.Solution, w: float, m_B: float) -> Reply:
        from tmsopt.documents import convert_to_si

        si = convert_to_si(solution, w, m_B)
        options = {"si": si} if self.wheelbase or self.rear_mass else {}
        try:
            shown = self._make_json(solution) if self.json else make_document(solution, self._level, **options)
        except KeyboardInterrupt:
            return self._show(replace(solution, interrupted=True), w, m_B)

        def draw() -> Any:
            speed = (si["g"] * si["w"]) ** 0.5 if solution.problem.model is tmsopt.models.tms else None
            growth = tmsopt.growth(solution, over=self.over, progress=progress_listener())
            return tmsopt.plots.growth_figure(growth, solution.problem.title, speed)

        without = "" if math.isfinite(solution.abscissa) else "plot"
        if self.plot and without:
            click.echo("--plot: nothing to draw, a root is at infinity", err=True)
        status = INTERRUPTED if solution.interrupted else STATUSES[solution.status]
        page = {"full": self.full}
        return Reply(solution, status, shown, draw=draw, page=page, without=without, shown=shown)

    def _make_json(self, solution: tmsopt.Solution) -> dict[str, Any]:
        """The keys of the contract; with --full all of them, and what the analysis finds."""
        data = solution.to_json()
        if not self.full:
            return {name: value for name, value in data.items() if name in _KEYS.split()}
        with solution.analysis.report_progress(progress_listener()) as analysis:
            found = {"meaning": analysis.full_explanation, "robustness": analysis.boundaries}
            data |= {name: value.to_json() for name, value in found.items() if value}
            diagnoses = [diagnosis.to_json() for diagnosis in analysis.diagnoses]
        return data | ({"diagnosis": diagnoses} if diagnoses else {})


def _parse_scale(option: str, text: str | None, unit: str) -> float:
    """A positive length or mass; 1 if the option is left out."""
    value = parse_number(text or "1", unit, option)
    if not 0 < value < math.inf:
        raise input_error(f"found {text}; accepted: a positive number of {unit}", option)
    return value
