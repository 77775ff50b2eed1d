"""Stability charts drawn with their exact boundary curves."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from tmsopt.models import ParameterSet
from tmsopt.show.style import CAPSIZE, CRITICAL, LINE, MARK, new_figure
from tmsopt.show.text import columns, number
from tmsopt.study.chart import CLASSES, Chart
from tmsopt.study.domain import Domain

CLASS_COLOURS = ("#FFFFFF", "#BBBBBB", "#E6E6E6", "#A6D5F0", "#F2C45A")
"""Fills of the classes, undefined to heavily damped, told apart by lightness too."""

LAYERS = {
    "kind": "kind of motion",
    "abscissa": "spectral abscissa",
    "damping_ratio": "damping ratio",
    "real_roots": "number of real roots",
}
"""What can be drawn of a chart."""


def draw_classes(ax: Axes, chart: Chart) -> None:
    """The class of every grid point as a colour, with a legend of those that occur."""
    norm = BoundaryNorm(np.arange(len(CLASSES) + 1) - 0.5, len(CLASSES))
    ax.pcolormesh(*chart.grid, chart.kind, cmap=ListedColormap(CLASS_COLOURS), norm=norm, rasterized=True)
    present = [code for code in range(len(CLASSES)) if np.any(chart.kind == code)]
    words = {"capsize": "unstable by capsize", "weave": "unstable by weave"}
    handles = [
        Patch(facecolor=CLASS_COLOURS[k], edgecolor="grey", label=words.get(CLASSES[k], CLASSES[k])) for k in present
    ]
    ax.legend(handles=handles, fontsize=8, framealpha=0.9)


def draw_layer(ax: Axes, chart: Chart, layer: str) -> None:
    """The abscissa, damping ratio or number of real roots, with its colour bar."""
    values = np.asarray(getattr(chart, layer), dtype=float)
    known = values[np.isfinite(values)]
    low, high = (float(np.percentile(known, q)) for q in (0, 95)) if known.size else (0.0, 1.0)
    mesh = ax.pcolormesh(*chart.grid, values, cmap="cividis", vmin=low, vmax=high, rasterized=True)
    figure = ax.get_figure()
    assert figure is not None
    figure.colorbar(mesh, ax=ax, label=LAYERS[layer], extend="max")


def draw_domain(ax: Axes, domain: Domain, horizontal: str, vertical: str) -> None:
    """Boundaries of stability and of heavy damping as curves, their corners marked and named."""
    boundaries = ((domain.merging, CAPSIZE, 1.2), (domain.stability, CRITICAL, 1.8), (domain.heavy_damping, LINE, 1.4))
    for arcs, colour, width in boundaries:
        for arc in arcs:
            style = {"capsize": "-.", "infinity": ":"}.get(arc.kind, "-")
            ax.plot(arc.points[horizontal], arc.points[vertical], color=colour, linewidth=width, linestyle=style)
    for corner in domain.corners:
        x, y = corner.parameters[horizontal], corner.parameters[vertical]
        ax.plot([x], [y], "o", color=MARK, markersize=4, zorder=5)
        name_point(ax, corner.name, x, y)


def name_point(ax: Axes, name: str, x: float, y: float, left: bool = False) -> None:
    """A name beside a marked point, readable on any background."""
    ax.annotate(
        name, (x, y), xytext=(-6 if left else 6, 5), textcoords="offset points", fontsize=8, zorder=6,
        ha="right" if left else "left", bbox={"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.7},
    )  # fmt: skip


def chart_figure(chart: Chart, layer: str = "kind") -> Figure:
    """A chart with the exact boundaries on top, hatched where a constraint is violated."""
    figure = new_figure(6.4, 4.8)
    ax = figure.subplots()
    if layer == "kind":
        draw_classes(ax, chart)
    else:
        draw_layer(ax, chart, layer)
    if chart.domain is not None:
        draw_domain(ax, chart.domain, *chart.axes)
    if not chart.satisfied.all():
        hatched = ax.contourf(*chart.grid, ~chart.satisfied, levels=[0.5, 1.5], colors="none", hatches=["//"])
        hatched.set(edgecolor=(0.4, 0.4, 0.4, 0.7), linewidth=0)
        ax.contour(*chart.grid, chart.satisfied, levels=[0.5], colors="0.3", linewidths=0.8)
    label_axes(ax, chart.problem.parameter_set, *chart.axes)
    ax.set_xlim(chart.grid[0][0], chart.grid[0][-1])
    ax.set_ylim(chart.grid[1][0], chart.grid[1][-1])
    ax.set_title(chart.problem.title, fontsize=11)
    return figure


def label_axes(ax: Axes, of: ParameterSet, horizontal: str, vertical: str) -> None:
    """Symbols and units of two parameters."""
    for name, label in ((horizontal, ax.set_xlabel), (vertical, ax.set_ylabel)):
        unit = "" if of[name].unit == "1" else f" in {of[name].unit}"
        label(f"${of[name].latex}${unit}")


def chart_table(chart: Chart) -> str:
    """Shares of the classes, the best grid point, and the boundaries with their corners."""
    data: dict[str, Any] = chart.to_json()
    first, second = chart.axes
    size = f"{len(chart.grid[0])} × {len(chart.grid[1])}"
    lines = [chart.problem.title or "untitled problem", f"{size} designs over {first} and {second}", ""]
    lines += columns([(name, f"{100 * share:.2f} %") for name, share in chart.shares.items() if share])
    if chart.problem.constraints:
        lines.append(f"  the constraints hold on {100 * data['satisfied']:.2f} %")
    if best := data["least_abscissa"]:
        where = f"{first} = {best[first]:.6g}, {second} = {best[second]:.6g}"
        lines += ["", f"least abscissa on the grid: {best['value']:.6g} at {where}"]
    if chart.domain is not None:
        kinds = [f"{arc.kind} ({len(arc.points[first])} points)" for arc in chart.domain.stability]
        damped = [f"{arc.kind} ({len(arc.points[first])} points)" for arc in chart.domain.heavy_damping]
        lines += ["", f"stability is bounded by {', '.join(kinds) or 'nothing in the box'}"]
        lines += [f"heavy damping is bounded by {', '.join(damped) or 'nothing in the box'}"]
        if chart.domain.corners:
            rows = [("corner", first, second)]
            rows += [(c.name, number(c.parameters[first]), number(c.parameters[second])) for c in chart.domain.corners]
            lines += ["", *columns(rows)]
    return "\n".join(line.rstrip() for line in lines)
