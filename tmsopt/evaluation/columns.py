"""Evaluates many designs of a problem without free parameters at once, in arrays of doubles with error bounds.

The results equal the results of `recheck` and `certified_numbers`. These two must evaluate the doubtful designs: with a
nearly multiple root, with a limit violated by little more than the tolerance, or with an undefined coefficient.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tmsopt.algebra.formula import UnsupportedOperation
from tmsopt.algebra.rounding import Bounded, as_bounded
from tmsopt.evaluation.bound import PROOF_TOLERANCE, ROUNDING, is_rational, minimizes_abscissa
from tmsopt.evaluation.law_rows import speed_laws
from tmsopt.evaluation.recheck import FEASIBILITY_TOLERANCE
from tmsopt.models import tms
from tmsopt.problem.evaluate import coefficients_of, evaluate
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, RADIUS, ROOT_NAMES, STRUCTURE_TOLERANCE
from tmsopt.problem.validate import MIN_SIZE
from tmsopt.records import Array, Truth
from tmsopt.roots.discs import Motions, enclose_motions

DESIGNS_PER_BLOCK = 8192
"""Number of designs in a block, so that their numbers stay in the cache. Results do not depend on this number."""

_MAX_RELATIVE_ERROR = 5e-10
"""Relative error above which the recheck must evaluate a design, so that numbers agree to 1e-9."""

_UNIT_ROUNDING = 2.0**-53  # relative rounding error of a parameter
_DOUBT_RATIO = 2.0  # if a limit is violated by at most this many tolerances, the recheck must evaluate the design


@dataclass(frozen=True)
class Columns:
    """Results as columns with one value per design.

    Attributes:
        is_certain: whether the other values are valid for this design.
        objective, abscissa, damping_ratio: as in `Solution`; the abscissa as stored is equal to the abscissa.
        oscillates: whether the structure is ``pair``; otherwise it is ``real``.
        violations: name of a constraint → amount of the violation; nan if the constraint is satisfied.
        bound, gap: the lower bound and the gap of feasible designs; no gap is closed.
        by_relation: whether the bound comes from relations of the coefficients.
        laws: label → relative residual, nan where the law does not apply.
        reports: expression → its value.
    """

    is_certain: Truth
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
    excluded = problem.free or problem.scenarios or problem.tolerances or problem.model.is_complex
    return not (excluded or problem.pattern or problem.asks(RADIUS) or problem.asks(ANGULAR_FREQUENCY))


def evaluate_columns(problem: Posed, columns: Mapping[str, Array], reports: Sequence[str] = ()) -> Columns | None:
    """Evaluate designs that differ from the design of a problem in some parameters; None if a formula takes no arrays.

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
    # NumPy numbers, because their comparisons give arrays
    parameters = {n: np.float64(x) for n, x in problem.ordered({}).items()} | dict(columns)
    m = len(next(iter(columns.values())))
    bounded = {n: Bounded(x, np.abs(x) * _UNIT_ROUNDING) for n, x in parameters.items()}
    coefficients = [_broadcast(c, m) for c in coefficients_of(problem, bounded)]
    motions = enclose_motions(coefficients, STRUCTURE_TOLERANCE)
    is_certain = motions.are_simple & _is_possible(problem, parameters)

    def round_and_mark(number: Any) -> Array:
        nonlocal is_certain
        column = _broadcast(number, m)
        is_exact_zero = (column.value == 0) & (column.error == 0)
        is_certain = is_certain & (column.is_known_within(_MAX_RELATIVE_ERROR) | is_exact_zero)
        return np.asarray(column.value)

    bounded |= {"abscissa": motions.abscissa, "damping_ratio": motions.damping_ratio}
    objective = (
        round_and_mark(*evaluate(problem, [problem.objective], bounded)) if problem.objective else np.full(m, np.nan)
    )
    doubles = {name: round_and_mark(bounded[name]) for name in ("abscissa", "damping_ratio")}
    numbers = parameters | doubles | {ANGULAR_FREQUENCY: motions.frequency}
    violations, is_doubtful = _find_violations(problem, numbers, motions)
    is_certain &= ~is_doubtful & (np.abs(doubles["abscissa"]) > motions.scatter)
    is_feasible = np.all(np.isnan([np.full(m, np.nan), *violations.values()]), axis=0)
    bound, by_relation = _find_bounds(problem, coefficients, round_and_mark)
    bound = np.where(is_feasible, bound, -np.inf)
    is_certain &= ~(np.isfinite(bound) & (objective - bound <= _DOUBT_RATIO * PROOF_TOLERANCE * (1.0 + np.abs(bound))))
    residuals = (
        _compute_law_residuals(problem, bounded, coefficients, is_feasible, round_and_mark)
        if problem.model is tms
        else {}
    )
    return Columns(
        is_certain,
        objective,
        doubles["abscissa"],
        doubles["damping_ratio"],
        motions.oscillates,
        violations,
        bound,
        np.where(np.isfinite(bound), np.maximum(objective - bound, 0.0), np.inf),
        by_relation,
        residuals,
        {text: _broadcast(x, m).value for text, x in zip(reports, evaluate(problem, reports, numbers), strict=True)},
    )


def _broadcast(number: Any, m: int) -> Bounded:
    """A number as a column with one value per design."""
    bounded = as_bounded(number)
    return Bounded(*(np.ascontiguousarray(np.broadcast_to(x, m), dtype=float) for x in (bounded.value, bounded.error)))


