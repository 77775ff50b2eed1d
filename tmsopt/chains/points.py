"""Designs at which eigenvalues coincide with one eigenvector, by Newton steps on clusters and on Jordan chains.

A pattern asks for one or several multiple eigenvalues. From any design, two stages find them. The first brings k
eigenvalues together, by steps in the parameters for the power sums of their distances from their mean. The second
solves the equations of the Jordan chain for the parameters and the eigenvalue, to all digits. Both use least squares,
so that conditions that a symmetry fulfils for all parameters do no harm.
"""

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Any, Literal

import numpy as np

from tmsopt.chains.family import Family
from tmsopt.records import Array, Complex
from tmsopt.roots import composition
from tmsopt.roots.chains import (
    MIN_SECOND_VALUE,
    Chain,
    Cluster,
    eigenvalues_of,
    eigenvectors_of,
    find_borders,
    linearise,
    linearised_slopes,
    make_chain,
    make_cluster,
    schur_form,
    size_at,
)

MAX_BACKWARD_ERROR = 1e-12
"""Largest relative change of the matrices that makes the chain of a found design exact."""

_MAX_CLUSTER_STEPS = 60
_CLOSE = 1e-3, 1e-8
"""A spread below this share of the size of the eigenvalues ends the first stage; the smaller one if the second stage
then fails, as it does for an EP next to a diabolic point."""
_MIN_DAMPING = 0.01
_DECREASE = 0.1  # share of the predicted decrease that a damped step must reach
_MAX_CHAIN_STEPS = 60
_STALLED_CLUSTERS = 8  # steps of the first stage without progress that end it
_STALLED_STEPS = 3  # steps without a smaller residual that end the second stage
_PROGRESS = 0.5  # a step that leaves more than this share of the error has stalled
_STILL = 4e-16  # a step of this share of the ranges, and an error of this size, are at rounding
_ROUNDING = 32 * float(np.finfo(float).eps)  # of the equations, relative to their terms
_CUTOFF = 1e-10  # relative singular values below this count as 0 in a step
_MAX_STEP = 0.5  # longest step of a parameter in the second stage, as a share of its range
_SMALL = 1e-3  # an equation beyond those of a chain may hold nearby if its value is below this share of the matrices
_SAME_POINT = 1e-5  # relative to each range: how near a point of a higher order must be
_DISTINCT = 1e-6  # relative distance below which two eigenvalues of a pattern are one

_NO_SUMS = np.zeros(0, dtype=complex)

Axis = Literal["complex", "real", "imaginary", "zero"]


@dataclass(frozen=True)
class Target:
    """One multiple eigenvalue that a pattern asks for.

    Attributes:
        order: length of the chain.
        axis: where the eigenvalue lies; ``complex`` is anywhere, for real matrices above the real axis.
    """

    order: int
    axis: Axis

    @property
    def directions(self) -> tuple[complex, ...]:
        """Directions in which the eigenvalue may move."""
        return {"complex": (1, 1j), "real": (1,), "imaginary": (1j,), "zero": ()}[self.axis]

    def is_real(self, is_complex: bool) -> bool:
        """Whether the eigenvalue and its chain are real, for real or complex matrices."""
        return not is_complex and self.axis in ("real", "zero")

    def conditions(self, is_complex: bool) -> int:
        """Number of conditions on the parameters."""
        return (1 if self.is_real(is_complex) else 2) * self.order - len(self.directions)


def targets_of(name: str, is_complex: bool) -> tuple[Target, ...]:
    """The multiple eigenvalues of a pattern such as ``EP3`` or ``EP2+weave``, for real or complex matrices."""
    anywhere: Axis = "complex" if is_complex else "real"
    axes: dict[str, Axis] = {"EP": anywhere, "CEP": "complex", "weave": "imaginary", "resonance": "imaginary"}
    return tuple(
        Target(2 if kind == "resonance" else order, axes.get(kind, "zero"))
        for kind, order, count in composition(name)
        for _ in range(count)
    )


