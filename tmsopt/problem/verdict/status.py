"""Describes the status and the verdict of a solution, and defines the exception for problems without a solution."""

from typing import TYPE_CHECKING

from tmsopt.problem.unit_system import amounts_text
from tmsopt.problem.verdict.stability import UNSTABLE, describe_stability

if TYPE_CHECKING:
    from tmsopt.problem.problem import Posed
    from tmsopt.problem.solution import Solution


def status_text(problem: "Posed", status: str) -> str:
    """A status in words; if no parameter is free, an optimal design is called feasible."""
    return "feasible" if status == "optimal" and not problem.free else status.replace("_", " ")


def describe_status(solution: "Solution") -> str:
    """The status of a solution for a headline."""
    problem, bound, status = solution.problem, solution.bound, solution.status
    if solution.interrupted and status != "optimal":
        return "stopped before the end, the best design so far"
    if status == "infeasible":
        return f"infeasible{'' if problem.free else ' as given'}{' (proved)' if bound.proven else ''}"
    if solution.without_best:
        return "no best design exists"
    if status != "optimal":
        return "none found" if problem.posed.sense == "locate" else "not converged, so a better design may be near"
    if problem.posed.objective is None or not problem.free:
        return "found" if problem.free else "as given"
    doubt = "stopped before it was proved" if solution.interrupted else "not proved"
    sureness = solution.starts.sureness
    evidence = ["proved"] if bound.proven else [*sureness[:1], doubt, *sureness[1:]]
    return f"optimal ({', '.join(evidence)})"


def describe_verdict(solution: "Solution") -> str:
    """The stability of a solution in words; if no stable design was found, also whether one exists."""
    problem, any_stable, stability = solution.problem, solution.any_stable, solution.stability
    located_none = problem.posed.sense == "locate" and solution.status == "not_converged"
    if located_none or (solution.status == "infeasible" and any_stable is not False):
        return ""
    is_limited = problem.locate or len(problem.constraints) > len(problem.posed.asked_of_roots)
    limits = " that satisfies the constraints" if is_limited else ""
    model = problem.posed.model
    proof = f"no {model.noun} within the ranges{limits} is stable (proved)"
    doubt = "" if solution.interrupted else f"no stable {model.noun} was found, but not proved that none exists"
    remark = proof if any_stable is False else doubt
    is_sought = solution.stability_sought and not any_stable
    words = describe_stability(
        stability,
        is_exact=solution.edge_is_exact,
        has_matrices=model.pencil is not None,
        is_complex=model.is_complex,
    )
    if stability.verdict != UNSTABLE:
        return f"{words}; {remark}" if stability.on_edge and is_sought and remark else words
    if any_stable:
        return f"{words}, although some {model.noun}s within the ranges are stable"
    if not (any_stable is False or (is_sought and remark)):
        return words
    return remark if solution.status == "infeasible" else f"{words}: {remark}"


class NotSolved(RuntimeError):
    """Raised by `solve` if it finds no optimal design; `solution` holds the best point found.

    Example:
        >>> swing = tmsopt.models.from_coefficients([1, "c", 1])  # no abscissa below -1
        >>> fast = tmsopt.Problem(swing, free={"c": (0, 3)}, minimize="c", constraints={"decay": "abscissa <= -2"})
        >>> try:
        ...     tmsopt.solve(fast)
        ... except tmsopt.NotSolved as error:
        ...     print(error.solution.status)
        infeasible

    More: docs/how_to/infeasible.md
    """

    def __init__(self, solution: "Solution") -> None:
        self.solution, violated = solution, amounts_text(solution.problem.posed, solution.violations)
        super().__init__(
            f"{solution.problem.title or 'problem'}: {solution.status}"
            + (f"; violated: {violated}" if violated else "")
            + "".join(f"; {note}" for note in solution.notes)
        )

    def __reduce__(self) -> tuple[type["NotSolved"], tuple["Solution"]]:
        return NotSolved, (self.solution,)
