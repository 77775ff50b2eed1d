"""A quasi-random sample of the whole box, judged by arrays and refined: where to start, and the referee of claims."""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from itertools import product
from zlib import crc32

import numpy as np

from tmsopt.algebra.sequence import golden_steps
from tmsopt.problem.evaluate import coefficients_of
from tmsopt.problem.problem import Posed
from tmsopt.program.cube import Cube
from tmsopt.program.judgement import Judged, judge
from tmsopt.records import Array
from tmsopt.search.basins import REACHES, Looked, apart, basins, scattered
from tmsopt.search.rescues import rescued_by

_MOST, _LEAST = 3 * 2**12, 2**11
"""Designs of a sample: at most, and at least where each costs much."""

_FIRST, _EACH = 3 * 2**7, 4  # designs for no parameter at all, and times as many for each
_QUICK, _SLOWER = 4, 4  # degree with formulas of its own, and how many times as long those above take
_MANY = 4  # free parameters, beyond which no more designs are drawn
_CORNERS = 10  # free parameters up to which all corners of the box are looked at
_FACES = 4  # one design of so many is moved to faces of the box: many optima lie there

_RANKED = 1024  # first ones of an order among which those apart are chosen
_LEADERS, _BOLD = 8, 8  # designs to start from, of either kind
_BASINS, _DEEPEST = 64, 24  # basins that are refined, and the best of those, to start from too
_ROUNDS, _FEWER = (0.6, 0.3, 0.15, 0.07, 0.03, 0.01), 16
"""Steps by which those are refined, of the way to their neighbours, and designs looked at around each of them."""

_SOUGHT = 256  # designs from which limits are approached
NARROW = 0.02  # share of designs that meet all limits, below which little is feasible
_LOCAL = 40  # designs looked at around each that is refined, in each round

_SHELLS, _SHELL = 12, 64  # distances about a design, and designs at each
_NEAR = 0.01  # of the box: distance of designs about one that count as different
_VANISHING = 1e-2  # of its usual size: a leading coefficient that may come to 0
_NO_LIMIT = 1e300  # a scale by which nothing that exists counts
_MET = 1e-10  # of its scale: excess up to which a limit counts as met by numeric roots
_STEPS, _STEPS_AFAR = 12, 4  # of Newton's method towards what violated limits allow; where all stay far away
_STEP = 1e-7  # of the box, for differences
_SHARES = (1.0, 0.5, 0.1, 0.01, 1e-3)  # of a step, the best of which is taken


@dataclass(frozen=True)
class Sample:
    """What was seen of the whole box, before any solver.

    Attributes:
        refined: designs far from each other that violate least, or are best of those that violate nothing, refined.
        boldest: designs far from each other that are best whatever they violate.
        met, size: designs of the sample that meet all limits, and of all.
        spread: of the objective, over half of them.
        singular: whether a0 comes near 0 among those that violate least, so that the mass matrix may be singular.
    """

    refined: Looked
    boldest: Looked
    met: int
    size: int
    spread: float
    singular: bool

    @property
    def leaders(self) -> Looked:
        """Designs to start from: the refined ones, then the boldest."""
        return self.refined.joined(self.boldest)

    @property
    def far_off(self) -> bool:
        """Whether all designs stay away from what the limits allow."""
        return self.refined.far_off


