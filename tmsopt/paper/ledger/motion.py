"""Section 2.4.5: how the eigenvalues move as the Froude number grows."""

from typing import Any

import flint

from tmsopt.models.exact import Tilt
from tmsopt.paper.ledger import lemmas
from tmsopt.paper.ledger.algebra import heavily_damped, positive_quotient, q, real_roots, ring, slope, stable
from tmsopt.paper.ledger.entry import Claim, Outcome, digits, proof, section, universal
from tmsopt.paper.ledger.printed import laws
from tmsopt.roots.exact import isolated_roots
from tmsopt.roots.polynomial import evaluate as value_at

_claim = section("2.4.5 Mechanism of self-stability and CEP2 as a precursor to weaving")

_U = "p over |ω0| as u² + B1 u + B2 − 2 with u = σ + 1/σ, exactly; "


@_claim(
    "motion-standstill", "text", "at Fr = 0 there are two real negative and two real positive eigenvalues",
    "factorisation of the even polynomial at Fr = 0, in r and q; for any χ_H the symmetric matrices M and P",
)  # fmt: skip
def _standstill() -> Outcome:
    T, r, scale = ring("T r q")
    b = lemmas.normal(0 * T, r, T, r, scale)
    even = b[1] == 0 and b[3] == 0 and b[2] == -(r + 1 / r) and b[4] == 1
    return proof(
        even and real_squares() and lemmas.standstill_identity(),
        "They are ±√r |ω0| and ±|ω0|/√r, r = √(ζ_B/ζ_H), whatever λ_s. So it is for any χ_H where a0 a4 > 0: s² is "
        "real, as M > 0 and P are symmetric, and both s² are positive, as a2 then differs in sign from a0.",
    )


def real_squares() -> bool:
    """The discriminant of det(M S + P) in S, times M11², is a square plus 4 det M times a square."""
    m11, m12, m22, p11, p12, p22 = ring("m11 m12 m22 p11 p12 p22")
    middle = m11 * p22 + m22 * p11 - 2 * m12 * p12
    det_M, det_P = m11 * m22 - m12**2, p11 * p22 - p12**2
    skew = m11 * p12 - m12 * p11
    squares = (m11 * (m11 * p22 - m22 * p11) - 2 * m12 * skew) ** 2 + 4 * det_M * skew**2
    return bool(m11**2 * (middle**2 - 4 * det_M * det_P) == squares)


@_claim(
    "motion-positive", "text", "as Fr grows the positive eigenvalues move towards each other",
    "derivative of p with respect to Fr at s > 0, where a1, a3 and ζ_B (ζ_B − ζ_H) are positive, for any χ_H",
)  # fmt: skip
def _approach() -> Outcome:
    a, (Fr, _, _, _, zeta_B, zeta_H, _) = lemmas.general()
    change = [slope(c, "Fr") for c in a]
    return proof(
        change[0] == 0
        and change[4] == 0
        and change[1] * Fr == a[1]
        and change[3] * Fr == a[3]
        and change[2] == 2 * Fr * (zeta_B - zeta_H) * zeta_B,
        "At every s > 0 p grows with Fr, so the interval between the two roots, where p < 0, shrinks from both ends.",
    )


def _turn() -> tuple[bool, Any]:
    """Fr² at which the negative eigenvalues stop moving apart, proved; and its value at the tilt of the EP4."""
    B1, B2, (Fr, T, r, scale) = lemmas.palindrome()
    u = -2 * scale * (r + 1) * Fr / r  # where B1' u + B2' = 0, so that du/dFr = 0
    still = slope(B1, "Fr") * u + slope(B2, "Fr") == 0
    square = r * (r + 1) * T / (4 * scale**2 * (r + 1) * T - r * (r - 1))
    rest = u**2 + B1 * u + B2 - 2
    on = rest / (Fr**2 - square)
    root, tilt = flint.arb(2).sqrt(), lemmas.ep4()["T"]
    h = root / 5
    value = (root * (root + 1) * tilt / (4 * h * (root + 1) * tilt - root * (root - 1))).sqrt()
    return bool(still and slope(on, "Fr") == 0), value


@_claim(
    "motion-negative", "text", "the same happens, at a slower rate, with the negative eigenvalues",
    f"{_U}the speed at which du/dFr = 0 for the negative pair; sign of p at a point in fractions",
)  # fmt: skip
def _slower() -> Outcome:
    holds, value = _turn()
    before, after = (value_at(lemmas.by_hand(Fr, "1/4"), q("-1.5")) for Fr in ("0", "0.1"))
    return universal(
        "Fr² > r (r + 1) T/(4 h (r + 1) T − r (r − 1)), T = tan λ_s, and T above the pole of that; until then the "
        "negative eigenvalues move apart",
        holds and bool(value > _merging()),
        "ζ_B = −2, ζ_H = −1/2, χ_B = 2, tan λ_s = 1/4: at Fr = 0 the negative roots are −√2 and −1/√2 and "
        f"p(−3/2)/a0 = {before} > 0; at Fr = 1/10 it is {after} < 0, so one root has passed −3/2",
        before > 0 > after,
        computed=digits(value),
        remark="The number is that speed at the tilt of the EP4 in Table 1; the positive pair merges there long "
        f"before, at Fr = {_merging().str(6, radius=False)}.",
    )


