"""The one place that calls IPOPT, and Newton's method from its accuracy to machine precision.

Newton solves the optimality conditions of the active set that IPOPT found.
"""

import signal
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from tmsopt.program.nlp import NLP, Compiled, forget_formulas
from tmsopt.program.options import DEFAULTS, Options
from tmsopt.records import Array

# Larger steps away from the bounds and shorter ones towards them: on the EP4 problem this takes a third fewer
# iterations and reaches EP4 from more of the starts. Scaling and refining linear systems of a dozen unknowns costs
# a quarter of the time and changes no result.
_QUICK = {"min_refinement_steps": 0, "linear_system_scaling": "none"}
_FAR = {"bound_push": 0.1, "bound_frac": 0.1, "tau_min": 0.9, **_QUICK}
_NEAR = {"bound_push": 1e-9, "bound_frac": 1e-9, "mu_init": 1e-6, **_QUICK}
# A start that satisfies the equations of many cases is worth keeping to: with the barrier of far starts IPOPT
# throws that away, and half as many starts of band designs end at the best optimum.
_EXACT = {"bound_push": 1e-9, "bound_frac": 1e-9, "mu_init": 1e-4, **_QUICK}
_SETTINGS = {
    name: {f"ipopt.{option}": value for option, value in own.items()}
    for name, own in {"far": _FAR, "exact": _EXACT, "near": _NEAR}.items()
}

_SIGNALS = [getattr(signal, n) for n in ("SIGINT", "SIGTERM", "SIGHUP", "SIGALRM") if hasattr(signal, n)]
_STEPS = 12
_STALLED = 1e-14  # relative step of Newton's method, below which it ends once the steps no longer shrink
_STATIONARY = 1e-9
_DEPENDENT = 1e-9  # singular value of gradients of length 1 below which limits are dependent
_SINGULAR = 1e11  # size of a solution, for a right side of size 1, that betrays a singular matrix
_ROUNDINGS = 32 * float(np.finfo(float).eps)  # shifts of high degrees are sums of sums
_ACTIVE = 1e-5  # slack below which a bound may be active although its multiplier is nearly 0


@dataclass(frozen=True)
class Run:
    """What one run of IPOPT returned; a claim, to be rechecked.

    Attributes:
        x: variables of the NLP.
        row_multipliers, bound_multipliers: λ in ∇f + Jᵀ λ_rows + λ_bounds = 0.
        status: IPOPT's own word.
    """

    x: Array
    row_multipliers: Array
    bound_multipliers: Array
    status: str


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


def ipopt(nlp: NLP, options: Options = DEFAULTS, start: str = "far", max_iterations: int = 150) -> Callable[..., Run]:
    """A solver of one NLP: start, and other limits if wanted → run.

    `start` says what to expect of starts: ``far`` from a solution, ``exact`` in the equations, or ``near`` a solution.

    Not to be shared between threads.
    """
    unit = (*nlp.units, *[1.0] * (len(nlp.variables) - len(nlp.units)))
    asked = (("ipopt.linear_solver", options.linear_solver), ("ipopt.max_iter", max_iterations))
    solver = _SOLVERS.of(nlp.compiled, unit, 1 / nlp.objective_unit, (*asked, *_SETTINGS[start].items()))

    def run(x0: Array, limits: NLP = nlp) -> Run:
        lower, upper = np.array(limits.lower), np.array(limits.upper)
        first, *ends = (
            (column / np.array(unit)).tolist() for column in (x0, lower, upper)
        )  # quicker in CasADi than arrays
        rows = {"lbg": limits.row_lower, "ubg": limits.row_upper}
        with interruptible():
            answer = solver(x0=first, p=limits.constants, lbx=ends[0], ubx=ends[1], **rows)
        stats = solver.stats()
        return Run(
            x=np.clip(answer["x"].full().ravel() * np.array(unit), lower, upper),
            row_multipliers=answer["lam_g"].full().ravel(),
            bound_multipliers=answer["lam_x"].full().ravel() / np.array(unit),
            status=str(stats["return_status"]),
        )

    return run


def _solver(
    compiled: Compiled, unit: tuple[float, ...], objective: float, asked: tuple[tuple[str, Any], ...]
) -> ca.Function:
    """IPOPT on compiled functions, whose variables it moves in units."""
    settings: dict[str, Any] = {
        "print_time": False,
        "show_eval_warnings": False,
        "no_nlp_grad": True,
        "calc_lam_p": False,
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.tol": 1e-12,
        "ipopt.bound_relax_factor": 0.0,
        "ipopt.obj_scaling_factor": objective,
        **dict(asked),
    }
    if set(unit) <= {1.0}:
        return ca.nlpsol("solver", "ipopt", compiled.function, {**settings, **compiled.derivatives})
    x, p, _ = compiled.symbols
    stated = ca.Function("nlp", [x, p], list(compiled.function(x * ca.DM(unit), p)), ["x", "p"], ["f", "g"])
    return ca.nlpsol("solver", "ipopt", stated, settings)


