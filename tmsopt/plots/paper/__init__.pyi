from .bicycles import (
    bicycle_figure as bicycle_figure, draw_critical_speeds as draw_critical_speeds, draw_law as draw_law,
    experiment_figure as experiment_figure, growth_figure as growth_figure,
)
from .gallery import GALLERY as GALLERY, Item as Item, find_item as find_item, render_pictures as render_pictures
from .locus import draw_row as draw_row, full_window as full_window, root_locus_figure as root_locus_figure
from .planes import (
    abscissa_figure as abscissa_figure, draw_plane as draw_plane, draw_swallowtail as draw_swallowtail,
    ep_set_figure as ep_set_figure, off_law_figure as off_law_figure, quadrilaterals as quadrilaterals,
    swallowtail_figure as swallowtail_figure,
)
from .universal import draw_box as draw_box, draw_section as draw_section, universal_figure as universal_figure
