"""Fig. fig2: the cuspidal edges and the self-intersection beside the plane χ_B = √(ζ_B/ζ_H)."""

from collections.abc import Mapping
from functools import cache
from typing import Any

import flint

from tmsopt.models.tms import copo
from tmsopt.study.verify.algebra import heavily_damped, jacobian, kernel, match, polynomials, q, roots, solve
from tmsopt.study.verify.entry import Claim, Outcome, digits, proof, section
from tmsopt.study.verify.upright import HEIGHTS, double_pair, tilted

_claim = section("2.4.3 The discriminant surface and the EP set")

_NONE = flint.arb("1e-40")


@cache
def ep3_left() -> dict[str, Any]:
    """Fr, T, the triple root a and the simple root t at χ_B = √2 − 0.1, proved in balls."""
    Fr, T, a, t, chi_B = polynomials("Fr T a t chi_B")
    p = copo(Fr, q(0), chi_B, q(1), *HEIGHTS, T)
    guess = {"Fr": 2.02, "T": 0.2, "a": -0.94, "t": -14.9}
    off = {"chi_B": flint.arb(2).sqrt() - flint.arb(q("0.1"))}
    return {**solve(match(p, *[[1, -a]] * 3, [1, -t]), guess, off), **off}


@cache
def ep3_right(upper: bool, offset: str = "-0.18") -> dict[str, Any]:
    """Fr, χ_B, a, t at a tilt beside the EP4's: χ_B above √2, or below."""
    Fr, chi_B, a, t, T = polynomials("Fr chi_B a t T")
    p = copo(Fr, q(0), chi_B, q(1), *HEIGHTS, T)
    guesses = {
        ("-0.18", True): (2.185, 1.515, -3.68, -0.25), ("-0.18", False): (2.086, 1.339, -1.025, -11.6),
        ("-0.05", True): (2.2352, 1.4283, -2.581, -0.727), ("-0.05", False): (2.2171, 1.4025, -1.396, -4.59),
    }  # fmt: skip
    guess = dict(zip(("Fr", "chi_B", "a", "t"), guesses[offset, upper], strict=True))
    off = {"T": tilted(offset)}
    return {**solve(match(p, *[[1, -a]] * 3, [1, -t]), guess, off), **off}


def is_cusp(point: Mapping[str, Any], plane: tuple[str, str]) -> bool:
    """Whether the curve (s − a)²(s² + b s + c) through an EP3 is regular in its unknowns and stops in the plane."""
    gens = polynomials("Fr chi_B T a b c")
    Fr, chi_B, T, a, b, c = gens
    p = copo(Fr, q(0), chi_B, q(1), *HEIGHTS, T)
    at = {**point, "b": -(point["a"] + point["t"]), "c": point["a"] * point["t"]}
    names = (*plane, "a", "b", "c")
    direction = kernel(jacobian(match(p, [1, -a], [1, -a], [1, b, c]), names, at))
    stops = all(x.contains(0) and abs(x) < _NONE for x in direction[:2])
    return stops and not direction[2].contains(0)


_MATCHED = (
    "p(s) = a0 (s − a)³(s − t) by interval Newton, 80 digits; the lifted curve of double roots stops there in the plane"
)


@_claim(
    "fig2-left",
    "caption of Fig. fig2",
    "at χ_B = √2 − 0.1 the domain of heavy damping has a cusp at an EP3, in the (Fr, λ_s)-plane",
    _MATCHED,
)
def _left() -> Outcome:
    point = ep3_left()
    return proof(
        is_cusp(point, ("Fr", "T")) and bool(point["a"] < 0) and bool(point["t"] < 0),
        f"At Fr = {point['Fr'].str(10, radius=False)}, λ_s = {point['T'].atan().str(10, radius=False)}: triple root "
        f"{point['a'].str(8, radius=False)}, simple root {point['t'].str(8, radius=False)}; one Jordan block of order "
        "3, by w0-Jordan.",
        computed=digits(point["Fr"]),
    )


