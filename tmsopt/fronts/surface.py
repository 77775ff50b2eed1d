"""The front of three objectives: a grid of limits on two of them, over the payoff table."""

from collections.abc import Sequence
from itertools import product

from tmsopt.design.solution import Solution
from tmsopt.fronts.front import FrontPoint, Gap, efficient
from tmsopt.fronts.subproblems import Asker, least, point, solvable
from tmsopt.progress import Counts

MOST = 12
"""Limits per objective at most, so 144 sub-problems."""

_SAME = 1e-7  # of the range: a corner of the table is held with a slack of 1e-9


def surface(
    ask: Asker, ends: Sequence[FrontPoint], points: int, progress: Counts | None
) -> tuple[tuple[FrontPoint, ...], tuple[Gap, ...], int, bool]:
    """Efficient points, sub-problems that failed, the number of those solved, and whether the user ended it.

    Objective 0 is minimised with limits on 1 and 2, from loose to tight; the worst values in the payoff table
    stand for the nadir. A limit that no design meets ends its row, and every tighter one with it.
    """
    table = [[p.objectives[k] for p in ends] for k in range(3)]
    low, high = [min(c) for c in table], [max(c) for c in table]
    side = min(points, MOST)
    solved: dict[tuple[int, int], Solution | None] = {}
    impossible: set[tuple[int, int]] = set()
    failed: list[str] = []
    count = 0
    interrupted = False
    try:
        for i, j in product(range(side, 0, -1), repeat=2):
            looser = [(i + 1, j), (i, j + 1)]
            if any(cell in impossible for cell in looser):
                impossible.add((i, j))
                continue
            limits = {k: low[k] + (high[k] - low[k]) * step / side for k, step in ((1, i), (2, j))}
            near = [s for s in (solved.get(cell) for cell in looser) if s is not None]
            meets = [s for s in near if all(point(ask, s).objectives[k] <= v for k, v in limits.items())]
            if meets:  # the best under looser limits is the best here
                solved[i, j] = meets[0]
                continue
            found = least(ask.later(count), 0, limits, near or [p.solution for p in ends])
            count += 1
            if found is None and not solvable(ask, 0, limits):
                impossible.add((i, j))
            elif found is None:
                failed.append(" and ".join(f"{ask.texts[k]} <= {v:.6g}" for k, v in limits.items()))
            solved[i, j] = found
            if progress:
                progress(count, side * side)
    except KeyboardInterrupt:
        interrupted = True
    every = [*ends, *(point(ask, s) for s in {id(s): s for s in solved.values() if s is not None}.values())]
    ranges = [h - b for b, h in zip(low, high, strict=True)]
    kept = efficient(every, [_SAME * r for r in ranges])
    gaps = tuple(Gap(f"not solved for {text}; try more starts", 0, True) for text in failed)
    return tuple(kept), gaps, count + 3, interrupted
