"""The solution of a design problem, rechecked before it is believed."""

import math
import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Unpack

from tmsopt.boundaries import is_exactly_multiple, stands_on
from tmsopt.evaluation.digits import certified_numbers
from tmsopt.evaluation.exclusion import known_bound
from tmsopt.evaluation.recheck import Evaluation
from tmsopt.evaluation.stored import held, missed_note
from tmsopt.evaluation.worst_case import cover
from tmsopt.models.user_spectrum import beyond_axis, polynomial_structure, user_structure_name, without_rounding
from tmsopt.problem.dependence import sense_notes
from tmsopt.problem.files import Given, as_solvable
from tmsopt.problem.freedom import degrees_of_freedom
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY
from tmsopt.problem.solution import Bound, Solution
from tmsopt.problem.unit_system import unit_at, unit_of
from tmsopt.problem.verdict.meetings import every_meeting
from tmsopt.problem.verdict.stability import stability
from tmsopt.problem.verdict.status import NotSolved
from tmsopt.program.nlp import objective_size
from tmsopt.program.options import DEFAULTS, AskedOfSolve, Options, documents_options, options_of
from tmsopt.progress import Listener, begin, steps_for
from tmsopt.records import Table
from tmsopt.search.enough import count_starts
from tmsopt.search.outcome import UNCLEAR, Outcome, as_it_is, beats, evaluated, evaluated_cases, mass_advice
from tmsopt.search.policy import Policy, check_policy
from tmsopt.search.remedies.needs import add_required_speed
from tmsopt.search.remedies.none import answered, explain_none
from tmsopt.search.search import POLICY, search_part
from tmsopt.search.state import SearchState, begin_search, check_near, same_objective

UNSTABLE = "no stable design was found that meets the other limits"
"""Of a design that is not stable though a limit asks for it."""

_ASKING = replace(DEFAULTS, stability=5.0, interruptible=True)
_TOLD = 1e-6  # relative and absolute: difference of a value in doubles from the exact one, above which rounding decided
Found = tuple[SearchState, Outcome | None]
"""The search of a part of the box at its end, and its best design."""

_NEAR = 4  # starts where branch and bound found a stable design, that design the first of them


@documents_options(AskedOfSolve, _ASKING)
def solve(problem: Given, *, throw: bool = True, policy: Policy = POLICY, **options: Unpack[AskedOfSolve]) -> Solution:
    """Find the best design, from several starts, and check it independently of the solver.

    Ctrl-C ends the search with the best design so far, ``not_converged`` and `interrupted`; a second one ends that too.

    Args:
        problem: or the path of its file.
        throw: raise NotSolved unless the status is ``optimal``; otherwise return the best point with its status.
        policy: how each part of the box is searched; see `tmsopt.Policy`. The robustness radius is climbed first, in a
            way of its own, and what limits must give where nothing is feasible is asked of `tmsopt.POLICY`.
        options: ``starts``, ``seed``, ``exhaustive``, ``linear_solver``, ``progress``, ``near``, ``alone``,
            ``stability`` and ``interruptible``; see `tmsopt.Options`.

    Raises:
        NotSolved: carrying the best point found, when `throw`.
        InputError: when parameters are free and nothing is asked of them, or for a policy that is none.
        KeyboardInterrupt: when the user ends it before there is any design, or `interruptible` is False.

    Example:
        >>> design = tmsopt.solve("problems/ep4.toml")
        >>> design.structure, f"{design.parameters['chi_B']:.6f}"  # at the square root of 2
        ('EP4', '1.414214')

    More: docs/tutorials/first_bicycle.md
    """
    check_policy(policy)
    problem = as_solvable(problem)
    solution = solve_any_status(problem, options_of(options, AskedOfSolve, _ASKING), policy=policy)
    if throw and solution.status != "optimal":
        raise NotSolved(solution)
    return solution