@dataclass(frozen=True)
class ExceptionalPoint:
    """A design with its multiple eigenvalues.

    Attributes:
        p: values of the free parameters.
        chains: the chain of each target.
        backward_error: largest relative change of the matrices that makes a chain exact.
        second_value: least second smallest singular value, relative to the size of the matrices.
        sensitivity: largest effect on each parameter of a relative change of the equations; inf if the equations do
            not determine the parameters.
        steps: steps of the two stages.
        has_higher_order: whether more eigenvalues coincide than were asked for; then the chains have the higher order.
    """

    p: Array
    chains: tuple[Chain, ...]
    backward_error: float
    second_value: float
    sensitivity: Array
    steps: tuple[int, int] = (0, 0)
    has_higher_order: bool = False

    @property
    def roots(self) -> tuple[complex, ...]:
        """The multiple eigenvalues, in the unit of the family."""
        return tuple(chain.s for chain in self.chains)

    @property
    def is_isolated(self) -> bool:
        """Whether the equations determine the parameters."""
        return bool(np.isfinite(self.sensitivity).all())

    def estimate_errors(self, names: Sequence[str]) -> dict[str, float]:
        """Error bounds of the parameters, and of the abscissa, from the rounding of the equations."""
        errors = (_ROUNDING * self.sensitivity).tolist()
        return dict(zip(names, errors, strict=True)) | {"abscissa": 0.0}

    @property
    def is_defective(self) -> bool:
        """Whether each multiple eigenvalue has one eigenvector."""
        return self.second_value > MIN_SECOND_VALUE

    @property
    def is_found(self) -> bool:
        """Whether the point is a solution to rounding, with one eigenvector for each multiple eigenvalue."""
        return self.is_defective and self.backward_error <= MAX_BACKWARD_ERROR


def find_point(
    family: Family,
    targets: Sequence[Target],
    start: Array,
    rng: np.random.Generator | None = None,
    *,
    is_nearest: bool = True,
    is_patient: bool = True,
) -> ExceptionalPoint | None:
    """The point that the two stages reach from a design; None if they fail.

    Args:
        rng: chooses which eigenvalues shall coincide; by default those that are nearest each other.
        is_nearest: if the conditions leave freedom, find the nearest point, which takes more steps.
        is_patient: whether a second attempt brings the eigenvalues closer, as an EP next to a diabolic point needs.
    """
    with np.errstate(all="ignore"):
        p, point = np.clip(start, *family.box.T), None
        for close in _CLOSE if is_patient else _CLOSE[:1]:
            try:
                state = _gather(family, targets, p, rng if point is None else None, close)
            except np.linalg.LinAlgError:
                return point
            if state is None:
                return point
            p = state.p
            try:
                point = refine(family, targets, p, state.means, start if is_nearest else None, state.steps)
            except np.linalg.LinAlgError:  # an eigenvalue has several eigenvectors there
                point = ExceptionalPoint(p, (), np.inf, 0.0, np.full(len(p), np.inf), (state.steps, 0))
            if point.is_found or not state.is_close:
                break
            point = replace(point, p=p)
        if point is not None and point.is_found:
            climbs = (raise_order(family, targets, k, point)[1] for k in range(len(targets)))
            return next((replace(p, has_higher_order=True) for p in climbs if p is not point), point)
        return point


def raise_order(
    family: Family, targets: Sequence[Target], k: int, point: ExceptionalPoint
) -> tuple[Sequence[Target], ExceptionalPoint]:
    """The targets and the point, with the order of the k-th target raised as long as more eigenvalues coincide there.

    By a symmetry, an EP2 may exist only as an EP3.
    """
    chain = point.chains[k]
    if abs(chain.values[-1]) * chain.unit**chain.order > _SMALL * size_at(family.matrices(point.p), chain.s):
        return targets, point
    for more in (1, 2):  # beside an EP4, the equations of an EP3 converge slowly
        higher = [replace(t, order=t.order + more * (i == k)) for i, t in enumerate(targets)]
        with suppress(np.linalg.LinAlgError):
            found = refine(family, higher, point.p, point.roots)
            if found.is_found and np.all(np.abs(found.p - point.p) <= _SAME_POINT * family.widths):
                return raise_order(family, higher, k, found)
    return targets, point


def refine_near(family: Family, targets: Sequence[Target], p: Array) -> ExceptionalPoint | None:
    """The point next to a design, by the second stage alone, in the box or outside; None if it fails."""
    means = gather_roots(family.at(p), targets)
    try:
        return None if means is None else refine(family, targets, p, means)
    except np.linalg.LinAlgError:
        return None


