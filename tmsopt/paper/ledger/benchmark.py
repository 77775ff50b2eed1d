"""Section 2.3: the benchmark optimised for the abscissa −1, its EP4, and the growth rates of Fig. fig0."""

from collections.abc import Mapping
from functools import cache
from typing import Any

import flint

from tmsopt.models import copo, matrices
from tmsopt.paper.ledger import printed
from tmsopt.paper.ledger.abscissa import product_bound
from tmsopt.paper.ledger.algebra import Polynomial, evaluate, kernel, matched, polynomials, q, stable, stable_left_of
from tmsopt.paper.ledger.entry import Claim, Outcome, decimal, digits, proof, section, universal
from tmsopt.paper.ledger.lemmas import general
from tmsopt.roots.polynomial import evaluate as value_at, quadratic_pencil, shift

_claim = section("2.3 Minimizing the spectral abscissa of general TMS bikes")

_GEOMETRY = q("1.02"), q("-0.4"), q("-0.2")
"""χ_H, ζ_B and ζ_H of the benchmark."""


@_claim("chib-benchmark", "text before Eq. e1", "χ_B = 1.19", "a3 = ω0² a1 with ω0 = −1 solved in fractions")
def _chib_benchmark() -> Outcome:
    # χ_B − χ_H = −(ζ_B χ_H − ζ_H χ_B), linear in χ_B
    chi_H, zeta_B, zeta_H = _GEOMETRY
    return decimal("1.19", chi_H * (1 - zeta_B) / (1 - zeta_H))


def _special() -> list[Polynomial]:
    """p of the geometry of e1 to e3 in Fr, μ and T."""
    Fr, mu, T = polynomials("Fr mu T")
    return copo(Fr, mu, q("1.19"), *_GEOMETRY, T)


def _equation(terms: Mapping[str, str]) -> Polynomial:
    Fr, mu, T = polynomials("Fr mu T")
    known = {"1": Fr * 0 + 1, "Fr": Fr, "Fr^2": Fr**2, "mu": mu, "T": T}
    total = Fr * 0
    for name, coefficient in terms.items():
        total = total + known[name] * q(coefficient)
    return total


def _printed_equation(terms: Mapping[str, str], true: Polynomial) -> Outcome:
    claimed = _equation(terms)
    text = str(true)
    return proof(claimed == true, "", "Its coefficients are others.", str(claimed), text)


@_claim(
    "e1", "Eq. e1", "a2 = 6 ω0² a0 for the benchmark geometry",
    "the polynomial in fractions, coefficient by coefficient",
)  # fmt: skip
def _e1() -> Outcome:
    a = _special()
    return _printed_equation(printed.E1, a[2] - 6 * a[0])


@_claim(
    "e2", "Eq. e2", "ω0 = −1 from (w0) for the benchmark geometry", "a4 = a0 in fractions, coefficient by coefficient"
)
def _e2() -> Outcome:
    a = _special()
    return _printed_equation(printed.E2, a[4] - a[0])


@_claim("e3", "Eq. e3", "p(−1) = 0 for the benchmark geometry", "p(−1) in fractions, coefficient by coefficient")
def _e3() -> Outcome:
    return _printed_equation(printed.E3, value_at(_special(), q(-1)))


@_claim(
    "e123-unique", "text after Eq. e3", "(e1)–(e3) have a unique solution with μ > 0",
    "resultants: Fr and T eliminated, signs of the coefficients of the quadratic in μ",
)  # fmt: skip
def _unique() -> Outcome:
    e1, e2, e3 = (_equation(terms) for terms in (printed.E1, printed.E2, printed.E3))
    in_T = e1.resultant(e2, "T"), (e1 - e3).resultant(e2, "T")
    only_mu = in_T[0].resultant(in_T[1], "Fr")
    c = [evaluate(only_mu.derivative("mu").derivative("mu"), {"mu": 0}) / 2, evaluate(only_mu, {"mu": flint.arb(0)})]
    linear = in_T[1].degrees()[0] == 1 and e2.degrees()[2] == 1
    return proof(
        only_mu.degrees()[1] == 2 and bool(c[0] * c[1] < 0) and linear,
        "There are two real solutions, as the quadratic in μ has coefficients of different sign at its ends; the other "
        "has μ < 0. Both are EP4s of the polynomial.",
    )


