"""Find designs of largest robustness radius: climb from the best designs of a sample.

The radius of a design is its distance to the nearest point on a boundary of stability. A climb maximises the distance
to the boundary points known so far, then adds the nearest points of the new design, and repeats this.
"""

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
    """Climb from one design: add the nearest boundary points and solve again, until a recheck confirms the radius.

    The end is infeasible if no recheck confirms it.
    """
    problem, design, points = state.problem, start.design, list[Case]()
    listed_cases = tuple(case for case in problem.cases if not case.direction)
    margins: Robustness | None = find_stability_margins(problem, problem.ordered(design))
    end = make_failed_end(start, state.nlp)
    for _ in range(state.tuning.climb_rounds):
        if margins is None or not margins.stable or _has_other_weights(problem, margins):
            break
        points = _add_boundary_points(problem, points, margins, state.tuning)
        if not points:
            break
        nlp = formulate(state.part, (*listed_cases, *points))
        end = solve_from(replace(state, nlp=nlp), replace(start, design=design, near=True))
        if not end.feasible:
            break
        trial = check_end(state, end)
        if trial.checked.violations:
            break
        claimed_radius, margins = float(trial.point.x[nlp.variables.index(RADIUS)]), trial.checked.robustness
        if margins is not None and margins.radius >= claimed_radius * (1 - state.tuning.radius_accuracy):
            return end
        design = trial.parameters
        points = [_move_point(case, k, trial) for k, case in enumerate(nlp.cases, start=1) if case.edge]
    return replace(end, feasible=False)


def propose_climbs(state: SearchState) -> Iterator[Start]:
    """Yield the caller's designs. If there are none, yield sampled designs that lie apart, the most robust first."""
    problem, tuning = state.part, state.tuning
    yield from (Start(design) for design in state.extra)
    if state.extra:
        return
    limits = {name: text for name, text in problem.constraints.items() if RADIUS not in problem.conditions[name].names}
    abscissa_problem = problem.derive(minimize="abscissa", maximize=None, constraints=limits)
    if problem.start or state.options.near:
        yield Start(state.options.near or {})
    box = draw_box(abscissa_problem, state.options.seed, tuning)
    batch = box.draws.take_best(2 * tuning.radius_estimates)
    if np.sum(batch.violation == 0) < tuning.radius_estimates // 4:
        batch = batch.join(box.approach_limits(batch.take_first(tuning.radius_estimates // 2)))
        batch = batch.take(batch.order)
    batch = batch.take(np.flatnonzero(batch.objective < 0)[: tuning.radius_estimates])
    if not len(batch):
        return
    radii = estimate_radii(problem, box.space.designs(batch.u), state.options.seed)
    ranked = batch.take(np.lexsort((-radii, batch.violation)))
    yield from (Start(design) for design in box.designs(ranked.select_apart(tuning.max_climbs, tuning.basin_distance)))


def has_enough_climbs(state: SearchState) -> bool:
    """Whether enough climbs succeeded, and at least two of them ended at the best radius."""
    feasible = state.feasible
    best = min((end.objective for end in feasible), default=np.inf)
    return len(feasible) >= state.tuning.min_climbs and count_starts(feasible, best).at_best >= 2


RADIUS_POLICY = Policy(lambda _: None, propose_climbs, climb, accept_best, has_enough_climbs)


def _has_other_weights(problem: Posed, margins: Robustness) -> bool:
    """Whether a radius has other weights than the problem, for example because a parameter is 0."""
    return any(weight != weight_of(n, margins.parameters[n], problem.weights) for n, weight in margins.weights.items())


def _add_boundary_points(problem: Posed, points: list[Case], margins: Robustness, tuning: Tuning) -> list[Case]:
    """Return the boundary points so far, and new ones near a design."""
    cases = list(points)
    for nearest in (margins.weave, margins.capsize, margins.infinity):
        # The direction has all parameters that the radius varies, also those that are 0 in the design.
        direction = Table({n: nearest.direction.get(n, 0.0) for n in _list_varied_parameters(problem)})
        case = Case(direction=direction, edge=nearest.kind)
        is_near = nearest.distance <= tuning.max_boundary_distance * margins.radius
        if is_near and not any(_is_alike(case, other, tuning.equal_point_distance) for other in points):
            cases.append(case)
    return cases


def _is_alike(point: Case, other: Case, tolerance: float) -> bool:
    u, v = (np.array(list(case.direction.values())) for case in (point, other))
    return point.edge == other.edge and bool(np.linalg.norm(u - v) <= tolerance * np.linalg.norm(u))


def _move_point(case: Case, index: int, trial: CheckedEnd) -> Case:
    """Return a boundary point, the case with this index, with the position that it has in a trial."""
    nlp = trial.end.nlp
    direction = {n: float(trial.point.x[nlp.variables.index(f"{n}.{index}")]) for n in case.direction}
    return replace(case, direction=Table(direction))


def estimate_radii(problem: Posed, columns: Mapping[str, Array], seed: int) -> Array:
    """Estimate upper bounds of the radii of designs: how far the designs stay stable along some rays.

    Args:
        columns: free parameter → array with its value in each design.
    """
    names, steps = _list_varied_parameters(problem), np.geomspace(5e-3, 1.5, 20)
    random = stream(seed, "rays").standard_normal((24, len(names)))
    rays = np.concatenate([np.eye(len(names)), random / np.linalg.norm(random, axis=1, keepdims=True)])
    radii = []
    for ray in (*rays, *-rays):
        case = Case(direction=dict(zip(names, ray.tolist(), strict=True)))
        changed_parameters = case.applied(problem.ordered(columns), steps[:, None], problem.weights)
        a = np.broadcast_arrays(*coefficients_of(problem, changed_parameters), *changed_parameters.values())[
            : problem.model.degree + 1
        ]
        is_unstable = ~is_stable(np.stack(a, axis=-1), exact=False)
        radii.append(steps[np.where(is_unstable.any(axis=0), is_unstable.argmax(axis=0), len(steps) - 1)])
    return np.asarray(np.min(radii, axis=0) + 1e-3 * np.mean(radii, axis=0))


def _list_varied_parameters(problem: Posed) -> tuple[str, ...]:
    return radius_parameters(problem.parameter_set, problem.weights, problem.fixed)
