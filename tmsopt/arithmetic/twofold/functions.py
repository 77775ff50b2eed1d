"""Elementary functions of numbers with twice the digits of a double."""

from functools import cache
from typing import Any

import flint
import numpy as np

from tmsopt.arithmetic.twofold.numbers import Twofold, twofold
from tmsopt.records import Array

_BITS = 160
_PARTS = 16  # of π, between which sine and cosine are tabulated
_FARTHEST = 1e4  # argument of a sine; beyond it the bound on the error is lost
_TRUNCATED = 1e-27  # relative: the fourth terms and those after them are doubles, 2.4e-13 of the sum at most


def sine_cosine(x: Twofold) -> tuple[Twofold, Twofold]:
    """Sine and cosine: by tables at the nearest sixteenth of π, and power series of what is left."""
    step, sines, cosines = _tables()
    near = np.abs(x.high) < _FARTHEST
    turns = np.rint(np.where(near, x.high, 0.0) * (_PARTS / np.pi))[()]
    place = turns.astype(np.int64) % (2 * _PARTS)
    t = x - step * turns
    square = t * t
    u = square.high
    last = u * u * u * u
    tail = last * (1 / 362880 - u * (1 / 39916800 - u * (1 / 6227020800 - u / 1307674368000)))
    sine = t + t * (square * (square * (square * _SERIES[7] + _SERIES[5]) + _SERIES[3]) + tail)
    tail = last * (1 / 40320 - u * (1 / 3628800 - u * (1 / 479001600 - u / 87178291200)))
    cosine = square * (square * (square * _SERIES[6] + _SERIES[4]) + _SERIES[2]) + tail + 1
    at, along = sines[place], cosines[place]
    lost = np.where(near, _TRUNCATED, np.inf)[()]
    found = [(at * cosine + along * sine, at), (along * cosine - at * sine, along)]
    one, other = (Twofold(f.high, f.low, f.off + lost * (abs(of.high) + abs(sine.high))) for f, of in found)
    return one, other


def by_balls(name: str, x: Twofold) -> Twofold:
    """A function of each number by ball arithmetic, one after the other."""
    high, low, off = (np.asarray(a, dtype=float) for a in np.broadcast_arrays(x.high, x.low, x.off))
    found = np.empty((3, high.size))
    with flint.ctx.workprec(_BITS):
        for k, (h, rest, r) in enumerate(zip(high.ravel(), low.ravel(), off.ravel(), strict=True)):
            found[:, k] = _split(getattr(flint.arb(float(h)) + flint.arb(float(rest), float(r)), name)())
    return Twofold(*(part.reshape(high.shape)[()] for part in found))


def _split(ball: Any) -> tuple[float, float, float]:
    if not ball.is_finite():
        return np.nan, np.nan, np.inf
    high = float(ball.mid())
    rest = ball - flint.arb(high)
    low = float(rest.mid())
    return high, low, float((rest - flint.arb(low)).abs_upper())


@cache
def _tables() -> tuple[Twofold, Twofold, Twofold]:
    """π/16, and sine and cosine of its multiples."""
    with flint.ctx.workprec(_BITS):
        step = flint.arb.pi() / _PARTS
        angles = [step * k for k in range(2 * _PARTS)]
        each = [[_split(a.sin()) for a in angles], [_split(a.cos()) for a in angles]]
        sines, cosines = (Twofold(*np.array(rows).T) for rows in each)
        return Twofold(*_split(step)), sines, cosines


def _inverse_factorials() -> dict[int, Twofold]:
    found, product = {}, 1
    for k in range(2, 8):
        product *= k
        found[k] = twofold(flint.fmpq((-1) ** (k // 2), product))
    return found


_SERIES: dict[int, Twofold] = _inverse_factorials()
