"""Computes numeric roots that reproduce the coefficients of their polynomial to rounding.

Near a k-fold root, each single root is uncertain by the k-th root of the rounding unit. Therefore the measure of
accuracy belongs to all roots together: it is the error of the coefficients that are rebuilt from them.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tmsopt.records import Array
from tmsopt.roots.exact import isolated_roots
from tmsopt.roots.quartics.factors import root_pair

RowFunction = Callable[[Array, NDArray[np.intp]], Array]
"""Function of some rows of an array and of their indices."""

GOOD_ERROR = 4e-15
"""Backward error below which no Newton step is taken."""

_MIN_LEAD = 1e-300  # smallest leading coefficient, divided by the largest coefficient; their quotient must be a double
_MAX_STEPS = 6  # each Newton step doubles the digits, and companion eigenvalues have 4 digits or more
_MAX_ERROR = 1e-13  # if the backward error is larger, exact arithmetic isolates the roots


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
    min_lead = np.abs(c).max(axis=-1) * _MIN_LEAD  # keeps roots within the range of doubles
    lead = np.copysign(np.maximum(np.abs(c[..., 0]), min_lead), c[..., 0])
    with np.errstate(over="ignore", invalid="ignore"):  # a step that overflows does not lower the error
        monic = (c / lead[..., None]).reshape(c[..., 0].size, n + 1)
        monic[:, 0] = 1
        scale = _scale(monic)
        scaled = monic / scale[:, None] ** np.arange(n + 1)
        companion = np.zeros((len(scaled), n, n))
        companion[:, 0, :] = -scaled[:, 1:]
        companion[:, np.arange(1, n), np.arange(n - 1)] = 1
        factors = _pair_roots(np.linalg.eigvals(companion).astype(complex))
        error = backward_error(scaled, _factor_roots(factors)[:, :n])
        polish(
            factors,
            error,
            lambda trial, rows: trial + _newton_step(trial, scaled[rows]),
            lambda trial, rows: backward_error(scaled[rows], _factor_roots(trial)[:, :n]),
            _MAX_STEPS,
        )
        z = _factor_roots(factors)[:, :n] * scale[:, None]
    is_clamped = (np.abs(c[..., 0]) < min_lead).reshape(-1)
    for row in np.flatnonzero(is_clamped | ~(error <= _MAX_ERROR)):
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
        raise ValueError(f"{caller} needs two or more finite coefficients, and the leading one must not be 0")
    return c


def abscissa(coefficients: ArrayLike) -> Array:
    """Largest real part of the roots, in double precision. The coefficients have shape (…, n + 1), the result (…).

    Example:
        >>> [round(float(x), 12) for x in tmsopt.roots.abscissa([[1, 3, 2], [1, 0, 1]])]  # (s + 1)(s + 2) and s² + 1
        [-1.0, 0.0]

    More: docs/explanation/factors.md
    """
    return np.asarray(roots(coefficients).real.max(axis=-1))


def rebuilt(values: NDArray[np.complex128] | Array) -> Array:
    """Monic real coefficients of the polynomials with these roots. The roots have shape (…, n), the result (…, n + 1).

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

    Each coefficient is a symmetric function of the roots. Its error is divided by the same function of |roots|, that
    is, by the size of its terms, because the terms may cancel and leave a coefficient near 0.

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
    """Geometric mean of |roots| if no root is 0, else the largest term of Fujiwara's bound; 1 if all roots are 0."""
    n = monic.shape[-1] - 1
    powers = np.abs(monic[:, 1:]) ** (1 / np.arange(1, n + 1))
    scale = np.where(powers[:, -1] > 0, powers[:, -1], powers.max(axis=-1))
    return np.where(scale**n > 0, scale, 1.0)  # the power may underflow


def _pair_roots(values: NDArray[np.complex128]) -> Array:
    """Coefficients (p, q) of s² + p s + q, shape (rows, ⌈n/2⌉, 2); a single real root r has p = −r, q = 0."""
    order = np.lexsort((values.imag, np.abs(values.imag), values.real, values.imag == 0), axis=-1)
    values = np.take_along_axis(values, order, axis=-1)
    if values.shape[-1] % 2:
        values = np.concatenate([values, np.zeros_like(values[:, :1])], axis=-1)
    first_roots, second_roots = values[:, 0::2], values[:, 1::2]
    return np.stack([-(first_roots + second_roots).real, (first_roots * second_roots).real], axis=-1)


