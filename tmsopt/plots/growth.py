"""Growth rates and frequencies over the speed, or another parameter, drawn into Axes that the caller made."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tmsopt.critical_speeds.growth import SPEEDS, Growth
from tmsopt.plots.labels import axis_label
from tmsopt.plots.style import CRITICAL, HEAVY, LINE, MARK, STABLE, new_figure


def draw_growth_rates(ax: Axes, data: Growth) -> None:
    """Growth rates Re s, with bands of stability and heavy damping, the critical value and the design marked."""
    _bands(ax, data)
    for column in np.sort(data.roots.real, axis=1).T:
        ax.plot(data.values, column, color=LINE, linewidth=1.2)
    _marks(ax, data)
    ax.axhline(0, color="grey", linewidth=0.6)
    ax.set_ylabel(r"growth rates $\mathrm{Re}\,s$")
    ax.legend(loc="upper right", fontsize=8, framealpha=0.9)


def draw_frequencies(ax: Axes, data: Growth) -> None:
    """Frequencies Im s, marked in the same way."""
    _bands(ax, data)
    for column in np.sort(data.roots.imag, axis=1).T:
        ax.plot(data.values, column, color=LINE, linewidth=1.2)
    _marks(ax, data)
    ax.set_ylabel(r"frequencies $\mathrm{Im}\,s$")
    ax.set_xlabel(_FROUDE if data.over.name == "Fr" else axis_label(data.over))


_FROUDE = r"Froude number $\mathrm{Fr} = v/\sqrt{gw}$"


def growth_figure(data: Growth, title: str, metres_per_second: float | None = None) -> Figure:
    """Growth rates above frequencies; an upper axis shows the speed for Fr = 1 being `metres_per_second`."""
    figure = new_figure(6.4, 6.4)
    upper, lower = figure.subplots(2, 1, sharex=True)
    draw_growth_rates(upper, data)
    draw_frequencies(lower, data)
    upper.set_xlim(min(0.0, data.values[0]) if data.over.name in SPEEDS else data.values[0], data.values[-1])
    _focus(upper, data.roots.real, data)
    if (unit := metres_per_second) is not None:
        speed = upper.secondary_xaxis("top", functions=(lambda x: x * unit, lambda x: x / unit))
        speed.set_xlabel("speed $v$ in m/s")
    figure.suptitle(title, fontsize=11)
    return figure


def _bands(ax: Axes, data: Growth) -> None:
    for k, (low, high) in enumerate(data.stable):
        ax.axvspan(low, high, color=STABLE, alpha=0.18, linewidth=0, label="stable" if k == 0 else None)
    for k, (low, high) in enumerate(data.heavily_damped):
        ax.axvspan(low, high, color=HEAVY, alpha=0.35, linewidth=0, label="heavily damped" if k == 0 else None)


def _marks(ax: Axes, data: Growth) -> None:
    symbol = f"{{{data.over.latex}}}" if "_" in data.over.latex else data.over.latex  # no second subscript
    if np.isfinite(data.critical) and data.critical <= data.values[-1]:
        label = rf"${symbol}_c = {data.critical:.4g}$"
        ax.axvline(data.critical, color=CRITICAL, linewidth=1.2, linestyle="--", label=label)
    name = rf"{symbol}_{{\mathrm{{{data.structure}}}}}" if "EP" in data.structure else symbol
    ax.axvline(data.design, color=MARK, linewidth=1.2, linestyle=":", label=rf"${name} = {data.design:.4g}$")


def _focus(ax: Axes, values: NDArray[np.float64], data: Growth) -> None:
    """Limits that show the roots around the design even where others run away at low speed."""
    near = values[np.abs(data.values - data.design) <= 0.75 * abs(data.design) + 0.1]
    low, high = float(np.percentile(near, 1)), float(np.percentile(near, 99))
    margin = 0.25 * (high - low) + 0.1
    ax.set_ylim(low - margin, high + margin)
