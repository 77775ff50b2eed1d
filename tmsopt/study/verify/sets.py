"""Section 2.4.3: the discriminant surface, its edges and its line of self-intersection."""

from typing import Any

import flint

from tmsopt.models.tms import copo
from tmsopt.study.verify.algebra import (
    composed,
    jacobian,
    kernel,
    match,
    polynomials,
    positive,
    q,
    ring,
    slope,
)
from tmsopt.study.verify.entry import Claim, Outcome, digits, proof, section
from tmsopt.study.verify.upright import (
    HEIGHTS,
    ep4,
    normal,
    palindrome,
    tilt_of_EP4,
)  # fmt: skip

_claim = section("2.4.3 The discriminant surface and the EP set")


@_claim(
    "fig1-omega0", "caption of Fig. fig1", "ω0 = −(25/2)^(1/4)", "1/(ζ_B ζ_H) in fractions, and the solved EP4 in balls"
)
def _omega0() -> Outcome:
    claimed = -flint.arb(q("25/2")).root(4)
    return proof(
        1 / (HEIGHTS[0] * HEIGHTS[1]) == q("25/2") and claimed.overlaps(ep4()["s"]),
        printed="−(25/2)^(1/4)",
        computed=digits(ep4()["s"]),
    )


@_claim(
    "fig00-swallowtail",
    "caption of Fig. fig00; text, of KO2013",
    "the discriminant surface in (Fr, χ_B, λ_s) has its swallowtail singularity at EP4",
    "versality for all heights: 3×3 determinant of the changes of the coefficients of t², t, 1 at the EP4, in r and q",
)
def _swallowtail() -> Outcome:
    Fr, chi_B, T, r, scale = ring("Fr chi_B T r q")
    b = normal(Fr, chi_B, T, r, scale)
    law = tilt_of_EP4(r, scale**2)
    at = {"Fr": (r**2 + 6 * r + 1) / (4 * scale * (r + 1)), "chi_B": r, "T": law, "r": r, "q": scale}
    rows = []
    for name in ("Fr", "chi_B", "T"):
        c1, c2, c3, c4 = (composed(slope(c, name), at) for c in b[1:])
        # σ = t − 1: c1 σ³ + c2 σ² + c3 σ + c4 in powers of t
        rows.append([c2 - 3 * c1, 3 * c1 - 2 * c2 + c3, c4 - c3 + c2 - c1])
    (a11, a12, a13), (a21, a22, a23), (a31, a32, a33) = rows
    determinant = a11 * (a22 * a33 - a23 * a32) - a12 * (a21 * a33 - a23 * a31) + a13 * (a21 * a32 - a22 * a31)
    factors = [f for f, _ in determinant.over.factor()[1]]
    same = polynomials("Fr chi_B T r q")[3]
    return proof(
        determinant.over != 0 and all(positive(f) or positive(-f) or f == same - 1 for f in factors),
        "The determinant vanishes only at r = √(ζ_B/ζ_H) = 1, where there is no EP4; for every other pair of heights "
        "the family is a versal unfolding of t⁴.",
    )


def lifted(*names: str) -> tuple[list[Any], list[Any]]:
    """The polynomial with Fr, χ_B, T, and the given unknowns, as polynomials of one ring."""
    gens = polynomials(" ".join(("Fr", "chi_B", "T", *names)))
    return copo(gens[0], q(0), gens[1], q(1), *HEIGHTS, gens[2]), list(gens[3:])


def _edge_at_EP4() -> Any:
    """How fast the simple root leaves the triple one along the set of EP3 through EP4."""
    p, (a, t) = lifted("a", "t")
    design = ep4()
    at = {**design, "a": design["s"], "t": design["s"]}
    free = ("Fr", "chi_B", "T", "a", "t")
    direction = kernel(jacobian(match(p, *[[1, -a]] * 3, [1, -t]), free, at))
    return direction[4] - direction[3]


def _line_at_EP4() -> Any:
    """How fast b² − 4c changes along the set (s² + b s + c)² through EP4."""
    p, (b, c) = lifted("b", "c")
    design = ep4()
    at = {**design, "b": -2 * design["s"], "c": design["s"] ** 2}
    direction = kernel(jacobian(match(p, [1, b, c], [1, b, c]), ("Fr", "chi_B", "T", "b", "c"), at))
    return 2 * at["b"] * direction[3] - 4 * direction[4]


@_claim(
    "fig00-edges",
    "text after Fig. fig00",
    "two cuspidal edges and the line of self-intersection branch from the EP4",
    "the sets (s − a)³(s − t) and (s² + b s + c)² lifted to their unknowns are regular curves through the EP4, "
    "in balls",
)
def _edges() -> Outcome:
    return proof(
        not _edge_at_EP4().contains(0) and not _line_at_EP4().contains(0),
        "Along the one lifted curve t − a changes sign at the EP4: two edges, triple root left or right of the simple "
        "one. Along the other b² − 4 c changes sign: real double roots (the self-intersection) on one side, a complex "
        "double pair on the other.",
    )


@_claim(
    "plane",
    "text before Eq. epset",
    "the line of self-intersection lies in the plane χ_B = √(ζ_B/ζ_H)",
    "p = a0 (s² + b s + c)² with b eliminated: c² = a4/a0 and c = a3/a1, in r and q",
)
def _plane() -> Outcome:
    Fr, chi_B, T, r, scale = ring("Fr chi_B T r q")
    b = normal(Fr, chi_B, T, r, scale)
    difference = b[3] ** 2 - b[1] ** 2  # (c b1)² with c² = 1
    factor = Fr**2 * (r**2 - 1) * (chi_B**2 - r**2) / (scale**2 * T**2 * r**2)
    return proof(
        b[4] == 1 and difference == factor,
        "With c = 1/h > 0 only χ_B = r = √(ζ_B/ζ_H). The other solution, χ_B = −r with c = −1/h, is a second line, of "
        "unstable bicycles, away from the EP4.",
    )


@_claim(
    "discriminant",
    "text before Eq. epset",
    "the discriminant simplifies in the plane χ_B = √(ζ_B/ζ_H) and provides the curve",
    "discriminant of σ⁴ + B1 σ³ + B2 σ² + B1 σ + 1 by a resultant, factored exactly",
)
def _discriminant() -> Outcome:
    B1, _, variables = palindrome()
    x, y, s = polynomials("x y s")
    p = s**4 + x * s**3 + y * s**2 + x * s + 1
    found = p.resultant(p.derivative("s"), "s")
    double = x**2 - 4 * y + 8
    Fr, T, r, scale = variables
    return proof(
        found == double**2 * (y + 2 - 2 * x) * (y + 2 + 2 * x) and Fr * (r - 1) / (scale * T) == B1,
        "It is (B1² − 4 B2 + 8)² (B2 + 2 − 2 B1)(B2 + 2 + 2 B1). The squared factor is the EP set, so the discriminant "
        "does not change sign there; the others are a double root ω0 or −ω0.",
    )


CLAIMS: tuple[Claim, ...] = (_omega0, _swallowtail, _edges, _plane, _discriminant)
