"""The rows of a study: a histogram of what was built, or the objective over what varies."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from tmsopt.plots.labels import abscissa_label, finish_axes, scale_of
from tmsopt.plots.style import CAPSIZE, CRITICAL, LINE, MARK, STABLE, figure_of, on_axes
from tmsopt.problem import status_text
from tmsopt.records import Array, Truth
from tmsopt.search.solve import solve
from tmsopt.studies import Results, header

_BINS = 25
_FAR = 6  # widths of the middle half of the values: farther ones are counted, not shown


def draw_histogram(data: Results, ax: Axes | None = None) -> Axes:
    """How the designs of a study come out.

    Of a Monte Carlo study the Axes show how many designs have which abscissa, or for a problem in SI which decay rate
    in 1/s, stable ones apart from the others, with the nominal design and 0 marked and the share of stable ones in the
    title. Of another study they show the objective over what varies first, coloured by what varies next.

    Example:
        >>> study = tmsopt.monte_carlo("problems/benchmark.toml", rows=16, tolerances={"lambda_s": 0.001})
        >>> axes = tmsopt.plots.draw_histogram(tmsopt.run_study(study, workers=1))
        >>> axes.get_title().splitlines()[1]
        '16 of 16 stable (100 %)'

    More: docs/tutorials/study.md
    """
    title = "" if ax else data.study.title or data.study.problem.title
    ax = on_axes(ax, 6.4, 4.2)
    share = (_drawn_around if data.study.method == "monte_carlo" else _over_what_varies)(ax, data)
    ax.set_title(f"{title}\n{share}".strip(), fontsize=10)
    return finish_axes(ax)


def _drawn_around(ax: Axes, data: Results) -> str:
    problem, rows = data.study.problem, data.rows
    of = problem.posed.parameter_set
    nominal = solve(problem, throw=False, interruptible=False)
    values, at, words = rows.values("abscissa"), nominal.abscissa, abscissa_label(problem.posed)
    if of.rate is not None:
        values = -values * of.rate({n: rows.values(header("parameters", n)) for n in of.names})
        at = -at * of.rate(nominal.parameters)
        words = "decay rate in 1/s (negative: growth)"
    known, near = np.isfinite(values), _find_comparable(values)
    stable = rows.column("stable").filled(False)
    for chosen, colour, hatch, label in (stable, STABLE, "", "stable"), (~stable, MARK, "//", "not stable"):
        if (chosen & near).any():
            shown, edges = values[chosen & near], _edges(values[near])
            ax.hist(shown, edges, color=colour, edgecolor="white", hatch=hatch, linewidth=0.5, label=label)
    ax.axvline(at, color=LINE, linestyle="--", label=f"nominal design, {at:.4g}")
    ax.axvline(0, color=CAPSIZE, label="0: neither decay nor growth")
    ax.set(ylabel="designs", xlabel=words)
    counts = (known & ~near, "far beyond the axis"), (~known, "without roots")
    left_out = "".join(f", {np.count_nonzero(which)} {where}" for which, where in counts if which.any())
    share = f"{stable.sum()} of {len(stable)} stable ({100 * stable.mean():.3g} %)" if len(stable) else "no rows"
    return share + left_out


def _find_comparable(values: Array) -> Truth:
    """Which values are not so far from the others that they would hide them."""
    known = values[np.isfinite(values)]
    low, high = np.percentile(known, (25, 75)) if known.size else (0.0, 0.0)
    near: Truth = np.abs(values - (low + high) / 2) <= _FAR * (high - low) + 1e-9 * abs(high)
    return near


def _edges(values: Array) -> list[float]:
    """Edges of bins, one of them 0 where values lie on both sides, so that no bin holds growth and decay."""
    low, high = values.min(), values.max()
    width = (high - low) / _BINS or 1e-3 * (abs(high) or 1.0)
    return [width * k for k in range(math.floor(low / width), math.floor(high / width) + 2)]


def _over_what_varies(ax: Axes, data: Results) -> str:
    study, rows = data.study, data.rows
    problem = study.problem.posed
    sense = problem.minimize or problem.maximize
    found = rows.values("status") == "optimal"
    scale = scale_of(problem, sense or "abscissa")
    y = scale.to_axis(rows.values("objective" if sense else "abscissa")[found])
    axes = [scale_of(problem, name) for name in [*study.columns][:2]]
    varied = [axis.to_axis(rows.values(header("varied", axis.name))[found]) for axis in axes]
    x, *colours = varied or [rows.numbers[found]]
    if colours and found.any():
        drawn = ax.scatter(x, y, c=colours[0], s=26, cmap="cividis", edgecolors="0.3")
        figure_of(ax).colorbar(drawn, ax=ax, label=axes[1].label)
    else:
        ax.plot(x, y, "o-" if study.method == "grid" else "o", color=CRITICAL, markersize=3.5)
    ax.set(xlabel=axes[0].label if axes else "row", ylabel=scale.label)
    ax.xaxis.set_major_locator(MaxNLocator(6))
    return f"{np.count_nonzero(found)} of {len(found)} rows {status_text(problem, 'optimal')}"
