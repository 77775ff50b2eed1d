"""Rows of a study as columns."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tmsopt.design.unit_system import Unit
from tmsopt.records import Array, Table, Truth
from tmsopt.solver.solve import UNSTABLE
from tmsopt.studies.row import Row

STATUS = np.array(["optimal", "infeasible"], dtype=object)
"""Of a row in a block, by whether it violates anything."""

METHODS = np.array(["none", "omega0", "relation"], dtype=object)
"""How the bound of a row was found."""

STRUCTURES = np.array(["real", "pair"], dtype=object)
"""Of a row, by whether it oscillates."""

NUMBERS = ("objective", "abscissa", "damping_ratio", "oscillates", "bound", "gap", "by_relation")
"""Columns of every block, beside ``varied.…``, ``violation.…``, ``law.…`` and ``report.…``."""

_BIT = np.uint32
_SEEDS = 2**31
_MULTIPLIER, _START = 0x931E8875, 0x43B0D7E5  # NumPy's SeedSequence
_LEFT, _RIGHT = 0xCA01F9DD, 0x4973F715
_LAST, _LAST_MULTIPLIER = 0x8B51F9DD, 0x58F38DED
_POOL = 4


@dataclass(frozen=True)
class Shared:
    """What all rows of a block share.

    Attributes:
        seed: of the study.
        fixed: every parameter, those that vary too.
        units: constraint → the unit in which the problem was written.
        of_abscissa: constraints that name it.
    """

    seed: int
    fixed: Mapping[str, float]
    units: Mapping[str, tuple[str, float]]
    of_abscissa: tuple[str, ...]


@dataclass(frozen=True)
class RowBlock:
    """Rows with ascending numbers, each of them judged without a solver.

    Attributes:
        columns: those of `NUMBERS`, and the others by their headers; a violation or a law is nan where there is none.
        seconds: that each row took.
    """

    shared: Shared
    numbers: NDArray[np.int64]
    columns: Mapping[str, Array] = field(repr=False)
    seconds: float = 0.0
    host: str = ""

    def __len__(self) -> int:
        return len(self.numbers)

    def __iter__(self) -> Iterator[Row]:
        return (self.row(k) for k in range(len(self)))

    @cached_property
    def infeasible(self) -> Truth:
        """Whether a row violates anything."""
        found = np.zeros(len(self), dtype=bool)
        for name, column in self.columns.items():
            if name.startswith("violation."):
                found |= ~np.isnan(column)
        return found

    def named(self, table: str) -> list[str]:
        """Names in one table of the rows, such as ``law``."""
        return [name[len(table) + 1 :] for name in self.columns if name.startswith(f"{table}.")]

    def some(self, places: NDArray[np.int64]) -> "RowBlock":
        """The rows at some places."""
        return replace(self, numbers=self.numbers[places], columns={n: c[places] for n, c in self.columns.items()})

    def find(self, number: int) -> Row | None:
        """The row of a number, if it is here."""
        place = int(np.searchsorted(self.numbers, number))
        return self.row(place) if place < len(self) and self.numbers[place] == number else None

    def row(self, k: int) -> Row:
        """The row at a place."""
        at = {name: float(self.columns[name][k]) for name in NUMBERS}
        tables = {
            table: {n: x for n in self.named(table) if not math.isnan(x := float(self.columns[f"{table}.{n}"][k]))}
            for table in ("law", "violation")
        }
        varied = {n: float(self.columns[f"varied.{n}"][k]) for n in self.named("varied")}
        return Row(
            number=int(self.numbers[k]), seed=int(seeds(self.shared.seed, self.numbers[k : k + 1])[0]),
            varied=Table(varied), status=str(STATUS[int(self.infeasible[k])]), cause=self.cause(k),
            objective=at["objective"], abscissa=at["abscissa"], abscissa_realised=at["abscissa"],
            damping_ratio=at["damping_ratio"], structure=str(STRUCTURES[int(at["oscillates"])]),
            parameters=Table({**self.shared.fixed, **varied}),
            reports=Table({n: float(self.columns[f"report.{n}"][k]) for n in self.named("report")}),
            bound=at["bound"], gap=at["gap"], proven=False, method=str(METHODS[self.methods[k]]),
            laws=Table(tables["law"]), violations=Table(tables["violation"]), seconds=self.seconds, host=self.host,
        )  # fmt: skip

    @cached_property
    def methods(self) -> NDArray[np.int64]:
        """Place in `METHODS` of how each bound was found."""
        known = np.isfinite(self.columns["bound"])
        return np.where(known, 1 + (self.columns["by_relation"] > 0), 0)

    def causes(self) -> list[str]:
        """Why each row is infeasible; empty where it is not."""
        texts = [""] * len(self)
        for name in self.named("violation"):
            unit, column = Unit(*self.shared.units[name]), self.columns[f"violation.{name}"]
            for k in np.flatnonzero(~np.isnan(column)).tolist():
                texts[k] += f"{', ' if texts[k] else 'violated: '}{name} by {unit.show(float(column[k]), 3)}"
        asked = np.zeros(len(self), dtype=bool)
        for name in self.shared.of_abscissa:
            asked |= ~np.isnan(self.columns[f"violation.{name}"])
        for k in np.flatnonzero(asked & (self.columns["abscissa"] >= 0)).tolist():
            texts[k] += f"; {UNSTABLE}"
        return texts

    def cause(self, k: int) -> str:
        """Why the row at a place is infeasible; empty where it is not."""
        return self.some(np.array([k])).causes()[0] if self.infeasible[k] else ""


def seeds(seed: int, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
    """`Study.seed_of` of many rows: the last step of NumPy's SeedSequence for a spawn key of one number."""
    words = max(_POOL, -(-seed.bit_length() // 32))
    once = _START * pow(_MULTIPLIER, _POOL * words, 2**32) % 2**32
    pool = int(np.random.SeedSequence(seed).pool[0])
    with np.errstate(over="ignore"):
        x = (numbers.astype(_BIT) ^ _BIT(once)) * _BIT(once * _MULTIPLIER % 2**32)
        x = _BIT(_LEFT * pool % 2**32) - _BIT(_RIGHT) * (x ^ (x >> _BIT(16)))
        x = ((x ^ (x >> _BIT(16))) ^ _BIT(_LAST)) * _BIT(_LAST * _LAST_MULTIPLIER % 2**32)
    return np.asarray((x ^ (x >> _BIT(16))).astype(np.int64) % _SEEDS)
