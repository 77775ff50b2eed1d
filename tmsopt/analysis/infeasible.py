"""Sentences about an infeasible problem: the limits that exclude a design, and the smallest change that helps."""

import math
from collections.abc import Collection

from tmsopt.analysis.limits import split_bound
from tmsopt.evaluation.exclusion import bound_without_search
from tmsopt.models.expression import SIGN
from tmsopt.problem import limit_value, unit_of
from tmsopt.problem.advice.remedies import Relaxation, RequiredValue
from tmsopt.problem.problem import Posed
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import dimension_of, limit_text
from tmsopt.records import Table

_WRITTEN_DIGITS = 12  # digits of a present limit, since the new limit may differ from it in the sixth digit
# conditions that are no limits of the problem → their description
_OTHER_CONDITIONS = {
    "a0": "a mass matrix that is not singular (a0 = 0)",
    "coefficients": "coefficients that have values",
}


def infeasible_sentences(solution: Solution, full: bool = False) -> list[str]:
    """The obstacle, the limits in conflict, and the smallest change that helps.

    An unstable optimum gets one sentence. Any other feasible solution gets no sentence.

    Args:
        full: also list the change of each single limit that would be enough.
    """
    relaxation, problem, need = solution.relaxation, solution.problem.posed, solution.need
    lines = [text for text in [_describe_obstacle(solution)] if text]
    if solution.status != "infeasible" or relaxation is None or not relaxation.amounts:
        return lines
    if need and need.found and not full:
        return lines
    names = relaxation.conflict or tuple(relaxation.amounts)
    if len(names) > 1:
        is_proved = relaxation.irreducible and _is_proved_infeasible(solution, names)
        words = "in conflict" if is_proved else "in conflict, not proved"
        lines.append(f"{words}: {', '.join(_describe_limit(problem, n) for n in names)}")
    changes = [
        " and ".join(_describe_change(problem, *limit) for limit in remedy.items()) for remedy in relaxation.remedies
    ]
    if not changes:
        return lines if need and need.found else [*lines, "none of the changes of limits that were tried helps"]
    return [*lines, f"smallest change found: {changes[0]}", *(f"or alone: {text}" for text in changes[1:] if full)]


def _describe_obstacle(solution: Solution) -> str:
    problem, relaxation = solution.problem.posed, solution.relaxation
    only_roots_conflict = relaxation is None or not set(relaxation.conflict) - set(problem.asked_of_roots)
    if solution.need and (solution.need.found or (_is_unstable(solution) and only_roots_conflict)):
        return _describe_required_speed(solution, solution.need)
    if solution.status != "infeasible":
        return ""
    if not problem.free or relaxation is None or not relaxation.amounts:
        violated = _join_words([_describe_limit(problem, n) for n in solution.violations])
        return f"no design was found with {violated}" if problem.free else f"the given design does not have {violated}"
    return _describe_conflict(solution, relaxation)


def _describe_conflict(solution: Solution, relaxation: Relaxation) -> str:
    """The range of a parameter that the limits need; without such a range, how near a design comes to the limits."""
    problem = solution.problem.posed
    names = [n for n in relaxation.conflict if not _is_range_end(problem, n)] or list(solution.violations)
    remedies = (remedy for remedy in relaxation.remedies if all(_is_range_end(problem, n) for n in remedy))
    ends = next(remedies, Table[str]())
    limits = _join_words([_describe_limit(problem, n) for n in names])
    if ends:
        needs = _join_words([_describe_requirement(problem, *end) for end in ends.items()])
        context = " with the other limits" if problem.constraints.keys() - set(names) else ""
        return f"{limits}{context} need{'s' if len(names) == 1 else ''} {needs}"
    roots = f" with {problem.pattern.name}" if problem.pattern and problem.pattern.name not in names else ""
    nearest_text = _describe_nearest(solution, names[0]) if len(names) == 1 else ""
    if not _is_proved_infeasible(solution, names):
        count_word = {1: "", 2: "both "}.get(len(names), "all of ")
        return f"no design{roots} was found that meets {count_word}{limits}{nearest_text}"
    verdict = f"cannot {'both' if len(names) == 2 else 'all'} be met" if len(names) > 1 else "is out of reach"
    return f"{limits} {verdict}{roots}{nearest_text}"


def _is_proved_infeasible(solution: Solution, names: Collection[str]) -> bool:
    """Whether it is proved that no design satisfies these limits.

    If these are not all limits of the problem, a proof for all limits is not enough, and intervals must confirm it.
    """
    problem = solution.problem.posed
    constraints = {name: text for name, text in problem.constraints.items() if name in names}
    has_all_limits = constraints.keys() == problem.constraints.keys()
    return solution.bound.proven and (
        has_all_limits or bound_without_search(problem.derive(constraints=constraints)).proven
    )


