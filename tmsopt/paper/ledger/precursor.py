"""Section 2.4.5: CEP2 as a precursor to weaving, steep tilts, and the designs of Fig. fig3."""

from collections.abc import Sequence

import flint

from tmsopt.arithmetic.identity import Quotient
from tmsopt.models.exact import Tilt
from tmsopt.paper.ledger import lemmas, printed
from tmsopt.paper.ledger.algebra import ball_roots, depends, heavily_damped, q, real_roots, ring, stable
from tmsopt.paper.ledger.entry import Claim, Outcome, proof, section, universal
from tmsopt.paper.ledger.printed import laws
from tmsopt.roots.exact import isolated_roots

_claim = section("2.4.5 Mechanism of self-stability and CEP2 as a precursor to weaving")


@_claim(
    "motion-limit", "text", "the complex EP set tends to the boundary of asymptotic stability as λ_s → π/2",
    "Fr_EP² − Fr_c² and the real part of the double pair as rational functions of tan λ_s: degrees and limits",
)  # fmt: skip
def _limit() -> Outcome:
    T, r, scale = ring("T r q")
    omega0, zeta_B = -1 / scale, -(scale**2) * r
    square = printed.epset(omega0, zeta_B, T)
    critical = T * (r + 1) / (r - 1)
    gap = square - critical
    limit = r / (4 * scale**2)
    to_limit = gap - limit
    pair = square * (r - 1) ** 2 / (scale**2 * T**2)  # B1²

    def fades(value: Quotient) -> bool:
        """Whether a rational function of T tends to 0 as T grows."""
        return bool(value.over.degrees()[0] < value.under.degrees()[0])

    return proof(
        fades(to_limit) and fades(pair),
        "Fr_EP² − Fr_c² → r/(4 h) while Fr_c → ∞, so Fr_EP − Fr_c → 0 like 1/√tan λ_s, and the real part likewise.",
    )


@_claim(
    "motion-frequency", "text; Fig. fig3, lower row",
    "χ_B above or below √(ζ_B/ζ_H) affects the mode of higher or lower frequency",
    "ω² = a3/a1 of the critical pair against ω0², as rational functions; the solved weave boundaries of Fig. fig3",
)  # fmt: skip
def _frequency() -> Outcome:
    b, (_, chi_B, _, r, _) = lemmas.monic()
    law = b[3] / b[1] - 1 == (r + 1) * (chi_B - r) / (r**2 - chi_B)
    square = lemmas.ep4()["s"] ** 2
    solved = bool(lemmas.weave("0.80", "0.1")["W"] > square > lemmas.weave("0.80", "-0.1")["W"])
    return proof(law and solved, "The pair that loses stability is faster than |ω0| exactly if χ_B > √(ζ_B/ζ_H).")


@_claim(
    "motion-precursor", "text", "near the CEP2 even a small change of χ_B can destabilize at large λ_s",
    "Fr_c² at χ_B = r + ε less Fr_EP², as a rational function of tan λ_s: sign for large tan λ_s",
)  # fmt: skip
def _precursor() -> Outcome:
    T, r, scale, eps = ring("T r q eps")
    square = printed.epset(-1 / scale, -(scale**2) * r, T)
    critical = laws.Frc1(r + eps, -(scale**2) * r, -(scale**2) / r, Tilt(T))
    base = T * (r + 1) / (r - 1)
    excess = critical - base == base * eps**2 / ((r**2 - r - eps) * (r + eps - 1))
    remains = not depends((square - base) * lemmas.pole(T, r, scale) / T, "T")
    figure = [bool(lemmas.weave("0.80", x)["Fr"] < lemmas.double_pair("0.80")["Fr"]) for x in ("0.1", "-0.1")]
    return proof(
        excess and remains,
        "Fr_c² grows by tan λ_s times ε² while Fr_EP² − Fr_c² stays bounded, so any ε ≠ 0 does at a steep enough "
        "tilt. At the tilt of Fig. fig3 (lower row) a change of ± 0.1 "
        + ("does not yet: both bicycles are stable at Fr_EP." if all(figure) else "already does."),
    )


@_claim(
    "motion-symmetry", "text", "as λ_s → π/2 the system comes close to one with a Hamiltonian symmetry of the spectrum",
    "odd coefficients over |ω0| as rational functions of tan λ_s and Fr²/tan λ_s",
)  # fmt: skip
def _symmetry() -> Outcome:
    b, (Fr, _, T, _, _) = lemmas.monic()
    odd = not any(depends(b[k] ** 2 * T**2 / Fr**2, name) for k in (1, 3) for name in ("T", "Fr"))
    return proof(
        odd,
        "Their squares are Fr²/tan λ_s times a constant over tan λ_s: they vanish at speeds of the order of Fr_c, "
        "and p becomes even in s.",
    )


