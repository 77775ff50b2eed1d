"""Paths of models in the universal chart of quartics, drawn into Axes that the caller made."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]

from tmsopt.paper.universal import UniversalPath, ep_set, heavy_section
from tmsopt.plots.style import COMPLEX, CRITICAL, HEAVY, LINE, MARK, REAL, STABLE, new_figure
from tmsopt.records import Array

COLOURS = (LINE, CRITICAL, MARK, "#999999", "#F0E442", STABLE)
"""Paths, in the order given."""

_EVENTS = {
    "stable": ("D", "white"),
    "unstable": ("X", "white"),
    "EP4": ("o", REAL),
    "2EP2": ("o", REAL),
    "CEP2": ("o", COMPLEX),
}


_EDGE = "#8a5a00"

LIMIT = 8.0
"""Largest A1 and A3 shown."""

_BOX = (0.0, LIMIT, -3.0, 2 + LIMIT**2 / 4)
"""Limits of A1 and A3, and of A2."""


def draw_box(ax: Axes3D, paths: Sequence[UniversalPath], faces: Sequence[Array]) -> None:
    """The spire of heavy damping, the EP set and the paths in the space (A1, A3, A2)."""
    low, high, bottom, top = _BOX
    ax.computed_zorder = False
    for face in faces:
        x, z, y = np.moveaxis(face, -1, 0)
        ax.plot_surface(x, y, z, color=HEAVY, alpha=0.75, linewidth=0, rcount=41, ccount=41, shade=False, zorder=2)
        for side in (face[:, 0], face[:, -1]):
            ax.plot(side[:, 0], side[:, 2], side[:, 1], color=_EDGE, linewidth=0.9, zorder=3)
        ax.plot(face[-1, :, 0], face[-1, :, 2], face[-1, :, 1], color=_EDGE, linewidth=0.6, zorder=3)
    _stability_surface(ax)
    for (a, b), colour, style in (((low, 4.0), COMPLEX, "--"), ((4.0, high), REAL, "-")):
        A = ep_set(np.linspace(a, b, 100))
        ax.plot(A[:, 0], A[:, 2], A[:, 1], color=colour, linestyle=style, linewidth=2.0, zorder=4, gid="ep-set")
    for path, colour in zip(paths, COLOURS, strict=False):
        A = _inside(path.A)
        ax.plot(A[:, 0], A[:, 2], A[:, 1], color=colour, linewidth=1.5, zorder=5, gid="path")
        _direction(ax, A, colour)
        for event in path.events:
            x, z, y = event.A
            marker, fill = _EVENTS[event.name]
            ax.plot(
                [x],
                [y],
                [z],
                linestyle="none",
                marker=marker,
                markerfacecolor=fill,
                markeredgecolor=colour,
                markersize=5.5,
                zorder=6,
                gid=event.name,
            )
    ax.set(xlim=(low, high), ylim=(low, high), zlim=(bottom, top), zticks=range(0, 16, 5))
    ax.set_xlabel("$A_1$", labelpad=-2)
    ax.set_ylabel("$A_3$", labelpad=-2)
    ax.set_zlabel("$A_2$", labelpad=-4)
    ax.tick_params(pad=0, labelsize=8)
    ax.view_init(elev=20, azim=-58)
    ax.set_box_aspect((1, 1, 1.05), zoom=1.05)


def draw_section(ax: Axes, paths: Sequence[UniversalPath]) -> None:
    """The plane A1 = A3: stability, heavy damping, the EP set, and the paths, at the mean of their A1 and A3."""
    low, high, bottom, top = _BOX
    ax.fill_between([0, high], 2, top, color=STABLE, alpha=0.18, linewidth=0)
    a = np.linspace(4, high, 200)
    ax.fill_between(a, *heavy_section(a), color=HEAVY, alpha=0.55, linewidth=0)
    ax.plot(a, 2 * a - 2, color=_EDGE, linewidth=1.3)
    for (start, end), colour, style in (((low, 4.0), COMPLEX, "--"), ((4.0, high), REAL, "-")):
        A = ep_set(np.linspace(start, end, 100))
        ax.plot(A[:, 0], A[:, 1], color=colour, linestyle=style, linewidth=2.0, gid="ep-set")
    ax.axhline(2, color=STABLE, linewidth=1.3)
    for path, colour in zip(paths, COLOURS, strict=False):
        x = (path.A[:, 0] + path.A[:, 2]) / 2
        ax.plot(x, path.A[:, 1], color=colour, linewidth=1.5, gid="path")
        _section_arrows(ax, x, path.A[:, 1], colour)
        for event in path.events:
            marker, fill = _EVENTS[event.name]
            ax.plot(
                [(event.A[0] + event.A[2]) / 2],
                [event.A[1]],
                linestyle="none",
                marker=marker,
                markersize=6.5,
                markerfacecolor=fill,
                markeredgecolor=colour,
                markeredgewidth=1.2,
                zorder=5,
                gid=event.name,
            )
    ax.set(xlim=(low, high), ylim=(bottom, top), yticks=range(0, 16, 5))
    ax.set_xlabel("$A_1 = A_3$")
    ax.set_ylabel("$A_2$")
    text: dict[str, Any] = {"fontsize": 8.5, "color": "0.15"}
    ax.text(7.9, -2.2, "unstable", horizontalalignment="right", **text)
    ax.text(0.25, 12.0, "stable", color=CRITICAL, fontsize=8.5)
    ax.text(6.05, 2.7, "$A_2 = 2$", color=CRITICAL, fontsize=8.5)
    ax.annotate("heavy damping", (7.2, 13.6), (5.55, 8.0), arrowprops={"arrowstyle": "-", "linewidth": 0.6}, **text)
    ax.annotate(r"$\mathrm{EP}_4$", (4, 6), (4.25, 4.6), fontsize=9)
    ax.text(1.75, 3.75, r"$\mathrm{CEP}_2$", color="#9c4a78", fontsize=9)
    ax.text(7.15, 15.3, r"$2\mathrm{EP}_2$", color="#00674c", fontsize=9, horizontalalignment="right")


def universal_figure(paths: Sequence[UniversalPath], faces: Sequence[Array], swept: str) -> Figure:
    """The chart as a box and as the section A1 = A3; `swept` is the symbol of the parameter for the legend."""
    figure = new_figure(9.4, 5.0)
    grid = figure.add_gridspec(1, 2, width_ratios=(1.1, 1))
    left = figure.add_subplot(grid[0], projection="3d")
    right = figure.add_subplot(grid[1])
    assert isinstance(left, Axes3D)
    draw_box(left, paths, faces)
    draw_section(right, paths)
    left.set_title("(a) every quartic with $a_4/a_0 > 0$, scaled", fontsize=9.5)
    projected = any(np.nanmax(np.abs(path.A[:, 0] - path.A[:, 2]), initial=0.0) > 1e-6 for path in paths)
    right.set_title("(b) section $A_1 = A_3$" + (", paths projected on it" if projected else ""), fontsize=9.5)
    figure.legend(
        handles=[*_path_handles(paths), *_key(swept, paths)],
        loc="outside lower center",
        ncols=3 if len(paths) > 3 else 4,
        fontsize=8,
        frameon=False,
    )
    return figure


def _stability_surface(ax: Axes3D) -> None:
    """A2 = A1/A3 + A3/A1, above which all is stable, as the lines through (0, 0) that it consists of."""
    k, r = np.meshgrid(np.linspace(-1.5, 1.5, 31), np.linspace(0.02, 1, 9))
    x, y = _BOX[1] * r * np.exp(np.minimum(k, 0)), _BOX[1] * r * np.exp(np.minimum(-k, 0))
    ax.plot_surface(
        x, y, 2 * np.cosh(k), color=STABLE, alpha=0.2, linewidth=0.3, edgecolor="#3b8fbf", shade=False, zorder=1
    )


def _inside(A: Array) -> Array:
    """The points that the box shows; the others become gaps, because a 3-D plot does not clip."""
    low, high, bottom, top = _BOX
    with np.errstate(invalid="ignore"):
        shown = (A[..., 0] >= low) & (A[..., 0] <= high) & (A[..., 2] >= low) & (A[..., 2] <= high)
        shown &= (A[..., 1] >= bottom) & (A[..., 1] <= top)
    return np.where(shown[..., None], A, np.nan)


def _direction(ax: Axes3D, A: Array, colour: str) -> None:
    """An arrow head a third along the part of a path that the box shows."""
    shown = A[np.isfinite(A[:, 0])]
    length = np.cumsum(np.linalg.norm(np.diff(shown, axis=0), axis=1))
    if length.size == 0:
        return
    k = int(np.searchsorted(length, length[-1] / 3))
    x, z, y = shown[k]
    dx, dz, dy = 0.9 * (shown[k + 1] - shown[k]) / np.linalg.norm(shown[k + 1] - shown[k])
    ax.quiver(x, y, z, dx, dy, dz, color=colour, arrow_length_ratio=0.9, linewidth=1.5, zorder=5)


def _section_arrows(ax: Axes, x: Array, y: Array, colour: str) -> None:
    low, high, bottom, top = _BOX
    with np.errstate(invalid="ignore"):
        shown = np.flatnonzero((x > low) & (x < high) & (y > bottom) & (y < top))
    if shown.size < 3:
        return
    length = np.cumsum(np.hypot(np.diff(x[shown]) / high, np.diff(y[shown]) / top))
    for fraction in (0.2, 0.8):
        k = int(np.searchsorted(length, fraction * length[-1]))
        i, j = shown[k], shown[k + 1]
        ax.annotate(
            "",
            (x[j], y[j]),
            (x[i], y[i]),
            zorder=4,
            arrowprops={
                "arrowstyle": "-|>,head_width=0.25,head_length=0.5",
                "color": colour,
                "shrinkA": 0,
                "shrinkB": 0,
            },
        )


def _path_handles(paths: Sequence[UniversalPath]) -> list[Line2D]:
    return [
        Line2D([], [], color=colour, marker=">", markersize=4, label=path.title)
        for path, colour in zip(paths, COLOURS, strict=False)
    ]


def _key(swept: str, paths: Sequence[UniversalPath]) -> list[Line2D | Patch]:
    open_marker: dict[str, Any] = {"linestyle": "none", "markeredgecolor": LINE, "markersize": 6}
    ends = any(event.name == "unstable" for path in paths for event in path.events)
    return [
        Line2D([], [], marker="D", markerfacecolor="white", label=f"{swept} where stability begins", **open_marker),
        *([Line2D([], [], marker="X", markerfacecolor="white", label="where it ends", **open_marker)] if ends else []),
        Line2D([], [], marker="o", markerfacecolor="0.8", label="on the EP set", **open_marker),
        Line2D([], [], color=REAL, linewidth=2, label=r"$2\mathrm{EP}_2$"),
        Line2D([], [], color=COMPLEX, linewidth=2, linestyle="--", label=r"$\mathrm{CEP}_2$"),
        Patch(facecolor=HEAVY, edgecolor=_EDGE, alpha=0.55, label="heavy damping"),
        Patch(facecolor=STABLE, alpha=0.25, label="stable above $A_2 = A_1/A_3 + A_3/A_1$"),
    ]
