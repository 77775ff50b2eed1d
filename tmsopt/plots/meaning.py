"""Draw facts about an optimum: effect of rounding, distance to the boundaries, comparison with laws, all designs.

This module also draws the ledger, which lists the claims of the paper with their verdicts.
"""

from collections.abc import Sequence
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import NullFormatter

from tmsopt.analysis import Explanation
from tmsopt.boundaries import Nearest, Robustness
from tmsopt.evaluation.law_rows import SAME_LAW
from tmsopt.models import words_of
from tmsopt.paper import Comparison, Ledger
from tmsopt.plots.labels import Name, abscissa_label, finish_axes, scale_of
from tmsopt.plots.style import CRITICAL, STABLE, ensure_axes, write_note
from tmsopt.search import Every

_MIN_BAR = 1e-17  # shortest bar on a logarithmic axis, also for 0; less than the rounding of doubles near 1
_MIN_SHARE = 1e-3  # a change smaller than this fraction of the distance is not shown
_BOUNDARY_NAMES = {"infinity": "a root at infinity", "heavy damping": "the edge of heavy damping"}


def draw_rounding(data: Explanation, ax: Axes | None = None) -> Axes:
    """Draw how rounding of the parameters changes the abscissa.

    The Axes show the change of the abscissa on a logarithmic scale, when all free parameters or only one are rounded to
    a number of digits. A hatched bar means that the abscissa falls; the label names violated constraints.

    Example:
        >>> axes = tmsopt.plots.draw_rounding(tmsopt.explain("problems/ep4.toml"))
        >>> [label.get_text() for label in axes.get_yticklabels()][:2]
        ['all to 2 digits', 'all to 3 digits']

    More: docs/how_to/report.md
    """
    rows = [*(("all", row) for row in data.precision), *data.rounding.items()]
    ax = ensure_axes(ax, 6.0, 1.3 + 0.32 * len(rows), "what rounding does to the abscissa")
    bars = [
        (
            "\nviolates ".join(filter(None, (f"{name} to {row.digits} digits", ", ".join(row.violations)))),
            max(abs(row.loss), _MIN_BAR),
            row.loss <= 0,
        )
        for name, row in rows
    ]
    _draw_bars(ax, bars, ("rises: decays more slowly", "falls: decays faster"))
    decades = np.floor(np.log10([size for _, size, _ in bars] or [1.0]))
    ax.set(xscale="log", xlim=(10 ** decades.min(), 10 ** (decades.max() + 1)), xlabel="change of the abscissa")
    ax.xaxis.set_minor_formatter(NullFormatter())
    return finish_axes(ax)


def draw_robustness(data: Robustness | Nearest, ax: Axes | None = None) -> Axes:
    """Draw the smallest change of the parameters that leads to a boundary (for a `Robustness`, to the nearest one).

    The Axes show the change of each parameter, in units of its weight, or in % if there are no weights. The title says
    how far away the boundaries are.

    Example:
        >>> axes = tmsopt.plots.draw_robustness(tmsopt.robustness("problems/benchmark.toml"))
        >>> axes.get_xlabel()  # the nearest boundary
        'change towards a root at infinity in %'

    More: docs/how_to/tolerances.md
    """
    nearest, words = data if isinstance(data, Nearest) else data.limit, _BOUNDARY_NAMES
    boundaries, factor, unit = [nearest], 1.0, ""
    if isinstance(data, Robustness):
        words = {**_BOUNDARY_NAMES, **words_of(data.problem.model)}
        boundaries = [n for n in (data.weave, data.capsize, data.infinity, data.heavy_damping) if n.found]
        if data.relative:
            factor, unit = 100.0, "\N{NO-BREAK SPACE}%"
    changes = [(n, factor * x, False) for n, x in nearest.direction.items() if abs(x) > _MIN_SHARE * nearest.distance]
    changes.sort(key=lambda change: -abs(change[1]))
    ax = ensure_axes(ax, 6.0, 1.3 + 0.26 * len(changes))
    distances = ", ".join(f"{words.get(n.kind, n.kind)} at {factor * n.distance:.3g}{unit}" for n in boundaries)
    ax.set_title(fill(distances, 62) or "no boundary found", fontsize=9.5)
    _draw_bars(ax, changes)
    ax.axvline(0, color="grey", linewidth=0.6)
    if not changes:
        message = "the design is on the boundary" if nearest.found else "none was found"
        ax.text(0.5, 0.5, message, transform=ax.transAxes, horizontalalignment="center", fontsize=9)
    label = f"change towards {words.get(nearest.kind, nearest.kind)}"
    ax.set_xlabel(f"{label} in {unit.strip() or 'units of the weights'}")
    return finish_axes(ax)


