"""The numbers of a design, each the double nearest to its true value: ball arithmetic on the parameters as stored.

The parameters are doubles, so exact binary numbers, and a case adds its offset to them exactly. Every quantity is then
a definite real number, enclosed in a ball that is narrowed until only one double is nearest to it.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

import flint
import numpy as np

from tmsopt.algebra.balls import exact
from tmsopt.algebra.kinds import BALLS, greater, lesser
from tmsopt.evaluation.recheck import Evaluation
from tmsopt.models import Model, Values
from tmsopt.models.user_spectrum import user_roots
from tmsopt.problem.cases import Case
from tmsopt.problem.dependence import depends_on_case
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, RADIUS, SIMPLE
from tmsopt.problem.units import Reading, frequencies, readings
from tmsopt.records import Numbers, Table
from tmsopt.roots import Root, Structure
from tmsopt.roots.patterns.enclosed import Enclosed, enclosed_roots, nearest_decimal, nearest_double, nearest_roots

_PRECISIONS = (212, 424, 848, 1696)
"""Bits carried, one after the other until they suffice; the first are 60 digits, half of which a fit may lose."""

_Key = tuple[Any, ...]
_Several = tuple[Enclosed, ...]


@dataclass(frozen=True)
class Certified:
    """The numbers of a design that follow from its parameters alone; see `Solution` for each."""

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
    """The numbers of a design, correctly rounded.

    Which cases are the worst and which structure the roots have is taken from the recheck. A number that the balls
    cannot settle, such as one that only happens to be 0, stays what the recheck found.

    Args:
        cases: those that the design was checked in; an objective that differs between them is the worst of all.
    """
    structures = {checked.worst: checked.structure}
    for case in {checked.least_damped, checked.fastest} - {checked.worst}:
        structures[case] = problem.values(case.applied(parameters))["structure"]
    listed = [case for case in cases if not case.direction]
    design = _Design(problem, _exact(parameters), checked, listed, structures)
    before = _rechecked(checked)
    numbers: dict[_Key, float] = {}
    for precision in _PRECISIONS:
        last = precision == _PRECISIONS[-1]
        with flint.ctx.workprec(precision):
            roots = design.roots(last)
            balls = [] if roots is None else [each for each in design.balls(*roots) if each[0] not in numbers]
            for key, ball, digits in balls:
                number = nearest_decimal(ball, digits) if digits else nearest_double(ball)
                expected = last or math.isnan(before.get(key, math.nan))
                if number is not None and (expected or not math.isnan(number)):
                    numbers[key] = number
        if roots is not None and numbers.keys() >= {key for key, *_ in balls}:
            break
    # At the very end of where a quantity exists, as Fr_c = 0, rounding of the parameters alone may carry it beyond.
    exist = {key: x for key, x in numbers.items() if not (math.isnan(x) and math.isfinite(before.get(key, math.nan)))}
    return _assembled(problem.model, checked, before | exist)


def _rechecked(checked: Evaluation) -> dict[_Key, float]:
    """What the recheck found in double precision."""
    found: dict[_Key, float] = {("value",): checked.objective, ("realised",): checked.realised}
    found["abscissa",] = checked.structure.abscissa
    for kind, table in (("quantities", checked.quantities), ("dimensionless", checked.dimensionless)):
        found |= {(kind, name): value for name, value in table.items()}
    return found


@dataclass(frozen=True)
class _Design:
    """A design with all that its numbers depend on.

    Attributes:
        exact: its parameters.
        structures: of the roots in the cases with the largest abscissa, the least damping ratio and the fastest motion.
    """

    problem: Posed
    exact: Mapping[str, Any]
    checked: Evaluation
    cases: Sequence[Case]
    structures: Mapping[Case, Structure]

    def balls(self, stored: _Several, ideal: Mapping[Case, _Several]) -> Iterator[tuple[_Key, Any, int]]:
        """Every number as a ball at the working precision, with the decimal digits to round it to, 0 for a double."""
        model, of, checked, known = self.problem.model, self.problem.parameter_set, self.checked, dict[str, Any]()
        worst, damped, fastest = (ideal[c] for c in (checked.worst, checked.least_damped, checked.fastest))
        if stored:
            yield ("realised",), _rightmost(stored), 0
        if damped and model.carrier is None:
            known["damping_ratio"] = reduce(lesser, map(_ratio, damped))
        if fastest and ANGULAR_FREQUENCY in checked.quantities:
            known[ANGULAR_FREQUENCY] = reduce(greater, (root.im for root in fastest))
        yield from ((("quantities", name), ball, 0) for name, ball in known.items())
        if worst:
            known["abscissa"] = _rightmost(worst)
            yield ("abscissa",), known["abscissa"], 0
            for k, root in enumerate(_shown(model, worst)):
                for part, ball in (("re", root.re), ("im", root.im), ("multiplicity", exact(root.multiplicity))):
                    yield ("roots", k, part), ball, 0
        if checked.around and math.isfinite(checked.around.radius):
            known[RADIUS] = exact(checked.around.radius)
        nominal, abscissa, pi = self.values(Case()), known.get("abscissa", math.nan), flint.arb.pi()
        if of.rate is not None:
            rates = frequencies(fastest, of.rate(self.exact), pi)
            nominal = nominal.with_known({"frequency": reduce(greater, rates, flint.arb(0))})
        nominal = nominal.with_known({"abscissa": abscissa})
        yield from ((("quantities", n), nominal[n], 0) for n in checked.quantities if n not in _ROOTS)
        native = of.native(self.exact)
        yield from ((("dimensionless", n), native[n], 0) for n in checked.dimensionless)
        for name, values, digits in readings(of, self.exact, nominal, abscissa, worst, pi):
            several = isinstance(values, tuple)
            yield from ((("si", name, k), ball, digits) for k, ball in enumerate(values if several else [values]))
            if several:
                yield ("si", name, "count"), exact(len(values)), 0
        objective = self.problem.objective
        if objective is not None and set(objective.names) & {*_ROOTS} <= set(known):
            differs = depends_on_case(self.problem, objective, self.cases)
            cases = self.cases if differs else [Case()]
            each = [objective.of(self.values(case).with_known(known), BALLS) for case in cases]
            yield ("value",), reduce(lesser if self.problem.sense == "maximize" else greater, each), 0

    def roots(self, last: bool) -> tuple[_Several, dict[Case, _Several]] | None:
        """The roots as stored in the worst case, and in each case those of the nearest polynomial of its structure.

        None where they are not decided, the `last` time what the recheck found.
        """
        stored = enclosed_roots(self.values(self.checked.worst).coefficients)
        ideal: dict[Case, _Several] = {}
        for case, structure in self.structures.items():
            found = self.ideal(case, structure, stored)
            if (found is None or stored is None) and not last:
                return None
            as_found = (Enclosed(flint.arb(r.re), flint.arb(r.im), r.multiplicity) for r in structure.roots)
            ideal[case] = tuple(as_found) if found is None else found
        return stored or (), ideal

    def ideal(self, case: Case, found: Structure, stored: _Several | None) -> _Several | None:
        """Roots in a case of the nearest polynomial that has the structure; none for a root at infinity."""
        coefficients = self.values(case).coefficients
        if found.roots and found.name in SIMPLE and all(root.multiplicity == 1 for root in found.roots):
            return (stored if case == self.checked.worst else None) or enclosed_roots(coefficients)
        return nearest_roots(coefficients, found.roots) if found.roots else ()

    def values(self, case: Case) -> Values:
        """Everything derived from the exact parameters in a case, root quantities excluded."""
        varied = Case(Table(_exact(case.at)), Table(_exact(case.offset))).applied(self.exact)
        return Values(self.problem.model, self.problem.parameter_set, varied)


_ROOTS = ("abscissa", "damping_ratio", ANGULAR_FREQUENCY, RADIUS)


def _exact(table: Numbers) -> dict[str, Any]:
    return {name: exact(value) for name, value in table.items()}


def _rightmost(roots: _Several) -> Any:
    return reduce(greater, (root.re for root in roots))


def _ratio(root: Enclosed) -> Any:
    """−Re s/|s|; 0 for a root at 0."""
    return flint.arb(0) if root.re == 0 and root.im == 0 else -root.re / root.modulus


def _shown(model: Model, roots: _Several) -> _Several:
    """The roots as the user reads them; an eigenfrequency that is the carrier's own to 60 digits is 0."""
    found: _Several = user_roots(model, roots)
    if model.carrier is None:
        return found
    nothing = flint.arb(2) ** -_PRECISIONS[0] * (1 + abs(model.carrier))
    return tuple(replace(z, im=flint.arb(0)) if z.im.contains(0) and abs(z.im) < nothing else z for z in found)


def _assembled(model: Model, checked: Evaluation, numbers: Mapping[_Key, float]) -> Certified:
    count = len([key for key in numbers if key[0] == "roots" and key[2] == "multiplicity"])
    parts = [[numbers.get(("roots", k, part), math.nan) for part in ("re", "im", "multiplicity")] for k in range(count)]
    roots = [Root(re, im, int(m)) for re, im, m in parts] if not np.isnan(parts).any() else []
    si: dict[str, Reading] = {}
    for name in dict.fromkeys(key[1] for key in numbers if key[0] == "si"):
        length = numbers.get(("si", name, "count"))
        each = tuple(numbers.get(("si", name, k), math.nan) for k in range(1 if length is None else int(length)))
        si[name] = each[0] if length is None else each
    return Certified(
        value=numbers["value",],
        abscissa=numbers["abscissa",],
        realised=numbers["realised",],
        roots=tuple(roots) or user_roots(model, checked.structure.roots),
        quantities=Table({n: numbers["quantities", n] for n in checked.quantities}),
        dimensionless=Table({n: numbers["dimensionless", n] for n in checked.dimensionless}),
        si=Table(si),
    )
