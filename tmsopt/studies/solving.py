"""Solves the rows of a study: each alone, or from the optimum of a neighbour (warm), or all at once if nothing is free.

A row is solved cold if it is not started from a neighbour's optimum.
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
from tmsopt.evaluation.columns import DESIGNS_PER_BLOCK, can_evaluate_columns, evaluate_columns
from tmsopt.evaluation.law_rows import law_rows
from tmsopt.models import tms
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import amounts_text
from tmsopt.records import Array, Table
from tmsopt.search.solve import solve
from tmsopt.search.state import same_objective
from tmsopt.studies.rows import PREFIXES, Batch, Row, blank_batch, column_of, header
from tmsopt.studies.study import Study

BLOCK_ROWS = 32
"""Number of rows of a block of neighbours; its first row is solved cold, so that blocks are independent."""

_EXTRA_STARTS = 1
"""Number of starts of a warm row besides the optimum of its neighbour; they find optima that neither the first nor
the last row of a block has."""


@dataclass(frozen=True)
class SolvedRow:
    """A row and its solution; the solution is None for a failed row."""

    row: Row
    solution: Solution | None = None


def solve_row(study: Study, number: int) -> SolvedRow:
    """Solve one row with the same result as in the study; with warm starts, the whole block of the row is solved.

    Raises:
        InputError: for a row number outside the study.
    """
    study.varied(number)
    task = next((block for block in split_into_blocks(study) if number in block), ()) if study.warm else (number,)
    return next(solved for solved in Solver(study).solve_rows(task) if solved.row.number == number)


@dataclass(frozen=True)
class Solver:
    """Solves tasks of one study.

    A task is one row, or with warm starts a block of neighbours. If a task is one row of a block, it is solved cold.
    """

    study: Study

    def __call__(self, numbers: Sequence[int]) -> list[Row]:
        """Solve a task, given by its row numbers, and return its rows."""
        return [solved.row for solved in self.solve_rows(numbers)]

    def solve_rows(self, numbers: Sequence[int]) -> list[SolvedRow]:
        """Solve a task, and return its rows with their solutions."""
        with _thread_pools().limit(limits=1):
            if self.study.warm and len(numbers) > 1:
                return self._solve_block(numbers)
            return [self._solve_row(number) for number in numbers]

    def _solve_block(self, numbers: Sequence[int]) -> list[SolvedRow]:
        """Solve both ends of a block cold, and each other row from its neighbour and from `_EXTRA_STARTS` starts.

        Another optimum may become better along the block. If the last row or one of these starts finds it, the rows
        before it are also solved from that optimum, as long as it is better.
        """
        solved_rows = [self._solve_row(numbers[0])]
        for number in numbers[1:]:
            solved_rows.append(self._solve_row(number, solved_rows[-1].row, _EXTRA_STARTS))
        cold_end = self._solve_row(numbers[-1]) if solved_rows[-1].row.warm else solved_rows[-1]
        may_differ = [_may_differ(row) for row in solved_rows]
        if self._is_better(cold_end.row, solved_rows[-1].row):
            solved_rows[-1], may_differ[-1] = cold_end, True
        for k in range(len(numbers) - 2, -1, -1):
            if may_differ[k + 1] and solved_rows[k + 1].row.status == "optimal":
                candidate = self._solve_row(numbers[k], solved_rows[k + 1].row)
                if self._is_better(candidate.row, solved_rows[k].row):
                    solved_rows[k], may_differ[k] = candidate, True
        return solved_rows

    def _is_better(self, row: Row, current: Row) -> bool:
        """Whether a solution of a row is better than the current one by more than rounding."""
        if row.status != "optimal" or current.status != "optimal":
            return row.status == "optimal" and current.status != "optimal"
        sign = self.study.problem.posed.sign
        return sign * row.objective < sign * current.objective and not same_objective(row.objective, current.objective)

    def _solve_row(self, number: int, neighbour: Row | None = None, extra_starts: int = 0) -> SolvedRow:
        """Solve one row from a neighbour's optimum and `extra_starts` further starts; solve it cold if that fails."""
        start_time, solution = time.perf_counter(), None
        try:
            problem = self.study.row_problem(number)
            # Slow analyses of infeasible rows are left out, and Ctrl-C stops the whole study.
            options: dict[str, Any] = {"throw": False, "alone": False, "stability": 0.0, "interruptible": False}
            options["seed"] = self.study.seed_of(number)
            if neighbour is not None and neighbour.status == "optimal":
                near = {name: neighbour.parameters[name] for name in problem.free}
                solution = solve(problem, starts=1 + extra_starts, near=near, **options)
            is_warm = solution is not None and solution.status == "optimal"
            if solution is None or not is_warm:
                solution = solve(problem, starts=self.study.starts, **options)
            values = _extract_fields(solution, self.study.report) | {"warm": is_warm}
        except InputError as error:
            values = {"status": "failed", "cause": "; ".join(str(fault) for fault in error.faults)}
        except Exception as error:  # an error in one row must not end the study
            values = {"status": "failed", "cause": f"{type(error).__name__}: {error}"}
        return SolvedRow(self.row(number, seconds=time.perf_counter() - start_time, **values), solution)

    def row(self, number: int, **values: Any) -> Row:
        """A row with the values of its fields."""
        return Row(number, self.study.seed_of(number), self.study.varied(number), host=platform.node(), **values)


