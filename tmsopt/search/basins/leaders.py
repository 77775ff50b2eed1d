"""Designs of a sample to start from, and which of them lead down to where a start ended."""

from collections.abc import Iterator, Sequence
from itertools import cycle

import numpy as np

from tmsopt.program.starts import designs
from tmsopt.records import Array
from tmsopt.search.workspace import LocalEnd, Workspace

SAME = 1e-7
"""Relative difference of objectives that counts as the same."""

_WAY = np.arange(1, 8) / 8  # from a design to where a start ended, looked at for what is worse
_LEVEL = 1e-3  # of the difference of its ends: what may be worse on the way for numeric roots
_KINDS = 2  # of designs of a sample to start from: near to an optimum, or afar


def starting(
    work: Workspace, ended: Sequence[LocalEnd] = (), left: list[int] | None = None
) -> Iterator[tuple[dict[str, float], bool]]:
    """Designs to start from, and whether each may be near an optimum: those of the sample first, by turns.

    After the first of either kind, the one that is farthest from where starts `ended` meanwhile: those beside it would
    end there too.

    Args:
        left: rows of the sample's leaders that are still to be started from; taken from it.
    """
    if work.sampler and work.sample:
        seen, count = work.sample.leaders, len(work.sample.refined)
        rows = [*range(len(seen))] if left is None else left
        for turn, near in enumerate(cycle((True, False))):
            if not rows:
                break
            if some := [row for row in rows if (row < count) == near]:
                row = some[0 if near or turn < _KINDS else _farthest(work, seen.u[some], ended)]
                rows.remove(row)
                yield work.sampler.design(seen, row), near
    yield from ((design, False) for design in designs(work.part, work.options.seed, work.options.starts))


def _farthest(work: Workspace, u: Array, ended: Sequence[LocalEnd]) -> int:
    """The point that is farthest from where starts ended; the first one where none did."""
    assert work.sampler
    ends = {id(c): work.sampler.space.points(work.design_at(c.run.x)) for c in ended if c.feasible}
    return int(np.argmax(np.linalg.norm(u[:, None] - [*ends.values()], axis=2).min(axis=1))) if ends else 0


def led(work: Workspace, end: LocalEnd, left: list[int]) -> int:
    """How many leaders a straight way leads from, never up, to where a start ended; they are left no more."""
    if not (work.sampler and work.sample and left and end.feasible and work.part.objective):
        return 0
    seen, near = work.sample.leaders.take(np.array(left)), SAME * (end.nlp.size + abs(end.objective))
    place = work.sampler.space.points(work.design_at(end.run.x))
    u = seen.u[:, None] + _WAY[:, None] * (place - seen.u[:, None])
    way = work.sampler.look(u.reshape(-1, work.sampler.space.size))
    worth, violation = (x.reshape(len(left), -1) for x in (way.worth, way.violation))
    gain = seen.worth - end.objective
    heights = np.concatenate([seen.worth[:, None], worth], axis=1)
    falls = np.all(heights[:, 1:] <= heights[:, :-1] + (_LEVEL * np.abs(gain) + near)[:, None], axis=1)
    down = falls & (gain >= -near) & np.isfinite(seen.worth) & (violation.max(axis=1) <= seen.violation)
    down |= (np.abs(gain) <= near) & (seen.violation == 0)
    count = len(left)
    left[:] = [row for row, is_led in zip(left, down.tolist(), strict=True) if not is_led]
    return count - len(left)
