"""The figures of the paper, and others about it, by name: from reference designs to finished figures.

To add one, write a function `NAME_figure` that takes nothing and returns a Figure, its line in `__init__.pyi`, and an
Item with it. The module is imported when the figure is made, so that listing the figures loads nothing heavy.
"""

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

from tmsopt.executor import Crash, cores, here, processes
from tmsopt.records import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LOOK: Any = {"axes.titlesize": 9.5, "legend.fontsize": 7.5, "legend.title_fontsize": 7.5, "legend.framealpha": 0.9}
"""Settings of Matplotlib for every figure."""


@dataclass(frozen=True)
class Item:
    """A figure that can be asked for.

    Attributes:
        name: on the command line.
        alias: its label in the paper, empty where it is not there.
        caption: what it shows.
    """

    name: str
    alias: str
    caption: str

    def make(self) -> "Figure":
        """The figure, its data computed anew."""
        from matplotlib import rc_context

        with rc_context(_LOOK):
            made: Figure = getattr(import_module("tmsopt.plots.paper"), f"{self.name.replace('-', '_')}_figure")()
        return made


def find(name: str) -> Item:
    """The figure of that name or alias.

    Raises:
        InputError: for an unknown name, with a suggestion.
    """
    from tmsopt.errors import input_error, suggest

    named = {key: item for item in GALLERY.values() for key in (item.name, item.alias) if key}
    if name not in named:
        raise input_error(f"found '{name}'; {suggest(name, named)}", "NAME")
    return named[name]


_ITEMS = (
    Item(
        "bicycle",
        "figTMS",
        "The two-mass-skate bicycle with its parameters, drawn to scale for the benchmark.",
    ),
    Item(
        "growth",
        "fig0",
        "Growth rates over the Froude number: the benchmark, with the speed of its least abscissa, and the optimised "
        "bicycle with the quadruple root s = -1 (EP4).",
    ),
    Item(
        "swallowtail",
        "fig00",
        "The discriminant surface for chi_H = 1, zeta_H = -0.2, zeta_B = -0.4 with its cuspidal edges (EP3) and "
        "self-intersection (2EP2) meeting in EP4, and its sections at the Fr of EP4, 0.1 below and 0.5 above.",
    ),
    Item(
        "ep-set",
        "fig1",
        "Stability and heavy damping over (Fr, lambda_s) at chi_B = sqrt(2) with the EP set, and over (Fr, chi_B) at "
        "the steer axis tilt of EP4; every boundary is traced.",
    ),
    Item(
        "off-law",
        "fig2",
        "The same beside the laws: chi_B = sqrt(2) - 0.1, and 0.18 rad below the steer axis tilt of EP4, with EP3 "
        "cusps and the 2EP2 crossing.",
    ),
    Item(
        "root-locus",
        "fig3",
        "Roots as Fr increases from 0 to 5 for chi_H = 1, zeta_H = -0.2, zeta_B = -0.4 at the three steer axis tilts "
        "of Table 1, with chi_B = sqrt(2) and beside it; enlarged around EP4, 2EP2 and CEP2.",
    ),
    Item(
        "experiment",
        "fige",
        "The experimental bicycle beside the law chi_B = sqrt(zeta_B/zeta_H), which is for chi_H = 1 while it has "
        "0.921, and its critical Froude number over chi_B at an assumed tilt of 20 deg and assumed mass ratios.",
    ),
    Item(
        "abscissa",
        "",
        "Spectral abscissa over the planes of Fig. fig1 with the laws drawn in; its contours have corners at the "
        "exceptional points, and its least value is at EP4.",
    ),
    Item(
        "universal",
        "",
        "Every quartic with a4/a0 > 0 as a point (A1, A2, A3), with stability, heavy damping and the EP set; the "
        "designs of Table 1 swept over Fr from 0 to 5.",
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
    from tmsopt.plots.style import render

    name, ending = asked
    return render(GALLERY[name].make(), ending)
