"""The figures of the paper, and others about it, by name: from reference designs to finished figures.

To add one, write a function that takes nothing and returns a Figure, and an Item with it. Imports stand inside the
functions, so that listing the figures loads nothing heavy.
"""

from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tmsopt.executor import Crash, cores, here, processes
from tmsopt.records import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Item:
    """A figure that can be asked for.

    Attributes:
        name: on the command line.
        alias: its label in the paper, empty where it is not there.
        caption: what it shows.
        make: computes the data and draws it.
    """

    name: str
    alias: str
    caption: str
    make: "Callable[[], Figure]"


def find(name: str) -> Item:
    """The figure of that name or alias.

    Raises:
        InputError: for an unknown name, with a suggestion.
    """
    from tmsopt.errors import Fault, InputError, suggest

    for item in GALLERY.values():
        if name in (item.name, item.alias):
            return item
    raise InputError([Fault(f"found '{name}'; {suggest(name, _names())}", ("NAME",))])


def _names() -> Iterator[str]:
    """Everything that `find` accepts, names first."""
    yield from GALLERY
    yield from (item.alias for item in GALLERY.values() if item.alias)


def _bicycle() -> "Figure":
    from tmsopt.paper.reference import benchmark
    from tmsopt.paper.sketch import sketch
    from tmsopt.plots.bicycle import bicycle_figure

    return bicycle_figure(sketch(benchmark().parameters), "The two-mass-skate bicycle: the benchmark, to scale")


def _growth() -> "Figure":
    from tmsopt.dynamics.growth import growth
    from tmsopt.models import tms
    from tmsopt.paper.reference import benchmark, optimised
    from tmsopt.plots.paper.growth import draw_growth_rates
    from tmsopt.plots.style import REAL, new_figure
    from tmsopt.problem.problem import Problem
    from tmsopt.search.solve import solve

    others = {name: value for name, value in benchmark().parameters.items() if name != "Fr"}
    fastest = solve(Problem(tms, fixed=others, free={"Fr": (0.1, 4.0)}, minimize="abscissa"), interruptible=False)
    best = solve(Problem(tms, fixed=dict(optimised().parameters)))
    figure = new_figure(9.2, 4.2)
    left, right = figure.subplots(1, 2, sharey=True)
    for ax, design, name in ((left, fastest, "(a) benchmark"), (right, best, "(b) optimised benchmark")):
        draw_growth_rates(ax, growth(design, end=4.0))
        ax.axhline(design.abscissa, color="0.5", linewidth=0.8, linestyle=":")
        ax.plot(
            [design.dimensionless["Fr"]],
            [design.abscissa],
            linestyle="none",
            marker="o",
            markersize=6,
            zorder=5,
            color=REAL if "EP" in design.structure else "white",
            markeredgecolor="black",
        )
        if design.structure == "EP4":
            at = (design.dimensionless["Fr"], design.abscissa)
            ax.annotate(r"$\mathrm{EP}_4$", at, xytext=(9, 5), textcoords="offset points", fontsize=10)
        ax.set_xlim(0, 4)
        ax.set_ylim(-4, 4)
        ax.set_xlabel(r"Froude number $\mathrm{Fr} = v/\sqrt{gw}$")
        least = rf"${design.abscissa:.4g}$ at $\mathrm{{Fr}} = {design.dimensionless['Fr']:.4f}$"
        ax.set_title(f"{name}: least abscissa {least}", fontsize=9.5)
    right.set_ylabel("")
    return figure


def _swallowtail() -> "Figure":
    from tmsopt.paper.planes import SECTIONS, section, surface
    from tmsopt.plots.paper.swallowtail import swallowtail_figure

    names = (r"\mathrm{Fr}_{\mathrm{EP}_4}" + (f" {offset:+g}" if offset else "") for offset in SECTIONS)
    titles = [rf"({letter}) $\mathrm{{Fr}} = {name}$" for letter, name in zip("bcd", names, strict=True)]
    return swallowtail_figure(surface(), [section(offset) for offset in SECTIONS], titles)


def _ep_set() -> "Figure":
    from tmsopt.paper.planes import chi_B_plane, tilt_plane
    from tmsopt.plots.paper.planes import planes_figure

    return planes_figure([tilt_plane(), chi_B_plane()], _ON_LAW)


def _off_law() -> "Figure":
    from tmsopt.paper.planes import OFF_LAW_CHI_B, OFF_LAW_TILT, chi_B_plane, tilt_plane
    from tmsopt.plots.paper.planes import planes_figure

    titles = [
        rf"(a) $\chi_B = \sqrt{{2}} {OFF_LAW_CHI_B:+g}$",
        rf"(b) $\lambda_s = \lambda_s^{{\mathrm{{EP}}_4}} {OFF_LAW_TILT:+g}$ rad",
    ]
    return planes_figure([tilt_plane(OFF_LAW_CHI_B), chi_B_plane(OFF_LAW_TILT)], titles)


