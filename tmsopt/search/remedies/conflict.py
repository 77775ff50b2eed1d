"""Which limits of an infeasible problem exclude each other."""

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from tmsopt.evaluation.recheck import recheck
from tmsopt.evaluation.worst_case import find_worst_cases
from tmsopt.problem.advice.remedies import Relaxation
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import RADIUS
from tmsopt.program.options import Options
from tmsopt.search.policy import run_nested
from tmsopt.search.search import POLICY, search_nested
from tmsopt.search.state import CheckedEnd, SearchState, begin_search, is_inside

STARTS = 6
"""Starts of a short search."""

_MOST_SEARCHES = 16  # sets of limits that are searched
_MOST_CONFLICTS = 3  # times that a conflict is sought anew because a whole search met it

SearchLimits = Callable[[Sequence[str]], tuple[Mapping[str, float] | None, bool]]
"""Searches for a design that meets the constraints of these names; also whether it can tell. See `search_limits`."""


def find_conflict(
    problem: Posed,
    relaxation: Relaxation,
    likely: Sequence[str],
    wide: Posed,
    options: Options,
    search: SearchLimits,
) -> Relaxation:
    """Add to a relaxation the limits that exclude each other, and whether any proper subset of them can be met.

    Constraints are dropped one by one while no design meets the rest in the box, first the unlikely ones, then those on
    the roots. An end of a range takes part if moving it makes the rest feasible. A few starts decide each step; a whole
    search confirms the final set. If that search finds a design, everything is repeated with it.

    Args:
        problem: without an objective; no design of it meets all limits.
        likely: the limits that are active in a least relaxation.
        wide: the problem with the ends of its ranges as far out as they may move.
        search: searches for a design that meets the constraints of these names.
    """
    if not relaxation.amounts:
        return relaxation
    check = _FeasibilityCheck(problem, replace(options, starts=STARTS, progress=None))
    designs: list[Mapping[str, float]] = [relaxation.parameters]
    for _ in range(_MOST_CONFLICTS):
        check.designs = designs
        kept, sure = _reduce_constraints(check, likely)
        design, certain = search(kept) if len(kept) < len(problem.constraints) else (None, True)
        if design is None:
            sure = sure and certain
            break
        designs = [*designs, design]
    else:
        kept, sure = tuple(problem.constraints), False
    ends_moved = _find_blocking_ends(check, kept, likely, wide)
    names = (*kept, *ends_moved)
    return replace(relaxation, conflict=names or tuple(likely), irreducible=sure and bool(names))


@dataclass
class _FeasibilityCheck:
    """Which limits of a problem can be met together, by known designs and by a few starts.

    Attributes:
        designs: candidates that may meet some limits.
        results: sets of limits that were searched, with the answers.
    """

    problem: Posed
    options: Options
    designs: Sequence[Mapping[str, float]] = ()
    results: dict[Hashable, bool | None] = field(default_factory=dict)

    def can_meet(self, names: Sequence[str], ends: Mapping[str, tuple[float, float]]) -> bool | None:
        """Whether a design meets the constraints of these names, with these other ranges; None if unknown."""
        free = self.problem.free
        rest = {n: text for n, text in self.problem.constraints.items() if n in names}
        part = self.problem.derive(constraints=rest, free={**free, **ends})
        if any(is_inside(part, d) and _is_feasible(part, part.ordered(d)) for d in self.designs):
            return True
        key = (tuple(rest), tuple(ends.items()))
        if key not in self.results and len(self.results) < _MOST_SEARCHES:
            self.results[key] = _can_be_met(part, self.designs, self.options, quick=bool(ends))
        return self.results.get(key)


def _reduce_constraints(check: _FeasibilityCheck, likely: Sequence[str]) -> tuple[tuple[str, ...], bool]:
    """Constraints that seem to exclude each other, none of them superfluous, and whether this is certain."""
    problem = check.problem
    kept, sure = tuple(problem.constraints), True
    others = [n for n in kept if n not in likely]
    in_order = sorted((n for n in kept if n in likely), key=lambda n: n not in problem.asked_of_roots)
    groups = [others, *([n] for n in others if len(others) > 1), *([n] for n in in_order)]
    for group in groups:
        if group and set(group) <= set(kept):
            met = check.can_meet(rest := tuple(n for n in kept if n not in group), {})
            kept, sure = rest if met is False else kept, sure and (met is not None or len(group) > 1)
    return kept, sure


