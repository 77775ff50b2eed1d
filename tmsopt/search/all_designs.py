"""All designs with a pattern in a box: proved complete, or those that many starts find, with an estimate of others."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Unpack

import numpy as np

from tmsopt.errors import Fault, InputError, is_number, short
from tmsopt.evaluation.recheck import recheck
from tmsopt.global_search.completeness import SECONDS, Completeness, prove_completeness
from tmsopt.problem.files import Given, pose
from tmsopt.problem.freedom import degrees_of_freedom
from tmsopt.problem.problem import Posed
from tmsopt.problem.solution import Solution
from tmsopt.problem.validate import SMALLEST
from tmsopt.program.formulate import design_of, formulate_matching
from tmsopt.program.nlp import NLP
from tmsopt.program.options import CommonOptions, Options, documents_options, make_options
from tmsopt.program.starts import complete_starts, sample_box
from tmsopt.progress import begin
from tmsopt.records import Array, Table, Tabular, plain
from tmsopt.search.local_search import solve_from
from tmsopt.search.newton import build_square_system, estimate_error, find_zero, make_zero
from tmsopt.search.solve import solve_any_status
from tmsopt.search.state import SearchState, Start, clip_to_box

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
        raise InputError([Fault(f"found {short(seconds)}; accepted: a number of seconds", ("seconds",))])
    nlp = _build_equations(problem)
    state = SearchState(problem, problem, nlp, make_options(options, defaults=_DEFAULTS))
    begin(state.options.progress, "proving that no design is missed", "s")
    proof = prove_completeness(problem, seconds, state.options.progress) if seconds > 0 else None
    proved_designs = proof.designs if proof else ()
    proved = [np.array([*clip_to_box(problem, {n: float(x) for n, x in d.items()}).values()]) for d in proved_designs]
    finished = proof is not None and (proof.complete or proof.stopped)
    found, errors, coverage = ([], [], None) if finished else _search_starts(problem, nlp, state)
    width = np.array([hi - lo for lo, hi in problem.free.values()])
    new = [x for x in proved if not any(_is_same(x, y, width) for y in found)]
    if coverage:
        coverage = replace(coverage, hits=(*coverage.hits, *(0 for _ in new)))
    radii = [{n: float(x.radius) for n, x in design.items()} for design in proved_designs]
    solutions, exists, bounds = list[Solution](), list[bool](), list[Table[float]]()
    for x, own in zip([*found, *new], [*errors, *({} for _ in new)], strict=True):
        matches = [radius for y, radius in zip(proved, radii, strict=True) if _is_same(x, y, width)]
        solutions.append(_make_solution(problem, _name_parameters(problem, x)))
        exists.append(bool(matches))
        bounds.append(_combine_errors(solutions[-1], own, matches[0] if matches else {}))
    return Every(tuple(solutions), coverage, proof, tuple(exists), tuple(bounds))


def _combine_errors(solution: Solution, own: Mapping[str, float], radius: Mapping[str, float]) -> Table[float]:
    """Error bounds of a solution: from the proof, else from the search; at least the rounding of doubles and roots."""
    size = max((r.size for r in solution.roots), default=0.0)
    least = {n: abs(solution.parameters[n]) for n in solution.problem.free} | {"abscissa": size}
    errors = {**own, **radius, **({"abscissa": 0.0} if radius else {})}
    return Table({n: max(errors.get(n, 0.0), _ROUNDING * x) for n, x in least.items()})


def _search_starts(
    problem: Posed, nlp: NLP, state: SearchState
) -> tuple[list[Array], list[dict[str, float]], Coverage]:
    """Solutions found from many starts, the most frequent first, with their errors and the coverage."""
    starts, progress = state.options.starts, state.options.progress
    begin(progress, "searching", "start")
    system = build_square_system(nlp)
    assert system is not None  # as many conditions as parameters
    width = np.array([hi - lo for lo, hi in problem.free.values()])
    found: list[Array] = []
    errors: list[dict[str, float]] = []
    hits: list[int] = []
    done = singular = crossings = 0
    for design in sample_box(problem, state.options.seed):
        if done >= starts or _is_covered(done, hits):
            break
        ends = [find_zero(system, x) for x in complete_starts(nlp, problem, design)]
        if done % _IPOPT_EVERY == 0:
            local = solve_from(state, Start(design, near=False))
            ends.append((find_zero(system, local.run.x) or make_zero(system, local.run.x)) if local.feasible else None)
        reached: set[int] = set()
        doubtful = crossed = False
        for end in ends:
            point = None if end is None else _take_parameters(problem, nlp, end.x)
            if end is None or point is None:
                continue
            if not end.isolated:
                checked = recheck(problem, problem.ordered(_name_parameters(problem, point)))
                doubtful, crossed = doubtful or not checked.violations, crossed or checked.crossing
                continue
            row = next((k for k, other in enumerate(found) if _is_same(point, other, width)), None)
            if row is None:
                if recheck(problem, problem.ordered(_name_parameters(problem, point))).violations:
                    continue
                row = len(found)
                found.append(point)
                errors.append(_name_errors(problem, estimate_error(system, end.x)))
                hits.append(0)
            reached.add(row)
        for k in reached:
            hits[k] += 1
        singular += doubtful and not reached
        crossings += crossed and not reached
        done += 1
        if progress:
            progress(done, starts)
    order = np.argsort([-h for h in hits], kind="stable")
    coverage = estimate_coverage(done, [hits[k] for k in order], singular)
    return [found[k] for k in order], [errors[k] for k in order], replace(coverage, crossings=crossings)


def _name_errors(problem: Posed, errors: Array) -> dict[str, float]:
    """Errors by name: of the free parameters and of the abscissa. An angle's error is at most its tangent's."""
    own = dict(zip(problem.free, errors.tolist(), strict=False))
    return own | {"abscissa": max(errors[len(own) :].tolist(), default=0.0)}


def _build_equations(problem: Posed) -> NLP:
    """The equations of a problem; refuses problems whose solutions are not isolated."""
    counted = degrees_of_freedom(problem)
    if problem.pattern is None or problem.objective is not None:
        order = min(max(len(problem.free) + 1, 2), problem.model.degree)  # as many conditions as free parameters
        message = f"needs a pattern and no objective; write e.g. locate = 'EP{order}' instead of minimize or maximize"
        raise InputError([Fault(message, ("objective",))])
    if problem.cases:
        message = "scenarios and tolerances leave no isolated solutions; remove them"
        raise InputError([Fault(message, ("parameters",))])
    if counted.kind != "square":
        advice = "free fewer, or add == constraints" if counted.count > 0 else "free more, or drop conditions"
        free = f"{counted.free} free parameter{'' if counted.free == 1 else 's'}"
        conditions = f"{counted.conditions} condition{'' if counted.conditions == 1 else 's'}"
        message = f"{free} and {conditions} do not give isolated solutions; {advice}"
        raise InputError([Fault(message, ("parameters",))])
    nlp = formulate_matching(problem)
    if nlp.contacts:
        found = f"the constraints use {', '.join(nlp.contacts)}, which only the roots define"
        accepted = "parameters, coefficients, and quantities with a formula in these"
        advice = "rewrite the constraints, or use solve, which finds one design and names other solutions"
        raise InputError([Fault(f"{found}; accepted: {accepted}; {advice}", ("constraints",))])
    return nlp


def _is_same(one: Array, other: Array, width: Array) -> bool:
    return bool(np.max(np.abs(one - other) / width) <= _SAME)


def _name_parameters(problem: Posed, point: Array) -> dict[str, float]:
    """Parameters by name; numbers too small for a problem become 0."""
    return {n: x if abs(x) >= SMALLEST else 0.0 for n, x in zip(problem.free, point.tolist(), strict=True)}


def _take_parameters(problem: Posed, nlp: NLP, x: Array) -> Array | None:
    """The free parameters of a solution in the box; None if it is outside."""
    lower, upper = (np.array(ends[: len(problem.free)]) for ends in (nlp.lower, nlp.upper))
    room = _INSIDE * (upper - lower)
    own = x[: len(problem.free)]
    if np.any(own < lower - room) or np.any(own > upper + room):
        return None
    return np.array(list(design_of(problem, x.tolist()).values()))


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
