"""How the rows of a study are solved, each for itself or from neighbour to neighbour, and judged at once where nothing
is free.
"""

import math
import platform
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

from tmsopt.errors import InputError
from tmsopt.evaluation.columns import BLOCK, can_evaluate_columns, evaluate_columns
from tmsopt.evaluation.law_rows import law_rows
from tmsopt.models import tms
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import amounts_text
from tmsopt.records import Array, Table
from tmsopt.search.solve import solve
from tmsopt.search.state import same_objective
from tmsopt.studies.neighbours import blocks
from tmsopt.studies.rows import PREFIXES, Part, Row, blank, column_of, header
from tmsopt.studies.study import Study

_AFAR = 1
"""Starts of a row beside the one near its neighbour: an optimum that neither end of a block knows is met on the way."""


@dataclass(frozen=True)
class SolvedRow:
    """A row, and the solution that it says the most important of; None where there is none."""

    row: Row
    solution: Solution | None = None


def solve_row(study: Study, number: int) -> SolvedRow:
    """One row solved without the others, as in the study; with warm starts, with the other rows of its block.

    Raises:
        InputError: for a row that the study has not.
    """
    study.varied(number)
    unit = next((block for block in blocks(study) if number in block), ()) if study.warm else (number,)
    return next(answer for answer in Solver(study).answers(unit) if answer.row.number == number)


@dataclass(frozen=True)
class Solver:
    """Solves rows of one study.

    A unit is one row, or with warm starts a whole block of neighbours: rows of a part of a block are solved as if the
    study were cold.
    """

    study: Study

    def __call__(self, numbers: Sequence[int]) -> list[Row]:
        """The rows of a unit."""
        return [answer.row for answer in self.answers(numbers)]

    def answers(self, numbers: Sequence[int]) -> list[SolvedRow]:
        """The rows of a unit, each with its solution."""
        with _pools().limit(limits=1):
            if self.study.warm and len(numbers) > 1:
                return self._block(numbers)
            return [self._answer(number) for number in numbers]

    def lost(self, number: int, cause: str) -> Row:
        """A row that ended its worker."""
        return self._row(number, status="quarantined", cause=cause)

    def _block(self, numbers: Sequence[int]) -> list[SolvedRow]:
        """Both ends from many starts, the others from their neighbours and from afar; back again where that is better.

        An optimum that is carried along can be overtaken by another on the way. The far end and the start from afar
        that every row has may find that one; it is then carried back as far as it is better.
        """
        found = [self._answer(numbers[0])]
        for number in numbers[1:]:
            found.append(self._answer(number, found[-1].row, _AFAR))
        end = self._answer(numbers[-1]) if found[-1].row.warm else found[-1]
        news = [_new(answer) for answer in found]
        if self._better(end.row, found[-1].row):
            found[-1], news[-1] = end, True
        for k in range(len(numbers) - 2, -1, -1):
            if news[k + 1] and found[k + 1].row.status == "optimal":
                back = self._answer(numbers[k], found[k + 1].row)
                if self._better(back.row, found[k].row):
                    found[k], news[k] = back, True
        return found

    def _better(self, one: Row, other: Row) -> bool:
        """Whether one solution of a row beats another by more than rounding."""
        if one.status != "optimal" or other.status != "optimal":
            return one.status == "optimal" and other.status != "optimal"
        sign = self.study.problem.posed.sign
        return sign * one.objective < sign * other.objective and not same_objective(one.objective, other.objective)

    def _answer(self, number: int, neighbour: Row | None = None, afar: int = 0) -> SolvedRow:
        """One row, near a neighbour's optimum and from so many starts afar if that leads to an optimum."""
        began, solution = time.perf_counter(), None
        try:
            problem = self.study.row_problem(number)
            options: dict[str, Any] = {"seed": self.study.seed_of(number), "throw": False}
            # What takes longer than the rest of a row without a design is left out, and Ctrl-C is for the whole study.
            options |= {"alone": False, "stability": 0.0, "interruptible": False}
            if neighbour is not None and neighbour.status == "optimal":
                near = {name: neighbour.parameters[name] for name in problem.free}
                solution = solve(problem, starts=1 + afar, near=near, **options)
            warm = solution is not None and solution.status == "optimal"
            if solution is None or not warm:
                solution = solve(problem, starts=self.study.starts, **options)
            found = _fields(solution, self.study.report) | {"warm": warm}
        except InputError as error:
            found = {"status": "failed", "cause": "; ".join(str(fault) for fault in error.faults)}
        except Exception as error:  # a row that breaks the program must not end a study
            found = {"status": "failed", "cause": f"{type(error).__name__}: {error}"}
        return SolvedRow(self._row(number, seconds=time.perf_counter() - began, **found), solution)

    def _row(self, number: int, **found: Any) -> Row:
        given, seed = self.study.varied(number), self.study.seed_of(number)
        return Row(number, seed, given, host=platform.node(), **found)


