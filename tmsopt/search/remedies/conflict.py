"""Which limits of an infeasible problem exclude each other."""

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from tmsopt.evaluation import find_worst_cases
from tmsopt.evaluation.recheck import recheck
from tmsopt.problem import Posed, Relaxation
from tmsopt.problem.quantities import RADIUS
from tmsopt.program import Options
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
    check = _ConflictSearch(problem, likely, wide, replace(options, starts=STARTS, progress=None))
    designs: list[Mapping[str, float]] = [relaxation.parameters]
    for _ in range(_MOST_CONFLICTS):
        check.designs = designs
        kept, sure = check.reduce_constraints()
        design, certain = search(kept) if len(kept) < len(problem.constraints) else (None, True)
        if design is None:
            sure = sure and certain
            break
        designs = [*designs, design]
    else:
        kept, sure = tuple(problem.constraints), False
    names = (*kept, *check.find_blocking_ends(kept))
    return replace(relaxation, conflict=names or tuple(likely), irreducible=sure and bool(names))


@dataclass
class _ConflictSearch:
    """Which limits of a problem can be met together, by known designs and by a few starts.

    Attributes:
        designs: candidates that may meet some limits.
        results: sets of limits that were searched, with the answers.
    """

    problem: Posed
    likely: Sequence[str]
    wide: Posed
    options: Options
    designs: Sequence[Mapping[str, float]] = ()
    results: dict[Hashable, bool | None] = field(default_factory=dict)

    def can_meet(self, names: Sequence[str], moved: Sequence[str] = ()) -> bool | None:
        """Whether a design meets the constraints of these names in the box, with these ends moved; None if unknown."""
        ranges = dict(self.problem.free)
        for name, _, end in (n.rpartition(".") for n in moved):
            (lower, upper), (least, most) = ranges[name], self.wide.free[name]
            ranges[name] = (least, upper) if end == "min" else (lower, most)
        rest = {n: text for n, text in self.problem.constraints.items() if n in names}
        part = self.problem.derive(constraints=rest, free=ranges)
        if any(is_inside(part, d) and _is_feasible(part, part.ordered(d)) for d in self.designs):
            return True
        key = (tuple(rest), tuple(ranges.items()))
        if key not in self.results and len(self.results) < _MOST_SEARCHES:
            self.results[key] = _can_be_met(part, self.designs, self.options, quick=bool(moved))
        return self.results.get(key)

    def reduce_constraints(self) -> tuple[tuple[str, ...], bool]:
        """Constraints that seem to exclude each other, none of them superfluous, and whether this is certain."""
        kept, sure = tuple(self.problem.constraints), True
        others = [n for n in kept if n not in self.likely]
        in_order = sorted((n for n in kept if n in self.likely), key=lambda n: n not in self.problem.asked_of_roots)
        for group in (others, *([n] for n in others if len(others) > 1), *([n] for n in in_order)):
            if group and set(group) <= set(kept):
                met = self.can_meet(rest := tuple(n for n in kept if n not in group))
                kept, sure = rest if met is False else kept, sure and (met is not None or len(group) > 1)
        return kept, sure

    def find_blocking_ends(self, kept: Sequence[str]) -> list[str]:
        """Ends of ranges: moving one of them lets a design meet the constraints."""
        problem = self.problem
        named = [n for n in problem.free if any(n in problem.conditions[k].names for k in kept)]
        possible = [n for n in self.likely if n not in problem.constraints]
        names = list(dict.fromkeys([*possible, *(f"{n}.{end}" for n in named for end in ("min", "max"))]))
        if len(names) > 1 and self.can_meet(kept, names) is False:
            return []
        return [name for name in names if self.can_meet(kept, [name])]


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
    if quick and samples and all(sample.far_off for sample in samples):
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