@_claim(
    "fig2-edge",
    "caption of Fig. fig2",
    "the EP3 belongs to the cuspidal edge of the swallowtail surface",
    "the set (s − a)³(s − t) in (Fr, χ_B, λ_s) is a regular curve there, in balls, crossing the plane",
)
def _edge() -> Outcome:
    Fr, chi_B, T, a, t = polynomials("Fr chi_B T a t")
    p = copo(Fr, q(0), chi_B, q(1), *HEIGHTS, T)
    direction = kernel(jacobian(match(p, *[[1, -a]] * 3, [1, -t]), ("Fr", "chi_B", "T", "a", "t"), ep3_left()))
    return proof(not direction[1].contains(0), "The edge crosses χ_B = √2 − 0.1, as its χ_B changes along it.")


@_claim(
    "fig2-right",
    "caption of Fig. fig2",
    "at the tilt of the EP4 less 0.18 the domain of heavy damping has two EP3 cusps, in the (Fr, χ_B)-plane",
    _MATCHED,
)
def _right() -> Outcome:
    points = [ep3_right(upper) for upper in (True, False)]
    real = all(bool(x["a"] < 0) and bool(x["t"] < 0) for x in points)
    where = "; ".join(f"Fr = {x['Fr'].str(8, radius=False)}, χ_B = {x['chi_B'].str(8, radius=False)}" for x in points)
    return proof(real and all(is_cusp(x, ("Fr", "chi_B")) for x in points), f"They are {where}.")


@_claim(
    "fig2-crossing",
    "caption of Fig. fig2",
    "and a self-intersection at the 2EP2 point on its boundary",
    "p(s) = a0 (s² + b s + c)² by interval Newton; the two sheets p(x) = 0 at its double roots x have different "
    "tangents",
)
def _crossing() -> Outcome:
    point = double_pair("-0.18")
    b, c = point["b"], point["c"]
    half = (b * b - 4 * c).sqrt()
    Fr, chi_B, T, s = polynomials("Fr chi_B T s")
    a = copo(Fr, q(0), chi_B, q(1), *HEIGHTS, T)
    p = [sum(((x * s ** (4 - k)) for k, x in enumerate(a)), s * 0)]
    rows = [
        jacobian(p, ("Fr", "chi_B"), {**point, "T": tilted("-0.18"), "s": (sign * half - b) / 2})[0] for sign in (1, -1)
    ]
    cross = rows[0][0] * rows[1][1] - rows[0][1] * rows[1][0]
    return proof(
        bool(b > 0) and bool(c > 0) and not cross.contains(0),
        f"At Fr = {point['Fr'].str(8, radius=False)}, χ_B = √2.",
        computed=digits(point["Fr"]),
    )


@_claim(
    "spire",
    "text after Fig. fig00",
    "the edges and the line bound a trihedral spire inside which all eigenvalues are real and negative",
    "its three corners in the slice 0.05 below the EP4, by interval Newton, and certified roots of a bicycle "
    "between them",
)
def _spire() -> Outcome:
    corners = [ep3_right(True, "-0.05"), ep3_right(False, "-0.05"), double_pair("-0.05")]
    signs = all(bool(x["a"] < 0) and bool(x["t"] < 0) for x in corners[:2])
    middle = [float(sum(x[name] for x in corners).mid()) / 3 for name in ("Fr", "chi_B")]
    T = float(tilted("-0.05").mid())
    inner = copo(q(f"{middle[0]:.6f}"), q(0), q(f"{middle[1]:.6f}"), q(1), *HEIGHTS, q(f"{T:.6f}"))
    outer = copo(q("2.4"), q(0), q("1.42"), q(1), *HEIGHTS, q(f"{T:.6f}"))
    return proof(
        signs and heavily_damped(inner) and not heavily_damped(outer) and len(roots(inner)) == 4,
        "The number of real roots changes only on the discriminant surface, so one inner point decides for all.",
    )


CLAIMS: tuple[Claim, ...] = (_spire, _left, _edge, _right, _crossing)
