"""Evaluates many designs of a problem without free parameters at once, in arrays of doubles with error bounds.

The results equal the results of `recheck` and `certified_numbers`. These two evaluate the doubtful designs: with a
nearly multiple root, with a limit missed by little more than the tolerance, or with an undefined coefficient.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tmsopt.algebra.formula import UnsupportedOperation
from tmsopt.algebra.rounding import Bounded, as_bounded
from tmsopt.evaluation.bound import PROVEN, ROUNDING, is_rational, minimizes_abscissa
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
"""Designs per block, so that their numbers stay in the cache. Results do not depend on the size of a block."""

KNOWN = 5e-10
"""Relative error above which the recheck must evaluate a design, so that numbers agree to 1e-9."""

_UNIT_ROUNDING = 2.0**-53  # relative rounding error of a parameter
_DOUBT_RATIO = 2.0  # if a limit is missed by at most this many tolerances, the recheck must evaluate the design


@dataclass(frozen=True)
class Columns:
    """Results as columns with one value per design.

    Attributes:
        certain: whether the other values are valid for this design.
        objective, abscissa, damping_ratio: as in `Solution`; the abscissa as stored is the same as the abscissa.
        oscillates: whether the structure is ``pair``; otherwise it is ``real``.
        violations: name of a constraint → amount of the violation; nan if the constraint is satisfied.
        bound, gap: the lower bound and the gap of feasible designs; no gap is closed.
        by_relation: whether the bound comes from relations of the coefficients.
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


def can_evaluate_columns(problem: Posed) -> bool:
    """Whether `evaluate_columns` handles a problem.

    The problem may not have free parameters, cases, a pattern or a complex model. It may not use the robustness radius
    or the angular frequency.
    """
    excluded = problem.free or problem.scenarios or problem.tolerances or problem.model.carrier is not None
    return not (excluded or problem.pattern or problem.asks(RADIUS) or problem.asks(ANGULAR_FREQUENCY))


def evaluate_columns(problem: Posed, columns: Mapping[str, Array], reports: Sequence[str] = ()) -> Columns | None:
    """Evaluate designs that differ from a problem's in some fixed parameters; None if a formula takes no arrays.

    Args:
        columns: parameter → its values, one per design, at least one.
        reports: further expressions to evaluate.
    """
    try:
        with np.errstate(all="ignore"):
            return _evaluate_columns(problem, columns, reports)
    except UnsupportedOperation:  # a formula that takes no error bounds
        return None


def _evaluate_columns(problem: Posed, columns: Mapping[str, Array], reports: Sequence[str]) -> Columns:
    # comparisons of NumPy numbers give arrays
    fixed_numbers = {n: np.float64(x) for n, x in problem.ordered({}).items()}
    parameters = fixed_numbers | dict(columns)
    m = len(next(iter(columns.values())))
    bounded = {n: Bounded(x, np.abs(x) * _UNIT_ROUNDING) for n, x in parameters.items()}
    coefficients = [_broadcast(c, m) for c in coefficients_of(problem, bounded)]
    motions = enclose_motions(coefficients, STRUCTURE_TOLERANCE)
    certain = motions.simple & _is_possible(problem, parameters)

    def round_or_doubt(number: Any) -> Array:
        nonlocal certain
        spread = _broadcast(number, m)
        certain = certain & (spread.is_known_within(KNOWN) | ((spread.value == 0) & (spread.error == 0)))
        return np.asarray(spread.value)

    bounded |= {"abscissa": motions.abscissa, "damping_ratio": motions.damping_ratio}
    objective = (
        round_or_doubt(*evaluate(problem, [problem.objective], bounded)) if problem.objective else np.full(m, np.nan)
    )
    doubles = {name: round_or_doubt(bounded[name]) for name in ("abscissa", "damping_ratio")}
    plain = parameters | doubles | {ANGULAR_FREQUENCY: motions.frequency}
    violations, doubt = _find_violations(problem, plain, motions)
    certain &= ~doubt & (np.abs(doubles["abscissa"]) > motions.scatter)
    feasible = np.all(np.isnan([np.full(m, np.nan), *violations.values()]), axis=0)
    bound, related = _find_bounds(problem, coefficients, round_or_doubt)
    bound = np.where(feasible, bound, -np.inf)
    certain &= ~(np.isfinite(bound) & (objective - bound <= _DOUBT_RATIO * PROVEN * (1.0 + np.abs(bound))))
    residuals = (
        _compute_law_residuals(problem, bounded, coefficients, feasible, round_or_doubt) if problem.model is tms else {}
    )
    return Columns(
        certain,
        objective,
        doubles["abscissa"],
        doubles["damping_ratio"],
        motions.oscillates,
        violations,
        bound,
        np.where(np.isfinite(bound), np.maximum(objective - bound, 0.0), np.inf),
        related,
        residuals,
        {text: _broadcast(x, m).value for text, x in zip(reports, evaluate(problem, reports, plain), strict=True)},
    )


def _broadcast(number: Any, m: int) -> Bounded:
    """A number as a column with one value per design."""
    bounded = as_bounded(number)
    return Bounded(*(np.ascontiguousarray(np.broadcast_to(x, m), dtype=float) for x in (bounded.value, bounded.error)))


