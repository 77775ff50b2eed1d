"""Proves that a design with a root pattern exists near a stored one, and that the stored one is its rounding."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import flint

from tmsopt.algebra.balls import GUARD, largest_radius, upper
from tmsopt.algebra.krawczyk import Enclosure, ProofFailed, enclose_solution, refine_solution
from tmsopt.models.exact import ExactDesign
from tmsopt.problem.problem import Posed
from tmsopt.program.nlp import Scale
from tmsopt.proofs.factorisation import Factorisation, factor_pattern, factor_polynomial, has_pattern
from tmsopt.proofs.system import ROUNDINGS, Equations, MovedParameters, build_equations, choose_moved
from tmsopt.roots import Pattern
from tmsopt.roots.patterns.structure import fit_unknowns

EXACT = "exact factorisation"
"""The method for a design whose coefficients are fractions."""

_EXTRA_DIGITS = 25  # decimal digits carried beyond the requested ones
_ATTEMPTS = 3  # each carries twice the digits of the one before
_AT_BOUND = 1e-9  # of a range: a parameter closer to an end counts as there


@dataclass(frozen=True)
class ProvedDesign:
    """A proved design.

    Attributes:
        parameters: every parameter as a ball, angles in radians.
        tangents: tangents of the angles.
        unknowns: unknowns of the pattern, and lifted quantities.
        uniqueness: no other solution is this near, in each parameter moved and each unknown; inf if nothing is moved.
        radius: the largest radius of the balls.
        distance: from the stored design, in the parameter with the largest distance relative to `explained`.
        explained: the distance that rounding explains in that parameter.
    """

    method: str
    coefficients: Sequence[Any]
    parameters: Mapping[str, Any]
    tangents: Mapping[str, Any]
    unknowns: Mapping[str, Any]
    factorisation: Factorisation
    moved: tuple[str, ...] = ()
    uniqueness: float = float("inf")
    radius: float = 0.0
    distance: float = 0.0
    explained: float = 0.0


def prove_exactly(problem: Posed, pattern: Pattern, design: ExactDesign) -> ProvedDesign | None:
    """Prove the design itself by exact factorisation; None if its numbers are no fractions or lack the pattern."""
    found = enclose_stored(problem, design)
    if found is None or found.method != EXACT or any(c.equality for c in problem.conditions.values()):
        return None
    return found if has_pattern(pattern.form, found.coefficients) else None


def enclose_stored(problem: Posed, design: ExactDesign) -> ProvedDesign | None:
    """The stored design in balls, whatever its roots; None if a0 may be 0."""
    balls, of = design.balls(), problem.parameter_set
    tangents = {n: x for n, x in _exact_numbers(problem, design).items() if of[n].tangent}
    exact = design.coefficients(problem.model, of)
    a = problem.model.coefficients(balls, of) if exact is None else exact
    if a[0] == 0 or flint.arb(a[0]).contains(0) or not all(flint.arb(c).is_finite() for c in a):
        return None
    if exact is not None:
        return ProvedDesign(EXACT, a, balls, tangents, {}, factor_polynomial(a))
    whole = Factorisation((([c / a[0] for c in a], 1),))
    return ProvedDesign("isolated roots", a, balls, tangents, {}, whole, radius=largest_radius(list(balls.values())))


def prove_nearby(
    problem: Posed, pattern: Pattern, design: ExactDesign, stored: Mapping[str, float], digits: int
) -> ProvedDesign:
    """Prove by Krawczyk's test the design with a pattern whose rounding is the stored one.

    Raises:
        ProofFailed: if the proof fails; gives the reason.
    """
    system, carried = build_equations(problem, pattern, stored), digits + _EXTRA_DIGITS
    for _ in range(_ATTEMPTS):
        with flint.ctx.workdps(carried):
            found = _search_nearby(system, design, stored, carried - _EXTRA_DIGITS // 2)
            small = flint.arb(10) ** -(digits + GUARD)
            balls = [*found.parameters.items(), *found.unknowns.items()]
            if all(b.rad() <= small * (system.units.get(n, 1) + abs(b)) for n, b in balls):
                return found
        carried *= 2
    raise ProofFailed(f"the balls do not shrink to {digits} digits; ask for fewer digits")


def _search_nearby(system: Equations, design: ExactDesign, stored: Mapping[str, float], digits: int) -> ProvedDesign:
    problem, pattern = system.problem, system.pattern
    held = _exact_numbers(problem, design)
    free = [n for n in problem.free if n not in {s.removeprefix("tan(").removesuffix(")") for s in design.stated}]
    reasons: list[str] = []
    for among in _parameter_choices(problem, stored, free, system.conditions):
        for unknowns in _starts(system, held, problem):
            start = {**held, **unknowns}
            try:
                return _prove_from(system, start, among, digits)
            except ProofFailed as refusal:
                reasons.append(str(refusal))
    raise ProofFailed(reasons[0] if reasons else f"no {pattern.name} found near the design")


def _parameter_choices(problem: Posed, stored: Mapping[str, float], free: list[str], count: int) -> Iterator[list[str]]:
    """Yield choices of parameters to move: first only those inside their ranges, which keeps the design in the box."""
    ends = {n: problem.free[n] for n in free}
    inner = [n for n, (lo, hi) in ends.items() if min(stored[n] - lo, hi - stored[n]) > _AT_BOUND * (hi - lo)]
    if len(inner) >= count:
        yield inner
    if inner != free or len(inner) < count:
        yield free


def _starts(system: Equations, held: Mapping[str, Any], problem: Posed) -> Iterator[dict[str, Any]]:
    """Yield start values of the unknowns, from the nearest polynomials of the pattern and the quantities' values."""
    of = problem.parameter_set
    own = {n: float(held[n].atan()) if of[n].tangent else float(held[n]) for n in of.names}
    values = problem.values(own)
    lifted = {q.name: flint.arb(float(values[q.name])) for q in system.lifted}
    scale = Scale(system.unit)
    coefficients = scale.scale_coefficients([float(c) for c in problem.model.coefficients(own, of)])
    try:
        fits = fit_unknowns(system.pattern, coefficients)
    except ValueError:
        raise ProofFailed("a0 is 0, or a coefficient does not exist: a root is at infinity") from None
    for fit in fits[:2]:
        units = (system.units.get(n, 1.0) for n in system.pattern_unknowns)
        yield lifted | {n: flint.arb(x * u) for n, x, u in zip(system.pattern_unknowns, fit, units, strict=True)}


