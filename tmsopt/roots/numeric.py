"""Computes numeric roots that reproduce the coefficients of their polynomial to rounding.

Near a k-fold root, each single root is uncertain by the k-th root of the rounding unit. Therefore the roots are judged
together, by the coefficients that are rebuilt from them.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tmsopt.records import Array
from tmsopt.roots.exact import isolated_roots
from tmsopt.roots.quartics.factors import root_pair

Rows = Callable[[Array, NDArray[np.intp]], Array]

GOOD = 4e-15
"""Backward error below which no Newton step is taken."""

_LEAST_LEAD = 1e-300  # smallest leading coefficient relative to the largest one: their quotient must be a double
_STEPS = 6  # Newton's method doubles the digits at each step; companion eigenvalues start with 4 or more
_ACCEPTED = 1e-13  # with a larger backward error the roots are isolated exactly, as for roots of very different size


def roots(coefficients: ArrayLike) -> NDArray[np.complex128]:
    """All roots of real polynomials: coefficients of shape (…, n + 1), descending; roots of shape (…, n).

    Newton's method on the quadratic factors (and a linear factor for odd n) refines the eigenvalues of the companion
    matrix. A step counts only if it lowers the backward error. If this does not suffice, for example for many roots of
    very different size, exact arithmetic isolates the roots. Conjugate pairs are exact and adjacent.

    Raises:
        ValueError: for a leading coefficient 0 or coefficients that are not finite.

    Example:
        >>> [complex(s) for s in tmsopt.roots.roots([1, 2, 5]).round(9)]
        [(-1+2j), (-1-2j)]

    More: docs/explanation/factors.md
    """
    c = validate_coefficients(coefficients, "roots")
    n = c.shape[-1] - 1
    min_lead = np.abs(c).max(axis=-1) * _LEAST_LEAD  # keeps roots within the range of doubles
    lead = np.copysign(np.maximum(np.abs(c[..., 0]), min_lead), c[..., 0])
    with np.errstate(over="ignore", invalid="ignore"):  # a step that overflows is no improvement
        monic = (c / lead[..., None]).reshape(c[..., 0].size, n + 1)
        monic[:, 0] = 1
        scale = _scale(monic)
        scaled = monic / scale[:, None] ** np.arange(n + 1)
        companion = np.zeros((len(scaled), n, n))
        companion[:, 0, :] = -scaled[:, 1:]
        companion[:, np.arange(1, n), np.arange(n - 1)] = 1
        factors = _factors(np.linalg.eigvals(companion).astype(complex))
        error = backward_error(scaled, _factor_roots(factors)[:, :n])
        polish(
            factors,
            error,
            lambda trial, rows: trial + _newton_step(trial, scaled[rows]),
            lambda trial, rows: backward_error(scaled[rows], _factor_roots(trial)[:, :n]),
            _STEPS,
        )
        z = _factor_roots(factors)[:, :n] * scale[:, None]
    clamped = (np.abs(c[..., 0]) < min_lead).reshape(-1)
    for row in np.flatnonzero(clamped | ~(error <= _ACCEPTED)):
        z[row] = _isolate_roots(c.reshape(-1, n + 1)[row], z[row])
    return z.reshape(*c.shape[:-1], n)


def validate_coefficients(coefficients: ArrayLike, caller: str) -> Array:
    """Coefficients as an array of shape (…, n + 1), n ≥ 1.

    Args:
        caller: name of the function for messages.

    Raises:
        ValueError: for a leading coefficient 0 or coefficients that are not finite.
    """
    c = np.asarray(coefficients, dtype=float)
    if c.ndim == 0 or c.shape[-1] < 2 or not np.all(np.isfinite(c)) or np.any(c[..., 0] == 0):
        raise ValueError(f"{caller} needs two or more finite coefficients with a leading one other than 0")
    return c


def abscissa(coefficients: ArrayLike) -> Array:
    """Largest real part of the roots, in double precision: shape (…, n + 1) in, (…) out.

    Example:
        >>> [round(float(x), 12) for x in tmsopt.roots.abscissa([[1, 3, 2], [1, 0, 1]])]  # (s + 1)(s + 2) and s² + 1
        [-1.0, 0.0]

    More: docs/explanation/factors.md
    """
    return np.asarray(roots(coefficients).real.max(axis=-1))


def rebuilt(values: NDArray[np.complex128] | Array) -> Array:
    """Monic real coefficients of the polynomials with these roots: shape (…, n) in, (…, n + 1) out.

    Example:
        >>> import numpy as np
        >>> tmsopt.roots.rebuilt(np.array([-1 + 1j, -1 - 1j]))
        array([1., 2., 2.])

    More: docs/reference/python.md
    """
    result = np.zeros((*values.shape[:-1], values.shape[-1] + 1), dtype=complex)
    result[..., 0] = 1
    for k in range(values.shape[-1]):
        result[..., 1 : k + 2] -= values[..., k : k + 1] * result[..., : k + 1]
    return result.real


def backward_error(coefficients: ArrayLike, values: NDArray[np.complex128]) -> Array:
    """Largest relative error of the coefficients rebuilt from the roots, shape (…).

    The error of each coefficient is relative to the same symmetric function of |roots|, the size of its terms, because
    a coefficient that cancels to nearly 0 has no relative accuracy of its own.

    Example:
        >>> p = [1, 4, 6, 4, 1]
        >>> bool(tmsopt.roots.backward_error(p, tmsopt.roots.roots(p)) < 1e-14)
        True

    More: docs/explanation/factors.md
    """
    c = np.asarray(coefficients, dtype=float)
    error = np.abs(rebuilt(values) - c / c[..., :1])
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.max(np.where(error == 0, 0.0, error / rebuilt(-np.abs(values))), axis=-1))


def _scale(monic: Array) -> Array:
    """Geometric mean of |roots| if no root is 0, else the largest term of the Fujiwara bound; 1 if that is 0."""
    n = monic.shape[-1] - 1
    powers = np.abs(monic[:, 1:]) ** (1 / np.arange(1, n + 1))
    scale = np.where(powers[:, -1] > 0, powers[:, -1], powers.max(axis=-1))
    return np.where(scale**n > 0, scale, 1.0)  # the power may underflow


def _factors(values: NDArray[np.complex128]) -> Array:
    """Coefficients (p, q) of s² + p s + q, shape (rows, ⌈n/2⌉, 2); a single real root r has p = −r, q = 0."""
    order = np.lexsort((values.imag, np.abs(values.imag), values.real, values.imag == 0), axis=-1)
    values = np.take_along_axis(values, order, axis=-1)
    if values.shape[-1] % 2:
        values = np.concatenate([values, np.zeros_like(values[:, :1])], axis=-1)
    first, second = values[:, 0::2], values[:, 1::2]
    return np.stack([-(first + second).real, (first * second).real], axis=-1)


def _isolate_roots(coefficients: Array, numeric: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """The roots of one polynomial, correctly rounded, or the numeric ones if the roots exceed doubles."""
    each = [complex(z) for z, m in isolated_roots(coefficients.tolist()) for _ in range(m)]
    isolated = np.array(sorted(each, key=lambda z: (z.imag == 0, z.real, abs(z.imag), -z.imag)))
    return isolated if isolated.shape == numeric.shape and np.all(np.isfinite(isolated)) else numeric


def polish(values: Array, error: Array, step: Rows, measure: Rows, steps: int) -> None:
    """Take Newton steps on the rows of an array, in place, until the backward error is good or does not fall.

    Args:
        step: function of some rows and their indices that takes a step.
        measure: function of the same arguments that gives the backward errors.
    """
    rows = np.flatnonzero(error > GOOD)
    for _ in range(steps):
        if not rows.size:
            break
        trial = step(values[rows], rows)
        trial_error = measure(trial, rows)
        is_better = trial_error < error[rows]
        rows, trial_error = rows[is_better], trial_error[is_better]
        values[rows], error[rows] = trial[is_better], trial_error
        rows = rows[trial_error > GOOD]


@np.errstate(all="ignore")
def quadratic_roots(p: Array, q: Array) -> NDArray[np.complex128]:
    """Roots of quadratic factors s² + p s + q of shape (…, m); the two of a factor are adjacent, conjugates exact."""
    re, im, other_re, other_im = root_pair(p, q)
    pairs = np.stack([re + 1j * im, other_re + 1j * other_im], axis=-1)
    return np.asarray(pairs.reshape(*p.shape[:-1], 2 * p.shape[-1]))


def _newton_step(factors: Array, monic: Array) -> Array:
    """Newton step; the shortest least-squares step if factors coincide, so that the Jacobian is singular."""
    rows, half, _ = factors.shape
    n = monic.shape[-1] - 1
    cofactors = [_multiply(np.delete(factors, k, axis=1)) for k in range(half)]
    residual = monic[:, 1:] - _multiply(factors)[:, 1 : n + 1]
    jacobian = np.zeros((rows, n, 2 * half))
    for k, cofactor in enumerate(cofactors):
        for column in (0, 1):  # d/dp gives a factor s, d/dq a factor 1
            width = min(n - column, cofactor.shape[-1])
            jacobian[:, column : column + width, 2 * k + column] = cofactor[:, :width]
    radius = np.abs(_factor_roots(factors))
    size = rebuilt(-radius[:, :n])[:, 1:] + 1e-300
    unit = radius.reshape(rows, half, 2).max(axis=-1) + 1e-300
    columns = np.stack([unit, unit**2], axis=-1).reshape(rows, 2 * half)
    if n % 2:
        jacobian[:, :, -1] = 0  # q of the single real root stays 0
    with np.errstate(all="ignore"):
        balanced = jacobian * columns[:, None, :] / size[:, :, None]
        target = residual / size
    regular = np.all(np.isfinite(balanced), axis=(1, 2)) & np.all(np.isfinite(target), axis=1)
    balanced, target = np.where(regular[:, None, None], balanced, 0.0), np.where(regular[:, None], target, 0.0)
    step = np.linalg.pinv(balanced) @ target[:, :, None]
    return np.asarray((step[:, :, 0] * columns).reshape(rows, half, 2))


def _multiply(factors: Array) -> Array:
    result = np.zeros((len(factors), 2 * factors.shape[1] + 1))
    result[:, 0] = 1.0
    for k in range(factors.shape[1]):
        end = 2 * k + 3
        shorter = result[:, : end - 2].copy()
        result[:, 1 : end - 1] += factors[:, k, :1] * shorter
        result[:, 2:end] += factors[:, k, 1:] * shorter
    return result


def _factor_roots(factors: Array) -> NDArray[np.complex128]:
    """Both roots of each factor, without cancellation; for an odd degree, the padding root 0 comes last."""
    return quadratic_roots(factors[..., 0], factors[..., 1])
