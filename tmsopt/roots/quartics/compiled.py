"""The elementwise formulas of quartics in loops that numba compiles (extra ``fast``).

The functions are those of NumPy, compiled with `where` for one number. The rounding is the same: numba without
``fastmath`` keeps the order of operations and contracts none. The arrays of a block stand in one scratch array at fixed
distances, so that the compiler sees that they do not overlap and does four numbers at a time.
"""

from collections.abc import Callable
from functools import cache
from types import FunctionType
from typing import Any, Literal

import numpy as np

from tmsopt.roots.quartics import factors, signs
from tmsopt.roots.quartics.degenerate import ACCEPTED, GOOD, STEPS
from tmsopt.roots.quartics.factors import abscissa, damping_ratio, error, monic, newton, start
from tmsopt.roots.quartics.signs import classes as class_of, stable as is_stable

_FORMULAS = (
    factors.third_of_exponent, factors.cube_root, factors.largest_root, factors.ordered, monic, start, error, newton,
    abscissa, damping_ratio,
)  # fmt: skip
"""Each uses only those before it."""

_N = 512  # numbers of a block; with nine arrays of them it stays in the first cache

Loop = Callable[..., None]
"""Fills the arrays that come after the flat arrays a0 … a4."""


def loop(name: Literal["factors", "motion", "classes", "stable"]) -> Loop:
    """A compiled loop over quartics; the first call of each name in a process compiles it.

    ``factors`` fills p, q of shape (quartics, 2) and which are left, not accepted; ``motion`` abscissa, damping ratio
    and which are left; ``classes`` codes, counts and which are in doubt; ``stable`` verdicts. They hold no lock.

    Raises:
        ModuleNotFoundError: without numba.
    """
    return _compiled(name)


@cache
def _compiled(name: str) -> Loop:
    import numba
    from numba import types

    # One signature, which takes arrays that may be written and those that may not: no array of a user compiles anew.
    given = [types.Array(types.float64, 1, "C", readonly=True)] * 5
    numbers, pairs = types.float64[::1], types.float64[:, ::1]
    codes, truths = types.int8[::1], types.boolean[::1]
    body, filled = {
        "factors": (_factors, (pairs, pairs, truths)), "motion": (_motion, (numbers, numbers, truths)),
        "classes": (_classes, (codes, codes, truths)), "stable": (_stable, (truths,)),
    }[name]  # fmt: skip
    compiled: Loop = numba.njit(types.void(*given, *filled), error_model="numpy", nogil=True)(_bound(body, _known()))
    return compiled


@cache
def _known() -> dict[str, Any]:
    """What the loops call, by the names that they use; each is compiled when the first loop needs it."""
    import numba

    inlined = numba.njit(error_model="numpy", nogil=True, forceinline=True)
    known: dict[str, Any] = {"where": inlined(_choose), "one": inlined(_as_integer)}
    for each in _FORMULAS:
        known[each.__name__] = inlined(_bound(each, known))
    known["is_stable"] = inlined(_bound(signs.stable, known))
    known["class_of"] = inlined(_bound(signs.classes, known | {"stable": known["is_stable"]}))
    known["_factor_block"] = numba.njit(error_model="numpy", nogil=True)(_bound(_factor_block, known))
    return known


def _bound(function: Any, known: dict[str, Any]) -> FunctionType:
    """A function in which the names known are others."""
    return FunctionType(function.__code__, {**function.__globals__, **known}, function.__name__)


def _as_integer(condition: Any) -> Any:
    return 1 if condition else 0


def _choose(condition: Any, yes: Any, no: Any) -> Any:
    return yes if condition else no


def _factor_block(a0: Any, a1: Any, a2: Any, a3: Any, a4: Any, first: int, n: int, x: Any) -> None:
    """Into x, in parts of _N: b1 … b4, then p1, q1, p2, q2 and the error."""
    for k in range(n):
        i = first + k
        x[k], x[_N + k], x[2 * _N + k], x[3 * _N + k] = monic(a0[i], a1[i], a2[i], a3[i], a4[i])
    for k in range(_N):
        b1, b2, b3, b4 = x[k], x[_N + k], x[2 * _N + k], x[3 * _N + k]
        p1, q1, p2, q2 = start(b1, b2, b3, b4)
        x[4 * _N + k], x[5 * _N + k], x[6 * _N + k], x[7 * _N + k] = p1, q1, p2, q2
        x[8 * _N + k] = error(b1, b2, b3, b4, p1, q1, p2, q2)
    for k in range(n):
        e = x[8 * _N + k]
        if e <= GOOD:
            continue
        b1, b2, b3, b4 = x[k], x[_N + k], x[2 * _N + k], x[3 * _N + k]
        p1, q1, p2, q2 = x[4 * _N + k], x[5 * _N + k], x[6 * _N + k], x[7 * _N + k]
        for _ in range(STEPS):
            n1, m1, n2, m2 = newton(b1, b2, b3, b4, p1, q1, p2, q2)
            f = error(b1, b2, b3, b4, n1, m1, n2, m2)
            if not f < e:
                break
            p1, q1, p2, q2, e = n1, m1, n2, m2, f
            if e <= GOOD:
                break
        x[4 * _N + k], x[5 * _N + k], x[6 * _N + k], x[7 * _N + k], x[8 * _N + k] = p1, q1, p2, q2, e


def _factors(a0: Any, a1: Any, a2: Any, a3: Any, a4: Any, p: Any, q: Any, left: Any) -> None:
    x = np.ones(9 * _N)
    for first in range(0, a0.size, _N):
        n = min(_N, a0.size - first)
        _factor_block(a0, a1, a2, a3, a4, first, n, x)
        for k in range(n):
            i = first + k
            p[i, 0], q[i, 0], p[i, 1], q[i, 1] = x[4 * _N + k], x[5 * _N + k], x[6 * _N + k], x[7 * _N + k]
            left[i] = not x[8 * _N + k] <= ACCEPTED


def _motion(a0: Any, a1: Any, a2: Any, a3: Any, a4: Any, alpha: Any, ratio: Any, left: Any) -> None:
    x = np.ones(9 * _N)
    for first in range(0, a0.size, _N):
        n = min(_N, a0.size - first)
        _factor_block(a0, a1, a2, a3, a4, first, n, x)
        for k in range(n):
            p1, q1, p2, q2 = x[4 * _N + k], x[5 * _N + k], x[6 * _N + k], x[7 * _N + k]
            alpha[first + k] = max(abscissa(p1, q1), abscissa(p2, q2))
            ratio[first + k] = min(damping_ratio(p1, q1), damping_ratio(p2, q2))
        for k in range(n):
            left[first + k] = not x[8 * _N + k] <= ACCEPTED


def _classes(a0: Any, a1: Any, a2: Any, a3: Any, a4: Any, kind: Any, count: Any, doubtful: Any) -> None:
    for k in range(a0.size):
        kind[k], count[k], doubtful[k] = class_of(a0[k], a1[k], a2[k], a3[k], a4[k])


def _stable(a0: Any, a1: Any, a2: Any, a3: Any, a4: Any, verdict: Any) -> None:
    for k in range(a0.size):
        verdict[k] = is_stable(a0[k], a1[k], a2[k], a3[k], a4[k])
