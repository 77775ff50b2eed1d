"""Designs to start from: the caller's, then the sample's refined and bold ones in turn, then a sequence."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import zip_longest

import numpy as np

from tmsopt.program.starts import choose_starts
from tmsopt.search.sample import Sample, sample_box
from tmsopt.search.state import LocalEnd, SearchState, Start
from tmsopt.search.stopping import is_proven


def sample_part(state: SearchState) -> Sample | None:
    """Sample the part; None if arrays cannot judge the problem because it asks for a pattern or the radius."""
    if state.part.pattern is not None or state.part.asks_radius:
        return None
    return sample_box(state.part, state.options.seed, state.tuning)


def propose_starts(state: SearchState) -> Iterator[Start]:
    """Starts in order: the caller's, the best refined design, the boldest, the next refined one, and so on."""
    part = state.part
    if state.options.near:
        yield Start(state.options.near)
    if part.start:
        yield Start(part.start)
    yield from (Start(design) for design in state.extra if state.holds(design))
    if state.sample:
        yield from propose_sample_starts(state.sample)
    yield from (Start(design, near=False) for design in choose_starts(part, state.options.seed, state.options.starts))


def propose_sample_starts(sample: Sample) -> Iterator[Start]:
    """Refined and bold designs of a sample in turn."""
    count = len(sample.refined)
    for pair in zip_longest(range(count), range(count, len(sample.leaders))):
        for row in pair:
            if row is not None:
                yield Start(sample.box.design(sample.leaders, row), row < count, row)


def is_led(state: SearchState, start: Start) -> bool:
    """Whether the sampled design of this start leads straight down to an end, so that it would end there too."""
    return any(start.row in end.led for end in state.ends)


def add_led_designs(state: SearchState, end: LocalEnd) -> LocalEnd:
    """Add to an end the sampled designs that lead straight down to it and to no earlier end."""
    if not (state.sample and end.feasible and state.part.objective) or state.options.exhaustive:
        return end
    tuning, leaders, box = state.tuning, state.sample.leaders, state.sample.box
    place = box.space.points(state.design_at(end))
    known = (box.space.points(state.design_at(other)) for other in state.feasible)
    if is_proven(state, end) or any(np.abs(place - other).max() <= tuning.same for other in known):
        return end  # the search ends here, or an earlier end has the same design
    rows = [row for row in state.left if row != end.start.row]
    seen, near = leaders.take(np.array(rows, dtype=int)), tuning.same * (end.nlp.size + abs(end.objective))
    if not rows:
        return end
    shares = np.arange(1, 8)[:, None] / 8
    path = box.judge_points((seen.u[:, None] + shares * (place - seen.u[:, None])).reshape(-1, box.space.size))
    objective, violation = (x.reshape(len(rows), -1) for x in (path.objective, path.violation))
    gain = seen.objective - end.objective
    heights = np.concatenate([seen.objective[:, None], objective], axis=1)
    falls = np.all(heights[:, 1:] <= heights[:, :-1] + (tuning.level * np.abs(gain) + near)[:, None], axis=1)
    down = falls & (gain >= -near) & np.isfinite(seen.objective) & (violation.max(axis=1) <= seen.violation)
    down |= (np.abs(gain) <= near) & (seen.violation == 0)
    return replace(end, led=frozenset(np.array(rows)[down].tolist()))
