"""Checks that a problem can be solved for one design, and counts its degrees of freedom."""

from dataclasses import dataclass

from tmsopt.errors import Fault
from tmsopt.problem.problem import Posed
from tmsopt.problem.symmetry import count_by_symmetry


def find_objective_faults(problem: Posed) -> list[Fault]:
    """Faults of a problem that does not ask for one design."""
    if problem.pareto:
        advice = "use tmsopt.pareto, or write minimize with one of the expressions"
        message = f"asks for a front, not for one design; {advice}"
        return [Fault(message, ("objective", "pareto"))]
    if not problem.free or problem.sense != "evaluate":
        return []
    message = (
        "parameters are free, but there is no objective; write minimize, maximize or locate, "
        "or pareto for a front (chart and trace need none)"
    )
    return [Fault(message, ("objective",))]


@dataclass(frozen=True)
class Freedom:
    """Degrees of freedom of a problem before it is solved.

    Attributes:
        free: free parameters.
        conditions: conditions of the pattern that do not hold by symmetry, and equality constraints.
        by_symmetry: further conditions of the pattern that hold for all parameters.
    """

    free: int
    conditions: int
    by_symmetry: int = 0

    @property
    def count(self) -> int:
        """Degrees of freedom; negative if there are more conditions than parameters."""
        return self.free - self.conditions

    @property
    def of_equations(self) -> int:
        """The same for equations that do not use the symmetry."""
        return self.count - self.by_symmetry

    @property
    def kind(self) -> str:
        """``square``, ``under-determined`` or ``over-determined``."""
        return "square" if self.count == 0 else "under-determined" if self.count > 0 else "over-determined"

    def describe_conditions(self) -> str:
        """All conditions in words, with the number of those that hold by symmetry."""
        total = self.conditions + self.by_symmetry
        symmetry = f", {self.by_symmetry} by symmetry" if self.by_symmetry else ""
        return f"{total} condition{'s' * (total != 1)}{symmetry}"


def degrees_of_freedom(problem: Posed) -> Freedom:
    """Count free parameters, pattern conditions and equality constraints of a problem."""
    equalities, by_symmetry = sum(c.equality for c in problem.conditions.values()), count_by_symmetry(problem)
    codimension = problem.pattern.codimension if problem.pattern else 0
    return Freedom(len(problem.free), codimension - by_symmetry + equalities, by_symmetry)