def _family() -> list[Polynomial]:
    """p of the benchmark's χ_H, ζ_B and ζ_H in Fr, μ, χ_B and T."""
    Fr, mu, chi_B, T = polynomials("Fr mu chi_B T")
    return copo(Fr, mu, chi_B, *_GEOMETRY, T)


@cache
def optimised() -> dict[str, Any]:
    """Fr, μ, χ_B and T with the 4-fold root −1."""
    return matched(_family(), [[1, 1]] * 4, {"Fr": 2.3, "mu": 20.0, "chi_B": 1.2, "T": 1.1}, {})


_MATCHED = "p(s) = a0 (s + 1)⁴ solved for Fr, μ, χ_B, tan λ_s by interval Newton, 80 digits"


@_claim("e123-Fr", "text after Eq. e3; caption of Fig. fig0", "Fr_EP of the optimised benchmark", _MATCHED)
def _optimised_Fr() -> Outcome:
    return decimal("2.337214017", optimised()["Fr"])


@_claim("e123-mu", "text after Eq. e3; caption of Fig. fig0", "μ of the optimised benchmark", _MATCHED)
def _optimised_mu() -> Outcome:
    return decimal("20.84626701", optimised()["mu"])


@_claim("e123-lambda_s", "text after Eq. e3; caption of Fig. fig0", "λ_s of the optimised benchmark", _MATCHED)
def _optimised_tilt() -> Outcome:
    return decimal("0.8514403685", optimised()["T"].atan())


@_claim(
    "fig0-abscissa", "caption of Fig. fig0", "the optimised bicycle attains the least abscissa a_min = −1 at Fr_EP",
    "the 4-fold root −1 proved by interval Newton; the product bound, which does not depend on Fr",
)  # fmt: skip
def _fig0() -> Outcome:
    a, (_, mu, _, chi_H, zeta_B, zeta_H, T) = general()
    bound = a[4] / a[0]
    free = printed.w0(mu, chi_H, zeta_B, zeta_H, T) == bound
    design = optimised()
    b = copo(design["Fr"], design["mu"], design["chi_B"], *_GEOMETRY, design["T"])
    return proof(
        free and product_bound() and (b[4] / b[0]).contains(1),
        "Least over all Fr, and over all χ_B as well, since a4/a0 depends on neither.", printed="-1",
        computed=digits(flint.arb(-1)),
    )  # fmt: skip


@_claim(
    "e123-minimum", "text after Eq. e3", "the optimised bicycle attains the minimum of the spectral abscissa",
    "product bound with ω0 held; shifted Hurwitz conditions of a bicycle with the same χ_H, ζ_B, ζ_H and another "
    "λ_s, μ",
)  # fmt: skip
def _whole_minimum() -> Outcome:
    better = tuple(q(x) for x in ("2.243", "5.82", "1.3366", "1.02", "-0.4", "-0.2", "0.5573"))
    slopes = _covector()
    return universal(
        "ω0 = −1 is held, which leaves Fr and χ_B free; λ_s and μ change ω0",
        product_bound(),
        f"Fr = {better[0]}, μ = {better[1]}, χ_B = {better[2]}, tan λ_s = {better[6]} with the same χ_H, ζ_B, ζ_H has "
        "every root left of −6/5, by the Hurwitz conditions of p(t − 6/5)",
        stable_left_of(copo(*better), q("-1.2")),
        remark="With μ held and Fr, χ_B, λ_s free the EP4 "
        + (
            "still meets the first-order condition of a local minimum."
            if bool(slopes[0] * slopes[1] > 0)
            else "is no local minimum either."
        ),
    )


def _covector() -> list[Any]:
    """The relation that the first changes of c1 … c4 in p(t − 1)/a0 obey as Fr, χ_B and T vary, μ held.

    With equal signs of the first two, c1 and c2 cannot both grow, and the abscissa cannot fall.
    """
    a, design = _family(), optimised()
    rows = []
    for name in ("Fr", "chi_B", "T"):
        slopes = [evaluate(c.derivative(name), design) for c in a]
        monic = [s - slopes[0] * m for s, m in zip(slopes, (1, 4, 6, 4, 1), strict=True)]
        rows.append(shift(monic, flint.arb(-1))[1:])
    return kernel(rows)


