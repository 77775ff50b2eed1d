"""Section 2.2: the conditions for asymptotic stability and the critical Froude number."""

from collections.abc import Sequence
from functools import cache
from typing import Any

import flint

from tmsopt.models import copo
from tmsopt.models.exact import Tilt
from tmsopt.paper.ledger import lemmas
from tmsopt.paper.ledger.algebra import matched, polynomials, positive, q, ring, stable, unstable
from tmsopt.paper.ledger.entry import EXACT, Claim, Outcome, decimal, proof, section, universal
from tmsopt.paper.ledger.printed import laws

_claim = section("2.2 Asymptotic stability and the critical Froude number")

_NAMES = "Fr mu chi_B chi_H zeta_B zeta_H T"

_NECESSARY = (
    "as a necessary condition: sign identities of polynomials, and the Routh conditions of 4000 rational designs"
)


@_claim("lscf-1", "Eq. lscf, line 1", "χ_H > 1 + ζ_H tan λ_s", _NECESSARY)
def _line_1() -> Outcome:
    a, (_, _, _, chi_H, zeta_B, zeta_H, T) = lemmas.general()
    is_a0 = a[0] == (chi_H - (1 + zeta_H * T)) * zeta_B**2
    return proof(
        is_a0 and lemmas.class_identity() and lemmas.necessary(0), "It is a0 > 0; a0 and a4 cannot both be negative."
    )


@_claim("lscf-2", "Eq. lscf, line 2", "χ_H < 1 − (ζ_B/μ) tan λ_s", _NECESSARY)
def _line_2() -> Outcome:
    a, (_, mu, _, chi_H, zeta_B, _, T) = lemmas.general()
    is_a4 = a[4] == (1 - zeta_B / mu * T - chi_H) * mu
    return proof(is_a4 and lemmas.class_identity() and lemmas.necessary(1), "It is a4 > 0.")


@_claim("lscf-3", "Eq. lscf, line 3", "χ_H < χ_B", _NECESSARY)
def _line_3() -> Outcome:
    a, (Fr, _, chi_B, chi_H, zeta_B, _, _) = lemmas.general()
    is_a3 = a[3] == (chi_B - chi_H) * -zeta_B * Fr
    return proof(is_a3 and lemmas.necessary(2), "It is a3 > 0.")


@_claim("lscf-4", "Eq. lscf, line 4", "ζ_H > ζ_B", _NECESSARY)
def _line_4() -> Outcome:
    return proof(
        lemmas.hurwitz_identity() and lemmas.standstill_identity() and lemmas.necessary(3),
        "With a0, a1, a3, a4 > 0 the Hurwitz determinant over Fr² is affine in Fr² and negative at Fr = 0, where a2 is "
        "minus a positive combination of a0 and a4; it can become positive only if its slope, which has the sign of "
        "ζ_H − ζ_B, is positive.",
    )


@_claim("lscf-5", "Eq. lscf, line 5", "Fr > Fr_c > 0", _NECESSARY)
def _line_5() -> Outcome:
    return proof(
        lemmas.hurwitz_identity() and lemmas.standstill_identity() and lemmas.necessary(4),
        "Fr_c² is the zero of that affine function, so where a0, a1, a3, a4 > 0 and ζ_H > ζ_B it is positive of "
        "itself.",
    )


WITNESS: lemmas.Design = tuple(q(x) for x in ("2", "5", "1.2", "0.9", "-0.5", "-0.4", "0.5"))
"""A design that the printed conditions admit although it is unstable."""


def wrongly_admitted(design: lemmas.Design) -> bool:
    """Whether the five printed conditions hold and yet a root lies on the right."""
    return lemmas.admitted(design) and unstable(copo(*design))


