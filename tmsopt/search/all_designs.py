"""Find all designs with a pattern in a box: with a proof, or from many starts with an estimate of missed designs."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from typing import Any, Unpack

import numpy as np

from tmsopt.chains import family_of, find_point, nearest_crossing, targets_of
from tmsopt.errors import input_error, is_number, short
from tmsopt.evaluation.recheck import recheck
from tmsopt.global_search import Completeness, prove_completeness
from tmsopt.global_search.chain_equations import MAX_PROVED_SIZE, prove_point
from tmsopt.global_search.completeness import SECONDS
from tmsopt.problem import Posed, ProblemSource, Solution, degrees_of_freedom, pose
from tmsopt.problem.real_form import has_real_form, real_form
from tmsopt.problem.symmetry import reduce_problem
from tmsopt.problem.validate import MIN_SIZE
from tmsopt.program import NLP, CommonOptions, Options, formulate_matching, make_options
from tmsopt.program.formulate import design_of
from tmsopt.program.options import documents_options
from tmsopt.program.starts import complete_starts, sample_box
from tmsopt.progress import ReportCount, begin
from tmsopt.records import Array, Table, Tabular, plain
from tmsopt.roots import composition
from tmsopt.search.all_points import prove_all_points
from tmsopt.search.local_search import solve_from
from tmsopt.search.locate import REACH_OF_CROSSING, has_chains, has_equalities
from tmsopt.search.newton import build_square_system, estimate_error, find_zero, make_zero
from tmsopt.search.solve import make_solution
from tmsopt.search.state import SearchState, Start, clip_to_box, is_close

MAX_STARTS = 1024
"""Largest number of starts."""

_DEFAULTS = Options(starts=MAX_STARTS)
_MIN_STARTS = 48
_MIN_HITS = 3  # starts that must lead to each solution before the search may end
_SAME_DESIGN = 1e-7  # relative to each range: designs that differ less are one solution
_MAX_OVERSHOOT = 1e-9  # relative to a range: a solution this far outside it still counts as inside
_STARTS_PER_IPOPT_RUN = 4  # IPOPT finds solutions that Newton's method misses
_MIN_ERROR = 1e-15  # smallest relative error bound of a parameter and of the abscissa
_DEVIATIONS = 2.0  # standard deviations by which the bound exceeds the estimated chance, for 95 % confidence
_UNSEEN_EVENTS = 3.0  # −ln 5 %: an event seen in none of n starts has a chance below 3/n, with 95 % confidence


@dataclass(frozen=True)
class Coverage:
    """How completely a search from many starts covered the solutions.

    Attributes:
        starts: number of starts, spread evenly over the box.
        hits: number of starts that led to each solution.
        expected: estimated number of solutions in all, from `hits` (Boender and Rinnooy Kan 1987); not a proof.
        chance: upper bound of the chance that one more start finds a new solution, with 95 % confidence.
        singular: number of starts that ended only at designs where the equations are singular: in a continuum of
            solutions, or where two solutions coincide. These designs do not count as solutions.
        crossings: number of starts that ended only where roots meet without the Jordan chain of an exceptional point.
    """

    starts: int
    hits: tuple[int, ...]
    expected: float
    chance: float
    singular: int = 0
    crossings: int = 0

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        data = plain(self)
        expected = round(self.expected, 4) if math.isfinite(self.expected) else None
        return data | {"expected": expected, "chance": round(self.chance, 6)}


@dataclass(frozen=True, repr=False)
class Every(Tabular):
    """All solutions that were found.

    Attributes:
        solutions: ordered by their parameters if the list is proved to be complete, else the most frequent first.
        coverage: how completely the search covered the solutions; None without a search.
        completeness: result of the proof; None without a proof.
        proved: for each solution, whether it is proved to exist.
        errors: for each solution, error bounds of its free parameters and its abscissa.

    Example:
        >>> every = tmsopt.solve_all("problems/coupled_pair.toml")
        >>> sorted(round(design.parameters["c2"], 9) for design in every.solutions)
        [-1.1, -1.1, 1.1, 1.1]

    More: docs/how_to/all_designs.md
    """

    solutions: tuple[Solution, ...]
    coverage: Coverage | None = None
    completeness: Completeness | None = None
    proved: tuple[bool, ...] = ()
    errors: tuple[Table[float], ...] = ()

    @property
    def complete(self) -> bool:
        """Whether it is proved that there are no other solutions."""
        return self.completeness is not None and self.completeness.complete

    def records(self) -> Iterable[dict[str, Any]]:
        """One row for each design."""
        for solution, proved in zip(self.solutions, self._proved_flags(), strict=True):
            values = {"abscissa": solution.abscissa, "structure": solution.structure, "stable": solution.stable}
            yield {**solution.parameters, **values, "proved": proved}

    def _proved_flags(self) -> tuple[bool, ...]:
        return self.proved or (False,) * len(self.solutions)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``: each solution with ``proved``; also ``complete`` and ``undecided``."""
        data = plain(self)
        for solution, proved in zip(data["solutions"], self._proved_flags(), strict=True):
            solution["proved"] = proved
        proof = self.completeness
        return data | {"complete": self.complete, "undecided": len(proof.undecided) if proof else None}