def solve_any_status(
    design: Given,
    options: Options = DEFAULTS,
    extra_starts: Sequence[Mapping[str, float]] = (),
    without_sample: bool = False,
    without: Collection[str] = (),
    bound: bool = True,
    policy: Policy = POLICY,
) -> Solution:
    """A solution as it is; of a problem, or of a file, what `solve` finds, whatever its status.

    Args:
        extra_starts: designs that may be close to the optimum, to be started from.
        without_sample: search from these and the problem's start alone; and without `covered`.
        without: parts of the box to be left out, such as ``normal rake``.
        bound: whether to say how good the design is at best.
    """
    if isinstance(design, Solution):
        return design
    problem = as_solvable(design)
    began = time.perf_counter()
    if not problem.free:
        outcome = evaluated(problem, evaluated_cases(problem, problem.ordered({})))
        return covered(_assembled(problem, outcome, (), {}, began, bound))
    if options.near:
        check_near(problem, options.near)
        near = {n: min(max(options.near[n], lo), hi) for n, (lo, hi) in problem.free.items() if n in options.near}
        options = replace(options, near=near)
    policy = replace(policy, sample=lambda _: None) if without_sample else policy
    states = [s for s in begin_search(problem, options, tuple(extra_starts), policy.tuning) if s.side not in without]
    found = _search_sides(states, policy)
    best = _winner(problem, found)
    interrupted = any(state.interrupted for state, _ in found)
    if interrupted:
        if not options.interruptible:
            raise KeyboardInterrupt
        best = _so_far(problem, found, best)
    try:
        outcome = best or explain_none(problem, [state for state, _ in found], policy)
    except KeyboardInterrupt:
        if not options.interruptible:
            raise
        interrupted, outcome = True, _so_far(problem, found, None)
    looked = sum(len(state.sample.box.drawn) for state, _ in found if state.sample)
    outcome = replace(outcome, starts=replace(outcome.starts, looked=looked))
    notes = (*_sides_note(problem, found, outcome), *sense_notes(problem))
    solution = _assembled(problem, outcome, notes, _side_values(found), began, bound)
    solution = replace(solution, interrupted=interrupted)
    solution = solution if without_sample else covered(solution)
    if interrupted or not options.stability or options.near:  # which keeps to its side of the box
        return solution
    try:
        judged = _with_stability(solution, options, began, policy)
        needy, missed = add_required_speed(judged, options, partial(answered, asked=problem, thorough=True))
        words = "a search for the least speed found the stable design from which this one was reached"
        return _follow(needy, missed, words, options, policy) if missed else needy
    except KeyboardInterrupt:
        if not options.interruptible:
            raise
        words = "the user stopped the question whether any design is stable"
        return replace(solution, interrupted=True, notes=(*solution.notes, words))


def _search_sides(states: Sequence[SearchState], policy: Policy) -> list[Found]:
    """The search of each part of the box, in the order of these; that with the best design of a sample comes first."""
    if len(states) > 1:
        begin(states[0].options.progress, "looking at designs")
        states = [replace(state, sample=policy.sample(state)) for state in states]
    found: dict[str, Found] = {}
    for state in sorted(states, key=lambda state: state.sample.first if state.sample else (0.0, 0.0)):
        found[state.side] = search_part(state, policy)
        if found[state.side][0].interrupted:
            break
    return [found[state.side] for state in states if state.side in found]


def covered(solution: Solution) -> Solution:
    """The same, with the proof that no case between those listed is worse, where that is asked of an optimum."""
    problem = solution.problem.posed
    if solution.status != "optimal" or solution.cover or not (problem.scenarios or problem.tolerances):
        return solution
    return replace(solution, cover=cover(problem, solution.parameters, solution.abscissa))


def solved_first(design: Given, progress: Listener | None) -> Solution:
    """The same for a verb that takes no options but its listener."""
    return solve_any_status(design, replace(DEFAULTS, progress=steps_for(progress)))


def evaluate_design(problem: Posed, design: Mapping[str, float], note: str) -> Solution:
    """A design as it is, whoever found it: ``not_converged``, or ``infeasible`` where it violates something."""
    return _assembled(problem, as_it_is(problem, design, note), (), {}, time.perf_counter())


