"""Many designs of one problem at once, in which nothing is free: what `recheck` and `certified` say of each, by arrays.

Double precision with bounds of its error. What these leave in doubt is left to them: a nearly multiple root, a limit
missed by no more than tolerance, a coefficient that does not exist.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tmsopt.algebra.formula import UnsupportedOperation
from tmsopt.algebra.rounding import Bounded, as_bounded
from tmsopt.evaluation.bound import PROVEN, ROUNDING, bounded, is_rational
from tmsopt.evaluation.law_rows import speed_laws
from tmsopt.evaluation.recheck import FEASIBLE
from tmsopt.models import tms
from tmsopt.problem.evaluate import coefficients_of, evaluate
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, RADIUS, ROOT_NAMES, STRUCTURE_TOLERANCE
from tmsopt.problem.validate import SMALLEST
from tmsopt.records import Array, Truth
from tmsopt.roots.discs import Motions, enclose_motions

BLOCK = 8192
"""Designs at once: their numbers stay in the cache. No bit of an answer depends on it."""

KNOWN = 5e-10
"""Share of its size within which a number is known, or its design is left to the recheck: numbers are equal to 1e-9."""

_UNIT = 2.0**-53  # relative rounding of a parameter
_DOUBT = 2.0  # tolerances within which a limit is left to the recheck


@dataclass(frozen=True)
class Verdicts:
    """Designs as columns, one value for each.

    Attributes:
        certain: whether the other values are known; of the others they mean nothing.
        objective, abscissa, damping_ratio: as in `Solution`; the abscissa is also that of the parameters as stored.
        oscillates: whether the structure is ``pair``; else it is ``real``.
        violations: name of a constraint → by how much it is violated, nan where it is not.
        bound, gap: of the feasible ones; no gap is closed.
        by_relation: whether the bound is one by relations of the coefficients.
        laws: label → relative residual, nan where the law does not apply.
        reports: expression → its value.
    """

    certain: Truth
    objective: Array
    abscissa: Array
    damping_ratio: Array
    oscillates: Truth
    violations: Mapping[str, Array]
    bound: Array
    gap: Array
    by_relation: Truth
    laws: Mapping[str, Array]
    reports: Mapping[str, Array]


def judgeable(problem: Posed) -> bool:
    """Whether designs of a problem may be judged at once: nothing is free, listed, located or searched for, and roots
    are told as they are."""
    listed = problem.free or problem.scenarios or problem.tolerances or problem.model.carrier is not None
    return not (listed or problem.pattern or problem.asks(RADIUS) or problem.asks(ANGULAR_FREQUENCY))


def verdicts(problem: Posed, columns: Mapping[str, Array], reports: Sequence[str] = ()) -> Verdicts | None:
    """The designs that differ from a problem's in some of its fixed parameters; None where formulas take no arrays.

    Args:
        columns: parameter → its value in every design, at least one.
        reports: expressions.
    """
    try:
        with np.errstate(all="ignore"):
            return _judged(problem, columns, reports)
    except UnsupportedOperation:  # of a formula that does not take bounds of errors
        return None


def _judged(problem: Posed, columns: Mapping[str, Array], reports: Sequence[str]) -> Verdicts:
    fixed = {n: np.float64(x) for n, x in problem.ordered({}).items()}  # whose comparisons are arrays' too
    given = fixed | dict(columns)
    m = len(next(iter(columns.values())))
    wide = {n: Bounded(x, np.abs(x) * _UNIT) for n, x in given.items()}
    coefficients = [_spread(c, m) for c in coefficients_of(problem, wide)]
    found = enclose_motions(coefficients, STRUCTURE_TOLERANCE)
    certain = found.simple & _possible(problem, given)

    def settled(number: Any) -> Array:
        nonlocal certain
        spread = _spread(number, m)
        certain = certain & (spread.is_known_within(KNOWN) | ((spread.value == 0) & (spread.error == 0)))
        return np.asarray(spread.value)

    wide |= {"abscissa": found.abscissa, "damping_ratio": found.damping_ratio}
    objective = settled(*evaluate(problem, [problem.objective], wide)) if problem.objective else np.full(m, np.nan)
    doubles = {name: settled(wide[name]) for name in ("abscissa", "damping_ratio")}
    plain = given | doubles | {ANGULAR_FREQUENCY: found.frequency}
    violations, doubt = _violations(problem, plain, found)
    certain &= ~doubt & (np.abs(doubles["abscissa"]) > found.scatter)
    feasible = np.all(np.isnan([np.full(m, np.nan), *violations.values()]), axis=0)
    bound, related = _bounds(problem, coefficients, settled)
    bound = np.where(feasible, bound, -np.inf)
    certain &= ~(np.isfinite(bound) & (objective - bound <= _DOUBT * PROVEN * (1.0 + np.abs(bound))))
    said = _laws(problem, wide, coefficients, feasible, settled) if problem.model is tms else {}
    return Verdicts(
        certain,
        objective,
        doubles["abscissa"],
        doubles["damping_ratio"],
        found.oscillates,
        violations,
        bound,
        np.where(np.isfinite(bound), np.maximum(objective - bound, 0.0), np.inf),
        related,
        said,
        {text: _spread(x, m).value for text, x in zip(reports, evaluate(problem, reports, plain), strict=True)},
    )


def _spread(number: Any, m: int) -> Bounded:
    """One number of each design."""
    wide = as_bounded(number)
    return Bounded(*(np.ascontiguousarray(np.broadcast_to(x, m), dtype=float) for x in (wide.value, wide.error)))


def _possible(problem: Posed, given: Mapping[str, Any]) -> Truth:
    """Whether a design may be posed: parameters within their ranges, no angle 0, which rational bounds ask for."""
    of, possible = problem.parameter_set, np.True_
    for p in of.parameters:
        x, inside = given[p.name], p.range
        low, high = (x >= inside.lower, x <= inside.upper) if inside.closed else (x > inside.lower, x < inside.upper)
        size = np.abs(x)
        possible = possible & low & high & (((size >= SMALLEST) & (size <= 1 / SMALLEST)) | (x == 0))
        possible = possible & ~(p.tangent & (x == 0))
    for name, (other, _) in of.needs.items():
        possible = possible & ((given[name] == 0) | (given[other] > 0))
    return np.asarray(possible)


def _violations(problem: Posed, given: Mapping[str, Any], found: Motions) -> tuple[dict[str, Array], Truth]:
    """By how much each constraint is violated, and which designs are too close to a limit to be told here."""
    m = len(found.simple)
    amounts, doubt = {}, np.zeros(m, dtype=bool)
    names = list(dict.fromkeys(n for c in problem.conditions.values() for n in c.names))
    values = dict(zip(names, evaluate(problem, names, given), strict=True))
    for name, condition in problem.conditions.items():
        left, right = (_spread(side, m).value for side in condition.sides(values))
        difference = left - right
        excess, size = condition.excess(difference), np.maximum(1.0, np.maximum(np.abs(left), np.abs(right)))
        relative = excess / size
        doubt |= ~np.isfinite(difference) | ((relative > 0) & (relative <= _DOUBT * FEASIBLE))
        if set(condition.names) & set(ROOT_NAMES):  # of numeric roots in the recheck
            doubt |= np.abs(difference) <= (_DOUBT * FEASIBLE + found.scatter) * size
        amounts[name] = np.where(relative > FEASIBLE, excess, np.nan)
    return amounts, doubt


def _bounds(problem: Posed, coefficients: Sequence[Bounded], settled: Callable[[Any], Array]) -> tuple[Array, Truth]:
    """The bound of `instant_bound` on the abscissa of each design, if any, and where it is one by relations.

    Coefficients that do not vary have relations of two: with a0, where aⱼ/a0 = C(n, j) zʲ gives the bound, and with aₙ.

    Args:
        settled: rounds numbers to doubles, and notes where that is not certain.
    """
    model, of, n = problem.model, problem.parameter_set, problem.model.degree
    known = np.full(len(coefficients[0].value), -np.inf)
    if bounded(problem):
        known = -(settled(abs(coefficients[-1] / coefficients[0])) ** (1 / n)) * (1 + ROUNDING)
    if not bounded(problem) or any(p.tangent for p in of.parameters) or not is_rational(model, of):
        return known, np.zeros(len(known), dtype=bool)
    least = np.full(len(known), np.inf)
    for j in range(n + 1):
        up, down = coefficients[j] / coefficients[0] / math.comb(n, j), coefficients[n] / coefficients[j]
        for power, ratio, linear in ((j, up, j == 1), (n - j, down * math.comb(n, j), n == 1)):
            if power:
                root = ratio.root(power)
                zero = settled(root) + root.error
                least = np.minimum(least, zero if linear else np.maximum(zero, 0.0))  # 0 is one of a derivative
    other = np.nextafter(-least, -np.inf)
    return np.maximum(other, known), other > known


def _laws(
    problem: Posed,
    wide: Mapping[str, Any],
    coefficients: Sequence[Bounded],
    feasible: Truth,
    settled: Callable[[Any], Array],
) -> dict[str, Array]:
    """Relative residual of the laws that apply to a feasible design without a multiple root; see `law_rows`."""
    m = len(feasible)
    names = problem.model.sets[0].names
    *native, number = (_spread(x, m) for x in evaluate(problem, [*names, "Fr_c"], wide))
    p = {n: settled(x) for n, x in zip(names, native, strict=True)}
    exists = np.isfinite(number.value)
    critical = np.where(exists, settled(number.where(exists, Bounded(np.ones(m), np.zeros(m)))), np.nan)
    found = {}
    for label, (numeric, law, applies) in speed_laws(p, critical, np.stack([*map(settled, coefficients)], -1)).items():
        residual = (numeric - law) / np.where(law == 0, 1.0, np.abs(law))
        settled(np.where(feasible & applies, residual, 0.0))  # a law without a value
        found[label] = np.where(feasible & applies, residual, np.nan)
    return found
