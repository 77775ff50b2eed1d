"""Charts: shares of the classes, the best grid point, boundaries and corners."""

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from tmsopt import plots
from tmsopt.charts.chart import Chart
from tmsopt.documents.blocks import Cell, Chapter, Figure, Level, Parts, Sentence, TableBlock
from tmsopt.documents.curves import describe_domain, tabulate_corners
from tmsopt.documents.tables import MOST, format_value, write_question
from tmsopt.models import in_words_of
from tmsopt.problem.unit_system import common_unit, unit_of
from tmsopt.roots import CLASSES

_POINTS = 800 * 800  # of a chart that a picture shows


def write_chart(chart: Chart, level: Level) -> Parts:
    """The classes with their shares, the best grid point, the boundaries of a plane in memory, and their corners."""
    size, over = " × ".join(str(len(values)) for values in chart.grid), ", ".join(chart.axes)
    most = sorted(chart.shares.items(), key=lambda item: -item[1])[:2]
    yield f"{size} designs over {over}", *(f"{100 * share:.3g} % {name}" for name, share in most)
    data: dict[str, Any] = chart.to_json()
    problem = chart.problem.posed
    plane = chart.path is None and len(chart.axes) == 2
    over = " and ".join(chart.axes) if plane else over
    yield Sentence(f"{size} designs over {over}", tone="answer")
    yield Chapter("classes")
    yield from _write_classes(chart, data, plane)
    yield Chapter("best")
    if best := data["least_abscissa"]:
        where = ", ".join(f"{n} = {unit_of(problem, n).show(best[n], 6)}" for n in chart.axes)
        value = common_unit(problem, "abscissa").show(best["value"], 6)
        yield Sentence(f"{value} at {where}", "least abscissa on the grid", "answer")
    if chart.domain is not None and plane:
        yield Chapter("boundaries")
        yield from describe_domain(chart.domain, problem)
        yield from tabulate_corners(chart.domain, problem)
    if data.get("designs"):
        yield Chapter("speed")
        yield f"{data['per_second']:.3g} designs per second with {data['engine']}"
    if level == "page":
        yield Chapter("picture", "Chart", "wide")
        shown, axes = _thin_chart(chart, _POINTS), " and ".join(chart.axes)
        yield Figure(plots.chart_figure, shown, f"Stability over {axes}")
        yield Figure(partial(plots.chart_figure, layer="abscissa"), shown, f"Spectral abscissa over {axes}")
        yield from write_question(problem)
        yield from _tabulate_designs(chart)


def _write_classes(chart: Chart, data: Mapping[str, Any], plane: bool) -> Parts:
    rows = [(in_words_of(chart.problem.model, n), f"{100 * x:.2f}") for n, x in data["classes"].items() if x]
    if rows:
        yield TableBlock((("class", "share in %"), *rows), "Share of each class")
    satisfied = data["satisfied"]
    inequalities = len(chart.problem.constraints) > len(chart.left_aside) if plane else (satisfied or 1) < 1
    if satisfied is not None and inequalities:
        yield f"the constraints hold on {100 * satisfied:.2f} %"
    for name in chart.left_aside if plane else ():
        yield f"{name} is an equality, which holds on curves and not on a grid: left aside"


def _tabulate_designs(chart: Chart) -> Parts:
    """Designs of the grid, every so many along each axis where they are too many."""
    problem, shown = chart.problem, _thin_chart(chart, MOST)
    left_out = [] if len(problem.constraints) > len(chart.left_aside) else ["satisfied", "margin"]
    left_out += [] if problem.model.carrier is None else ["damping_ratio", "real_roots"]  # eigenfrequencies have none
    grid = reversed(np.meshgrid(*reversed(shown.grid), indexing="ij"))
    layers = {n: layer for n, layer in shown.layers.items() if n not in left_out}
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
    left = math.prod(map(len, chart.grid))
    if len(rows) <= left:
        yield f"{len(rows) - 1} of {left} designs, spread evenly over each axis; --output writes all."
    yield TableBlock(rows, "Designs of the grid")


def _thin_chart(chart: Chart, most: int) -> Chart:
    """A chart with one in so many designs along each axis that there are no more than `most`."""
    sizes = [len(values) for values in chart.grid]
    step = next(k for k in range(1, max(sizes) + 1) if math.prod(-(-size // k) for size in sizes) <= most)
    if step == 1:
        return chart
    layers = {n: layer[(slice(None, None, step),) * len(sizes)] for n, layer in chart.layers.items()}
    return replace(chart, grid=tuple(values[::step] for values in chart.grid), layers=layers)
