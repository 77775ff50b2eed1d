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
from tmsopt.records import Table
from tmsopt.roots import Root, Structure
from tmsopt.roots.patterns.enclosed import Enclosed, enclosed_roots, nearest_decimal, nearest_double, nearest_roots

_PRECISIONS = (212, 424, 848, 1696)
"""Bits carried, one after the other until they suffice; the first are 60 digits, half of which a fit may lose."""

_Key = tuple[str, ...]


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
    problem: Posed, parameters: Mapping[str, float], checked: Evaluation, cases: Sequence[Case] = ()
) -> Certified:
    """The numbers of a design, correctly rounded.

    Which cases are the worst and which structure the roots have is taken from the recheck. A number that the balls
    cannot settle, such as one that only happens to be 0, stays what the recheck found.

    Args:
        cases: those that the design was checked in; an objective that differs between them is the worst of all.
    """
    listed = [case for case in cases if not case.direction]
    least, fastest = (_structure(problem, parameters, checked, c) for c in (checked.least_damped, checked.fastest))
    design = _Design(problem, parameters, checked, listed, least, fastest)
    known = _known(checked)
    numbers: dict[_Key, float] = {}
    for precision in _PRECISIONS:
        last = precision == _PRECISIONS[-1]
        with flint.ctx.workprec(precision):
            roots = design.roots(last)
            balls = {} if roots is None else {k: b for k, *b in design.balls(roots) if k not in numbers}
            for key, (ball, digits) in balls.items():
                number = nearest_decimal(ball, digits) if digits else nearest_double(ball)
                expected = last or math.isnan(known.get(key, math.nan))
                if number is not None and (expected or not math.isnan(number)):
                    numbers[key] = number
        if roots is not None and all(key in numbers for key in balls):
            break
    # At the very end of where a quantity exists, as Fr_c = 0, rounding of the parameters alone may carry it beyond.
    lost = {key for key, number in numbers.items() if math.isnan(number) and math.isfinite(known.get(key, math.nan))}
    return _assembled(problem.model, checked, {**known, **{key: x for key, x in numbers.items() if key not in lost}})


def _known(checked: Evaluation) -> dict[_Key, float]:
    """What the recheck found in double precision."""
    found: dict[_Key, float] = {("value",): checked.objective, ("realised",): checked.realised}
    found["abscissa",] = checked.structure.abscissa
    found |= {("quantities", n): v for n, v in checked.quantities.items()}
    return found | {("dimensionless", n): v for n, v in checked.dimensionless.items()}


def _structure(problem: Posed, parameters: Mapping[str, float], checked: Evaluation, case: Case) -> Structure:
    """Structure of the roots in a case."""
    if case == checked.worst:
        return checked.structure
    found = problem.values(case.applied(parameters))["structure"]
    assert isinstance(found, Structure)
    return found


_Several = tuple[Enclosed, ...]


@dataclass(frozen=True)
class _Roots:
    """Roots of a design.

    Attributes:
        stored: of the parameters as stored, in the case with the largest abscissa.
        ideal: there, of the nearest polynomial that has the structure.
        damped: likewise in the case with the least damping ratio.
        fastest: likewise in the case with the greatest angular frequency.
    """

    stored: _Several
    ideal: _Several
    damped: _Several
    fastest: _Several


