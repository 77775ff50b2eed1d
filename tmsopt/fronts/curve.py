"""The front of two objectives.

A probe is a sub-problem that limits one objective by eps and minimises the other. A stretch is the part of the front
between two neighbouring points. The next probe lies in the longest stretch. Points whose designs change continuously
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

# The next constants are fractions of the range of an objective over the front
_ROUNDING = 1e-9  # polished optima that differ by less are equal
_INACTIVE = 1e-6  # an eps that lies farther than this above the optimum is an inactive limit
_GAP_TOLERANCE = 1e-3  # largest error in the position of the far end of a gap
_FAILED_GAP_TOLERANCE = 0.05  # the same for sub-problems that fail, because each failure takes many starts
_MIN_GAP = 5e-3  # a narrower gap is the rest of a wider gap, or comes from rounding on a flat stretch
_KINK_TOLERANCE = 2e-4  # largest error in the position of a kink
_END_DISTANCE = 1e-3  # a kink closer to an end is ignored, because rounding makes the structure uncertain near an EP4

_MAX_SWEEPS = 3  # largest number of sweeps; see `_Search.sweep`
_SAME_BRANCH = 0.02  # designs that differ by less, as a fraction of the box, count as one branch
_BASE_PROBES = 100  # largest number of sub-problems, in addition to those per point
_PROBES_PER_POINT = 8  # largest number of sub-problems per point
_MIN_ROOM = 1.5  # a stretch that is longer than this times the mean spacing has room for a point
_MIN_SPACING = 0.3  # a point without a label that is closer than this times the mean spacing is left out


def fill_curve(executor: Executor, solver: FrontSolver, front: Front, point_count: int, progress: Steps) -> Front:
    """Compute the points of the front between its two ends, with kinks and gaps.

    Each new limit lies between the neighbours that are farthest apart, and limits the objective that changes more
    there. Sweeps in both directions then solve each point again from its neighbour, so that a better branch replaces a
    worse one.
    """
    search, is_interrupted = _Search(executor, solver, point_count, progress), False
    try:
        for _ in range(_MAX_SWEEPS):
            search.add_points()
            if not search.sweep():
                break
        while search.refine_kinks_and_gaps():
            search.sweep()
    except KeyboardInterrupt:
        is_interrupted = True
    return replace(_assemble_front(search, front), interrupted=is_interrupted)


@dataclass(frozen=True)
class _Probe:
    """A solved sub-problem: objective `axis` ≤ eps, and the other is minimised; `point` is None if it failed."""

    axis: int
    eps: float
    point: FrontPoint | None


@dataclass(frozen=True)
class _Stretch:
    """Two neighbours on the front; the left one is better in objective 0.

    Attributes:
        size: difference of each objective, relative to its range.
        axis: index of the objective to limit between the two points.
        unknown_range: range of that limit in which the probes so far leave the front unknown.
        has_useless_probe: whether a probe between the two points failed or found no point between them.
        has_failure: whether a probe between the two points failed.
        is_gap: whether the stretch is a gap that needs no more probes.
    """

    left: FrontPoint
    right: FrontPoint
    size: tuple[float, ...]
    axis: int
    unknown_range: tuple[float, float]
    has_useless_probe: bool
    has_failure: bool
    is_gap: bool

    @property
    def length(self) -> float:
        return math.hypot(*self.size)

    @property
    def has_kink(self) -> bool:
        is_undecided = "undecided" in (self.left.structure, self.right.structure)
        return not is_undecided and bool(list_changes(self.left, self.right))

    @property
    def halvings(self) -> int:
        """Number of halvings until the kink between the two points is located to its tolerance."""
        is_at_end = bool(self.left.label or self.right.label)
        tolerance = _END_DISTANCE if is_at_end else _KINK_TOLERANCE
        return 0 if self.is_gap else max(0, math.ceil(math.log2(self.length / tolerance)))


@dataclass
class _Search:
    """The probes that were solved so far. The front is computed from them whenever it is needed.

    Attributes:
        point_count: requested number of points.
        steps: number of finished steps of the present task, and their total number.
    """

    executor: Executor
    solver: FrontSolver
    point_count: int
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
        useless_probes = [p for p in self.probes if self._is_useless(p, *((b, a) if p.axis else (a, b)))]
        axis = useless_probes[0].axis if useless_probes else int(size[1] > size[0])
        low, high = sorted((a[axis], b[axis]))
        failed_limits = [p.eps for p in useless_probes if p.axis == axis and p.point is None]
        empty_limits = [p.eps for p in useless_probes if p.axis == axis and p.point is not None]
        lowest_failure = min(failed_limits, default=low)
        # below all failures if this range is wide enough, otherwise above all useless probes
        unknown_range = max([low, *(e for e in empty_limits if e < lowest_failure)]), lowest_failure
        if unknown_range[1] - unknown_range[0] <= _FAILED_GAP_TOLERANCE * self.solver.ranges[axis]:
            unknown_range = max(failed_limits + empty_limits, default=low), high
        tolerance = _FAILED_GAP_TOLERANCE if failed_limits else _GAP_TOLERANCE
        is_gap = bool(useless_probes) and unknown_range[1] - unknown_range[0] <= tolerance * self.solver.ranges[axis]
        return _Stretch(left, right, size, axis, unknown_range, bool(useless_probes), bool(failed_limits), is_gap)

    def _is_useless(self, probe: _Probe, low: Objectives, high: Objectives) -> bool:
        """Whether a probe between two neighbours failed or found no point between them.

        Args:
            low, high: objectives of the neighbour with the smaller, and with the larger value of the limited objective.
        """
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

    def plan_probe(
        self, stretch: _Stretch, index: int, position: float = 0.5, is_quick: bool = False
    ) -> "_ProbeRequest":
        """Plan a probe in a stretch.

        Args:
            index: index of the probe among the probes that are planned together.
            position: position of the limit in its unknown range, from 0 (low end) to 1.
            is_quick: first try to start only from the designs of the neighbours.
        """
        low, high = stretch.unknown_range
        eps = low + (high - low) * (0.5 if stretch.has_useless_probe else position)
        neighbours, k = (stretch.left.solution, stretch.right.solution), 1 - stretch.axis
        fallback = stretch.right if stretch.axis else stretch.left
        attempts = ((neighbours[:1] if self._are_close(*neighbours) else neighbours, True),) if is_quick else ()
        good_value = fallback.objectives[k] + _INACTIVE * self.solver.ranges[k]
        return _ProbeRequest(
            stretch.axis, eps, (*attempts, (neighbours, False)), good_value, fallback, len(self.probes) + index
        )

    def probe(self, requests: Sequence["_ProbeRequest"]) -> list[_Probe | None]:
        """Solve probes in parallel; after Ctrl-C the finished probes are kept."""
        solved_probes: dict[int, _Probe | None] = {}
        try:
            for k, probe in map_items(self.executor, _solve_request, self.solver, requests):
                solved_probes[k] = probe
                done_count, total_count = self.steps
                self.steps = done_count + 1, total_count
                self.progress(min(done_count + 1, total_count), total_count)
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
        return len(self.probes) >= _BASE_PROBES + _PROBES_PER_POINT * self.point_count

    def add_points(self) -> None:
        """Add points where neighbours are farthest apart, until the requested number is reached."""
        self.progress.begin("following the front", "point")
        self.steps = len(self.efficient_chain()), self.point_count
        while not self.is_exhausted:
            stretches = self.find_stretches()
            long_stretches = sorted(
                (s for s in stretches if not s.is_gap and s.length > _GAP_TOLERANCE), key=lambda s: -s.length
            )
            if (missing_count := self.point_count - 1 - len(stretches)) <= 0 or not long_stretches:
                return
            spacing = sum(s.length for s in stretches if not s.is_gap) / (self.point_count - 1)
            parts = [max(2, round(s.length / spacing)) for s in long_stretches]
            indices = [k for k, s in enumerate(long_stretches) if not k or s.length > _MIN_ROOM * spacing]
            indices = indices[: min(MAX_PARALLEL, missing_count)]
            self.probe([self.plan_probe(long_stretches[k], k, (parts[k] // 2) / parts[k]) for k in indices])

    def sweep(self) -> bool:
        """Solve each point again from the previous design, in both directions; return True if any point improved."""
        old_length = len(self.efficient_chain())
        self.progress.begin("looking for better branches", "sub-problem")
        self.steps = 0, 2 * old_length
        has_improved = False
        for direction in (1, -1):
            previous, *points, _ = self.efficient_chain()[::direction]
            # a few points in parallel, as if none improved; if one improves, the later points are repeated
            while points:
                next_requests = [*islice(self._next_requests(previous, points), MAX_PARALLEL)]
                probes = self.probe([request for _, request in next_requests])
                first_improved = next((k for k, probe in enumerate(probes) if probe is not None), None)
                if first_improved is None:
                    last_index = next_requests[-1][0] if len(next_requests) == MAX_PARALLEL else len(points) - 1
                    previous, points = points[last_index], points[last_index + 1 :]
                else:
                    later_count = sum(probe is not None for probe in probes[first_improved + 1 :])
                    del self.probes[len(self.probes) - later_count :]
                    has_improved, points = True, points[next_requests[first_improved][0] + 1 :]
                    previous = self.probes[-1].point or previous
        return has_improved or len(self.efficient_chain()) < old_length

    def _next_requests(
        self, previous: FrontPoint, points: Sequence[FrontPoint]
    ) -> Iterator[tuple[int, "_ProbeRequest"]]:
        """Yield the next points to solve again, each from the previous design, as (index in `points`, request)."""
        for index, point in enumerate(points):
            probe = next((p for p in self.probes if p.point is point), None)
            if probe is not None and not self._are_close(previous.solution, point.solution):
                k = 1 - probe.axis
                good_value = point.objectives[k] - _INACTIVE * self.solver.ranges[k]
                attempt = ((previous.solution,), True)
                yield index, _ProbeRequest(probe.axis, probe.eps, (attempt,), good_value, None, len(self.probes))
            previous = point

    def refine_kinks_and_gaps(self) -> bool:
        """Locate the ends of gaps and the kinks to their tolerance.

        Probes of a kink start only from the designs of the neighbours. Both designs may lie on a worse branch, so
        the last probe also uses new starts.

        Returns:
            True if the search stopped early because it found another branch.
        """
        self.progress.begin("placing kinks and gaps", "sub-problem")
        self.steps = 0, 0
        while not self.is_exhausted:
            stretches = self.find_stretches()
            gap_candidates = [
                s for s in stretches if not s.is_gap and s.has_useless_probe and s.length > _GAP_TOLERANCE
            ]
            kink_stretches = [s for s in stretches if s.has_kink and s.halvings]
            if not (chosen_stretches := (gap_candidates or kink_stretches)[:MAX_PARALLEL]):
                break
            done_count, _ = self.steps
            self.steps = done_count, done_count + len(gap_candidates) + sum(s.halvings for s in kink_stretches)
            quick_flags = [not gap_candidates and s.halvings > 1 for s in chosen_stretches]
            probes = self.probe(
                [self.plan_probe(s, k, is_quick=quick_flags[k]) for k, s in enumerate(chosen_stretches)]
            )
            for s, is_quick, probe in zip(chosen_stretches, quick_flags, probes, strict=True):
                if (point := probe and probe.point) and not (gap_candidates or is_quick):
                    ends = s.left.solution, s.right.solution
                    if not any(self._are_close(point.solution, end) for end in ends):
                        return True
        return False


@dataclass(frozen=True)
class _ProbeRequest:
    """A probe to make.

    Attributes:
        axis, eps: index of the limited objective, and its limit.
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
    return _Probe(
        request.axis, request.eps, point and request.fallback
    )  # the fallback is better than a poor local optimum


