"""The best design known of a problem: SciPy's differential evolution, climbs, two polishes, on our own evaluation.

In: a problem. Out: a `Reference`, its value and violations at 50 digits. One polish is Nelder and Mead's on an exact
penalty, the other a smooth program: p(t + γ) = a0 ∏ (t² + β t + κ), β and κ at least 0, by SLSQP.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import mpmath
import numpy as np
import numpy.typing as npt
import scipy.optimize

from benchmarks.suites.fresh.formulas import FLOATS, evaluate, excess
from benchmarks.suites.fresh.problem import (
    Floats,
    Problem,
    assign,
    eigenvalues,
    measure,
    measure_exactly,
    state_matrix,
)

optimize: Any = scipy.optimize

FEASIBLE = 1e-9
"""Relative violation up to which a design counts as feasible."""

SEEDS = (11, 12, 13, 14, 15, 16)
"""Of evolutions; those with an odd one see ranges around 0 on a scale of sinh, on which small values are wide."""

WARP = 4.0
"""How much: near 0 the scale is finer by some WARP / sinh(WARP)."""

SAMPLE, SPREAD, CLIMBERS = 4096, 0.1, 48
"""Random designs; the distance, of the box, that starts keep; how many of them climb each on its own."""

STEPS, CHILDREN = 120, 8
"""Of each climb, and trials in each step."""


@dataclass(frozen=True)
class Reference:
    """The best design found.

    Attributes:
        design: free parameters.
        value: of the objective, as the file has it, at 50 digits.
        violation: the worst relative one.
        abscissa: at 50 digits.
    """

    design: Mapping[str, float]
    value: float
    violation: float
    abscissa: float

    @property
    def feasible(self) -> bool:
        """Whether every limit holds."""
        return self.violation <= FEASIBLE

    def to_json(self) -> dict[str, Any]:
        """As plain data."""
        return asdict(self)


def reference(problem: Problem, generations: int = 250) -> Reference:
    """The best of evolutions, climbs and their polishes."""
    box, merit = problem.box, _merit(problem)
    starts = np.concatenate([_evolve(problem, seed, generations) for seed in SEEDS])
    if problem.feasible:
        starts = np.concatenate([[[problem.feasible[n] for n in problem.free]], starts])
    starts = np.concatenate([starts, _climb(problem)])
    starts = starts[np.argsort(merit(starts), kind="stable")]
    polished = [starts, *(_nelder_mead(problem, x)[None] for x in _apart(problem, starts)[:3])]
    if _can_lift(problem):
        polished += [_lift(problem, x)[None] for x in (*starts[:2], *_apart(problem, starts)[1:4])]
    points = np.clip(np.concatenate(polished), box[:, 0], box[:, 1])
    best = points[np.argsort(merit(points), kind="stable")[:6]]
    known = [_exactly(problem, x) for x in best]
    if problem.feasible:
        known.append(_exactly(problem, np.array([problem.feasible[n] for n in problem.free])))
    held = [r for r in known if r.feasible]
    if held:
        return min(held, key=lambda r: problem.sign * r.value)
    return min(known, key=lambda r: r.violation)


def _exactly(problem: Problem, x: Floats) -> Reference:
    design = {name: float(v) for name, v in zip(problem.free, x, strict=True)}
    try:
        real = measure_exactly(problem, design)
    except (ZeroDivisionError, mpmath.libmp.NoConvergence):
        return Reference(design, problem.sign * 1e30, 1e30, 1e30)
    return Reference(design, real.objective, max(real.violations.values(), default=0.0), real.abscissa)


def _merit(problem: Problem) -> Callable[[Floats], Floats]:
    """Objective where a design is feasible, beyond 1e6 where it is not, the more the more it violates."""

    def merit(designs: Floats) -> Floats:
        value, missed = measure(problem, designs)
        return np.where(missed <= 1e-10, np.minimum(value, 1e6), 1e6 * (1 + np.minimum(missed, 1e20)))

    return merit


def _evolve(problem: Problem, seed: int, generations: int) -> Floats:
    """The better part of the last population."""
    box, merit, warped = problem.box, _merit(problem), bool(seed % 2)
    ended = optimize.differential_evolution(
        lambda u: merit(_place(problem, u.T, warped)),
        bounds=[(0, 1)] * len(box),
        maxiter=generations,
        popsize=max(12, 48 // len(box)),
        tol=1e-10,
        rng=np.random.default_rng(seed),
        vectorized=True,
        updating="deferred",
        polish=False,
    )
    order = np.argsort(ended.population_energies)[:2]
    return _place(problem, np.concatenate([ended.x[None], ended.population[order]]), warped)


def _place(problem: Problem, units: Floats, warped: bool) -> Floats:
    """Designs from numbers between 0 and 1."""
    low, high = problem.box.T
    straight: Floats = low + (high - low) * units
    if not warped:
        return straight
    end = np.where(straight > 0, high, low)
    share = np.clip(straight / np.where(end == 0, 1, end), 0, 1)
    curved: Floats = end * np.sinh(WARP * share) / np.sinh(WARP)
    return np.where((low <= 0) & (high >= 0), curved, straight)


def _climb(problem: Problem) -> Floats:
    """Where random designs end that climb each on its own: an evolution strategy with one parent, many at once."""
    rng, merit, (low, high) = np.random.default_rng(SEEDS[0]), _merit(problem), problem.box.T
    units = rng.random((SAMPLE, len(low)))
    sample = np.concatenate([_place(problem, units[::2], False), _place(problem, units[1::2], True)])
    parents = np.array(_apart(problem, sample[np.argsort(merit(sample), kind="stable")[:600]])[:CLIMBERS])
    best, steps = merit(parents), np.full(len(parents), SPREAD)
    for _ in range(STEPS):
        moves = rng.normal(size=(len(parents), CHILDREN, len(low))) * steps[:, None, None] * (high - low)
        children = np.clip(parents[:, None, :] + moves, low, high)
        values = merit(children.reshape(-1, len(low))).reshape(len(parents), CHILDREN)
        chosen = values.argmin(axis=1)
        won = values.min(axis=1) < best
        parents[won] = children[np.arange(len(parents)), chosen][won]
        best, steps = np.where(won, values.min(axis=1), best), steps * np.where(won, 1.3, 0.82)
    return parents


def _apart(problem: Problem, designs: Floats) -> list[Floats]:
    """Those that are not near an earlier one."""
    span = problem.box[:, 1] - problem.box[:, 0]
    found: list[Floats] = []
    for x in designs:
        if all(np.abs((x - y) / span).max() > SPREAD for y in found):
            found.append(x)
    return found


def _nelder_mead(problem: Problem, x: Floats) -> Floats:
    box = problem.box
    span = box[:, 1] - box[:, 0]

    def penalty(y: Floats) -> float:
        z = np.clip(y, 0, 1)
        value, missed = measure(problem, (box[:, 0] + span * z)[None])
        return float(value[0] + 1e3 * (1 + abs(value[0])) * missed[0] + np.abs(y - z).sum())

    y = (x - box[:, 0]) / span
    for size in (1e-2, 1e-5):
        simplex = np.concatenate([y[None], y + size * np.eye(len(y))])
        options = {"initial_simplex": simplex, "maxiter": 150 * len(y), "xatol": 1e-13, "fatol": 1e-14}
        y = optimize.minimize(penalty, y, method="Nelder-Mead", options=options).x
    return box[:, 0] + span * np.clip(y, 0, 1)


def _can_lift(problem: Problem) -> bool:
    texts = " ".join([problem.objective, *problem.limits.values()])
    return (
        len(problem.cases) == 1
        and problem.system.kind != "H"
        and ("abscissa" in texts or "decay_rate" in texts)
        and "damping_ratio" not in texts
    )


def _coefficients(matrices: npt.NDArray[Any]) -> Floats:
    """Of det(s − matrix), descending, of many."""
    n = matrices.shape[1]
    found, power = [np.ones(len(matrices))], np.broadcast_to(np.eye(n), matrices.shape)
    for k in range(1, n + 1):
        product = matrices @ power
        found.append(-np.trace(product, axis1=1, axis2=2) / k)
        power = product + found[-1][:, None, None] * np.eye(n)
    return np.stack(found, axis=1)


def _lift(problem: Problem, x: Floats) -> Floats:
    """SLSQP on designs, γ and factors."""
    box, p = problem.box, len(x)
    span = box[:, 1] - box[:, 0]

    def at(designs: Floats) -> tuple[dict[str, Any], npt.NDArray[Any]]:
        values = assign(problem, dict(zip(problem.free, designs.T, strict=True)), {}, FLOATS)
        return values, state_matrix(problem.system, values, len(designs))

    roots = eigenvalues(at(x[None])[1])[0]
    n, gamma = len(roots), float(roots.real.max()) + 1e-3
    if not np.isfinite(gamma):
        return x
    scale = max(1e-3, float(np.abs(roots - gamma).max()))
    pairs = sorted((s for s in roots if s.imag > 1e-12), key=lambda s: -s.real)
    reals = sorted((s.real for s in roots if abs(s.imag) <= 1e-12), reverse=True)
    quadratic = [(-2 * (s.real - gamma), abs(s - gamma) ** 2) for s in pairs]
    while len(reals) > 1:
        a, b = reals.pop(0) - gamma, reals.pop(0) - gamma
        quadratic.append((-a - b, a * b))
    tail = [gamma / scale]
    tail += [v for b, k in quadratic for v in (b / scale, k / scale**2)] + [(gamma - r) / scale for r in reals]
    if len(tail) != 1 + n:
        return x

    def rows(z: Floats) -> Floats:
        """Objective, equalities and limits, one row for each z."""
        designs, gammas = box[:, 0] + span * z[:, :p], scale * z[:, p]
        values, matrices = at(designs)
        moved = (matrices - gammas[:, None, None] * np.eye(n)) / scale
        product = np.ones((len(z), 1))
        for i in range(n // 2):
            beta, kappa = z[:, p + 1 + 2 * i], z[:, p + 2 + 2 * i]
            product = _times(product, np.stack([np.ones(len(z)), beta, kappa], axis=1))
        if n % 2:
            product = _times(product, np.stack([np.ones(len(z)), z[:, p + n]], axis=1))
        values["abscissa"] = gammas
        values["decay_rate"] = -gammas * evaluate(problem.system.rate, values, FLOATS)
        goal = problem.sign * evaluate(problem.objective, values, FLOATS) * np.ones(len(z))
        limits = [-excess(t, values, FLOATS)[0] * np.ones(len(z)) for t in problem.limits.values()]
        return np.stack([goal, *(_coefficients(moved) - product)[:, 1:].T, *limits], axis=1)

    start = np.concatenate([(x - box[:, 0]) / span, tail])
    cached: dict[bytes, tuple[Floats, Floats]] = {}

    def both(z: Floats) -> tuple[Floats, Floats]:
        key = z.tobytes()
        if key not in cached:
            cached.clear()
            h = 1e-6 * np.eye(len(z))
            with np.errstate(all="ignore"):
                values = np.nan_to_num(rows(np.concatenate([z[None], z + h, z - h])), posinf=1e20, neginf=-1e20)
            cached[key] = values[0], ((values[1 : 1 + len(z)] - values[1 + len(z) :]) / 2e-6).T
        return cached[key]

    constraints = [{"type": "eq", "fun": lambda z: both(z)[0][1 : 1 + n], "jac": lambda z: both(z)[1][1 : 1 + n]}]
    if problem.limits:
        constraints.append({"type": "ineq", "fun": lambda z: both(z)[0][1 + n :], "jac": lambda z: both(z)[1][1 + n :]})
    try:
        ended = optimize.minimize(
            lambda z: both(z)[0][0],
            start,
            jac=lambda z: both(z)[1][0],
            method="SLSQP",
            constraints=constraints,
            bounds=[(0, 1)] * p + [(None, None)] + [(0, None)] * n,
            options={"maxiter": 150, "ftol": 1e-13},
        )
    except (np.linalg.LinAlgError, ValueError, optimize.OptimizeWarning):
        return x
    y = np.clip(ended.x[:p], 0, 1)
    return box[:, 0] + span * y if np.all(np.isfinite(y)) else x


def _times(a: Floats, b: Floats) -> Floats:
    """Products of polynomials, row by row."""
    found = np.zeros((len(a), a.shape[1] + b.shape[1] - 1))
    for j in range(b.shape[1]):
        found[:, j : j + a.shape[1]] += a * b[:, j : j + 1]
    return found
