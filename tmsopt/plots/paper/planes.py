"""The planes of the paper, with boundaries, the EP set and the laws, and the swallowtail surface that they cut."""

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
from tmsopt.plots.style import COMPLEX, CRITICAL, HEAVY, LINE, MARK, REAL, STABLE, entry, legend_below, new_figure
from tmsopt.plots.trace import draw_branch
from tmsopt.records import Array
from tmsopt.tracing.swallowtail import Swallowtail

_LAWS = {
    "Frc1": (r"$\mathrm{Fr}_c$ (Frc1)", CRITICAL, "-"),
    "epset": ("EP set (epset)", HEAVY, "-"),
    "tls": (r"$\tan\lambda_s$ (tls)", LINE, ":"),
    "chib1": (r"$\chi_B$ (chib1)", LINE, ":"),
}
"""Words, colour and line of each law over the colours of the abscissa."""

_ON_LAW = (r"(a) $\chi_B = \sqrt{2}$", r"(b) $\lambda_s = \lambda_s^{\mathrm{EP}_4} = 0.4107$ rad")

_LIGHT = np.array([0.3, -0.6, 0.75])


def ep_set_figure() -> Figure:
    """Stability and heavy damping with the EP set, on the laws."""
    return _planes_figure([tilt_plane(), chi_B_plane()], _ON_LAW)


def off_law_figure() -> Figure:
    """The same beside the laws."""
    titles = [
        rf"(a) $\chi_B = \sqrt{{2}} {OFF_LAW_CHI_B:+g}$",
        rf"(b) $\lambda_s = \lambda_s^{{\mathrm{{EP}}_4}} {OFF_LAW_TILT:+g}$ rad",
    ]
    return _planes_figure([tilt_plane(OFF_LAW_CHI_B), chi_B_plane(OFF_LAW_TILT)], titles)


def abscissa_figure() -> Figure:
    """The abscissa over both planes, with the laws."""
    figure = new_figure(10.4, 4.4)
    panels, named = figure.subplots(1, 2), []
    for ax, make, title in zip(panels, (tilt_plane, chi_B_plane), _ON_LAW, strict=True):
        plane = make(points=(480, 360), boundaries=False)
        draw_layer(ax, plane.chart, plane_of(plane.chart), "abscissa")
        for law, place in plane.laws.items():
            words, colour, style = _LAWS[law]
            ax.plot(*place, style, color=colour, label=words)
        named.append((ax, _draw_marked(ax, plane)))
        ax.legend(loc="upper left")
        ax.set_title(title)
    place_all(named)
    return figure


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
            here = np.isin(branch.kinds, (kind, "EP4"))
            columns = [np.where(here, branch.parameters[n], np.nan) for n in data.axes]
            ax.plot(*columns, style, color=colour, linewidth=1.8, zorder=9)
    for event in data.crossing.events:
        if event.name == "EP4":
            place = np.array([event.parameters[n] for n in data.axes])
            ax.plot(*place[:, None], "o", color=MARK, zorder=10)
            ax.text(*place[:2], place[2] + 0.05 * width[2], "EP4", fontsize=9, zorder=11)
    of = data.problem.posed.parameter_set
    for letter, name, ends in zip("xyz", data.axes, ranges, strict=True):
        ax.set(**{f"{letter}lim": ends, f"{letter}label": f"${of[name].latex}$"})
        # ticks of two axes must not meet at their corner
        getattr(ax, f"{letter}axis").set_major_locator(MaxNLocator(4, prune="both"))
    return ax


def quadrilaterals(points: Array) -> Array:
    """Faces of a grid of points: shape (rows, columns, 3) in, (faces, 4, 3) out, those that exist."""
    corners = np.stack([points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]], axis=2)
    faces = corners.reshape(-1, 4, 3)
    return faces[np.all(np.isfinite(faces), axis=(1, 2))]


def swallowtail_figure() -> Figure:
    """The surface and its cross-sections, two by two."""
    figure = new_figure(10.0, 9.0)
    ax = figure.add_subplot(2, 2, 1, projection="3d", computed_zorder=False)
    draw_swallowtail(surface(), ax)
    ax.view_init(elev=24, azim=-52)
    ax.set_box_aspect(None, zoom=0.86)  # leaves room for the vertical label
    ax.set_title("(a) discriminant surface")
    key = [
        entry("bounds heavy damping", HEAVY, linewidth=6),
        entry("elsewhere", STABLE, linewidth=6),
        entry("EP3, cuspidal edges", LINE),
        entry("2EP2, self-intersection", REAL),
        entry("CEP2", COMPLEX, "--"),
    ]
    ax.legend(handles=key, loc="upper left")
    titles = [
        rf"({letter}) $\mathrm{{Fr}} = \mathrm{{Fr}}_{{\mathrm{{EP}}_4}}{f' {offset:+g}' if offset else ''}$"
        for letter, offset in zip("bcd", SECTIONS, strict=True)
    ]
    flat = [figure.add_subplot(2, 2, k) for k in (2, 3, 4)]
    draw_planes(figure, flat, [section(offset) for offset in SECTIONS], titles)
    return figure


def draw_plane(ax: Axes, plane: Plane) -> Legend:
    """Classes, exact boundaries with corners, the EP set and the marked points of a plane; names, legend entries."""
    axes = plane_of(plane.chart)
    names, handles = draw_layer(ax, plane.chart, axes, "kind")
    if plane.ep_set is not None:
        handles += [entry("2EP2", REAL, linewidth=2), entry("CEP2", COMPLEX, "--", linewidth=2)]
        for branch in plane.ep_set.branches:
            draw_branch(ax, branch, axes, width=2.0)
    return names + _draw_marked(ax, plane), handles


def _planes_figure(planes: Sequence[Plane], titles: Sequence[str]) -> Figure:
    """Planes side by side."""
    figure = new_figure(9.6, 5.0)
    draw_planes(figure, figure.subplots(1, 2), planes, titles)
    return figure


def draw_planes(figure: Figure, panels: Sequence[Axes], planes: Sequence[Plane], titles: Sequence[str]) -> None:
    """Planes with their titles, one legend for all, and their names."""
    drawn = [draw_plane(ax, plane) for ax, plane in zip(panels, planes, strict=True)]
    for ax, title in zip(panels, titles, strict=True):
        ax.set_title(title)
    legend_below(figure, [entry for _, entries in drawn for entry in entries])
    place_all([(ax, names) for ax, (names, _) in zip(panels, drawn, strict=True)])


def _draw_marked(ax: Axes, plane: Plane) -> list[Name]:
    for place in plane.marked.values():
        ax.plot(*place, "o", color=MARK, markeredgecolor="white", zorder=6)
    words = {"least Fr_c": r"least $\mathrm{Fr}_c$"}
    return [Name(words.get(name, name), *place) for name, place in plane.marked.items()]


def _shade_faces(faces: Array, colour: str) -> Array:
    """The colour of each face, darker where it turns away from the light on either side."""
    normal = np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    facing = np.abs(normal @ (_LIGHT / np.linalg.norm(_LIGHT))) / np.where(length > 0, length, 1)[:, 0]
    return np.outer(0.6 + 0.4 * facing, to_rgb(colour))
