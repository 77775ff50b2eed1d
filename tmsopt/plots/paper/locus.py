"""Root loci in the complex plane, drawn into Axes that the caller made."""

from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tmsopt.dynamics import Growth
from tmsopt.paper.locus import FR_MAX, LocusRow, multiple_roots, table_1_loci
from tmsopt.plots.style import COMPLEX, CRITICAL, EDGE, LINE, MARK, REAL, arrow, entry, legend_below, new_figure, note
from tmsopt.records import Array, Complex

_CURVES = ((LINE, 1.5), (CRITICAL, 1.0), (MARK, 1.0))
"""Colour and width at χ_B of the law, below it, above it."""

NAMES = {"EP4": r"$\mathrm{EP}_4$", "2EP2": r"$2\mathrm{EP}_2$", "CEP2": r"$\mathrm{CEP}_2$", "EP2": r"$\mathrm{EP}_2$"}
"""Multiple roots in the symbols of the paper."""

_PLACES = {"EP4": ((-34, 9),), "2EP2": ((22, 26), (1, 33)), "CEP2": ((10, -17), (10, 12)), "EP2": ((6, -13),)}
"""Where the names stand beside the roots, in points, by ascending real and imaginary part."""

_LEADER = {"arrowstyle": "-", "linewidth": 0.5, "color": "0.3", "shrinkA": 0, "shrinkB": 3}
"""From a multiple root to a name that stands off."""

_CIRCLE: dict[str, Any] = {"color": "0.55", "linewidth": 3.5, "alpha": 0.45}
_CROSSING: dict[str, Any] = {"markersize": 4.5, "markerfacecolor": "white", "markeredgecolor": LINE}

Window = Array
"""Left, right, low and high."""


def draw_row(ax: Axes, row: LocusRow, window: Window, arrows: int) -> None:
    """The three loci of one steer axis tilt with the circle |s| = |ω0|, inside a window."""
    omega0 = row.bicycle.omega0
    ax.axhline(0, color="0.75", linewidth=0.6, zorder=0)
    ax.axvline(0, color="0.4", linewidth=0.8, zorder=0)
    circle = abs(omega0) * np.exp(1j * np.linspace(0, 2 * np.pi, 361))
    ax.plot(circle.real, circle.imag, zorder=0.5, gid="circle", **_CIRCLE)
    ax.set(xlim=window[:2], ylim=window[2:], aspect="equal")
    for data, (colour, width) in reversed([*zip(row.loci, _CURVES, strict=True)]):
        tracks = [s for m in data.modes for s in ([m.roots, m.roots.conj()] if m.roots.imag.any() else [m.roots])]
        for s in tracks:
            ax.plot(s.real, s.imag, color=colour, linewidth=width, solid_capstyle="round", gid="track")
            _arrows(ax, s, colour, 2 if colour == LINE else arrows)
    _marks(ax, row.loci[0], omega0)


def root_locus_figure() -> Figure:
    """The whole complex plane beside an enlargement around the exceptional points, a row per steer axis tilt."""
    rows = table_1_loci()
    figure = new_figure(7.4, 3.05 * len(rows) + 0.4)
    axes = figure.subplots(len(rows), 2)
    for (left, right), row, letter in zip(axes, rows, "abc", strict=True):
        near = _zoom_window(row)
        draw_row(left, row, full_window(row), 1)
        draw_row(right, row, near, 2)
        left.plot(near[[0, 1, 1, 0, 0]], near[[2, 2, 3, 3, 2]], ":", color="0.4", linewidth=0.7, zorder=4)
        name, tilt = row.bicycle.name, row.bicycle.parameters["lambda_s"]
        offset = {"2EP2": " - 0.05", "CEP2": " + 0.8"}.get(name, "")
        exact = r"\arctan(\frac{15}{4} - \frac{75}{32}\sqrt{2})"
        left.set_title(rf"({letter}) $\lambda_s = {exact}{offset} = {tilt:.4f}$ rad", fontsize=9)
        at = rf"$\mathrm{{Fr}} = {row.loci[0].design:.6g}$"
        right.set_title(f"enlarged: {NAMES[name]} at {at}", fontsize=9)
        left.set_ylabel(r"$\mathrm{Im}\,s$")
        shifts = "", f" - {row.offset:g}", f" + {row.offset:g}"
        left.legend(
            handles=[
                entry(rf"$\sqrt{{2}}{shift}$", colour, linewidth=width + 0.3)
                for shift, (colour, width) in zip(shifts, _CURVES, strict=True)
            ],
            loc="upper right",
            title=r"$\chi_B$",
            fontsize=6.5,
            title_fontsize=7.5,
            labelspacing=0.25,
            handlelength=1.4,
            borderpad=0.3,
        )
    for ax in axes[-1]:
        ax.set_xlabel(r"$\mathrm{Re}\,s$")
    legend_below(figure, _key(rows[0].bicycle.omega0), 3)
    return figure


