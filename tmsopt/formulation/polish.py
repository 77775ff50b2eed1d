"""From IPOPT's accuracy to machine precision: Newton's method on the optimality conditions of a known active set."""

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from tmsopt.formulation.ipopt import Run
from tmsopt.formulation.nlp import NLP
from tmsopt.records import Array

_STEPS = 12
_STATIONARY = 1e-9
_SINGULAR = 1e11  # size of a solution, for a right side of size 1, that betrays a singular matrix
_ROUNDINGS = 32 * float(np.finfo(float).eps)  # shifts of high degrees are sums of sums
_ACTIVE = 1e-5  # slack below which a bound may be active although its multiplier is nearly 0


@dataclass(frozen=True)
class Point:
    """A point of an NLP with what decides its rank.

    Attributes:
        violation: largest violation of a row or bound, absolute.
        stationarity: largest component of the gradient of the Lagrangian.
        rounding: what the terms of the rows leave of a violation that is 0.
    """

    x: Array
    objective: float
    violation: float
    stationarity: float
    row_multipliers: Array
    bound_multipliers: Array
    rounding: float = 0.0


def polisher(nlp: NLP) -> Callable[[Run, NLP], Point]:
    """A function that refines runs of one NLP under given limits; the better of refined and raw point is returned."""
    x = ca.SX.sym("x", len(nlp.variables))
    multipliers = ca.SX.sym("m", len(nlp.rows))
    p = ca.SX.sym("p", len(nlp.settings))
    f, g = nlp.at(x, p)
    hessian = ca.hessian(f + ca.dot(multipliers, g), x)[0]
    expand = ca.Function("kkt", [x, multipliers, p], [f, ca.gradient(f, x), g, ca.jacobian(g, x), hessian])

    def polish(run: Run, limits: NLP) -> Point:
        ends = (np.array(e) for e in (limits.lower, limits.upper, limits.row_lower, limits.row_upper))
        return _polished(_Conditions(expand, limits.settings, *ends), run)

    return polish


@dataclass(frozen=True)
class _Conditions:
    """The optimality conditions of one NLP: its functions with derivatives, and its limits."""

    expand: ca.Function
    settings: tuple[float, ...]
    lower: Array
    upper: Array
    row_lower: Array
    row_upper: Array

    def at(self, x: Array, rows: Array) -> tuple[float, Array, Array, Array, Array]:
        """Objective, its gradient, rows, their Jacobian, and the Hessian of the Lagrangian."""
        f, gradient, g, jacobian, hessian = (np.array(part) for part in self.expand(x, rows, self.settings))
        return float(f.item()), gradient.ravel(), g.ravel(), jacobian, hessian

    def point(self, x: Array, rows: Array, bounds: Array) -> Point:
        """A point with its violation and stationarity."""
        objective, gradient, g, jacobian, _ = self.at(x, rows)
        outside = np.concatenate([self.row_lower - g, g - self.row_upper, self.lower - x, x - self.upper, [0.0]])
        violation = float(outside.max()) if np.all(np.isfinite(g)) else np.inf
        slope = np.abs(gradient + jacobian.T @ rows + bounds).max(initial=0.0)
        terms = float((np.abs(jacobian) @ np.abs(x)).max(initial=0.0))
        return Point(x, objective, violation, float(slope), rows, bounds, _ROUNDINGS * terms)


def _polished(conditions: _Conditions, run: Run) -> Point:
    best = conditions.point(run.x, run.row_multipliers, run.bound_multipliers)
    for loose in (False, True):
        refined = _newton(conditions, run, loose)
        if refined is not None and _better(refined, best):
            best = refined
        if best is refined and best.stationarity <= _STATIONARY:
            break
    pulling = _pulling(conditions, best)
    if pulling.any():
        freed = _newton(conditions, run, True, pulling)
        if freed is not None and _better(freed, best) and not _pulling(conditions, freed).any():
            best = freed if freed.stationarity <= _STATIONARY else best
    return best


def _pulling(conditions: _Conditions, point: Point) -> NDArray[np.bool_]:
    """Rows held at a limit although their multiplier pulls away from it: at two limits so close that both were held."""
    small = _STATIONARY * (1 + np.abs(point.row_multipliers).max(initial=0.0))
    below = np.isinf(conditions.row_upper) & (point.row_multipliers > small)
    return np.asarray(below | (np.isinf(conditions.row_lower) & (point.row_multipliers < -small)))


