"""A quasi-random sample of the whole box, judged by arrays and refined: where to start, and what no answer may miss."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product, zip_longest
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from tmsopt.algebra.sequence import golden_steps
from tmsopt.problem.evaluate import coefficients_of
from tmsopt.problem.problem import Posed
from tmsopt.program.design_scores import DesignScores, score_designs
from tmsopt.program.unit_box import UnitBox
from tmsopt.records import Array
from tmsopt.search.tuning import TUNING, Tuning

Rows = NDArray[np.int_]


@dataclass(frozen=True)
class Looked:
    """Designs as points of the unit cube, judged; the first ones come first where nothing else decides.

    Attributes:
        u: points, shape (designs, free parameters).
        worth: the objective, larger is worse; inf where it does not exist.
        violation: sum of the excesses, each relative to its scale; 0 where all limits are met.
    """

    u: Array
    worth: Array
    violation: Array

    def __len__(self) -> int:
        return len(self.u)

    def take(self, rows: Rows) -> "Looked":
        """Some of them."""
        return Looked(self.u[rows], self.worth[rows], self.violation[rows])

    def joined(self, other: "Looked") -> "Looked":
        """These and others."""
        pairs = (self.u, other.u), (self.worth, other.worth), (self.violation, other.violation)
        return Looked(*map(np.concatenate, pairs))

    @cached_property
    def ranked(self) -> Rows:
        """Rows by violation, then by worth."""
        return np.lexsort((self.worth, self.violation))

    def best(self, most: int) -> "Looked":
        """The first few by rank."""
        return self.take(self.ranked[:most])

    def first(self, most: int) -> "Looked":
        """The first few, if there are so many."""
        return self.take(np.arange(min(most, len(self))))

    def apart(self, most: int, distance: float) -> "Looked":
        """The first few that lie so far apart from each other."""
        rows: list[int] = []
        left = np.arange(len(self))
        while left.size and len(rows) < most:
            rows.append(int(left[0]))
            left = left[np.abs(self.u[left] - self.u[left[0]]).max(axis=1) >= distance]
        return self.take(np.array(rows, dtype=int))

    def scattered(self, most: int, cell: float) -> "Looked":
        """The first few in cells of their own: what `apart` gives for many, in a fraction of its time."""
        cells = np.floor(self.u / cell) @ np.random.default_rng(0).random(self.u.shape[1])
        return self.take(np.sort(np.unique(cells, return_index=True)[1])[:most])

    def better(self, least: float) -> "Looked":
        """Those that meet all limits and are worth less, the best first."""
        some = self.take(np.flatnonzero((self.violation == 0) & (self.worth < least)))
        return some.take(some.ranked)

    def misses_by(self, amount: float) -> bool:
        """Whether all of them violate limits by more than this."""
        return bool(np.all(self.violation > amount))


@dataclass(frozen=True)
class Box:
    """The box of a problem as a place to look at designs.

    Attributes:
        scales: of each limit's excess.
        drawn: the designs of the sample.
        judged: what these are, limit by limit.
    """

    space: UnitBox
    seed: int
    scales: Array
    drawn: Looked
    judged: DesignScores
    tuning: Tuning = TUNING

    @property
    def problem(self) -> Posed:
        """Whose box it is."""
        return self.space.problem

    def stream(self, stage: str) -> np.random.Generator:
        """Random numbers of one stage, whatever others draw."""
        return stream(self.seed, stage)

    def look(self, u: Array) -> Looked:
        """Judge points of shape (n, size)."""
        return _looked(u, score_designs(self.problem, self.space.designs(u)), self.scales, self.tuning)

    def design(self, found: Looked, row: int = 0) -> dict[str, float]:
        """The free parameters of one design."""
        return {n: float(x) for n, x in self.space.designs(found.u[row]).items()}

    def designs(self, found: Looked) -> Iterator[dict[str, float]]:
        """The free parameters of each design."""
        return (self.design(found, row) for row in range(len(found)))

    @property
    def met(self) -> float:
        """Share of the designs drawn that meet all limits."""
        return float(np.mean(self.drawn.violation == 0))

    @property
    def narrow(self) -> bool:
        """Whether few designs meet all limits."""
        return self.met < self.tuning.narrow

    def refine(self, start: Looked, reaches: Sequence[float | Array] = (), local: int = 0) -> Looked:
        """Each design improved by random steps that become shorter, limits first.

        Args:
            reaches: of the box, round after round, or of each design in each direction, shape (designs, 1, size).
            local: designs looked at around each, in each round.
        """
        kept, rng, local, size = start, self.stream("refine"), local or self.tuning.local, self.space.size
        count = len(kept)
        rows = np.arange(count)
        for reach in (reaches or self.tuning.reaches) if count else ():
            steps = rng.standard_normal((count, local, size))
            steps[:, ::2] *= rng.random((count, (local + 1) // 2, size)) < 0.5  # not in all directions
            near = self.look(np.clip(kept.u[:, None] + reach * steps, 0.0, 1.0).reshape(-1, size))
            both, of = kept.joined(near), np.concatenate([rows, np.repeat(rows, local)])
            order = np.lexsort((both.worth, both.violation, of))
            kept = both.take(order[np.searchsorted(of[order], rows)])
        return kept

    def approach_limits(self, start: Looked) -> Looked:
        """Each design moved by Newton's method towards what the limits that it violates allow, the shortest way."""
        kept, moving = start, np.isfinite(start.violation)
        for step in range(self.tuning.newton_steps):
            rows = np.flatnonzero((kept.violation > 0) & moving)
            if not rows.size or (step == self.tuning.hopeless_steps and kept.misses_by(self.unreachable)):
                break
            steps, shares = self._newton_steps(kept.u[rows]), np.array(self.tuning.shares)
            tried = np.clip(kept.u[rows][:, None] + steps[:, None] * shares[:, None], 0.0, 1.0)
            ends = self.look(tried.reshape(-1, self.space.size))
            best = np.argmin(ends.violation.reshape(len(rows), -1), axis=1) + np.arange(len(rows)) * len(shares)
            better = moving[rows] = ends.violation[best] < kept.violation[rows]
            places = np.arange(len(kept))
            places[rows[better]] = len(kept) + best[better]
            kept = kept.joined(ends).take(places)
        return kept

    def around(self, design: Mapping[str, float]) -> Looked:
        """The best of the designs about one: near it at all distances, and with parameters at other ends of the box."""
        tuning, size = self.tuning, self.space.size
        u, rng = self.space.points(design), self.stream("around")
        reach = np.repeat(np.geomspace(0.5, 1e-5, tuning.shells), tuning.shell)[:, None]
        steps = rng.standard_normal((len(reach), size))
        steps[::2] *= rng.random((len(reach[::2]), size)) < 0.5
        ends = np.repeat(u[None], 2 * size, axis=0)
        ends[np.arange(len(ends)), np.repeat(np.arange(size), 2)] = np.tile([0.0, 1.0], size)
        seen = self.look(np.clip(np.concatenate([u[None], u + reach * steps, ends]), 0.0, 1.0))
        return seen.best(tuning.ranked).apart(tuning.leaders, tuning.beside)

    def without(self, limit: str) -> Looked:
        """Designs far from each other that violate the other limits least, refined; all of them count for no limit."""
        ignored = [name == limit for name in self.problem.conditions]
        others = replace(self, scales=np.where(ignored, 1e300, self.scales))
        seen = _looked(self.drawn.u, self.judged, others.scales, self.tuning)
        found = others.refine(
            others.approach_limits(seen.best(self.tuning.ranked).apart(self.tuning.leaders, self.tuning.apart))
        )
        return found.take(found.ranked)

    @property
    def unreachable(self) -> float:
        """Violation that no n-fold root explains, which no sample meets: it is missed by the n-th root of a step."""
        return self.tuning.unreachable * float(self.tuning.reaches[-1] ** (1 / max(self.problem.model.degree, 4)))

    def leading(self, u: Array) -> Array:
        """The leading coefficient of designs."""
        a0 = coefficients_of(self.problem, self.problem.ordered(self.space.designs(u)))[0]
        return np.asarray(np.nan_to_num(np.broadcast_to(a0, len(u))))

    def _newton_steps(self, u: Array) -> Array:
        """Shortest steps to where violated limits are met, to first order."""
        size = self.space.size
        ahead = np.where(u < 0.5, self.tuning.difference, -self.tuning.difference)
        moved = u[:, None] + np.concatenate([np.zeros((1, size)), np.eye(size)])[None] * ahead[:, None]
        found = score_designs(self.problem, self.space.designs(moved.reshape(-1, size)))
        beyond = found.beyond.reshape(len(found.beyond), len(u), size + 1) / self.scales[:, None, None]
        violated = found.equal[:, None] | (beyond[:, :, 0] > 0)
        target = np.where(violated, beyond[:, :, 0], 0.0)
        with np.errstate(over="ignore", invalid="ignore"):  # of limits without a value
            slopes = np.where(violated[:, :, None], (beyond[:, :, 1:] - beyond[:, :, :1]) / ahead, 0.0)
        slopes, target = np.nan_to_num(slopes, posinf=0.0, neginf=0.0), np.nan_to_num(target)
        inverse = np.linalg.pinv(np.moveaxis(slopes, 0, 1), rcond=1e-10)
        return np.asarray(-np.einsum("rnm,mr->rn", inverse, target))


