"""Decides facts about a proved design: eigenvectors, stability, heavy damping, the box and the limits."""

from dataclasses import dataclass
from typing import Any

import flint

from tmsopt.algebra.balls import rational
from tmsopt.algebra.kinds import BALLS
from tmsopt.models import Values
from tmsopt.models.exact import ExactDesign
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, RADIUS
from tmsopt.problem.real_form import real_form
from tmsopt.proofs.existence import EXACT, ProvedDesign
from tmsopt.proofs.factorisation import Factorisation
from tmsopt.roots import exact_nullity, has_one_eigenvector
from tmsopt.roots.patterns.root_enclosures import factor_roots


@dataclass(frozen=True)
class Verdict:
    """Whether something certainly holds.

    Attributes:
        holds: True or False if it is certain; None if it is undecided or was not checked.
        words: the fact, or the reason why the fact is undecided.
    """

    holds: bool | None = None
    words: str = "not checked"


NOT_CHECKED = Verdict()

# In this order: one root, several roots, the unstable side, the stable side, the stable side in short.
_ROOT_WORDS = "a root", "roots", "right of the imaginary axis", "left of the imaginary axis", "left of the axis"
_EIGENFREQUENCY_WORDS = (
    "an eigenfrequency",
    "eigenfrequencies",
    "above the real axis",
    "below the real axis",
    "below the axis",
)

BINDING_TOLERANCE = 1e-9
"""A comparison binds if its sides differ by at most this; a solver leaves differences of this size."""


def eigenvector_verdict(problem: Posed, design: ExactDesign, proved_design: ProvedDesign) -> tuple[int | None, Verdict]:
    """The largest geometric multiplicity of a multiple root, and whether all multiple roots are defective.

    For an exact design they are computed in fractions; otherwise from minors in ball arithmetic, which can only prove
    that each root has one eigenvector.
    """
    repeated_factors = [factor for factor, count in proved_design.factorisation.factors if count > 1]
    pencil, parameter_set = problem.model.pencil, problem.parameter_set
    if pencil is None:
        return None, Verdict(None, "a model given by its coefficients has no eigenvectors")
    if not repeated_factors:
        return None, NOT_CHECKED
    if proved_design.chain_roots:
        return 1, Verdict(True, "one eigenvector, because the bordered matrix is regular (interval arithmetic)")
    form = real_form(problem)
    matrices = design.matrices(form.problem.model, parameter_set) if proved_design.method == EXACT else None
    if matrices:
        parts = flint.fmpq_poly(list(proved_design.coefficients)[::-1]).factor()[1]
        nullities = [(exact_nullity(matrices, part), int(count)) for part, count in parts if count > 1]
        largest_nullity = max(nullity for nullity, _ in nullities)
        is_defective = all(nullity < count for nullity, count in nullities)
        return largest_nullity, Verdict(
            is_defective, f"{largest_nullity} eigenvector{'s' * (largest_nullity > 1)}, in fractions"
        )
    matrices_at = pencil(parameter_set.native(proved_design.parameters))
    all_roots = form.user_roots(z for f in repeated_factors for z in factor_roots(f) or ())
    roots = [flint.acb(z.re, z.im) for z in all_roots]
    has_one = bool(roots) and all(has_one_eigenvector(matrices_at, s) for s in roots)
    words = (
        "one eigenvector, because a minor of the matrix is not 0 (interval arithmetic)"
        if has_one
        else "every minor may be 0"
    )
    return (1 if has_one else None), Verdict(True if has_one else None, words)


