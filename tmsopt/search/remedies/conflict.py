"""Find which limits of an infeasible problem exclude each other."""

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

_MAX_SEARCHES = 16  # sets of limits that are searched
_MAX_CONFLICTS = 3  # times that a conflict is sought; it is sought again if a whole search meets its limits

SearchLimits = Callable[[Sequence[str]], tuple[Mapping[str, float] | None, bool]]
"""Searches for a design that meets the constraints of these names, and tells whether its answer is certain.

See `search_limits`.
"""


def find_conflict(
    problem: Posed,
    relaxation: Relaxation,
    likely: Sequence[str],
    wide: Posed,
    options: Options,
    search: SearchLimits,
) -> Relaxation:
    """Add to a relaxation the limits that exclude each other, and whether any proper subset of them can be met.

    Constraints are dropped one by one while no design in the box meets the remaining ones: first the unlikely ones,
    then those on the roots. An end of a range takes part if moving it makes the remaining constraints feasible. A few
    starts decide each step; a whole search confirms the final set. If that search finds a design, everything is
    repeated with it.

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
    for _ in range(_MAX_CONFLICTS):
        check.designs = designs
        constraints, is_certain = check.reduce_constraints()
        design, could_tell = search(constraints) if len(constraints) < len(problem.constraints) else (None, True)
        if design is None:
            is_certain = is_certain and could_tell
            break
        designs = [*designs, design]
    else:
        constraints, is_certain = tuple(problem.constraints), False
    names = (*constraints, *check.find_blocking_ends(constraints))
    return replace(relaxation, conflict=names or tuple(likely), irreducible=is_certain and bool(names))


@dataclass
class _ConflictSearch:
    """Decides which limits of a problem can be met together, by known designs and by a few starts.

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

    def can_meet(self, names: Sequence[str], moved_ends: Sequence[str] = ()) -> bool | None:
        """Whether a design meets the constraints of these names in the box, with these ends moved; None if unknown."""
        ranges = dict(self.problem.free)
        for name, _, end in (n.rpartition(".") for n in moved_ends):
            (lower, upper), (wide_lower, wide_upper) = ranges[name], self.wide.free[name]
            ranges[name] = (wide_lower, upper) if end == "min" else (lower, wide_upper)
        limits = {n: text for n, text in self.problem.constraints.items() if n in names}
        part = self.problem.derive(constraints=limits, free=ranges)
        if any(is_inside(part, d) and _is_feasible(part, part.ordered(d)) for d in self.designs):
            return True
        key = (tuple(limits), tuple(ranges.items()))
        if key not in self.results and len(self.results) < _MAX_SEARCHES:
            self.results[key] = _can_be_met(part, self.designs, self.options, quick=bool(moved_ends))
        return self.results.get(key)

    def reduce_constraints(self) -> tuple[tuple[str, ...], bool]:
        """Return constraints that seem to exclude each other, none of them superfluous, and whether this is certain."""
        names, is_certain = tuple(self.problem.constraints), True
        unlikely = [n for n in names if n not in self.likely]
        in_order = sorted((n for n in names if n in self.likely), key=lambda n: n not in self.problem.asked_of_roots)
        for group in (unlikely, *([n] for n in unlikely if len(unlikely) > 1), *([n] for n in in_order)):
            if group and set(group) <= set(names):
                is_met = self.can_meet(remaining := tuple(n for n in names if n not in group))
                is_certain = is_certain and (is_met is not None or len(group) > 1)
                names = remaining if is_met is False else names
        return names, is_certain

    def find_blocking_ends(self, constraints: Sequence[str]) -> list[str]:
        """Find the ends of ranges that block the constraints: moving one of them lets a design meet these."""
        problem = self.problem
        free_names = [n for n in problem.free if any(n in problem.conditions[k].names for k in constraints)]
        likely_ends = [n for n in self.likely if n not in problem.constraints]
        names = list(dict.fromkeys([*likely_ends, *(f"{n}.{end}" for n in free_names for end in ("min", "max"))]))
        if len(names) > 1 and self.can_meet(constraints, names) is False:
            return []
        return [name for name in names if self.can_meet(constraints, [name])]


def _can_be_met(problem: Posed, designs: Sequence[Mapping[str, float]], options: Options, quick: bool) -> bool | None:
    """Whether a design seems to meet all limits, by a sample and a few starts; None if these do not decide.

    Args:
        designs: to start from.
        quick: whether to answer False without starts if no sampled design comes near the limits.
    """
    states = [replace(s, sample=POLICY.sample(s)) for s in begin_search(problem, options, tuple(designs))]
    samples = [state.sample for state in states if state.sample]
    if any(_is_feasible(problem, problem.ordered(sample.box.design(sample.refined))) for sample in samples):
        return True
    if quick and samples and all(sample.far_off for sample in samples):
        return False
    ends = [t for t in map(search_briefly, states) if t and not t.checked.violations]
    return any(_is_feasible(problem, t.parameters) for t in ends) or (None if ends else False)


def search_briefly(state: SearchState) -> CheckedEnd | None:
    """Return the best end of a few starts; None if the sample shows that the limits are out of reach."""
    state = replace(state, sample=state.sample or POLICY.sample(state))
    if state.out_of_reach:
        return None
    return run_nested(state, POLICY.starts(state), POLICY, STARTS).best


def _is_feasible(problem: Posed, design: Mapping[str, float]) -> bool:
    """Whether a design meets all limits, also between the cases."""
    if recheck(problem, design).violations:
        return False
    worst_cases = [w.case for w in find_worst_cases(problem, design).values()] if problem.cases else []
    return not worst_cases or not recheck(problem, design, (*problem.cases, *worst_cases)).violations


def search_limits(problem: Posed, options: Options, names: Sequence[str]) -> tuple[Mapping[str, float] | None, bool]:
    """Search for a design that meets the constraints of these names; also tell whether the answer is certain."""
    options = replace(options, progress=None, near=None)
    part = problem.derive(constraints={n: text for n, text in problem.constraints.items() if n in names}, pareto=())
    if part.objective and (RADIUS in part.objective.names or not (part.pattern or set(names) & {*part.asked_of_roots})):
        part = part.derive(minimize=None, maximize=None)
    states = begin_search(part, options)
    on_roots = part.asked_of_roots or part.pattern
    if on_roots and any(sample.singular for s in states if (sample := POLICY.sample(s) or s.limits_sample)):
        return None, False
    for state in states:
        outcome = search_nested(state)
        if outcome is not None and not outcome.checked.violations:
            return outcome.parameters, True
    return None, True
