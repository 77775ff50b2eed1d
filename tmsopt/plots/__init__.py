"""Results as figures, drawn with Matplotlib.

In: results of any verb. Out: figures, saved whole or not at all. Open `style` first; `paper` has the figures of the
source.
"""

from tmsopt.plots.bicycle import draw_bicycle, draw_distance
from tmsopt.plots.chart import chart_figure
from tmsopt.plots.front import front_figure
from tmsopt.plots.growth import draw_frequencies, draw_growth_rates, growth_figure
from tmsopt.plots.labels import Name, place_names
from tmsopt.plots.style import new_figure, save
from tmsopt.plots.trace import trace_figure

__all__ = [
    "Name", "chart_figure", "draw_bicycle", "draw_distance", "draw_frequencies", "draw_growth_rates",
    "front_figure", "growth_figure", "new_figure", "place_names", "save", "trace_figure",
]  # fmt: skip
