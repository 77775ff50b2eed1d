"""The planes of the paper: domains with exact boundaries, the EP set, and the abscissa with the laws drawn in."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from tmsopt.paper.planes import Plane
from tmsopt.plots.chart import class_handles, domain_curves, domain_handles, fill_classes, frame, plane_of
from tmsopt.plots.labels import Name, place_all, place_names
from tmsopt.plots.style import COMPLEX, CRITICAL, LINE, MARK, REAL, legend_below, new_figure
from tmsopt.plots.trace import draw_branch

LAW_STYLE: Mapping[str, tuple[str, str]] = {
    "Frc1": (CRITICAL, "-"),
    "epset": (REAL, "-"),
    "tls": (LINE, ":"),
    "chib1": (LINE, ":"),
}
"""Colour and line of each law."""

_LAW_WORDS = {
    "Frc1": r"$\mathrm{Fr}_c$ (Frc1)",
    "epset": "EP set (epset)",
    "tls": r"$\tan\lambda_s$ (tls)",
    "chib1": r"$\chi_B$ (chib1)",
}


def draw_plane(ax: Axes, plane: Plane) -> list[Name]:
    """Classes, exact boundaries with corners, the EP set and the marked points of a plane; names to place."""
    chart, axes = plane.chart, plane_of(plane.chart)
    fill_classes(ax, chart, axes)
    names = domain_curves(ax, chart.domain, axes) if chart.domain is not None else []
    if plane.ep_set is not None:
        for branch in plane.ep_set.branches:
            draw_branch(ax, branch, axes, width=2.0)
    names += _draw_marked(ax, plane)
    frame(ax, chart, axes)
    return names


def plane_handles(plane: Plane) -> list[Artist]:
    """Legend entries of the classes and the curves of a plane."""
    handles: list[Artist] = [*class_handles(plane.chart.kind, plane.chart.problem.model)]
    if plane.chart.domain is not None:
        handles += domain_handles(plane.chart.domain)
    if plane.ep_set is not None:
        handles.append(Line2D([], [], color=REAL, linewidth=2, label="2EP2"))
        handles.append(Line2D([], [], color=COMPLEX, linewidth=2, linestyle="--", label="CEP2"))
    return handles


def draw_abscissa(ax: Axes, plane: Plane, low: float, high: float) -> ScalarMappable:
    """The abscissa as colours and contours between two values, with the laws as curves."""
    chart = plane.chart
    values = np.clip(chart.abscissa, low, high)
    mesh = ax.pcolormesh(*chart.grid, values, cmap="cividis", vmin=low, vmax=high, rasterized=True)
    levels = np.arange(-1.75, 0.01, 0.25)
    ax.contour(*chart.grid, chart.abscissa, levels=levels, colors="white", linewidths=0.5, linestyles="-")
    for label, (x, y) in plane.laws.items():
        colour, line = LAW_STYLE[label]
        colour = {LINE: "white", CRITICAL: "#56B4E9", REAL: "#E69F00"}[colour]
        ax.plot(x, y, color=colour, linestyle=line, linewidth=1.5, label=_LAW_WORDS[label])
    names = _draw_marked(ax, plane)
    legend = ax.legend(fontsize=7.5, facecolor="0.25", framealpha=0.85, loc="upper left")
    for text in legend.get_texts():
        text.set_color("white")
    frame(ax, chart, plane_of(chart))
    place_names(ax, names)
    return mesh


def planes_figure(planes: Sequence[Plane], titles: Sequence[str]) -> Figure:
    """Planes side by side."""
    figure = new_figure(4.8 * len(planes), 5.0)
    panels = np.atleast_1d(figure.subplots(1, len(planes)))
    names = []
    for ax, plane, title in zip(panels, planes, titles, strict=True):
        names.append(draw_plane(ax, plane))
        ax.set_title(title, fontsize=10)
    legend_below(figure, [h for plane in planes for h in plane_handles(plane)])
    place_all(list(zip(panels, names, strict=True)))
    return figure


def abscissa_figure(planes: Sequence[Plane], titles: Sequence[str], low: float = -1.9, high: float = 0.1) -> Figure:
    """The abscissa over planes side by side, one colour scale for all."""
    figure = new_figure(4.8 * len(planes) + 0.8, 4.4)
    panels = np.atleast_1d(figure.subplots(1, len(planes)))
    mesh = None
    for ax, plane, title in zip(panels, planes, titles, strict=True):
        mesh = draw_abscissa(ax, plane, low, high)
        ax.set_title(title, fontsize=10)
    if mesh is not None:
        figure.colorbar(mesh, ax=panels.tolist(), label="spectral abscissa", extend="max")
    return figure


def _draw_marked(ax: Axes, plane: Plane) -> list[Name]:
    for x, y in plane.marked.values():
        ax.plot([x], [y], "o", color=MARK, markeredgecolor="white", markersize=6, zorder=6)
    words = {"least Fr_c": r"least $\mathrm{Fr}_c$"}
    return [Name(words.get(name, name), x, y) for name, (x, y) in plane.marked.items()]
