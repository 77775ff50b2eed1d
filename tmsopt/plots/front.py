"""A Pareto front as a curve of two objectives, or as coloured points of three."""

import re
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tmsopt.fronts.front import Front, FrontPoint
from tmsopt.plots.labels import Name, finish_axes, scale_of
from tmsopt.plots.style import CAPSIZE, COMPLEX, CRITICAL, HEAVY, LINE, MARK, REAL, STABLE, figure_of, on_axes
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
"""Colour and marker of each structure; others are black crosses."""


def _style(structure: str) -> tuple[str, str]:
    """A root of five or more drawn as EP4 is, and so with pairs."""
    higher = re.fullmatch(r"(C?)EP\d+", structure)
    return _STYLES.get(structure) or (_STYLES["CEP2" if higher[1] else "EP4"] if higher else (LINE, "x"))


def draw_front(data: Front, ax: Axes | None = None) -> Axes:
    """A front of two objectives as a curve, cut at gaps, or of three as points, the third objective as colour.

    The Axes show the first two objectives, in the units of the file: points by the structure of their roots; those that
    are not stable are hollow with a ring, and the curve is dashed along them; kinks and ends have names.

    Example:
        >>> oscillator = tmsopt.models.from_matrices([[1]], [["c"]], [[1]])  # x'' + c x' + x = 0
        >>> problem = tmsopt.Problem(model=oscillator, free={"c": (0.1, 4)}, pareto=["abscissa", "c"])
        >>> axes = tmsopt.plots.draw_front(tmsopt.pareto(problem, points=2))
        >>> [text.get_text() for text in axes.texts]
        ['least abscissa', 'least c']

    More: docs/how_to/fronts.md
    """
    ax = on_axes(ax, 6.4, 5.0, data.problem.title or "Pareto front")
    scales = [scale_of(data.problem.posed, text) for text in data.objectives]
    columns = zip(*(p.objectives for p in data.points), strict=True)
    values = np.stack([s.to_axis(column) for s, column in zip(scales, columns, strict=True)], axis=-1)
    ax.set(xlabel=scales[0].label, ylabel=scales[1].label)
    if len(scales) == 2:
        _draw_curve(ax, data, values)
    else:
        coloured = ax.scatter(values[:, 0], values[:, 1], 22, values[:, 2], zorder=3)
        figure_of(ax).colorbar(coloured, ax=ax, label=scales[2].label)
    rings = values[[not p.stable for p in data.points], :2]
    if len(rings):  # not stable, or not known to be
        ax.plot(*rings.T, "o", color=LINE, markerfacecolor="none", markersize=8, zorder=2.5, label="not stable")
    ax.margins(0.08)
    return finish_axes(ax, _names(data.points, values))


def front_figure(front: Front) -> Figure:
    """A front in a figure of its own.

    Example:
        >>> oscillator = tmsopt.models.from_matrices([[1]], [["c"]], [[1]])  # x'' + c x' + x = 0
        >>> problem = tmsopt.Problem(model=oscillator, free={"c": (0.1, 4)}, pareto=["abscissa", "c"])
        >>> tmsopt.plots.front_figure(tmsopt.pareto(problem, points=2)).axes[0].get_ylabel()
        '$c$'

    More: docs/how_to/fronts.md
    """
    return figure_of(draw_front(front))


def _draw_curve(ax: Axes, front: Front, values: Array) -> None:
    """Two objectives: the curve, cut at gaps, and points by the structure of their roots."""
    gaps = {gap.index: gap for gap in front.gaps}
    stable = [bool(p.stable) for p in front.points]
    for k, piece in enumerate(np.stack([values[:-1], values[1:]], axis=-1)):
        colour, style = (LINE, "-") if stable[k] and stable[k + 1] else (MARK, "--")
        look: dict[str, Any] = {"color": colour, "linestyle": style, "linewidth": 1}
        if k in gaps:
            label = "not solved" if gaps[k].failed else "gap: no efficient design"
            look = {"color": CAPSIZE, "linestyle": ":", "linewidth": 0.8, "label": label}
        ax.plot(*piece, **look)
    kinds = [(p.structure, s) for p, s in zip(front.points, stable, strict=True)]
    for structure, kept in dict.fromkeys(kinds):
        own, (colour, marker) = values[[kind == (structure, kept) for kind in kinds]], _style(structure)
        fill = colour if kept else "white"
        ax.plot(*own.T, marker, color=colour, markerfacecolor=fill, markersize=4, zorder=3, label=structure)


def _names(points: tuple[FrontPoint, ...], values: Array) -> list[Name]:
    """Names of the ends, and of kinks at which the structure changes; the table has limits that become active."""
    words = [[w for w in p.label.split("; ") if "->" in w or w.startswith(("least", "greatest"))] for p in points]
    return [
        Name(", ".join(w).replace("->", "→"), *map(float, at[:2])) for w, at in zip(words, values, strict=True) if w
    ]
