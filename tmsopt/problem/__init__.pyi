from .advice.remedies import Relaxation as Relaxation, move_limits as move_limits, replace_limits as replace_limits
from .cases import Band as Band, Case as Case
from .expression import (
    Expression as Expression, ExpressionError as ExpressionError, parse_comparison as parse_comparison,
    parse_value as parse_value,
)
from .evaluate import array_function as array_function, evaluate as evaluate
from .files import ProblemSource as ProblemSource, load as load, as_solvable as as_solvable, pose as pose
from .freedom import degrees_of_freedom as degrees_of_freedom
from .limit import limit_value as limit_value, replace_limit as replace_limit
from .problem import Posed as Posed, Problem as Problem
from .quantities import NO_RADIUS as NO_RADIUS, ROOT_NAMES as ROOT_NAMES
from .searches import Starts as Starts, expected_unseen as expected_unseen, expects_few_better as expects_few_better
from .solution import Bound as Bound, Solution as Solution
from .symmetry import find_symmetry as find_symmetry
from .unit_system import (
    Unit as Unit, amounts_text as amounts_text, rate_of as rate_of, show_at as show_at, unit_at as unit_at,
    unit_of as unit_of, common_unit as common_unit, units_of as units_of,
)
from .verdict.status import NotSolved as NotSolved, status_text as status_text
