"""A quasi-random sample of the box: it gives designs to start from, and designs that are better than the ends.

To *judge* designs is to compute their objectives and violations, in arrays for all designs together. To *refine* a
design is to improve it by random steps that become shorter. A *leader* is a design to start from.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from zlib import crc32

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from tmsopt.algebra.sequence import golden_steps
from tmsopt.problem import Posed
from tmsopt.problem.evaluate import coefficients_of
from tmsopt.program.design_scores import DesignScores, score_designs
from tmsopt.program.unit_box import UnitBox
from tmsopt.records import Array
from tmsopt.search.tuning import TUNING, Tuning

Rows = NDArray[np.int_]
"""Indices of designs in a batch."""


@dataclass(frozen=True)
class DesignBatch:
    """Judged designs, as points of the unit cube; equally good designs keep their order when sorted.

    Attributes:
        u: points, shape (designs, free parameters).
        objective: less is better, whether the problem minimises or maximises; inf where it has no value.
        violation: sum of the excesses over the limits, each relative to its scale; 0 where all limits hold.
    """

    u: Array
    objective: Array
    violation: Array

    def __len__(self) -> int:
        return len(self.u)

    def take(self, rows: Rows) -> "DesignBatch":
        """Return the designs of these rows."""
        return DesignBatch(self.u[rows], self.objective[rows], self.violation[rows])

    def join(self, other: "DesignBatch") -> "DesignBatch":
        """Return these designs, then the others."""
        pairs = (self.u, other.u), (self.objective, other.objective), (self.violation, other.violation)
        return DesignBatch(*map(np.concatenate, pairs))

    @cached_property
    def order(self) -> Rows:
        """Rows by violation, then by objective."""
        return np.lexsort((self.objective, self.violation))

    def take_best(self, count: int) -> "DesignBatch":
        """Return at most `count` designs, the best first."""
        return self.take(self.order[:count])

    def take_first(self, count: int) -> "DesignBatch":
        """Return the first `count` designs."""
        return self.take(np.arange(len(self))[:count])

    def select_apart(self, count: int, distance: float) -> "DesignBatch":
        """Return at most `count` designs that are this far apart; drop a design that is near an earlier one."""
        rows: list[int] = []
        remaining_rows = np.arange(len(self))
        while remaining_rows.size and len(rows) < count:
            rows.append(int(remaining_rows[0]))
            remaining_rows = remaining_rows[
                np.abs(self.u[remaining_rows] - self.u[remaining_rows[0]]).max(axis=1) >= distance
            ]
        return self.take(np.array(rows, dtype=int))

    def select_scattered(self, count: int, cell: float) -> "DesignBatch":
        """Return the first design in each cell of a grid, but at most `count`; this is faster than `select_apart`."""
        cells = np.floor(self.u / cell) @ np.random.default_rng(0).random(self.u.shape[1])
        return self.take(np.sort(np.unique(cells, return_index=True)[1])[:count])

    def select_better(self, threshold: float) -> "DesignBatch":
        """Return the feasible designs with an objective below a threshold, the best first."""
        batch = self.take(np.flatnonzero((self.violation == 0) & (self.objective < threshold)))
        return batch.take(batch.order)

    def all_violate_by(self, amount: float) -> bool:
        """Whether all designs violate limits by more than this amount."""
        return bool(np.all(self.violation > amount))


@dataclass(frozen=True)
class Box:
    """The box of a problem, with the designs that were drawn from it.

    Attributes:
        scales: unit of each limit's excess.
        draws: the drawn designs.
        draw_scores: objectives and excesses of the drawn designs, limit by limit.
    """

    space: UnitBox
    seed: int
    scales: Array
    draws: DesignBatch
    draw_scores: DesignScores
    tuning: Tuning = TUNING

    @property
    def problem(self) -> Posed:
        """The problem that has this box."""
        return self.space.problem

    def judge_points(self, u: Array) -> DesignBatch:
        """Judge points of shape (n, size)."""
        return _make_batch(u, score_designs(self.problem, self.space.designs(u)), self.scales, self.tuning)

    def design(self, batch: DesignBatch, row: int = 0) -> dict[str, float]:
        """The free parameters of one design."""
        return {n: float(x) for n, x in self.space.designs(batch.u[row]).items()}

    def designs(self, batch: DesignBatch) -> Iterator[dict[str, float]]:
        """The free parameters of each design."""
        return (self.design(batch, row) for row in range(len(batch)))

    @property
    def is_narrow(self) -> bool:
        """Whether few designs meet all limits."""
        return bool(np.mean(self.draws.violation == 0) < self.tuning.narrow_share)

    def refine(
        self, start: DesignBatch, step_sizes: Sequence[float | Array] = (), neighbour_count: int = 0
    ) -> DesignBatch:
        """Improve each design by random steps that become shorter; first its violation, then its objective.

        Args:
            step_sizes: one for each round, relative to the box: a number, or an array of shape (designs, 1, size) with
                a number for each design and direction.
            neighbour_count: number of designs to judge around each design, in each round.
        """
        batch, rng, count, size = (
            start,
            stream(self.seed, "refine"),
            neighbour_count or self.tuning.neighbour_count,
            self.space.size,
        )
        rows = np.arange(len(start))
        for step_size in (step_sizes or self.tuning.step_sizes) if rows.size else ():
            steps = rng.standard_normal((rows.size, count, size))
            steps[:, ::2] *= rng.random(steps[:, ::2].shape) < 0.5  # every second step changes some parameters only
            neighbours = self.judge_points(np.clip(batch.u[:, None] + step_size * steps, 0.0, 1.0).reshape(-1, size))
            candidates, origins = batch.join(neighbours), np.concatenate([rows, np.repeat(rows, count)])
            order = np.lexsort((candidates.objective, candidates.violation, origins))
            batch = candidates.take(order[np.searchsorted(origins[order], rows)])
        return batch

    def approach_limits(self, start: DesignBatch) -> DesignBatch:
        """Move each design by Newton's method, with the shortest steps, towards the limits that it violates."""
        batch, is_moving = start, np.isfinite(start.violation)
        for step in range(self.tuning.newton_steps):
            rows = np.flatnonzero((batch.violation > 0) & is_moving)
            if not rows.size or (
                step == self.tuning.hopeless_newton_steps and batch.all_violate_by(self.unreachable_violation)
            ):
                break
            u, fractions = batch.u[rows], np.array(self.tuning.step_shares)
            trial_points = np.clip(u[:, None] + self._newton_steps(u)[:, None] * fractions[:, None], 0.0, 1.0)
            trials = self.judge_points(trial_points.reshape(-1, self.space.size))
            best = np.argmin(trials.violation.reshape(len(rows), -1), axis=1) + np.arange(len(rows)) * len(fractions)
            is_better = is_moving[rows] = trials.violation[best] < batch.violation[rows]
            kept_rows = np.arange(len(batch))
            kept_rows[rows[is_better]] = len(batch) + best[is_better]
            batch = batch.join(trials).take(kept_rows)
        return batch

    def explore(self, design: Mapping[str, float]) -> DesignBatch:
        """Find the best designs around a design: at many distances, and with one parameter at an end of its range."""
        tuning, size = self.tuning, self.space.size
        u, rng = self.space.point(design), stream(self.seed, "around")
        distances = np.repeat(np.geomspace(0.5, 1e-5, tuning.shell_distances), tuning.shell_designs)[:, None]
        steps = rng.standard_normal((len(distances), size))
        steps[::2] *= rng.random(steps[::2].shape) < 0.5
        ends = np.repeat(u[None], 2 * size, axis=0)
        ends[np.arange(len(ends)), np.arange(len(ends)) // 2] = np.tile([0.0, 1.0], size)
        batch = self.judge_points(np.clip(np.concatenate([u[None], u + distances * steps, ends]), 0.0, 1.0))
        return batch.take_best(tuning.ranked_designs).select_apart(tuning.leaders, tuning.near_best_distance)

    def ignore_limit(self, limit: str) -> DesignBatch:
        """Find designs far apart that violate the other limits least; their violations do not include this limit."""
        is_ignored = [name == limit for name in self.problem.conditions]
        box = replace(self, scales=np.where(is_ignored, 1e300, self.scales))
        draws = _make_batch(self.draws.u, self.draw_scores, box.scales, self.tuning)
        leaders = draws.take_best(self.tuning.ranked_designs).select_apart(
            self.tuning.leaders, self.tuning.basin_distance
        )
        batch = box.refine(box.approach_limits(leaders))
        return batch.take(batch.order)

    @property
    def unreachable_violation(self) -> float:
        """Largest violation near an n-fold root: a sample misses the root by the n-th root of its last step size."""
        return self.tuning.unreachable_distance * float(
            self.tuning.step_sizes[-1] ** (1 / max(self.problem.model.degree, 4))
        )

    def _newton_steps(self, u: Array) -> Array:
        """Return the shortest steps that meet the violated limits to first order."""
        size = self.space.size
        steps = np.where(u < 0.5, self.tuning.difference_step, -self.tuning.difference_step)
        points = u[:, None] + np.concatenate([np.zeros((1, size)), np.eye(size)])[None] * steps[:, None]
        scores = score_designs(self.problem, self.space.designs(points.reshape(-1, size)))
        excess = scores.signed_excess.reshape(len(scores.signed_excess), len(u), size + 1) / self.scales[:, None, None]
        is_violated = scores.is_equality[:, None] | (excess[:, :, 0] > 0)
        target = np.where(is_violated, excess[:, :, 0], 0.0)
        with np.errstate(over="ignore", invalid="ignore"):  # some limits have no value
            slopes = np.where(is_violated[:, :, None], (excess[:, :, 1:] - excess[:, :, :1]) / steps, 0.0)
        slopes, target = np.nan_to_num(slopes, posinf=0.0, neginf=0.0), np.nan_to_num(target)
        inverse = np.linalg.pinv(np.moveaxis(slopes, 0, 1), rcond=1e-10)
        return np.asarray(-np.einsum("rnm,mr->rn", inverse, target))


@dataclass(frozen=True)
class Sample:
    """Designs in the box that are judged before the first run of the solver.

    Attributes:
        refined: refined designs that lie far apart: feasible ones with the best objective, or those that violate limits
            least.
        boldest: designs that lie far apart and have the best objective, even if they violate limits.
        spread: interquartile range of the objective of the drawn designs.
        is_nearly_singular: whether a0 comes near 0 in the designs that violate limits least; M may be singular.
    """

    box: Box
    refined: DesignBatch
    boldest: DesignBatch
    spread: float
    is_nearly_singular: bool

    @cached_property
    def leaders(self) -> DesignBatch:
        """Designs to start from: the refined ones, then the boldest."""
        return self.refined.join(self.boldest)

    @property
    def rank(self) -> tuple[float, float]:
        """Violation and objective of the best design."""
        return float(self.refined.violation[0]), float(self.refined.objective[0])

    @property
    def is_far_off(self) -> bool:
        """Whether no refined design comes near to meeting the limits, so that they seem to exclude each other."""
        return self.refined.all_violate_by(self.box.tuning.far_excess)

    @property
    def out_of_reach(self) -> bool:
        """Whether all refined designs violate limits by more than `Box.unreachable_violation`."""
        return self.refined.all_violate_by(self.box.unreachable_violation)


def stream(seed: int, stage: str) -> np.random.Generator:
    """Return the generator of random numbers of one stage; each stage has an independent one."""
    return np.random.default_rng([seed, crc32(stage.encode())])


def draw_box(problem: Posed, seed: int, tuning: Tuning = TUNING) -> Box:
    """Draw and judge the corners of the box and quasi-random points; some of these are moved to faces of the box."""
    space = UnitBox(problem)
    u = _draw_points(space, seed, tuning)
    scores = score_designs(problem, space.designs(u))
    sizes = [np.abs(excess[np.isfinite(excess)]) for excess in scores.signed_excess]
    medians = np.array([float(np.median(x)) if x.size else 0.0 for x in sizes])
    scales = np.where(medians > 0, medians, 1.0)
    return Box(space, seed, scales, _make_batch(u, scores, scales, tuning), scores, tuning)


def sample_box(problem: Posed, seed: int, tuning: Tuning = TUNING) -> Sample:
    """Draw a sample and refine its best designs."""
    box = draw_box(problem, seed, tuning)
    draws, ranked = box.draws, box.draws.take_best(tuning.ranked_designs)
    if box.is_narrow:
        approached = box.approach_limits(ranked.select_scattered(tuning.newton_designs, tuning.cell_size))
        refined = box.refine(approached.take(approached.order).select_apart(2 * tuning.leaders, tuning.basin_distance))
    else:
        refined = _add_basins(box, ranked.select_apart(tuning.leaders, tuning.basin_distance))
    boldest = draws.take(np.argsort(draws.objective, kind="stable")[: tuning.ranked_designs])
    objectives = draws.objective[np.isfinite(draws.objective)]
    spread = float(np.subtract(*np.percentile(objectives, [75, 25]))) if objectives.size else 0.0
    return Sample(
        box,
        refined.take(refined.order),
        boldest.select_apart(tuning.infeasible_leaders, tuning.basin_distance),
        spread,
        _is_nearly_singular(box, ranked),
    )


def _is_nearly_singular(box: Box, batch: DesignBatch) -> bool:
    """Whether a0 comes near 0 in some designs."""
    if box.problem.model.polynomial is None:
        return False
    leading = coefficients_of(box.problem, box.problem.ordered(box.space.designs(batch.u)))[0]
    a0 = np.nan_to_num(np.broadcast_to(leading, len(batch)))
    smallest, median = np.abs(a0).min(), np.median(np.abs(a0))
    return bool(a0.min() <= 0 <= a0.max() or smallest < box.tuning.vanishing_share * median)


def _draw_points(space: UnitBox, seed: int, tuning: Tuning) -> Array:
    """Draw the points of a sample: a third have all parameters near 0, a third have some near 0; a few lie on faces."""
    problem, size = space.problem, space.size
    relative_cost = max(1, len(problem.cases)) * (1 if problem.model.degree <= 4 else tuning.higher_degree_cost)
    max_count = min(tuning.base_sample * 4 ** min(size, 4), tuning.max_sample)
    count = max(max_count // relative_cost, tuning.min_sample)
    offset = np.random.default_rng(seed).random(size)
    u = (offset + np.arange(1, count + 1)[:, None] * golden_steps(size)) % 1.0
    index = np.arange(count)[:, None]
    is_near_zero = (index % 3 == 1) | ((index % 3 == 2) & (index // 3 >> np.arange(size) & 1 == 1))
    u = np.where(is_near_zero, space.sample_near_zero(u), u)
    u[:: tuning.face_copies] = np.clip(3 * u[:: tuning.face_copies] - 1, 0.0, 1.0)
    corners = (
        np.array(list(product((0.0, 1.0), repeat=size)))
        if size <= tuning.max_corner_parameters
        else np.empty((0, size))
    )
    return np.concatenate([np.full((1, size), 0.5), corners, u])


def _make_batch(u: Array, scores: DesignScores, scales: Array, tuning: Tuning) -> DesignBatch:
    objective = np.zeros(len(u)) if scores.objective is None else scores.objective
    excess = scores.excess / scales[:, None]
    violation = np.where(excess <= tuning.limit_tolerance, 0.0, excess).sum(axis=0)
    return DesignBatch(u, np.where(np.isfinite(objective), objective, np.inf), violation)


def _add_basins(box: Box, leaders: DesignBatch) -> DesignBatch:
    """Refine the leaders and the best design of each basin that the sample shows; return the best few of both."""
    tuning = box.tuning
    rows, cell_sizes = find_basins(box.draws, *box.space.resolve_near_zero(box.draws.u), tuning)
    count, start = len(leaders), leaders.join(box.draws.take(rows[: tuning.basins]))
    step_sizes: list[float | Array] = [
        np.concatenate([np.full((count, 1, box.space.size), of_box), of_cell * cell_sizes[: tuning.basins, None]])
        for of_box, of_cell in zip((*tuning.step_sizes, tuning.step_sizes[-1]), tuning.basin_step_sizes, strict=True)
    ]
    batch = box.refine(start, step_sizes, tuning.basin_neighbour_count)
    basins = batch.take(np.arange(count, len(batch)))
    return batch.take(np.arange(count)).join(basins.take_best(tuning.deepest_basins))


def find_basins(batch: DesignBatch, coordinates: Array, slopes: Array, tuning: Tuning = TUNING) -> tuple[Rows, Array]:
    """Find the basins of a sample: its best designs among their neighbours.

    A path that goes from each design to a better neighbour ends at one of these, as in Törn's topographs.

    Args:
        coordinates: coordinates of the designs, from 0 to 1, in which the designs are spread evenly.
        slopes: derivatives of these coordinates by those of the cube; a cell in the cube is smaller by this factor.

    Returns:
        The rows of designs that are best in their cell of a grid and in all neighbouring cells, the best first; and the
        size of the cell around each of these designs.
    """
    size = batch.u.shape[1]
    cells_per_design = min(tuning.cells_per_design, 3**size / (4 * (size + 2)))
    count = max(int((cells_per_design * len(batch)) ** (1 / size)), 4)
    rank = np.empty(len(batch), dtype=int)
    rank[batch.order] = np.arange(len(batch))
    cells = np.minimum(coordinates * count, count - 1).astype(int)
    cell = np.ravel_multi_index(tuple(cells.T), (count,) * size)
    best_rank = np.full(count**size, len(batch))
    np.minimum.at(best_rank, cell, rank)
    grid = best_rank.reshape((count,) * size)
    for axis in range(size):
        padded_grid = np.concatenate([grid.take([0], axis), grid, grid.take([-1], axis)], axis)
        grid = sliding_window_view(padded_grid, 3, axis).min(axis=-1)
    rows = np.flatnonzero(grid.ravel()[cell] == rank)
    rows = rows[np.argsort(rank[rows])]
    return rows, 1 / (count * slopes[rows])
