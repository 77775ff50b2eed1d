"""The data of a page: parameters with their ranges, constraints, designs, traced curves."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import starmap
from typing import Any

import numpy as np

from tmsopt.analysis import structure_line
from tmsopt.evaluation.recheck import FEASIBILITY_TOLERANCE
from tmsopt.explorer.designs import PageDesign
from tmsopt.explorer.javascript import Script, is_bicycle
from tmsopt.guide import exact_value, toml_key, toml_text
from tmsopt.models import Parameter, words_of
from tmsopt.models.user_spectrum import AXIS_TOLERANCE, eigenfrequencies
from tmsopt.problem import Posed, degrees_of_freedom, limit_value, unit_of
from tmsopt.problem.real_form import real_form
from tmsopt.problem.validate import MIN_SIZE
from tmsopt.records import Array
from tmsopt.tracing import domain, trace

_CURVE_STARTS = 8  # number of starts for a traced curve; the grid of the tracer finds curves that the starts miss
_CURVE_DIGITS = 5  # digits of a traced point
_MAX_CURVE_POINTS = 80  # points of a curve; a chart is about 400 pixels wide
_SPEEDS, _TILT = ("v", "Fr"), "lambda_s"
_DEFAULT_SLIDER_END = {"m": 0.5, "kg": 5.0, "kg m^2": 1.0, "rad": 0.5, "m/s": 5.0}
"""Unit → largest value of the slider for a fixed parameter that is 0; for other units this value is 1."""

_IMPULSE_UNIT = "m_B g w √(w/g)"
"""Unit of an impulse of torque, for a dimensionless bicycle of two masses on skates."""

_SHARED_PART = re.compile(r"\[(\d+)\]")  # reference to a part of a model that several formulas share
_MIDDLE_NOTE = "no problem was solved for this page, so the page opens in the middle of the ranges"


def make_page_data(
    problem: Posed, designs: Sequence[PageDesign], script: Script, model: Mapping[str, Any], trace_curves: bool
) -> dict[str, Any]:
    """The data of a page; numbers are in rad and SI units.

    Args:
        designs: the page opens with the first design if it is an answer, else in the middle of the ranges.
        script: the formulas of the page; they determine which quantities and constraints it can compute.
        model: the table [model] of the problem's file; empty if there is none.
        trace_curves: whether to trace the boundaries of stability in the plane of the chart.
    """
    parameter_set, has_answer = problem.parameter_set, bool(designs) and designs[0].is_answer
    start = {n: float(v) for n, v in (designs[0].parameters if has_answer else _compute_middle(problem)).items()}
    ranking = _sort_by_interest(problem)
    speeds = [n for n in parameter_set.names if n in _SPEEDS and problem.model.statement is None]  # only for bicycles
    goal = problem.minimize or problem.maximize or problem.locate or ""
    return {
        "title": problem.title,
        "model": problem.model.name,
        "modelTitle": ": ".join(filter(None, (problem.model.title, problem.model.omits))),
        "bicycle": is_bicycle(problem),
        "impulseUnit": _IMPULSE_UNIT if parameter_set.torque is None else "N·m·s",
        "words": dict(words_of(problem.model)),
        "rootUnit": unit_of(problem, "abscissa").text,
        "carrier": real_form(problem).carrier,
        "onAxis": AXIS_TOLERANCE,
        "smallest": MIN_SIZE,
        "parameters": [_describe_parameter(problem, p, start[p.name]) for p in parameter_set.parameters],
        "quantities": [
            {"name": q.name, "meaning": q.meaning, "share": q.share, **_describe_unit(problem, q.name)}
            for q in (*problem.model.quantities, *parameter_set.quantities)
        ],
        "constraints": [_describe_constraint(problem, n) for n in script.constraints],
        "objective": f"{problem.sense} {' '.join(goal.split())}" if goal else "",
        "designs": [_describe_design(problem, design) for design in designs],
        "start": [start[n] for n in parameter_set.names],
        "plane": [parameter_set.names.index(n) for n in ranking[:2]],
        "over": parameter_set.names.index((speeds or ranking)[0]),
        "curves": list(_trace_curves(problem, ranking[:2], start)) if trace_curves else [],
        "toml": surrounding_lines(problem, model),
        "others": [n for n in problem.conditions if n not in script.constraints],
        "nominal": problem.nominal is not problem,
        "shown": [_MIDDLE_NOTE] if problem.free and not has_answer else [],
    }


def _compute_middle(problem: Posed) -> dict[str, float]:
    return problem.ordered({n: problem.start.get(n, (low + high) / 2) for n, (low, high) in problem.free.items()})


def _describe_unit(problem: Posed, name: str) -> dict[str, Any]:
    unit = unit_of(problem, name)
    return {"unit": unit.text, "one": unit.factor}


def _describe_parameter(problem: Posed, parameter: Parameter, value: float) -> dict[str, Any]:
    name, limits = parameter.name, parameter.range
    low, high = problem.free.get(name) or _slider_range(parameter, value)
    ends = {"least": limits.lower, "most": limits.upper}
    return {
        "name": name,
        "meaning": parameter.meaning,
        **_describe_unit(problem, name),
        "free": name in problem.free,
        "low": low,
        "high": high,
        "value": value,
        "text": exact_value(value, unit_of(problem, name).text, parameter.unit),
        **{n: end for n, end in ends.items() if math.isfinite(end)},
        **({} if limits.closed else {"open": True}),
    }


def _slider_range(parameter: Parameter, value: float) -> tuple[float, float]:
    """Range of the slider of a fixed parameter: from 1/5 of its value to twice its value, within its physical range.

    The range does not begin at 0, where the mass of many systems would be 0.
    """
    default_end, limits = _DEFAULT_SLIDER_END.get(parameter.unit, 1.0), parameter.range
    ends = sorted((0.2 * value, 2 * value)) if value else (-default_end, default_end)
    margin = 0.0 if limits.closed else 1e-3 * abs(value)
    low, high = (min(max(end, limits.lower + margin), limits.upper - margin) for end in ends)
    return low, high


def _describe_constraint(problem: Posed, name: str) -> dict[str, Any]:
    condition = problem.conditions[name]
    size = max(1.0, abs(limit_value(problem.constraints[name]) or 0.0))  # size of both sides at the limit
    return {
        "name": name,
        "text": problem.constraints[name],
        **_describe_unit(problem, name),
        "equality": condition.equality,
        "tolerance": FEASIBILITY_TOLERANCE * size,
    }


def _describe_design(problem: Posed, design: PageDesign) -> dict[str, Any]:
    structure = design.structure
    # Each root is (growth rate, frequency, multiplicity); of a conjugate pair only one root is listed. For a complex
    # matrix H with eigenfrequencies ω, a root is (Im ω, Re ω, multiplicity).
    roots = [[w.im, w.re, w.multiplicity] for w in eigenfrequencies(problem.model, structure.roots)]
    roots = roots or [[r.re, r.im, r.multiplicity] for r in structure.roots if r.im >= 0]
    return {
        "name": design.name,
        "values": [float(design.parameters[n]) for n in problem.parameter_set.names],
        "structure": structure_line(problem, structure.name, structure.abscissa, design.meetings) if roots else "",
        "abscissa": max((root[0] for root in roots), default=math.nan),
        "roots": roots,
        "facts": list(design.facts),
        "proved": design.proof_text,
        **design.verdict,
    }


def _sort_by_interest(problem: Posed) -> list[str]:
    """Names of the parameters, sorted: free before fixed parameters; among these, speed and tilt before the others."""
    names = problem.parameter_set.names
    rank = {**dict.fromkeys(_SPEEDS, 0), _TILT: 1}
    return sorted(names, key=lambda n: (n not in problem.free, rank.get(n, 2)))


def _trace_curves(problem: Posed, plane: Sequence[str], start: Mapping[str, float]) -> Iterator[dict[str, Any]]:
    """Curves in the plane of the chart: boundaries of stability and heavy damping, and points with the root pattern."""
    if len(plane) < 2 or not set(plane) <= set(problem.free):
        return
    nominal, index = problem.nominal, problem.parameter_set.names.index
    off_plane_names = [n for n in problem.free if n not in plane]
    curves: list[tuple[str, str, Mapping[str, Array], Sequence[str]]] = []
    if problem.locate and degrees_of_freedom(nominal).count == 1:
        branches = trace(nominal, starts=_CURVE_STARTS).branches
        curves += [(problem.locate, "EP set", branch.parameters, off_plane_names) for branch in branches]
    fixed_values = {n: v for n, v in start.items() if n not in plane}
    boundaries = domain(
        nominal.derive(pareto=(), fixed=fixed_values, free={n: problem.free[n] for n in plane}), starts=_CURVE_STARTS
    )
    for title, arcs in (("stability", boundaries.stability), ("heavy damping", boundaries.heavy_damping)):
        curves += [(arc.kind, title, arc.points, ()) for arc in arcs]
    for kind, title, columns, names in curves:
        count = len(columns[plane[0]])
        indices = np.unique(np.linspace(0, count - 1, min(count, _MAX_CURVE_POINTS)).round().astype(int))
        x, y = ([float(f"{v:.{_CURVE_DIGITS}g}") for v in columns[n][indices].tolist()] for n in plane)
        axes = {"axes": [*map(index, plane)], "along": [*map(index, names)]}
        yield {"kind": kind, "set": title, **axes, "x": x, "y": y}


# The text of a problem file around its parameters: a page uses it to save its design as a problem file


def surrounding_lines(problem: Posed, model: Mapping[str, Any]) -> dict[str, str]:
    """The lines of a problem file before and after the lines of [parameters].

    Args:
        model: the table [model] of the file; if it is empty, the table is made from the model.
    """
    head = [_write_line("title", problem.title)]
    if problem.model.statement is None:
        head.append(_write_line("model", problem.model.name))
    else:
        head += ["", *_write_model(model or model_table(problem))]
    tail = []
    for name in ("constraints", "weights"):
        if entries := getattr(problem, name):
            tail += ["", f"[{name}]", *starmap(_write_line, entries.items())]
    if problem.nominal is not problem:
        head.append("# one design, at its nominal values: bands and tolerances are left out")
    return {"before": "\n".join([*head, "", "[parameters]", ""]), "after": "\n".join([*tail, ""])}


def _write_model(table: Mapping[str, Any]) -> Iterator[str]:
    yield "[model]"
    tables = {n: v for n, v in table.items() if isinstance(v, Mapping)}
    yield from (_write_line(n, v) for n, v in table.items() if n not in tables)
    for name, values in tables.items():
        yield from ("", f"[model.{toml_key(name)}]", *starmap(_write_line, values.items()))


def model_table(problem: Posed) -> dict[str, Any]:
    """The table [model] of a model that was made in Python. A part that formulas share is written in each."""
    statement = {n: v for n, v in (problem.model.statement or {}).items() if n != "parameters"}
    shared_parts = statement.pop("shared")

    def write(value: Any) -> Any:
        if isinstance(value, str):
            return _SHARED_PART.sub(lambda match: write(shared_parts[int(match[1]) - 1]), value)
        if isinstance(value, Mapping):
            return {n: write(v) for n, v in value.items()}
        return [write(v) for v in value]

    table = {n: write(v) for n, v in statement.items() if v} | {"name": problem.model.name}
    return table | {n: rows[0] for n, rows in table.items() if n == "coefficients"}


def _write_line(key: str, value: Any) -> str:
    return f"{toml_key(key)} = {toml_text(value)}"
