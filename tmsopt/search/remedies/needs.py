"""What a problem without an answer needs: the least speed at which all else holds; and which limits are in the way."""

import math
import time
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

from tmsopt.evaluation.recheck import recheck
from tmsopt.evaluation.worst_case import find_worst_cases
from tmsopt.problem.advice.remedies import DIGITS, Relaxation, RequiredValue, round_outwards
from tmsopt.problem.dependence import STABLE, stability_limit
from tmsopt.problem.problem import Posed
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import unit_of
from tmsopt.program.options import Options
from tmsopt.progress import begin
from tmsopt.records import Table
from tmsopt.search.accept import accept_best
from tmsopt.search.policy import try_starts
from tmsopt.search.remedies.allowance import Spent, within
from tmsopt.search.search import POLICY
from tmsopt.search.state import CheckedEnd, SearchState, begin_search

_FASTEST, _TIMES = 10.0, 4.0  # speeds looked through, in √(g w); in the problem's own speed, where that is more
_STARTS, _SECONDS = 6, 0.5  # what a search for it may cost; after which no other is begun
_LEAST_DECAY = 1e-6  # of the roots' mean size, of a design that counts as stable
_AT_END = 1e-6  # relative: a speed so near an end of its range is that end
_ENDS = "min", "max"
_ASKED = 16  # sets of limits that are searched for designs at most
_ANEW = 3  # times that limits in conflict are sought, where whole searches meet them after all

Answered = Callable[[Posed, Options], Mapping[str, float] | None]
"""The design that answers a problem where it is solved again, {} or None; see `search.answered`."""

Reached = Callable[[Sequence[str]], tuple[Mapping[str, float] | None, bool]]
"""A design that meets the constraints of these names, by a search like that of a problem which asks for no others; and
whether such a search can tell."""


def add_required_speed(
    solution: Solution, options: Options, answered: Answered
) -> tuple[Solution, Mapping[str, float] | None]:
    """The same, with the least speed that a design takes, or the greatest, where the roots stand in the way.

    The problem is solved again at the speed that is shown. A design that was missed in the box comes with it.
    """
    name, problem = _speed(solution.problem.posed), solution.problem
    if not name or problem.posed.cases or not problem.free or not _asked(solution):
        return solution, None
    limits = {} if set(problem.posed.asked_of_roots) or problem.posed.pattern else {STABLE: "abscissa <= 0"}
    few = replace(options, starts=_STARTS, stability=0.0, alone=False, progress=None, near=None)
    began, looked = time.perf_counter(), list[float]()
    begin(options.progress, f"looking for the {name} that it takes")
    for most, ends in _ranges(problem.posed, name):
        asked = _freed(problem.posed, name, ends).derive(
            constraints={**problem.constraints, **limits},
            minimize=None if most else name,
            maximize=name if most else None,
        )
        looked += ends
        trials = [_best(state) for state in begin_search(asked, few)]
        found = [t.parameters for t in trials if t and not t.checked.violations]
        if found:
            design = (max if most else min)(found, key=lambda p: p[name])
            if name in problem.free and math.isclose(design[name], ends[most], rel_tol=_AT_END):
                return solution, design
            short = within(options)
            with suppress(Spent):
                for shown in _shown(problem.posed, name, design[name], not most):
                    if answered(_freed(problem.posed, name, (shown, shown)), short):
                        need = RequiredValue(name, design[name], most, ends, Table(design), shown)
                        return replace(solution, need=need), None
            return solution, None
        if time.perf_counter() - began > _SECONDS:
            break
    beyond = (min(looked), max(looked)) if looked else None
    return (replace(solution, need=RequiredValue(name, math.nan, False, beyond)) if beyond else solution), None


def _freed(problem: Posed, name: str, ends: tuple[float, float]) -> Posed:
    """The problem with another range of a parameter; with a value, where both ends are that."""
    freed = {**problem.free, name: ends}
    free = {n: freed[n] for n in problem.parameter_set.names if n in freed}
    return problem.derive(fixed={n: x for n, x in problem.fixed.items() if n != name}, free=free, start={})