@dataclass(frozen=True)
class Sample:
    """What was seen of the whole box, before any solver.

    Attributes:
        refined: designs far from each other that violate least, or are best of those that violate nothing, refined.
        boldest: designs far from each other that are best whatever they violate.
        spread: of the objective, over half of the designs drawn.
        singular: whether a0 comes near 0 among those that violate least, so that the mass matrix may be singular.
    """

    box: Box
    refined: Looked
    boldest: Looked
    spread: float
    singular: bool

    @cached_property
    def leaders(self) -> Looked:
        """Designs to start from: the refined ones, then the boldest."""
        return self.refined.joined(self.boldest)

    @property
    def first(self) -> tuple[float, float]:
        """Violation and worth of the best design."""
        return float(self.refined.violation[0]), float(self.refined.worth[0])

    def starts(self) -> Iterator[tuple[int, bool]]:
        """Rows of the leaders to start from, refined and bold by turns, and whether each is refined."""
        count = len(self.refined)
        for pair in zip_longest(range(count), range(count, len(self.leaders))):
            yield from ((row, row < count) for row in pair if row is not None)

    @property
    def far_off(self) -> bool:
        """Whether limits seem to exclude each other: where they can be met, some refined design meets them."""
        return self.refined.misses_by(self.box.tuning.far_off)

    @property
    def out_of_reach(self) -> bool:
        """The same by so much that it is not for a multiple root alone."""
        return self.refined.misses_by(self.box.unreachable)