def draw_comparison(data: Comparison, ax: Axes | None = None) -> Axes:
    """Draw how much a design differs from the laws of the paper.

    The Axes show the relative difference from each law that applies, on a logarithmic scale, and the limit up to which
    design and law agree.

    Example:
        >>> comparison = tmsopt.compare("problems/ep4.toml")
        >>> axes = tmsopt.plots.draw_comparison(comparison)
        >>> len(axes.patches) == sum(row.applies for row in comparison.laws)  # a bar for each
        True

    More: docs/explanation/paper.md
    """
    rows = [row for row in data.laws if row.applies]
    ax = ensure_axes(ax, 6.0, 1.4 + 0.26 * len(rows), data.design.problem.title)
    bars = [(f"{row.label}: {row.subject}", max(abs(row.relative), _MIN_BAR), bool(row.agrees)) for row in rows]
    _draw_bars(ax, bars, ("differs", "agrees"))
    ax.axvline(SAME_LAW, color="black", linestyle="--", linewidth=1, label=f"agrees up to {SAME_LAW:g}")
    ax.set(xscale="log", xlim=(_MIN_BAR, None), xlabel="relative difference from the law")
    return finish_axes(ax)


def draw_ledger(data: Ledger, ax: Axes | None = None) -> Axes:
    """Draw the number of claims of the paper with each verdict.

    Example:
        >>> ledger = tmsopt.verify(only=["lscf-*"])
        >>> axes = tmsopt.plots.draw_ledger(ledger)
        >>> [int(text.get_text()) for text in axes.texts] == list(ledger.counts.values())
        True

    More: docs/explanation/paper.md
    """
    ax = ensure_axes(ax, 6.0, 1.2 + 0.3 * len(data.counts), f"{len(data.entries)} claims of the paper")
    _draw_bars(ax, [(verdict, count, False) for verdict, count in data.counts.items()])
    for k, count in enumerate(data.counts.values()):
        write_note(ax, str(count), (count, k), (4, 0), verticalalignment="center")
    ax.margins(x=0.12)
    ax.set_xlabel("claims")
    return finish_axes(ax)


def draw_designs(data: Every, ax: Axes | None = None) -> Axes:
    """Draw all designs that were found.

    The Axes show the plane of the first two free parameters, in the units of the file, or the abscissa over the only
    free parameter. Each design has its abscissa; the marks of proved designs are filled.

    Example:
        >>> axes = tmsopt.plots.draw_designs(tmsopt.solve_all("problems/optimised_benchmark.toml"))
        >>> [text.get_text() for text in axes.texts]  # one design, and its abscissa
        ['-1']

    More: docs/how_to/all_designs.md
    """
    if not data.solutions:
        return ensure_axes(ax, 6.0, 4.4, "no design found")
    problem = data.solutions[0].problem
    ax = ensure_axes(ax, 6.0, 4.4, problem.title)
    scales = [scale_of(problem.posed, name) for name in [*problem.free][:2]]
    columns = [scale.to_axis([d.parameters[scale.name] for d in data.solutions]) for scale in scales]
    for scale, letter in zip(scales, "xy", strict=False):
        ax.set(**{f"{letter}label": scale.label, f"{letter}lim": scale.to_axis(problem.free[scale.name])})
    if len(scales) < 2:
        columns.append(np.array([d.abscissa for d in data.solutions]))
        ax.set_ylabel(abscissa_label(problem.posed))
    points = np.transpose(columns)
    proved = data.proved or (False,) * len(points)
    for point, is_proved in zip(points, proved, strict=True):
        fill_colour, label = (CRITICAL, "proved") if is_proved else ("white", "found")
        ax.plot(*point, "o", color=CRITICAL, markerfacecolor=fill_colour, label=label)
    return finish_axes(
        ax, [Name(f"{d.abscissa:.4g}", *point) for d, point in zip(data.solutions, points.tolist(), strict=True)]
    )


def _draw_bars(ax: Axes, bars: Sequence[tuple[str, float, bool]], labels: tuple[str, str] = ("", "")) -> None:
    """Draw horizontal bars, the first one at the top.

    Args:
        bars: name, length, and whether the bar belongs to the second kind, which is hatched.
        labels: labels of the first and the second kind in the legend.
    """
    for index, (_, length, is_second) in enumerate(bars):
        colour, hatch = (STABLE, "//") if is_second else (CRITICAL, "")
        ax.barh(index, length, 0.7, color=colour, hatch=hatch, edgecolor="white", label=labels[is_second])
    ax.set_yticks(range(len(bars)), [name for name, *_ in bars], fontsize=8)
    ax.invert_yaxis()
