"""That a design with a root pattern exists beside a stored one, and that it is what the stored one stands for."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import flint

from tmsopt.algebra.balls import GUARD, largest_radius, upper
from tmsopt.algebra.krawczyk import Enclosure, ProofFailed, enclose_solution, refine_solution
from tmsopt.models.exact import ExactDesign
from tmsopt.problem.problem import Posed
from tmsopt.program.nlp import Scale
from tmsopt.proofs.factored import Factored, factored, has_pattern, of_pattern
from tmsopt.proofs.system import ROUNDINGS, Chosen, Equations, choose, equations
from tmsopt.roots import Pattern
from tmsopt.roots.patterns.structure import fit_unknowns

EXACT = "exact factorisation"
"""The method for a design whose coefficients are fractions."""

_EXTRA = 25  # decimal digits carried beyond those asked for
_TIMES = 3  # times that the digits carried are doubled
_INSIDE = 1e-9  # of the width of its range: nearer to an end a parameter is taken to be there


@dataclass(frozen=True)
class Existing:
    """A design with a pattern, proved.

    Attributes:
        parameters: every parameter as a ball, angles in radians.
        tangents: of the angles.
        unknowns: those of the pattern, and quantities with an equation of their own.
        uniqueness: no other solution is this near, in every number moved and unknown; inf where nothing is moved.
        radius: largest of those of the balls.
        distance, explained: of the parameter that the stored design is off most, and how far rounding explains.
    """

    method: str
    coefficients: Sequence[Any]
    parameters: Mapping[str, Any]
    tangents: Mapping[str, Any]
    unknowns: Mapping[str, Any]
    factored: Factored
    moved: tuple[str, ...] = ()
    uniqueness: float = float("inf")
    radius: float = 0.0
    distance: float = 0.0
    explained: float = 0.0


def exactly(problem: Posed, pattern: Pattern, design: ExactDesign) -> Existing | None:
    """The design itself, if its numbers are fractions and have the pattern exactly."""
    found = as_stored(problem, design)
    if found is None or found.method != EXACT or any(c.equality for c in problem.conditions.values()):
        return None
    return found if has_pattern(pattern.form, found.coefficients) else None


def as_stored(problem: Posed, design: ExactDesign) -> Existing | None:
    """The design as its numbers are, whatever its roots; None where a0 cannot be told from 0."""
    balls, of = design.balls(), problem.parameter_set
    tangents = {n: x for n, x in _numbers(problem, design).items() if of[n].tangent}
    exact = design.coefficients(problem.model, of)
    a = problem.model.coefficients(balls, of) if exact is None else exact
    if a[0] == 0 or flint.arb(a[0]).contains(0) or not all(flint.arb(c).is_finite() for c in a):
        return None
    if exact is not None:
        return Existing(EXACT, a, balls, tangents, {}, factored(a))
    whole = Factored((([c / a[0] for c in a], 1),))
    return Existing("isolated roots", a, balls, tangents, {}, whole, radius=largest_radius(list(balls.values())))


def beside(problem: Posed, pattern: Pattern, design: ExactDesign, stored: Mapping[str, float], digits: int) -> Existing:
    """The design with a pattern that a stored one stands for, by Krawczyk's test.

    Raises:
        ProofFailed: with the reason in words.
    """
    system, carried = equations(problem, pattern, stored), digits + _EXTRA
    for _ in range(_TIMES):
        with flint.ctx.workdps(carried):
            found = _beside(system, design, stored, carried - _EXTRA // 2)
            small = flint.arb(10) ** -(digits + GUARD)
            balls = [*found.parameters.items(), *found.unknowns.items()]
            if all(b.rad() <= small * (system.units.get(n, 1) + abs(b)) for n, b in balls):
                return found
        carried *= 2
    raise ProofFailed(f"the balls do not shrink to {digits} digits; ask for fewer")


def _beside(system: Equations, design: ExactDesign, stored: Mapping[str, float], digits: int) -> Existing:
    problem, pattern = system.problem, system.pattern
    held = _numbers(problem, design)
    free = [n for n in problem.free if n not in {s.removeprefix("tan(").removesuffix(")") for s in design.stated}]
    reasons: list[str] = []
    for among in _choices(problem, stored, free, system.conditions):
        for unknowns in _starts(system, held, problem):
            start = {**held, **unknowns}
            try:
                return _proved(system, start, among, digits)
            except ProofFailed as refusal:
                reasons.append(str(refusal))
    raise ProofFailed(reasons[0] if reasons else f"no {pattern.name} is anywhere near the design")


def _choices(problem: Posed, stored: Mapping[str, float], free: list[str], count: int) -> Iterator[list[str]]:
    """Free parameters to move: first only those inside their ranges, so that the proved design stays in the box."""
    ends = {n: problem.free[n] for n in free}
    inner = [n for n, (lo, hi) in ends.items() if min(stored[n] - lo, hi - stored[n]) > _INSIDE * (hi - lo)]
    if len(inner) >= count:
        yield inner
    if inner != free or len(inner) < count:
        yield free


def _starts(system: Equations, held: Mapping[str, Any], problem: Posed) -> Iterator[dict[str, Any]]:
    """Unknowns to start from: those of the nearest polynomials of the pattern, and the quantities' own values."""
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
        units = (system.units.get(n, 1.0) for n in system.of_pattern)
        yield lifted | {n: flint.arb(x * u) for n, x, u in zip(system.of_pattern, fit, units, strict=True)}


