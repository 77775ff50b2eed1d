"""What a page is about, as plain data: parameters with their ranges, limits, known designs, traced curves."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import starmap
from typing import Any

import numpy as np

from tmsopt.analysis import structure_line
from tmsopt.evaluation.recheck import FEASIBLE
from tmsopt.explorer.javascript import Script, is_bicycle
from tmsopt.explorer.known import Known
from tmsopt.guide import exact_value, toml_key, toml_text
from tmsopt.models import Parameter, words_of
from tmsopt.models.user_spectrum import ON_AXIS, eigenfrequencies
from tmsopt.problem import Posed, degrees_of_freedom, limit_value, unit_of
from tmsopt.problem.validate import SMALLEST
from tmsopt.records import Array
from tmsopt.tracing import domain, trace

_STARTS = 8  # of traced curves: the tracer's grid shows what they miss
_DIGITS, _POINTS = 5, 80  # of a traced point, and at most of a curve: a chart has some 400 pixels
_SPEEDS, _TILT = ("v", "Fr"), "lambda_s"
_USUAL = {"m": 0.5, "kg": 5.0, "kg m^2": 1.0, "rad": 0.5, "m/s": 5.0}
"""How far the slider of a fixed parameter that is 0 reaches, by its unit; 1 for others."""

_IMPULSE = "m_B g w √(w/g)"
"""Unit of an impulse of torque, of two masses on skates without units."""

_SHARED = re.compile(r"\[(\d+)\]")  # a part of a stated model that several places refer to
_MIDDLE = "nothing was solved here, so the page opens in the middle of the box"


def subject(
    problem: Posed, designs: Sequence[Known], script: Script, model: Mapping[str, Any], trace_curves: bool
) -> dict[str, Any]:
    """The data of a page; numbers are those that the package computes with, in rad and SI.

    Args:
        designs: the first of them is where the page opens, if it is an answer; else it opens in the middle of the box.
        script: the formulas of the page, which say which quantities and limits it can compute.
        model: the table of the problem's file that states the model; empty without one.
        trace_curves: whether to trace the boundaries of stability in the plane of the chart.
    """
    of, solved = problem.parameter_set, bool(designs) and designs[0].is_answer
    start = {n: float(v) for n, v in (designs[0].parameters if solved else _middle(problem)).items()}
    ranked = _by_interest(problem)
    speeds = [n for n in of.names if n in _SPEEDS and problem.model.statement is None]  # of a bicycle
    asked = problem.minimize or problem.maximize or problem.locate or ""
    return {
        "title": problem.title,
        "model": problem.model.name,
        "modelTitle": ": ".join(filter(None, (problem.model.title, problem.model.omits))),
        "bicycle": problem.model.name if is_bicycle(problem) else None,
        "impulseUnit": _IMPULSE if of.torque is None else "N·m·s",
        "words": dict(words_of(problem.model)),
        "rootUnit": unit_of(problem, "abscissa").text,
        "carrier": problem.model.carrier,
        "onAxis": ON_AXIS,
        "smallest": SMALLEST,
        "parameters": [_parameter(problem, p, start[p.name]) for p in of.parameters],
        "quantities": [
            {"name": q.name, "meaning": q.meaning, "share": q.share, **_unit(problem, q.name)}
            for q in (*problem.model.quantities, *of.quantities)
        ],
        "constraints": [_constraint(problem, n) for n in script.constraints],
        "objective": f"{problem.sense} {' '.join(asked.split())}" if asked else "",
        "designs": [_design(problem, k) for k in designs],
        "start": [start[n] for n in of.names],
        "plane": [of.names.index(n) for n in ranked[:2]],
        "over": of.names.index((speeds or ranked)[0]),
        "curves": list(_curves(problem, ranked[:2], start)) if trace_curves else [],
        "toml": surrounding_lines(problem, model),
        "others": [n for n in problem.conditions if n not in script.constraints],
        "nominal": problem.nominal is not problem,
        "shown": [_MIDDLE] if problem.free and not solved else [],
    }


def _middle(problem: Posed) -> dict[str, float]:
    return problem.ordered({n: problem.start.get(n, (low + high) / 2) for n, (low, high) in problem.free.items()})


def _unit(problem: Posed, name: str) -> dict[str, Any]:
    unit = unit_of(problem, name)
    return {"unit": unit.text, "one": unit.one}


def _parameter(problem: Posed, parameter: Parameter, value: float) -> dict[str, Any]:
    name, room = parameter.name, parameter.range
    low, high = problem.free.get(name) or _reach(parameter, value)
    ends = {"least": room.lower, "most": room.upper}
    return {
        "name": name,
        "meaning": parameter.meaning,
        **_unit(problem, name),
        "free": name in problem.free,
        "low": low,
        "high": high,
        "value": value,
        "text": exact_value(value, unit_of(problem, name).text, parameter.unit),
        **{n: end for n, end in ends.items() if math.isfinite(end)},
        **({} if room.closed else {"open": True}),
    }


def _reach(parameter: Parameter, value: float) -> tuple[float, float]:
    """Where the slider of a fixed parameter goes: from a fifth of its value to twice that, as far as it is possible.

    Not from 0, where many a system has no mass.
    """
    usual, room = _USUAL.get(parameter.unit, 1.0), parameter.range
    ends = sorted((0.2 * value, 2 * value)) if value else (-usual, usual)
    inside = 0.0 if room.closed else 1e-3 * abs(value)
    low, high = (min(max(end, room.lower + inside), room.upper - inside) for end in ends)
    return low, high


def _constraint(problem: Posed, name: str) -> dict[str, Any]:
    condition = problem.conditions[name]
    size = max(1.0, abs(limit_value(problem.constraints[name]) or 0.0))  # of the sides where they are equal
    return {
        "name": name,
        "text": problem.constraints[name],
        **_unit(problem, name),
        "equality": condition.equality,
        "tolerance": FEASIBLE * size,
    }


def _design(problem: Posed, known: Known) -> dict[str, Any]:
    found = known.structure
    # growth rate, frequency and multiplicity of each root, of conjugates of one; of a complex H Im ω and Re ω
    roots = [[w.im, w.re, w.multiplicity] for w in eigenfrequencies(problem.model, found.roots)]
    roots = roots or [[r.re, r.im, r.multiplicity] for r in found.roots if r.im >= 0]
    return {
        "name": known.name,
        "values": [float(known.parameters[n]) for n in problem.parameter_set.names],
        "structure": structure_line(problem, found.name, found.abscissa, known.meetings) if roots else "",
        "abscissa": max((root[0] for root in roots), default=math.nan),
        "roots": roots,
        "facts": list(known.facts),
        "proved": known.proved,
        **known.verdict,
    }


def _by_interest(problem: Posed) -> list[str]:
    """Parameters in the order in which one looks at them: free before fixed, the speed and the tilt before others."""
    names = problem.parameter_set.names
    rank = {**dict.fromkeys(_SPEEDS, 0), _TILT: 1}
    return sorted(names, key=lambda n: (n not in problem.free, rank.get(n, 2)))


def _curves(problem: Posed, plane: Sequence[str], start: Mapping[str, float]) -> Iterator[dict[str, Any]]:
    """Traced curves in the plane of the chart: the boundaries of both domains, and the set that the problem locates."""
    if len(plane) < 2 or not set(plane) <= set(problem.free):
        return
    nominal, index = problem.nominal, problem.parameter_set.names.index
    others = [n for n in problem.free if n not in plane]
    found: list[tuple[str, str, Mapping[str, Array], Sequence[str]]] = []
    if problem.locate and degrees_of_freedom(nominal).count == 1:
        branches = trace(nominal, starts=_STARTS).branches
        found += [(problem.locate, "EP set", branch.parameters, others) for branch in branches]
    held = {n: v for n, v in start.items() if n not in plane}
    near = domain(nominal.derive(pareto=(), fixed=held, free={n: problem.free[n] for n in plane}), starts=_STARTS)
    for title, arcs in (("stability", near.stability), ("heavy damping", near.heavy_damping)):
        found += [(arc.kind, title, arc.points, ()) for arc in arcs]
    for kind, title, columns, along in found:
        count = len(columns[plane[0]])
        some = np.unique(np.linspace(0, count - 1, min(count, _POINTS)).round().astype(int))  # both ends among them
        x, y = ([float(f"{v:.{_DIGITS}g}") for v in columns[n][some].tolist()] for n in plane)
        axes = {"axes": [*map(index, plane)], "along": [*map(index, along)]}
        yield {"kind": kind, "set": title, **axes, "x": x, "y": y}


# The text of a problem file around its parameters, so that a design seen on a page can be solved and shared


def surrounding_lines(problem: Posed, model: Mapping[str, Any]) -> dict[str, str]:
    """What stands before and after the lines of [parameters].

    Args:
        model: the table that states the model, as typed; without one it is written from the model itself.
    """
    before = [_write_line("title", problem.title)]
    if problem.model.statement is None:
        before.append(_write_line("model", problem.model.name))
    else:
        before += ["", *_write_model(model or model_table(problem))]
    after = []
    for name in ("constraints", "weights"):
        if entries := getattr(problem, name):
            after += ["", f"[{name}]", *starmap(_write_line, entries.items())]
    if problem.nominal is not problem:
        before.append("# one design, at its nominal values: bands and tolerances are left out")
    return {"before": "\n".join([*before, "", "[parameters]", ""]), "after": "\n".join([*after, ""])}


def _write_model(table: Mapping[str, Any]) -> Iterator[str]:
    yield "[model]"
    inner = {n: v for n, v in table.items() if isinstance(v, Mapping)}
    yield from (_write_line(n, v) for n, v in table.items() if n not in inner)
    for name, values in inner.items():
        yield from ("", f"[model.{toml_key(name)}]", *starmap(_write_line, values.items()))


def model_table(problem: Posed) -> dict[str, Any]:
    """The table of a model that was made in Python, with every shared part written out."""
    said = {n: v for n, v in (problem.model.statement or {}).items() if n != "parameters"}
    shared = said.pop("shared")

    def write(value: Any) -> Any:
        if isinstance(value, str):
            return _SHARED.sub(lambda found: write(shared[int(found[1]) - 1]), value)
        if isinstance(value, Mapping):
            return {n: write(v) for n, v in value.items()}
        return [write(v) for v in value]

    found = {n: write(v) for n, v in said.items() if v} | {"name": problem.model.name}
    return found | {n: rows[0] for n, rows in found.items() if n == "coefficients"}


def _write_line(key: str, value: Any) -> str:
    return f"{toml_key(key)} = {toml_text(value)}"
