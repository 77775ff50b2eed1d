"""All designs with a pattern in a box: proved complete, or those that many starts find, with an estimate of others."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any, Unpack

import numpy as np

from tmsopt.errors import input_error, is_number, short
from tmsopt.evaluation.recheck import recheck
from tmsopt.global_search import Completeness, prove_completeness
from tmsopt.global_search.completeness import SECONDS
from tmsopt.problem import Given, Posed, Solution, degrees_of_freedom, pose
from tmsopt.problem.validate import SMALLEST
from tmsopt.program import NLP, CommonOptions, Options, formulate_matching, make_options
from tmsopt.program.formulate import design_of
from tmsopt.program.options import documents_options
from tmsopt.program.starts import complete_starts, sample_box
from tmsopt.progress import begin
from tmsopt.records import Array, Table, Tabular, plain
from tmsopt.search.local_search import solve_from
from tmsopt.search.newton import build_square_system, estimate_error, find_zero, make_zero
from tmsopt.search.solve import solve_any_status
from tmsopt.search.state import SearchState, Start, clip_to_box, is_close

MOST = 1024
"""Largest number of starts."""

_DEFAULTS = Options(starts=MOST)
_FEWEST = 48  # starts at least
_MIN_HITS = 3  # of every solution before the search may end
_SAME = 1e-7  # of the box: distance below which two designs are one solution
_INSIDE = 1e-9  # of the box: ends this far outside are moved to its edge
_IPOPT_EVERY = 4  # starts per run of IPOPT, which finds solutions that Newton's method misses
_ROUNDING = 1e-15  # relative, of a double and of a root
_DEVIATIONS = 2.0  # added to the estimate: with `_NEVER`, 95 % for few or many solutions, equally likely or not
_NEVER = 3.0  # −ln 5 %: an event seen in none of n starts has a chance below 3/n, with 95 % confidence


@dataclass(frozen=True)
class Coverage:
    """How completely a search of many starts covered the solutions.

    Attributes:
        starts: number of starts, spread evenly over the box.
        hits: number of starts that led to each solution.
        expected: estimated number of solutions in all, from `hits` (Boender and Rinnooy Kan 1987); not a proof.
        chance: upper bound of the chance that one more start finds a new solution, with 95 % confidence.
        singular: starts that ended only at designs with the pattern and singular equations: in a continuum of
            solutions, or where two meet. These are not counted as solutions.
        crossings: starts that ended only where roots meet without the Jordan chain of an exceptional point.
    """

    starts: int
    hits: tuple[int, ...]
    expected: float
    chance: float
    singular: int = 0
    crossings: int = 0

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        found = plain(self)
        expected = round(self.expected, 4) if math.isfinite(self.expected) else None
        return found | {"expected": expected, "chance": round(self.chance, 6)}


@dataclass(frozen=True, repr=False)
class Every(Tabular):
    """All solutions found.

    Attributes:
        solutions: ordered by their parameters if proved complete, else the most frequent first.
        coverage: of the search; None without one.
        completeness: of the proof; None without one.
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
        """Whether these are proved to be all solutions."""
        return self.completeness is not None and self.completeness.complete

    def records(self) -> Iterable[dict[str, Any]]:
        """One row for each design."""
        for solution, proved in zip(self.solutions, self._proved_flags(), strict=True):
            found = {"abscissa": solution.abscissa, "structure": solution.structure, "stable": solution.stable}
            yield {**solution.parameters, **found, "proved": proved}

    def _proved_flags(self) -> tuple[bool, ...]:
        return self.proved or (False,) * len(self.solutions)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``: each solution with ``proved``; also ``complete`` and ``undecided``."""
        found = plain(self)
        for solution, proved in zip(found["solutions"], self._proved_flags(), strict=True):
            solution["proved"] = proved
        proof = self.completeness
        return found | {"complete": self.complete, "undecided": len(proof.undecided) if proof else None}


@documents_options(CommonOptions, _DEFAULTS)
def solve_all(problem: Given, *, seconds: float = SECONDS, **options: Unpack[CommonOptions]) -> Every:
    """Find every design in the box with the located pattern, if the pattern leaves no freedom.

    Interval branch and prune proves which designs exist and that there is no other. If it takes too long, Newton's
    method starts from designs spread over the box, with every assignment of their roots to factors, and IPOPT from some
    of them. This ends when each solution was met three times and the estimate expects no more, or after `starts`.
    Solutions differ in their parameters: exchanged factors do not count.

    Args:
        seconds: time limit of the proof; 0 skips it.
        options: ``starts`` at most, `MOST` by default, ``seed``, ``linear_solver`` and ``progress``; see
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
    nlp = _build_equations(problem)
    state = SearchState(problem, problem, nlp, make_options(options, defaults=_DEFAULTS))
    begin(state.options.progress, "proving that no design is missed", "s")
    proof = prove_completeness(problem, seconds, state.options.progress) if seconds > 0 else None
    proved = list[_Found]()
    for at in proof.designs if proof else ():
        errors = {n: float(x.radius) for n, x in at.items()} | {"abscissa": 0.0}
        proved.append(_Found(_drop_tiny(clip_to_box(problem, {n: float(x) for n, x in at.items()})), errors))
    found, coverage = ([], None) if proof and (proof.complete or proof.stopped) else _search_starts(state)
    new = [one for one in proved if not any(one.is_same(problem, other) for other in found)]
    if coverage:
        coverage = replace(coverage, hits=(*coverage.hits, *[0] * len(new)))
    solutions, exists, bounds = list[Solution](), list[bool](), list[Table[float]]()
    for one in (*found, *new):
        solution = _make_solution(problem, one.design)
        matches = [other for other in proved if one.is_same(problem, other)]
        errors = one.errors | (matches[0].errors if matches else {})
        size = max((r.size for r in solution.roots), default=0.0)
        least = {n: abs(solution.parameters[n]) for n in problem.free} | {"abscissa": size}
        solutions.append(solution)
        exists.append(bool(matches))
        bounds.append(Table({n: max(errors.get(n, 0.0), _ROUNDING * x) for n, x in least.items()}))
    return Every(tuple(solutions), coverage, proof, tuple(exists), tuple(bounds))


