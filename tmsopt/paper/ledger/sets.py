"""Section 2.4.3: the discriminant surface, its edges and its line of self-intersection."""

from collections.abc import Mapping
from typing import Any

import flint

from tmsopt.paper.ledger import lemmas
from tmsopt.paper.ledger.algebra import composed, heavily_damped, jacobian, polynomials, positive, q, slope, tangent
from tmsopt.paper.ledger.entry import Claim, Outcome, digits, proof, section

_NONE = flint.arb("1e-40")
_MATCHED = (
    "p(s) = a0 (s − a)³(s − t) by interval Newton, 80 digits; the lifted curve of double roots stops there in the plane"
)


_claim = section("2.4.3 The discriminant surface and the EP set")


@_claim(
    "fig1-omega0", "caption of Fig. fig1", "ω0 = −(25/2)^(1/4)", "1/(ζ_B ζ_H) in fractions, and the solved EP4 in balls"
)
def _omega0() -> Outcome:
    claimed = -flint.arb(q("25/2")).root(4)
    zeta_B, zeta_H = lemmas.HEIGHTS
    holds = 1 / (zeta_B * zeta_H) == q("25/2") and claimed.overlaps(lemmas.ep4()["s"])
    return proof(holds, printed="−(25/2)^(1/4)", computed=digits(lemmas.ep4()["s"]))


@_claim(
    "fig00-swallowtail", "caption of Fig. fig00; text, of KO2013",
    "the discriminant surface in (Fr, χ_B, λ_s) has its swallowtail singularity at EP4",
    "versality for all heights: 3×3 determinant of the changes of the coefficients of t², t, 1 at the EP4, in r and q",
)  # fmt: skip
def _swallowtail() -> Outcome:
    b, (*_, r, scale) = lemmas.monic()
    at = {"Fr": lemmas.speed_of_EP4(r, scale), "chi_B": r, "T": lemmas.tilt_of_EP4(r, scale**2), "r": r, "q": scale}
    rows = []
    for name in ("Fr", "chi_B", "T"):
        c1, c2, c3, c4 = (composed(slope(c, name), at) for c in b[1:])
        # σ = t − 1: c1 σ³ + c2 σ² + c3 σ + c4 in powers of t
        rows.append([c2 - 3 * c1, 3 * c1 - 2 * c2 + c3, c4 - c3 + c2 - c1])
    (a11, a12, a13), (a21, a22, a23), (a31, a32, a33) = rows
    determinant = a11 * (a22 * a33 - a23 * a32) - a12 * (a21 * a33 - a23 * a31) + a13 * (a21 * a32 - a22 * a31)
    factors = [f for f, _ in determinant.over.factor()[1]]
    return proof(
        determinant.over != 0 and all(positive(f) or positive(-f) or f == (r - 1).over for f in factors),
        "The determinant vanishes only at r = √(ζ_B/ζ_H) = 1, where there is no EP4; for every other pair of heights "
        "the family is a versal unfolding of t⁴.",
    )


def _edge_at_EP4() -> Any:
    """How fast the simple root leaves the triple one along the set of EP3 through EP4."""
    p, (a, t) = lemmas.lifted("a t")
    design = lemmas.ep4()
    at = {**design, "a": design["s"], "t": design["s"]}
    free = ("Fr", "chi_B", "T", "a", "t")
    direction = tangent(p, [*[[1, -a]] * 3, [1, -t]], free, at)
    return direction[4] - direction[3]


def _line_at_EP4() -> Any:
    """How fast b² − 4c changes along the set (s² + b s + c)² through EP4."""
    p, (b, c) = lemmas.lifted("b c")
    design = lemmas.ep4()
    at = {**design, "b": -2 * design["s"], "c": design["s"] ** 2}
    direction = tangent(p, [[1, b, c], [1, b, c]], ("Fr", "chi_B", "T", "b", "c"), at)
    return 2 * at["b"] * direction[3] - 4 * direction[4]


@_claim(
    "fig00-edges", "text after Fig. fig00", "two cuspidal edges and the line of self-intersection branch from the EP4",
    "the sets (s − a)³(s − t) and (s² + b s + c)² lifted to their unknowns are regular curves through the EP4, "
    "in balls",
)  # fmt: skip
def _edges() -> Outcome:
    return proof(
        not _edge_at_EP4().contains(0) and not _line_at_EP4().contains(0),
        "Along the one lifted curve t − a changes sign at the EP4: two edges, triple root left or right of the simple "
        "one. Along the other b² − 4 c changes sign: real double roots (the self-intersection) on one side, a complex "
        "double pair on the other.",
    )


@_claim(
    "plane", "text before Eq. epset", "the line of self-intersection lies in the plane χ_B = √(ζ_B/ζ_H)",
    "p = a0 (s² + b s + c)² with b eliminated: c² = a4/a0 and c = a3/a1, in r and q",
)  # fmt: skip
def _plane() -> Outcome:
    return proof(
        lemmas.asymmetry_identity(),  # b3² = (c b1)² with c² = 1
        "With c = 1/h > 0 only χ_B = r = √(ζ_B/ζ_H). The other solution, χ_B = −r with c = −1/h, is a second line, of "
        "unstable bicycles, away from the EP4.",
    )


@_claim(
    "discriminant", "text before Eq. epset",
    "the discriminant simplifies in the plane χ_B = √(ζ_B/ζ_H) and provides the curve",
    "discriminant of σ⁴ + B1 σ³ + B2 σ² + B1 σ + 1 by a resultant, factored exactly",
)  # fmt: skip
def _discriminant() -> Outcome:
    B1, _, variables = lemmas.palindrome()
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


