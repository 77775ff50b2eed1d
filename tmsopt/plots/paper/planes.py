"""Figures of planes of the paper, with boundaries, the EP set and the laws, and of the swallowtail surface."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]
from mpl_toolkits.mplot3d.axes3d import Axes3D  # type: ignore[import-untyped]

from tmsopt.paper.planes import OFF_LAW_CHI_B, OFF_LAW_TILT, SECTIONS, Plane, chi_B_plane, section, surface, tilt_plane
from tmsopt.plots.chart import Legend, draw_layer, plane_of
from tmsopt.plots.labels import Name, place_all
from tmsopt.plots.style import (
    COMPLEX,
    CRITICAL,
    HEAVY,
    LINE,
    MARK,
    REAL,
    STABLE,
    legend_below,
    legend_entry,
    new_figure,
)
from tmsopt.plots.trace import draw_branch
from tmsopt.records import Array
from tmsopt.tracing.swallowtail import Swallowtail

_LAW_STYLES = {
    "Frc1": (r"$\mathrm{Fr}_c$ (Frc1)", CRITICAL, "-"),
    "epset": ("EP set (epset)", HEAVY, "-"),
    "tls": (r"$\tan\lambda_s$ (tls)", LINE, ":"),
    "chib1": (r"$\chi_B$ (chib1)", LINE, ":"),
}
"""Label, colour and line style of each law in the figure of the abscissa."""

_ON_LAW_TITLES = (r"(a) $\chi_B = \sqrt{2}$", r"(b) $\lambda_s = \lambda_s^{\mathrm{EP}_4} = 0.4107$ rad")

_LIGHT = np.array([0.3, -0.6, 0.75])  # direction of the light on the surface


def ep_set_figure() -> Figure:
    """Stability and heavy damping with the EP set, for designs on the laws."""
    return _planes_figure([tilt_plane(), chi_B_plane()], _ON_LAW_TITLES)


def off_law_figure() -> Figure:
    """Stability and heavy damping with the EP set, for designs near the laws."""
    titles = [
        rf"(a) $\chi_B = \sqrt{{2}} {OFF_LAW_CHI_B:+g}$",
        rf"(b) $\lambda_s = \lambda_s^{{\mathrm{{EP}}_4}} {OFF_LAW_TILT:+g}$ rad",
    ]
    return _planes_figure([tilt_plane(OFF_LAW_CHI_B), chi_B_plane(OFF_LAW_TILT)], titles)


def abscissa_figure() -> Figure:
    """The abscissa in both planes, with the laws."""
    figure = new_figure(10.4, 4.4)
    panels, axes_names = figure.subplots(1, 2), []
    for ax, make_plane, title in zip(panels, (tilt_plane, chi_B_plane), _ON_LAW_TITLES, strict=True):
        plane = make_plane(points=(480, 360), boundaries=False)
        draw_layer(ax, plane.chart, plane_of(plane.chart), "abscissa")
        for law, curve in plane.laws.items():
            label, colour, style = _LAW_STYLES[law]
            ax.plot(*curve, style, color=colour, label=label)
        axes_names.append((ax, _draw_marked_points(ax, plane)))
        ax.legend(loc="upper left")
        ax.set_title(title)
    place_all(axes_names)
    return figure


def draw_swallowtail(data: Swallowtail, ax: Axes3D | None = None) -> Axes3D:
    """Draw the discriminant surface of a design with its edges.

    The Axes show three parameters (rad, SI). All patches form one collection, which is sorted by depth, so that near
    patches hide distant patches. Cuspidal edges (EP3) and the self-intersection (2EP2, CEP2) are drawn on top.

    Example:
        >>> surface = tmsopt.swallowtail("problems/ep_set.toml", rows=4, across=3, starts=4)
        >>> axes = tmsopt.plots.draw_swallowtail(surface)
        >>> [text.get_text() for text in axes.texts]
        ['EP4']

    More: docs/explanation/exceptional_points.md
    """
    if ax is None:
        ax = new_figure(6.4, 5.6).add_subplot(projection="3d", computed_zorder=False)
    quads, colours = [], []
    ranges = np.array([data.problem.free[n] for n in data.axes])
    width = ranges[:, 1] - ranges[:, 0]
    for patch in data.patches:
        pieces = quadrilaterals(np.stack([patch.points[n] for n in data.axes], axis=-1))
        quads.append(pieces)
        colours.append(_shade_faces(pieces / width, HEAVY if patch.heavily_damped else STABLE))
    fills = np.concatenate(colours)
    ax.add_collection3d(Poly3DCollection(np.concatenate(quads), facecolors=fills, edgecolors=fills, linewidths=0.7))
    lines = (data.cusps, "EP3", LINE, "-"), (data.crossing, "2EP2", REAL, "-"), (data.crossing, "CEP2", COMPLEX, "--")
    for trace, kind, colour, style in lines:
        for branch in trace.branches:
            has_kind = np.isin(branch.kinds, (kind, "EP4"))
            columns = [np.where(has_kind, branch.parameters[n], np.nan) for n in data.axes]
            ax.plot(*columns, style, color=colour, linewidth=1.8, zorder=9)
    for event in data.crossing.events:
        if event.name == "EP4":
            point = np.array([event.parameters[n] for n in data.axes])
            ax.plot(*point[:, None], "o", color=MARK, zorder=10)
            ax.text(*point[:2], point[2] + 0.05 * width[2], "EP4", fontsize=9, zorder=11)
    parameters = data.problem.posed.parameter_set
    for letter, name, ends in zip("xyz", data.axes, ranges, strict=True):
        ax.set(**{f"{letter}lim": ends, f"{letter}label": f"${parameters[name].latex}$"})
        # The ticks of two axes must not meet at their common corner.
        getattr(ax, f"{letter}axis").set_major_locator(MaxNLocator(4, prune="both"))
    return ax


def quadrilaterals(points: Array) -> Array:
    """Faces of a grid of points without those that have a nan.

    Args:
        points: shape (rows, columns, 3).

    Returns:
        The corners of the faces, shape (faces, 4, 3).
    """
    corners = np.stack([points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]], axis=2)
    faces = corners.reshape(-1, 4, 3)
    return faces[np.all(np.isfinite(faces), axis=(1, 2))]


def swallowtail_figure() -> Figure:
    """The surface and three cross-sections."""
    figure = new_figure(10.0, 9.0)
    ax = figure.add_subplot(2, 2, 1, projection="3d", computed_zorder=False)
    draw_swallowtail(surface(), ax)
    ax.view_init(elev=24, azim=-52)
    ax.set_box_aspect(None, zoom=0.86)  # leaves room for the vertical label
    ax.set_title("(a) discriminant surface")
    handles = [
        legend_entry("bounds heavy damping", HEAVY, linewidth=6),
        legend_entry("elsewhere", STABLE, linewidth=6),
        legend_entry("EP3, cuspidal edges", LINE),
        legend_entry("2EP2, self-intersection", REAL),
        legend_entry("CEP2", COMPLEX, "--"),
    ]
    ax.legend(handles=handles, loc="upper left")
    titles = [
        rf"({letter}) $\mathrm{{Fr}} = \mathrm{{Fr}}_{{\mathrm{{EP}}_4}}{f' {offset:+g}' if offset else ''}$"
        for letter, offset in zip("bcd", SECTIONS, strict=True)
    ]
    panels = [figure.add_subplot(2, 2, k) for k in (2, 3, 4)]
    draw_planes(figure, panels, [section(offset) for offset in SECTIONS], titles)
    return figure


def draw_plane(ax: Axes, plane: Plane) -> Legend:
    """Draw classes, exact boundaries with corners, the EP set and the marked points of a plane."""
    axes = plane_of(plane.chart)
    names, handles = draw_layer(ax, plane.chart, axes, "kind")
    if plane.ep_set is not None:
        handles += [legend_entry("2EP2", REAL, linewidth=2), legend_entry("CEP2", COMPLEX, "--", linewidth=2)]
        for branch in plane.ep_set.branches:
            draw_branch(ax, branch, axes, width=2.0)
    return names + _draw_marked_points(ax, plane), handles


def _planes_figure(planes: Sequence[Plane], titles: Sequence[str]) -> Figure:
    """Two planes side by side."""
    figure = new_figure(9.6, 5.0)
    draw_planes(figure, figure.subplots(1, 2), planes, titles)
    return figure


def draw_planes(figure: Figure, panels: Sequence[Axes], planes: Sequence[Plane], titles: Sequence[str]) -> None:
    """Draw planes with their titles and names, and one legend for all."""
    legends = [draw_plane(ax, plane) for ax, plane in zip(panels, planes, strict=True)]
    for ax, title in zip(panels, titles, strict=True):
        ax.set_title(title)
    legend_below(figure, [handle for _, handles in legends for handle in handles])
    place_all([(ax, names) for ax, (names, _) in zip(panels, legends, strict=True)])


def _draw_marked_points(ax: Axes, plane: Plane) -> list[Name]:
    for point in plane.marked_points.values():
        ax.plot(*point, "o", color=MARK, markeredgecolor="white", zorder=6)
    symbols = {"least Fr_c": r"least $\mathrm{Fr}_c$"}
    return [Name(symbols.get(name, name), *point) for name, point in plane.marked_points.items()]


def _shade_faces(faces: Array, colour: str) -> Array:
    """The colour of each face. It is brightest where the light is perpendicular to the face."""
    normal = np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    facing = np.abs(normal @ (_LIGHT / np.linalg.norm(_LIGHT))) / np.where(length > 0, length, 1)[:, 0]
    return np.outer(0.6 + 0.4 * facing, to_rgb(colour))
