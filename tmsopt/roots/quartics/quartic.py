"""Roots of many real quartics at once, as their two real quadratic factors.

Every quartic is factored in closed form. If the factors do not reproduce its coefficients to 4e-15, Newton's method
refines them. The error of a few quartics is then still above 5e-14: they have roots of very different size, tiny or
huge roots, or several roots at 0. Companion eigenvalues solve them, in a unit near the largest root.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tmsopt.deprecated import ignore_option
from tmsopt.records import Array
from tmsopt.roots.numeric import GOOD_ERROR, polish, quadratic_roots, roots
from tmsopt.roots.quartics import factors

_BLOCK = 2**14  # elements of a part of an array; so many stay in the cache between two operations

MAX_ERROR = 5e-14
"""Backward error above which companion eigenvalues are used."""
MAX_STEPS = 4
"""Largest number of Newton steps after the closed form; one step is nearly always enough."""


@dataclass(frozen=True)
class Factors:
    """Factors (s² + p s + q) of monic quartics.

    Attributes:
        p, q: shape (…, 2); nan for coefficients that are not finite or a leading 0.
        fallbacks: number of quartics that needed companion eigenvalues.

    Example:
        >>> factors = tmsopt.roots.quartic_factors(1, 0, 5, 0, 4)  # (s² + 1)(s² + 4)
        >>> sorted(factors.q.round(9).tolist())
        [1.0, 4.0]

    More: docs/explanation/factors.md
    """

    p: Array
    q: Array
    fallbacks: int

    @property
    def roots(self) -> NDArray[np.complex128]:
        """All roots, shape (…, 4). The roots of a factor are adjacent; complex ones are exact conjugates."""
        return quadratic_roots(self.p, self.q)


@dataclass(frozen=True)
class Motion:
    """Spectral abscissa max Re s and damping ratio min −Re s/|s| over the roots. The damping ratio of a root 0 is 0.

    Attributes:
        abscissa, damping_ratio: shape (…); nan for coefficients that are not finite or a leading 0.
        fallbacks: number of quartics that needed companion eigenvalues.

    Example:
        >>> motion = tmsopt.roots.abscissa_and_damping(1, 4, 8, 8, 4)  # (s² + 2 s + 2)²: s = -1 ± i
        >>> f"{motion.abscissa:.6f} {motion.damping_ratio:.6f}"
        '-1.000000 0.707107'

    More: docs/how_to/charts.md
    """

    abscissa: Array
    damping_ratio: Array
    fallbacks: int


@ignore_option("compiled")
def quartic_factors(a0: ArrayLike, a1: ArrayLike, a2: ArrayLike, a3: ArrayLike, a4: ArrayLike) -> Factors:
    """Real quadratic factors of the quartics a0 s⁴ + … + a4. The shapes of the coefficients must broadcast.

    The factors have a `backward_error` of at most 1e-13, even near exceptional points.

    Raises:
        ValueError: for shapes that cannot be broadcast.

    Example:
        >>> factors = tmsopt.roots.quartic_factors(1, 4, 6, 4, 1)  # (s² + 2 s + 1)²
        >>> factors.p.round(6).tolist(), factors.q.round(6).tolist()
        ([2.0, 2.0], [1.0, 1.0])

    More: docs/explanation/factors.md
    """
    a, shape = flatten_columns(a0, a1, a2, a3, a4)
    p, q = np.empty((2, a[0].size, 2))
    fallbacks = _fill_results((p, q), a, _stack_factors)
    return Factors(p.reshape(*shape, 2), q.reshape(*shape, 2), fallbacks)


@ignore_option("compiled")
def abscissa_and_damping(a0: ArrayLike, a1: ArrayLike, a2: ArrayLike, a3: ArrayLike, a4: ArrayLike) -> Motion:
    """Abscissa and damping ratio of the quartics a0 s⁴ + … + a4; arguments and errors as for `quartic_factors`.

    Example:
        >>> motion = tmsopt.roots.abscissa_and_damping(1, 10, 35, 50, 24)  # roots -1, -2, -3, -4
        >>> f"{motion.abscissa:.6f} {motion.damping_ratio:.6f}"
        '-1.000000 1.000000'

    More: docs/how_to/charts.md
    """
    a, shape = flatten_columns(a0, a1, a2, a3, a4)
    abscissae, ratios = np.empty((2, a[0].size))
    fallbacks = _fill_results((abscissae, ratios), a, _measure)
    return Motion(abscissae.reshape(shape), ratios.reshape(shape), fallbacks)


def flatten_columns(*coefficients: ArrayLike) -> tuple[list[Array], tuple[int, ...]]:
    """The coefficients as flat arrays of equal size, and the shape that they broadcast to.

    Raises:
        ValueError: for shapes that cannot be broadcast.
    """
    columns = np.broadcast_arrays(*[np.asarray(c, dtype=float) for c in coefficients])
    return [np.ascontiguousarray(c).reshape(-1) for c in columns], columns[0].shape


def make_blocks(size: int) -> list[slice]:
    """Slices of an array that stay in the cache between two operations."""
    return [slice(start, start + _BLOCK) for start in range(0, size, _BLOCK)]


def _fill_results(results: Sequence[Array], a: Sequence[Array], finish: Callable[..., tuple[Array, Array]]) -> int:
    """Fill the results from the factors of quartics.

    Args:
        finish: function of the factors p1, q1, p2, q2 and the exponent m of their unit 2^m; it computes
            the results.

    Returns:
        The number of quartics that needed companion eigenvalues.
    """
    unsolved_rows = [np.empty(0, dtype=int)]
    with np.errstate(all="ignore"):  # roots may exceed doubles
        for block in make_blocks(a[0].size):
            monic = factors.monic(*[c[block] for c in a])
            pq = factors.closed_form_factors(*monic)
            error = factors.error(*monic, *pq)
            rows = np.flatnonzero(~(error <= GOOD_ERROR))
            refined, refined_error = np.stack([x[rows] for x in pq]), error[rows]
            _refine(np.stack([b[rows] for b in monic]), refined, refined_error)
            for x, values in zip(pq, refined, strict=True):
                x[rows] = values
            for result, values in zip(results, finish(*pq, 0), strict=True):
                result[block] = values
            unsolved_rows.append(block.start + rows[~(refined_error <= MAX_ERROR)])
        rows = np.concatenate(unsolved_rows)
        if not rows.size:
            return 0
        by_eigenvalues, unit_exponent, fallbacks = _factors_by_eigenvalues(np.stack([c[rows] for c in a]))
        for result, values in zip(results, finish(*by_eigenvalues, unit_exponent), strict=True):
            result[rows] = values
    return fallbacks


def _refine(b: Array, pq: Array, error: Array) -> None:
    """Newton steps on the factors, in place."""
    polish(
        pq.T,
        error,
        lambda trial, rows: np.stack(factors.newton_step(*b[:, rows], *trial.T), axis=1),
        lambda trial, rows: np.asarray(factors.error(*b[:, rows], *trial.T)),
        MAX_STEPS,
    )


def _factors_by_eigenvalues(c: Array) -> tuple[Array, NDArray[np.int_], int]:
    """Factors p1, q1, p2, q2 of quartics with coefficients of shape (5, quartics).

    Each quartic has its own unit 2^m.

    Returns:
        The factors, which are nan if a coefficient is not finite or the leading one is 0; the exponents m; the
        number of quartics whose factors are not nan.
    """
    pq, unit_exponent = np.full((4, c.shape[1]), np.nan), np.zeros(c.shape[1], dtype=int)
    regular_columns = np.flatnonzero(np.all(np.isfinite(c), axis=0) & (c[0] != 0))
    if regular_columns.size:
        monic, unit_exponent[regular_columns] = _scale_roots(c[:, regular_columns])
        z = roots(np.concatenate([np.ones_like(monic[:1]), monic]).T).reshape(-1, 2, 2)
        p, q = -z.sum(axis=2).real, z.prod(axis=2).real
        pq[:, regular_columns] = p[:, 0], q[:, 0], p[:, 1], q[:, 1]
    return pq, unit_exponent, regular_columns.size


def _scale_roots(c: Array) -> tuple[Array, NDArray[np.int_]]:
    """Monic coefficients in a unit 2^m near the largest root, and m. Only the division by the first coefficient rounds.

    The unit is found from Fujiwara's bound.
    """
    _, exponent = np.frexp(c)
    power = np.arange(1, 5)[:, None]
    bound = np.where(c[1:] != 0, (exponent[1:] - exponent[0]) / power, -np.inf).max(axis=0)
    unit_exponent = np.where(np.isfinite(bound), np.ceil(bound), 0).astype(int)
    lead = np.ldexp(c[0], -exponent[0])
    return np.ldexp(c[1:], -exponent[0] - unit_exponent * power) / lead, unit_exponent


def _stack_factors(p1: Array, q1: Array, p2: Array, q2: Array, unit_exponent: Any) -> tuple[Array, Array]:
    """p and q of both factors, each of shape (quartics, 2)."""
    p, q = np.ldexp([p1, p2], unit_exponent), np.ldexp([q1, q2], 2 * unit_exponent)
    return p.T, q.T


def _measure(p1: Array, q1: Array, p2: Array, q2: Array, unit_exponent: Any) -> tuple[Array, Array]:
    """Abscissa and damping ratio; nan if there are no factors."""
    abscissae = np.maximum(factors.abscissa(p1, q1), factors.abscissa(p2, q2))
    ratios = np.minimum(factors.damping_ratio(p1, q1), factors.damping_ratio(p2, q2))
    return np.ldexp(abscissae, unit_exponent), np.where(np.isnan(abscissae), np.nan, ratios)
