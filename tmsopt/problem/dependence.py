"""Finds whether expressions depend on the case, and in which direction root quantities improve them."""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from tmsopt.algebra.formula import formula, symbol
from tmsopt.models import Model, Quantity, Values
from tmsopt.models.expression import Expression
from tmsopt.problem.cases import Case
from tmsopt.problem.limit import limit_side
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, NO_RADIUS, RADIUS, ROOT_NAMES, ROOT_QUANTITIES

WORSE_DIRECTION = {"abscissa": 1.0, "damping_ratio": -1.0, ANGULAR_FREQUENCY: 1.0}
"""Root quantity → sign of a change for the worse. The nonlinear program bounds the quantity on that side only."""

_LESS_STABLE_DIRECTION = {"abscissa": 1.0, "damping_ratio": -1.0, RADIUS: -1.0}
"""Root quantity → sign of a change towards less stability."""

STABILITY_CONSTRAINT = "every root left of the axis"
"""Name of a stability constraint that the problem itself does not state."""

_LEAST_DECAY = 0.01  # least decay rate of a clearly stable design, relative to the mean size of the roots
_DESIGN_COUNT = 32  # number of random designs at which an expression is tested for its dependence on a quantity
_MAX_DECADES = 3.0  # random sizes of a root quantity lie up to this many powers of ten above and below 1
_STEP = 1e-3  # relative change of a quantity at these random designs


def depends_on_case(problem: Posed, expression: Expression, cases: Sequence[Case]) -> bool:
    """Whether an expression depends on parameters that differ between cases, apart from its root quantities.

    A root quantity is the worst value over the cases, so it is the same in all of them. An equality is required at the
    nominal design only, because it cannot hold at two corners of a box.
    """
    varied_names = {name for case in cases for table in (case.at, case.offset) for name in table}
    if not varied_names or expression.equality:
        return False
    return bool(varied_names & _find_dependencies(problem.model, problem.parameter_set.name, expression))


def needs_two_sided_bounds(problem: Posed) -> bool:
    """Whether one-sided bounds on root quantities would make the problem easier than it is.

    The nonlinear program writes the polynomial as a product of factors. Their constraints bound the abscissa and the
    angular frequency from above and the damping ratio from below. These bounds are exact if the objective and the
    constraints do not improve as the first two grow or the damping ratio falls.
    """
    return any(rewards_change_of(problem, name, direction) for name, direction in WORSE_DIRECTION.items())


def rewards_change_of(problem: Posed, name: str, direction: float = 1.0) -> bool:
    """Whether the objective or a constraint improves at some design as a quantity grows (direction 1) or falls (−1)."""
    terms = [(problem.sign, problem.objective), *((c.sign, c) for c in problem.conditions.values())]
    return any(e is not None and _can_fall(problem, sign, e, name, direction) for sign, e in terms)


def _mean_root_size(values: Values) -> float:
    """The geometric mean of |s| over the roots of a design; 1 if a root is infinite."""
    if values.model.polynomial is None:
        sizes = [r.size for r in values["structure"].roots for _ in range(r.multiplicity)]
        return float(math.prod(x ** (1 / len(sizes)) for x in sizes))
    a = [float(c) for c in values.coefficients]
    return abs(a[-1] / a[0]) ** (1 / values.model.degree) if a[0] else 1.0


def stability_limit(problem: Posed, least_decay: float = _LEAST_DECAY) -> dict[str, str]:
    """Name → a constraint that keeps designs stable; empty if neither the limits nor the objective require it.

    The constraint allows roots on the imaginary axis if the limits allow them and the objective does not depend on the
    roots.

    Args:
        least_decay: least decay rate relative to the mean size of the roots.
    """
    roots = {"abscissa", "damping_ratio", RADIUS}
    if problem.pattern or not any(name in roots and problem.asks(name) for name in roots):
        return {}
    values = problem.values(problem.ordered({n: (lo + hi) / 2 for n, (lo, hi) in problem.free.items()}))
    size = _mean_root_size(values)

    def is_excluded(abscissa: float, ratio: float) -> bool:
        """Whether a limit excludes roots with these values."""
        root_values = {"abscissa": abscissa, "damping_ratio": ratio, RADIUS: 0.0, ANGULAR_FREQUENCY: size}
        limits = (c for c in problem.conditions.values() if roots & set(c.names))
        return any(not c.holds(float(c(values.with_known(root_values)))) for c in limits)

    objective_uses_roots = problem.objective is not None and bool(roots & set(problem.objective.names))
    if not objective_uses_roots and not is_excluded(1e-6 * size, -1e-6):
        return {}
    allows_edge = not objective_uses_roots and not is_excluded(0.0, 0.0)
    decay = 0.0 if allows_edge or not 0 < size < np.inf else least_decay * size
    return {STABILITY_CONSTRAINT: f"abscissa <= {0.0 - decay!r}"}


