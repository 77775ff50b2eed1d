"""Random rational bicycles, each with the five printed conditions and its stability by Liénard–Chipart."""

import random
from collections.abc import Iterator
from functools import cache
from typing import Any

from tmsopt import laws
from tmsopt.algebra.balls import Tilt, rational
from tmsopt.models import copo
from tmsopt.paper.ledger.algebra import is_stable

_COUNT = 4000
_LAWS: Any = laws  # typed loosely, because the laws accept exact numbers too


@cache
def draw_sample() -> list[dict[str, Any]]:
    """Bicycles in every sign regime, Fr of both signs: see `describe_design`."""
    return [describe_design(*design) for design in _draw_designs()]


def describe_design(*design: Any) -> dict[str, Any]:
    """Facts about a bicycle, in fractions, from Fr, μ, χ_B, χ_H, ζ_B, ζ_H and tan λ_s.

    `skew` is a1/(Fr ζ_B); `square` is Fr_c² by flus, None if infinite; `lines` are the five conditions lscf, `admitted`
    is whether all of them hold, and `stable` is whether the bicycle is stable.
    """
    Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T = map(rational, design)
    skew = zeta_B * chi_H - zeta_H * chi_B
    square = _LAWS.flus(mu, chi_B, chi_H, zeta_B, zeta_H, Tilt(T)) if skew != 0 else None
    lines = [chi_H > 1 + zeta_H * T, chi_H < 1 - zeta_B / mu * T, chi_H < chi_B, zeta_H > zeta_B]
    lines.append(square is not None and square > 0 and Fr > 0 and Fr * Fr > square)
    return {
        "Fr": Fr,
        "chi_H": chi_H,
        "T": T,
        "skew": skew,
        "square": square,
        "lines": lines,
        "admitted": all(lines),
        "stable": is_stable(copo(*map(rational, design))),
    }


def _draw_designs() -> Iterator[tuple[Any, ...]]:
    pick = random.Random(1)

    def tenths(low: int, high: int) -> Any:
        return rational(pick.randint(10 * low, 10 * high)) / 10

    for k in range(_COUNT):
        chi_H = 1 + tenths(-1, 1) / 3 if k % 2 else tenths(-2, 3)
        zeta_B, zeta_H = -rational(pick.randint(1, 40)) / 20, -rational(pick.randint(0, 40)) / 20
        mu, T = rational(pick.choice((1, 2, 5, 10, 50, 200))) / 10, rational(pick.choice((1, 3, 7, 15, 60))) / 10
        Fr = tenths(0, 8) + rational("1/20")
        signs = (pick.choice((1, 1, 1, -1)), pick.choice((1, -1)))
        yield signs[0] * Fr, mu, tenths(-2, 3) + rational("1/50"), chi_H, zeta_B, zeta_H, signs[1] * T
