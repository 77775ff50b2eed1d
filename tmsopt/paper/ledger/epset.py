"""Section 2.4.3: the EP set in the plane χ_B = √(ζ_B/ζ_H), and the domain of heavy damping beside it."""

from typing import Any

import flint

from tmsopt.arithmetic.identity import Quotient
from tmsopt.paper.ledger import lemmas, printed
from tmsopt.paper.ledger.algebra import composed, evaluate, polynomials, q, ring, slope, stable, tangent
from tmsopt.paper.ledger.entry import Claim, Outcome, digits, proof, section, universal

_claim = section("2.4.3 The discriminant surface and the EP set")

_TINY = "1e-40"


def _set_of_pairs() -> tuple[Quotient, tuple[Quotient, ...]]:
    """Fr² on B1² − 4 B2 + 8 = 0, and the variables T, r, q."""
    T, r, scale = variables = ring("T r q")
    one, none = (lemmas.normal(x + 0 * T, r, T, r, scale) for x in (1, 0))
    constant = none[1] ** 2 - 4 * none[2] + 8
    slope_ = one[1] ** 2 - 4 * one[2] + 8 - constant
    return -constant / slope_, variables


@_claim(
    "epset", "Eq. epset", "Fr on the EP set",
    "the squared factor of the discriminant solved for Fr², in r and q; a bicycle below the pole in fractions",
)  # fmt: skip
def _epset() -> Outcome:
    square, (T, r, scale) = _set_of_pairs()
    omega0, zeta_B = -1 / scale, -(scale**2) * r
    law = printed.epset(omega0, zeta_B, T)
    exists = lemmas.pole(T, r, scale)
    same = law == square == 4 * (r + 1) ** 2 * scale**2 * T**2 / ((r - 1) * exists)
    radicand = _radicand(q(-1), q(-2), q("0.1"))
    return universal(
        "tan λ_s (r + 1)/(r − 1) > r/(4 h), r = √(ζ_B/ζ_H), h = √(ζ_B ζ_H); there it is the one positive speed",
        same,
        f"ζ_B = −2, ζ_H = −1/2, χ_B = 2, tan λ_s = 1/10: the radicand is {radicand} and no speed gives two double "
        "roots, as B1² − 4 B2 + 8 = 40 Fr² + 18",
        radicand < 0 and _pair_factor() == (q(40), q(18)),
    )


def _radicand(omega0: Any, zeta_B: Any, T: Any) -> Any:
    ratio = (omega0**2 * zeta_B - 1) / (omega0**2 * zeta_B + 1)
    return omega0**4 * zeta_B + 4 * T * ratio


def _pair_factor() -> tuple[Any, Any]:
    """B1² − 4 B2 + 8 for r = 2, h = 1, tan λ_s = 1/10: coefficients of Fr² and 1."""
    at_0, at_1 = (lemmas.normal(q(x), q(2), q("0.1"), q(2), q(1)) for x in (0, 1))
    values = [b[1] ** 2 - 4 * b[2] + 8 for b in (at_0, at_1)]
    return values[1] - values[0], values[0]


@_claim(
    "epset-tangent", "text after Eq. epset",
    "a point where the curve has a vertical tangent in the (Fr, λ_s)-plane is the EP4",
    "dFr²/dT on the squared factor of the discriminant, its zero beside the tilt of the EP4, in r and q",
)  # fmt: skip
def _tangent() -> Outcome:
    square, (T, r, scale) = _set_of_pairs()
    turn = r * (r - 1) / (2 * scale**2 * (r + 1))
    change = slope(square, "T")
    exists = lemmas.pole(T, r, scale)
    only_there = slope(change * exists**2 / (T * (T - turn)), "T") == 0
    ep = lemmas.tilt_of_EP4(r, scale**2)
    apart = ep - turn == (r - 1) ** 3 / (16 * scale**2 * (r + 1))
    at = {"T": turn, "r": r, "q": scale}
    is_turn = composed(change, at) == 0 and composed(change, {**at, "T": ep}) != 0
    speed = composed(square, at) == r / scale**2
    point, nodes = lemmas.ep4(), flint.arb(2).sqrt()
    h = nodes / 5
    lean = (nodes * (nodes - 1) / (2 * h * (nodes + 1))).atan()
    return universal(
        "never for ζ_B ≠ ζ_H",
        False,
        "the tangent is vertical at tan λ_s = r (r − 1)/(2 h (r + 1)), Fr = √(r/h), where the roots of the 2EP2 are "
        "not yet equal; the EP4 lies above it by (r − 1)³/(16 h (r + 1)) in tan λ_s. With r = 2, h = 1: tan λ_s = "
        "1/3 and Fr² = 2 against 17/48 and Fr² = 289/144",
        is_turn and only_there and apart and speed and _by_hand(),
        computed=digits(lean),
        remark="For ζ_B = −0.4, ζ_H = −0.2 the vertical tangent is at Fr = √5 = 2.23607 and the λ_s given here; "
        f"the EP4 at Fr = {point['Fr'].str(6, radius=False)} and λ_s = {point['T'].atan().str(8, radius=False)}: too "
        "near to tell apart in the figure. With the axes exchanged the tangent is vertical nowhere.",
    )


