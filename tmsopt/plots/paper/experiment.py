"""The experimental bicycle beside the scaling law, drawn into Axes that the caller made."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tmsopt.paper.experiment import CriticalSpeed, Experiment
from tmsopt.plots.style import COMPLEX, CRITICAL, LINE, MARK, REAL, STABLE, new_figure

_MARKERS = ("*", "s", "o")
_COLOURS = (MARK, CRITICAL, REAL)
_SIZES = (13, 7, 7)
_OFFSETS = ((14, -8), (12, 2), (12, -14))
_CURVES = ((LINE, "-"), (CRITICAL, "--"), (REAL, "-."), (COMPLEX, ":"))


def draw_law(ax: Axes, data: Experiment) -> None:
    """The law χ_B = √(ζ_B/ζ_H) for χ_H = 1, and the bicycles beside it with their own χ_H."""
    ax.plot(data.ratio, data.law, color=LINE, label=r"$\chi_B = \sqrt{\zeta_B/\zeta_H}$, the law for $\chi_H = 1$")
    for point, marker, colour, size, offset in zip(data.points, _MARKERS, _COLOURS, _SIZES, _OFFSETS, strict=True):
        ax.plot(
            [point.ratio],
            [point.chi_B],
            linestyle="none",
            marker=marker,
            color=colour,
            markersize=size,
            zorder=4,
            markeredgecolor="black",
            markeredgewidth=0.6,
        )
        text = f"{point.name}\n" + rf"$\chi_B = {point.chi_B:.4g}$, $\chi_H = {point.chi_H:.4g}$"
        if np.isfinite(point.omega0):
            text += "\n" + rf"on the law for any $\chi_H$, $\omega_0 = {point.omega0:g}$"
        ax.annotate(
            text,
            (point.ratio, point.chi_B),
            xytext=offset,
            textcoords="offset points",
            fontsize=8,
            verticalalignment="top" if offset[1] < 0 else "bottom",
        )
    built = data.points[0]
    law = float(np.interp(built.ratio, data.ratio, data.law))
    ax.annotate(
        "",
        (built.ratio, law),
        (built.ratio, built.chi_B),
        zorder=3,
        arrowprops={"arrowstyle": "-", "color": MARK, "linewidth": 1.2},
    )
    ax.annotate(
        f"{100 * (built.chi_B / law - 1):.1f} % above the law",
        (built.ratio, built.chi_B),
        xytext=(-8, 8),
        textcoords="offset points",
        fontsize=8,
        color=MARK,
        horizontalalignment="right",
    )
    ax.set_xlim(1, 3)
    ax.set_ylim(1, 1.8)
    ax.set_xlabel(r"$\zeta_B/\zeta_H$")
    ax.set_ylabel(r"$\chi_B$")
    ax.legend(loc="upper left", fontsize=8, framealpha=0.9)


def draw_critical_speeds(ax: Axes, data: Experiment) -> None:
    """Fr_c over χ_B for the geometry of the experimental bicycle, with the minima and the χ_B that was built."""
    law = data.critical[0]
    ax.axvspan(
        *law.flat,
        color=STABLE,
        alpha=0.25,
        linewidth=0,
        label=rf"within {100 * law.slack:.0f} % of the minimum, $\chi_H = 1$",
    )
    for curve, (colour, style) in zip(data.critical, _CURVES, strict=False):
        ax.plot(curve.chi_B, curve.Fr_c, color=colour, linestyle=style, linewidth=1.4, label=_name(curve))
        ax.plot(
            [curve.best[0]],
            [curve.best[1]],
            linestyle="none",
            marker="v",
            markersize=7,
            color=colour,
            zorder=4,
            markeredgecolor="white",
            markeredgewidth=0.6,
        )
    ax.plot([], [], linestyle="none", marker="v", markersize=7, color="0.3", label=r"minimum over $\chi_B$")
    ax.axvline(data.chi_B, color=MARK, linewidth=1.1)
    ax.plot(
        [data.chi_B] * len(data.critical),
        [curve.own for curve in data.critical],
        linestyle="none",
        marker="*",
        markersize=10,
        color=MARK,
        markeredgecolor="black",
        markeredgewidth=0.5,
        zorder=5,
        label=rf"as built, $\chi_B = {data.chi_B:g}$",
    )
    least = float(np.nanmin([curve.best[1] for curve in data.critical]))
    ax.set_xlim(1, 2.05)
    ax.set_ylim(0.93 * least, 1.9 * least)
    ax.set_xlabel(r"$\chi_B$")
    ax.set_ylabel(r"critical Froude number $\mathrm{Fr}_c$")
    ax.legend(loc="upper center", fontsize=7.5, framealpha=0.9)


def experiment_figure(data: Experiment) -> Figure:
    """The law with the bicycles beside it, and how flat the optimum of Fr_c is."""
    figure = new_figure(9.2, 4.4)
    left, right = figure.subplots(1, 2)
    draw_law(left, data)
    draw_critical_speeds(right, data)
    p = data.points[0]
    left.set_title(r"(a) The law holds for $\chi_H = 1$;" "\n" r"these bicycles have another $\chi_H$", fontsize=9)
    right.set_title(
        rf"(b) $\zeta_B$, $\zeta_H$ as built; assumed $\lambda_s = {np.rad2deg(data.lambda_s):.0f}°$ and $\mu$"
        "\n"
        rf"With $\chi_H = {p.chi_H:g}$ it is stable only if $\lambda_s > {np.rad2deg(data.least_tilt):.1f}°$",
        fontsize=9,
    )
    return figure


def _name(curve: CriticalSpeed) -> str:
    if np.isnan(curve.mu):
        return rf"$\chi_H = {curve.chi_H:g}$ (the law), any $\mu$"
    return rf"$\chi_H = {curve.chi_H:g}$ as built, $\mu = {curve.mu:g}$"
