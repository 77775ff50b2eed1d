"""Discs around numeric roots that certainly hold the true ones, for arrays of polynomials.

With Wᵢ = p(zᵢ)/(a0 ∏ (zᵢ − zⱼ)), the discs |z − zᵢ| ≤ n |Wᵢ| hold all roots, and one that is apart from the others
holds exactly one (Gershgorin's theorem for the companion matrix in the basis of the zᵢ): a real root if zᵢ is real.
"""

import numpy as np
from numpy.typing import NDArray

from tmsopt.roots.numeric import roots

Array = NDArray[np.float64]

_ROOM = 1.001
"""For the rounding of the radii themselves."""


def real_counts(c: Array) -> tuple[NDArray[np.int_], NDArray[np.int_], NDArray[np.bool_]]:
    """Numbers of negative and of positive real roots of the rows, and where discs touch one another, 0 or both sides.

    Rows must have a leading coefficient other than 0 and be finite; a real root counts once where it is in no doubt.
    """
    n = c.shape[1] - 1
    z = roots(c)
    with np.errstate(all="ignore"):
        value, size = np.zeros_like(z), np.zeros(z.shape)
        for column in c.T:
            value = value * z + column[:, None]
            size = size * np.abs(z) + np.abs(column)[:, None]
        apart = z[:, :, None] - z[:, None, :]
        others = np.abs(np.prod(np.where(np.eye(n, dtype=bool), c[:, :1, None], apart), axis=2))
        rounding = 8 * n * np.finfo(float).eps * size  # of Horner's rule in complex numbers, with room
        radius = _ROOM * n * (np.abs(value) + rounding) / others
        distance = np.where(np.eye(n, dtype=bool), np.inf, np.abs(apart))
        isolated = np.all(distance > _ROOM * (radius[:, :, None] + radius[:, None, :]), axis=2)
        real = z.imag == 0
        decided = np.where(real, np.abs(z.real) > _ROOM * radius, np.abs(z.imag) > _ROOM * radius)
        doubtful = ~np.all(isolated & decided, axis=1)
    negative, positive = np.sum(real & (z.real < 0), axis=1), np.sum(real & (z.real > 0), axis=1)
    return np.asarray(negative), np.asarray(positive), doubtful
