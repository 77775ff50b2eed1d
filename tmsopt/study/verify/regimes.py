"""The stability conditions over every sign regime: rational designs, and the identities behind the conditions."""

import random
from collections.abc import Iterator
from functools import cache
from typing import Any

from tmsopt.models.tms import copo
from tmsopt.study.verify import printed
from tmsopt.study.verify.algebra import q, ring, stable

_NAMES = "Fr mu chi_B chi_H zeta_B zeta_H T"

Design = tuple[Any, ...]  # Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T as fractions


@cache
def designs() -> tuple[tuple[Design, bool], ...]:
    """Rational designs in every sign regime, Fr of both signs, and whether each is stable, by its Routh conditions."""
    return tuple((design, stable(copo(*design))) for design in _designs(4000))


def _designs(count: int) -> Iterator[Design]:
    pick = random.Random(1)

    def tenths(low: int, high: int) -> Any:
        return q(pick.randint(10 * low, 10 * high)) / 10

    for k in range(count):
        chi_H = 1 + tenths(-1, 1) / 3 if k % 2 else tenths(-2, 3)
        zeta_B, zeta_H = -q(pick.randint(1, 40)) / 20, -q(pick.randint(0, 40)) / 20
        mu, T = q(pick.choice((1, 2, 5, 10, 50, 200))) / 10, q(pick.choice((1, 3, 7, 15, 60))) / 10
        Fr = tenths(0, 8) + q("1/20")
        signs = (pick.choice((1, 1, 1, -1)), pick.choice((1, -1)))
        yield signs[0] * Fr, mu, tenths(-2, 3) + q("1/50"), chi_H, zeta_B, zeta_H, signs[1] * T


def first_four(design: Design) -> list[bool]:
    _, mu, chi_B, chi_H, zeta_B, zeta_H, T = design
    return [chi_H > 1 + zeta_H * T, chi_H < 1 - zeta_B / mu * T, chi_H < chi_B, zeta_H > zeta_B]


def fifth(design: Design) -> bool:
    Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T = design
    if zeta_B * chi_H == zeta_H * chi_B:
        return False
    square = printed.flus(mu, chi_B, chi_H, zeta_B, zeta_H, T)
    return bool(square > 0 and Fr > 0 and Fr * Fr > square)


def admitted(design: Design) -> bool:
    """Whether all five printed conditions hold."""
    return all(first_four(design)) and fifth(design)


def class_identity() -> bool:
    """a4 + μ a0/ζ_B² = −T (ζ_B + μ ζ_H): with T > 0 not both a0 and a4 are negative, with T < 0 not both positive."""
    Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T = ring(_NAMES)
    a = copo(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T)
    return bool(a[4] + mu * a[0] / zeta_B**2 == -T * (zeta_B + mu * zeta_H))


def standstill_identity() -> bool:
    """At Fr = 0, a2 is minus a positive combination of a0 and a4; with y = −ζ > 0."""
    mu, k, y_B, y_H, T = ring("mu k y_B y_H T")
    a = copo(0 * T, mu, 2 * k, 1 + k, -y_B, -y_H, T)
    weight = y_B + mu * y_H
    return bool(a[2] * weight == -a[4] * (y_B**2 + mu * y_H**2) - a[0] * (1 + mu))


def hurwitz_identity() -> bool:
    """a1 a2 a3 − a0 a3² − a4 a1² is (ζ_B − ζ_H) ζ_B a1 a3 (Fr² − flus), and so affine in Fr² beside Fr²."""
    Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T = ring(_NAMES)
    a0, a1, a2, a3, a4 = copo(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T)
    square = printed.flus(mu, chi_B, chi_H, zeta_B, zeta_H, T)
    return bool(a1 * a2 * a3 - a0 * a3**2 - a4 * a1**2 == (zeta_B - zeta_H) * zeta_B * a1 * a3 * (Fr**2 - square))


def necessary(line: int) -> bool:
    """No stable design of the sample with λ_s > 0 and Fr > 0 breaks a line of the conditions."""
    for design, is_stable in designs():
        if is_stable and design[0] > 0 and design[6] > 0:
            lines = [*first_four(design), fifth(design)]
            if not lines[line]:
                return False
    return True
