"""A study as data: a problem, and values that vary from row to row."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tmsopt.errors import (
    MOST_STARTS,
    Fault,
    InputError,
    count_faults,
    input_error,
    limit_advice,
    list_faults,
    short,
    suggest,
    table_faults,
    text_faults,
)
from tmsopt.models.expression import ExpressionError
from tmsopt.problem.cases import Band
from tmsopt.problem.files import ProblemSource, pose
from tmsopt.problem.freedom import find_objective_faults
from tmsopt.problem.limit import limit_value, replace_limit
from tmsopt.problem.problem import Posed, Problem
from tmsopt.program.options import STARTS
from tmsopt.records import Array, Column, Table
from tmsopt.studies.sampling import MAX_ROWS, column_of_numbers, grid

_SEED_COUNT = 2**31


@dataclass(frozen=True)
class Study:
    """A problem and values that vary from row to row; see `load_study` for its file form.

    Attributes:
        problem: the problem of every row. Its values of the varied names are replaced by those of the columns.
        columns: name → its value in every row (rad, SI units); all have the same length. A name is a fixed parameter,
            ``lambda_s.min`` or ``lambda_s.max`` of a free one, or ``trail.limit``, the number in the constraint
            ``trail``.
        title: one line for reports.
        seed: seed from which the seeds of the rows follow.
        starts: largest number of starts of a row.
        warm: whether each row starts at the optimum of its neighbour.
        report: expressions recorded for every row, in addition to parameters and abscissa.
        grid_shape: for a full grid, axis → number of values, in the order of the columns; the last axis changes
            fastest. None for other studies.
        method: how the columns were made (grid, list, latin_hypercube, sobol, csv, monte_carlo); does not affect rows.
        notes: sentences for the reader of a report.

    Raises:
        InputError: listing all faults with the accepted values.

    Example:
        >>> study = tmsopt.over_grid("problems/ep4.toml", {"mu": [0.1, 0.2], "zeta_H": [-0.2, -0.3]})
        >>> list(study.columns["mu"]), list(study.columns["zeta_H"])
        ([0.1, 0.1, 0.2, 0.2], [-0.2, -0.3, -0.2, -0.3])

    More: docs/reference/study_file.md
    """

    problem: Problem
    columns: Mapping[str, Sequence[float]] = Table()
    title: str = ""
    seed: int = 0
    starts: int = STARTS
    warm: bool = False
    report: Sequence[str] = ()
    grid_shape: Mapping[str, int] | None = None
    method: str = "list"
    notes: Sequence[str] = ()

    def __post_init__(self) -> None:
        if found_faults := list(find_faults(self)):
            raise InputError(found_faults)
        vars(self).update(
            columns=Table({name: Column(values) for name, values in self.columns.items()}),
            report=tuple(dict.fromkeys(text.strip() for text in self.report)),
            notes=tuple(self.notes),
            grid_shape=self.grid_shape and Table(self.grid_shape),
        )

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    @property
    def axes(self) -> dict[str, Array]:
        """Axis of a full grid → its values in order; empty for other studies."""
        axes, stride = {}, len(self)
        for name, size in (self.grid_shape or {}).items():
            stride //= size
            axes[name] = np.asarray(self.columns[name])[: size * stride : stride]
        return axes

    def varied(self, row: int) -> Table[float]:
        """The varied values of a row, counted from 0.

        Raises:
            InputError: for a row number outside the study.
        """
        if not 0 <= row < len(self):
            message = f"found {row}; accepted: 0 to {len(self) - 1}, because the study has {len(self)} rows"
            raise input_error(message, "row")
        return Table({name: column[row] for name, column in self.columns.items()})

    def row_problem(self, row: int) -> Problem:
        """The problem of a row; a start value outside the bounds of the row is moved to the nearer bound.

        Raises:
            InputError: for an invalid problem, such as one with lambda_s.min above lambda_s.max.
        """
        problem = self.problem
        fixed, free, constraints = dict(problem.fixed), dict(problem.free), dict(problem.constraints)
        for name, value in self.varied(row).items():
            stem, _, end = name.rpartition(".")
            if not stem:
                fixed[name] = value
            elif end == "limit":
                constraints[stem] = replace_limit(constraints[stem], value)
            else:
                low, high = free[stem]
                free[stem] = (value, high) if end == "min" else (low, value)
        start = {name: float(np.clip(value, *free[name])) for name, value in problem.start.items()}
        return replace(problem, fixed=fixed, free=free, constraints=constraints, start=start)

    def seed_of(self, row: int) -> int:
        """The seed of a row's starts; it depends on this row only, so that a single row can be solved."""
        state = np.random.SeedSequence(self.seed, spawn_key=(row,)).generate_state(1)
        return int(state[0]) % _SEED_COUNT


