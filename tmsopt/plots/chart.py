"""Stability charts drawn with their exact boundary curves."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import BoundaryNorm, CenteredNorm, ListedColormap
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
from tmsopt.plots.style import CAPSIZE, CRITICAL, LINE, MARK, figure_of, on_axes
from tmsopt.problem.problem import Problem
from tmsopt.problem.solution import Solution
from tmsopt.records import Array
from tmsopt.roots import CLASSES
from tmsopt.search.solve import solve
from tmsopt.tracing.domain import Domain

Legend = tuple[list[Name], list[Artist]]
"""Names to place, and legend entries."""

CLASS_COLOURS = ("#FFFFFF", "#BBBBBB", "#E6E6E6", "#A6D5F0", "#F2C45A")
"""Fills of the classes, undefined to heavily damped, told apart by lightness too."""

_BOUNDARIES = (
    ("parting", "between capsize and weave", CAPSIZE, 1.2),
    ("stability", "edge of stability", CRITICAL, 1.8),
    ("heavy_damping", "edge of heavy damping", LINE, 1.4),
)
"""Boundaries of a domain, with words, colour and width, in the order in which they are drawn."""

_SHOWN = (1, 95)  # percentiles of a layer between which colours change: poles of the abscissa must not take them all

_KINDS: Mapping[str, tuple[LineStyleType, str]] = {
    "capsize": ("-.", " (root 0)"),
    "infinity": (":", " (root at infinity)"),
}
"""Line of an arc by its kind, and words for it; others are drawn through."""

_LAYERS = {"damping_ratio": "damping ratio", "real_roots": "number of real roots"}
"""Words for layers of numbers; quantities have their own name."""


def fill_classes(ax: Axes, chart: Chart, plane: PlaneAxes) -> None:
    """The class of every grid point as a colour."""
    _fill_counts(ax, chart, plane, "kind", CLASS_COLOURS)


def class_handles(kind: NDArray[np.int8], model: Model) -> list[Patch]:
    """Legend entries of the classes that occur."""
    how = "unstable by" if model.carrier is None else "gain, beyond"
    words = {kind: f"{how} {word}" for kind, word in events_of(model).items()}
    present = [code for code in range(len(CLASSES)) if np.any(kind == code)]
    return [
        Patch(facecolor=CLASS_COLOURS[k], edgecolor="grey", label=words.get(CLASSES[k], CLASSES[k])) for k in present
    ]


def domain_curves(ax: Axes, domain: Domain | None, plane: PlaneAxes, model: Model = tms) -> Legend:
    """Boundaries of stability and of heavy damping as curves, their corners marked; names to place, legend entries.

    Args:
        model: in whose words.
    """
    names: list[Name] = []
    handles: list[Artist] = []
    if domain is None:
        return names, handles
    for name, words, colour, width in _BOUNDARIES:
        for arc in getattr(domain, name):
            style, how = _KINDS.get(arc.kind, ("-", ""))
            around = withStroke(linewidth=width + 1.2, foreground="white", alpha=0.6)
            look: dict[str, Any] = {"color": colour, "linestyle": style, "linewidth": width}
            ax.plot(*plane.to_axis(arc.points), path_effects=[around], **look)
            handles.append(Line2D([], [], label=words + how, **look))
    for corner in domain.corners:
        x, y = plane.to_axis(corner.parameters)
        ax.plot(x, y, "o", color=MARK, markersize=4, zorder=5)
        names.append(Name(in_words_of(model, corner.name), x, y))
    return names, handles


def frame(ax: Axes, chart: Chart, plane: PlaneAxes) -> None:
    """Symbols and units of the two parameters, and limits at the ends of the grid."""
    x, y = _grid(chart, plane)
    plane.label(ax)
    ax.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))


def plane_of(chart: Chart) -> PlaneAxes:
    """The two axes of a chart, in the units of its file.

    Raises:
        InputError: for a chart over three parameters.
    """
    if len(chart.axes) != 2:
        message = f"found {len(chart.axes)} parameters; a picture shows a plane: chart two, with the third one fixed"
        raise input_error(message, "axes")
    return plane_over(chart.problem.posed, *chart.axes)


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
    plane = plane_over(problem.posed if problem else None, horizontal, vertical, *varying)
    drawn = on_axes(ax, 6.4, 5.0, problem.title if problem else "")
    plane.label(drawn)
    return finish_axes(drawn, ax is None, *domain_curves(drawn, data, plane, problem.model if problem else tms))


def draw_chart(
    data: Chart, ax: Axes | None = None, layer: str = "kind", design: Solution | None = None, optimum: bool = True
) -> Axes:
    """A chart with its exact boundaries on top, hatched where a constraint is violated.

    The Axes show the plane in the units of the file. For the abscissa, blue decays and red grows, white is 0, contours
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
        raise input_error(f"found '{layer}'; {suggest(layer, data.layers)}", "layer")
    drawn = on_axes(ax, 6.4, 5.4, data.problem.title)
    if layer == "kind":
        fill_classes(drawn, data, plane)
    else:
        _fill_layer(drawn, data, plane, layer)
    names, curves = domain_curves(drawn, data.domain, plane, data.problem.model)
    classes = class_handles(data.kind, data.problem.model) if layer == "kind" else []
    handles: list[Artist] = [*classes, *curves, *_hatch_violations(drawn, data, plane)]
    if layer == "abscissa" and optimum:
        handles += _optimum(drawn, data, plane)
    if design is not None:
        x, y = at = plane.to_axis(design.parameters)
        handles += _mark(drawn, at, "D", f"the design ({design.structure})")
        names.append(Name("design", x, y))
    frame(drawn, data, plane)
    return finish_axes(drawn, ax is None, names, handles)


