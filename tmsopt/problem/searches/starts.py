"""Counts how starts ended, and estimates how many optima no start found."""

import math
from dataclasses import dataclass

_BETTER = 0.2  # a search may end if no more unseen better optima are expected
_LIKELY = 0.5  # a better optimum is likely if more are expected
_EXTRA_RUNS = 2  # least number of solver runs above the number of optima found


def expected_unseen(searches: int, optima: int) -> float:
    """Expected number of optima not found yet, w (w + 1)/(n − w − 2), after n searches that found w different ones.

    Valid for random starts and any sizes of the basins (Boender and Rinnooy Kan 1987); inf if n is too small.
    """
    rest = searches - optima - 2
    return optima * (optima + 1) / rest if rest > 0 else math.inf


def expects_few_better(searches: int, optima: int, most: float = _BETTER) -> bool:
    """Whether at most `most` unseen optima better than all found are expected.

    Each unseen optimum is the best with probability 1/(w + 1), if all ranks are equally likely.
    """
    return expected_unseen(searches, optima) <= most * (optima + 1)


@dataclass(frozen=True)
class Starts:
    """How many starts were tried, converged to a feasible point, and ended at the best one.

    A sampled design counts as a start if a descent leads from it to where another start ended.

    Attributes:
        optima: different values of the objective, or places, where starts ended.
        looked: further designs that were sampled, to choose starts and to check that none is better.
        runs: starts from which the solver ran.

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
        """Whether so few better optima are expected that a search may end.

        Args:
            alone: designs that may lie in basins of their own; they count as searches and as optima.
        """
        enough = self.runs >= self.optima + _EXTRA_RUNS
        return enough and expects_few_better(self.converged + alone, self.optima + alone)

    @property
    def sureness(self) -> tuple[str, ...]:
        """Phrases on how certain the best optimum is if it is not proved; none without starts.

        Example:
            >>> tmsopt.Starts(tried=64, converged=64, at_best=1, optima=30, runs=64).sureness
            ('found from 1 of 64 starts', 'a better design is likely')

        More: docs/explanation/proofs.md
        """
        if not self.tried:
            return ()
        by = f"found from {self.at_best} of {self.tried} start{'' if self.tried == 1 else 's'}"
        if self.at_best and self.suffice():
            return (by,)
        likely = self.at_best == 1 and not expects_few_better(self.converged, self.optima, _LIKELY)
        return by, f"a better design is {'likely' if likely else 'possible'}"
