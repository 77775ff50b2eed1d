"""Calls IPOPT, and refines its result to machine precision by Newton's method.

No other module calls IPOPT. Newton's method solves the optimality conditions of the active set that IPOPT found.
"""

import signal
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from tmsopt.program.nlp import NLP, CompiledProgram, PerThread, forget_programs
from tmsopt.program.options import DEFAULTS, Options
from tmsopt.records import Array

# With larger steps away from the bounds and shorter steps towards them, the EP4 problem takes a third fewer iterations
# and reaches EP4 from more starts. Scaling and refining the small linear systems would cost a quarter of the time and
# change no result.
_NO_SCALING = {"min_refinement_steps": 0, "linear_system_scaling": "none"}
_FAR_SETTINGS = {"bound_push": 0.1, "bound_frac": 0.1, "tau_min": 0.9, **_NO_SCALING}
_NEAR_SETTINGS = {"bound_push": 1e-9, "bound_frac": 1e-9, "mu_init": 1e-6, **_NO_SCALING}
# With the settings for far starts, IPOPT would leave a start that satisfies the equations of many cases. Then only half
# as many starts of band designs would reach the best optimum.
_EXACT_SETTINGS = {"bound_push": 1e-9, "bound_frac": 1e-9, "mu_init": 1e-4, **_NO_SCALING}
_SETTINGS = {
    name: {f"ipopt.{option}": value for option, value in settings.items()}
    for name, settings in {"far": _FAR_SETTINGS, "exact": _EXACT_SETTINGS, "near": _NEAR_SETTINGS}.items()
}
"""Kind of a start → options of IPOPT."""

_SIGNALS = [getattr(signal, n) for n in ("SIGINT", "SIGTERM", "SIGHUP", "SIGALRM") if hasattr(signal, n)]
_MAX_NEWTON_STEPS = 12  # greatest number of steps of Newton's method
_STALLED_STEP = 1e-14  # Newton's method ends when relative steps below this no longer become smaller
_MAX_STATIONARITY = 1e-9  # largest gradient of the Lagrangian that counts as 0
_DEPENDENCE_TOLERANCE = 1e-9  # limits are dependent if a singular value of their unit gradients is smaller
_MAX_SOLUTION = 1e11  # a matrix is singular if a right-hand side of size 1 has a larger solution
# Relative rounding error of a row; it is large, because shifted polynomials of high degree are sums of sums.
_ROUNDING = 32 * float(np.finfo(float).eps)
_ACTIVE_SLACK = 1e-5  # slack below which a bound may be active even with a multiplier near 0


@dataclass(frozen=True)
class Run:
    """The result of one run of IPOPT, not yet checked.

    Attributes:
        x: variables of the NLP.
        row_multipliers, bound_multipliers: λ in ∇f + Jᵀ λ_rows + λ_bounds = 0.
        status: the return status of IPOPT.
    """

    x: Array
    row_multipliers: Array
    bound_multipliers: Array
    status: str


@dataclass(frozen=True)
class Point:
    """A point of an NLP with the measures that rank it.

    Attributes:
        violation: largest absolute violation of a row or bound.
        stationarity: largest component of the gradient of the Lagrangian.
        rounding: violation that rounding errors of the rows can cause.
    """

    x: Array
    objective: float
    violation: float
    stationarity: float
    row_multipliers: Array
    bound_multipliers: Array
    rounding: float = 0.0


def make_ipopt(
    nlp: NLP, options: Options = DEFAULTS, start_kind: str = "far", max_iterations: int = 150
) -> Callable[..., Run]:
    """A solver of one NLP: (start, optionally an NLP with other limits) → run. Do not share it between threads.

    Args:
        start_kind: ``far`` from a solution, ``near`` a solution, or ``exact`` if the equations of all cases hold.
    """
    units = (*nlp.units, *[1.0] * (len(nlp.variables) - len(nlp.units)))
    settings = (("ipopt.linear_solver", options.linear_solver), ("ipopt.max_iter", max_iterations))
    solver = _SOLVERS.get(nlp.program, units, 1 / nlp.objective_unit, (*settings, *_SETTINGS[start_kind].items()))

    def run(x0: Array, limits: NLP = nlp) -> Run:
        lower, upper = np.array(limits.lower), np.array(limits.upper)
        start, lbx, ubx = ((column / np.array(units)).tolist() for column in (x0, lower, upper))  # lists are faster
        rows = {"lbg": limits.row_lower, "ubg": limits.row_upper}
        with delay_signals():
            answer = solver(x0=start, p=limits.constants, lbx=lbx, ubx=ubx, **rows)
        stats = solver.stats()
        return Run(
            x=np.clip(answer["x"].full().ravel() * np.array(units), lower, upper),
            row_multipliers=answer["lam_g"].full().ravel(),
            bound_multipliers=answer["lam_x"].full().ravel() / np.array(units),
            status=str(stats["return_status"]),
        )

    return run


