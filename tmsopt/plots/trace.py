"""Draw traced branches as curves in a plane of two parameters."""

from itertools import groupby

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from tmsopt.models import Model, in_words_of, tms
from tmsopt.plots.labels import Name, PlaneAxes, abscissa_label, finish_axes, plane_over
from tmsopt.plots.style import CAPSIZE, COMPLEX, CRITICAL, LINE, MARK, REAL, ensure_axes, figure_of
from tmsopt.tracing.branch import Branch, Trace, kinds_along

_COLOURS = {"EP2": LINE, "weave": CRITICAL, "capsize": CAPSIZE, "resonance": COMPLEX}
"""Pattern → colour; `colour_of` has the rule for other patterns."""

_UNNAMED_EVENTS = ("fold", "constraint", "end")
_BAND_WIDTHS = 6.0, 2.5
"""Widths of the coloured band where a branch is stable and where it is not."""


def draw_trace(data: Trace, ax: Axes | None = None, horizontal: str | None = None, vertical: str | None = None) -> Axes:
    """Draw branches in a plane of two parameters, by default the first two that vary along them.

    The Axes show parameters in the units of the file. A branch is a line, dashed for complex patterns and dotted where
    a constraint is violated. The colour of the band below it shows the abscissa; the band is narrow where the branch is
    unstable. Events have names.

    Example:
        >>> axes = tmsopt.plots.draw_trace(tmsopt.trace("problems/ep_set.toml"))
        >>> [text.get_text() for text in axes.texts], axes.get_legend_handles_labels()[1]
        (['EP4'], ['CEP2', '2EP2'])

    More: docs/how_to/tracing.md
    """
    plane = plane_over(data.problem.posed, horizontal, vertical, *data.varying, *data.problem.free)
    model = data.problem.model
    ax = ensure_axes(ax, 6.4, 5.0, data.problem.title or in_words_of(model, data.pattern))
    _draw_bands(ax, data, plane)
    for branch in data.branches:
        draw_branch(ax, branch, plane, width=1.2, tint=LINE, model=model)
    events = [e for e in data.events if e.name not in _UNNAMED_EVENTS]
    names = [Name(in_words_of(model, e.name), *plane.to_axis(e.parameters)) for e in events]
    for name in names:
        ax.plot(name.x, name.y, "o", color=MARK, markeredgecolor="white", zorder=4)
    plane.label(ax)
    return finish_axes(ax, names)


def draw_branch(
    ax: Axes, branch: Branch, plane: PlaneAxes, width: float, tint: str | None = None, model: Model = tms
) -> None:
    """Draw one branch as lines, pale where it is unstable.

    A line ends where the pattern, the stability or the validity of a constraint changes.

    Args:
        tint: colour of all lines; by default it depends on the pattern.
        model: the model whose names are used for patterns.
    """
    points = plane.to_axis(branch.parameters)
    states = zip(kinds_along(branch), branch.stable, branch.satisfied, strict=True)
    events, start = {e.index for e in branch.events}, 0
    for (kind, stable, satisfied), group in groupby(states):
        stop = start + len(list(group))
        first = start - (start - 1 in events)
        end = stop + (stop - 1 not in events)  # an event belongs to both of its sides, so that there is no gap
        words = in_words_of(model, kind), *["unstable"] * (not stable), *["constraint violated"] * (not satisfied)
        ax.plot(
            *points[:, first:end],
            "--" if kind.startswith("CEP") else "-" if satisfied else ":",
            color=tint or colour_of(kind),
            linewidth=width if satisfied else width / 2,
            alpha=1.0 if stable else 0.35,
            label=", ".join(words),
        )
        start = stop


def colour_of(kind: str) -> str:
    """Colour of a pattern: one for a single multiple root, one for several real roots, and one for complex pairs."""
    if kind in _COLOURS:
        return _COLOURS[kind]
    return COMPLEX if "CEP" in kind else REAL if "+" in kind or kind[0].isdigit() else MARK


def trace_figure(trace: Trace, horizontal: str | None = None, vertical: str | None = None) -> Figure:
    """Draw all branches of a trace in one plane, in a new figure.

    Example:
        >>> figure = tmsopt.plots.trace_figure(tmsopt.trace("problems/ep_set.toml"), "lambda_s", "Fr")
        >>> figure.axes[0].get_xlabel().endswith("in deg"), "Fr" in figure.axes[0].get_ylabel()
        (True, True)

    More: docs/how_to/tracing.md
    """
    return figure_of(draw_trace(trace, None, horizontal, vertical))


def _draw_bands(ax: Axes, data: Trace, plane: PlaneAxes) -> None:
    """Draw the segments of all branches in the colour of the mean abscissa of their ends, and the colour bar."""
    pieces = []  # of each branch: its segments, their mean abscissa, and whether they are stable
    for branch in data.branches:
        points, stable = plane.to_axis(branch.parameters).T, branch.stable
        mean_abscissa = (branch.abscissa[:-1] + branch.abscissa[1:]) / 2
        pieces.append((np.stack([points[:-1], points[1:]], axis=1), mean_abscissa, stable[:-1] & stable[1:]))
    if pieces:
        segments, values, is_stable = (np.concatenate(column) for column in zip(*pieces, strict=True))
        widths = np.where(is_stable, *_BAND_WIDTHS)
        bands = LineCollection([*segments], array=values, linewidths=widths, capstyle="projecting", zorder=1)
        bands.set_cmap("cividis")
        ax.add_collection(bands)
        figure_of(ax).colorbar(bands, ax=ax, label=abscissa_label(data.problem.posed))
