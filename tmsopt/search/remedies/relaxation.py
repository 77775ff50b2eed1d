"""The least by which limits of a problem without an answer must be moved for a design that meets them."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from typing import Any

import numpy as np

from tmsopt.algebra.formula import fold, formula, symbol
from tmsopt.algebra.kinds import NODES, atan
from tmsopt.evaluation.recheck import FEASIBLE, excesses, recheck
from tmsopt.evaluation.worst_case import worst_cases
from tmsopt.models import Values
from tmsopt.problem.advice.remedies import Relaxation
from tmsopt.problem.cases import Case
from tmsopt.problem.problem import Posed
from tmsopt.program.formulate import formulate
from tmsopt.program.nlp import NLP, AddedVariable, variable_name
from tmsopt.program.options import Options
from tmsopt.records import Table
from tmsopt.search.accept import accept_best
from tmsopt.search.policy import try_all, try_starts
from tmsopt.search.sample import Box, draw_box
from tmsopt.search.search import POLICY
from tmsopt.search.state import CheckedEnd, SearchState, Start, begin_search, same_objective

_ROUNDS = 12  # times that cases are added
_TRIED = 8  # starts of a relaxation at most
_LED = 2  # starts for one limit alone
_AGREE = 3  # of them at the best value that end it
_TIE = 1e-3  # of a scale, by which equal limits differ: one moved is easier to read than two moved by halves
_WIDER = 3.0  # widths of the box by which its bounds may give way
_INSET = 1e-3  # share of the width kept from a physical end that is excluded
_HOLDS = 1e-5  # multiplier, per scale or width of the box, above which a limit takes part in the conflict
_NOTHING = 1e-12  # sum of amounts at which the problem is feasible as it is
_FINEST = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8)  # of the box: steps that improve a design that is kept as it is
_ROUND_UP = 1e-12  # of an amount, so that the relaxed design is inside


@dataclass(frozen=True)
class Limit:
    """A constraint, or an end of a free parameter's range such as ``Fr.max``, that a relaxation may move.

    Attributes:
        scale: the amount that counts as 1 when amounts are added up.
        parameter, end: of an end of a range, whose it is and where it lies.
    """

    name: str
    scale: float
    parameter: str = ""
    end: float = 0.0

    def needed(self, parameters: Mapping[str, float], excess: Mapping[str, float]) -> float:
        """By how much the limit must be moved for a design."""
        if not self.parameter:
            return excess.get(self.name, 0.0)
        beyond = parameters[self.parameter] - self.end
        return max(beyond if self.name.endswith(".max") else -beyond, 0.0)


def least_relaxation(
    problem: Posed,
    options: Options,
    wide: Posed,
    limits: Sequence[Limit],
    designs: Sequence[Mapping[str, float]] = (),
) -> tuple[Relaxation, CheckedEnd | None, NLP | None] | tuple[None, None, None]:
    """The least relaxation in a box, with where it ended; without, for a design that was met on the way."""
    listed = problem.cases
    sides = begin_search(wide, options)
    ended = [_least_covered(side, limits, listed) for side in sides]
    reached = [(trial, nlp) for trial, nlp in ended if trial is not None]
    trial, nlp = min(reached, key=lambda found: found[0].point.objective, default=(None, None))
    met = [] if listed else [found for side in sides for found in islice(_met(side, limits, designs), 1)]
    least, seen = min(met, key=lambda found: found[0], default=(np.inf, None))
    amounts = _amounts(wide, limits, trial.parameters, nlp.cases) if trial and nlp else {}
    if seen and (trial is None or least < total(limits, amounts) * (1 - _TIE)):
        return seen, None, None
    if trial is None or nlp is None:
        return None, None, None
    return Relaxation(Table(trial.parameters), Table(amounts)), trial, nlp


def least_near(options: Options, box: Posed, limits: Sequence[Limit], design: Mapping[str, float]) -> dict[str, float]:
    """How far limits must be moved for the nearest design that this one leads to; {} where it leads to none."""
    trial = _relaxed(box, options, _elastic(box, box.cases, limits), limits, [design])
    return _amounts(box, limits, trial.parameters, trial.end.nlp.cases) if trial else {}


def _met(
    side: SearchState, limits: Sequence[Limit], designs: Sequence[Mapping[str, float]]
) -> Iterator[tuple[float, Relaxation]]:
    """What designs met on the way need, and the least violating one of a sample; those least in need first."""
    known, unlimited = list(designs), _unlimited(side.problem, limits)
    if sample := POLICY.sample(side):
        known += [*sample.box.designs(sample.box.refine(sample.refined.first(1), _FINEST))]
    needs = [(p, _amounts(side.problem, limits, p, ())) for p in map(side.problem.ordered, known)]
    totals = [total(limits, amounts) for _, amounts in needs]
    for row in np.argsort(totals, kind="stable").tolist():
        parameters, amounts = needs[row]
        if not recheck(unlimited, parameters).violations:
            yield totals[row], Relaxation(Table(parameters), Table(amounts))


def total(limits: Sequence[Limit], amounts: Mapping[str, float]) -> float:
    """Amounts added up, each in units of its limit."""
    return sum(abs(amounts.get(limit.name, 0.0)) / limit.scale for limit in limits)


def stages(problem: Posed) -> Iterator[tuple[Posed, list[Limit]]]:
    """The problem with limits to move: the constraints in its own box, then also the box."""
    constraints = _constraint_limits(problem)
    if constraints:
        yield problem, constraints
    yield widened(problem, problem.free), [*constraints, *_bound_limits(problem)]


def _constraint_limits(problem: Posed) -> list[Limit]:
    """Constraints in units of the limit as written, or of the size of the sides where it is 0 or no number."""
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


def _bound_limits(problem: Posed) -> list[Limit]:
    return [
        Limit(f"{name}.{end}", ends[1] - ends[0], name, ends[k])
        for name, ends in problem.free.items()
        for k, end in enumerate(("min", "max"))
    ]


def widened(problem: Posed, names: Collection[str]) -> Posed:
    """The problem in a larger box, inside what is physical."""
    free = dict(problem.free)
    for name in names:
        lower, upper = problem.free[name]
        physical, width = problem.parameter_set[name].range, upper - lower
        inset = problem.tolerances.get(name, 0.0) + (0.0 if physical.closed else _INSET * min(width, 1.0))
        least, most = lower - _WIDER * width, upper + _WIDER * width
        free[name] = (min(max(least, physical.lower + inset), lower), max(min(most, physical.upper - inset), upper))
    return problem.derive(free=free)


def _least_covered(side: SearchState, limits: Sequence[Limit], listed: Sequence[Case]) -> tuple[CheckedEnd | None, NLP]:
    """The least relaxation of one part of the box, with cases added until none between them needs more."""
    trial, nlp = _least(side, limits, listed)
    movable = [limit for limit in limits if not limit.parameter]
    thorough = side.options.starts >= _TRIED
    if thorough and trial is not None and trial.point.objective > _NOTHING and len(movable) > 1:
        box = _box(side.part, side.options)
        leads = {tuple(d.values()): d for limit in movable for d in _leads(box, limit.name)}
        again = _relaxed(side.part, side.options, nlp, limits, list(leads.values()))
        if again is not None and again.point.objective < trial.point.objective * (1 - _TIE):
            trial = again
    for _ in range(_ROUNDS if listed else 0):
        if trial is None or not (more := _beyond(side.problem, limits, trial, nlp.cases)):
            break
        trial, nlp = _least(side, limits, (*nlp.cases, *more), trial)
    return trial, nlp


def _least(
    side: SearchState, limits: Sequence[Limit], cases: Sequence[Case], before: CheckedEnd | None = None
) -> tuple[CheckedEnd | None, NLP]:
    """The design with the least weighted sum of amounts that a few starts reach, or the one `before` leads to."""
    nlp = _elastic(side.part, cases, limits)
    trial = _relaxed(side.part, side.options, nlp, limits, [before.parameters]) if before else None
    return trial or _relaxed(side.part, side.options, nlp, limits), nlp


def _relaxed(
    problem: Posed,
    options: Options,
    nlp: NLP,
    limits: Sequence[Limit],
    designs: Sequence[Mapping[str, float]] | None = None,
) -> CheckedEnd | None:
    """The least relaxation that these designs lead to, or a few of the sample, if all that may not move is met."""
    state = SearchState(_unlimited(problem, limits), problem, nlp, options)
    if designs is None:
        state = replace(state, sample=POLICY.sample(state))
        state = try_starts(state, POLICY.starts(state), _RELAXING, min(_TRIED, options.starts))
    else:
        state = try_starts(state, map(Start, designs), try_all(_RELAXING))
    if state.interrupted:
        raise KeyboardInterrupt
    trial = accept_best(state).best
    return trial if trial is not None and not trial.checked.violations else None


def _is_least(state: SearchState) -> bool:
    """Whether nothing has to give, or enough starts agree on what has."""
    objectives = [end.objective for end in state.feasible]
    best = min(objectives, default=np.inf)
    agreed = sum(same_objective(value, best) for value in objectives) >= _AGREE and len(state.ends) >= 2 * _AGREE
    return best <= _NOTHING or agreed


_RELAXING = replace(POLICY, enough=_is_least)


def _box(problem: Posed, options: Options, extended: Limit | None = None) -> Box:
    """A place to look at designs for their limits alone, and for how far one end of the box must be moved."""
    asked = problem.derive(locate=None)
    if extended and extended.parameter and extended.name.endswith(".max"):
        asked = asked.derive(minimize=extended.parameter)
    elif extended and extended.parameter:
        asked = asked.derive(maximize=extended.parameter)
    return draw_box(asked, options.seed)


def _leads(box: Box, name: str) -> list[dict[str, float]]:
    """Designs that may do with one limit moved, as far as it takes; none where the others exclude each other."""
    found = box.without(name)
    excluded = found.misses_by(box.unreachable if box.problem.pattern else box.tuning.far_off)
    return [] if excluded else [*box.designs(found.first(_LED))]


def _unlimited(problem: Posed, limits: Sequence[Limit]) -> Posed:
    """The same without the constraints that may move, whose violation is the point of it."""
    moved = {limit.name for limit in limits}
    kept = {n: c for n, c in problem.constraints.items() if n not in moved}
    return problem.derive(constraints=kept, minimize=None, maximize=None)


def _beyond(wide: Posed, limits: Sequence[Limit], trial: CheckedEnd, cases: Sequence[Case]) -> list[Case]:
    """Cases between those listed in which a design needs more."""
    worst = [w.case for w in worst_cases(wide, trial.parameters).values()]
    known, all_ = (_amounts(wide, limits, trial.parameters, c) for c in (cases, (*cases, *worst)))
    grown = any(abs(a) > abs(known.get(n, 0.0)) + FEASIBLE * (1 + abs(a)) for n, a in all_.items())
    return [case for case in worst if case not in cases] if grown else []


def _amounts(
    wide: Posed, limits: Sequence[Limit], parameters: Mapping[str, float], cases: Sequence[Case]
) -> dict[str, float]:
    """What the design itself needs, whatever the solver claims."""
    excess = excesses(wide, parameters, cases)
    needed = {limit.name: (limit.needed(parameters, excess), limit.scale) for limit in limits}
    return {
        name: amount * (1 + _ROUND_UP) for name, (amount, scale) in needed.items() if abs(amount) > FEASIBLE * scale
    }


def holding(nlp: NLP, limits: Sequence[Limit], trial: CheckedEnd) -> list[str]:
    """Limits with a multiplier: were one of them not there, less would do."""
    scales = {limit.name: limit.scale for limit in limits}
    rows = zip(nlp.rows, trial.point.row_multipliers.tolist(), strict=True)
    names = [row for row, multiplier in rows if row in scales and abs(multiplier) * scales[row] > _HOLDS]
    for k, name in enumerate(trial.end.nlp.variables):
        multiplier = float(trial.point.bound_multipliers[k])
        parameter = name.removeprefix("tan(").removesuffix(")")
        width = trial.end.nlp.upper[k] - trial.end.nlp.lower[k]
        if parameter in trial.parameters and abs(multiplier) * width > _HOLDS:
            names.append(f"{parameter}.{'max' if multiplier > 0 else 'min'}")
    return names


def alone(
    problem: Posed, options: Options, conflict: Sequence[str], trial: CheckedEnd, cases: Sequence[Case]
) -> dict[str, float]:
    """How far each limit of a conflict must be moved if nothing else is; those that cannot do it alone are left out."""
    limits = {limit.name: limit for limit in (*_constraint_limits(problem), *_bound_limits(problem))}
    found: dict[str, float] = {}
    for limit in (limits[name] for name in conflict):
        wide = widened(problem, [limit.parameter] if limit.parameter else [])
        if not (leads := _leads(_box(wide, options, limit), limit.name)):
            continue
        here = {n: min(max(trial.parameters[n], lo), hi) for n, (lo, hi) in wide.free.items()}
        ended = _relaxed(wide, options, _elastic(wide, cases, [limit]), [limit], [here, *leads])
        if ended is not None:
            found |= _amounts(wide, [limit], ended.parameters, ended.end.nlp.cases)
    return found


def _elastic(wide: Posed, cases: Sequence[Case], limits: Sequence[Limit]) -> NLP:
    """minimise Σ slack / scale, with each limit moved by its slack; everything else holds."""
    nlp = formulate(wide, cases, elastic=True)
    names = [limit.name for limit in limits]
    inputs = [symbol(variable_name(k)) for k in range(len(nlp.variables) + len(limits))]
    x, slack = inputs[: len(nlp.variables)], inputs[len(nlp.variables) :]
    _, *g = fold(nlp.formula, {n: symbol(n) for n in nlp.formula.names}, NODES)
    rows: list[tuple[str, Any, float, float]] = []
    second: list[tuple[str, Any, float, float]] = []  # after all others, whose numbers touches and kinks know
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
        lifts=(*nlp.lifts, AddedVariable("slack", len(names), partial(_slack_guess, wide, names))),
    )


def _slack_guess(wide: Posed, names: Sequence[str], values: Sequence[Values], z: Any) -> list[list[float]]:
    """What a design needs, and a little more."""
    found = []
    for name in names:
        condition = wide.conditions.get(name)
        differences = [abs(float(condition(v))) for v in values] if condition else [0.0]
        found.append(max((d for d in differences if np.isfinite(d)), default=1.0) + 1e-3)
    return [found]
