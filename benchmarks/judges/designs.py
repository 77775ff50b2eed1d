"""Designs of a problem without scenarios, in arrays by eigenvalues, and one at a time by isolated roots."""

from collections.abc import Iterator, Mapping
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import flint
import numpy as np

from benchmarks.judges.eigenvalues import Roots, eigenvalues, root_values
from benchmarks.judges.exact import DIGITS, near_roots, stored_values
from benchmarks.judges.text import NOWHERE, difference, evaluated, excess, sides
from tmsopt import Problem
from tmsopt.models import Values
from tmsopt.records import Array

_ROOTS = ("abscissa", "damping_ratio")


@dataclass(frozen=True)
class Worth:
    """What designs are worth, shape (designs,) each.

    Attributes:
        value: the objective, the less the better: with the opposite sign where it is maximised.
        violation: largest, relative to the size of the two sides; `NOWHERE` where something does not exist.
    """

    value: Array
    violation: Array

    @property
    def merit(self) -> Array:
        """Rank: any feasible design beats any other, and of those that are not the least violating wins."""
        return np.where(self.violation <= 0, np.minimum(self.value, 1e18), 1e20 * (1 + self.violation))


@dataclass(frozen=True)
class Row:
    """A constraint, compiled."""

    text: str
    left: Any
    comparison: str
    right: Any
    difference: Any
    rooted: bool

    def excess(self, values: Mapping[str, Any]) -> Array:
        """As `text.excess`, of designs."""
        return excess(evaluated(self.left, values), self.comparison, evaluated(self.right, values))

    def apart(self, values: Mapping[str, Any]) -> Array:
        """Left minus right, with the sign that is at most 0 where an inequality holds, relative to the sides' size."""
        left, right = evaluated(self.left, values), evaluated(self.right, values)
        size = np.maximum(1.0, np.maximum(np.abs(left), np.abs(right)))
        return np.asarray((right - left if self.comparison == ">=" else left - right) / size, dtype=float)


class _Stated(dict[str, Any]):
    """Parameters of designs of a stated model, and its coefficients once they are asked for."""

    def __init__(self, at: Mapping[str, Any], names: tuple[str, ...], function: Any, x: Array) -> None:
        super().__init__(at)
        self._names, self._function, self._x = names, function, x

    @cached_property
    def coefficients(self) -> list[Array]:
        return list(np.array(self._function(self._x)))

    def __missing__(self, name: str) -> Any:
        if name not in self._names:
            raise KeyError(name)
        return self.coefficients[self._names.index(name)]

    def with_known(self, known: Mapping[str, Any]) -> "_Stated":
        other = copy(self)
        other.update(known)
        return other


