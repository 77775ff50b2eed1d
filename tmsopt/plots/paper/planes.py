"""The planes of the paper: domains with exact boundaries, the EP set, and the abscissa with the laws drawn in."""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tmsopt.paper.planes import OFF_LAW_CHI_B, OFF_LAW_TILT, Plane, chi_B_plane, tilt_plane
from tmsopt.plots.chart import Legend, draw_layer, plane_of
from tmsopt.plots.labels import Name, place_all
from tmsopt.plots.style import COMPLEX, CRITICAL, HEAVY, LINE, MARK, REAL, entry, legend_below, new_figure
from tmsopt.plots.trace import draw_branch

_LAWS = {
    "Frc1": (r"$\mathrm{Fr}_c$ (Frc1)", CRITICAL, "-"),
    "epset": ("EP set (epset)", HEAVY, "-"),
    "tls": (r"$\tan\lambda_s$ (tls)", LINE, ":"),
    "chib1": (r"$\chi_B$ (chib1)", LINE, ":"),
}
"""Words, colour and line of each law over the colours of the abscissa."""

_ON_LAW = (r"(a) $\chi_B = \sqrt{2}$", r"(b) $\lambda_s = \lambda_s^{\mathrm{EP}_4} = 0.4107$ rad")


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