@dataclass(eq=False)
class _Found:
    """A solution: its free parameters, error bounds of these and of the abscissa, the starts that led to it."""

    design: dict[str, float]
    errors: dict[str, float]
    hits: int = 0

    def is_same(self, problem: Posed, other: "_Found") -> bool:
        return is_close(problem, self.design, other.design, _SAME)


def _search_starts(state: SearchState) -> tuple[list[_Found], Coverage]:
    """Solutions found from many starts, the most frequent first, and the coverage."""
    problem, nlp, starts, progress = state.problem, state.nlp, state.options.starts, state.options.progress
    begin(progress, "searching", "start")
    system = build_square_system(nlp)
    assert system is not None  # as many conditions as parameters
    found = list[_Found]()
    done = singular = crossings = 0
    for start in islice(sample_box(problem, state.options.seed), starts):
        if _is_covered(done, [one.hits for one in found]):
            break
        ends = [find_zero(system, x) for x in complete_starts(nlp, problem, start)]
        if done % _IPOPT_EVERY == 0 and (local := solve_from(state, Start(start, near=False))).feasible:
            ends.append(find_zero(system, local.run.x) or make_zero(system, local.run.x))
        reached = set[_Found]()
        doubtful = crossed = False
        for end in filter(None, ends):
            design = _take_design(problem, nlp, end.x)
            if design is None:
                continue
            one = _Found(design, {})
            known = next((other for other in found if one.is_same(problem, other)), None)
            if end.isolated and known:
                reached.add(known)
                continue
            checked = recheck(problem, problem.ordered(design))
            if not end.isolated:
                doubtful, crossed = doubtful or not checked.violations, crossed or checked.crossing
            elif not checked.violations:
                # An angle's error is at most its tangent's; the other variables are the factors' coefficients.
                errors = estimate_error(system, end.x).tolist()
                one.errors = dict(zip(problem.free, errors, strict=False))
                one.errors["abscissa"] = max(errors[len(problem.free) :], default=0.0)
                found.append(one)
                reached.add(one)
        for one in reached:
            one.hits += 1
        singular += doubtful and not reached
        crossings += crossed and not reached
        done += 1
        if progress:
            progress(done, starts)
    found.sort(key=lambda one: -one.hits)
    coverage = estimate_coverage(done, [one.hits for one in found], singular)
    return found, replace(coverage, crossings=crossings)