def _abscissa() -> "Figure":
    from tmsopt.paper.planes import chi_B_plane, tilt_plane
    from tmsopt.plots.paper.planes import abscissa_figure

    points = (480, 360)
    return abscissa_figure([tilt_plane(0, points, False), chi_B_plane(0, points, False)], _ON_LAW)


_ON_LAW = (r"(a) $\chi_B = \sqrt{2}$", r"(b) $\lambda_s = \lambda_s^{\mathrm{EP}_4} = 0.4107$ rad")


def _root_locus() -> "Figure":
    from tmsopt.paper.locus import table_1_loci
    from tmsopt.plots.paper.locus import locus_figure

    return locus_figure(table_1_loci())


def _experiment() -> "Figure":
    from tmsopt.paper.experiment import experiment
    from tmsopt.plots.paper.experiment import experiment_figure

    return experiment_figure(experiment())


def _universal() -> "Figure":
    from tmsopt.paper.universal import spire_faces, table_1_paths
    from tmsopt.plots.paper.universal import LIMIT, universal_figure

    return universal_figure(table_1_paths(), spire_faces(LIMIT), r"$\mathrm{Fr}$")


_ITEMS = (
    Item(
        "bicycle",
        "figTMS",
        "The two-mass-skate bicycle with its parameters, drawn to scale for the benchmark.",
        _bicycle,
    ),
    Item(
        "growth",
        "fig0",
        "Growth rates over the Froude number: the benchmark, with the speed of its least abscissa, and the optimised "
        "bicycle with the quadruple root s = -1 (EP4).",
        _growth,
    ),
    Item(
        "swallowtail",
        "fig00",
        "The discriminant surface for chi_H = 1, zeta_H = -0.2, zeta_B = -0.4 with its cuspidal edges (EP3) and "
        "self-intersection (2EP2) meeting in EP4, and its sections at the Fr of EP4, 0.1 below and 0.5 above.",
        _swallowtail,
    ),
    Item(
        "ep-set",
        "fig1",
        "Stability and heavy damping over (Fr, lambda_s) at chi_B = sqrt(2) with the EP set, and over (Fr, chi_B) at "
        "the steer axis tilt of EP4; every boundary is traced.",
        _ep_set,
    ),
    Item(
        "off-law",
        "fig2",
        "The same beside the laws: chi_B = sqrt(2) - 0.1, and 0.18 rad below the steer axis tilt of EP4, with EP3 "
        "cusps and the 2EP2 crossing.",
        _off_law,
    ),
    Item(
        "root-locus",
        "fig3",
        "Roots as Fr increases from 0 to 5 for chi_H = 1, zeta_H = -0.2, zeta_B = -0.4 at the three steer axis tilts "
        "of Table 1, with chi_B = sqrt(2) and beside it; enlarged around EP4, 2EP2 and CEP2.",
        _root_locus,
    ),
    Item(
        "experiment",
        "fige",
        "The experimental bicycle beside the law chi_B = sqrt(zeta_B/zeta_H), which is for chi_H = 1 while it has "
        "0.921, and its critical Froude number over chi_B at an assumed tilt of 20 deg and assumed mass ratios.",
        _experiment,
    ),
    Item(
        "abscissa",
        "",
        "Spectral abscissa over the planes of Fig. fig1 with the laws drawn in; its contours have corners at the "
        "exceptional points, and its least value is at EP4.",
        _abscissa,
    ),
    Item(
        "universal",
        "",
        "Every quartic with a4/a0 > 0 as a point (A1, A2, A3), with stability, heavy damping and the EP set; the "
        "designs of Table 1 swept over Fr from 0 to 5.",
        _universal,
    ),
)

GALLERY = Table({item.name: item for item in _ITEMS})
"""Figures by name, in the order of the list."""


def pictures(items: Sequence[Item], endings: Sequence[str]) -> Generator[tuple[int, bytes]]:
    """What the files of figures hold, each with its place, as they are finished.

    Several are drawn by processes of their own, as many as are of use; what one of them fails at is drawn here.
    """
    workers = min(cores(), len(items))
    with processes(workers) if workers > 1 else here() as executor:
        for place, picture in executor.map(_picture, zip([item.name for item in items], endings, strict=True)):
            yield place, _picture((items[place].name, endings[place])) if isinstance(picture, Crash) else picture


def _picture(asked: tuple[str, str]) -> bytes:
    """A figure by its name, and the ending of its file."""
    from tmsopt.plots.style import rendered

    name, ending = asked
    return rendered(GALLERY[name].make(), ending)
