from .experiment import draw_critical_speeds as draw_critical_speeds, draw_law as draw_law
from .gallery import GALLERY as GALLERY, Item as Item, find as find, pictures as pictures
from .locus import draw_row as draw_row, full_window as full_window
from .planes import planes_figure as planes_figure
from .swallowtail import draw_swallowtail as draw_swallowtail, quadrilaterals as quadrilaterals
from .universal import draw_box as draw_box, draw_section as draw_section
