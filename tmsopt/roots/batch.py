"""Finds classes and motion of many polynomials of one degree: quartics by closed formulas, others by numeric roots."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from tmsopt.roots.numeric import roots
from tmsopt.roots.quartics.classes import Classes, count_classes, quartic_classes
from tmsopt.roots.quartics.quartic import Motion, abscissa_and_damping, flatten_columns, make_blocks

_QUARTIC = 5
"""Number of coefficients of a quartic."""


def classify(coefficients: Sequence[ArrayLike]) -> Classes:
    """Classes of polynomials. The coefficients come highest power first, and their shapes must broadcast.

    Example:
        >>> tmsopt.roots.classify([1, [3, -3], 2]).real_roots  # (s ± 1)(s ± 2)
        array([2, 2], dtype=int8)

    More: docs/how_to/charts.md
    """
    if len(coefficients) == _QUARTIC:
        return quartic_classes(*coefficients)
    a, shape = flatten_columns(*coefficients)
    rows = np.stack(a, axis=1)
    kinds, counts = np.empty((2, len(rows)), np.int8)
    for block in make_blocks(len(rows)):
        kinds[block], counts[block] = count_classes(rows[block])
    return Classes(kinds.reshape(shape), counts.reshape(shape), 0)


def find_motion(coefficients: Sequence[ArrayLike]) -> Motion:
    """Spectral abscissae and damping ratios; arguments as for `classify`.

    Example:
        >>> tmsopt.roots.find_motion([1, [2, 4], 5]).abscissa.round(9)  # -1 ± 2i, -2 ± i
        array([-1., -2.])

    More: docs/how_to/charts.md
    """
    if len(coefficients) == _QUARTIC:
        return abscissa_and_damping(*coefficients)
    a, shape = flatten_columns(*coefficients)
    rows = np.stack(a, axis=1)
    abscissae, ratios = np.full((2, len(rows)), np.nan)
    regular_rows = np.flatnonzero(np.all(np.isfinite(rows), axis=1) & (rows[:, 0] != 0))
    for block in make_blocks(regular_rows.size):
        selected = regular_rows[block]
        z = roots(rows[selected])
        abscissae[selected], ratios[selected] = z.real.max(axis=1), np.min(-z.real / (np.abs(z) + 1e-300), axis=1)
    return Motion(abscissae.reshape(shape), ratios.reshape(shape), regular_rows.size)
