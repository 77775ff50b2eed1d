"""From IPOPT's accuracy to machine precision: Newton's method on the optimality conditions of a known active set."""

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from tmsopt.design.formulations import NLP
from tmsopt.design.ipopt import Run

Array = NDArray[np.float64]

_STEPS = 12
_STATIONARY = 1e-9
_ACTIVE = 1e-5  # slack below which a bound may be active although its multiplier is nearly 0


@dataclass(frozen=True)
class Point:
    """A point of an NLP with what decides its rank.

    Attributes:
        violation: largest violation of a row or bound, absolute.
        stationarity: largest component of the gradient of the Lagrangian.
    """

    x: Array
    objective: float
    violation: float
    stationarity: float
    row_multipliers: Array
    bound_multipliers: Array


def polisher(nlp: NLP) -> Callable[[Run], Point]:
    """A function that refines runs of one NLP; the better of the refined and the raw point is returned."""
    x = ca.SX.sym("x", len(nlp.variables))
    multipliers = ca.SX.sym("m", len(nlp.rows))
    f, g = nlp.functions(x)
    lagrangian = f + ca.dot(multipliers, g)
    expand = ca.Function(
        "kkt", [x, multipliers], [f, ca.gradient(f, x), g, ca.jacobian(g, x), ca.hessian(lagrangian, x)[0]]
    )
    lower, upper = np.array(nlp.lower), np.array(nlp.upper)
    row_lower, row_upper = np.array(nlp.row_lower), np.array(nlp.row_upper)

    def evaluate(x: Array, rows: Array, bounds: Array) -> Point:
        f, gradient, g, jacobian, _ = (np.array(part) for part in expand(x, rows))
        g = g.ravel()
        outside = np.concatenate([row_lower - g, g - row_upper, lower - x, x - upper, [0.0]])
        stationarity = gradient.ravel() + jacobian.T @ rows + bounds
        violation = float(outside.max()) if np.all(np.isfinite(g)) else np.inf
        return Point(x, float(f.item()), violation, float(np.abs(stationarity).max(initial=0.0)), rows, bounds)

    def newton(run: Run, loose: bool) -> Point | None:
        at_lower, at_upper = _active(run.x, lower, upper, run.bound_multipliers, loose)
        x = np.where(at_lower, lower, np.where(at_upper, upper, run.x))
        free = np.logical_not(np.logical_or(at_lower, at_upper))
        g = np.array(expand(x, run.row_multipliers)[2]).ravel()
        if not np.all(np.isfinite(g)):
            return None
        row_at_lower, row_at_upper = _active(g, row_lower, row_upper, run.row_multipliers, loose)
        rows = np.logical_or(row_at_lower, row_at_upper)
        target = np.where(row_at_lower, row_lower, row_upper)[rows]
        dual = np.where(rows, run.row_multipliers, 0.0)
        n, m = int(free.sum()), int(rows.sum())
        for _ in range(_STEPS):
            _, gradient, g, jacobian, hessian = (np.array(part) for part in expand(x, dual))
            active = jacobian[np.ix_(rows, free)]
            matrix = np.block([[hessian[np.ix_(free, free)], active.T], [active, np.zeros((m, m))]])
            right = np.concatenate([-gradient.ravel()[free], target - g.ravel()[rows]])
            if not (np.all(np.isfinite(matrix)) and np.all(np.isfinite(right))):
                return None
            scale = 1 / np.maximum(np.abs(matrix).max(axis=1, initial=0.0), 1e-300)
            solution = np.linalg.lstsq(matrix * scale[:, None], right * scale, rcond=1e-13)[0]
            x = x.copy()
            x[free] += solution[:n]
            dual = np.where(rows, 0.0, 0.0)
            dual[rows] = solution[n:]
            if np.all(np.abs(solution[:n]) <= 1e-16 * (1 + np.abs(x[free]))):
                break
        if not np.all(np.isfinite(x)):
            return None
        x = np.clip(x, lower, upper)
        _, gradient, _, jacobian, _ = (np.array(part) for part in expand(x, dual))
        bounds = np.where(free, 0.0, -(gradient.ravel() + jacobian.T @ dual))
        return evaluate(x, dual, bounds)

    def polish(run: Run) -> Point:
        best = evaluate(run.x, run.row_multipliers, run.bound_multipliers)
        for loose in (False, True):
            refined = newton(run, loose)
            if refined is not None and _better(refined, best):
                best = refined
            if best is refined and best.stationarity <= _STATIONARY:
                break
        return best

    return polish


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
        refined.violation <= max(raw.violation, 1e-14 * scale)
        and refined.objective <= raw.objective + 1e-7 * scale
        and np.abs(refined.x - raw.x).max(initial=0.0) <= 1e-2 * (1 + np.abs(raw.x).max(initial=0.0))
    )
