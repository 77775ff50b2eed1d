"""Draw a Pareto front: a curve for two objectives, coloured points for three."""

import re
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tmsopt.fronts.front import Front, FrontPoint
from tmsopt.plots.labels import Name, finish_axes, scale_of
from tmsopt.plots.style import CAPSIZE, COMPLEX, CRITICAL, HEAVY, LINE, MARK, REAL, STABLE, ensure_axes, figure_of
from tmsopt.records import Array

_STYLES = {
    "EP4": (MARK, "D"),
    "EP3": (MARK, "^"),
    "2EP2": (REAL, "s"),
    "EP2": (REAL, "v"),
    "CEP2": (COMPLEX, "s"),
    "pair+real": (CRITICAL, "o"),
    "two pairs": (STABLE, "o"),
    "pair": (HEAVY, "o"),
    "real": (CAPSIZE, "o"),
}
"""Structure of the rightmost roots → colour and marker; other structures have black crosses."""


def _find_style(structure: str) -> tuple[str, str]:
    """Colour and marker of a structure. An EPk with k > 4 looks like EP4, and a CEPk with k > 2 like CEP2."""
    match = re.fullmatch(r"(C?)EP\d+", structure)
    return _STYLES.get(structure) or (_STYLES["CEP2" if match[1] else "EP4"] if match else (LINE, "x"))


def draw_front(data: Front, ax: Axes | None = None) -> Axes:
    """Draw a front: a curve with gaps for two objectives, or points for three, whose colour is the third objective.

    The Axes show the first two objectives in the units of the file. Colour and marker of a point show the structure of
    its rightmost roots. Points that are not stable are hollow and have a ring, and the curve between them is dashed.
    Kinks and ends have names.

    Example:
        >>> oscillator = tmsopt.models.from_matrices([[1]], [["c"]], [[1]])  # x'' + c x' + x = 0
        >>> problem = tmsopt.Problem(model=oscillator, free={"c": (0.1, 4)}, pareto=["abscissa", "c"])
        >>> axes = tmsopt.plots.draw_front(tmsopt.pareto(problem, points=2))
        >>> [text.get_text() for text in axes.texts]
        ['least abscissa', 'least c']

    More: docs/how_to/fronts.md
    """
    ax = ensure_axes(ax, 6.4, 5.0, data.problem.title or "Pareto front")
    scales = [scale_of(data.problem.posed, text) for text in data.objectives]
    columns = zip(*(p.objectives for p in data.points), strict=True)
    values = np.stack([s.to_axis(column) for s, column in zip(scales, columns, strict=True)], axis=-1)
    ax.set(xlabel=scales[0].label, ylabel=scales[1].label)
    if len(scales) == 2:
        _draw_curve(ax, data, values)
    else:
        points = ax.scatter(values[:, 0], values[:, 1], 22, values[:, 2], zorder=3)
        figure_of(ax).colorbar(points, ax=ax, label=scales[2].label)
    rings = values[[not p.stable for p in data.points], :2]
    if len(rings):  # designs that are not stable, or whose stability is unknown
        ax.plot(*rings.T, "o", color=LINE, markerfacecolor="none", markersize=8, zorder=2.5, label="not stable")
    ax.margins(0.08)
    return finish_axes(ax, _name_points(data.points, values))


def front_figure(front: Front) -> Figure:
    """Draw a front in a new figure.

    Example:
        >>> oscillator = tmsopt.models.from_matrices([[1]], [["c"]], [[1]])  # x'' + c x' + x = 0
        >>> problem = tmsopt.Problem(model=oscillator, free={"c": (0.1, 4)}, pareto=["abscissa", "c"])
        >>> tmsopt.plots.front_figure(tmsopt.pareto(problem, points=2)).axes[0].get_ylabel()
        '$c$'

    More: docs/how_to/fronts.md
    """
    return figure_of(draw_front(front))


def _draw_curve(ax: Axes, front: Front, values: Array) -> None:
    """Draw the curve of two objectives with its gaps, and the points with colours for the structure of their roots."""
    gaps = {gap.index: gap for gap in front.gaps}
    stability = [bool(p.stable) for p in front.points]
    for k, piece in enumerate(np.stack([values[:-1], values[1:]], axis=-1)):
        colour, style = (LINE, "-") if stability[k] and stability[k + 1] else (MARK, "--")
        look: dict[str, Any] = {"color": colour, "linestyle": style, "linewidth": 1}
        if k in gaps:
            label = "not solved" if gaps[k].failed else "gap: no efficient design"
            look = {"color": CAPSIZE, "linestyle": ":", "linewidth": 0.8, "label": label}
        ax.plot(*piece, **look)
    kinds = [(p.structure, is_stable) for p, is_stable in zip(front.points, stability, strict=True)]
    for structure, is_stable in dict.fromkeys(kinds):
        group, (colour, marker) = values[[kind == (structure, is_stable) for kind in kinds]], _find_style(structure)
        fill = colour if is_stable else "white"
        ax.plot(*group.T, marker, color=colour, markerfacecolor=fill, markersize=4, zorder=3, label=structure)


def _name_points(points: tuple[FrontPoint, ...], values: Array) -> list[Name]:
    """Names of the ends, and of kinks where the structure changes. Other kinks have no name."""
    words = [[w for w in p.label.split("; ") if "->" in w or w.startswith(("least", "greatest"))] for p in points]
    positions = values[:, :2].tolist()
    return [Name(", ".join(w).replace("->", "→"), *position) for w, position in zip(words, positions, strict=True) if w]
