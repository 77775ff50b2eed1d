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
from tmsopt.evaluation.recheck import Evaluation, recheck
from tmsopt.evaluation.stored import held, missed_note
from tmsopt.evaluation.worst_case import cover
from tmsopt.models.user_spectrum import beyond_axis, polynomial_structure, user_structure_name, without_rounding
from tmsopt.problem.advice.senses import sense_notes
from tmsopt.problem.files import Given, as_solvable
from tmsopt.problem.freedom import degrees_of_freedom
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY
from tmsopt.problem.searches import Starts
from tmsopt.problem.solution import Bound, Solution
from tmsopt.problem.unit_system import unit_at, unit_of
from tmsopt.problem.verdict.meetings import every_meeting
from tmsopt.problem.verdict.stability import stability
from tmsopt.problem.verdict.status import NotSolved
from tmsopt.program.formulate import design_of
from tmsopt.program.nlp import objective_size
from tmsopt.program.options import DEFAULTS, AskedOfSolve, Options, documents_options, options_of
from tmsopt.progress import Listener, begin, steps_for
from tmsopt.records import Table
from tmsopt.search.multistart import rank, same_objective
from tmsopt.search.outcome import (
    UNCLEAR,
    Outcome,
    best_checked,
    better,
    counted,
    evaluated,
    evaluated_cases,
    mass_advice,
)
from tmsopt.search.remedies.needs import add_required_speed
from tmsopt.search.rescues import rescued_by
from tmsopt.search.search import Explored, answered, explore, without_any
from tmsopt.search.workspace import Workspace, check_near, workspace

UNSTABLE = "no stable design was found that meets the other limits"
"""Of a design that is not stable though a limit asks for it."""

_ASKING = replace(DEFAULTS, stability=5.0, interruptible=True)
_WAIT = 1.0  # seconds after an interrupt in which the best of where starts ended is looked for
_SEEN, _SAME = 3, 1e-9  # designs of a sample that may be the best then; what an end must promise more than the best has
_TOLD = 1e-6  # relative and absolute: difference of a value in doubles from the exact one, above which rounding decided
_NEAR = 4  # starts where branch and bound found a stable design, that design the first of them


@documents_options(AskedOfSolve, _ASKING)
def solve(problem: Given, *, throw: bool = True, **options: Unpack[AskedOfSolve]) -> Solution:
    """Find the best design, from several starts, and check it independently of the solver.

    Ctrl-C ends the search with the best design so far, ``not_converged`` and `interrupted`; a second one ends that too.

    Args:
        problem: or the path of its file.
        throw: raise NotSolved unless the status is ``optimal``; otherwise return the best point with its status.
        options: ``starts``, ``seed``, ``exhaustive``, ``linear_solver``, ``progress``, ``near``, ``alone``,
            ``stability`` and ``interruptible``; see `tmsopt.Options`.

    Raises:
        NotSolved: carrying the best point found, when `throw`.
        InputError: when parameters are free and nothing is asked of them.
        KeyboardInterrupt: when the user ends it before there is any design, or `interruptible` is False.

    Example:
        >>> design = tmsopt.solve("problems/ep4.toml")
        >>> design.structure, f"{design.parameters['chi_B']:.6f}"  # at the square root of 2
        ('EP4', '1.414214')

    More: docs/tutorials/first_bicycle.md
    """
    problem = as_solvable(problem)
    solution = solve_any_status(problem, options_of(options, AskedOfSolve, _ASKING))
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
    notes: tuple[str, ...] = ()
    values: dict[str, float] = {}
    interrupted = False
    if problem.free:
        if options.near:
            check_near(problem, options.near)
            near = {n: min(max(options.near[n], lo), hi) for n, (lo, hi) in problem.free.items() if n in options.near}
            options = replace(options, near=near)
        work = workspace(problem, options, extra_starts, without_sample)
        parts = [part for part in work.parts(options.near) if part.name not in without]
        explored: list[Explored] = []
        try:
            for part in _promising(parts, options):
                met = [e.finding.checked for e in explored if e.finding and not e.finding.checked.violations]
                stable = any(checked.structure.abscissa < 0 for checked in met)
                explored.append(explore(part, insist=not stable))
            explored.sort(key=lambda e: [part.name for part in parts].index(e.name))
            finding = _winner(problem, explored) or without_any(work, sum(len(e.candidates) for e in explored))
        except KeyboardInterrupt:
            so_far = _so_far(parts) if options.interruptible else None
            if so_far is None:
                raise
            finding, interrupted = so_far, True
        looked = sum(part.sampler.count for part in parts if part.sampler)
        finding = replace(finding, starts=replace(finding.starts, looked=looked))
        notes = (*_sides_note(problem, explored, finding), *sense_notes(problem))
        values = _side_values(explored)
    else:
        finding = evaluated(problem, evaluated_cases(problem, problem.ordered({})))
    solution = replace(_assembled(problem, finding, notes, values, began, bound), interrupted=interrupted)
    solution = solution if without_sample else covered(solution)
    if interrupted or not options.stability or options.near:  # which keeps to its side of the box
        return solution
    try:
        judged = _with_stability(solution, options, began)
        needy, missed = add_required_speed(judged, options, partial(answered, asked=problem, thorough=True))
        words = "a search for the least speed found the stable design from which this one was reached"
        return _led(needy, missed, words, options) if missed else needy
    except KeyboardInterrupt:
        if not options.interruptible:
            raise
        words = "the user stopped the question whether any design is stable"
        return replace(solution, interrupted=True, notes=(*solution.notes, words))


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
    began = time.perf_counter()
    return _assembled(problem, replace(_as_it_is(problem, design), notes=(note,)), (), {}, began)