def _merging() -> Any:
    """Fr at which the positive pair of the EP4 bicycle merges: B2 + 2 + 2 B1 = 0."""
    r, tilt = flint.arb(2).sqrt(), lemmas.ep4()["T"]
    scale = (r / 5).sqrt()
    half = r * (r - 1) / scale / (r**2 - 1)
    return -half + (half**2 + (r - 1) ** 2 * tilt / (r**2 - 1)).sqrt()


@_claim(
    "motion-double", "text", "the positive eigenvalues merge into a double real eigenvalue s = −ω0 > 0",
    f"{_U}p' − 2 p at σ = 1 for any χ_B; certified roots in fractions",
)  # fmt: skip
def _double() -> Outcome:
    b, _ = lemmas.monic()
    p = b[0] + b[1] + b[2] + b[3] + b[4]
    derivative = 4 * b[0] + 3 * b[1] + 2 * b[2] + b[3]
    only = derivative - 2 * p == b[1] - b[3]
    (_, B1, B2, *_), (_, tilt, rho, scale) = lemmas.grown()
    met = (B2 + 2 + 2 * B1) * (1 + rho) * tilt * scale + scale * rho**2 * tilt  # the constant term added back
    other = lemmas.quartic(q(1), q(3), q(1), q(2), q(1))
    return universal(
        "χ_B = √(ζ_B/ζ_H); the text divides the cases only in its next sentence",
        only and positive_quotient(met),
        "ζ_B = −2, ζ_H = −1/2 (|ω0| = 1), χ_B = 3: a double root 1 would need a1 = a3, but a1/a3 = "
        f"{other[1] / other[3]}",
        other[1] != other[3],
        remark="The double root then is another positive number.",
    )


@_claim(
    "motion-split", "text", "at χ_B = √(ζ_B/ζ_H) it splits into a complex pair with positive real parts (weaving)",
    f"{_U}sign of du/dFr where u > 0, with r = 1 + ρ",
)  # fmt: skip
def _split() -> Outcome:
    (_, B1, B2, *_), _ = lemmas.grown()
    return proof(
        positive_quotient(slope(B1, "Fr")) and positive_quotient(slope(B2, "Fr")),
        "du/dFr = −(B1' u + B2')/(2 u + B1) < 0 for u > 0: u falls through 2, and for 0 < u < 2 the real part of "
        "σ is u/2.",
    )


@_claim(
    "motion-circle", "text; Fig. fig3", "the pair evolves along the circle |s| = |ω0|",
    "p over |ω0| as the product of σ² − u σ + 1 for the two roots u, as polynomials",
)  # fmt: skip
def _circle() -> Outcome:
    u, v = ring("u v")
    product = [1, -(u + v), u * v + 2, -(u + v), 1]
    B1, B2 = product[1], product[2]
    same = product[3] == B1 and u * u + B1 * u + B2 - 2 == 0 and v * v + B1 * v + B2 - 2 == 0
    lemmas.palindrome()
    return proof(
        bool(same), "A real u with |u| < 2 gives a pair of modulus 1. It ends at Fr_EP, where the u become complex."
    )


@_claim(
    "motion-Fr_c", "text", "it crosses the imaginary axis exactly at Fr_c of (Frc1), which yields asymptotic stability",
    f"{_U}u = 0 beside the printed Fr_c², as rational functions; the Hurwitz determinant changes sign there",
)  # fmt: skip
def _crossing() -> Outcome:
    _, B2, (Fr, T, r, scale) = lemmas.palindrome()
    law = laws.Frc1(r, -(scale**2) * r, -(scale**2) / r, Tilt(T))
    below, above = stable(lemmas.by_hand("1.7", "1")), stable(lemmas.by_hand("1.75", "1"))
    return proof((Fr**2 - law) * (r**2 - 1) / (r * T) == B2 - 2 and above and not below)


def _third() -> bool:
    """(u1 + 2)(u2 + 2) = B2 + 2 − 2 B1 is negative up to its one positive zero in Fr, for every tilt."""
    B1, B2, (Fr, T, r, scale) = lemmas.palindrome()
    value = (B2 + 2 - 2 * B1) * r * T
    return bool(value == (r**2 - 1) * Fr**2 - 2 * r * (r - 1) * Fr / scale - (r - 1) ** 2 * T)