def _prove_from(system: Equations, start: Mapping[str, Any], among: list[str], digits: int) -> ProvedDesign:
    problem, pattern = system.problem, system.pattern
    of = problem.parameter_set
    chosen = choose_moved(system, start, among)
    names = [*chosen.moved, *system.unknowns]
    middle = refine_solution(system, start, names, digits, system.units)
    enclosure = enclose_solution(system, middle, names, digits, system.units)
    at = {**middle, **enclosure.balls}
    distance, explained = _measure_distance(chosen, start, enclosure, system.units)
    tangents = {n: at[n] for n in of.names if of[n].tangent}
    parameters = {n: at[n].atan() if n in tangents else at[n] for n in of.names}
    coefficients = problem.model.coefficients(parameters, of)
    unknowns = [at[n] for n in system.pattern_unknowns]
    _check_solution(system, coefficients, at)
    return ProvedDesign(
        "Krawczyk",
        coefficients,
        parameters,
        tangents,
        {n: at[n] for n in system.unknowns},
        factor_pattern(pattern, unknowns),
        chosen.moved,
        enclosure.uniqueness * min((system.units.get(n, 1.0) for n in names), default=1.0),
        largest_radius([at[n] for n in names]),
        distance,
        explained,
    )


def _measure_distance(
    chosen: MovedParameters, start: Mapping[str, Any], enclosure: Enclosure, units: Mapping[str, float]
) -> tuple[float, float]:
    """Distance of the stored design from the proved one, and the distance that rounding explains.

    Raises:
        ProofFailed: if rounding does not explain the distance, or if it could leave the box in which the solution is
            unique. Next to an EP4, for example, the last bit of a stored number would select one of many EP3s.
    """
    explained = chosen.explained
    off = {n: upper(abs(enclosure.balls[n] - start[n])) for n in chosen.moved}
    unique = {n: enclosure.uniqueness * units.get(n, 1.0) for n in explained}
    loose = max(explained, key=lambda n: explained[n] / unique[n], default=None)
    if loose and not explained[loose] < unique[loose]:
        raise ProofFailed(
            f"nearly singular: rounding alone moves {loose} by {explained[loose]:.2g}, but the solution is unique only "
            f"within {unique[loose]:.2g}; hold another parameter, or give exact numbers"
        )
    worst = max(off, key=lambda n: off[n] / explained[n], default=None)
    if worst is None:
        return 0.0, 0.0
    if off[worst] > explained[worst]:
        raise ProofFailed(
            f"not the design's: the nearest one is {off[worst]:.2g} from the stored {worst}; rounding explains only "
            f"{explained[worst]:.2g} ({ROUNDINGS} roundings of each number); solve again, or give all digits"
        )
    return off[worst], explained[worst]


