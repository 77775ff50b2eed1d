from .chart import LARGEST as LARGEST, Chart as Chart, chart as chart, open_chart as open_chart
from .export import check_netcdf as check_netcdf
from .survey import (
    LAYERS as LAYERS, USUAL as USUAL, USUAL_POINTS as USUAL_POINTS, Grid as Grid, add_tallies as add_tallies,
    axes_of as axes_of, count_tile as count_tile, plan_survey as plan_survey,
)
