"""Stability charts drawn with their exact boundary curves."""

from collections.abc import Mapping

import numpy as np
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.typing import LineStyleType
from numpy.typing import NDArray

from tmsopt.charts.chart import Chart
from tmsopt.plots.labels import Name, label_axes, place_names
from tmsopt.plots.style import CAPSIZE, CRITICAL, LINE, MARK, legend_below, new_figure
from tmsopt.roots import CLASSES
from tmsopt.tracing.domain import Domain

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


def draw_classes(ax: Axes, chart: Chart) -> None:
    """The class of every grid point as a colour."""
    norm = BoundaryNorm(np.arange(len(CLASSES) + 1) - 0.5, len(CLASSES))
    ax.pcolormesh(*chart.grid, chart.kind, cmap=ListedColormap(CLASS_COLOURS), norm=norm, rasterized=True)


def class_handles(kind: NDArray[np.int8]) -> list[Patch]:
    """Legend entries of the classes that occur."""
    words = {"capsize": "unstable by capsize", "weave": "unstable by weave"}
    present = [code for code in range(len(CLASSES)) if np.any(kind == code)]
    return [
        Patch(facecolor=CLASS_COLOURS[k], edgecolor="grey", label=words.get(CLASSES[k], CLASSES[k])) for k in present
    ]


def draw_violated(ax: Axes, chart: Chart) -> Patch | None:
    """Hatching where a constraint does not hold, and a line where it just does; its legend entry."""
    if chart.satisfied.all():
        return None
    hatched = ax.contourf(*chart.grid, ~chart.satisfied, levels=[0.5, 1.5], colors="none", hatches=["//"])
    hatched.set(edgecolor=(0.4, 0.4, 0.4, 0.7), linewidth=0)
    if np.any(chart.margin > 0) and np.any(chart.margin < 0):
        ax.contour(*chart.grid, chart.margin, levels=[0], colors="0.3", linewidths=0.8)
    return Patch(facecolor="none", edgecolor="0.4", hatch="//", linewidth=0, label="constraint violated")


def draw_layer(ax: Axes, chart: Chart, layer: str) -> None:
    """The abscissa, damping ratio, number of real roots or a quantity, with its colour bar."""
    quantity = chart.quantities.get(layer)
    values = np.asarray(getattr(chart, layer) if quantity is None else quantity, dtype=float)
    label = LAYERS.get(layer, layer)
    figure = ax.get_figure()
    assert figure is not None
    if layer == "real_roots":
        counts = np.arange(chart.problem.model.degree + 1)
        shades = ListedColormap(colormaps["cividis"](np.linspace(0, 1, len(counts))))
        norm = BoundaryNorm(np.arange(len(counts) + 1) - 0.5, len(counts))
        mesh = ax.pcolormesh(*chart.grid, values, cmap=shades, norm=norm, rasterized=True)
        figure.colorbar(mesh, ax=ax, label=label, ticks=counts)
        return
    known = values[np.isfinite(values)]
    low, high = (float(np.percentile(known, q)) for q in _SHOWN) if known.size else (0.0, 1.0)
    mesh = ax.pcolormesh(*chart.grid, values, cmap="cividis", vmin=low, vmax=high, rasterized=True)
    figure.colorbar(mesh, ax=ax, label=label, extend="both" if low > known.min(initial=low) else "max")


def draw_domain(ax: Axes, domain: Domain, horizontal: str, vertical: str) -> list[Name]:
    """Boundaries of stability and of heavy damping as curves, their corners marked; names to place."""
    boundaries = (domain.parting, domain.stability, domain.heavy_damping)
    for arcs, (colour, width) in zip(boundaries, _BOUNDARIES.values(), strict=True):
        for arc in arcs:
            style, _ = _KINDS.get(arc.kind, _OTHER)
            ax.plot(
                arc.points[horizontal], arc.points[vertical], color=colour, linewidth=width, linestyle=style,
                path_effects=[withStroke(linewidth=width + 1.2, foreground="white", alpha=0.6)],
            )  # fmt: skip
    for corner in domain.corners:
        x, y = corner.parameters[horizontal], corner.parameters[vertical]
        ax.plot([x], [y], "o", color=MARK, markersize=4, zorder=5)
    return [Name(c.name, c.parameters[horizontal], c.parameters[vertical]) for c in domain.corners]


def domain_handles(domain: Domain) -> list[Line2D]:
    """Legend entries of the boundaries that occur."""
    handles = []
    boundaries = (domain.parting, domain.stability, domain.heavy_damping)
    for arcs, (words, (colour, width)) in zip(boundaries, _BOUNDARIES.items(), strict=True):
        for style, how in dict.fromkeys(_KINDS.get(arc.kind, _OTHER) for arc in arcs):
            handles.append(Line2D([], [], color=colour, linewidth=width, linestyle=style, label=words + how))
    return handles


def frame(ax: Axes, chart: Chart) -> None:
    """Symbols of the two parameters, and limits at the ends of the grid."""
    label_axes(ax, chart.problem.parameter_set, *chart.axes)
    ax.set_xlim(chart.grid[0][0], chart.grid[0][-1])
    ax.set_ylim(chart.grid[1][0], chart.grid[1][-1])


def chart_figure(chart: Chart, layer: str = "kind") -> Figure:
    """A chart with the exact boundaries on top, hatched where a constraint is violated."""
    figure = new_figure(6.4, 5.4)
    ax = figure.subplots()
    handles: list[Artist] = []
    if layer == "kind":
        draw_classes(ax, chart)
        handles += class_handles(chart.kind)
    else:
        draw_layer(ax, chart, layer)
    names: list[Name] = []
    if chart.domain is not None:
        names = draw_domain(ax, chart.domain, *chart.axes)
        handles += domain_handles(chart.domain)
    violated = draw_violated(ax, chart)
    handles += [violated] if violated else []
    frame(ax, chart)
    ax.set_title(chart.problem.title, fontsize=11)
    legend_below(figure, handles)
    place_names(ax, names)
    return figure
