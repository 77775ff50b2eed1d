"""What the rows of a study say together."""

import math
import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from statistics import median
from typing import Any

from tmsopt.records import Table
from tmsopt.study.batch.plan import Study
from tmsopt.study.batch.product import Yield, yield_of
from tmsopt.study.batch.row import STATUSES, Row

_AMOUNT = re.compile(r" by [-+\d.e]+")
_NUMBER = re.compile(r"[-+]?\d[\d.]*(e[-+]?\d+)?")


@dataclass(frozen=True)
class Summary:
    """A study in a few numbers.

    Attributes:
        rows: in the study.
        counts: status → rows that have it.
        best: the optimal row with the best objective; None where there is none.
        causes: cause of rows that are not optimal → how many have it, numbers in it aside, the commonest first.
        spread: ``objective``, ``abscissa`` → least, median and greatest over the optimal rows.
        stable: rows whose abscissa is below 0.
        structures: structure → optimal rows that have it, the commonest first.
        proven: rows whose bound is closed.
        warm: rows started from a neighbour's optimum.
        laws: law → greatest relative residual over the rows in which it applies.
        seconds: that the rows took, one after the other.
        product: of a Monte Carlo study, the shares that are as they should be.
    """

    rows: int
    counts: Table[int]
    best: Row | None
    causes: Table[int]
    spread: Table[tuple[float, float, float]]
    stable: int
    structures: Table[int]
    proven: int
    warm: int
    laws: Table[float]
    seconds: float
    product: Yield | None = None

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        return {
            "rows": self.rows,
            "counts": dict(self.counts),
            "best": None if self.best is None else self.best.to_json(),
            "causes": dict(self.causes),
            "spread": {n: dict(zip(("min", "median", "max"), ends, strict=True)) for n, ends in self.spread.items()},
            "stable": self.stable,
            "structures": dict(self.structures),
            "proven": self.proven,
            "warm": self.warm,
            "laws": dict(self.laws),
            "row_seconds": round(self.seconds, 4),
            **({"monte_carlo": self.product.to_json()} if self.product else {}),
        }


def summary(study: Study, rows: Iterable[Row]) -> Summary:
    """The rows of a study, read once."""
    known = list(rows)
    optimal = [row for row in known if row.status == "optimal"]
    counts = Counter(row.status for row in known)
    sign = -1.0 if study.problem.sense == "maximize" else 1.0
    ranked = [row for row in optimal if math.isfinite(row.objective)]
    laws: dict[str, float] = {}
    for row in known:
        for label, residual in row.laws.items():
            laws[label] = max(laws.get(label, 0.0), abs(residual))
    return Summary(
        rows=len(study),
        counts=Table({status: counts[status] for status in STATUSES if counts[status]}),
        best=min(ranked, key=lambda row: sign * row.objective, default=None),
        causes=_causes(row for row in known if row.status != "optimal"),
        spread=Table({name: ends for name in ("objective", "abscissa") if (ends := _ends(name, optimal))}),
        stable=sum(row.abscissa < 0 for row in known),
        structures=_ranked(row.structure for row in optimal),
        proven=sum(row.proven for row in known),
        warm=sum(row.warm for row in known),
        laws=Table(laws),
        seconds=sum(row.seconds for row in known),
        product=yield_of(known) if study.method == "monte_carlo" else None,
    )


def _causes(rows: Iterable[Row]) -> Table[int]:
    alike: dict[str, list[str]] = {}
    for row in rows:
        alike.setdefault(_NUMBER.sub("#", row.cause), []).append(row.cause)
    ranked = sorted(alike.values(), key=len, reverse=True)
    return Table({causes[0] if len(causes) == 1 else _AMOUNT.sub("", causes[0]): len(causes) for causes in ranked})


def _ranked(names: Iterable[str]) -> Table[int]:
    return Table(dict(Counter(names).most_common()))


def _ends(name: str, rows: Iterable[Row]) -> tuple[float, float, float] | None:
    values = sorted(v for v in (getattr(row, name) for row in rows) if math.isfinite(v))
    return (values[0], median(values), values[-1]) if values else None