def upright_case() -> bool:
    """With χ_H ≥ 1 and the first four conditions, a1 < 0 makes Fr_c² negative: a1 > 0 follows from Fr_c² > 0."""
    mu, k, d, x, y, T, w = ring("mu k d x y T w")
    chi_H, chi_B, zeta_B, zeta_H = 1 + k, 1 + k + d, -(x + y), -y
    skew = zeta_B * chi_H - zeta_H * chi_B  # a1/(Fr ζ_B); it is w > 0 where a1 < 0
    square = laws.flus(mu, chi_B, chi_H, zeta_B, zeta_H, Tilt(T))
    rest = x * (x + y) * chi_B * chi_H * T + k * chi_B * (x + y) * d
    identity = -square * (d * skew * (x + y)) == rest + k * chi_H * mu * skew
    return identity and positive((rest + k * chi_H * mu * w).over)


@_claim(
    "lscf-sufficient", "Eq. lscf", "for tan λ_s > 0 the five conditions are sufficient",
    "an identity for Fr_c² with a1 < 0, the Routh conditions of 4000 rational designs, and certified roots of the "
    "counterexample",
)  # fmt: skip
def _sufficient() -> Outcome:
    upright = all(is_stable for d, is_stable in lemmas.designs() if d[6] > 0 and d[3] >= 1 and lemmas.admitted(d))
    amended = all(
        is_stable
        for d, is_stable in lemmas.designs()
        if d[6] > 0 and lemmas.admitted(d) and d[4] * d[3] < d[5] * d[2]
    )  # fmt: skip
    wrong = sum(lemmas.admitted(d) and not is_stable for d, is_stable in lemmas.designs() if d[6] > 0 and d[3] < 1)
    all_below = sum(lemmas.admitted(d) for d, _ in lemmas.designs() if d[6] > 0 and d[3] < 1)
    a1, square = copo(*WITNESS)[1], lemmas.critical_square(WITNESS)
    return universal(
        "χ_H ≥ 1; for χ_H < 1 the condition a1 > 0, that is ζ_B χ_H < ζ_H χ_B, must be added",
        upright_case() and upright and amended and lemmas.hurwitz_identity(),
        f"χ_H = 9/10, χ_B = 6/5, ζ_B = −1/2, ζ_H = −2/5, μ = 5, tan λ_s = 1/2 has Fr_c = {square} and meets all five "
        f"at Fr = 2, where a1 = {a1} and a root lies on the right",
        square == 1 and wrongly_admitted(WITNESS),
        remark=f"Of {all_below} random rational designs with χ_H < 1 that the five admit, {wrong} are unstable.",
    )


@_claim(
    "lscf-classes", "text after Eq. flus, of GAS2018", "the self-stable designs form two classes, by the sign of λ_s",
    "the identity a4 + μ a0/ζ_B² = −tan λ_s (ζ_B + μ ζ_H), and an example of each class by its Routh conditions",
)  # fmt: skip
def _classes() -> Outcome:
    forward = copo(*(q(x) for x in ("4", "1", "2", "1", "-2", "-0.5", "1")))
    other = copo(*(q(x) for x in ("2", "1", "0.5", "1", "-0.5", "-2", "-0.25")))
    mirrored = all(
        is_stable == (not any(lemmas.first_four(d)) and lemmas.fifth(d) and d[4] * d[3] > d[5] * d[2])
        for d, is_stable in lemmas.designs()
        if d[6] < 0 and d[0] > 0
    )
    none = not any(lemmas.admitted(d) for d, _ in lemmas.designs() if d[6] < 0)
    both = stable(forward) and stable(other) and forward[0] > 0 > other[0]
    return proof(
        lemmas.class_identity() and both and mirrored and none,
        "All coefficients have the sign of λ_s, and at λ_s = 0 no bicycle is stable, as a0 and a4 differ in sign. "
        "For λ_s < 0 stability is the first four conditions reversed, a1 < 0 and Fr > Fr_c; lscf as printed is empty.",
    )


BACKWARD: lemmas.Design = tuple(q(x) for x in ("-20", "1", "-1.1", "-1", "-0.4", "-0.2", "11"))
"""A design that is stable rolling backward: both masses behind the rear contact."""