def chart_figure(chart: Chart, layer: str = "kind", design: Solution | None = None) -> Figure:
    """A chart in a figure of its own.

    Example:
        >>> figure = tmsopt.plots.chart_figure(tmsopt.chart("problems/chart.toml", points=(20, 20)))
        >>> figure.axes[0].get_title()
        'chi_H = 1, chi_B = sqrt(2)'

    More: docs/how_to/charts.md
    """
    return figure_of(draw_chart(chart, None, layer, design))


def _grid(chart: Chart, plane: PlaneAxes) -> tuple[Array, Array]:
    first, second = (scale.to_axis(values) for scale, values in zip(plane, chart.grid, strict=True))
    return first, second


def _hatch_violations(ax: Axes, chart: Chart, plane: PlaneAxes) -> list[Patch]:
    """Hatching where a constraint does not hold, and a line where it just does; its legend entry."""
    if "satisfied" not in chart.layers or chart.satisfied.all():
        return []
    grid = _grid(chart, plane)
    hatched = ax.contourf(*grid, ~chart.satisfied, levels=[0.5, 1.5], colors="none", hatches=["//"])
    hatched.set(edgecolor=(0.4, 0.4, 0.4, 0.7), linewidth=0)
    if "margin" in chart.layers and np.any(chart.margin > 0) and np.any(chart.margin < 0):
        ax.contour(*grid, chart.margin, levels=[0], colors="0.3", linewidths=0.8)
    return [Patch(facecolor="none", edgecolor="0.4", hatch="//", linewidth=0, label="constraint violated")]


def _fill_counts(ax: Axes, chart: Chart, plane: PlaneAxes, layer: str, colours: Sequence[str] | Array) -> QuadMesh:
    """A layer of whole numbers from 0 on, each as a colour."""
    norm = BoundaryNorm(np.arange(len(colours) + 1) - 0.5, len(colours))
    shades = ListedColormap(colours)
    return ax.pcolormesh(*_grid(chart, plane), chart.layers[layer], cmap=shades, norm=norm, rasterized=True)


def _fill_layer(ax: Axes, chart: Chart, plane: PlaneAxes, layer: str) -> None:
    """The abscissa, damping ratio, number of real roots or a quantity, with its colour bar."""
    grid, figure = _grid(chart, plane), figure_of(ax)
    label = _LAYERS.get(layer, layer)
    if layer == "real_roots":
        counts = np.arange(chart.problem.model.degree + 1)
        shades = colormaps["cividis"](np.linspace(0, 1, len(counts)))
        figure.colorbar(_fill_counts(ax, chart, plane, layer, shades), ax=ax, label=label, ticks=counts)
        return
    values = np.asarray(chart.layers[layer], dtype=float)
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
    figure.colorbar(mesh, ax=ax, label=label, extend="both" if low > known.min(initial=low) else "max")


def _optimum(ax: Axes, chart: Chart, plane: PlaneAxes) -> list[Line2D]:
    """The best design of the plane, solved for or of the grid: a star, and the legend says which."""
    problem = chart.problem.posed.nominal
    if problem.objective is not None or problem.pattern is not None:
        found = solve(problem, throw=False, interruptible=False)
        if found.status == "optimal":
            word = "abscissa" if problem.model.carrier is None else "largest Im ω"
            label = f"optimum ({found.structure}), {word} {found.abscissa:.4g}"
            return _mark(ax, plane.to_axis(found.parameters), "*", label)
    allowed = chart.satisfied if "satisfied" in chart.layers else np.ones(chart.abscissa.shape, bool)
    values = np.where(allowed & np.isfinite(chart.abscissa), chart.abscissa, np.inf)
    row, column = np.unravel_index(int(values.argmin()), values.shape)
    if not np.isfinite(values[row, column]):
        return []
    x, y = _grid(chart, plane)
    word = "least abscissa" if problem.model.carrier is None else "best Im ω"
    return _mark(ax, (x[column], y[row]), "*", f"{word} on the grid, {values[row, column]:.4g}")


def _mark(ax: Axes, at: Iterable[float], marker: str, label: str) -> list[Line2D]:
    size, yellow = 12 if marker == "*" else 6, "#F0E442"
    return ax.plot(*at, marker, color=yellow, mec=LINE, markersize=size, zorder=6, label=label, clip_on=False)
