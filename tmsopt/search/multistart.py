"""Multi-start: IPOPT from many designs, ended early when enough of them agree."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise

import numpy as np

from tmsopt.evaluation.bound import bounded, closed, instant_bound
from tmsopt.problem.freedom import degrees_of_freedom
from tmsopt.problem.problem import Posed
from tmsopt.problem.searches import is_enough
from tmsopt.program.formulate import abscissa, design_of, middle
from tmsopt.program.ipopt import Run, ipopt
from tmsopt.program.nlp import NLP
from tmsopt.program.starts import designs, initial_point, opposite, start_objective
from tmsopt.progress import begin
from tmsopt.records import Array
from tmsopt.roots import roots
from tmsopt.search.basins.leaders import SAME, led, starting
from tmsopt.search.rescues import rescued_by
from tmsopt.search.sample import NARROW
from tmsopt.search.workspace import LocalEnd, Workspace

_ENOUGH = 12  # starts tried before agreement counts
_AGREE = 5  # starts at the best value that end the search
_HOPELESS = 16  # starts without a feasible end after which the least-violating design is looked for instead
_ENOUGH_SAMPLED, _ENOUGH_NARROW, _HOPELESS_SAMPLED = 3, 8, 8
"""The same where the starts come from a sample of the box, which counts; more where little is feasible."""

HOPELESS_AFAR = 3  # the same where no design of the sample comes near to meeting all limits
_MET = 1e-14  # sum of squares of coefficients at which more conditions than parameters are met
_FEASIBLE = 1e-6  # of the rows, before polishing; the recheck has the last word
_SCATTER = 0.01  # of the size of the roots: in double precision those beside a 4-fold one are off by 4e-4
_RESIDUAL = 1e-11  # of the equations: an n-fold root is off by its n-th root
_RESCUES = 4  # starts from abscissa optima, for a pattern that no start reached

_AGAIN = 4  # times that a start is taken up again where it ended badly
_AGAIN_HOPELESS = 1  # the same where rows are violated and no start has satisfied them yet
_NOWHERE = 4  # starts of which none satisfied all rows, after which none is taken up again
_WAYS = 3  # in which root quantities and kinks are held from one start
_CROSSINGS = 4  # times that an end may turn out to be one of another way
_MEETS = 1e-5  # difference of distances at which two ways meet
_SUCCESS = "Solve_Succeeded"


def search(work: Workspace, nlp: NLP, most: int | None = None) -> list[LocalEnd]:
    """Where every start ended that was tried, in order; a design near the optimum, where one is given, before all."""
    run, part, options = Runner(work, nlp), work.part, work.options
    left = [*range(len(work.sample.leaders))] if work.sample else []
    starts, candidates = min(options.starts, most or options.starts), list[LocalEnd]()
    begin(options.progress, "searching", "start")
    if options.near:
        candidates.append(run.solve_from({**middle(part), **options.near}, near=True))
        if not options.exhaustive and _settled(work, candidates):
            return candidates
    if part.start and len(candidates) < starts:  # the user's own
        candidates.append(run.solve_from(middle(part), near=True))
    candidates += [run.solve_from(design, near=True) for design in work.extra_starts if work.holds(design)]
    from_sample = starting(work, candidates, left)
    while len(candidates) < starts:
        design, near = next(from_sample)
        hopeful = work.sample is None and any(c.feasible for c in candidates)
        candidates.append(_otherwise(run, design, run.solve_from(design, near, hopeful)))
        if not options.exhaustive:  # which starts from every design
            candidates += [candidates[-1]] * min(led(work, candidates[-1], left), starts - len(candidates))
        if options.progress:
            options.progress(len(candidates), starts, _best(work, candidates))
        if not options.exhaustive and _settled(work, candidates, left):
            if work.sample is None and rescued_by("opposite faces"):
                candidates += _beside(run, candidates, starts - len(candidates))
            break
    lost = part.pattern is not None and most is None and not any(c.feasible for c in candidates)
    if lost and not work.out_of_reach and rescued_by("least abscissa"):
        candidates += _rescued(work, nlp)
    return candidates


def _best(work: Workspace, candidates: Sequence[LocalEnd]) -> str:
    """How good the best is so far, in words."""
    best = min((c.objective for c in candidates if c.feasible), default=math.inf)
    if work.problem.objective is None or not math.isfinite(best):
        return work.name
    return ", ".join([f"best {work.problem.sign * best:.6g}", *([work.name] if work.name else [])])


def _otherwise(run: "Runner", design: Mapping[str, float], ended: LocalEnd) -> LocalEnd:
    """Where a start ends that first took a way on which a0 may vanish, if it ended nowhere by the usual one."""
    work, nlp = run.work, run.nlp
    if (
        ended.feasible
        or run.hopeless
        or work.sample is None
        or not (nlp.products and work.sample.singular)
        or not rescued_by("through a0")
    ):
        return ended
    lead = -1 if float(work.problem.values(work.problem.ordered(design)).coefficients[0]) < 0 else 1
    led = Runner(work, work.formulate(nlp.cases, lead=lead)).solve_from(design, near=True, hopeful=False)
    return run.solve_from(work.design_at(led.run.x), near=True, hopeful=False) if led.feasible else ended


def further(work: Workspace, nlp: NLP, tried: int) -> list[LocalEnd]:
    """Where the starts end that a search did without; up to the first left of the axis, where that is the goal."""
    run, found = Runner(work, nlp), list[LocalEnd]()
    for design, near in islice(starting(work), tried, work.options.starts):
        found.append(run.solve_from(design, near, hopeful=False))
        if work.options.progress:
            work.options.progress(tried + len(found), work.options.starts, _best(work, found))
        left = bounded(work.part) and found[-1].feasible and found[-1].objective < 0
        if left or sum(not c.feasible for c in found) >= _HOPELESS:
            break
    return found


def _beside(run: "Runner", candidates: Sequence[LocalEnd], most: int) -> list[LocalEnd]:
    """Starts with one parameter of the best end moved to the other end of its range, as long as better ones result.

    Of optima at different faces of the box all far starts may end at the same, be it the best or not.
    """
    part, found = run.work.part, list[LocalEnd]()
    best = min((c for c in candidates if c.feasible), key=lambda c: c.objective, default=None)
    while best is not None and part.objective is not None and not _proven(part, best):
        others = opposite(part, run.work.design_at(best.run.x))
        ended = [run.solve_from(design, near=True) for design in others[: max(most - len(found), 0)]]
        found += ended
        better = [c for c in ended if c.feasible and c.objective < best.objective]
        apart = [c for c in better if not same_objective(c.objective, best.objective)]
        best = min(apart, key=lambda c: c.objective, default=None)
    return found


@dataclass(frozen=True)
class Runner:
    """IPOPT on one NLP, started anew where an end is not to be trusted."""

    work: Workspace
    nlp: NLP

    def solve_from(self, design: Mapping[str, float], near: bool = False, hopeful: bool = True) -> LocalEnd:
        """Where a start ends, with the factors shared out anew as long as that helps."""
        best = self._once(design, "near" if near else "exact" if self.nlp.cases and self.nlp.exact else "far")
        for again in range(_AGAIN):
            if best.feasible and best.run.status == _SUCCESS and not best.nlp.tangled(best.run.x):
                break
            if not best.feasible and again >= (_AGAIN if hopeful else 0 if self.hopeless else _AGAIN_HOPELESS):
                break
            if not np.all(np.isfinite(best.run.x)) or not rescued_by("restarts"):
                break
            ended = self._once(self.work.design_at(best.run.x), "near" if again % 2 == 0 else "far")
            if best.feasible and (not ended.feasible or ended.objective >= best.objective - SAME):
                break
            best = ended
        best = self._crossed(best)
        if best.feasible and (not near or self.nlp.touches):
            best = self._no_worse(best, design, "far" if near else "near")
        self.work.met.append((self.nlp, best))
        return best

    @property
    def hopeless(self) -> bool:
        """Whether nothing speaks for a feasible end: not the limits, nor any other start where there is no sample."""
        work, met = self.work, self.work.met
        if any(c.feasible for _, c in met):
            return False
        alone = work.sample is None and len(met) >= _NOWHERE
        return alone or (self.nlp.formulation != "elastic" and work.out_of_reach)

    def _no_worse(self, best: LocalEnd, design: Mapping[str, float], start: str) -> LocalEnd:
        """Where it ended, or where a start that was better than that ends if IPOPT keeps to it, or does not."""
        if self.work.part.pattern is not None or start_objective(self.work.part, design) >= best.objective - SAME:
            return best
        kept = self._once(design, start)
        ahead = kept.feasible and kept.objective < best.objective
        return kept if ahead and rescued_by("kept start") else best

    def _once(self, design: Mapping[str, float], start: str) -> LocalEnd:
        x = initial_point(self.nlp, self.work.part, design, start == "near")
        return min(
            (
                self._from(x, way, start)
                for way in islice(self.nlp.touchings(x), _WAYS if self.nlp.touches and rescued_by("ways") else 1)
            ),
            key=rank,
        )

    def _crossed(self, best: LocalEnd) -> LocalEnd:
        """The best that is reached from an end at which other ways are as close as the one that was held."""
        for _ in range(_CROSSINGS if self.nlp.touches and best.feasible and rescued_by("exchanges") else 0):
            x, held = best.run.x, _limits(best.nlp)
            others = (way for way in self.nlp.touchings(x, _MEETS) if _limits(way) != held)
            ends = [self._from(x, way, "near") for way in islice(others, 2 * _WAYS)]
            further = min(ends, key=rank, default=best)
            if not (further.feasible and further.objective < best.objective - SAME):
                break
            best = further
        return best

    def _from(self, x: Array, limits: NLP, start: str) -> LocalEnd:
        return self.work.chained(
            candidate_of(self.work.part, limits, ipopt(self.nlp, self.work.options, start)(x, limits))
        )


def _limits(nlp: NLP) -> tuple[tuple[float, ...], ...]:
    return nlp.lower, nlp.upper, nlp.row_upper


def rank(candidate: LocalEnd) -> tuple[bool, float]:
    """Of two candidates, the better one has the lower rank."""
    return not candidate.feasible, candidate.objective


def same_objective(a: float, b: float, size: float = 1.0) -> bool:
    """Whether two objectives, of this size or larger, count as the same optimum."""
    return abs(a - b) <= SAME * (size + abs(b))


def distinct(candidates: Sequence[LocalEnd], known: Sequence[LocalEnd] = ()) -> list[LocalEnd]:
    """The best candidate of each optimum, other than the known ones, the best first."""
    kept: list[LocalEnd] = []
    for c in sorted((c for c in candidates if c.feasible), key=lambda c: c.objective):
        if not any(same_objective(c.objective, other.objective, c.nlp.size) for other in (*known, *kept)):
            kept.append(c)
    return kept


def candidate_of(problem: Posed, nlp: NLP, run: Run) -> LocalEnd:
    """What a run of IPOPT came to."""
    f, rows = nlp.at(run.x)
    if not (np.all(np.isfinite(rows)) and np.all(np.isfinite(run.x)) and math.isfinite(f)):
        return LocalEnd(nlp, run, math.inf, False)
    outside = np.maximum(np.array(nlp.row_lower) - rows, rows - np.array(nlp.row_upper)).clip(0)
    feasible = outside.max(initial=0.0) <= _FEASIBLE and run.status != "Infeasible_Problem_Detected"
    # What rows, met to 1e-12, may give where they are singular: a double root off by 1e-6, as its square is by that.
    claim = 2 * float(np.abs(np.nan_to_num(run.row_multipliers)) @ outside) if nlp.touches else 0.0
    return LocalEnd(nlp, run, f + claim, bool(feasible) and not _spurious(problem, nlp, run))


def _spurious(problem: Posed, nlp: NLP, run: Run) -> bool:
    """Whether the factors claim an abscissa left of the roots: near a0 = 0 equations hold as all terms vanish."""
    if "abscissa" not in nlp.variables:
        return False
    a = _coefficients(problem, nlp, run)
    if np.any(a[:, 0] == 0):
        return True
    z = roots(a)
    claimed = run.x[nlp.variables.index("abscissa")] * nlp.unit
    size = np.maximum(np.abs(z).max(axis=1), nlp.unit)  # all of them may be at 0
    return bool(np.any(claimed < z.real.max(axis=1) - max(_SCATTER, _RESIDUAL ** (1 / problem.model.degree)) * size))


def _settled(work: Workspace, candidates: list[LocalEnd], left: Sequence[int] = ()) -> bool:
    """Whether more starts would be waste: the bound is reached, or enough of them agree on the best.

    Enough is what `is_enough` says of the optima that starts and designs of the sample led to. A refined design that is
    `left` counts as one that leads to an optimum of its own.
    """
    problem, sampled = work.part, work.sample is not None
    feasible = [c for c in candidates if c.feasible]
    failed = len(candidates) - len(feasible)
    if not feasible:
        afar = failed >= HOPELESS_AFAR and (work.sample.far_off if work.sample else work.out_of_reach)
        return afar or failed >= (_HOPELESS_SAMPLED if sampled else _HOPELESS)
    best = min(c.objective for c in feasible)
    record = candidates[-1].feasible and all(candidates[-1].objective < c.objective for c in feasible[:-1])
    if record and _proven(problem, candidates[-1]):
        return True
    agreeing = sum(same_objective(c.objective, best, c.nlp.size) for c in feasible)
    if problem.objective is None:  # any point of a square pattern will do, and any that meets too many conditions
        count = degrees_of_freedom(problem).count
        return agreeing >= (1 if count == 0 or (count < 0 and best <= _MET) else _AGREE)
    if sampled and failed >= _HOPELESS:  # which takes long; the sample is the judge of what was found
        return True
    refined = work.sample.refined.violation if work.sample else np.empty(0)
    alone = sum(refined[row] == 0 for row in left if row < refined.size)
    enough = is_enough(len(feasible) + alone, optima(feasible) + alone)
    if sampled:
        wide = work.sample is not None and work.sample.met > NARROW * work.sample.size
        return enough and len({id(c) for c in candidates}) >= (_ENOUGH_SAMPLED if wide else _ENOUGH_NARROW)
    return len(candidates) >= _ENOUGH and agreeing >= _AGREE and enough


def optima(candidates: Sequence[LocalEnd]) -> int:
    """Different objectives at which starts ended."""
    ordered = sorted(c.objective for c in candidates if c.feasible)
    return bool(ordered) + sum(not same_objective(a, b, candidates[0].nlp.size) for a, b in pairwise(ordered))


def _proven(problem: Posed, candidate: LocalEnd) -> bool:
    """Whether the bound is reached; it is looked at only where the design itself has all roots of one modulus."""
    if not bounded(problem):
        return False
    a = _coefficients(problem, candidate.nlp, candidate.run)[0]
    own = -(abs(a[-1] / a[0]) ** (1 / problem.model.degree)) if a[0] else -math.inf
    near = closed(candidate.objective - own, own, candidate.nlp.size)
    return near and instant_bound(problem, candidate.objective).proven


def _coefficients(problem: Posed, nlp: NLP, run: Run) -> Array:
    """Coefficients in every case, shape (cases, n + 1)."""
    nominal = problem.ordered(design_of(problem, run.x.tolist()))
    varied = [c.applied(nominal) for c in nlp.cases if not c.direction] or [nominal]
    of = problem.parameter_set
    return np.array([[float(c) for c in problem.model.coefficients(p, of)] for p in varied])


def _rescued(work: Workspace, nlp: NLP) -> list[LocalEnd]:
    """Starts where the abscissa is least under the same constraints: multiple roots are often met there."""
    relaxed = work.part.derive(locate=None, minimize="abscissa", maximize=None, scenarios={}, tolerances={})
    leading = abscissa(relaxed)
    lead = ipopt(leading, work.options)
    ended = [lead(initial_point(leading, relaxed, d)).x for d in designs(relaxed, work.options.seed, _RESCUES)]
    run = Runner(work, nlp)
    return [run.solve_from(work.design_at(x), near=True) for x in ended if np.all(np.isfinite(x))]
