"""Solve a design problem, and recheck the solution independently of the solver."""

import math
import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Unpack

from tmsopt.boundaries import find_edges, is_exactly_multiple
from tmsopt.chains.meetings import all_meetings
from tmsopt.errors import Fault, InputError, is_number, short, suggest
from tmsopt.evaluation import missed_note, prove_worst_case
from tmsopt.evaluation.bound import minimizes_abscissa
from tmsopt.evaluation.digits import certified_numbers
from tmsopt.evaluation.exclusion import bound_without_search
from tmsopt.evaluation.recheck import Evaluation, recheck
from tmsopt.evaluation.stored import find_storable_design
from tmsopt.models.user_spectrum import distance_beyond_axis
from tmsopt.problem import (
    Bound,
    NotSolved,
    Posed,
    ProblemSource,
    Solution,
    as_solvable,
    degrees_of_freedom,
    unit_at,
    unit_of,
)
from tmsopt.problem.dependence import sense_notes
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, RADIUS
from tmsopt.problem.real_form import RealForm, has_real_form, real_form
from tmsopt.problem.symmetry import find_symmetry
from tmsopt.problem.verdict.stability import stability
from tmsopt.program import DEFAULTS, Options, SolveOptions, make_options, objective_size
from tmsopt.program.options import documents_options
from tmsopt.progress import Listener, begin, steps_for
from tmsopt.records import Table
from tmsopt.search.locate import has_chains, locate_by_chains
from tmsopt.search.outcome import UNCLEAR, Outcome, assess_design, choose_outcome, write_mass_advice
from tmsopt.search.policy import Policy, check_policy
from tmsopt.search.remedies.infeasible import explain_infeasible
from tmsopt.search.remedies.required_speed import add_required_speed
from tmsopt.search.search import POLICY, search_part
from tmsopt.search.state import SearchState, begin_search, same_objective
from tmsopt.search.stopping import count_starts

UNSTABLE = "no stable design was found that meets the other limits"
"""Note for a problem with a limit on stability and no stable design found."""

_SOLVE_DEFAULTS = replace(DEFAULTS, stability=5.0, interruptible=True)
# If a value in doubles differs from the exact value by more, relatively and absolutely, rounding errors determine it.
_VALUE_TOLERANCE = 1e-6
SearchedPart = tuple[SearchState, Outcome | None]
"""The final state of the search of one part of the box, and its best design."""

_STARTS_NEAR = 4  # starts at and near a design that branch and bound found


@documents_options(SolveOptions, _SOLVE_DEFAULTS)
def solve(
    problem: ProblemSource, *, throw: bool = True, policy: Policy = POLICY, **options: Unpack[SolveOptions]
) -> Solution:
    """Find the best design, from several starts, and check it independently of the solver.

    Ctrl-C stops the search. The result is then the best design so far, with the status ``not_converged`` and
    `interrupted` = True. A second Ctrl-C stops immediately.

    Args:
        problem: the problem, or the path of its file.
        throw: whether to raise NotSolved unless the status is ``optimal``; if False, return the best point.
        policy: how to search each part of the box; see `tmsopt.Policy`. Two searches do not use it: the search for the
            largest robustness radius, and the search for the smallest change of limits of an infeasible problem.
        options: ``starts``, ``seed``, ``exhaustive``, ``linear_solver``, ``progress``, ``near``, ``alone``,
            ``stability`` and ``interruptible``; see `tmsopt.Options`.

    Raises:
        NotSolved: with the best point found, if `throw`.
        InputError: for free parameters without an objective, constraint or pattern, or for an invalid policy.
        KeyboardInterrupt: if the user stops the search before any design is found, or if `interruptible` is False.

    Example:
        >>> design = tmsopt.solve("problems/ep4.toml")
        >>> design.structure, f"{design.parameters['chi_B']:.6f}"  # at the square root of 2
        ('EP4', '1.414214')

    More: docs/tutorials/first_bicycle.md
    """
    check_policy(policy)
    problem = as_solvable(problem)
    solution = solve_any_status(problem, make_options(options, SolveOptions, _SOLVE_DEFAULTS), policy=policy)
    if throw and solution.status != "optimal":
        raise NotSolved(solution)
    return solution