@documents_options(CommonOptions, _DEFAULTS)
def solve_all(problem: ProblemSource, *, seconds: float = SECONDS, **options: Unpack[CommonOptions]) -> Every:
    """Find every design in the box with the located pattern, if the pattern leaves no freedom.

    Interval branch and prune proves which designs exist and that there is no other. If it takes too long, Newton's
    method starts from designs spread over the box, with every assignment of their roots to factors, and IPOPT from some
    of them. The search ends when each solution was found three times and the estimate expects no others, or after
    `starts`. Solutions with the same parameters and exchanged factors count as one.

    Args:
        seconds: time limit of the proof; 0 skips the proof.
        options: ``starts`` at most, `MAX_STARTS` by default, ``seed``, ``linear_solver`` and ``progress``; see
            `tmsopt.Options`.

    Raises:
        InputError: for a problem without a located pattern, with freedom left, or with a constraint on a quantity that
            has no formula.

    Example:
        >>> swing = tmsopt.models.from_coefficients([1, "c", 1])  # (s + 1)² and (s - 1)²
        >>> every = tmsopt.solve_all(tmsopt.Problem(swing, free={"c": (-3, 3)}, locate="EP2"))
        >>> sorted(round(design.parameters["c"], 9) for design in every.solutions)
        [-2.0, 2.0]

    More: docs/how_to/all_designs.md
    """
    problem = pose(problem)
    if not is_number(seconds):
        raise input_error(f"found {short(seconds)}; accepted: a number of seconds", "seconds")
    _check_isolated(problem)
    if not has_chains(problem):
        _build_equations(real_form(problem).problem)
    own_options = make_options(options, defaults=_DEFAULTS)
    begin(own_options.progress, "proving that no design is missed", "s")
    proof = prove_all_points(problem) if seconds > 0 else None
    if proof is None and seconds > 0 and has_real_form(problem.model):
        proof = _prove_completeness(problem, seconds, own_options.progress)
    proved_entries = list[_IsolatedDesign]()
    for intervals in proof.designs if proof else ():
        errors = {n: float(x.radius) for n, x in intervals.items()} | {"abscissa": 0.0}
        design = clip_to_box(problem, {n: float(x) for n, x in intervals.items()})
        proved_entries.append(_IsolatedDesign(_drop_tiny(design), errors))
    search_entries, coverage = (
        ([], None) if proof and (proof.complete or proof.stopped) else _search_starts(problem, own_options)
    )
    proof_only_entries = [
        entry for entry in proved_entries if not any(entry.is_same(problem, other) for other in search_entries)
    ]
    if coverage:
        coverage = replace(coverage, hits=(*coverage.hits, *[0] * len(proof_only_entries)))
    can_prove = seconds > 0 and has_chains(problem) and problem.model.degree <= MAX_PROVED_SIZE
    solutions, proved_flags, bounds = list[Solution](), list[bool](), list[Table[float]]()
    for entry in (*search_entries, *proof_only_entries):
        solution = make_solution(problem, entry.design)
        matches = [other for other in proved_entries if entry.is_same(problem, other)]
        is_proved = bool(matches) or (can_prove and prove_point(problem, problem.ordered(entry.design)) is not None)
        errors = entry.errors | (matches[0].errors if matches else {})
        largest_root = max((r.size for r in solution.roots), default=0.0)
        sizes = {n: abs(solution.parameters[n]) for n in problem.free} | {"abscissa": largest_root}
        solutions.append(solution)
        proved_flags.append(is_proved)
        bounds.append(Table({n: max(errors.get(n, 0.0), _MIN_ERROR * x) for n, x in sizes.items()}))
    return Every(tuple(solutions), coverage, proof, tuple(proved_flags), tuple(bounds))


