"""What the rows of a study say together."""

import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tmsopt.problem import rate_of
from tmsopt.records import Array, Table, Truth, plain
from tmsopt.studies.rows import PREFIXES, STATUSES, PartialColumn, Row, RowTable, columns
from tmsopt.studies.study import Study

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
LAW = PREFIXES["laws"]
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
        return plain(self, "count of share interval")


@dataclass(frozen=True)
class Yield:
    """Shares of the rows drawn; rows that failed count in none of them.

    Attributes:
        stable: all roots left of the axis, in the worst scenario.
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
        return plain(self)


_AMOUNT = re.compile(r" by [-+\d.e]+( [^\s,;]+)?")
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
        stable: rows whose design is stable.
        structures: structure → optimal rows that have it, the commonest first.
        proven: rows whose bound is closed.
        warm: rows started from a neighbour's optimum.
        laws: law → greatest relative residual over the rows in which it applies.
        seconds: that the rows took, one after the other.
        product: of a Monte Carlo study, the shares that are as they should be.
        clocked: the spread, and the ``quantiles`` of `product`, in 1/s; of what is per √(g/w) where a second is known.
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
    clocked: Table[tuple[float, ...]] = field(default_factory=Table)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        spread = {n: dict(zip(("min", "median", "max"), ends, strict=True)) for n, ends in self.spread.items()}
        return {
            **(plain(self, "rows counts best causes spread stable structures proven warm laws") | {"spread": spread}),
            "row_seconds": round(self.seconds, 4),
            **({"monte_carlo": self.product.to_json()} if self.product else {}),
        }


def summary(study: Study, rows: Iterable[Row]) -> Summary:
    """The rows of a study, read once."""
    known = rows if isinstance(rows, Sequence) else list(rows)
    table = columns(known)
    values = {name: table[name].values for name in ("status", "objective", "abscissa", "structure", "proven", "warm")}
    status, objective = values["status"], values["objective"]
    counts, optimal = Counter(status.tolist()), status == "optimal"
    clocked = _clocked(study, table, values)
    judged = clocked.get("objective", objective)
    ranked = np.flatnonzero(optimal & np.isfinite(judged))
    best = ranked[np.argmin(study.problem.sign * judged[ranked])] if ranked.size else None
    answered = optimal | (status == "infeasible")
    quantiles = study.method == "monte_carlo" and "abscissa" in clocked
    in_seconds: dict[str, tuple[float, ...]] = {n: ends for n, x in clocked.items() if (ends := _ends(x[optimal]))}
    in_seconds |= {"quantiles": tuple(_quantiles(clocked["abscissa"][answered]))} if quantiles else {}
    laws = {
        name.removeprefix(LAW): float(np.fmax.reduce(np.abs(column.values[column.present]), initial=0.0))
        for name, column in table.items()
        if name.startswith(LAW)
    }
    return Summary(
        rows=len(study),
        counts=Table({status: counts[status] for status in STATUSES if counts[status]}),
        best=None if best is None else known[int(best)],
        causes=_causes(known),
        spread=Table({n: ends for n in ("objective", "abscissa") if (ends := _ends(values[n][optimal]))}),
        stable=int(_stable(table).sum()),
        structures=_ranked(values["structure"][optimal].tolist()),
        proven=int(values["proven"].sum()),
        warm=int(values["warm"].sum()),
        laws=Table(laws),
        seconds=float(table["seconds"].values.sum()),
        product=yield_of(known) if study.method == "monte_carlo" else None,
        clocked=Table(in_seconds),
    )


def _clocked(study: Study, table: Mapping[str, PartialColumn], values: Mapping[str, Array]) -> dict[str, Array]:
    """Objective and abscissa of every row in 1/s, where they are per √(g/w) and a second is known: w may differ."""
    problem, found = study.problem, {}
    parameters = {n: table[n].values for n in problem.parameter_set.names if n in table}
    for name, text in (("objective", problem.minimize or problem.maximize), ("abscissa", "abscissa")):
        if text and parameters and (rates := rate_of(problem, text, parameters)) is not None:
            found[name] = values[name] * rates
    return found


def _stable(table: Mapping[str, PartialColumn]) -> Truth:
    column = table["stable"]
    return np.asarray(column.values.astype(bool) & column.present)


def _causes(rows: Sequence[Row]) -> Table[int]:
    each = ((row.cause, 1) for row in rows if row.status != "optimal")
    alike: dict[str, list[tuple[str, int]]] = {}
    for text, count in rows.causes() if isinstance(rows, RowTable) else each:
        alike.setdefault(_NUMBER.sub("#", text), []).append((text, count))
    counted = [(same[0][0], sum(count for _, count in same)) for same in alike.values()]
    ranked = sorted(counted, key=lambda pair: pair[1], reverse=True)
    return Table({text if count == 1 else _AMOUNT.sub("", text): count for text, count in ranked})


def _ranked(names: Iterable[str]) -> Table[int]:
    return Table(dict(Counter(names).most_common()))


def _ends(values: Array) -> tuple[float, float, float] | None:
    known = np.sort(values[np.isfinite(values)])
    return (float(known[0]), float(np.median(known)), float(known[-1])) if known.size else None


def yield_of(rows: Iterable[Row]) -> Yield:
    """Shares of stable and feasible rows, and quantiles of their abscissa."""
    table = columns(rows)
    status, abscissa, stable = table["status"].values, table["abscissa"].values, _stable(table)
    feasible = status == "optimal"
    answered = feasible | (status == "infeasible")
    most = int(answered.sum())
    at = dict(zip((f"{q:g}" for q in QUANTILES), _quantiles(abscissa[answered]), strict=False))
    shares = [Share(int((of & answered).sum()), most) for of in (stable, feasible, stable & feasible)]
    return Yield(shares[0], shares[1], shares[2], len(status) - most, Table(at))


def _quantiles(abscissa: Array) -> list[float]:
    known = np.sort(np.where(np.isnan(abscissa), np.inf, abscissa))
    return [float(known[max(math.ceil(q * len(known)) - 1, 0)]) for q in QUANTILES if len(known)]


def wilson(count: int, of: int, z: float = _Z) -> tuple[float, float]:
    """The score interval of a share (E. B. Wilson, J. Am. Stat. Assoc. 22, 209, 1927); 0 to 1 of none."""
    if of == 0:
        return 0.0, 1.0
    share, square = count / of, z * z
    middle = (share + square / (2 * of)) / (1 + square / of)
    half = z / (1 + square / of) * math.sqrt(share * (1 - share) / of + square / (4 * of * of))
    return (0.0 if count == 0 else middle - half), (1.0 if count == of else middle + half)
