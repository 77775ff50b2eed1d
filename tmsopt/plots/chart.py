"""Stability charts drawn with their exact boundary curves."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, CenteredNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from matplotlib.typing import LineStyleType
from numpy.typing import NDArray

from tmsopt.charts.chart import Chart
from tmsopt.errors import refusal, suggest
from tmsopt.models import Model, in_words_of
from tmsopt.plots.labels import AxisScale, Name, abscissa_label, events_of, finished, scale_of
from tmsopt.plots.style import CAPSIZE, CRITICAL, LINE, MARK, entry, figure_of, on_axes
from tmsopt.problem.problem import Problem
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import Unit
from tmsopt.records import Array
from tmsopt.roots import CLASSES
from tmsopt.search.solve import solve
from tmsopt.tracing.domain import Domain

Plane = tuple[AxisScale, AxisScale]
"""The horizontal and the vertical axis."""

CLASS_COLOURS = ("#FFFFFF", "#BBBBBB", "#E6E6E6", "#A6D5F0", "#F2C45A")
"""Fills of the classes, undefined to heavily damped, told apart by lightness too."""

_BOUNDARIES = {
    "between capsize and weave": (CAPSIZE, 1.2),
    "edge of stability": (CRITICAL, 1.8),
    "edge of heavy damping": (LINE, 1.4),
}
"""Colour and width of the boundaries, in the order of a domain."""

_SHOWN = (1, 95)  # percentiles of a layer between which colours change: poles of the abscissa must not take them all

_KINDS: Mapping[str, tuple[LineStyleType, str]] = {
    "capsize": ("-.", " (root 0)"),
    "infinity": (":", " (root at infinity)"),
}
_OTHER: tuple[LineStyleType, str] = ("-", "")
"""Line of an arc by its kind, and words for it."""

LAYERS = {
    "kind": "kind of motion",
    "abscissa": "spectral abscissa",
    "damping_ratio": "damping ratio",
    "real_roots": "number of real roots",
}
"""What can be drawn of a chart."""


def fill_classes(ax: Axes, chart: Chart, plane: Plane) -> None:
    """The class of every grid point as a colour."""
    norm = BoundaryNorm(np.arange(len(CLASSES) + 1) - 0.5, len(CLASSES))
    shades = ListedColormap(CLASS_COLOURS)
    ax.pcolormesh(*_grid(chart, plane), chart.kind, cmap=shades, norm=norm, rasterized=True)


def class_handles(kind: NDArray[np.int8], model: Model) -> list[Patch]:
    """Legend entries of the classes that occur."""
    how = "unstable by" if model.carrier is None else "gain, beyond"
    words = {kind: f"{how} {word}" for kind, word in events_of(model).items()}
    present = [code for code in range(len(CLASSES)) if np.any(kind == code)]
    return [
        Patch(facecolor=CLASS_COLOURS[k], edgecolor="grey", label=words.get(CLASSES[k], CLASSES[k])) for k in present
    ]


def domain_curves(ax: Axes, domain: Domain, plane: Plane) -> list[Name]:
    """Boundaries of stability and of heavy damping as curves, their corners marked; names to place."""
    boundaries = (domain.parting, domain.stability, domain.heavy_damping)
    for arcs, (colour, width) in zip(boundaries, _BOUNDARIES.values(), strict=True):
        for arc in arcs:
            style, _ = _KINDS.get(arc.kind, _OTHER)
            ax.plot(
                *(scale.of(arc.points[scale.name]) for scale in plane),
                color=colour,
                linewidth=width,
                linestyle=style,
                path_effects=[withStroke(linewidth=width + 1.2, foreground="white", alpha=0.6)],
            )
    names = [Name(c.name, *(float(s.of(c.parameters[s.name])) for s in plane)) for c in domain.corners]
    for name in names:
        ax.plot(name.x, name.y, "o", color=MARK, markersize=4, zorder=5)
    return names


def domain_handles(domain: Domain) -> list[Artist]:
    """Legend entries of the boundaries that occur."""
    boundaries = (domain.parting, domain.stability, domain.heavy_damping)
    return [
        entry(words + how, colour, style, linewidth=width)
        for arcs, (words, (colour, width)) in zip(boundaries, _BOUNDARIES.items(), strict=True)
        for style, how in dict.fromkeys(_KINDS.get(arc.kind, _OTHER) for arc in arcs)
    ]


def frame(ax: Axes, chart: Chart, plane: Plane) -> None:
    """Symbols and units of the two parameters, and limits at the ends of the grid."""
    x, y = _grid(chart, plane)
    ax.set(xlabel=plane[0].label, ylabel=plane[1].label, xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))


def plane_of(chart: Chart) -> Plane:
    """The two axes of a chart, in the units of its file.

    Raises:
        InputError: for a chart over three parameters.
    """
    if len(chart.axes) != 2:
        message = f"found {len(chart.axes)} parameters; a picture shows a plane: chart two, with the third one fixed"
        raise refusal(message, "axes")
    first, second = chart.axes
    return scale_of(chart.problem.posed, first), scale_of(chart.problem.posed, second)


def draw_domain(
    data: Domain,
    ax: Axes | None = None,
    horizontal: str | None = None,
    vertical: str | None = None,
    problem: Problem | None = None,
) -> Axes:
    """Boundaries of stability and of heavy damping, with their corners.

    The Axes show a plane of two parameters, by default the first two that vary along the boundaries; in the units of a
    problem where one is given, else in SI and rad.

    Example:
        >>> axes = tmsopt.plots.draw_domain(tmsopt.domain("problems/chart.toml"))
        >>> [text.get_text() for text in axes.texts], axes.get_xlabel(), axes.get_ylabel()
        (['EP4'], 'Fr', 'lambda_s')

    More: docs/how_to/charts.md
    """
    arcs = (*data.stability, *data.heavy_damping, *data.parting)
    varying = [n for n in (arcs[0].points if arcs else ()) if any(np.ptp(a.points[n]) > 0 for a in arcs)]
    chosen = [*(n for n in (horizontal, vertical) if n), *varying, "", ""][:2]
    first, second = (scale_of(problem.posed, n) if problem else AxisScale(n, n, Unit()) for n in chosen)
    drawn = on_axes(ax, 6.4, 5.0, problem.title if problem else "")
    names = _in_words(domain_curves(drawn, data, (first, second)), problem)
    drawn.set(xlabel=first.label, ylabel=second.label)
    return finished(drawn, ax is None, names, domain_handles(data))


def _in_words(names: list[Name], problem: Problem | None) -> list[Name]:
    """Names of corners as users of a problem read them."""
    return [replace(n, text=in_words_of(problem.model, n.text)) for n in names] if problem else names


def draw_chart(
    data: Chart, ax: Axes | None = None, layer: str = "kind", design: Solution | None = None, optimum: bool = True
) -> Axes:
    """A chart with its exact boundaries on top, hatched where a constraint is violated.

    The Axes show the plane in the units of the file. Of the abscissa, blue decays and red grows, white is 0, contours
    have their numbers, and a star marks the optimum where the problem asks for one (it is solved for it), else the
    least abscissa of the grid among what the constraints allow.

    Args:
        layer: ``kind``, ``abscissa``, ``damping_ratio``, ``real_roots`` or a quantity of the chart.
        design: a solution to mark.
        optimum: whether to mark that.

    Raises:
        InputError: for a chart over three parameters, or a layer that it does not have.

    Example:
        >>> chart = tmsopt.chart("problems/chart.toml", points=(20, 20))
        >>> axes = tmsopt.plots.draw_chart(chart, design=tmsopt.solve("problems/ep4.toml"))
        >>> [text.get_text() for text in axes.texts]  # the design stands at the corner of heavy damping
        ['EP4, design']

    More: docs/how_to/charts.md
    """
    plane = plane_of(data)
    if layer not in data.layers:
        raise refusal(f"found '{layer}'; {suggest(layer, data.layers)}", "layer")
    drawn = on_axes(ax, 6.4, 5.4, data.problem.title)
    handles: list[Artist] = []
    if layer == "kind":
        fill_classes(drawn, data, plane)
        handles += class_handles(data.kind, data.problem.model)
    else:
        _fill_layer(drawn, data, plane, layer)
    names: list[Name] = []
    if data.domain is not None:
        names = _in_words(domain_curves(drawn, data.domain, plane), data.problem)
        handles += domain_handles(data.domain)
    violated = _violated(drawn, data, plane)
    handles += [violated] if violated else []
    if layer == "abscissa" and optimum:
        handles += _optimum(drawn, data, plane)
    if design is not None:
        x, y = (float(scale.of(design.parameters[scale.name])) for scale in plane)
        handles += _mark(drawn, x, y, "D", f"the design ({design.structure})")
        names.append(Name("design", x, y))
    frame(drawn, data, plane)
    return finished(drawn, ax is None, names, handles)


def chart_figure(chart: Chart, layer: str = "kind", design: Solution | None = None) -> Figure:
    """A chart in a figure of its own.

    Example:
        >>> figure = tmsopt.plots.chart_figure(tmsopt.chart("problems/chart.toml", points=(20, 20)))
        >>> figure.axes[0].get_title()
        'chi_H = 1, chi_B = sqrt(2)'

    More: docs/how_to/charts.md
    """
    return figure_of(draw_chart(chart, None, layer, design))


def _grid(chart: Chart, plane: Plane) -> tuple[Array, Array]:
    first, second = (scale.of(values) for scale, values in zip(plane, chart.grid, strict=True))
    return first, second


def _violated(ax: Axes, chart: Chart, plane: Plane) -> Patch | None:
    """Hatching where a constraint does not hold, and a line where it just does; its legend entry."""
    if "satisfied" not in chart.layers or chart.satisfied.all():
        return None
    grid = _grid(chart, plane)
    hatched = ax.contourf(*grid, ~chart.satisfied, levels=[0.5, 1.5], colors="none", hatches=["//"])
    hatched.set(edgecolor=(0.4, 0.4, 0.4, 0.7), linewidth=0)
    if "margin" in chart.layers and np.any(chart.margin > 0) and np.any(chart.margin < 0):
        ax.contour(*grid, chart.margin, levels=[0], colors="0.3", linewidths=0.8)
    return Patch(facecolor="none", edgecolor="0.4", hatch="//", linewidth=0, label="constraint violated")


def _fill_layer(ax: Axes, chart: Chart, plane: Plane, layer: str) -> None:
    """The abscissa, damping ratio, number of real roots or a quantity, with its colour bar."""
    grid, figure = _grid(chart, plane), figure_of(ax)
    values = np.asarray(chart.layers[layer], dtype=float)
    if layer == "real_roots":
        counts = np.arange(chart.problem.model.degree + 1)
        shades = ListedColormap(colormaps["cividis"](np.linspace(0, 1, len(counts))))
        whole = BoundaryNorm(np.arange(len(counts) + 1) - 0.5, len(counts))
        mesh = ax.pcolormesh(*grid, values, cmap=shades, norm=whole, rasterized=True)
        figure.colorbar(mesh, ax=ax, label=LAYERS[layer], ticks=counts)
        return
    known = values[np.isfinite(values)]
    low, high = (float(np.percentile(known, q)) for q in _SHOWN) if known.size else (0.0, 1.0)
    if layer == "abscissa":
        norm = CenteredNorm(0.0, max(abs(low), abs(high)) or 1.0)
        mesh = ax.pcolormesh(*grid, values, cmap="RdBu_r", norm=norm, rasterized=True)
        levels = [x for x in MaxNLocator(9).tick_values(low, high) if low <= x <= high and x != 0]
        drawn = ax.contour(*grid, np.ma.masked_invalid(values), levels=levels, colors="0.15", linewidths=0.6)
        for text in ax.clabel(drawn, fontsize=6.5, fmt="%.3g"):
            text.set_path_effects([withStroke(linewidth=1.5, foreground="white")])
        if chart.domain is None:
            ax.contour(*grid, np.ma.masked_invalid(values), levels=[0.0], colors=LINE, linewidths=1.6)
        figure.colorbar(mesh, ax=ax, label=abscissa_label(chart.problem.posed), extend="both")
        return
    mesh = ax.pcolormesh(*grid, values, cmap="cividis", vmin=low, vmax=high, rasterized=True)
    label = LAYERS.get(layer, layer)
    figure.colorbar(mesh, ax=ax, label=label, extend="both" if low > known.min(initial=low) else "max")


def _optimum(ax: Axes, chart: Chart, plane: Plane) -> list[Line2D]:
    """The best design of the plane, solved for or of the grid: a star, and the legend says which."""
    problem = chart.problem.posed.nominal
    if problem.objective is not None or problem.pattern is not None:
        found = solve(problem, throw=False, interruptible=False)
        if found.status == "optimal":
            x, y = (float(scale.of(found.parameters[scale.name])) for scale in plane)
            word = "abscissa" if problem.model.carrier is None else "largest Im ω"
            return _mark(ax, x, y, "*", f"optimum ({found.structure}), {word} {found.abscissa:.4g}")
    allowed = chart.satisfied if "satisfied" in chart.layers else np.ones(chart.abscissa.shape, bool)
    values = np.where(allowed & np.isfinite(chart.abscissa), chart.abscissa, np.inf)
    row, column = np.unravel_index(int(values.argmin()), values.shape)
    if not np.isfinite(values[row, column]):
        return []
    x, y = (axis[k] for axis, k in zip(_grid(chart, plane), (column, row), strict=True))
    word = "least abscissa" if problem.model.carrier is None else "best Im ω"
    return _mark(ax, float(x), float(y), "*", f"{word} on the grid, {values[row, column]:.4g}")


def _mark(ax: Axes, x: float, y: float, marker: str, label: str) -> list[Line2D]:
    size, yellow = 12 if marker == "*" else 6, "#F0E442"
    return ax.plot(x, y, marker, color=yellow, mec=LINE, markersize=size, zorder=6, label=label, clip_on=False)
