"""Explains an optimum: its active limits and their value, its optimality, and the effect of rounding."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from tmsopt.analysis.limits import Lever, find_levers
from tmsopt.analysis.optimality import Optimality, optimality
from tmsopt.analysis.rounding import RoundedDesign, list_rounded_designs
from tmsopt.analysis.summary import list_warnings, summarise
from tmsopt.problem.files import ProblemSource
from tmsopt.problem.solution import Bound
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Table, Tabular, plain
from tmsopt.search.solve import solve_if_needed


@dataclass(frozen=True, repr=False)
class Explanation(Tabular):
    """Explanation of a solution.

    Attributes:
        summary: one sentence about the structure of the rightmost roots and the quality of the design.
        structure, bound: as in the solution.
        optimality: whether the design is a local optimum, by the multipliers of its factors.
        levers: the active limits, the most valuable first; empty unless the design is optimal.
        rounding: free parameter → the design with only this parameter rounded, to 3 digits.
        precision: the design with all free parameters rounded to 2, 3, 4 and 6 digits.
        goal: the objective or the located pattern; empty if the problem has neither.
        abscissa, value: abscissa of the design, and value of its objective.
        warnings: arbitrary active bounds, bounds that are reached without a gain, parameters without effect.

    Example:
        >>> explained = tmsopt.explain("problems/ep4.toml", resolve=False)
        >>> explained.structure, explained.optimality.verdict
        ('EP4', 'strict minimum')

    More: docs/how_to/report.md
    """

    summary: str
    structure: str
    bound: Bound
    optimality: Optimality
    levers: tuple[Lever, ...]
    rounding: Table[RoundedDesign]
    precision: tuple[RoundedDesign, ...]
    warnings: tuple[str, ...]
    goal: str
    abscissa: float
    value: float

    @property
    def worst(self) -> str:
        """The parameter whose rounding worsens the abscissa most; empty if rounding worsens nothing."""
        losses = {name: row.loss for name, row in self.rounding.items() if row.loss > 0}
        return max(losses, key=losses.__getitem__, default="")

    def records(self) -> Iterable[dict[str, Any]]:
        """The active limits, one per row."""
        return (lever.to_json() for lever in self.levers)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; numbers that do not exist are None."""
        data = plain(self, "summary optimality levers rounding worst precision warnings")
        return data | {"worst": self.worst or None}


def explain(design: ProblemSource, *, resolve: bool = True, progress: Listener | None = None) -> Explanation:
    """Explain a solution. A solution that is not optimal gets fewer facts.

    Args:
        resolve: check each multiplier: move its limit and solve again from the optimum, which takes about 30 ms.
        progress: called with a `tmsopt.Progress` now and then.

    Example:
        >>> print(tmsopt.explain("problems/ep4.toml").summary)
        four roots coincide (EP4): no design within the limits decays faster (proved)

    More: docs/how_to/report.md
    """
    solution = solve_if_needed(design, progress)
    steps = start_steps(progress, "moving limits" if resolve else "computing multipliers", "limit")
    problem = solution.problem.posed
    rounded_alone, rounded_together = (
        list_rounded_designs(solution) if not solution.violations else (Table[RoundedDesign](), ())
    )
    return Explanation(
        summary=summarise(solution),
        structure=solution.structure,
        bound=solution.bound,
        optimality=optimality(solution),
        levers=find_levers(solution, resolve, steps),
        rounding=rounded_alone,
        precision=rounded_together,
        warnings=list_warnings(solution),
        goal=problem.goal or (problem.locate or "").strip(),
        abscissa=solution.abscissa,
        value=solution.value,
    )
