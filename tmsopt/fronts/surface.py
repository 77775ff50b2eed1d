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
    RETRY,
    FrontSolver,
    build_subproblem,
    front_point,
    map_items,
    minimise_limited,
    objective_values,
)
from tmsopt.problem.solution import Solution
from tmsopt.progress import Steps

MAX_SIDE = 12
"""Largest number of limits per objective; the grid then has 144 cells."""

_SAME = 1e-7  # fraction of the range: points that are closer are equal; the ends have a slack of 1e-9


class _Cell(NamedTuple):
    """A sub-problem: its position in the grid, limits on objectives, nearby designs, and its number."""

    place: tuple[int, int]
    limits: Mapping[int, float]
    near: tuple[Solution, ...]
    number: int


def fill_surface(executor: Executor, solver: FrontSolver, front: Front, points: int, progress: Steps) -> Front:
    """Compute the points of the front between its ends; sub-problems that failed become gaps.

    Objective 0 is minimised with limits on objectives 1 and 2, from loose to tight; the cells of one diagonal of the
    grid are solved in parallel. The worst values in the payoff table replace the nadir, which is unknown. If no design
    meets a pair of limits, all tighter pairs are skipped.
    """
    progress.begin("following the front", "sub-problem")
    ends = solver.ends
    values = np.array([p.objectives for p in ends])
    low, high = values.min(axis=0), values.max(axis=0)
    side, count, interrupted = min(points, MAX_SIDE), 0, False
    solved: dict[tuple[int, int], Solution | None] = {(side, side): ends[0].solution}  # the loosest limits are inactive
    failed: dict[int, str] = {}
    try:
        for diagonal in range(2 * side - 1, 1, -1):
            cells: list[_Cell] = []
            for i, j in ((i, diagonal - i) for i in range(side, 0, -1) if 1 <= diagonal - i <= side):
                looser = [cell for cell in ((i + 1, j), (i, j + 1)) if max(cell) <= side]
                if any(cell not in solved for cell in looser):  # looser limits are already infeasible
                    continue
                limits = {k: float(low[k] + (high[k] - low[k]) * step / side) for k, step in ((1, i), (2, j))}
                near = [s for s in map(solved.get, looser) if s is not None]
                allowed_designs = [
                    s for s in near if all(objective_values(solver, s)[k] <= v for k, v in limits.items())
                ]
                if allowed_designs:  # the optimum under looser limits is the optimum here
                    solved[i, j] = allowed_designs[0]
                else:
                    near = near or [p.solution for p in ends]
                    cells.append(_Cell((i, j), limits, tuple(near), count + len(cells)))
            for k, (optimum, feasible) in map_items(executor, _solve_cell, solver, cells):
                count, solved_cell = count + 1, cells[k]
                progress(count, side * side - 1)
                if feasible:
                    solved[solved_cell.place] = optimum
                if feasible and optimum is None:
                    failed[solved_cell.number] = " and ".join(
                        f"{solver.texts[n]} <= {v:.6g}" for n, v in solved_cell.limits.items()
                    )
    except KeyboardInterrupt:
        interrupted = True
    ordered = [solved[cell] for cell in sorted(solved, key=lambda cell: (-sum(cell), -cell[0]))]
    all_points = [*ends, *(front_point(solver, s) for s in {id(s): s for s in ordered if s is not None}.values())]
    front_points = efficient_points(all_points, _SAME * (high - low))
    gaps = tuple(Gap(f"not solved for {text}; try more starts", 0, True) for _, text in sorted(failed.items()))
    return replace(front, points=tuple(front_points), gaps=gaps, solved=count + 3, interrupted=interrupted)


def _solve_cell(solver: FrontSolver, cell: _Cell) -> tuple[Solution | None, bool]:
    """Solve a cell.

    Returns:
        The optimum or None, and whether the limits can be met; this is False if no start met them.
    """
    optimum = minimise_limited(solver.reseed(cell.number), 0, cell.limits, cell.near)
    return optimum, optimum is not None or solver.solve(
        build_subproblem(solver, 0, cell.limits), RETRY
    ).status != "infeasible"