def _as_it_is(problem: Posed, design: Mapping[str, float]) -> Outcome:
    parameters = problem.ordered(design)
    cases = evaluated_cases(problem, parameters)
    checked = recheck(problem, parameters, cases)
    status = "infeasible" if checked.violations else "not_converged"
    return Outcome(parameters, checked, status, {}, Starts(), "none", cases)


def _so_far(parts: Sequence[Workspace]) -> Outcome | None:
    """The best design that an interrupted search has met: of those looked at before, and where starts ended."""
    problem, met, end = parts[0].problem, parts[0].met, time.perf_counter() + _WAIT
    looked = [(part.sampler, vars(part).get("sample")) for part in parts]  # not to be made for this
    seen = [(of, s.refined, row) for of, s in looked if of and s for row in range(min(len(s.refined), _SEEN))]
    found = [_as_it_is(problem, of.design(refined, row)) for of, refined, row in seen]
    best = min(found, key=partial(_order, problem), default=None)
    for nlp, candidate in sorted((m for m in met if math.isfinite(m[1].objective)), key=lambda m: rank(m[1])):
        if best and candidate.feasible and _order(problem, best) <= (0.0, candidate.objective + _SAME):
            continue
        if best and time.perf_counter() > end:
            break
        trial = best_checked(parts[0], nlp, [candidate])
        own = _as_it_is(problem, design_of(problem, (trial.point if trial else candidate.run).x.tolist()))
        best = min([*([best] if best else []), own], key=partial(_order, problem))
    if best is None:
        return None
    starts = counted([end for _, end in met], problem.sign * best.checked.objective)
    words = f"the user stopped the search after {len(met)} starts; this is the best design so far"
    return replace(best, starts=starts, formulation=met[0][0].formulation if met else "none", notes=(words,))


def _order(problem: Posed, finding: Outcome) -> tuple[float, float]:
    """Of two designs as they are, the better one comes first: by violation, then by objective."""
    value = problem.sign * finding.checked.objective
    worth = -math.inf if problem.objective is None else math.inf if math.isnan(value) else value
    return sum(finding.checked.violations.values()), worth


def _with_stability(solution: Solution, options: Options, began: float) -> Solution:
    """Of a search for stability that found none: whether there is any, and the design that one leads to."""
    problem = solution.problem.posed
    if (
        solution.stable is not False
        or solution.any_stable is False
        or not solution.stability_sought
        or not rescued_by("branch and bound")
    ):
        return solution
    from tmsopt.global_search.stability import any_stable  # a tenth of all imports, which few problems need

    begin(options.progress, "looking for a stable design", "s")
    asked = any_stable(problem, options.stability, solution.parameters, options.progress)
    if asked.design is not None:
        words = "branch and bound found the stable design from which this one was reached"
        solution = _led(solution, asked.design, words, options)
    elif asked.any is False:
        solution = replace(solution, notes=(*solution.notes, f"that none is stable is proved {asked.proof}"))
    if asked.failed:
        words = f"whether any design is stable is not known: {asked.failed}"
        solution = replace(solution, notes=(*solution.notes, words))
    return replace(solution, stable_elsewhere=asked.any, seconds=time.perf_counter() - began)


def _led(solution: Solution, design: Mapping[str, float], words: str, options: Options) -> Solution:
    """Where a design leads that the search has missed, if that is better."""
    problem = solution.problem.posed
    few = replace(options, starts=min(options.starts, _NEAR), stability=0.0, alone=False, interruptible=False)
    found = solve_any_status(problem, replace(few, near=design))
    gain = problem.sign * (solution.value - found.value)
    better = found.status == "optimal" and (solution.status != "optimal" or gain > 0)
    return replace(found, notes=(*found.notes, words)) if better else solution


def _promising(parts: Sequence[Workspace], options: Options) -> Sequence[Workspace]:
    """Parts of the box by what was seen of them: where one has a stable design, none need be insisted on in others."""
    if len(parts) == 1:
        return parts
    begin(options.progress, "looking at designs")
    seen = [part.sample.refined if part.sample else None for part in parts]
    ranks = [(s.violation[0], s.worth[0]) if s else (0.0, 0.0) for s in seen]
    return [parts[k] for k in sorted(range(len(parts)), key=ranks.__getitem__)]


