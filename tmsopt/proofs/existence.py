"""Proves that an exact design with a root pattern exists near a stored one, and that the stored one is its rounding.

Ball arithmetic represents a number by a ball: an interval with a midpoint and a radius that certainly contains it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import flint

from tmsopt.algebra.balls import GUARD_DIGITS, largest_radius, upper_bound
from tmsopt.algebra.krawczyk import Enclosure, ProofFailed, enclose_solution, refine_solution
from tmsopt.chains import has_regular_lead
from tmsopt.global_search.chain_equations import ChainEquations, build_chain_equations, has_chain_proof
from tmsopt.models.exact import ExactDesign
from tmsopt.models.user_spectrum import pattern_of
from tmsopt.problem.problem import Posed
from tmsopt.problem.real_form import has_real_form, real_form
from tmsopt.program.nlp import Scale
from tmsopt.proofs.factorisation import Factorisation, factor_pattern, factor_polynomial, has_pattern
from tmsopt.proofs.system import ROUNDINGS, Equations, MovedParameters, build_equations, choose_moved
from tmsopt.roots import Pattern
from tmsopt.roots.patterns.root_enclosures import EnclosedRoot
from tmsopt.roots.patterns.structure import fit_unknowns

EXACT = "exact factorisation"
"""The method for a design whose coefficients are fractions."""

AnyEquations = Equations | ChainEquations

_EXTRA_DIGITS = 25  # decimal digits of the arithmetic beyond the requested ones
_MAX_ATTEMPTS = 3  # each attempt computes with twice the digits of the previous one
_END_DISTANCE = 1e-9  # relative to its range: a parameter closer to an end counts as at that end


@dataclass(frozen=True)
class ProvedDesign:
    """A proved design.

    Attributes:
        parameters: every parameter as a ball, angles in radians.
        tangents: tangents of the angles.
        unknowns: unknowns of the pattern, and quantities with an equation of their own.
        moved: parameters that were solved for; the others keep their stored values.
        uniqueness: distance within which no other solution exists, in each moved parameter and each unknown; inf if no
            parameter is moved.
        radius: the largest radius of the balls.
        distance: how far the stored value of a parameter is from the proved one, for the parameter with the largest
            ratio of this distance to the distance that rounding explains.
        explained: the distance that rounding explains for this parameter.
        chain_roots: the roots of proved Jordan chains, each of which has one eigenvector.
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
    chain_roots: tuple[EnclosedRoot, ...] = ()


def prove_exactly(problem: Posed, pattern: Pattern, design: ExactDesign) -> ProvedDesign | None:
    """Prove the stored design by exact factorisation; None unless it has fractions and the pattern."""
    proved_design = enclose_stored(problem, design)
    if proved_design is None or proved_design.method != EXACT or any(c.equality for c in problem.conditions.values()):
        return None
    return proved_design if has_pattern(pattern.form, proved_design.coefficients) else None


def enclose_stored(problem: Posed, design: ExactDesign) -> ProvedDesign | None:
    """Enclose the roots of the stored design in balls, for any pattern; None if a0 may be 0."""
    if not has_real_form(problem.model):
        return None
    balls, parameter_set, model = design.balls(), problem.parameter_set, real_form(problem).problem.model
    tangents = {n: x for n, x in _exact_numbers(problem, design).items() if parameter_set[n].tangent}
    exact_coefficients = design.coefficients(model, parameter_set)
    a = model.coefficients(balls, parameter_set) if exact_coefficients is None else exact_coefficients
    if not a or a[0] == 0 or flint.arb(a[0]).contains(0) or not all(flint.arb(c).is_finite() for c in a):
        return None
    if exact_coefficients is not None:
        return ProvedDesign(EXACT, a, balls, tangents, {}, factor_polynomial(a))
    factorisation = Factorisation((([c / a[0] for c in a], 1),))
    return ProvedDesign(
        "isolated roots", a, balls, tangents, {}, factorisation, radius=largest_radius(list(balls.values()))
    )