def _solver(
    program: CompiledProgram, units: tuple[float, ...], objective_scale: float, settings: tuple[tuple[str, Any], ...]
) -> ca.Function:
    """IPOPT on a compiled program, with the variables in the given units."""
    all_settings: dict[str, Any] = {
        "print_time": False,
        "show_eval_warnings": False,
        "no_nlp_grad": True,
        "calc_lam_p": False,
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.tol": 1e-12,
        "ipopt.bound_relax_factor": 0.0,
        "ipopt.obj_scaling_factor": objective_scale,
        **dict(settings),
    }
    if set(units) <= {1.0}:
        return ca.nlpsol("solver", "ipopt", program.function, {**all_settings, **program.derivatives})
    x, p, _ = program.symbols
    in_units = ca.Function("nlp", [x, p], list(program.function(x * ca.DM(units), p)), ["x", "p"], ["f", "g"])
    return ca.nlpsol("solver", "ipopt", in_units, all_settings)


def _conditions(program: CompiledProgram) -> ca.Function:
    """Objective, its gradient, rows, their Jacobian, and the Hessian of the Lagrangian."""
    x, p, rows = program.symbols
    first_derivatives = [e for name in ("grad_f", "jac_g") for e in program.derivatives[name](x, p)]
    hessian = ca.triu2symm(program.derivatives["hess_lag"](x, p, 1, rows))
    return ca.Function("kkt", [x, rows, p], [*first_derivatives, hessian])


_SOLVERS, _CONDITIONS = PerThread(_solver, 96), PerThread(_conditions, 32)


def forget_solvers() -> None:
    """Drop every compiled program and solver of this thread."""
    for cache in (_SOLVERS, _CONDITIONS):
        cache.get.cache_clear()
    forget_programs()


def make_polisher(nlp: NLP) -> Callable[[Run, NLP], Point]:
    """A function (run, limits) → the refined point, or the point of the run itself if it is better."""
    expand = _CONDITIONS.get(nlp.program)

    def polish(run: Run, limits: NLP) -> Point:
        ends = (np.array(e) for e in (limits.lower, limits.upper, limits.row_lower, limits.row_upper))
        with np.errstate(over="ignore", invalid="ignore"):
            return _polish(_Conditions(expand, limits.constants, *ends), run)

    return polish


def relaxation_gain(nlp: NLP, point: Point) -> Callable[[Sequence[int]], float]:
    """A function for the first-order gain of the objective if several limits are relaxed at once.

    The gain is the sum of the multipliers of these limits. If the active limits are dependent, several sets of
    multipliers explain the gradient; the gain is then the least sum (Gauvin and Dubeau, 1982).

    Returns:
        A function of indices of inequalities: rows first, then variables.
    """
    multipliers = np.concatenate([point.row_multipliers, point.bound_multipliers])
    is_active = np.abs(multipliers) > _MAX_STATIONARITY * (1 + np.abs(multipliers).max(initial=0.0))
    _, slope, rows, jacobian = (
        part.full() for name in ("grad_f", "jac_g") for part in nlp.program.derivatives[name](point.x, nlp.constants)
    )
    columns = np.hstack([jacobian.T, np.eye(len(point.x))])[:, is_active]
    lengths = np.linalg.norm(columns, axis=0)
    is_usable = np.all(np.isfinite(lengths) & (lengths > 0))
    are_dependent = is_usable and np.linalg.matrix_rank(columns / lengths, tol=_DEPENDENCE_TOLERANCE) < len(lengths)
    lower, upper = np.array([*nlp.row_lower, *nlp.lower]), np.array([*nlp.row_upper, *nlp.upper])
    value = np.concatenate([rows.ravel(), point.x])
    signs = np.where(value - lower <= upper - value, -1.0, 1.0)  # sign of a multiplier at a lower and at an upper limit
    is_equation = (lower == upper)[is_active]

    def gain(limits: Sequence[int]) -> float:
        if are_dependent:
            from scipy.optimize import linprog  # importing it takes 0.25 s

            cost = np.isin(np.arange(len(multipliers)), limits)[is_active] * signs[is_active]
            lower_bounds = np.where(is_equation | (signs[is_active] < 0), -np.inf, 0.0).tolist()
            upper_bounds = np.where(is_equation | (signs[is_active] > 0), np.inf, 0.0).tolist()
            solution = linprog(
                cost, A_eq=columns, b_eq=-slope.ravel(), bounds=list(zip(lower_bounds, upper_bounds, strict=True))
            )
            if solution.success and solution.fun is not None:
                return float(solution.fun)
        return float(np.abs(multipliers[limits]).sum())

    return gain


