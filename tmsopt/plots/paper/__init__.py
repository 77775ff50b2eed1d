"""The figures of Kirillov (2018), drawn from recomputed data.

In: the data of `tmsopt.paper`. Out: figures. Open `gallery` first: the list of them.
"""

from tmsopt.plots.paper.experiment import draw_critical_speeds, draw_law
from tmsopt.plots.paper.gallery import GALLERY, Item, find
from tmsopt.plots.paper.locus import draw_row, full_window
from tmsopt.plots.paper.planes import planes_figure
from tmsopt.plots.paper.swallowtail import draw_swallowtail, quadrilaterals
from tmsopt.plots.paper.universal import draw_box, draw_section

__all__ = [
    "GALLERY", "Item", "draw_box", "draw_critical_speeds", "draw_law", "draw_row", "draw_section",
    "draw_swallowtail", "find", "full_window", "planes_figure", "quadrilaterals",
]  # fmt: skip
