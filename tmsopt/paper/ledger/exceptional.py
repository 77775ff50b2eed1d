"""Section 2.4.2: the EP4 of bicycles with χ_H = 1; Table 1."""

import flint

from tmsopt.arithmetic.identity import Quotient
from tmsopt.models import copo
from tmsopt.paper.ledger import lemmas, printed
from tmsopt.paper.ledger.algebra import depends, polynomials, q, ring, vanishes
from tmsopt.paper.ledger.entry import Claim, Outcome, decimal, digits, proof, section
from tmsopt.paper.ledger.printed import laws

_claim = section("2.4.2 Exact location of the real exceptional point EP4; Table 1")


@_claim("w01", "Eq. w01", "ω0 at χ_H = 1", "a4/a0 of the polynomial at χ_H = 1, as a rational function")
def _w01() -> Outcome:
    Fr, chi_B, T, r, scale = ring("Fr chi_B T r q")
    a = lemmas.quartic(Fr, chi_B, T, r, scale)
    return proof(
        a[4] / a[0] == laws.w01(-(scale**2) * r, -(scale**2) / r) ** 4,
        "Independent of λ_s too: with χ_H = 1 it bounds the abscissa of every design with these heights.",
        "a4/a0 is another function.",
    )


@_claim(
    "chib1", "Eq. chib1", "χ_B = √(ζ_B/ζ_H) at EP4",
    "a3 = ω0² a1 at χ_H = 1 with the radicals taken away by ζ_B = −q² r, ζ_H = −q²/r",
)  # fmt: skip
def _chib1() -> Outcome:
    b, (Fr, chi_B, T, r, scale) = lemmas.monic()
    return proof(b[3] - b[1] == Fr * (r + 1) * (chi_B - r) / (scale * T * r), "The only solution for Fr > 0.")


@_claim(
    "chib1-chibm", "text after Eq. chib1", "it is the minimizer of the critical Froude number",
    "the zero of a3 − ω0² a1 beside the zero of the derivative of Fr_c², taken from the Hurwitz determinant",
)  # fmt: skip
def _same() -> Outcome:
    chi_B, T, r = polynomials("chi_B T r")
    # Fr_c² = T (r² − 1) χ_B/((r² − χ_B)(χ_B − 1)), proved under Frc1
    over, under = T * (r**2 - 1) * chi_B, (r**2 - chi_B) * (chi_B - 1)
    slope = over.derivative("chi_B") * under - over * under.derivative("chi_B")
    return proof(
        slope == T * (r**2 - 1) * (chi_B - r) * (chi_B + r), "The derivative has the zeros ±r, r = √(ζ_B/ζ_H)."
    )


def _eliminated() -> tuple[Quotient, Quotient, tuple[Quotient, ...]]:
    """Fr from p(ω0) = 0 and a2 = 6 ω0² a0 together, then the rest of the latter; with T, r, q."""
    T, r, scale = variables = ring("T r q")
    # p(ω0) − ω0² (a2 − 6 ω0² a0) = 8 a0 ω0⁴ + 2 a1 ω0³, which is linear in Fr
    unit = lemmas.quartic(1 + 0 * T, r, T, r, scale)
    Fr = 4 * unit[0] / (unit[1] * scale)
    b = lemmas.normal(Fr, r, T, r, scale)
    return Fr, b[2] - 6, variables


@_claim("tls", "Eq. tls", "tan λ_s at EP4", "p(ω0) = 0 and a2 = 6 ω0² a0 with Fr eliminated, solved for tan λ_s")
def _tls() -> Outcome:
    _, rest, (T, r, scale) = _eliminated()
    law = laws.tls(-(scale**2) * r, -(scale**2) / r)
    return proof(
        not depends(rest / (T - law), "T") and law == lemmas.tilt_of_EP4(r, scale**2),
        "The only solution. In r = √(ζ_B/ζ_H), h = √(ζ_B ζ_H) it is (r − 1)(r² + 6 r + 1)/(16 h (r + 1)); it is "
        "positive for |ζ_B| > |ζ_H|.",
        "The eliminated equation has another root.",
    )


