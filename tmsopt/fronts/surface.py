"""The front of three objectives: a grid of limits on two of them, over the payoff table."""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

from tmsopt.executor import Executor
from tmsopt.fronts.front import Front, Gap, efficient
from tmsopt.fronts.subproblems import RETRY, FrontSolver, least, objectives, point, subproblem
from tmsopt.fronts.team import each
from tmsopt.problem.solution import Solution
from tmsopt.progress import Steps

MOST = 12
"""Limits per objective at most, so 144 cells."""

_SAME = 1e-7  # of the range: a corner of the table is held with a slack of 1e-9


class _Cell(NamedTuple):
    """A sub-problem: its place in the grid, limits on objectives, designs near by, and its number."""

    place: tuple[int, int]
    limits: Mapping[int, float]
    near: tuple[Solution, ...]
    number: int


def surface(team: Executor, ask: FrontSolver, front: Front, points: int, progress: Steps) -> Front:
    """The front, of which nothing is known yet but the ends that `ask` has, with the sub-problems that failed as gaps.

    Objective 0 is minimised with limits on 1 and 2, from loose to tight, those side by side that do not follow from one
    another; the worst values in the payoff table stand for the nadir. A limit that no design meets ends its row, and
    every tighter one with it.
    """
    progress.begin("following the front", "sub-problem")
    ends = ask.ends
    low, high = ([f(column) for column in zip(*(p.objectives for p in ends), strict=True)] for f in (min, max))
    side, count, interrupted = min(points, MOST), 0, False
    solved: dict[tuple[int, int], Solution | None] = {(side, side): ends[0].solution}  # the loosest limits cut nothing
    failed: dict[int, str] = {}
    try:
        for diagonal in range(2 * side - 1, 1, -1):
            cells: list[_Cell] = []
            for i, j in ((i, diagonal - i) for i in range(side, 0, -1) if 1 <= diagonal - i <= side):
                looser = [cell for cell in ((i + 1, j), (i, j + 1)) if max(cell) <= side]
                if any(cell not in solved for cell in looser):  # no design meets its limits, nor these
                    continue
                limits = {k: low[k] + (high[k] - low[k]) * step / side for k, step in ((1, i), (2, j))}
                near = [s for s in map(solved.get, looser) if s is not None]
                meets = [s for s in near if all(objectives(ask, s)[k] <= v for k, v in limits.items())]
                if meets:  # the best under looser limits is the best here
                    solved[i, j] = meets[0]
                else:
                    near = near or [p.solution for p in ends]
                    cells.append(_Cell((i, j), limits, tuple(near), count + len(cells)))
            for k, (found, possible) in each(team, _solved, ask, cells):
                count, own = count + 1, cells[k]
                progress(count, side * side - 1)
                if possible:
                    solved[own.place] = found
                if possible and found is None:
                    failed[own.number] = " and ".join(f"{ask.texts[n]} <= {v:.6g}" for n, v in own.limits.items())
    except KeyboardInterrupt:
        interrupted = True
    ordered = [solved[cell] for cell in sorted(solved, key=lambda cell: (-sum(cell), -cell[0]))]
    every = [*ends, *(point(ask, s) for s in {id(s): s for s in ordered if s is not None}.values())]
    kept = efficient(every, [_SAME * (h - b) for b, h in zip(low, high, strict=True)])
    gaps = tuple(Gap(f"not solved for {text}; try more starts", 0, True) for _, text in sorted(failed.items()))
    return replace(front, points=tuple(kept), gaps=gaps, solved=count + 3, interrupted=interrupted)


def _solved(ask: FrontSolver, cell: _Cell) -> tuple[Solution | None, bool]:
    """The best of a cell, None where no optimum was found, and whether there may be one: not if no start met limits."""
    found = least(ask.later(cell.number), 0, cell.limits, cell.near)
    return found, found is not None or ask.solve(subproblem(ask, 0, cell.limits), RETRY).status != "infeasible"
