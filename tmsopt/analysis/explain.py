"""What an optimum means: which limits it leans on and what they are worth, and how much rounding it bears."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from tmsopt.analysis.limits import Lever, levers
from tmsopt.analysis.optimality import Optimality, optimality
from tmsopt.analysis.rounding import Rounded, rounded_designs
from tmsopt.analysis.summary import summary, warnings
from tmsopt.problem.files import Given
from tmsopt.problem.solution import Bound
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Table, Tabular, plain
from tmsopt.search.solve import solve_if_needed


@dataclass(frozen=True, repr=False)
class Explanation(Tabular):
    """What `explain` has to say of a solution.

    Attributes:
        summary: one sentence: the structure on the rightmost line, and how good the design is.
        structure: of the design, as in the solution.
        bound: of the design, as in the solution.
        optimality: whether the design is a local optimum, by the multipliers of its factors.
        levers: the limits that bind, the most valuable first; empty unless the design is optimal.
        rounding: free parameter → the design with it alone rounded to 3 digits.
        precision: the design with all free parameters rounded to 2, 3, 4 and 6 digits.
        goal: what was optimised, or the pattern that was located; empty where nothing was asked.
        abscissa, value: of the design, and of its objective.
        warnings: arbitrary bounds that the design leans on, bounds touched for nothing, parameters without effect.

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
    rounding: Table[Rounded]
    precision: tuple[Rounded, ...]
    warnings: tuple[str, ...]
    goal: str
    abscissa: float
    value: float

    @property
    def worst(self) -> str:
        """The parameter whose rounding costs most; empty where none costs anything."""
        losing = {name: row.loss for name, row in self.rounding.items() if row.loss > 0}
        return max(losing, key=losing.__getitem__, default="")

    def records(self) -> Iterable[dict[str, Any]]:
        """The limits that bind, one a row."""
        return (lever.to_json() for lever in self.levers)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; numbers that do not exist are None."""
        found = plain(self, "summary optimality levers rounding worst precision warnings")
        return found | {"worst": self.worst or None}


def explain(design: Given, *, resolve: bool = True, progress: Listener | None = None) -> Explanation:
    """Say what a solution means; of one that is not optimal, what can be said.

    Args:
        resolve: check each multiplier by solving again with its limit moved, from the optimum; 30 ms or so each.
        progress: called with a `tmsopt.Progress` now and then.

    Example:
        >>> print(tmsopt.explain("problems/ep4.toml").summary)
        four roots meet in one (EP4): no design in the box decays faster (proven)

    More: docs/how_to/report.md
    """
    solution = solve_if_needed(design, progress)
    steps = start_steps(progress, "moving limits" if resolve else "weighing limits", "limit")
    problem = solution.problem.posed
    alone, together = rounded_designs(solution) if not solution.violations else (Table[Rounded](), ())
    return Explanation(
        summary=summary(solution),
        structure=solution.structure,
        bound=solution.bound,
        optimality=optimality(solution),
        levers=levers(solution, resolve, steps),
        rounding=alone,
        precision=together,
        warnings=warnings(solution),
        goal=problem.goal or (problem.locate or "").strip(),
        abscissa=solution.abscissa,
        value=solution.value,
    )
