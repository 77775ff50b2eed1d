"""Traced branches as a table and as curves in a plane of two parameters."""

from itertools import groupby

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tmsopt.plots.labels import Name, label_axes, place_names
from tmsopt.plots.style import CAPSIZE, COMPLEX, CRITICAL, LINE, MARK, REAL, legend_below, new_figure
from tmsopt.tracing.branch import Branch, Trace, kinds_along

COLOURS = {
    "EP4": MARK, "EP3": MARK, "2EP2": REAL, "CEP2": COMPLEX, "EP2": LINE, "weave": CRITICAL, "capsize": CAPSIZE,
    "resonance": COMPLEX,
}  # fmt: skip
"""Colour of each pattern; complex ones are dashed besides."""

_UNLABELLED = ("fold", "constraint", "end")


def draw_trace(ax: Axes, trace: Trace, horizontal: str, vertical: str) -> list[Name]:
    """Branches in a plane of two parameters: one colour per pattern, pale where unstable; events marked.

    They are thin where a constraint is violated. Returns the names of the events, to place.
    """
    for branch in trace.branches:
        draw_branch(ax, branch, horizontal, vertical)
    marked = [e for e in trace.events if e.name not in _UNLABELLED]
    names = [Name(e.name, e.parameters[horizontal], e.parameters[vertical]) for e in marked]
    for name in names:
        ax.plot([name.x], [name.y], "o", color=MARK, markersize=4, zorder=4)
    return names


def draw_branch(ax: Axes, branch: Branch, horizontal: str, vertical: str, width: float = 1.4) -> None:
    """One branch as lines, cut where its pattern, its stability or a constraint changes."""
    x, y = branch.parameters[horizontal], branch.parameters[vertical]
    states = list(zip(kinds_along(branch), branch.stable.tolist(), branch.satisfied.tolist(), strict=True))
    events = {e.index for e in branch.events}
    start = 0
    for (kind, stable, satisfied), run in groupby(states):
        stop = start + len(list(run))
        first = start - 1 if start and start - 1 in events else start
        end = stop if stop - 1 in events else stop + 1  # no gap: an event belongs to both of its sides
        ax.plot(
            x[first:end], y[first:end], color=colour(kind), linewidth=width if satisfied else width / 2,
            linestyle="--" if kind.startswith("CEP") else "-" if satisfied else ":", alpha=1.0 if stable else 0.35,
            label=_label(ax, kind + ("" if stable else ", unstable") + ("" if satisfied else ", constraint violated")),
        )  # fmt: skip
        start = stop


def colour(kind: str) -> str:
    """Colour of a pattern of any degree: one for all higher roots, for several real ones, and for complex pairs."""
    if kind in COLOURS:
        return COLOURS[kind]
    return COMPLEX if "CEP" in kind else REAL if "+" in kind or kind[0].isdigit() else MARK


def trace_figure(trace: Trace, horizontal: str, vertical: str) -> Figure:
    """All branches of a trace in one plane."""
    figure = new_figure(6.4, 5.0)
    ax = figure.subplots()
    names = draw_trace(ax, trace, horizontal, vertical)
    label_axes(ax, trace.problem.parameter_set, horizontal, vertical)
    ax.set_title(trace.problem.title or trace.pattern, fontsize=11)
    legend_below(figure, ax.get_legend_handles_labels()[0])
    place_names(ax, names)
    return figure


def _label(ax: Axes, text: str) -> str | None:
    return None if any(line.get_label() == text for line in ax.get_lines()) else text
