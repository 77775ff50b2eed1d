"""Draw root loci in the complex plane."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tmsopt.paper.locus import FR_MAX, LocusRow, multiple_roots, table_1_loci
from tmsopt.plots.labels import Name, place_all
from tmsopt.plots.style import (
    COMPLEX,
    CRITICAL,
    EDGE,
    LINE,
    MARK,
    REAL,
    draw_arrow,
    legend_below,
    legend_entry,
    new_figure,
)
from tmsopt.records import Array

_CURVE_STYLES = ((LINE, 1.5), (CRITICAL, 1.0), (MARK, 1.0))
"""Colour and width of the loci: at the χ_B of the law, below this χ_B, and above it."""

NAMES = {"EP4": r"$\mathrm{EP}_4$", "2EP2": r"$2\mathrm{EP}_2$", "CEP2": r"$\mathrm{CEP}_2$", "EP2": r"$\mathrm{EP}_2$"}
"""Structure → symbol of the paper."""

Window = Array
"""Limits of Axes: left, right, bottom and top."""


def draw_row(ax: Axes, row: LocusRow, window: Window, arrows: int) -> list[Name]:
    """Draw the three loci of one steer axis tilt with the circle |s| = |ω0|; return the names of multiple roots."""
    size, law = abs(row.bicycle.omega0), row.loci[0]
    ax.axhline(0, color="0.75", linewidth=0.6)
    ax.axvline(0, color="0.4", linewidth=0.8)
    angle = np.linspace(0, 2 * np.pi, 361)
    label = rf"$|s| = |\omega_0| = {size:.4f}$"
    ax.plot(size * np.cos(angle), size * np.sin(angle), "0.8", linewidth=3.5, gid="circle", label=label)
    ax.set(xlim=window[:2], ylim=window[2:], aspect="equal")
    for data, (colour, width) in reversed([*zip(row.loci, _CURVE_STYLES, strict=True)]):
        for mode in data.modes:
            for sign in (1, -1) if mode.roots.imag.any() else (1,):
                track = np.stack([mode.roots.real, sign * mode.roots.imag], axis=1)
                ax.plot(*track.T, color=colour, linewidth=width, gid="track")
                draw_arrows(ax, track, 2 if data is law else arrows, colour)
    names = []
    for name, _, s in multiple_roots(law):
        colour, kind = (COMPLEX, "complex double") if s.imag else (REAL, "real multiple")
        label = rf"{kind} root, $\chi_B = \sqrt{{2}}$"
        ax.plot(
            s.real, s.imag, "o", color=colour, zorder=5, gid=name, label=kind + r" root, $\chi_B = \sqrt{2}$", **EDGE
        )
        on_circle = name == "EP2" and abs(abs(s.real) - size) < 1e-6
        text = (r"$-\omega_0$" if s.real > 0 else r"$\omega_0$") if on_circle else NAMES[name]
        names.append(Name(text, s.real, s.imag))
    for y in (event.root.im for event in law.events if event.changes):
        label = r"$\mathrm{Fr} = \mathrm{Fr}_c$, $\chi_B = \sqrt{2}$"
        ax.plot([0, 0], [y, -y], "D", markersize=4.5, mfc="white", color=LINE, zorder=5, gid="crossing", label=label)
    return names


def root_locus_figure() -> Figure:
    """For each steer axis tilt a row: the whole complex plane, and an enlargement around the exceptional points."""
    rows = table_1_loci()
    figure = new_figure(7.4, 3.05 * len(rows) + 0.4)
    axes, names = figure.subplots(len(rows), 2), list[tuple[Axes, Sequence[Name]]]()
    for (main, detail), row, letter in zip(axes, rows, "abc", strict=True):
        zoom = _zoom_window(row)
        names += [
            (main, draw_row(main, row, full_window(row), 1)),
            (detail, draw_row(detail, row, zoom, 2)),
        ]
        main.plot(zoom[[0, 1, 1, 0, 0]], zoom[[2, 2, 3, 3, 2]], ":", color="0.4", linewidth=0.7)
        name, tilt = row.bicycle.name, row.bicycle.parameters["lambda_s"]
        offset = {"2EP2": " - 0.05", "CEP2": " + 0.8"}.get(name, "")
        exact = r"\arctan(\frac{15}{4} - \frac{75}{32}\sqrt{2})"
        main.set(title=rf"({letter}) $\lambda_s = {exact}{offset} = {tilt:.4f}$ rad", ylabel=r"$\mathrm{Im}\,s$")
        detail.set_title(rf"enlarged: {NAMES[name]} at $\mathrm{{Fr}} = {row.loci[0].design:.6g}$")
        shifts = "", f" - {row.offset:g}", f" + {row.offset:g}"
        handles = [
            legend_entry(rf"$\sqrt{{2}}{shift}$", colour)
            for shift, (colour, _) in zip(shifts, _CURVE_STYLES, strict=True)
        ]
        main.legend(handles=handles, loc="upper right", title=r"$\chi_B$", handlelength=1.4)
    for ax in axes[-1]:
        ax.set_xlabel(r"$\mathrm{Re}\,s$")
    handles = [handle for ax in axes.flat for handle in ax.get_legend_handles_labels()[0]]
    handles.append(legend_entry(rf"$\mathrm{{Fr}}$ increases from 0 to {FR_MAX:g}", LINE, marker=">"))
    legend_below(figure, handles, 3)
    place_all(names)
    return figure


def full_window(row: LocusRow) -> Window:
    """A window with the circle and the multiple roots; roots that become large lie outside."""
    return abs(row.bicycle.omega0) * np.array([-2.4, 1.9, -1.6, 1.6])


def _zoom_window(row: LocusRow) -> Window:
    """A window around the exceptional points in Re s < 0, Im s ≥ 0, with the shape of `full_window`."""
    x, y = np.array([(r.re, r.im) for r in row.loci[0].multiple if r.im >= 0]).T
    size = abs(row.bicycle.omega0)
    half_width = max(np.ptp(x) / 2 + 0.22 * size, 0.36 * size)
    half_height = half_width * 3.2 / 4.3
    centre = (x.min() + x.max()) / 2
    return np.array([centre - half_width, centre + half_width, y.max() - half_height, y.max() + half_height])


def draw_arrows(ax: Axes, points: Array, count: int, colour: str) -> None:
    """Draw arrow heads at equal distances on the visible part of a curve; a short part gets no arrow."""
    low, high = np.transpose([ax.get_xlim(), ax.get_ylim()])
    is_visible = np.all((points[1:] > low) & (points[1:] < high), axis=1)
    length = np.cumsum(is_visible * np.linalg.norm(np.diff(points, axis=0) / (high - low), axis=1))
    if length.size and length[-1] > 0.12:
        count = count if length[-1] > 0.4 else 1
        for k in np.searchsorted(length, length[-1] * (np.arange(count) + 0.5) / count):
            draw_arrow(ax, points[k], points[k + 1], color=colour)
