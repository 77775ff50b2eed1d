"""What the rows of a study follow from, as plain data."""

from typing import Any

import numpy as np

from tmsopt.design.cases import Band
from tmsopt.design.problem import Problem
from tmsopt.study.batch.plan import Study


def definition(study: Study) -> dict[str, Any]:
    """Everything that the rows of a study follow from, for ``json.dumps``; titles and notes are left out.

    Two studies with equal definitions have equal rows, solved by the same versions. A grid is given by its axes. The
    order of names in ``order`` counts as well: starts are spread over the free parameters in turn.
    """
    return {
        "problem": _problem(study.problem),
        **_columns(study),
        "seed": study.seed,
        "starts": study.starts,
        "warm": study.warm,
        "report": list(study.report),
    }


def _columns(study: Study) -> dict[str, Any]:
    if study.grid_shape is None:
        return {"columns": {name: list(column) for name, column in study.columns.items()}}
    sizes = tuple(study.grid_shape.values())
    axes = {}
    for axis, (name, column) in enumerate(study.columns.items()):
        values = np.moveaxis(np.asarray(column).reshape(sizes), axis, 0)
        axes[name] = values.reshape(sizes[axis], -1)[:, 0].tolist()
    return {"grid": axes, "axes": list(axes)}


def _problem(problem: Problem) -> dict[str, Any]:
    asked = {"minimize": problem.minimize, "maximize": problem.maximize, "locate": problem.locate}
    tables: dict[str, dict[str, Any]] = {
        "fixed": _floats(problem.fixed),
        "free": {name: [float(low), float(high)] for name, (low, high) in problem.free.items()},
        "constraints": dict(problem.constraints),
        "scenarios": {name: _scenario(s) for name, s in problem.variations.items()},
        "tolerances": _floats(problem.tolerances),
        "weights": _floats(problem.weights),
        "start": _floats(problem.start),
    }
    return {
        "model": problem.model.name if problem.model.statement is None else dict(problem.model.statement),
        "parameters": problem.parameter_set.name,
        "objective": {sense: text for sense, text in asked.items() if text is not None},
        **tables,
        "order": {name: list(table) for name, table in tables.items() if len(table) > 1 and name != "fixed"},
    }


def _floats(table: Any) -> dict[str, float]:
    return {name: float(value) for name, value in table.items()}


def _scenario(scenario: Band | tuple[float, ...]) -> Any:
    if isinstance(scenario, Band):
        return {"min": float(scenario.min), "max": float(scenario.max), "points": scenario.points}
    return [float(value) for value in scenario]
