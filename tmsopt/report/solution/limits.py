"""Worst cases, and limits in conflict, as lines for a reader."""

import math

from tmsopt.analysis import faster_than, none_of
from tmsopt.problem.cases import Case
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, RADIUS
from tmsopt.problem.solution import Bound, Solution
from tmsopt.problem.unit_system import unit_of, unit_of_all
from tmsopt.report.text import number


def bound_lines(solution: Solution) -> list[str]:
    """What no design of the box can beat, and how that is known."""
    bound = solution.bound
    search = f"branch and bound with {bound.solver}, {bound.nodes} nodes, {bound.seconds:.1f} s"
    floating = f"a floating-point proof, feasibility tolerance {bound.tolerance:.0e}"
    kind = floating if bound.tolerance else "a proof without a tolerance"
    if solution.status == "infeasible":
        how = f"{search}); {kind}" if bound.solver else "interval arithmetic)"
        return [f"proved: no design in the box satisfies all constraints ({how}"] if bound.proven else []
    if not math.isfinite(bound.value):
        return [f"bound: none found in time ({search})"] if bound.seconds else []
    side = "above" if solution.problem.posed.sense == "maximize" else "below"
    which = f"{none_of(solution.problem.posed)} is {side} {number(bound.value)}"
    lines = [f"bound: {which} ({bound.method}); gap {bound.gap:.1e}"]
    if bound.method == bound.solver.lower():
        lines.append(f"       {search}; {kind}")
    elif bound.seconds:
        lines.append(f"       {search} found none better in time")
    return lines


def proof_line(solution: Solution) -> str:  # noqa: PLR0911 - one per case
    """Whether it is proved that none is better, in one line, and how to go on where it is not."""
    bound, problem = solution.bound, solution.problem.posed
    text = (problem.minimize or problem.maximize or "").strip()
    beyond = {ANGULAR_FREQUENCY: "frequencies", RADIUS: "the robustness radius"}
    beyond = {name: words for name, words in beyond.items() if problem.asks(name)}
    unjudged = f"branch and bound does not judge {' or '.join(beyond.values())}" if beyond else ""
    if solution.status == "infeasible":
        known = "that no design is stable; " if solution.any_stable is False else ""
        unproved = f"{known}none that no design is feasible{_tried(bound)}"
        further = unjudged or _further(bound, "--certify looks for one")
        return f"proof: {'no design in the box meets all limits' if bound.proven else _joined(unproved, further)}"
    if not problem.free:
        return "proof: nothing is free, so nothing to prove; tmsopt prove proves the roots"
    if not text:
        if solution.status != "optimal":
            return f"proof: none that there is no {problem.locate}"
        left = solution.freedom.count
        among = {1: "a curve", 2: "a surface"}.get(left, f"a family of {left} parameters")
        followed = ", which tmsopt trace follows" if left == 1 else ""
        more = f"; it is one of {among} of such designs{followed}" if left > 0 else ""
        return f"proof: tmsopt prove FILE proves, or refutes, that this design exists{more}"
    unit = unit_of_all(problem, text)
    side = "above" if problem.sense == "maximize" else "below"
    if bound.proven:
        by = f" by more than {bound.gap:.1e}" if bound.tolerance else ""
        better = (
            faster_than(solution)
            if text == "abscissa" and problem.sense == "minimize"
            else f"has a {'greater' if side == 'above' else 'lesser'} {text}"
        )
        return f"proof: {none_of(problem)} {better}{by} ({bound.method})"
    if math.isfinite(bound.value):
        known = f"none allowed is {side} {unit.show(bound.value, 6)} ({bound.method})"
        further = unjudged or _further(bound, "--certify goes on")
        return _joined(f"proof: {known}, {unit.show(bound.gap, 2)} open{_tried(bound)}", further)
    further = unjudged or _further(bound, "--certify proves it, or finds better")
    return _joined(f"proof: none that this is the best{_tried(bound)}", further)


def _joined(text: str, advice: str) -> str:
    return f"{text}; {advice}" if advice else text


def _further(bound: Bound, first: str) -> str:
    """What to ask of branch and bound: twice the time where it ran out; nothing where it could not take the problem."""
    if not bound.solver:
        return first
    return f"--certify {max(2 * math.ceil(bound.seconds), 1)} goes on" if bound.seconds else ""


def _tried(bound: Bound) -> str:
    return f" in {bound.seconds:.0f} s of {bound.solver}" if bound.solver and bound.seconds else ""


def case_lines(solution: Solution) -> list[str]:
    """The worst case, and what is known of all of them."""
    if solution.worst is None:
        return []
    of = solution.problem
    lines = [f"worst case: {_place(of.posed, solution.worst)}; motion and roots are those there, the rest nominal"]
    if solution.least_damped not in (None, solution.worst) and of.model.carrier is None:
        found = "least damped of those looked at" if solution.problem.tolerances else "least damped case"
        lines.append(f"{found}: {_place(of.posed, solution.least_damped)}; the damping ratio is that there")
    if solution.fastest is not None and solution.fastest != solution.worst:
        lines.append(f"fastest case: {_place(of.posed, solution.fastest)}; limits on the frequency are on that there")
    cover = solution.cover
    if cover is not None:
        means = f"by interval arithmetic on {cover.boxes} boxes" if cover.proven else "looked for, not proven"
        unit = unit_of_all(of.posed, "abscissa")
        limit = f"{number(cover.limit / unit.one)} {unit.text}".rstrip()
        lines.append(f"every case: abscissa at most {limit}, {means}")
    return lines


def _place(of: Posed, case: Case) -> str:
    """Values of scenarios and errors of parameters in a case."""
    at = [f"{n} = {_short(of, n, v)}" for n, v in case.at.items()]
    at += [f"{n} {'+' if v >= 0 else '−'} {_short(of, n, abs(v))}" for n, v in case.offset.items()]
    return ", ".join(at)


def _short(problem: Posed, name: str, value: float) -> str:
    return unit_of(problem, name).show(value, 6)
