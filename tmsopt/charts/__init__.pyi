from .chart import LARGEST as LARGEST, Chart as Chart, chart as chart, open_chart as open_chart
from .expressions import array_function as array_function
from .files import check_netcdf as check_netcdf, save_layers as save_layers
from .motion import classified as classified, classify as classify, engine_of as engine_of
from .summary import tally as tally, total as total
from .survey import (
    LAYERS as LAYERS, USUAL as USUAL, USUAL_POINTS as USUAL_POINTS, Grid as Grid, axes_of as axes_of, survey as survey,
)
