"""Computes correctly rounded numbers of a design by interval arithmetic on the parameters as stored.

The parameters are doubles, so they are exact binary numbers, and a case adds its offsets exactly. So every quantity is
a definite real number. Its interval (a *ball* with a midpoint and a radius) is computed with more and more bits until
one double is certainly the nearest.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import flint

from tmsopt.algebra.balls import exact
from tmsopt.algebra.kinds import BALLS, ball_maximum, ball_minimum
from tmsopt.evaluation.recheck import Evaluation
from tmsopt.models import Values
from tmsopt.problem.cases import Case
from tmsopt.problem.dependence import depends_on_case
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, RADIUS, ROOT_NAMES, SIMPLE_STRUCTURES, roots_at
from tmsopt.problem.units import Reading, frequencies, readings
from tmsopt.records import Numbers, Table
from tmsopt.roots import Root, Structure
from tmsopt.roots.patterns.root_enclosures import (
    EnclosedRoot,
    enclosed_roots,
    nearest_decimal,
    nearest_double,
    nearest_roots,
)

_PRECISIONS = (212, 424, 848, 1696)
"""Bits of precision, tried in this order. 212 bits are 64 digits, half of which a fit may lose."""

_Key = tuple[str, str]
"""A field of `Certified`, and a name in the field if the field is a table."""

_Roots = tuple[EnclosedRoot, ...]


@dataclass(frozen=True)
class Certified:
    """The numbers that follow from the parameters only; `Solution` describes each number."""

    value: float
    abscissa: float
    abscissa_realised: float
    roots: tuple[Root, ...]
    quantities: Table[float]
    dimensionless: Table[float]
    si: Table[Reading]


def certified_numbers(
    problem: Posed, parameters: Numbers, checked: Evaluation, cases: Sequence[Case] = ()
) -> Certified:
    """Round the numbers of a design correctly.

    The recheck gives the worst cases and the structure of the roots. If intervals cannot decide how to round a number,
    for example because it is exactly 0, the number keeps the value of the recheck.

    Args:
        cases: the cases of the recheck. If the objective depends on the case, it is the worst over these cases.
    """
    structures = {checked.worst: checked.structure}
    for case in {checked.least_damped, checked.fastest} - {checked.worst}:
        structures[case] = problem.values(case.applied(parameters))["structure"]
    listed_cases = [case for case in cases if not case.direction]
    design = _Design(problem, _convert_exactly(parameters), checked, listed_cases, structures)
    default_numbers: dict[_Key, float] = {
        ("value", ""): checked.objective,
        ("abscissa", ""): checked.structure.abscissa,
        ("abscissa_realised", ""): checked.abscissa_realised,
    }
    default_numbers |= {("quantities", name): x for name, x in checked.quantities.items()}
    default_numbers |= {("dimensionless", name): x for name, x in checked.dimensionless.items()}
    numbers: dict[_Key, Any] = {}
    for precision in _PRECISIONS:
        with flint.ctx.workprec(precision):
            roots = design.roots(is_last=precision == _PRECISIONS[-1])
            balls = [] if roots is None else [entry for entry in design.balls(*roots) if entry[0] not in numbers]
            for key, ball, digits in balls:
                number = _round_ball(ball, digits)
                # Rounded parameters may be slightly outside the domain of a quantity, for example near Fr_c = 0.
                if number is not None and not (
                    math.isfinite(default_numbers.get(key, math.nan)) and math.isnan(number)
                ):
                    numbers[key] = number
        if roots is not None and numbers.keys() >= {key for key, *_ in balls}:
            break

    def table(field: str) -> Table[Any]:
        return Table({name: x for (owner, name), x in (default_numbers | numbers).items() if owner == field})

    return Certified(
        value=table("value")[""],
        abscissa=table("abscissa")[""],
        abscissa_realised=table("abscissa_realised")[""],
        roots=numbers.get(("roots", "")) or checked.structure.roots,
        quantities=table("quantities"),
        dimensionless=table("dimensionless"),
        si=table("si"),
    )


def _round_ball(ball: Any, digits: int) -> Any:
    """The rounded value of a ball, a root or a tuple of these; None if the rounding is uncertain."""
    if isinstance(ball, tuple):
        parts = tuple(_round_ball(part, digits) for part in ball)
        return None if None in parts else parts
    if isinstance(ball, EnclosedRoot):
        parts = _round_ball((ball.re, ball.im), digits)
        return parts and Root(parts[0], parts[1], ball.multiplicity)
    return nearest_decimal(ball, digits) if digits else nearest_double(ball)


@dataclass(frozen=True)
class _Design:
    """A design with everything that its numbers depend on.

    Attributes:
        exact: the parameters as exact numbers.
        structures: case → structure of the roots, for the rightmost, least damped and fastest cases.
    """

    problem: Posed
    exact: Mapping[str, Any]
    checked: Evaluation
    cases: Sequence[Case]
    structures: Mapping[Case, Structure]

    def balls(self, stored: _Roots, ideal: Mapping[Case, _Roots]) -> Iterator[tuple[_Key, Any, int]]:
        """Every number as a ball at the working precision, and its number of decimal digits; 0 means a double."""
        model, parameter_set, checked, known_values = (
            self.problem.model,
            self.problem.parameter_set,
            self.checked,
            dict[str, Any](),
        )
        worst_roots, least_damped_roots, fastest_roots = (
            ideal[case] for case in (checked.worst, checked.least_damped, checked.fastest)
        )
        if stored:
            yield ("abscissa_realised", ""), _find_rightmost(stored), 0
        if least_damped_roots and not model.is_complex:
            known_values["damping_ratio"] = reduce(ball_minimum, map(_compute_damping_ratio, least_damped_roots))
        if fastest_roots and ANGULAR_FREQUENCY in checked.quantities:
            known_values[ANGULAR_FREQUENCY] = reduce(ball_maximum, (root.im for root in fastest_roots))
        if worst_roots:
            known_values["abscissa"] = _find_rightmost(worst_roots)
            yield ("abscissa", ""), known_values["abscissa"], 0
            yield ("roots", ""), worst_roots, 0
        if checked.robustness and math.isfinite(checked.robustness.radius):
            known_values[RADIUS] = exact(checked.robustness.radius)
        nominal, abscissa, pi = self.values(Case()), known_values.get("abscissa", math.nan), flint.arb.pi()
        if parameter_set.rate is not None:
            rates = frequencies(fastest_roots, parameter_set.rate(self.exact), pi)
            nominal = nominal.with_known({"frequency": reduce(ball_maximum, rates, flint.arb(0))})
        nominal = nominal.with_known({"abscissa": abscissa, **known_values})
        yield from (
            (("quantities", n), nominal[n], 0) for n in checked.quantities if n in known_values or n not in ROOT_NAMES
        )
        native = parameter_set.native(self.exact)
        yield from ((("dimensionless", n), native[n], 0) for n in checked.dimensionless)
        for name, x, digits in readings(parameter_set, self.exact, nominal, abscissa, worst_roots, pi):
            yield ("si", name), x, digits
        objective = self.problem.objective
        if objective is not None and set(objective.names) & {*ROOT_NAMES} <= set(known_values):
            differs = depends_on_case(self.problem, objective, self.cases)
            cases = self.cases if differs else [Case()]
            objectives = [objective.of(self.values(case).with_known(known_values), BALLS) for case in cases]
            worst_of = ball_minimum if self.problem.sense == "maximize" else ball_maximum
            yield ("value", ""), reduce(worst_of, objectives), 0

    def roots(self, is_last: bool) -> tuple[_Roots, Mapping[Case, _Roots]] | None:
        """The stored roots in the worst case, and for each case the roots of the nearest polynomial of its structure.

        If roots remain undecided, the result is None, or at the last precision the roots of the recheck.
        """
        if self.problem.model.polynomial is None:  # the eigenvalues are computed in doubles
            worst = roots_at(self.problem.model, self.problem.parameter_set, self.values(self.checked.worst))
            return _as_enclosed(worst), {case: _as_enclosed(s.roots) for case, s in self.structures.items()}
        stored = enclosed_roots(self.values(self.checked.worst).coefficients)
        ideal: dict[Case, _Roots] = {}
        for case, structure in self.structures.items():
            coefficients = self.values(case).coefficients
            nearest: _Roots | None = ()  # for a root at infinity
            if (
                structure.roots
                and structure.name in SIMPLE_STRUCTURES
                and all(root.multiplicity == 1 for root in structure.roots)
            ):
                nearest = (stored if case == self.checked.worst else None) or enclosed_roots(coefficients)
            elif structure.roots:
                nearest = nearest_roots(coefficients, structure.roots)
            if (nearest is None or stored is None) and not is_last:
                return None
            ideal[case] = _as_enclosed(structure.roots) if nearest is None else nearest
        return stored or (), ideal

    def values(self, case: Case) -> Values:
        """Everything derived from the exact parameters in a case, without root quantities."""
        exact_case = Case(Table(_convert_exactly(case.at)), Table(_convert_exactly(case.offset)))
        return Values(self.problem.model, self.problem.parameter_set, exact_case.applied(self.exact))


def _as_enclosed(roots: Sequence[Root]) -> _Roots:
    return tuple(EnclosedRoot(flint.arb(r.re), flint.arb(r.im), r.multiplicity) for r in roots)


def _convert_exactly(table: Numbers) -> dict[str, Any]:
    return {name: exact(value) for name, value in table.items()}


def _find_rightmost(roots: _Roots) -> Any:
    return reduce(ball_maximum, (root.re for root in roots))


def _compute_damping_ratio(root: EnclosedRoot) -> Any:
    """−Re s/|s|; 0 for a root at 0."""
    return flint.arb(0) if root.re == 0 and root.im == 0 else -root.re / root.modulus
