"""Classes of the motion of many quartics at once, from their coefficients."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tmsopt.deprecated import ignore_option
from tmsopt.records import Array
from tmsopt.roots.count import real_roots
from tmsopt.roots.quartics import signs
from tmsopt.roots.quartics.quartic import flatten_columns, make_blocks
from tmsopt.roots.stability import is_stable

CLASSES = ("undefined", "capsize", "weave", "stable", "heavily damped")
"""Names of the class codes 0 … 4, from worst to best. A class is undefined if the leading coefficient is 0 or a
coefficient is not finite."""

Codes = NDArray[np.int8]


@dataclass(frozen=True)
class Classes:
    """Classes of polynomials.

    Attributes:
        kind: codes of CLASSES: unstable with a real root ≥ 0 (capsize), unstable without one (weave), stable, and
            stable with only real, distinct roots (heavily damped).
        real_roots: number of distinct real roots.
        doubtful: number of quartics for which rounding could change a sign; exact arithmetic decided their classes.

    Example:
        >>> found = tmsopt.roots.quartic_classes(1, 4, 6, 4, [1, -1])  # (s + 1)⁴, and a root right of 0
        >>> [tmsopt.roots.CLASSES[kind] for kind in found.kind], found.real_roots.tolist()
        (['stable', 'capsize'], [1, 2])

    More: docs/how_to/charts.md
    """

    kind: Codes
    real_roots: Codes
    doubtful: int


@ignore_option("compiled")
def quartic_classes(a0: ArrayLike, a1: ArrayLike, a2: ArrayLike, a3: ArrayLike, a4: ArrayLike) -> Classes:
    """Classes of the quartics a0 s⁴ + … + a4. The shapes of the coefficients must broadcast.

    Stability agrees with `is_stable`, and the number of real roots with `real_roots`. Both are exact for the polynomial
    whose coefficients are exactly the given doubles.

    Raises:
        ValueError: for shapes that cannot be broadcast.

    Example:
        >>> found = tmsopt.roots.quartic_classes(1, 10, 35, 50, [24, 0])  # (s + 1)(s + 2)(s + 3)(s + 4)
        >>> [tmsopt.roots.CLASSES[kind] for kind in found.kind]
        ['heavily damped', 'capsize']

    More: docs/how_to/charts.md
    """
    a, shape = flatten_columns(a0, a1, a2, a3, a4)
    kind, count = np.empty((2, a[0].size), np.int8)
    doubtful = np.empty(a[0].size, np.bool_)
    with np.errstate(all="ignore"):
        for block in make_blocks(a[0].size):
            kind[block], count[block], doubtful[block] = signs.classes(*(c[block] for c in a))
    rows = np.flatnonzero(doubtful)
    if rows.size:
        kind[rows], count[rows] = count_classes(np.stack([c[rows] for c in a], axis=1))
    return Classes(kind.reshape(shape), count.reshape(shape), rows.size)


@ignore_option("compiled")
def quartic_is_stable(a0: ArrayLike, a1: ArrayLike, a2: ArrayLike, a3: ArrayLike, a4: ArrayLike) -> NDArray[np.bool_]:
    """Whether all roots have Re s < 0, as in `is_stable`; arguments and errors as for `quartic_classes`.

    Example:
        >>> tmsopt.roots.quartic_is_stable(1, 4, 6, 4, [1, -1])
        array([ True, False])

    More: docs/how_to/charts.md
    """
    a, shape = flatten_columns(a0, a1, a2, a3, a4)
    stable = np.empty(a[0].size, np.bool_)
    with np.errstate(all="ignore"):
        for block in make_blocks(stable.size):
            stable[block] = signs.is_stable_by_signs(*(c[block] for c in a))
    return stable.reshape(shape)


def count_classes(c: Array) -> tuple[Codes, Codes]:
    """Class codes and numbers of distinct real roots of polynomials of any degree, exact where rounding could matter.

    Args:
        c: coefficients, shape (rows, degree + 1).
    """
    kind, count = np.zeros((2, len(c)), np.int8)
    regular_rows = np.flatnonzero(np.all(np.isfinite(c), axis=1) & (c[:, 0] != 0))
    if regular_rows.size:
        c = c[regular_rows]
        negative, positive = real_roots(c)
        has_zero_root = c[:, -1] == 0
        with np.errstate(all="ignore"):
            stable = is_stable(c)
        stable_kind = np.where(negative == c.shape[1] - 1, CLASSES.index("heavily damped"), CLASSES.index("stable"))
        unstable_kind = np.where((positive > 0) | has_zero_root, CLASSES.index("capsize"), CLASSES.index("weave"))
        kind[regular_rows] = np.where(stable, stable_kind, unstable_kind)
        count[regular_rows] = negative + positive + has_zero_root
    return kind, count