@_claim(
    "frep4", "Eq. frep4", "Fr_EP4 is a root of this quadratic",
    "the Fr that solves the four coefficient conditions, put into the quadratic; its other root by division",
)  # fmt: skip
def _frep4() -> Outcome:
    Fr, _, (T, r, scale) = _eliminated()
    law = lemmas.tilt_of_EP4(r, scale**2)
    true = 4 * scale * law / (r - 1)
    omega0, zeta_B = -1 / scale, -(scale**2) * r
    other = -((r - 1) ** 2) / (4 * scale * (r + 1))
    zero = [printed.frep4(x, omega0, zeta_B, law) == 0 for x in (true, other)]
    spurious = lemmas.normal(other, r, law, r, scale)[1] != 4
    return proof(
        lemmas.fourfold()
        and true == lemmas.speed_of_EP4(r, scale)
        and all(zero)
        and spurious
        and Fr == 4 * scale * T / (r - 1),
        "The other root, −(r − 1)² |ω0|/(4 (r + 1)), is no EP4: a1 ≠ −4 ω0 a0 there.",
        "The Froude number of the EP4 does not solve it.",
    )


# Table 1 and the text: the EP4 for ζ_B = −0.4, ζ_H = −0.2, as numbers of the field of √2


def _is_zero(value: Quotient) -> bool:
    """Whether it is, with √2 as a variable: equations hold modulo its square less 2."""
    (t,) = polynomials("t")
    return vanishes(value, t**2 - 2)


_FIELD = "the coefficient conditions of (s − ω0)⁴ solved in the field of √2; "
_BALLS = "p(s) = a0 (s − ω0)⁴ solved for Fr, χ_B, tan λ_s and ω0 by interval Newton, 80 digits"


def _heights() -> tuple[Quotient, Quotient, Quotient]:
    """r, h and √2, with h r = 2/5 and h/r = 1/5."""
    (t,) = ring("t")
    return t, t / 5, t


def _radical(
    printed_text: str, squared: Quotient, exponent: int, true: Quotient, ball: flint.arb, claimed: flint.arb
) -> Outcome:
    """A printed radical against the true value: powers equal in the field of √2, and the same number in balls."""
    same = _is_zero(squared - true) and claimed.overlaps(ball)
    words = f"Its power {exponent} is equal in the field of √2." if exponent > 1 else ""
    return proof(same, words, "The powers differ.", printed_text, digits(ball))


@_claim("tab1-chi_B", "Table 1; text before Fig. fig00", "χ_B = √2", f"{_FIELD}{_BALLS}")
def _table_chi() -> Outcome:
    (t,) = ring("t")
    return _radical("√2", t**2, 2, 2 + 0 * t, lemmas.ep4()["chi_B"], flint.arb(2).sqrt())


@_claim("tab1-omega0", "Table 1; Section 2.4.3", "ω0 = −√5/2^(1/4)", f"{_FIELD}{_BALLS}")
def _table_omega0() -> Outcome:
    _, h, t = _heights()
    claimed = -flint.arb(5).sqrt() / flint.arb(2).root(4)
    return _radical("−√5/2^(1/4)", 25 / (2 + 0 * t), 4, 1 / h**2, lemmas.ep4()["s"], claimed)


@_claim(
    "tab1-EP4-tilt", "Table 1; text; captions of Figs. fig1, fig2, fig3", "tan λ_s = 15/4 − (75/32)√2",
    f"{_FIELD}{_BALLS}",
)  # fmt: skip
def _table_tilt() -> Outcome:
    r, h, t = _heights()
    # a1 = −4 ω0 a0 gives Fr² = 16 h T²/(r − 1)²; then a2 = 6 ω0² a0 is linear in T
    T = r * (6 + (r**2 + 1) / r) / ((r**2 - 1) * 16 * h / (r - 1) ** 2)
    claimed = q("15/4") - q("75/32") * flint.arb(2).sqrt()
    return _radical("15/4 − (75/32)√2", q("15/4") - q("75/32") * t, 1, T, lemmas.ep4()["T"], claimed)


@_claim(
    "tab1-EP4-Fr_c", "Table 1", "Fr_c = √(30√2 + 120)/8 at the tilt of the EP4",
    "p(iω) = 0 in the field of √2 and p = a0 (s² + ω²)(s² + b s + c) by interval Newton",
)  # fmt: skip
def _table_Fr_c() -> Outcome:
    r, h, t = _heights()
    T = q("15/4") - q("75/32") * t
    # ω² = a3/a1 = 1/h, and the real part of p(iω)
    unit, still = (copo(x + 0 * t, 0 * t, r, 1 + 0 * t, -h * r, -h / r, T) for x in (1, 0))
    W = unit[3] / unit[1]
    square = (unit[0] * W + unit[4] / W - still[2]) / (unit[2] - still[2])
    claimed = (30 * flint.arb(2).sqrt() + 120).sqrt() / 8
    return _radical("√(30√2 + 120)/8", (30 * t + 120) / 64, 2, square, lemmas.weave("0")["Fr"], claimed)


