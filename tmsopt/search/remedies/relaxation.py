"""The least by which limits of a problem without an answer must be moved for a design that meets them."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from typing import Any

import numpy as np

from tmsopt.algebra.formula import fold, formula, symbol
from tmsopt.algebra.kinds import NODES, atan
from tmsopt.evaluation.recheck import FEASIBLE, excesses
from tmsopt.evaluation.worst_case import worst_cases
from tmsopt.models import Values
from tmsopt.problem.advice.remedies import Relaxation
from tmsopt.problem.cases import Case
from tmsopt.problem.problem import Posed
from tmsopt.program.formulate import design_of, formulate
from tmsopt.program.nlp import NLP, AddedVariable, name_of
from tmsopt.records import Table
from tmsopt.search.basins.leaders import starting
from tmsopt.search.multistart import Runner, same_objective
from tmsopt.search.outcome import CheckedEnd, best_checked
from tmsopt.search.sample import Sampler
from tmsopt.search.workspace import LocalEnd, Workspace, workspace

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
    work: Workspace, wide: Posed, limits: Sequence[Limit]
) -> tuple[Relaxation, CheckedEnd | None, NLP | None] | tuple[None, None, None]:
    """The least relaxation in a box, with where it ended; without, for a design that was met on the way."""
    options, listed = work.options, work.problem.cases
    sides = [workspace(part.part, options) for part in workspace(wide, options).parts()]
    ended = [_least_covered(side, limits, listed) for side in sides]
    reached = [(trial, nlp) for trial, nlp in ended if trial is not None]
    trial, nlp = min(reached, key=lambda found: found[0].point.objective, default=(None, None))
    met = [] if listed else [found for side in sides for found in islice(_met(work, side, limits), 1)]
    least, seen = min(met, key=lambda found: found[0], default=(np.inf, None))
    amounts = _amounts(wide, limits, trial.parameters, nlp.cases) if trial and nlp else {}
    if seen and (trial is None or least < total(limits, amounts) * (1 - _TIE)):
        return seen, None, None
    if trial is None or nlp is None:
        return None, None, None
    return Relaxation(Table(trial.parameters), Table(amounts)), trial, nlp


def least_near(work: Workspace, box: Posed, limits: Sequence[Limit], design: Mapping[str, float]) -> dict[str, float]:
    """How far limits must be moved for the nearest design that this one leads to; {} where it leads to none."""
    side, nlp = workspace(box, work.options), _elastic(box, box.cases, limits)
    trial = best_checked(
        _unlimited(side, limits), nlp, [Runner(side, nlp).solve_from(design, near=True, hopeful=False)]
    )
    met = trial is not None and not trial.checked.violations
    return _amounts(box, limits, trial.parameters, nlp.cases) if trial and met else {}


def _met(work: Workspace, side: Workspace, limits: Sequence[Limit]) -> Iterator[tuple[float, Relaxation]]:
    """What designs need that were met on the way: the least violating one looked at, and where starts ended.

    Those that need least come first.
    """
    designs = [design_of(work.problem, end.run.x.tolist()) for _, end in work.met if np.all(np.isfinite(end.run.x))]
    unlimited = _unlimited(side, limits)
    if side.sampler and side.sample:
        refined = side.sampler.refined(side.sample.refined.take(np.arange(1)), _FINEST)
        designs.append(side.sampler.design(refined, 0))
    needs = [(p, _amounts(side.problem, limits, p, ())) for p in map(side.problem.ordered, designs)]
    totals = [total(limits, amounts) for _, amounts in needs]
    for row in np.argsort(totals, kind="stable").tolist():
        parameters, amounts = needs[row]
        if not unlimited.recheck(parameters, ()).violations:
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


def _least_covered(work: Workspace, limits: Sequence[Limit], listed: Sequence[Case]) -> tuple[CheckedEnd | None, NLP]:
    """The least relaxation of one part of the box, with cases added until none between them needs more."""
    trial, nlp = _least(work, limits, listed)
    movable = [limit for limit in limits if not limit.parameter]
    thorough = work.options.starts >= _TRIED
    if thorough and trial is not None and trial.point.objective > _NOTHING and len(movable) > 1:
        run, sampler = Runner(work, nlp), _sampler(work)
        leads = {tuple(d.values()): d for limit in movable for d in _leads(work, sampler, limit.name)}
        ended = [run.solve_from(design, near=True, hopeful=False) for design in leads.values()]
        again = best_checked(_unlimited(work, limits), nlp, ended)
        less = again is not None and again.point.objective < trial.point.objective * (1 - _TIE)
        if again is not None and less and not again.checked.violations:
            trial = again
    for _ in range(_ROUNDS if listed else 0):
        if trial is None or not (more := _beyond(work.problem, limits, trial, nlp.cases)):
            break
        trial, nlp = _least(work, limits, (*nlp.cases, *more), trial)
    return trial, nlp


def _least(
    work: Workspace, limits: Sequence[Limit], cases: Sequence[Case], before: CheckedEnd | None = None
) -> tuple[CheckedEnd | None, NLP]:
    """The design with the least weighted sum of amounts that a few starts reach, or the one `before` leads to."""
    nlp = _elastic(work.problem, cases, limits)
    run = Runner(work, nlp)
    candidates = [] if before is None else [run.solve_from(before.parameters, near=True)]
    if not any(c.feasible for c in candidates):
        candidates = _ends(run, min(_TRIED, work.options.starts))
    trial = best_checked(_unlimited(work, limits), nlp, candidates)
    return (trial if trial is not None and not trial.checked.violations else None), nlp


def _sampler(work: Workspace, extended: Limit | None = None) -> Sampler:
    """Looks at designs for their limits alone, and for how far one end of the box must be moved."""
    asked = work.part.derive(locate=None)
    if extended and extended.parameter and extended.name.endswith(".max"):
        asked = asked.derive(minimize=extended.parameter)
    elif extended and extended.parameter:
        asked = asked.derive(maximize=extended.parameter)
    sampler = Sampler(asked, work.options.seed)
    sampler.draw()
    return sampler


def _leads(work: Workspace, sampler: Sampler, name: str) -> list[dict[str, float]]:
    """Designs that may do with one limit moved, as far as it takes; none where the others exclude each other."""
    found = sampler.without(name)
    excluded = found.out_of_reach(work.problem.model.degree) if work.problem.pattern else found.far_off
    return [] if excluded else [sampler.design(found, k) for k in range(min(len(found), _LED))]


def _ends(run: Runner, most: int) -> list[LocalEnd]:
    candidates: list[LocalEnd] = []
    for design, near in islice(starting(run.work), most):
        candidates.append(run.solve_from(design, near, hopeful=False))
        if run.work.options.progress:
            run.work.options.progress(len(candidates), most)
        feasible = [c.objective for c in candidates if c.feasible]
        if feasible and min(feasible) <= _NOTHING:
            break
        if (
            feasible
            and sum(same_objective(f, min(feasible)) for f in feasible) >= _AGREE
            and len(candidates) >= 2 * _AGREE
        ):
            break
    return candidates


def _unlimited(work: Workspace, limits: Sequence[Limit]) -> Workspace:
    """The same without the constraints that may move, whose violation is the point of it."""
    moved = {limit.name for limit in limits}
    kept = {n: c for n, c in work.problem.constraints.items() if n not in moved}
    return replace(work, problem=work.problem.derive(constraints=kept, minimize=None, maximize=None))


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
    for k, name in enumerate(trial.candidate.nlp.variables):
        multiplier = float(trial.point.bound_multipliers[k])
        parameter = name.removeprefix("tan(").removesuffix(")")
        width = trial.candidate.nlp.upper[k] - trial.candidate.nlp.lower[k]
        if parameter in trial.parameters and abs(multiplier) * width > _HOLDS:
            names.append(f"{parameter}.{'max' if multiplier > 0 else 'min'}")
    return names


def alone(work: Workspace, conflict: Sequence[str], trial: CheckedEnd, cases: Sequence[Case]) -> dict[str, float]:
    """How far each limit of a conflict must be moved if nothing else is; those that cannot do it alone are left out."""
    problem = work.problem
    limits = {limit.name: limit for limit in (*_constraint_limits(problem), *_bound_limits(problem))}
    found: dict[str, float] = {}
    for limit in (limits[name] for name in conflict):
        wide = widened(problem, [limit.parameter] if limit.parameter else [])
        side = workspace(wide, work.options)
        sampler = _sampler(side, limit)
        if not (led := _leads(side, sampler, limit.name)):
            continue
        nlp = _elastic(wide, cases, [limit])
        run = Runner(side, nlp)
        here = {n: min(max(trial.parameters[n], lo), hi) for n, (lo, hi) in wide.free.items()}
        candidates = [run.solve_from(design, near=True, hopeful=False) for design in (here, *led)]
        ended = best_checked(_unlimited(side, [limit]), nlp, candidates)
        if ended is not None and not ended.checked.violations:
            found |= _amounts(wide, [limit], ended.parameters, nlp.cases)
    return found


def _elastic(wide: Posed, cases: Sequence[Case], limits: Sequence[Limit]) -> NLP:
    """minimise Σ slack / scale, with each limit moved by its slack; everything else holds."""
    nlp = formulate(wide, cases, elastic=True)
    names = [limit.name for limit in limits]
    inputs = [symbol(name_of(k)) for k in range(len(nlp.variables) + len(limits))]
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
