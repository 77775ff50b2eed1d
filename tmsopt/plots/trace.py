"""Traced branches as a table and as curves in a plane of two parameters."""

from itertools import groupby

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tmsopt.plots.labels import Name, label_axes, place_names
from tmsopt.plots.style import CAPSIZE, COMPLEX, CRITICAL, LINE, MARK, REAL, legend_below, new_figure
from tmsopt.report.text import columns, number, with_unit
from tmsopt.roots import pattern
from tmsopt.tracing.branch import Branch, Trace, _sides

COLOURS = {
    "EP4": MARK, "EP3": MARK, "2EP2": REAL, "CEP2": COMPLEX, "EP2": LINE, "weave": CRITICAL, "capsize": CAPSIZE,
    "resonance": COMPLEX,
}  # fmt: skip
"""Colour of each pattern; complex ones are dashed besides."""

_UNLABELLED = ("fold", "constraint", "end")

_FITTING = 1e-6  # mismatch of a coefficient beyond which a point does not belong to its branch


def trace_table(trace: Trace) -> str:
    """Branches with their events, one a row, in the free parameters."""
    free, of = list(trace.problem.free), trace.problem.parameter_set
    per_point = 1e6 * trace.seconds_walking / max(trace.points, 1)
    count = f"{len(trace.branches)} branch" + ("es" if len(trace.branches) != 1 else "")
    points = f", {trace.points} points at {per_point:.0f} µs each" if trace.points else ""
    lines = [
        trace.problem.title or "untitled problem",
        f"{trace.pattern}: {count}{points}, looked for from {trace.starts} starts; {trace.seconds:.2f} s",
    ]
    for number_, branch in enumerate(trace.branches, start=1):
        lines += ["", f"branch {number_}: {_summary(branch, trace)}"]
        rows = [("", *(with_unit(of, n) for n in free), "abscissa", "")]
        for event in branch.events:
            values = (number(event.parameters[n]) for n in free)
            rows.append((event.name, *values, number(float(branch.abscissa[event.index])), event.detail))
        lines += columns(rows)
    return "\n".join(line.rstrip() for line in lines)


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
    states = list(zip(_sides(branch), branch.stable.tolist(), branch.satisfied.tolist(), strict=True))
    events = {e.index for e in branch.events}
    start = 0
    for (kind, stable, satisfied), run in groupby(states):
        stop = start + len(list(run))
        first = start - 1 if start and start - 1 in events else start
        end = stop if stop - 1 in events else stop + 1  # no gap: an event belongs to both of its sides
        ax.plot(
            x[first:end],
            y[first:end],
            color=colour(kind),
            linewidth=width if satisfied else width / 2,
            linestyle="--" if kind.startswith("CEP") else "-" if satisfied else ":",
            alpha=1.0 if stable else 0.35,
            label=_label(ax, kind + ("" if stable else ", unstable") + ("" if satisfied else ", constraint violated")),
        )
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


def _summary(branch: Branch, trace: Trace) -> str:
    share = f"{100 * float(np.mean(branch.stable)):.0f} % of its points"
    states = (
        f"bounds stability on {share}"
        if pattern(branch.pattern, trace.problem.model.degree).rest
        else f"stable on {share}"
    )
    if any(c.comparison != "==" for c in trace.problem.conditions.values()):
        states += f", constraints hold on {100 * float(np.mean(branch.satisfied)):.0f} %"
    form = "closed" if branch.closed else "open"
    kinds = " and ".join(dict.fromkeys(_sides(branch)))
    met = "met" if branch.residual <= _FITTING else "met only"
    return f"{kinds}, {len(branch)} points, {form}, {states}, coefficients {met} to {branch.residual:.0e}"


def _label(ax: Axes, text: str) -> str | None:
    return None if any(line.get_label() == text for line in ax.get_lines()) else text
