"""Classes of the motion of many quartics at once, from their coefficients alone, in NumPy or compiled by numba."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tmsopt.roots.count import real_roots
from tmsopt.roots.quartics import signs
from tmsopt.roots.quartics.quartic import columns, use_numba

CLASSES = ("undefined", "capsize", "weave", "stable", "heavily damped")
"""Names of the class codes 0 … 4, from worst to best; undefined is a leading 0 or a coefficient that is not finite."""

_BLOCK = 8192


@dataclass(frozen=True)
class Classes:
    """Classes of quartics.

    Attributes:
        kind: codes of CLASSES: unstable with a real root ≥ 0 (capsize), unstable without one (weave), stable, stable
            with four different real roots (heavily damped).
        real_roots: number of different real roots.
        doubtful: number of quartics whose signs rounding left in doubt, and that `real_roots` decided.

    Example:
        >>> found = tmsopt.roots.quartic_classes(1, 4, 6, 4, [1, -1], compiled=False)  # (s + 1)⁴, and a root right of 0
        >>> [tmsopt.roots.CLASSES[kind] for kind in found.kind], found.real_roots.tolist()
        (['stable', 'capsize'], [1, 2])

    More: docs/how_to/charts.md
    """

    kind: NDArray[np.int8]
    real_roots: NDArray[np.int8]
    doubtful: int


def quartic_classes(
    a0: ArrayLike, a1: ArrayLike, a2: ArrayLike, a3: ArrayLike, a4: ArrayLike, *, compiled: bool | None = None
) -> Classes:
    """Classes of the quartics a0 s⁴ + … + a4, coefficients of any shapes that broadcast.

    Stability is that of `is_stable`, the count that of `real_roots`, exact on the coefficients as stored.

    Args:
        compiled: by numba, or in NumPy alone, with the same answers; by default compiled where numba is installed.

    Raises:
        ValueError: for shapes that cannot be broadcast.
        ModuleNotFoundError: for compiled without numba.

    Example:
        >>> found = tmsopt.roots.quartic_classes(1, 10, 35, 50, [24, 0], compiled=False)  # (s + 1)(s + 2)(s + 3)(s + 4)
        >>> [tmsopt.roots.CLASSES[kind] for kind in found.kind]
        ['heavily damped', 'capsize']

    More: docs/how_to/charts.md
    """
    a, shape = columns(a0, a1, a2, a3, a4)
    size = a[0].size
    kind, count, doubtful = np.empty(size, np.int8), np.empty(size, np.int8), np.empty(size, np.bool_)
    if use_numba(compiled):
        from tmsopt.roots.quartics.compiled import loop

        loop("classes")(*a, kind, count, doubtful)
    else:
        with np.errstate(all="ignore"):
            for first in range(0, size, _BLOCK):
                block = slice(first, first + _BLOCK)
                kind[block], count[block], doubtful[block] = signs.classes(*(c[block] for c in a))
    rows = np.flatnonzero(doubtful)
    if rows.size:
        kind[rows], count[rows] = _decided(np.stack([c[rows] for c in a], axis=1))
    return Classes(kind.reshape(shape), count.reshape(shape), rows.size)


def quartic_is_stable(
    a0: ArrayLike, a1: ArrayLike, a2: ArrayLike, a3: ArrayLike, a4: ArrayLike, *, compiled: bool | None = None
) -> NDArray[np.bool_]:
    """Whether all roots have Re s < 0, as `is_stable` has it; arguments and errors as of `quartic_classes`.

    Example:
        >>> tmsopt.roots.quartic_is_stable(1, 4, 6, 4, [1, -1], compiled=False)
        array([ True, False])

    More: docs/how_to/charts.md
    """
    a, shape = columns(a0, a1, a2, a3, a4)
    verdict = np.empty(a[0].size, np.bool_)
    if use_numba(compiled):
        from tmsopt.roots.quartics.compiled import loop

        loop("stable")(*a, verdict)
    else:
        with np.errstate(all="ignore"):
            for first in range(0, verdict.size, _BLOCK):
                block = slice(first, first + _BLOCK)
                verdict[block] = signs.stable(*(c[block] for c in a))
    return verdict.reshape(shape)


def _decided(c: NDArray[np.float64]) -> tuple[NDArray[np.int8], NDArray[np.int8]]:
    """Classes and counts of rows of coefficients by the functions that go to exact arithmetic in doubt."""
    kind, count = np.zeros(len(c), np.int8), np.zeros(len(c), np.int8)
    regular = np.flatnonzero(np.all(np.isfinite(c), axis=1) & (c[:, 0] != 0))
    if regular.size:
        negative, positive = real_roots(c[regular])
        zero = c[regular, 4] == 0
        with np.errstate(all="ignore"):
            held = signs.stable(*c[regular].T)
        kind[regular] = np.where(held, np.where(negative == 4, 4, 3), np.where((positive > 0) | zero, 1, 2))
        count[regular] = negative + positive + zero
    return kind, count
