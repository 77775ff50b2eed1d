"""Nonsmooth optimisers on the eigenvalues of a system whose coefficients are linear in its parameters."""

import contextlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np
from scipy.optimize import minimize, nnls

from benchmarks.rivals.searches import quiet
from tmsopt import Problem
from tmsopt.records import Array
from tmsopt.roots import exact_abscissa

_STEPS = 1000


def rightmost(a: Array, slopes: Array) -> tuple[float, Array]:
    """Largest real part of the roots of a polynomial, and its gradient, for slopes of the coefficients (n + 1, free).

    The rightmost root z moves by dz = −Σ da_k z^(n−k) / p'(z).
    """
    found = np.roots(a)
    z = found[int(np.argmax(found.real))]
    with np.errstate(all="ignore"):
        slope = -(np.polyval(slopes, z) / np.polyval(np.polyder(a), z)).real
    return float(z.real), np.nan_to_num(slope, posinf=0.0, neginf=0.0)


@dataclass(frozen=True)
class Poles:
    """The largest real part of the poles of controllers x, (5,), by eigenvalues.

    Attributes:
        constant, slopes: the coefficients are constant + slopes @ x, descending, (7,) and (7, 5).
    """

    constant: Array
    slopes: Array

    def __call__(self, x: Array) -> tuple[float, Array]:
        """Its value, and its gradient where it has one."""
        return rightmost(self.constant + self.slopes @ x, self.slopes)

    def stored(self, x: Array) -> float:
        """The true value for the numbers as they are stored, at 60 digits."""
        rows = [[Fraction(c) for c in row] for row in np.column_stack([self.constant, self.slopes]).tolist()]
        design = [Fraction(1), *map(Fraction, x.tolist())]
        return exact_abscissa([sum(c * v for c, v in zip(row, design, strict=True)) for row in rows])


Method = Callable[[Poles, Array], tuple[Array, float]]
"""Poles and a start → where it ends, and the abscissa that it states."""


def poles(problem: Problem) -> Poles:
    """Of a problem whose coefficients are linear in its free parameters."""

    def coefficients(x: Array) -> Array:
        values = problem.posed.ordered(dict(zip(problem.free, x.tolist(), strict=True)))
        return np.array([float(a) for a in problem.posed.values(values).coefficients])

    constant = coefficients(np.zeros(len(problem.free)))
    return Poles(constant, np.column_stack([coefficients(unit) - constant for unit in np.eye(len(problem.free))]))


def bfgs(at: Poles, start: Array) -> tuple[Array, float]:
    """As HANSO begins: A. Lewis, M. Overton, Math. Program. 141 (2013) 135."""
    x, inverse = start, np.eye(len(start))
    value, slope = at(x)
    for _ in range(_STEPS):
        found = _weak_wolfe(at, x, value, slope, -inverse @ slope)
        if found is None:
            break
        new, new_value, new_slope = found
        moved, turned = new - x, new_slope - slope
        rho = 1 / (moved @ turned)
        left = np.eye(len(x)) - rho * np.outer(moved, turned)
        inverse = left @ inverse @ left.T + rho * np.outer(moved, moved)
        x, value, slope = new, new_value, new_slope
    return x, value


def _weak_wolfe(at: Poles, x: Array, value: float, slope: Array, direction: Array) -> tuple[Array, float, Array] | None:
    """A step along a direction that descends enough and after which the slope is less steep; none at the end."""
    steepness = float(slope @ direction)
    low, high, step = 0.0, np.inf, 1.0
    for _ in range(60 if steepness < 0 else 0):
        new = x + step * direction
        new_value, new_slope = at(new)
        if new_value > value + 1e-4 * step * steepness:
            high = step
        elif new_slope @ direction < 0.5 * steepness:
            low = step
        else:
            return new, new_value, new_slope
        step = (low + high) / 2 if np.isfinite(high) else 2 * low
    return None


def hanso(at: Poles, start: Array) -> tuple[Array, float]:
    """BFGS, then gradient sampling: J. Burke, A. Lewis, M. Overton, SIAM J. Optim. 15 (2005) 751."""
    rng = np.random.default_rng(0)
    x, value = bfgs(at, start)
    for radius in 10.0 ** -np.arange(1.0, 7.0):
        for _ in range(_STEPS // 5):
            around = x + radius * rng.uniform(-1, 1, (2 * len(x), len(x)))
            steepest = _least_norm(np.array([at(v)[1] for v in (x, *around)]))
            size = float(np.linalg.norm(steepest))
            lengths = (radius * 0.5**k for k in range(-3, 30))
            tried = ((x - t * steepest / size, t) for t in lengths if size > 1e-6)
            step = next((v for v, t in tried if at(v)[0] < value - 1e-6 * t * size), None)
            if step is None:
                break
            x, value = step, at(step)[0]
    return x, value


def _least_norm(slopes: Array) -> Array:
    """The shortest vector of the convex hull of the rows."""
    heavy = 1e3 * max(float(np.abs(slopes).max()), 1.0)
    weights, _ = nnls(np.vstack([slopes.T, np.full(len(slopes), heavy)]), np.append(np.zeros(slopes.shape[1]), heavy))
    return np.asarray(weights / weights.sum() @ slopes)


def nelder_mead(at: Poles, start: Array) -> tuple[Array, float]:
    """SciPy's, started anew from its end as long as that helps."""
    x, value = start, np.inf
    while True:
        found: Any = minimize(partial(_value, at), x, method="Nelder-Mead", options={"maxfev": 20_000})
        if found.fun > value - 1e-9:
            return x, value
        x, value = found.x, float(found.fun)


def _value(at: Poles, x: Array) -> float:
    return at(x)[0]


def granso(at: Poles, start: Array) -> tuple[Array, float]:
    """PyGRANSO with exact gradients, unconstrained."""
    return pygranso(lambda x: (*at(x), None, None), start)


def pygranso(
    combined: Callable[[Array], tuple[float, Array, Array | None, Array | None]], start: Array, **options: Any
) -> tuple[Array, float]:
    """BFGS-SQP for constrained nonsmooth functions: value, gradient, limits ≤ 0 and their gradients, (n, limits)."""
    torch = import_module("torch")
    torch.set_num_threads(1)  # a dozen numbers are not worth a second thread

    def tensor(a: Any) -> Any:
        return None if a is None else torch.tensor(np.asarray(a, dtype=float))

    def told(variables: Any) -> list[Any]:
        value, slope, limits, inward = combined(variables.x.detach().numpy().ravel())
        return [
            value,
            tensor(slope[:, None]),
            None if limits is None else tensor(limits[:, None]),
            tensor(inward),
            None,
            None,
        ]

    settings = import_module("pygranso.pygransoStruct").pygransoStruct()
    given = {"globalAD": False, "print_level": 0, "quadprog_info_msg": False, "opt_tol": 1e-10, "maxit": _STEPS}
    for name, value in {**given, "x0": tensor(start[:, None]), **options}.items():
        setattr(settings, name, value)
    # it ends the interpreter where a function is not finite: that is the end of one start
    with quiet(), contextlib.suppress(SystemExit):
        best = import_module("pygranso.pygranso").pygranso({"x": [len(start), 1]}, told, user_opts=settings).best
        return best.x.detach().numpy().ravel(), float(best.f)
    return start, np.inf


NONSMOOTH: Mapping[str, Method] = {
    "BFGS, weak Wolfe": bfgs,
    "BFGS and gradient sampling, as HANSO": hanso,
    "PyGRANSO": granso,
    "Nelder–Mead, restarted": nelder_mead,
}