def _by_hand() -> bool:
    """The EP set for r = 2, h = 1 at tan λ_s = 1/3 and 17/48 in fractions: (s² + b s + 1)² with b > 2 and b = 2."""
    found = []
    for T, square in ((q("1/3"), q(2)), (q("17/48"), q("289/144"))):
        unit = lemmas.quartic(q(1), q(2), T, q(2), q(1))
        still = lemmas.quartic(q(0), q(2), T, q(2), q(1))
        b_square = square * (unit[1] / unit[0] / 2) ** 2
        a2 = still[2] + square * (unit[2] - still[2])
        found.append((a2 / unit[0] == b_square + 2, b_square))
    return all(ok for ok, _ in found) and found[0][1] > 4 and found[1][1] == 4


@_claim(
    "epset-2EP2", "text after Eq. epset",
    "below the EP4 the curve is a pair of different negative double real eigenvalues (2EP2)",
    "b² − 4 c on the squared factor of the discriminant, in r and q; the solved bicycle of Table 1",
)  # fmt: skip
def _below() -> Outcome:
    real = lemmas.double_pair("-0.05")
    return proof(
        _kind_identity() and lemmas.are_real(real) and bool(real["b"] > 0),
        "From the pole tan λ_s = r (r − 1)/(4 h (r + 1)) of the curve up to the EP4. One Jordan block each, by "
        "w0-Jordan.",
    )


def _kind_identity() -> bool:
    """B1² − 16 on the curve is a positive multiple of the tilt of the EP4 less the tilt, over T less the pole."""
    square, (T, r, scale) = _set_of_pairs()
    unit = lemmas.normal(1 + 0 * T, r, T, r, scale)
    exists = lemmas.pole(T, r, scale)
    return bool(square * unit[1] ** 2 - 16 == 64 * scale**2 * (r + 1) * (lemmas.tilt_of_EP4(r, scale**2) - T) / exists)


@_claim(
    "epset-CEP2", "text after Eq. epset; caption of Fig. fig1",
    "above the EP4 the curve is a conjugate pair of double complex eigenvalues (CEP2)",
    "b² − 4 c on the squared factor of the discriminant, in r and q; the solved bicycle of Table 1",
)  # fmt: skip
def _above() -> Outcome:
    return proof(
        _kind_identity() and lemmas.are_complex(lemmas.double_pair("0.80")),
        "For every tilt above the EP4's. One Jordan block of order 2 each, by w0-Jordan.",
    )


@_claim(
    "epset-codimension", "text after Eq. epset", "the codimension of the EP set is 2",
    "rank of the derivatives of the lifted equations at the EP4, the 2EP2 and the CEP2 of Table 1, in balls",
)  # fmt: skip
def _codimension() -> Outcome:
    p, (b, c) = lemmas.lifted("b c")
    design = lemmas.ep4()
    points = [{**design, "b": -2 * design["s"], "c": design["s"] ** 2}]
    points += [{**lemmas.double_pair(offset), "T": lemmas.tilted(offset)} for offset in ("-0.05", "0.80")]
    free = ("Fr", "chi_B", "T", "b", "c")
    full = [any(not x.contains(0) for x in tangent(p, [[1, b, c], [1, b, c]], free, at)[:3]) for at in points]
    return proof(
        all(full),
        "Four independent conditions with two unknowns b, c: a curve in the space of Fr, χ_B, λ_s; it passes smoothly "
        "through all three kinds.",
        printed="2",
        computed=str(4 - 2),
    )


