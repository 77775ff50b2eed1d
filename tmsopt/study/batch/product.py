"""What the rows of a Monte Carlo study say: how many of the designs drawn are as they should be."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from tmsopt.records import Table
from tmsopt.study.batch.row import Row

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)

_Z = 1.959963984540054  # of the normal distribution, 97.5 % below


@dataclass(frozen=True)
class Share:
    """How many of how many, with the 95 % interval of Wilson for the share of all that could be drawn."""

    count: int
    of: int

    @property
    def share(self) -> float:
        """From 0 to 1; nan of none."""
        return self.count / self.of if self.of else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Least and greatest share that the count speaks for."""
        return wilson(self.count, self.of)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        low, high = self.interval
        return {"count": self.count, "of": self.of, "share": self.share if self.of else None, "interval": [low, high]}


@dataclass(frozen=True)
class Yield:
    """Shares of the rows drawn; rows that failed count in none of them.

    Attributes:
        stable: abscissa below 0, in the worst scenario.
        feasible: every constraint met.
        good: both.
        failed: rows without an answer.
        abscissa: quantile, such as ``0.95`` → the abscissa of the row there, in the worst scenario; inf where that
            row has a root at infinity.
    """

    stable: Share
    feasible: Share
    good: Share
    failed: int
    abscissa: Table[float]

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; numbers that do not exist are None."""
        return {
            "stable": self.stable.to_json(),
            "feasible": self.feasible.to_json(),
            "good": self.good.to_json(),
            "failed": self.failed,
            "abscissa": {q: v if math.isfinite(v) else None for q, v in self.abscissa.items()},
        }


def yield_of(rows: Iterable[Row]) -> Yield:
    """Shares of stable and feasible rows, and quantiles of their abscissa."""
    answered, failed, stable, feasible, good = [], 0, 0, 0, 0
    for row in rows:
        if row.status not in ("optimal", "infeasible"):
            failed += 1
            continue
        answered.append(math.inf if math.isnan(row.abscissa) else row.abscissa)
        stable += row.abscissa < 0
        feasible += row.status == "optimal"
        good += row.abscissa < 0 and row.status == "optimal"
    answered.sort()
    most = len(answered)
    at = {f"{q:g}": answered[max(math.ceil(q * most) - 1, 0)] for q in QUANTILES if most}
    return Yield(Share(stable, most), Share(feasible, most), Share(good, most), failed, Table(at))


def wilson(count: int, of: int, z: float = _Z) -> tuple[float, float]:
    """The score interval of a share (E. B. Wilson, J. Am. Stat. Assoc. 22, 209, 1927); 0 to 1 of none."""
    if of == 0:
        return 0.0, 1.0
    share, square = count / of, z * z
    middle = (share + square / (2 * of)) / (1 + square / of)
    half = z / (1 + square / of) * math.sqrt(share * (1 - share) / of + square / (4 * of * of))
    return (0.0 if count == 0 else middle - half), (1.0 if count == of else middle + half)
