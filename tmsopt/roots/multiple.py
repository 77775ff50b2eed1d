"""Real-rooted polynomials with a multiple root, recognised by coefficients."""

import numpy as np
from numpy.typing import ArrayLike

from tmsopt.roots.fitting import gauss_newton, relative_distance
from tmsopt.roots.numeric import rebuilt, roots
from tmsopt.roots.shape import Group, Shape
from tmsopt.roots.structure import Root

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
        shape, means = (
            Shape(tuple(Group(len(g), real=True) for g in groups), 0),
            np.array([g.mean().real for g in groups]),
        )
        if relative_distance(shape, means, c / c[0], size) > _NEAR:
            continue
        fitted = gauss_newton(shape, means, c / c[0], size)
        if relative_distance(shape, fitted, c / c[0], size) <= tolerance:
            found = [Root(float(r), 0.0, len(g)) for r, g in zip(fitted, groups, strict=True)]
            return tuple(sorted(found, key=lambda r: -r.re))
    return None
