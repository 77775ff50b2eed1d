"""Solve the rows of a study: one by one, warm from neighbour to neighbour, or all at once where nothing is free."""

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
from tmsopt.studies.rows import PREFIXES, Batch, Row, blank_batch, column_of, header
from tmsopt.studies.study import Study

ROWS_OF_BLOCK = 32
"""Rows of a block; the first row of each block starts cold, so that blocks are independent."""

_AFAR = 1
"""Starts of a warm row besides its neighbour's optimum, which find optima that neither end of a block has."""


@dataclass(frozen=True)
class SolvedRow:
    """A row and its solution; None without one."""

    row: Row
    solution: Solution | None = None


def solve_row(study: Study, number: int) -> SolvedRow:
    """Solve one row as in the study; with warm starts, together with the other rows of its block.

    Raises:
        InputError: for a row number outside the study.
    """
    study.varied(number)
    unit = next((block for block in split_into_blocks(study) if number in block), ()) if study.warm else (number,)
    return next(answer for answer in Solver(study).answers(unit) if answer.row.number == number)


@dataclass(frozen=True)
class Solver:
    """Solves rows of one study.

    A unit is one row, or with warm starts a whole block of neighbours; a single row of a block is solved cold.
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

    def _block(self, numbers: Sequence[int]) -> list[SolvedRow]:
        """Solve both ends from many starts, and the others from their neighbours and from `_AFAR` further starts.

        Another optimum may become better along the block. If the last row or a further start finds it, it is carried
        back as far as it is better.
        """
        found = [self._answer(numbers[0])]
        for number in numbers[1:]:
            found.append(self._answer(number, found[-1].row, _AFAR))
        end = self._answer(numbers[-1]) if found[-1].row.warm else found[-1]
        differs = [_may_differ(answer) for answer in found]
        if self._is_better(end.row, found[-1].row):
            found[-1], differs[-1] = end, True
        for k in range(len(numbers) - 2, -1, -1):
            if differs[k + 1] and found[k + 1].row.status == "optimal":
                back = self._answer(numbers[k], found[k + 1].row)
                if self._is_better(back.row, found[k].row):
                    found[k], differs[k] = back, True
        return found

    def _is_better(self, one: Row, other: Row) -> bool:
        """Whether one solution of a row is better than another by more than rounding."""
        if one.status != "optimal" or other.status != "optimal":
            return one.status == "optimal" and other.status != "optimal"
        sign = self.study.problem.posed.sign
        return sign * one.objective < sign * other.objective and not same_objective(one.objective, other.objective)

    def _answer(self, number: int, neighbour: Row | None = None, afar: int = 0) -> SolvedRow:
        """Solve one row, warm from a neighbour's optimum and `afar` further starts, or cold if that fails."""
        began, solution = time.perf_counter(), None
        try:
            problem = self.study.row_problem(number)
            # Slow analyses of infeasible rows are left out, and Ctrl-C stops the whole study.
            options: dict[str, Any] = {"throw": False, "alone": False, "stability": 0.0, "interruptible": False}
            options["seed"] = self.study.seed_of(number)
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
        return SolvedRow(self.row(number, seconds=time.perf_counter() - began, **found), solution)

    def row(self, number: int, **found: Any) -> Row:
        """A row with what is found of it."""
        return Row(number, self.study.seed_of(number), self.study.varied(number), host=platform.node(), **found)


def _fields(solution: Solution, report: Sequence[str]) -> dict[str, Any]:
    """The fields of a row from its solution."""
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
    """Thread pools of NumPy and SciPy, to be limited because more threads change the last digits of sums."""
    import scipy.linalg  # noqa: F401  # has a pool of its own

    return ThreadpoolController()


def _may_differ(answer: SolvedRow) -> bool:
    """Whether a row may have another optimum than the neighbour that it was started from."""
    starts = answer.solution.starts if answer.solution is not None else None
    return starts is not None and (not answer.row.warm or starts.at_best < starts.tried)


