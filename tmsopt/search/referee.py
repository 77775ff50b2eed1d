"""The sample as referee: a search is taken up again wherever a design that was looked at is better than its best."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tmsopt.evaluation.digits import certified_numbers
from tmsopt.evaluation.worst_case import worst_cases
from tmsopt.problem.cases import Case
from tmsopt.problem.problem import Posed
from tmsopt.problem.searches import Starts
from tmsopt.program.nlp import NLP
from tmsopt.search.basins import Looked
from tmsopt.search.multistart import Runner, same_objective
from tmsopt.search.outcome import (
    CheckedEnd,
    Outcome,
    attained,
    best_checked,
    claim_matches,
    converged,
    is_better,
    mass_advice,
    unclear,
)
from tmsopt.search.rescues import rescued_by
from tmsopt.search.sample import Sample, Sampler
from tmsopt.search.workspace import LocalEnd, Workspace

_APPEALS, _APPEALED = 8, 2  # times that better designs are started from, and how many each time
_LOST = 1e-7  # relative difference of the objective that makes a design better
_HAIRS = np.geomspace(1e-15, 1e-7, 33)  # of the way to a design that meets all limits
_TOWARDS = 30  # random designs in whose direction an end is moved
_FLAT = "damping_ratio"
_AT_ZERO = 1e-9  # of the largest root: one that rounding may put on either side of 0
_EDGE = 1e-8  # relative difference of the objective that a step off an edge may cost
_FINER = 1e-11  # the same as `_LOST`, where both were polished
_FINEST = np.geomspace(1e-4, 1e-10, 19).tolist()  # of the box: steps that improve a design that is kept as it is
_KEPT_AT_MOST = 8  # designs that were looked at and are checked closely
_SAME_DESIGN = 1e-3  # of the box: beside a multiple root numeric ones look better by a hair
_OPEN = 3  # designs from which a singular mass matrix is approached
_FAR_OFF = 1e5  # ratio of the largest root to the others that makes it one near infinity
_RUNAWAY = 1e7  # the same ratio, beyond which no optimum within the box is left that a double could tell
_SHARE = 1e-3  # of a range, by which a parameter is moved to see whether a0 depends on it
_SINGULAR = 1e-9  # a0 in its own unit, below which it is 0 in all but name
_SCATTER = 2e-3  # relative, more than roots beside a 4-fold one are off in double precision
_INSIDE = 1e-12  # a0 in its own unit, of the design that is given where the best has none
_ENDLESS = 1e6  # spreads of the objective in the box, beyond which it has no lower bound

_UNBOUNDED = "unbounded, as far as was looked: what this design reaches is far below all else; limit what it divides by"
_KEPT = "the best design that was looked at; no start of the solver ended as good"
_PASSED = "where a start of the solver ended: not known to be an optimum, but better than those that are"


@dataclass(frozen=True)
class Standing:
    """What is left of a search.

    Attributes:
        held: free parameters of a feasible design that is better than all that the solver reached.
        words: why it is no optimum.
    """

    nlp: NLP
    candidates: list[LocalEnd]
    trial: CheckedEnd | None
    held: Mapping[str, float] | None = None
    words: str = ""


def improve_from_sample(work: Workspace, nlp: NLP, candidates: list[LocalEnd], trial: CheckedEnd | None) -> Standing:
    """The search taken up again as long as a design that was looked at is better than where it ended."""
    if work.sampler is None or work.sample is None:
        return Standing(nlp, candidates, trial)
    standing = _appealed(work, work.sampler, work.sample, Standing(nlp, candidates, trial))
    if standing.trial is not None and standing.held is None:
        told = attained(work, standing.nlp, standing.candidates, standing.trial)
        standing = replace(standing, trial=_off_the_edge(work, work.sampler, told))
    trial = standing.trial
    if standing.held is not None or trial is None or converged(trial) or trial.checked.violations:
        return standing
    if not _endless(work, work.sample, trial.checked.objective):
        return standing
    return replace(standing, held={name: trial.parameters[name] for name in work.problem.free}, words=_UNBOUNDED)


def _at_infinity(work: Workspace, sample: Sample, trial: CheckedEnd | None) -> Looked:
    """Designs with a singular mass matrix that are better than a trial, their roots at infinity left aside."""
    if not sample.singular:
        return sample.refined.take(np.arange(0))
    a0 = work.part.model.coefficient_names()[0]
    limits = {**work.part.constraints, "a singular mass matrix": f"{a0} == 0"}
    sampler = Sampler(work.part.derive(constraints=limits), work.options.seed)
    return _better(sampler.sample().refined, _least(work, trial))


def ideal(work: Workspace) -> Outcome | None:
    """A design of the sample that no other can beat: all its roots real and negative, where the damping ratio is asked.

    Of one case alone: others would have to be covered.
    """
    problem, sample = work.problem, work.sample
    if problem.cases or (problem.maximize or "").strip() != "damping_ratio" or not (work.sampler and sample):
        return None
    for k in np.flatnonzero((sample.refined.violation == 0) & (sample.refined.worth <= -1))[:_APPEALED].tolist():
        parameters = problem.ordered(work.sampler.design(sample.refined, k))
        checked = work.recheck(parameters, ())
        if not checked.violations and checked.objective == 1 and rescued_by("ideal"):
            return Outcome(parameters, checked, "optimal", {}, Starts(), "abscissa")
    return None


def _appealed(work: Workspace, sampler: Sampler, sample: Sample, so_far: Standing) -> Standing:
    nlp, candidates, trial = so_far.nlp, so_far.candidates, so_far.trial
    run, rivals = Runner(work, nlp), sample.refined
    for _ in range(_APPEALS):
        if trial is not None:
            rivals = rivals.joined(sampler.around({name: trial.parameters[name] for name in work.problem.free}))
        rivals = _better(rivals, _least(work, trial))
        if not len(rivals) or not rescued_by("appeals"):
            break
        ended = [run.solve_from(sampler.design(rivals, k), near=True) for k in range(min(len(rivals), _APPEALED))]
        candidates = [*candidates, *ended]
        other = best_checked(work, nlp, candidates)
        if other is None or (trial is not None and not is_better(work, other, trial)):
            break
        trial = other
    nudged = _nudged(work, nlp, sampler, candidates, trial, rivals if len(rivals) else sample.refined)
    if nudged is not None and not len(_better(rivals, _least(work, nudged))):
        return Standing(nlp, candidates, nudged)
    beyond = _at_infinity(work, sample, trial)
    if len(rivals) or len(beyond) or (sample.singular and _troubled(work, candidates, trial)):
        opened = _opened(work, nlp, sampler, trial, (rivals if len(rivals) else sample.refined).joined(beyond))
        if opened is not None:
            return replace(opened, candidates=[*candidates, *opened.candidates])
    kept = sampler.refined(rivals.take(np.arange(min(len(rivals), 1))), _FINEST).joined(rivals)
    for k in range(min(len(kept), _KEPT_AT_MOST)):
        free = sampler.design(kept, k)
        checked = work.recheck(work.problem.ordered(free), nlp.cases)
        better = not checked.violations and work.problem.sign * checked.objective < _least(work, trial)
        if better and rescued_by("kept design"):
            endless = _endless(work, sample, checked.objective)
            return Standing(nlp, candidates, trial, free, _UNBOUNDED if endless else _KEPT)
    return Standing(nlp, candidates, trial)


def _endless(work: Workspace, sample: Sample, value: float) -> bool:
    """Whether an objective that no solver stopped at is far below what it is elsewhere in the box."""
    far = math.isfinite(value) and work.problem.sign * value < -_ENDLESS * sample.spread < 0
    return far and rescued_by("unbounded")


def keep_sampled(work: Workspace, standing: Standing, starts: Starts, cases: Sequence[Case]) -> Outcome:
    """A feasible design that is no optimum, but better than all that the solver reached."""
    assert standing.held is not None
    parameters = work.problem.ordered(standing.held)
    checked = work.recheck(parameters, cases)
    finding = Outcome(parameters, checked, "not_converged", {}, starts, standing.nlp.formulation, tuple(cases))
    return replace(finding, notes=(standing.words,), without_best=standing.words != _KEPT)


def endless(work: Workspace, finding: Outcome) -> Outcome:
    """An optimum by the digits of the solver alone: a0 is all but 0, and no limit that binds holds it there.

    The root that is far away would go on to infinity.
    """
    if finding.status != "optimal" or not runs_away(finding) or not rescued_by("runaway"):
        return finding
    if work.problem.objective is None or _held_off(work.problem, finding):
        return finding
    words = f"no best design: it improves towards a singular mass matrix (a0 = 0); {mass_advice(work.problem)}"
    return replace(finding, status="not_converged", without_best=True, notes=(*finding.notes, words))


def runs_away(finding: Outcome) -> bool:
    """Whether a root is so far away from others that a0 is all but 0; from those that are 0 any other is."""
    every = (math.hypot(r.re, r.im) for r in finding.checked.structure.roots)
    sizes = sorted(size for size in every if size)
    return bool(sizes) and sizes[-1] > _RUNAWAY * sizes[(len(sizes) - 1) // 2]


def _held_off(problem: Posed, finding: Outcome) -> bool:
    """Whether no parameter moves a0, or a limit that binds is about one that does."""
    about: set[str] = set()
    for name in finding.active:
        condition = problem.conditions.get(name)
        about |= set(condition.names) if condition else {name.rpartition(".")[0]}
    own = float(problem.values(finding.parameters).coefficients[0])
    moving = set[str]()
    for name, (low, high) in problem.free.items():
        moved = {**finding.parameters, name: finding.parameters[name] + _SHARE * (high - low)}
        if float(problem.values(moved).coefficients[0]) != own:
            moving.add(name)
    return not moving or bool(about & moving or about - set(problem.free))  # of a quantity, which may depend on all


def demote_if_beaten(work: Workspace, finding: Outcome) -> Outcome:
    """What was found, or where some start ended if that is better than what is called optimal."""
    sampler, ends = work.sampler, [c for _, c in work.met if np.all(np.isfinite(c.run.x))]
    if finding.status != "optimal" or sampler is None or not ends or work.part.objective is None:
        return finding
    own = sampler.space.points(finding.parameters)
    u = np.array([sampler.space.points(work.design_at(c.run.x)) for c in ends])
    worth = work.problem.sign * finding.checked.objective
    least = worth - _LOST * (ends[0].nlp.size + abs(worth))
    others = _better(sampler.look(u[np.abs(u - own).max(axis=1) > _SAME_DESIGN]), least)
    for k in range(min(len(others), _APPEALED)):
        parameters, cases = work.problem.ordered(sampler.design(others, k)), finding.cases
        if cases:  # those between them are worst elsewhere than at what was found
            cases = (*cases, *(w.case for w in worst_cases(work.problem, parameters).values()))
        checked = work.recheck(parameters, cases)
        told = not checked.violations and not unclear(work.problem, checked)
        merged = abs(checked.structure.abscissa - checked.realised)  # what merging roots may gain
        if told and work.problem.sign * checked.objective < least - merged and rescued_by("outdone"):
            doubted = replace(finding, parameters=parameters, checked=checked, cases=cases, status="not_converged")
            return replace(doubted, active={}, branches=(), notes=(_PASSED,))
    return finding


def _better(rivals: Looked, least: float) -> Looked:
    """Those that meet all limits and are worth less, the best first."""
    some = rivals.take(np.flatnonzero((rivals.violation == 0) & (rivals.worth < least)))
    return some.take(some.ranked)


def _least(work: Workspace, trial: CheckedEnd | None, lost: float = _LOST) -> float:
    """What a design must be worth less than to be better than a trial."""
    if trial is None or trial.checked.violations:
        return math.inf
    worth = work.problem.sign * trial.checked.objective
    return worth - lost * (trial.candidate.nlp.size + abs(worth)) if math.isfinite(worth) else math.inf


def _nudged(
    work: Workspace, nlp: NLP, sampler: Sampler, candidates: Sequence[LocalEnd], trial: CheckedEnd | None, near: Looked
) -> CheckedEnd | None:
    """An end that meets all limits a hair's breadth aside: at itself a root at 0, say, has no sign."""
    least, best = _least(work, trial), min((c.objective for c in candidates if c.feasible), default=math.inf)
    ends = [c for c in candidates if c.feasible and c.objective < least and same_objective(c.objective, best, nlp.size)]
    for end in ends[:_APPEALED]:
        own = sampler.space.points(work.design_at(end.run.x))
        towards = np.concatenate([near.u[:_APPEALED], sampler.stream("nudge").random((_TOWARDS, sampler.space.size))])
        seen = sampler.look((own + _HAIRS[:, None, None] * (towards - own)).reshape(-1, sampler.space.size))
        for k in np.flatnonzero((seen.violation == 0) & (seen.worth < least))[:_APPEALED].tolist():
            parameters = work.problem.ordered(sampler.design(seen, k))
            whole = best_checked(work, nlp, [end])
            assert whole is not None
            moved = replace(whole, parameters=parameters, checked=work.recheck(parameters, nlp.cases))
            if not moved.checked.violations and claim_matches(work, moved) and rescued_by("nudge"):
                return moved
    return None


