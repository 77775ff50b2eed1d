"""What a problem must ask before it is solved, and the counting of what is free against what is asked."""

from dataclasses import dataclass

from tmsopt.errors import Fault
from tmsopt.problem.problem import Posed


def question_faults(problem: Posed) -> list[Fault]:
    """What is wrong with solving a problem that has not one question; a chart needs none."""
    if problem.pareto:
        advice = "use tmsopt.pareto, or write minimize with one of the expressions"
        message = f"asks for a front, not for one design; {advice}"
        return [Fault(message, ("objective", "pareto"))]
    if not problem.free or problem.sense != "evaluate":
        return []
    message = (
        "parameters are free, but nothing is asked of them; write minimize, maximize or locate, "
        "or pareto for a front (chart and trace need none)"
    )
    return [Fault(message, ("objective",))]


@dataclass(frozen=True)
class Freedom:
    """Counting of a pattern problem before it is solved.

    Attributes:
        free: free parameters.
        conditions: codimension of the pattern plus the equality constraints.
    """

    free: int
    conditions: int

    @property
    def count(self) -> int:
        """Degrees of freedom left; negative when there are more conditions than parameters."""
        return self.free - self.conditions

    @property
    def kind(self) -> str:
        """``square``, ``under-determined`` or ``over-determined``."""
        return "square" if self.count == 0 else "under-determined" if self.count > 0 else "over-determined"


def degrees_of_freedom(problem: Posed) -> Freedom:
    """Degrees of freedom of a problem: free parameters against pattern conditions and equality constraints."""
    equalities = sum(c.equality for c in problem.conditions.values())
    return Freedom(len(problem.free), (problem.pattern.codimension if problem.pattern else 0) + equalities)