def solve_any_status(
    problem: ProblemSource,
    options: Options = DEFAULTS,
    extra_starts: Sequence[Mapping[str, float]] = (),
    without_sample: bool = False,
    skipped_parts: Collection[str] = (),
    with_bound: bool = True,
    policy: Policy = POLICY,
) -> Solution:
    """Solve a problem or a file; raise no error if it has no optimum. Return a `Solution` unchanged.

    Args:
        extra_starts: designs to start from that may be close to the optimum.
        without_sample: whether to start only from these designs and from the problem's start; this also skips
            `add_worst_case_proof`.
        skipped_parts: parts of the box that are not searched, such as ``normal rake``.
        with_bound: whether to add a bound on the best possible objective.
    """
    if isinstance(problem, Solution):
        return problem
    problem = as_solvable(problem)
    began = time.perf_counter()
    if not problem.free:
        return add_worst_case_proof(
            _assemble(problem, assess_design(problem, {}, is_fixed=True), (), {}, began, with_bound)
        )
    if options.near:
        _check_near(problem, options.near)
        near = {n: min(max(options.near[n], lo), hi) for n, (lo, hi) in problem.free.items() if n in options.near}
        options = replace(options, near=near)
    if (
        has_chains(problem)
        and (policy.local is POLICY.local or problem.model.polynomial is None)
        and (outcome := locate_by_chains(problem, options, extra_starts))
    ):
        notes = (*sense_notes(problem), *_describe_hermitian(problem))
        return _assemble(problem, outcome, notes, {}, began, with_bound)
    form = real_form(problem) if _needs_polynomial(problem) else RealForm(problem)
    policy = replace(policy, sample=lambda _: None) if without_sample else policy
    solution = _search_box(form.problem, options, extra_starts, skipped_parts, with_bound, policy)
    if not (without_sample or solution.interrupted):
        solution = add_worst_case_proof(solution)
    if options.stability and not (solution.interrupted or options.near):
        solution = _seek_stability(solution, options, began, policy)
    if form.problem is problem:
        return solution
    solution = form.to_user(solution, problem)
    if solution.status == "optimal" and problem.pattern is not None:
        checked = recheck(problem, solution.parameters)  # the polynomial has rounding errors of its own
        if problem.pattern.name in checked.violations:
            solution = replace(solution, status="not_converged", violations=checked.amounts)
    return solution


def _needs_polynomial(problem: Posed) -> bool:
    """Whether a search uses factors of the polynomial, although matrices may have none."""
    return any(problem.asks(name) for name in (RADIUS, "damping_ratio", ANGULAR_FREQUENCY))


def _search_box(
    problem: Posed,
    options: Options,
    extra_starts: Sequence[Mapping[str, float]],
    skipped_parts: Collection[str],
    with_bound: bool,
    policy: Policy,
) -> Solution:
    """Search the parts of the box by factors of the polynomial; the arguments are those of `solve_any_status`."""
    began = time.perf_counter()
    states = [
        s for s in begin_search(problem, options, tuple(extra_starts), policy.tuning) if s.side not in skipped_parts
    ]
    searched_parts = _search_sides(states, policy)
    best, is_interrupted = _pick_best(problem, searched_parts), any(state.interrupted for state, _ in searched_parts)
    try:
        if is_interrupted:
            raise KeyboardInterrupt
        outcome = best or explain_infeasible(problem, [state for state, _ in searched_parts], policy)
    except KeyboardInterrupt:
        if not options.interruptible:
            raise
        is_interrupted, outcome = True, _find_best_so_far(problem, searched_parts, best)
    sampled_count = sum(len(state.sample.box.draws) for state, _ in searched_parts if state.sample)
    outcome = replace(outcome, starts=replace(outcome.starts, looked=sampled_count))
    notes = (*_describe_sides(problem, searched_parts, outcome), *sense_notes(problem))
    objective_by_side = {
        state.side: o.checked.objective if o and o.status == "optimal" else math.nan
        for state, o in searched_parts
        if state.side
    }
    solution = _assemble(problem, outcome, notes, objective_by_side, began, with_bound)
    return replace(solution, interrupted=is_interrupted)


