"""Figures from finished data, drawn into Axes that the caller made."""

import os
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tmsopt.study.growth import Growth

FORMATS = ("png", "pdf", "svg")
"""Endings of figure files."""

_STABLE, _HEAVY, _LINE, _MARK, _CRITICAL = "#56B4E9", "#E69F00", "#000000", "#D55E00", "#0072B2"  # Okabe–Ito


def draw_growth_rates(ax: Axes, data: Growth) -> None:
    """Growth rates Re s over Fr, with bands of stability and heavy damping, Fr_c and the design marked."""
    _bands(ax, data)
    for column in np.sort(data.roots.real, axis=1).T:
        ax.plot(data.Fr, column, color=_LINE, linewidth=1.2)
    _marks(ax, data)
    ax.axhline(0, color="grey", linewidth=0.6)
    ax.set_ylabel(r"growth rates $\mathrm{Re}\,s$")
    ax.legend(loc="upper right", fontsize=8, framealpha=0.9)


def draw_frequencies(ax: Axes, data: Growth) -> None:
    """Frequencies Im s over Fr, marked in the same way."""
    _bands(ax, data)
    for column in np.sort(data.roots.imag, axis=1).T:
        ax.plot(data.Fr, column, color=_LINE, linewidth=1.2)
    _marks(ax, data)
    ax.set_ylabel(r"frequencies $\mathrm{Im}\,s$")
    ax.set_xlabel(r"Froude number $\mathrm{Fr} = v/\sqrt{gw}$")


def growth_figure(data: Growth, title: str, metres_per_second: float) -> Figure:
    """Growth rates above frequencies; the upper axis shows the speed for Fr = 1 being `metres_per_second`."""
    figure = Figure(figsize=(6.4, 6.4), layout="constrained")
    FigureCanvasAgg(figure)
    upper, lower = figure.subplots(2, 1, sharex=True)
    draw_growth_rates(upper, data)
    draw_frequencies(lower, data)
    upper.set_xlim(0, data.Fr[-1])
    _focus(upper, data.roots.real, data)
    speed = upper.secondary_xaxis("top", functions=(lambda x: x * metres_per_second, lambda x: x / metres_per_second))
    speed.set_xlabel("speed $v$ in m/s")
    figure.suptitle(title, fontsize=11)
    return figure


def save(figure: Figure, path: Path) -> None:
    """Write a figure as a whole or not at all; the format is the ending of the name.

    Raises:
        OSError: when the file cannot be written.
    """
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=".tmsopt-", suffix=path.suffix)
    os.close(handle)
    try:
        figure.savefig(temporary, dpi=200)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)
        os.replace(temporary, path)
    finally:
        Path(temporary).unlink(missing_ok=True)


def _bands(ax: Axes, data: Growth) -> None:
    for k, (low, high) in enumerate(data.stable):
        ax.axvspan(low, high, color=_STABLE, alpha=0.18, linewidth=0, label="stable" if k == 0 else None)
    for k, (low, high) in enumerate(data.heavily_damped):
        ax.axvspan(low, high, color=_HEAVY, alpha=0.35, linewidth=0, label="heavily damped" if k == 0 else None)


def _marks(ax: Axes, data: Growth) -> None:
    if np.isfinite(data.Fr_c) and data.Fr_c <= data.Fr[-1]:
        label = rf"$\mathrm{{Fr}}_c = {data.Fr_c:.4g}$"
        ax.axvline(data.Fr_c, color=_CRITICAL, linewidth=1.2, linestyle="--", label=label)
    exceptional = "EP" in data.structure
    name = rf"\mathrm{{Fr}}_{{\mathrm{{{data.structure}}}}}" if exceptional else r"\mathrm{Fr}"
    ax.axvline(data.Fr_design, color=_MARK, linewidth=1.2, linestyle=":", label=rf"${name} = {data.Fr_design:.4g}$")


def _focus(ax: Axes, values: NDArray[np.float64], data: Growth) -> None:
    """Limits that show the roots around the design even where others run away at low speed."""
    near = values[np.abs(data.Fr - data.Fr_design) <= 0.75 * data.Fr_design + 0.1]
    low, high = float(np.percentile(near, 1)), float(np.percentile(near, 99))
    margin = 0.25 * (high - low) + 0.1
    ax.set_ylim(low - margin, high + margin)
