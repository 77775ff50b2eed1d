"""Draw the rows of a study: a histogram of random designs, or the objective over the varied quantity."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from tmsopt.plots.labels import abscissa_label, finish_axes, scale_of
from tmsopt.plots.style import CAPSIZE, CRITICAL, LINE, MARK, STABLE, ensure_axes, figure_of
from tmsopt.problem import status_text
from tmsopt.records import Array, Truth
from tmsopt.search.solve import solve
from tmsopt.studies import Results, header

_BINS = 25
_MAX_DISTANCE = 6  # values farther from the middle than this many interquartile ranges are counted, not shown


def draw_histogram(data: Results, ax: Axes | None = None) -> Axes:
    """Draw the results of a study.

    For a Monte Carlo study the Axes show a histogram of the abscissa, or for a problem in SI of the decay rate in 1/s.
    Stable designs have another colour; the nominal design and 0 are marked, and the title has the share of stable
    designs. For another study the Axes show the objective over the first varied quantity; the colour shows the second.

    Example:
        >>> study = tmsopt.monte_carlo("problems/benchmark.toml", rows=16, tolerances={"lambda_s": 0.001})
        >>> axes = tmsopt.plots.draw_histogram(tmsopt.run_study(study, workers=1))
        >>> axes.get_title().splitlines()[1]
        '16 of 16 stable (100 %)'

    More: docs/tutorials/study.md
    """
    title = "" if ax else data.study.title or data.study.problem.title
    ax = ensure_axes(ax, 6.4, 4.2)
    subtitle = (_draw_monte_carlo if data.study.method == "monte_carlo" else _draw_objective)(ax, data)
    ax.set_title(f"{title}\n{subtitle}".strip(), fontsize=10)
    return finish_axes(ax)


def _draw_monte_carlo(ax: Axes, data: Results) -> str:
    problem, rows = data.study.problem, data.rows
    parameters = problem.posed.parameter_set
    nominal = solve(problem, throw=False, interruptible=False)
    values, nominal_value, axis_label = rows.values("abscissa"), nominal.abscissa, abscissa_label(problem.posed)
    if parameters.rate is not None:
        values = -values * parameters.rate({n: rows.values(header("parameters", n)) for n in parameters.names})
        nominal_value = -nominal_value * parameters.rate(nominal.parameters)
        axis_label = "decay rate in 1/s (negative: growth)"
    has_value, is_near = np.isfinite(values), _find_comparable(values)
    is_stable = rows.column("stable").filled(False)
    for mask, colour, hatch, label in (is_stable, STABLE, "", "stable"), (~is_stable, MARK, "//", "not stable"):
        if (mask & is_near).any():
            ax.hist(
                values[mask & is_near],
                _bin_edges(values[is_near]),
                color=colour,
                edgecolor="white",
                hatch=hatch,
                linewidth=0.5,
                label=label,
            )
    ax.axvline(nominal_value, color=LINE, linestyle="--", label=f"nominal design, {nominal_value:.4g}")
    ax.axvline(0, color=CAPSIZE, label="0: neither decay nor growth")
    ax.set(ylabel="designs", xlabel=axis_label)
    counts = (has_value & ~is_near, "far beyond the axis"), (~has_value, "without roots")
    omissions = "".join(f", {np.count_nonzero(mask)} {reason}" for mask, reason in counts if mask.any())
    share = (
        f"{is_stable.sum()} of {len(is_stable)} stable ({100 * is_stable.mean():.3g} %)"
        if len(is_stable)
        else "no rows"
    )
    return share + omissions


def _find_comparable(values: Array) -> Truth:
    """True for values that are near the middle of all values, so that one axis can show them."""
    finite_values = values[np.isfinite(values)]
    low, high = np.percentile(finite_values, (25, 75)) if finite_values.size else (0.0, 0.0)
    is_near: Truth = np.abs(values - (low + high) / 2) <= _MAX_DISTANCE * (high - low) + 1e-9 * abs(high)
    return is_near


def _bin_edges(values: Array) -> list[float]:
    """Edges of bins. If values have both signs, 0 is an edge, so that no bin contains both growth and decay."""
    low, high = values.min(), values.max()
    width = (high - low) / _BINS or 1e-3 * (abs(high) or 1.0)
    return [width * k for k in range(math.floor(low / width), math.floor(high / width) + 2)]


def _draw_objective(ax: Axes, data: Results) -> str:
    study, rows = data.study, data.rows
    problem = study.problem.posed
    sense = problem.minimize or problem.maximize
    is_optimal = rows.values("status") == "optimal"
    scale = scale_of(problem, sense or "abscissa")
    y = scale.to_axis(rows.values("objective" if sense else "abscissa")[is_optimal])
    axes = [scale_of(problem, name) for name in [*study.columns][:2]]
    columns = [axis.to_axis(rows.values(header("varied", axis.name))[is_optimal]) for axis in axes]
    x, *colours = columns or [rows.numbers[is_optimal]]
    if colours and is_optimal.any():
        points = ax.scatter(x, y, c=colours[0], s=26, cmap="cividis", edgecolors="0.3")
        figure_of(ax).colorbar(points, ax=ax, label=axes[1].label)
    else:
        ax.plot(x, y, "o-" if study.method == "grid" else "o", color=CRITICAL, markersize=3.5)
    ax.set(xlabel=axes[0].label if axes else "row", ylabel=scale.label)
    ax.xaxis.set_major_locator(MaxNLocator(6))
    return f"{np.count_nonzero(is_optimal)} of {len(is_optimal)} rows {status_text(problem, 'optimal')}"
