"""What an expression depends on: the case of a problem, and root quantities in which direction."""

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
"""Direction in which a root quantity gets worse; its factors bound it from that side alone."""

_EXTREME = {"abscissa": 1.0, "damping_ratio": -1.0, RADIUS: -1.0}
"""The same of which there cannot be too much of the one and too little of the other."""

STABLE = "every root left of the axis"
"""The name of a constraint that a problem does not state."""

_STEADY = 0.01  # of the roots' mean size: decay of a design that is stable beyond doubt
_DESIGNS = 32  # designs at which the direction of a root quantity is looked at
_DECADES = 3.0  # from 1, up and down, over which values of a root quantity are drawn
_STEP = 1e-3


def depends_on_case(problem: Posed, expression: Expression, cases: Sequence[Case]) -> bool:
    """Whether the value of an expression depends on what differs between cases, its root quantities aside.

    Those are shared by all cases, as the worst of them. An equality is one of the nominal design, for it cannot hold
    at two corners of a box.
    """
    varied = {name for case in cases for table in (case.at, case.offset) for name in table}
    if not varied or expression.equality:
        return False
    return bool(varied & _dependencies(problem.model, problem.parameter_set.name, expression))


def needs_two_sided_bounds(problem: Posed) -> bool:
    """Whether a bound on a root quantity, in place of the quantity, would make a problem easier than it is.

    The factors bound the abscissa and the angular frequency from above and the damping ratio from below; that is exact
    where the objective and the constraints get no better as those grow or the ratio falls.
    """
    return any(rewards_change_of(problem, name, worse) for name, worse in WORSE_DIRECTION.items())


def rewards_change_of(problem: Posed, name: str, worse: float = 1.0) -> bool:
    """Whether objective or constraints get better, at some design, as a quantity moves up (or down: `worse` −1)."""
    asked = [(problem.sign, problem.objective), *((c.sign, c) for c in problem.conditions.values())]
    return any(e is not None and _falls(problem, sign, e, name, worse) for sign, e in asked)


def stability_wanted(problem: Posed, steady: float = _STEADY) -> dict[str, str]:
    """A limit that keeps designs stable, by its name; none where limits and objective do not want that.

    Limits that are met on the edge of stability are content with it.

    Args:
        steady: decay at least, of the roots' mean size.
    """
    roots = {"abscissa", "damping_ratio", RADIUS}
    if problem.pattern or not any(name in roots and problem.asks(name) for name in roots):
        return {}
    values = problem.values(problem.ordered({n: (lo + hi) / 2 for n, (lo, hi) in problem.free.items()}))
    a = [float(c) for c in values.coefficients]
    size = abs(a[-1] / a[0]) ** (1 / problem.model.degree) if a[0] else 1.0

    def refused(abscissa: float, ratio: float) -> bool:
        """Whether a limit excludes such roots."""
        found = {"abscissa": abscissa, "damping_ratio": ratio, RADIUS: 0.0, ANGULAR_FREQUENCY: size}
        asked = (c for c in problem.conditions.values() if roots & set(c.names))
        return any(not c.holds(float(c(values.with_known(found)))) for c in asked)

    goal = problem.objective is not None and bool(roots & set(problem.objective.names))
    if not goal and not refused(1e-6 * size, -1e-6):
        return {}
    edge = not goal and not refused(0.0, 0.0)
    least = 0.0 if edge or not 0 < size < np.inf else steady * size
    return {STABLE: f"abscissa <= {0.0 - least!r}"}


def _only_worsens(problem: Posed, name: str, worse: float) -> bool:
    """Whether the objective gets better as a quantity gets worse, and at no design as it gets better."""
    goal = problem.objective
    if goal is None or name not in goal.names:
        return False
    return _falls(problem, problem.sign, goal, name, worse) and not _falls(problem, problem.sign, goal, name, -worse)


def sense_notes(problem: Posed) -> tuple[str, ...]:
    """That an objective gets better only as stability gets worse, and what asks for the opposite."""
    text = (problem.minimize or problem.maximize or "").strip()
    if not problem.free or not any(_only_worsens(problem, name, worse) for name, worse in _EXTREME.items()):
        return ()
    opposite = {"minimize": "maximize", "maximize": "minimize"}[problem.sense]
    other = f'{opposite} = "{text}"'
    return (f"{problem.sense} {text} asks for the least stable design; {other} asks for the most stable one",)


def demands_heavy_damping(problem: Posed) -> bool:
    """Whether a constraint on the damping ratio alone leaves nothing but 1: all roots real and negative."""
    for condition in problem.conditions.values():
        if condition.names == ("damping_ratio",):
            below, at = (float(condition({"damping_ratio": ratio})) for ratio in (1 - 1e-9, 1.0))
            if condition.holds(at) and condition.excess(below) > 0:
                return True
    return False


def _falls(problem: Posed, sign: float, expression: Expression, name: str, worse: float) -> bool:
    """Whether an expression, the smaller the better, falls as a quantity changes; an equality, if it does anything."""
    if name in ROOT_NAMES and name not in expression.names:
        return False
    if expression.text.strip() == name:  # the commonest question needs no numbers
        return sign * worse < 0
    if side := limit_side(expression.text, name):
        return expression.equality or sign * worse * side < 0
    rng = np.random.default_rng(0)
    ends = np.array([problem.free[n] for n in problem.free]).reshape(-1, 2)
    for _ in range(_DESIGNS):
        drawn = problem.ordered(dict(zip(problem.free, rng.uniform(*ends.T).tolist(), strict=True)))
        drawn_of = [n for n in ROOT_NAMES if n != ANGULAR_FREQUENCY or n in expression.names]
        found = {n: float(rng.choice((-1, 1)) * 10 ** rng.uniform(-_DECADES, _DECADES)) for n in drawn_of}
        found |= {"damping_ratio": float(rng.uniform(-1, 1))}
        found |= {n: abs(found[n]) for n in (ANGULAR_FREQUENCY, RADIUS) if n in found}
        if name not in found:
            found[name] = float(rng.uniform(0.1, 2.0))
        before, after = (
            float(expression(problem.values(drawn).with_known({**found, name: value})))
            for value in (found[name], found[name] + worse * _STEP * min(1.0, abs(found[name])))
        )
        change = sign * (after - before)
        if change < 0 or (expression.equality and change != 0):
            return True
    return False


@lru_cache(maxsize=4096)
def _dependencies(model: Model, set_name: str, expression: Expression) -> frozenset[str]:
    """Parameters that an expression depends on, directly or through quantities other than those of the roots."""
    of = model.parameter_set(set_name)
    extra = (*ROOT_QUANTITIES, NO_RADIUS)

    def stand_in(quantity: Quantity, values: Values) -> Any:
        """In place of a quantity of the roots, itself."""
        return symbol(quantity.name) if quantity.name in ROOT_NAMES else None

    values = Values(model, of, {name: symbol(name) for name in of.names}, extra=extra, lift=stand_in)
    return frozenset(formula([expression(values)]).inputs) & frozenset(of.names)
