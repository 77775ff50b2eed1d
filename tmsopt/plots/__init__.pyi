from .bicycle import draw_bicycle as draw_bicycle, draw_distance as draw_distance
from .chart import chart_figure as chart_figure, draw_chart as draw_chart, draw_domain as draw_domain
from .front import draw_front as draw_front, front_figure as front_figure
from .growth import (
    draw_frequencies as draw_frequencies, draw_growth as draw_growth, draw_speeds as draw_speeds,
    draw_petermann as draw_petermann, growth_figure as growth_figure,
)
from .labels import Name as Name, place_names as place_names
from .meaning import (
    draw_comparison as draw_comparison, draw_designs as draw_designs, draw_ledger as draw_ledger,
    draw_robustness as draw_robustness, draw_rounding as draw_rounding,
)
from .motion import draw_motion as draw_motion, motion_figure as motion_figure
from .paper.planes import draw_swallowtail as draw_swallowtail
from .roots import draw_roots as draw_roots, draw_splitting as draw_splitting
from .spectra import (
    draw_loop as draw_loop, draw_sheets as draw_sheets, loop_figure as loop_figure, sheets_figure as sheets_figure,
)
from .study import draw_histogram as draw_histogram
from .style import new_figure as new_figure, save as save
from .trace import draw_trace as draw_trace, trace_figure as trace_figure
