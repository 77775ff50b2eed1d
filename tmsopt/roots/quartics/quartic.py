"""Roots of many real quartics at once, as their two real quadratic factors, in NumPy or compiled by numba.

Every quartic is factored in closed form and, where the factors do not give its coefficients back to 4e-15, by Newton's
method on the factors. The few that this leaves beyond 5e-14 go to `hard_factors`.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tmsopt.records import Array
from tmsopt.roots.quartics import factors
from tmsopt.roots.quartics.degenerate import ACCEPTED, GOOD, STEPS, hard_factors, polish

Columns = tuple[Array, Array, Array, Array, Array]
Four = factors.Four

_BLOCK = 8192  # numbers of an array that stay in the cache between two operations


@dataclass(frozen=True)
class Factors:
    """Factors (s² + p s + q) of monic quartics.

    Attributes:
        p, q: shape (…, 2); nan for coefficients that are not finite or a leading 0.
        fallbacks: number of quartics that needed companion eigenvalues.

    Example:
        >>> factors = tmsopt.roots.quartic_factors(1, 0, 5, 0, 4, compiled=False)  # (s² + 1)(s² + 4)
        >>> sorted(factors.q.round(9).tolist())
        [1.0, 4.0]

    More: docs/explanation/factors.md
    """

    p: Array
    q: Array
    fallbacks: int

    @property
    def roots(self) -> NDArray[np.complex128]:
        """All roots, shape (…, 4), those of a factor side by side; conjugates are exact."""
        with np.errstate(all="ignore"):
            pair = np.stack(factors.root_pair(self.p, self.q), axis=-1)
        return np.asarray(pair.reshape(*self.p.shape[:-1], 4))


@dataclass(frozen=True)
class Motion:
    """Spectral abscissa max Re s and damping ratio min −Re s/|s| over the roots, a root at 0 counting 0.

    Attributes:
        abscissa, damping_ratio: shape (…); nan for coefficients that are not finite or a leading 0.
        fallbacks: number of quartics that needed companion eigenvalues.

    Example:
        >>> motion = tmsopt.roots.abscissa_and_damping(1, 4, 8, 8, 4, compiled=False)  # (s² + 2 s + 2)²: s = -1 ± i
        >>> f"{motion.abscissa:.6f} {motion.damping_ratio:.6f}"
        '-1.000000 0.707107'

    More: docs/how_to/charts.md
    """

    abscissa: Array
    damping_ratio: Array
    fallbacks: int


def quartic_factors(
    a0: ArrayLike, a1: ArrayLike, a2: ArrayLike, a3: ArrayLike, a4: ArrayLike, *, compiled: bool | None = None
) -> Factors:
    """Real quadratic factors of the quartics a0 s⁴ + … + a4, coefficients of any shapes that broadcast.

    The coefficients that the factors give back have a `backward_error` of 1e-13 at most, beside exceptional points too.

    Args:
        compiled: by numba, or in NumPy alone; by default compiled where numba is installed.

    Raises:
        ValueError: for shapes that cannot be broadcast.
        ModuleNotFoundError: for compiled without numba.

    Example:
        >>> factors = tmsopt.roots.quartic_factors(1, 4, 6, 4, 1, compiled=False)  # (s² + 2 s + 1)²
        >>> factors.p.round(6).tolist(), factors.q.round(6).tolist()
        ([2.0, 2.0], [1.0, 1.0])

    More: docs/explanation/factors.md
    """
    a, shape = columns(a0, a1, a2, a3, a4)
    p, q = np.empty((a[0].size, 2)), np.empty((a[0].size, 2))
    if use_numba(compiled):
        from tmsopt.roots.quartics.compiled import loop

        left = np.empty(a[0].size, dtype=bool)
        loop("factors")(*a, p, q, left)
        rows = np.flatnonzero(left)
    else:
        remaining = []
        for block, found, left_of_block in _blocks(a):
            p[block, 0], q[block, 0], p[block, 1], q[block, 1] = found
            remaining.append(left_of_block)
        rows = np.concatenate(remaining) if remaining else np.empty(0, dtype=int)
    (p1, q1, p2, q2), unit, fallbacks = hard_factors(np.stack([c[rows] for c in a]))
    with np.errstate(all="ignore"):  # the product of two large roots need not be a double
        p[rows, 0], p[rows, 1] = np.ldexp(p1, unit), np.ldexp(p2, unit)
        q[rows, 0], q[rows, 1] = np.ldexp(q1, 2 * unit), np.ldexp(q2, 2 * unit)
    return Factors(p.reshape(*shape, 2), q.reshape(*shape, 2), fallbacks)


def abscissa_and_damping(
    a0: ArrayLike, a1: ArrayLike, a2: ArrayLike, a3: ArrayLike, a4: ArrayLike, *, compiled: bool | None = None
) -> Motion:
    """Abscissa and damping ratio of the quartics a0 s⁴ + … + a4; arguments and errors as of `quartic_factors`.

    Example:
        >>> motion = tmsopt.roots.abscissa_and_damping(1, 10, 35, 50, 24, compiled=False)  # roots -1, -2, -3, -4
        >>> f"{motion.abscissa:.6f} {motion.damping_ratio:.6f}"
        '-1.000000 1.000000'

    More: docs/how_to/charts.md
    """
    a, shape = columns(a0, a1, a2, a3, a4)
    alpha, ratio = np.empty(a[0].size), np.empty(a[0].size)
    if use_numba(compiled):
        from tmsopt.roots.quartics.compiled import loop

        left = np.empty(a[0].size, dtype=bool)
        loop("motion")(*a, alpha, ratio, left)
        rows = np.flatnonzero(left)
    else:
        remaining = []
        for block, found, left_of_block in _blocks(a):
            alpha[block], ratio[block] = _motion(found)
            remaining.append(left_of_block)
        rows = np.concatenate(remaining) if remaining else np.empty(0, dtype=int)
    (p1, q1, p2, q2), unit, fallbacks = hard_factors(np.stack([c[rows] for c in a]))
    late, ratio[rows] = _motion((p1, q1, p2, q2))
    with np.errstate(all="ignore"):  # a root of coefficients of very different sizes need not be a double
        alpha[rows] = np.ldexp(late, unit)
    return Motion(alpha.reshape(shape), ratio.reshape(shape), fallbacks)


def columns(*coefficients: ArrayLike) -> tuple[Columns, tuple[int, ...]]:
    """The coefficients as flat arrays of doubles of one size, and the shape that they broadcast to.

    Raises:
        ValueError: for shapes that cannot be broadcast.
    """
    given = [np.asarray(c, dtype=float) for c in coefficients]
    shape = np.broadcast_shapes(*(c.shape for c in given))
    flat = [np.ascontiguousarray(np.broadcast_to(c, shape)).reshape(-1) for c in given]
    return (flat[0], flat[1], flat[2], flat[3], flat[4]), shape


def use_numba(compiled: bool | None) -> bool:
    """Whether to compile.

    Raises:
        ModuleNotFoundError: if asked for without numba.
    """
    if compiled is False:
        return False
    present = find_spec("numba") is not None
    if compiled and not present:
        raise ModuleNotFoundError('compiled loops need numba: pip install "tmsopt[fast]"', name="numba")
    return present if compiled is None else compiled


def _motion(found: Four) -> tuple[Array, Array]:
    p1, q1, p2, q2 = found
    with np.errstate(all="ignore"):
        alpha = np.maximum(factors.abscissa(p1, q1), factors.abscissa(p2, q2))
        ratio = np.minimum(factors.damping_ratio(p1, q1), factors.damping_ratio(p2, q2))
    return alpha, np.where(np.isnan(alpha), np.nan, ratio)


def _blocks(a: Columns) -> Iterator[tuple[slice, Four, NDArray[np.int_]]]:
    """Factors by block, and the rows whose error is not accepted."""
    for first in range(0, a[0].size, _BLOCK):
        block = slice(first, min(first + _BLOCK, a[0].size))
        with np.errstate(all="ignore"):
            monic = factors.monic(*(c[block] for c in a))
            found = factors.start(*monic)
            error = factors.error(*monic, *found)
            rows = np.flatnonzero(~(error <= GOOD))
            some, some_error = np.stack([f[rows] for f in found]), error[rows]
            polish(np.stack([b[rows] for b in monic]), some, some_error, STEPS)
            for whole, part in zip(found, some, strict=True):
                whole[rows] = part
        yield block, found, first + rows[~(some_error <= ACCEPTED)]
