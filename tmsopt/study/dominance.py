"""Which points of a set are efficient."""

from collections.abc import Sequence

from tmsopt.study.front import FrontPoint


def efficient(points: Sequence[FrontPoint], slack: Sequence[float]) -> list[FrontPoint]:
    """Points that no other dominates, by their objectives; of those that are the same the first.

    Args:
        slack: per objective, the difference that rounding explains.
    """
    kept: list[FrontPoint] = []
    for p in points:
        beaten = any(
            all(b <= a + t for a, b, t in zip(p.objectives, q.objectives, slack, strict=True))
            and any(b < a - t for a, b, t in zip(p.objectives, q.objectives, slack, strict=True))
            for q in points
        )
        same = any(
            all(abs(a - b) <= t for a, b, t in zip(p.objectives, q.objectives, slack, strict=True)) for q in kept
        )
        if not beaten and not same:
            kept.append(p)
    return sorted(kept, key=lambda p: p.objectives)