def _backward_slopes() -> bool:
    """With χ_H > 0 and λ_s > 0, a1 and a3 of a backward bicycle cannot both be positive if ζ_H > ζ_B.

    a1 = −F (ζ_B χ_H − ζ_H χ_B) ζ_B and a3 = F (χ_B − χ_H) ζ_B, F = −Fr > 0. With ζ_B = −(x + y), ζ_H = −y and
    χ_H = χ_B + d, d > 0 for a3 > 0, a1 is minus a polynomial with positive coefficients in χ_H. For λ_s < 0 every
    sign is reversed.
    """
    F, mu, chi_H, d, x, y, T = polynomials("F mu chi_H d x y T")
    a = copo(-F, mu, chi_H - d, chi_H, -(x + y), -y, T)
    mirrored = copo(-F, mu, chi_H + d, chi_H, -y, -(x + y), -T)
    return positive(a[3]) and positive(-a[1]) and positive(-mirrored[3]) and positive(mirrored[1])


@_claim(
    "lscf-backward", "text after Eq. flus, of GAS2018", "backward stability is excluded",
    "signs of a1 and a3 at Fr < 0 for ζ_H > ζ_B, which the Hurwitz determinant demands, the Routh conditions of the "
    "rational designs with Fr < 0, and of the counterexample",
)  # fmt: skip
def _backward() -> Outcome:
    sample = not any(is_stable for d, is_stable in lemmas.designs() if d[0] < 0 and d[3] >= 0)
    return universal(
        "χ_H ≥ 0, the front assembly's mass not behind the rear contact",
        _backward_slopes() and lemmas.hurwitz_identity() and lemmas.standstill_identity() and sample,
        "χ_B = −11/10, χ_H = −1, ζ_B = −2/5, ζ_H = −1/5, μ = 1, tan λ_s = 11 is stable at Fr = −20, by its Routh "
        f"conditions: a0 = {copo(*BACKWARD)[0]}, a1 = {copo(*BACKWARD)[1]}, a3 = {copo(*BACKWARD)[3]}, "
        f"a4 = {copo(*BACKWARD)[4]}",
        stable(copo(*BACKWARD)),
        remark="Such a machine leans on no rear contact, so it is of no practical use; the exclusion needs a "
        "word on χ.",
    )


@_claim(
    "flus", "Eq. flus", "the critical Froude number",
    "p(iω) = 0 with ω² eliminated: the Hurwitz determinant as an identity of rational functions",
)  # fmt: skip
def _flus() -> Outcome:
    (a0, a1, a2, a3, a4), (Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T) = lemmas.general()
    W = a3 / a1  # ω² from the imaginary part
    real = a0 * W**2 - a2 * W + a4
    lead = -(zeta_B - zeta_H) * zeta_B * W  # of Fr² in the real part
    square = laws.flus(mu, chi_B, chi_H, zeta_B, zeta_H, Tilt(T))
    return proof(
        real == lead * (Fr**2 - square),
        "For every χ_H and either sign of λ_s it is the speed at which the Hurwitz determinant vanishes. It bounds "
        "stability only where a0, a1, a3, a4 share a sign; in the counterexample of lscf-sufficient it is positive and "
        "no boundary.",
        "The eliminated condition p(iω) = 0 has another root.",
    )


def _sides(Fr: str) -> bool:
    return stable(copo(q(Fr), *WITNESS[1:]))


@_claim(
    "Fr_c-sides", "text after Eq. flus", "unstable at 0 ≤ Fr < Fr_c, asymptotically stable at Fr > Fr_c",
    "sign of the Hurwitz determinant on either side, exactly; Fr = 0 by the evenness of p; the counterexample by Routh",
)  # fmt: skip
def _sides_of_critical() -> Outcome:
    _, mu, chi_B, chi_H, zeta_B, zeta_H, T = ring(_NAMES)
    still = copo(0 * T, mu, chi_B, chi_H, zeta_B, zeta_H, T)
    even = still[1] == 0 and still[3] == 0
    regular = all(
        is_stable == (d[0] ** 2 > lemmas.critical_square(d))
        for d, is_stable in lemmas.designs()
        if d[0] > 0 and d[6] > 0 and all(lemmas.first_four(d)) and d[4] * d[3] < d[5] * d[2]
    )
    return universal(
        "a0, a1, a3, a4 have one sign, which lscf gives for χ_H ≥ 1",
        even and regular and lemmas.hurwitz_identity() and lemmas.standstill_identity(),
        "the design of lscf-sufficient, Fr_c = 1, is unstable at Fr = 2 and at Fr = 10",
        not _sides("2") and not _sides("10") and lemmas.critical_square(WITNESS) == 1,
    )


