"""What stands in the way of a problem without an answer, as lines for a reader: first what would help."""

import math
import re

from tmsopt.design import Unit, unit_of
from tmsopt.design.problem import Problem
from tmsopt.design.solution import Need, Relaxation, Solution
from tmsopt.design.unit_system import limit_text

_SIGN = re.compile(r"<=|>=|==")
_DIGITS = 5
_LEFT = 1e-11  # of a limit: what rounding, also that of amounts upwards, leaves of it
_OTHER = {"a0": "a mass matrix that is not singular (a0 = 0)", "coefficients": "coefficients that have values"}


def infeasible_lines(solution: Solution, full: bool = False) -> list[str]:
    """A sentence; the limits in conflict and the smallest change that frees the problem; `full`, each limit alone.

    Of a design that is not stable though that was looked for, the sentence alone; empty for any other.

    Example:
        >>> import dataclasses
        >>> problem = dataclasses.replace(tmsopt.load("problems/ep4.toml"), constraints={"fast": "Fr >= 11"})
        >>> print(tmsopt.report.infeasible_lines(tmsopt.solve(problem, throw=False))[0])
        fast (Fr >= 11) needs Fr at least 11 (at most 10 is allowed)

    More: docs/how_to/infeasible.md
    """
    relaxation, problem, need = solution.relaxation, solution.problem, solution.need
    lines = [text for text in [_sentence(solution)] if text]
    if solution.status != "infeasible" or relaxation is None or not relaxation.amounts:
        return lines
    if need and need.found and not full:
        return lines
    names = relaxation.conflict or tuple(relaxation.amounts)
    if len(names) > 1:
        told = "" if relaxation.irreducible else ", as far as a search tells"
        lines.append(f"in conflict{told}: {', '.join(_limit(problem, n) for n in names)}")
    changes = " and ".join(_changed(problem, n, amount) for n, amount in relaxation.amounts.items())
    lines.append(f"smallest change found: {changes}")
    single = {n: a for n, a in relaxation.alone.items() if relaxation.amounts.keys() != {n}}
    return lines + [f"  or alone: {_changed(problem, n, amount)}" for n, amount in single.items() if full]


def _sentence(solution: Solution) -> str:
    problem, relaxation = solution.problem, solution.relaxation
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
    problem = solution.problem
    asked = [n for n in relaxation.conflict if not _end(problem, n)] or list(solution.violations)
    ends = {n: a for n, a in relaxation.amounts.items() if _end(problem, n)}
    if len(ends) < len(relaxation.amounts):  # or one that would do alone
        ends = dict([(n, a) for n, a in relaxation.alone.items() if _end(problem, n)][:1])
    listed = _listed([_limit(problem, n) for n in asked])
    if ends:
        needs = _listed([_needed(problem, n, a) for n, a in ends.items()])
        others = " with the other limits" if problem.constraints.keys() - set(asked) else ""
        return f"{listed}{others} need{'s' if len(asked) == 1 else ''} {needs}"
    roots = f" with {problem.pattern.name}" if problem.pattern and problem.pattern.name not in asked else ""
    nearest = _nearest(solution, asked[0]) if len(asked) == 1 else ""
    if not solution.bound.proven or problem.constraints.keys() - set(asked):  # what is proved is about all limits
        both = {1: "", 2: "both "}.get(len(asked), "all of ")
        return f"no design{roots} was found that meets {both}{listed}{nearest}"
    all_of_them = f"cannot {'both' if len(asked) == 2 else 'all'} be met" if len(asked) > 1 else "is out of reach"
    return f"{listed} {all_of_them}{roots}{nearest}"


def _speed(solution: Solution, need: Need) -> str:
    """Nothing at this speed, and where there is something."""
    problem, name = solution.problem, need.parameter
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
    return f"{what} {exists} {at}: the {least} {name} found is {_shown(unit, need.value, not need.most)}"


def _unstable(solution: Solution) -> bool:
    return solution.stable is False and solution.any_stable is not True


