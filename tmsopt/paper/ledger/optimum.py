"""Section 2.4.4: what the EP set means for stability; heavy damping, the steepest tilt, the scaling laws."""

from typing import Any

import flint

from tmsopt.models import copo
from tmsopt.paper.ledger import lemmas
from tmsopt.paper.ledger.abscissa import product_bound
from tmsopt.paper.ledger.algebra import heavily_damped, polynomials, positive_quotient, q, ring, stable
from tmsopt.paper.ledger.entry import EXACT, Claim, Outcome, proof, section, universal
from tmsopt.paper.ledger.printed import laws
from tmsopt.roots.polynomial import product

_claim = section("2.4.4 Localization of the EP set and stability optimization")


@_claim(
    "epset-stable", "text", "the EP set lies entirely in the domain of asymptotic stability",
    "b and c of (s² + b s + c)² on it, with r = 1 + ρ: quotients of polynomials with positive coefficients",
)  # fmt: skip
def _inside() -> Outcome:
    b, _ = lemmas.grown()
    return proof(
        positive_quotient(b[1]) and b[3] == b[1] and b[4] == 1,
        "For |ζ_B| > |ζ_H| and λ_s > 0: b > 0 and c = 1/h > 0, whatever the kind.",
    )


@_claim(
    "epset-bounds", "text",
    "the 2EP2 part of the EP set bounds the domain of heavy damping in the plane χ_B = √(ζ_B/ζ_H)",
    "u² + B1 u + B2 − 2 for u = σ + 1/σ: heavy damping is u1, u2 < −2; rational bicycles on both sides of the curve",
)  # fmt: skip
def _bounds() -> Outcome:
    lemmas.palindrome()
    u, v = polynomials("u v")
    x, y = -(u + v), u * v + 2  # B1 and B2
    identities = x**2 - 4 * y + 8 == (u - v) ** 2 and y + 2 - 2 * x == (u + 2) * (v + 2)
    # r = 2, h = 1, T = 1/4 < 17/48: the curve at Fr = 3/2
    inside, edge, outside = (lemmas.by_hand(Fr, "1/4") for Fr in ("1.45", "1.5", "1.55"))
    return proof(
        identities
        and heavily_damped(inside)
        and not heavily_damped(outside)
        and edge == [q(c) for c in (1, 6, 11, 6, 1)],
        "The other part of the boundary in that plane is a double root ω0, where B2 + 2 = 2 B1. With ζ_B = −2, "
        "ζ_H = −1/2, tan λ_s = 1/4 the curve is met at Fr = 3/2, where p is (s² + 3 s + 1)²; heavy damping is on its "
        "lower side.",
    )


@_claim(
    "fig00-onset", "text; Fig. fig00", "χ_B = √(ζ_B/ζ_H) maximises λ_s at the onset of weaving, for given Fr",
    "tan λ_s from p(iω) = 0 as a function of χ_B; its maximum less it is a square over positive factors",
)  # fmt: skip
def _onset() -> Outcome:
    Fr, chi_B, r, h = ring("Fr chi_B r h")

    def tilt(chi: Any) -> Any:
        nothing = 0 * Fr
        unit, none = (
            copo(Fr, nothing, chi, 1 + nothing, -h * r, -h / r, x + nothing) for x in (1, 0)
        )  # fmt: skip
        W = none[3] / none[1]  # ω², which does not depend on T
        # a0 W² − a2 W + a4 is linear in T
        at_1, at_0 = (c[0] * W**2 - c[2] * W + c[4] for c in (unit, none))
        return -at_0 / (at_1 - at_0)

    return proof(
        tilt(r) - tilt(chi_B) == Fr**2 * (chi_B - r) ** 2 / ((r**2 - 1) * chi_B), "The only maximum for χ_B > 0."
    )