@_claim(
    "fig1-left", "caption of Fig. fig1", "at χ_B = √2 the domain of heavy damping has a cuspidal point at EP4",
    "its two boundaries, B1² = 4 B2 − 8 and B2 + 2 = 2 B1, touch at the EP4: gradients, and the map from (Fr, "
    "T), exactly",
)  # fmt: skip
def _cusp() -> Outcome:
    B1, B2, (_, _, r, scale) = lemmas.palindrome()
    at = {"Fr": lemmas.speed_of_EP4(r, scale), "T": lemmas.tilt_of_EP4(r, scale**2), "r": r, "q": scale}
    meets = composed(B1, at) == 4 and composed(B2, at) == 6
    x, y = polynomials("x y")
    first, second = x**2 - 4 * y + 8, y + 2 - 2 * x
    cross = first.derivative("x") * second.derivative("y") - first.derivative("y") * second.derivative("x")
    touches = evaluate(cross, {"x": flint.arb(4), "y": flint.arb(6)}) == 0
    regular = composed(slope(B1, "Fr") * slope(B2, "T") - slope(B1, "T") * slope(B2, "Fr"), at)
    return proof(meets and touches and regular != 0, "The curves touch there and nowhere else.")


@_claim(
    "fig1-right", "caption of Fig. fig1",
    "at the tilt of the EP4 the domain of heavy damping in the (Fr, χ_B)-plane degenerates into the one point",
    "tan λ_s as a function of four positive roots with product 1, bounded by sums of squares",
)  # fmt: skip
def _degenerate() -> Outcome:
    return proof(
        lemmas.tilt_bound(),
        "h tan λ_s = (r² − 1)(r e2 + r² + 1)/(r e1 + e3)² for roots −x1 … −x4 over |ω0| with elementary "
        "symmetric e1 … e3; "
        "e1² ≥ (8/3) e2, e3² ≥ (8/3) e2 and e2 ≥ 6 bound it by its value at the EP4, with equality there only.",
    )


@_claim(
    "EP-Jordan-2", "text after Eq. epset; caption of Fig. fig1",
    "the double eigenvalues of 2EP2 and CEP2 have a Jordan block of order two",
    "second row of M s² + V s + P at the double eigenvalues of Table 1, in complex balls: it must not vanish",
)  # fmt: skip
def _order_two() -> Outcome:
    ranks = []
    for offset in ("-0.05", "0.80"):
        point = lemmas.double_pair(offset)
        b, c = flint.acb(point["b"]), flint.acb(point["c"])
        root = (-b + (b * b - 4 * c).sqrt()) / 2
        ranks.append(not (lemmas.HEIGHTS[1] * root**2 + 1).contains(0))
    return proof(all(ranks), "The entry is −μ ν_H (ζ_H s² + 1), so the rank is 1 for every μ > 0.")


@_claim(
    "EP-kinds", "text after Eq. epset", "the curve is the location of three types of exceptional points",
    "stability, b² − 4 c and the EP4 of the three solved bicycles, in balls",
)  # fmt: skip
def _kinds() -> Outcome:
    design = lemmas.ep4()
    r = design["chi_B"]
    h = r / 5
    square = 4 * (r + 1) ** 2 * h * design["T"] ** 2 / ((r - 1) * (4 * h * design["T"] * (r + 1) - r * (r - 1)))
    on_curve = abs(square - design["Fr"] ** 2) < flint.arb(_TINY)
    bicycles = [lemmas.at_heights(design["Fr"], design["chi_B"], design["T"])]
    bicycles += [
        lemmas.at_heights(x["Fr"], x["chi_B"], lemmas.tilted(o))
        for o in ("-0.05", "0.80")
        for x in (lemmas.double_pair(o),)
    ]
    return proof(bool(on_curve) and all(stable(p) for p in bicycles), "2EP2, EP4 and CEP2, all of stable bicycles.")


CLAIMS: tuple[Claim, ...] = (
    _epset, _tangent, _below, _above, _order_two, _kinds, _codimension, _cusp, _degenerate,
)  # fmt: skip
