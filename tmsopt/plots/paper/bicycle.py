"""The two-mass-skate bicycle with its parameters, for the benchmark."""

import numpy as np
from matplotlib.figure import Figure

from tmsopt.paper.reference import benchmark
from tmsopt.paper.sketch import sketch
from tmsopt.plots.bicycle import draw_bicycle, draw_distance
from tmsopt.plots.style import new_figure


def bicycle_figure() -> Figure:
    """The side view beside the enlargement that shows u_H, with the numbers below."""
    data, figure = sketch(benchmark().parameters), new_figure(9.0, 4.1)
    side, near = figure.subplots(1, 2, width_ratios=(2.35, 1))
    draw_bicycle(data, side)
    draw_distance(data, near)
    side.set_title("The two-mass-skate bicycle: the benchmark, to scale", fontsize=10.5)
    near.set_title("enlarged: $H$ and the steer axis", fontsize=9.5)
    p = data.parameters
    figure.supxlabel(
        rf"$\chi_B = x_B/w = {p['chi_B']:.4g}$    $\zeta_B = z_B/w = {p['zeta_B']:.4g}$    "
        rf"$\chi_H = x_H/w = {p['chi_H']:.4g}$    $\zeta_H = z_H/w = {p['zeta_H']:.4g}$    "
        rf"$\mu = m_H/m_B = {p['mu']:.4g}$    $\lambda_s = {np.rad2deg(p['lambda_s']):.4g}°$",
        fontsize=9,
    )
    return figure
