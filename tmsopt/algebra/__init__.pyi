from .arrays import Program as Program, program as program
from .balls import Number as Number, number as number
from .elementary import (
    exact as exact, greater as greater, lesser as lesser, magnitude as magnitude, positive_part as positive_part,
    printed as printed,
    power as power, quotient as quotient, sqrt as sqrt, tan as tan,
)
from .formal import variable as variable
from .formulas import Formulas as Formulas
from .intervals import (
    EVERYTHING as EVERYTHING, INTERVALS as INTERVALS, ball as ball, interval as interval, ranges as ranges,
    root_bound as root_bound, square as square,
)
from .krawczyk import Refused as Refused, enclosed as enclosed, refined as refined
from .operations import ARRAYS as ARRAYS, BALLS as BALLS
from .rounding import Bounded as Bounded, as_bounded as as_bounded
from .walk import NotAccepted as NotAccepted, operation_name as operation_name, steps as steps, walk as walk
