"""A quasi-random sample of the box, the source of starts and of designs better than the ends.

To *judge* designs is to compute their objective and violations, all at once in arrays. To *refine* them is to improve
each by random steps that become shorter.
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


@dataclass(frozen=True)
class DesignBatch:
    """Judged designs, as points of the unit cube; sorting keeps the order of equal ones.

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
        """Return at most `count` designs that are this far apart; an earlier design wins over a later one near it."""
        rows: list[int] = []
        remaining_rows = np.arange(len(self))
        while remaining_rows.size and len(rows) < count:
            rows.append(int(remaining_rows[0]))
            remaining_rows = remaining_rows[
                np.abs(self.u[remaining_rows] - self.u[remaining_rows[0]]).max(axis=1) >= distance
            ]
        return self.take(np.array(rows, dtype=int))

    def select_scattered(self, count: int, cell: float) -> "DesignBatch":
        """Return the first design in each cell of a grid, at most `count`; this is faster than `select_apart`."""
        cells = np.floor(self.u / cell) @ np.random.default_rng(0).random(self.u.shape[1])
        return self.take(np.sort(np.unique(cells, return_index=True)[1])[:count])

    def select_better(self, threshold: float) -> "DesignBatch":
        """Return the feasible designs with an objective below a threshold, the best first."""
        batch = self.take(np.flatnonzero((self.violation == 0) & (self.objective < threshold)))
        return batch.take(batch.order)

    def misses_by(self, amount: float) -> bool:
        """Whether all designs violate limits by more than this amount."""
        return bool(np.all(self.violation > amount))