@_claim(
    "fig00-heavy", "text; Fig. fig00",
    "χ_B = √(ζ_B/ζ_H) maximises λ_s on the boundary of heavy damping: at EP4 for Fr = Fr_EP4, at 2EP2 for Fr > Fr_EP4",
    "every candidate for a maximum at given Fr: interior, one double root, EP3, 2EP2; by exact polynomial inequalities",
)  # fmt: skip
def _steepest() -> Outcome:
    solved = lemmas.double_pair("0.80")
    return proof(
        lemmas.tilt_bound()
        and lemmas.triple_roots_are_slow()
        and lemmas.smooth_parts_have_no_maximum()
        and lemmas.one_pair_of_double_roots()
        and bool(solved["Fr"] > lemmas.ep4()["Fr"]),
        "At given Fr > Fr_EP4 the heavily damped bicycles have no EP3, tan λ_s has no maximum inside nor where one "
        "root is double, and one 2EP2 exists; the set with tan λ_s ≥ ε is compact, so that 2EP2 is the maximum. For "
        "√(r/h) < Fr < Fr_EP4 the plane holds two 2EP2.",
    )


SLOW = tuple(q(x) for x in ("6", "4", "3", "1/72"))
"""Minus the eigenvalues of a slow heavily damped bicycle with ζ_B = −2, ζ_H = −1/2 (r = 2, h = 1)."""


def slow_bicycle() -> tuple[Any, Any, Any]:
    """Its Fr, χ_B and tan λ_s."""
    e = product(*[[1, x] for x in SLOW])
    sums = 2 * e[1] + e[3]
    Fr, T = (2 * e[2] + 5) / sums, 3 * (2 * e[2] + 5) / sums**2
    return Fr, 1 + e[3] * T / Fr, T


def _none_in_the_plane() -> bool:
    """At χ_B = r, u1 = −v and u2 = −w obey (r v − f (r + 1))(r w − f (r + 1)) = (r + 1)² (f² − r).

    With f < 2 r/(r + 1) ≤ √r the right side is negative, the left positive for v, w ≥ 2.
    """
    f, r, v, w, root = ring("f r v w root")
    relation = r * (v * w + 2) + r**2 + 1 - f * (r + 1) * (v + w)
    apart = (r * v - f * (r + 1)) * (r * w - f * (r + 1)) - (r + 1) ** 2 * (f**2 - r)
    below = root - 2 * root**2 / (root**2 + 1) == root * (root - 1) ** 2 / (root**2 + 1)
    return bool(apart == r * relation and below)


@_claim(
    "fig00-always", "text; Fig. fig00, lower left", "that maximum is always attained at a singular point of the EP set",
    "the equation for u1, u2 in the plane at small Fr, as polynomials; a bicycle with chosen rational eigenvalues",
)  # fmt: skip
def _always() -> Outcome:
    Fr, chi_B, T = slow_bicycle()
    p = copo(Fr, q(0), chi_B, q(1), q(-2), q("-0.5"), T)
    eigenvalues = [c / p[0] for c in p] == product(*[[1, x] for x in SLOW])
    r = flint.arb(2).sqrt()
    lower_left = bool((lemmas.ep4()["Fr"] - flint.arb(q("0.1"))) * (r / 5).sqrt() < 2 * r / (r + 1))
    return universal(
        "Fr ≥ Fr_EP4, the cases that the sentence then names",
        _steepest.check().verdict == EXACT,
        f"ζ_B = −2, ζ_H = −1/2, χ_B = {chi_B}, tan λ_s = {T}, Fr = {Fr} has the eigenvalues −6, −4, −3, −1/72, while "
        "at χ_B = √(ζ_B/ζ_H) = 2 no tilt gives heavy damping at any Fr < 4/3",
        eigenvalues and heavily_damped(p) and Fr < q("4/3") and _none_in_the_plane(),
        remark="The lower left part of Fig. fig00, Fr = Fr_EP4 − 0.1, is such a speed: there √2 is no maximizer."
        if lower_left
        else "",
    )


@_claim(
    "EP4-steepest", "text", "the absolute maximum of λ_s with heavy damping is attained exactly at EP4",
    "tan λ_s as a function of four positive roots with product 1, bounded by sums of squares, for every Fr and χ_B",
)  # fmt: skip
def _absolute() -> Outcome:
    return proof(lemmas.tilt_bound(), "For every pair of heights with |ζ_B| > |ζ_H|.")


@_claim(
    "EP4-abscissa", "text", "the EP4 also minimizes the spectral abscissa",
    "product bound with a4/a0 = 1/(ζ_B ζ_H), which no other parameter of the χ_H = 1 bicycle enters; the EP4 "
    "attains it",
)  # fmt: skip
def _abscissa() -> Outcome:
    return proof(
        product_bound() and lemmas.monic()[0][4] == 1 and lemmas.fourfold(),
        "Globally, over Fr, χ_B, λ_s and μ, for given ζ_B and ζ_H; and the EP4 is the only minimizer with Fr > 0.",
    )


