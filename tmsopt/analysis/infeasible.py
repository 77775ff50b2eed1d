"""What stands in the way of a problem without an answer, in sentences: first what would help."""

import math
from collections.abc import Collection

from tmsopt.evaluation.exclusion import bound_without_search
from tmsopt.models.expression import SIGN
from tmsopt.problem import limit_value, unit_of
from tmsopt.problem.advice.remedies import Relaxation, RequiredValue
from tmsopt.problem.problem import Posed
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import dimension_of, limit_text
from tmsopt.records import Table

_AS_WRITTEN = 12  # digits of a limit as it is, next to one that may differ from it in the sixth
_OTHER = {"a0": "a mass matrix that is not singular (a0 = 0)", "coefficients": "coefficients that have values"}


def infeasible_sentences(solution: Solution, full: bool = False) -> list[str]:
    """The obstacle; the limits in conflict and the smallest change that frees the problem; `full`, each limit alone.

    One sentence for a design that is not stable though that was sought; none for any other.
    """
    relaxation, problem, need = solution.relaxation, solution.problem.posed, solution.need
    lines = [text for text in [_sentence(solution)] if text]
    if solution.status != "infeasible" or relaxation is None or not relaxation.amounts:
        return lines
    if need and need.found and not full:
        return lines
    names = relaxation.conflict or tuple(relaxation.amounts)
    if len(names) > 1:
        told = "" if relaxation.irreducible and _proved(solution, names) else ", as far as a search tells"
        lines.append(f"in conflict{told}: {', '.join(_limit(problem, n) for n in names)}")
    changes = [" and ".join(_changed(problem, *one) for one in found.items()) for found in relaxation.remedies]
    if not changes:
        return lines if need and need.found else [*lines, "no change of limits was found that helps"]
    return [*lines, f"smallest change found: {changes[0]}", *(f"or alone: {text}" for text in changes[1:] if full)]


def _sentence(solution: Solution) -> str:
    problem, relaxation = solution.problem.posed, solution.relaxation
    stands_alone = relaxation is None or not set(relaxation.conflict) - set(problem.asked_of_roots)
    if solution.need and (solution.need.found or (_unstable(solution) and stands_alone)):
        return _speed(solution, solution.need)
    if solution.status != "infeasible":
        return ""
    if not problem.free or relaxation is None or not relaxation.amounts:
        violated = _listed([_limit(problem, n) for n in solution.violations])
        return (
            f"no design was found with {violated}" if problem.free else f"the design as given does not have {violated}"
        )
    return _conflict(solution, relaxation)


def _conflict(solution: Solution, relaxation: Relaxation) -> str:
    """What one limit needs that another does not allow, or how near to it a design comes."""
    problem = solution.problem.posed
    asked = [n for n in relaxation.conflict if not _end(problem, n)] or list(solution.violations)
    remedies = (found for found in relaxation.remedies if all(_end(problem, n) for n in found))
    ends = next(remedies, Table[str]())
    listed = _listed([_limit(problem, n) for n in asked])
    if ends:
        needs = _listed([_needed(problem, *one) for one in ends.items()])
        others = " with the other limits" if problem.constraints.keys() - set(asked) else ""
        return f"{listed}{others} need{'s' if len(asked) == 1 else ''} {needs}"
    roots = f" with {problem.pattern.name}" if problem.pattern and problem.pattern.name not in asked else ""
    nearest = _nearest(solution, asked[0]) if len(asked) == 1 else ""
    if not _proved(solution, asked):
        both = {1: "", 2: "both "}.get(len(asked), "all of ")
        return f"no design{roots} was found that meets {both}{listed}{nearest}"
    all_of_them = f"cannot {'both' if len(asked) == 2 else 'all'} be met" if len(asked) > 1 else "is out of reach"
    return f"{listed} {all_of_them}{roots}{nearest}"


def _proved(solution: Solution, names: Collection[str]) -> bool:
    """Whether it is proved that no design meets these limits: all there are, or some that intervals exclude."""
    problem = solution.problem.posed
    kept = {name: text for name, text in problem.constraints.items() if name in names}
    some = kept.keys() < problem.constraints.keys()
    return solution.bound.proven and not (some and not bound_without_search(problem.derive(constraints=kept)).proven)


