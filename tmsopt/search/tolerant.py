"""The most tolerant designs: climbs by feet, the nearest points of boundaries, from designs that rays take for good."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from tmsopt.boundaries.nearest import Nearest, Robustness
from tmsopt.problem.cases import Case, weight_of
from tmsopt.problem.problem import Posed, weighted
from tmsopt.problem.quantities import RADIUS
from tmsopt.program.formulate import middle
from tmsopt.program.nlp import NLP
from tmsopt.records import Array, Table
from tmsopt.roots import is_stable
from tmsopt.search.basins import apart
from tmsopt.search.multistart import Runner, same_objective
from tmsopt.search.outcome import CheckedEnd, best_checked, is_better
from tmsopt.search.sample import Sampler
from tmsopt.search.workspace import LocalEnd, Workspace

_LOOKED = 512  # stable designs whose radius is estimated
_RADII = np.geomspace(5e-3, 1.5, 20)
_RANDOM = 24  # directions, beside those of single parameters
_STARTS, _LEAST, _AGREE = 6, 3, 2  # climbs at most and at least, and so many that end at the best
_ROUNDS = 10  # of a climb
_BESIDE = 3.0  # radii: feet that are farther off are left out
_EXACT = 1e-9  # relative: how well the claim is the radius
_ALIKE = 1e-3  # of a distance: feet that are one


@dataclass(frozen=True)
class Climbed:
    """Where climbs ended, and the best of them."""

    nlp: NLP
    candidates: tuple[LocalEnd, ...]
    trial: CheckedEnd


def maximise_radius(work: Workspace, designs: Iterable[Mapping[str, float]]) -> Climbed | None:
    """The best design that climbs from some reach; None where none ends as it claims to."""
    built: dict[tuple[str, ...], NLP] = {}
    ended: list[tuple[NLP, CheckedEnd]] = []
    for tried, design in enumerate(designs, start=1):
        found = _climb(work, design, built)
        if work.options.progress:
            work.options.progress(tried, max(tried, _STARTS))
        if found is not None:
            ended.append(found)
        if not ended:
            continue
        best = reduce(lambda one, other: other if is_better(work, other[1], one[1]) else one, ended)
        value = best[1].checked.objective
        if len(ended) >= _LEAST and sum(same_objective(t.checked.objective, value) for _, t in ended) >= _AGREE:
            break
    return Climbed(best[0], tuple(t.candidate for _, t in ended), best[1]) if ended else None


def _climb(
    work: Workspace, design: Mapping[str, float], built: dict[tuple[str, ...], NLP]
) -> tuple[NLP, CheckedEnd] | None:
    """Where the feet of one design, and those met on the way, lead."""
    problem = work.problem
    listed = tuple(case for case in problem.cases if not case.direction)
    around = work.around(problem.ordered(design))
    feet: list[Case] = []
    for _ in range(_ROUNDS):
        if around is None or not around.stable:
            return None
        if any(weight != weight_of(n, around.parameters[n], problem.weights) for n, weight in around.weights.items()):
            return None
        feet = _joined(problem, feet, around)
        if not feet:
            return None
        edges = tuple(case.edge for case in feet)
        if edges not in built:
            built[edges] = work.formulate((*listed, *feet))
        nlp = replace(built[edges], cases=(*listed, *feet))
        trial = best_checked(work, nlp, [Runner(work, nlp).solve_from(design, near=True)])
        if trial is None or trial.checked.violations:
            return None
        claimed, around = float(trial.point.x[nlp.variables.index(RADIUS)]), trial.checked.around
        if around is not None and around.radius >= claimed * (1 - _EXACT):
            return nlp, trial
        design = {n: trial.parameters[n] for n in problem.free}
        feet = [_moved(case, k, nlp, trial) for k, case in enumerate(nlp.cases, start=1) if case.edge]
    return None


def _joined(problem: Posed, feet: list[Case], around: Robustness) -> list[Case]:
    """The feet so far, and those of a design that are others."""
    near = [n for n in (around.weave, around.capsize, around.infinity) if n.distance <= _BESIDE * around.radius]
    found = [_foot(problem, n) for n in near]
    return [*feet, *(case for case in found if not any(_alike(case, other) for other in feet))]


def _foot(problem: Posed, nearest: Nearest) -> Case:
    """In all that the radius lets change: what is 0 in a design, such as a gain, has no part in its own direction."""
    names = weighted(problem.parameter_set, problem.weights, problem.fixed)
    return Case(direction=Table({n: nearest.direction.get(n, 0.0) for n in names}), edge=nearest.kind)


def _alike(one: Case, other: Case) -> bool:
    u, v = (np.array(list(case.direction.values())) for case in (one, other))
    return one.edge == other.edge and bool(np.linalg.norm(u - v) <= _ALIKE * np.linalg.norm(u))


def _moved(case: Case, k: int, nlp: NLP, trial: CheckedEnd) -> Case:
    """A foot where it is at a trial."""
    at = {n: float(trial.point.x[nlp.variables.index(f"{n}.{k}")]) for n in case.direction}
    return replace(case, direction=Table(at))


def promising(work: Workspace) -> Iterator[dict[str, float]]:
    """Designs that lie apart, those of the greatest radius along some rays first; one near the optimum before all."""
    problem = work.part
    limits = {name: text for name, text in problem.constraints.items() if RADIUS not in problem.conditions[name].names}
    sampler = Sampler(problem.derive(minimize="abscissa", maximize=None, constraints=limits), work.options.seed)
    if problem.start or work.options.near:
        yield {**middle(problem), **(work.options.near or {})}
    seen = sampler.draw()
    seen = seen.take(seen.ranked[: 2 * _LOOKED])
    if np.sum(seen.violation == 0) < _LOOKED // 4:
        seen = seen.joined(sampler.nearer(seen.take(np.arange(_LOOKED // 2))))
        seen = seen.take(seen.ranked)
    seen = seen.take(np.flatnonzero(seen.worth < 0)[:_LOOKED])
    if not len(seen):
        return
    radii = estimated(problem, sampler.space.designs(seen.u), work.options.seed)
    ranked = seen.take(np.lexsort((-radii, seen.violation)))
    for k in apart(ranked, _STARTS).tolist():
        yield sampler.design(ranked, k)


def estimated(problem: Posed, columns: Mapping[str, Array], seed: int) -> Array:
    """Radii up to which designs, columns of free parameters, stay stable in some directions; too large, if anything."""
    of, nominal = problem.parameter_set, {n: np.asarray(x, dtype=float) for n, x in problem.ordered(columns).items()}
    names = list(weighted(of, problem.weights, problem.fixed))
    random = np.random.default_rng(seed).standard_normal((_RANDOM, len(names)))
    rays = np.concatenate([np.eye(len(names)), random / np.linalg.norm(random, axis=1, keepdims=True)])
    moves = (np.concatenate([rays, -rays])[:, None] * _RADII[:, None]).reshape(-1, len(names))  # (moves, names)
    sizes = {n: np.where(x == 0, 1.0, np.abs(x)) for n, x in nominal.items()}
    changed = {n: x[..., None] for n, x in nominal.items()}
    for n, u in zip(names, moves.T, strict=True):
        changed[n] = changed[n] + problem.weights.get(n, sizes[n][..., None]) * u
    with np.errstate(all="ignore"):
        a = problem.model.coefficients(changed, of)
        c = np.stack(np.broadcast_arrays(*a, changed[names[0]])[:-1], axis=-1)
    lost = ~is_stable(c, exact=False).reshape(*c.shape[:-2], -1, len(_RADII))
    first = np.where(lost.any(axis=-1), lost.argmax(axis=-1), len(_RADII) - 1)
    return np.asarray(_RADII[first].min(axis=-1) + 1e-3 * _RADII[first].mean(axis=-1))
