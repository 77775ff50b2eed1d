"""The front of two objectives, from limits set where neighbouring points are farthest apart."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate, islice, pairwise

from tmsopt.executor import Executor
from tmsopt.fronts.front import Front, FrontPoint, Gap, Kink, efficient_points
from tmsopt.fronts.subproblems import MAX_PARALLEL, FrontSolver, front_point, map_items, minimise_limited
from tmsopt.problem.solution import Solution
from tmsopt.progress import Steps
from tmsopt.search.solve import add_cover

Objectives = tuple[float, ...]

_SAME = 1e-9  # of the range: rounding of polished optima
_UNUSED = 1e-6  # of the range: an eps this far above the optimum is an inactive limit
_GAP = 1e-3  # of the range: tolerance of the far end of a gap
_WIDE = 5e-3  # of the ranges: narrower gaps are remains of others, or rounding on a flat stretch
_FAILED = 0.05  # of the range: tolerance of a gap where sub-problems fail, since each takes many starts
_KINK = 2e-4  # of the ranges: tolerance of a kink
_END = 1e-3  # of the ranges: a kink closer to an end is ignored; next to EP4 the structure is within rounding
_ROUNDS = 3  # sweeps that carry a better branch along the front
_NEAR = 0.02  # of the box: designs this close count as one branch
_MOST_PROBES = 8  # sub-problems per point
_ROOM = 1.5  # of the mean spacing: a longer stretch has room for a point
_CLOSE = 0.3  # of the mean spacing: unlabelled points closer than this to another are left out


def fill_curve(executor: Executor, solver: FrontSolver, front: Front, points: int, progress: Steps) -> Front:
    """Fill in the front between its two ends, with kinks and gaps.

    Each new limit lies where neighbours are farthest apart, on the objective that changes more there. Sweeps in both
    directions then carry a better branch along the front.
    """
    search, interrupted = _Search(executor, solver, points, progress), False
    try:
        for _ in range(_ROUNDS):
            search.add_points()
            if not search.sweep():
                break
        while search.refine_kinks_and_gaps():
            search.sweep()
    except KeyboardInterrupt:
        interrupted = True
    return replace(_assemble_front(search, front), interrupted=interrupted)


@dataclass(frozen=True)
class _Probe:
    """A solved sub-problem: objective `axis` ≤ eps, the other minimised; `point` is None without an optimum."""

    axis: int
    eps: float
    point: FrontPoint | None


@dataclass(frozen=True)
class _Stretch:
    """Two neighbours on the front; the left one is better in objective 0.

    Attributes:
        size: difference of each objective, relative to its range.
        axis: the objective to limit between them.
        unknown: range of that limit not yet probed.
        suspect: whether a probe between the two found no point between them.
        failed: whether such a probe failed.
        gap: whether the stretch needs no more probes.
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
    def has_kink(self) -> bool:
        known = "undecided" not in (self.left.structure, self.right.structure)
        return known and bool(list_changes(self.left, self.right))

    @property
    def halvings(self) -> int:
        """Halvings left until the kink between the two is placed to its tolerance."""
        at_end = bool(self.left.label or self.right.label)
        return 0 if self.gap else max(0, math.ceil(math.log2(self.length / (_END if at_end else _KINK))))