def _speed(solution: Solution, need: RequiredValue) -> str:
    """Nothing at this speed, and where there is something."""
    problem, name = solution.problem.posed, need.parameter
    unit = unit_of(problem, name)
    about = [n for n in solution.violations if n in problem.asked_of_roots or n in problem.located]
    unstable = _unstable(solution)
    what = "no stable design" if unstable else f"no design with {_listed([_limit(problem, n) for n in about])}"
    known = solution.bound.proven if solution.status == "infeasible" else False
    exists = "exists" if known or (unstable and solution.any_stable is False) else "was found"
    low, high = problem.free.get(name, (problem.fixed.get(name, math.nan),) * 2)
    at = f"at {name} = {unit.show(low)}" if low == high else f"for {name} from {unit.number(low)} to {unit.show(high)}"
    if not need.found:
        low, high = need.looked
        return f"{what} {exists} {at}, nor was one found for {name} from {unit.number(low)} to {unit.show(high)}"
    least = "greatest" if need.most else "least"
    return f"{what} {exists} {at}: the {least} {name} found is {unit.show(need.shown)}"


def _unstable(solution: Solution) -> bool:
    return solution.stable is False and solution.any_stable is not True


def _needed(problem: Posed, bound: str, new: str) -> str:
    """What is needed of a parameter that its range does not allow."""
    name, end = bound.rsplit(".", 1)
    word, other = ("at least", "at most") if end == "max" else ("at most", "at least")
    allowed = unit_of(problem, bound).show(problem.free[name][end == "max"], _AS_WRITTEN)
    return f"{name} {word} {new} ({other} {allowed} is allowed)"


def _nearest(solution: Solution, name: str) -> str:
    """How near a design comes to a limit: its side that is no number."""
    problem, relaxation = solution.problem.posed, solution.relaxation
    condition = problem.conditions.get(name)
    if relaxation is None or condition is None:
        return ""
    sides = SIGN.split(problem.constraints[name])
    reached = condition.sides(problem.values(relaxation.parameters))
    amount = relaxation.amounts.get(name, 0.0)
    for side, other, own, sign in zip(sides, reversed(sides), reached, (1, -1), strict=True):
        if (limit := _number(other)) is not None:
            varied = problem.nominal is not problem
            # The radius is none of a design's own values, and over several cases the worst one counts.
            value = own if math.isfinite(own) and not varied else limit + sign * condition.sign * amount
            if not math.isfinite(value) or not math.isfinite(amount):
                return f": {side.strip()} has no value where the search ended"
            shown = f"{side.strip()} = {unit_of(problem, name).show(value)}"
            return f": the nearest design found has {shown}{' in its worst case' if varied else ''}"
    return ""


def _changed(problem: Posed, name: str, new: str) -> str:
    """A limit as it is to be written, and the number that it has now."""
    if _end(problem, name):
        parameter, end = name.rsplit(".", 1)
        old = unit_of(problem, name).number(problem.free[parameter][end == "max"], _AS_WRITTEN)
        return f"{parameter} {'up' if end == 'max' else 'down'} to {new} instead of {old}"
    limit = limit_value(problem.constraints[name])
    return f"{new}{'' if limit is None else f' instead of {limit:.{_AS_WRITTEN}g}'} ({_in_unit(problem, name)})"


def _in_unit(problem: Posed, name: str) -> str:
    """The name of a constraint, with the unit that numbers in it are in: its own, whatever was typed for parameters."""
    unit = dimension_of(problem, name).unit
    return name if unit == "1" else f"{name}, in {unit}"


def _limit(problem: Posed, name: str) -> str:
    """A limit in words: a constraint with what it says, an end of a range."""
    if _end(problem, name):
        parameter, end = name.rsplit(".", 1)
        bound = unit_of(problem, name).show(problem.free[parameter][end == "max"])
        return f"{parameter} {'<=' if end == 'max' else '>='} {bound}"
    return f"{name} ({limit_text(problem, name)})" if name in problem.constraints else _OTHER.get(name, name)


def _end(problem: Posed, name: str) -> bool:
    return name not in problem.constraints and name.rpartition(".")[0] in problem.free


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _listed(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}" if names else "something"