def _winner(problem: Posed, explored: Sequence[Explored]) -> Outcome | None:
    """The best of the findings of all parts of the box, with the starts of all of them."""
    best: Outcome | None = None
    for part in explored:
        if part.finding is not None and (best is None or better(problem, part.finding, best)):
            best = part.finding
    if best is None or len(explored) == 1:
        return best
    every = [c for part in explored for c in part.candidates]
    return replace(best, starts=replace(counted(every, math.nan), at_best=best.starts.at_best))


def _side_values(explored: Sequence[Explored]) -> dict[str, float]:
    """The best objective of each part of the box; nan where it has no optimal design."""
    found = {part.name: part.finding for part in explored if part.name}
    return {n: f.checked.objective if f and f.status == "optimal" else math.nan for n, f in found.items()}


def _sides_note(problem: Posed, explored: Sequence[Explored], finding: Outcome) -> tuple[str, ...]:
    """Which part of the box the best design is in, and what the other one offers."""
    won = next((part for part in explored if part.finding and part.finding.parameters == finding.parameters), None)
    if len(explored) == 1 or won is None or finding.status != "optimal":
        return ()
    sentences = [f"both signs were searched: {won.name} wins"]
    for part in explored:
        if part is not won:
            if part.finding is None or part.finding.checked.violations:
                stable = "stable and " if problem.asks_radius else ""
                sentences.append(f"with {part.name} nothing {stable}feasible was found")
            elif problem.objective is None:
                sentences.append(f"there is one with {part.name} too")
            elif same_objective(part.finding.checked.objective, finding.checked.objective, objective_size(problem)):
                return (f"both signs were searched: {part.name} is as good as {won.name}",)
            else:
                found = "the best" if part.finding.status == "optimal" else "what was found"
                asked = unit_at(problem, problem.minimize or problem.maximize or "", part.finding.parameters)
                sentences.append(f"{found} with {part.name} is {asked.show(part.finding.checked.objective, 6)}")
    return ("; ".join(sentences),)


def _assembled(
    problem: Posed,
    finding: Outcome,
    notes: tuple[str, ...],
    sides: dict[str, float],
    began: float,
    bound: bool = True,
) -> Solution:
    parameters, checked, lost = held(problem, finding.parameters, finding.checked, finding.cases)
    finding = replace(finding, parameters=parameters, checked=checked)
    numbers = certified_numbers(problem, finding.parameters, checked, finding.cases)
    told = math.isclose(numbers.value, checked.objective, rel_tol=_TOLD, abs_tol=_TOLD)
    if finding.status == "optimal" and problem.free and problem.objective is not None and not told:
        finding = replace(finding, status="not_converged", notes=(*finding.notes, UNCLEAR))
    optimal, listed = finding.status == "optimal", bool(problem.scenarios or problem.tolerances)
    name, worst = user_structure_name(problem.model, checked.structure.name), checked.worst.applied(parameters)
    whole = polynomial_structure(problem.model, name, numbers.roots).roots
    met = every_meeting(problem, worst, whole, () if checked.crossing else checked.violations)
    edges, certain = stands_on(problem, worst, checked.structure, optimal, numbers.abscissa, met)
    return Solution(
        problem=problem.problem,
        status=finding.status,
        value=numbers.value,
        parameters=Table(finding.parameters),
        abscissa=numbers.abscissa,
        abscissa_realised=numbers.realised,
        roots=without_rounding(problem.model, numbers.roots),
        structure=name,
        active=Table(finding.active),
        violations=checked.amounts,
        missed=Table(lost),
        bound=known_bound(problem, finding.status, numbers.value) if bound else Bound(),
        starts=finding.starts,
        seconds=time.perf_counter() - began,
        quantities=numbers.quantities,
        dimensionless=numbers.dimensionless,
        formulation=finding.formulation,
        freedom=degrees_of_freedom(problem),
        branches=finding.branches,
        notes=(*finding.notes, *missed_note(problem, lost), *notes, *_stability_note(problem, checked, edges, optimal)),
        worst=checked.worst if listed else None,
        least_damped=checked.least_damped if listed else None,
        fastest=checked.fastest if listed and problem.asks(ANGULAR_FREQUENCY) else None,
        sides=Table(sides),
        relaxation=finding.relaxation,
        meetings=met,
        edges=edges,
        edge_is_exact=certain,
        multiple_as_rounded=bool(met) and not problem.free and not is_exactly_multiple(problem, worst, whole),
        without_best=finding.without_best,
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
    largest = max((math.hypot(r.re, r.im) for r in checked.structure.roots), default=0.0)
    found = stability((checked.structure.abscissa, checked.realised), edges, largest=largest)
    if problem.free and (problem.minimize or "").strip() == "abscissa":
        least = "no design that decays was found in the box; whether those of abscissa 0 grow depends on multiple roots"
        return (least if found.on_edge else "no stable design was found in the box; this is the least unstable one",)
    return () if found.on_edge else ("the design is not stable: abscissa >= 0",)
