"""The best value that anybody reached on each problem of a suite, kept in a file beside it: one line a problem."""

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from benchmarks.judges import same
from tmsopt.files import write_text

REFERENCES = Path("benchmarks/suites/references.json")
OSCILLATORS = Path("benchmarks/suites/oscillators.json")
HARD = Path("benchmarks/suites/hard_references.json")
"""Where the values of the random designs, of the random systems and of the hard problems are kept."""


@dataclass(frozen=True)
class Reference:
    """The best that is known of one random design.

    Attributes:
        solvable: whether a feasible design is known.
        value: its abscissa; at an exceptional point that of the ideal design, as `solve` reports it; nan without one.
        realised: abscissa of the parameters exactly as stored, from isolated roots; no true bound lies above it,
            but for the violation.
        violation: largest, relative to the size of the two sides, by the judge; the least known where none is feasible.
        parameters: of that design; all seven.
        known: source → least value it reached at a feasible design: ``default``, ``starts``, ``evolution`` (its own
            end, if it is feasible within 1e-12), ``from evolution`` (solved from that end).
        doubtful: sources that claimed an optimum that the judge does not confirm.
    """

    index: int
    solvable: bool
    value: float
    realised: float
    violation: float
    parameters: Mapping[str, float]
    known: Mapping[str, float]
    doubtful: tuple[str, ...] = ()

    @property
    def by(self) -> tuple[str, ...]:
        """Who reached the value."""
        return tuple(source for source, value in self.known.items() if same(value, self.value))


@dataclass(frozen=True)
class Known:
    """The best that is known of one random system.

    Attributes:
        value: of the objective, at a multiple root that of the ideal design.
        parameters: the free ones of that design.
        known: source → value it reached: ``starts``, ``from evolution`` (solved from the end of one), ``evolution``
            (the best of them, by isolated roots of the exact polynomial of its end).
        evaluations: of the eigenvalues, by the differential evolution with seed 0.
    """

    index: int
    value: float
    parameters: Mapping[str, float]
    known: Mapping[str, float]
    evaluations: int


@dataclass(frozen=True)
class Target:
    """The best that is known of one hard problem.

    Attributes:
        value: of the objective in the problem's own sense; nan where no design is known to be feasible.
        violation: of the design, relative to the size of the two sides; the least known where none is feasible.
        design: the free parameters.
        how: what found it.
    """

    index: int
    family: str
    value: float
    violation: float
    design: Mapping[str, float]
    how: str
    seconds: float

    @property
    def solvable(self) -> bool:
        """Whether a design is known to be feasible."""
        return math.isfinite(self.value)


def targets(path: Path = HARD) -> dict[int, Target]:
    """Index → what is known, as kept in the file; empty where there is none."""
    return {row["index"]: Target(**row) for row in read(path).get("problems", [])}


def references(path: Path = REFERENCES) -> dict[int, Reference]:
    """Index → what is known, as kept in the file; empty where there is none."""
    rows = read(path).get("problems", [])
    return {row["index"]: Reference(**{**row, "doubtful": tuple(row["doubtful"])}) for row in rows}


def known(path: Path = OSCILLATORS) -> dict[int, Known]:
    """Index → what is known, as kept in the file; empty where there is none."""
    return {row["index"]: Known(**row) for row in read(path).get("systems", [])}


def read(path: Path) -> dict[str, Any]:
    """A file of values, null being nan; empty where there is none."""

    def numbers(row: dict[str, Any]) -> dict[str, Any]:
        return {name: math.nan if value is None else value for name, value in row.items()}

    return dict(json.loads(path.read_text(encoding="utf-8"), object_hook=numbers)) if path.exists() else {}


def write(path: Path, head: Mapping[str, Any], name: str, rows: Iterable[Reference | Known | Target]) -> None:
    """One line per problem, in order; the old file stays until the new one is complete."""
    lines = ",\n".join(json.dumps(_row(one), allow_nan=False) for one in sorted(rows, key=lambda one: one.index))
    top = ",\n".join(f"{json.dumps(key)}: {json.dumps(value)}" for key, value in head.items())
    write_text(path, f"{{\n{top},\n{json.dumps(name)}: [\n{lines}\n]\n}}\n")


def _row(one: Reference | Known | Target) -> dict[str, Any]:
    return {n: None if isinstance(v, float) and math.isnan(v) else v for n, v in asdict(one).items()}
