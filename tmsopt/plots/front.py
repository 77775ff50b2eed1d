"""A Pareto front as a table, as a curve of two objectives, or as coloured points of three."""

import re

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tmsopt.fronts.front import Front, FrontPoint
from tmsopt.plots.labels import Name, place_names
from tmsopt.plots.style import CAPSIZE, COMPLEX, CRITICAL, HEAVY, LINE, MARK, REAL, STABLE, legend_below, new_figure

_STYLES = {
    "EP4": (MARK, "D"), "EP3": (MARK, "^"), "2EP2": (REAL, "s"), "EP2": (REAL, "v"), "CEP2": (COMPLEX, "s"),
    "pair+real": (CRITICAL, "o"), "two pairs": (STABLE, "o"), "pair": (HEAVY, "o"), "real": (CAPSIZE, "o"),
}  # fmt: skip
"""Colour and marker of each structure; others are black crosses."""


def _style(structure: str) -> tuple[str, str]:
    """A root of five or more drawn as EP4 is, and so with pairs."""
    higher = re.fullmatch(r"(C?)EP\d+", structure)
    return _STYLES.get(structure) or (_STYLES["CEP2" if higher[1] else "EP4"] if higher else (LINE, "x"))


def front_figure(front: Front) -> Figure:
    """Two objectives: the curve, cut at gaps, points by structure. Three: points, the third objective as colour.

    Those that are not stable have a ring.
    """
    figure = new_figure(6.4, 5.0)
    ax = figure.subplots()
    label_objectives(ax, front)
    ax.set_title(front.problem.title or "Pareto front", fontsize=11)
    names = draw_front(ax, front) if len(front.objectives) == 2 else _draw_three(figure, ax, front)
    legend_below(figure, ax.get_legend_handles_labels()[0])
    ax.margins(0.08)
    place_names(ax, names)
    return figure


def draw_front(ax: Axes, front: Front) -> list[Name]:
    """The curve of two objectives; the names of its ends and kinks, to place."""
    values = np.array([p.objectives for p in front.points])
    cuts = [g.index + 1 for g in front.gaps]
    for part in np.split(np.arange(len(front)), cuts):
        ax.plot(values[part, 0], values[part, 1], color=LINE, linewidth=1.0, zorder=2)
    for k, gap in enumerate(front.gaps):
        ends = values[gap.index : gap.index + 2]
        label = "not solved" if gap.failed else "gap: no efficient design"
        known = any(h.get_label() == label for h in ax.get_lines())
        ax.plot(*ends.T, color=CAPSIZE, linewidth=0.8, linestyle=":", zorder=1, label=None if k and known else label)
    for structure in dict.fromkeys(p.structure for p in front.points):
        own = values[[p.structure == structure for p in front.points]]
        colour, marker = _style(structure)
        ax.plot(*own.T, marker, color=colour, markersize=4, zorder=3, label=structure, linestyle="none")
    _ring_unstable(ax, front)
    return _names(front.points)


def label_objectives(ax: Axes, front: Front) -> None:
    """Symbols of the first two objectives, with a unit for a parameter, or their text."""
    ax.set_xlabel(_axis(front, front.objectives[0]))
    ax.set_ylabel(_axis(front, front.objectives[1]))


def _draw_three(figure: Figure, ax: Axes, front: Front) -> list[Name]:
    values = np.array([p.objectives for p in front.points])
    drawn = ax.scatter(values[:, 0], values[:, 1], c=values[:, 2], cmap=matplotlib.colormaps["viridis"], s=22, zorder=3)
    figure.colorbar(drawn, ax=ax, label=_axis(front, front.objectives[2]))
    _ring_unstable(ax, front)
    return _names(front.points)


def _ring_unstable(ax: Axes, front: Front) -> None:
    """A ring around each design that is not stable, or is not known to be."""
    rings = np.array([p.objectives[:2] for p in front.points if not p.stable])
    if len(rings):
        ax.plot(
            *rings.T,
            "o",
            color=LINE,
            markerfacecolor="none",
            markersize=8,
            zorder=2.5,
            label="not stable",
            linestyle="none",
        )


def _names(points: tuple[FrontPoint, ...]) -> list[Name]:
    words = [(p, [w for w in p.label.split("; ") if w and not w.startswith("gap ")]) for p in points]
    return [Name(", ".join(w).replace("->", "→"), p.objectives[0], p.objectives[1]) for p, w in words if w]


def _axis(front: Front, text: str) -> str:
    plain = text.strip()
    name = plain.removeprefix("-").strip()
    sign = "-" if name != plain else ""
    of = front.problem.parameter_set
    if name in of.names:
        unit = "" if of[name].unit == "1" else f" in {of[name].unit}"
        return f"${sign}{of[name].latex}${unit}"
    return plain
