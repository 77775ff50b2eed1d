"""Chart: stability over grids of designs, in memory or in a folder.

In: a problem with two or three free parameters. Out: a `Chart` of layers: classes, abscissae, any expression. Open
`chart` first; `survey` computes it tile by tile, `folder` keeps it on disk.
"""

from tmsopt.charts.chart import Chart, chart, save_arrays
from tmsopt.charts.expressions import array_function
from tmsopt.charts.files import save_layers
from tmsopt.charts.motion import classified, classify, engine_of
from tmsopt.charts.stored import StoredChart, chart_to, gathered, open_chart
from tmsopt.charts.summary import tally, total
from tmsopt.charts.survey import LAYERS, USUAL, Grid, axes_of, survey

__all__ = [
    "LAYERS",
    "USUAL",
    "Chart",
    "Grid",
    "StoredChart",
    "array_function",
    "axes_of",
    "chart",
    "chart_to",
    "classified",
    "classify",
    "engine_of",
    "gathered",
    "open_chart",
    "save_arrays",
    "save_layers",
    "survey",
    "tally",
    "total",
]
