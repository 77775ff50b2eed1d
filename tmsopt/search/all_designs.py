"""All designs with a pattern in a box: proved to be all, or as far as many starts find them and what these cover."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Unpack

import numpy as np

from tmsopt.algebra.balls import Number
from tmsopt.errors import Fault, InputError, is_number, short
from tmsopt.evaluation.recheck import recheck
from tmsopt.global_search.completeness import SECONDS, Completeness, prove_completeness
from tmsopt.problem.files import Given, pose
from tmsopt.problem.freedom import degrees_of_freedom
from tmsopt.problem.problem import Posed
from tmsopt.problem.solution import Solution
from tmsopt.problem.validate import SMALLEST
from tmsopt.program.formulate import design_of, matching
from tmsopt.program.nlp import NLP
from tmsopt.program.options import Asked, Options, documents_options, options_of
from tmsopt.program.starts import completions, spread
from tmsopt.progress import begin
from tmsopt.records import Array, Table, Tabular, plain
from tmsopt.search.local import run_from
from tmsopt.search.newton import error, newton, newton_step, square_system
from tmsopt.search.solve import solve_any_status
from tmsopt.search.state import SearchState, Start

MOST = 1024
"""Starts at most."""

_DEFAULTS = Options(starts=MOST)
_FEWEST = 48
_AGAIN = 3  # times that every solution must have been met before the search may end
_SAME = 1e-7  # of the box: distance of designs that are one solution, whatever their factors are called
_INSIDE = 1e-9  # of the box: how far outside an end counts as on it
_BY_IPOPT = 4  # every so many starts, IPOPT is asked too: it reaches what Newton's method runs away from
_ROUNDING = 1e-15  # relative, of a double and of a root
_DEVIATIONS = 2.0  # beyond the estimate: with `_NEVER`, 95 % for few solutions and for many, alike and unlike
_NEVER = 3.0  # −ln 5 %: what was met in none of n starts is met in fewer than 3/n of them, with 95 %


@dataclass(frozen=True)
class Coverage:
    """What a search of many starts says about what it has not found.

    Attributes:
        starts: designs that were started from, spread evenly over the box.
        hits: starts that led to each solution.
        expected: number of solutions to be expected in all, from how often each was met (Boender and Rinnooy Kan
            1987); it is an estimate, not a proof.
        chance: with 95 % confidence, the chance that one more start finds another is smaller.
        singular: starts that ended at designs with the pattern where the equations are singular, and at no other: one
            of a continuum of solutions, or one where two meet. These are not counted as solutions.
        crossings: starts that ended where roots meet without the Jordan chain of an exceptional point, and at no other.
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
    """All solutions that were found.

    Attributes:
        solutions: in the order of their parameters where they are proved to be all, else those met most often first.
        coverage: of the search; None where there was none.
        completeness: of the proof; None where none was asked for.
        proved: of each solution, whether it is proved to exist.
        errors: of each solution, how far its free parameters and its abscissa may be off.

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
        """Whether these are proved to be all."""
        return self.completeness is not None and self.completeness.complete

    def records(self) -> Iterable[dict[str, Any]]:
        """The designs, one a row."""
        for solution, proved in zip(self.solutions, self._known(), strict=True):
            found = {"abscissa": solution.abscissa, "structure": solution.structure, "stable": solution.stable}
            yield {**solution.parameters, **found, "proved": proved}

    def _known(self) -> tuple[bool, ...]:
        return self.proved or (False,) * len(self.solutions)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``: each solution with ``proved``, beside them ``complete`` and ``undecided``."""
        found = plain(self)
        for solution, proved in zip(found["solutions"], self._known(), strict=True):
            solution["proved"] = proved
        known = self.completeness
        return found | {"complete": self.complete, "undecided": len(known.undecided) if known else None}