def _fields(solution: Solution, report: Sequence[str]) -> dict[str, Any]:
    """What a row says of its solution."""
    problem, bound = solution.problem.posed, solution.bound
    values = problem.values(solution.parameters)
    return {
        "status": solution.status,
        "cause": _cause(solution),
        "objective": solution.value,
        "abscissa": solution.abscissa,
        "abscissa_realised": solution.abscissa_realised,
        "damping_ratio": solution.quantities["damping_ratio"],
        "structure": solution.structure,
        "parameters": solution.parameters,
        "reports": Table({text: float(problem.read(text)(values)) for text in report}),
        "bound": bound.value,
        "gap": bound.gap,
        "proven": bound.proven,
        "method": bound.method,
        "laws": Table(_laws(solution)),
        "violations": Table({n: math.inf if math.isnan(x) else x for n, x in solution.violations.items()}),
        "starts": solution.starts.tried,
    }


@cache
def _pools() -> ThreadpoolController:
    """Thread pools of NumPy and SciPy: with more threads, sums are taken in another order and last digits differ."""
    import scipy.linalg  # noqa: F401  # it brings its own

    return ThreadpoolController()


def _new(answer: SolvedRow) -> bool:
    """Whether a row may have another optimum than the neighbour that it was started from."""
    starts = answer.solution.starts if answer.solution is not None else None
    return starts is not None and (not answer.row.warm or starts.at_best < starts.tried)


def _cause(solution: Solution) -> str:
    """Why a solution is not optimal, in words."""
    if solution.status == "optimal":
        lost = amounts_text(solution.problem.posed, solution.missed)
        return f"as stored in doubles, misses {lost}" if lost else ""
    violated = amounts_text(solution.problem.posed, solution.violations)
    conflict = solution.relaxation.conflict if solution.relaxation else ()
    parts = [
        f"violated: {violated}" if violated else "",
        f"in conflict: {', '.join(conflict)}" if conflict else "",
        *solution.notes,
    ]
    return "; ".join(part for part in parts if part)


def _laws(solution: Solution) -> Mapping[str, float]:
    """Relative residual of each law that applies to an optimal design."""
    if solution.status != "optimal" or solution.problem.model is not tms:
        return {}
    return {row.name: row.relative for row in law_rows(solution) if row.applies}


_JUDGED = ("objective", "abscissa", "damping_ratio", "bound", "gap", "oscillates", "by_relation")


def applies(study: Study) -> bool:
    """Whether rows of a study may be judged at once: only fixed parameters vary, and nothing is free."""
    names = study.problem.posed.parameter_set.names
    return not study.warm and can_evaluate_columns(study.problem.posed) and all(name in names for name in study.columns)


def judged(study: Study, numbers: NDArray[np.int64]) -> Iterator[Part]:
    """Columns of those rows that are certain; the others are left to be solved one by one.

    Args:
        numbers: of the rows, ascending.
    """
    given = {name: np.asarray(column) for name, column in study.columns.items()}
    for first in range(0, len(numbers), BLOCK):
        began, some = time.perf_counter(), numbers[first : first + BLOCK]
        found = evaluate_columns(
            study.problem.posed, {name: column[some] for name, column in given.items()}, study.report
        )
        if found is None:
            return
        if found.certain.any():
            tables = {"reports": found.reports, "laws": found.laws, "violations": found.violations}
            each = {name: getattr(found, name) for name in _JUDGED}
            each |= {header(name, key): values for name, table in tables.items() for key, values in table.items()}
            columns = {name: values[found.certain] for name, values in each.items()}
            yield judged_part(some[found.certain], columns, (time.perf_counter() - began) / len(some), platform.node())


def judged_part(numbers: NDArray[np.int64], given: dict[str, Array], seconds: float, host: str) -> Part:
    """Columns of rows that were judged at once.

    Args:
        given: header → numbers; and ``oscillates`` and ``by_relation``, from which structure and method follow.
    """
    wrong = np.zeros(len(numbers), dtype=bool)
    for name, values in given.items():
        wrong |= name.startswith(PREFIXES["violations"]) & ~np.isnan(values)
    method = np.where(np.isfinite(given["bound"]), 1 + given.pop("by_relation"), 0)
    texts = {
        "status": (("optimal", "infeasible"), wrong),
        "structure": (("real", "pair"), given.pop("oscillates")),
        "method": (("none", "omega0", "relation"), method),
        "host": ((host,), 0 * method),
    }
    made = blank(len(numbers)) | given | {"number": numbers, "abscissa_realised": given["abscissa"]}
    made["seconds"] = np.full(len(numbers), seconds)
    return made | {name: column_of(words, str)[which.astype(int)] for name, (words, which) in texts.items()}