def _describe_required_speed(solution: Solution, need: RequiredValue) -> str:
    """A sentence that no design exists at this speed, with the nearest speed at which a design was found."""
    problem, name = solution.problem.posed, need.parameter
    unit = unit_of(problem, name)
    limits = [n for n in solution.violations if n in problem.asked_of_roots or n in problem.located]
    is_unstable = _is_unstable(solution)
    subject = "no stable design"
    if not is_unstable:
        subject = f"no design with {_join_words([_describe_limit(problem, n) for n in limits])}"
    is_proved = solution.status == "infeasible" and solution.bound.proven
    verb = "exists" if is_proved or (is_unstable and solution.any_stable is False) else "was found"
    low, high = problem.free.get(name, (problem.fixed.get(name, math.nan),) * 2)
    place_text = (
        f"at {name} = {unit.show(low)}" if low == high else f"for {name} from {unit.number(low)} to {unit.show(high)}"
    )
    if not need.found:
        low, high = need.looked
        searched_range = f"{name} from {unit.number(low)} to {unit.show(high)}"
        return f"{subject} {verb} {place_text}; none was found for {searched_range} either"
    extreme, value = "highest" if need.most else "lowest", unit.show(need.shown)
    design = "a stable design that satisfies all other limits" if is_unstable else "a design that satisfies all limits"
    return f"{subject} {verb} {place_text}; the {extreme} {name} found for {design} is {value}"


def _is_unstable(solution: Solution) -> bool:
    return solution.stable is False and solution.any_stable is not True


def _describe_requirement(problem: Posed, bound: str, required: str) -> str:
    """The value that a parameter needs, and the end of its range that does not allow it."""
    name, is_upper, value = split_bound(problem, bound)
    word, opposite_word = ("at least", "at most") if is_upper else ("at most", "at least")
    allowed = unit_of(problem, bound).show(value, _WRITTEN_DIGITS)
    return f"{name} {word} {required} ({opposite_word} {allowed} is allowed)"


def _describe_nearest(solution: Solution, name: str) -> str:
    """How near a design comes to a limit: the value of the side of the limit that is not a number."""
    problem, relaxation = solution.problem.posed, solution.relaxation
    condition = problem.conditions.get(name)
    if relaxation is None or condition is None:
        return ""
    sides = SIGN.split(problem.constraints[name])
    side_values = condition.sides(problem.values(relaxation.parameters))
    amount = relaxation.amounts.get(name, 0.0)
    for side, opposite_side, side_value, sign in zip(sides, reversed(sides), side_values, (1, -1), strict=True):
        if (limit := _parse_number(opposite_side)) is not None:
            has_cases = problem.nominal is not problem
            # the values of one design do not include the robustness radius or the worst of several cases
            value = (
                side_value if math.isfinite(side_value) and not has_cases else limit + sign * condition.sign * amount
            )
            if not math.isfinite(value) or not math.isfinite(amount):
                return f": {side.strip()} has no value where the search ended"
            text = f"{side.strip()} = {unit_of(problem, name).show(value)}"
            return f": the nearest design found has {text}{' in its worst case' if has_cases else ''}"
    return ""


def _describe_change(problem: Posed, name: str, new_limit: str) -> str:
    """The new limit that the user should write, and the present number."""
    if _is_range_end(problem, name):
        parameter, is_upper, value = split_bound(problem, name)
        old_text = unit_of(problem, name).number(value, _WRITTEN_DIGITS)
        return f"{parameter} {'up' if is_upper else 'down'} to {new_limit} instead of {old_text}"
    limit = limit_value(problem.constraints[name])
    old_text = "" if limit is None else f" instead of {limit:.{_WRITTEN_DIGITS}g}"
    return f"{new_limit}{old_text} ({_name_with_unit(problem, name)})"


def _name_with_unit(problem: Posed, name: str) -> str:
    """The name of a constraint with the unit of its numbers, which is not the unit that the user chose for display."""
    unit = dimension_of(problem, name).unit
    return name if unit == "1" else f"{name}, in {unit}"


def _describe_limit(problem: Posed, name: str) -> str:
    """A constraint with its text, or an end of a range as an inequality."""
    if _is_range_end(problem, name):
        parameter, is_upper, value = split_bound(problem, name)
        return f"{parameter} {'<=' if is_upper else '>='} {unit_of(problem, name).show(value)}"
    return f"{name} ({limit_text(problem, name)})" if name in problem.constraints else _OTHER_CONDITIONS.get(name, name)


def _is_range_end(problem: Posed, name: str) -> bool:
    return name not in problem.constraints and name.rpartition(".")[0] in problem.free


def _parse_number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _join_words(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}" if names else "something"