def _find_blocking_ends(check: _FeasibilityCheck, kept: Sequence[str], likely: Sequence[str], wide: Posed) -> list[str]:
    """Ends of ranges: moving one of them lets a design meet the constraints."""
    problem = check.problem
    named = [n for n in problem.free if any(n in problem.conditions[k].names for k in kept)]
    possible = [
        *(n for n in likely if n not in problem.constraints),
        *(f"{n}.{e}" for n in named for e in ("min", "max")),
    ]
    names = list(dict.fromkeys(possible))
    if len(names) > 1 and check.can_meet(kept, _widen_ends(problem, wide, names)) is False:
        return []
    return [name for name in names if check.can_meet(kept, _widen_ends(problem, wide, [name]))]


def _widen_ends(problem: Posed, wide: Posed, names: Sequence[str]) -> dict[str, tuple[float, float]]:
    """The ranges in which these ends are moved as far out as they may be."""
    ranges = dict(problem.free)
    for name, end in (n.rsplit(".", 1) for n in names):
        lower, upper = ranges[name]
        ranges[name] = (wide.free[name][0], upper) if end == "min" else (lower, wide.free[name][1])
    return {n: ends for n, ends in ranges.items() if ends != problem.free[n]}


def _can_be_met(problem: Posed, known: Sequence[Mapping[str, float]], options: Options, quick: bool) -> bool | None:
    """Whether a design seems to meet all limits, by a sample and a few starts; None if they do not tell.

    Args:
        known: designs to start from.
        quick: answer False without starts if no sampled design comes near.
    """
    states = [replace(s, sample=POLICY.sample(s)) for s in begin_search(problem, options, tuple(known))]
    samples = [state.sample for state in states if state.sample]
    if any(_is_feasible(problem, problem.ordered(sample.box.design(sample.refined))) for sample in samples):
        return True
    if quick and len(samples) == len(states) and all(sample.far_off for sample in samples):
        return False
    ends = [t for t in map(search_briefly, states) if t and not t.checked.violations]
    return any(_is_feasible(problem, t.parameters) for t in ends) or (None if ends else False)


def search_briefly(state: SearchState) -> CheckedEnd | None:
    """The best end of a few starts."""
    state = replace(state, sample=state.sample or POLICY.sample(state))
    if state.out_of_reach:
        return None
    return run_nested(state, POLICY.starts(state), POLICY, STARTS).best


def _is_feasible(problem: Posed, design: Mapping[str, float]) -> bool:
    """Whether a design meets all limits, also between the cases."""
    if recheck(problem, design).violations:
        return False
    between = [w.case for w in find_worst_cases(problem, design).values()] if problem.cases else []
    return not between or not recheck(problem, design, (*problem.cases, *between)).violations


def search_limits(problem: Posed, options: Options, names: Sequence[str]) -> tuple[Mapping[str, float] | None, bool]:
    """A design that meets the constraints of these names, by a whole search; and whether the search could tell."""
    options = replace(options, progress=None, near=None)
    kept = problem.derive(constraints={n: text for n, text in problem.constraints.items() if n in names}, pareto=())
    if kept.objective and (RADIUS in kept.objective.names or not (kept.pattern or set(names) & {*kept.asked_of_roots})):
        kept = kept.derive(minimize=None, maximize=None)
    states = begin_search(kept, options)
    about = kept.asked_of_roots or kept.pattern
    if about and any(seen.singular for s in states if (seen := POLICY.sample(s) or s.limits_sample)):
        return None, False
    for state in states:
        outcome = search_nested(state)
        if outcome is not None and not outcome.checked.violations:
            return outcome.parameters, True
    return None, True
