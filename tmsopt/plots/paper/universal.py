"""Draw the paths of the designs of Table 1 in the universal chart of quartics.

The chart has the coordinates A1, A2, A3 of the quartic s⁴ + A1 s³ + A2 s² + A3 s + 1, to which every quartic with
a4/a0 > 0 can be scaled.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]

from tmsopt.paper.universal import UniversalPath, ep_set, heavy_section, spire_faces, table_1_paths
from tmsopt.plots.paper.locus import NAMES, draw_arrows
from tmsopt.plots.style import COMPLEX, CRITICAL, HEAVY, LINE, MARK, REAL, STABLE, legend_below, new_figure
from tmsopt.records import Array

_COLOURS = (LINE, CRITICAL, MARK)
"""Colours of the paths, in the order of Table 1."""

_EDGE_COLOUR = "#8a5a00"

_MAX_A1 = 8.0  # upper limit of A1 and of A3 in the figures
_MIN_A2, _MAX_A2 = -3.0, 18.0  # limits of A2 in the figures


def draw_box(ax: Axes3D, paths: Sequence[UniversalPath], faces: Sequence[Array]) -> None:
    """Draw the spire (the region of heavy damping), the EP set and the paths in the space (A1, A3, A2)."""
    ax.computed_zorder = False
    for face in faces:
        x, z, y = np.moveaxis(face, -1, 0)
        ax.plot_surface(x, y, z, color=HEAVY, alpha=0.75, linewidth=0, rcount=41, ccount=41, shade=False, zorder=2)
        for edge in (face[:, 0], face[:, -1], face[-1]):
            ax.plot(*edge.T[[0, 2, 1]], color=_EDGE_COLOUR, linewidth=0.9, zorder=3)
    # The boundary of stability, A2 = A1/A3 + A3/A1, consists of horizontal lines through A1 = A3 = 0. All quartics
    # above it are stable.
    k, r = np.meshgrid(np.linspace(-1.5, 1.5, 31), np.linspace(0.02, 1, 9))
    x, y = (_MAX_A1 * r * np.exp(np.minimum(exponent, 0)) for exponent in (k, -k))
    ax.plot_surface(x, y, 2 * np.cosh(k), color=STABLE, alpha=0.2, linewidth=0.3, edgecolor="#3b8fbf", shade=False)
    for A, colour in zip(_draw_paths(ax, paths, [0, 2, 1]), _COLOURS, strict=True):
        start, end = A[len(A) // 3 :][:2]
        ax.quiver(*start, *end - start, length=0.9, normalize=True, color=colour, arrow_length_ratio=0.9, zorder=5)
    ax.set(xlim=(0, _MAX_A1), ylim=(0, _MAX_A1), zlim=(_MIN_A2, _MAX_A2), zticks=range(0, 16, 5))
    ax.set(xlabel="$A_1$", ylabel="$A_3$", zlabel="$A_2$")
    ax.view_init(elev=20, azim=-58)
    ax.set_box_aspect((1, 1, 1.05))


def draw_section(ax: Axes, paths: Sequence[UniversalPath]) -> None:
    """Draw the plane A1 = A3 with stability, heavy damping, the EP set and the paths."""
    stable_label, a = "stable above $A_2 = A_1/A_3 + A_3/A_1$", np.linspace(4, _MAX_A1, 200)
    ax.fill_between([0, _MAX_A1], 2, _MAX_A2, color=STABLE, alpha=0.18, linewidth=0, label=stable_label)
    ax.fill_between(a, *heavy_section(a), color=HEAVY, alpha=0.55, linewidth=0, label="heavy damping")
    ax.plot(a, 2 * a - 2, color=_EDGE_COLOUR)
    ax.axhline(2, color=STABLE)
    ax.set(xlim=(0, _MAX_A1), ylim=(_MIN_A2, _MAX_A2), yticks=range(0, 16, 5), xlabel="$A_1 = A_3$", ylabel="$A_2$")
    for A, colour in zip(_draw_paths(ax, paths, [0, 1]), _COLOURS, strict=True):
        draw_arrows(ax, A, 2, colour)
    for x, y, text, colour in (
        (6.8, -2.2, "unstable", "0.15"),
        (0.25, 12.0, "stable", CRITICAL),
        (6.05, 2.7, "$A_2 = 2$", CRITICAL),
        (4.25, 4.6, NAMES["EP4"], LINE),
        (1.75, 3.75, NAMES["CEP2"], "#9c4a78"),
        (6.7, 15.3, NAMES["2EP2"], "#00674c"),
    ):
        ax.text(x, y, text, color=colour, fontsize=8.5)
    ax.annotate("heavy damping", (7.2, 13.6), (5.55, 8.0), arrowprops={"arrowstyle": "-"}, fontsize=8.5)


def universal_figure() -> Figure:
    """The chart in three dimensions and its section A1 = A3."""
    figure, paths = new_figure(9.4, 5.0), table_1_paths()
    grid = figure.add_gridspec(1, 2, width_ratios=(1.1, 1))
    box_axes, section_axes = figure.add_subplot(grid[0], projection="3d"), figure.add_subplot(grid[1])
    draw_box(box_axes, paths, spire_faces(_MAX_A1))
    draw_section(section_axes, paths)
    box_axes.set_title("(a) every quartic with $a_4/a_0 > 0$, scaled")
    section_axes.set_title("(b) section $A_1 = A_3$")
    legend_below(figure, section_axes.get_legend_handles_labels()[0], 4)
    return figure


def _draw_paths(ax: Any, paths: Sequence[UniversalPath], columns: list[int]) -> list[Array]:
    """Draw the EP set and the paths, and mark on each path the beginning of stability and the exceptional point.

    Args:
        columns: indices of the coordinates to draw, in (A1, A2, A3).

    Returns:
        The visible points of each path; a 3-D plot does not clip curves itself.
    """
    for low, high, name, colour, style in ((0.0, 4.0, "CEP2", COMPLEX, "--"), (4.0, _MAX_A1, "2EP2", REAL, "-")):
        points = ep_set(np.linspace(low, high, 100))[:, columns]
        ax.plot(*points.T, style, color=colour, linewidth=2.0, zorder=4, gid="ep-set", label=NAMES[name])
    visible_paths = []
    for path, colour in zip(paths, _COLOURS, strict=True):
        is_inside = np.all((path.A <= (_MAX_A1, _MAX_A2, _MAX_A1)) & (path.A[:, 1:2] >= _MIN_A2), axis=1)
        visible_paths.append(path.A[is_inside][:, columns])
        label = rf"{NAMES[path.name]} of Table 1, $\lambda_s = {path.tilt:.4f}$"
        ax.plot(*visible_paths[-1].T, color=colour, gid="path", zorder=5, label=label)
        fill, stable_label = COMPLEX if path.name == "CEP2" else REAL, r"$\mathrm{Fr}$ where stability begins"
        marks = (
            ("D", "white", path.stability_onset, "stable", stable_label),
            ("o", fill, path.exceptional_point, path.name, "on the EP set"),
        )
        for marker, marker_fill, point, name, label in marks:
            ax.plot(*point[columns, None], marker, mfc=marker_fill, mec=colour, zorder=6, gid=name, label=label)
    return visible_paths