def over_grid(
    problem: ProblemSource,
    axes: Mapping[str, Sequence[float]],
    *,
    title: str = "",
    seed: int = 0,
    starts: int = STARTS,
    warm: bool = False,
    report: Sequence[str] = (),
) -> Study:
    """The study of every combination of the axes' values; the last axis changes fastest.

    Raises:
        InputError: listing all faults.

    Example:
        >>> study = tmsopt.over_grid("problems/ep4.toml", {"mu": [0.1, 0.2, 0.3], "zeta_H": [-0.2, -0.3]})
        >>> study.grid_shape, len(study.columns["mu"])
        ({'mu': 3, 'zeta_H': 2}, 6)

    More: docs/reference/study_file.md
    """
    if axis_faults := table_faults("axes", axes, "{'mu': [0.1, 0.2]}"):
        raise InputError(axis_faults)
    return Study(
        problem=pose(problem).problem,
        columns=grid(axes),
        title=title,
        seed=seed,
        starts=starts,
        warm=warm,
        report=report,
        grid_shape={name: len(values) for name, values in axes.items()},
        method="grid",
    )


def definition(study: Study, convert_column: Callable[[Sequence[float]], Any] = list) -> dict[str, Any]:
    """Everything that determines the rows of a study, for ``json.dumps``.

    Two studies with equal definitions, solved by the same versions, have equal rows. A grid is stored as its axes. The
    definition includes the order of names, because starts depend on the order of the free parameters.

    Args:
        convert_column: converts a column of a study that is not a grid. A list takes four times the memory of an array.
    """
    if study.grid_shape is None:
        columns: dict[str, Any] = {"columns": {name: convert_column(values) for name, values in study.columns.items()}}
    else:
        columns = {"grid": {name: values.tolist() for name, values in study.axes.items()}, "axes": list(study.axes)}
    return {
        "problem": _describe_problem(study.problem),
        **columns,
        "seed": int(study.seed),
        "starts": int(study.starts),
        "warm": study.warm,
        "report": list(study.report),
    }


def _describe_problem(problem: Problem) -> dict[str, Any]:
    names = ("fixed", "constraints", "tolerances", "weights", "start")
    tables: dict[str, dict[str, Any]] = {name: dict(getattr(problem, name)) for name in names}
    tables["free"] = {name: list(ends) for name, ends in problem.free.items()}
    tables["scenarios"] = {
        name: {"min": float(s.min), "max": float(s.max), "points": s.points} if isinstance(s, Band) else list(s)
        for name, s in problem.scenarios.items()
    }
    goals = {sense: getattr(problem, sense) for sense in ("minimize", "maximize", "locate")}
    return {
        "model": problem.model.name if problem.model.statement is None else dict(problem.model.statement),
        "parameters": problem.posed.parameter_set.name,
        "objective": {sense: text for sense, text in goals.items() if text is not None},
        **tables,
        "order": {name: list(table) for name, table in tables.items() if len(table) > 1 and name != "fixed"},
    }


# Faults of a study


MAX_REPORT_EXPRESSIONS = 1000
"""Largest number of expressions recorded for every row."""

METHODS = ("grid", "list", "latin_hypercube", "sobol", "csv", "monte_carlo")
"""Methods of making the rows of a study."""

UncheckedStudy = Any
"""A Study before validation: any field may be of any type."""


def find_faults(study: UncheckedStudy) -> Iterator[Fault]:
    """All faults of a study before validation."""
    if not isinstance(study.problem, Problem):
        message = f"found {short(study.problem)}; accepted: a Problem, such as tmsopt.load('problems/least_speed.toml')"
        yield Fault(message, ("problem",))
        return
    yield from (Fault(f.message, ("problem", *f.key)) for f in find_objective_faults(study.problem.posed))
    if isinstance(study.columns, Mapping):
        yield from _column_faults(study)
    else:
        accepted = "varied names with a value for every row, such as {'mu': [0.1, 0.2]}"
        yield Fault(f"found {short(study.columns)}; accepted: {accepted}", ("columns",))
    yield from _option_faults(study)


def variable_names(problem: Posed) -> tuple[str, ...]:
    """Names that may vary from row to row in a study of a problem."""
    fixed = tuple(n for n in problem.parameter_set.names if n in problem.fixed and n not in problem.scenarios)
    ends = tuple(f"{n}.{end}" for n in problem.parameter_set.names if n in problem.free for end in ("min", "max"))
    limits = tuple(f"{n}.limit" for n, text in problem.constraints.items() if limit_value(text) is not None)
    return fixed + ends + limits


