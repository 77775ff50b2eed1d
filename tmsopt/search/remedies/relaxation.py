"""The least change of limits that makes an infeasible problem feasible."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tmsopt.algebra import NODES, fold
from tmsopt.algebra.formula import formula, symbol
from tmsopt.algebra.kinds import atan
from tmsopt.evaluation import find_worst_cases
from tmsopt.evaluation.recheck import FEASIBILITY_TOLERANCE, measure_excesses, recheck
from tmsopt.models import Values
from tmsopt.problem import Case, Posed, Relaxation
from tmsopt.program import NLP, Options
from tmsopt.program.formulate import formulate
from tmsopt.program.nlp import AddedVariable, variable_name
from tmsopt.records import Table
from tmsopt.search.policy import disable_stopping, run_nested
from tmsopt.search.sample import Box, Sample, draw_box
from tmsopt.search.search import POLICY
from tmsopt.search.state import CheckedEnd, SearchState, Start, begin_search, clip_to_box, same_objective

_MAX_ROUNDS = 12  # times that cases are added
_MAX_STARTS = 8  # starts of the search for a relaxation
_SINGLE_LIMIT_STARTS = 2  # sampled designs from which the relaxation of a single limit starts
_AGREEING_STARTS = 3  # starts that must end at the best value before the search may end
_TIE = 1e-3  # relative difference of the scales of equal limits, so that one of them moves instead of each by half
_MAX_WIDENING = 3.0  # widths of a range by which its ends may move
_INSET = 1e-3  # relative to a width: distance kept from an excluded end of a physical range
_MIN_MULTIPLIER = 1e-5  # per scale of a limit, or width of a range: a limit with a smaller multiplier is not active
_ZERO_SUM = 1e-12  # sum of amounts below which the problem is feasible
_FINE_STEPS = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8)  # relative to the box: step sizes that refine the best sampled design
_ROUND_UP = 1e-12  # relative increase of an amount, so that the design is inside the relaxed limits


@dataclass(frozen=True)
class Limit:
    """A constraint, or an end of a free parameter's range such as ``Fr.max``, that a relaxation may move.

    Attributes:
        scale: the amount that counts as 1 in sums.
        parameter: the parameter, if the limit is an end of a range; empty for a constraint.
        end: value of the end of the range; 0 for a constraint.
        is_upper: whether this is the upper end.
    """

    name: str
    scale: float
    parameter: str = ""
    end: float = 0.0
    is_upper: bool = False


@dataclass(frozen=True)
class ElasticProblem:
    """A problem in which some limits may move; the sum of the amounts, each in units of its scale, is minimised.

    Attributes:
        problem: the problem in the box that is searched.
        limits: limits that may move; all others stay.
        sample: sample of the box, to start from.
    """

    problem: Posed
    limits: Sequence[Limit]
    options: Options
    sample: Sample | None = None

    def find_least_relaxation(
        self, designs: Sequence[Mapping[str, float]] = ()
    ) -> tuple[Relaxation, CheckedEnd | None] | tuple[None, None]:
        """Return the least relaxation, and its end unless it is from a known design; (None, None) if there is none."""
        states = begin_search(self.problem, self.options)
        parts = [replace(self, problem=state.part, sample=POLICY.sample(state)) for state in states]
        ends = [end for part in parts if (end := part._find_least_in_cases())]
        trial = min(ends, key=lambda end: end.point.objective, default=None)
        candidates = (
            []
            if self.problem.cases
            else [candidate for part in parts if (candidate := part._relax_known_designs(designs))]
        )
        least_sum, relaxation = min(candidates, key=lambda candidate: candidate[0], default=(np.inf, None))
        amounts = self._compute_amounts(trial.parameters, trial.end.nlp.cases) if trial else {}
        if relaxation and (trial is None or least_sum < self.sum_amounts(amounts) * (1 - _TIE)):
            return relaxation, None
        return (Relaxation(Table(trial.parameters), Table(amounts)), trial) if trial else (None, None)

    def find_amounts(
        self, designs: Sequence[Mapping[str, float]], cases: Sequence[Case] | None = None
    ) -> dict[str, float]:
        """Return the amounts of the least relaxation to which these designs lead; {} if they lead to none."""
        nlp = self._build_program(self.problem.cases if cases is None else cases)
        trial = self._solve(nlp, designs)
        return self._compute_amounts(trial.parameters, nlp.cases) if trial else {}

    def sum_amounts(self, amounts: Mapping[str, float]) -> float:
        """Sum the amounts, each in units of its limit's scale."""
        return sum(abs(amounts.get(limit.name, 0.0)) / limit.scale for limit in self.limits)

    def list_active_limits(self, trial: CheckedEnd) -> list[str]:
        """List the limits with a nonzero multiplier: without any of these, smaller amounts would suffice."""
        scales, nlp = {limit.name: limit.scale for limit in self.limits}, trial.end.nlp
        rows = zip(nlp.rows, trial.point.row_multipliers.tolist(), strict=True)
        names = [row for row, multiplier in rows if row in scales and abs(multiplier) * scales[row] > _MIN_MULTIPLIER]
        bounds = zip(nlp.variables, trial.point.bound_multipliers.tolist(), nlp.lower, nlp.upper, strict=True)
        for variable, multiplier, lower, upper in bounds:
            parameter = variable.removeprefix("tan(").removesuffix(")")
            if parameter in trial.parameters and abs(multiplier) * (upper - lower) > _MIN_MULTIPLIER:
                names.append(f"{parameter}.{'max' if multiplier > 0 else 'min'}")
        return names

    def _find_least_in_cases(self) -> CheckedEnd | None:
        """Find the least relaxation of one part of the box; add cases until no case needs larger amounts."""
        cases = self.problem.cases
        trial = self._solve(self._build_program(cases))
        movable = [limit for limit in self.limits if not limit.parameter]
        if trial and self.options.starts >= _MAX_STARTS and trial.point.objective > _ZERO_SUM and len(movable) > 1:
            box = draw_box(self.problem.derive(locate=None), self.options.seed)
            start_designs = {tuple(d.values()): d for limit in movable for d in _propose_designs(box, limit.name)}
            second_trial = self._solve(trial.end.nlp, list(start_designs.values()))
            if second_trial and second_trial.point.objective < trial.point.objective * (1 - _TIE):
                trial = second_trial
        for _ in range(_MAX_ROUNDS if cases else 0):
            if trial is None or not (new_cases := self._find_worse_cases(trial)):
                break
            nlp = self._build_program((*trial.end.nlp.cases, *new_cases))
            trial = self._solve(nlp, [trial.parameters]) or self._solve(nlp)
        return trial

    def _solve(self, nlp: NLP, designs: Sequence[Mapping[str, float]] | None = None) -> CheckedEnd | None:
        """Find the least relaxation from these designs, or from a few starts; None if it violates a fixed limit."""
        state = SearchState(self._drop_limits(), self.problem, nlp, self.options)
        if designs is None:
            state = replace(state, sample=self.sample)
            state = run_nested(state, POLICY.starts(state), _RELAXATION_POLICY, min(_MAX_STARTS, self.options.starts))
        else:
            state = run_nested(state, map(Start, designs), disable_stopping(_RELAXATION_POLICY))
        return state.best if state.best is not None and not state.best.checked.violations else None

    def _relax_known_designs(self, designs: Sequence[Mapping[str, float]]) -> tuple[float, Relaxation] | None:
        """Return the least sum of amounts among known designs and the best sampled design, with its relaxation."""
        candidates, fixed_problem, sample = list(designs), self._drop_limits(), self.sample
        if sample:
            candidates += sample.box.designs(sample.box.refine(sample.refined.take_first(1), _FINE_STEPS))
        designs_with_amounts = [(p, self._compute_amounts(p, ())) for p in map(self.problem.ordered, candidates)]
        for parameters, amounts in sorted(designs_with_amounts, key=lambda pair: self.sum_amounts(pair[1])):
            if not recheck(fixed_problem, parameters).violations:
                return self.sum_amounts(amounts), Relaxation(Table(parameters), Table(amounts))
        return None

    def _drop_limits(self) -> Posed:
        """Return the problem without its objective and without the constraints that may move."""
        movable_names = {limit.name for limit in self.limits}
        constraints = {n: c for n, c in self.problem.constraints.items() if n not in movable_names}
        return self.problem.derive(constraints=constraints, minimize=None, maximize=None)

    def _find_worse_cases(self, trial: CheckedEnd) -> list[Case]:
        """Find cases between the listed ones in which a design needs larger amounts."""
        cases = trial.end.nlp.cases
        worst = [w.case for w in find_worst_cases(self.problem, trial.parameters).values()]
        amounts, needed = (self._compute_amounts(trial.parameters, c) for c in (cases, (*cases, *worst)))
        has_grown = any(
            abs(a) > abs(amounts.get(n, 0.0)) + FEASIBILITY_TOLERANCE * (1 + abs(a)) for n, a in needed.items()
        )
        return [case for case in worst if case not in cases] if has_grown else []

    def _compute_amounts(self, parameters: Mapping[str, float], cases: Sequence[Case]) -> dict[str, float]:
        """Recheck a design and return the amounts that it needs."""
        needed = measure_excesses(self.problem, parameters, cases)
        for limit in self.limits:
            if limit.parameter:
                excess = parameters[limit.parameter] - limit.end
                needed[limit.name] = max(excess if limit.is_upper else -excess, 0.0)
        amounts = {limit: needed.get(limit.name, 0.0) for limit in self.limits}
        return {k.name: a * (1 + _ROUND_UP) for k, a in amounts.items() if abs(a) > FEASIBILITY_TOLERANCE * k.scale}

    def _build_program(self, cases: Sequence[Case]) -> NLP:
        """Build the program that minimises Σ slack/scale: each limit moves by its slack, all others stay."""
        nlp = formulate(self.problem, cases, elastic=True)
        names = [limit.name for limit in self.limits]
        slack_names = [variable_name(len(nlp.variables) + k) for k in range(len(names))]
        slacks = dict(zip(names, map(symbol, slack_names), strict=True))
        _, *g = fold(nlp.formula, {n: symbol(n) for n in nlp.formula.names}, NODES)
        rows: list[tuple[str, Any, float, float]] = []
        later_rows: list[tuple[str, Any, float, float]] = []  # last, because contacts and kinks refer to rows by index
        for name, value, lower, upper in zip(nlp.rows, g, nlp.row_lower, nlp.row_upper, strict=True):
            if name not in slacks:
                rows.append((name, value, lower, upper))
                continue
            sides = [(name, value - slacks[name], -np.inf, upper), (name, value + slacks[name], lower, np.inf)]
            row, *other_rows = [row for row in sides if np.any(np.isfinite(row[2:]))]
            rows.append(row)
            later_rows += other_rows
        rows += later_rows
        for limit in self.limits:
            if limit.parameter:
                value = symbol(nlp.inputs[list(self.problem.free).index(limit.parameter)])
                if self.problem.parameter_set[limit.parameter].tangent:
                    value = atan(value)
                slack, ends = slacks[limit.name], (-np.inf, limit.end) if limit.is_upper else (limit.end, np.inf)
                rows.append((limit.name, value - slack if limit.is_upper else value + slack, *ends))
        objective = sum(slacks[limit.name] / limit.scale for limit in self.limits)
        row_names, values, row_lower, row_upper = zip(*rows, strict=True)
        return replace(
            nlp,
            formulation="elastic",
            variables=(*nlp.variables, *(f"slack of {n}" for n in names)),
            formula=formula([objective, *values], (*nlp.inputs, *slack_names, *nlp.numbers)),
            lower=(*nlp.lower, *[0.0] * len(names)),
            upper=(*nlp.upper, *[np.inf] * len(names)),
            rows=row_names,
            row_lower=row_lower,
            row_upper=row_upper,
            lifts=(*nlp.lifts, AddedVariable("slack", len(names), self._guess_slacks)),
        )

    def _guess_slacks(self, values: Sequence[Values], z: Any) -> list[list[float]]:
        """Guess initial slacks: the amounts that a design needs, and a little more."""
        slacks = []
        for limit in self.limits:
            condition = self.problem.conditions.get(limit.name)
            differences = [abs(float(condition(v))) for v in values] if condition else [0.0]
            slacks.append(max(filter(np.isfinite, differences), default=1.0) + 1e-3)
        return [slacks]