@dataclass(frozen=True)
class _Design:
    """A design with all that its numbers depend on."""

    problem: Posed
    parameters: Mapping[str, float]
    checked: Evaluation
    cases: Sequence[Case]
    least: Structure
    fastest: Structure

    def balls(self, roots: "_Roots") -> Iterator[tuple[_Key, Any, int]]:
        """Every number as a ball at the working precision, with the decimal digits to round it to, 0 for a double."""
        checked = self.checked
        nominal = self.values(Case())
        known = {}
        if checked.around and math.isfinite(checked.around.radius):
            known[RADIUS] = exact(checked.around.radius)
        if roots.stored:
            yield ("realised",), _rightmost(roots.stored), 0
        if roots.ideal:
            known["abscissa"] = _rightmost(roots.ideal)
            yield ("abscissa",), known["abscissa"], 0
            for k, root in enumerate(_told(self.problem.model, roots.ideal)):
                for part, ball in (("re", root.re), ("im", root.im), ("multiplicity", exact(root.multiplicity))):
                    yield ("roots", str(k), part), ball, 0
        if roots.damped and self.problem.model.carrier is None:
            known["damping_ratio"] = reduce(lesser, (_ratio(r) for r in roots.damped))
            yield ("quantities", "damping_ratio"), known["damping_ratio"], 0
        asked = ANGULAR_FREQUENCY in checked.quantities
        if asked and roots.fastest:
            known[ANGULAR_FREQUENCY] = reduce(greater, (root.im for root in roots.fastest))
            yield ("quantities", ANGULAR_FREQUENCY), known[ANGULAR_FREQUENCY], 0
        of, own = self.problem.parameter_set, _exact(self.parameters)
        if of.rate is not None:
            fastest = roots.fastest if asked else roots.ideal
            rates = frequencies(fastest, of.rate(own), flint.arb.pi())
            nominal = nominal.with_known({"frequency": reduce(greater, rates, flint.arb(0))})
        nominal = nominal.with_known({"abscissa": known.get("abscissa", math.nan)})
        for name in checked.quantities:
            if name not in _ROOTS:
                yield ("quantities", name), nominal[name], 0
        native = of.native(own)
        for name in checked.dimensionless:
            yield ("dimensionless", name), native[name], 0
        yield from self.si(nominal, known.get("abscissa", math.nan), roots.ideal)
        objective = self.objective(known)
        if objective is not None:
            yield ("value",), objective, 0

    def si(self, nominal: Values, abscissa: Any, roots: _Several) -> Iterator[tuple[_Key, Any, int]]:
        """The readings; of several frequencies also how many there are."""
        of = self.problem.parameter_set
        for name, values, digits in readings(of, _exact(self.parameters), nominal, abscissa, roots, flint.arb.pi()):
            for k, ball in enumerate(values if isinstance(values, tuple) else [values]):
                yield ("si", name, str(k)), ball, digits
            if isinstance(values, tuple):
                yield ("si", name, "count"), exact(len(values)), 0

    def roots(self, last: bool) -> "_Roots | None":
        """The roots that the numbers rest on; None where they are not decided, the `last` time what was found."""
        checked = self.checked
        stored = enclosed_roots(self.values(checked.worst).coefficients)
        ideal = self.ideal(checked.worst, checked.structure, stored)
        damped, fastest = (
            ideal if case == checked.worst else self.ideal(case, structure, None)
            for case, structure in ((checked.least_damped, self.least), (checked.fastest, self.fastest))
        )
        if None not in (stored, ideal, damped, fastest) or last:
            each = (ideal, checked.structure), (damped, self.least), (fastest, self.fastest)
            found = [_as_found(s) if r is None else r for r, s in each]
            return _Roots(stored or (), *found)
        return None

    def ideal(self, case: Case, found: Structure, stored: _Several | None) -> _Several | None:
        """Roots in a case of the nearest polynomial that has the structure; none for a root at infinity."""
        if not found.roots:
            return ()
        coefficients = self.values(case).coefficients
        if found.name in SIMPLE and all(root.multiplicity == 1 for root in found.roots):
            return stored or enclosed_roots(coefficients)
        return nearest_roots(coefficients, found.roots)

    def values(self, case: Case) -> Values:
        """Everything derived from the exact parameters in a case, root quantities excluded."""
        varied = Case(Table(_exact(case.at)), Table(_exact(case.offset))).applied(_exact(self.parameters))
        return Values(self.problem.model, self.problem.parameter_set, varied)

    def objective(self, known: Mapping[str, Any]) -> Any:
        """Ball of the objective, the worst over the cases where it differs between them; None without one."""
        objective = self.problem.objective
        if objective is None or not set(objective.names) & {*_ROOTS} <= set(known):
            return None
        each = self.cases if depends_on_case(self.problem, objective, self.cases) else [Case()]
        found = []
        for case in each:
            found.append(objective.of(self.values(case).with_known(known), BALLS))
        return reduce(lesser if self.problem.sense == "maximize" else greater, found)


_ROOTS = ("abscissa", "damping_ratio", ANGULAR_FREQUENCY, RADIUS)


def _exact(table: Mapping[str, float]) -> dict[str, Any]:
    return {name: exact(value) for name, value in table.items()}


def _as_found(found: Structure) -> _Several:
    return tuple(Enclosed(flint.arb(r.re), flint.arb(r.im), r.multiplicity) for r in found.roots)


def _rightmost(roots: _Several) -> Any:
    return reduce(greater, (root.re for root in roots))


def _ratio(root: Enclosed) -> Any:
    """−Re s/|s|; 0 for a root at 0."""
    return flint.arb(0) if root.re == 0 and root.im == 0 else -root.re / root.modulus


def _told(model: Model, roots: _Several) -> _Several:
    """The roots as the user reads them; an eigenfrequency that is the carrier's own to 60 digits is 0."""
    found: _Several = user_roots(model, roots)
    if model.carrier is None:
        return found
    nothing = flint.arb(2) ** -_PRECISIONS[0] * (1 + abs(model.carrier))
    return tuple(replace(z, im=flint.arb(0)) if z.im.contains(0) and abs(z.im) < nothing else z for z in found)


def _assembled(model: Model, checked: Evaluation, numbers: Mapping[_Key, float]) -> Certified:
    count = sum(key[0] == "roots" and key[2] == "multiplicity" for key in numbers)
    parts = [[numbers.get(("roots", str(k), part)) for part in ("re", "im", "multiplicity")] for k in range(count)]
    roots = tuple(Root(re, im, int(m)) for re, im, m in parts if re is not None and im is not None and m is not None)
    si: dict[str, Reading] = {}
    for key in numbers:
        if key[0] == "si":
            name = key[1]
            length = numbers.get(("si", name, "count"))
            each = [numbers.get(("si", name, str(k)), math.nan) for k in range(1 if length is None else int(length))]
            si[name] = each[0] if length is None else tuple(each)
    return Certified(
        value=numbers["value",],
        abscissa=numbers["abscissa",],
        realised=numbers["realised",],
        roots=roots if roots and len(roots) == count else user_roots(model, checked.structure.roots),
        quantities=Table({n: numbers["quantities", n] for n in checked.quantities}),
        dimensionless=Table({n: numbers["dimensionless", n] for n in checked.dimensionless}),
        si=Table(si),
    )
