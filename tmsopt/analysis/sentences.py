"""The structure of a solution, and what is proved of it, each in one sentence."""

import math
from collections.abc import Sequence

from tmsopt.analysis.summary import faster_than, none_of
from tmsopt.models.user_spectrum import describe_user_structure
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, RADIUS
from tmsopt.problem.solution import Bound, Solution
from tmsopt.problem.unit_system import Unit, common_unit
from tmsopt.problem.verdict.stability import MultipleRoot, describe_crossing

_DIGITS = 12
_UNJUDGED = {ANGULAR_FREQUENCY: "frequencies", RADIUS: "the robustness radius"}


def structure_line(problem: Posed, structure: str, abscissa: float, known: Sequence[MultipleRoot]) -> str:
    """The structure of the roots in words, and what it is where eigenvectors remain, or nobody can tell.

    Args:
        known: what meets in each multiple root.
    """
    words = describe_user_structure(problem.model, structure, abscissa > 0)
    about = known if problem.pattern is not None else [m for m in known if m.re == known[0].re]
    if crossing := next((m for m in about if not m.exceptional), None):
        return f"{words}: {describe_crossing(crossing)}"
    blind = problem.model.pencil is None and "EP" in f"{problem.locate or ''}{structure}"
    return f"{words}; coefficients cannot tell whether it is defective" if blind and known else words


def proof_line(solution: Solution) -> str:  # noqa: PLR0911 - one per case
    """Whether it is proved that no solution is better, and how to go on where it is not."""
    bound, problem = solution.bound, solution.problem.posed
    text = (problem.minimize or problem.maximize or "").strip()
    beyond = [words for name, words in _UNJUDGED.items() if problem.asks(name)]
    unjudged = f"branch and bound does not judge {' or '.join(beyond)}" if beyond else ""
    if solution.status == "infeasible":
        if bound.proven:
            return "no design in the box meets all limits"
        known = "that no design is stable; " if solution.any_stable is False else ""
        unproved = f"{known}none that no design is feasible{_tried(bound)}"
        return _joined(unproved, unjudged or _further(bound, "--certify looks for one"))
    if not problem.free:
        return "nothing is free, so nothing to prove; tmsopt prove proves the roots"
    if not text:
        if solution.status != "optimal":
            return f"none that there is no {problem.locate}"
        left = solution.freedom.count
        among = {1: "a curve", 2: "a surface"}.get(left, f"a family of {left} parameters")
        followed = ", which tmsopt trace follows" if left == 1 else ""
        more = f"; it is one of {among} of such designs{followed}" if left > 0 else ""
        return f"tmsopt prove FILE proves, or refutes, that this design exists{more}"
    unit = common_unit(problem, text)
    side = "above" if problem.sense == "maximize" else "below"
    if bound.proven:
        by = f" by more than {bound.gap:.1e}" if bound.tolerance else ""
        better = f"has a {'greater' if side == 'above' else 'lesser'} {text}"
        better = faster_than(solution) if text == "abscissa" and problem.sense == "minimize" else better
        return f"{none_of(problem)} {better}{by} ({bound.method})"
    if math.isfinite(bound.value):
        known = f"none allowed is {side} {unit.show(bound.value, 6)} ({bound.method})"
        further = unjudged or _further(bound, "--certify goes on")
        return _joined(f"{known}, {unit.show(bound.gap, 2)} open{_tried(bound)}", further)
    further = unjudged or _further(bound, "--certify proves it, or finds better")
    return _joined(f"none that this is the best{_tried(bound)}", further)


def bound_lines(solution: Solution) -> list[str]:
    """What no solution can beat, and how that is known."""
    bound, problem = solution.bound, solution.problem.posed
    search = f"branch and bound with {bound.solver}, {bound.nodes} nodes, {bound.seconds:.1f} s"
    floating = f"a floating-point proof, feasibility tolerance {bound.tolerance:.0e}"
    kind = floating if bound.tolerance else "a proof without a tolerance"
    if solution.status == "infeasible":
        how = f"{search}; {kind}" if bound.solver else "interval arithmetic"
        return [f"proved: no design in the box satisfies all constraints ({how})"] if bound.proven else []
    if not math.isfinite(bound.value):
        return [f"bound: none found in time ({search})"] if bound.seconds else []
    side = "above" if problem.sense == "maximize" else "below"
    which = f"{none_of(problem)} is {side} {Unit().number(bound.value, _DIGITS)}"
    lines = [f"bound: {which} ({bound.method}); gap {bound.gap:.1e}"]
    if bound.method == bound.solver.lower():
        lines.append(f"how: {search}; {kind}")
    elif bound.seconds:
        lines.append(f"how: {search} found none better in time")
    return lines


def _joined(text: str, advice: str) -> str:
    return f"{text}; {advice}" if advice else text


def _further(bound: Bound, first: str) -> str:
    """What to ask of branch and bound: twice the time where it ran out; nothing where it could not take the problem."""
    if not bound.solver:
        return first
    return f"--certify {max(2 * math.ceil(bound.seconds), 1)} goes on" if bound.seconds else ""


def _tried(bound: Bound) -> str:
    return f" in {bound.seconds:.0f} s of {bound.solver}" if bound.solver and bound.seconds else ""