def gather_roots(family: Family, targets: Sequence[Target]) -> tuple[complex, ...] | None:
    """The means of the eigenvalues that come nearest to the targets, for a family without parameters."""
    try:
        groups = _choose_groups(eigenvalues_of(family.matrices(np.empty(0))), targets, family, _measure_spread)
    except np.linalg.LinAlgError:
        return None
    means = [complex(group.mean()) for group in groups if group is not None]
    return tuple(map(project_on_axis, means, targets)) if len(means) == len(targets) else None


@dataclass(frozen=True)
class _Gathered:
    """A step of the first stage: the clusters of a design, what separates their eigenvalues, and its slopes.

    Attributes:
        is_close: whether the first stage has ended because the eigenvalues are close.
    """

    p: Array
    clusters: tuple[Cluster, ...]
    residual: Array
    jacobian: Array
    steps: int = 0
    is_close: bool = False

    @property
    def means(self) -> tuple[complex, ...]:
        """The mean of each cluster."""
        return tuple(cluster.mean for cluster in self.clusters)

    def largest_distance(self, targets: Sequence[Target]) -> float:
        """Largest distance of an eigenvalue from the mean of its cluster, or of a mean from its axis."""
        pairs = zip(self.clusters, targets, strict=True)
        return max(float(c.radius) + float(abs(_stack(c.mean, _NO_SUMS, t)[0])) for c, t in pairs)


def _gather(
    family: Family, targets: Sequence[Target], start: Array, rng: np.random.Generator | None, close: float
) -> _Gathered | None:
    """Bring the eigenvalues of each target together, by damped Gauss–Newton steps in the box."""
    matrices, slopes = family.expand(start)
    s, left, right = eigenvectors_of(matrices)
    size = float(np.abs(s - s.mean()).max() or np.abs(s).max()) or 1.0
    changes = linearised_slopes(matrices, slopes)

    def predict_step(group: Complex, target: Target) -> float:
        """Length of the step that makes a group coincide to first order, and the share of the equations that it leaves.

        Near eigenvalues often cross with their own eigenvectors; those that can become defective respond strongly.
        """
        members = np.flatnonzero(np.isin(s, group))[: target.order]
        cluster = _gather_eigenvalues(s[members], right[:, members], left[members])
        residual, jacobian = _separate([cluster], [target], changes, family, size)
        if not jacobian.any():  # equal for all parameters, or none of them moves one against the other
            return np.inf
        if not residual.any():
            return 0.0
        if not np.isfinite(jacobian).all():
            return np.inf
        step = np.linalg.lstsq(jacobian * family.widths, -residual, rcond=_CUTOFF)[0]
        rest = residual + jacobian @ (family.widths * step)
        return float(np.linalg.norm(step) + np.linalg.norm(rest) / np.linalg.norm(residual))

    groups = _choose_groups(s, targets, family, predict_step if family.names else _measure_spread, rng)
    state = _measure(family, start, targets, groups, size)
    errors = list[float]()
    while state and state.steps < _MAX_CLUSTER_STEPS:
        if state.largest_distance(targets) <= close * size:
            return replace(state, is_close=True)
        errors.append(float(np.linalg.norm(state.residual)))
        if len(errors) > _STALLED_CLUSTERS and errors[-1] > _PROGRESS * errors[-1 - _STALLED_CLUSTERS]:
            break
        step, damping = _step_in_box(state.jacobian, state.residual, state.p, family), 1.0
        while damping > _MIN_DAMPING:
            p = np.clip(state.p + damping * step, *family.box.T)
            s = eigenvalues_of(family.matrices(p))
            groups = [_nearest(s, mean, t, family) for mean, t in zip(state.means, targets, strict=True)]
            clusters = [_gather_eigenvalues(group) for group in groups if group is not None]
            if len(clusters) == len(targets):
                residual, _ = _separate(clusters, targets, (), family, size)
                if np.linalg.norm(residual) <= (1 - _DECREASE * damping) * errors[-1]:
                    break
            damping /= 2
        else:
            break
        following = _measure(family, p, targets, groups, size)
        assert following is not None
        state = replace(following, steps=state.steps + 1)
    return state


