"""The front of two objectives: limits set one after the other where it is known least."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, islice, pairwise

from tmsopt.executor import Executor
from tmsopt.fronts.front import Front, FrontPoint, Gap, Kink, efficient
from tmsopt.fronts.subproblems import FrontSolver, least, point
from tmsopt.fronts.team import AT_ONCE, each
from tmsopt.problem.solution import Solution
from tmsopt.progress import Steps
from tmsopt.search.solve import add_cover

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
_ROOM = 1.5  # of the mean spacing: a longer stretch has room for a point
_CLOSE = 0.3  # of the mean spacing: unlabelled points closer than this to another are left out


def curve(team: Executor, ask: FrontSolver, front: Front, points: int, progress: Steps) -> Front:
    """The front between the two ends that `ask` has, with kinks and gaps; nothing else is known of it yet.

    Each new limit is set where neighbours are farthest apart, on the objective that changes more there; sweeps both
    ways then carry a better branch along the front.
    """
    search, interrupted = _Search(team, ask, points, progress), False
    try:
        for _ in range(_ROUNDS):
            search.fill()
            if not search.sweep():
                break
        while search.settle():
            search.sweep()
    except KeyboardInterrupt:
        interrupted = True
    return replace(_thinned(search, front), interrupted=interrupted)


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
    size: tuple[float, ...]
    axis: int
    unknown: tuple[float, float]
    suspect: bool
    failed: bool
    gap: bool

    @property
    def length(self) -> float:
        return math.hypot(*self.size)

    @property
    def changes(self) -> bool:
        known = "undecided" not in (self.left.structure, self.right.structure)
        return known and (self.left.structure, set(self.left.limits)) != (self.right.structure, set(self.right.limits))

    @property
    def halvings(self) -> int:
        """After how many the change between the two is known closely enough, or is that of an end."""
        at_end = bool(self.left.label or self.right.label)
        return 0 if self.gap else max(0, math.ceil(math.log2(self.length / (_END if at_end else _KINK))))


class _Search:
    """The probes made so far; the front is always read from them afresh."""

    def __init__(self, team: Executor, ask: FrontSolver, points: int, progress: Steps) -> None:
        self.team, self.ask, self.points, self.progress = team, ask, points, progress
        self.ends, self.range = ask.ends, ask.ranges
        self.probes: list[_Probe] = []
        self.done, self.most = 0, points  # of what is counted

    def chain(self) -> list[FrontPoint]:
        """Efficient points by the first objective."""
        found = [*self.ends, *(p.found for p in self.probes if p.found is not None)]
        return efficient(found, [_SAME * r for r in self.range])

    def stretches(self) -> list[_Stretch]:
        return [self._stretch(left, right) for left, right in pairwise(self.chain())]

    def _stretch(self, left: FrontPoint, right: FrontPoint) -> _Stretch:
        a, b = left.objectives, right.objectives
        size = tuple(abs(x - y) / span for x, y, span in zip(a, b, self.range, strict=True))
        own = [p for p in self.probes if self._led_nowhere(p, *((b, a) if p.axis else (a, b)))]
        axis = own[0].axis if own else int(size[1] > size[0])
        low, high = sorted((a[axis], b[axis]))
        failures = [p.eps for p in own if p.axis == axis and p.found is None]
        empty = [p.eps for p in own if p.axis == axis and p.found is not None]
        above = max(failures + empty, default=low), high
        first = min(failures, default=low)
        below = max([low, *(e for e in empty if e < first)]), first
        unknown = below if below[1] - below[0] > _FAILED * self.range[axis] else above
        enough = _FAILED if failures else _GAP
        gap = bool(own) and unknown[1] - unknown[0] <= enough * self.range[axis]
        return _Stretch(left, right, size, axis, unknown, bool(own), bool(failures), gap)

    def _led_nowhere(self, probe: _Probe, low: Objectives, high: Objectives) -> bool:
        """Whether a probe between two neighbours failed, or found nothing better than the one that is lower in it."""
        k = probe.axis
        margin = _UNUSED * self.range[k]
        if not low[k] + margin < probe.eps < high[k]:
            return False
        if probe.found is None:
            return True
        found = probe.found.objectives
        if found[1 - k] > low[1 - k] + _UNUSED * self.range[1 - k]:  # no better one was known when it was asked
            return False
        return found[k] <= low[k] + margin or found[1 - k] >= low[1 - k] - _SAME * self.range[1 - k]

    def between(self, s: _Stretch, place: int, share: float = 0.5, few: bool = False) -> "_Asked":
        """A probe between two neighbours, at a share of the way from the one that is lower in the probed objective."""
        low, high = s.unknown
        eps = low + (high - low) * (0.5 if s.suspect else share)
        near, k, known = (s.left.solution, s.right.solution), 1 - s.axis, s.right if s.axis else s.left
        quick = ((near[:1] if self._near(*near) else near, True),) if few else ()
        enough = known.objectives[k] + _UNUSED * self.range[k]
        return _Asked(s.axis, eps, (*quick, (near, False)), enough, known, len(self.probes) + place)

    def probe(self, asked: Sequence["_Asked"]) -> list[_Probe | None]:
        """What comes of probes, solved side by side; those that have ended are kept when the user ends the others."""
        found: dict[int, _Probe | None] = {}
        try:
            for k, probe in each(self.team, _probed, self.ask, asked):
                found[k] = probe
                self.done += 1
                self.progress(min(self.done, self.most), self.most)
        finally:
            ended = [found.get(k) for k in range(len(asked))]
            self.probes += [probe for probe in ended if probe is not None]
        return ended

    def _near(self, a: Solution, b: Solution) -> bool:
        """Whether two designs are close, so that starting from either comes to the same."""
        free = self.ask.problem.free.items()
        return all(abs(a.parameters[n] - b.parameters[n]) <= _NEAR * (high - low) for n, (low, high) in free)

    @property
    def exhausted(self) -> bool:
        return len(self.probes) >= _MOST * self.points + 100

    def fill(self) -> None:
        """Points where neighbours are farthest apart, until there are enough."""
        self.progress.begin("following the front", "point")
        self.done, self.most = len(self.chain()), self.points
        while not self.exhausted:
            stretches = self.stretches()
            open_ = sorted((s for s in stretches if not s.gap and s.length > _GAP), key=lambda s: -s.length)
            if (missing := self.points - 1 - len(stretches)) <= 0 or not open_:
                return
            spacing = sum(s.length for s in stretches if not s.gap) / (self.points - 1)
            parts = [max(2, round(s.length / spacing)) for s in open_]
            wide = [k for k, s in enumerate(open_) if not k or s.length > _ROOM * spacing][: min(AT_ONCE, missing)]
            self.probe([self.between(open_[k], k, (parts[k] // 2) / parts[k]) for k in wide])

    def sweep(self) -> bool:
        """Solve each point anew from the design before it, both ways; whether any became better."""
        before = len(self.chain())
        self.progress.begin("looking for better branches", "sub-problem")
        self.done, self.most = 0, 2 * before
        better = False
        for backwards in (False, True):
            chain = self.chain()[::-1] if backwards else self.chain()
            previous, rest = chain[0], chain[1:-1]
            while rest:  # a few at once, as if none became better; where one does, those after it are asked again
                ahead = [*islice(self._next(previous, rest), AT_ONCE)]
                new = self.probe([asked for _, asked in ahead])
                found = next((k for k, probe in enumerate(new) if probe is not None), None)
                if found is None:
                    last = ahead[-1][0] if len(ahead) == AT_ONCE else len(rest) - 1
                    previous, rest = rest[last], rest[last + 1 :]
                else:
                    late = sum(probe is not None for probe in new[found + 1 :])
                    del self.probes[len(self.probes) - late :]
                    better, rest = True, rest[ahead[found][0] + 1 :]
                    previous = self.probes[-1].found or previous
        return better or len(self.chain()) < before

    def _next(self, previous: FrontPoint, rest: Sequence[FrontPoint]) -> Iterator[tuple[int, "_Asked"]]:
        """The next points that are to be solved anew, by their places, each from the one before it."""
        for place, old in enumerate(rest):
            probe = next((p for p in self.probes if p.found is old), None)
            if probe is not None and not self._near(previous.solution, old.solution):
                k = 1 - probe.axis
                enough = old.objectives[k] - _UNUSED * self.range[k]
                way = ((previous.solution,), True)
                yield place, _Asked(probe.axis, probe.eps, (way,), enough, None, len(self.probes))
            previous = old

    def settle(self) -> bool:
        """Ends of gaps and places of kinks, to their tolerance; ended early, with True, where another branch is met.

        A kink is halved from the neighbours' designs alone and, as both may be on a poorer branch, at last as others.
        """
        self.progress.begin("placing kinks and gaps", "sub-problem")
        self.done = 0
        while not self.exhausted:
            stretches = self.stretches()
            unclear = [s for s in stretches if not s.gap and s.suspect and s.length > _GAP]
            changing = [s for s in stretches if s.changes and s.halvings]
            if not (now := (unclear or changing)[:AT_ONCE]):
                break
            self.most = self.done + len(unclear) + sum(s.halvings for s in changing)
            few = [not unclear and s.halvings > 1 for s in now]
            found = self.probe([self.between(s, k, few=few[k]) for k, s in enumerate(now)])
            if not unclear and any(not f and self._apart(p, s) for s, f, p in zip(now, few, found, strict=True)):
                return True
        return False

    def _apart(self, probe: _Probe | None, s: _Stretch) -> bool:
        """Whether a probe found a design close to neither neighbour."""
        found = probe.found if probe else None
        return found is not None and not any(self._near(found.solution, end.solution) for end in (s.left, s.right))


@dataclass(frozen=True)
class _Asked:
    """A probe to be made.

    Attributes:
        axis, eps: the limit.
        ways: designs to start from and whether from them alone, one way after the other until the result will do.
        enough: what the other objective has to come to at least.
        known: what stands for a design that does not come to that; None where it is then as if nothing was asked.
        count: of probes before it, for starts of its own.
    """

    axis: int
    eps: float
    ways: tuple[tuple[tuple[Solution, ...], bool], ...]
    enough: float
    known: FrontPoint | None
    count: int


def _probed(ask: FrontSolver, asked: _Asked) -> _Probe | None:
    """What comes of a probe."""
    found, ask = None, ask.later(asked.count)
    for near, few in asked.ways:
        solution = least(ask, 1 - asked.axis, {asked.axis: asked.eps}, near, few)
        found = None if solution is None else point(ask, solution)
        if found is not None and found.objectives[1 - asked.axis] <= asked.enough:
            return _Probe(asked.axis, asked.eps, found)
    if asked.known is None:
        return None
    return _Probe(asked.axis, asked.eps, found and asked.known)  # of a poor local optimum, the neighbour is better


def _thinned(search: _Search, front: Front) -> Front:
    """The front as reported: labelled points, and the others where they are not crowded."""
    stretches = search.stretches()
    chain = [stretches[0].left, *(s.right for s in stretches)]
    words = [[search.ends[0].label], *(list[str]() for _ in chain[1:-1]), [search.ends[1].label]]  # even if better
    kinks, gaps = list[Kink](), list[Gap]()
    for i, s in enumerate(stretches):
        if s.gap and s.length > _WIDE:
            gaps.append(Gap(_missing(search.ask, s), i, s.failed))
            words[i].append("gap begins")
            words[i + 1].append("gap ends")
        elif s.changes and not (s.left.label or s.right.label):
            words[i] += (names := change_names(s.left, s.right))
            kinks += [Kink(name, i, s.length) for name in names]
    spacing = sum(s.length for s in stretches if not s.gap) / max(search.points - 1, 1)
    at = [*accumulate((s.length for s in stretches), initial=0.0)]
    kept, last = list[int](), -math.inf
    for i, x in enumerate(at):
        ahead = next((at[k] for k in range(i + 1, len(at)) if words[k]), math.inf)
        if words[i] or min(x - last, ahead - x) >= _CLOSE * spacing:
            kept.append(i)
            last = x
    place = {i: k for k, i in enumerate(kept)}
    proved = dict(each(search.team, _covered, search.ask, [chain[i].solution for i in kept]))
    notes = () if not search.exhausted else ("the search was ended: too many sub-problems; ask for more points",)
    return replace(
        front,
        points=tuple(replace(chain[i], solution=proved[k], label="; ".join(words[i])) for k, i in enumerate(kept)),
        kinks=tuple(replace(kink, index=place[kink.index]) for kink in kinks),
        gaps=tuple(replace(gap, index=place[gap.index]) for gap in gaps),
        solved=len(search.probes) + 2,
        notes=notes,
    )


def _covered(_: FrontSolver, solution: Solution) -> Solution:
    return add_cover(solution)


def _missing(ask: FrontSolver, s: _Stretch) -> str:
    low, high = sorted((s.left.objectives[s.axis], s.right.objectives[s.axis]))
    where = f"{ask.texts[s.axis]} from {low:.6g} to {high:.6g}"
    return f"not solved for {where}; try more starts" if s.failed else f"no efficient design was found with {where}"


def change_names(before: FrontPoint, after: FrontPoint) -> list[str]:
    """What changes from one point to the next, in words."""
    names = [f"{before.structure} -> {after.structure}"] if before.structure != after.structure else []
    names += [f"{n} begins to bind" for n in after.limits if n not in before.limits]
    return names + [f"{n} ceases to bind" for n in before.limits if n not in after.limits]
