"""One formula for floats, arrays, CasADi expressions, fractions and balls.

In: formulas written once as plain arithmetic, and numbers of any of these kinds. Out: values of the same kind,
enclosures, and solutions proved by interval Newton. Open `operations` first: the table of what each arithmetic can
do.
"""

from tmsopt.arithmetic.arrays import Program, program
from tmsopt.arithmetic.balls import Number, number
from tmsopt.arithmetic.elementary import exact, greater, lesser, magnitude, positive_part, power, quotient, sqrt, tan
from tmsopt.arithmetic.formulas import formulas
from tmsopt.arithmetic.intervals import EVERYTHING, INTERVALS, ball, interval, ranges, root_bound, square
from tmsopt.arithmetic.krawczyk import Refused, enclosed, refined
from tmsopt.arithmetic.operations import ARRAYS, BALLS
from tmsopt.arithmetic.walk import NotAccepted, operation_name, steps, walk

__all__ = [
    "ARRAYS", "BALLS", "EVERYTHING", "INTERVALS", "NotAccepted", "Number", "Program", "Refused", "ball", "enclosed",
    "exact", "formulas", "greater", "interval", "lesser", "magnitude", "number", "operation_name", "positive_part",
    "power", "program", "quotient", "ranges", "refined", "root_bound", "sqrt", "square", "steps", "tan", "walk",
]  # fmt: skip