def sense_notes(problem: Posed) -> tuple[str, ...]:
    """A note for the reader if the objective improves only while stability gets worse."""
    sign, goal, text = problem.sign, problem.objective, problem.goal
    directions = {n: d for n, d in _LESS_STABLE_DIRECTION.items() if problem.free and goal and n in goal.names}
    if not goal or not any(
        _can_fall(problem, sign, goal, n, d) and not _can_fall(problem, sign, goal, n, -d)
        for n, d in directions.items()
    ):
        return ()
    opposite = f'{"maximize" if problem.maximize is None else "minimize"} = "{text}"'
    return (f"{problem.sense} {text} asks for the least stable design; write {opposite} for the most stable one",)


def demands_heavy_damping(problem: Posed) -> bool:
    """Whether a constraint on the damping ratio allows only 1: all roots real and negative."""
    below_one, at_one = ({"damping_ratio": ratio} for ratio in (1 - 1e-9, 1.0))
    limits = (c for c in problem.conditions.values() if c.names == ("damping_ratio",))
    return any(c.holds(float(c(at_one))) and not c.holds(float(c(below_one))) for c in limits)


def _can_fall(problem: Posed, sign: float, expression: Expression, name: str, direction: float) -> bool:
    """Whether `sign` times an expression falls at some design as a quantity moves in a direction, 1 or −1.

    For an equality, any change of the expression counts.
    """
    if name in ROOT_NAMES and name not in expression.names:
        return False
    if expression.text.strip() == name:  # the most common case
        return sign * direction < 0
    if side := limit_side(expression.text, name):
        return expression.equality or sign * direction * side < 0
    rng = np.random.default_rng(0)
    ends = np.array([*problem.free.values()]).reshape(-1, 2)
    for _ in range(_DESIGN_COUNT):
        design = problem.ordered(dict(zip(problem.free, rng.uniform(*ends.T).tolist(), strict=True)))
        root_values = {
            n: float(rng.choice((-1, 1)) * 10 ** rng.uniform(-_MAX_DECADES, _MAX_DECADES)) for n in ROOT_NAMES
        }
        root_values |= {n: abs(root_values[n]) for n in (ANGULAR_FREQUENCY, RADIUS)}
        root_values["damping_ratio"] = float(rng.uniform(-1, 1))
        value = root_values.setdefault(name, float(rng.uniform(0.1, 2.0)))
        old_value, new_value = (
            float(expression(problem.values(design).with_known(root_values | {name: x})))
            for x in (value, value + direction * _STEP * min(1.0, abs(value)))
        )
        change = sign * (new_value - old_value)
        if change < 0 or (expression.equality and change != 0):
            return True
    return False


@lru_cache(maxsize=4096)
def _find_dependencies(model: Model, set_name: str, expression: Expression) -> frozenset[str]:
    """Parameters that an expression depends on, directly or through quantities, but not through root quantities."""
    parameter_set = model.parameter_set(set_name)
    extra = (*ROOT_QUANTITIES, NO_RADIUS)

    def root_symbol(quantity: Quantity, values: Values) -> Any:
        """A symbol for a root quantity; None for other quantities."""
        return symbol(quantity.name) if quantity.name in ROOT_NAMES else None

    symbols = {name: symbol(name) for name in parameter_set.names}
    values = Values(model, parameter_set, symbols, extra=extra, lift=root_symbol)
    return frozenset(formula([expression(values)]).inputs) & frozenset(parameter_set.names)
