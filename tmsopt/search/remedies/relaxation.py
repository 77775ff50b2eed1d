"""The least change of limits that makes an infeasible problem feasible."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from typing import Any

import numpy as np

from tmsopt.algebra.formula import fold, formula, symbol
from tmsopt.algebra.kinds import NODES, atan
from tmsopt.evaluation.recheck import FEASIBLE, measure_excesses, recheck
from tmsopt.evaluation.worst_case import find_worst_cases
from tmsopt.models import Values
from tmsopt.problem.advice.remedies import Relaxation
from tmsopt.problem.cases import Case
from tmsopt.problem.problem import Posed
from tmsopt.program.formulate import formulate
from tmsopt.program.nlp import NLP, AddedVariable, variable_name
from tmsopt.program.options import Options
from tmsopt.records import Table
from tmsopt.search.policy import disable_stopping, run_nested
from tmsopt.search.sample import Box, draw_box
from tmsopt.search.search import POLICY
from tmsopt.search.state import CheckedEnd, SearchState, Start, begin_search, clip_to_box, same_objective

_ROUNDS = 12  # of adding cases, at most
_MOST_STARTS = 8  # of a relaxation
_LEADS = 2  # starts for one limit alone
_AGREE = 3  # starts at the best value that end the search
_TIE = 1e-3  # relative difference of the scales of equal limits: moving one is easier to read than two halves
_WIDER = 3.0  # widths of the box by which its bounds may move
_INSET = 1e-3  # share of the width kept from an excluded physical end
_ACTIVE = 1e-5  # multiplier, per scale or width of the box, above which a limit is in the conflict
_NOTHING = 1e-12  # sum of amounts below which the problem is feasible
_FINEST = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8)  # of the box: steps that refine the best sampled design
_ROUND_UP = 1e-12  # of an amount, so that the design is inside the relaxed limits


@dataclass(frozen=True)
class Limit:
    """A constraint, or an end of a free parameter's range such as ``Fr.max``, that a relaxation may move.

    Attributes:
        scale: the amount that counts as 1 in sums.
        parameter, end: for an end of a range, its parameter and value.
    """

    name: str
    scale: float
    parameter: str = ""
    end: float = 0.0

    def measure_need(self, parameters: Mapping[str, float], excess: Mapping[str, float]) -> float:
        """The amount by which a design needs the limit moved."""
        if not self.parameter:
            return excess.get(self.name, 0.0)
        beyond = parameters[self.parameter] - self.end
        return max(beyond if self.name.endswith(".max") else -beyond, 0.0)


def find_least_relaxation(
    problem: Posed,
    options: Options,
    wide: Posed,
    limits: Sequence[Limit],
    designs: Sequence[Mapping[str, float]] = (),
) -> tuple[Relaxation, CheckedEnd | None, NLP | None] | tuple[None, None, None]:
    """The least relaxation in a box, with its end and program; without these for a known design."""
    sides = begin_search(wide, options)
    results = [_find_least_in_cases(side, limits, problem.cases) for side in sides]
    feasible = [(trial, nlp) for trial, nlp in results if trial is not None]
    trial, nlp = min(feasible, key=lambda found: found[0].point.objective, default=(None, None))
    candidates: list[tuple[float, Relaxation]] = []
    for side in sides if not problem.cases else ():
        candidates += islice(_list_known_relaxations(side, limits, designs), 1)
    least, known = min(candidates, key=lambda found: found[0], default=(np.inf, None))
    amounts = _compute_amounts(wide, limits, trial.parameters, nlp.cases) if trial and nlp else {}
    if known and (trial is None or least < sum_amounts(limits, amounts) * (1 - _TIE)):
        return known, None, None
    if trial is None or nlp is None:
        return None, None, None
    return Relaxation(Table(trial.parameters), Table(amounts)), trial, nlp


def find_relaxation_near(
    options: Options, box: Posed, limits: Sequence[Limit], design: Mapping[str, float]
) -> dict[str, float]:
    """Amounts of the least relaxation that this design leads to; {} if it leads to none."""
    trial = _solve_relaxation(box, options, _build_elastic_program(box, box.cases, limits), limits, [design])
    return _compute_amounts(box, limits, trial.parameters, trial.end.nlp.cases) if trial else {}


def _list_known_relaxations(
    side: SearchState, limits: Sequence[Limit], designs: Sequence[Mapping[str, float]]
) -> Iterator[tuple[float, Relaxation]]:
    """Relaxations for known designs and the best sampled design, the least first."""
    known, unlimited = list(designs), _drop_limits(side.problem, limits)
    if sample := POLICY.sample(side):
        known += [*sample.box.designs(sample.box.refine(sample.refined.take_first(1), _FINEST))]
    needs = [(p, _compute_amounts(side.problem, limits, p, ())) for p in map(side.problem.ordered, known)]
    totals = [sum_amounts(limits, amounts) for _, amounts in needs]
    for row in np.argsort(totals, kind="stable").tolist():
        parameters, amounts = needs[row]
        if not recheck(unlimited, parameters).violations:
            yield totals[row], Relaxation(Table(parameters), Table(amounts))


def sum_amounts(limits: Sequence[Limit], amounts: Mapping[str, float]) -> float:
    """Sum of the amounts, each in units of its limit."""
    return sum(abs(amounts.get(limit.name, 0.0)) / limit.scale for limit in limits)


def list_stages(problem: Posed) -> Iterator[tuple[Posed, list[Limit]]]:
    """The problem with the limits to move: first the constraints in its own box, then also the box."""
    constraints = _make_constraint_limits(problem)
    if constraints:
        yield problem, constraints
    yield widen_box(problem, problem.free), [*constraints, *_make_bound_limits(problem)]


def _make_constraint_limits(problem: Posed) -> list[Limit]:
    """Constraints in units of the limit as written, or of the size of the sides if it is 0 or no number."""
    ends = [{n: lo + share * (hi - lo) for n, (lo, hi) in problem.free.items()} for share in (0.5, 0.3)]
    one, other = (problem.values(problem.ordered(design)) for design in ends)
    found: list[Limit] = []
    for name, condition in problem.conditions.items():
        pairs = list(zip(condition.sides(one), condition.sides(other), strict=True))
        written = [abs(a) for a, b in pairs if a == b != 0]
        sides = [abs(a) for a, _ in pairs if np.isfinite(a) and a]
        size = min(written) if written else max(sides, default=1.0)
        found.append(Limit(name, size * (1 + _TIE * len(found))))
    return found


def _make_bound_limits(problem: Posed) -> list[Limit]:
    return [
        Limit(f"{name}.{end}", ends[1] - ends[0], name, ends[k])
        for name, ends in problem.free.items()
        for k, end in enumerate(("min", "max"))
    ]


def widen_box(problem: Posed, names: Collection[str]) -> Posed:
    """The problem with wider ranges of these parameters, inside the physical ones."""
    free = dict(problem.free)
    for name in names:
        lower, upper = problem.free[name]
        physical, width = problem.parameter_set[name].range, upper - lower
        inset = problem.tolerances.get(name, 0.0) + (0.0 if physical.closed else _INSET * min(width, 1.0))
        least, most = lower - _WIDER * width, upper + _WIDER * width
        free[name] = (min(max(least, physical.lower + inset), lower), max(min(most, physical.upper - inset), upper))
    return problem.derive(free=free)


def _find_least_in_cases(
    side: SearchState, limits: Sequence[Limit], listed: Sequence[Case]
) -> tuple[CheckedEnd | None, NLP]:
    """The least relaxation of one part of the box, with cases added until none between them needs more."""
    trial, nlp = _find_least(side, limits, listed)
    movable = [limit for limit in limits if not limit.parameter]
    thorough = side.options.starts >= _MOST_STARTS
    if thorough and trial is not None and trial.point.objective > _NOTHING and len(movable) > 1:
        box = _draw_limit_box(side.part, side.options)
        leads = {tuple(d.values()): d for limit in movable for d in _propose_leads(box, limit.name)}
        again = _solve_relaxation(side.part, side.options, nlp, limits, list(leads.values()))
        if again is not None and again.point.objective < trial.point.objective * (1 - _TIE):
            trial = again
    for _ in range(_ROUNDS if listed else 0):
        if trial is None or not (more := _find_worse_cases(side.problem, limits, trial, nlp.cases)):
            break
        trial, nlp = _find_least(side, limits, (*nlp.cases, *more), trial)
    return trial, nlp


def _find_least(
    side: SearchState, limits: Sequence[Limit], cases: Sequence[Case], before: CheckedEnd | None = None
) -> tuple[CheckedEnd | None, NLP]:
    """The least relaxation that the end `before` leads to, or else a few starts."""
    nlp = _build_elastic_program(side.part, cases, limits)
    trial = _solve_relaxation(side.part, side.options, nlp, limits, [before.parameters]) if before else None
    return trial or _solve_relaxation(side.part, side.options, nlp, limits), nlp


def _solve_relaxation(
    problem: Posed,
    options: Options,
    nlp: NLP,
    limits: Sequence[Limit],
    designs: Sequence[Mapping[str, float]] | None = None,
) -> CheckedEnd | None:
    """The least relaxation from these designs, or from a few starts; None if a fixed limit is violated."""
    state = SearchState(_drop_limits(problem, limits), problem, nlp, options)
    if designs is None:
        state = replace(state, sample=POLICY.sample(state))
        state = run_nested(state, POLICY.starts(state), _RELAXING, min(_MOST_STARTS, options.starts))
    else:
        state = run_nested(state, map(Start, designs), disable_stopping(_RELAXING))
    return state.best if state.best is not None and not state.best.checked.violations else None


def _is_least(state: SearchState) -> bool:
    """Whether nothing must move, or enough starts agree on the least sum."""
    objectives = [end.objective for end in state.feasible]
    best = min(objectives, default=np.inf)
    agreed = sum(same_objective(value, best) for value in objectives) >= _AGREE and len(state.ends) >= 2 * _AGREE
    return best <= _NOTHING or agreed


_RELAXING = replace(POLICY, enough=_is_least)


def _draw_limit_box(problem: Posed, options: Options, extended: Limit | None = None) -> Box:
    """A sample of the box for the limits alone, with a moved end of the box as the objective, if any."""
    goal = {}
    if extended and extended.parameter:
        goal = {"minimize" if extended.name.endswith(".max") else "maximize": extended.parameter}
    return draw_box(problem.derive(locate=None, **goal), options.seed)


def _propose_leads(box: Box, name: str) -> list[dict[str, float]]:
    """Designs that may need only this limit moved; none if the other limits exclude each other."""
    found = box.ignore_limit(name)
    excluded = found.misses_by(box.unreachable if box.problem.pattern else box.tuning.far_off)
    return [] if excluded else [*box.designs(found.take_first(_LEADS))]


def _drop_limits(problem: Posed, limits: Sequence[Limit]) -> Posed:
    """The problem without the constraints that may move."""
    moved = {limit.name for limit in limits}
    kept = {n: c for n, c in problem.constraints.items() if n not in moved}
    return problem.derive(constraints=kept, minimize=None, maximize=None)


def _find_worse_cases(wide: Posed, limits: Sequence[Limit], trial: CheckedEnd, cases: Sequence[Case]) -> list[Case]:
    """Cases between the listed ones in which a design needs more."""
    worst = [w.case for w in find_worst_cases(wide, trial.parameters).values()]
    known, all_ = (_compute_amounts(wide, limits, trial.parameters, c) for c in (cases, (*cases, *worst)))
    grown = any(abs(a) > abs(known.get(n, 0.0)) + FEASIBLE * (1 + abs(a)) for n, a in all_.items())
    return [case for case in worst if case not in cases] if grown else []


def _compute_amounts(
    wide: Posed, limits: Sequence[Limit], parameters: Mapping[str, float], cases: Sequence[Case]
) -> dict[str, float]:
    """The amounts that a design needs, by its own recheck."""
    excess = measure_excesses(wide, parameters, cases)
    needed = {limit.name: (limit.measure_need(parameters, excess), limit.scale) for limit in limits}
    return {
        name: amount * (1 + _ROUND_UP) for name, (amount, scale) in needed.items() if abs(amount) > FEASIBLE * scale
    }


def find_holding_limits(nlp: NLP, limits: Sequence[Limit], trial: CheckedEnd) -> list[str]:
    """Limits with a multiplier: without one of them, less would suffice."""
    scales = {limit.name: limit.scale for limit in limits}
    rows = zip(nlp.rows, trial.point.row_multipliers.tolist(), strict=True)
    names = [row for row, multiplier in rows if row in scales and abs(multiplier) * scales[row] > _ACTIVE]
    for k, name in enumerate(trial.end.nlp.variables):
        multiplier = float(trial.point.bound_multipliers[k])
        parameter = name.removeprefix("tan(").removesuffix(")")
        width = trial.end.nlp.upper[k] - trial.end.nlp.lower[k]
        if parameter in trial.parameters and abs(multiplier) * width > _ACTIVE:
            names.append(f"{parameter}.{'max' if multiplier > 0 else 'min'}")
    return names


def relax_each_alone(
    problem: Posed, options: Options, conflict: Sequence[str], trial: CheckedEnd, cases: Sequence[Case]
) -> dict[str, float]:
    """How far each limit of a conflict must move if no other does; limits that cannot help alone are left out."""
    limits = {limit.name: limit for limit in (*_make_constraint_limits(problem), *_make_bound_limits(problem))}
    found: dict[str, float] = {}
    for limit in (limits[name] for name in conflict):
        wide = widen_box(problem, [limit.parameter] if limit.parameter else [])
        if not (leads := _propose_leads(_draw_limit_box(wide, options, limit), limit.name)):
            continue
        here = clip_to_box(wide, trial.parameters)
        end = _solve_relaxation(wide, options, _build_elastic_program(wide, cases, [limit]), [limit], [here, *leads])
        if end is not None:
            found |= _compute_amounts(wide, [limit], end.parameters, end.end.nlp.cases)
    return found


def _build_elastic_program(wide: Posed, cases: Sequence[Case], limits: Sequence[Limit]) -> NLP:
    """Minimise Σ slack/scale with each limit moved by its slack, all others kept."""
    nlp = formulate(wide, cases, elastic=True)
    names = [limit.name for limit in limits]
    inputs = [symbol(variable_name(k)) for k in range(len(nlp.variables) + len(limits))]
    x, slack = inputs[: len(nlp.variables)], inputs[len(nlp.variables) :]
    _, *g = fold(nlp.formula, {n: symbol(n) for n in nlp.formula.names}, NODES)
    rows: list[tuple[str, Any, float, float]] = []
    second: list[tuple[str, Any, float, float]] = []  # last, because touches and kinks refer to rows by number
    for k, name in enumerate(nlp.rows):
        lower, upper = nlp.row_lower[k], nlp.row_upper[k]
        if name not in names:
            rows.append((name, g[k], lower, upper))
            continue
        s = slack[names.index(name)]
        moved = [(name, g[k] - s, -np.inf, upper)] if np.isfinite(upper) else []
        moved += [(name, g[k] + s, lower, np.inf)] if np.isfinite(lower) else []
        rows.append(moved[0])
        second += moved[1:]
    rows += second
    for number, limit in enumerate(limits):
        if limit.parameter:
            at = list(wide.free).index(limit.parameter)
            value = atan(x[at]) if wide.parameter_set[limit.parameter].tangent else x[at]
            most = limit.name.endswith(".max")
            ends = (-np.inf, limit.end) if most else (limit.end, np.inf)
            rows.append((limit.name, value - slack[number] if most else value + slack[number], *ends))
    objective = sum(slack[k] / limit.scale for k, limit in enumerate(limits))
    return replace(
        nlp,
        formulation="elastic",
        variables=(*nlp.variables, *(f"slack of {n}" for n in names)),
        formula=formula([objective, *(r[1] for r in rows)], (*(x.value for x in inputs), *nlp.numbers)),
        lower=(*nlp.lower, *(0.0 for _ in names)),
        upper=(*nlp.upper, *(np.inf for _ in names)),
        rows=tuple(r[0] for r in rows),
        row_lower=tuple(r[2] for r in rows),
        row_upper=tuple(r[3] for r in rows),
        lifts=(*nlp.lifts, AddedVariable("slack", len(names), partial(_guess_slack, wide, names))),
    )


def _guess_slack(wide: Posed, names: Sequence[str], values: Sequence[Values], z: Any) -> list[list[float]]:
    """Initial slacks: what a design needs, and a little more."""
    found = []
    for name in names:
        condition = wide.conditions.get(name)
        differences = [abs(float(condition(v))) for v in values] if condition else [0.0]
        found.append(max((d for d in differences if np.isfinite(d)), default=1.0) + 1e-3)
    return [found]
