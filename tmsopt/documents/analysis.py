"""The analyses of a solution that its report shows. Each one is computed at its first use and then stored."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property

from tmsopt.analysis import Diagnosis, Explanation, diagnose, explain, infeasible_sentences
from tmsopt.boundaries import Robustness, find_stability_margins, robustness
from tmsopt.dynamics import stable_speeds
from tmsopt.errors import InputError
from tmsopt.problem.real_form import has_real_form
from tmsopt.problem.solution import Solution
from tmsopt.progress import Listener, start_steps


@dataclass(eq=False)
class Analysis:
    """The analyses of one solution. An analysis that does not apply is None or empty.

    Example:
        >>> analysis = tmsopt.solve("problems/benchmark.toml").analysis
        >>> [[f"{v:.6f} m/s" for v in band] for band in analysis.stable_speeds]  # above the weave speed
        [['2.841008 m/s', 'inf m/s']]

    More: docs/how_to/report.md
    """

    solution: Solution
    _progress: Listener | None = None

    @contextmanager
    def report_progress(self, progress: Listener | None) -> Iterator["Analysis"]:
        """Report progress to a listener while analyses are computed in this context."""
        self._progress = progress
        try:
            yield self
        finally:
            self._progress = None

    @cached_property
    def explanation(self) -> Explanation | None:
        """Active limits and their effect to first order, warnings, rounding, local optimality."""
        return None if self.solution.interrupted else explain(self.solution, resolve=False, progress=self._progress)

    @cached_property
    def full_explanation(self) -> Explanation | None:
        """The explanation with each active limit moved and the problem solved again."""
        return None if self.solution.interrupted else explain(self.solution, progress=self._progress)

    @cached_property
    def robustness(self) -> Robustness | None:
        """The nearest boundaries of stability; the boundary of heavy damping is left out."""
        if not self._can_be_analysed:
            return None
        start_steps(self._progress, "looking for the nearest boundaries")
        return find_stability_margins(self.solution.problem.posed, self.solution.parameters)

    @cached_property
    def boundaries(self) -> Robustness | None:
        """The nearest boundaries of stability and of heavy damping."""
        return robustness(self.solution, progress=self._progress) if self._can_be_analysed else None

    @cached_property
    def stable_speeds(self) -> tuple[tuple[float, float], ...] | None:
        """Bands of the speed in which the design is stable; None if it has no speed or several speeds."""
        try:
            return stable_speeds(self.solution) if self._can_be_analysed else None
        except InputError:
            return None

    @cached_property
    def diagnoses(self) -> tuple[Diagnosis, ...]:
        """The kind of each multiple root and how it splits; empty for a solution that is not optimal."""
        optimal = self.solution.status == "optimal" and not self.solution.interrupted
        return diagnose(self.solution, progress=self._progress) if optimal else ()

    @cached_property
    def obstacles(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Two tuples of sentences on why the problem has no answer: for every report, and only for a full report."""
        brief, complete = (infeasible_sentences(self.solution, full) for full in (False, True))
        return tuple(brief), tuple(complete[len(brief) :])

    @property
    def _can_be_analysed(self) -> bool:
        solution = self.solution
        is_solved = solution.status != "infeasible" and not solution.interrupted
        return math.isfinite(solution.abscissa) and is_solved and has_real_form(solution.problem.model)