@dataclass
class _Search:
    """The probes made so far; the front is derived from them each time.

    Attributes:
        points: number of points asked for.
        steps: steps done of the task at hand, and their number.
    """

    executor: Executor
    solver: FrontSolver
    points: int
    progress: Steps
    probes: list[_Probe] = field(default_factory=list)
    steps: tuple[int, int] = (0, 0)

    def efficient_chain(self) -> list[FrontPoint]:
        """The efficient points found, sorted by the first objective."""
        found = [*self.solver.ends, *(p.point for p in self.probes if p.point is not None)]
        return efficient_points(found, [_SAME * r for r in self.solver.ranges])

    def find_stretches(self) -> list[_Stretch]:
        return [self._find_stretch(left, right) for left, right in pairwise(self.efficient_chain())]

    def _find_stretch(self, left: FrontPoint, right: FrontPoint) -> _Stretch:
        a, b = left.objectives, right.objectives
        size = tuple(abs(x - y) / span for x, y, span in zip(a, b, self.solver.ranges, strict=True))
        own = [p for p in self.probes if self._found_nothing(p, *((b, a) if p.axis else (a, b)))]
        axis = own[0].axis if own else int(size[1] > size[0])
        low, high = sorted((a[axis], b[axis]))
        failures, empty = (
            [p.eps for p in own if p.axis == axis and (p.point is None) is failed] for failed in (True, False)
        )
        above = max(failures + empty, default=low), high
        first = min(failures, default=low)
        below = max([low, *(e for e in empty if e < first)]), first
        unknown = below if below[1] - below[0] > _FAILED * self.solver.ranges[axis] else above
        enough = _FAILED if failures else _GAP
        gap = bool(own) and unknown[1] - unknown[0] <= enough * self.solver.ranges[axis]
        return _Stretch(left, right, size, axis, unknown, bool(own), bool(failures), gap)

    def _found_nothing(self, probe: _Probe, low: Objectives, high: Objectives) -> bool:
        """Whether a probe between two neighbours failed, or improved neither objective of the lower one."""
        k = probe.axis
        margin = _UNUSED * self.solver.ranges[k]
        if not low[k] + margin < probe.eps < high[k]:
            return False
        if probe.point is None:
            return True
        found = probe.point.objectives
        if found[1 - k] > low[1 - k] + _UNUSED * self.solver.ranges[1 - k]:  # a better neighbour was found later
            return False
        return found[k] <= low[k] + margin or found[1 - k] >= low[1 - k] - _SAME * self.solver.ranges[1 - k]

    def plan_probe(self, s: _Stretch, place: int, share: float = 0.5, few_starts: bool = False) -> "_ProbeRequest":
        """A probe between two neighbours, at a share of the way from the lower one in the limited objective."""
        low, high = s.unknown
        eps = low + (high - low) * (0.5 if s.suspect else share)
        near, k, known = (s.left.solution, s.right.solution), 1 - s.axis, s.right if s.axis else s.left
        quick = ((near[:1] if self._are_close(*near) else near, True),) if few_starts else ()
        enough = known.objectives[k] + _UNUSED * self.solver.ranges[k]
        return _ProbeRequest(s.axis, eps, (*quick, (near, False)), enough, known, len(self.probes) + place)

    def probe(self, requests: Sequence["_ProbeRequest"]) -> list[_Probe | None]:
        """Solve probes in parallel; Ctrl-C keeps the finished ones."""
        found: dict[int, _Probe | None] = {}
        try:
            for k, probe in map_items(self.executor, _solve_request, self.solver, requests):
                found[k] = probe
                done, most = self.steps
                self.steps = done + 1, most
                self.progress(min(done + 1, most), most)
        finally:
            ended = [found.get(k) for k in range(len(requests))]
            self.probes += [probe for probe in ended if probe is not None]
        return ended

    def _are_close(self, a: Solution, b: Solution) -> bool:
        """Whether two designs count as one branch."""
        free = self.solver.problem.free.items()
        return all(abs(a.parameters[n] - b.parameters[n]) <= _NEAR * (high - low) for n, (low, high) in free)

    @property
    def is_exhausted(self) -> bool:
        return len(self.probes) >= _MOST_PROBES * self.points + 100

    def add_points(self) -> None:
        """Add points where neighbours are farthest apart, until there are enough."""
        self.progress.begin("following the front", "point")
        self.steps = len(self.efficient_chain()), self.points
        while not self.is_exhausted:
            stretches = self.find_stretches()
            open_ = sorted((s for s in stretches if not s.gap and s.length > _GAP), key=lambda s: -s.length)
            if (missing := self.points - 1 - len(stretches)) <= 0 or not open_:
                return
            spacing = sum(s.length for s in stretches if not s.gap) / (self.points - 1)
            parts = [max(2, round(s.length / spacing)) for s in open_]
            wide = [k for k, s in enumerate(open_) if not k or s.length > _ROOM * spacing][: min(MAX_PARALLEL, missing)]
            self.probe([self.plan_probe(open_[k], k, (parts[k] // 2) / parts[k]) for k in wide])

    def sweep(self) -> bool:
        """Solve each point again from the design before it, in both directions; True if any improved."""
        before = len(self.efficient_chain())
        self.progress.begin("looking for better branches", "sub-problem")
        self.steps = 0, 2 * before
        better = False
        for direction in (1, -1):
            previous, *rest, _ = self.efficient_chain()[::direction]
            while rest:  # a few in parallel, assuming none improves; if one does, those after it are solved again
                next_requests = [*islice(self._next_requests(previous, rest), MAX_PARALLEL)]
                new = self.probe([request for _, request in next_requests])
                found = next((k for k, probe in enumerate(new) if probe is not None), None)
                if found is None:
                    last = next_requests[-1][0] if len(next_requests) == MAX_PARALLEL else len(rest) - 1
                    previous, rest = rest[last], rest[last + 1 :]
                else:
                    late = sum(probe is not None for probe in new[found + 1 :])
                    del self.probes[len(self.probes) - late :]
                    better, rest = True, rest[next_requests[found][0] + 1 :]
                    previous = self.probes[-1].point or previous
        return better or len(self.efficient_chain()) < before

    def _next_requests(self, previous: FrontPoint, rest: Sequence[FrontPoint]) -> Iterator[tuple[int, "_ProbeRequest"]]:
        """Yield the next points to solve again, with their places, each from the design before it."""
        for place, old in enumerate(rest):
            probe = next((p for p in self.probes if p.point is old), None)
            if probe is not None and not self._are_close(previous.solution, old.solution):
                k = 1 - probe.axis
                enough = old.objectives[k] - _UNUSED * self.solver.ranges[k]
                way = ((previous.solution,), True)
                yield place, _ProbeRequest(probe.axis, probe.eps, (way,), enough, None, len(self.probes))
            previous = old

    def refine_kinks_and_gaps(self) -> bool:
        """Place the ends of gaps and the kinks to their tolerance; stops early, with True, at another branch.

        Probes of a kink start from the neighbours' designs alone. Both may lie on a poorer branch, so the last probe
        uses new starts too.
        """
        self.progress.begin("placing kinks and gaps", "sub-problem")
        self.steps = 0, 0
        while not self.is_exhausted:
            stretches = self.find_stretches()
            unclear = [s for s in stretches if not s.gap and s.suspect and s.length > _GAP]
            changing = [s for s in stretches if s.has_kink and s.halvings]
            if not (now := (unclear or changing)[:MAX_PARALLEL]):
                break
            done, _ = self.steps
            self.steps = done, done + len(unclear) + sum(s.halvings for s in changing)
            few_starts = [not unclear and s.halvings > 1 for s in now]
            found = self.probe([self.plan_probe(s, k, few_starts=few_starts[k]) for k, s in enumerate(now)])
            for s, few, probe in zip(now, few_starts, found, strict=True):
                if (point := probe and probe.point) and not (unclear or few):
                    ends = s.left.solution, s.right.solution
                    if not any(self._are_close(point.solution, end) for end in ends):
                        return True
        return False


@dataclass(frozen=True)
class _ProbeRequest:
    """A probe to make.

    Attributes:
        axis, eps: the limit.
        attempts: (designs to start from, whether from these alone), tried in turn until a result is good enough.
        enough: the value of the other objective that is good enough.
        fallback: the point to use if no result is good enough; None drops the probe.
        count: number of probes before it, which selects its random starts.
    """

    axis: int
    eps: float
    attempts: tuple[tuple[tuple[Solution, ...], bool], ...]
    enough: float
    fallback: FrontPoint | None
    count: int


def _solve_request(solver: FrontSolver, request: _ProbeRequest) -> _Probe | None:
    """Solve a probe; None drops it."""
    found, solver = None, solver.reseed(request.count)
    for near, few_starts in request.attempts:
        solution = minimise_limited(solver, 1 - request.axis, {request.axis: request.eps}, near, few_starts)
        found = None if solution is None else front_point(solver, solution)
        if found is not None and found.objectives[1 - request.axis] <= request.enough:
            return _Probe(request.axis, request.eps, found)
    if request.fallback is None:
        return None
    return _Probe(request.axis, request.eps, found and request.fallback)  # better than a poor local optimum


def _assemble_front(search: _Search, front: Front) -> Front:
    """The front as reported: all labelled points, and the others where they are not crowded."""
    stretches = search.find_stretches()
    chain = [stretches[0].left, *(s.right for s in stretches)]
    labels = [list[str]() for _ in chain]
    for at, end in zip((0, -1), search.solver.ends, strict=True):
        labels[at].append(end.label)  # an end keeps its label
    kinks, gaps = list[Kink](), list[Gap]()
    for i, s in enumerate(stretches):
        if s.gap and s.length > _WIDE:
            gaps.append(Gap(_describe_gap(search.solver, s), i, s.failed))
            labels[i].append("gap begins")
            labels[i + 1].append("gap ends")
        elif s.has_kink and not (s.left.label or s.right.label):
            labels[i] += (names := list_changes(s.left, s.right))
            kinks += [Kink(name, i, s.length) for name in names]
    spacing = sum(s.length for s in stretches if not s.gap) / max(search.points - 1, 1)
    positions = [*accumulate((s.length for s in stretches), initial=0.0)]
    kept, last = list[int](), -math.inf
    for i, x in enumerate(positions):
        next_label = next((positions[k] for k in range(i + 1, len(positions)) if labels[k]), math.inf)
        if labels[i] or min(x - last, next_label - x) >= _CLOSE * spacing:
            kept.append(i)
            last = x
    place = {i: k for k, i in enumerate(kept)}
    proved = dict(map_items(search.executor, _add_cover, search.solver, [chain[i].solution for i in kept]))
    limit = "the search stopped at its limit of sub-problems; ask for more points"
    notes = (limit,) if search.is_exhausted else ()
    return replace(
        front,
        points=tuple(replace(chain[i], solution=proved[k], label="; ".join(labels[i])) for k, i in enumerate(kept)),
        kinks=tuple(replace(kink, index=place[kink.index]) for kink in kinks),
        gaps=tuple(replace(gap, index=place[gap.index]) for gap in gaps),
        solved=len(search.probes) + 2,
        notes=notes,
    )


def _add_cover(_: FrontSolver, solution: Solution) -> Solution:
    return add_cover(solution)


def _describe_gap(solver: FrontSolver, s: _Stretch) -> str:
    low, high = sorted((s.left.objectives[s.axis], s.right.objectives[s.axis]))
    where = f"{solver.texts[s.axis]} from {low:.6g} to {high:.6g}"
    return f"not solved for {where}; try more starts" if s.failed else f"no efficient design was found with {where}"


def list_changes(before: FrontPoint, after: FrontPoint) -> list[str]:
    """Names of the changes from one point to the next."""
    names = [f"{before.structure} -> {after.structure}"] if before.structure != after.structure else []
    names += [f"{n} begins to bind" for n in after.limits if n not in before.limits]
    return names + [f"{n} ceases to bind" for n in before.limits if n not in after.limits]