@_claim(
    "dp", "Eq. dp", "0 < tan λ_s ≤ (tls) with χ_B = √(ζ_B/ζ_H) gives heavy damping at some speed",
    "necessity by the bound for every χ_B; existence by u1, u2 < −2 at the end of the speeds; fractions for the "
    "counterexample",
)  # fmt: skip
def _dp() -> Outcome:
    r, scale = ring("r q")
    law = laws.tls(-(scale**2) * r, -(scale**2) / r)
    low, shallow = heavily_damped(lemmas.by_hand("1.45", "1/4")), heavily_damped(lemmas.by_hand("2", "1/10"))
    other = lemmas.tilt_of_EP4(q("1/2"), q(1))
    return universal(
        "|ζ_B| > |ζ_H|, as lscf demand for λ_s > 0; then the bound is necessary for any χ_B, and sufficient",
        lemmas.tilt_bound() and lemmas.order_identity() and low and shallow and law == lemmas.tilt_of_EP4(r, scale**2),
        f"ζ_B = −1/2, ζ_H = −2 gives the range 0 < tan λ_s ≤ {other}, which is empty; the dual designs have "
        f"{other} ≤ tan λ_s < 0",
        other < 0,
    )


@_claim(
    "dp-omega0", "Eq. dp", "ω0 = −(1/(ζ_B ζ_H))^(1/4) in the design principle",
    "a4/a0 of the bicycle with χ_H = 1 in balls at the solved EP4",
)  # fmt: skip
def _dp_omega0() -> Outcome:
    design = lemmas.ep4()
    a = lemmas.at_heights(design["Fr"], design["chi_B"], design["T"])
    return proof(bool(abs(a[4] / a[0] - 1 / (lemmas.HEIGHTS[0] * lemmas.HEIGHTS[1])) < flint.arb("1e-40")))


@_claim(
    "dp-robust", "text after Eq. dp; Fig. fig2",
    "with χ_B only approximately √(ζ_B/ζ_H) the domain of heavy damping is large enough",
    "certified real roots of rational bicycles 0.1 from χ_B = √2 on either side, and the EP3 that ends their domain",
)  # fmt: skip
def _robust() -> Outcome:
    below, above = (
        lemmas.at_heights(q("2.06"), q("1.3142"), q("0.18")), lemmas.at_heights(q("2.22"), q("1.5142"), q("0.22")),
    )  # fmt: skip
    b, (_, chi, _, ratio, _) = lemmas.monic()
    fixed = b[3] * (ratio**2 - chi) == b[1] * ratio * (chi - 1)
    r = flint.arb(2).sqrt()
    chi_B = r - flint.arb(q("0.1"))
    kappa = r * (chi_B - 1) / (r**2 - chi_B)
    bound = (r**2 - 1) * kappa**2 * (r**2 + 6 * r + 1) / (16 * r / 5 * (r + kappa) ** 2)
    share = lemmas.ep3_left()["T"].atan() / lemmas.ep4()["T"].atan()
    return universal(
        "'large enough' read as not empty: rational bicycles at χ_B = √2 ± 0.1 are heavily damped; but at √2 − 0.1 the "
        f"cusp of the domain lies at {float(share.mid()):.0%} of the tilt of the EP4",
        heavily_damped(below) and heavily_damped(above) and stable(below),
        "tan λ_s = 2/5 allows heavy damping at χ_B = √2, but at √2 − 0.1 heavy damping needs tan λ_s ≤ "
        f"{bound.str(4, radius=False)}, as a3/a1 is fixed there: e3 = κ e1 with κ < 1, e1 ≥ 4/κ and e2 ≤ (3/8) κ² e1²",
        lemmas.newton_inequalities()
        and lemmas.tilt_of_roots()
        and fixed
        and bool(bound < q("0.4"))
        and bool(lemmas.ep4()["T"] > q("0.4")),
    )


CLAIMS: tuple[Claim, ...] = (
    _inside, _bounds, _onset, _steepest, _always, _absolute, _abscissa, _dp, _dp_omega0, _robust,
)  # fmt: skip
