"""The polynomial of a factored form that is nearest to a given one: least squares on relative coefficient changes."""

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from tmsopt.records import Array
from tmsopt.roots.numeric import rebuilt

Roots = NDArray[np.complex128]

_STEPS = 20
_RESOLVED = 1e6  # roundings; a solver leaves some hundreds in a coefficient that it makes vanish
_ROUNDINGS = 16  # of every parameter: what a solver may leave of its equations


class Form(Protocol):
    """A set of monic polynomials given by factors with unknown coefficients: a pattern or a shape."""

    def monic(self, unknowns: Sequence[Any]) -> list[Any]:
        """Coefficients of the product of the factors, descending from 1."""
        ...


def sizes(found: Roots, monic: Array | None = None, off: Array | None = None, tolerance: float = 0.0) -> Array:
    """Size of the terms that each monic coefficient is summed from.

    A root far smaller than the others counts as a thousandth of their median, so that a coefficient that a root
    at 0 makes vanish is judged by the others' size and not by its own rounding; of the largest, if the median is 0.

    Args:
        monic, off: the coefficients, and how far rounding may put each off. One that stands far above that, as of a
            stiff system, is not near 0 by chance, and is judged by the roots' own sizes.
        tolerance: relative change that is to cover some roundings: a small difference of large numbers cannot be right
            to its own size.
    """
    radius = np.abs(found)
    floor = 1e-3 * float(np.median(radius) or radius.max())
    size = rebuilt(-np.maximum(radius, floor))
    if monic is not None and off is not None:
        size = np.where(np.abs(monic) > _RESOLVED * off, rebuilt(-radius), size)
        size = np.maximum(size, _ROUNDINGS * off / tolerance) if tolerance else size
    return np.maximum(size, 1e-100)


def relative_distance(form: Form, unknowns: Sequence[float] | Array, monic: Array, size: Array) -> float:
    """Root sum of squares of the relative coefficient changes from a monic polynomial to one of a form."""
    return float(np.linalg.norm((np.array(form.monic(list(unknowns)), dtype=float) - monic) / size))


def gauss_newton(form: Form, guess: Array, monic: Array, size: Array, patience: int = _STEPS) -> Array:
    """Unknowns of least relative distance, from a guess; complex-step Jacobian, each column in its own size.

    Args:
        patience: steps that may fail to bring the distance down by a tenth before the nearest so far is returned.
    """
    u = best = guess
    if not guess.size:
        return guess
    least, left = np.inf, patience
    directions = 1e-100j * np.eye(len(u))
    for _ in range(_STEPS):
        moved = np.stack(np.broadcast_arrays(*form.monic([x + d for x, d in zip(u, directions, strict=True)])))
        jacobian = moved.imag / 1e-100 / size[:, None]
        residual = (np.array(form.monic(list(u)), dtype=float) - monic) / size
        if not (np.all(np.isfinite(jacobian)) and np.all(np.isfinite(residual))):
            break
        with np.errstate(over="ignore"):  # where it diverges
            distance = float(np.linalg.norm(residual))
        left = patience if distance < 0.9 * least else left - 1
        if distance < least:
            best, least = u, distance
        if not left:
            return best
        length = np.linalg.norm(jacobian, axis=0)
        length[~(length > 0)] = 1.0
        step = np.linalg.lstsq(jacobian / length, -residual, rcond=None)[0] / length
        u = u + step
        if np.all(np.abs(step) <= 1e-15 * np.abs(u)):
            break
    return u