class Designs:
    """Evaluates designs x of shape (free, designs)."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.names = list(problem.free)
        self.lower, self.upper = np.array([*problem.free.values()]).reshape(-1, 2).T
        assert problem.posed.objective is not None
        self.objective = compile(problem.posed.objective.text, "objective", "eval")
        self.about_roots = _about(problem.posed.objective.names)
        self.rows = [_row(c.text, c.names) for c in problem.posed.conditions.values()]
        self.sign = problem.posed.sign
        self._quick = None if problem.model.statement is None else self._function()

    @property
    def equalities(self) -> list[Row]:
        """Rows that are equations."""
        return [r for r in self.rows if r.comparison == "=="]

    def _function(self) -> Any:
        """The coefficients of a stated model, for arrays: at once, where formulas are walked step by step."""
        symbols = {n: ca.SX.sym(n) for n in self.names}
        found = self.problem.model.coefficients({**self.problem.fixed, **symbols}, self.problem.posed.parameter_set)
        return ca.Function("coefficients", [ca.vertcat(*symbols.values())], [ca.densify(ca.vertcat(*found))])

    def values(self, x: Array) -> Values | _Stated:
        """Everything but the roots."""
        at: dict[str, Any] = {**self.problem.fixed, **dict(zip(self.names, x, strict=True))}
        if self._quick is not None:
            return _Stated(at, self.problem.model.coefficient_names(), self._quick, x)
        return Values(self.problem.model, self.problem.posed.parameter_set, at)

    def coefficients(self, values: Values | _Stated, count: int) -> Array:
        """Shape (designs, n + 1)."""
        size = np.zeros(count)
        return np.stack([np.asarray(c, float) + size for c in values.coefficients], axis=-1)

    def plain(self, x: Array, values: Values | _Stated | None = None) -> Array:
        """Largest violation of the limits that are not about roots."""
        worst = np.zeros(x.shape[1])
        with np.errstate(all="ignore"):
            known = self.values(x) if values is None else values
            for row in self.rows:
                if not row.rooted:
                    worst = np.maximum(worst, row.excess(known))
        return worst

    def __call__(self, x: Array, slack: float = 0.0) -> Worth:
        """A violation up to `slack` counts as none; roots are found only where all the rest holds."""
        with np.errstate(all="ignore"):
            values = self.values(x)
            violation = np.broadcast_to(self.plain(x, values), x.shape[1]).copy()
            violation[violation <= slack] = 0
            held = violation <= 0
            rooted = [r for r in self.rows if r.rooted]
            violation[~held] += 1.0 if rooted else 0.0
            value = np.full(x.shape[1], NOWHERE**6)
            if np.any(held):
                few = self.values(x[:, held])
                a = self.coefficients(few, int(held.sum()))
                exist = np.all(np.isfinite(a), axis=1) & (a[:, 0] != 0)
                if rooted or self.about_roots:
                    few = few.with_known(dict(zip(_ROOTS, root_values(eigenvalues(a)), strict=True)))
                worst = np.where(exist, 0.0, NOWHERE)
                for row in rooted:
                    worst = np.maximum(worst, row.excess(few))
                found = self.sign * np.broadcast_to(evaluated(self.objective, few), worst.shape)
                worst = np.where(np.isfinite(found), worst, NOWHERE)
                violation[held], value[held] = np.where(worst <= slack, 0.0, worst), found
        return Worth(np.where(np.isfinite(value), value, NOWHERE**6), violation)


def _row(text: str, names: tuple[str, ...]) -> Row:
    left, comparison, right = sides(text)
    codes = [compile(t, text, "eval") for t in (left, right, difference(text))]
    return Row(text, codes[0], comparison, codes[1], codes[2], _about(names))


def _about(names: tuple[str, ...]) -> bool:
    return not {*_ROOTS}.isdisjoint(names)


@dataclass(frozen=True)
class Exactly:
    """What one design is worth for roots that are known exactly.

    Attributes:
        value: the objective in the problem's own sense.
        violation: largest, of constraints and box.
    """

    value: float
    violation: float
    roots: Roots


def exactly(problem: Problem, design: Mapping[str, float]) -> Iterator[Exactly]:
    """Of a design as stored, by isolated roots and quantities of 120 digits; then of the multiple roots it rounds."""
    at = Designs(problem)
    x = np.array([float(design[n]) for n in at.names])
    box = max(
        (max(lo - v, v - hi, 0.0) / max(1.0, abs(v)) for v, lo, hi in zip(x, at.lower, at.upper, strict=True)),
        default=0.0,
    )
    try:
        for z in near_roots(problem, design):
            with flint.ctx.workdps(DIGITS):
                known = {n: flint.arb(float(found)) for n, found in zip(_ROOTS, root_values(z), strict=True)}
                values = stored_values(problem, design).with_known(known)
                worst = max((float(r.excess(values)) for r in at.rows), default=0.0)
                value = float(evaluated(at.objective, values))
            yield Exactly(value, max(worst, box) if np.isfinite(value) else NOWHERE, z)
    except (ZeroDivisionError, ValueError, OverflowError):
        yield Exactly(float("nan"), NOWHERE, np.array([]))
