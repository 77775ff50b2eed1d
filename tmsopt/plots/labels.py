"""Names of marked points and of axes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import textalloc
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke

from tmsopt.models import Parameter, ParameterSet

_SIZE = 8

_SAME = 0.02  # of an axis: names of marks so close would stand beside the wrong ones


@dataclass(frozen=True)
class Name:
    """A word for a marked point."""

    text: str
    x: float
    y: float


def place_names(ax: Axes, names: Sequence[Name]) -> None:
    """Write names beside their points, clear of curves, of one another and of the frame; limits must stand.

    Points that fall together share one label.
    """
    low, high = np.array([ax.get_xlim(), ax.get_ylim()]).T
    merged: list[tuple[np.ndarray, list[str]]] = []
    for name in names:
        place = np.array([name.x, name.y])
        if np.any((place - low) * (place - high) > 0):
            continue
        near = [m for m in merged if np.all(np.abs(m[0] - place) <= _SAME * np.abs(high - low))]
        if not near:
            merged.append((place, [name.text]))
        elif name.text not in near[0][1]:
            near[0][1].append(name.text)
    if not merged:
        return
    figure = ax.get_figure(root=True)
    assert figure is not None
    figure.draw_without_rendering()  # settles the layout, and with it how large a text is in the axes
    curves = [np.asarray(line.get_xydata(), dtype=float) for line in ax.get_lines()]
    curves = [xy[np.isfinite(xy).all(axis=1)] for xy in curves]
    places = np.array([place for place, _ in merged])
    textalloc.allocate(
        ax, places[:, 0], places[:, 1], [", ".join(words) for _, words in merged], x_scatter=places[:, 0],
        y_scatter=places[:, 1], x_lines=[xy[:, 0] for xy in curves if len(xy) > 1],
        y_lines=[xy[:, 1] for xy in curves if len(xy) > 1], textsize=_SIZE, linecolor="0.4", linewidth=0.6, zorder=7,
        path_effects=[withStroke(linewidth=2.5, foreground="white")],
    )  # fmt: skip


def label_axes(ax: Axes, of: ParameterSet, horizontal: str, vertical: str) -> None:
    """Symbols and units of two parameters."""
    ax.set_xlabel(axis_label(of[horizontal]))
    ax.set_ylabel(axis_label(of[vertical]))


def axis_label(parameter: Parameter) -> str:
    """Symbol and unit of a parameter."""
    return f"${parameter.latex}$" + ("" if parameter.unit == "1" else f" in {parameter.unit}")