@documents_options(Asked, _DEFAULTS)
def solve_all(problem: Given, *, seconds: float = SECONDS, **options: Unpack[Asked]) -> Every:
    """Every design in the box with the pattern that a problem locates, where that leaves no freedom.

    Interval branch and prune shows which designs there are, and that there is no other. Where it does not come to an
    end in time, Newton's method runs from designs spread over the box with every way to share out their roots, and
    IPOPT from some of them, until each solution was met three times and an estimate expects no more, or after `starts`.
    Solutions are told apart by their parameters, so factors that change places are no other solution.

    Args:
        seconds: for the proof at most; 0 for the search alone.
        options: ``starts`` at most, `MOST` by default, ``seed``, ``linear_solver`` and ``progress``; see
            `tmsopt.Options`.

    Raises:
        InputError: for a problem that locates no pattern, leaves freedom, or constrains a quantity without a formula.

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
    nlp = _posed(problem)
    state = SearchState(problem, problem, nlp, options_of(options, defaults=_DEFAULTS))
    begin(state.options.progress, "proving that no design is missed", "s")
    proof = prove_completeness(problem, seconds, state.options.progress) if seconds > 0 else None
    proved = [] if proof is None else [_clipped(problem, design) for design in proof.designs]
    known = proof is not None and (proof.complete or proof.stopped)
    found, errors, coverage = ([], [], None) if known else _search(problem, nlp, state)
    width = np.array([hi - lo for lo, hi in problem.free.values()])
    new = [x for x in proved if not any(_same(x, y, width) for y in found)]
    if coverage:
        coverage = replace(coverage, hits=(*coverage.hits, *(0 for _ in new)))
    solutions = tuple(_solution(problem, _named(problem, x)) for x in [*found, *new])
    told = tuple(any(_same(x, y, width) for y in proved) for x in [*found, *new])
    radii = [{n: float(x.radius) for n, x in design.items()} for design in proof.designs] if proof else []
    proofs = [next((r for r, y in zip(radii, proved, strict=True) if _same(x, y, width)), {}) for x in [*found, *new]]
    each = zip(solutions, [*errors, *({} for _ in new)], proofs, strict=True)
    return Every(solutions, coverage, proof, told, tuple(_errors(s, own, radius) for s, own, radius in each))


def _errors(solution: Solution, own: Mapping[str, float], radius: Mapping[str, float]) -> Table[float]:
    """What a proof says of a parameter, or else the search; a double is rounded, and so are roots."""
    size = max((r.size for r in solution.roots), default=0.0)
    least = {n: abs(solution.parameters[n]) for n in solution.problem.free} | {"abscissa": size}
    known = {**own, **radius, **({"abscissa": 0.0} if radius else {})}
    return Table({n: max(known.get(n, 0.0), _ROUNDING * x) for n, x in least.items()})


def _search(problem: Posed, nlp: NLP, state: SearchState) -> tuple[list[Array], list[dict[str, float]], Coverage]:
    """Solutions that many starts lead to, those met most often first, and their errors."""
    starts, progress = state.options.starts, state.options.progress
    begin(progress, "searching", "start")
    system = square_system(nlp)
    assert system is not None  # as many conditions as parameters
    width = np.array([hi - lo for lo, hi in problem.free.values()])
    found: list[Array] = []
    errors: list[dict[str, float]] = []
    hits: list[int] = []
    done = singular = crossings = 0
    for design in spread(problem, state.options.seed):
        if done >= starts or _covered(done, hits):
            break
        ends = [newton(system, x) for x in completions(nlp, problem, design)]
        if done % _BY_IPOPT == 0:
            ended = run_from(state, Start(design, near=False))
            ends.append((newton(system, ended.run.x) or newton_step(system, ended.run.x)) if ended.feasible else None)
        met: set[int] = set()
        doubtful = crossed = False
        for end in ends:
            point = None if end is None else _inside(problem, nlp, end.x)
            if end is None or point is None:
                continue
            if not end.isolated:
                checked = recheck(problem, problem.ordered(_named(problem, point)))
                doubtful, crossed = doubtful or not checked.violations, crossed or checked.crossing
                continue
            known = next((k for k, other in enumerate(found) if _same(point, other, width)), None)
            if known is None:
                if recheck(problem, problem.ordered(_named(problem, point))).violations:
                    continue
                known = len(found)
                found.append(point)
                errors.append(_off(problem, error(system, end.x)))
                hits.append(0)
            met.add(known)
        for k in met:
            hits[k] += 1
        singular += doubtful and not met
        crossings += crossed and not met
        done += 1
        if progress:
            progress(done, starts)
    order = np.argsort([-h for h in hits], kind="stable")
    coverage = coverage_of(done, [hits[k] for k in order], singular)
    return [found[k] for k in order], [errors[k] for k in order], replace(coverage, crossings=crossings)


def _off(problem: Posed, off: Array) -> dict[str, float]:
    """Errors of free parameters, of an angle no greater than that of its tangent, and of the roots."""
    own = dict(zip(problem.free, off.tolist(), strict=False))
    return own | {"abscissa": max(off[len(own) :].tolist(), default=0.0)}


def _posed(problem: Posed) -> NLP:
    """The equations of a problem; refused where they are not those of single solutions in the parameters alone."""
    counted = degrees_of_freedom(problem)
    if problem.pattern is None or problem.objective is not None:
        order = min(
            max(len(problem.free) + 1, 2), problem.model.degree
        )  # as many conditions as there are free parameters
        message = (
            f"all solutions are those of a pattern; write locate = 'EP{order}', or another, and no minimize or maximize"
        )
        raise InputError([Fault(message, ("objective",))])
    if counted.kind != "square" or problem.cases:
        advice = "free fewer, or add == constraints" if counted.count > 0 else "free more, or ask for less"
        free = f"{counted.free} free parameter{'' if counted.free == 1 else 's'}"
        conditions = f"{counted.conditions} condition{'' if counted.conditions == 1 else 's'}"
        message = f"{free} and {conditions} do not make single solutions; {advice}"
        raise InputError([Fault(message, ("parameters",))])
    nlp = matching(problem)
    if nlp.touches:
        found = f"the constraints use {', '.join(nlp.touches)}, which only the roots define"
        accepted = "parameters, coefficients, and quantities with a formula in these"
        advice = "write them so, or ask for one design alone by solve, which names other solutions too"
        raise InputError([Fault(f"{found}; accepted: {accepted}; {advice}", ("constraints",))])
    return nlp


def _same(one: Array, other: Array, width: Array) -> bool:
    return bool(np.max(np.abs(one - other) / width) <= _SAME)


def _clipped(problem: Posed, design: Mapping[str, Number]) -> Array:
    """A proved design as doubles in the box."""
    return np.array([min(max(float(design[n]), lo), hi) for n, (lo, hi) in problem.free.items()])


def _named(problem: Posed, point: Array) -> dict[str, float]:
    """What is nearer to 0 than any number of a problem is 0."""
    return {n: x if abs(x) >= SMALLEST else 0.0 for n, x in zip(problem.free, point.tolist(), strict=True)}


def _inside(problem: Posed, nlp: NLP, x: Array) -> Array | None:
    """The free parameters of a solution in the box; None for one outside."""
    lower, upper = (np.array(ends[: len(problem.free)]) for ends in (nlp.lower, nlp.upper))
    room = _INSIDE * (upper - lower)
    own = x[: len(problem.free)]
    if np.any(own < lower - room) or np.any(own > upper + room):
        return None
    return np.array(list(design_of(problem, x.tolist()).values()))


def _covered(done: int, hits: list[int]) -> bool:
    """Whether more starts would be waste."""
    if done < _FEWEST:
        return False
    return not hits or (min(hits) >= _AGAIN and _expected(hits) <= len(hits) + 0.5)


def _expected(hits: list[int]) -> float:
    """w (n − 1)/(n − w − 2) solutions in all, for w different ones among n that were met."""
    w, n = len(hits), sum(hits)
    return w * (n - 1) / (n - w - 2) if n > w + 2 else math.inf if w else 0.0


def coverage_of(done: int, hits: list[int], singular: int = 0) -> Coverage:
    once, twice = (sum(h == k for h in hits) for k in (1, 2))
    deviation = math.sqrt(once + 2 * twice)  # of n times the chance, which Turing estimates by `once` (Good 1953)
    chance = min(1.0, (once + _DEVIATIONS * deviation + _NEVER) / max(done, 1))
    return Coverage(done, tuple(hits), _expected(hits), chance, singular)


def _solution(problem: Posed, design: Mapping[str, float]) -> Solution:
    """A design with its standing: of the same problem, where nothing is free."""
    fixed = solve_any_status(problem.derive(fixed=problem.ordered(design), free={}, start={}))
    return replace(fixed, problem=problem.problem, freedom=degrees_of_freedom(problem), formulation="matching")