def build_name_check(problem: Posed) -> Callable[[Any], str]:
    """Build a function that says why a name cannot vary; its text is empty for a name that can."""
    accepted, advice = variable_names(problem), limit_advice(suggest)

    def check_name(name: Any) -> str:
        if name in accepted:
            return ""
        stem, _, end = str(name).rpartition(".")
        if name in problem.free:
            return f"{name} is free, so each row finds its own value; fix it, or vary {name}.min or {name}.max"
        if name in problem.scenarios:
            return f"{name} has a scenario, which is the same for every row; remove the scenario to vary {name}"
        if end in ("min", "max") and stem in problem.fixed:
            return f"{stem} is fixed, so it has no {end}; vary {stem} itself, or free it"
        if end == "limit" and stem in problem.constraints:
            text = problem.constraints[stem]
            return f"neither side of '{text}' is a number; write the constraint with a number alone on one side"
        return f"unknown name {short(name)}; {advice(str(name), accepted)}"

    return check_name


def _column_faults(study: UncheckedStudy) -> Iterator[Fault]:
    if not study.columns:
        accepted = " ".join(variable_names(study.problem.posed))
        yield Fault(f"nothing varies; give at least one column; accepted: {accepted}", ("columns",))
        return
    lengths: dict[str, int] = {}
    check_name = build_name_check(study.problem.posed)
    for name, values in study.columns.items():
        key, column = ("columns", str(name)), column_of_numbers(values)
        if message := check_name(name):
            yield Fault(message, key)
        if column is None:
            yield Fault(f"found {short(values)}; accepted: a list of numbers, such as [0.1, 0.2]", key)
            continue
        lengths[name] = len(column)
        if bad_rows := np.flatnonzero(~np.isfinite(column)).tolist():
            suffix = f" and {len(bad_rows) - 1} more rows" if len(bad_rows) > 1 else ""
            yield Fault(f"found {column[bad_rows[0]]} in row {bad_rows[0]}{suffix}; accepted: finite numbers", key)
    row_count = next(iter(lengths.values()), 1)
    if set(lengths.values()) - {row_count}:
        text = ", ".join(f"{name} has {length}" for name, length in lengths.items())
        yield Fault(f"columns of different lengths: {text}; give every column one value per row", ("columns",))
    elif not 1 <= row_count <= MAX_ROWS:
        yield Fault(f"found {row_count} rows; accepted: 1 to {MAX_ROWS}", ("columns",))
    elif study.grid_shape is not None and len(lengths) == len(study.columns) and not _fills_grid(study):
        accepted = f"a size for each column in order ({', '.join(study.columns)}); the last axis changes fastest"
        message = f"found {short(study.grid_shape)} for {row_count} rows; accepted: {accepted}; see over_grid"
        yield Fault(message, ("grid_shape",))


def _fills_grid(study: UncheckedStudy) -> bool:
    """Whether the columns agree with the shape of the grid."""
    shape = study.grid_shape
    if not isinstance(shape, Mapping) or list(shape) != list(study.columns):
        return False
    if any(count_faults("points", n, 1) for n in shape.values()) or math.prod(shape.values()) != len(study):
        return False
    return all(np.array_equal(column, study.columns[name]) for name, column in grid(study.axes).items())


def _option_faults(study: UncheckedStudy) -> Iterator[Fault]:
    if not isinstance(study.method, str) or study.method not in METHODS:
        yield Fault(f"found {short(study.method)}; {suggest(study.method, METHODS)}", ("method",))
    if not isinstance(study.warm, bool):
        yield Fault(f"found {short(study.warm)}; accepted: true or false", ("warm",))
    notes = list_faults("notes", study.notes, "['left out: the lamp']")
    yield from notes or (fault for note in study.notes for fault in text_faults(note, "notes"))
    yield from text_faults(study.title, "title")
    yield from common_faults(study.problem.posed, study.seed, study.starts, study.report)


def common_faults(problem: Posed, seed: Any, starts: Any, report: Any) -> Iterator[Fault]:
    """Faults of the seed, the starts and the report of a study."""
    yield from count_faults("seed", seed, 0)
    yield from count_faults("starts", starts, 1, MOST_STARTS)
    if report_faults := list_faults("report", report, "['nu_H', '2*Fr_c']"):
        yield from report_faults
        return
    if len(report) > MAX_REPORT_EXPRESSIONS:
        yield Fault(f"found {len(report)} expressions; accepted: up to {MAX_REPORT_EXPRESSIONS}", ("report",))
        return
    for text in report:
        try:
            problem.read(text)
        except ExpressionError as error:
            yield Fault(str(error), ("report",))