@_claim(
    "EP4-swallowtail", "text, of KO2013",
    "the EP4 is a swallowtail singularity inside the domain of asymptotic stability",
    "versality: the changes of p with Fr, μ, χ_B, tan λ_s and the root span all changes of a quartic, in balls; Routh",
)  # fmt: skip
def _swallowtail() -> Outcome:
    design = optimised()
    relation = _covector()
    a = copo(design["Fr"], design["mu"], design["chi_B"], *_GEOMETRY, design["T"])
    transversal = not relation[0].contains(0)
    return proof(
        transversal and stable(a),
        "The changes of Fr, χ_B, tan λ_s, and a shift of the root, which changes c1 alone, are independent; so the "
        "family is a versal unfolding of t⁴ and its discriminant set is a swallowtail.",
    )


@_claim(
    "e123-Jordan", "text after Eq. e3", "all four eigenvalues merge into s = −1 with the Jordan block",
    "determinant and rank of M s² + V s + P at s = −1 in balls, from the solved design",
)  # fmt: skip
def _block() -> Outcome:
    design = optimised()
    cosine = 1 / (1 + design["T"] ** 2).sqrt()
    chi_H, zeta_B, zeta_H = (flint.arb(x) for x in _GEOMETRY)
    speed = design["Fr"], design["mu"], design["chi_B"]
    M, V, P = matrices(*speed, chi_H, zeta_B, zeta_H, design["T"] * cosine, cosine)
    entries = [M[i][j] - V[i][j] + P[i][j] for i in range(2) for j in range(2)]
    p = shift(quadratic_pencil(M, V, P), flint.arb(-1))
    zero = all(c.contains(0) and abs(c) < flint.arb(10) ** -30 for c in p[1:])
    return proof(zero and any(not e.contains(0) for e in entries), "The rank at s = −1 is 1, so one block of order 4.")


@_claim(
    "fig0-benchmark", "caption of Fig. fig0; text", "the benchmark is generic: its growth rates meet no EP4",
    "the EP4 condition (a3/a1)² = a4/a0 of the benchmark, in balls",
)  # fmt: skip
def _generic() -> Outcome:
    T = (flint.arb.pi() / 36).tan()
    a = copo(flint.arb(1), q("0.1"), q("1.2"), q("1.02"), q("-0.4"), q("-0.2"), T)
    gap = a[4] / a[0] - (a[3] / a[1]) ** 2
    return proof(
        not gap.contains(0),
        f"(a3/a1)² is {((a[3] / a[1]) ** 2).str(6, radius=False)} and a4/a0 is {(a[4] / a[0]).str(6, radius=False)} at "
        "every Fr, so it has no EP4, 2EP2 or CEP2; a simple double root may still occur at some Fr.",
    )


@_claim(
    "4poly-form", "Eq. 4poly", "the polynomial (chapo) takes the form (s − ω0)⁴",
    "leading coefficient at the EP4 of the optimised benchmark, in balls",
)  # fmt: skip
def _form() -> Outcome:
    design = optimised()
    a = copo(design["Fr"], design["mu"], design["chi_B"], *_GEOMETRY, design["T"])
    monic = all(abs(c / a[0] - m) < flint.arb(10) ** -40 for c, m in zip(a, (1, 4, 6, 4, 1), strict=True))
    return universal(
        "for p(s)/a0, as (chapo) with (copo) is not monic", monic,
        f"a0 = {a[0].str(10, radius=False)} at the EP4 of the optimised benchmark", bool(a[0] < 1),
    )  # fmt: skip


CLAIMS: tuple[Claim, ...] = (
    _form, _generic, _chib_benchmark, _e1, _e2, _e3, _unique, _optimised_Fr, _optimised_mu, _optimised_tilt, _block,
    _fig0, _whole_minimum, _swallowtail,
)  # fmt: skip
