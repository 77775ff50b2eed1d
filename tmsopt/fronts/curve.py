"""The front of two objectives.

A sub-problem (here: probe) limits one objective by eps and minimises the other. The next eps lies in the stretch
between those two neighbouring points of the front that are farthest apart. Points whose designs change continuously
along the front belong to one branch; the designs of another branch can be better.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate, islice, pairwise

from tmsopt.executor import Executor
from tmsopt.fronts.front import Front, FrontPoint, Gap, Kink, efficient_points
from tmsopt.fronts.subproblems import MAX_PARALLEL, FrontSolver, front_point, map_items, minimise_limited
from tmsopt.problem.solution import Solution
from tmsopt.progress import Steps
from tmsopt.search.solve import add_worst_case_proof

Objectives = tuple[float, ...]

# Fractions of the range of an objective over the front
_ROUNDING = 1e-9  # polished optima that differ by less are equal
_INACTIVE = 1e-6  # an eps that lies this far above the optimum is an inactive limit
_GAP_TOLERANCE = 1e-3  # the far end of a gap is located to this
_FAILED_GAP_TOLERANCE = 0.05  # the same where sub-problems fail, because each failure takes many starts
_MIN_GAP = 5e-3  # narrower gaps are remains of others, or come from rounding on a flat stretch
_KINK_TOLERANCE = 2e-4  # a kink is located to this
_END_DISTANCE = 1e-3  # a kink closer to an end is ignored; next to EP4 the structure is uncertain by rounding

_MAX_SWEEPS = 3  # a sweep carries a better branch along the front
_SAME_BRANCH = 0.02  # designs that differ by less, as a fraction of the box, count as one branch
_MAX_PROBES = 8  # sub-problems per point
_MIN_ROOM = 1.5  # a stretch that is longer than this times the mean spacing has room for a point
_MIN_SPACING = 0.3  # points without a label that are closer, as a fraction of the mean spacing, are left out


def fill_curve(executor: Executor, solver: FrontSolver, front: Front, points: int, progress: Steps) -> Front:
    """Compute the points of the front between its two ends, with kinks and gaps.

    Each new limit lies between the neighbours that are farthest apart, and limits the objective that changes more
    there. Sweeps in both directions then carry a better branch along the front.
    """
    search, interrupted = _Search(executor, solver, points, progress), False
    try:
        for _ in range(_MAX_SWEEPS):
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
        axis: index of the objective to limit between the two points.
        unknown: range of that limit that no probe has covered yet.
        suspect: whether a probe between the two points found no point between them.
        failed: whether a probe between the two points failed.
        gap: whether the stretch is a gap that needs no more probes.
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
        structures_known = "undecided" not in (self.left.structure, self.right.structure)
        return structures_known and bool(list_changes(self.left, self.right))

    @property
    def halvings(self) -> int:
        """Number of halvings until the kink between the two points is located to its tolerance."""
        at_end = bool(self.left.label or self.right.label)
        tolerance = _END_DISTANCE if at_end else _KINK_TOLERANCE
        return 0 if self.gap else max(0, math.ceil(math.log2(self.length / tolerance)))


@dataclass
class _Search:
    """The probes that were solved so far. The front is computed from them whenever it is needed.

    Attributes:
        points: requested number of points.
        steps: number of finished steps of the present task, and their total number.
    """

    executor: Executor
    solver: FrontSolver
    points: int
    progress: Steps
    probes: list[_Probe] = field(default_factory=list)
    steps: tuple[int, int] = (0, 0)

    def efficient_chain(self) -> list[FrontPoint]:
        """The efficient points that were found, sorted by the first objective."""
        points = [*self.solver.ends, *(p.point for p in self.probes if p.point is not None)]
        return efficient_points(points, [_ROUNDING * r for r in self.solver.ranges])

    def find_stretches(self) -> list[_Stretch]:
        return [self._find_stretch(left, right) for left, right in pairwise(self.efficient_chain())]

    def _find_stretch(self, left: FrontPoint, right: FrontPoint) -> _Stretch:
        a, b = left.objectives, right.objectives
        size = tuple(abs(x - y) / span for x, y, span in zip(a, b, self.solver.ranges, strict=True))
        fruitless_probes = [p for p in self.probes if self._found_nothing(p, *((b, a) if p.axis else (a, b)))]
        axis = fruitless_probes[0].axis if fruitless_probes else int(size[1] > size[0])
        low, high = sorted((a[axis], b[axis]))
        failures, empty_limits = (
            [p.eps for p in fruitless_probes if p.axis == axis and (p.point is None) is failed]
            for failed in (True, False)
        )
        above = max(failures + empty_limits, default=low), high
        lowest_failure = min(failures, default=low)
        below = max([low, *(e for e in empty_limits if e < lowest_failure)]), lowest_failure
        unknown = below if below[1] - below[0] > _FAILED_GAP_TOLERANCE * self.solver.ranges[axis] else above
        tolerance = _FAILED_GAP_TOLERANCE if failures else _GAP_TOLERANCE
        gap = bool(fruitless_probes) and unknown[1] - unknown[0] <= tolerance * self.solver.ranges[axis]
        return _Stretch(left, right, size, axis, unknown, bool(fruitless_probes), bool(failures), gap)

    def _found_nothing(self, probe: _Probe, low: Objectives, high: Objectives) -> bool:
        """Whether a probe between two neighbours failed, or improved neither objective of the lower one."""
        k = probe.axis
        margin = _INACTIVE * self.solver.ranges[k]
        if not low[k] + margin < probe.eps < high[k]:
            return False
        if probe.point is None:
            return True
        objectives = probe.point.objectives
        if objectives[1 - k] > low[1 - k] + _INACTIVE * self.solver.ranges[1 - k]:  # a better neighbour was found later
            return False
        return (
            objectives[k] <= low[k] + margin or objectives[1 - k] >= low[1 - k] - _ROUNDING * self.solver.ranges[1 - k]
        )

    def plan_probe(self, s: _Stretch, place: int, share: float = 0.5, quick: bool = False) -> "_ProbeRequest":
        """A probe between two neighbours.

        Args:
            place: number of the probe among those planned together.
            share: position of the limit in its unknown range, from 0 (low end) to 1.
            quick: first try to start only from the designs of the neighbours.
        """
        low, high = s.unknown
        eps = low + (high - low) * (0.5 if s.suspect else share)
        neighbours, k, fallback = (s.left.solution, s.right.solution), 1 - s.axis, s.right if s.axis else s.left
        attempts = ((neighbours[:1] if self._are_close(*neighbours) else neighbours, True),) if quick else ()
        good_value = fallback.objectives[k] + _INACTIVE * self.solver.ranges[k]
        return _ProbeRequest(
            s.axis, eps, (*attempts, (neighbours, False)), good_value, fallback, len(self.probes) + place
        )

    def probe(self, requests: Sequence["_ProbeRequest"]) -> list[_Probe | None]:
        """Solve probes in parallel; after Ctrl-C the finished ones are kept."""
        solved_probes: dict[int, _Probe | None] = {}
        try:
            for k, probe in map_items(self.executor, _solve_request, self.solver, requests):
                solved_probes[k] = probe
                done, total = self.steps
                self.steps = done + 1, total
                self.progress(min(done + 1, total), total)
        finally:
            probes = [solved_probes.get(k) for k in range(len(requests))]
            self.probes += [probe for probe in probes if probe is not None]
        return probes

    def _are_close(self, a: Solution, b: Solution) -> bool:
        """Whether two designs count as one branch."""
        free = self.solver.problem.free.items()
        return all(abs(a.parameters[n] - b.parameters[n]) <= _SAME_BRANCH * (high - low) for n, (low, high) in free)

    @property
    def is_exhausted(self) -> bool:
        return len(self.probes) >= _MAX_PROBES * self.points + 100

    def add_points(self) -> None:
        """Add points where neighbours are farthest apart, until the requested number is reached."""
        self.progress.begin("following the front", "point")
        self.steps = len(self.efficient_chain()), self.points
        while not self.is_exhausted:
            stretches = self.find_stretches()
            long_stretches = sorted(
                (s for s in stretches if not s.gap and s.length > _GAP_TOLERANCE), key=lambda s: -s.length
            )
            if (missing := self.points - 1 - len(stretches)) <= 0 or not long_stretches:
                return
            spacing = sum(s.length for s in stretches if not s.gap) / (self.points - 1)
            parts = [max(2, round(s.length / spacing)) for s in long_stretches]
            indices = [k for k, s in enumerate(long_stretches) if not k or s.length > _MIN_ROOM * spacing]
            indices = indices[: min(MAX_PARALLEL, missing)]
            self.probe([self.plan_probe(long_stretches[k], k, (parts[k] // 2) / parts[k]) for k in indices])

    def sweep(self) -> bool:
        """Solve each point again from the previous design, in both directions; return True if any improved."""
        old_length = len(self.efficient_chain())
        self.progress.begin("looking for better branches", "sub-problem")
        self.steps = 0, 2 * old_length
        any_improved = False
        for direction in (1, -1):
            previous, *rest, _ = self.efficient_chain()[::direction]
            while rest:  # a few in parallel, assuming that none improves; if one does, the later ones are repeated
                next_requests = [*islice(self._next_requests(previous, rest), MAX_PARALLEL)]
                probes = self.probe([request for _, request in next_requests])
                improved = next((k for k, probe in enumerate(probes) if probe is not None), None)
                if improved is None:
                    last_index = next_requests[-1][0] if len(next_requests) == MAX_PARALLEL else len(rest) - 1
                    previous, rest = rest[last_index], rest[last_index + 1 :]
                else:
                    later_probes = sum(probe is not None for probe in probes[improved + 1 :])
                    del self.probes[len(self.probes) - later_probes :]
                    any_improved, rest = True, rest[next_requests[improved][0] + 1 :]
                    previous = self.probes[-1].point or previous
        return any_improved or len(self.efficient_chain()) < old_length

    def _next_requests(
        self, previous: FrontPoint, points: Sequence[FrontPoint]
    ) -> Iterator[tuple[int, "_ProbeRequest"]]:
        """Yield the next points to solve again, each from the previous design, as (index in `points`, request)."""
        for place, point in enumerate(points):
            probe = next((p for p in self.probes if p.point is point), None)
            if probe is not None and not self._are_close(previous.solution, point.solution):
                k = 1 - probe.axis
                good_value = point.objectives[k] - _INACTIVE * self.solver.ranges[k]
                attempt = ((previous.solution,), True)
                yield place, _ProbeRequest(probe.axis, probe.eps, (attempt,), good_value, None, len(self.probes))
            previous = point

    def refine_kinks_and_gaps(self) -> bool:
        """Locate the ends of gaps and the kinks to their tolerance.

        Probes of a kink start only from the designs of the neighbours. Both may lie on a poorer branch, so the last
        probe also uses new starts.

        Returns:
            True if the search stopped early because it found another branch.
        """
        self.progress.begin("placing kinks and gaps", "sub-problem")
        self.steps = 0, 0
        while not self.is_exhausted:
            stretches = self.find_stretches()
            gap_candidates = [s for s in stretches if not s.gap and s.suspect and s.length > _GAP_TOLERANCE]
            kink_stretches = [s for s in stretches if s.has_kink and s.halvings]
            if not (chosen := (gap_candidates or kink_stretches)[:MAX_PARALLEL]):
                break
            done, _ = self.steps
            self.steps = done, done + len(gap_candidates) + sum(s.halvings for s in kink_stretches)
            quick_flags = [not gap_candidates and s.halvings > 1 for s in chosen]
            probes = self.probe([self.plan_probe(s, k, quick=quick_flags[k]) for k, s in enumerate(chosen)])
            for s, is_quick, probe in zip(chosen, quick_flags, probes, strict=True):
                if (point := probe and probe.point) and not (gap_candidates or is_quick):
                    ends = s.left.solution, s.right.solution
                    if not any(self._are_close(point.solution, end) for end in ends):
                        return True
        return False


@dataclass(frozen=True)
class _ProbeRequest:
    """A probe to make.

    Attributes:
        axis, eps: the objective with this index is limited by eps.
        attempts: (designs to start from, whether no new starts are added), tried in turn until a result is good enough.
        good_value: a result is good enough if the minimised objective is not above this value.
        fallback: the point to use if no result is good enough; if it is None, the probe is dropped.
        count: number of earlier probes; it selects the random starts.
    """

    axis: int
    eps: float
    attempts: tuple[tuple[tuple[Solution, ...], bool], ...]
    good_value: float
    fallback: FrontPoint | None
    count: int


def _solve_request(solver: FrontSolver, request: _ProbeRequest) -> _Probe | None:
    """Solve a probe; return None if it is dropped."""
    point, solver = None, solver.reseed(request.count)
    for near, nearby_only in request.attempts:
        solution = minimise_limited(solver, 1 - request.axis, {request.axis: request.eps}, near, nearby_only)
        point = None if solution is None else front_point(solver, solution)
        if point is not None and point.objectives[1 - request.axis] <= request.good_value:
            return _Probe(request.axis, request.eps, point)
    if request.fallback is None:
        return None
    return _Probe(request.axis, request.eps, point and request.fallback)  # better than a poor local optimum


def _assemble_front(search: _Search, front: Front) -> Front:
    """The front for the report: all points with a label, and the others unless they are too close to another point."""
    stretches = search.find_stretches()
    chain = [stretches[0].left, *(s.right for s in stretches)]
    labels = [list[str]() for _ in chain]
    for index, end in zip((0, -1), search.solver.ends, strict=True):
        labels[index].append(end.label)  # an end keeps its label
    kinks, gaps = list[Kink](), list[Gap]()
    for i, s in enumerate(stretches):
        if s.gap and s.length > _MIN_GAP:
            gaps.append(Gap(_describe_gap(search.solver, s), i, s.failed))
            labels[i].append("gap begins")
            labels[i + 1].append("gap ends")
        elif s.has_kink and not (s.left.label or s.right.label):
            labels[i] += (names := list_changes(s.left, s.right))
            kinks += [Kink(name, i, s.length) for name in names]
    spacing = sum(s.length for s in stretches if not s.gap) / max(search.points - 1, 1)
    positions = [*accumulate((s.length for s in stretches), initial=0.0)]
    indices, last_position = list[int](), -math.inf
    for i, x in enumerate(positions):
        next_label = next((positions[k] for k in range(i + 1, len(positions)) if labels[k]), math.inf)
        if labels[i] or min(x - last_position, next_label - x) >= _MIN_SPACING * spacing:
            indices.append(i)
            last_position = x
    new_index = {i: k for k, i in enumerate(indices)}
    designs = dict(map_items(search.executor, _add_cover, search.solver, [chain[i].solution for i in indices]))
    limit = "the search stopped at its limit of sub-problems; ask for more points"
    notes = (limit,) if search.is_exhausted else ()
    return replace(
        front,
        points=tuple(replace(chain[i], solution=designs[k], label="; ".join(labels[i])) for k, i in enumerate(indices)),
        kinks=tuple(replace(kink, index=new_index[kink.index]) for kink in kinks),
        gaps=tuple(replace(gap, index=new_index[gap.index]) for gap in gaps),
        solved=len(search.probes) + 2,
        notes=notes,
    )


def _add_cover(_: FrontSolver, solution: Solution) -> Solution:
    return add_worst_case_proof(solution)


def _describe_gap(solver: FrontSolver, s: _Stretch) -> str:
    low, high = sorted((s.left.objectives[s.axis], s.right.objectives[s.axis]))
    where = f"{solver.texts[s.axis]} from {low:.6g} to {high:.6g}"
    return f"not solved for {where}; try more starts" if s.failed else f"no efficient design was found with {where}"


def list_changes(before: FrontPoint, after: FrontPoint) -> list[str]:
    """Names of the changes from one point to the next."""
    names = [f"{before.structure} -> {after.structure}"] if before.structure != after.structure else []
    names += [f"{n} becomes active" for n in after.limits if n not in before.limits]
    return names + [f"{n} becomes inactive" for n in before.limits if n not in after.limits]