def full_window(row: LocusRow) -> Window:
    """The circle and the multiple roots; roots that run far out for large values leave it."""
    return abs(row.bicycle.omega0) * np.array([-2.4, 1.9, -1.6, 1.6])


def _zoom_window(row: LocusRow) -> Window:
    """A window of the shape of `full_window` around the exceptional points in Re s < 0, Im s ≥ 0."""
    x, y = np.array([(r.re, r.im) for r in row.loci[0].multiple if r.im >= 0]).T
    size = abs(row.bicycle.omega0)
    half = max(np.ptp(x) / 2 + 0.22 * size, 0.36 * size)
    tall = half * 3.2 / 4.3
    middle = (x.min() + x.max()) / 2
    return np.array([middle - half, middle + half, y.max() - tall, y.max() + tall])


def _key(omega0: float) -> list[Artist]:
    dot: dict[str, Any] = {"style": "none", "marker": "o", "markersize": 6, **EDGE}
    return [
        entry(rf"$|s| = |\omega_0| = {abs(omega0):.4f}$", **_CIRCLE),
        entry(r"real multiple root, $\chi_B = \sqrt{2}$", REAL, **dot),
        entry(r"complex double root, $\chi_B = \sqrt{2}$", COMPLEX, **dot),
        entry(r"$\mathrm{Fr} = \mathrm{Fr}_c$, $\chi_B = \sqrt{2}$", LINE, "none", marker="D", **_CROSSING),
        entry(rf"$\mathrm{{Fr}}$ increases from 0 to {FR_MAX:g}", LINE, marker=">", markersize=5),
    ]


def _marks(ax: Axes, data: Growth, omega0: float) -> None:
    """The multiple roots of one locus by name, drawn inside the axes alone, and its crossings of the imaginary axis."""
    found = sorted(multiple_roots(data), key=lambda mark: (mark[2].real, mark[2].imag))
    for name, places in _PLACES.items():
        for s, offset in zip([s for own, _, s in found if own == name], cycle(places), strict=False):
            ax.plot(s.real, s.imag, "o", color=COMPLEX if s.imag else REAL, markersize=6, zorder=5, gid=name, **EDGE)
            circle = name == "EP2" and abs(abs(s.real) - abs(omega0)) < 1e-6
            note(
                ax,
                (r"$-\omega_0$" if s.real > 0 else r"$\omega_0$") if circle else NAMES[name],
                (s.real, s.imag),
                offset,
                fontsize=8.5,
                zorder=6,
                bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.6},
                arrowprops=_LEADER if np.hypot(*offset) > 20 else None,
            )
    for event in data.events:
        if event.changes:
            y = event.root.im
            ax.plot([0, 0], [y, -y], "D", zorder=5, gid="crossing", **_CROSSING)


def _arrows(ax: Axes, s: Complex, colour: str, count: int) -> None:
    """Arrow heads spread evenly over the part of a track that the window shows, none on a short track."""
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    size = np.hypot(right - left, high - low)
    middle = (s[1:] + s[:-1]) / 2
    seen = (middle.real > left) & (middle.real < right) & (middle.imag > low) & (middle.imag < high)
    length = np.cumsum(np.where(seen, np.abs(np.diff(s)), 0.0))
    if length.size == 0 or length[-1] < 0.09 * size:
        return
    number = count if length[-1] > 0.3 * size else 1
    for fraction in (np.arange(number) + 0.5) / number:
        k = int(np.searchsorted(length, fraction * length[-1]))
        start, end = s[max(k - 1, 0)], s[min(k + 1, len(s) - 1)]
        arrow(ax, (start.real, start.imag), (end.real, end.imag), (0.22, 0.45), color=colour, linewidth=0.8)
