"""The list of the figures of the paper, and of others about it.

To add a figure, write a function `NAME_figure` that has no arguments and returns a Figure, add its line to
`__init__.pyi`, and add an Item to the list. The module of a figure is imported when the figure is made, so that the
list is available without Matplotlib.
"""

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

from tmsopt.executor import Crash, cores, in_process, processes
from tmsopt.records import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SETTINGS: Any = {"axes.titlesize": 9.5, "legend.fontsize": 7.5, "legend.title_fontsize": 7.5, "legend.framealpha": 0.9}
"""Settings of Matplotlib for all figures."""


@dataclass(frozen=True)
class Item:
    """A figure of the list.

    Attributes:
        name: name of the figure on the command line.
        alias: label of the figure in the paper; empty if the paper does not have it.
        caption: what the figure shows.
    """

    name: str
    alias: str
    caption: str

    def make(self) -> "Figure":
        """Compute the data and draw the figure."""
        from matplotlib import rc_context

        with rc_context(_SETTINGS):
            figure: Figure = getattr(import_module("tmsopt.plots.paper"), f"{self.name.replace('-', '_')}_figure")()
        return figure


def find_item(name: str) -> Item:
    """Find a figure by its name or alias.

    Raises:
        InputError: for an unknown name, with a suggestion.
    """
    from tmsopt.errors import input_error, suggest

    figures = {key: item for item in GALLERY.values() for key in (item.name, item.alias) if key}
    if name not in figures:
        raise input_error(f"found '{name}'; {suggest(name, figures)}", "NAME")
    return figures[name]


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


def render_pictures(items: Sequence[Item], file_formats: Sequence[str]) -> Generator[tuple[int, bytes]]:
    """Yield (index of the figure, content of its file), in the order in which the figures are finished.

    Several figures are drawn by several processes. If a process crashes, this process draws its figure.
    """
    workers = min(cores(), len(items))
    with processes(workers) if workers > 1 else in_process() as executor:
        tasks = [*zip([item.name for item in items], file_formats, strict=True)]
        for index, picture in executor.map(_render_item, tasks):
            yield index, _render_item(tasks[index]) if isinstance(picture, Crash) else picture


def _render_item(task: tuple[str, str]) -> bytes:
    """Draw the figure of a task, which is its name and its file format."""
    from tmsopt.plots.style import render

    name, file_format = task
    return render(GALLERY[name].make(), file_format)