@_claim("tab1-EP4-Fr_EP", "Table 1; text; caption of Fig. fig00", "Fr_EP4 = 3√(110√2 − 120)/8", f"{_FIELD}{_BALLS}")
def _table_Fr_EP() -> Outcome:
    r, h, t = _heights()
    T = q("15/4") - q("75/32") * t
    claimed = 3 * (110 * flint.arb(2).sqrt() - 120).sqrt() / 8
    return _radical(
        "3√(110√2 − 120)/8", 9 * (110 * t - 120) / 64, 2, 16 * h * T**2 / (r - 1) ** 2, lemmas.ep4()["Fr"], claimed
    )


@_claim("Fr_EP4", "text before Fig. fig00", "Fr_EP4 as a decimal", _BALLS)
def _decimal_Fr_EP4() -> Outcome:
    return decimal("2.236317517", lemmas.ep4()["Fr"])


_PAIRS = (
    "p(s) = a0 (s² + b s + c)² solved for Fr, χ_B, b, c by interval Newton, 80 digits; the tilt from the solved EP4"
)
_WEAVE = "p(s) = a0 (s² + ω²)(s² + b s + c) solved for Fr, ω², b, c by interval Newton, 80 digits"


@_claim("tab1-2EP2-Fr_c", "Table 1", "Fr_c of the 2EP2 bicycle", _WEAVE)
def _table_2ep2_weave() -> Outcome:
    return decimal("1.482682090", lemmas.weave("-0.05")["Fr"])


@_claim("tab1-2EP2-Fr_EP", "Table 1", "Fr_EP of the 2EP2 bicycle", _PAIRS)
def _table_2ep2() -> Outcome:
    return decimal("2.257421384", lemmas.double_pair("-0.05")["Fr"])


@_claim("tab1-CEP2-Fr_c", "Table 1", "Fr_c of the CEP2 bicycle", _WEAVE)
def _table_cep2_weave() -> Outcome:
    return decimal("3.934331969", lemmas.weave("0.80")["Fr"])


@_claim("tab1-CEP2-Fr_EP", "Table 1", "Fr_EP of the CEP2 bicycle", _PAIRS)
def _table_cep2() -> Outcome:
    return decimal("4.103508160", lemmas.double_pair("0.80")["Fr"])


@_claim(
    "tab1-kinds", "Table 1",
    "rows 2 and 3 have two real double eigenvalues, and a complex double pair, at χ_B = √2 and with the same ω0",
    "b² − 4 c and c of the solved factors, with χ_B an unknown",
)  # fmt: skip
def _table_kinds() -> Outcome:
    real, pair = lemmas.double_pair("-0.05"), lemmas.double_pair("0.80")
    root, omega0 = flint.arb(2).sqrt(), lemmas.ep4()["s"]
    same = all(x["chi_B"].overlaps(root) and x["c"].overlaps(omega0**2) for x in (real, pair))
    return proof(
        lemmas.are_real(real) and lemmas.are_complex(pair) and same,
        "The product of each two roots is ω0², so ω0 is their geometric mean; it is a root of row 1 only.",
    )


@_claim(
    "compact", "text of Section 2.4.2",
    "critical parameters of the χ_H = 1 bicycle are elementary in ζ_H, ζ_B (and λ_s)",
    "the matching conditions with the compact forms of tan λ_s and Fr, in r and q",
)  # fmt: skip
def _compact() -> Outcome:
    return proof(
        lemmas.fourfold(),
        "Fr_EP4 needs no quadratic: it is (r² + 6 r + 1)/(4 √h (r + 1)), r = √(ζ_B/ζ_H), h = √(ζ_B ζ_H).",
    )


@_claim(
    "EP4-heights", "text of Section 2.4.2", "the EP4 exists for the heights of the benchmark",
    "the compact form for r < 1, where tan λ_s changes sign, at ζ_B = −1/2, ζ_H = −2 in fractions",
)  # fmt: skip
def _other_heights() -> Outcome:
    r, h = q("0.5"), q(1)
    T = lemmas.tilt_of_EP4(r, h)
    solved = lemmas.ep4()
    return proof(
        bool(solved["T"] > 0) and T < 0 and lemmas.HEIGHTS[0] < lemmas.HEIGHTS[1],
        f"For |ζ_B| < |ζ_H| it exists with λ_s < 0: ζ_B = −1/2, ζ_H = −2 gives tan λ_s = {T}.",
    )


CLAIMS: tuple[Claim, ...] = (
    _w01, _chib1, _same, _tls, _frep4, _compact, _other_heights, _table_chi, _table_omega0, _table_tilt, _table_Fr_c,
    _table_Fr_EP, _decimal_Fr_EP4, _table_2ep2_weave, _table_2ep2, _table_cep2_weave, _table_cep2, _table_kinds,
)  # fmt: skip
