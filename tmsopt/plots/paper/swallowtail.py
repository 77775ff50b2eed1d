"""The swallowtail surface in three dimensions, with its cuspidal edges, its self-intersection and its sections."""

from collections.abc import Sequence

import numpy as np
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]
from mpl_toolkits.mplot3d.axes3d import Axes3D  # type: ignore[import-untyped]

from tmsopt.paper.planes import Plane
from tmsopt.plots.labels import place_all
from tmsopt.plots.paper.planes import draw_plane, plane_handles
from tmsopt.plots.style import COMPLEX, HEAVY, LINE, MARK, REAL, STABLE, legend_below, new_figure
from tmsopt.records import Array
from tmsopt.tracing.branch import Trace
from tmsopt.tracing.swallowtail import Swallowtail

_LIGHT = np.array([0.3, -0.6, 0.75])


def draw_swallowtail(data: Swallowtail, ax: Axes3D | None = None) -> Axes3D:
    """The discriminant surface of a design with its edges.

    The Axes show three parameters (rad, SI): patches sorted by depth as one collection, so that nothing is drawn
    through, cuspidal edges (EP3) and self-intersection (2EP2, CEP2) on top.

    Example:
        >>> surface = tmsopt.swallowtail("problems/ep_set.toml", rows=4, across=3, starts=4)
        >>> axes = tmsopt.plots.draw_swallowtail(surface)
        >>> [text.get_text() for text in axes.texts]
        ['EP4']

    More: docs/explanation/exceptional_points.md
    """
    if ax is None:
        made = new_figure(6.4, 5.6).add_subplot(projection="3d", computed_zorder=False)
        assert isinstance(made, Axes3D)
        ax = made
    quads, colours = [], []
    ranges = np.array([data.problem.free[n] for n in data.axes])
    width = ranges[:, 1] - ranges[:, 0]
    for patch in data.patches:
        points = np.stack([patch.points[n] for n in data.axes], axis=-1)
        pieces = quadrilaterals(points)
        quads.append(pieces)
        colours.append(_shaded(pieces / width, HEAVY if patch.heavily_damped else STABLE))
    collection = Poly3DCollection(
        np.concatenate(quads), facecolors=np.concatenate(colours), edgecolors=np.concatenate(colours), linewidths=0.7
    )
    ax.add_collection3d(collection)
    _edges(ax, data.cusps, data.axes, {"EP3": (LINE, "-")})
    _edges(ax, data.crossing, data.axes, {"2EP2": (REAL, "-"), "CEP2": (COMPLEX, "--")})
    for event in data.crossing.events:
        if event.name == "EP4":
            place = [event.parameters[n] for n in data.axes]
            ax.plot(*[[v] for v in place], marker="o", color=MARK, markersize=6, zorder=10)
            ax.text(place[0], place[1], place[2] + 0.05 * width[2], "EP4", fontsize=9, zorder=11)
    of = data.problem.parameter_set
    for name, (low, high), limit, label in zip(
        data.axes,
        ranges,
        (ax.set_xlim, ax.set_ylim, ax.set_zlim),
        (ax.set_xlabel, ax.set_ylabel, ax.set_zlabel),
        strict=True,
    ):
        limit(low, high)
        label(f"${of[name].latex}$")
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.set_major_locator(MaxNLocator(4, prune="both"))  # ticks of two axes must not meet at their corner
    return ax


def quadrilaterals(points: Array) -> Array:
    """Faces of a grid of points: shape (rows, columns, 3) in, (faces, 4, 3) out, those that exist."""
    corners = np.stack([points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]], axis=2)
    faces = corners.reshape(-1, 4, 3)
    return faces[np.all(np.isfinite(faces), axis=(1, 2))]


def swallowtail_figure(data: Swallowtail, sections: Sequence[Plane], titles: Sequence[str]) -> Figure:
    """The surface and its cross-sections, two by two."""
    figure = new_figure(10.0, 9.0)
    ax = figure.add_subplot(2, 2, 1, projection="3d", computed_zorder=False)
    assert isinstance(ax, Axes3D)
    draw_swallowtail(data, ax)
    ax.view_init(elev=24, azim=-52)
    ax.set_box_aspect(None, zoom=0.86)  # leaves room for the vertical label
    ax.set_title("(a) discriminant surface", fontsize=10)
    ax.legend(
        handles=[
            Line2D([], [], color=HEAVY, linewidth=6, label="bounds heavy damping"),
            Line2D([], [], color=STABLE, linewidth=6, label="elsewhere"),
            Line2D([], [], color=LINE, label="EP3, cuspidal edges"),
            Line2D([], [], color=REAL, label="2EP2, self-intersection"),
            Line2D([], [], color=COMPLEX, linestyle="--", label="CEP2"),
        ],
        fontsize=7.5,
        loc="upper left",
    )
    names = []
    for k, (plane, title) in enumerate(zip(sections, titles, strict=True)):
        flat = figure.add_subplot(2, 2, k + 2)
        names.append((flat, draw_plane(flat, plane)))
        flat.set_title(title, fontsize=10)
    legend_below(figure, [h for plane in sections for h in plane_handles(plane)])
    place_all(names)
    return figure


def _edges(ax: Axes3D, trace: Trace, axes: Sequence[str], styles: dict[str, tuple[str, str]]) -> None:
    for branch in trace.branches:
        kinds = branch.kinds
        for kind, (colour, line) in styles.items():
            here = (kinds == kind) | (kinds == "EP4")
            columns = [np.where(here, branch.parameters[n], np.nan) for n in axes]
            ax.plot(*columns, color=colour, linestyle=line, linewidth=1.8, zorder=9)


def _shaded(faces: Array, colour: str) -> Array:
    """The colour of each face, darker where it turns away from the light on either side."""
    normal = np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    facing = np.abs(normal @ (_LIGHT / np.linalg.norm(_LIGHT))) / np.where(length > 0, length, 1)[:, 0]
    base = np.array(to_rgba(colour))
    shade = np.repeat(base[None], len(faces), axis=0)
    shade[:, :3] *= (0.6 + 0.4 * facing)[:, None]
    return shade
