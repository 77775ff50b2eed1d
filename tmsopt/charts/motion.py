"""What kind of motion designs have, from the coefficients of their characteristic polynomials."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray

from tmsopt.errors import Fault, InputError
from tmsopt.records import Array
from tmsopt.roots import CLASSES, abscissa_and_damping, is_stable, quartic_classes, real_roots, roots

ENGINES = ("auto", "numpy", "numba")
"""What computes roots and classes: numba where it is installed, or the one or the other."""


def engine_of(name: str) -> str:
    """``numpy`` or ``numba`` for one of `ENGINES`.

    Raises:
        InputError: for another name, or numba where it is not installed.
    """
    if name not in ENGINES:
        raise InputError([Fault(f"found {name!r}; accepted: {' '.join(ENGINES)}", ("engine",))])
    installed = find_spec("numba") is not None
    if name == "numba" and not installed:
        message = 'numba is not installed; run pip install "tmsopt[fast]", or take the engine numpy'
        raise InputError([Fault(message, ("engine",))])
    return "numba" if installed and name != "numpy" else "numpy"


@dataclass(frozen=True)
class Classified:
    """Classes and roots of many designs; None for what was not asked for.

    Attributes:
        kind: class codes, decided by coefficients.
        real_roots: number of different real roots, from coefficients.
        abscissa, damping_ratio: from roots that are jointly right next to an exceptional point; nan if undefined.
        fallbacks: number of designs whose roots needed companion eigenvalues: all of another degree than 4.
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
        engine: ``numpy`` or ``numba``, which only quartics use; classes do not depend on it.
    """
    if len(coefficients) != _QUARTIC:
        return _any_degree(coefficients, wanted)
    compiled = engine == "numba"
    a0, a1, a2, a3, a4 = coefficients
    found = Classified()
    if _OF_SIGNS & set(wanted):
        kinds = quartic_classes(a0, a1, a2, a3, a4, compiled=compiled)
        found = replace(found, kind=kinds.kind, real_roots=kinds.real_roots)
    if _OF_ROOTS & set(wanted):
        motion = abscissa_and_damping(a0, a1, a2, a3, a4, compiled=compiled)
        found = replace(found, abscissa=motion.abscissa, damping_ratio=motion.damping_ratio, fallbacks=motion.fallbacks)
    return found


_QUARTIC = 5
"""Coefficients of the degree that has formulas of its own; others take the eigenvalues of companion matrices."""

_OF_SIGNS, _OF_ROOTS = {"kind", "real_roots"}, {"abscissa", "damping_ratio"}

_BLOCK = 8192
"""Designs whose companion matrices are in memory at once."""


def _any_degree(coefficients: Sequence[Array], wanted: Collection[str]) -> Classified:
    shape = np.broadcast_shapes(*(c.shape for c in coefficients))
    flat = [np.broadcast_to(c, shape).ravel() for c in coefficients]
    found = Classified()
    if _OF_SIGNS & set(wanted):
        found = replace(found, kind=np.zeros(shape, np.int8), real_roots=np.zeros(shape, np.int8))
    if _OF_ROOTS & set(wanted):
        found = replace(found, abscissa=np.full(shape, np.nan), damping_ratio=np.full(shape, np.nan))
    layers = {n: v.reshape(-1) for n in (*_OF_SIGNS, *_OF_ROOTS) if (v := getattr(found, n)) is not None}
    fallbacks = 0
    for first in range(0, flat[0].size, _BLOCK):
        part = slice(first, first + _BLOCK)
        a = np.stack([c[part] for c in flat], axis=-1)
        regular = np.flatnonzero(np.all(np.isfinite(a), axis=1) & (a[:, 0] != 0))
        if not regular.size:
            continue
        if "kind" in layers:
            layers["kind"][part][regular], layers["real_roots"][part][regular] = _signs(a[regular])
        if "abscissa" in layers:
            layers["abscissa"][part][regular], layers["damping_ratio"][part][regular] = _motion(a[regular])
            fallbacks += regular.size
    return replace(found, fallbacks=fallbacks)


def _signs(c: Array) -> tuple[NDArray[np.int8], NDArray[np.int8]]:
    """Class codes and numbers of real roots of regular rows, from coefficients alone."""
    negative, positive = real_roots(c)
    zero = c[:, -1] == 0
    unstable = np.where((positive > 0) | zero, CLASSES.index("capsize"), CLASSES.index("weave"))
    damped = np.where(negative == c.shape[1] - 1, CLASSES.index("heavily damped"), CLASSES.index("stable"))
    return np.where(is_stable(c), damped, unstable).astype(np.int8), (negative + positive + zero).astype(np.int8)


def _motion(c: Array) -> tuple[Array, Array]:
    """Abscissa and damping ratio of regular rows."""
    z = roots(c)
    return z.real.max(axis=1), np.min(-z.real / (np.abs(z) + 1e-300), axis=1)


def classify(a: Array) -> tuple[NDArray[np.int8], NDArray[np.int8], Array, Array]:
    """Class code, number of real roots, abscissa and damping ratio for coefficients of shape (designs, n + 1).

    The general way for every degree, quartics too.
    """
    found = _any_degree(list(np.moveaxis(a, -1, 0)), (*_OF_SIGNS, *_OF_ROOTS))
    assert found.kind is not None
    assert found.real_roots is not None
    assert found.abscissa is not None
    assert found.damping_ratio is not None
    return found.kind, found.real_roots, found.abscissa, found.damping_ratio
