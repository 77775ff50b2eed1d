"""Commands about designs: `tmsopt solve`, `explore`, `compare`, `prove`, `diagnose`, `speeds`, `simulate`, `trace`."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import click

import tmsopt
from tmsopt.cli.answers import PAGE_ENDINGS, Reply, check_output, make_document, report_writing
from tmsopt.cli.command import (
    OnFile,
    WithCsv,
    WithIpopt,
    WithPage,
    WithPlot,
    WithSearch,
    note_scenarios,
    option,
    parse_number,
    split_names,
    take_nominal,
)
from tmsopt.cli.ending import INFEASIBLE, INTERRUPTED, NOT_CONVERGED, STATUSES, hold_signals
from tmsopt.cli.terminal import progress_listener
from tmsopt.errors import MOST_POINTS, MOST_STARTS, input_error

_KEYS = (
    "schema title model status objective parameters units abscissa abscissa_realised stable any_stable verdict growth "
    "verdict_is_exact multiplicity_is_exact defective geometric_multiplicity roots eigenfrequencies structure active "
    "violations missed_as_stored conditions bound starts seconds inertia_margin relaxation worst_case notes interrupted"
)
"""Keys of the JSON without --full, which other programs rely on."""

_NOT_FOR_A_FRONT = "is for one design, and the file asks for a front; write minimize with one of the expressions"
_ONLY_FOR_A_FRONT = 'is for a front; write pareto = ["abscissa", "Fr"] under [objective], or leave the option out'
_NOT_WITH_ALL = "is for one design, and --all finds all designs; leave one of the two out"
_NO_SCALE_FOR_A_FRONT = "scales one design, and the file asks for a front; write the problem in SI units instead"
_ONLY_DIMENSIONLESS = "scales a dimensionless bicycle, and the file has none; leave the option out"


def _parse_seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if 0 < seconds < math.inf:
        return seconds
    # The text may be FILE, if it stands after --certify.
    accepted = "a positive number of seconds, or no number at all. Write FILE before --certify."
    raise click.BadParameter(f"found {text!r}; accepted: {accepted}")


class SolveCommand(WithIpopt, WithCsv, WithPage, WithPlot, OnFile):
    """Find the best design for the problem in FILE, or a Pareto front.

    Examples:
      tmsopt solve problems/ep4.toml --full
      tmsopt solve problems/realistic.toml --plot growth.png --certify 30
      tmsopt solve problems/pareto.toml --points 40 --csv front.csv

    Exit status: 0 solved, 2 bad input, 3 infeasible, 4 not converged.
    """

    over: str | None = option("Parameter on the horizontal axis of --plot.")
    full: bool = option("Show all results, each under a heading.")
    certify: Any = option(
        "Prove the optimum.  [default time: 60 s]",
        type=_parse_seconds,
        metavar="[SECONDS]",
        is_flag=False,
        flag_value="60",
    )
    all: bool = option("Find all designs with the root pattern.")
    seconds: float | None = option("Time limit of --all in s.  [default: 60]", type=click.FloatRange(0, min_open=True))
    points: int | None = option("Points of a front.  [default: 25 or 12x12]", type=click.IntRange(2, MOST_POINTS))
    workers: int | None = option("Processes for a front.  [default: up to 4]", type=click.IntRange(1))
    wheelbase: str | None = option("Also show SI units; wheelbase, e.g. 25cm.")
    rear_mass: str | None = option("Also show SI units; rear mass m_B, e.g. 9kg.")
    starts: int | None = option("Starts at most.  [default: 64; 2 for a front]", type=click.IntRange(1, MOST_STARTS))

    def run(self) -> Reply:
        from tmsopt.problem import as_solvable

        scale = _parse_scale("--wheelbase", self.wheelbase, "m"), _parse_scale("--rear-mass", self.rear_mass, "kg")
        problem = as_solvable(self.file, allows_front=True)
        is_dimensionless = problem.model.name == "tms" and problem.parameter_set.rate is None
        self.refuse_useless(
            (not self.all, "seconds", "limits the time of --all; add --all, or leave the option out"),
            (not self.plot, "over", "is the horizontal axis of --plot; add --plot FILE, or leave the option out"),
            (not problem.pareto, "points csv workers", _ONLY_FOR_A_FRONT),
            (self.all, "certify full over wheelbase rear_mass", _NOT_WITH_ALL),
            (problem.pareto, "certify over", _NOT_FOR_A_FRONT),
            (problem.pareto, "wheelbase rear_mass", _NO_SCALE_FOR_A_FRONT),
            (not is_dimensionless, "wheelbase rear_mass", _ONLY_DIMENSIONLESS),
        )
        if self.certify:
            from tmsopt.proofs import check_installed

            check_installed()
        if self.all:
            designs = tmsopt.solve_all(problem, **self.search, **self.select("seconds"))
            return Reply(designs, 0 if designs.solutions else INFEASIBLE, problem.heading | designs.to_json())
        if problem.pareto:
            try:
                front = tmsopt.pareto(problem, **self.search, **self.select("points workers"))
            except tmsopt.NotSolved as error:
                return replace(self._show(error.solution, *scale), skipped_options="csv plot")
            figure = partial(tmsopt.plots.front_figure, front)
            status = INTERRUPTED if front.interrupted else 0
            return Reply(front, status, None, self._level, figure)
        solution = tmsopt.solve(problem, throw=False, **self.search)
        if self.certify and not solution.interrupted:
            solution = tmsopt.certify(solution, seconds=self.certify, progress=progress_listener())
        return self._show(solution, *scale)

    @property
    def _level(self) -> str:
        return "full" if self.full else "brief"

    def _show(self, solution: "tmsopt.Solution", w: float, m_B: float) -> Reply:
        from tmsopt.documents import convert_to_si

        si = convert_to_si(solution, w, m_B)
        options = {"si": si} if self.wheelbase or self.rear_mass else {}
        try:
            answer = self._make_json(solution) if self.json else make_document(solution, self._level, **options)
        except KeyboardInterrupt:
            return self._show(replace(solution, interrupted=True), w, m_B)

        def draw() -> Any:
            speed_unit = (si["g"] * si["w"]) ** 0.5 if solution.problem.model is tmsopt.models.tms else None
            growth = tmsopt.growth(solution, over=self.over, progress=progress_listener())
            return tmsopt.plots.growth_figure(growth, solution.problem.title, speed_unit)

        skipped_options = "" if math.isfinite(solution.abscissa) else "plot"
        if self.plot and skipped_options:
            click.echo("--plot: nothing to draw, a root is at infinity", err=True)
        status = INTERRUPTED if solution.interrupted else STATUSES[solution.status]
        return Reply(solution, status, answer, self._level, draw, skipped_options=skipped_options, content=answer)

    def _make_json(self, solution: "tmsopt.Solution") -> dict[str, Any]:
        """The JSON of a solution: the keys of `_KEYS`; with --full all keys, and the results of the analysis."""
        data = solution.to_json()
        if not self.full:
            return {name: value for name, value in data.items() if name in _KEYS.split()}
        with solution.analysis.report_progress(progress_listener()) as analysis:
            sections = {"meaning": analysis.full_explanation, "robustness": analysis.boundaries}
            data |= {name: value.to_json() for name, value in sections.items() if value}
            diagnoses = [diagnosis.to_json() for diagnosis in analysis.diagnoses]
        return data | ({"diagnosis": diagnoses} if diagnoses else {})


def _parse_scale(flag: str, text: str | None, unit: str) -> float:
    """A positive length or mass; 1 if the option is left out."""
    value = parse_number(text or "1", unit, flag)
    if not 0 < value < math.inf:
        raise input_error(f"found {text}; accepted: a positive number of {unit}", flag)
    return value


class ExploreCommand(WithSearch, OnFile):
    """Write a page for a browser: sliders, chart, roots, growth rates, the bicycle in motion.

    Examples:
      tmsopt explore problems/ep4.toml
      tmsopt explore problems/delivery_robot.toml --output robot.html --open

    Exit status: 0 done (whatever the search found), 2 bad input.
    """

    output: Path | None = option("The page.  [default: FILE with ending .html]", None, "-o")
    open: bool = option("Show the page in a browser.")

    def run(self) -> None:
        path = self.output or Path(f"{self.file.stem}.html")
        check_output("--output", path, PAGE_ENDINGS)
        page = tmsopt.explore(self.file, **self.search)
        with hold_signals(), report_writing("--output", path):
            page.save(path)
        if page.solution is not None and page.solution.status != "optimal":
            status = page.solution.status.replace("_", " ")
            click.echo(f"{status}: the page opens with the design nearest to a solution", err=True)
        if self.open and not import_module("webbrowser").open(path.resolve().as_uri()):
            click.echo(f"no browser was found here; open {path} in a browser", err=True)


class CompareCommand(WithIpopt, WithPlot, OnFile):
    """Compare the optimum of FILE with the closed-form laws, and two formulations
    of the problem with each other.

    Examples:
      tmsopt compare problems/ep4.toml
      tmsopt compare problems/optimised_benchmark.toml --json

    Exit status: 0 solved, 2 bad input, 3 infeasible, 4 not converged.
    """

    def run(self) -> Reply:
        from tmsopt.problem import as_solvable

        comparison = tmsopt.compare(take_nominal(as_solvable(self.file)), **self.search)
        return Reply(comparison, STATUSES[comparison.design.status])


class ProveCommand(WithSearch, WithPage, WithPlot, OnFile):
    """Prove that the solution of FILE exists, and decide if it is stable and heavily damped.

    Examples:
      tmsopt prove problems/ep4.toml --report proof.html
      tmsopt prove problems/optimised_benchmark.toml --digits 60
      tmsopt prove problems/heavily_damped.toml --exact "lambda_s=10 deg"

    Exit status: 0 proved, 2 bad input, 3 no design found, 4 not proved.
    """

    digits: int = option("Digits of all numbers.", 30, type=click.IntRange(1, 1000))
    exact: Mapping[str, str] = option("Exact value of a parameter.", metavar="NAME=VALUE", example="zeta_B=-1/3")

    def run(self) -> Reply:
        solution = tmsopt.solve(self.file, throw=False, interruptible=False, **self.search)
        proof = tmsopt.prove(solution, self.digits, exact=self.exact, progress=progress_listener())
        status = 0 if proof.proved else NOT_CONVERGED if solution.status == "optimal" else INFEASIBLE
        data = solution.problem.posed.heading | {"status": solution.status} | proof.to_json()
        return Reply(proof, status, data, page={"design": solution})


class DiagnoseCommand(WithSearch, WithCsv, WithPlot, OnFile):
    """Show how each multiple root of the solution of FILE splits, and how
    sensitive all eigenvalues are.

    Examples:
      tmsopt diagnose problems/ep4.toml
      tmsopt diagnose problems/pt_pair.toml --plot splitting.png
      tmsopt diagnose problems/pt_trimer.toml --over gain --plot petermann.png

    Exit status: 0 done, 2 bad input, 3 infeasible, 4 not converged.
    """

    over: str | None = option("Show roots and Petermann factors over a parameter.", metavar="NAME")

    def run(self) -> Reply:
        self.refuse_useless((not self.over, "csv", "writes Petermann factors over a parameter; add --over NAME"))
        solution = tmsopt.solve(self.file, **self.search)
        diagnoses = tmsopt.diagnose(solution, progress=progress_listener())
        eigenvalues = tmsopt.eigenvalues(solution)
        data = {"status": solution.status, "diagnoses": [diagnosis.to_json() for diagnosis in diagnoses]}
        data = solution.problem.posed.heading | data | eigenvalues.to_json()
        is_multiple = any(s.multiplicity > 1 for s in eigenvalues.entries)
        reason = "the matrices are too large to show how a root splits" if is_multiple else "no root is multiple"
        content = [*(diagnoses or [reason]), eigenvalues]
        if self.over:
            growth = tmsopt.growth(solution, over=self.over, petermann=True, progress=progress_listener())
            draw = partial(tmsopt.plots.growth_figure, growth)
            return Reply(growth, 0, data | {"over": growth.to_json()}, "full", draw, content=[*content, growth])
        if self.plot and not diagnoses:
            click.echo(f"--plot: nothing to draw, {reason}", err=True)
        result, skipped_options = (diagnoses[0], "") if diagnoses else (eigenvalues, "plot")
        return Reply(result, 0, data, "full", content=content, skipped_options=skipped_options)


def _parse_range(text: str) -> tuple[float, float]:
    try:
        low, high = map(float, text.split(","))
    except ValueError:
        raise click.BadParameter(f"found {text!r}; accepted: two numbers, as in 0,12") from None
    return low, high


class SpeedsCommand(WithPlot, OnFile):
    """Find exactly every weave and capsize speed of FILE, and every speed at which roots meet.

    Examples:
      tmsopt speeds problems/whipple_benchmark.toml
      tmsopt speeds problems/whipple_benchmark.toml --parameter c --between -0.2,0.3
      tmsopt speeds problems/ep4.toml --plot speeds.png

    Exit status: 0 done, 2 bad input, 3 infeasible, 4 not converged.
    """

    parameter: str | None = option("Parameter that varies.  [default: the speed]", metavar="NAME")
    between: Any = option("Range to search.  [default: all]", type=_parse_range, metavar="LOW,HIGH")

    def run(self) -> Reply:
        problem = tmsopt.load(self.file)
        note_scenarios(problem.posed, [self.parameter] if self.parameter else ("v", "Fr"))
        return Reply(tmsopt.speeds(problem, self.parameter, between=self.between, progress=progress_listener()))


class SimulateCommand(WithCsv, WithPage, WithPlot, OnFile):
    """Show how the design of FILE moves after a lean or a push, or under noise.

    Examples:
      tmsopt simulate problems/whipple_benchmark.toml --lean 5 --plot motion.png
      tmsopt simulate problems/ep4.toml --push 0.001 --json
      tmsopt simulate problems/gain_schedule.toml --at v=1.5
      tmsopt simulate problems/ziegler.toml --start q2=0.1

    Exit status: 0 done (stable or not), 2 bad input, 3 infeasible, 4 not converged.
    """

    lean: float | None = option("Lean angle to the right at the start.", metavar="DEGREES")
    steer: float | None = option("Steer angle to the right at the start.", metavar="DEGREES")
    push: float | None = option("Impulse of steer torque, in N m s.", metavar="IMPULSE")
    lean_push: float | None = option("Impulse of lean torque, in N m s.", metavar="IMPULSE")
    start: Mapping[str, float] = option(
        "A state at the start, in rad and s.", metavar="NAME=VALUE", example="phidot=0.1"
    )
    at: Mapping[str, float] = option("Another value of a parameter, in SI.", metavar="NAME=VALUE", example="v=1.5")
    noise: float | None = option("Noise of steer torque, in N m sqrt(s).", metavar="INTENSITY")
    seed: int = option("Seed of the noise.", 0, type=click.IntRange(0))
    seconds: float | None = option("Seconds.  [default: until settled or grown]")
    points: int = option("Number of times in the table.", 1001, type=click.IntRange(2, 1_000_000))
    path: bool = option("Add torques and paths of the wheels to --csv.")

    def run(self) -> Reply:
        self.refuse_useless((not self.csv, "path", "changes what --csv writes; add --csv FILE"))
        problem = tmsopt.load(self.file)
        note_scenarios(problem.posed, self.at)
        options = self.select("lean steer push lean_push noise seed seconds points")
        states: Any = {"start": self.start or None, "at": self.at or None}
        motion = tmsopt.simulate(problem, **states, **options, progress=progress_listener())
        draw = partial(tmsopt.plots.motion_figure, motion)
        return Reply(motion, draw=draw, write_csv=partial(motion.write_csv, whole=self.path))


class TraceCommand(WithSearch, WithCsv, WithPage, WithPlot, OnFile):
    """Trace a root pattern of FILE through parameter space: every branch, with its events.

    Examples:
      tmsopt trace problems/ep_set.toml
      tmsopt trace problems/ep_set.toml --plot ep_set.png --axes Fr,lambda_s
      tmsopt trace problems/off_law.toml --pattern weave --csv weave.csv

    Exit status: 0 traced, 2 bad input, 3 pattern not found in the ranges.
    """

    pattern: str | None = option("Root pattern.  [default: that in FILE]")
    axes: Any = option("Axes of --plot, e.g. Fr,chi_B.", type=split_names, metavar="NAMES")
    step: float = option("Longest step, as a fraction of the ranges.", 0.005, type=click.FloatRange(1e-6, 0.1))
    starts: int = option("Stop after so many starts in a row without a find.", 48, type=click.IntRange(1, MOST_STARTS))

    def run(self) -> Reply:
        self.refuse_useless((not self.plot, "axes", "changes what --plot draws; add --plot FILE"))
        problem = take_nominal(tmsopt.load(self.file).posed)
        if self.axes:
            _check_plane(self.axes, problem.free)
        result = tmsopt.trace(problem, self.pattern, step=self.step, **self.search)
        if not result.branches:
            click.echo(f"no {result.pattern} found within the ranges; widen them, or try more --starts", err=True)
            return Reply(result, INFEASIBLE, skipped_options="csv plot")
        axes = self.axes or result.varying[:2]
        if self.plot:
            _check_plane(axes, problem.free)
        return Reply(result, draw=partial(tmsopt.plots.trace_figure, result, *axes))


def _check_plane(names: Sequence[str], free: Mapping[str, Any]) -> None:
    """Check that the names are two different free parameters."""
    if len(names) != 2 or len({*names}) != 2 or not {*names} <= {*free}:
        names_text, accepted = ", ".join(names), ", ".join(free)
        raise input_error(f"found {names_text}; accepted: two of the free parameters ({accepted})", "--axes")
