"""Write names next to marked points, labels and units on axes, and legends."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import textalloc
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.path import Path
from matplotlib.patheffects import withStroke
from numpy.typing import ArrayLike

from tmsopt.models import Model, Parameter, words_of
from tmsopt.plots.style import draw_legend, figure_of
from tmsopt.problem.problem import Posed
from tmsopt.problem.unit_system import Unit, unit_of
from tmsopt.records import Array

_FONT_SIZE = 8

_SAME_POINT = 0.02  # points that are closer than this fraction of an axis share one label

PETERMANN_LABEL = "Petermann factor"
COMPLEX_H_LABELS = {
    "real": r"$\mathrm{Im}\,\omega$ (loss negative)",
    "imag": r"$\mathrm{Re}\,\omega$",
    "petermann": PETERMANN_LABEL,
}
"""Axis labels of the parts of s = −i ω for a complex H (a matrix with gain or loss), and of its Petermann factor."""


@dataclass(frozen=True)
class Name:
    """A name of a marked point.

    Example:
        >>> name = tmsopt.plots.Name("EP4", x=2.236, y=0.411)
        >>> name.text, name.x, name.y
        ('EP4', 2.236, 0.411)

    More: docs/how_to/tracing.md
    """

    text: str
    x: float
    y: float


class AxisScale(NamedTuple):
    """An axis: the parameter or expression on it, its symbol, and the unit in which the problem was written."""

    name: str
    symbol: str
    unit: Unit = Unit()

    @property
    def label(self) -> str:
        """Symbol and unit."""
        return self.symbol + (f" in {self.unit.text}" if self.unit.text else "")

    def to_axis(self, values: ArrayLike) -> Array:
        """Convert numbers to the unit of the axis."""
        return np.asarray(values, dtype=float) / self.unit.factor


class PlaneAxes(NamedTuple):
    """The two axes of a plane."""

    horizontal: AxisScale
    vertical: AxisScale

    def to_axis(self, values: Mapping[str, ArrayLike]) -> Array:
        """Positions of points on both axes, of shape (2, …), from the values of the parameters or expressions."""
        return np.array([axis.to_axis(values[axis.name]) for axis in self])

    def label(self, ax: Axes) -> None:
        """Write the labels of both axes."""
        ax.set(xlabel=self.horizontal.label, ylabel=self.vertical.label)


def plane_over(problem: Posed | None, *names: str | None) -> PlaneAxes:
    """The plane of the first two names that are not None, in the units of the problem, or else in SI and rad."""
    chosen_names = (*filter(None, names), "", "")[:2]
    return PlaneAxes(*(scale_of(problem, n) if problem else AxisScale(n, n) for n in chosen_names))


def scale_of(problem: Posed, text: str) -> AxisScale:
    """The axis of a parameter of a problem, or of an expression in its parameters."""
    expression = text.strip()
    name = expression.removeprefix("-").strip()
    unit, parameters = unit_of(problem, name), problem.parameter_set
    if name == "abscissa":
        return AxisScale(expression, ("−" if name != expression else "") + abscissa_label(problem))
    sign = "-" if name != expression else ""
    symbol = f"${sign}{parameters[name].latex}$" if name in parameters.names else expression
    return AxisScale(expression, symbol, unit)


def scale_over(problem: Posed, parameter: Parameter) -> AxisScale:
    """The axis of a parameter of a problem, or of a parameter of the model that the problem does not use."""
    if parameter.name == "Fr":
        return AxisScale("Fr", r"Froude number $\mathrm{Fr} = v/\sqrt{gw}$")
    if parameter.name in problem.parameter_set.names:
        return scale_of(problem, parameter.name)
    return AxisScale(parameter.name, f"${parameter.latex}$", Unit("" if parameter.unit == "1" else parameter.unit))


def abscissa_label(problem: Posed, words: str = "spectral abscissa") -> str:
    """Label of the abscissa with its unit: 1/s for a model in SI, √(g/w) for a dimensionless model with data in SI."""
    parameters = problem.parameter_set
    if problem.model.is_complex:
        return rf"largest {COMPLEX_H_LABELS['real']}"
    if parameters.rate is None:
        return words
    return words + (" in 1/s" if parameters is problem.model.sets[0] else r" per $\sqrt{g/w}$")


def events_of(model: Model) -> dict[str, str]:
    """Event → its name: a pair of roots, a root 0 or a root at infinity enters the right half-plane."""
    return {**words_of(model), "infinity": "root at infinity"}


def finish_axes(ax: Axes, names: Sequence[Name] = (), handles: Sequence[Artist] | None = None) -> Axes:
    """Draw the legend, and the names next to their points; return the Axes."""
    draw_legend(ax, ax.get_legend_handles_labels()[0] if handles is None else handles)
    place_names(ax, names)
    return ax


def place_names(ax: Axes, names: Sequence[Name]) -> None:
    """Write names next to their points, away from curves, other names and the frame.

    The limits of the Axes must be set before. Points that almost coincide share one label.

    Example:
        >>> axes = tmsopt.plots.new_figure(3, 3).subplots()  # from 0 to 1
        >>> names = [tmsopt.plots.Name(text, x, 0.5) for text, x in (("EP4", 0.5), ("design", 0.5), ("outside", 2))]
        >>> tmsopt.plots.place_names(axes, names)
        >>> [text.get_text() for text in axes.texts]
        ['EP4, design']

    More: docs/how_to/tracing.md
    """
    if names:
        place_all([(ax, names)])


def place_all(axes_names: Sequence[tuple[Axes, Sequence[Name]]]) -> None:
    """Write names in several Axes of one figure.

    The layout is computed first and kept fixed, because the size of a text relative to the Axes depends on it.
    """
    figure = figure_of(axes_names[0][0])
    engine = figure.get_layout_engine()
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for ax, names in axes_names:
        _place_in_axes(ax, names)
    figure.set_layout_engine(engine)


def _place_in_axes(ax: Axes, names: Sequence[Name]) -> None:
    low, high = np.sort([ax.get_xlim(), ax.get_ylim()]).T
    points: dict[tuple[float, float], list[str]] = {}  # position → texts that are written there
    for name in names:
        point = name.x, name.y
        if np.array_equal(np.clip(point, low, high), point):
            neighbours = (p for p in points if np.all(np.abs(np.subtract(p, point)) <= _SAME_POINT * (high - low)))
            texts = points.setdefault(next(neighbours, point), [])
            texts += [name.text] * (name.text not in texts)
    if not points:
        return
    x, y = np.array([*points]).T
    curves = [xy.T for line in ax.get_lines() for xy in _visible_pieces(ax, line.get_xydata())]
    textalloc.allocate(
        ax,
        x,
        y,
        [", ".join(texts) for texts in points.values()],
        x_scatter=x,
        y_scatter=y,
        x_lines=[xy[0] for xy in curves],
        y_lines=[xy[1] for xy in curves],
        textsize=_FONT_SIZE,
        linecolor="0.4",
        linewidth=0.6,
        zorder=7,
        path_effects=[withStroke(linewidth=2.5, foreground="white")],
    )


def _visible_pieces(ax: Axes, xy: ArrayLike) -> list[Array]:
    """The pieces of a curve inside the figure, with few points but exact to a tenth of a pixel."""
    width, height = figure_of(ax).canvas.get_width_height(physical=True)
    polygons = Path(np.asarray(xy, dtype=float)).to_polygons(ax.transData, width, height, closed_only=False)
    return [ax.transData.inverted().transform(piece) for piece in map(np.asarray, polygons) if len(piece) > 1]