def _is_possible(problem: Posed, parameters: Mapping[str, Any]) -> Truth:
    """Whether each design is valid: its parameters are in their ranges, and no angle is 0, as bounds require."""
    parameter_set, possible = problem.parameter_set, np.True_
    for p in parameter_set.parameters:
        x, allowed_range = parameters[p.name], p.range
        above_lower, below_upper = (
            (x >= allowed_range.lower, x <= allowed_range.upper)
            if allowed_range.closed
            else (x > allowed_range.lower, x < allowed_range.upper)
        )
        size = np.abs(x)
        possible = possible & above_lower & below_upper & (((size >= SMALLEST) & (size <= 1 / SMALLEST)) | (x == 0))
        possible = possible & ~(p.tangent & (x == 0))
    for name, (needed_name, _) in parameter_set.needs.items():
        possible = possible & ((parameters[name] == 0) | (parameters[needed_name] > 0))
    return np.asarray(possible)


def _find_violations(problem: Posed, parameters: Mapping[str, Any], motions: Motions) -> tuple[dict[str, Array], Truth]:
    """The violation of each constraint, and which designs are too close to a limit for this evaluation."""
    m = len(motions.simple)
    amounts, doubt = {}, np.zeros(m, dtype=bool)
    names = list(dict.fromkeys(n for c in problem.conditions.values() for n in c.names))
    values = dict(zip(names, evaluate(problem, names, parameters), strict=True))
    for name, condition in problem.conditions.items():
        left, right = (_broadcast(side, m).value for side in condition.sides(values))
        difference = left - right
        excess, size = condition.excess(difference), np.maximum(1.0, np.maximum(np.abs(left), np.abs(right)))
        relative = excess / size
        doubt |= ~np.isfinite(difference) | ((relative > 0) & (relative <= _DOUBT_RATIO * FEASIBLE))
        if set(condition.names) & set(ROOT_NAMES):  # the recheck uses numeric roots
            doubt |= np.abs(difference) <= (_DOUBT_RATIO * FEASIBLE + motions.scatter) * size
        amounts[name] = np.where(relative > FEASIBLE, excess, np.nan)
    return amounts, doubt


def _find_bounds(
    problem: Posed, coefficients: Sequence[Bounded], round_or_doubt: Callable[[Any], Array]
) -> tuple[Array, Truth]:
    """The `instant_bound` of each design, and whether it comes from relations.

    Fixed coefficients satisfy relations in pairs: aⱼ with a0, where aⱼ/a0 = C(n, j) zʲ gives the bound, and aⱼ with aₙ.

    Args:
        round_or_doubt: rounds numbers to doubles, and marks the designs for which the rounding is uncertain.
    """
    model, parameter_set, n = problem.model, problem.parameter_set, problem.model.degree
    product_bound = np.full(len(coefficients[0].value), -np.inf)
    if minimizes_abscissa(problem):
        product_bound = -(round_or_doubt(abs(coefficients[-1] / coefficients[0])) ** (1 / n)) * (1 + ROUNDING)
    if (
        not minimizes_abscissa(problem)
        or any(p.tangent for p in parameter_set.parameters)
        or not is_rational(model, parameter_set)
    ):
        return product_bound, np.zeros(len(product_bound), dtype=bool)
    least = np.full(len(product_bound), np.inf)
    for j in range(n + 1):
        up, down = coefficients[j] / coefficients[0] / math.comb(n, j), coefficients[n] / coefficients[j]
        for power, ratio, linear in ((j, up, j == 1), (n - j, down * math.comb(n, j), n == 1)):
            if power:
                root = ratio.root(power)
                zero = round_or_doubt(root) + root.error
                least = np.minimum(least, zero if linear else np.maximum(zero, 0.0))  # 0 is a zero of a derivative
    linear_bound = np.nextafter(-least, -np.inf)
    return np.maximum(linear_bound, product_bound), linear_bound > product_bound


def _compute_law_residuals(
    problem: Posed,
    bounded: Mapping[str, Any],
    coefficients: Sequence[Bounded],
    feasible: Truth,
    round_or_doubt: Callable[[Any], Array],
) -> dict[str, Array]:
    """Relative residuals of the laws that apply to a feasible design without a multiple root; see `law_rows`."""
    m = len(feasible)
    names = problem.model.sets[0].names
    *native, number = (_broadcast(x, m) for x in evaluate(problem, [*names, "Fr_c"], bounded))
    p = {n: round_or_doubt(x) for n, x in zip(names, native, strict=True)}
    exists = np.isfinite(number.value)
    critical = np.where(exists, round_or_doubt(number.where(exists, Bounded(np.ones(m), np.zeros(m)))), np.nan)
    residuals = {}
    for label, (numeric, law, applies) in speed_laws(
        p, critical, np.stack([*map(round_or_doubt, coefficients)], -1)
    ).items():
        residual = (numeric - law) / np.where(law == 0, 1.0, np.abs(law))
        round_or_doubt(np.where(feasible & applies, residual, 0.0))  # a law without a value
        residuals[label] = np.where(feasible & applies, residual, np.nan)
    return residuals