def list_stages(problem: Posed, options: Options) -> Iterator[ElasticProblem]:
    """Yield the problem with the limits that may move: first its constraints, then its constraints and its box."""
    constraints = _make_constraint_limits(problem)
    if constraints:
        yield ElasticProblem(problem, constraints, options)
    yield ElasticProblem(widen_box(problem, problem.free), [*constraints, *_make_bound_limits(problem)], options)


def _make_constraint_limits(problem: Posed) -> list[Limit]:
    """Make limits of the constraints; the scale is the written limit, or the size of a side if it is 0 or no number."""
    designs = [{n: lo + share * (hi - lo) for n, (lo, hi) in problem.free.items()} for share in (0.5, 0.3)]
    values, other_values = (problem.values(problem.ordered(design)) for design in designs)
    limits: list[Limit] = []
    for name, condition in problem.conditions.items():
        pairs = list(zip(condition.sides(values), condition.sides(other_values), strict=True))
        constant_sides = [abs(a) for a, b in pairs if a == b != 0]
        sides = [abs(a) for a, _ in pairs if np.isfinite(a) and a]
        size = min(constant_sides) if constant_sides else max(sides, default=1.0)
        limits.append(Limit(name, size * (1 + _TIE * len(limits))))
    return limits


def _make_bound_limits(problem: Posed) -> list[Limit]:
    return [
        Limit(f"{name}.{'max' if is_upper else 'min'}", ends[1] - ends[0], name, ends[is_upper], is_upper)
        for name, ends in problem.free.items()
        for is_upper in (False, True)
    ]


