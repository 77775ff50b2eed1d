"""Everything that can be wrong with a study, each fault with its place and the accepted values."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from tmsopt.design.expression import ExpressionError
from tmsopt.design.limit import limit_of
from tmsopt.design.problem import Problem, unasked
from tmsopt.errors import MOST_STARTS, Fault, at_first, count_faults, list_faults, short, suggest, text_faults

MOST_ROWS = 10_000_000
"""Rows of a study; one with more is another kind of question, such as a chart."""

MOST_NUMBERS, MOST_REPORTED = 40_000_000, 1000
"""Numbers in all columns, which are held in memory; expressions recorded for every row."""

METHODS = ("grid", "list", "latin_hypercube", "sobol", "csv", "monte_carlo")
"""How the rows of a study are made."""

Stated = Any
"""A Study as its author stated it: any field may be of any type."""


def faults(study: Stated) -> Iterator[Fault]:
    """What is wrong with a study, everything at once."""
    if not isinstance(study.problem, Problem):
        message = f"found {short(study.problem)}; accepted: a Problem, such as tmsopt.load('problems/least_speed.toml')"
        yield Fault(message, ("problem",))
        return
    yield from (Fault(f.message, ("problem", *f.key)) for f in unasked(study.problem))
    if isinstance(study.columns, Mapping):
        yield from _column_faults(study)
    else:
        accepted = "what varies with its value in every row, such as {'mu': [0.1, 0.2]}"
        yield Fault(f"found {short(study.columns)}; accepted: {accepted}", ("columns",))
    yield from _option_faults(study)


def variable_names(problem: Problem) -> tuple[str, ...]:
    """What may vary from row to row of a study of a problem."""
    fixed = tuple(n for n in problem.parameter_set.names if n in problem.fixed and n not in problem.scenarios)
    ends = tuple(f"{n}.{end}" for n in problem.parameter_set.names if n in problem.free for end in ("min", "max"))
    limits = tuple(f"{n}.limit" for n, text in problem.constraints.items() if limit_of(text) is not None)
    return fixed + ends + limits


def name_faults(problem: Problem) -> Callable[[Any], str]:
    """Says why a name cannot vary, one after the other; empty where it can."""
    accepted, advice = variable_names(problem), at_first(suggest)

    def wrong(name: Any) -> str:
        if name in accepted:
            return ""
        stem, _, end = str(name).rpartition(".")
        if name in problem.free:
            return f"{name} is free, so each row finds its own; fix it, or vary {name}.min or {name}.max"
        if name in problem.scenarios:
            return (
                f"{name} has a scenario, which every row must do in; leave the scenario out to vary it from row to row"
            )
        if end in ("min", "max") and stem in problem.fixed:
            return f"{stem} is fixed, so it has no {end}; vary {stem} itself, or free it"
        if end == "limit" and stem in problem.constraints:
            text = problem.constraints[stem]
            return f"neither side of '{text}' is a number; write the constraint with a number alone on one side"
        return f"unknown name {short(name)}; {advice(str(name), accepted)}"

    return wrong


def _column_faults(study: Stated) -> Iterator[Fault]:
    columns = study.columns
    if not columns:
        accepted = " ".join(variable_names(study.problem))
        yield Fault(f"nothing varies; give at least one column, of: {accepted}", ("columns",))
    lengths: dict[str, int] = {}
    wrong_with = name_faults(study.problem)
    for name, values in columns.items():
        key = ("columns", str(name))
        if wrong := wrong_with(name):
            yield Fault(wrong, key)
        array = _numbers(values)
        if array is None:
            yield Fault(f"found {short(values)}; accepted: a list of numbers, such as [0.1, 0.2]", key)
            continue
        lengths[name] = len(array)
        if bad := np.flatnonzero(~np.isfinite(array)).tolist():
            more = f" and {len(bad) - 1} more rows" if len(bad) > 1 else ""
            yield Fault(f"found {array[bad[0]]} in row {bad[0]}{more}; accepted: finite numbers", key)
    if len(set(lengths.values())) > 1:
        found = ", ".join(f"{name} has {length}" for name, length in lengths.items())
        yield Fault(f"columns of different lengths: {found}; give every column one value per row", ("columns",))
    elif lengths:
        rows = next(iter(lengths.values()))
        if not 1 <= rows <= MOST_ROWS:
            yield Fault(f"found {rows} rows; accepted: 1 to {MOST_ROWS}", ("columns",))
        elif study.grid_shape is not None and len(lengths) == len(columns):
            yield from _shape_faults(study, rows)


def _numbers(values: Any) -> Any:
    """A column as an array of doubles; None where it is something else."""
    if isinstance(values, str | bytes | Mapping):
        return None
    try:
        array = np.asarray(values)
        if array.dtype.kind not in "fiu" and array.size:
            return None
        array = array.astype(np.float64)
    except (TypeError, ValueError, OverflowError):
        return None
    return array if array.ndim == 1 else None


def _shape_faults(study: Stated, rows: int) -> Iterator[Fault]:
    """Whether the columns are what the grid's shape says."""
    shape, key = study.grid_shape, ("grid_shape",)
    if not isinstance(shape, Mapping) or tuple(shape) != tuple(study.columns):
        found = tuple(shape) if isinstance(shape, Mapping) else shape
        yield Fault(
            f"found {short(found)}; accepted: an entry for each column in turn: {', '.join(study.columns)}", key
        )
        return
    sizes = tuple(shape.values())
    if any(count_faults("points", n, 1) for n in sizes) or math.prod(sizes) != rows:
        yield Fault(f"found {' x '.join(map(str, sizes))} for {rows} rows; accepted: sizes with that product", key)
        return
    for axis, (name, values) in enumerate(study.columns.items()):
        block = np.moveaxis(np.asarray(values, dtype=np.float64).reshape(sizes), axis, 0).reshape(sizes[axis], -1)
        if np.any(block != block[:, :1]):
            yield Fault(f"{name} is not that of a grid of this shape, the last axis fastest; see over_grid", key)


def _option_faults(study: Stated) -> Iterator[Fault]:
    yield from text_faults(study.title, "title")
    if not isinstance(study.method, str) or study.method not in METHODS:
        yield Fault(f"found {short(study.method)}; {suggest(str(study.method), METHODS)}", ("method",))
    if not isinstance(study.warm, bool):
        yield Fault(f"found {short(study.warm)}; accepted: true or false", ("warm",))
    yield from list_faults("notes", study.notes, "['left out: the lamp']") or (
        fault for note in study.notes for fault in text_faults(note, "notes")
    )
    yield from common_faults(study.problem, study.seed, study.starts, study.report)


def common_faults(problem: Problem, seed: Any, starts: Any, report: Any) -> Iterator[Fault]:
    """What is wrong with the seed, the starts and the report of a study."""
    yield from count_faults("seed", seed, 0)
    yield from count_faults("starts", starts, 1, MOST_STARTS)
    if isinstance(report, str) or not isinstance(report, Sequence):
        yield Fault(f"found {short(report)}; accepted: a list of expressions, such as ['nu_H', '2*Fr_c']", ("report",))
        return
    if len(report) > MOST_REPORTED:
        yield Fault(f"found {len(report)} expressions; accepted: up to {MOST_REPORTED}", ("report",))
        return
    for text in report:
        try:
            problem.read(text)
        except ExpressionError as error:
            yield Fault(str(error), ("report",))