def stability_verdict(factorisation: Factorisation, of_H: bool = False) -> Verdict:
    """Whether all roots lie left of the imaginary axis, by Liénard–Chipart signs in balls.

    Args:
        of_H: whether the roots s belong to a complex H; the words are then about its eigenfrequencies ω = i s.
    """
    subject, subjects, unstable_side, stable_side, inside = _EIGENFREQUENCY_WORDS if of_H else _ROOT_WORDS
    if factorisation.stable:
        return Verdict(
            True, f"all {subjects} are {stable_side} (signs of Routh–Hurwitz expressions, by interval arithmetic)"
        )
    if factorisation.stable is None:
        text = "a Routh–Hurwitz expression is 0 within its error; a larger --digits decides, unless it is exactly 0"
        return Verdict(None, text)
    roots = factorisation.roots or ()
    axis_roots = [z for z in roots if z.re == 0]
    if not axis_roots or any(z.re > 0 for z in roots):
        return Verdict(False, f"{subject} is {unstable_side if any(z.re > 0 for z in roots) else f'not {stable_side}'}")
    sentence = (
        f"{subject} is real" if of_H else "a root is 0" if all(z.is_real for z in axis_roots) else "a pair is imaginary"
    )
    is_simple = all(z.multiplicity == 1 for z in roots if z.re <= 0)
    return Verdict(False, sentence + f", the others {inside}: on the boundary of stability" * is_simple)


def heavy_damping_verdict(factorisation: Factorisation) -> Verdict:
    """Whether all roots are real and negative, and whether they are also different."""
    if factorisation.heavily_damped is None:
        return Verdict(None, "some roots may be real or complex; a larger --digits decides, unless they coincide")
    if not factorisation.heavily_damped:
        return Verdict(False, "a root is complex" if factorisation.stable else "a root is not negative")
    if any(multiplicity > 1 for _, multiplicity in factorisation.factors) or factorisation.roots is None:
        return Verdict(True, "all roots are real and negative, some of them equal: on the edge of heavy damping")
    return Verdict(True, "all roots are real, negative and different: strictly inside heavy damping")


def box_verdict(problem: Posed, design: ExactDesign, proved_design: ProvedDesign) -> Verdict:
    """Whether every free parameter certainly lies within its limits."""
    if not problem.free:
        return Verdict(True, "nothing is free")
    undecided_names = []
    for name, (least, greatest) in problem.free.items():
        value: Any = flint.arb(proved_design.parameters[name])
        if (
            name not in (*proved_design.moved, *design.tangents)
            and (exact_value := design.values[name].fraction) is not None
        ):
            value = rational(exact_value)
        if {name, f"tan({name})"} & set(design.given_exactly) and float(value) in (least, greatest):
            continue  # the user states the limit exactly
        lo, hi = (problem.exactly({name: end})[name] for end in (least, greatest))
        if value < lo or value > hi:
            return Verdict(False, f"{name} is outside its limits")
        if not (value >= lo and value <= hi):
            undecided_names.append(name)
    if undecided_names:
        return Verdict(None, f"{', '.join(undecided_names)} may lie on either side of a limit")
    return Verdict(True, "every free parameter is within its limits")


def limit_verdicts(problem: Posed, proved_design: ProvedDesign) -> dict[str, str]:
    """The verdict on each comparison at the nominal design; empty if the problem has several cases."""
    if problem.scenarios or problem.tolerances:
        return {}
    roots = proved_design.factorisation
    root_values = {
        "abscissa": roots.abscissa,
        "damping_ratio": roots.damping_ratio,
        ANGULAR_FREQUENCY: roots.angular_frequency,
        RADIUS: None,
    }
    values = Values(problem.model, problem.parameter_set, proved_design.parameters)
    values = values.with_known({n: flint.arb("nan") if value is None else value for n, value in root_values.items()})
    verdicts = {}
    for name, condition in problem.conditions.items():
        difference = flint.arb(condition.of(values, BALLS))
        if condition.equality:
            verdicts[name] = _equality_verdict(difference, is_solved=proved_design.method == "Krawczyk")
        else:
            verdicts[name] = _inequality_verdict(difference if condition.sign < 0 else -difference)
    return verdicts


def _equality_verdict(difference: Any, is_solved: bool) -> str:
    """The verdict on an equality; `is_solved` tells whether it is one of the equations that the proof has solved."""
    if difference == 0 or (is_solved and difference.contains(0)):
        return "met"
    verdict = "not decided" if not difference.is_finite() else f"met but for {abs(float(difference.mid())):.1e}"
    return verdict if abs(difference) <= BINDING_TOLERANCE or not difference.is_finite() else "violated"


def _inequality_verdict(margin: Any) -> str:
    if abs(margin) <= BINDING_TOLERANCE:
        return "binds"
    return "met" if margin > 0 else "violated" if margin < 0 else "not decided"