def _conditions(compiled: Compiled) -> ca.Function:
    """Objective, its gradient, rows, their Jacobian, and the Hessian of the Lagrangian."""
    x, p, rows = compiled.symbols
    first = [e for name in ("grad_f", "jac_g") for e in compiled.derivatives[name](x, p)]
    hessian = ca.triu2symm(compiled.derivatives["hess_lag"](x, p, 1, rows))
    return ca.Function("kkt", [x, rows, p], [*first, hessian])


class PerThread(threading.local):
    """What a function makes of the last few arguments, for each thread: a solver must not be used from two."""

    def __init__(self, make: Callable[..., ca.Function], most: int = 32) -> None:
        self.of = lru_cache(maxsize=most)(make)


_SOLVERS, _CONDITIONS = PerThread(_solver, 96), PerThread(_conditions)


def forget() -> None:
    """Compile everything anew from now on, in this thread."""
    for made in (_SOLVERS, _CONDITIONS):
        made.of.cache_clear()
    forget_formulas()


def polisher(nlp: NLP) -> Callable[[Run, NLP], Point]:
    """A function that refines runs of one NLP under given limits; the better of refined and raw point is returned."""
    expand = _CONDITIONS.of(nlp.compiled)

    def polish(run: Run, limits: NLP) -> Point:
        ends = (np.array(e) for e in (limits.lower, limits.upper, limits.row_lower, limits.row_upper))
        with np.errstate(over="ignore", invalid="ignore"):  # what overflows is not better
            return _polished(_Conditions(expand, limits.constants, *ends), run)

    return polish


def gains(nlp: NLP, point: Point) -> Callable[[Sequence[int]], float]:
    """What relaxing some limits at once buys to first order: limits → the sum of their multipliers.

    Where limits are dependent, many multipliers explain the gradient; it is the least sum that they can have (Gauvin
    and Dubeau, 1982).

    Returns:
        Takes indices of inequalities: of rows, and beyond them of variables.
    """
    own = np.concatenate([point.row_multipliers, point.bound_multipliers])
    held = np.abs(own) > _STATIONARY * (1 + np.abs(own).max(initial=0.0))
    _, slope, rows, jacobian = (
        part.full() for name in ("grad_f", "jac_g") for part in nlp.compiled.derivatives[name](point.x, nlp.constants)
    )
    columns = np.hstack([jacobian.T, np.eye(len(point.x))])[:, held]
    lengths = np.linalg.norm(columns, axis=0)
    known = np.all(np.isfinite(lengths) & (lengths > 0))
    dependent = known and np.linalg.matrix_rank(columns / lengths, tol=_DEPENDENT) < len(lengths)
    lower, upper = np.array([*nlp.row_lower, *nlp.lower]), np.array([*nlp.row_upper, *nlp.upper])
    value = np.concatenate([rows.ravel(), point.x])
    signs = np.where(value - lower <= upper - value, -1.0, 1.0)  # of multipliers at a lower and at an upper limit
    free = (lower == upper)[held]

    def gain(limits: Sequence[int]) -> float:
        if dependent:
            from scipy.optimize import linprog  # a quarter of a second, paid only where multipliers are in question

            asked = np.isin(np.arange(len(own)), limits)[held] * signs[held]
            least = np.where(free | (signs[held] < 0), -np.inf, 0.0).tolist()
            most = np.where(free | (signs[held] > 0), np.inf, 0.0).tolist()
            found = linprog(asked, A_eq=columns, b_eq=-slope.ravel(), bounds=list(zip(least, most, strict=True)))
            if found.success and found.fun is not None:
                return float(found.fun)
        return float(np.abs(own[limits]).sum())

    return gain


@contextmanager
def interruptible() -> Iterator[None]:
    """Call handlers of signals once IPOPT is done: CasADi takes what they raise for a failed evaluation and goes on.

    Only in the main thread, which alone hears signals.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    heard: list[int] = []
    found = ((number, signal.getsignal(number)) for number in _SIGNALS)
    handlers = {int(number): handler for number, handler in found if callable(handler)}
    for number in handlers:
        signal.signal(number, lambda number, frame: heard.append(number))
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
    _deliver(heard, handlers)


def _deliver(heard: list[int], handlers: Mapping[int, Any]) -> None:
    """The first one, and those after it whatever that raises."""
    if heard:
        try:
            handlers[heard[0]](heard[0], None)
        finally:
            _deliver(heard[1:], handlers)


@dataclass(frozen=True)
class _Conditions:
    """The optimality conditions of one NLP: its functions with derivatives, and its limits."""

    expand: ca.Function
    constants: Sequence[float]
    lower: Array
    upper: Array
    row_lower: Array
    row_upper: Array

    def at(self, x: Array, rows: Array) -> tuple[float, Array, Array, Array, Array]:
        """Objective, its gradient, rows, their Jacobian, and the Hessian of the Lagrangian."""
        every = self.expand(x.tolist(), rows.tolist(), self.constants)
        f, gradient, g, jacobian, hessian = [part.full() for part in every]
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
    n, m, last = int(free.sum()), int(held.sum()), np.inf
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
        size = np.abs(solution[:n] / (1 + np.abs(x[free]))).max(initial=0.0)
        if size <= _STALLED and size > last / 2:  # rounding alone is left
            break
        last = size
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