def prove_nearby(
    problem: Posed, pattern: Pattern, design: ExactDesign, stored_values: Mapping[str, float], digits: int
) -> ProvedDesign:
    """Prove by Krawczyk's test that a design with a pattern exists whose rounding is the stored one.

    Raises:
        ProofFailed: if the proof fails; the message gives the reason.
    """
    working_digits = digits + _EXTRA_DIGITS
    system: AnyEquations
    if has_chain_proof(problem, pattern.name) and has_regular_lead(problem, stored_values):
        changed = set(design.given_exactly) & set(problem.fixed) - set(problem.typed(stored_values))
        system = build_chain_equations(problem, pattern, stored_values, uses_symmetry=not changed)
    else:
        form = real_form(problem)
        real_pattern = pattern_of(form.problem.model, form.real_name(pattern.name)) if form.carrier else pattern
        system = build_equations(form.problem, real_pattern, stored_values)
    for _ in range(_MAX_ATTEMPTS):
        with flint.ctx.workdps(working_digits):
            proved_design = _search_nearby(system, design, stored_values, working_digits - _EXTRA_DIGITS // 2)
            tolerance = flint.arb(10) ** -(digits + GUARD_DIGITS)
            balls = [*proved_design.parameters.items(), *proved_design.unknowns.items()]
            if all(b.rad() <= tolerance * (system.units.get(n, 1) + abs(b)) for n, b in balls):
                return proved_design
        working_digits *= 2
    raise ProofFailed(f"the balls do not shrink to {digits} digits; ask for fewer digits")


def _search_nearby(
    system: AnyEquations, design: ExactDesign, stored_values: Mapping[str, float], digits: int
) -> ProvedDesign:
    """Try each choice of parameters to move and each start of the unknowns; the first proof counts."""
    problem, pattern = system.problem, system.pattern
    exact_values = _exact_numbers(problem, design)
    free_names = [
        n for n in problem.free if n not in {s.removeprefix("tan(").removesuffix(")") for s in design.given_exactly}
    ]
    reasons: list[str] = []
    for candidates in _parameter_choices(problem, stored_values, free_names, system.condition_count):
        starts = system.start_values() if isinstance(system, ChainEquations) else _start_values(system, exact_values)
        for unknowns in starts:
            start = {**exact_values, **unknowns}
            try:
                return _prove_from(system, start, candidates, digits)
            except ProofFailed as failure:
                reasons.append(str(failure))
    raise ProofFailed(reasons[0] if reasons else f"no {pattern.name} found near the design")


def _parameter_choices(
    problem: Posed, stored_values: Mapping[str, float], free_names: list[str], count: int
) -> Iterator[list[str]]:
    """Yield choices of parameters to move: first those inside their ranges, to keep the design in the box."""
    ends = {n: problem.free[n] for n in free_names}
    inner_names = [
        n
        for n, (lo, hi) in ends.items()
        if min(stored_values[n] - lo, hi - stored_values[n]) > _END_DISTANCE * (hi - lo)
    ]
    if len(inner_names) >= count:
        yield inner_names
    if inner_names != free_names or len(inner_names) < count:
        yield free_names


def _start_values(system: Equations, exact_values: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield start values of the unknowns, from the nearest polynomials of the pattern and the quantities' values."""
    problem, parameter_set = system.problem, system.problem.parameter_set
    parameters = {
        n: float(exact_values[n].atan()) if parameter_set[n].tangent else float(exact_values[n])
        for n in parameter_set.names
    }
    values = problem.values(parameters)
    lifted = {q.name: flint.arb(float(values[q.name])) for q in system.lifted}
    scale = Scale(system.unit)
    coefficients = scale.scale_coefficients([float(c) for c in problem.model.coefficients(parameters, parameter_set)])
    try:
        fits = fit_unknowns(system.pattern, coefficients)
    except ValueError:
        raise ProofFailed("a0 is 0, or a coefficient is not finite: a root is at infinity") from None
    for fit in fits[:2]:
        units = (system.units.get(n, 1.0) for n in system.pattern_unknowns)
        yield lifted | {n: flint.arb(x * u) for n, x, u in zip(system.pattern_unknowns, fit, units, strict=True)}


def _prove_from(system: AnyEquations, start: Mapping[str, Any], candidates: list[str], digits: int) -> ProvedDesign:
    """Prove a design from start values of all parameters and unknowns."""
    parameter_set = system.problem.parameter_set
    choice = choose_moved(system, start, candidates)
    names = [*choice.moved, *system.unknowns]
    middle = refine_solution(system, start, names, digits, system.units)
    enclosure = enclose_solution(system, middle, names, digits, system.units)
    solution = {**middle, **enclosure.balls}
    distance, explained = _measure_distance(choice, start, enclosure, system.units)
    tangents = {n: solution[n] for n in parameter_set.names if parameter_set[n].tangent}
    parameters = {n: solution[n].atan() if n in tangents else solution[n] for n in parameter_set.names}
    form = real_form(system.problem) if has_real_form(system.problem.model) else None
    coefficients = form.problem.model.coefficients(parameters, parameter_set) if form else []
    if isinstance(system, ChainEquations):
        system.check(solution)
        factorisation = _factorise(system, coefficients, solution, form.carrier or 0.0 if form else 0.0)
    else:
        _check_solution(system, coefficients, solution)
        factorisation = factor_pattern(system.pattern, [solution[n] for n in system.pattern_unknowns])
    return ProvedDesign(
        "Krawczyk",
        coefficients,
        parameters,
        tangents,
        {} if isinstance(system, ChainEquations) else {n: solution[n] for n in system.unknowns},
        factorisation,
        choice.moved,
        enclosure.uniqueness * min((system.units.get(n, 1.0) for n in names), default=1.0),
        largest_radius([solution[n] for n in names]),
        distance,
        explained,
        _list_chain_roots(system, solution) if isinstance(system, ChainEquations) else (),
    )


def _list_chain_roots(system: ChainEquations, solution: Mapping[str, Any]) -> tuple[EnclosedRoot, ...]:
    roots = list[EnclosedRoot]()
    for s, target in zip(system.eigenvalues(solution), system.targets, strict=True):
        roots.append(EnclosedRoot(s.real, s.imag, target.order))
        if not system.is_complex and target.axis in ("complex", "imaginary"):
            roots.append(EnclosedRoot(s.real, -s.imag, target.order))
    return tuple(roots)


def _factorise(
    system: ChainEquations, coefficients: Sequence[Any], solution: Mapping[str, Any], carrier: float
) -> Factorisation:
    """The polynomial of a model as a product of the multiple factors and the other roots' factor."""
    rest = [c / coefficients[0] for c in coefficients]  # empty for large matrices
    factors = list[tuple[list[Any], int]]()
    for s, target in zip(system.eigenvalues(solution), system.targets, strict=True):
        height = s.imag - carrier
        square = s.real * s.real + height * height  # a power of a ball around 0 would be nan
        is_real = target.is_real(system.problem.model.is_complex)
        factor = [flint.arb(1), -s.real] if is_real else [flint.arb(1), -2 * s.real, square]
        factors.append((factor, target.order))
        for _ in range(target.order if rest else 0):
            rest = _divide(rest, factor)
    return Factorisation((*factors, *([(rest, 1)] if len(rest) > 1 else [])))


def _divide(coefficients: Sequence[Any], factor: Sequence[Any]) -> list[Any]:
    """The quotient of two monic polynomials, without the remainder."""
    rest, count = list(coefficients), len(coefficients) - len(factor) + 1
    for i in range(count):
        for j, x in enumerate(factor[1:], start=1):
            rest[i + j] -= rest[i] * x
    return rest[:count]


def _measure_distance(
    choice: MovedParameters, start: Mapping[str, Any], enclosure: Enclosure, units: Mapping[str, float]
) -> tuple[float, float]:
    """Measure `distance` and `explained` of `ProvedDesign`.

    Raises:
        ProofFailed: if rounding does not explain the distance, or if rounding could move the design out of the box in
            which the solution is unique. Next to an EP4, for example, the last bit of a number selects one of many EP3.
    """
    explained = choice.explained
    distances = {n: upper_bound(abs(enclosure.balls[n] - start[n])) for n in choice.moved}
    unique_distances = {n: enclosure.uniqueness * units.get(n, 1.0) for n in explained}
    critical_name = max(explained, key=lambda n: explained[n] / unique_distances[n], default=None)
    if critical_name and not explained[critical_name] < unique_distances[critical_name]:
        raise ProofFailed(
            f"nearly singular: rounding alone moves {critical_name} by {explained[critical_name]:.2g}, but the "
            f"solution is unique only within {unique_distances[critical_name]:.2g}; hold another parameter, or give "
            "exact numbers"
        )
    farthest_name = max(distances, key=lambda n: distances[n] / explained[n], default=None)
    if farthest_name is None:
        return 0.0, 0.0
    if distances[farthest_name] > explained[farthest_name]:
        raise ProofFailed(
            f"the solution found is not the stored design: {farthest_name} differs by {distances[farthest_name]:.2g}, "
            f"but rounding explains only {explained[farthest_name]:.2g} ({ROUNDINGS} roundings of each number); "
            "solve again, or give all digits"
        )
    return distances[farthest_name], explained[farthest_name]


def _check_solution(system: Equations, coefficients: Sequence[Any], solution: Mapping[str, Any]) -> None:
    """Check the conditions that are not equations.

    Raises:
        ProofFailed: for a0 = 0, a quantity out of its range, or another kind of pattern.
    """
    if coefficients[0].contains(0):
        raise ProofFailed(
            "a0 may be 0: a root may be at infinity, and a polynomial with all a = 0 meets every equation"
        )
    for quantity in system.lifted:
        r, x = quantity.range, solution[quantity.name]
        if not (x >= r.lower and x <= r.upper):
            raise ProofFailed(f"the solution found has {quantity.name} = {float(x):.6g}, outside its range {r}")
    pattern = system.pattern
    for value in pattern.nonnegative([solution[n] for n in system.pattern_unknowns]):
        if value < 0:
            raise ProofFailed(_other_kind(pattern))
        if not value > 0:
            raise ProofFailed(_undecided_kind(pattern))


def _other_kind(pattern: Pattern) -> str:
    known_reasons = {
        "2EP2": "the double pair is complex: a CEP2, not a 2EP2",
        "CEP2": "two real double roots: a 2EP2, not a CEP2",
    }
    reason = "the factors have no imaginary roots"
    if _needs_discriminant(pattern):
        reason = "multiple roots are complex instead of real, or real instead of complex"
    return known_reasons.get(pattern.name, f"{reason}: no {pattern.name}")


def _undecided_kind(pattern: Pattern) -> str:
    if pattern.form in ("2EP2", "CEP2") and not pattern.real_name:
        return "b² − 4c may be 0, which leaves 2EP2, CEP2 and EP4 undecided; locate EP4, with one more free parameter"
    if _needs_discriminant(pattern):
        return f"b² − 4c may be 0, which leaves {pattern.name} undecided; locate the pattern in which the roots meet"
    return "the imaginary part may be 0"


def _needs_discriminant(pattern: Pattern) -> bool:
    """Whether the sign of a discriminant b² − 4c separates the pattern from another one."""
    return any(u.startswith("b") for u in pattern.unknowns) and "EP" in pattern.name


def _exact_numbers(problem: Posed, design: ExactDesign) -> dict[str, Any]:
    """Each parameter → a ball around its exact value; for an angle, around its tangent."""
    parameter_set = problem.parameter_set
    numbers = {n: e.ball() for n, e in design.values.items()}
    return {
        n: design.tangents[n].ball()
        if n in design.tangents
        else numbers[n].tan()
        if parameter_set[n].tangent
        else numbers[n]
        for n in parameter_set.names
    }
