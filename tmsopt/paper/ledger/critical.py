"""Section 2.4.1: bicycles with χ_H = 1, their critical Froude number and its minimum."""

from typing import Any

import flint

from tmsopt.models import copo
from tmsopt.models.exact import Tilt
from tmsopt.paper.ledger import lemmas, printed
from tmsopt.paper.ledger.algebra import depends, polynomials, q, ring, stable_left_of
from tmsopt.paper.ledger.entry import Claim, Outcome, proof, section, universal
from tmsopt.paper.ledger.printed import laws
from tmsopt.paper.ledger.stability import WITNESS, upright_case, wrongly_admitted

_claim = section("2.4.1 χ_H = 1: the critical Froude number and its minimum")


@_claim(
    "chi_H-near-1", "text", "the benchmark and the realization have χ_H ≈ 1",
    "relative difference of the two printed values from 1, in fractions",
)  # fmt: skip
def _near_1() -> Outcome:
    gaps = [abs(q(x) - 1) for x in ("1.02", "0.921")]
    return universal(
        "≈ read as within 8 %",
        all(gap < q("0.08") for gap in gaps),
        f"the printed values 1.02 and 0.921 differ from 1 by {gaps[0]} and {gaps[1]}, on different sides, and the "
        "stability conditions are not the same on the two sides (see lscf-sufficient)",
        all(gap > 0 for gap in gaps),
    )


FASTER: lemmas.Design = tuple(q(x) for x in ("2.2362", "1.9673", "1.4754", "0.95", "-0.4", "-0.2", "0.4903"))
"""A design with χ_H < 1 that decays faster than any with χ_H = 1 and the same heights."""


@_claim(
    "chi_H-generality", "text before Eq. Frc1", "χ_H = 1 simplifies without affecting generality",
    "what is proved at χ_H = 1, tried elsewhere: derivatives with respect to μ, the Routh conditions of two rational "
    "designs, and interval Newton at the EP4",
)  # fmt: skip
def _generality() -> Outcome:
    Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T = polynomials("Fr mu chi_B chi_H zeta_B zeta_H T")
    slopes = [c.derivative("mu") for c in copo(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T)]
    by_mass = any(x != 0 for x in slopes) and all(x.subs({"chi_H": 1}) == 0 for x in slopes)
    bound = -1 / flint.arb(FASTER[4] * FASTER[5]).root(4)  # ω0 at χ_H = 1
    decays = stable_left_of(copo(*FASTER), q("-2.4"))
    return universal(
        "said of what exists, for χ_H near 1: the EP4 is a regular zero, so one persists, with other numbers; and of "
        "lscf for χ_H ≥ 1",
        bool(lemmas.ep4()) and upright_case(),
        "for every χ_H ≠ 1 the spectrum depends on μ. With χ_H = 19/20, μ = 1.9673, χ_B = 1.4754, tan λ_s = 0.4903, "
        f"Fr = 2.2362 and the heights of Table 1 all roots lie left of −2.4, where {bound.str(5, radius=False)} is "
        "the least abscissa with χ_H = 1; and for χ_H = 9/10 all five lines of lscf admit an unstable bicycle (see "
        "lscf-sufficient), which they cannot for χ_H = 1",
        by_mass and decays and bound > q("-2") and wrongly_admitted(WITNESS),
    )


@_claim("Frc1", "Eq. Frc1", "Fr_c² at χ_H = 1", "p(iω) = 0 at χ_H = 1 with ω² eliminated, as rational functions")
def _frc1() -> Outcome:
    Fr, mu, chi_B, zeta_B, zeta_H, T = ring("Fr mu chi_B zeta_B zeta_H T")
    a = copo(Fr, mu, chi_B, 1 + 0 * T, zeta_B, zeta_H, T)
    W = a[3] / a[1]
    still = copo(0 * T, mu, chi_B, 1 + 0 * T, zeta_B, zeta_H, T)[2]
    slope = (a[2] - still) / Fr**2
    square = ((a[0] * W**2 + a[4]) / W - still) / slope
    return proof(
        square == laws.Frc1(chi_B, zeta_B, zeta_H, Tilt(T)), otherwise="The eliminated condition has another root."
    )


@_claim(
    "chi_H-1-mu", "text after Eq. Frc1", "χ_H = 1 makes Fr_c and the conditions lscf independent of μ",
    "derivative of every coefficient with respect to μ at χ_H = 1; line 2 of lscf at χ_H = 1",
)  # fmt: skip
def _no_mu() -> Outcome:
    Fr, mu, chi_B, zeta_B, zeta_H, T = polynomials("Fr mu chi_B zeta_B zeta_H T")
    a = copo(Fr, mu, chi_B, T * 0 + 1, zeta_B, zeta_H, T)
    free = all(c.derivative("mu") == 0 for c in a)
    return proof(
        free and a[4] == -zeta_B * T,
        "The whole polynomial is. Line 2 still prints μ, but for μ > 0 it then says tan λ_s > 0, and so does line 1.",
    )