@_claim(
    "motion-EP4", "text; Fig. fig3, upper row",
    "at the tilt (tls) the pair meets the two negative real eigenvalues exactly at Fr_EP4, in s = ω0",
    f"{_U}u1 and u2 stay on different sides of −2 until Fr_EP4, where both are −2",
)  # fmt: skip
def _meeting() -> Outcome:
    return proof(
        _third() and lemmas.fourfold(),
        "Until then one pair is on the circle and two eigenvalues are real, as (u1 + 2)(u2 + 2) < 0.",
    )


@_claim(
    "motion-EP4-after", "text; Fig. fig3, upper row",
    "beyond Fr_EP4 the multiple eigenvalue splits into a quadruplet of complex eigenvalues with negative real parts",
    f"{_U}its discriminant at the tilt of the EP4 as a multiple of Fr_EP4² − Fr²; Routh in balls beyond",
)  # fmt: skip
def _after() -> Outcome:
    Fr, rho, scale = ring("Fr rho q")
    r = 1 + rho
    law = lemmas.tilt_of_EP4(r, scale**2)
    b = lemmas.normal(Fr, r, law, r, scale)
    multiple = (b[1] ** 2 - 4 * b[2] + 8) / ((4 * scale * law / rho) ** 2 - Fr**2)
    design = lemmas.ep4()
    later = lemmas.at_heights(design["Fr"] + flint.arb("0.1"), design["chi_B"], design["T"])
    return proof(
        slope(multiple, "Fr") == 0 and positive_quotient(multiple) and stable(later),
        "Beyond Fr_EP4 both u are complex, so no root is real or on the circle; all stay left of the axis beyond Fr_c.",
    )


@_claim(
    "motion-2EP2", "text; Fig. fig3, middle row",
    "for smaller tilt the pair reaches the real axis first, at ω0, and splits: four simple negative real eigenvalues",
    f"{_U}B1 less 4 where (u1 + 2)(u2 + 2) = 0, in r and q; certified roots in fractions",
)  # fmt: skip
def _middle() -> Outcome:
    before, heavy, after = (lemmas.by_hand(Fr, "1/4") for Fr in ("1.38", "1.45", "1.55"))
    real = [real_roots(p) for p in (before, heavy, after)]
    return proof(
        _third() and lemmas.order_identity() and real == [2, 4, 0] and heavily_damped(heavy),
        "With ζ_B = −2, ζ_H = −1/2, tan λ_s = 1/4 the numbers of real roots at Fr = 1.38, 1.45, 1.55 are 2, 4, 0.",
    )


@_claim(
    "motion-2EP2-both", "text; Fig. fig3, middle row",
    "at Fr_EP of (epset) two real negative double eigenvalues originate simultaneously, and then become two pairs",
    f"{_U}its discriminant in Fr²; certified roots of a bicycle below the pole of (epset), in fractions",
)  # fmt: skip
def _simultaneous() -> Outcome:
    edge = lemmas.by_hand("1.5", "1/4")
    shallow = all(heavily_damped(lemmas.by_hand(Fr, "1/10")) for Fr in ("2", "10", "1000"))
    return universal(
        "tan λ_s (r + 1)/(r − 1) > r/(4 h), the pole of (epset); below it heavy damping never ends",
        edge == [q(c) for c in (1, 6, 11, 6, 1)] and lemmas.order_identity() and stable(lemmas.by_hand("1.55", "1/4")),
        "ζ_B = −2, ζ_H = −1/2, χ_B = 2, tan λ_s = 1/10: all roots are simple, real and negative at Fr = 2, 10 and "
        "1000, as B1² − 4 B2 + 8 = 40 Fr² + 18",
        shallow,
    )


@_claim(
    "motion-CEP2", "text; Fig. fig3, lower row",
    "for larger tilt the negative real eigenvalues meet first, at ω0, and the pairs meet on the circle at Fr_EP",
    f"{_U}B1 less 4 where (u1 + 2)(u2 + 2) = 0, in r and q; certified roots in fractions",
)  # fmt: skip
def _lower() -> Outcome:
    before, on, after = (lemmas.by_hand(Fr, "1") for Fr in ("1.5", "1.85", "2"))
    counts = [real_roots(p) for p in (before, on, after)]
    round_ = all(abs(z) - 1 < flint.arb("1e-10") and 1 - abs(z) < flint.arb("1e-10") for z, _ in isolated_roots(on))
    off = all(not (abs(z) - 1).contains(0) for z, _ in isolated_roots(after))
    return proof(
        _third() and lemmas.order_identity() and counts == [2, 0, 0] and round_ and off and stable(after),
        "With ζ_B = −2, ζ_H = −1/2, tan λ_s = 1: two real roots at Fr = 3/2, two pairs of modulus 1 at 1.85, four "
        "complex roots off the circle at 2; Fr_EP² = 18/5. The real parts after the collision are negative.",
    )


CLAIMS: tuple[Claim, ...] = (
    _standstill, _approach, _slower, _double, _split, _circle, _crossing, _meeting, _after, _middle, _simultaneous,
    _lower,
)  # fmt: skip
