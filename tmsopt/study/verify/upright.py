"""Bicycles with χ_H = 1 in the coordinates that take the radicals away.

ζ_B = −q² r, ζ_H = −q²/r, so √(ζ_B/ζ_H) = r, ω0 = −1/q, and h = √(ζ_B ζ_H) = q². At χ_B = r the roots over |ω0|,
σ = q s, obey the palindromic σ⁴ + B1 σ³ + B2 σ² + B1 σ + 1, that is u² + B1 u + B2 − 2 = 0 with u = σ + 1/σ.
"""

from functools import cache
from typing import Any

import flint

from tmsopt.models.tms import copo
from tmsopt.study.verify.algebra import Quotient, match, polynomials, q, ring, solve

HEIGHTS = q("-0.4"), q("-0.2")
"""ζ_B and ζ_H of every design of the section."""


def quartic(Fr: Any, chi_B: Any, T: Any, r: Any, scale: Any) -> list[Any]:
    """Coefficients with χ_H = 1, in the coordinates r and q (here `scale`)."""
    nothing = 0 * T
    return copo(Fr, nothing, chi_B, 1 + nothing, -(scale**2) * r, -(scale**2) / r, T)


def normal(Fr: Any, chi_B: Any, T: Any, r: Any, scale: Any) -> list[Any]:
    """Coefficients of the monic polynomial in σ = q s."""
    a = quartic(Fr, chi_B, T, r, scale)
    return [a[k] / a[0] * scale**k for k in range(5)]


def palindrome() -> tuple[Quotient, Quotient, tuple[Quotient, ...]]:
    """B1, B2 at χ_B = r and the variables Fr, T, r, q they are made of.

    Raises:
        ArithmeticError: if the polynomial in σ is not palindromic.
    """
    Fr, T, r, scale = variables = ring("Fr T r q")
    b = normal(Fr, r, T, r, scale)
    if not (b[4] == 1 and b[1] == b[3]):
        raise ArithmeticError("the polynomial is not palindromic at χ_B = r")
    return b[1], b[2], variables


def tilt_of_EP4(r: Any, h: Any) -> Any:
    """tan λ_s of the EP4, compact: not the printed form; see the entry tls for its proof."""
    return (r - 1) * (r**2 + 6 * r + 1) / (16 * h * (r + 1))


@cache
def ep4() -> dict[str, Any]:
    """Fr, χ_B, T and the 4-fold root s for ζ_B = −0.4, ζ_H = −0.2, all four unknown, proved in balls."""
    Fr, chi_B, T, s = polynomials("Fr chi_B T s")
    a = copo(Fr, q(0), chi_B, q(1), *HEIGHTS, T)
    return solve(match(a, *[[1, -s]] * 4), {"Fr": 2.2, "chi_B": 1.4, "T": 0.43, "s": -1.9}, {})


def tilted(offset: str) -> Any:
    """tan(λ_s of the EP4 + offset), from the solved EP4."""
    return (ep4()["T"].atan() + flint.arb(q(offset))).tan()


@cache
def double_pair(offset: str) -> dict[str, Any]:
    """Fr, χ_B, b, c with p = a0 (s² + b s + c)² at that tilt, proved in balls."""
    Fr, chi_B, b, c, T = polynomials("Fr chi_B b c T")
    a = copo(Fr, q(0), chi_B, q(1), *HEIGHTS, T)
    guess = {"-0.05": (2.26, 4.1), "0.80": (4.1, 1.5), "-0.18": (2.9, 8.0)}[offset]
    tilt = {"T": tilted(offset)}
    return solve(match(a, [1, b, c], [1, b, c]), {"Fr": guess[0], "chi_B": 1.4, "b": guess[1], "c": 3.5}, tilt)


@cache
def weave(offset: str, chi_B: str = "") -> dict[str, Any]:
    """Fr, ω² and the other factor at the weave boundary at that tilt; χ_B = √2 plus the given number."""
    Fr, W, b, c, T, chi = polynomials("Fr W b c T chi")
    a = copo(Fr, q(0), chi, q(1), *HEIGHTS, T)
    at = {"T": tilted(offset), "chi": ep4()["chi_B"] + flint.arb(q(chi_B or "0"))}
    slope = float(at["T"].mid())
    guess = {"Fr": (5.8 * slope) ** 0.5, "W": 3.5, "b": 2.0 / slope**0.5, "c": 3.5}
    return solve(match(a, [1, 0, W], [1, b, c]), guess, at)
