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

SHORT_SEARCH_STARTS = 6
"""Number of starts of a short search."""

_MAX_SEARCHES = 16  # sets of limits for which a short search runs
_MAX_CONFLICTS = 3  # conflicts that are tried; another one is needed if a whole search meets the limits of the last one

SearchLimits = Callable[[Sequence[str]], tuple[Mapping[str, float] | None, bool]]
"""Names of constraints → (a design that meets these, or None; whether this answer is certain); see `search_limits`."""


def find_conflict(
    problem: Posed,
    relaxation: Relaxation,
    likely_names: Sequence[str],
    wide_problem: Posed,
    options: Options,
    search: SearchLimits,
) -> Relaxation:
    """Add to a relaxation the limits that exclude each other, and whether any proper subset of them can be met.

    Constraints are dropped one by one while no design in the box meets the remaining ones: first the unlikely ones,
    then those on the roots. An end of a range is part of the conflict if moving it makes the remaining constraints
    feasible. A short search decides each step; a whole search confirms the final set. If the whole search finds a
    design, all steps are repeated with this design.

    Args:
        problem: without an objective; no design of it meets all limits.
        likely_names: the limits that are active in a least relaxation.
        wide_problem: the problem with the ends of its ranges as far out as they may move.
        search: searches for a design that meets the constraints of these names.
    """
    if not relaxation.amounts:
        return relaxation
    conflict_search = _ConflictSearch(
        problem, likely_names, wide_problem, replace(options, starts=SHORT_SEARCH_STARTS, progress=None)
    )
    designs: list[Mapping[str, float]] = [relaxation.parameters]
    for _ in range(_MAX_CONFLICTS):
        conflict_search.designs = designs
        constraints, is_certain = conflict_search.reduce_constraints()
        design, is_answer_certain = search(constraints) if len(constraints) < len(problem.constraints) else (None, True)
        if design is None:
            is_certain = is_certain and is_answer_certain
            break
        designs = [*designs, design]
    else:
        constraints, is_certain = tuple(problem.constraints), False
    names = (*constraints, *conflict_search.find_blocking_ends(constraints))
    return replace(relaxation, conflict=names or tuple(likely_names), irreducible=is_certain and bool(names))


@dataclass
class _ConflictSearch:
    """Decides which limits of a problem can be met together, by known designs and by a few starts.

    Attributes:
        designs: candidates that may meet some limits.
        results: key of a set of limits → whether a design meets them; None if this is unknown.
    """

    problem: Posed
    likely_names: Sequence[str]
    wide_problem: Posed
    options: Options
    designs: Sequence[Mapping[str, float]] = ()
    results: dict[Hashable, bool | None] = field(default_factory=dict)

    def can_meet(self, names: Sequence[str], moved_ends: Sequence[str] = ()) -> bool | None:
        """Whether a design meets the constraints of these names in the box, with these ends moved; None if unknown."""
        ranges = dict(self.problem.free)
        for name, _, end in (n.rpartition(".") for n in moved_ends):
            (lower, upper), (wide_lower, wide_upper) = ranges[name], self.wide_problem.free[name]
            ranges[name] = (wide_lower, upper) if end == "min" else (lower, wide_upper)
        limits = {n: text for n, text in self.problem.constraints.items() if n in names}
        part = self.problem.derive(constraints=limits, free=ranges)
        if any(is_inside(part, d) and _is_feasible(part, part.ordered(d)) for d in self.designs):
            return True
        key = (tuple(limits), tuple(ranges.items()))
        if key not in self.results and len(self.results) < _MAX_SEARCHES:
            self.results[key] = _can_be_met(part, self.designs, self.options, is_quick=bool(moved_ends))
        return self.results.get(key)

    def reduce_constraints(self) -> tuple[tuple[str, ...], bool]:
        """Return constraints that seem to exclude each other, none of them superfluous, and whether this is certain."""
        names, is_certain = tuple(self.problem.constraints), True
        unlikely = [n for n in names if n not in self.likely_names]
        likely = sorted(
            (n for n in names if n in self.likely_names), key=lambda n: n not in self.problem.asked_of_roots
        )
        for group in (unlikely, *([n] for n in unlikely if len(unlikely) > 1), *([n] for n in likely)):
            if group and set(group) <= set(names):
                can_meet_rest = self.can_meet(remaining := tuple(n for n in names if n not in group))
                is_certain = is_certain and (can_meet_rest is not None or len(group) > 1)
                names = remaining if can_meet_rest is False else names
        return names, is_certain

    def find_blocking_ends(self, constraints: Sequence[str]) -> list[str]:
        """Find the ends of ranges that block the constraints: if one of them moves, a design meets the constraints."""
        problem = self.problem
        free_names = [n for n in problem.free if any(n in problem.conditions[k].names for k in constraints)]
        likely_ends = [n for n in self.likely_names if n not in problem.constraints]
        names = list(dict.fromkeys([*likely_ends, *(f"{n}.{end}" for n in free_names for end in ("min", "max"))]))
        if len(names) > 1 and self.can_meet(constraints, names) is False:
            return []
        return [name for name in names if self.can_meet(constraints, [name])]


def _can_be_met(
    problem: Posed, designs: Sequence[Mapping[str, float]], options: Options, is_quick: bool
) -> bool | None:
    """Whether a design seems to meet all limits, by a sample and a few starts; None if these do not decide.

    Args:
        designs: designs to start from.
        is_quick: whether to answer False without starts if no sampled design comes near the limits.
    """
    states = [replace(s, sample=POLICY.sample(s)) for s in begin_search(problem, options, tuple(designs))]
    samples = [state.sample for state in states if state.sample]
    if any(_is_feasible(problem, problem.ordered(sample.box.design(sample.refined))) for sample in samples):
        return True
    if is_quick and samples and all(sample.is_far_off for sample in samples):
        return False
    ends = [end for end in map(search_briefly, states) if end and not end.checked.violations]
    return any(_is_feasible(problem, end.parameters) for end in ends) or (None if ends else False)


def search_briefly(state: SearchState) -> CheckedEnd | None:
    """Return the best end of a few starts; None if the sample shows that the limits are out of reach."""
    state = replace(state, sample=state.sample or POLICY.sample(state))
    if state.out_of_reach:
        return None
    return run_nested(state, POLICY.starts(state), POLICY, SHORT_SEARCH_STARTS).best


def _is_feasible(problem: Posed, design: Mapping[str, float]) -> bool:
    """Whether a design meets all limits, also between the cases."""
    if recheck(problem, design).violations:
        return False
    worst_cases = [w.case for w in find_worst_cases(problem, design).values()] if problem.cases else []
    return not worst_cases or not recheck(problem, design, (*problem.cases, *worst_cases)).violations


def search_limits(problem: Posed, options: Options, names: Sequence[str]) -> tuple[Mapping[str, float] | None, bool]:
    """Search for a design that meets these constraints; return it or None, and whether this answer is certain."""
    options = replace(options, progress=None, near=None)
    part = problem.derive(constraints={n: text for n, text in problem.constraints.items() if n in names}, pareto=())
    if part.objective and (RADIUS in part.objective.names or not (part.pattern or set(names) & {*part.asked_of_roots})):
        part = part.derive(minimize=None, maximize=None)
    states = begin_search(part, options)
    has_root_limits = part.asked_of_roots or part.pattern
    if has_root_limits and any(
        sample.is_nearly_singular for s in states if (sample := POLICY.sample(s) or s.limits_sample)
    ):
        return None, False
    for state in states:
        outcome = search_nested(state)
        if outcome is not None and not outcome.checked.violations:
            return outcome.parameters, True
    return None, True