def _isolate_roots(coefficients: Array, numeric: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """The roots of one polynomial, correctly rounded; the numeric roots if a root is outside the range of doubles."""
    all_roots = [complex(z) for z, m in isolated_roots(coefficients.tolist()) for _ in range(m)]
    isolated = np.array(sorted(all_roots, key=lambda z: (z.imag == 0, z.real, abs(z.imag), -z.imag)))
    return isolated if isolated.shape == numeric.shape and np.all(np.isfinite(isolated)) else numeric


def polish(values: Array, error: Array, take_step: RowFunction, measure_error: RowFunction, max_steps: int) -> None:
    """Take Newton steps on the rows of an array, in place, until the backward error is small or no longer decreases.

    Args:
        error: backward error of each row.
        take_step: returns the rows after a step.
        measure_error: returns the backward errors of the rows.
    """
    rows = np.flatnonzero(error > GOOD_ERROR)
    for _ in range(max_steps):
        if not rows.size:
            break
        trial = take_step(values[rows], rows)
        trial_error = measure_error(trial, rows)
        is_better = trial_error < error[rows]
        rows, trial_error = rows[is_better], trial_error[is_better]
        values[rows], error[rows] = trial[is_better], trial_error
        rows = rows[trial_error > GOOD_ERROR]


@np.errstate(all="ignore")
def quadratic_roots(p: Array, q: Array) -> NDArray[np.complex128]:
    """Roots of factors s² + p s + q. The two roots of a factor are adjacent; complex ones are exact conjugates."""
    re, im, other_re, other_im = root_pair(p, q)
    pairs = np.stack([re + 1j * im, other_re + 1j * other_im], axis=-1)
    return np.asarray(pairs.reshape(*p.shape[:-1], 2 * p.shape[-1]))


def _newton_step(factors: Array, monic: Array) -> Array:
    """Newton step. If factors coincide, the Jacobian is singular, and the shortest least-squares step is taken."""
    rows, factor_count, _ = factors.shape
    n = monic.shape[-1] - 1
    cofactors = [_multiply(np.delete(factors, k, axis=1)) for k in range(factor_count)]
    residual = monic[:, 1:] - _multiply(factors)[:, 1 : n + 1]
    jacobian = np.zeros((rows, n, 2 * factor_count))
    for k, cofactor in enumerate(cofactors):
        for column in (0, 1):  # d/dp gives a factor s, d/dq a factor 1
            width = min(n - column, cofactor.shape[-1])
            jacobian[:, column : column + width, 2 * k + column] = cofactor[:, :width]
    radius = np.abs(_factor_roots(factors))
    size = rebuilt(-radius[:, :n])[:, 1:] + 1e-300
    unit = radius.reshape(rows, factor_count, 2).max(axis=-1) + 1e-300
    columns = np.stack([unit, unit**2], axis=-1).reshape(rows, 2 * factor_count)
    if n % 2:
        jacobian[:, :, -1] = 0  # q of the single real root stays 0
    with np.errstate(all="ignore"):
        balanced = jacobian * columns[:, None, :] / size[:, :, None]
        target = residual / size
    is_finite = np.all(np.isfinite(balanced), axis=(1, 2)) & np.all(np.isfinite(target), axis=1)
    balanced, target = np.where(is_finite[:, None, None], balanced, 0.0), np.where(is_finite[:, None], target, 0.0)
    step = np.linalg.pinv(balanced) @ target[:, :, None]
    return np.asarray((step[:, :, 0] * columns).reshape(rows, factor_count, 2))


def _multiply(factors: Array) -> Array:
    """Coefficients of the product of the factors of each row, descending from 1."""
    result = np.zeros((len(factors), 2 * factors.shape[1] + 1))
    result[:, 0] = 1.0
    for k in range(factors.shape[1]):
        end = 2 * k + 3
        shorter = result[:, : end - 2].copy()
        result[:, 1 : end - 1] += factors[:, k, :1] * shorter
        result[:, 2:end] += factors[:, k, 1:] * shorter
    return result


def _factor_roots(factors: Array) -> NDArray[np.complex128]:
    """Both roots of each factor, without cancellation. For an odd degree, the last root is an additional 0."""
    return quadratic_roots(factors[..., 0], factors[..., 1])