def stream(seed: int, stage: str) -> np.random.Generator:
    """Random numbers of one stage, whatever others draw."""
    return np.random.default_rng([seed, crc32(stage.encode())])


def draw_box(problem: Posed, seed: int, tuning: Tuning = TUNING) -> Box:
    """Judge corners, a quasi-random sequence, and some of it moved to faces."""
    space = UnitBox(problem)
    u = _drawn(space, seed, tuning)
    judged = score_designs(problem, space.designs(u))
    sizes = [np.abs(beyond[np.isfinite(beyond)]) for beyond in judged.beyond]
    medians = np.array([float(np.median(x)) if x.size else 0.0 for x in sizes])
    scales = np.where(medians > 0, medians, 1.0)
    return Box(space, seed, scales, _looked(u, judged, scales, tuning), judged, tuning)


def sample_box(problem: Posed, seed: int, tuning: Tuning = TUNING) -> Sample:
    """See the box."""
    box = draw_box(problem, seed, tuning)
    drawn, ranked = box.drawn, box.drawn.best(tuning.ranked)
    if box.narrow:
        near = box.approach_limits(ranked.scattered(tuning.sought, tuning.cell))
        refined = box.refine(near.take(near.ranked).apart(2 * tuning.leaders, tuning.apart))
    else:
        refined = _with_basins(box, ranked.apart(tuning.leaders, tuning.apart))
    bold = drawn.take(np.argsort(drawn.worth, kind="stable")[: tuning.ranked])
    known = drawn.worth[np.isfinite(drawn.worth)]
    spread = float(np.subtract(*np.percentile(known, [75, 25]))) if known.size else 0.0
    a0 = box.leading(ranked.u)
    singular = bool(a0.min() <= 0 <= a0.max() or np.abs(a0).min() < tuning.vanishing * np.median(np.abs(a0)))
    return Sample(box, refined.take(refined.ranked), bold.apart(tuning.bold, tuning.apart), spread, singular)