def _measure(
    family: Family, p: Array, targets: Sequence[Target], groups: Sequence[Complex | None], size: float
) -> _Gathered | None:
    """The clusters of groups of eigenvalues with the equations that bring them together."""
    matrices, slopes = family.expand(p)
    form = schur_form(linearise(matrices), is_complex=True)
    clusters = [make_cluster(form, group) for group in groups if group is not None]
    if len(clusters) < len(targets):
        return None
    changes = linearised_slopes(matrices, slopes)
    return _Gathered(p, tuple(clusters), *_separate(clusters, targets, changes, family, size))


_NO_VECTORS = np.zeros((0, 0), dtype=complex)


def _gather_eigenvalues(group: Complex, right: Complex = _NO_VECTORS, left: Complex = _NO_VECTORS) -> Cluster:
    """The cluster of simple eigenvalues, by their eigenvectors if these are given."""
    return Cluster(complex(group.mean()), np.diag(group - group.mean()), right, left)


def _separate(
    clusters: Sequence[Cluster], targets: Sequence[Target], changes: Iterable[Complex], family: Family, size: float
) -> tuple[Array, Array]:
    """The power sums of clusters and their distances from the axes, in powers of `size`; and their derivatives."""
    residual, jacobian = list[Array](), list[Array]()
    for cluster, target in zip(clusters, targets, strict=True):
        scale = size ** -np.arange(1.0, target.order + 1)
        responses = [cluster.respond(change) for change in changes]
        rows = np.array([_stack(cluster.mean, cluster.power_sums, target), *(_stack(*r, target) for r in responses)])
        rows = (rows * scale).T
        parts = rows.real if target.is_real(family.is_complex) else np.concatenate([rows.real, rows.imag])
        residual.append(parts[:, 0])
        jacobian.append(parts[:, 1:])
    return np.concatenate(residual), np.concatenate(jacobian)


def _stack(mean: complex, power_sums: Complex, target: Target) -> Complex:
    """The distance of the mean from the axis of a target, and the power sums."""
    distance = {"imaginary": mean.real, "zero": mean}.get(target.axis, 0.0)
    return np.array([distance, *power_sums], dtype=complex)


def _choose_groups(
    eigenvalues: Complex,
    targets: Sequence[Target],
    family: Family,
    rank: Callable[[Complex, Target], float],
    rng: np.random.Generator | None = None,
) -> list[Complex | None]:
    """The eigenvalues that shall coincide, one group for each target, without common ones; None where too few are left.

    The highest order chooses first. Without `rng` it takes the group with the lowest rank.
    """
    groups, left = dict[int, Complex](), eigenvalues
    for k in sorted(range(len(targets)), key=lambda k: -targets[k].order):
        target = targets[k]
        candidates = [g for z in left if (g := _nearest(left, z, target, family)) is not None]
        if not candidates:
            return [None]
        ranks = [rank(g, target) for g in candidates] if rng is None else []
        group = candidates[int(np.argmin(ranks) if rng is None else rng.integers(len(candidates)))]
        groups[k], left = group, left[~np.isin(left, group)]
    return [groups[k] for k in range(len(targets))]


def _measure_spread(group: Complex, target: Target) -> float:
    """Largest distance of an eigenvalue of a group from the mean, with the distance of the mean from its axis."""
    return float(np.abs(group - group.mean()).max() + abs(_stack(group.mean(), _NO_SUMS, target)[0]))


def _nearest(eigenvalues: Complex, z: complex, target: Target, family: Family) -> Complex | None:
    """The eigenvalues of a target that are nearest to z; None if there are too few.

    For real matrices, a real target takes conjugate eigenvalues together, and any other target those above the axis.
    """
    z = {"imaginary": 1j * z.imag, "zero": 0j}.get(target.axis, z)
    if family.is_complex:
        pool = eigenvalues
    elif target.is_real(family.is_complex):
        z, group = complex(z.real), list[complex]()
        for w in eigenvalues[np.argsort(np.abs(eigenvalues - z), kind="stable")]:
            both = [w] if w.imag == 0 else [w, w.conjugate()] if w.imag > 0 else []
            group += both if len(group) + len(both) <= target.order else []
        return np.array(group) if len(group) == target.order else None
    else:
        pool, z = eigenvalues[eigenvalues.imag > 0], complex(z.real, abs(z.imag))
    return pool[np.argsort(np.abs(pool - z), kind="stable")[: target.order]] if len(pool) >= target.order else None