def _shown(problem: Posed, name: str, value: float, up: bool) -> Iterator[float]:
    """A value as it is shown, to fewer and fewer digits, rounded to where a design is."""
    one = unit_of(problem, name).one
    yield from dict.fromkeys(round_outwards(value / one, up, digits) * one for digits in (DIGITS, 4, 2))


def irreducible(
    problem: Posed,
    relaxation: Relaxation,
    likely: Sequence[str],
    wide: Posed,
    options: Options,
    reached: Reached,
) -> Relaxation:
    """The same with limits that exclude each other, and whether without any one of them a design meets the others.

    Constraints are left out one after the other, first those that are not likely to have a part, then those about the
    roots, as long as no design meets the rest in the box; ends of it have a part where the rest is met beyond them.
    A few starts decide each time; that none meets what is left in the end is said only after a whole search for it,
    and where that finds a design, all is decided anew with it. What is met by none, no more is known of.

    Args:
        problem: without an objective, and no design of it meets all that is asked.
        likely: the limits that hold a least relaxation.
        wide: the problem in the box as far as its ends may give way.
        reached: the whole search, for the constraints of these names.
    """
    if not relaxation.amounts:
        return relaxation
    found = _Found(problem, replace(options, starts=_STARTS, progress=None))
    designs: list[Mapping[str, float]] = [relaxation.parameters]
    for _ in range(_ANEW):
        found.designs = designs
        kept, sure = _fewest(found, likely)
        design, told = reached(kept) if len(kept) < len(problem.constraints) else (None, True)
        if design is None:
            sure = sure and told
            break
        designs = [*designs, design]
    else:
        kept, sure = tuple(problem.constraints), False
    wanted = _ends(found, kept, likely, wide)
    names = (*kept, *wanted)
    return replace(relaxation, conflict=names or tuple(likely), irreducible=sure and bool(names))


@dataclass
class _Found:
    """Which limits of a problem are met together, by designs at hand and by a few starts.

    Attributes:
        designs: that may meet some of them.
        asked: sets of limits that starts have been spent on, with what these came to.
    """

    problem: Posed
    options: Options
    designs: Sequence[Mapping[str, float]] = ()
    asked: dict[Hashable, bool | None] = field(default_factory=dict)

    def met(self, names: Sequence[str], ends: Mapping[str, tuple[float, float]]) -> bool | None:
        """Whether a design meets the constraints of these names, with other ends of some ranges; None: not known."""
        free = self.problem.free
        rest = {n: text for n, text in self.problem.constraints.items() if n in names}
        part = self.problem.derive(constraints=rest, free={**free, **ends})
        if any(_inside(part, d) and _holds(part, part.ordered(d)) for d in self.designs):
            return True
        key = (tuple(rest), tuple(ends.items()))
        if key not in self.asked and len(self.asked) < _ASKED:
            self.asked[key] = _met(part, self.designs, self.options, quick=bool(ends))
        return self.asked.get(key)


def _fewest(found: _Found, likely: Sequence[str]) -> tuple[tuple[str, ...], bool]:
    """Constraints of which all seem to be needed for there to be no design, and whether each of them surely is."""
    problem = found.problem
    kept, sure = tuple(problem.constraints), True
    others = [n for n in kept if n not in likely]
    in_order = sorted((n for n in kept if n in likely), key=lambda n: n not in problem.asked_of_roots)
    groups = [others, *([n] for n in others if len(others) > 1), *([n] for n in in_order)]
    for group in groups:
        if group and set(group) <= set(kept):
            met = found.met(rest := tuple(n for n in kept if n not in group), {})
            kept, sure = rest if met is False else kept, sure and (met is not None or len(group) > 1)
    return kept, sure


def _ends(found: _Found, kept: Sequence[str], likely: Sequence[str], wide: Posed) -> list[str]:
    """Ends of ranges beyond which constraints are met that no design in the box meets together."""
    problem = found.problem
    named = [n for n in problem.free if any(n in problem.conditions[k].names for k in kept)]
    possible = [*(n for n in likely if n not in problem.constraints), *(f"{n}.{e}" for n in named for e in _ENDS)]
    names = list(dict.fromkeys(possible))
    if len(names) > 1 and found.met(kept, _beyond(problem, wide, names)) is False:
        return []
    return [name for name in names if found.met(kept, _beyond(problem, wide, [name]))]


