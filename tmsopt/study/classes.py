"""What kind of motion designs have, from the coefficients of their characteristic polynomials."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tmsopt.roots import CLASSES, abscissa_and_damping, is_stable, quartic_classes, real_roots, roots

__all__ = ["CLASSES", "Classified", "classified", "classify"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Classified:
    """Classes and roots of many designs; None for what was not asked for.

    Attributes:
        kind: class codes, decided by coefficients.
        real_roots: number of different real roots, from coefficients.
        abscissa, damping_ratio: from roots that are jointly right next to an exceptional point; nan if undefined.
        fallbacks: number of designs whose roots needed companion eigenvalues.
    """

    kind: NDArray[np.int8] | None = None
    real_roots: NDArray[np.int8] | None = None
    abscissa: Array | None = None
    damping_ratio: Array | None = None
    fallbacks: int = 0


def classified(coefficients: Sequence[Array], wanted: Collection[str], engine: str = "numpy") -> Classified:
    """Classes and roots of designs whose coefficients, descending, are arrays of one shape.

    Args:
        wanted: names among those of `Classified`.
        engine: ``numpy`` or ``numba``; classes do not depend on it.
    """
    if len(coefficients) != _QUARTIC:
        shape = coefficients[0].shape
        kind, real, alpha, ratio = classify(np.stack([c.ravel() for c in coefficients], axis=-1))
        fallbacks = int(np.count_nonzero(kind))
        return Classified(
            kind.reshape(shape), real.reshape(shape), alpha.reshape(shape), ratio.reshape(shape), fallbacks
        )
    compiled = engine == "numba"
    a0, a1, a2, a3, a4 = coefficients
    found = Classified()
    if {"kind", "real_roots"} & set(wanted):
        kinds = quartic_classes(a0, a1, a2, a3, a4, compiled=compiled)
        found = replace(found, kind=kinds.kind, real_roots=kinds.real_roots)
    if {"abscissa", "damping_ratio"} & set(wanted):
        motion = abscissa_and_damping(a0, a1, a2, a3, a4, compiled=compiled)
        found = replace(found, abscissa=motion.abscissa, damping_ratio=motion.damping_ratio, fallbacks=motion.fallbacks)
    return found


_QUARTIC = 5
"""Coefficients of the degree that has formulas of its own; others take the eigenvalues of companion matrices."""


def classify(a: Array) -> tuple[NDArray[np.int8], NDArray[np.int8], Array, Array]:
    """Class code, number of real roots, abscissa and damping ratio for coefficients of shape (designs, n + 1)."""
    count, n = len(a), a.shape[1] - 1
    kind, real = np.zeros(count, dtype=np.int8), np.zeros(count, dtype=np.int8)
    alpha, ratio = np.full(count, np.nan), np.full(count, np.nan)
    regular = np.flatnonzero(np.all(np.isfinite(a), axis=1) & (a[:, 0] != 0))
    if not regular.size:
        return kind, real, alpha, ratio
    c = a[regular]
    negative, positive = real_roots(c)
    zero = c[:, -1] == 0
    stable = is_stable(c)
    unstable = np.where((positive > 0) | zero, CLASSES.index("capsize"), CLASSES.index("weave"))
    damped = np.where(negative == n, CLASSES.index("heavily damped"), CLASSES.index("stable"))
    kind[regular] = np.where(stable, damped, unstable)
    real[regular] = negative + positive + zero
    z = roots(c)
    alpha[regular] = z.real.max(axis=1)
    ratio[regular] = np.min(-z.real / (np.abs(z) + 1e-300), axis=1)
    return kind, real, alpha, ratio