def _step_in_box(jacobian: Array, residual: Array, p: Array, family: Family) -> Array:
    """A Gauss–Newton step, of least length in shares of the ranges; a parameter at its limit does not move outwards."""
    free = np.ones(len(p), dtype=bool)
    step = np.zeros(len(p))
    while free.any():
        scaled = jacobian[:, free] * family.widths[free]
        step[:] = 0.0
        step[free] = np.linalg.lstsq(scaled, -residual, rcond=_CUTOFF)[0] * family.widths[free]
        blocked = free & (((p <= family.box[:, 0]) & (step < 0)) | ((p >= family.box[:, 1]) & (step > 0)))
        if not blocked.any():
            break
        free &= ~blocked
    return step if free.any() else np.zeros(len(p))


def refine(
    family: Family,
    targets: Sequence[Target],
    p: Array,
    roots: Sequence[complex],
    nearest_to: Array | None = None,
    steps: int = 0,
) -> ExceptionalPoint:
    """Solve the equations of the chains by Gauss–Newton steps in the parameters and the eigenvalues.

    Args:
        nearest_to: a design. If the conditions leave freedom, the point nearest to it is found, in shares of the
            ranges; by default the one nearest to p.
        steps: steps that led to p.

    Raises:
        LinAlgError: if the matrices are not finite, or an eigenvalue has several eigenvectors.
    """
    roots = [project_on_axis(s, target) for s, target in zip(roots, targets, strict=True)]
    borders = [find_borders(family.matrices(p), s)[0] for s in roots]
    best, stalled_steps, step_count = None, 0, 0
    while step_count < _MAX_CHAIN_STEPS and stalled_steps < _STALLED_STEPS:
        equations = chain_equations(family, targets, p, roots, borders)
        has_stalled = best is not None and not equations.error < max(_PROGRESS * best.error, _STILL)
        stalled_steps = stalled_steps + 1 if has_stalled else 0
        if best is None or equations.error <= max(best.error, _STILL):
            best = equations
        borders = [chain.borders for chain in equations.chains]
        pull = np.zeros(len(p)) if nearest_to is None else (nearest_to - p) / (family.widths + (family.widths == 0))
        step, moves = _chain_step(equations, targets, family, pull)
        if not np.isfinite([*step, *moves]).all() or (step_count and max(np.abs([*step, *moves])) <= _STILL):
            break
        p = p + np.clip(step, -_MAX_STEP, _MAX_STEP) * family.widths
        roots = [s + move for s, move in zip(roots, moves, strict=True)]
        step_count += 1
    assert best is not None
    p = np.where(np.abs(best.p) <= _STILL * family.widths, 0.0, best.p)
    matrices = family.matrices(p)
    seconds = [find_borders(matrices, c.s)[2] / size_at(matrices, c.s) for c in best.chains]
    sensitivity = _measure_sensitivity(best, family.widths)
    error = best.error if _are_distinct(best.chains, eigenvalues_of(matrices)) else np.inf
    return ExceptionalPoint(p, best.chains, error, min(seconds), sensitivity, (steps, step_count))


def _are_distinct(chains: Sequence[Chain], eigenvalues: Complex) -> bool:
    """Whether the chains belong to different eigenvalues: near two of them lie as many as both orders together.

    At an eigenvalue of order 3, the equations of two chains of length 2 hold as well.
    """
    size = float(np.abs(eigenvalues - eigenvalues.mean()).max()) or 1.0
    for a, b in combinations(chains, 2):
        distance, count = abs(a.s - b.s), a.order + b.order
        reach = distance + size * MAX_BACKWARD_ERROR ** (1 / count)
        near = np.sort(np.abs(eigenvalues - (a.s + b.s) / 2))[:count]
        if distance <= _DISTINCT * size or (distance <= _CLOSE[0] * size and near[-1] > reach):
            return False
    return True


def measure_point(family: Family, targets: Sequence[Target], p: Array) -> ExceptionalPoint | None:
    """The chains at a design that stays as it is; None if the matrices are not finite or an eigenvalue has several
    eigenvectors."""
    return find_point(family.at(p), targets, np.empty(0))


