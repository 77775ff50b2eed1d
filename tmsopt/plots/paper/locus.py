"""Root loci in the complex plane, drawn into Axes that the caller made."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from tmsopt.paper.locus import DoubleRoots, Locus, LocusRow, Track
from tmsopt.plots.style import COMPLEX, CRITICAL, LINE, MARK, REAL, new_figure

COLOURS = (LINE, CRITICAL, MARK)
"""χ_B of the law, below it, above it."""

NAMES = {"EP4": r"$\mathrm{EP}_4$", "2EP2": r"$2\mathrm{EP}_2$", "CEP2": r"$\mathrm{CEP}_2$", "EP2": r"$\mathrm{EP}_2$"}
"""Multiple roots in the symbols of the paper."""

_PLACES = {"EP4": ((-34, 9),), "2EP2": ((22, 26), (1, 33)), "CEP2": ((10, -17), (10, 12)), "EP2": ((6, -13),)}
"""Where the names stand beside the roots, in points, by ascending real and imaginary part."""

Window = tuple[float, float, float, float]

_WIDTHS = (1.5, 1.0, 1.0)


def draw_locus(ax: Axes, data: Locus, colour: str, width: float, arrows: int = 2) -> None:
    """The tracks of one locus, with arrows towards increasing values."""
    for track in data.tracks:
        ax.plot(track.s.real, track.s.imag, color=colour, linewidth=width, solid_capstyle="round", gid="track")
    for track in data.tracks:
        _arrows(ax, track, colour, arrows)


def draw_marks(ax: Axes, data: Locus, omega0: float) -> None:
    """The multiple roots of one locus by name, and its crossings of the imaginary axis."""
    for mark in data.marks:
        colour = COMPLEX if mark.name == "CEP2" else REAL
        ax.plot(
            mark.s.real,
            mark.s.imag,
            linestyle="none",
            marker="o",
            markersize=6,
            color=colour,
            zorder=5,
            markeredgecolor="black",
            markeredgewidth=0.6,
            gid=mark.name,
        )
        _name(ax, mark, omega0)
    for _, frequency in data.crossings:
        ax.plot(
            [0, 0],
            [frequency, -frequency],
            linestyle="none",
            marker="D",
            markersize=4.5,
            markerfacecolor="white",
            markeredgecolor=LINE,
            zorder=5,
            gid="crossing",
        )


def draw_row(ax: Axes, row: LocusRow, window: Window, zoom: bool) -> None:
    """The three loci of one steer axis tilt with the circle |s| = |ω0|, inside a window (left, right, low, high)."""
    angle = np.linspace(0, 2 * np.pi, 361)
    radius = abs(row.omega0)
    ax.axhline(0, color="0.75", linewidth=0.6, zorder=0)
    ax.axvline(0, color="0.4", linewidth=0.8, zorder=0)
    ax.plot(
        radius * np.cos(angle),
        radius * np.sin(angle),
        color="0.55",
        linewidth=3.5,
        alpha=0.45,
        zorder=0.5,
        gid="circle",
    )
    ax.set(xlim=window[:2], ylim=window[2:])
    ax.set_aspect("equal")
    for locus, colour, width in reversed(list(zip(row.loci, COLOURS, _WIDTHS, strict=True))):
        draw_locus(ax, locus, colour, width, arrows=1 if colour != LINE and not zoom else 2)
    draw_marks(ax, row.loci[0], row.omega0)


def locus_figure(rows: tuple[LocusRow, ...]) -> Figure:
    """The whole complex plane beside an enlargement around the exceptional points, a row per steer axis tilt."""
    figure = new_figure(7.4, 3.05 * len(rows) + 0.4)
    axes = figure.subplots(len(rows), 2, squeeze=False)
    for (left, right), row, letter in zip(axes, rows, "abcdef", strict=False):
        near = zoom_window(row)
        draw_row(left, row, full_window(row), zoom=False)
        draw_row(right, row, near, zoom=True)
        left.plot(
            [near[0], near[1], near[1], near[0], near[0]],
            [near[2], near[2], near[3], near[3], near[2]],
            color="0.4",
            linewidth=0.7,
            linestyle=":",
            zorder=4,
        )
        left.set_title(rf"({letter}) {_tilt_text(row)}", fontsize=9)
        exceptional = next(m for m in row.loci[0].marks if m.name != "EP2")
        right.set_title(
            rf"enlarged: {NAMES[exceptional.name]} at $\mathrm{{Fr}} = {exceptional.value:.6g}$", fontsize=9
        )
        left.set_ylabel(r"$\mathrm{Im}\,s$")
        left.legend(
            handles=_legend(row),
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
    figure.legend(handles=_key(rows[0]), loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    return figure


def full_window(row: LocusRow) -> Window:
    """The circle and the multiple roots; roots that run far out for large values leave it."""
    radius = abs(row.omega0)
    return -2.4 * radius, 1.9 * radius, -1.6 * radius, 1.6 * radius


def zoom_window(row: LocusRow) -> Window:
    """A window of the shape of `full_window` around the exceptional points in Re s < 0, Im s ≥ 0."""
    s = np.concatenate([m.s for m in row.loci[0].marks if m.name != "EP2"])
    s = s[s.imag >= 0]
    middle = complex((s.real.min() + s.real.max()) / 2, s.imag.max())
    left, right, low, high = full_window(row)
    half = max(float(np.ptp(s.real)) / 2 + 0.22 * abs(row.omega0), 0.36 * abs(row.omega0))
    tall = half * (high - low) / (right - left)
    return middle.real - half, middle.real + half, middle.imag - tall, middle.imag + tall


def _tilt_text(row: LocusRow) -> str:
    offset = {"EP4": "", "2EP2": " - 0.05", "CEP2": " + 0.8"}.get(row.name, "")
    exact = r"\arctan(\frac{15}{4} - \frac{75}{32}\sqrt{2})"
    return rf"$\lambda_s = {exact}{offset} = {row.tilt:.4f}$ rad"


def _legend(row: LocusRow) -> list[Line2D]:
    return [
        Line2D([], [], color=colour, linewidth=width + 0.3, label=rf"${locus.title}$")
        for locus, colour, width in zip(row.loci, COLOURS, _WIDTHS, strict=True)
    ]


def _key(row: LocusRow) -> list[Line2D]:
    first, last = row.loci[0].values[[0, -1]]
    dot: dict[str, Any] = {"linestyle": "none", "marker": "o", "markeredgecolor": "black", "markeredgewidth": 0.6}
    dot["markersize"] = 6
    return [
        Line2D([], [], color="0.55", alpha=0.45, linewidth=3.5, label=rf"$|s| = |\omega_0| = {abs(row.omega0):.4f}$"),
        Line2D([], [], color=REAL, label=r"real multiple root, $\chi_B = \sqrt{2}$", **dot),
        Line2D([], [], color=COMPLEX, label=r"complex double root, $\chi_B = \sqrt{2}$", **dot),
        Line2D(
            [],
            [],
            linestyle="none",
            marker="D",
            markersize=4.5,
            markerfacecolor="white",
            markeredgecolor=LINE,
            label=r"$\mathrm{Fr} = \mathrm{Fr}_c$, $\chi_B = \sqrt{2}$",
        ),
        Line2D(
            [], [], color=LINE, marker=">", markersize=5, label=rf"$\mathrm{{Fr}}$ increases from {first:g} to {last:g}"
        ),
    ]


def _name(ax: Axes, mark: DoubleRoots, omega0: float) -> None:
    """The name of a multiple root at each of its places inside the axes, with a leader where it stands off."""
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    for k, s in enumerate(sorted(mark.s, key=lambda z: (z.real, z.imag))):
        if not (left < s.real < right and low < s.imag < high):
            continue
        text, (dx, dy) = NAMES[mark.name], _PLACES[mark.name][k]
        if mark.name == "EP2" and abs(abs(s.real) - abs(omega0)) < 1e-6:
            text = r"$-\omega_0$" if s.real > 0 else r"$\omega_0$"
        ax.annotate(
            text,
            (s.real, s.imag),
            xytext=(dx, dy),
            textcoords="offset points",
            fontsize=8.5,
            zorder=6,
            horizontalalignment="left" if dx > 0 else "right",
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.6},
            arrowprops={"arrowstyle": "-", "linewidth": 0.5, "color": "0.3", "shrinkA": 0, "shrinkB": 3}
            if np.hypot(dx, dy) > 20
            else None,
        )


def _arrows(ax: Axes, track: Track, colour: str, count: int) -> None:
    """Arrow heads spread evenly over the part of a track that the window shows, none on a short track."""
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    size = float(np.hypot(right - left, high - low))
    s = track.s
    moved = np.abs(np.diff(s))
    middle = (s[1:] + s[:-1]) / 2
    seen = (middle.real > left) & (middle.real < right) & (middle.imag > low) & (middle.imag < high)
    length: NDArray[np.float64] = np.cumsum(np.where(seen, moved, 0.0))
    if length.size == 0 or length[-1] < 0.09 * size:
        return
    number = count if length[-1] > 0.3 * size else 1
    for fraction in (np.arange(number) + 0.5) / number:
        k = int(np.searchsorted(length, fraction * length[-1]))
        start, end = s[max(k - 1, 0)], s[min(k + 1, len(s) - 1)]
        ax.annotate(
            "",
            xy=(end.real, end.imag),
            xytext=(start.real, start.imag),
            zorder=4,
            arrowprops={
                "arrowstyle": "-|>,head_width=0.22,head_length=0.45",
                "color": colour,
                "linewidth": 0.8,
                "shrinkA": 0,
                "shrinkB": 0,
            },
        )
