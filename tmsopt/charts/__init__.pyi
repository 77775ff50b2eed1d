from .chart import (
    MAX_DESIGNS_IN_MEMORY as MAX_DESIGNS_IN_MEMORY, Chart as Chart, chart as chart, open_chart as open_chart,
)
from .export import check_netcdf as check_netcdf
from .survey import (
    DEFAULT_LAYERS as DEFAULT_LAYERS, DEFAULT_POINTS as DEFAULT_POINTS, LAYERS as LAYERS, Grid as Grid,
    add_tallies as add_tallies, axes_of as axes_of, count_tile as count_tile, plan_survey as plan_survey,
)
