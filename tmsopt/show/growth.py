"""Growth rates and frequencies over the Froude number, drawn into Axes that the caller made."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tmsopt.show.style import CRITICAL, HEAVY, LINE, MARK, STABLE, new_figure
from tmsopt.study.growth import Growth


def draw_growth_rates(ax: Axes, data: Growth) -> None:
    """Growth rates Re s over Fr, with bands of stability and heavy damping, Fr_c and the design marked."""
    _bands(ax, data)
    for column in np.sort(data.roots.real, axis=1).T:
        ax.plot(data.Fr, column, color=LINE, linewidth=1.2)
    _marks(ax, data)
    ax.axhline(0, color="grey", linewidth=0.6)
    ax.set_ylabel(r"growth rates $\mathrm{Re}\,s$")
    ax.legend(loc="upper right", fontsize=8, framealpha=0.9)


def draw_frequencies(ax: Axes, data: Growth) -> None:
    """Frequencies Im s over Fr, marked in the same way."""
    _bands(ax, data)
    for column in np.sort(data.roots.imag, axis=1).T:
        ax.plot(data.Fr, column, color=LINE, linewidth=1.2)
    _marks(ax, data)
    ax.set_ylabel(r"frequencies $\mathrm{Im}\,s$")
    ax.set_xlabel(r"Froude number $\mathrm{Fr} = v/\sqrt{gw}$")


def growth_figure(data: Growth, title: str, metres_per_second: float) -> Figure:
    """Growth rates above frequencies; the upper axis shows the speed for Fr = 1 being `metres_per_second`."""
    figure = new_figure(6.4, 6.4)
    upper, lower = figure.subplots(2, 1, sharex=True)
    draw_growth_rates(upper, data)
    draw_frequencies(lower, data)
    upper.set_xlim(0, data.Fr[-1])
    _focus(upper, data.roots.real, data)
    speed = upper.secondary_xaxis("top", functions=(lambda x: x * metres_per_second, lambda x: x / metres_per_second))
    speed.set_xlabel("speed $v$ in m/s")
    figure.suptitle(title, fontsize=11)
    return figure


def _bands(ax: Axes, data: Growth) -> None:
    for k, (low, high) in enumerate(data.stable):
        ax.axvspan(low, high, color=STABLE, alpha=0.18, linewidth=0, label="stable" if k == 0 else None)
    for k, (low, high) in enumerate(data.heavily_damped):
        ax.axvspan(low, high, color=HEAVY, alpha=0.35, linewidth=0, label="heavily damped" if k == 0 else None)


def _marks(ax: Axes, data: Growth) -> None:
    if np.isfinite(data.Fr_c) and data.Fr_c <= data.Fr[-1]:
        label = rf"$\mathrm{{Fr}}_c = {data.Fr_c:.4g}$"
        ax.axvline(data.Fr_c, color=CRITICAL, linewidth=1.2, linestyle="--", label=label)
    exceptional = "EP" in data.structure
    name = rf"\mathrm{{Fr}}_{{\mathrm{{{data.structure}}}}}" if exceptional else r"\mathrm{Fr}"
    ax.axvline(data.Fr_design, color=MARK, linewidth=1.2, linestyle=":", label=rf"${name} = {data.Fr_design:.4g}$")


def _focus(ax: Axes, values: NDArray[np.float64], data: Growth) -> None:
    """Limits that show the roots around the design even where others run away at low speed."""
    near = values[np.abs(data.Fr - data.Fr_design) <= 0.75 * data.Fr_design + 0.1]
    low, high = float(np.percentile(near, 1)), float(np.percentile(near, 99))
    margin = 0.25 * (high - low) + 0.1
    ax.set_ylim(low - margin, high + margin)
