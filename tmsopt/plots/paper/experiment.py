"""The experimental bicycle beside the scaling law, drawn into Axes that the caller made."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tmsopt.paper.experiment import SLACK, CriticalSpeed, Experiment, experiment
from tmsopt.plots.style import COMPLEX, CRITICAL, EDGE, LINE, MARK, REAL, STABLE, new_figure, note

_POINTS = (("*", MARK, 13, (14, -8)), ("s", CRITICAL, 7, (12, 2)), ("o", REAL, 7, (12, -14)))
"""Marker, colour, size and place of the text of each bicycle."""

_CURVES = ((LINE, "-"), (CRITICAL, "--"), (REAL, "-."), (COMPLEX, ":"))


def draw_law(ax: Axes, data: Experiment) -> None:
    """The law χ_B = √(ζ_B/ζ_H) for χ_H = 1, and the bicycles beside it with their own χ_H."""
    ax.plot(data.ratio, data.law, color=LINE, label=r"$\chi_B = \sqrt{\zeta_B/\zeta_H}$, the law for $\chi_H = 1$")
    places = [(b.parameters["zeta_B"] / b.parameters["zeta_H"], b.parameters["chi_B"]) for b in data.bicycles]
    for bicycle, at, (marker, colour, size, offset) in zip(data.bicycles, places, _POINTS, strict=True):
        ax.plot(*at, marker, color=colour, markersize=size, zorder=4, **EDGE)
        text = f"{bicycle.name}\n" + rf"$\chi_B = {at[1]:.4g}$, $\chi_H = {bicycle.parameters['chi_H']:.4g}$"
        if np.isfinite(bicycle.omega0):
            text += "\n" + rf"on the law for any $\chi_H$, $\omega_0 = {bicycle.omega0:g}$"
        note(ax, text, at, offset, verticalalignment="top" if offset[1] < 0 else "bottom")
    ratio, chi_B = places[0]
    law = float(np.interp(ratio, data.ratio, data.law))
    ax.plot([ratio, ratio], [chi_B, law], color=MARK, linewidth=1.2, zorder=3)
    note(ax, f"{100 * (chi_B / law - 1):.1f} % above the law", places[0], (-8, 8), color=MARK)
    ax.set(xlim=(1, 3), ylim=(1, 1.8), xlabel=r"$\zeta_B/\zeta_H$", ylabel=r"$\chi_B$")
    ax.legend(loc="upper left", fontsize=8, framealpha=0.9)


def draw_critical_speeds(ax: Axes, data: Experiment) -> None:
    """Fr_c over χ_B for the geometry of the experimental bicycle, with the minima and the χ_B that was built."""
    law = data.critical[0]
    flat = rf"within {100 * SLACK:.0f} % of the minimum, $\chi_H = 1$"
    ax.axvspan(*law.flat, color=STABLE, alpha=0.25, linewidth=0, label=flat)
    for curve, (colour, style) in zip(data.critical, _CURVES, strict=False):
        ax.plot(curve.chi_B, curve.Fr_c, style, color=colour, linewidth=1.4, label=_name(curve))
        ax.plot(*curve.best, "v", markersize=7, color=colour, zorder=4, **{**EDGE, "markeredgecolor": "white"})
    ax.plot([], [], "v", markersize=7, color="0.3", label=r"minimum over $\chi_B$")
    built, own = data.bicycles[0].parameters["chi_B"], [curve.own for curve in data.critical]
    ax.axvline(built, color=MARK, linewidth=1.1)
    words = rf"as built, $\chi_B = {built:g}$"
    ax.plot([built] * len(own), own, "*", markersize=10, color=MARK, zorder=5, label=words, **EDGE)
    least = np.nanmin([curve.best[1] for curve in data.critical])
    ax.set(xlim=(1, 2.05), ylim=(0.93 * least, 1.9 * least))
    ax.set(xlabel=r"$\chi_B$", ylabel=r"critical Froude number $\mathrm{Fr}_c$")
    ax.legend(loc="upper center", fontsize=7.5, framealpha=0.9)


def experiment_figure() -> Figure:
    """The law with the bicycles beside it, and how flat the optimum of Fr_c is."""
    data, figure = experiment(), new_figure(9.2, 4.4)
    left, right = figure.subplots(1, 2)
    draw_law(left, data)
    draw_critical_speeds(right, data)
    left.set_title(r"(a) The law holds for $\chi_H = 1$;" "\n" r"these bicycles have another $\chi_H$", fontsize=9)
    right.set_title(
        rf"(b) $\zeta_B$, $\zeta_H$ as built; assumed $\lambda_s = {np.rad2deg(data.lambda_s):.0f}°$ and $\mu$"
        "\n"
        rf"With $\chi_H = {data.bicycles[0].parameters['chi_H']:g}$ it is stable only if "
        rf"$\lambda_s > {np.rad2deg(data.least_tilt):.1f}°$",
        fontsize=9,
    )
    return figure


def _name(curve: CriticalSpeed) -> str:
    if np.isnan(curve.mu):
        return rf"$\chi_H = {curve.chi_H:g}$ (the law), any $\mu$"
    return rf"$\chi_H = {curve.chi_H:g}$ as built, $\mu = {curve.mu:g}$"
