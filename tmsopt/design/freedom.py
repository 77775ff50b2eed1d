"""Counting of a pattern problem before it is solved."""

from dataclasses import dataclass

from tmsopt.design.problem import Problem


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


def freedom(problem: Problem) -> Freedom:
    """Degrees of freedom of a problem: free parameters against pattern conditions and equality constraints."""
    equalities = sum(c.comparison == "==" for c in problem.conditions.values())
    return Freedom(len(problem.free), (problem.pattern.codimension if problem.pattern else 0) + equalities)