def _so_far(problem: Posed, found: Sequence[Found], outcome: Outcome | None) -> Outcome:
    """The best design that an interrupted search has met: where starts ended, or of those looked at before.

    Raises:
        KeyboardInterrupt: where there is none.
    """
    designs = [outcome.parameters] if outcome else []
    for state, _ in found:
        designs += [state.design_at(end) for end in sorted(state.ends, key=lambda end: end.rank)[:1]]
        designs += [state.sample.box.design(state.sample.refined)] if state.sample else []
    known = [as_it_is(problem, {n: design[n] for n in problem.free}) for design in designs]
    if not known:
        raise KeyboardInterrupt
    best = min(known, key=partial(_order, problem))
    ends = [end for state, _ in found for end in state.ends]
    many = f"{len(ends)} start{'' if len(ends) == 1 else 's'} of the solver"
    words = f"the user stopped the search after {many}; this is the best design so far"
    formulation = found[0][0].nlp.formulation if ends else "none"
    starts = count_starts(ends, problem.sign * best.checked.objective)
    return replace(best, starts=starts, formulation=formulation, notes=(words,))


def _order(problem: Posed, outcome: Outcome) -> tuple[float, float]:
    """Of two designs as they are, the better one comes first: by violation, then by objective."""
    value = problem.sign * outcome.checked.objective
    worth = -math.inf if problem.objective is None else math.inf if math.isnan(value) else value
    return sum(outcome.checked.violations.values()), worth


def _with_stability(solution: Solution, options: Options, began: float, policy: Policy) -> Solution:
    """Of a search for stability that found none: whether there is any, and the design that one leads to."""
    problem = solution.problem.posed
    if solution.stable is not False or solution.any_stable is False or not solution.stability_sought:
        return solution
    from tmsopt.global_search.stability import find_stable_design  # a tenth of all imports, which few problems need

    begin(options.progress, "looking for a stable design", "s")
    asked = find_stable_design(problem, options.stability, solution.parameters, options.progress)
    if asked.design is not None:
        words = "branch and bound found the stable design from which this one was reached"
        solution = _follow(solution, asked.design, words, options, policy)
    elif asked.any is False:
        solution = replace(solution, notes=(*solution.notes, f"that none is stable is proved {asked.proof}"))
    if asked.failed:
        words = f"whether any design is stable is not known: {asked.failed}"
        solution = replace(solution, notes=(*solution.notes, words))
    return replace(solution, stable_elsewhere=asked.any, seconds=time.perf_counter() - began)


def _follow(solution: Solution, design: Mapping[str, float], words: str, options: Options, policy: Policy) -> Solution:
    """Where a design leads that the search has missed, if that is better."""
    problem = solution.problem.posed
    few = replace(options, starts=min(options.starts, _NEAR), stability=0.0, alone=False, interruptible=False)
    found = solve_any_status(problem, replace(few, near=design), policy=policy)
    gain = problem.sign * (solution.value - found.value)
    better = found.status == "optimal" and (solution.status != "optimal" or gain > 0)
    return replace(found, notes=(*found.notes, words)) if better else solution


def _winner(problem: Posed, found: Sequence[Found]) -> Outcome | None:
    """The best design of all parts of the box, with the starts of all of them."""
    best: Outcome | None = None
    for state, outcome in found:
        if outcome is not None and (best is None or beats(problem, outcome, best, state.tuning)):
            best = outcome
    if best is None or len(found) == 1:
        return best
    starts = count_starts([end for state, _ in found for end in state.ends], math.nan)
    return replace(best, starts=replace(starts, at_best=best.starts.at_best))


def _side_values(found: Sequence[Found]) -> dict[str, float]:
    """The best objective of each part of the box; nan where it has no optimal design."""
    named = {state.side: outcome for state, outcome in found if state.side}
    return {n: o.checked.objective if o and o.status == "optimal" else math.nan for n, o in named.items()}


def _sides_note(problem: Posed, found: Sequence[Found], best: Outcome) -> tuple[str, ...]:
    """Which part of the box the best design is in, and what the other one offers."""
    won = next((state.side for state, o in found if o and o.parameters == best.parameters), None)
    if len(found) == 1 or won is None or best.status != "optimal":
        return ()
    sentences = [f"both signs were searched: {won} wins"]
    for state, outcome in found:
        if state.side == won:
            continue
        if outcome is None or outcome.checked.violations:
            stable = "stable and " if problem.asks_radius else ""
            sentences.append(f"with {state.side} nothing {stable}feasible was found")
        elif problem.objective is None:
            sentences.append(f"there is one with {state.side} too")
        elif same_objective(outcome.checked.objective, best.checked.objective, objective_size(problem)):
            return (f"both signs were searched: {state.side} is as good as {won}",)
        else:
            which = "the best" if outcome.status == "optimal" else "what was found"
            asked = unit_at(problem, problem.minimize or problem.maximize or "", outcome.parameters)
            sentences.append(f"{which} with {state.side} is {asked.show(outcome.checked.objective, 6)}")
    return ("; ".join(sentences),)


