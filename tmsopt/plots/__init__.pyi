from .bicycle import draw_bicycle as draw_bicycle, draw_distance as draw_distance
from .chart import chart_figure as chart_figure
from .front import front_figure as front_figure
from .growth import (
    draw_frequencies as draw_frequencies, draw_growth_rates as draw_growth_rates, growth_figure as growth_figure,
)
from .labels import Name as Name, place_names as place_names
from .style import new_figure as new_figure, save as save
from .trace import trace_figure as trace_figure