def _proved(system: Equations, start: Mapping[str, Any], among: list[str], digits: int) -> Existing:
    problem, pattern = system.problem, system.pattern
    of = problem.parameter_set
    chosen = choose(system, start, among)
    names = [*chosen.moved, *system.unknowns]
    middle = refine_solution(system, start, names, digits, system.units)
    enclosure = enclose_solution(system, middle, names, digits, system.units)
    at = {**middle, **enclosure.balls}
    distance, explained = _distance(chosen, start, enclosure, system.units)
    tangents = {n: at[n] for n in of.names if of[n].tangent}
    parameters = {n: at[n].atan() if n in tangents else at[n] for n in of.names}
    coefficients = problem.model.coefficients(parameters, of)
    unknowns = [at[n] for n in system.of_pattern]
    _checked(system, coefficients, at)
    return Existing(
        "Krawczyk",
        coefficients,
        parameters,
        tangents,
        {n: at[n] for n in system.unknowns},
        of_pattern(pattern, unknowns),
        chosen.moved,
        enclosure.uniqueness * min((system.units.get(n, 1.0) for n in names), default=1.0),
        largest_radius([at[n] for n in names]),
        distance,
        explained,
    )


def _distance(
    chosen: Chosen, start: Mapping[str, Any], enclosure: Enclosure, units: Mapping[str, float]
) -> tuple[float, float]:
    """The moved parameter that the stored design is off most, against what rounding explains.

    Raises:
        ProofFailed: if it is off by more, or if rounding takes it, or a root, out of the box in which the solution is
            unique: beside an EP4 are EP3s, of which the last bit of a stored number would choose one.
    """
    explained = chosen.explained
    off = {n: upper(abs(enclosure.balls[n] - start[n])) for n in chosen.moved}
    unique = {n: enclosure.uniqueness * units.get(n, 1.0) for n in explained}
    loose = max(explained, key=lambda n: explained[n] / unique[n], default=None)
    if loose and not explained[loose] < unique[loose]:
        raise ProofFailed(
            f"nearly singular: rounding alone moves {loose} by {explained[loose]:.2g}, and the solution is the only "
            f"one within {unique[loose]:.2g} only; hold another parameter, or give exact numbers"
        )
    worst = max(off, key=lambda n: off[n] / explained[n], default=None)
    if worst is None:
        return 0.0, 0.0
    if off[worst] > explained[worst]:
        raise ProofFailed(
            f"not the design's: the nearest one is {off[worst]:.2g} from the stored {worst}, of which rounding of the "
            f"stored numbers explains {explained[worst]:.2g} ({ROUNDINGS} roundings of each); solve again, or give all "
            "digits"
        )
    return off[worst], explained[worst]


def _checked(system: Equations, coefficients: Sequence[Any], at: Mapping[str, Any]) -> None:
    """What the equations alone do not say.

    Raises:
        ProofFailed: for a0 = 0, a quantity of the wrong sign, or another kind of pattern.
    """
    if coefficients[0].contains(0):
        raise ProofFailed(
            "a0 cannot be told from 0: a root may be at infinity, and all equations hold where all a are 0"
        )
    for quantity in system.lifted:
        r, x = quantity.range, at[quantity.name]
        if not (x >= r.lower and x <= r.upper):
            raise ProofFailed(f"the solution found has {quantity.name} = {float(x):.6g}, out of its range {r}")
    pattern = system.pattern
    for value in pattern.nonnegative([at[n] for n in system.of_pattern]):
        if value < 0:
            raise ProofFailed(_other_kind(pattern))
        if not value > 0:
            raise ProofFailed(_undecided_kind(pattern))


def _other_kind(pattern: Pattern) -> str:
    kinds = {
        "2EP2": "the double pair is complex: a CEP2, not a 2EP2",
        "CEP2": "two real double roots: a 2EP2, not a CEP2",
    }
    other = f"the factors have no imaginary roots: no {pattern.name}"
    if _of_quadratics(pattern):
        other = f"the multiple roots are complex where they must be real, or the other way round: no {pattern.name}"
    return kinds.get(pattern.name, other)


def _undecided_kind(pattern: Pattern) -> str:
    if pattern.form in ("2EP2", "CEP2") and not pattern.doubles:
        return "b² − 4c cannot be told from 0, so not 2EP2 from CEP2 and EP4; locate EP4, with a parameter more free"
    if _of_quadratics(pattern):
        return f"b² − 4c cannot be told from 0, so neither whether it is {pattern.name}; locate what the roots meet in"
    return "the imaginary part cannot be told from 0"


def _of_quadratics(pattern: Pattern) -> bool:
    """Whether the sign of a b² − 4c tells the pattern from another."""
    return any(u.startswith("b") for u in pattern.unknowns) and "EP" in pattern.name


def _numbers(problem: Posed, design: ExactDesign) -> dict[str, Any]:
    """Every parameter as it is taken exactly: a ball, of an angle that of its tangent."""
    of = problem.parameter_set
    numbers = {n: e.ball() for n, e in design.values.items()}
    return {
        n: design.tangents[n].ball() if n in design.tangents else numbers[n].tan() if of[n].tangent else numbers[n]
        for n in of.names
    }