@_claim(
    "motion-near-circle", "text; Fig. fig3", "for χ_B ≠ √(ζ_B/ζ_H) the eigenvalues evolve close to the circle",
    "certified moduli of the complex roots over |ω0| at Fr = 0.2, 0.4, … up to Fr_EP, for the six bicycles of "
    "Fig. fig3",
)  # fmt: skip
def _near() -> Outcome:
    worst = [_departure(offset, shift) for offset, shift in (
        ("0", "0.01"), ("0", "-0.01"), ("-0.05", "0.01"), ("-0.05", "-0.01"), ("0.80", "0.1"), ("0.80", "-0.1"),
    )]  # fmt: skip
    return universal(
        "'close' read as within a quarter of |ω0|, up to Fr_EP", max(worst) < 0.25,
        f"at χ_B = √2 + 0.1 in the lower row a modulus departs from |ω0| by {worst[4]:.2%}", worst[4] > 0.1,
        remark=f"The largest departure of the six is {max(worst):.2%}; for ± 0.01 it is {max(worst[:4]):.2%}.",
    )  # fmt: skip


def _departure(offset: str, shift: str) -> float:
    """Largest relative distance of the complex roots from the circle."""
    design = lemmas.ep4()
    last = float((design if offset == "0" else lemmas.double_pair(offset))["Fr"].mid())
    chi_B, T = design["chi_B"] + flint.arb(q(shift)), lemmas.tilted(offset)
    found = [0.0]
    for k in range(1, int(last / 0.2) + 1):
        for z in ball_roots(lemmas.at_heights(flint.arb(q(k) / 5), chi_B, T)):
            if not z.imag.contains(0):
                found.append(abs(float((abs(z) / -design["s"] - 1).mid())))
    return max(found)


@_claim(
    "fig3-EPs", "caption of Fig. fig3",
    "at χ_B = √2 there is an EP4, a couple of real EP2, a couple of complex EP2 as Fr grows from 0 to 5",
    "the three solved bicycles, their Fr and b² − 4 c, in balls",
)  # fmt: skip
def _three() -> Outcome:
    real, pair = lemmas.double_pair("-0.05"), lemmas.double_pair("0.80")
    inside = all(0 < x["Fr"] < 5 for x in (lemmas.ep4(), real, pair))
    return proof(lemmas.are_real(real) and lemmas.are_complex(pair) and inside, "At the Froude numbers of Table 1.")


@_claim(
    "fig3-stabilized", "caption of Fig. fig3",
    "the TMS bike is stabilized as Fr grows from 0 to 5, for each of the nine designs",
    "Fr_c of the nine by interval Newton, Routh at Fr = 5",
)  # fmt: skip
def _stabilized() -> Outcome:
    designs = [
        (o, s) for o in ("0", "-0.05", "0.80") for s in (("", "0.1", "-0.1") if o == "0.80" else ("", "0.01", "-0.01"))
    ]
    speeds = [lemmas.weave(offset, shift)["Fr"] for offset, shift in designs]
    ends = [
        stable(lemmas.at_heights(q(5), lemmas.ep4()["chi_B"] + flint.arb(q(s or "0")), lemmas.tilted(o)))
        for o, s in designs
    ]
    return proof(
        all(0 < x < 5 for x in speeds) and all(ends),
        f"Fr_c lies between {min(float(x.mid()) for x in speeds):.6f} and {max(float(x.mid()) for x in speeds):.6f}.",
    )