def _assembled(
    problem: Posed,
    outcome: Outcome,
    notes: tuple[str, ...],
    sides: dict[str, float],
    began: float,
    bound: bool = True,
) -> Solution:
    parameters, checked, lost = held(problem, outcome.parameters, outcome.checked, outcome.cases)
    outcome = replace(outcome, parameters=parameters, checked=checked)
    numbers = certified_numbers(problem, outcome.parameters, checked, outcome.cases)
    told = math.isclose(numbers.value, checked.objective, rel_tol=_TOLD, abs_tol=_TOLD)
    if outcome.status == "optimal" and problem.free and problem.objective is not None and not told:
        outcome = replace(outcome, status="not_converged", notes=(*outcome.notes, UNCLEAR))
    optimal, listed = outcome.status == "optimal", bool(problem.scenarios or problem.tolerances)
    name, worst = user_structure_name(problem.model, checked.structure.name), checked.worst.applied(parameters)
    whole = polynomial_structure(problem.model, name, numbers.roots).roots
    met = every_meeting(problem, worst, whole, () if checked.crossing else checked.violations)
    edges, certain = stands_on(problem, worst, checked.structure, optimal, numbers.abscissa, met)
    return Solution(
        problem=problem.problem,
        status=outcome.status,
        value=numbers.value,
        parameters=Table(outcome.parameters),
        abscissa=numbers.abscissa,
        abscissa_realised=numbers.realised,
        roots=without_rounding(problem.model, numbers.roots),
        structure=name,
        active=Table(outcome.active),
        violations=checked.amounts,
        missed=Table(lost),
        bound=known_bound(problem, outcome.status, numbers.value) if bound else Bound(),
        starts=outcome.starts,
        seconds=time.perf_counter() - began,
        quantities=numbers.quantities,
        dimensionless=numbers.dimensionless,
        formulation=outcome.formulation,
        freedom=degrees_of_freedom(problem),
        branches=outcome.branches,
        notes=(*outcome.notes, *missed_note(problem, lost), *notes, *_stability_note(problem, checked, edges, optimal)),
        worst=checked.worst if listed else None,
        least_damped=checked.least_damped if listed else None,
        fastest=checked.fastest if listed and problem.asks(ANGULAR_FREQUENCY) else None,
        sides=Table(sides),
        relaxation=outcome.relaxation,
        meetings=met,
        edges=edges,
        edge_is_exact=certain,
        multiple_as_rounded=bool(met) and not problem.free and not is_exactly_multiple(problem, worst, whole),
        without_best=outcome.without_best,
        si=numbers.si,
    )


def _stability_note(problem: Posed, checked: Evaluation, edges: Sequence[str], optimal: bool) -> tuple[str, ...]:
    if "coefficients" in checked.violations:
        return ("a coefficient has no value at this design; keep away from what divides by 0, or has no root",)
    if "a0" in checked.violations:
        return (f"the mass matrix is singular (a0 = 0), so a root is at infinity; {mass_advice(problem)}",)
    asked = [n for n, c in problem.conditions.items() if n in checked.violations and "abscissa" in c.names]
    unstable = (UNSTABLE,) if asked and checked.structure.abscissa >= 0 else ()
    beyond = beyond_axis(problem.model, problem.located, checked.structure.roots) if optimal else None
    if beyond:
        another = "root has real part" if problem.model.carrier is None else "eigenfrequency has gain"
        return (f"not the edge of stability: another {another} {unit_of(problem, 'abscissa').show(beyond, 2)}",)
    if unstable or not optimal or checked.structure.abscissa < 0:
        return unstable
    largest = max((r.size for r in checked.structure.roots), default=0.0)
    found = stability((checked.structure.abscissa, checked.realised), edges, largest=largest)
    if problem.free and (problem.minimize or "").strip() == "abscissa":
        least = "no design that decays was found in the box; whether those of abscissa 0 grow depends on multiple roots"
        return (least if found.on_edge else "no stable design was found in the box; this is the least unstable one",)
    return () if found.on_edge else ("the design is not stable: abscissa >= 0",)
