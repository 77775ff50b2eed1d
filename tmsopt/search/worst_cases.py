"""Designs for many cases: add the worst case between the listed ones until none is worse."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from tmsopt.evaluation.recheck import FEASIBLE
from tmsopt.evaluation.worst_case import Worst, find_worst_cases
from tmsopt.problem.cases import Case
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import RADIUS
from tmsopt.program.formulate import formulate
from tmsopt.records import Table
from tmsopt.search.acceptance import is_better
from tmsopt.search.outcome import Outcome, assess_best, merge_cases
from tmsopt.search.policy import Policy, disable_stopping, search, try_starts
from tmsopt.search.radius import RADIUS_POLICY
from tmsopt.search.state import CheckedEnd, SearchState, Start, same_objective
from tmsopt.search.stopping import count_starts, select_distinct_ends


def cover_cases(state: SearchState, policy: Policy) -> Outcome | None:
    """The best design once cases have been added until none between them is worse."""
    problem, tuning = state.problem, state.tuning
    starts = count_starts(state.ends, state.best.end.objective if state.best else math.nan)
    exhaustive = disable_stopping(policy)
    if state.best and problem.asks_radius and not any(case.edge for case in state.nlp.cases):
        designs = (state.best.parameters, *_list_leaders(state))
        climbed = search(replace(state.with_program(state.nlp), extra=designs), replace(RADIUS_POLICY, tuning=tuning))
        state = climbed if climbed.best else state
    best, worst = state.best, dict[str, Worst]()
    for _ in range(tuning.far_rounds if problem.asks_radius else tuning.rounds):
        trial = state.best
        if trial is None or best is None:
            return None
        if sum(trial.checked.violations.values()) > math.sqrt(FEASIBLE) and not problem.asks_radius:
            break  # the current cases are not met
        worst = find_worst_cases(problem, trial.parameters)
        more = [*_find_uncovered_cases(problem, trial, worst), *_find_nearer_boundary(trial, tuning.nearer)]
        if not more:
            break
        best, worst = trial if is_better(problem, trial, best) else best, {}
        current = [best.parameters] if best is trial else [best.parameters, trial.parameters]
        leaders = _select_apart(problem, [*current, *_list_leaders(state)], tuning.alike_designs)
        state = state.with_program(formulate(state.part, (*trial.end.nlp.cases, *more)))
        state = policy.accept(try_starts(state, (Start(d) for d in leaders), exhaustive))
        if _is_worse_than_leaders(state, leaders):
            state = policy.accept(try_starts(state, (Start(d, near=False) for d in leaders), exhaustive))
            if not problem.asks_radius and _is_worse_than_leaders(state, leaders):
                state = policy.accept(try_starts(state, policy.starts(state), policy))
        if state.interrupted:
            break
    if state.best is None:
        return None
    cases = state.best.end.nlp.cases
    listed = merge_cases(problem, worst or find_worst_cases(problem, state.best.parameters))
    return assess_best(state, starts, (*cases, *(c for c in listed if c not in cases)))


def _is_worse_than_leaders(state: SearchState, leaders: Sequence[Mapping[str, float]]) -> bool:
    """Whether the best design is worse, in the cases of its program, than a design that it started from."""
    if state.best is None:
        return True
    if state.problem.objective is None:
        return False
    sign, own = state.problem.sign, [state.recheck(design) for design in leaders]
    known = min((sign * c.objective for c in own if not c.violations), default=math.inf)
    reached = sign * state.best.checked.objective
    return reached > known and not same_objective(reached, known, state.nlp.size, state.tuning.same)


def _find_uncovered_cases(problem: Posed, trial: CheckedEnd, find_worst_cases: Mapping[str, Worst]) -> list[Case]:
    """Cases in which the design is worse than in all cases that it was made for."""
    more: list[Case] = []
    known = trial.checked
    for name, worst in find_worst_cases.items():
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
                excess = float(beyond) if beyond > 0 else 0.0  # nan counts as none
        if not excess <= FEASIBLE * (1 + abs(worst.value)) and worst.case not in more:
            more.append(worst.case)
    return more


def _find_nearer_boundary(trial: CheckedEnd, least: float) -> list[Case]:
    """The direction in which stability is lost before the radius that the design claims."""
    around, nlp = trial.checked.robustness, trial.end.nlp
    if around is None or RADIUS not in nlp.variables:
        return []
    claimed = float(trial.point.x[nlp.variables.index(RADIUS)])
    if around.radius >= claimed * (1 - least) or not around.limit.found:
        return []
    length = around.limit.distance or 1.0
    step = {n: u / length for n, u in around.limit.direction.items()}
    known = [c.direction for c in nlp.cases]
    if any(all(abs(step[n] - k.get(n, 0.0)) < least for n in step) for k in known):  # stable again further out
        step = {n: u * around.radius / claimed * (1 + least) for n, u in step.items()}
    return [Case(direction=Table(step))]


def _select_apart(problem: Posed, designs: Sequence[Mapping[str, float]], share: float) -> list[Mapping[str, float]]:
    """The designs without those that nearly equal an earlier one."""
    kept: list[Mapping[str, float]] = []
    for d in designs:
        if not any(all(abs(d[n] - k[n]) <= share * (hi - lo) for n, (lo, hi) in problem.free.items()) for k in kept):
            kept.append(d)
    return kept


def _list_leaders(state: SearchState) -> list[dict[str, float]]:
    """The designs of the best few distinct optima."""
    return [state.design_at(end) for end in select_distinct_ends(state.ends)[: state.tuning.followed]]
