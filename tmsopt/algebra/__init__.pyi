from .arrays import on_arrays as on_arrays
from .balls import Number as Number, exact as exact, number as number, rational as rational
from .formula import (
    Formula as Formula, Kind as Kind, NotAccepted as NotAccepted, fold as fold, from_casadi as from_casadi,
    trace as trace,
)
from .intervals import (
    EVERYTHING as EVERYTHING, ball as ball, interval as interval, ranges as ranges, root_bound as root_bound,
)
from .kinds import (
    BALLS as BALLS, CASADI as CASADI, FLOATS as FLOATS, INTERVALS as INTERVALS, NODES as NODES, values as values,
)
from .krawczyk import Refused as Refused, enclosed as enclosed, refined as refined
from .rounding import Bounded as Bounded, as_bounded as as_bounded
