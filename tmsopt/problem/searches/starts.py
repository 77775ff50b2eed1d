"""Counts how starts ended, and estimates how many optima no start found."""

import math
from dataclasses import dataclass

_FEW_BETTER = 0.2  # a search may end if at most this number of better optima that no start found is expected
_LIKELY_BETTER = 0.5  # a better optimum is likely if more than this number is expected
_EXTRA_RUNS = 2  # the solver must run at least this number of times more than there are different optima


def expected_unseen(searches: int, optima: int) -> float:
    """Expected number of optima that n searches did not find, w (w + 1)/(n − w − 2), if they found w different ones.

    Valid for random starts and any sizes of the basins (Boender and Rinnooy Kan 1987); inf if n is too small.
    """
    denominator = searches - optima - 2
    return optima * (optima + 1) / denominator if denominator > 0 else math.inf


def expects_few_better(searches: int, optima: int, limit: float = _FEW_BETTER) -> bool:
    """Whether at most `limit` better optima are expected that no search found.

    With w optima found, each other optimum is better than all of them with probability 1/(w + 1).
    """
    return expected_unseen(searches, optima) <= limit * (optima + 1)


@dataclass(frozen=True)
class Starts:
    """The numbers of starts that were tried, that converged to a feasible point, and that ended at the best point.

    A sampled design counts as a start if a descent leads from it to a point where another start ended.

    Attributes:
        optima: number of optima where starts ended, with different values of the objective or different parameters.
        looked: number of other designs that were sampled, to choose starts and to check that none is better.
        runs: number of starts from which the solver ran.

    Example:
        >>> starts = tmsopt.solve("problems/ep4.toml").starts
        >>> 1 <= starts.at_best <= starts.converged <= starts.tried
        True

    More: docs/how_to/report.md
    """

    tried: int = 0
    converged: int = 0
    at_best: int = 0
    looked: int = 0
    optima: int = 0
    runs: int = 0

    @property
    def expected_unseen(self) -> float:
        """Estimated number of optima that no start found; inf if there are too few starts."""
        return expected_unseen(self.converged, self.optima)

    def suffice(self, alone: int = 0) -> bool:
        """Whether a search may end, because few better optima are expected.

        Args:
            alone: designs that may lie in basins of their own; they count as searches and as optima.
        """
        has_enough_runs = self.runs >= self.optima + _EXTRA_RUNS
        return has_enough_runs and expects_few_better(self.converged + alone, self.optima + alone)

    @property
    def sureness(self) -> tuple[str, ...]:
        """Phrases on how certain the best optimum is if it is not proved; empty without starts.

        Example:
            >>> tmsopt.Starts(tried=64, converged=64, at_best=1, optima=30, runs=64).sureness
            ('found from 1 of 64 starts', 'a better design is likely')

        More: docs/explanation/proofs.md
        """
        if not self.tried:
            return ()
        origin = f"found from {self.at_best} of {self.tried} start{'' if self.tried == 1 else 's'}"
        if self.at_best and self.suffice():
            return (origin,)
        is_likely = self.at_best == 1 and not expects_few_better(self.converged, self.optima, _LIKELY_BETTER)
        return origin, f"a better design is {'likely' if is_likely else 'possible'}"
