"""The search of one part of the box, with cases added until the worst one is covered."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from tmsopt.evaluation.bound import bounded
from tmsopt.evaluation.recheck import FEASIBLE, recheck
from tmsopt.evaluation.worst_case import Worst, worst_cases
from tmsopt.problem.cases import Case
from tmsopt.problem.dependence import STABLE, WORSE_DIRECTION
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import RADIUS
from tmsopt.problem.searches import Starts
from tmsopt.program.formulate import design_of, formulate, middle
from tmsopt.program.nlp import NLP
from tmsopt.program.options import Options
from tmsopt.progress import begin
from tmsopt.records import Table
from tmsopt.search.basins.crossings import crossing_finding, search_elsewhere
from tmsopt.search.basins.exceptional import exceptional
from tmsopt.search.basins.plateau import off_plateau, on_plateau
from tmsopt.search.multistart import Runner, distinct, further, optima, same_objective, search
from tmsopt.search.outcome import (
    CheckedEnd,
    Outcome,
    best_checked,
    better,
    counted,
    evaluated_cases,
    found,
    is_better,
    listed_cases,
    mass_advice,
)
from tmsopt.search.referee import demote_if_beaten, endless, ideal, improve_from_sample, keep_sampled, runs_away
from tmsopt.search.remedies.changes import relax
from tmsopt.search.remedies.needs import irreducible, steady
from tmsopt.search.rescues import rescued_by
from tmsopt.search.sample import NARROW, Sampler
from tmsopt.search.tolerant import maximise_radius, promising
from tmsopt.search.workspace import LocalEnd, Workspace, workspace

_ROUNDS, _FAR_ROUNDS = 12, 40
"""Times that cases are added; each time the worst one between them shrinks to its square, roughly."""

_LEADERS = 3  # optima followed when cases are added: a better one may do worse between the old cases
_SETTLED = 6  # starts of a problem with limits moved
_FROM = 16  # stable designs of a sample that are started from, of either kind
_FEWER = 8  # starts for positive real roots where the others have led somewhere
_NEARER = 1e-7  # share of the radius
_BESIDE = 1e-6  # of the box: designs closer than that are one; what IPOPT leaves at a multiple root is farther off


@dataclass(frozen=True)
class Explored:
    """What the search of one part of the box came to.

    Attributes:
        name: of the part.
        finding: None where nothing feasible was found.
    """

    name: str
    candidates: tuple[LocalEnd, ...]
    finding: Outcome | None


def explore(work: Workspace, insist: bool = True) -> Explored:
    """Search one part of the box from many starts, exactly and in all cases.

    Args:
        insist: on a stable design; another part of the box may have one.
    """
    begin(work.options.progress, "looking at designs")
    if best := ideal(work):
        return Explored(work.name, (), best)
    cases, about = work.problem.cases, work.problem.objective.names if work.problem.objective else ()
    if RADIUS in about and work.problem.pattern is None and (led := maximise_radius(work, promising(work))):
        starts = counted(led.candidates, led.trial.candidate.objective)
        return Explored(work.name, led.candidates, _covered(work, led.nlp, led.candidates, led.trial, starts))
    nlp = work.formulate(cases)
    mixed = {"abscissa", "damping_ratio"} <= set(nlp.variables)
    thin = work.problem.model.feedback is not None or (work.sample and work.sample.singular) or rarely_stable(work)
    needles = bool(work.sample and thin and "abscissa" in nlp.variables)
    asked = (mixed or needles) and not work.options.near and rescued_by("multiple roots")
    leads = exceptional(work) if asked else []
    candidates = [*search(work, nlp, _FEWER if mixed and leads else None), *_from(work, nlp, leads)]
    trial = best_checked(work, nlp, candidates)
    if (
        any(c.crossing for c in candidates)
        and (trial is None or trial.checked.violations)
        and rescued_by("other chains")
    ):
        nlp, candidates, trial = search_elsewhere(work, nlp, candidates)
    if trial is None and on_plateau(work.problem) and rescued_by("off plateau"):
        candidates += _from(work, nlp, off_plateau(work, nlp, _FEWER))
        trial = best_checked(work, nlp, candidates)
    for ratio, most in _ratios(work, nlp, trial):
        fixed = work.formulate(cases, damping_ratio=ratio)
        others = _from(work, fixed, leads) if leads and ratio == 1 else search(work, fixed, most)
        other = best_checked(work, fixed, others)
        if other is not None and (trial is None or (not other.checked.violations and is_better(work, other, trial))):
            nlp, candidates, trial = fixed, others, other
    standing = improve_from_sample(work, nlp, candidates, trial)
    wanting = insist and standing.trial is not None and _wants_stability(work.problem, standing.trial)
    if (
        standing.trial is not None
        and work.sampler
        and wanting
        and not work.never_stable
        and rescued_by("left of the axis")
    ):
        others = _left_of_the_axis(work, nlp, len({id(c) for c in candidates}))
        other, every = best_checked(work, nlp, others), [*standing.candidates, *others]
        ahead_of = other is not None and is_better(work, other, standing.trial)
        standing = improve_from_sample(work, nlp, every, other) if ahead_of else replace(standing, candidates=every)
    nlp, candidates, trial = standing.nlp, standing.candidates, standing.trial
    starts = counted(candidates, trial.candidate.objective if trial else math.nan)
    if trial and on_plateau(work.problem, trial.checked.objective):
        starts = replace(starts, at_best=0)
    if standing.held is not None:
        listed = evaluated_cases(work.problem, work.problem.ordered(standing.held))
        return Explored(work.name, tuple(candidates), keep_sampled(work, standing, starts, listed))
    finding = _covered(work, nlp, candidates, trial, starts) if cases else found(work, nlp, trial, starts)
    return Explored(work.name, tuple(candidates), endless(work, demote_if_beaten(work, finding)) if finding else None)


def rarely_stable(work: Workspace) -> bool:
    """Whether stability is asked for, and so few designs of the sample have it that basins may lie between them."""
    worth = work.sampler.drawn[1].worth if work.sampler and bounded(work.part) else None
    return worth is not None and bool(np.mean(worth < 0) < NARROW)


def _from(work: Workspace, nlp: NLP, designs: Sequence[Mapping[str, float]]) -> list[LocalEnd]:
    run = Runner(work, nlp)
    return [run.solve_from(design, near=True, hopeful=False) for design in designs]


def _left_of_the_axis(work: Workspace, nlp: NLP, tried: int) -> list[LocalEnd]:
    """Where starts end from designs sought for their stability alone; all starts are spent where there is any such."""
    limits = {**work.part.constraints, STABLE: "abscissa <= 0"}
    asked = work.part.derive(minimize="abscissa", maximize=None, constraints=limits)
    seed = work.options.seed + 1
    sampler, run = Sampler(asked, seed), Runner(work, nlp)
    if bounded(work.part) and work.sample:  # without limits the boldest designs show whether any is near the axis
        free = Sampler(asked.derive(constraints={}), seed)
        if not np.any(free.refined(free.look(work.sample.boldest.u)).worth < 0):
            return []
    sample, ended = sampler.sample(), list[LocalEnd]()
    for seen, near in ((sample.refined, True), (sample.boldest, False)):
        rows = np.flatnonzero(seen.worth < 0)[:_FROM].tolist()
        ended += [run.solve_from(sampler.design(seen, k), near, hopeful=False) for k in rows]
    return [*ended, *further(work, nlp, tried)] if ended else ended


def _wants_stability(problem: Posed, trial: CheckedEnd) -> bool:
    """Whether a design is unstable, and the objective or a constraint is about the roots."""
    asked = (problem.objective, *problem.conditions.values())
    about = any(set(WORSE_DIRECTION) & set(e.names) for e in asked if e)
    return about and not trial.checked.structure.abscissa < 0


def without_any(work: Workspace, tried: int) -> Outcome:
    """No start ended feasible: the least-violating design, and what can be reached from it if it violates nothing."""
    problem = work.problem
    nlp = formulate(problem, problem.cases)
    if crossed := next((c for _, c in work.met if c.crossing), None):
        return crossing_finding(work, work.design_at(crossed.run.x), tried, nlp)
    begin(work.options.progress, "searching for the least that limits must give", "start")
    again = partial(answered, asked=problem)
    relaxation = relax(work, partial(irreducible, reached=partial(_reached, work)), again)
    free = relaxation.parameters if relaxation else middle(problem)
    design = {n: min(max(free[n], lo), hi) for n, (lo, hi) in problem.free.items()}
    parameters = problem.ordered(design)
    cases = evaluated_cases(problem, parameters)
    checked = work.recheck(parameters, cases)
    none = f"of {tried} starts, none"
    if relaxation is None or relaxation.amounts:
        status, note = "infeasible", f"{none} satisfies all constraints"
    else:
        ended = [Runner(work, nlp).solve_from(design, near) for near in (True, False)]
        trial = best_checked(work, nlp, ended)
        if finding := found(work, nlp, trial, Starts(tried + 2, sum(c.feasible for c in ended), 1)):
            return finding
        advice = f"try more starts, give one, or {mass_advice(problem)}"
        status, note = "not_converged", f"feasible designs exist, but {none} converged; {advice}"
    starts, notes = Starts(tried=tried), (note,)
    return Outcome(parameters, checked, status, {}, starts, nlp.formulation, cases, notes=notes, relaxation=relaxation)


def answered(problem: Posed, options: Options, asked: Posed, thorough: bool = False) -> Mapping[str, float] | None:
    """The optimum of a problem that is solved again; {} where it is not stable, though `asked` wants that; or None.

    As many starts are enough as a search takes to settle, for none that follow make an optimum worse; where these end
    at nothing stable, all are made, but for a least abscissa that all of them agree on, unless a stable design is known
    and it is to be `thorough`. That a sample sees nothing near ends none: what is just enough is a needle.
    """
    stable = steady(problem, asked)
    best: Outcome | None = None
    for part in workspace(problem, options).parts():
        settled = None if problem.cases else _settled(part, stable, thorough)
        finding = settled or explore(part).finding
        best = finding if finding and (best is None or better(problem, finding, best)) else best
    if best is None or best.status != "optimal":
        return None
    return best.parameters if _meets(stable, best) else {}


def _settled(part: Workspace, stable: Posed, thorough: bool) -> Outcome | None:
    """Where few starts end that settle it: at what is stable, or all of them at one least abscissa that is not."""
    nlp = part.formulate(())
    ended = search(part, nlp, _SETTLED)
    finding = found(part, nlp, best_checked(part, nlp, ended), Starts())
    agreed = not thorough and bounded(part.part) and all(c.feasible for c in ended) and optima(ended) == 1
    if finding is None or finding.status != "optimal" or runs_away(finding):
        return None
    return finding if agreed or _meets(stable, finding) else None


def _meets(problem: Posed, finding: Outcome) -> bool:
    return not recheck(problem, finding.parameters, finding.cases).violations


def _reached(work: Workspace, names: Sequence[str]) -> tuple[Mapping[str, float] | None, bool]:
    """A design that meets the constraints of these names, whatever it does to others; and whether that can be told."""
    problem, options = work.problem, replace(work.options, progress=None, near=None)
    kept = problem.derive(constraints={n: text for n, text in problem.constraints.items() if n in names}, pareto=())
    if kept.objective and (RADIUS in kept.objective.names or not (kept.pattern or set(names) & {*kept.asked_of_roots})):
        kept = kept.derive(minimize=None, maximize=None)
    parts = workspace(kept, options).parts()
    if any(part.needles for part in parts):
        return None, False
    for part in parts:
        finding = explore(part, insist=False).finding
        if finding is not None and not finding.checked.violations:
            return finding.parameters, True
    return None, True


def _ratios(work: Workspace, nlp: NLP, trial: CheckedEnd | None) -> Iterator[tuple[float, int]]:
    """Damping ratios at which to search again, and from how many starts."""
    if {"abscissa", "damping_ratio"} <= set(nlp.variables) and rescued_by("real roots"):
        yield 1.0, _FEWER  # where real roots meet, sectors and half-planes are singular together
    if (
        "damping_ratio" in nlp.variables
        and (trial is None or _unstable(work.problem, nlp, trial))
        and rescued_by("positive roots")
    ):
        # A positive real root has −1, and no sector of its own.
        yield -1.0, _FEWER if (trial and nlp.touches) or on_plateau(work.problem) else work.options.starts


def _unstable(problem: Posed, nlp: NLP, trial: CheckedEnd) -> bool:
    """Whether the best design may have been kept from positive real roots, where the damping ratio is not the goal."""
    if "damping_ratio" in nlp.touches:  # the less of it the better, somewhere
        return True
    asked = problem.objective is not None and "damping_ratio" in problem.objective.names
    return not asked and trial.checked.structure.abscissa > 0


def _covered(
    work: Workspace, nlp: NLP, candidates: Sequence[LocalEnd], trial: CheckedEnd | None, starts: Starts
) -> Outcome | None:
    """The best design once cases have been added until none between them is worse."""
    problem = work.problem
    if trial is not None and problem.asks_radius and not any(case.edge for case in nlp.cases):
        led = maximise_radius(work, [trial.parameters, *_leaders(work, candidates)])
        nlp, candidates, trial = (led.nlp, led.candidates, led.trial) if led else (nlp, candidates, trial)
    best, worst = trial, dict[str, Worst]()
    for _ in range(_FAR_ROUNDS if problem.asks_radius else _ROUNDS):
        if trial is None or best is None:
            return None
        if sum(trial.checked.violations.values()) > math.sqrt(FEASIBLE) and not problem.asks_radius:
            break  # not even the cases at hand are met
        worst = worst_cases(problem, trial.parameters)
        more = [*_uncovered(problem, trial, worst), *_nearer(nlp, trial)]
        if not more:
            break
        best, worst = trial if is_better(work, trial, best) else best, {}
        ours = [best.parameters] if best is trial else [best.parameters, trial.parameters]
        leaders = _apart(problem, [*ours, *_leaders(work, candidates)])
        nlp = work.formulate((*nlp.cases, *more))
        run = Runner(work, nlp)
        candidates = [run.solve_from(design, near=True) for design in leaders]
        trial = best_checked(work, nlp, candidates)
        if _lost(work, trial, leaders, nlp):
            candidates = [*candidates, *(run.solve_from(design) for design in leaders)]
            trial = best_checked(work, nlp, candidates)
            if not problem.asks_radius and _lost(work, trial, leaders, nlp):
                candidates = [*candidates, *search(work, nlp)]
                trial = best_checked(work, nlp, candidates)
    if trial is None:
        return None
    listed = listed_cases(problem, worst or worst_cases(problem, trial.parameters))
    others = [c for c in listed if c not in nlp.cases]
    return found(work, nlp, trial, starts, (*nlp.cases, *others))


def _lost(work: Workspace, trial: CheckedEnd | None, leaders: Sequence[Mapping[str, float]], nlp: NLP) -> bool:
    """Whether a trial is worse, in the cases of an NLP, than one of the designs that it was started from."""
    if trial is None:
        return True
    if work.problem.objective is None:
        return False
    sign = work.problem.sign
    own = [work.recheck(work.problem.ordered(design), nlp.cases) for design in leaders]
    known = min((sign * c.objective for c in own if not c.violations), default=math.inf)
    return sign * trial.checked.objective > known and not same_objective(
        sign * trial.checked.objective, known, trial.candidate.nlp.size
    )


def _uncovered(problem: Posed, trial: CheckedEnd, found: Mapping[str, Worst]) -> list[Case]:
    """Cases in which the design does worse than in all that it was made for."""
    more: list[Case] = []
    known = trial.checked
    for name, worst in found.items():
        match name:
            case "abscissa":
                excess = worst.value - known.structure.abscissa
            case "damping_ratio":
                excess = known.quantities["damping_ratio"] - worst.value
            case "angular_frequency":
                excess = worst.value - known.quantities["angular_frequency"]
            case "objective":
                excess = abs(worst.value - known.objective)
            case _:
                beyond = problem.conditions[name.removeprefix("constraint ")].excess(worst.value)
                excess = float(beyond) if beyond > 0 else 0.0  # what does not exist is no excess
        if not excess <= FEASIBLE * (1 + abs(worst.value)) and worst.case not in more:
            more.append(worst.case)
    return more


def _nearer(nlp: NLP, trial: CheckedEnd) -> list[Case]:
    """The direction in which stability is lost before the radius that the design claims."""
    around = trial.checked.around
    if around is None or RADIUS not in nlp.variables:
        return []
    claimed = float(trial.point.x[nlp.variables.index(RADIUS)])
    if around.radius >= claimed * (1 - _NEARER) or not around.limit.found:
        return []
    length = around.limit.distance or 1.0
    step = {n: u / length for n, u in around.limit.direction.items()}
    known = [c.direction for c in nlp.cases]
    if any(all(abs(step[n] - k.get(n, 0.0)) < _NEARER for n in step) for k in known):  # stable again further out
        step = {n: u * around.radius / claimed * (1 + _NEARER) for n, u in step.items()}
    return [Case(direction=Table(step))]


def _apart(problem: Posed, designs: Sequence[Mapping[str, float]]) -> list[Mapping[str, float]]:
    """The designs without those beside an earlier one, as an end of the solver is beside what it was polished to."""
    kept: list[Mapping[str, float]] = []
    for d in designs:
        if not any(all(abs(d[n] - k[n]) <= _BESIDE * (hi - lo) for n, (lo, hi) in problem.free.items()) for k in kept):
            kept.append(d)
    return kept


def _leaders(work: Workspace, candidates: Sequence[LocalEnd]) -> list[dict[str, float]]:
    """The designs of the best few different optima."""
    return [design_of(work.problem, c.run.x.tolist()) for c in distinct(candidates)[:_LEADERS]]