@dataclass(eq=False)
class _IsolatedDesign:
    """A solution: its free parameters, error bounds of these and of the abscissa, and how many starts led to it."""

    design: dict[str, float]
    errors: dict[str, float]
    hits: int = 0

    def is_same(self, problem: Posed, other: "_IsolatedDesign") -> bool:
        return is_close(problem, self.design, other.design, _SAME_DESIGN)


@dataclass
class _End:
    """Where a start ended: free parameters, whether the solution is isolated there, and a function for its errors."""

    design: dict[str, float]
    is_isolated: bool
    estimate_errors: Callable[[], dict[str, float]]


def _search_starts(problem: Posed, options: Options) -> tuple[list[_IsolatedDesign], Coverage]:
    """Search from many starts; return the solutions found, the most frequent first, and the coverage."""
    progress = options.progress
    begin(progress, "searching", "start")
    find_ends = _find_chain_ends if has_chains(problem) and not has_equalities(problem) else _find_factor_ends
    entries = list[_IsolatedDesign]()
    start_count = singular = crossings = 0
    for ends in find_ends(problem, options):
        reached_entries = set[_IsolatedDesign]()
        found_singular = found_crossing = False
        for end in ends:
            entry = _IsolatedDesign(end.design, {})
            match = next((other for other in entries if entry.is_same(problem, other)), None)
            if end.is_isolated and match:
                reached_entries.add(match)
                continue
            checked = recheck(problem, problem.ordered(end.design))
            if checked.is_crossing or not end.is_isolated:
                found_singular, found_crossing = (
                    found_singular or not checked.violations,
                    found_crossing or checked.is_crossing,
                )
            elif not checked.violations:
                entry.errors = end.estimate_errors()
                entries.append(entry)
                reached_entries.add(entry)
        for entry in reached_entries:
            entry.hits += 1
        singular += found_singular and not reached_entries
        crossings += found_crossing and not reached_entries
        start_count += 1
        if progress:
            progress(start_count, options.starts)
        if _is_covered(start_count, [entry.hits for entry in entries]):
            break
    entries.sort(key=lambda entry: -entry.hits)
    coverage = estimate_coverage(start_count, [entry.hits for entry in entries], singular)
    return entries, replace(coverage, crossings=crossings)


def _find_factor_ends(problem: Posed, options: Options) -> Iterator[list[_End]]:
    """The ends of Newton's method on the factors, and of IPOPT, for each start."""
    problem = real_form(problem).problem
    nlp = _build_equations(problem)
    state, system = SearchState(problem, problem, nlp, options), build_square_system(nlp)
    assert system is not None  # as many conditions as parameters

    def errors_at(x: Array) -> dict[str, float]:
        # An angle's error is at most its tangent's; the other variables are the factors' coefficients.
        errors = estimate_error(system, x).tolist()
        own_errors = dict(zip(problem.free, errors, strict=False))
        return own_errors | {"abscissa": max(errors[len(problem.free) :], default=0.0)}

    for number, start in enumerate(islice(sample_box(problem, options.seed), options.starts)):
        zeros = [find_zero(system, x) for x in complete_starts(nlp, problem, start)]
        if number % _STARTS_PER_IPOPT_RUN == 0 and (local := solve_from(state, Start(start, near=False))).feasible:
            zeros.append(find_zero(system, local.run.x) or make_zero(system, local.run.x))
        ends = ((zero, _take_design(problem, nlp, zero.x)) for zero in zeros if zero)
        yield [_End(design, zero.is_isolated, partial(errors_at, zero.x)) for zero, design in ends if design]


def _find_chain_ends(problem: Posed, options: Options) -> Iterator[list[_End]]:
    """The point that each start reaches by Jordan chains; where eigenvalues meet without a chain, that design."""
    assert problem.pattern is not None
    family, targets = family_of(problem), targets_of(problem.pattern.name, problem.model.is_complex)
    rng = np.random.default_rng(options.seed)
    for number, start in enumerate(islice(sample_box(problem, options.seed), options.starts)):
        choice = rng if number % 2 else None
        point = find_point(family, targets, np.array([start[n] for n in problem.free]), choice)
        overshoot = _MAX_OVERSHOOT * family.widths
        low, high = family.box.T
        if point is None or np.any((point.p < low - overshoot) | (point.p > high + overshoot)):
            yield []
            continue
        design = dict(zip(problem.free, np.clip(point.p, low, high).tolist(), strict=True))
        if not point.is_found:
            design = nearest_crossing(problem, problem.pattern, problem.ordered(design), REACH_OF_CROSSING)
        yield [_End(_drop_tiny(design), point.is_isolated, partial(point.estimate_errors, list(problem.free)))]