def _drawn(space: UnitBox, seed: int, tuning: Tuning) -> Array:
    """Points of the sample: a third of them beside 0 in all parameters, another in some; a few on faces."""
    problem, size = space.problem, space.size
    cost = max(1, len(problem.cases)) * (1 if problem.model.degree <= 4 else tuning.slower)
    most = min(tuning.first * 4 ** min(size, 4), tuning.most)
    count = max(most // cost, tuning.least)
    offset = np.random.default_rng(seed).random(size)
    u = (offset + np.arange(1, count + 1)[:, None] * golden_steps(size)) % 1.0
    turn = np.arange(count)[:, None]
    beside = (turn % 3 == 1) | ((turn % 3 == 2) & (turn // 3 >> np.arange(size) & 1 == 1))
    u = np.where(beside, space.sample_near_zero(u), u)
    u[:: tuning.faces] = np.clip(3 * u[:: tuning.faces] - 1, 0.0, 1.0)
    corners = np.array(list(product((0.0, 1.0), repeat=size))) if size <= tuning.corners else np.empty((0, size))
    return np.concatenate([np.full((1, size), 0.5), corners, u])


def _looked(u: Array, judged: DesignScores, scales: Array, tuning: Tuning) -> Looked:
    worth = np.zeros(len(u)) if judged.worth is None else judged.worth
    excess = judged.excess / scales[:, None]
    violation = np.where(excess <= tuning.met, 0.0, excess).sum(axis=0)
    return Looked(u, np.where(np.isfinite(worth), worth, np.inf), violation)


def _with_basins(box: Box, leaders: Looked) -> Looked:
    """Leaders refined, and after them the best of the basins that the designs drawn show, refined alike."""
    tuning = box.tuning
    rows, reach = find_basins(box.drawn, *box.space.even_near_zero(box.drawn.u), tuning)
    count, start = len(leaders), leaders.joined(box.drawn.take(rows[: tuning.basins]))
    steps: list[float | Array] = [
        np.concatenate([np.full((count, 1, box.space.size), far), share * reach[: tuning.basins, None]])
        for far, share in zip((*tuning.reaches, tuning.reaches[-1]), tuning.basin_reaches, strict=True)
    ]
    found = box.refine(start, steps, tuning.basin_local)
    others = found.take(np.arange(count, len(found)))
    return found.take(np.arange(count)).joined(others.best(tuning.deepest))


def find_basins(found: Looked, coordinates: Array, slopes: Array, tuning: Tuning = TUNING) -> tuple[Rows, Array]:
    """Rows that are the best of all in the cells of a grid beside their own, the best first; and the size of a cell.

    Each of them is where a way from design to better design beside it ends, as in Törn's topographs.

    Args:
        coordinates: of the designs, from 0 to 1, about as even as they are.
        slopes: of these in the coordinates of the cube, by which the cells there are smaller.
    """
    size = found.u.shape[1]
    each = min(tuning.cells, 3**size / (4 * (size + 2)))
    count = max(int((each * len(found)) ** (1 / size)), 4)
    rank = np.empty(len(found), dtype=int)
    rank[found.ranked] = np.arange(len(found))
    cells = np.minimum(coordinates * count, count - 1).astype(int)
    cell = np.ravel_multi_index(tuple(cells.T), (count,) * size)
    least = np.full(count**size, len(found))
    np.minimum.at(least, cell, rank)
    grid = least.reshape((count,) * size)
    for axis in range(size):
        before = np.moveaxis(grid, axis, 0)
        after = before.copy()
        after[1:] = np.minimum(after[1:], before[:-1])
        after[:-1] = np.minimum(after[:-1], before[1:])
        grid = np.moveaxis(after, 0, axis)
    rows = np.flatnonzero(grid.ravel()[cell] == rank)
    rows = rows[np.argsort(rank[rows])]
    return rows, 1 / (count * slopes[rows])
