"""Summary of the rows of a study."""

import math
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tmsopt.problem import rate_of
from tmsopt.records import Array, Table, plain
from tmsopt.studies.rows import STATUSES, Row, RowTable, header

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Quantiles of the abscissa in a `Yield`."""


@dataclass(frozen=True)
class Share:
    """A count out of a total (`of`), with Wilson's 95 % interval for the share in the population."""

    count: int
    of: int

    @property
    def share(self) -> float:
        """The share, from 0 to 1; nan if the total is 0."""
        return self.count / self.of if self.of else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval of the share."""
        from scipy.stats import binomtest

        if not self.of:
            return 0.0, 1.0
        interval = binomtest(self.count, self.of).proportion_ci(method="wilson")
        return float(interval.low), float(interval.high)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        return plain(self, "count of share interval")


@dataclass(frozen=True)
class Yield:
    """Shares of the rows of a Monte Carlo study; failed rows do not count.

    Attributes:
        stable: rows with all roots left of the imaginary axis, in the worst scenario.
        feasible: rows that satisfy every constraint.
        good: rows that are stable and feasible.
        failed: number of rows without a result.
        abscissa: quantile, such as ``0.95`` → abscissa in the worst scenario; inf for a root at infinity.
    """

    stable: Share
    feasible: Share
    good: Share
    failed: int
    abscissa: Table[float]

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; nan is None."""
        return plain(self)


_AMOUNT = re.compile(r" by [-+\d.e]+( [^\s,;]+)?")  # the amount of a violation in the text of a cause
_NUMBER = re.compile(r"[-+]?\d[\d.]*(e[-+]?\d+)?")  # any number in the text of a cause


@dataclass(frozen=True)
class Summary:
    """Summary of a study.

    Attributes:
        rows: number of rows in the study.
        counts: status → number of rows.
        best: the optimal row with the best objective; None if there is none.
        causes: cause of rows that are not optimal → number of rows, the most frequent first; causes that differ only in
            their numbers are counted together.
        spread: ``objective``, ``abscissa`` → minimum, median and maximum over the optimal rows.
        stable: number of rows with a stable design.
        structures: structure → number of optimal rows, the most frequent first.
        proven: number of rows with a proved optimum.
        warm: number of rows started from a neighbour's optimum.
        laws: law → largest relative residual over the rows in which it applies.
        seconds: total time of all rows.
        product: the yield of a Monte Carlo study, else None.
        clocked: the spread, and the ``quantiles`` of `product`, converted from √(g/w) to 1/s if that is possible.
    """

    rows: int
    counts: Table[int]
    best: Row | None
    causes: Table[int]
    spread: Table[tuple[float, ...]]
    stable: int
    structures: Table[int]
    proven: int
    warm: int
    laws: Table[float]
    seconds: float
    product: Yield | None = None
    clocked: Table[tuple[float, ...]] = Table()

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        spread = {n: dict(zip(("min", "median", "max"), ends, strict=True)) for n, ends in self.spread.items()}
        return {
            **(plain(self, "rows counts best causes spread stable structures proven warm laws") | {"spread": spread}),
            "row_seconds": round(self.seconds, 4),
            **({"monte_carlo": self.product.to_json()} if self.product else {}),
        }


def summarise(rows: RowTable) -> Summary:
    """Summarise the rows of a study."""
    study, status = rows.study, rows.values("status")
    counts, is_optimal = Counter(status.tolist()), status == "optimal"
    values = {name: rows.values(name) for name in ("objective", "abscissa")}
    values_per_second = _convert_to_per_second(rows, values)
    signed_objective = study.problem.posed.sign * values_per_second.get("objective", values["objective"])
    costs = np.where(is_optimal & np.isfinite(signed_objective), signed_objective, np.inf)  # the best is the smallest
    spread, spread_per_second = (
        {name: ends for name, x in columns.items() if (ends := _compute_spread(x[is_optimal]))}
        for columns in (values, values_per_second)
    )
    product = compute_yield(rows) if study.method == "monte_carlo" else None
    if product and "abscissa" in values_per_second:
        has_result = is_optimal | (status == "infeasible")
        spread_per_second["quantiles"] = _compute_quantiles(values_per_second["abscissa"][has_result])
    laws = {key: rows.column(head).compressed() for head, (name, key) in rows.headers.items() if name == "laws"}
    return Summary(
        rows=len(study),
        counts=Table({status: counts[status] for status in STATUSES if counts[status]}),
        best=rows[int(np.argmin(costs))] if np.isfinite(costs).any() else None,
        causes=_count_causes(rows),
        spread=Table(spread),
        stable=int(rows.column("stable").sum() or 0),
        structures=Table(dict(Counter(rows.values("structure")[is_optimal].tolist()).most_common())),
        proven=int(rows.values("proven").sum()),
        warm=int(rows.values("warm").sum()),
        laws=Table({name: float(np.abs(residuals).max()) for name, residuals in laws.items() if residuals.size}),
        seconds=float(rows.values("seconds").sum()),
        product=product,
        clocked=Table(spread_per_second),
    )


def _convert_to_per_second(rows: RowTable, values: Mapping[str, Array]) -> dict[str, Array]:
    """Objective and abscissa of every row, converted from √(g/w) to 1/s if possible; w may differ between rows."""
    problem = rows.study.problem.posed
    parameters = {name: rows.values(header("parameters", name)) for name in problem.parameter_set.names}
    texts = {"objective": problem.goal, "abscissa": "abscissa"}
    rates = {name: rate_of(problem, text, parameters) for name, text in texts.items() if text}
    return {name: values[name] * rate for name, rate in rates.items() if rate is not None}


def _count_causes(rows: RowTable) -> Table[int]:
    groups: dict[str, list[str]] = {}
    for text in rows.values("cause")[rows.values("status") != "optimal"].tolist():
        groups.setdefault(_NUMBER.sub("#", text), []).append(text)
    sorted_groups = sorted(groups.values(), key=len, reverse=True)
    return Table({texts[0] if len(texts) == 1 else _AMOUNT.sub("", texts[0]): len(texts) for texts in sorted_groups})


def _compute_spread(values: Array) -> tuple[float, ...]:
    numbers = values[np.isfinite(values)]
    return tuple(float(statistic(numbers)) for statistic in (np.min, np.median, np.max)) if numbers.size else ()


def compute_yield(rows: RowTable) -> Yield:
    """Shares of stable and of feasible rows, and quantiles of the abscissa, over all rows that have a result."""
    status, is_stable = rows.values("status"), rows.column("stable").filled(False)
    is_feasible = status == "optimal"
    has_result = is_feasible | (status == "infeasible")
    total = int(has_result.sum())
    values = _compute_quantiles(rows.values("abscissa")[has_result])
    quantiles = zip((f"{q:g}" for q in QUANTILES), values, strict=False)
    masks = is_stable, is_feasible, is_stable & is_feasible
    stable, feasible, good = (Share(int((mask & has_result).sum()), total) for mask in masks)
    return Yield(stable, feasible, good, len(status) - total, Table(dict(quantiles)))


def _compute_quantiles(abscissa: Array) -> tuple[float, ...]:
    ascending = np.sort(np.where(np.isnan(abscissa), np.inf, abscissa)).tolist()
    return tuple(ascending[math.ceil(q * len(ascending)) - 1] for q in QUANTILES if ascending)
