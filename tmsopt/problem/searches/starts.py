"""How starts ended, and what that tells of optima that no start met."""

import math
from dataclasses import dataclass

_BETTER = 0.2  # optima that are better than the best one met and not met yet, expected where a search may end
_LIKELY = 0.5  # the same, from which one is likely
_MORE = 2  # starts of the solver beyond the optima met: those that only lead there have not shown any other


def expected_unseen(searches: int, optima: int) -> float:
    """Optima not met yet, expected after so many searches ended in so many different ones: w (w + 1)/(n − w − 2).

    Boender and Rinnooy Kan (1987), for searches from random starts, whatever the shares of the basins. inf where the
    searches are too few to tell.
    """
    rest = searches - optima - 2
    return optima * (optima + 1) / rest if rest > 0 else math.inf


def expects_few_better(searches: int, optima: int, most: float = _BETTER) -> bool:
    """Whether few enough optima are expected that no search met and that are better than all w that were.

    Where each rank is as likely as another, one of w + 1 is the best.
    """
    return expected_unseen(searches, optima) <= most * (optima + 1)


@dataclass(frozen=True)
class Starts:
    """How many starts were tried, converged to a feasible point, and ended at the best one.

    A design of a sample counts as a start, if a way down leads from it to where another start ended.

    Attributes:
        optima: values of the objective, or places, that starts ended at.
        looked: designs of the box that were looked at beside, to know where to start, and whether any is better.
        runs: starts from which the solver was run.

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
        """Optima that no start met, as estimated; inf where the starts are too few to tell."""
        return expected_unseen(self.converged, self.optima)

    def suffice(self, alone: int = 0) -> bool:
        """Whether few better optima are to be expected: where a search ends, and may be sure of its answer.

        Args:
            alone: designs that may lie in basins of their own, to be counted as searches and as optima.
        """
        enough = self.runs >= self.optima + _MORE
        return enough and expects_few_better(self.converged + alone, self.optima + alone)

    @property
    def sureness(self) -> tuple[str, ...]:
        """How sure it is, unless proved, that the best one met is the best there is; none where nothing was started.

        Example:
            >>> tmsopt.Starts(tried=64, converged=64, at_best=1, optima=30, runs=64).sureness
            ('found by 1 of 64 starts', 'a better one is likely')

        More: docs/explanation/proofs.md
        """
        if not self.tried:
            return ()
        by = f"found by {self.at_best} of {self.tried} start{'' if self.tried == 1 else 's'}"
        if self.at_best and self.suffice():
            return (by,)
        likely = self.at_best == 1 and not expects_few_better(self.converged, self.optima, _LIKELY)
        return by, f"a better one is {'likely' if likely else 'possible'}"