def _seek_stability(solution: Solution, options: Options, began: float, policy: Policy) -> Solution:
    """Search for a stable design and for the speed that it needs, if stability was sought and not reached."""
    try:
        solution = _search_stable_design(solution, options, began, policy)
        return add_required_speed(solution, options)
    except KeyboardInterrupt:
        if not options.interruptible:
            raise
        words = "the user stopped the search for a stable design"
        return replace(solution, interrupted=True, notes=(*solution.notes, words))


def _describe_hermitian(problem: Posed) -> tuple[str, ...]:
    """A note if an exceptional point of a Hermitian matrix is sought."""
    if not (problem.locate and "EP" in problem.locate and find_symmetry(problem).is_hermitian):
        return ()
    return ("H is Hermitian up to a multiple of 1 for all parameters, so it has no exceptional point",)


def _check_near(problem: Posed, near: Mapping[str, float]) -> None:
    """Check the design in the option `near`: its keys must be parameters, its values must be numbers.

    Raises:
        InputError: with all faults.
    """
    names = problem.parameter_set.names
    faults = [Fault(f"unknown parameter '{n}'; {suggest(str(n), names)}", ("near",)) for n in near if n not in names]
    no_numbers = ((n, value) for n, value in near.items() if not is_number(value))
    faults += [Fault(f"found {short(value)}; accepted: a finite number", ("near", n)) for n, value in no_numbers]
    if faults:
        raise InputError(faults)


def _search_sides(states: Sequence[SearchState], policy: Policy) -> list[SearchedPart]:
    """Search the parts of the box, beginning with the part that has the best sampled design; return all in order."""
    if len(states) > 1:
        begin(states[0].options.progress, "looking at designs")
        states = [replace(state, sample=policy.sample(state)) for state in states]
    searched_parts: dict[str, SearchedPart] = {}
    for state in sorted(states, key=lambda state: state.sample.rank if state.sample else (0.0, 0.0)):
        searched_parts[state.side] = search_part(state, policy)
        if searched_parts[state.side][0].interrupted:
            break
    return [searched_parts[state.side] for state in states if state.side in searched_parts]


def add_worst_case_proof(solution: Solution) -> Solution:
    """Try to prove that an optimum has no worse case between the listed cases; add the result to the optimum."""
    problem = solution.problem.posed
    has_cases = bool(problem.scenarios or problem.tolerances)
    if solution.status != "optimal" or solution.cover or not has_cases or not has_real_form(problem.model):
        return solution
    return replace(solution, cover=prove_worst_case(real_form(problem).problem, solution.parameters, solution.abscissa))


def solve_if_needed(problem: ProblemSource, progress: Listener | None) -> Solution:
    """Solve a problem or a file with default options, as `solve_any_status`. Return a `Solution` unchanged."""
    return solve_any_status(problem, replace(DEFAULTS, progress=steps_for(progress)))


def evaluate_design(problem: Posed, design: Mapping[str, float], note: str) -> Solution:
    """Recheck a design that this search did not find. Its status is ``infeasible`` or ``not_converged``."""
    return _assemble(problem, assess_design(problem, design, note), (), {}, time.perf_counter())


def make_solution(problem: Posed, design: Mapping[str, float]) -> Solution:
    """The solution at a design that satisfies the equations of the located pattern."""
    outcome = replace(assess_design(problem, design, is_fixed=True), formulation="matching")
    return _assemble(problem, outcome, (), {}, time.perf_counter())


def _find_best_so_far(problem: Posed, searched_parts: Sequence[SearchedPart], outcome: Outcome | None) -> Outcome:
    """Return the best design of an interrupted search, among the ends and the sampled designs.

    Raises:
        KeyboardInterrupt: if there is no design yet.
    """

    def rank(outcome: Outcome) -> tuple[float, float]:
        """By violation, then by objective."""
        value = problem.sign * outcome.checked.objective
        return sum(outcome.checked.violations.values()), math.inf if math.isnan(value) else value

    designs: list[Mapping[str, float]] = [outcome.parameters] if outcome else []
    for state, _ in searched_parts:
        designs += [state.design_at(end) for end in sorted(state.ends, key=lambda end: end.rank)[:1]]
        designs += [state.sample.box.design(state.sample.refined)] if state.sample else []
    if not designs:
        raise KeyboardInterrupt
    best = min((assess_design(problem, design) for design in designs), key=rank)
    ends = [end for state, _ in searched_parts for end in state.ends]
    count = f"{len(ends)} start{'' if len(ends) == 1 else 's'} of the solver"
    words = f"the user stopped the search after {count}; this is the best design so far"
    formulation = searched_parts[0][0].nlp.formulation if ends else "none"
    starts = count_starts(ends, problem.sign * best.checked.objective)
    return replace(best, starts=starts, formulation=formulation, notes=(words,))


