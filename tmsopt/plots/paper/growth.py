"""Growth rates of the two bicycles of Fig. fig0, in the dress of the paper."""

import numpy as np
from matplotlib.figure import Figure

from tmsopt.dynamics.growth import growth
from tmsopt.models import tms
from tmsopt.paper.reference import benchmark, optimised_benchmark
from tmsopt.plots.labels import FROUDE
from tmsopt.plots.style import CRITICAL, LINE, MARK, REAL, draw_bands, new_figure, note
from tmsopt.problem.problem import Problem
from tmsopt.search.solve import solve


def growth_figure() -> Figure:
    """Growth rates Re s with bands of stability and heavy damping, the critical Fr and that of the least abscissa."""
    others = {name: value for name, value in benchmark().parameters.items() if name != "Fr"}
    fastest = solve(Problem(tms, fixed=others, free={"Fr": (0.1, 4.0)}, minimize="abscissa"), interruptible=False)
    best = solve(Problem(tms, fixed=dict(optimised_benchmark().parameters)))
    figure = new_figure(9.2, 4.2)
    panels = figure.subplots(1, 2, sharey=True)
    for ax, design, name in zip(panels, (fastest, best), ("(a) benchmark", "(b) optimised benchmark"), strict=True):
        data, at = growth(design, end=4.0), (design.dimensionless["Fr"], design.abscissa)
        draw_bands(ax, data.stable, data.heavily_damped)
        ax.plot(data.values, np.sort(data.roots.real, axis=1), color=LINE, linewidth=1.2)
        label = rf"$\mathrm{{Fr}}_c = {data.critical:.4g}$"
        ax.axvline(data.critical, color=CRITICAL, linewidth=1.2, linestyle="--", label=label)
        symbol = rf"\mathrm{{Fr}}_{{\mathrm{{{data.structure}}}}}" if "EP" in data.structure else r"\mathrm{Fr}"
        ax.axvline(at[0], color=MARK, linewidth=1.2, linestyle=":", label=rf"${symbol} = {at[0]:.4g}$")
        ax.axhline(0, color="grey", linewidth=0.6)
        ax.axhline(at[1], color="0.5", linewidth=0.8, linestyle=":")
        colour = REAL if "EP" in data.structure else "white"
        ax.plot(*at, "o", markersize=6, zorder=5, color=colour, markeredgecolor="black")
        if data.structure == "EP4":
            note(ax, r"$\mathrm{EP}_4$", at, (9, 5), fontsize=10)
        ax.set(xlim=(0, 4), ylim=(-4, 4), xlabel=FROUDE)
        ax.set_title(rf"{name}: least abscissa ${at[1]:.4g}$ at $\mathrm{{Fr}} = {at[0]:.4f}$", fontsize=9.5)
        ax.legend(loc="upper right", fontsize=8, framealpha=0.9)
    panels[0].set_ylabel(r"growth rates $\mathrm{Re}\,s$")
    return figure
