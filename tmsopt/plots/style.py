"""What all figures share: colours that the colour-blind can tell apart, sizes for print, and saving."""

import warnings
from collections.abc import Sequence
from io import BytesIO
from os import PathLike
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.typing import LineStyleType
from numpy.typing import ArrayLike

from tmsopt.files import as_path, write_atomic

STABLE, HEAVY, LINE, MARK, CRITICAL = "#56B4E9", "#E69F00", "#000000", "#D55E00", "#0072B2"
"""Fills of stability and heavy damping, lines, marked points, the weave boundary (Okabe–Ito)."""

REAL, COMPLEX, CAPSIZE = "#009E73", "#CC79A7", "#999999"
"""Real and complex exceptional points, the capsize boundary."""

EDGE: dict[str, Any] = {"markeredgecolor": "black", "markeredgewidth": 0.6}
"""Of filled markers."""

_ENTRY = 2.6  # inches of a legend entry
_OWN = "own"  # label of Axes in a figure of their own, which has its legend below


def new_figure(width: float, height: float) -> Figure:
    """An empty figure, sizes in inches, that needs no display.

    Example:
        >>> figure = tmsopt.plots.new_figure(6.4, 4.8)
        >>> figure.axes, figure.get_size_inches().tolist()
        ([], [6.4, 4.8])

    More: docs/reference/python.md
    """
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def on_axes(ax: Axes | None, width: float, height: float, title: str = "") -> Axes:
    """The Axes given, or those of a new figure with a title."""
    if ax is None:
        ax = new_figure(width, height).subplots()
        ax.set(label=_OWN)
        ax.set_title(title, fontsize=11)
    return ax


def figure_of(ax: Axes) -> Figure:
    """The whole figure that Axes stand in."""
    figure: Figure = ax.figure.figure  # that of a part of a figure is the whole
    return figure


def draw_legend(ax: Axes, handles: Sequence[Artist]) -> None:
    """The legend of Axes, in a figure of their own below it."""
    if ax.get_label() == _OWN:
        legend_below(figure_of(ax), handles)
    else:
        _legend(ax, handles, fontsize=7, framealpha=0.9)


def legend_below(figure: Figure, handles: Sequence[Artist], columns: int | None = None) -> None:
    """One legend for the whole figure, below it, where it covers nothing."""
    columns = columns or int(figure.get_figwidth() / _ENTRY)
    _legend(figure, handles, loc="outside lower center", ncols=columns, fontsize=8, frameon=False)


def _legend(place: Axes | Figure, handles: Sequence[Artist], **look: Any) -> None:
    """A legend that has each label once."""
    if once := {str(h.get_label()): h for h in handles}:
        place.legend(handles=list(once.values()), **look)


def draw_bands(ax: Axes, stable: ArrayLike, heavily_damped: ArrayLike) -> None:
    """Bands of stability and of heavy damping."""
    for bands, colour, words in (stable, STABLE, "stable"), (heavily_damped, HEAVY, "heavily damped"):
        for low, high in np.reshape(bands, (-1, 2)):
            ax.axvspan(low, high, color=colour, alpha=0.25, linewidth=0, label=words)


def entry(label: str, color: str, style: LineStyleType = "-", **look: Any) -> Artist:
    """An entry of a legend: a line or a marker."""
    return Line2D([], [], color=color, linestyle=style, label=label, **look)


def note(ax: Axes, text: str, place: Any, offset: tuple[float, float], **look: Any) -> None:
    """A text beside a point, by an offset in points."""
    look = {"fontsize": 8, "horizontalalignment": "right" if offset[0] < 0 else "left", **look}
    ax.annotate(text, place, offset, textcoords="offset points", **look)


def arrow(ax: Axes, start: Any, end: Any, **look: Any) -> None:
    """An arrow from point to point."""
    style = "-|>,head_width=0.25,head_length=0.5"
    ax.annotate("", end, start, arrowprops={"arrowstyle": style, "shrinkA": 0, "shrinkB": 0, **look})


def save(drawn_on: Figure | Axes, path: str | PathLike[str]) -> None:
    """Write a figure, or that of Axes, as a whole or not at all; the format is the ending of the name.

    Raises:
        OSError: when the file cannot be written.

    Example:
        >>> import pathlib, tempfile
        >>> axes = tmsopt.plots.draw_speeds(tmsopt.speeds("problems/benchmark.toml"))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     tmsopt.plots.save(axes, pathlib.Path(folder, "speeds.svg"))
        ...     pathlib.Path(folder, "speeds.svg").read_text(encoding="utf-8")[:5]
        '<?xml'

    More: docs/reference/python.md
    """
    path = as_path(path, "the file to write")
    figure = figure_of(drawn_on) if isinstance(drawn_on, Axes) else drawn_on
    ending = path.suffix.lstrip(".").lower()
    with write_atomic(path) as temporary:
        temporary.write_bytes(render(figure, ending))


def render(figure: Figure, ending: str) -> bytes:
    """A figure as what a file of that ending holds."""
    sink = BytesIO()
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph", UserWarning)  # of letters that no font here has: boxes show that
        figure.savefig(sink, dpi=200, format=ending)
    return sink.getvalue()