def _off_the_edge(work: Workspace, sampler: Sampler, trial: CheckedEnd) -> CheckedEnd:
    """A trial with a root at 0, where the damping ratio jumps to −1: moved a hair, until it is what it claims."""
    problem = work.problem
    goal, roots = problem.objective, [math.hypot(r.re, r.im) for r in trial.checked.structure.roots]
    if goal is None or _FLAT not in goal.names or not min(roots, default=1.0) < _AT_ZERO * max(roots, default=0.0):
        return trial
    if not rescued_by("off the edge"):
        return trial
    own, claimed = sampler.space.points(trial.parameters), problem.sign * trial.checked.objective
    towards = sampler.stream("off the edge").random((_TOWARDS, sampler.space.size))
    seen = sampler.look((own + _HAIRS[::-1, None, None] * (towards - own)).reshape(-1, sampler.space.size))
    close = (seen.violation == 0) & (np.abs(seen.worth - claimed) <= _EDGE * (1 + abs(claimed)))
    for k in (-1, *np.flatnonzero(close)[:_KEPT_AT_MOST].tolist()):
        parameters = trial.parameters if k < 0 else problem.ordered(sampler.design(seen, k))
        checked = trial.checked if k < 0 else work.recheck(parameters, trial.candidate.nlp.cases)
        exact = certified_numbers(problem, parameters, checked, trial.candidate.nlp.cases).value
        if not checked.violations and math.isclose(exact, problem.sign * claimed, rel_tol=_LOST, abs_tol=_LOST):
            return replace(trial, parameters=parameters, checked=checked)
    return trial