def _prove_completeness(problem: Posed, seconds: float, progress: ReportCount | None) -> Completeness:
    """Prove that no design is missed; with a symmetry, in the real problem that it leaves."""
    reduced = reduce_problem(problem) or problem
    if degrees_of_freedom(reduced).of_equations != 0:
        return Completeness(False, "branch and prune does not use the symmetry that holds here")
    if reduced is problem:
        return prove_completeness(problem, seconds, progress)
    proof = prove_completeness(reduced, seconds, progress)
    # proved designs are no crossings: with two eigenvectors the adjugate is 0, and the reduced equations are singular
    order = max(c for _, c, _ in composition(str(problem.pattern and problem.pattern.name)))
    if proof.complete and 2 * order <= problem.model.degree:
        reason = (
            "points at which two conjugate eigenfrequencies are multiple, off the line of symmetry, are not excluded"
        )
        return replace(proof, complete=False, reason=reason)
    return proof


def _check_isolated(problem: Posed) -> None:
    """Check that a problem asks for isolated solutions.

    Raises:
        InputError: if the solutions of the problem are not isolated.
    """
    freedom = degrees_of_freedom(problem)
    if problem.pattern is None or problem.objective is not None:
        order = min(max(len(problem.free) + 1, 2), problem.model.degree)  # as many conditions as free parameters
        needed = f"needs a pattern and no objective; write e.g. locate = 'EP{order}' instead of minimize or maximize"
        raise input_error(needed, "objective")
    if problem.cases:
        raise input_error("scenarios and tolerances leave no isolated solutions; remove them", "parameters")
    if freedom.kind != "square":
        advice = "free fewer, or add == constraints" if freedom.count > 0 else "free more, or drop conditions"
        free = f"{freedom.free} free parameter{'' if freedom.free == 1 else 's'}"
        raise input_error(
            f"{free} and {freedom.describe_conditions()} do not give isolated solutions; {advice}", "parameters"
        )


def _build_equations(problem: Posed) -> NLP:
    """Return the equations of a problem.

    Raises:
        InputError: if a constraint needs the roots.
    """
    nlp = formulate_matching(problem)
    if nlp.contacts:
        fault = f"the constraints use {', '.join(nlp.contacts)}, which only the roots define"
        accepted = "parameters, coefficients, and quantities with a formula in these"
        advice = "rewrite the constraints, or use solve, which finds one design and names other solutions"
        raise input_error(f"{fault}; accepted: {accepted}; {advice}", "constraints")
    return nlp


def _drop_tiny(design: Mapping[str, float]) -> dict[str, float]:
    """Replace numbers that are too small for a problem by 0."""
    return {n: x if abs(x) >= MIN_SIZE else 0.0 for n, x in design.items()}


def _take_design(problem: Posed, nlp: NLP, x: Array) -> dict[str, float] | None:
    """The free parameters of a solution; None if the solution is outside the box."""
    parameters, lower, upper = (np.array(values[: len(problem.free)]) for values in (x, nlp.lower, nlp.upper))
    is_outside = np.any(np.maximum(lower - parameters, parameters - upper) > _MAX_OVERSHOOT * (upper - lower))
    return None if is_outside else _drop_tiny(design_of(problem, x.tolist()))


def _is_covered(start_count: int, hits: list[int]) -> bool:
    """Whether more starts are unlikely to find another solution."""
    if start_count < _MIN_STARTS:
        return False
    return not hits or (min(hits) >= _MIN_HITS and _estimate_total(hits) <= len(hits) + 0.5)


def _estimate_total(hits: list[int]) -> float:
    """Estimated number of solutions, w (n − 1)/(n − w − 2), from w different ones met n times in all."""
    w, n = len(hits), sum(hits)
    return w * (n - 1) / (n - w - 2) if n > w + 2 else math.inf if w else 0.0


def estimate_coverage(start_count: int, hits: list[int], singular: int = 0) -> Coverage:
    """Estimate the coverage of a search; the chance of a new solution follows Good and Turing (Good 1953)."""
    hit_once, hit_twice = (sum(h == k for h in hits) for k in (1, 2))
    # Turing's estimate of the chance is `hit_once` / `start_count`; this is the standard deviation of `hit_once`.
    deviation = math.sqrt(hit_once + 2 * hit_twice)
    chance = min(1.0, (hit_once + _DEVIATIONS * deviation + _UNSEEN_EVENTS) / max(start_count, 1))
    return Coverage(start_count, tuple(hits), _estimate_total(hits), chance, singular)