def _check_solution(system: Equations, coefficients: Sequence[Any], at: Mapping[str, Any]) -> None:
    """Check the conditions that are no equations.

    Raises:
        ProofFailed: for a0 = 0, a quantity out of its range, or another kind of pattern.
    """
    if coefficients[0].contains(0):
        raise ProofFailed(
            "a0 may be 0: a root may be at infinity, and a polynomial with all a = 0 meets every equation"
        )
    for quantity in system.lifted:
        r, x = quantity.range, at[quantity.name]
        if not (x >= r.lower and x <= r.upper):
            raise ProofFailed(f"the solution found has {quantity.name} = {float(x):.6g}, outside its range {r}")
    pattern = system.pattern
    for value in pattern.nonnegative([at[n] for n in system.pattern_unknowns]):
        if value < 0:
            raise ProofFailed(_other_kind(pattern))
        if not value > 0:
            raise ProofFailed(_undecided_kind(pattern))


def _other_kind(pattern: Pattern) -> str:
    kinds = {
        "2EP2": "the double pair is complex: a CEP2, not a 2EP2",
        "CEP2": "two real double roots: a 2EP2, not a CEP2",
    }
    other = "the factors have no imaginary roots"
    if _needs_discriminant(pattern):
        other = "multiple roots are complex instead of real, or real instead of complex"
    return kinds.get(pattern.name, f"{other}: no {pattern.name}")


def _undecided_kind(pattern: Pattern) -> str:
    if pattern.form in ("2EP2", "CEP2") and not pattern.doubles:
        return "b² − 4c may be 0, which leaves 2EP2, CEP2 and EP4 undecided; locate EP4, with one more free parameter"
    if _needs_discriminant(pattern):
        return f"b² − 4c may be 0, which leaves {pattern.name} undecided; locate the pattern in which the roots meet"
    return "the imaginary part may be 0"


def _needs_discriminant(pattern: Pattern) -> bool:
    """Whether the sign of a discriminant b² − 4c separates the pattern from another one."""
    return any(u.startswith("b") for u in pattern.unknowns) and "EP" in pattern.name


def _exact_numbers(problem: Posed, design: ExactDesign) -> dict[str, Any]:
    """The exact value of every parameter as a ball; of an angle, its tangent."""
    of = problem.parameter_set
    numbers = {n: e.ball() for n, e in design.values.items()}
    return {
        n: design.tangents[n].ball() if n in design.tangents else numbers[n].tan() if of[n].tangent else numbers[n]
        for n in of.names
    }