def is_cusp(point: Mapping[str, Any], plane: tuple[str, str]) -> bool:
    """Whether the curve (s − a)²(s² + b s + c) through an EP3 is regular in its unknowns and stops in the plane."""
    p, (a, b, c) = lemmas.lifted("a b c")
    at = {**point, "b": -(point["a"] + point["t"]), "c": point["a"] * point["t"]}
    names = (*plane, "a", "b", "c")
    direction = tangent(p, [[1, -a], [1, -a], [1, b, c]], names, at)
    stops = all(x.contains(0) and abs(x) < _NONE for x in direction[:2])
    return stops and not direction[2].contains(0)


@_claim(
    "fig2-left", "caption of Fig. fig2",
    "at χ_B = √2 − 0.1 the domain of heavy damping has a cusp at an EP3, in the (Fr, λ_s)-plane", _MATCHED,
)  # fmt: skip
def _left() -> Outcome:
    point = lemmas.ep3_left()
    return proof(
        is_cusp(point, ("Fr", "T")) and bool(point["a"] < 0) and bool(point["t"] < 0),
        f"At Fr = {point['Fr'].str(10, radius=False)}, λ_s = {point['T'].atan().str(10, radius=False)}: triple root "
        f"{point['a'].str(8, radius=False)}, simple root {point['t'].str(8, radius=False)}; one Jordan block of order "
        "3, by w0-Jordan.",
        computed=digits(point["Fr"]),
    )


@_claim(
    "fig2-edge", "caption of Fig. fig2", "the EP3 belongs to the cuspidal edge of the swallowtail surface",
    "the set (s − a)³(s − t) in (Fr, χ_B, λ_s) is a regular curve there, in balls, crossing the plane",
)  # fmt: skip
def _edge() -> Outcome:
    p, (a, t) = lemmas.lifted("a t")
    direction = tangent(p, [*[[1, -a]] * 3, [1, -t]], ("Fr", "chi_B", "T", "a", "t"), lemmas.ep3_left())
    return proof(not direction[1].contains(0), "The edge crosses χ_B = √2 − 0.1, as its χ_B changes along it.")


@_claim(
    "fig2-right", "caption of Fig. fig2",
    "at the tilt of the EP4 less 0.18 the domain of heavy damping has two EP3 cusps, in the (Fr, χ_B)-plane", _MATCHED,
)  # fmt: skip
def _right() -> Outcome:
    points = [lemmas.ep3_right(upper) for upper in (True, False)]
    real = all(bool(x["a"] < 0) and bool(x["t"] < 0) for x in points)
    where = "; ".join(f"Fr = {x['Fr'].str(8, radius=False)}, χ_B = {x['chi_B'].str(8, radius=False)}" for x in points)
    return proof(real and all(is_cusp(x, ("Fr", "chi_B")) for x in points), f"They are {where}.")


@_claim(
    "fig2-crossing", "caption of Fig. fig2", "and a self-intersection at the 2EP2 point on its boundary",
    "p(s) = a0 (s² + b s + c)² by interval Newton; the two sheets p(x) = 0 at its double roots x have different "
    "tangents",
)  # fmt: skip
def _crossing() -> Outcome:
    point = lemmas.double_pair("-0.18")
    b, c = point["b"], point["c"]
    half = (b * b - 4 * c).sqrt()
    a, (s,) = lemmas.lifted("s")
    p = [sum(((x * s ** (4 - k)) for k, x in enumerate(a)), s * 0)]
    rows = [
        jacobian(p, ("Fr", "chi_B"), {**point, "T": lemmas.tilted("-0.18"), "s": (sign * half - b) / 2})[0]
        for sign in (1, -1)
    ]
    cross = rows[0][0] * rows[1][1] - rows[0][1] * rows[1][0]
    return proof(
        bool(b > 0) and bool(c > 0) and not cross.contains(0), f"At Fr = {point['Fr'].str(8, radius=False)}, χ_B = √2.",
        computed=digits(point["Fr"]),
    )  # fmt: skip


@_claim(
    "spire", "text after Fig. fig00",
    "the edges and the line bound a trihedral spire inside which all eigenvalues are real and negative",
    "its three corners in the slice 0.05 below the EP4, by interval Newton, and certified roots of a bicycle "
    "between them",
)  # fmt: skip
def _spire() -> Outcome:
    corners = [lemmas.ep3_right(True, "-0.05"), lemmas.ep3_right(False, "-0.05"), lemmas.double_pair("-0.05")]
    signs = all(bool(x["a"] < 0) and bool(x["t"] < 0) for x in corners[:2])
    middle = [float(sum(x[name] for x in corners).mid()) / 3 for name in ("Fr", "chi_B")]
    T = float(lemmas.tilted("-0.05").mid())
    inner = lemmas.at_heights(q(f"{middle[0]:.6f}"), q(f"{middle[1]:.6f}"), q(f"{T:.6f}"))
    outer = lemmas.at_heights(q("2.4"), q("1.42"), q(f"{T:.6f}"))
    return proof(
        signs and heavily_damped(inner) and not heavily_damped(outer),
        "The number of real roots changes only on the discriminant surface, so one inner point decides for all.",
    )


EDGES: tuple[Claim, ...] = (_spire, _left, _edge, _right, _crossing)