def _troubled(work: Workspace, candidates: Sequence[LocalEnd], trial: CheckedEnd | None) -> bool:
    """Whether starts that met all limits ended nowhere, or the best end has a root near infinity."""
    assert work.sample is not None
    if bool(np.any(work.sample.refined.violation == 0)) and not all(c.feasible for c in candidates):
        return True
    sizes = sorted(math.hypot(r.re, r.im) for r in trial.checked.structure.roots) if trial else []
    return trial is not None and (not sizes or sizes[-1] > _FAR_OFF * sizes[(len(sizes) - 1) // 2])


def _opened(work: Workspace, nlp: NLP, sampler: Sampler, trial: CheckedEnd | None, rivals: Looked) -> Standing | None:
    """A better design where the search may go as far as a0 = 0; None where it finds none."""
    if not nlp.products or not rescued_by("infinity"):
        return None
    rows = [*range(len(rivals))][:_OPEN] + [*range(len(rivals))][_OPEN:][-_OPEN:]
    origins = [(sampler.design(rivals, k), True) for k in rows]
    origins += [] if trial is None else [({name: trial.parameters[name] for name in work.problem.free}, True)]
    bold = work.sample.boldest if work.sample else rivals
    origins += [(sampler.design(bold, k), False) for k in range(min(len(bold), _OPEN))]
    best: Standing | None = None
    least = _least(work, trial, _FINER)
    if trial is not None and abs(_leading(work, trial.parameters)) < _SINGULAR:  # it is all but there already
        least = _least(work, trial, -_LOST)
    for sign in (1, -1):
        ours = [(design, near) for design, near in origins if sign * _leading(work, design) > -_SINGULAR]
        if not ours:
            continue
        opened = work.formulate(nlp.cases, lead=sign)
        run = Runner(work, opened)
        ends = [run.solve_from(design, near, hopeful=False) for design, near in ours]
        reached = min((c for c in ends if c.feasible), key=lambda c: c.objective, default=None)
        if reached is None or not reached.objective < least:
            continue
        rows = [k for k, name in enumerate(opened.rows) if name == "a0"]
        singular = bool(opened.at(reached.run.x)[1][rows].min() < _SINGULAR)
        if singular:
            inside = [_INSIDE if k in rows else lower for k, lower in enumerate(opened.row_lower)]
            opened = replace(opened, row_lower=tuple(inside))
            ends = [Runner(work, opened).solve_from(work.design_at(reached.run.x), near=True)]
        other = best_checked(work, opened, ends)
        if other is None or other.checked.violations or _merged(other):
            continue
        if not work.problem.sign * other.checked.objective < least:
            continue
        least = _least(work, other, _FINER)
        best = Standing(opened, ends, other)
        if singular:
            towards = f"towards a singular mass matrix (a0 = 0), to {work.problem.sign * reached.objective:.9g}"
            words = f"no best design: it improves {towards}; {mass_advice(work.problem)}"
            if work.sample and _endless(work, work.sample, work.problem.sign * reached.objective):
                words = _UNBOUNDED
            best = replace(best, held={n: other.parameters[n] for n in work.problem.free}, words=words)
    return best


def _merged(trial: CheckedEnd) -> bool:
    """Whether roots that are far apart count as one: beside a0 = 0 rounding leaves little of the coefficients."""
    ideal, stored = trial.checked.structure.abscissa, trial.checked.realised
    return abs(ideal - stored) > _SCATTER * abs(ideal)


def _leading(work: Workspace, free: Mapping[str, float]) -> float:
    """a0 relative to the other coefficients."""
    a = [float(c) for c in work.problem.values(work.problem.ordered(free)).coefficients]
    return a[0] / (max(map(abs, a)) or 1.0)
