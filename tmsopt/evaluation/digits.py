"""Computes correctly rounded numbers of a design by ball arithmetic on the parameters as stored.

The parameters are doubles, hence exact binary numbers, and a case adds its offsets exactly. So every quantity is a
definite real number; its ball is narrowed until one double is certainly the nearest.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

import flint

from tmsopt.algebra.balls import exact
from tmsopt.algebra.kinds import BALLS, greater, lesser
from tmsopt.evaluation.recheck import Evaluation
from tmsopt.models import Model, Values
from tmsopt.models.user_spectrum import user_roots
from tmsopt.problem.cases import Case
from tmsopt.problem.dependence import depends_on_case
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, RADIUS, ROOT_NAMES, SIMPLE
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
"""Bits to try in turn; the first are 64 digits, half of which a fit may lose."""

_Key = tuple[str, str]  # a field of `Certified`, and a name if it is a table
_Several = tuple[EnclosedRoot, ...]


@dataclass(frozen=True)
class Certified:
    """The numbers that follow from the parameters alone; `Solution` describes each."""

    value: float
    abscissa: float
    realised: float
    roots: tuple[Root, ...]
    quantities: Table[float]
    dimensionless: Table[float]
    si: Table[Reading]


def certified_numbers(
    problem: Posed, parameters: Numbers, checked: Evaluation, cases: Sequence[Case] = ()
) -> Certified:
    """Round the numbers of a design correctly.

    The recheck supplies the worst cases and the structure of the roots. A number that balls cannot decide, such as one
    that happens to be 0, keeps the value of the recheck.

    Args:
        cases: the cases of the recheck; the objective is the worst over those between which it differs.
    """
    structures = {checked.worst: checked.structure}
    for case in {checked.least_damped, checked.fastest} - {checked.worst}:
        structures[case] = problem.values(case.applied(parameters))["structure"]
    listed = [case for case in cases if not case.direction]
    design = _Design(problem, _exact_numbers(parameters), checked, listed, structures)
    before: dict[_Key, float] = {("value", ""): checked.objective, ("realised", ""): checked.realised}
    before["abscissa", ""] = checked.structure.abscissa
    before |= {("quantities", name): x for name, x in checked.quantities.items()}
    before |= {("dimensionless", name): x for name, x in checked.dimensionless.items()}
    numbers: dict[_Key, Any] = {}
    for precision in _PRECISIONS:
        with flint.ctx.workprec(precision):
            roots = design.roots(last=precision == _PRECISIONS[-1])
            balls = [] if roots is None else [each for each in design.balls(*roots) if each[0] not in numbers]
            for key, ball, digits in balls:
                number = _nearest(ball, digits)
                # Rounded parameters may lie just outside the domain of a quantity, as near Fr_c = 0.
                if number is not None and not (math.isfinite(before.get(key, math.nan)) and math.isnan(number)):
                    numbers[key] = number
        if roots is not None and numbers.keys() >= {key for key, *_ in balls}:
            break

    def table(field: str) -> Table[Any]:
        return Table({name: x for (of, name), x in (before | numbers).items() if of == field})

    return Certified(
        value=table("value")[""],
        abscissa=table("abscissa")[""],
        realised=table("realised")[""],
        roots=numbers.get(("roots", "")) or user_roots(problem.model, checked.structure.roots),
        quantities=table("quantities"),
        dimensionless=table("dimensionless"),
        si=table("si"),
    )


def _nearest(ball: Any, digits: int) -> Any:
    """The rounded value of a ball, a root or a tuple of these; None if it is uncertain."""
    if isinstance(ball, tuple):
        each = tuple(_nearest(one, digits) for one in ball)
        return None if None in each else each
    if isinstance(ball, EnclosedRoot):
        place = _nearest((ball.re, ball.im), digits)
        return place and Root(place[0], place[1], ball.multiplicity)
    return nearest_decimal(ball, digits) if digits else nearest_double(ball)


@dataclass(frozen=True)
class _Design:
    """A design with everything that its numbers depend on.

    Attributes:
        exact: the exact parameters.
        structures: case → structure of the roots, for the rightmost, least damped and fastest cases.
    """

    problem: Posed
    exact: Mapping[str, Any]
    checked: Evaluation
    cases: Sequence[Case]
    structures: Mapping[Case, Structure]

    def balls(self, stored: _Several, ideal: Mapping[Case, _Several]) -> Iterator[tuple[_Key, Any, int]]:
        """Every number as a ball at the working precision, with the decimal digits to round to; 0 means a double."""
        model, of, checked, known = self.problem.model, self.problem.parameter_set, self.checked, dict[str, Any]()
        worst, damped, fastest = (ideal[c] for c in (checked.worst, checked.least_damped, checked.fastest))
        if stored:
            yield ("realised", ""), _rightmost(stored), 0
        if damped and model.carrier is None:
            known["damping_ratio"] = reduce(lesser, map(_ratio, damped))
        if fastest and ANGULAR_FREQUENCY in checked.quantities:
            known[ANGULAR_FREQUENCY] = reduce(greater, (root.im for root in fastest))
        if worst:
            known["abscissa"] = _rightmost(worst)
            yield ("abscissa", ""), known["abscissa"], 0
            yield ("roots", ""), _to_user_roots(model, worst), 0
        if checked.robustness and math.isfinite(checked.robustness.radius):
            known[RADIUS] = exact(checked.robustness.radius)
        nominal, abscissa, pi = self.values(Case()), known.get("abscissa", math.nan), flint.arb.pi()
        if of.rate is not None:
            rates = frequencies(fastest, of.rate(self.exact), pi)
            nominal = nominal.with_known({"frequency": reduce(greater, rates, flint.arb(0))})
        nominal = nominal.with_known({"abscissa": abscissa, **known})
        yield from ((("quantities", n), nominal[n], 0) for n in checked.quantities if n in known or n not in ROOT_NAMES)
        native = of.native(self.exact)
        yield from ((("dimensionless", n), native[n], 0) for n in checked.dimensionless)
        yield from ((("si", n), x, k) for n, x, k in readings(of, self.exact, nominal, abscissa, worst, pi))
        objective = self.problem.objective
        if objective is not None and set(objective.names) & {*ROOT_NAMES} <= set(known):
            differs = depends_on_case(self.problem, objective, self.cases)
            cases = self.cases if differs else [Case()]
            each = [objective.of(self.values(case).with_known(known), BALLS) for case in cases]
            yield ("value", ""), reduce(lesser if self.problem.sense == "maximize" else greater, each), 0

    def roots(self, last: bool) -> tuple[_Several, Mapping[Case, _Several]] | None:
        """The roots as stored in the worst case, and per case the roots of the nearest polynomial of its structure.

        Returns None if they are undecided, or, at the `last` precision, the roots of the recheck.
        """
        stored = enclosed_roots(self.values(self.checked.worst).coefficients)
        ideal: dict[Case, _Several] = {}
        for case, structure in self.structures.items():
            coefficients = self.values(case).coefficients
            found: _Several | None = ()  # for a root at infinity
            if structure.roots and structure.name in SIMPLE and all(root.multiplicity == 1 for root in structure.roots):
                found = (stored if case == self.checked.worst else None) or enclosed_roots(coefficients)
            elif structure.roots:
                found = nearest_roots(coefficients, structure.roots)
            if (found is None or stored is None) and not last:
                return None
            as_found = (EnclosedRoot(flint.arb(r.re), flint.arb(r.im), r.multiplicity) for r in structure.roots)
            ideal[case] = tuple(as_found) if found is None else found
        return stored or (), ideal

    def values(self, case: Case) -> Values:
        """Everything derived from the exact parameters in a case, without root quantities."""
        varied = Case(Table(_exact_numbers(case.at)), Table(_exact_numbers(case.offset))).applied(self.exact)
        return Values(self.problem.model, self.problem.parameter_set, varied)


def _exact_numbers(table: Numbers) -> dict[str, Any]:
    return {name: exact(value) for name, value in table.items()}


def _rightmost(roots: _Several) -> Any:
    return reduce(greater, (root.re for root in roots))


def _ratio(root: EnclosedRoot) -> Any:
    """−Re s/|s|; 0 for a root at 0."""
    return flint.arb(0) if root.re == 0 and root.im == 0 else -root.re / root.modulus


def _to_user_roots(model: Model, roots: _Several) -> _Several:
    """The roots as users read them; an eigenfrequency within 2⁻²¹² of the carrier reads 0."""
    found: _Several = user_roots(model, roots)
    if model.carrier is None:
        return found
    nothing = flint.arb(2) ** -_PRECISIONS[0] * (1 + abs(model.carrier))
    return tuple(replace(z, im=flint.arb(0)) if z.im.contains(0) and abs(z.im) < nothing else z for z in found)
