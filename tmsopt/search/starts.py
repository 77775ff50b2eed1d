"""Designs to start from: those of a problem and its caller, those of the sample by turns, then a sequence."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tmsopt.program.starts import choose_starts
from tmsopt.search.enough import is_proven
from tmsopt.search.sample import Sample, sample_box
from tmsopt.search.state import LocalEnd, SearchState, Start


def sample_part(state: SearchState) -> Sample | None:
    """The sample of the part; None where arrays cannot judge what is asked: a pattern, or the radius."""
    if state.part.pattern is not None or state.part.asks_radius:
        return None
    return sample_box(state.part, state.options.seed, state.tuning)


def propose_starts(state: SearchState) -> Iterator[Start]:
    """Starts in their order: the best refined design, the boldest one, the next refined one, and so on."""
    part = state.part
    if state.options.near:
        yield Start(state.options.near)
    if part.start:
        yield Start(part.start)
    yield from (Start(design) for design in state.extra if state.holds(design))
    if state.sample:
        yield from sample_starts(state.sample)
    yield from (Start(design, near=False) for design in choose_starts(part, state.options.seed, state.options.starts))


def sample_starts(sample: Sample) -> Iterator[Start]:
    """The designs of a sample by turns."""
    return (Start(sample.box.design(sample.leaders, row), near, row) for row, near in sample.starts())


def is_led(state: SearchState, start: Start) -> bool:
    """Whether a straight way falls from a design of the sample to where a start ended: it would end there too."""
    return any(start.row in end.led for end in state.ends)


def with_led(state: SearchState, end: LocalEnd) -> LocalEnd:
    """An end with the designs of the sample, not led before, from which a straight way falls to it."""
    if not (state.sample and end.feasible and state.part.objective) or state.options.exhaustive:
        return end
    tuning, leaders, box = state.tuning, state.sample.leaders, state.sample.box
    place = box.space.points(state.design_at(end))
    known = (box.space.points(state.design_at(other)) for other in state.feasible)
    if is_proven(state, end) or any(np.abs(place - other).max() <= tuning.same for other in known):
        return end  # there are no more starts, or the ways to this design have been looked at
    left = [row for row in state.left if row != end.start.row]
    seen, near = leaders.take(np.array(left, dtype=int)), tuning.same * (end.nlp.size + abs(end.objective))
    if not left:
        return end
    shares = np.arange(1, 8)[:, None] / 8
    way = box.look((seen.u[:, None] + shares * (place - seen.u[:, None])).reshape(-1, box.space.size))
    worth, violation = (x.reshape(len(left), -1) for x in (way.worth, way.violation))
    gain = seen.worth - end.objective
    heights = np.concatenate([seen.worth[:, None], worth], axis=1)
    falls = np.all(heights[:, 1:] <= heights[:, :-1] + (tuning.level * np.abs(gain) + near)[:, None], axis=1)
    down = falls & (gain >= -near) & np.isfinite(seen.worth) & (violation.max(axis=1) <= seen.violation)
    down |= (np.abs(gain) <= near) & (seen.violation == 0)
    return replace(end, led=frozenset(np.array(left)[down].tolist()))