@_claim(
    "chi_H-1-implies", "text after Eq. Frc1", "lscf imply χ_B > 1 and |ζ_B| > |ζ_H|",
    "signs of a3 and of the slope of the Hurwitz determinant at χ_H = 1",
)  # fmt: skip
def _implied() -> Outcome:
    Fr, mu, chi_B, zeta_B, zeta_H, T = ring("Fr mu chi_B zeta_B zeta_H T")
    a = copo(Fr, mu, chi_B, 1 + 0 * T, zeta_B, zeta_H, T)
    hurwitz = (a[1] * a[2] * a[3] - a[0] * a[3] ** 2 - a[4] * a[1] ** 2) / (a[1] * a[3])
    still = hurwitz - Fr**2 * (zeta_B - zeta_H) * zeta_B
    return proof(
        a[3] == Fr * (1 - chi_B) * zeta_B and not depends(still, "Fr"),
        "Lines 3 and 4 at χ_H = 1; Fr_c > 0 adds χ_B < ζ_B/ζ_H, which is a1 > 0.",
    )


@_claim(
    "dimension-5", "text after Eq. Frc1", "χ_H = 1 reduces the parameters from 7 to 5: Fr, χ_B, ζ_H, ζ_B, λ_s",
    "derivatives of the monic polynomial with respect to every parameter at χ_H = 1",
)  # fmt: skip
def _five() -> Outcome:
    names = "Fr mu chi_B zeta_B zeta_H T"
    Fr, mu, chi_B, zeta_B, zeta_H, T = ring(names)
    a = copo(Fr, mu, chi_B, 1 + 0 * T, zeta_B, zeta_H, T)
    present = [name for name in names.split() if any(depends(c / a[0], name) for c in a[1:])]
    f, tau, chi, r, scale = ring("f tau chi r scale")
    b = copo(f / scale, 0 * f, chi, 1 + 0 * f, -(scale**2) * r, -(scale**2) / r, tau / scale**2)
    four = not any(depends(b[k] / b[0] * scale**k, "scale") for k in range(5))
    return proof(
        len(present) == 5 and "mu" not in present,
        "With time in units of 1/|ω0| one more drops out: the roots over |ω0| depend on four numbers only, "
        "Fr (ζ_B ζ_H)^(1/4), √(ζ_B ζ_H) tan λ_s, χ_B and ζ_B/ζ_H."
        if four
        else "",
        printed="5",
        computed=str(len(present)),
    )


@_claim(
    "chibm", "Eq. chibm", "Fr_c is least over χ_B at χ_B = √(ζ_B/ζ_H)",
    "identity: Fr_c² less its value there is a square over the two distances from the poles",
)  # fmt: skip
def _chibm() -> Outcome:
    r, chi_B, T, h = ring("r chi_B T h")
    zeta_B, zeta_H = -h * r, -h / r

    def square(chi: Any) -> Any:
        a = copo(1 + 0 * T, 0 * T, chi, 1 + 0 * T, zeta_B, zeta_H, T)
        still = copo(0 * T, 0 * T, chi, 1 + 0 * T, zeta_B, zeta_H, T)[2]
        W = a[3] / a[1]
        return ((a[0] * W**2 + a[4]) / W - still) / (a[2] - still)

    excess = square(chi_B) - square(r)
    under = (r**2 - chi_B) * (chi_B - 1)
    outside = laws.Frc1(q("-0.1"), q(-4), q(-1), Tilt(q(1)))
    return proof(
        excess == T * (r + 1) * (chi_B - r) ** 2 / ((r - 1) * under) and outside > 0,
        "The only minimum on 1 < χ_B < ζ_B/ζ_H, the interval that lscf allow: the excess is "
        "tan λ_s (r + 1)(χ_B − r)²/((r − 1)(r² − χ_B)(χ_B − 1)), r = √(ζ_B/ζ_H). The formula alone is positive and "
        f"smaller for χ_B < 0: with ζ_B = −4, ζ_H = −1, tan λ_s = 1 it is {outside} at χ_B = −1/10 and 3 at χ_B = 2.",
    )


@_claim(
    "frm", "Eq. frm", "the least critical Froude number",
    "Fr² from p(iω) = 0 at χ_B = √(ζ_B/ζ_H), with √|ζ_B| and √|ζ_H| as variables",
)  # fmt: skip
def _frm() -> Outcome:
    root_B, root_H, T, Fr = ring("root_B root_H T Fr")
    a = copo(Fr, 0 * T, root_B / root_H, 1 + 0 * T, -(root_B**2), -(root_H**2), T)
    W = a[3] / a[1]
    real = a[0] * W**2 - a[2] * W + a[4]
    lead = -W * root_B**2 * (root_B**2 - root_H**2)
    return proof(
        real == lead * (Fr**2 - printed.frm(root_B, root_H, T)),
        "Real for |ζ_B| > |ζ_H| and tan λ_s > 0, as lscf demand; ω² = 1/√(ζ_B ζ_H) there.",
        "The condition p(iω) = 0 has another root.",
    )


CLAIMS: tuple[Claim, ...] = (_near_1, _generality, _frc1, _no_mu, _implied, _five, _chibm, _frm)
