from .chart import LARGEST as LARGEST, Chart as Chart, chart as chart, open_chart as open_chart
from .export import check_netcdf as check_netcdf
from .survey import (
    LAYERS as LAYERS, USUAL as USUAL, USUAL_POINTS as USUAL_POINTS, Grid as Grid, axes_of as axes_of,
    plan_survey as plan_survey,
)
from .tally import add_tallies as add_tallies, count_tile as count_tile