def _extract_fields(solution: Solution, report: Sequence[str]) -> dict[str, Any]:
    """The fields of a row from its solution."""
    problem, bound = solution.problem.posed, solution.bound
    values = problem.values(solution.parameters)
    return {
        "status": solution.status,
        "cause": _describe_cause(solution),
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
        "laws": Table(_compute_law_residuals(solution)),
        "violations": Table({n: math.inf if math.isnan(x) else x for n, x in solution.violations.items()}),
        "starts": solution.starts.tried,
    }


@cache
def _thread_pools() -> ThreadpoolController:
    """Thread pools of NumPy and SciPy; they must be limited, because more threads change the last digits of sums."""
    import scipy.linalg  # noqa: F401  # has a pool of its own

    return ThreadpoolController()


def _may_differ(solved_row: SolvedRow) -> bool:
    """Whether a row may have another optimum than the neighbour from which it was started."""
    starts = solved_row.solution.starts if solved_row.solution is not None else None
    return starts is not None and (not solved_row.row.warm or starts.at_best < starts.tried)


def _describe_cause(solution: Solution) -> str:
    """Why a solution is not optimal, or which constraints it violates after rounding to doubles."""
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


def _compute_law_residuals(solution: Solution) -> Mapping[str, float]:
    """Relative residual of each law that applies to an optimal design."""
    if solution.status != "optimal" or solution.problem.model is not tms:
        return {}
    return {row.name: row.relative for row in law_rows(solution) if row.applies}


def can_evaluate(study: Study) -> bool:
    """Whether rows can be evaluated without a solver: only fixed parameters vary, and nothing is free."""
    posed = study.problem.posed
    return not study.warm and can_evaluate_columns(posed) and study.columns.keys() <= {*posed.parameter_set.names}


def evaluate_rows(study: Study, numbers: NDArray[np.int64]) -> Iterator[Batch]:
    """Evaluate rows together; rows with an uncertain result are omitted and must be solved one by one.

    Args:
        numbers: numbers of the rows, ascending.
    """
    varied = {name: np.asarray(column) for name, column in study.columns.items()}
    for first in range(0, len(numbers), DESIGNS_PER_BLOCK):
        start_time, chunk_numbers = time.perf_counter(), numbers[first : first + DESIGNS_PER_BLOCK]
        columns = {name: column[chunk_numbers] for name, column in varied.items()}
        results = evaluate_columns(study.problem.posed, columns, study.report)
        if results is None:
            return
        table: dict[str, Any] = {}
        for name, value in vars(results).items():
            table |= {header(name, n): x for n, x in value.items()} if isinstance(value, Mapping) else {name: value}
        is_certain = table.pop("is_certain")
        if is_certain.any():
            seconds = (time.perf_counter() - start_time) / len(chunk_numbers)
            certain_table = {name: values[is_certain] for name, values in table.items()}
            yield build_evaluated_batch(chunk_numbers[is_certain], certain_table, seconds, platform.node())


def build_evaluated_batch(numbers: NDArray[np.int64], table: dict[str, Array], seconds: float, host: str) -> Batch:
    """Make the batch of rows that were evaluated together.

    Args:
        table: header → numbers; ``oscillates`` gives the structure, and ``by_relation`` the method.
    """
    violations = [values for name, values in table.items() if name.startswith(PREFIXES["violations"])]
    is_infeasible = np.any(~np.isnan([np.full(len(numbers), np.nan), *violations]), axis=0)
    texts = {  # header → (possible texts, index of the text in each row)
        "status": (("optimal", "infeasible"), is_infeasible),
        "structure": (("real", "pair"), table.pop("oscillates")),
        "method": (("none", "omega0", "relation"), np.isfinite(table["bound"]) * (1 + table.pop("by_relation"))),
        "host": ((host,), 0 * numbers),
    }
    batch = blank_batch(len(numbers)) | table | {"number": numbers, "abscissa_realised": table["abscissa"]}
    batch["seconds"] = np.full(len(numbers), seconds)
    return batch | {name: column_of(options, str)[indices.astype(int)] for name, (options, indices) in texts.items()}


def split_into_blocks(study: Study, size: int = BLOCK_ROWS) -> list[tuple[int, ...]]:
    """Split all rows into blocks of `size`, in which consecutive rows have similar values.

    A grid is traversed back and forth, so that consecutive rows differ in one axis by one step. For other studies, each
    column except the last is divided into bins by rank, and the bins are traversed in the same way. Ranks treat
    logarithmic and linear columns alike.
    """
    count = len(study)
    ranks = [np.unique(np.asarray(column), return_inverse=True)[1] for column in study.columns.values()]
    axes = [rank for rank in ranks if rank.max() > 0]  # ranks of the values in the columns that vary
    if study.grid_shape is None:
        axes = axes[: max(1, int(math.log2(count)))]
        bins = round(count ** (1 / max(1, len(axes))))
        axes[:-1] = [rank * min(bins, rank.max() + 1) // (rank.max() + 1) for rank in axes[:-1]]
    position = np.zeros(count, dtype=np.int64)
    for rank in axes:
        max_rank = rank.max()
        position = position * (max_rank + 1) + np.where(position % 2 == 1, max_rank - rank, rank)
    order = np.argsort(position, kind="stable").tolist()
    return [tuple(order[k : k + size]) for k in range(0, count, size)]