@_claim(
    "Fr_c-weaving", "text after Eq. flus", "Fr_c lies on the boundary of stability and dynamic instability (weaving)",
    "division of p by s² + a3/a1, the remainder proportional to the Hurwitz determinant",
)  # fmt: skip
def _weaving() -> Outcome:
    a0, a1, a2, a3, a4 = ring("a0 a1 a2 a3 a4")
    W = a3 / a1
    rest = [a0, a1, a4 / W]
    product = [rest[0], rest[1], rest[2] + W * rest[0], W * rest[1], W * rest[2]]
    difference = [x - y for x, y in zip((a0, a1, a2, a3, a4), product, strict=True)]
    only_a2 = all(difference[k] == 0 for k in (0, 1, 3, 4))
    hurwitz = a1 * a2 * a3 - a0 * a3**2 - a4 * a1**2
    return proof(
        only_a2 and difference[2] == hurwitz / (a1 * a3),
        "At Fr_c, p = (s² + a3/a1)(a0 s² + a1 s + a1 a4/a3): one imaginary pair, and two roots on the left where "
        "a0, a1, a3, a4 share a sign.",
    )


@cache
def benchmark() -> dict[str, Any]:
    """Fr, ω² and the other factor of the benchmark at its weave boundary, by matching coefficients in balls."""
    Fr, W, b, c, T = polynomials("Fr W b c T")
    a = copo(Fr, q("1/10"), q("1.2"), q("1.02"), q("-0.4"), q("-0.2"), T)
    tilt = {"T": (flint.arb.pi() / 36).tan()}
    return matched(a, [[1, 0, W], [1, b, c]], {"Fr": 0.9, "W": 1.07, "b": 2.0, "c": 5.0}, tilt)


_MATCHED = "p(s) = a0 (s² + ω²)(s² + b s + c) solved for Fr, ω², b, c by interval Newton, 80 digits"


@_claim(
    "bench", "Eq. bench", "the benchmark is a self-stable design", "the conditions and Routh in balls at Fr_c ± 1e-9"
)
def _bench() -> Outcome:
    T, Fr = (flint.arb.pi() / 36).tan(), benchmark()["Fr"]
    geometry = q("0.1"), q("1.2"), q("1.02"), q("-0.4"), q("-0.2")
    above, below = (copo(Fr + flint.arb(step), *geometry, T) for step in ("1e-9", "-1e-9"))
    return proof(stable(above) and not stable(below) and all(lemmas.first_four((Fr, *geometry, T))))


@_claim("fr1-Fr_c", "Eq. fr1", "Fr_c of the benchmark", _MATCHED)
def _fr1() -> Outcome:
    return decimal("0.9070641497", benchmark()["Fr"])


@_claim("fr1-v_c", "Eq. fr1", "v_c of the benchmark in m/s", f"{_MATCHED}; v = Fr √(g w)")
def _v_c() -> Outcome:
    speed = benchmark()["Fr"] * flint.arb(q("9.81")).sqrt()
    standard = decimal("2.841008324", benchmark()["Fr"] * flint.arb(q("9.80665")).sqrt())
    g = (flint.arb("2.841008324") / benchmark()["Fr"]) ** 2
    words = (
        f"g is not printed: the number implies {g.str(10, radius=False)}, so 9.81 m/s² was taken. "
        f"With 9.80665 the same rule says '{standard.verdict}'. That it reproduces the number of TMS2011 cannot be "
        "computed from the paper."
    )
    outcome = decimal("2.841008324", speed, words)
    return outcome if outcome.verdict != EXACT else Outcome(EXACT, outcome.printed, outcome.computed, words)


CLAIMS: Sequence[Claim] = (
    _line_1, _line_2, _line_3, _line_4, _line_5, _sufficient, _flus, _sides_of_critical, _weaving, _classes, _backward,
    _bench, _fr1, _v_c,
)  # fmt: skip
