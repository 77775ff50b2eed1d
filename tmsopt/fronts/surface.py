"""The front of three objectives, from a grid of limits on two of them over the payoff table."""

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
"""Most limits per objective, so at most 144 cells."""

_SAME = 1e-7  # of the range: points closer than this are equal; ends have a slack of 1e-9


class _Cell(NamedTuple):
    """A sub-problem: its place in the grid, limits on objectives, nearby designs, and its number."""

    place: tuple[int, int]
    limits: Mapping[int, float]
    near: tuple[Solution, ...]
    number: int


def fill_surface(executor: Executor, solver: FrontSolver, front: Front, points: int, progress: Steps) -> Front:
    """Fill in the front between its ends; sub-problems that failed become gaps.

    Objective 0 is minimised with limits on 1 and 2, from loose to tight, one diagonal of the grid at a time in
    parallel. The worst values in the payoff table stand for the nadir. Limits that no design meets end the search for
    all tighter ones.
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
                meets = [s for s in near if all(objective_values(solver, s)[k] <= v for k, v in limits.items())]
                if meets:  # the optimum under looser limits is the optimum here
                    solved[i, j] = meets[0]
                else:
                    near = near or [p.solution for p in ends]
                    cells.append(_Cell((i, j), limits, tuple(near), count + len(cells)))
            for k, (found, possible) in map_items(executor, _solve_cell, solver, cells):
                count, own = count + 1, cells[k]
                progress(count, side * side - 1)
                if possible:
                    solved[own.place] = found
                if possible and found is None:
                    failed[own.number] = " and ".join(f"{solver.texts[n]} <= {v:.6g}" for n, v in own.limits.items())
    except KeyboardInterrupt:
        interrupted = True
    ordered = [solved[cell] for cell in sorted(solved, key=lambda cell: (-sum(cell), -cell[0]))]
    every = [*ends, *(front_point(solver, s) for s in {id(s): s for s in ordered if s is not None}.values())]
    kept = efficient_points(every, _SAME * (high - low))
    gaps = tuple(Gap(f"not solved for {text}; try more starts", 0, True) for _, text in sorted(failed.items()))
    return replace(front, points=tuple(kept), gaps=gaps, solved=count + 3, interrupted=interrupted)


def _solve_cell(solver: FrontSolver, cell: _Cell) -> tuple[Solution | None, bool]:
    """The optimum of a cell, or None; and whether one may exist, which is False if no start met the limits."""
    found = minimise_limited(solver.reseed(cell.number), 0, cell.limits, cell.near)
    return found, found is not None or solver.solve(
        build_subproblem(solver, 0, cell.limits), RETRY
    ).status != "infeasible"
