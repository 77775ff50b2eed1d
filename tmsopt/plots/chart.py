"""Draw stability charts with their exact boundary curves."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from matplotlib.typing import LineStyleType
from numpy.typing import NDArray

from tmsopt.charts.chart import Chart
from tmsopt.errors import input_error, suggest
from tmsopt.models import Model, in_words_of, tms
from tmsopt.plots.labels import Name, PlaneAxes, abscissa_label, events_of, finish_axes, plane_over
from tmsopt.plots.style import CAPSIZE, CRITICAL, LINE, MARK, ensure_axes, figure_of
from tmsopt.problem.problem import Problem
from tmsopt.problem.solution import Solution
from tmsopt.records import Array
from tmsopt.roots import CLASSES
from tmsopt.search.solve import solve
from tmsopt.tracing.domain import Domain

Legend = tuple[list[Name], list[Artist]]
"""Names of points, which are written after everything else is drawn, and entries of the legend."""

CLASS_COLOURS = ("#FFFFFF", "#BBBBBB", "#E6E6E6", "#A6D5F0", "#F2C45A")
"""Fill colours of the classes, from undefined to heavily damped. They also differ in lightness."""

_BOUNDARY_STYLES = (
    ("parting", "between capsize and weave", CAPSIZE, 1.2),
    ("stability", "edge of stability", CRITICAL, 1.8),
    ("heavy_damping", "edge of heavy damping", LINE, 1.4),
)
"""Boundaries of a domain in the order in which they are drawn: field, label, colour and line width."""

_COLOUR_PERCENTILES = (1, 95)
"""The colours cover a layer between these percentiles, so that poles of the abscissa do not use up all colours."""

_EXTREME_PERCENTILES = (0.1, 99.9)
"""The same for layers whose extremes are exceptional points, which are narrow."""

_MIN_PETERMANN_RANGE = 10.0  # least ratio of the largest and the smallest Petermann factor on the colour scale

_ARC_STYLES: Mapping[str, tuple[LineStyleType, str]] = {
    "capsize": ("-.", " (root 0)"),
    "infinity": (":", " (root at infinity)"),
}
"""Kind of a boundary curve → line style and addition to its label; other kinds have a solid line."""

_LAYER_LABELS = {
    "damping_ratio": "damping ratio",
    "real_roots": "number of real roots",
    "petermann": "largest Petermann factor",
    "phase_rigidity": "smallest phase rigidity",
}
"""Labels of layers of numbers; a quantity is labelled with its name."""


def draw_layer(ax: Axes, chart: Chart, plane: PlaneAxes, layer: str) -> Legend:
    """Draw a layer as colours, with the exact boundaries, and hatching where a constraint is violated."""
    model, handles = chart.problem.model, list[Artist]()
    if layer == "kind":
        handles += class_handles(chart.kind, model)
        _fill(ax, chart, plane, layer, cmap=ListedColormap(CLASS_COLOURS), vmin=-0.5, vmax=len(CLASSES) - 0.5)
    else:
        _fill_numbers(ax, chart, plane, layer)
    names, curves = draw_domain_curves(ax, chart.domain, plane, model)
    return names, [*handles, *curves, *_hatch_violations(ax, chart, plane)]


def _fill(ax: Axes, chart: Chart, plane: PlaneAxes, layer: str, **look: Any) -> QuadMesh:
    """Draw a layer as colours; label the axes and limit them to the grid."""
    x, y = grid = _axis_values(chart, plane)
    plane.label(ax)
    ax.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    return ax.pcolormesh(*grid, chart.layers[layer], rasterized=True, **look)


def class_handles(kind: NDArray[np.int8], model: Model) -> list[Patch]:
    """Legend entries of the classes that occur."""
    prefix = "unstable by" if not model.is_complex else "gain, beyond"
    labels = {event: f"{prefix} {name}" for event, name in events_of(model).items()}
    return [
        Patch(facecolor=CLASS_COLOURS[code], edgecolor="grey", label=labels.get(CLASSES[code], CLASSES[code]))
        for code in np.unique(kind)
    ]


def draw_domain_curves(ax: Axes, domain: Domain | None, plane: PlaneAxes, model: Model = tms) -> Legend:
    """Draw the boundaries of stability and of heavy damping as curves, and mark their corners.

    Args:
        model: the model whose names are used for the corners.
    """
    names, handles = list[Name](), list[Artist]()
    if domain is None:
        return names, handles
    for name, label, colour, width in _BOUNDARY_STYLES:
        outline = withStroke(linewidth=width + 1.2, foreground="white", alpha=0.6)
        for arc in getattr(domain, name):
            style, suffix = _ARC_STYLES.get(arc.kind, ("-", ""))
            look: dict[str, Any] = {"color": colour, "linestyle": style, "linewidth": width, "label": label + suffix}
            handles += ax.plot(*plane.to_axis(arc.points), path_effects=[outline], **look)
    for corner in domain.corners:
        x, y = plane.to_axis(corner.parameters)
        ax.plot(x, y, "o", color=MARK, markersize=4, zorder=5)
        names.append(Name(in_words_of(model, corner.name), x, y))
    return names, handles


def plane_of(chart: Chart) -> PlaneAxes:
    """The two axes of a chart, in the units of its file.

    Raises:
        InputError: for a chart over three parameters.
    """
    if len(chart.axes) != 2:
        message = f"found {len(chart.axes)} parameters; a picture shows a plane; chart two of them, and fix the third"
        raise input_error(message, "axes")
    return plane_over(chart.problem.posed, *chart.axes)


def draw_domain(
    data: Domain,
    ax: Axes | None = None,
    horizontal: str | None = None,
    vertical: str | None = None,
    problem: Problem | None = None,
) -> Axes:
    """Draw the boundaries of stability and of heavy damping, with their corners.

    The Axes show a plane of two parameters, by default the first two that vary along the boundaries. The units are
    those of the problem if one is given, otherwise SI and rad.

    Example:
        >>> axes = tmsopt.plots.draw_domain(tmsopt.domain("problems/chart.toml"))
        >>> [text.get_text() for text in axes.texts], axes.get_xlabel(), axes.get_ylabel()
        (['EP4'], 'Fr', 'lambda_s')

    More: docs/how_to/charts.md
    """
    arcs = (*data.stability, *data.heavy_damping, *data.parting)
    varying_names = [n for n in (arcs[0].points if arcs else ()) if any(np.ptp(a.points[n]) > 0 for a in arcs)]
    plane = plane_over(problem.posed if problem else None, horizontal, vertical, *varying_names)
    ax = ensure_axes(ax, 6.4, 5.0, problem.title if problem else "")
    plane.label(ax)
    return finish_axes(ax, *draw_domain_curves(ax, data, plane, problem.model if problem else tms))


def draw_chart(
    data: Chart, ax: Axes | None = None, layer: str = "kind", design: Solution | None = None, optimum: bool = True
) -> Axes:
    """Draw a chart with its exact boundaries on top, hatched where a constraint is violated.

    The Axes show the plane in the units of the file. The abscissa is blue where motion decays, red where it grows, and
    white at 0; its contours have numbers. A star marks the optimum if the problem has an objective or a pattern (the
    problem is then solved), otherwise the least abscissa on the grid that the constraints allow.

    Args:
        layer: a layer of the chart, such as ``kind``, ``abscissa`` or ``petermann``, or one of its quantities.
        design: a solution to mark.
        optimum: whether to draw the star on the layer ``abscissa``.

    Raises:
        InputError: for a chart over three parameters, or a layer that it does not have.

    Example:
        >>> chart = tmsopt.chart("problems/chart.toml", points=(20, 20))
        >>> axes = tmsopt.plots.draw_chart(chart, design=tmsopt.solve("problems/ep4.toml"))
        >>> [text.get_text() for text in axes.texts]  # the design is at the corner of heavy damping
        ['EP4, design']

    More: docs/how_to/charts.md
    """
    plane = plane_of(data)
    if layer not in data.layers:
        raise input_error(f"found '{layer}'; {suggest(layer, data.layers)}", "layer")
    ax = ensure_axes(ax, 6.4, 5.4, data.problem.title)
    names, handles = draw_layer(ax, data, plane, layer)
    if layer == "abscissa" and optimum:
        handles += _draw_optimum(ax, data, plane)
    if design is not None:
        x, y = point = plane.to_axis(design.parameters)
        handles += _draw_mark(ax, point, "D", f"the design ({design.structure})")
        names.append(Name("design", x, y))
    return finish_axes(ax, names, handles)


def chart_figure(chart: Chart, layer: str = "kind", design: Solution | None = None) -> Figure:
    """Draw a chart in a new figure.

    Example:
        >>> figure = tmsopt.plots.chart_figure(tmsopt.chart("problems/chart.toml", points=(20, 20)))
        >>> figure.axes[0].get_title()
        'chi_H = 1, chi_B = sqrt(2)'

    More: docs/how_to/charts.md
    """
    return figure_of(draw_chart(chart, None, layer, design))


def _axis_values(chart: Chart, plane: PlaneAxes) -> list[Array]:
    """Values along both axes in the units of the axes."""
    return [scale.to_axis(values) for scale, values in zip(plane, chart.grid, strict=True)]


def _hatch_violations(ax: Axes, chart: Chart, plane: PlaneAxes) -> list[Artist]:
    """Hatch the area where a constraint is violated, and draw its edge; return the legend entry."""
    if "satisfied" not in chart.layers or chart.satisfied.all():
        return []
    grid = _axis_values(chart, plane)
    hatching = ax.contourf(*grid, ~chart.satisfied, levels=[0.5, 1.5], colors="none", hatches=["//"])
    hatching.set(edgecolor=(0.4, 0.4, 0.4, 0.7), linewidth=0)
    if "margin" in chart.layers and np.any(chart.margin > 0) and np.any(chart.margin < 0):
        ax.contour(*grid, chart.margin, levels=[0], colors="0.3", linewidths=0.8)
    return [Patch(facecolor="none", edgecolor="0.4", hatch="//", linewidth=0, label="constraint violated")]


def _fill_numbers(ax: Axes, chart: Chart, plane: PlaneAxes, layer: str) -> None:
    """Draw a layer of numbers, such as the abscissa or a quantity, with its colour bar."""
    bar_options: dict[str, Any] = {"label": _LAYER_LABELS.get(layer, layer), "extend": "both"}
    values = np.ma.masked_invalid(np.asarray(chart.layers[layer], dtype=float))
    percentiles = _EXTREME_PERCENTILES if layer in ("petermann", "phase_rigidity") else _COLOUR_PERCENTILES
    low, high = np.percentile(values.compressed(), percentiles) if values.count() else (0.0, 1.0)
    look: dict[str, Any] = {"cmap": "cividis", "vmin": low, "vmax": high}
    if layer == "real_roots":
        count = chart.problem.model.degree + 1
        look = {"cmap": colormaps["cividis"].resampled(count), "vmin": -0.5, "vmax": count - 0.5}
        bar_options |= {"ticks": range(count), "extend": "neither"}
    elif layer == "petermann":
        look = {"cmap": "cividis", "norm": LogNorm(1.0, max(high, _MIN_PETERMANN_RANGE))}
    elif layer == "abscissa":
        limit = max(abs(low), abs(high)) or 1.0
        look = {"cmap": "RdBu_r", "vmin": -limit, "vmax": limit}
        bar_options["label"] = abscissa_label(chart.problem.posed)
        grid = _axis_values(chart, plane)
        levels = [x for x in MaxNLocator(9).tick_values(low, high) if low <= x <= high and x != 0]
        contours = ax.contour(*grid, values, levels=levels, colors="0.15", linewidths=0.6)
        for text in ax.clabel(contours, fontsize=6.5, fmt="%.3g"):
            text.set_path_effects([withStroke(linewidth=1.5, foreground="white")])
        if chart.domain is None:
            ax.contour(*grid, values, levels=[0.0], colors=LINE, linewidths=1.6)
    figure_of(ax).colorbar(_fill(ax, chart, plane, layer, **look), ax=ax, **bar_options)


def _draw_optimum(ax: Axes, chart: Chart, plane: PlaneAxes) -> list[Line2D]:
    """Mark the best design with a star.

    It is the optimum of the problem if there is one, otherwise the best grid point; the legend says which.
    """
    problem = chart.problem.posed.nominal
    is_complex = problem.model.is_complex
    if problem.objective is not None or problem.pattern is not None:
        solution = solve(problem, throw=False, interruptible=False)
        if solution.status == "optimal":
            quantity = "largest Im ω" if is_complex else "abscissa"
            label = f"optimum ({solution.structure}), {quantity} {solution.abscissa:.4g}"
            return _draw_mark(ax, plane.to_axis(solution.parameters), "*", label)
    is_allowed = np.isfinite(chart.abscissa) & chart.layers.get("satisfied", np.True_)
    if not is_allowed.any():
        return []
    values = np.where(is_allowed, chart.abscissa, np.inf)
    row, column = np.unravel_index(values.argmin(), values.shape)
    x, y = _axis_values(chart, plane)
    label = f"{'best Im ω' if is_complex else 'least abscissa'} on the grid, {values[row, column]:.4g}"
    return _draw_mark(ax, (x[column], y[row]), "*", label)


def _draw_mark(ax: Axes, point: Iterable[float], marker: str, label: str) -> list[Line2D]:
    size, yellow = 12 if marker == "*" else 6, "#F0E442"
    return ax.plot(*point, marker, color=yellow, mec=LINE, markersize=size, zorder=6, label=label, clip_on=False)
