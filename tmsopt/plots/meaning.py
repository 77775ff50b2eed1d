"""What an optimum means: rounding, distance to the boundaries, laws beside it, all designs, and the ledger."""

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
from tmsopt.plots.style import CRITICAL, STABLE, note, on_axes
from tmsopt.search import Every

_LEAST = 1e-17  # of differences on a logarithmic axis: those of no double
_SEEN = 1e-3  # of the longest bar
_TOWARDS = {"infinity": "a root at infinity", "heavy damping": "the edge of heavy damping"}


def draw_rounding(data: Explanation, ax: Axes | None = None) -> Axes:
    """What rounding the parameters costs.

    The Axes show by how much the abscissa changes, logarithmic, when all free parameters are rounded to so many digits
    and when one is alone: hatched where it falls, with what is violated.

    Example:
        >>> axes = tmsopt.plots.draw_rounding(tmsopt.explain("problems/ep4.toml"))
        >>> [label.get_text() for label in axes.get_yticklabels()][:2]
        ['all to 2 digits', 'all to 3 digits']

    More: docs/how_to/report.md
    """
    rows = [*(("all", row) for row in data.precision), *data.rounding.items()]
    ax = on_axes(ax, 6.0, 1.3 + 0.32 * len(rows), "what rounding does to the abscissa")
    bars = [
        (
            "\nviolates ".join(filter(None, (f"{name} to {row.digits} digits", ", ".join(row.violations)))),
            max(abs(row.loss), _LEAST),
            row.loss <= 0,
        )
        for name, row in rows
    ]
    _bars(ax, bars, ("rises: decays more slowly", "falls: decays faster"))
    decades = np.floor(np.log10([size for _, size, _ in bars] or [1.0]))
    ax.set(xscale="log", xlim=(10 ** decades.min(), 10 ** (decades.max() + 1)), xlabel="change of the abscissa")
    ax.xaxis.set_minor_formatter(NullFormatter())
    return finish_axes(ax)


def draw_robustness(data: Robustness | Nearest, ax: Axes | None = None) -> Axes:
    """Which parameters make up the least change to a boundary; of all boundaries of stability, to the nearest.

    The Axes show each parameter's part of it, in units of its weight (without weights in %); the title says how far the
    boundaries are.

    Example:
        >>> axes = tmsopt.plots.draw_robustness(tmsopt.robustness("problems/benchmark.toml"))
        >>> axes.get_xlabel()  # the nearest boundary
        'change towards a root at infinity in %'

    More: docs/how_to/tolerances.md
    """
    nearest, words = data if isinstance(data, Nearest) else data.limit, _TOWARDS
    near, times, unit = [nearest], 1.0, ""
    if isinstance(data, Robustness):
        words = {**_TOWARDS, **words_of(data.problem.model)}
        near = [n for n in (data.weave, data.capsize, data.infinity, data.heavy_damping) if n.found]
        if data.relative:
            times, unit = 100.0, "\N{NO-BREAK SPACE}%"
    parts = [(n, times * x, False) for n, x in nearest.direction.items() if abs(x) > _SEEN * nearest.distance]
    parts.sort(key=lambda part: -abs(part[1]))
    ax = on_axes(ax, 6.0, 1.3 + 0.26 * len(parts))
    far = ", ".join(f"{words.get(n.kind, n.kind)} at {times * n.distance:.3g}{unit}" for n in near)
    ax.set_title(fill(far, 62) or "no boundary found", fontsize=9.5)
    _bars(ax, parts)
    ax.axvline(0, color="grey", linewidth=0.6)
    if not parts:
        said = "the design is on the boundary" if nearest.found else "none was found"
        ax.text(0.5, 0.5, said, transform=ax.transAxes, horizontalalignment="center", fontsize=9)
    towards = f"change towards {words.get(nearest.kind, nearest.kind)}"
    ax.set_xlabel(f"{towards} in {unit.strip() or 'units of the weights'}")
    return finish_axes(ax)


def draw_comparison(data: Comparison, ax: Axes | None = None) -> Axes:
    """The design beside the laws of the paper.

    The Axes show the relative difference from each law that applies, logarithmic, with the limit of what agrees.

    Example:
        >>> comparison = tmsopt.compare("problems/ep4.toml")
        >>> axes = tmsopt.plots.draw_comparison(comparison)
        >>> len(axes.patches) == sum(row.applies for row in comparison.laws)  # a bar for each
        True

    More: docs/explanation/paper.md
    """
    rows = [row for row in data.laws if row.applies]
    ax = on_axes(ax, 6.0, 1.4 + 0.26 * len(rows), data.design.problem.title)
    bars = [(f"{row.label}: {row.subject}", max(abs(row.relative), _LEAST), bool(row.agrees)) for row in rows]
    _bars(ax, bars, ("differs", "agrees"))
    ax.axvline(SAME_LAW, color="black", linestyle="--", linewidth=1, label=f"agrees up to {SAME_LAW:g}")
    ax.set(xscale="log", xlim=(_LEAST, None), xlabel="relative difference from the law")
    return finish_axes(ax)


def draw_ledger(data: Ledger, ax: Axes | None = None) -> Axes:
    """How many claims of the paper have which verdict; the Axes show counts.

    Example:
        >>> ledger = tmsopt.verify(only=["lscf-*"])
        >>> axes = tmsopt.plots.draw_ledger(ledger)
        >>> [int(text.get_text()) for text in axes.texts] == list(ledger.counts.values())
        True

    More: docs/explanation/paper.md
    """
    ax = on_axes(ax, 6.0, 1.2 + 0.3 * len(data.counts), f"{len(data.entries)} claims of the paper")
    _bars(ax, [(verdict, count, False) for verdict, count in data.counts.items()])
    for k, count in enumerate(data.counts.values()):
        note(ax, str(count), (count, k), (4, 0), verticalalignment="center")
    ax.margins(x=0.12)
    ax.set_xlabel("claims")
    return finish_axes(ax)


def draw_designs(data: Every, ax: Axes | None = None) -> Axes:
    """All designs that were found.

    The Axes show them over the first two free parameters, in the units of the file (of one parameter, the abscissa over
    it): proved ones filled, each with its abscissa.

    Example:
        >>> axes = tmsopt.plots.draw_designs(tmsopt.solve_all("problems/optimised_benchmark.toml"))
        >>> [text.get_text() for text in axes.texts]  # one design, and its abscissa
        ['-1']

    More: docs/how_to/all_designs.md
    """
    if not data.solutions:
        return on_axes(ax, 6.0, 4.4, "no design found")
    problem = data.solutions[0].problem
    ax = on_axes(ax, 6.0, 4.4, problem.title)
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
        inside, label = (CRITICAL, "proved") if is_proved else ("white", "found")
        ax.plot(*point, "o", color=CRITICAL, markerfacecolor=inside, label=label)
    return finish_axes(
        ax, [Name(f"{d.abscissa:.4g}", *at) for d, at in zip(data.solutions, points.tolist(), strict=True)]
    )


def _bars(ax: Axes, bars: Sequence[tuple[str, float, bool]], words: tuple[str, str] = ("", "")) -> None:
    """Horizontal bars by name, the first one uppermost; of a second kind hatched, with words for each kind."""
    for place, (_, length, second) in enumerate(bars):
        colour, hatch = (STABLE, "//") if second else (CRITICAL, "")
        ax.barh(place, length, 0.7, color=colour, hatch=hatch, edgecolor="white", label=words[second])
    ax.set_yticks(range(len(bars)), [name for name, *_ in bars], fontsize=8)
    ax.invert_yaxis()