def _cause(solution: Solution) -> str:
    """Why a solution is not optimal, or what the stored doubles miss."""
    if solution.status == "optimal":
        amounts = amounts_text(solution.problem.posed, solution.missed)
        return f"rounded to doubles, violates {amounts}" if amounts else ""
    violated = amounts_text(solution.problem.posed, solution.violations)
    conflict = solution.relaxation.conflict if solution.relaxation else ()
    causes = [
        f"violated: {violated}" if violated else "",
        f"in conflict: {', '.join(conflict)}" if conflict else "",
        *solution.notes,
    ]
    return "; ".join(filter(None, causes))


def _laws(solution: Solution) -> Mapping[str, float]:
    """Relative residual of each law that applies to an optimal design."""
    if solution.status != "optimal" or solution.problem.model is not tms:
        return {}
    return {row.name: row.relative for row in law_rows(solution) if row.applies}


def can_evaluate(study: Study) -> bool:
    """Whether rows can be evaluated without a solver: only fixed parameters vary, and nothing is free."""
    posed = study.problem.posed
    return not study.warm and can_evaluate_columns(posed) and study.columns.keys() <= {*posed.parameter_set.names}


def evaluate_rows(study: Study, numbers: NDArray[np.int64]) -> Iterator[Batch]:
    """Evaluate rows together; doubtful ones are omitted and must be solved one by one.

    Args:
        numbers: numbers of the rows, ascending.
    """
    varied = {name: np.asarray(column) for name, column in study.columns.items()}
    for first in range(0, len(numbers), BLOCK):
        began, some = time.perf_counter(), numbers[first : first + BLOCK]
        columns = {name: column[some] for name, column in varied.items()}
        found = evaluate_columns(study.problem.posed, columns, study.report)
        if found is None:
            return
        given: dict[str, Any] = {}
        for name, value in vars(found).items():
            given |= {header(name, n): x for n, x in value.items()} if isinstance(value, Mapping) else {name: value}
        certain = given.pop("certain")
        if certain.any():
            seconds = (time.perf_counter() - began) / len(some)
            kept = {name: values[certain] for name, values in given.items()}
            yield evaluated_batch(some[certain], kept, seconds, platform.node())


def evaluated_batch(numbers: NDArray[np.int64], given: dict[str, Array], seconds: float, host: str) -> Batch:
    """All columns of rows that were evaluated together.

    Args:
        given: header → numbers; also ``oscillates`` and ``by_relation``, which determine structure and method.
    """
    violations = [values for name, values in given.items() if name.startswith(PREFIXES["violations"])]
    infeasible = np.any(~np.isnan([np.full(len(numbers), np.nan), *violations]), axis=0)
    texts = {
        "status": (("optimal", "infeasible"), infeasible),
        "structure": (("real", "pair"), given.pop("oscillates")),
        "method": (("none", "omega0", "relation"), np.isfinite(given["bound"]) * (1 + given.pop("by_relation"))),
        "host": ((host,), 0 * numbers),
    }
    batch = blank_batch(len(numbers)) | given | {"number": numbers, "abscissa_realised": given["abscissa"]}
    batch["seconds"] = np.full(len(numbers), seconds)
    return batch | {name: column_of(words, str)[which.astype(int)] for name, (words, which) in texts.items()}


def split_into_blocks(study: Study, size: int = ROWS_OF_BLOCK) -> list[tuple[int, ...]]:
    """Every row once, in blocks of `size` with close consecutive rows.

    A grid is traversed back and forth, so consecutive rows differ in one axis by one step. For other rows, each
    column but the last is binned by rank and traversed in the same way. Ranks treat logarithmic and linear columns
    alike.
    """
    count = len(study)
    ranks = [np.unique(np.asarray(column), return_inverse=True)[1] for column in study.columns.values()]
    moving = [rank for rank in ranks if rank.max() > 0]
    if study.grid_shape is None:
        moving = moving[: max(1, int(math.log2(count)))]
        bins = round(count ** (1 / max(1, len(moving))))
        moving[:-1] = [rank * min(bins, rank.max() + 1) // (rank.max() + 1) for rank in moving[:-1]]
    walk = np.zeros(count, dtype=np.int64)
    for rank in moving:
        most = rank.max()
        walk = walk * (most + 1) + np.where(walk % 2 == 1, most - rank, rank)
    order = np.argsort(walk, kind="stable").tolist()
    return [tuple(order[k : k + size]) for k in range(0, count, size)]