def _is_possible(problem: Posed, parameters: Mapping[str, Any]) -> Truth:
    """Whether each design is valid: its parameters are in their ranges, and no angle is 0, as bounds require."""
    parameter_set, is_possible = problem.parameter_set, np.True_
    for p in parameter_set.parameters:
        x, allowed_range = parameters[p.name], p.range
        above_lower, below_upper = (
            (x >= allowed_range.lower, x <= allowed_range.upper)
            if allowed_range.closed
            else (x > allowed_range.lower, x < allowed_range.upper)
        )
        size = np.abs(x)
        is_possible = (
            is_possible & above_lower & below_upper & (((size >= MIN_SIZE) & (size <= 1 / MIN_SIZE)) | (x == 0))
        )
        is_possible = is_possible & ~(p.tangent & (x == 0))
    for name, (needed_name, _) in parameter_set.needs.items():
        is_possible = is_possible & ((parameters[name] == 0) | (parameters[needed_name] > 0))
    return np.asarray(is_possible)


def _find_violations(problem: Posed, parameters: Mapping[str, Any], motions: Motions) -> tuple[dict[str, Array], Truth]:
    """The violation of each constraint, and whether a design is too close to a limit for this evaluation."""
    m = len(motions.are_simple)
    amounts, is_doubtful = {}, np.zeros(m, dtype=bool)
    names = list(dict.fromkeys(n for c in problem.conditions.values() for n in c.names))
    values = dict(zip(names, evaluate(problem, names, parameters), strict=True))
    for name, condition in problem.conditions.items():
        left, right = (_broadcast(side, m).value for side in condition.sides(values))
        difference = left - right
        excess, size = condition.excess(difference), np.maximum(1.0, np.maximum(np.abs(left), np.abs(right)))
        relative = excess / size
        is_doubtful |= ~np.isfinite(difference) | ((relative > 0) & (relative <= _DOUBT_RATIO * FEASIBILITY_TOLERANCE))
        if set(condition.names) & set(ROOT_NAMES):  # the recheck uses numeric roots
            is_doubtful |= np.abs(difference) <= (_DOUBT_RATIO * FEASIBILITY_TOLERANCE + motions.scatter) * size
        amounts[name] = np.where(relative > FEASIBILITY_TOLERANCE, excess, np.nan)
    return amounts, is_doubtful


def _find_bounds(
    problem: Posed, coefficients: Sequence[Bounded], round_and_mark: Callable[[Any], Array]
) -> tuple[Array, Truth]:
    """The `instant_bound` of each design, and whether it comes from relations.

    Fixed coefficients satisfy relations in pairs: aⱼ with a0, where aⱼ/a0 = C(n, j) zʲ gives the bound, and aⱼ with aₙ.

    Args:
        round_and_mark: rounds numbers to doubles, and marks the designs whose numbers are uncertain.
    """
    model, parameter_set, n = problem.model, problem.parameter_set, problem.model.degree
    product_bound = np.full(len(coefficients[0].value), -np.inf)
    if minimizes_abscissa(problem):
        product_bound = -(round_and_mark(abs(coefficients[-1] / coefficients[0])) ** (1 / n)) * (1 + ROUNDING)
    if (
        not minimizes_abscissa(problem)
        or any(p.tangent for p in parameter_set.parameters)
        or not is_rational(model, parameter_set)
    ):
        return product_bound, np.zeros(len(product_bound), dtype=bool)
    least = np.full(len(product_bound), np.inf)
    for j in range(n + 1):
        ratio_to_first = coefficients[j] / coefficients[0] / math.comb(n, j)
        ratio_of_last = coefficients[n] / coefficients[j] * math.comb(n, j)
        for power, ratio, is_linear in ((j, ratio_to_first, j == 1), (n - j, ratio_of_last, n == 1)):
            if power:
                root = ratio.root(power)
                zero = round_and_mark(root) + root.error
                least = np.minimum(least, zero if is_linear else np.maximum(zero, 0.0))  # 0 is a zero of a derivative
    linear_bound = np.nextafter(-least, -np.inf)
    return np.maximum(linear_bound, product_bound), linear_bound > product_bound


def _compute_law_residuals(
    problem: Posed,
    bounded: Mapping[str, Any],
    coefficients: Sequence[Bounded],
    is_feasible: Truth,
    round_and_mark: Callable[[Any], Array],
) -> dict[str, Array]:
    """Relative residuals of the laws that apply to a feasible design without a multiple root; see `law_rows`."""
    m = len(is_feasible)
    names = problem.model.sets[0].names
    *native, froude = (_broadcast(x, m) for x in evaluate(problem, [*names, "Fr_c"], bounded))
    p = {n: round_and_mark(x) for n, x in zip(names, native, strict=True)}
    exists = np.isfinite(froude.value)
    critical = np.where(exists, round_and_mark(froude.where(exists, Bounded(np.ones(m), np.zeros(m)))), np.nan)
    residuals = {}
    for label, (numeric, law, applies) in speed_laws(
        p, critical, np.stack([*map(round_and_mark, coefficients)], -1)
    ).items():
        residual = (numeric - law) / np.where(law == 0, 1.0, np.abs(law))
        round_and_mark(np.where(is_feasible & applies, residual, 0.0))  # marks designs without a value of the law
        residuals[label] = np.where(is_feasible & applies, residual, np.nan)
    return residuals
