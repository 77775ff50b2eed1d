"""Figures of the bicycles of the paper: parameters, growth rates, and the experimental bicycle with the scaling law."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tmsopt.dynamics.growth import growth
from tmsopt.models import tms
from tmsopt.paper.experiment import FLAT_SHARE, Experiment, experiment
from tmsopt.paper.reference import benchmark, optimised_benchmark
from tmsopt.paper.sketch import sketch
from tmsopt.plots.bicycle import draw_bicycle, draw_distance
from tmsopt.plots.growth import draw_curves
from tmsopt.plots.labels import finish_axes
from tmsopt.plots.style import COMPLEX, CRITICAL, EDGE, LINE, MARK, REAL, STABLE, new_figure, write_note
from tmsopt.problem.problem import Problem
from tmsopt.search.solve import solve

_BICYCLE_STYLES = (("*", MARK, 13, (14, -8)), ("s", CRITICAL, 7, (12, 2)), ("o", REAL, 7, (12, -14)))
"""For each bicycle: marker, colour and size of the marker, and offset of the text."""

_CURVE_STYLES = ((LINE, "-"), (CRITICAL, "--"), (REAL, "-."), (COMPLEX, ":"))


def bicycle_figure() -> Figure:
    """The side view of the benchmark bicycle and an enlargement that shows u_H, with the parameters below."""
    data, figure = sketch(benchmark().parameters), new_figure(9.0, 4.1)
    side, enlargement = figure.subplots(1, 2, width_ratios=(2.35, 1))
    draw_bicycle(data, side).set_title("The two-mass-skate bicycle: the benchmark, to scale")
    draw_distance(data, enlargement).set_title("enlarged: $H$ and the steer axis")
    p = data.parameters
    figure.supxlabel(
        rf"$\chi_B = x_B/w = {p['chi_B']:.4g}$    $\zeta_B = z_B/w = {p['zeta_B']:.4g}$    "
        rf"$\chi_H = x_H/w = {p['chi_H']:.4g}$    $\zeta_H = z_H/w = {p['zeta_H']:.4g}$    "
        rf"$\mu = m_H/m_B = {p['mu']:.4g}$    $\lambda_s = {np.rad2deg(p['lambda_s']):.4g}°$",
        fontsize=9,
    )
    return figure


def growth_figure() -> Figure:
    """Growth rates Re s with bands of stability and heavy damping, the critical Fr and the Fr of the least abscissa."""
    fixed = {name: value for name, value in benchmark().parameters.items() if name != "Fr"}
    benchmark_design = solve(
        Problem(tms, fixed=fixed, free={"Fr": (0.1, 4.0)}, minimize="abscissa"), interruptible=False
    )
    optimised_design = solve(Problem(tms, fixed=dict(optimised_benchmark().parameters)))
    figure = new_figure(9.2, 4.4)
    panels = figure.subplots(1, 2)
    designs = {"(a) benchmark": benchmark_design, "(b) optimised benchmark": optimised_design}
    for ax, (name, design) in zip(panels, designs.items(), strict=True):
        optimum = design.dimensionless["Fr"], design.abscissa
        ax.axhline(optimum[1], color="0.5", linewidth=0.8, linestyle=":")
        names = draw_curves(ax, growth(design, end=4.0), "real")
        ax.plot(*optimum, "o", color=MARK, zorder=5)
        ax.set_ylim(-4, 4)
        finish_axes(ax, names)
        ax.set_title(rf"{name}: least abscissa ${optimum[1]:.4g}$ at $\mathrm{{Fr}} = {optimum[0]:.4f}$")
    return figure


def experiment_figure() -> Figure:
    """The law with the bicycles, and the critical Froude number near its minimum, which is flat."""
    data, figure = experiment(), new_figure(9.2, 4.4)
    law_axes, speed_axes = figure.subplots(1, 2)
    draw_law(law_axes, data)
    draw_critical_speeds(speed_axes, data)
    law_axes.set_title(r"(a) The law holds for $\chi_H = 1$;" "\n" r"these bicycles have another $\chi_H$")
    speed_axes.set_title(
        rf"(b) $\zeta_B$, $\zeta_H$ as built; assumed $\lambda_s = {np.rad2deg(data.lambda_s):.0f}°$ and $\mu$"
        "\n"
        rf"With $\chi_H = {data.bicycles[0].parameters['chi_H']:g}$ it is stable only if "
        rf"$\lambda_s > {np.rad2deg(data.least_tilt):.1f}°$"
    )
    return figure


def draw_law(ax: Axes, data: Experiment) -> None:
    """Draw the law χ_B = √(ζ_B/ζ_H) for χ_H = 1, and the bicycles, which have another χ_H."""
    ax.plot(data.ratio, data.law, color=LINE, label=r"$\chi_B = \sqrt{\zeta_B/\zeta_H}$, the law for $\chi_H = 1$")
    points = [(b.parameters["zeta_B"] / b.parameters["zeta_H"], b.parameters["chi_B"]) for b in data.bicycles]
    for bicycle, point, (marker, colour, size, offset) in zip(data.bicycles, points, _BICYCLE_STYLES, strict=True):
        ax.plot(*point, marker, color=colour, markersize=size, **EDGE)
        text = f"{bicycle.name}\n" + rf"$\chi_B = {point[1]:.4g}$, $\chi_H = {bicycle.parameters['chi_H']:.4g}$"
        if np.isfinite(bicycle.omega0):
            text += "\n" + rf"on the law for any $\chi_H$, $\omega_0 = {bicycle.omega0:g}$"
        write_note(ax, text, point, offset, verticalalignment="top" if offset[1] < 0 else "bottom")
    ratio, chi_B = points[0]
    law = float(np.interp(ratio, data.ratio, data.law))
    ax.plot([ratio, ratio], [chi_B, law], color=MARK)
    write_note(ax, f"{100 * (chi_B / law - 1):.1f} % above the law", points[0], (-8, 8), color=MARK)
    ax.set(xlim=(1, 3), ylim=(1, 1.8), xlabel=r"$\zeta_B/\zeta_H$", ylabel=r"$\chi_B$")
    ax.legend(loc="upper left")


def draw_critical_speeds(ax: Axes, data: Experiment) -> None:
    """Draw Fr_c over χ_B for the geometry of the experimental bicycle, with the minima and the χ_B that was built."""
    flat_label = rf"within {100 * FLAT_SHARE:.0f} % of the minimum, $\chi_H = 1$"
    ax.axvspan(*data.critical[0].flat_range, color=STABLE, alpha=0.25, linewidth=0, label=flat_label)
    for curve, (colour, style) in zip(data.critical, _CURVE_STYLES, strict=False):
        conditions = " (the law), any $\\mu$" if np.isnan(curve.mu) else rf" as built, $\mu = {curve.mu:g}$"
        ax.plot(curve.chi_B, curve.Fr_c, style, color=colour, label=rf"$\chi_H = {curve.chi_H:g}$" + conditions)
        ax.plot(*curve.minimum, "v", color=colour, markeredgecolor="white")
    ax.plot([], [], "v", color="0.3", label=r"minimum over $\chi_B$")
    chi_B = data.bicycles[0].parameters["chi_B"]
    label = rf"as built, $\chi_B = {chi_B:g}$"
    ax.axvline(chi_B, color=MARK)
    speeds = [curve.experimental_Fr_c for curve in data.critical]
    ax.plot(np.full(len(speeds), chi_B), speeds, "*", markersize=10, color=MARK, label=label, **EDGE)
    least_speed = np.nanmin([curve.minimum[1] for curve in data.critical])
    ax.set(xlim=(1, 2.05), ylim=(0.93 * least_speed, 1.9 * least_speed))
    ax.set(xlabel=r"$\chi_B$", ylabel=r"critical Froude number $\mathrm{Fr}_c$")
    ax.legend(loc="upper center")
