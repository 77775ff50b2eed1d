"""Finds the polynomial of a factored form that is nearest to a given one, by least squares on relative changes."""

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from tmsopt.records import Array
from tmsopt.roots.numeric import rebuilt

Roots = NDArray[np.complex128]

_MAX_STEPS = 20  # Gauss–Newton steps
_MIN_RESOLUTION = 1e6  # a coefficient with more than so many rounding errors is surely not 0, even after a solver
_ROUNDINGS = 16  # rounding errors that a solver may leave in its equations, for each parameter


class Form(Protocol):
    """A set of monic polynomials with factors of unknown coefficients: a pattern or a shape."""

    def monic(self, unknowns: Sequence[Any]) -> list[Any]:
        """Coefficients of the product of the factors, descending from 1."""
        ...


def term_sizes(z: Roots, monic: Array | None = None, errors: Array | None = None, tolerance: float = 0.0) -> Array:
    """Sizes of the terms whose sums are the monic coefficients, for relative changes of the coefficients.

    A root below a thousandth of the median root (of the largest root, if the median is 0) counts as that size, so that
    the change of a coefficient that is 0 because of a root 0 is relative to the other roots and not to its rounding.

    Args:
        z: roots of the polynomial.
        monic: the coefficients.
        errors: rounding errors of the coefficients. If a coefficient is far above its error, as in a stiff system, it
            may be small but is not 0, and the true sizes of the roots give the size of its terms.
        tolerance: relative change that must be larger than some rounding errors. A small difference of large numbers
            is not accurate relative to its own size, so its size is increased.
    """
    radius = np.abs(z)
    floor = 1e-3 * float(np.median(radius) or radius.max())
    size = rebuilt(-np.maximum(radius, floor))
    if monic is not None and errors is not None:
        size = np.where(np.abs(monic) > _MIN_RESOLUTION * errors, rebuilt(-radius), size)
        size = np.maximum(size, _ROUNDINGS * errors / tolerance) if tolerance else size
    return np.maximum(size, 1e-100)


def relative_distance(form: Form, unknowns: Sequence[float] | Array, monic: Array, size: Array) -> float:
    """Relative change of the coefficients (root sum of squares) from a monic polynomial to a polynomial of the form."""
    return float(np.linalg.norm((np.array(form.monic(list(unknowns)), dtype=float) - monic) / size))


def gauss_newton(form: Form, guess: Array, monic: Array, size: Array, patience: int = _MAX_STEPS) -> Array:
    """Unknowns with the least relative distance from a polynomial, by Gauss–Newton steps with a complex-step Jacobian.

    Args:
        guess: unknowns to start from.
        patience: number of successive steps that may fail to lower the distance by a tenth; then the fit ends.
    """
    u = best_u = guess
    if not guess.size:
        return guess
    best_distance, patience_left = np.inf, patience
    directions = 1e-100j * np.eye(len(u))
    for _ in range(_MAX_STEPS):
        coefficients = np.stack(np.broadcast_arrays(*form.monic([x + d for x, d in zip(u, directions, strict=True)])))
        jacobian = coefficients.imag / 1e-100 / size[:, None]
        residual = (np.array(form.monic(list(u)), dtype=float) - monic) / size
        if not (np.all(np.isfinite(jacobian)) and np.all(np.isfinite(residual))):
            break
        with np.errstate(over="ignore"):  # the fit may diverge
            distance = float(np.linalg.norm(residual))
        patience_left = patience if distance < 0.9 * best_distance else patience_left - 1
        if distance < best_distance:
            best_u, best_distance = u, distance
        if not patience_left:
            return best_u
        length = np.linalg.norm(jacobian, axis=0)
        length[~(length > 0)] = 1.0
        step = np.linalg.lstsq(jacobian / length, -residual, rcond=None)[0] / length
        u = u + step
        if np.all(np.abs(step) <= 1e-15 * np.abs(u)):
            break
    return u