def _search_stable_design(solution: Solution, options: Options, began: float, policy: Policy) -> Solution:
    """If no stable design was found, search for one by branch and bound, and solve again from it."""
    problem = solution.problem.posed
    if not has_real_form(problem.model):
        return solution
    if solution.stable is not False or solution.any_stable is False or not solution.stability_sought:
        return solution
    from tmsopt.global_search.stability import find_stable_design  # slow to import, rarely needed

    begin(options.progress, "looking for a stable design", "s")
    answer = find_stable_design(real_form(problem).problem, options.stability, solution.parameters, options.progress)
    if answer.design is not None:
        words = "this design was reached from a stable design that branch and bound found"
        solution = _solve_near(solution, answer.design, words, options, policy)
    elif answer.exists is False:
        solution = replace(solution, notes=(*solution.notes, f"no stable design exists, proved {answer.proof}"))
    if answer.failure:
        words = f"the search for a stable design failed: {answer.failure}"
        solution = replace(solution, notes=(*solution.notes, words))
    return replace(solution, stable_elsewhere=answer.exists, seconds=time.perf_counter() - began)


def _solve_near(
    solution: Solution, design: Mapping[str, float], words: str, options: Options, policy: Policy
) -> Solution:
    """Solve again near a design that the search missed; return the new solution if it is better, else the old one."""
    problem = solution.problem.posed
    short_options = replace(
        options, starts=min(options.starts, _STARTS_NEAR), stability=0.0, alone=False, interruptible=False
    )
    new_solution = solve_any_status(problem, replace(short_options, near=design), policy=policy)
    gain = problem.sign * (solution.value - new_solution.value)
    is_better = new_solution.status == "optimal" and (solution.status != "optimal" or gain > 0)
    return replace(new_solution, notes=(*new_solution.notes, words)) if is_better else solution


def _pick_best(problem: Posed, searched_parts: Sequence[SearchedPart]) -> Outcome | None:
    """Return the best design of all parts of the box; its starts are counted over all parts."""
    best = choose_outcome(problem, [outcome for _, outcome in searched_parts], searched_parts[0][0].tuning)
    if best is None or len(searched_parts) == 1:
        return best
    starts = count_starts([end for state, _ in searched_parts for end in state.ends], math.nan)
    return replace(best, starts=replace(starts, at_best=best.starts.at_best))


def _describe_sides(problem: Posed, searched_parts: Sequence[SearchedPart], best: Outcome) -> tuple[str, ...]:
    """Write a note that says which part of the box has the best design, and what the other part has."""
    best_side = next((state.side for state, o in searched_parts if o and o.parameters == best.parameters), None)
    if len(searched_parts) == 1 or best_side is None or best.status != "optimal":
        return ()
    sentences = [f"{best_side} is better"]
    for state, outcome in searched_parts:
        if state.side == best_side:
            continue
        if outcome is None or outcome.checked.violations:
            stable = "stable and " if problem.asks_radius else ""
            sentences.append(f"no {stable}feasible design with {state.side} was found")
        elif problem.objective is None:
            sentences.append(f"{state.side} has a solution too")
        elif same_objective(outcome.checked.objective, best.checked.objective, objective_size(problem)):
            return (f"both signs of the tilt were searched: {state.side} is as good as {best_side}",)
        else:
            value = unit_at(problem, problem.goal, outcome.parameters).show(outcome.checked.objective, 6)
            sentences.append(f"the search with {state.side} found {problem.goal} = {value}")
    return ("; ".join(sentences),)


