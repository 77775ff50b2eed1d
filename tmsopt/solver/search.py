"""The search of one part of the box, with cases added until the worst one is covered."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from tmsopt.checks.recheck import FEASIBLE, recheck
from tmsopt.checks.worst_case import worst_cases
from tmsopt.design.cases import Case
from tmsopt.design.dependence import overclaims
from tmsopt.design.problem import Problem
from tmsopt.design.quantities import RADIUS
from tmsopt.design.solution import Starts
from tmsopt.formulation.formulate import design_of, formulate, middle
from tmsopt.formulation.nlp import NLP
from tmsopt.records import Progress, Table
from tmsopt.solver.box import Side
from tmsopt.solver.multistart import Candidate, Runner, follow, same, search
from tmsopt.solver.outcome import Finding, Trial, ahead, counted, found, survivor
from tmsopt.solver.relaxation import relax
from tmsopt.solver.workspace import Family

_ROUNDS, _FAR_ROUNDS = 12, 40
"""Times that cases are added; each time the worst one between them shrinks to its square, roughly."""

_LEADERS = 3  # optima followed when cases are added: a better one may do worse between the old cases
_NEARER = 1e-7  # share of the radius


@dataclass(frozen=True)
class Options:
    """How to search; see `solve`."""

    starts: int
    seed: int
    exhaustive: bool
    linear_solver: str
    progress: Progress | None
    near: Mapping[str, float] | None = None
    family: Family = field(default_factory=Family)
    alone: bool = True


@dataclass(frozen=True)
class Explored:
    """What the search of one part of the box came to.

    Attributes:
        finding: None where nothing feasible was found.
    """

    side: Side
    nlp: NLP
    candidates: tuple[Candidate, ...]
    finding: Finding | None


def explore(problem: Problem, side: Side, options: Options) -> Explored:
    """Search one part of the box from many starts, exactly and in all cases."""
    family = options.family
    nlp = side.narrowed(family.formulate(problem, problem.cases))
    touching = overclaims(problem)
    candidates = _searched(side, nlp, options, touching)
    trial = survivor(problem, nlp, candidates, family)
    if "damping_ratio" in nlp.touches and (trial is None or _unstable(problem, trial)):
        # A positive real root has −1, and no sector of its own.
        unstable = side.narrowed(family.formulate(problem, problem.cases, damping_ratio=-1.0))
        others = _searched(side, unstable, options, touching)
        other = survivor(problem, unstable, others, family)
        if other is not None and (trial is None or ahead(problem, other, trial)):
            nlp, candidates, trial = unstable, others, other
    starts = counted(candidates, trial.candidate.objective if trial else math.nan)
    if problem.cases:
        finding = _covered(problem, side, nlp, candidates, trial, starts, touching, options)
    else:
        finding = found(problem, nlp, trial, starts)
    return Explored(side, nlp, tuple(candidates), finding)


def without_any(problem: Problem, explored: Sequence[Explored], options: Options) -> Finding:
    """No start ended feasible: the least-violating design, and what can be reached from it if it violates nothing."""
    nlp = formulate(problem, problem.cases)
    relaxation = relax(problem, options.seed, options.linear_solver, alone=options.alone)
    free = relaxation.parameters if relaxation else middle(problem)
    design = {n: min(max(free[n], lo), hi) for n, (lo, hi) in problem.free.items()}
    parameters = problem.ordered(design)
    cases = evaluated_cases(problem, parameters)
    checked = recheck(problem, parameters, cases)
    tried = sum(len(e.candidates) for e in explored)
    none = f"of {tried} starts, none"
    if relaxation is None or relaxation.amounts:
        status, note = "infeasible", f"{none} satisfies all constraints"
    else:
        ended = [follow(problem, nlp, design, options.linear_solver, near) for near in (True, False)]
        trial = survivor(problem, nlp, ended)
        if finding := found(problem, nlp, trial, Starts(tried + 2, sum(c.feasible for c in ended), 1)):
            return finding
        advice = "try more starts, give one, or keep a0 away from 0 (for tms, nu_H >= 0.02; for whipple, u_H >= 0.02)"
        status, note = "not_converged", f"feasible designs exist, but {none} converged; {advice}"
    return Finding(
        parameters,
        checked,
        status,
        {},
        Starts(tried=tried),
        nlp.formulation,
        cases,
        notes=(note,),
        relaxation=relaxation,
    )


def evaluated_cases(problem: Problem, parameters: Mapping[str, float]) -> tuple[Case, ...]:
    """The listed cases of a design and the worst ones between them."""
    listed = problem.cases
    return (*listed, *(w.case for w in worst_cases(problem, parameters).values())) if listed else ()


def _unstable(problem: Problem, trial: Trial) -> bool:
    """Whether the best design may have been kept from positive real roots, where the damping ratio is not the goal."""
    asked = problem.objective is not None and "damping_ratio" in problem.objective.names
    return not asked and trial.checked.structure.abscissa > 0


def _searched(side: Side, nlp: NLP, options: Options, touching: bool) -> list[Candidate]:
    """Where the starts ended."""
    return search(
        side.problem,
        nlp,
        starts=options.starts,
        seed=options.seed,
        exhaustive=options.exhaustive,
        linear_solver=options.linear_solver,
        progress=options.progress,
        touching=touching,
        near=options.near,
        family=options.family,
    )


def _covered(
    problem: Problem,
    side: Side,
    nlp: NLP,
    candidates: Sequence[Candidate],
    trial: Trial | None,
    starts: Starts,
    touching: bool,
    options: Options,
) -> Finding | None:
    """The best design once cases have been added until none between them is worse."""
    best, family = trial, options.family
    for _ in range(_FAR_ROUNDS if problem.asks_radius else _ROUNDS):
        if trial is None or best is None:
            return None
        if sum(trial.checked.violations.values()) > math.sqrt(FEASIBLE) and not problem.asks_radius:
            break  # not even the cases at hand are met
        more = [*_uncovered(problem, trial), *_nearer(problem, nlp, trial)]
        if not more:
            break
        best = trial if ahead(problem, trial, best) else best
        ours = [best.parameters] if best is trial else [best.parameters, trial.parameters]
        leaders = [*ours, *_leaders(problem, candidates)]
        nlp = side.narrowed(family.formulate(problem, (*nlp.cases, *more)))
        run = Runner(problem, nlp, options.linear_solver, touching, family)
        candidates = [run.ended(design, near=True) for design in leaders]
        trial = survivor(problem, nlp, candidates, family)
        if _lost(problem, trial, leaders, nlp, family):
            candidates = [*candidates, *(run.ended(design) for design in leaders)]
            trial = survivor(problem, nlp, candidates, family)
        if _lost(problem, trial, leaders, nlp, family) and not problem.asks_radius:
            candidates = [*candidates, *_searched(side, nlp, options, touching)]
            trial = survivor(problem, nlp, candidates, family)
    if trial is None:
        return None
    others = [c for c in evaluated_cases(problem, trial.parameters) if c not in nlp.cases]
    return found(problem, nlp, trial, starts, (*nlp.cases, *others))


def _lost(
    problem: Problem, trial: Trial | None, leaders: Sequence[Mapping[str, float]], nlp: NLP, family: Family
) -> bool:
    """Whether a trial is worse, in the cases of an NLP, than one of the designs that it was started from."""
    if trial is None:
        return True
    if problem.objective is None:
        return False
    sign = -1.0 if problem.sense == "maximize" else 1.0
    designs = [problem.ordered(design) for design in leaders]
    own = [recheck(problem, design, nlp.cases, family.around(problem, design)) for design in designs]
    known = min((sign * c.objective for c in own if not c.violations), default=math.inf)
    return sign * trial.checked.objective > known and not same(
        sign * trial.checked.objective, known, trial.candidate.nlp.size
    )


def _uncovered(problem: Problem, trial: Trial) -> list[Case]:
    """Cases in which the design does worse than in all that it was made for."""
    more: list[Case] = []
    known = trial.checked
    for name, worst in worst_cases(problem, trial.parameters).items():
        match name:
            case "abscissa":
                excess = worst.value - known.structure.abscissa
            case "damping_ratio":
                excess = known.quantities["damping_ratio"] - worst.value
            case "objective":
                excess = abs(worst.value - known.objective)
            case _:
                beyond = problem.conditions[name.removeprefix("constraint ")].excess(worst.value)
                excess = float(beyond) if beyond > 0 else 0.0  # what does not exist is no excess
        if not excess <= FEASIBLE * (1 + abs(worst.value)) and worst.case not in more:
            more.append(worst.case)
    return more


def _nearer(problem: Problem, nlp: NLP, trial: Trial) -> list[Case]:
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


def _leaders(problem: Problem, candidates: Sequence[Candidate]) -> list[dict[str, float]]:
    """The designs of the best few different optima."""
    kept: list[Candidate] = []
    for candidate in sorted((c for c in candidates if c.feasible), key=lambda c: c.objective):
        if not any(same(candidate.objective, k.objective, candidate.nlp.size) for k in kept):
            kept.append(candidate)
    return [design_of(problem, c.run.x.tolist()) for c in kept[:_LEADERS]]
