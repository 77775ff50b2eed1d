"""Rows of a study judged at once, those that need no solver."""

import platform
import time
from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from tmsopt.checks.judge import BLOCK, Verdicts, judgeable, verdicts
from tmsopt.design.unit_system import unit_of
from tmsopt.records import Array
from tmsopt.studies.judging.block import NUMBERS, RowBlock, Shared
from tmsopt.studies.row import Row
from tmsopt.studies.study import Study

_NUMBERS = 4_000_000
"""In a block, some 32 MB: what is committed at once, and held beside the study."""
_ROWS = 2**16  # in a block


def applies(study: Study) -> bool:
    """Whether rows of a study may be judged at once: only fixed parameters vary, and nothing is free."""
    names = study.problem.parameter_set.names
    return not study.warm and judgeable(study.problem) and all(name in names for name in study.columns)


def judged(study: Study, numbers: NDArray[np.int64]) -> Iterator[tuple[RowBlock, NDArray[np.int64]]]:
    """Blocks of rows, and the numbers of those beside them that are left to be looked at one by one.

    Args:
        numbers: of the rows, ascending.
    """
    shared = shared_by(study)
    width = len(study.columns) + len(NUMBERS) + len(study.problem.conditions) + len(study.report) + 4
    size = max(BLOCK, min(_ROWS, _NUMBERS // width // BLOCK * BLOCK))
    given = {name: np.asarray(column, dtype=float) for name, column in study.columns.items()}
    for first in range(0, len(numbers), size):
        yield _block(study, shared, given, numbers[first : first + size])


def judged_alone(study: Study, number: int) -> Row | None:
    """One row, to the same bits as among others; None where it is to be looked at by itself."""
    if not applies(study):
        return None
    block, _ = next(judged(study, np.array([number])))
    return next(iter(block), None)


def shared_by(study: Study) -> Shared:
    """What the rows of a study share."""
    problem = study.problem
    units = {name: unit_of(problem, name) for name in problem.constraints}
    return Shared(
        seed=int(study.seed), fixed={n: float(x) for n, x in problem.ordered({}).items()},
        units={name: (unit.text, float(unit.one)) for name, unit in units.items()},
        of_abscissa=tuple(n for n, c in problem.conditions.items() if "abscissa" in c.names),
    )  # fmt: skip


def _block(
    study: Study, shared: Shared, given: Mapping[str, Array], numbers: NDArray[np.int64]
) -> tuple[RowBlock, NDArray[np.int64]]:
    began = time.perf_counter()
    parts: list[tuple[NDArray[np.int64], dict[str, Array]]] = []
    for first in range(0, len(numbers), BLOCK):
        some = numbers[first : first + BLOCK]
        columns = {name: column[some] for name, column in given.items()}
        found = verdicts(study.problem, columns, study.report)
        if found is None:
            parts = [(numbers[:0], {name: np.empty(0) for name in (*NUMBERS, *map("varied.{}".format, given))})]
            break
        rows = np.flatnonzero(found.certain)
        named = {f"varied.{name}": column for name, column in columns.items()} | _columns(found)
        parts.append((some[rows], {name: column[rows] for name, column in named.items()}))
    inside = np.concatenate([some for some, _ in parts])
    whole = {name: np.concatenate([columns[name] for _, columns in parts]) for name in parts[0][1]}
    seconds = (time.perf_counter() - began) / max(len(numbers), 1)
    return RowBlock(shared, inside, whole, seconds, platform.node()), np.setdiff1d(numbers, inside, assume_unique=True)


def _columns(found: Verdicts) -> dict[str, Array]:
    tables = {"violation": found.violations, "law": found.laws, "report": found.reports}
    plain = {name: np.asarray(getattr(found, name), dtype=float) for name in NUMBERS}
    return plain | {f"{table}.{n}": column for table, named in tables.items() for n, column in named.items()}
