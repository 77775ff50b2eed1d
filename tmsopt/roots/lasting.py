"""What holds for the roots of a polynomial whatever the number y in it: roots 0, mirrored and repeated factors.

Such factors make a0 … aₙ, the Hurwitz minor or the discriminant vanish for every y and so hide where other roots meet.
They are split off exactly, as greatest common divisors of polynomials in s and y.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import flint

Polynomial = Sequence[Any]
"""Coefficients in y, exact fractions, ascending."""

Rows = list[list[Any]]
"""A polynomial in s, descending, each coefficient a polynomial in y."""


@dataclass(frozen=True)
class Lasting:
    """A polynomial p(s, y) = s^zeros · (factors), every factor but s once.

    Attributes:
        zeros: multiplicity of the root 0 that is there for every y.
        mirrored: product of the different factors that are even in s: their roots are s and −s.
        rest: product of the other factors; it shares no root with its mirror image for every y.
        once: s (if it divides p), mirrored and rest: p without its repetitions.
        repeated: whether a factor other than s is there more than once.
        repeats_mirrored: whether one of those that are even is.
    """

    zeros: int
    mirrored: Rows
    rest: Rows
    once: Rows
    repeated: bool
    repeats_mirrored: bool


def lasting(coefficients: Sequence[Polynomial]) -> Lasting:
    """Split a polynomial that is not 0; coefficients descending in s."""
    context = flint.fmpq_mpoly_ctx.get(["s", "y"], "lex")
    s, y = context.gens()
    degree = len(coefficients) - 1
    terms = {
        (degree - k, power): value
        for k, polynomial in enumerate(coefficients)
        for power, value in enumerate(polynomial)
        if value != 0
    }
    zeros = min(power for power, _ in terms)
    p = context.from_dict({(i - zeros, j): value for (i, j), value in terms.items()})
    factors = [(f, times) for f, times in p.factor_squarefree()[1] if f.degrees()[0] > 0]
    one = context.from_dict({(0, 0): 1})
    once = one
    for f, _ in factors:
        once = once * f
    mirrored = once.gcd(once.compose(-s, y))
    both = p.gcd(p.compose(-s, y))
    return Lasting(
        zeros,
        _rows(mirrored),
        _rows(once / mirrored),
        _rows(once * s if zeros else once),
        any(times > 1 for _, times in factors),
        both.degrees()[0] > mirrored.degrees()[0],
    )


def _rows(p: Any) -> Rows:
    """Coefficients of a polynomial in s and y, descending in s."""
    degree, width = p.degrees()
    rows = [[flint.fmpq(0)] * (width + 1) for _ in range(degree + 1)]
    for (i, j), value in p.to_dict().items():
        rows[degree - i][j] = value
    return rows
