"""Describes status and verdict of a solution, and defines the exception for problems without one."""

from typing import TYPE_CHECKING

from tmsopt.problem.unit_system import amounts_text
from tmsopt.problem.verdict.stability import UNSTABLE, describe_stability

if TYPE_CHECKING:
    from tmsopt.problem.problem import Posed
    from tmsopt.problem.solution import Solution


def status_text(problem: "Posed", status: str) -> str:
    """A status in words; with nothing free, an optimal design is called feasible."""
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
    unproved = "stopped before it was proved" if solution.interrupted else "not proved"
    known = ["proved"] if bound.proven else [*solution.starts.sureness, unproved]
    return f"optimal ({', '.join(known)})"


def describe_verdict(solution: "Solution") -> str:
    """The stability of a solution; if an unstable one was to be stable, also whether any design is."""
    problem, known, found = solution.problem, solution.any_stable, solution.stability
    located_none = problem.posed.sense == "locate" and solution.status == "not_converged"
    if located_none or (solution.status == "infeasible" and known is not False):
        return ""
    limited = problem.locate or len(problem.constraints) > len(problem.posed.asked_of_roots)
    limits = " and satisfies the constraints" if limited else ""
    none = f"no design within the ranges is stable{limits} (proved)"
    unknown = "" if solution.interrupted else "no stable design was found, but not proved that none exists"
    others = none if known is False else unknown
    sought = solution.stability_sought and not known
    if found.verdict != UNSTABLE:
        model = problem.model
        words = describe_stability(
            found, exact=solution.edge_is_exact, of_matrices=model.pencil is not None, of_H=model.carrier is not None
        )
        return f"{words}; {others}" if found.on_edge and sought and others else words
    if known:
        return "not stable, although some designs within the ranges are stable"
    if not (known is False or (sought and others)):
        return "not stable"
    return others if solution.status == "infeasible" else f"not stable: {others}"


class NotSolved(RuntimeError):
    """Raised by `solve` if it finds no optimal design; `solution` holds the best point found.

    Example:
        >>> swing = tmsopt.models.from_coefficients([1, "c", 1])  # no abscissa below -1
        >>> asked = tmsopt.Problem(swing, free={"c": (0, 3)}, minimize="c", constraints={"fast": "abscissa <= -2"})
        >>> try:
        ...     tmsopt.solve(asked)
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
