"""Growth rates of the two bicycles of Fig. fig0, in the dress of the paper."""

import numpy as np
from matplotlib.axes import Axes

from tmsopt.dynamics.growth import Growth
from tmsopt.plots.style import CRITICAL, HEAVY, LINE, MARK, STABLE


def draw_growth_rates(ax: Axes, data: Growth) -> None:
    """Growth rates Re s, with bands of stability and heavy damping, the critical value and the design marked."""
    for bands, colour, alpha, words in (
        (data.stable, STABLE, 0.18, "stable"),
        (data.heavily_damped, HEAVY, 0.35, "heavily damped"),
    ):
        for k, (low, high) in enumerate(bands):
            ax.axvspan(low, high, color=colour, alpha=alpha, linewidth=0, label=words if k == 0 else None)
    for column in np.sort(data.roots.real, axis=1).T:
        ax.plot(data.values, column, color=LINE, linewidth=1.2)
    symbol = f"{{{data.over.latex}}}" if "_" in data.over.latex else data.over.latex  # no second subscript
    if np.isfinite(data.critical) and data.critical <= data.values[-1]:
        label = rf"${symbol}_c = {data.critical:.4g}$"
        ax.axvline(data.critical, color=CRITICAL, linewidth=1.2, linestyle="--", label=label)
    name = rf"{symbol}_{{\mathrm{{{data.structure}}}}}" if "EP" in data.structure else symbol
    ax.axvline(data.design, color=MARK, linewidth=1.2, linestyle=":", label=rf"${name} = {data.design:.4g}$")
    ax.axhline(0, color="grey", linewidth=0.6)
    ax.set_ylabel(r"growth rates $\mathrm{Re}\,s$")
    ax.legend(loc="upper right", fontsize=8, framealpha=0.9)
