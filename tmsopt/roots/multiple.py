"""Real-rooted polynomials with a multiple root, recognised by coefficients."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tmsopt.roots.numeric import rebuilt, roots
from tmsopt.roots.structure import Root

Array = NDArray[np.float64]

_STEPS = 20
_NEAR = 0.05  # relative distance of a guess that can still lead to a polynomial within any sensible tolerance


def multiple_real_roots(coefficients: ArrayLike, tolerance: float) -> tuple[Root, ...] | None:
    """Roots of the nearest polynomial whose roots are all real and two of them equal; None where none is near.

    Numeric roots are gathered from the closest neighbours on, the most degenerate first, and ∏ (s − rᵢ)^mᵢ is fitted
    to the coefficients, descending, shape (n + 1,), with a leading one other than 0. It is near within `tolerance`:
    the root sum of squares of the changes, each relative to the terms that make up a coefficient.
    """
    c = np.asarray(coefficients, dtype=float)
    z = roots(c)
    z = z[np.lexsort((z.imag, z.real))]
    size = np.maximum(rebuilt(-np.abs(z).astype(complex)), 1e-100)
    gaps = np.abs(np.diff(z)) / (np.abs(z[1:]) + np.abs(z[:-1]) + 1e-300)
    for cuts in range(len(z) - 1):
        ends = np.sort(np.argsort(-gaps, kind="stable")[:cuts]) + 1
        groups = np.split(z, ends)
        means, multiplicity = np.array([g.mean().real for g in groups]), [len(g) for g in groups]
        if _distance(c / c[0], means, multiplicity, size) > _NEAR:
            continue
        fitted = _fit(c / c[0], means, multiplicity, size)
        if _distance(c / c[0], fitted, multiplicity, size) <= tolerance:
            found = [Root(float(r), 0.0, len(g)) for r, g in zip(fitted, groups, strict=True)]
            return tuple(sorted(found, key=lambda r: -r.re))
    return None


def _distance(monic: Array, r: Array, multiplicity: list[int], size: Array) -> float:
    return float(np.linalg.norm((monic - rebuilt(np.repeat(r, multiplicity).astype(complex))) / size))


def _fit(monic: Array, r: Array, multiplicity: list[int], size: Array) -> Array:
    """Least squares of the relative residuals by Gauss and Newton."""
    for _ in range(_STEPS):
        whole = rebuilt(np.repeat(r, multiplicity).astype(complex))
        columns = []
        for k in range(len(r)):
            less = [m - (j == k) for j, m in enumerate(multiplicity)]
            columns.append(-multiplicity[k] * np.concatenate([[0.0], rebuilt(np.repeat(r, less).astype(complex))]))
        step = np.linalg.lstsq(np.stack(columns, axis=1) / size[:, None], (monic - whole) / size, rcond=None)[0]
        r = r + step
        if np.all(np.abs(step) <= 1e-15 * np.abs(r)):
            break
    return r
