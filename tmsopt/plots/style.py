"""What all figures share: colours that colour-blind people can distinguish, sizes for print, and saving."""

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

# Colours of the Okabe–Ito palette, and grey.
STABLE = "#56B4E9"  # stable designs
HEAVY = "#E69F00"  # heavily damped designs
LINE = "#000000"  # lines
MARK = "#D55E00"  # marked points
CRITICAL = "#0072B2"  # the weave boundary
REAL = "#009E73"  # real exceptional points
COMPLEX = "#CC79A7"  # complex exceptional points
CAPSIZE = "#999999"  # the capsize boundary

EDGE: dict[str, Any] = {"markeredgecolor": "black", "markeredgewidth": 0.6}
"""Style of the edge of filled markers."""

_ENTRY_WIDTH = 2.6  # width of a legend entry in inches
_OWN_FIGURE = "own"  # label of Axes that are alone in their figure; their legend is below them


def new_figure(width: float, height: float) -> Figure:
    """Make an empty figure that needs no display; width and height are in inches.

    Example:
        >>> figure = tmsopt.plots.new_figure(6.4, 4.8)
        >>> figure.axes, figure.get_size_inches().tolist()
        ([], [6.4, 4.8])

    More: docs/reference/python.md
    """
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def ensure_axes(ax: Axes | None, width: float, height: float, title: str = "") -> Axes:
    """Return the given Axes; if they are None, those of a new figure with a title."""
    if ax is None:
        ax = new_figure(width, height).subplots()
        ax.set(label=_OWN_FIGURE)
        ax.set_title(title, fontsize=11)
    return ax


def figure_of(ax: Axes) -> Figure:
    """The whole figure that holds the Axes."""
    figure: Figure = ax.figure.figure  # the second attribute leads from a part of a figure to the whole
    return figure


def draw_legend(ax: Axes, handles: Sequence[Artist]) -> None:
    """Draw the legend of Axes: inside them, or below them if they are alone in their figure."""
    if ax.get_label() == _OWN_FIGURE:
        legend_below(figure_of(ax), handles)
    else:
        _draw_legend(ax, handles, fontsize=7, framealpha=0.9)


def legend_below(figure: Figure, handles: Sequence[Artist], columns: int | None = None) -> None:
    """Draw one legend for the whole figure, below it, so that it covers nothing."""
    columns = columns or int(figure.get_figwidth() / _ENTRY_WIDTH)
    _draw_legend(figure, handles, loc="outside lower center", ncols=columns, fontsize=8, frameon=False)


def _draw_legend(owner: Axes | Figure, handles: Sequence[Artist], **look: Any) -> None:
    """Draw a legend that has each label once."""
    if entries := {str(h.get_label()): h for h in handles}:
        owner.legend(handles=list(entries.values()), **look)


def draw_bands(ax: Axes, stable: ArrayLike, heavily_damped: ArrayLike) -> None:
    """Draw bands of stability and of heavy damping."""
    for bands, colour, label in (stable, STABLE, "stable"), (heavily_damped, HEAVY, "heavily damped"):
        for low, high in np.reshape(bands, (-1, 2)):
            ax.axvspan(low, high, color=colour, alpha=0.25, linewidth=0, label=label)


def legend_entry(label: str, color: str, style: LineStyleType = "-", **look: Any) -> Artist:
    """An entry of a legend: a line or a marker."""
    return Line2D([], [], color=color, linestyle=style, label=label, **look)


def write_note(ax: Axes, text: str, point: Any, offset: tuple[float, float], **look: Any) -> None:
    """Write a text next to a point; the offset is in points (1/72 inch)."""
    look = {"fontsize": 8, "horizontalalignment": "right" if offset[0] < 0 else "left", **look}
    ax.annotate(text, point, offset, textcoords="offset points", **look)


def draw_arrow(ax: Axes, start: Any, end: Any, **look: Any) -> None:
    """Draw an arrow between two points."""
    style = "-|>,head_width=0.25,head_length=0.5"
    ax.annotate("", end, start, arrowprops={"arrowstyle": style, "shrinkA": 0, "shrinkB": 0, **look})


def save(drawn_on: Figure | Axes, path: str | PathLike[str]) -> None:
    """Write a figure, or the figure of Axes, to a file; the ending of the name is the format.

    An incomplete file is never left.

    Raises:
        OSError: if the file cannot be written.

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
    file_format = path.suffix.lstrip(".").lower()
    with write_atomic(path) as temporary:
        temporary.write_bytes(render(figure, file_format))


def render(figure: Figure, file_format: str) -> bytes:
    """The content of a file with the figure, in the format of that name, e.g. ``png``."""
    stream = BytesIO()
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph", UserWarning)  # a letter without a glyph becomes a box
        figure.savefig(stream, dpi=200, format=file_format)
    return stream.getvalue()