def _build_equations(problem: Posed) -> NLP:
    """The equations of a problem; refuses problems whose solutions are not isolated."""
    counted = degrees_of_freedom(problem)
    if problem.pattern is None or problem.objective is not None:
        order = min(max(len(problem.free) + 1, 2), problem.model.degree)  # as many conditions as free parameters
        needed = f"needs a pattern and no objective; write e.g. locate = 'EP{order}' instead of minimize or maximize"
        raise input_error(needed, "objective")
    if problem.cases:
        raise input_error("scenarios and tolerances leave no isolated solutions; remove them", "parameters")
    if counted.kind != "square":
        advice = "free fewer, or add == constraints" if counted.count > 0 else "free more, or drop conditions"
        free = f"{counted.free} free parameter{'' if counted.free == 1 else 's'}"
        conditions = f"{counted.conditions} condition{'' if counted.conditions == 1 else 's'}"
        raise input_error(f"{free} and {conditions} do not give isolated solutions; {advice}", "parameters")
    nlp = formulate_matching(problem)
    if nlp.contacts:
        found = f"the constraints use {', '.join(nlp.contacts)}, which only the roots define"
        accepted = "parameters, coefficients, and quantities with a formula in these"
        advice = "rewrite the constraints, or use solve, which finds one design and names other solutions"
        raise input_error(f"{found}; accepted: {accepted}; {advice}", "constraints")
    return nlp


def _drop_tiny(design: Mapping[str, float]) -> dict[str, float]:
    """Numbers too small for a problem become 0."""
    return {n: x if abs(x) >= SMALLEST else 0.0 for n, x in design.items()}


def _take_design(problem: Posed, nlp: NLP, x: Array) -> dict[str, float] | None:
    """The free parameters of a solution in the box; None if it is outside."""
    own, lower, upper = (np.array(values[: len(problem.free)]) for values in (x, nlp.lower, nlp.upper))
    outside = np.any(np.maximum(lower - own, own - upper) > _INSIDE * (upper - lower))
    return None if outside else _drop_tiny(design_of(problem, x.tolist()))


def _is_covered(done: int, hits: list[int]) -> bool:
    """Whether more starts are unlikely to find another solution."""
    if done < _FEWEST:
        return False
    return not hits or (min(hits) >= _MIN_HITS and _estimate_total(hits) <= len(hits) + 0.5)


def _estimate_total(hits: list[int]) -> float:
    """Estimated number of solutions, w (n − 1)/(n − w − 2), from w different ones met n times in all."""
    w, n = len(hits), sum(hits)
    return w * (n - 1) / (n - w - 2) if n > w + 2 else math.inf if w else 0.0


def estimate_coverage(done: int, hits: list[int], singular: int = 0) -> Coverage:
    """The coverage of a search, with the chance of a new solution by Good and Turing (Good 1953)."""
    once, twice = (sum(h == k for h in hits) for k in (1, 2))
    deviation = math.sqrt(once + 2 * twice)  # of `once`, Turing's estimate of n times the chance
    chance = min(1.0, (once + _DEVIATIONS * deviation + _NEVER) / max(done, 1))
    return Coverage(done, tuple(hits), _estimate_total(hits), chance, singular)


def _make_solution(problem: Posed, design: Mapping[str, float]) -> Solution:
    """The solution at a design: of the same problem with nothing free."""
    fixed = solve_any_status(problem.derive(fixed=problem.ordered(design), free={}, start={}))
    return replace(fixed, problem=problem.problem, freedom=degrees_of_freedom(problem), formulation="matching")