@dataclass(frozen=True)
class Box:
    """The box of a problem, with the designs that were drawn from it.

    Attributes:
        scales: unit of each limit's excess.
        draws: the drawn designs.
        judged: values of the drawn designs, limit by limit.
    """

    space: UnitBox
    seed: int
    scales: Array
    draws: DesignBatch
    judged: DesignScores
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
    def narrow(self) -> bool:
        """Whether few designs meet all limits."""
        return bool(np.mean(self.draws.violation == 0) < self.tuning.narrow)

    def refine(self, start: DesignBatch, reaches: Sequence[float | Array] = (), local: int = 0) -> DesignBatch:
        """Improve each design by random steps that become shorter; first by the violation, then by the objective.

        Args:
            reaches: step sizes round after round, as shares of the box, or for each design and direction, shape
                (designs, 1, size).
            local: number of designs to judge around each design, in each round.
        """
        batch, rng, local, size = start, stream(self.seed, "refine"), local or self.tuning.local, self.space.size
        rows = np.arange(len(start))
        for reach in (reaches or self.tuning.reaches) if rows.size else ():
            steps = rng.standard_normal((rows.size, local, size))
            steps[:, ::2] *= rng.random(steps[:, ::2].shape) < 0.5  # change some directions only
            neighbours = self.judge_points(np.clip(batch.u[:, None] + reach * steps, 0.0, 1.0).reshape(-1, size))
            candidates, origins = batch.join(neighbours), np.concatenate([rows, np.repeat(rows, local)])
            order = np.lexsort((candidates.objective, candidates.violation, origins))
            batch = candidates.take(order[np.searchsorted(origins[order], rows)])
        return batch

    def approach_limits(self, start: DesignBatch) -> DesignBatch:
        """Move each design by Newton's method, with the shortest steps, towards the limits that it violates."""
        batch, is_moving = start, np.isfinite(start.violation)
        for step in range(self.tuning.newton_steps):
            rows = np.flatnonzero((batch.violation > 0) & is_moving)
            if not rows.size or (step == self.tuning.hopeless_steps and batch.misses_by(self.unreachable)):
                break
            u, shares = batch.u[rows], np.array(self.tuning.shares)
            trial_points = np.clip(u[:, None] + self._newton_steps(u)[:, None] * shares[:, None], 0.0, 1.0)
            trials = self.judge_points(trial_points.reshape(-1, self.space.size))
            best = np.argmin(trials.violation.reshape(len(rows), -1), axis=1) + np.arange(len(rows)) * len(shares)
            is_better = is_moving[rows] = trials.violation[best] < batch.violation[rows]
            places = np.arange(len(batch))
            places[rows[is_better]] = len(batch) + best[is_better]
            batch = batch.join(trials).take(places)
        return batch

    def explore(self, design: Mapping[str, float]) -> DesignBatch:
        """Find the best designs around a design: at all distances, and with one parameter at an end of its range."""
        tuning, size = self.tuning, self.space.size
        u, rng = self.space.points(design), stream(self.seed, "around")
        reach = np.repeat(np.geomspace(0.5, 1e-5, tuning.shells), tuning.shell)[:, None]
        steps = rng.standard_normal((len(reach), size))
        steps[::2] *= rng.random(steps[::2].shape) < 0.5
        ends = np.repeat(u[None], 2 * size, axis=0)
        ends[np.arange(len(ends)), np.arange(len(ends)) // 2] = np.tile([0.0, 1.0], size)
        batch = self.judge_points(np.clip(np.concatenate([u[None], u + reach * steps, ends]), 0.0, 1.0))
        return batch.take_best(tuning.ranked).select_apart(tuning.leaders, tuning.beside)

    def ignore_limit(self, limit: str) -> DesignBatch:
        """Find designs far apart that violate the other limits least; their violations do not include this limit."""
        is_ignored = [name == limit for name in self.problem.conditions]
        box = replace(self, scales=np.where(is_ignored, 1e300, self.scales))
        draws = _make_batch(self.draws.u, self.judged, box.scales, self.tuning)
        leaders = draws.take_best(self.tuning.ranked).select_apart(self.tuning.leaders, self.tuning.apart)
        batch = box.refine(box.approach_limits(leaders))
        return batch.take(batch.order)

    @property
    def unreachable(self) -> float:
        """Violation that no n-fold root explains: a sample misses such a root by the n-th root of its last step."""
        return self.tuning.unreachable * float(self.tuning.reaches[-1] ** (1 / max(self.problem.model.degree, 4)))

    def _newton_steps(self, u: Array) -> Array:
        """Return the shortest steps that meet the violated limits to first order."""
        size = self.space.size
        steps = np.where(u < 0.5, self.tuning.difference, -self.tuning.difference)
        points = u[:, None] + np.concatenate([np.zeros((1, size)), np.eye(size)])[None] * steps[:, None]
        judged = score_designs(self.problem, self.space.designs(points.reshape(-1, size)))
        excess = judged.beyond.reshape(len(judged.beyond), len(u), size + 1) / self.scales[:, None, None]
        violated = judged.equal[:, None] | (excess[:, :, 0] > 0)
        target = np.where(violated, excess[:, :, 0], 0.0)
        with np.errstate(over="ignore", invalid="ignore"):  # limits without a value
            slopes = np.where(violated[:, :, None], (excess[:, :, 1:] - excess[:, :, :1]) / steps, 0.0)
        slopes, target = np.nan_to_num(slopes, posinf=0.0, neginf=0.0), np.nan_to_num(target)
        inverse = np.linalg.pinv(np.moveaxis(slopes, 0, 1), rcond=1e-10)
        return np.asarray(-np.einsum("rnm,mr->rn", inverse, target))


@dataclass(frozen=True)
class Sample:
    """Designs in the box that were judged before the first run of the solver.

    Attributes:
        refined: designs far apart that violate limits least, or have the best objective if feasible, after refinement.
        boldest: designs far apart with the best objective, whatever they violate.
        spread: interquartile range of the objective of the drawn designs.
        singular: whether a0 comes near 0 among the designs that violate limits least: the mass matrix may be singular.
    """

    box: Box
    refined: DesignBatch
    boldest: DesignBatch
    spread: float
    singular: bool

    @cached_property
    def leaders(self) -> DesignBatch:
        """Designs to start from: the refined ones, then the boldest."""
        return self.refined.join(self.boldest)

    @property
    def rank(self) -> tuple[float, float]:
        """Violation and objective of the best design."""
        return float(self.refined.violation[0]), float(self.refined.objective[0])

    @property
    def far_off(self) -> bool:
        """Whether limits seem to exclude each other: no refined design comes near to meeting them."""
        return self.refined.misses_by(self.box.tuning.far_off)

    @property
    def out_of_reach(self) -> bool:
        """Whether all refined designs violate limits by more than a multiple root explains; see `Box.unreachable`."""
        return self.refined.misses_by(self.box.unreachable)


def stream(seed: int, stage: str) -> np.random.Generator:
    """Return a generator of random numbers for one stage; other stages have independent ones."""
    return np.random.default_rng([seed, crc32(stage.encode())])


def draw_box(problem: Posed, seed: int, tuning: Tuning = TUNING) -> Box:
    """Draw and judge the corners of the box and a quasi-random sequence, some points of which are moved to faces."""
    space = UnitBox(problem)
    u = _draw_points(space, seed, tuning)
    judged = score_designs(problem, space.designs(u))
    sizes = [np.abs(excess[np.isfinite(excess)]) for excess in judged.beyond]
    medians = np.array([float(np.median(x)) if x.size else 0.0 for x in sizes])
    scales = np.where(medians > 0, medians, 1.0)
    return Box(space, seed, scales, _make_batch(u, judged, scales, tuning), judged, tuning)


def sample_box(problem: Posed, seed: int, tuning: Tuning = TUNING) -> Sample:
    """Draw a sample and refine its best designs."""
    box = draw_box(problem, seed, tuning)
    draws, ranked = box.draws, box.draws.take_best(tuning.ranked)
    if box.narrow:
        approached = box.approach_limits(ranked.select_scattered(tuning.sought, tuning.cell))
        refined = box.refine(approached.take(approached.order).select_apart(2 * tuning.leaders, tuning.apart))
    else:
        refined = _add_basins(box, ranked.select_apart(tuning.leaders, tuning.apart))
    boldest = draws.take(np.argsort(draws.objective, kind="stable")[: tuning.ranked])
    objectives = draws.objective[np.isfinite(draws.objective)]
    spread = float(np.subtract(*np.percentile(objectives, [75, 25]))) if objectives.size else 0.0
    leading = coefficients_of(problem, problem.ordered(box.space.designs(ranked.u)))[0]
    a0 = np.nan_to_num(np.broadcast_to(leading, len(ranked)))
    singular = bool(a0.min() <= 0 <= a0.max() or np.abs(a0).min() < tuning.vanishing * np.median(np.abs(a0)))
    return Sample(box, refined.take(refined.order), boldest.select_apart(tuning.bold, tuning.apart), spread, singular)


def _draw_points(space: UnitBox, seed: int, tuning: Tuning) -> Array:
    """Draw the points of a sample: a third near 0 in all parameters, a third near 0 in some; a few lie on faces."""
    problem, size = space.problem, space.size
    cost = max(1, len(problem.cases)) * (1 if problem.model.degree <= 4 else tuning.slower)
    max_count = min(tuning.first * 4 ** min(size, 4), tuning.most)
    count = max(max_count // cost, tuning.least)
    offset = np.random.default_rng(seed).random(size)
    u = (offset + np.arange(1, count + 1)[:, None] * golden_steps(size)) % 1.0
    index = np.arange(count)[:, None]
    is_near_zero = (index % 3 == 1) | ((index % 3 == 2) & (index // 3 >> np.arange(size) & 1 == 1))
    u = np.where(is_near_zero, space.sample_near_zero(u), u)
    u[:: tuning.faces] = np.clip(3 * u[:: tuning.faces] - 1, 0.0, 1.0)
    corners = np.array(list(product((0.0, 1.0), repeat=size))) if size <= tuning.corners else np.empty((0, size))
    return np.concatenate([np.full((1, size), 0.5), corners, u])


def _make_batch(u: Array, judged: DesignScores, scales: Array, tuning: Tuning) -> DesignBatch:
    objective = np.zeros(len(u)) if judged.worth is None else judged.worth
    excess = judged.excess / scales[:, None]
    violation = np.where(excess <= tuning.met, 0.0, excess).sum(axis=0)
    return DesignBatch(u, np.where(np.isfinite(objective), objective, np.inf), violation)


def _add_basins(box: Box, leaders: DesignBatch) -> DesignBatch:
    """Refine the leaders and the best design of each basin that the sample shows; return the best few of both."""
    tuning = box.tuning
    rows, reach = find_basins(box.draws, *box.space.even_near_zero(box.draws.u), tuning)
    count, start = len(leaders), leaders.join(box.draws.take(rows[: tuning.basins]))
    steps: list[float | Array] = [
        np.concatenate([np.full((count, 1, box.space.size), far), share * reach[: tuning.basins, None]])
        for far, share in zip((*tuning.reaches, tuning.reaches[-1]), tuning.basin_reaches, strict=True)
    ]
    batch = box.refine(start, steps, tuning.basin_local)
    basins = batch.take(np.arange(count, len(batch)))
    return batch.take(np.arange(count)).join(basins.take_best(tuning.deepest))


def find_basins(batch: DesignBatch, coordinates: Array, slopes: Array, tuning: Tuning = TUNING) -> tuple[Rows, Array]:
    """Find rows that are best in their cell of a grid and in all neighbouring cells; the best comes first.

    A path that goes from each design to a better neighbour ends at one of these, as in Törn's topographs. The second
    result is the size of the cell around each of these rows.

    Args:
        coordinates: of the designs, from 0 to 1, in which the designs are spread evenly.
        slopes: derivatives of these coordinates by those of the cube; a cell in the cube is smaller by this factor.
    """
    size = batch.u.shape[1]
    cells_per_design = min(tuning.cells, 3**size / (4 * (size + 2)))
    count = max(int((cells_per_design * len(batch)) ** (1 / size)), 4)
    rank = np.empty(len(batch), dtype=int)
    rank[batch.order] = np.arange(len(batch))
    cells = np.minimum(coordinates * count, count - 1).astype(int)
    cell = np.ravel_multi_index(tuple(cells.T), (count,) * size)
    best_rank = np.full(count**size, len(batch))
    np.minimum.at(best_rank, cell, rank)
    grid = best_rank.reshape((count,) * size)
    for axis in range(size):
        ends = np.concatenate([grid.take([0], axis), grid, grid.take([-1], axis)], axis)
        grid = sliding_window_view(ends, 3, axis).min(axis=-1)
    rows = np.flatnonzero(grid.ravel()[cell] == rank)
    rows = rows[np.argsort(rank[rows])]
    return rows, 1 / (count * slopes[rows])