def _needed(problem: Problem, bound: str, amount: float) -> str:
    """What is needed of a parameter that its range does not allow."""
    name, end = bound.rsplit(".", 1)
    old, unit = problem.free[name][end == "max"], unit_of(problem, bound)
    new = _shown(unit, old + (amount if end == "max" else -amount), end == "max")
    word, other = ("at least", "at most") if end == "max" else ("at most", "at least")
    return f"{name} {word} {new} ({other} {unit.show(old)} is allowed)"


def _nearest(solution: Solution, name: str) -> str:
    """How near a design comes to a limit: its side that is no number."""
    relaxation, condition = solution.relaxation, solution.problem.conditions.get(name)
    if relaxation is None or condition is None:
        return ""
    sides = _SIGN.split(solution.problem.constraints[name])
    reached = condition.sides(solution.problem.values(relaxation.parameters))
    amount = relaxation.amounts.get(name, 0.0)
    for side, other, own, sign in zip(sides, reversed(sides), reached, (1, -1), strict=True):
        if (limit := _number(other)) is not None:
            varied = solution.problem.nominal is not solution.problem
            # The radius is none of a design's own values, and over several cases the worst one counts.
            value = own if math.isfinite(own) and not varied else limit + sign * condition.sign * amount
            if not math.isfinite(value) or not math.isfinite(amount):
                return f": {side.strip()} has no value where the search ended"
            shown = f"{side.strip()} = {unit_of(solution.problem, name).show(value)}"
            return f": the nearest design found has {shown}{' in its worst case' if varied else ''}"
    return ""


def _changed(problem: Problem, name: str, amount: float) -> str:
    """A limit as it would have to be, rounded so that it suffices."""
    if not math.isfinite(amount):
        return f"another {_limit(problem, name)}, which has no value where the search ended"
    if _end(problem, name):
        parameter, end = name.rsplit(".", 1)
        old, unit = problem.free[parameter][end == "max"], unit_of(problem, name)
        needed = _shown(unit, old + (amount if end == "max" else -amount), end == "max")
        return f"{parameter} {'up to' if end == 'max' else 'down to'} {needed} instead of {unit.number(old)}"
    text = problem.constraints.get(name, "")
    sides, sign = _SIGN.split(text), "".join(_SIGN.findall(text))
    limit = _number(sides[-1]) if len(sides) == 2 else None
    if limit is None:
        return f"{_limit(problem, name)} missed by {_shown(unit_of(problem, name), abs(amount), True)}"
    unit, more = unit_of(problem, name), -amount if sign == ">=" else amount
    new = _shown(unit, limit + more, more > 0, abs(limit))
    return f"{sides[0].strip()} {sign} {new} instead of {unit.number(limit)} ({name})"


def _limit(problem: Problem, name: str) -> str:
    """A limit in words: a constraint with what it says, an end of a range."""
    if _end(problem, name):
        parameter, end = name.rsplit(".", 1)
        bound = unit_of(problem, name).show(problem.free[parameter][end == "max"])
        return f"{parameter} {'<=' if end == 'max' else '>='} {bound}"
    return f"{name} ({limit_text(problem, name)})" if name in problem.constraints else _OTHER.get(name, name)


def _end(problem: Problem, name: str) -> bool:
    return name not in problem.constraints and name.rpartition(".")[0] in problem.free


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _shown(unit: Unit, value: float, up: bool, size: float = 0.0) -> str:
    """A value, or 0 where it is less than what is left of numbers of a size that cancel."""
    value = 0.0 if abs(value) <= _LEFT * size else value
    return unit.show(_outwards(value / unit.one, up) * unit.one)


def _outwards(x: float, up: bool) -> float:
    """Rounded up, or down, to the digits that are shown."""
    if not x or not math.isfinite(x):
        return 0.0
    step = 10.0 ** (math.floor(math.log10(abs(x))) - _DIGITS + 1)
    return (math.ceil if up else math.floor)(round(x / step, 6)) * step


def _listed(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}" if names else "something"
