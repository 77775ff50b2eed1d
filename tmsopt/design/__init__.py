"""Problems and solutions as data: expressions, units, problem files, validation.

In: a problem file, or the arguments of `Problem`. Out: a frozen `Problem` in which every number is checked, and the
record `Solution` that solving it fills. Open `problem` first, then `expression`.
"""

from tmsopt.design.cases import Band, Case
from tmsopt.design.expression import Expression, ExpressionError, parse_comparison, parse_value
from tmsopt.design.files import Given, load, problem_of, question_of
from tmsopt.design.limit import limit_of, with_limit
from tmsopt.design.problem import Problem, freedom
from tmsopt.design.quantities import NO_RADIUS, ROOT_NAMES
from tmsopt.design.solution import Bound, NotSolved, Solution, Starts
from tmsopt.design.units import decay_time, frequencies, growth_time, reading, with_unit

__all__ = [
    "NO_RADIUS", "ROOT_NAMES", "Band", "Bound", "Case", "Expression", "ExpressionError", "Given", "NotSolved",
    "Problem", "Solution", "Starts", "decay_time", "freedom", "frequencies", "growth_time", "limit_of", "load",
    "parse_comparison", "parse_value", "problem_of", "question_of", "reading", "with_limit", "with_unit",
]  # fmt: skip
