"""Designs to start from: first the caller's, then refined and bold designs of the sample in turn, then random ones."""

from collections.abc import Iterator
from itertools import zip_longest

from tmsopt.program import choose_starts
from tmsopt.search.sample import Sample, sample_box
from tmsopt.search.state import SearchState, Start, is_inside


def sample_part(state: SearchState) -> Sample | None:
    """Sample the part of the box; None for a problem with a pattern or the radius, which arrays cannot judge."""
    if state.part.pattern is not None or state.part.asks_radius:
        return None
    return sample_box(state.part, state.options.seed, state.tuning)


def propose_starts(state: SearchState) -> Iterator[Start]:
    """Yield starts: the caller's, the best refined design, the boldest, the second refined one, and so on."""
    part = state.part
    if state.options.near:
        yield Start(state.options.near)
    if part.start:
        yield Start(part.start)
    yield from (Start(design) for design in state.extra if is_inside(part, design))
    if state.sample:
        yield from propose_sample_starts(state.sample)
    yield from (Start(design, near=False) for design in choose_starts(part, state.options.seed, state.options.starts))


def propose_sample_starts(sample: Sample) -> Iterator[Start]:
    """Yield refined and bold designs of a sample in turn."""
    count = len(sample.refined)
    for pair in zip_longest(range(count), range(count, len(sample.leaders))):
        for row in pair:
            if row is not None:
                yield Start(sample.box.design(sample.leaders, row), row < count, row)
