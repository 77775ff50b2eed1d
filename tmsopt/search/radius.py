"""The most tolerant designs: climbs by the nearest points of boundaries, from designs of a great radius along rays."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from tmsopt.boundaries.nearest import Nearest, Robustness, find_stability_margins
from tmsopt.problem.cases import Case, weight_of
from tmsopt.problem.problem import Posed, weighted
from tmsopt.problem.quantities import RADIUS
from tmsopt.program.formulate import default_start, formulate
from tmsopt.records import Array, Table
from tmsopt.roots import is_stable
from tmsopt.search.accept import accept_best, check_end
from tmsopt.search.enough import count_starts
from tmsopt.search.local import run_from
from tmsopt.search.policy import Policy
from tmsopt.search.sample import draw_box, stream
from tmsopt.search.state import CheckedEnd, LocalEnd, SearchState, Start, no_end
from tmsopt.search.tuning import Tuning


def climb(state: SearchState, start: Start) -> LocalEnd:
    """Where the nearest boundary points of one design, and those met on the way, lead; not feasible where nowhere."""
    problem, design, points = state.problem, start.design, list[Case]()
    listed = tuple(case for case in problem.cases if not case.direction)
    around: Robustness | None = find_stability_margins(problem, problem.ordered(design))
    end = no_end(start, state.nlp)
    for _ in range(state.tuning.climb_rounds):
        if around is None or not around.stable or _reweighted(problem, around):
            break
        points = _joined(problem, points, around, state.tuning)
        if not points:
            break
        nlp = formulate(state.part, (*listed, *points))
        end = run_from(replace(state, nlp=nlp), replace(start, design=design, near=True))
        if not end.feasible:
            break
        trial = check_end(state, end)
        if trial.checked.violations:
            break
        claimed, around = float(trial.point.x[nlp.variables.index(RADIUS)]), trial.checked.around
        if around is not None and around.radius >= claimed * (1 - state.tuning.exact_radius):
            return end
        design = {n: trial.parameters[n] for n in problem.free}
        points = [_moved(case, k, trial) for k, case in enumerate(nlp.cases, start=1) if case.edge]
    return replace(end, feasible=False)


def propose_tolerant(state: SearchState) -> Iterator[Start]:
    """Designs that lie apart, those of the greatest radius along some rays first; those at hand before all."""
    problem, tuning = state.part, state.tuning
    yield from (Start(design) for design in state.extra)
    if state.extra:
        return
    limits = {name: text for name, text in problem.constraints.items() if RADIUS not in problem.conditions[name].names}
    asked = problem.derive(minimize="abscissa", maximize=None, constraints=limits)
    if problem.start or state.options.near:
        yield Start({**default_start(problem), **(state.options.near or {})})
    box = draw_box(asked, state.options.seed, tuning)
    seen = box.drawn.best(2 * tuning.estimated)
    if np.sum(seen.violation == 0) < tuning.estimated // 4:
        seen = seen.joined(box.approach_limits(seen.first(tuning.estimated // 2)))
        seen = seen.take(seen.ranked)
    seen = seen.take(np.flatnonzero(seen.worth < 0)[: tuning.estimated])
    if not len(seen):
        return
    radii = estimate_radii(problem, box.space.designs(seen.u), state.options.seed)
    ranked = seen.take(np.lexsort((-radii, seen.violation)))
    yield from (Start(design) for design in box.designs(ranked.apart(tuning.climbs, tuning.apart)))


def are_climbs_enough(state: SearchState) -> bool:
    """Whether enough climbs ended, and two of them at the best radius."""
    feasible = state.feasible
    best = min((end.objective for end in feasible), default=np.inf)
    return len(feasible) >= state.tuning.fewest_climbs and count_starts(feasible, best).at_best >= 2


RADIUS_POLICY = Policy(lambda _: None, propose_tolerant, climb, accept_best, are_climbs_enough)


def _reweighted(problem: Posed, around: Robustness) -> bool:
    """Whether a radius is measured by other weights than the problem's, as beside a parameter that is 0."""
    return any(weight != weight_of(n, around.parameters[n], problem.weights) for n, weight in around.weights.items())


def _joined(problem: Posed, points: list[Case], around: Robustness, tuning: Tuning) -> list[Case]:
    """The boundary points so far, and those of a design that are others."""
    near = [n for n in (around.weave, around.capsize, around.infinity) if n.distance <= tuning.beyond * around.radius]
    found = [_boundary_point(problem, n) for n in near]
    return [*points, *(case for case in found if not any(_alike(case, other, tuning.alike_points) for other in points))]


def _boundary_point(problem: Posed, nearest: Nearest) -> Case:
    """In all that the radius lets change: what is 0 in a design, such as a gain, has no part in its own direction."""
    names = weighted(problem.parameter_set, problem.weights, problem.fixed)
    return Case(direction=Table({n: nearest.direction.get(n, 0.0) for n in names}), edge=nearest.kind)


def _alike(one: Case, other: Case, share: float) -> bool:
    u, v = (np.array(list(case.direction.values())) for case in (one, other))
    return one.edge == other.edge and bool(np.linalg.norm(u - v) <= share * np.linalg.norm(u))


def _moved(case: Case, k: int, trial: CheckedEnd) -> Case:
    """A boundary point where it is at a trial."""
    nlp = trial.end.nlp
    at = {n: float(trial.point.x[nlp.variables.index(f"{n}.{k}")]) for n in case.direction}
    return replace(case, direction=Table(at))


def estimate_radii(problem: Posed, columns: Mapping[str, Array], seed: int) -> Array:
    """Radii up to which designs, columns of free parameters, stay stable in some directions; too large, if anything."""
    of, nominal = problem.parameter_set, {n: np.asarray(x, dtype=float) for n, x in problem.ordered(columns).items()}
    names, steps = list(weighted(of, problem.weights, problem.fixed)), np.geomspace(5e-3, 1.5, 20)
    random = stream(seed, "rays").standard_normal((24, len(names)))
    rays = np.concatenate([np.eye(len(names)), random / np.linalg.norm(random, axis=1, keepdims=True)])
    moves = (np.concatenate([rays, -rays])[:, None] * steps[:, None]).reshape(-1, len(names))  # (moves, names)
    sizes = {n: np.where(x == 0, 1.0, np.abs(x)) for n, x in nominal.items()}
    changed = {n: x[..., None] for n, x in nominal.items()}
    for n, u in zip(names, moves.T, strict=True):
        changed[n] = changed[n] + problem.weights.get(n, sizes[n][..., None]) * u
    with np.errstate(all="ignore"):
        a = problem.model.coefficients(changed, of)
        c = np.stack(np.broadcast_arrays(*a, changed[names[0]])[:-1], axis=-1)
    lost = ~is_stable(c, exact=False).reshape(*c.shape[:-2], -1, len(steps))
    first = np.where(lost.any(axis=-1), lost.argmax(axis=-1), len(steps) - 1)
    return np.asarray(steps[first].min(axis=-1) + 1e-3 * steps[first].mean(axis=-1))
