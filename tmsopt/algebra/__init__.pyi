from .arrays import evaluate_on_arrays as evaluate_on_arrays
from .balls import Number as Number, exact as exact, number as number, rational as rational
from .formula import (
    Formula as Formula, Kind as Kind, UnsupportedOperation as UnsupportedOperation, fold as fold,
    from_casadi as from_casadi, trace as trace,
)
from .intervals import (
    REAL_LINE as REAL_LINE, ball as ball, bound_roots as bound_roots, interval as interval, ranges as ranges,
)
from .kinds import (
    BALLS as BALLS, CASADI as CASADI, FLOATS as FLOATS, INTERVALS as INTERVALS, NODES as NODES, values as values,
)
from .krawczyk import (
    ProofFailed as ProofFailed, enclose_solution as enclose_solution, refine_solution as refine_solution,
)
from .rounding import Bounded as Bounded, as_bounded as as_bounded
