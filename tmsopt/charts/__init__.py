"""Chart: stability over grids of designs, in memory or in a folder.

In: a problem with two or three free parameters. Out: a `Chart` of layers: classes, abscissae, any expression. Open
`chart` first; `survey` computes it tile by tile, `folder` keeps it on disk.
"""

from tmsopt.charts.chart import LARGEST, Chart, chart, open_chart
from tmsopt.charts.expressions import array_function
from tmsopt.charts.files import check_netcdf, save_layers
from tmsopt.charts.motion import classified, classify, engine_of
from tmsopt.charts.summary import tally, total
from tmsopt.charts.survey import LAYERS, USUAL, USUAL_POINTS, Grid, axes_of, survey

__all__ = [
    "LARGEST", "LAYERS", "USUAL", "USUAL_POINTS", "Chart", "Grid", "array_function", "axes_of", "chart", "check_netcdf",
    "classified", "classify", "engine_of", "open_chart", "save_layers", "survey", "tally", "total",
]  # fmt: skip
