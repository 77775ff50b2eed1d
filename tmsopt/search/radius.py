"""Designs of largest robustness radius: climb via the nearest boundary points from the best designs of a sample."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from tmsopt.boundaries import Robustness, find_stability_margins
from tmsopt.problem import Case, Posed
from tmsopt.problem.cases import weight_of
from tmsopt.problem.evaluate import coefficients_of
from tmsopt.problem.problem import radius_parameters
from tmsopt.problem.quantities import RADIUS
from tmsopt.program.formulate import formulate
from tmsopt.records import Array, Table
from tmsopt.roots import is_stable
from tmsopt.search.acceptance import accept_best, check_end
from tmsopt.search.local_search import solve_from
from tmsopt.search.policy import Policy
from tmsopt.search.sample import draw_box, stream
from tmsopt.search.state import CheckedEnd, LocalEnd, SearchState, Start, make_failed_end
from tmsopt.search.stopping import count_starts
from tmsopt.search.tuning import Tuning


def climb(state: SearchState, start: Start) -> LocalEnd:
    """Climb from one design: add the nearest boundary points and solve again; an infeasible end if that fails."""
    problem, design, points = state.problem, start.design, list[Case]()
    listed = tuple(case for case in problem.cases if not case.direction)
    around: Robustness | None = find_stability_margins(problem, problem.ordered(design))
    end = make_failed_end(start, state.nlp)
    for _ in range(state.tuning.climb_rounds):
        if around is None or not around.stable or _has_other_weights(problem, around):
            break
        points = _add_boundary_points(problem, points, around, state.tuning)
        if not points:
            break
        nlp = formulate(state.part, (*listed, *points))
        end = solve_from(replace(state, nlp=nlp), replace(start, design=design, near=True))
        if not end.feasible:
            break
        trial = check_end(state, end)
        if trial.checked.violations:
            break
        claimed, around = float(trial.point.x[nlp.variables.index(RADIUS)]), trial.checked.robustness
        if around is not None and around.radius >= claimed * (1 - state.tuning.exact_radius):
            return end
        design = trial.parameters
        points = [_move_point(case, k, trial) for k, case in enumerate(nlp.cases, start=1) if case.edge]
    return replace(end, feasible=False)


def propose_climbs(state: SearchState) -> Iterator[Start]:
    """The caller's designs; or else designs that lie apart, those with the largest radius along some rays first."""
    problem, tuning = state.part, state.tuning
    yield from (Start(design) for design in state.extra)
    if state.extra:
        return
    limits = {name: text for name, text in problem.constraints.items() if RADIUS not in problem.conditions[name].names}
    asked = problem.derive(minimize="abscissa", maximize=None, constraints=limits)
    if problem.start or state.options.near:
        yield Start(state.options.near or {})
    box = draw_box(asked, state.options.seed, tuning)
    seen = box.draws.take_best(2 * tuning.estimated)
    if np.sum(seen.violation == 0) < tuning.estimated // 4:
        seen = seen.join(box.approach_limits(seen.take_first(tuning.estimated // 2)))
        seen = seen.take(seen.order)
    seen = seen.take(np.flatnonzero(seen.objective < 0)[: tuning.estimated])
    if not len(seen):
        return
    radii = estimate_radii(problem, box.space.designs(seen.u), state.options.seed)
    ranked = seen.take(np.lexsort((-radii, seen.violation)))
    yield from (Start(design) for design in box.designs(ranked.select_apart(tuning.climbs, tuning.apart)))


def has_enough_climbs(state: SearchState) -> bool:
    """Whether enough climbs ended, and two of them at the best radius."""
    feasible = state.feasible
    best = min((end.objective for end in feasible), default=np.inf)
    return len(feasible) >= state.tuning.fewest_climbs and count_starts(feasible, best).at_best >= 2


RADIUS_POLICY = Policy(lambda _: None, propose_climbs, climb, accept_best, has_enough_climbs)


def _has_other_weights(problem: Posed, around: Robustness) -> bool:
    """Whether a radius is measured by other weights than the problem's, as where a parameter is 0."""
    return any(weight != weight_of(n, around.parameters[n], problem.weights) for n, weight in around.weights.items())


def _add_boundary_points(problem: Posed, points: list[Case], around: Robustness, tuning: Tuning) -> list[Case]:
    """The boundary points so far, and the new ones of a design."""
    found = list(points)
    for nearest in (around.weave, around.capsize, around.infinity):
        # In all parameters that the radius varies, also those that are 0 in the design.
        direction = Table({n: nearest.direction.get(n, 0.0) for n in _list_varied(problem)})
        case = Case(direction=direction, edge=nearest.kind)
        near = nearest.distance <= tuning.beyond * around.radius
        if near and not any(_is_alike(case, other, tuning.alike_points) for other in points):
            found.append(case)
    return found


def _is_alike(one: Case, other: Case, share: float) -> bool:
    u, v = (np.array(list(case.direction.values())) for case in (one, other))
    return one.edge == other.edge and bool(np.linalg.norm(u - v) <= share * np.linalg.norm(u))


def _move_point(case: Case, k: int, trial: CheckedEnd) -> Case:
    """A boundary point moved to where it is at a trial."""
    nlp = trial.end.nlp
    at = {n: float(trial.point.x[nlp.variables.index(f"{n}.{k}")]) for n in case.direction}
    return replace(case, direction=Table(at))


def estimate_radii(problem: Posed, columns: Mapping[str, Array], seed: int) -> Array:
    """Upper estimates of the radii of designs, columns of free parameters: how far they stay stable along some rays."""
    names, steps = _list_varied(problem), np.geomspace(5e-3, 1.5, 20)
    random = stream(seed, "rays").standard_normal((24, len(names)))
    rays = np.concatenate([np.eye(len(names)), random / np.linalg.norm(random, axis=1, keepdims=True)])
    reached = []
    for ray in (*rays, *-rays):
        case = Case(direction=dict(zip(names, ray.tolist(), strict=True)))
        changed = case.applied(problem.ordered(columns), steps[:, None], problem.weights)
        a = np.broadcast_arrays(*coefficients_of(problem, changed), *changed.values())[: problem.model.degree + 1]
        lost = ~is_stable(np.stack(a, axis=-1), exact=False)
        reached.append(steps[np.where(lost.any(axis=0), lost.argmax(axis=0), len(steps) - 1)])
    return np.asarray(np.min(reached, axis=0) + 1e-3 * np.mean(reached, axis=0))


def _list_varied(problem: Posed) -> tuple[str, ...]:
    return radius_parameters(problem.parameter_set, problem.weights, problem.fixed)