def _beyond(problem: Posed, wide: Posed, names: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Ranges with these ends of them as far as they may give way."""
    ranges = dict(problem.free)
    for name, end in (n.rsplit(".", 1) for n in names):
        lower, upper = ranges[name]
        ranges[name] = (wide.free[name][0], upper) if end == "min" else (lower, wide.free[name][1])
    return {n: ends for n, ends in ranges.items() if ends != problem.free[n]}


def steady(problem: Posed, asked: Posed) -> Posed:
    """The limits of a problem, and that of stability where the one that was asked wants that."""
    limits = {**problem.constraints, **stability_limit(asked, _LEAST_DECAY)}
    return problem.derive(constraints=limits, minimize=None, maximize=None)


def _met(problem: Posed, known: Sequence[Mapping[str, float]], options: Options, quick: bool) -> bool | None:
    """Whether a design seems to meet all that is asked, by a sample and a few starts; None where neither tells.

    `quick`: where no design of the sample comes near, none is looked for; of what is only not named then.
    """
    states = [replace(s, sample=POLICY.sample(s)) for s in begin_search(problem, options, tuple(known))]
    samples = [state.sample for state in states if state.sample]
    if any(_holds(problem, problem.ordered(sample.box.design(sample.refined))) for sample in samples):
        return True
    if quick and len(samples) == len(states) and all(sample.far_off for sample in samples):
        return False
    ended = [t for t in map(_best, states) if t and not t.checked.violations]
    return any(_holds(problem, t.parameters) for t in ended) or (None if ended else False)


def _inside(problem: Posed, design: Mapping[str, float]) -> bool:
    """Whether a design is in the box."""
    return all(lower <= design[n] <= upper for n, (lower, upper) in problem.free.items())


def _holds(problem: Posed, design: Mapping[str, float]) -> bool:
    """Whether a design meets all that is asked, between the cases too."""
    if recheck(problem, design).violations:
        return False
    between = [w.case for w in find_worst_cases(problem, design).values()] if problem.cases else []
    return not between or not recheck(problem, design, (*problem.cases, *between)).violations


def _best(state: SearchState) -> CheckedEnd | None:
    state = replace(state, sample=state.sample or POLICY.sample(state))
    if state.out_of_reach:
        return None
    state = try_starts(state, POLICY.starts(state), POLICY, _STARTS)
    if state.interrupted:
        raise KeyboardInterrupt
    return accept_best(state).best


def _asked(solution: Solution) -> bool:
    """Whether the speed may help: what fails is about the roots."""
    problem = solution.problem.posed
    about = {*problem.asked_of_roots, *([problem.pattern.name] if problem.pattern else [])}
    if solution.status == "infeasible":
        return bool(about & set(solution.violations))
    return solution.stable is False and not solution.any_stable and solution.stability_sought


def _speed(problem: Posed) -> str:
    """The parameter that is a speed; none where a constraint is about it, which says what it may be."""
    of = problem.parameter_set
    name = next((p.name for p in of.parameters if p.unit == "m/s" or p.name == "Fr"), "")
    return "" if any(name in c.names for c in problem.conditions.values()) else name


def _ranges(problem: Posed, name: str) -> Iterator[tuple[bool, tuple[float, float]]]:
    """Above what the speed may be, then below it; not below where it is fixed or may be anything down to rest."""
    low, high = problem.free.get(name, (problem.fixed.get(name, math.nan),) * 2)
    middle = {
        n: sum(problem.free[n]) / 2 if n in problem.free else problem.fixed[n] for n in problem.parameter_set.names
    }
    unit = math.sqrt(middle["g"] * middle["w"]) if {"g", "w"} <= middle.keys() else 1.0
    top = min(max(_FASTEST * unit, _TIMES * high), problem.parameter_set[name].range.upper)
    if high < top:
        yield False, (high, top)
    bottom = max(problem.parameter_set[name].range.lower, 0.0)
    if bottom < low:
        yield True, (bottom, low)