def widen_box(problem: Posed, names: Collection[str]) -> Posed:
    """Return the problem with wider ranges of these parameters, inside the physical ranges."""
    free = dict(problem.free)
    for name in names:
        lower, upper = problem.free[name]
        physical, width = problem.parameter_set[name].range, upper - lower
        inset = problem.tolerances.get(name, 0.0) + (0.0 if physical.closed else _INSET * min(width, 1.0))
        low, high = lower - _MAX_WIDENING * width, upper + _MAX_WIDENING * width
        free[name] = (min(max(low, physical.lower + inset), lower), max(min(high, physical.upper - inset), upper))
    return problem.derive(free=free)


def relax_each_alone(problem: Posed, options: Options, conflict: Sequence[str], trial: CheckedEnd) -> dict[str, float]:
    """Return how far each limit of a conflict must move if no other moves; omit limits for which no move is enough."""
    limits = {limit.name: limit for limit in (*_make_constraint_limits(problem), *_make_bound_limits(problem))}
    amounts: dict[str, float] = {}
    for limit in (limits[name] for name in conflict):
        wide_problem = widen_box(problem, [limit.parameter] if limit.parameter else [])
        goal = {"minimize" if limit.is_upper else "maximize": limit.parameter} if limit.parameter else {}
        if start_designs := _propose_designs(
            draw_box(wide_problem.derive(locate=None, **goal), options.seed), limit.name
        ):
            designs = [clip_to_box(wide_problem, trial.parameters), *start_designs]
            amounts |= ElasticProblem(wide_problem, [limit], options).find_amounts(designs, trial.end.nlp.cases)
    return amounts


def _propose_designs(box: Box, name: str) -> list[dict[str, float]]:
    """Propose designs that may need a move of this limit only; none if the other limits exclude each other."""
    batch = box.ignore_limit(name)
    return [] if batch.all_violate_by(box.tuning.far_excess) else [*box.designs(batch.take_first(_SINGLE_LIMIT_STARTS))]


def _has_least_sum(state: SearchState) -> bool:
    """Whether no limit must move, or enough starts agree on the least sum."""
    objectives = [end.objective for end in state.feasible]
    best = min(objectives, default=np.inf)
    best_count = sum(same_objective(value, best) for value in objectives)
    return best <= _ZERO_SUM or (best_count >= _AGREEING_STARTS and len(state.ends) >= 2 * _AGREEING_STARTS)


_RELAXATION_POLICY = replace(POLICY, enough=_has_least_sum)
