"""Facts about a design with roots in balls: eigenvectors, stability, heavy damping, box and limits."""

from dataclasses import dataclass
from typing import Any

import flint

from tmsopt.algebra.balls import rational
from tmsopt.algebra.kinds import BALLS
from tmsopt.models import Values
from tmsopt.models.exact import ExactDesign
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, RADIUS
from tmsopt.proofs.existence import EXACT, ProvedDesign
from tmsopt.proofs.factorisation import Factorisation
from tmsopt.roots import exact_nullity, has_one_eigenvector
from tmsopt.roots.patterns.root_enclosures import factor_roots


@dataclass(frozen=True)
class Verdict:
    """Whether something certainly holds.

    Attributes:
        holds: None if undecided or not checked.
        words: the fact, or the reason.
    """

    holds: bool | None = None
    words: str = "not checked"


NOT_CHECKED = Verdict()

BINDS = 1e-9
"""Difference between the sides of a comparison up to which it binds: the remainder that a solver leaves."""


def eigenvector_verdict(problem: Posed, design: ExactDesign, found: ProvedDesign) -> tuple[int | None, Verdict]:
    """The largest geometric multiplicity of a multiple root, and whether all multiple roots are defective.

    Computed in fractions for an exact design; otherwise by minors in balls, which can only prove one eigenvector.
    """
    repeated = [factor for factor, count in found.factorisation.factors if count > 1]
    pencil, of = problem.model.pencil, problem.parameter_set
    if pencil is None:
        return None, Verdict(None, "a model given by its coefficients has no eigenvectors")
    if not repeated:
        return None, NOT_CHECKED
    matrices = design.matrices(problem.model, of) if found.method == EXACT else None
    if matrices:
        parts = flint.fmpq_poly(list(found.coefficients)[::-1]).factor()[1]
        nullities = [(exact_nullity(matrices, part), int(count)) for part, count in parts if count > 1]
        most = max(nullity for nullity, _ in nullities)
        defective = all(nullity < count for nullity, count in nullities)
        return most, Verdict(defective, f"{most} eigenvector{'s' * (most > 1)}, in fractions")
    at = pencil(of.native(found.parameters))
    roots = [flint.acb(z.re, z.im) for f in repeated for z in factor_roots(f) or ()]
    one = bool(roots) and all(has_one_eigenvector(at, s) for s in roots)
    words = (
        "one eigenvector, because a minor of the matrix is not 0 (interval arithmetic)"
        if one
        else "every minor may be 0"
    )
    return (1 if one else None), Verdict(True if one else None, words)


def stability_verdict(factorisation: Factorisation, of_H: bool = False) -> Verdict:
    """Whether all roots lie left of the imaginary axis, by Liénard–Chipart signs in balls.

    Args:
        of_H: word the verdict for eigenfrequencies ω = i s.
    """
    one, right, left, below = "a root", "right of the imaginary axis", "left of the imaginary axis", "left of the axis"
    if of_H:
        one, right, left, below = "an eigenfrequency", "above the real axis", "below the real axis", "below the axis"
    if factorisation.stable:
        every = "all eigenfrequencies" if of_H else "all roots"
        return Verdict(True, f"{every} are {left} (signs of Routh–Hurwitz expressions, by interval arithmetic)")
    if factorisation.stable is None:
        return Verdict(
            None, "a Routh–Hurwitz expression is 0 up to its error: more --digits decide unless it is exactly 0"
        )
    roots = factorisation.roots or ()
    axis = [z for z in roots if z.re == 0]
    if not axis or any(z.re > 0 for z in roots):
        return Verdict(False, f"{one} is {right if any(z.re > 0 for z in roots) else f'not {left}'}")
    at = f"{one} is real" if of_H else "a root is 0" if all(z.real for z in axis) else "a pair is imaginary"
    simple = all(z.multiplicity == 1 for z in roots if z.re <= 0)
    return Verdict(False, at + f", the others {below}: on the boundary of stability" * simple)


def heavy_damping_verdict(factorisation: Factorisation) -> Verdict:
    """Whether all roots are real and negative, and whether strictly."""
    if factorisation.heavily_damped is None:
        return Verdict(None, "some roots may be real or complex: more --digits decide unless they coincide")
    if not factorisation.heavily_damped:
        return Verdict(False, "a root is complex" if factorisation.stable else "a root is not negative")
    if any(multiplicity > 1 for _, multiplicity in factorisation.factors) or factorisation.roots is None:
        return Verdict(True, "all roots are real and negative, some of them equal: on the edge of heavy damping")
    return Verdict(True, "all roots are real, negative and different: strictly inside heavy damping")


def box_verdict(problem: Posed, design: ExactDesign, found: ProvedDesign) -> Verdict:
    """Whether every free parameter certainly lies within its limits."""
    if not problem.free:
        return Verdict(True, "nothing is free")
    undecided = []
    for name, (least, greatest) in problem.free.items():
        value: Any = flint.arb(found.parameters[name])
        if name not in (*found.moved, *design.tangents) and (known := design.values[name].fraction) is not None:
            value = rational(known)
        if {name, f"tan({name})"} & set(design.stated) and float(value) in (least, greatest):
            continue  # the user states the limit exactly
        lo, hi = (problem.exactly({name: end})[name] for end in (least, greatest))
        if value < lo or value > hi:
            return Verdict(False, f"{name} is outside its limits")
        if not (value >= lo and value <= hi):
            undecided.append(name)
    if undecided:
        return Verdict(None, f"{', '.join(undecided)} may lie on either side of a limit")
    return Verdict(True, "every free parameter is within its limits")


def limit_verdicts(problem: Posed, found: ProvedDesign) -> dict[str, str]:
    """The verdict on each comparison at the nominal design; none if it must hold in several cases."""
    if problem.scenarios or problem.tolerances:
        return {}
    roots = found.factorisation
    known = {
        "abscissa": roots.abscissa,
        "damping_ratio": roots.damping_ratio,
        ANGULAR_FREQUENCY: roots.angular_frequency,
        RADIUS: None,
    }
    values = Values(problem.model, problem.parameter_set, found.parameters)
    values = values.with_known({n: flint.arb("nan") if value is None else value for n, value in known.items()})
    verdicts = {}
    for name, condition in problem.conditions.items():
        difference = flint.arb(condition.of(values, BALLS))
        if condition.equality:
            verdicts[name] = _equality_verdict(difference, equations=found.method == "Krawczyk")
        else:
            verdicts[name] = _inequality_verdict(difference if condition.sign < 0 else -difference)
    return verdicts


def _equality_verdict(difference: Any, equations: bool) -> str:
    if difference == 0 or (equations and difference.contains(0)):
        return "met"
    off = "not decided" if not difference.is_finite() else f"met but for {abs(float(difference.mid())):.1e}"
    return off if abs(difference) <= BINDS or not difference.is_finite() else "violated"


def _inequality_verdict(room: Any) -> str:
    if abs(room) <= BINDS:
        return "binds"
    return "met" if room > 0 else "violated" if room < 0 else "not decided"