@contextmanager
def delay_signals() -> Iterator[None]:
    """Delay signal handlers until IPOPT has returned, because CasADi takes their exceptions for failed evaluations.

    Only the main thread receives signals; in other threads this function does nothing.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers: list[int] = []
    installed = ((number, signal.getsignal(number)) for number in _SIGNALS)
    handlers = {int(number): handler for number, handler in installed if callable(handler)}
    for number in handlers:
        signal.signal(number, lambda number, frame: numbers.append(number))
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
    _call_handlers(numbers, handlers)


def _call_handlers(received: list[int], handlers: Mapping[int, Any]) -> None:
    """Call the handler of each signal in turn, even if one raises."""
    if received:
        try:
            handlers[received[0]](received[0], None)
        finally:
            _call_handlers(received[1:], handlers)


@dataclass(frozen=True)
class _Conditions:
    """The optimality conditions of one NLP: its functions, their derivatives, and its limits."""

    expand: ca.Function
    constants: Sequence[float]
    lower: Array
    upper: Array
    row_lower: Array
    row_upper: Array

    def evaluate(self, x: Array, rows: Array) -> tuple[float, Array, Array, Array, Array]:
        """Objective, gradient, rows, Jacobian, and Hessian of the Lagrangian."""
        outputs = self.expand(x.tolist(), rows.tolist(), self.constants)
        f, gradient, g, jacobian, hessian = [part.full() for part in outputs]
        return float(f.item()), gradient.ravel(), g.ravel(), jacobian, hessian

    def point(self, x: Array, rows: Array, bounds: Array) -> Point:
        """A point with its violation and stationarity."""
        objective, gradient, g, jacobian, _ = self.evaluate(x, rows)
        excesses = np.concatenate([self.row_lower - g, g - self.row_upper, self.lower - x, x - self.upper, [0.0]])
        violation = float(excesses.max()) if np.all(np.isfinite(g)) else np.inf
        slope = np.abs(gradient + jacobian.T @ rows + bounds).max(initial=0.0)
        terms = float((np.abs(jacobian) @ np.abs(x)).max(initial=0.0))
        return Point(x, objective, violation, float(slope), rows, bounds, _ROUNDING * terms)


def _polish(conditions: _Conditions, run: Run) -> Point:
    best = conditions.point(run.x, run.row_multipliers, run.bound_multipliers)
    for by_slack in (False, True):
        refined = _newton(conditions, run, by_slack)
        if refined is not None and _is_better(refined, best):
            best = refined
        if best is refined and best.stationarity <= _MAX_STATIONARITY:
            break
    released_rows = _find_releasable_rows(conditions, best)
    if released_rows.any():
        refined = _newton(conditions, run, True, released_rows)
        if refined is not None and _is_better(refined, best) and not _find_releasable_rows(conditions, refined).any():
            best = refined if refined.stationarity <= _MAX_STATIONARITY else best
    return best


def _find_releasable_rows(conditions: _Conditions, point: Point) -> NDArray[np.bool_]:
    """Rows that are held at a limit with a multiplier of the wrong sign, for example if two limits nearly coincide."""
    tolerance = _MAX_STATIONARITY * (1 + np.abs(point.row_multipliers).max(initial=0.0))
    is_below = np.isinf(conditions.row_upper) & (point.row_multipliers > tolerance)
    return np.asarray(is_below | (np.isinf(conditions.row_lower) & (point.row_multipliers < -tolerance)))


def _newton(
    conditions: _Conditions, run: Run, by_slack: bool, released_rows: NDArray[np.bool_] | bool = False
) -> Point | None:
    """Newton's method with the active limits as equations, solved by least squares if the limits are dependent.

    Args:
        by_slack: whether a small slack is enough to make a limit active; see `_find_active`.
        released_rows: rows that are not held, even if they are active.
    """
    lower, upper = conditions.lower, conditions.upper
    at_lower, at_upper = _find_active(run.x, lower, upper, run.bound_multipliers, by_slack)
    x = np.where(at_lower, lower, np.where(at_upper, upper, run.x))
    is_free = np.logical_not(np.logical_or(at_lower, at_upper))
    g = conditions.evaluate(x, run.row_multipliers)[2]
    if not np.all(np.isfinite(g)):
        return None
    at_low, at_high = _find_active(g, conditions.row_lower, conditions.row_upper, run.row_multipliers, by_slack)
    active_rows = np.logical_or(at_low, at_high) & ~np.asarray(released_rows)
    target = np.where(at_low, conditions.row_lower, conditions.row_upper)[active_rows]
    rows = np.where(active_rows, run.row_multipliers, 0.0)
    n, m, last_size = int(is_free.sum()), int(active_rows.sum()), np.inf
    for _ in range(_MAX_NEWTON_STEPS):
        _, gradient, g, jacobian, hessian = conditions.evaluate(x, rows)
        active = jacobian[np.ix_(active_rows, is_free)]
        matrix = np.block([[hessian[np.ix_(is_free, is_free)], active.T], [active, np.zeros((m, m))]])
        right = np.concatenate([-gradient[is_free], target - g[active_rows]])
        if not (np.all(np.isfinite(matrix)) and np.all(np.isfinite(right))):
            return None
        scale = 1 / np.maximum(np.abs(matrix).max(axis=1, initial=0.0), 1e-300)
        solution = _solve_linear(matrix * scale[:, None], right * scale)
        x = x.copy()
        x[is_free] += solution[:n]
        rows = np.zeros_like(rows)
        rows[active_rows] = solution[n:]
        size = np.abs(solution[:n] / (1 + np.abs(x[is_free]))).max(initial=0.0)
        if size <= _STALLED_STEP and size > last_size / 2:  # only rounding remains
            break
        last_size = size
    if not np.all(np.isfinite(x)):
        return None
    x = np.clip(x, lower, upper)
    _, gradient, _, jacobian, _ = conditions.evaluate(x, rows)
    return conditions.point(x, rows, np.where(is_free, 0.0, -(gradient + jacobian.T @ rows)))


def _solve_linear(matrix: Array, right: Array) -> Array:
    """Solve a linear system. If it is singular, the shortest least-squares solution is found, 20 times slower.

    Two random right-hand sides reveal a singular matrix by the size of their solutions.
    """
    probes = np.random.default_rng(0).standard_normal((len(right), 2))
    try:
        solutions = np.linalg.solve(matrix, np.column_stack([right, probes]))
    except np.linalg.LinAlgError:
        solutions = np.full((len(right), 3), np.nan)
    if np.all(np.isfinite(solutions)) and np.abs(solutions[:, 1:]).max(initial=0.0) <= _MAX_SOLUTION:
        return np.asarray(solutions[:, 0])
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=1e-13)[0])


def _find_active(value: Array, lower: Array, upper: Array, multiplier: Array, by_slack: bool) -> tuple[Array, Array]:
    """Masks of the active lower and of the active upper limits.

    If `by_slack`, a limit is active if its slack is tiny, otherwise if its slack is smaller than its multiplier.
    """
    threshold = _ACTIVE_SLACK * (1 + np.abs(value))
    if by_slack:
        at_lower, at_upper = value - lower <= threshold, upper - value <= threshold
    else:
        at_lower = (value - lower <= -multiplier) & (multiplier < 0)
        at_upper = (upper - value <= multiplier) & (multiplier > 0)
        at_lower &= value - lower <= 100 * threshold
        at_upper &= upper - value <= 100 * threshold
    at_lower = at_lower | (lower == upper)
    return at_lower, at_upper & ~at_lower


def _is_better(refined: Point, raw: Point) -> bool:
    """Whether a refined point is near the raw point, and up to rounding as feasible and not worse."""
    scale = 1 + abs(raw.objective)
    return (
        refined.violation <= max(raw.violation, 1e-14 * scale, refined.rounding)
        and refined.objective <= raw.objective + 1e-7 * scale
        and np.abs(refined.x - raw.x).max(initial=0.0) <= 1e-2 * (1 + np.abs(raw.x).max(initial=0.0))
    )
