"""What a design means, beside its numbers: for a reader and for JSON."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tmsopt.design.solution import Solution
    from tmsopt.diagnosis.diagnosis import Diagnosis
    from tmsopt.explanation.explain import Explanation
    from tmsopt.margins.nearest import Robustness


def meaning(solution: "Solution") -> dict[str, Any]:
    """What the optimum means, for JSON."""
    robust, found = _robust(solution), _diagnosed(solution)
    return {
        "meaning": _explained(solution).to_json(),
        **({"robustness": robust.to_json()} if robust else {}),
        **({"diagnosis": [d.to_json() for d in found]} if found else {}),
    }


def meaning_lines(solution: "Solution", brief: bool, details: bool) -> Iterator[str]:
    """The same as text: nothing if brief, but for the details of multiple roots where these are asked for."""
    if not brief:
        from tmsopt.show.explained import explained_lines

        yield from ["", *explained_lines(_explained(solution))]
        if robust := _robust(solution):
            from tmsopt.show.robust import robustness_table

            nominal = "of the nominal design, without its scenarios and tolerances:\n" if solution.worst else ""
            yield "\n" + nominal + robustness_table(robust)
    if not brief or details:
        from tmsopt.show.diagnosis import diagnosis_lines

        if lines := diagnosis_lines(_diagnosed(solution), details):
            yield from ["", *lines]


def _explained(solution: "Solution") -> "Explanation":
    from tmsopt.explanation.explain import explain

    return explain(solution)


def _robust(solution: "Solution") -> "Robustness | None":
    """The nearest boundaries; None where a root is at infinity, or nothing feasible was found."""
    from tmsopt.margins.nearest import robustness

    if not math.isfinite(solution.abscissa) or solution.status == "infeasible":
        return None
    return robustness(solution)


def _diagnosed(solution: "Solution") -> "tuple[Diagnosis, ...]":
    """The multiple roots of a design that was found."""
    from tmsopt.diagnosis.diagnosis import diagnose

    return diagnose(solution) if solution.status == "optimal" else ()