def _assemble(
    problem: Posed,
    outcome: Outcome,
    notes: tuple[str, ...],
    objective_by_side: dict[str, float],
    began: float,
    with_bound: bool = True,
) -> Solution:
    """Round the design of an outcome to doubles, compute its exact numbers, and make the `Solution`."""
    parameters, checked, rounding_excess = find_storable_design(
        problem, outcome.parameters, outcome.checked, outcome.cases
    )
    outcome = replace(outcome, parameters=parameters, checked=checked)
    numbers = certified_numbers(problem, outcome.parameters, checked, outcome.cases)
    is_confirmed = math.isclose(numbers.value, checked.objective, rel_tol=_VALUE_TOLERANCE, abs_tol=_VALUE_TOLERANCE)
    if outcome.status == "optimal" and problem.free and problem.objective is not None and not is_confirmed:
        outcome = replace(outcome, status="not_converged", notes=(*outcome.notes, UNCLEAR))
    is_optimal, has_cases = outcome.status == "optimal", bool(problem.scenarios or problem.tolerances)
    worst_parameters = checked.worst.applied(parameters)
    multiple_roots = all_meetings(
        problem, worst_parameters, numbers.roots, () if checked.is_crossing else checked.violations
    )
    edges, is_certain = find_edges(
        problem, worst_parameters, checked.structure, is_optimal, numbers.abscissa, multiple_roots
    )
    return Solution(
        problem=problem.problem,
        status=outcome.status,
        value=numbers.value,
        parameters=Table(outcome.parameters),
        abscissa=numbers.abscissa,
        abscissa_realised=numbers.abscissa_realised,
        roots=numbers.roots,
        structure=checked.structure.name,
        active=Table(outcome.active_gains),
        violations=checked.amounts,
        missed=Table(rounding_excess),
        bound=bound_without_search(problem, outcome.status, numbers.value) if with_bound else Bound(),
        starts=outcome.starts,
        seconds=time.perf_counter() - began,
        quantities=numbers.quantities,
        dimensionless=numbers.dimensionless,
        formulation=outcome.formulation,
        freedom=degrees_of_freedom(problem),
        branches=outcome.branches,
        notes=(
            *outcome.notes,
            *missed_note(problem, rounding_excess),
            *notes,
            *_describe_stability(problem, checked, edges, is_optimal),
        ),
        worst=checked.worst if has_cases else None,
        least_damped=checked.least_damped if has_cases else None,
        fastest=checked.fastest if has_cases and problem.asks(ANGULAR_FREQUENCY) else None,
        sides=Table(objective_by_side),
        relaxation=outcome.relaxation,
        meetings=multiple_roots,
        edges=edges,
        edge_is_exact=is_certain,
        multiple_as_rounded=bool(multiple_roots)
        and not problem.free
        and not is_exactly_multiple(problem, worst_parameters, numbers.roots),
        without_best=outcome.has_no_best_design,
        si=numbers.si,
    )


def _describe_stability(problem: Posed, checked: Evaluation, edges: Sequence[str], is_optimal: bool) -> tuple[str, ...]:
    """Write a note on the stability of a design; none if there is nothing to say."""
    if "coefficients" in checked.violations:
        return (
            "a coefficient has no value at this design; add a constraint that excludes a division by 0 or a square "
            "root of a negative number",
        )
    if "a0" in checked.violations:
        return (f"the mass matrix is singular (a0 = 0), so a root is at infinity; {write_mass_advice(problem)}",)
    violated_limits = [n for n, c in problem.conditions.items() if n in checked.violations and "abscissa" in c.names]
    unstable_note = (UNSTABLE,) if violated_limits and checked.structure.abscissa >= 0 else ()
    real_part = distance_beyond_axis(problem.model, problem.located, checked.structure.roots) if is_optimal else None
    if real_part:
        text = unit_of(problem, "abscissa").show(real_part, 2)
        return (f"not the edge of stability: another root has real part {text}",)
    is_sought = is_optimal and problem.free and minimizes_abscissa(problem)
    if unstable_note or not is_sought or checked.structure.abscissa < 0:
        return unstable_note
    largest = max((r.size for r in checked.structure.roots), default=0.0)
    verdict = stability((checked.structure.abscissa, checked.abscissa_realised), edges, largest=largest)
    edge_note = "no design that decays was found in the box; at abscissa 0, multiple roots decide whether motions grow"
    return (edge_note if verdict.on_edge else "no stable design was found in the box; this is the least unstable one",)