@_claim(
    "fig3-repelling", "caption of Fig. fig3; text", "eigenvalue curves repel near EPs when χ_B ≠ √2",
    "p = a0 (s² + b s + c)² is impossible off the plane, in r and q; certified distance of the pairs at Fr_EP of the "
    "lower row; number of certified real roots as Fr grows, in the upper and the middle row",
)  # fmt: skip
def _repelling() -> Outcome:
    gaps = [_gap(shift) for shift in ("0.1", "-0.1")]
    upper = [_real_roots(chi_B, ("2.2", "2.3"), "0.435437") for chi_B in ("1.404214", "1.424214")]
    middle = [_real_roots("1.404214", ("2.2", "2.221", "2.23")), _real_roots("1.424214", ("2.23", "2.239", "2.25"))]
    return universal(
        "near a CEP2, the lower row",
        lemmas.asymmetry_identity() and all(gap > 0.01 for gap in gaps),
        "near the EP4 and the 2EP2 the curves still meet on the real axis. In the upper row, χ_B = √2 ± 0.01 and "
        "tan λ_s = 0.435437 rounded, two roots are real at Fr = 2.2 and none at 2.3; in the middle row, "
        "tan λ_s = 0.377177, two, four and two are real at Fr = 2.2, 2.221, 2.23 (minus), at 2.23, 2.239, 2.25 (plus)",
        upper == [[2, 0]] * 2 and middle == [[2, 4, 2]] * 2,
        remark=f"At Fr_EP of the lower row the two pairs are {gaps[0]:.3f} apart for χ_B = √2 + 0.1 and {gaps[1]:.3f} "
        "for √2 − 0.1. A double real root has codimension 1, and a curve of designs meets it; a double pair has 2.",
    )


def _gap(shift: str) -> float:
    """Distance of the two upper complex roots at Fr_EP of the lower row."""
    chi_B = lemmas.ep4()["chi_B"] + flint.arb(q(shift))
    found = ball_roots(lemmas.at_heights(lemmas.double_pair("0.80")["Fr"], chi_B, lemmas.tilted("0.80")))
    upper = [z for z in found if z.imag > 0]
    return float(abs(upper[0] - upper[1]).lower())


@_claim(
    "motion-monotonic", "text; Fig. fig3, middle row",
    "with heavy damping the time evolution of all perturbations is monotonic exponential decay",
    "certified roots of a heavily damped bicycle and the lean component of their modes, from the second row of "
    "the matrices",
)  # fmt: skip
def _monotonic() -> Outcome:
    # ζ_B = −2, ζ_H = −1/2, χ_B = 2, χ_H = 1, tan λ_s = 1/4, Fr = 29/20; over μ ν_H cos λ_s, with ν_H/cos λ_s = 1/8
    Fr, T = q("1.45"), q("0.25")
    p = lemmas.by_hand("1.45", "0.25")
    modes = [z.real for z, _ in isolated_roots(p)]
    leans = [s * s / 8 + Fr * s + Fr**2 - T for s in modes]
    slow, fast = modes[-1], modes[0]
    visible = all(not lean.contains(0) for lean in leans)
    return universal(
        "the motion is in a single mode",
        heavily_damped(p),
        "ζ_B = −2, ζ_H = −1/2, χ_B = 2, tan λ_s = 1/4, Fr = 29/20 is heavily damped with the eigenvalues "
        f"{', '.join(z.str(5, radius=False) for z in modes)}, and every mode leans: the sum of two of them with leans "
        "e^(s1 t) and −e^(s2 t) starts at 0, grows and only then decays",
        visible and not (slow - fast).contains(0),
        remark="A sum of four such modes can cross 0 up to three times; it does not oscillate for ever.",
    )


@_claim(
    "motion-similar", "text; Fig. fig3, middle row",
    "for smaller tilt and χ_B ≠ √(ζ_B/ζ_H) the evolution remains qualitatively the same",
    "number of certified real roots as Fr grows, tan λ_s = 0.377177 (the middle row), χ_B = √2 ± 0.01 rounded",
)  # fmt: skip
def _similar() -> Outcome:
    below = _real_roots("1.404214", ("0.01", "2", "2.221", "2.25", "2.4"))
    above = _real_roots("1.424214", ("0.01", "2", "2.239", "2.27", "2.4"))
    return universal(
        "up to the last collision, and χ_B between the two EP3 of that tilt (see spire): four real roots, two, four "
        "again (heavy damping), and at last none",
        all(counts[:3] == [4, 2, 4] and counts[-1] == 0 for counts in (below, above)),
        f"at χ_B = 1.404214 the numbers of real roots at Fr = 0.01, 2, 2.221, 2.25, 2.4 are {below}: the two double "
        "roots form one after the other, not simultaneously",
        below[3] == 2,
    )


def _real_roots(chi_B: str, speeds: Sequence[str], T: str = "0.377177") -> list[int]:
    return [real_roots(lemmas.at_heights(q(Fr), q(chi_B), q(T))) for Fr in speeds]


CLAIMS: tuple[Claim, ...] = (
    _monotonic, _similar, _limit, _frequency, _precursor, _symmetry, _near, _three, _stabilized, _repelling,
)  # fmt: skip