@dataclass(frozen=True)
class LinearisedChains:
    """The equations of the chains at a design: residuals, slopes with respect to parameters and eigenvalues."""

    p: Array
    chains: tuple[Chain, ...]
    residual: Array
    slopes: Array
    root_slopes: Array
    sizes: tuple[float, ...]

    @cached_property
    def error(self) -> float:
        """Largest relative change of the matrices that makes a chain exact."""
        return max(chain.backward_error(size) for chain, size in zip(self.chains, self.sizes, strict=True))


def chain_equations(
    family: Family,
    targets: Sequence[Target],
    p: Array,
    roots: Sequence[complex],
    borders: Sequence[tuple[Complex, Complex]],
) -> LinearisedChains:
    """The equations of the chains of several targets.

    Args:
        borders: borders of the matrix polynomial at each root, see `tmsopt.roots.chains.find_borders`.

    Raises:
        LinAlgError: if the matrices are not finite, or an eigenvalue has several eigenvectors.
    """
    matrices, slopes = family.expand(p)
    chains = tuple(make_chain(matrices, s, t.order, b) for s, t, b in zip(roots, targets, borders, strict=True))
    residual, rows, root_rows = list[Array](), list[Array](), list[Array]()
    sizes = tuple(size_at(matrices, s) for s in roots)
    for chain, target, size in zip(chains, targets, sizes, strict=True):
        columns = [chain.residuals, *(chain.respond(change) for change in slopes)]
        columns += [chain.slopes * direction for direction in target.directions]
        table = np.array(columns).T / size
        parts = table.real if target.is_real(family.is_complex) else np.concatenate([table.real, table.imag])
        residual.append(parts[:, 0])
        rows.append(parts[:, 1 : 1 + len(p)])
        root_rows.append(parts[:, 1 + len(p) :])
    width = sum(part.shape[1] for part in root_rows)
    root_slopes, row, column = np.zeros((sum(map(len, residual)), width)), 0, 0
    for part in root_rows:
        root_slopes[row : row + len(part), column : column + part.shape[1]] = part
        row, column = row + len(part), column + part.shape[1]
    return LinearisedChains(p, chains, np.concatenate(residual), np.concatenate(rows), root_slopes, sizes)


def _chain_step(
    equations: LinearisedChains, targets: Sequence[Target], family: Family, pull: Array
) -> tuple[Array, list[complex]]:
    """The step of the parameters in shares of their ranges, and the moves of the eigenvalues.

    Args:
        pull: the way to the design that the point shall be nearest to, followed as far as the conditions leave freedom.
    """
    slopes = equations.slopes * family.widths
    basis = np.linalg.qr(equations.root_slopes, mode="complete")[0][:, equations.root_slopes.shape[1] :]
    U, values, V = np.linalg.svd(basis.T @ slopes)
    rank = _rank(values)
    right = (U[:, :rank].T @ basis.T @ -equations.residual) / values[:rank]
    step = V[:rank].T @ right + V[rank:].T @ (V[rank:] @ pull)
    rest = -equations.residual - slopes @ step
    moves = iter(np.linalg.lstsq(equations.root_slopes, rest, rcond=_CUTOFF)[0].tolist())
    return step, [sum((d * next(moves) for d in target.directions), 0j) for target in targets]


def _rank(values: Any) -> int:
    """Number of singular values that are not 0."""
    return int(np.sum(values > _CUTOFF * max(values[0], 1e-300))) if values.size else 0


def _measure_sensitivity(equations: LinearisedChains, widths: Array) -> Array:
    basis = np.linalg.qr(equations.root_slopes, mode="complete")[0][:, equations.root_slopes.shape[1] :]
    reduced = basis.T @ equations.slopes * widths
    if not np.isfinite(reduced).all() or _rank(np.linalg.svd(reduced, compute_uv=False)) < len(widths):
        return np.full(len(widths), np.inf)
    return np.asarray(widths * np.abs(np.linalg.pinv(reduced)).sum(axis=1))


def project_on_axis(s: complex, target: Target) -> complex:
    """The point of the axis of a target that is nearest to s."""
    return {"real": complex(s.real), "imaginary": 1j * s.imag, "zero": 0j}.get(target.axis, s)