class Sampler:
    """Looks at designs of one box, and counts them.

    Attributes:
        scales: of each limit's excess.
        count: of designs looked at.
        drawn: the first ones, and what they are.
    """

    def __init__(self, problem: Posed, seed: int) -> None:
        self.space, self.seed = Cube(problem), seed
        self.count = 0
        self.scales = np.ones(len(problem.conditions))
        self._offset = np.random.default_rng(seed).random(self.space.size)

    def stream(self, stage: str) -> np.random.Generator:
        """Random numbers of one stage, whatever others draw."""
        return np.random.default_rng([self.seed, crc32(stage.encode())])

    @property
    def problem(self) -> Posed:
        return self.space.problem

    def look(self, u: Array) -> Looked:
        """Judge points of shape (n, size)."""
        found = self._judged(u)
        return self._standing(u, found)

    def sample(self) -> Sample:
        """See the box."""
        drawn = self.draw()
        ranked = drawn.take(drawn.ranked[:_RANKED])
        leaders = ranked.take(apart(ranked, _LEADERS))
        met = int(np.sum(drawn.violation == 0))
        if met < NARROW * len(drawn) and rescued_by("sought"):
            sought = self.nearer(ranked.take(scattered(ranked, _SOUGHT)))
            sought = sought.take(sought.ranked)
            leaders = sought.take(apart(sought, 2 * _LEADERS))
        wide = met >= NARROW * len(drawn) and rescued_by("basins")
        refined = self._with_basins(leaders, drawn) if wide else self.refined(leaders)
        bold = drawn.take(np.argsort(drawn.worth, kind="stable")[:_RANKED])
        known = drawn.worth[np.isfinite(drawn.worth)]
        spread = float(np.subtract(*np.percentile(known, [75, 25]))) if known.size else 0.0
        a0 = self._leading(ranked.u)
        singular = bool(a0.min() <= 0 <= a0.max() or np.abs(a0).min() < _VANISHING * np.median(np.abs(a0)))
        return Sample(refined.take(refined.ranked), bold.take(apart(bold, _BOLD)), met, len(drawn), spread, singular)

    def without(self, limit: str) -> Looked:
        """Designs far from each other that violate the other limits least, refined; all of them count for no limit."""
        others, names = copy(self), list(self.problem.conditions)
        others.scales = np.where([name == limit for name in names], _NO_LIMIT, self.scales)
        seen = others._standing(*self.drawn)
        ranked = seen.take(seen.ranked[:_RANKED])
        found = others.refined(others.nearer(ranked.take(apart(ranked, _LEADERS))))
        return found.take(found.ranked)

    def draw(self) -> Looked:
        """Corners, a quasi-random sequence, and some of it moved to faces."""
        u, found = self.drawn = self._first()
        self.count += len(u)
        for k, beyond in enumerate(found.beyond):
            known = np.abs(beyond[np.isfinite(beyond)])
            self.scales[k] = float(np.median(known)) if known.size and np.median(known) > 0 else 1.0
        return self._standing(u, found)

    def _first(self) -> tuple[Array, Judged]:
        problem, size = self.problem, self.space.size
        cost = max(1, len(problem.cases)) * (1 if problem.model.degree <= _QUICK else _SLOWER)
        count = max(min(_FIRST * _EACH ** min(size, _MANY), _MOST) // cost, _LEAST)
        u = (self._offset + np.arange(1, count + 1)[:, None] * golden_steps(size)) % 1.0
        turn = np.arange(count)[:, None]
        beside = (turn % 3 == 1) | ((turn % 3 == 2) & (turn // 3 >> np.arange(size) & 1 == 1))
        u = np.where(beside, self.space.drawn_beside_zero(u), u)  # a third of them in all parameters, another in some
        u[::_FACES] = np.clip(3 * u[::_FACES] - 1, 0.0, 1.0)
        corners = np.array(list(product((0.0, 1.0), repeat=size))) if size <= _CORNERS else np.empty((0, size))
        u = np.concatenate([np.full((1, size), 0.5), corners, u])
        return u, judge(problem, self.space.designs(u))

    def refined(self, start: Looked, reaches: Sequence[float | Array] = REACHES, local: int = _LOCAL) -> Looked:
        """Each design improved by random steps that become shorter, limits first.

        Args:
            reaches: of the box, round after round, or of each design in each direction, shape (designs, 1, size).
            local: designs looked at around each, in each round.
        """
        kept, rng = start, self.stream("refined")
        rows = np.arange(len(kept))
        for reach in reaches if len(kept) else ():
            steps = rng.standard_normal((len(kept), local, self.space.size))
            steps[:, ::2] *= rng.random((len(kept), local // 2, self.space.size)) < 0.5  # not in all directions
            near = self.look(np.clip(kept.u[:, None] + reach * steps, 0.0, 1.0).reshape(-1, self.space.size))
            both = kept.joined(near)
            of = np.concatenate([rows, np.repeat(rows, local)])
            order = np.lexsort((both.worth, both.violation, of))
            kept = both.take(order[np.searchsorted(of[order], rows)])
        return kept

    def _with_basins(self, leaders: Looked, drawn: Looked) -> Looked:
        """Leaders refined, and after them the best of the basins that the designs drawn show, refined alike."""
        rows, reach = basins(drawn, *self.space.even(drawn.u))
        count, start = len(leaders), leaders.joined(drawn.take(rows[:_BASINS]))
        steps = [
            np.concatenate([np.full((count, 1, self.space.size), far), share * reach[:_BASINS, None]])
            for far, share in zip((*REACHES, REACHES[-1]), _ROUNDS, strict=True)
        ]
        found = self.refined(start, steps, _FEWER)
        others = found.take(np.arange(count, len(found)))
        return found.take(np.arange(count)).joined(others.take(others.ranked[:_DEEPEST]))

    def nearer(self, start: Looked) -> Looked:
        """Each design moved by Newton's method towards what the limits that it violates allow, the shortest way."""
        kept = start
        moving = np.isfinite(kept.violation)
        for step in range(_STEPS):
            rows = np.flatnonzero((kept.violation > 0) & moving)
            if not rows.size or (step == _STEPS_AFAR and kept.out_of_reach(self.problem.model.degree)):
                break
            steps = self._newton_steps(kept.u[rows])
            tried = np.clip(kept.u[rows][:, None] + steps[:, None] * np.array(_SHARES)[:, None], 0.0, 1.0)
            ends = self.look(tried.reshape(-1, self.space.size))
            best = np.argmin(ends.violation.reshape(len(rows), -1), axis=1) + np.arange(len(rows)) * len(_SHARES)
            before, after = kept.violation[rows], ends.violation[best]
            better = moving[rows] = after < before
            joined = kept.joined(ends)
            places = np.arange(len(kept))
            places[rows[better]] = len(kept) + best[better]
            kept = joined.take(places)
        return kept

    def design(self, found: Looked, row: int) -> dict[str, float]:
        """The free parameters of one design."""
        return {n: float(x) for n, x in self.space.designs(found.u[row]).items()}

    def around(self, design: Mapping[str, float]) -> Looked:
        """The best of the designs about one: near it at all distances, and with parameters at other ends of the box."""
        u, rng = self.space.points(design), self.stream("around")
        reach = np.repeat(np.geomspace(0.5, 1e-5, _SHELLS), _SHELL)[:, None]
        steps = rng.standard_normal((len(reach), self.space.size))
        steps[::2] *= rng.random((len(reach[::2]), self.space.size)) < 0.5
        ends = np.repeat(u[None], 2 * self.space.size, axis=0)
        ends[np.arange(len(ends)), np.repeat(np.arange(self.space.size), 2)] = np.tile([0.0, 1.0], self.space.size)
        seen = self.look(np.clip(np.concatenate([u[None], u + reach * steps, ends]), 0.0, 1.0))
        best = seen.take(seen.ranked[:_RANKED])
        return best.take(apart(best, _LEADERS, _NEAR))

    def _newton_steps(self, u: Array) -> Array:
        """Shortest steps to where violated limits are met, to first order."""
        size = self.space.size
        ahead = np.where(u < 0.5, _STEP, -_STEP)
        moved = u[:, None] + np.concatenate([np.zeros((1, size)), np.eye(size)])[None] * ahead[:, None]
        found = self._judged(moved.reshape(-1, size))
        beyond = found.beyond.reshape(len(found.beyond), len(u), size + 1) / self.scales[:, None, None]
        violated = found.equal[:, None] | (beyond[:, :, 0] > 0)
        target = np.where(violated, beyond[:, :, 0], 0.0)
        with np.errstate(over="ignore", invalid="ignore"):  # of limits without a value
            slopes = np.where(violated[:, :, None], (beyond[:, :, 1:] - beyond[:, :, :1]) / ahead, 0.0)
        slopes, target = np.nan_to_num(slopes, posinf=0.0, neginf=0.0), np.nan_to_num(target)
        inverse = np.linalg.pinv(np.moveaxis(slopes, 0, 1), rcond=1e-10)
        return np.asarray(-np.einsum("rnm,mr->rn", inverse, target))

    def _leading(self, u: Array) -> Array:
        """The leading coefficient of designs."""
        a0 = coefficients_of(self.problem, self.problem.ordered(self.space.designs(u)))[0]
        return np.asarray(np.nan_to_num(np.broadcast_to(a0, len(u))))

    def _judged(self, u: Array) -> Judged:
        self.count += len(u)
        return judge(self.problem, self.space.designs(u))

    def _standing(self, u: Array, found: Judged) -> Looked:
        worth = np.zeros(len(u)) if found.worth is None else found.worth
        excess = found.excess / self.scales[:, None]
        violation = np.where(excess <= _MET, 0.0, excess).sum(axis=0)
        return Looked(u, np.where(np.isfinite(worth), worth, np.inf), violation)
