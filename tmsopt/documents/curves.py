"""Documents of traces with their branches, of charts, domains and swallowtails."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from tmsopt import plots
from tmsopt.charts.chart import Chart
from tmsopt.documents.blocks import (
    ALL_DIGITS,
    Cell,
    Chapter,
    Figure,
    Level,
    Parts,
    Row,
    Sentence,
    TableBlock,
    count_things,
)
from tmsopt.documents.tables import MAX_ROWS, format_value, thin_rows, write_question
from tmsopt.models import Model, in_words_of
from tmsopt.models.user_spectrum import pattern_of
from tmsopt.problem.problem import Posed
from tmsopt.problem.unit_system import Unit, common_unit, unit_of
from tmsopt.roots import CLASSES
from tmsopt.tracing.branch import Branch, Trace, kinds_along
from tmsopt.tracing.domain import Domain
from tmsopt.tracing.swallowtail import Swallowtail

_MAX_PICTURE_POINTS = 800 * 800
"""Maximum number of grid points in a picture of a chart."""
_POINT_DIGITS = 6
"""Significant digits of a point on a page."""
_ROUNDING_MISMATCH = 1e-14
"""If the mismatch of the coefficients is smaller, it is only rounding, and all digits are shown."""
_MAX_MISMATCH = 1e-6
"""If the mismatch of its coefficients is larger, a point does not belong to the branch."""


def write_trace(trace: Trace, level: Level) -> Parts:
    """Write the branches with their events, in the free parameters."""
    counts = count_things(trace.points, "point"), count_things(trace.events, "event")
    yield trace.pattern, count_things(trace.branches, "branch", "branches"), *counts
    problem, model = trace.problem.posed, trace.problem.model
    yield Sentence(describe_trace(trace), tone="answer")
    if level == "page":
        yield Chapter("picture", "Branches")
        yield Figure(plots.draw_trace, trace, f"Branches of {in_words_of(model, trace.pattern)}")
    units = {n: common_unit(problem, n) for n in (*trace.problem.free, "abscissa")}
    for number, branch in enumerate(trace.branches, start=1):
        yield Chapter(f"branch-{number}", f"Branch {number}", "whole")
        yield Sentence(_describe_branch(branch, trace), f"branch {number}")
        yield TableBlock(list_events(branch, units, model), f"Events along branch {number}, to all digits")
    if level == "page":
        yield from write_question(problem)
        yield from _tabulate_points(trace)


def describe_trace(trace: Trace) -> str:
    """Count branches and points, and state the time they took."""
    per_point = 1e6 * trace.seconds_walking / max(trace.points, 1)
    points = f", {trace.points} points, {per_point:.0f} µs per point" if trace.points else ""
    count = count_things(trace.branches, "branch", "branches")
    pattern = in_words_of(trace.problem.model, trace.pattern)
    return f"{pattern}: {count}{points}, found from {trace.starts} starts; {trace.seconds:.2f} s"


def _describe_branch(branch: Branch, trace: Trace) -> str:
    share = f"{100 * float(np.mean(branch.stable)):.0f} % of its points"
    remaining_factor = pattern_of(trace.problem.model, branch.pattern).rest
    states = f"{'bounds stability' if remaining_factor else 'stable'} on {share}"
    if any(not c.equality for c in trace.problem.posed.conditions.values()):
        states += f", constraints hold on {100 * float(np.mean(branch.satisfied)):.0f} %"
    form = "closed" if branch.closed else "not closed"
    doubt = "" if branch.residual <= _MAX_MISMATCH else " (too large)"
    kinds = in_words_of(trace.problem.model, " and ".join(dict.fromkeys(kinds_along(branch))))
    return f"{kinds}, {len(branch)} points, {form}, {states}, coefficient error {branch.residual:.0e}{doubt}"


def list_events(branch: Branch, units: Mapping[str, Unit], model: Model | None = None) -> list[Row]:
    """List headings and the cells of each event, in these units; uncertain digits are left out."""
    rows: list[Row] = [("event", *_list_headings(units), "detail")]
    for event in branch.events:
        values = {**event.parameters, "abscissa": float(branch.abscissa[event.index])}
        # the error of a point may be several times the residual of its coefficients: show two digits less
        digits = min(max(math.floor(-math.log10(max(event.residual, _ROUNDING_MISMATCH))) - 2, 2), ALL_DIGITS)
        rows.append((name_kind(model, event.name), *_list_numbers(values, units, digits), event.detail))
    return rows


def name_kind(model: Model | None, name: str) -> str:
    """Name a kind of boundary or an event, in the words of the model if it is given."""
    return in_words_of(model, name) if model else name


def _list_headings(units: Mapping[str, Unit]) -> Iterator[str]:
    return (f"{n} {unit.text}".rstrip() for n, unit in units.items())


def _list_numbers(values: Mapping[str, float], units: Mapping[str, Unit], digits: int = ALL_DIGITS) -> Iterator[Cell]:
    return (Cell(values[n], unit, digits) for n, unit in units.items())


def _tabulate_points(trace: Trace) -> Parts:
    """Tabulate points of all branches with their events, in the units of the problem."""
    units = {n: unit_of(trace.problem.posed, n) for n in (*trace.problem.free, "abscissa")}
    model = trace.problem.model
    damping = () if model.is_complex else ("heavily damped",)
    facts = ("kind", "stable", *damping, "constraints", "event")
    records = [*trace.records()]
    event_rows = [k for k, record in enumerate(records) if record["event"]]
    shown_records, note = thin_rows(records, "points", "tmsopt trace FILE --csv curve.csv writes all", event_rows)
    rows: list[Row] = [("branch", *_list_headings(units), *facts)]
    for record in shown_records:
        cells = (in_words_of(model, format_value(record[fact.replace(" ", "_")])) for fact in facts)
        rows.append((str(record["branch"] + 1), *_list_numbers(record, units, _POINT_DIGITS), *cells))
    yield Chapter("rows", "Points", "whole")
    yield from note
    yield TableBlock(rows, "Points of the branches")


def write_branch(branch: Branch, _level: Level) -> Parts:
    """Write one branch with its events, in the free parameters."""
    form = "closed" if branch.closed else "not closed"
    yield branch.pattern, count_things(branch, "point"), count_things(branch.events, "event"), form
    text = f"{branch.pattern}: {len(branch)} points, {form}, coefficient error {branch.residual:.0e}"
    yield Sentence(text, tone="answer")
    yield Chapter("events")
    units = dict.fromkeys((*branch.tangent, "abscissa"), Unit())
    yield TableBlock(list_events(branch, units), "Events along the branch")


def write_domain(domain: Domain, _level: Level) -> Parts:
    """Write the boundaries of stability and of heavy damping, and their corners."""
    stability, damping = (count_things(arcs, "arc") for arcs in (domain.stability, domain.heavy_damping))
    yield f"stability: {stability}", f"heavy damping: {damping}", count_things(domain.corners, "corner")
    yield from describe_domain(domain)
    yield Chapter("corners")
    yield from tabulate_corners(domain)


def describe_domain(domain: Domain, problem: Posed | None = None) -> Iterator[str]:
    """Describe the boundaries of stability and of heavy damping."""
    model = problem.model if problem else None
    boundaries = [("stability", domain.stability)]
    if model is None or not model.is_complex:  # a complex system has no heavy damping
        boundaries.append(("heavy damping", domain.heavy_damping))
    for name, arcs in boundaries:
        point_counts: dict[str, list[int]] = {}
        for arc in arcs:
            point_counts.setdefault(name_kind(model, arc.kind), []).append(len(next(iter(arc.points.values()))))
        kinds = [
            f"{kind} ({f'{len(counts)} curves, ' if len(counts) > 1 else ''}{sum(counts)} points)"
            for kind, counts in point_counts.items()
        ]
        yield f"{name} is bounded by {', '.join(kinds) or 'nothing within the ranges'}"


def tabulate_corners(domain: Domain, problem: Posed | None = None) -> Iterator[TableBlock]:
    """Tabulate the corners to all digits, in the units of the problem if it is given; no table if there are none."""
    if not domain.corners:
        return
    model = problem.model if problem else None
    names = {n for arc in (*domain.stability, *domain.heavy_damping) for n in arc.points}
    units = {n: unit_of(problem, n) if problem else Unit() for n in domain.corners[0].parameters if n in names}
    rows: list[Row] = [(name_kind(model, c.name), *_list_numbers(c.parameters, units)) for c in domain.corners]
    yield TableBlock((("corner", *_list_headings(units)), *rows), "Corners of the domains")


def write_swallowtail(swallowtail: Swallowtail, _level: Level) -> Parts:
    """Write the patches of the surface, then its edges as traces."""
    edges = f"edges: {count_things(swallowtail.cusps.branches, 'EP3 curve')}"
    yield " ".join(swallowtail.axes), count_things(swallowtail.patches, "patch", "patches"), edges
    damped_count = sum(patch.heavily_damped for patch in swallowtail.patches)
    patches = f"{len(swallowtail.patches)} patches, {damped_count} of them bound heavy damping"
    yield Sentence(f"real negative double roots over {', '.join(swallowtail.axes)}: {patches}", tone="answer")
    yield Sentence(describe_trace(swallowtail.cusps), "cuspidal edges")
    yield Sentence(describe_trace(swallowtail.crossing), "self-intersection")


def write_chart(chart: Chart, level: Level) -> Parts:
    """Write the classes with their shares, the best grid point, and the boundaries with their corners."""
    size, axis_names = " × ".join(str(len(values)) for values in chart.grid), ", ".join(chart.axes)
    largest_shares = sorted(chart.shares.items(), key=lambda item: -item[1])[:2]
    yield f"{size} designs over {axis_names}", *(f"{100 * share:.3g} % {name}" for name, share in largest_shares)
    data: dict[str, Any] = chart.to_json()
    problem = chart.problem.posed
    is_plane = chart.path is None and len(chart.axes) == 2
    axis_names = " and ".join(chart.axes) if is_plane else axis_names
    yield Sentence(f"{size} designs over {axis_names}", tone="answer")
    yield Chapter("classes")
    yield from _write_classes(chart, data, is_plane)
    yield Chapter("best")
    if best := data["least_abscissa"]:
        design = ", ".join(f"{n} = {unit_of(problem, n).show(best[n], 6)}" for n in chart.axes)
        value = common_unit(problem, "abscissa").show(best["value"], 6)
        yield Sentence(f"{value} at {design}", "least abscissa on the grid", "answer")
    if chart.domain is not None and is_plane:
        yield Chapter("boundaries")
        yield from describe_domain(chart.domain, problem)
        yield from tabulate_corners(chart.domain, problem)
    if data.get("designs"):
        yield Chapter("speed")
        yield f"{data['per_second']:.3g} designs per second with {data['engine']}"
    if level == "page":
        yield Chapter("picture", "Chart", "wide")
        thinned, axes = _thin_chart(chart, _MAX_PICTURE_POINTS), " and ".join(chart.axes)
        yield Figure(plots.chart_figure, thinned, f"Stability over {axes}")
        yield Figure(partial(plots.chart_figure, layer="abscissa"), thinned, f"Spectral abscissa over {axes}")
        yield from write_question(problem)
        yield from _tabulate_designs(chart)


def _write_classes(chart: Chart, data: Mapping[str, Any], is_plane: bool) -> Parts:
    rows = [(in_words_of(chart.problem.model, n), f"{100 * x:.2f}") for n, x in data["classes"].items() if x]
    if rows:
        yield TableBlock((("class", "share in %"), *rows), "Share of each class")
    satisfied_share = data["satisfied"]
    has_inequalities = (
        len(chart.problem.constraints) > len(chart.left_aside) if is_plane else (satisfied_share or 1) < 1
    )
    if satisfied_share is not None and has_inequalities:
        yield f"the constraints hold on {100 * satisfied_share:.2f} %"
    for name in chart.left_aside if is_plane else ():
        yield f"{name} is ignored: it is an equality, which holds on curves and not on a grid"


def _tabulate_designs(chart: Chart) -> Parts:
    """Tabulate the designs of the grid; if there are too many, every k-th one along each axis."""
    problem, thinned = chart.problem, _thin_chart(chart, MAX_ROWS)
    hidden_layers = [] if len(problem.constraints) > len(chart.left_aside) else ["satisfied", "margin"]
    if problem.model.is_complex:  # a complex system has neither of these layers
        hidden_layers += ["damping_ratio", "real_roots"]
    grid = reversed(np.meshgrid(*reversed(thinned.grid), indexing="ij"))
    layers = {n: layer for n, layer in thinned.layers.items() if n not in hidden_layers}
    columns: dict[str, list[Cell | str]] = {}
    for name, layer in (*zip(chart.axes, grid, strict=True), *layers.items()):
        values = np.asarray(layer).ravel().tolist()
        if name == "kind":
            columns["class"] = [in_words_of(problem.model, CLASSES[k]) for k in values]
        elif name in (*chart.axes, "abscissa"):
            unit = unit_of(problem.posed, name)
            columns[f"{name} {unit.text}".rstrip()] = [Cell(x, unit, 6) for x in values]
        else:
            columns[name.replace("_", " ")] = [format_value(x) for x in values]
    yield Chapter("rows", "Designs", "whole")
    rows = [tuple(columns), *zip(*columns.values(), strict=True)]
    count = math.prod(map(len, chart.grid))
    if len(rows) <= count:
        yield f"{len(rows) - 1} of {count} designs, spread evenly over each axis; --output writes all."
    yield TableBlock(rows, "Designs of the grid")


def _thin_chart(chart: Chart, max_designs: int) -> Chart:
    """Keep every k-th grid point along each axis, so that at most `max_designs` remain."""
    sizes = [len(values) for values in chart.grid]
    step = next(k for k in range(1, max(sizes) + 1) if math.prod(-(-size // k) for size in sizes) <= max_designs)
    if step == 1:
        return chart
    layers = {n: layer[(slice(None, None, step),) * len(sizes)] for n, layer in chart.layers.items()}
    return replace(chart, grid=tuple(values[::step] for values in chart.grid), layers=layers)