def _assemble_front(search: _Search, front: Front) -> Front:
    """The front for the report: all points with a label, and the other points unless they are too close to another."""
    stretches = search.find_stretches()
    chain = [stretches[0].left, *(s.right for s in stretches)]
    labels = [list[str]() for _ in chain]
    for index, end in zip((0, -1), search.solver.ends, strict=True):
        labels[index].append(end.label)  # an end keeps its label
    kinks, gaps = list[Kink](), list[Gap]()
    for i, s in enumerate(stretches):
        if s.is_gap and s.length > _MIN_GAP:
            gaps.append(Gap(_describe_gap(search.solver, s), i, s.has_failure))
            labels[i].append("gap begins")
            labels[i + 1].append("gap ends")
        elif s.has_kink and not (s.left.label or s.right.label):
            labels[i] += (names := list_changes(s.left, s.right))
            kinks += [Kink(name, i, s.length) for name in names]
    spacing = sum(s.length for s in stretches if not s.is_gap) / max(search.point_count - 1, 1)
    positions = [*accumulate((s.length for s in stretches), initial=0.0)]
    indices, last_position = list[int](), -math.inf
    for i, x in enumerate(positions):
        next_label_position = next((positions[k] for k in range(i + 1, len(positions)) if labels[k]), math.inf)
        if labels[i] or min(x - last_position, next_label_position - x) >= _MIN_SPACING * spacing:
            indices.append(i)
            last_position = x
    new_index = {i: k for k, i in enumerate(indices)}
    designs = dict(map_items(search.executor, _add_cover, search.solver, [chain[i].solution for i in indices]))
    limit_note = (
        "the search stopped at its limit of sub-problems; ask for more points, because this limit grows with them"
    )
    notes = (limit_note,) if search.is_exhausted else ()
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
    range_text = f"{solver.texts[s.axis]} from {low:.6g} to {high:.6g}"
    if s.has_failure:
        return f"not solved for {range_text}; try more starts"
    return f"no efficient design was found with {range_text}"


def list_changes(old_point: FrontPoint, new_point: FrontPoint) -> list[str]:
    """Names of the changes from one point to the next."""
    names = [f"{old_point.structure} -> {new_point.structure}"] if old_point.structure != new_point.structure else []
    names += [f"{n} becomes active" for n in new_point.limits if n not in old_point.limits]
    return names + [f"{n} becomes inactive" for n in old_point.limits if n not in new_point.limits]