def _newton(conditions: _Conditions, run: Run, loose: bool, freed: NDArray[np.bool_] | bool = False) -> Point | None:
    """Newton's method with the active limits held as equations; least squares where they are dependent.

    Rows that are `freed` are not held.
    """
    lower, upper = conditions.lower, conditions.upper
    at_lower, at_upper = _active(run.x, lower, upper, run.bound_multipliers, loose)
    x = np.where(at_lower, lower, np.where(at_upper, upper, run.x))
    free = np.logical_not(np.logical_or(at_lower, at_upper))
    g = conditions.at(x, run.row_multipliers)[2]
    if not np.all(np.isfinite(g)):
        return None
    low, high = _active(g, conditions.row_lower, conditions.row_upper, run.row_multipliers, loose)
    held = np.logical_or(low, high) & ~np.asarray(freed)
    target = np.where(low, conditions.row_lower, conditions.row_upper)[held]
    rows = np.where(held, run.row_multipliers, 0.0)
    n, m = int(free.sum()), int(held.sum())
    for _ in range(_STEPS):
        _, gradient, g, jacobian, hessian = conditions.at(x, rows)
        active = jacobian[np.ix_(held, free)]
        matrix = np.block([[hessian[np.ix_(free, free)], active.T], [active, np.zeros((m, m))]])
        right = np.concatenate([-gradient[free], target - g[held]])
        if not (np.all(np.isfinite(matrix)) and np.all(np.isfinite(right))):
            return None
        scale = 1 / np.maximum(np.abs(matrix).max(axis=1, initial=0.0), 1e-300)
        solution = _solved(matrix * scale[:, None], right * scale)
        x = x.copy()
        x[free] += solution[:n]
        rows = np.zeros_like(rows)
        rows[held] = solution[n:]
        if np.all(np.abs(solution[:n]) <= 1e-16 * (1 + np.abs(x[free]))):
            break
    if not np.all(np.isfinite(x)):
        return None
    x = np.clip(x, lower, upper)
    _, gradient, _, jacobian, _ = conditions.at(x, rows)
    return conditions.point(x, rows, np.where(free, 0.0, -(gradient + jacobian.T @ rows)))


def _solved(matrix: Array, right: Array) -> Array:
    """Solution of a linear system; the shortest of least squares where it is singular, which takes 20 times as long.

    What the matrix makes of arbitrary right sides shows how singular it is.
    """
    probes = np.random.default_rng(0).standard_normal((len(right), 2))
    try:
        solved = np.linalg.solve(matrix, np.column_stack([right, probes]))
    except np.linalg.LinAlgError:
        solved = np.full((len(right), 3), np.nan)
    if np.all(np.isfinite(solved)) and np.abs(solved[:, 1:]).max(initial=0.0) <= _SINGULAR:
        return np.asarray(solved[:, 0])
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=1e-13)[0])


def _active(value: Array, lower: Array, upper: Array, multiplier: Array, loose: bool) -> tuple[Array, Array]:
    """Which lower and upper limits hold with equality: at an optimum either the slack or the multiplier is tiny."""
    threshold = _ACTIVE * (1 + np.abs(value))
    if loose:
        at_lower, at_upper = value - lower <= threshold, upper - value <= threshold
    else:
        at_lower = (value - lower <= -multiplier) & (multiplier < 0)
        at_upper = (upper - value <= multiplier) & (multiplier > 0)
        at_lower &= value - lower <= 100 * threshold
        at_upper &= upper - value <= 100 * threshold
    at_lower = at_lower | (lower == upper)
    return at_lower, at_upper & ~at_lower


def _better(refined: Point, raw: Point) -> bool:
    """A refined point counts when it is as feasible, and no worse than rounding and feasibility explain."""
    scale = 1 + abs(raw.objective)
    return (
        refined.violation <= max(raw.violation, 1e-14 * scale, refined.rounding)
        and refined.objective <= raw.objective + 1e-7 * scale
        and np.abs(refined.x - raw.x).max(initial=0.0) <= 1e-2 * (1 + np.abs(raw.x).max(initial=0.0))
    )
