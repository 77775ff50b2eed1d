"""Paths of the designs of Table 1 in the universal chart of quartics, drawn into Axes that the caller made."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]

from tmsopt.paper.universal import UniversalPath, ep_set, heavy_section, spire_faces, table_1_paths
from tmsopt.plots.paper.locus import NAMES
from tmsopt.plots.style import (
    COMPLEX,
    CRITICAL,
    HEAVY,
    LINE,
    MARK,
    REAL,
    STABLE,
    arrow,
    entry,
    legend_below,
    new_figure,
)
from tmsopt.records import Array

_COLOURS = (LINE, CRITICAL, MARK)
"""Paths, in the order given."""

_EDGE = "#8a5a00"

_LIMIT, _LOW, _HIGH = 8.0, -3.0, 18.0
"""Largest A1 and A3 shown; limits of A2."""

_EP_SET = ((0.0, 4.0, COMPLEX, "--"), (4.0, _LIMIT, REAL, "-"))
"""Least and largest A1, colour and line of CEP2 and 2EP2."""


def draw_box(ax: Axes3D, paths: Sequence[UniversalPath], faces: Sequence[Array]) -> None:
    """The spire of heavy damping, the EP set and the paths in the space (A1, A3, A2)."""
    ax.computed_zorder = False

    def curve(A: Array, fmt: str = "-", **look: Any) -> None:
        ax.plot(A[..., 0], A[..., 2], A[..., 1], fmt, **look)

    for face in faces:
        x, z, y = np.moveaxis(face, -1, 0)
        ax.plot_surface(x, y, z, color=HEAVY, alpha=0.75, linewidth=0, rcount=41, ccount=41, shade=False, zorder=2)
        for side, width in ((face[:, 0], 0.9), (face[:, -1], 0.9), (face[-1], 0.6)):
            curve(side, color=_EDGE, linewidth=width, zorder=3)
    # A2 = A1/A3 + A3/A1, above which all is stable, as the lines through (0, 0) that it consists of
    k, r = np.meshgrid(np.linspace(-1.5, 1.5, 31), np.linspace(0.02, 1, 9))
    x, y = (_LIMIT * r * np.exp(np.minimum(side, 0)) for side in (k, -k))
    ax.plot_surface(
        x, y, 2 * np.cosh(k), color=STABLE, alpha=0.2, linewidth=0.3, edgecolor="#3b8fbf", shade=False, zorder=1
    )
    for low, high, colour, style in _EP_SET:
        curve(ep_set(np.linspace(low, high, 100)), style, color=colour, linewidth=2.0, zorder=4, gid="ep-set")
    for path, colour in zip(paths, _COLOURS, strict=True):
        A = path.A[_inside(path.A)]  # a 3-D plot does not clip
        curve(A, color=colour, linewidth=1.5, zorder=5, gid="path")
        start, end = A[_index_along(A, 1 / 3) :][:2]
        x, z, y = start
        dx, dz, dy = 0.9 * (end - start) / np.linalg.norm(end - start)
        ax.quiver(x, y, z, dx, dy, dz, color=colour, arrow_length_ratio=0.9, linewidth=1.5, zorder=5)
        for marker, fill, at, name in _events(path):
            curve(at[None], marker, mfc=fill, mec=colour, markersize=5.5, zorder=6, gid=name)
    ax.set(xlim=(0, _LIMIT), ylim=(0, _LIMIT), zlim=(_LOW, _HIGH), zticks=range(0, 16, 5))
    for label, pad, name in ((ax.set_xlabel, -2, "$A_1$"), (ax.set_ylabel, -2, "$A_3$"), (ax.set_zlabel, -4, "$A_2$")):
        label(name, labelpad=pad)
    ax.tick_params(pad=0, labelsize=8)
    ax.view_init(elev=20, azim=-58)
    ax.set_box_aspect((1, 1, 1.05), zoom=1.05)


def draw_section(ax: Axes, paths: Sequence[UniversalPath]) -> None:
    """The plane A1 = A3: stability, heavy damping, the EP set, and the paths."""
    ax.fill_between([0, _LIMIT], 2, _HIGH, color=STABLE, alpha=0.18, linewidth=0)
    a = np.linspace(4, _LIMIT, 200)
    ax.fill_between(a, *heavy_section(a), color=HEAVY, alpha=0.55, linewidth=0)
    ax.plot(a, 2 * a - 2, color=_EDGE, linewidth=1.3)
    for low, high, colour, style in _EP_SET:
        ax.plot(*ep_set(np.linspace(low, high, 100)).T[:2], style, color=colour, linewidth=2.0, gid="ep-set")
    ax.axhline(2, color=STABLE, linewidth=1.3)
    for path, colour in zip(paths, _COLOURS, strict=True):
        ax.plot(*path.A.T[:2], color=colour, linewidth=1.5, gid="path")
        shown = path.A[_inside(path.A), :2]
        for fraction in (0.2, 0.8):
            k = _index_along(shown / (_LIMIT, _HIGH), fraction)
            arrow(ax, shown[k], shown[k + 1], color=colour)
        for marker, fill, at, name in _events(path):
            ax.plot(*at[:2], marker, mfc=fill, mec=colour, markersize=6.5, mew=1.2, zorder=5, gid=name)
    ax.set(xlim=(0, _LIMIT), ylim=(_LOW, _HIGH), yticks=range(0, 16, 5), xlabel="$A_1 = A_3$", ylabel="$A_2$")
    dark = "0.15"
    for x, y, text, colour, side in (
        (7.9, -2.2, "unstable", dark, "right"),
        (0.25, 12.0, "stable", CRITICAL, "left"),
        (6.05, 2.7, "$A_2 = 2$", CRITICAL, "left"),
        (4.25, 4.6, NAMES["EP4"], LINE, "left"),
        (1.75, 3.75, NAMES["CEP2"], "#9c4a78", "left"),
        (7.15, 15.3, NAMES["2EP2"], "#00674c", "right"),
    ):
        ax.text(x, y, text, color=colour, horizontalalignment=side, fontsize=8.5)
    leader = {"arrowstyle": "-", "linewidth": 0.6}
    ax.annotate("heavy damping", (7.2, 13.6), (5.55, 8.0), arrowprops=leader, fontsize=8.5, color=dark)


def universal_figure() -> Figure:
    """The chart as a box and as the section A1 = A3."""
    figure, paths = new_figure(9.4, 5.0), table_1_paths()
    grid = figure.add_gridspec(1, 2, width_ratios=(1.1, 1))
    left, right = figure.add_subplot(grid[0], projection="3d"), figure.add_subplot(grid[1])
    draw_box(left, paths, spire_faces(_LIMIT))
    draw_section(right, paths)
    left.set_title("(a) every quartic with $a_4/a_0 > 0$, scaled", fontsize=9.5)
    right.set_title("(b) section $A_1 = A_3$", fontsize=9.5)
    points: dict[str, Any] = {"style": "none", "markersize": 6}
    key = [
        *(
            entry(rf"{NAMES[p.name]} of Table 1, $\lambda_s = {p.tilt:.4f}$", colour, marker=">", markersize=4)
            for p, colour in zip(paths, _COLOURS, strict=True)
        ),
        entry(r"$\mathrm{Fr}$ where stability begins", LINE, marker="D", markerfacecolor="white", **points),
        entry("on the EP set", LINE, marker="o", markerfacecolor="0.8", **points),
        entry(NAMES["2EP2"], REAL, linewidth=2),
        entry(NAMES["CEP2"], COMPLEX, "--", linewidth=2),
        Patch(facecolor=HEAVY, edgecolor=_EDGE, alpha=0.55, label="heavy damping"),
        Patch(facecolor=STABLE, alpha=0.25, label="stable above $A_2 = A_1/A_3 + A_3/A_1$"),
    ]
    legend_below(figure, key, 4)
    return figure


def _events(path: UniversalPath) -> tuple[tuple[str, str, Array, str], ...]:
    """Marker, fill, place and name of where stability begins and of the exceptional point."""
    fill = COMPLEX if path.name == "CEP2" else REAL
    return ("D", "white", path.stable, "stable"), ("o", fill, path.exceptional, path.name)


def _inside(A: Array) -> Any:
    """Which points the axes show."""
    x, z, y = A.T
    return (x <= _LIMIT) & (y <= _LIMIT) & (z >= _LOW) & (z <= _HIGH)


def _index_along(points: Array, fraction: float) -> int:
    """The point at a fraction of the way along a curve."""
    length = np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))
    return int(np.searchsorted(length, fraction * length[-1]))
