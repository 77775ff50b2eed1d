"""The front of two objectives: limits set one after the other where it is known least."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from tmsopt.design.solution import Solution
from tmsopt.fronts.front import Front, FrontPoint, Gap, Kink, efficient
from tmsopt.fronts.subproblems import Asker, least, point
from tmsopt.progress import Counts
from tmsopt.solver.solve import covered

Objectives = tuple[float, ...]

_SAME = 1e-9  # of the range: rounding of polished optima
_UNUSED = 1e-6  # of the range: an eps whose limit the best design does not use
_GAP = 1e-3  # of the range: how closely the far end of a gap is known
_WIDE = 5e-3  # of the ranges: less is no gap but what is left of one, or rounding on a flat stretch
_FAILED = 0.05  # the same where sub-problems are not solved, for each is tried from many starts
_KINK = 2e-4  # of the ranges: how closely a kink is known
_END = 1e-3  # a change this close to an end is the end's own: beside EP4 the structure is within rounding
_ROUNDS = 3  # of sweeps that carry a better branch along the front
_NEAR = 0.02  # of the box: designs this close to one another are taken to lie on the same branch
_MOST = 8  # sub-problems per point asked for, at most
_CLOSE = 0.3  # of the mean spacing: unlabelled points closer than this to another are left out


def curve(ask: Asker, ends: Sequence[FrontPoint], points: int, progress: Counts | None) -> Front:
    """The front between its two ends, with kinks and gaps.

    Each new limit is set where neighbours are farthest apart, on the objective that changes more there; sweeps both
    ways then carry a better branch along the front.
    """
    search, interrupted = _Search(ask, ends, points, progress), False
    try:
        for _ in range(_ROUNDS):
            search.fill()
            if not search.sweep():
                break
        search.settle()
    except KeyboardInterrupt:
        interrupted = True
    return replace(_thinned(search), interrupted=interrupted)


@dataclass(frozen=True)
class _Probe:
    """A solved sub-problem: objective `axis` ≤ eps, the other minimised; None where no optimum was found."""

    axis: int
    eps: float
    found: FrontPoint | None


@dataclass(frozen=True)
class _Stretch:
    """Two neighbours on the front, the left one better in objective 0.

    Attributes:
        size: difference of each objective, in ranges.
        axis: the objective to limit between them.
        unknown: values of that limit about which no probe says anything.
        suspect: whether a probe between the two led to no point between them.
        failed: whether such a probe failed.
        gap: whether no more probes are worth it.
    """

    left: FrontPoint
    right: FrontPoint
    size: tuple[float, float]
    axis: int
    unknown: tuple[float, float]
    suspect: bool = False
    failed: bool = False
    gap: bool = False

    @property
    def length(self) -> float:
        return math.hypot(*self.size)

    @property
    def changes(self) -> bool:
        known = "undecided" not in (self.left.structure, self.right.structure)
        return known and (self.left.structure, set(self.left.limits)) != (self.right.structure, set(self.right.limits))

    @property
    def located(self) -> bool:
        """Whether the change between the two is known closely enough, or is that of an end."""
        at_end = bool(self.left.label or self.right.label)
        return self.gap or self.length <= (_END if at_end else _KINK)


class _Search:
    """The probes made so far; the front is always read from them afresh."""

    def __init__(self, ask: Asker, ends: Sequence[FrontPoint], points: int, progress: Counts | None) -> None:
        self.ask, self.ends, self.points, self.progress = ask, tuple(ends), points, progress
        self.probes: list[_Probe] = []
        self.range = tuple(abs(ends[0].objectives[k] - ends[1].objectives[k]) for k in (0, 1))

    def chain(self) -> list[FrontPoint]:
        """Efficient points by the first objective."""
        found = [*self.ends, *(p.found for p in self.probes if p.found is not None)]
        return efficient(found, [_SAME * r for r in self.range])

    def stretches(self) -> list[_Stretch]:
        return [self._stretch(left, right) for left, right in pairwise(self.chain())]

    def _stretch(self, left: FrontPoint, right: FrontPoint) -> _Stretch:
        a, b = left.objectives, right.objectives
        size = (abs(a[0] - b[0]) / self.range[0], abs(a[1] - b[1]) / self.range[1])
        own = [p for p in self.probes if self._led_nowhere(p, *((b, a) if p.axis else (a, b)))]
        if not own:
            axis = int(size[1] > size[0])
            return _Stretch(left, right, size, axis, (min(a[axis], b[axis]), max(a[axis], b[axis])))
        axis = own[0].axis
        low, high = sorted((a[axis], b[axis]))
        failures = [p.eps for p in own if p.axis == axis and p.found is None]
        empty = [p.eps for p in own if p.axis == axis and p.found is not None]
        above = max(failures + empty), high
        first = min(failures, default=low)
        below = max([low, *(e for e in empty if e < first)]), first
        unknown = below if below[1] - below[0] > _FAILED * self.range[axis] else above
        enough = _FAILED if failures else _GAP
        gap = unknown[1] - unknown[0] <= enough * self.range[axis]
        return _Stretch(left, right, size, axis, unknown, True, bool(failures), gap)

    def _led_nowhere(self, probe: _Probe, low: Objectives, high: Objectives) -> bool:
        """Whether a probe between two neighbours failed, or found nothing better than the one that is lower in it."""
        k = probe.axis
        margin = _UNUSED * self.range[k]
        if not low[k] + margin < probe.eps < high[k]:
            return False
        if probe.found is None:
            return True
        found = probe.found.objectives
        return found[k] <= low[k] + margin or found[1 - k] >= low[1 - k] - _SAME * self.range[1 - k]

    def split(self, s: _Stretch, share: float = 0.5, few: bool = False) -> None:
        """Probe between two neighbours, at a share of the way from the one that is lower in the probed objective."""
        low, high = s.unknown
        eps = low + (high - low) * (0.5 if s.suspect else share)
        near = [s.left.solution, s.right.solution]
        k, known = 1 - s.axis, s.right if s.axis else s.left
        found = None
        for quick in (True, False) if few else (False,):
            found = self.probe(s.axis, eps, near[:1] if quick and self._near(*near) else near, quick)
            if found is not None:
                if found.objectives[k] <= known.objectives[k] + _UNUSED * self.range[k]:
                    return
                self.probes.pop()
        if found is not None:  # a poor local optimum: the neighbour that meets the limit is better
            self.probes.append(_Probe(s.axis, eps, known))

    def probe(self, axis: int, eps: float, near: Sequence[Solution], few: bool = False) -> FrontPoint | None:
        ask = self.ask.later(len(self.probes))
        solution = least(ask, 1 - axis, {axis: eps}, near, few)
        found = None if solution is None else point(ask, solution)
        if found is not None or not few:
            self.probes.append(_Probe(axis, eps, found))
        if self.progress:
            self.progress(len(self.probes), max(3 * self.points, len(self.probes)))
        return found

    def _near(self, a: Solution, b: Solution) -> bool:
        """Whether two designs are close, so that starting from either comes to the same."""
        free = self.ask.problem.free.items()
        return all(abs(a.parameters[n] - b.parameters[n]) <= _NEAR * (high - low) for n, (low, high) in free)

    @property
    def exhausted(self) -> bool:
        return len(self.probes) >= _MOST * self.points + 100

    def fill(self) -> None:
        """Points where neighbours are farthest apart, until there are enough."""
        while not self.exhausted:
            stretches = self.stretches()
            open_ = [s for s in stretches if not s.gap and s.length > _GAP]
            if len(stretches) + 1 >= self.points or not open_:
                return
            widest = max(open_, key=lambda s: s.length)
            spacing = sum(s.length for s in stretches if not s.gap) / (self.points - 1)
            parts = max(2, round(widest.length / spacing))
            self.split(widest, (parts // 2) / parts)

    def sweep(self) -> bool:
        """Solve each point anew from the design before it, both ways; whether any became better."""
        before = len(self.chain())
        better = False
        for backwards in (False, True):
            chain = self.chain()[::-1] if backwards else self.chain()
            previous = chain[0]
            for old in chain[1:-1]:
                asked = next((p for p in self.probes if p.found is old), None)
                new = None
                if asked is not None and not self._near(previous.solution, old.solution):
                    new = self.probe(asked.axis, asked.eps, [previous.solution], few=True)
                if new is not None and asked is not None:
                    k = 1 - asked.axis
                    gain = old.objectives[k] - new.objectives[k]
                    if gain > _UNUSED * self.range[k]:
                        better, previous = True, new
                        continue
                    self.probes.pop()  # the same again
                previous = old
        return better or len(self.chain()) < before

    def settle(self) -> None:
        """Ends of gaps and places of kinks, to their tolerance."""
        while not self.exhausted:
            stretches = self.stretches()
            unclear = [s for s in stretches if not s.gap and s.suspect and s.length > _GAP]
            changing = [s for s in stretches if s.changes and not s.located]
            if not unclear and not changing:
                return
            self.split((unclear or changing)[0], few=bool(changing and not unclear))


def _thinned(search: _Search) -> Front:
    """The front as reported: labelled points, and the others where they are not crowded."""
    stretches = search.stretches()
    chain = [stretches[0].left, *(s.right for s in stretches)]
    words: list[list[str]] = [[p.label] if p.label else [] for p in chain]
    changes: list[tuple[int, str, float]] = []
    gaps: list[tuple[int, str, bool]] = []
    for i, s in enumerate(stretches):
        if s.gap and s.length > _WIDE:
            gaps.append((i, _missing(search.ask, s), s.failed))
            words[i].append("gap begins")
            words[i + 1].append("gap ends")
        elif s.changes and not (s.left.label or s.right.label):
            words[i] += (names := change_names(s.left, s.right))
            changes += [(i, name, s.length) for name in names]
    spacing = sum(s.length for s in stretches if not s.gap) / max(search.points - 1, 1)
    kept: list[int] = []
    since = math.inf
    ahead = _ahead(stretches, words)
    for i in range(len(chain)):
        since = since + stretches[i - 1].length if i else math.inf
        if words[i] or min(since, ahead[i]) >= _CLOSE * spacing:
            kept.append(i)
            since = 0.0
    place = {i: k for k, i in enumerate(kept)}
    notes = () if not search.exhausted else ("the search was ended: too many sub-problems; ask for more points",)
    return Front(
        problem=search.ask.problem,
        objectives=search.ask.texts,
        points=tuple(replace(chain[i], solution=covered(chain[i].solution), label="; ".join(words[i])) for i in kept),
        kinks=tuple(Kink(name, place[i], width) for i, name, width in changes),
        gaps=tuple(Gap(reason, place[i], failed) for i, reason, failed in gaps),
        solved=len(search.probes) + 2,
        seconds=0.0,
        notes=notes,
    )


def _ahead(stretches: Sequence[_Stretch], words: Sequence[list[str]]) -> list[float]:
    """Distance from each point to the next labelled one."""
    distances = [math.inf] * len(words)
    for i in range(len(words) - 2, -1, -1):
        distances[i] = stretches[i].length + (0.0 if words[i + 1] else distances[i + 1])
    return distances


def _missing(ask: Asker, s: _Stretch) -> str:
    low, high = sorted((s.left.objectives[s.axis], s.right.objectives[s.axis]))
    where = f"{ask.texts[s.axis]} from {low:.6g} to {high:.6g}"
    return f"not solved for {where}; try more starts" if s.failed else f"no efficient design was found with {where}"


def change_names(before: FrontPoint, after: FrontPoint) -> list[str]:
    """What changes from one point to the next, in words."""
    names = [f"{before.structure} -> {after.structure}"] if before.structure != after.structure else []
    names += [f"{n} begins to bind" for n in after.limits if n not in before.limits]
    return names + [f"{n} ceases to bind" for n in before.limits if n not in after.limits]
