"""The front of three objectives: one is minimised with a grid of limits on the other two.

The grid covers the ranges in the payoff table, which are the values of all objectives at the three ends of the front.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tmsopt.executor import Executor
from tmsopt.fronts.front import Front, Gap, efficient_points
from tmsopt.fronts.subproblems import (
    RETRY_STARTS,
    FrontSolver,
    build_subproblem,
    front_point,
    map_items,
    minimise_limited,
    objective_values,
)
from tmsopt.problem.solution import Solution
from tmsopt.progress import Steps

MAX_LIMITS = 12
"""Largest number of limits per objective. A grid with this number has 144 cells."""

_SAME_POINT = 1e-7  # points that are closer than this fraction of the range are equal; ends have a slack of 1e-9


class _Cell(NamedTuple):
    """A sub-problem: its position in the grid, objective → its limit, nearby designs, and its number in the search."""

    position: tuple[int, int]
    limits: Mapping[int, float]
    near: tuple[Solution, ...]
    number: int


def fill_surface(executor: Executor, solver: FrontSolver, front: Front, point_count: int, progress: Steps) -> Front:
    """Compute the points of the front between its ends; sub-problems that failed become gaps.

    Objective 0 is minimised with limits on objectives 1 and 2, from loose to tight; the cells of one diagonal of the
    grid are solved in parallel. The worst values in the payoff table replace the nadir, which is unknown. If no design
    meets a pair of limits, all tighter pairs are skipped.
    """
    progress.begin("following the front", "sub-problem")
    ends = solver.ends
    values = np.array([p.objectives for p in ends])
    low, high = values.min(axis=0), values.max(axis=0)
    limit_count, solved_count, is_interrupted = min(point_count, MAX_LIMITS), 0, False
    loosest = limit_count, limit_count  # these limits are inactive
    optima: dict[tuple[int, int], Solution | None] = {loosest: ends[0].solution}
    failed_texts: dict[int, str] = {}
    try:
        for diagonal in range(2 * limit_count - 1, 1, -1):
            cells: list[_Cell] = []
            for i, j in ((i, diagonal - i) for i in range(limit_count, 0, -1) if 1 <= diagonal - i <= limit_count):
                looser_cells = [cell for cell in ((i + 1, j), (i, j + 1)) if max(cell) <= limit_count]
                if any(cell not in optima for cell in looser_cells):  # looser limits are already infeasible
                    continue
                limits = {k: float(low[k] + (high[k] - low[k]) * step / limit_count) for k, step in ((1, i), (2, j))}
                near = [s for s in map(optima.get, looser_cells) if s is not None]
                allowed_designs = [
                    s for s in near if all(objective_values(solver, s)[k] <= v for k, v in limits.items())
                ]
                if allowed_designs:  # the optimum under looser limits is the optimum here
                    optima[i, j] = allowed_designs[0]
                else:
                    near = near or [p.solution for p in ends]
                    cells.append(_Cell((i, j), limits, tuple(near), solved_count + len(cells)))
            for k, (optimum, is_feasible) in map_items(executor, _solve_cell, solver, cells):
                solved_count, solved_cell = solved_count + 1, cells[k]
                progress(solved_count, limit_count * limit_count - 1)
                if is_feasible:
                    optima[solved_cell.position] = optimum
                if is_feasible and optimum is None:
                    failed_texts[solved_cell.number] = " and ".join(
                        f"{solver.texts[n]} <= {v:.6g}" for n, v in solved_cell.limits.items()
                    )
    except KeyboardInterrupt:
        is_interrupted = True
    ordered_designs = [optima[cell] for cell in sorted(optima, key=lambda cell: (-sum(cell), -cell[0]))]
    all_points = [
        *ends,
        *(front_point(solver, s) for s in {id(s): s for s in ordered_designs if s is not None}.values()),
    ]
    front_points = efficient_points(all_points, _SAME_POINT * (high - low))
    gaps = tuple(Gap(f"not solved for {text}; try more starts", 0, True) for _, text in sorted(failed_texts.items()))
    return replace(front, points=tuple(front_points), gaps=gaps, solved=solved_count + 3, interrupted=is_interrupted)


def _solve_cell(solver: FrontSolver, cell: _Cell) -> tuple[Solution | None, bool]:
    """Solve a cell.

    Returns:
        The optimum or None, and whether the limits can be met; this is False if no start met them.
    """
    optimum = minimise_limited(solver.reseed(cell.number), 0, cell.limits, cell.near)
    return optimum, optimum is not None or solver.solve(
        build_subproblem(solver, 0, cell.limits), RETRY_STARTS
    ).status != "infeasible"
