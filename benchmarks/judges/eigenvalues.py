"""Roots as eigenvalues of companion matrices, many polynomials at once, and what they say of a design."""

import numpy as np
from numpy.typing import NDArray

from benchmarks.judges.text import NOWHERE
from tmsopt.records import Array

Roots = NDArray[np.complex128]


def companion(a: Array) -> Array:
    """Stacked companion matrices, as in `numpy.roots`, of coefficients (…, n + 1), highest power first."""
    n = a.shape[-1] - 1
    found = np.zeros((*a.shape[:-1], n, n))
    found[..., 0, :] = -a[..., 1:] / a[..., :1]
    found[..., np.arange(1, n), np.arange(n - 1)] = 1
    return found


def eigenvalues(a: Array) -> Roots:
    """Roots of coefficients (…, n + 1); `NOWHERE` where the mass matrix is singular."""
    regular = (np.all(np.isfinite(a), axis=-1) & (a[..., 0] != 0))[..., None]
    unit = np.eye(1, a.shape[-1])[0]
    return np.where(regular, np.linalg.eigvals(companion(np.where(regular, a, unit))), NOWHERE + 0j)


def root_values(z: Roots) -> tuple[Array, Array]:
    """Abscissa and damping ratio of roots along the last axis."""
    size = np.abs(z)
    ratio = np.where(size > 0, -z.real / np.where(size > 0, size, 1.0), 0.0)
    return z.real.max(axis=-1), ratio.min(axis=-1)


def worst_roots(a: Array) -> tuple[Array, Array]:
    """Largest abscissa and least damping ratio, over the last but one axis of coefficients (designs, cases, n + 1)."""
    abscissa, damping = root_values(eigenvalues(a))
    return abscissa.max(axis=-1), np.where(abscissa < NOWHERE, damping, -1.0).min(axis=-1)
