"""Sentences about the structure of a solution and about the proofs of its quality."""

import math
from collections.abc import Sequence

from tmsopt.analysis.summary import describe_better, no_design, state_bound
from tmsopt.models.user_spectrum import describe_user_structure
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, RADIUS
from tmsopt.problem.real_form import has_real_form
from tmsopt.problem.solution import Bound, Solution
from tmsopt.problem.unit_system import common_unit
from tmsopt.problem.verdict.stability import MultipleRoot, describe_crossing

_DIGITS = 12
_NOT_COVERED = {ANGULAR_FREQUENCY: "frequencies", RADIUS: "the robustness radius"}


def structure_line(problem: Posed, structure: str, abscissa: float, multiple_roots: Sequence[MultipleRoot]) -> str:
    """The structure of the roots. If a multiple root is not defective, or this is unknown, the sentence says so.

    Args:
        multiple_roots: the multiple roots, rightmost first.
    """
    words = describe_user_structure(problem.model, structure, abscissa > 0)
    relevant_roots = (
        multiple_roots if problem.pattern is not None else [m for m in multiple_roots if m.re == multiple_roots[0].re]
    )
    if crossing := next((m for m in relevant_roots if not m.exceptional), None):
        return f"{words}: {describe_crossing(crossing)}"
    if multiple_roots and problem.model.pencil is None and "EP" in f"{problem.locate or ''}{structure}":
        return f"{words}; coefficients cannot tell whether the root is defective"
    return words


def proof_line(solution: Solution) -> str:  # noqa: PLR0911 - one per case
    """Whether it is proved that no solution is better; if not, what the user can do."""
    bound, problem = solution.bound, solution.problem.posed
    text = (problem.minimize or problem.maximize or "").strip()
    names = [words for name, words in _NOT_COVERED.items() if problem.asks(name)]
    not_covered = f"branch and bound does not cover {' or '.join(names)}" if names else ""
    if not names and not has_real_form(problem.model):
        not_covered = "--certify does not cover matrices without a characteristic polynomial"
    if solution.status == "infeasible":
        if bound.proven:
            return "no design meets all limits"
        statement = "no design is stable (proved); " if solution.any_stable is False else ""
        advice = not_covered or _advise_certify(bound, "--certify looks for a proof")
        return _append_advice(f"{statement}infeasibility is not proved{_search_effort(bound)}", advice)
    if not problem.free:
        return "nothing is free, so there is no optimum to prove; tmsopt prove proves the roots"
    if not text:
        if solution.status != "optimal":
            return f"not proved that no {problem.locate} exists"
        count = solution.freedom.count
        family = {1: "a curve", 2: "a surface"}.get(count, f"a {count}-parameter family")
        trace = ", which tmsopt trace follows" if count == 1 else ""
        family_text = f"; it belongs to {family} of such {problem.model.noun}s{trace}" if count > 0 else ""
        return f"tmsopt prove FILE tries to prove that this point exists exactly{family_text}"
    if bound.proven:
        return f"{no_design(problem)} {describe_better(solution, text)} (method {bound.method})"
    if math.isfinite(bound.value):
        unit = common_unit(problem, text)
        statement = f"{state_bound(problem, bound, unit)} (method {bound.method}), gap {unit.show(bound.gap, 2)}"
        statement += _search_effort(bound)
        return _append_advice(statement, not_covered or _advise_certify(bound, "--certify tries to reduce the gap"))
    advice = not_covered or _advise_certify(bound, "--certify looks for a proof or a better design")
    return _append_advice(f"not proved to be the best{_search_effort(bound)}", advice)


def bound_lines(solution: Solution) -> list[str]:
    """The value that no solution can beat, and how we know."""
    bound, problem = solution.bound, solution.problem.posed
    search = f"branch and bound with {bound.solver}, {bound.nodes} nodes, {bound.seconds:.1f} s"
    floating_proof = f"a floating-point proof, feasibility tolerance {bound.tolerance:.0e}"
    proof_kind = floating_proof if bound.tolerance else "a proof without a tolerance"
    if solution.status == "infeasible":
        how = f"{search}; {proof_kind}" if bound.solver else "interval arithmetic"
        return [f"proved: no design satisfies all constraints ({how})"] if bound.proven else []
    if not math.isfinite(bound.value):
        return [f"bound: none found in time ({search})"] if bound.seconds else []
    lines = [f"bound: {state_bound(problem, bound, digits=_DIGITS)} (method {bound.method}); gap {bound.gap:.1e}"]
    if bound.method == bound.solver.lower():
        lines.append(f"how: {search}; {proof_kind}")
    elif bound.seconds:
        lines.append(f"how: {search} found none better in time")
    return lines


def _append_advice(text: str, advice: str) -> str:
    return f"{text}; {advice}" if advice else text


def _advise_certify(bound: Bound, default: str) -> str:
    """Advice on --certify: twice the time if the time ran out; empty if branch and bound cannot solve the problem."""
    if not bound.solver:
        return default
    return f"--certify {max(2 * math.ceil(bound.seconds), 1)} continues the search" if bound.seconds else ""


def _search_effort(bound: Bound) -> str:
    return f" after {bound.seconds:.0f} s of {bound.solver}" if bound.solver and bound.seconds else ""
