"""The best design that anybody finds without the package: samples, evolutions in islands, local steps between roots.

Equations, and limits that random designs miss, are met by steps of Newton in all parameters; `lifted` has the steps.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import qmc

from benchmarks.judges import Designs, eigenvalues, exactly, root_values
from benchmarks.rivals.lifted import lifted
from benchmarks.rivals.searches import quiet
from tmsopt import Problem
from tmsopt.records import Array

MET = 1e-9
"""Violation that counts as none, relative to the size of the two sides."""

_EQUAL = 1e-10  # up to which an equation counts as met on the way
_STEP = 1e-7  # of the box, for differences
_SAMPLES = 17  # 2 to the power of it: quasi-random designs
_KEPT = 12_000  # of them, whose roots are found
_ISLANDS = 6
_THIN = 0.03  # share of feasible designs below which every design of an evolution is moved to the limits
_GENERATIONS = 260
_LOCAL = 6  # ends from which SLSQP goes on


@dataclass(frozen=True)
class Best:
    """The best design known, or the least violating one.

    Attributes:
        value: in the problem's own sense, by isolated roots; nan where no design is feasible.
        how: what found it.
    """

    value: float
    violation: float
    design: dict[str, float]
    how: str
    seconds: float

    @property
    def feasible(self) -> bool:
        """Whether a design is feasible."""
        return self.violation <= MET


class _Search:
    def __init__(self, problem: Problem, seed: int) -> None:
        self.problem, self.at = problem, Designs(problem)
        self.rng = np.random.default_rng([seed, 5])
        self.width = self.at.upper - self.at.lower
        self.n = len(self.width)
        self.equal = self.at.equalities
        self.slack = _EQUAL if self.equal else 0.0
        self.thin = bool(self.equal)

    def x(self, u: Array) -> Array:
        lower, upper = self.at.lower[:, None], self.at.upper[:, None]
        return np.asarray(np.clip(lower + (upper - lower) * u, lower, upper))

    def merit(self, u: Array) -> Array:
        return self.at(self.x(u), self.slack).merit

    def values(self, u: Array, rooted: bool) -> Any:
        x = self.x(u)
        values = self.at.values(x)
        if rooted:
            a = self.at.coefficients(values, x.shape[1])
            values = values.with_known(
                dict(zip(("abscissa", "damping_ratio"), root_values(eigenvalues(a)), strict=True))
            )
        return values

    def repaired(self, u: Array, steps: int, every: bool = False) -> Array:
        """Least steps of Newton to the equations, and with `every` to violated limits that are not about roots."""
        rows = self.at.rows if every else self.equal
        rows = [r for r in rows if r.comparison == "==" or not r.rooted]
        if not rows or not u.size:
            return u
        rooted = any(r.rooted for r in rows)
        n, m = u.shape
        for _ in range(steps):
            shift = np.where(u > 0.5, -_STEP, _STEP)
            around = np.concatenate([u, *(u + np.eye(n)[:, [k]] * shift for k in range(n))], axis=1)
            with np.errstate(all="ignore"):
                values = self.values(around, rooted)
                apart = np.array([np.broadcast_to(r.apart(values), around.shape[1]) for r in rows])
            apart = np.nan_to_num(apart, nan=0.0, posinf=1e3, neginf=-1e3).reshape(len(rows), n + 1, m)
            h = apart[:, 0].T.copy()
            slopes = ((apart[:, 1:] - apart[:, :1]) / shift[None]).transpose(2, 0, 1)
            idle = np.array([[r.comparison != "=="] for r in rows])[:, 0][None, :] & (h <= 0)
            h[idle] = 0
            slopes[idle] = 0
            if np.abs(h).max() < 1e-14:
                break
            # a parameter at its end stays there if the step would leave the box
            gram = slopes @ slopes.transpose(0, 2, 1)
            gram += np.eye(len(rows)) * (1e-13 * np.trace(gram, axis1=1, axis2=2)[:, None, None] + 1e-30)
            step = -np.einsum("mrn,mr->nm", slopes, np.linalg.solve(gram, h[..., None])[..., 0])
            size = np.abs(step).max(axis=0)
            u = np.clip(u + step * np.minimum(1.0, 0.3 / np.maximum(size, 1e-300)), 0, 1)
        return u

    def sampled(self) -> tuple[Array, Array]:
        """Many designs, those worth a look repaired; sorted by merit."""
        power = _SAMPLES if self.n > 1 else 14
        with quiet():
            u = qmc.Sobol(self.n, rng=self.rng).random_base2(power).T
        violation = np.concatenate([self.at.plain(self.x(part)) for part in np.array_split(u, 8, axis=1)])
        violation = np.nan_to_num(violation, nan=1e3)
        free = np.flatnonzero(violation <= 0)
        self.thin = bool(self.equal) or len(free) < _THIN * u.shape[1]
        picked = [self.rng.permutation(free)[:_KEPT]]
        missing = max(_KEPT // 3, _KEPT - len(free)) if any(not r.rooted for r in self.at.rows) or self.equal else 0
        near = np.argsort(violation, kind="stable")[len(free) : len(free) + missing // 2]
        some = self.rng.permutation(u.shape[1])[: missing // 2]
        fixed = self.repaired(np.concatenate([u[:, near], u[:, some]], axis=1), 8, every=True)
        every = np.concatenate([u[:, picked[0]], fixed], axis=1)
        if self.equal:
            every = fixed
        merit = self.merit(every)
        order = np.argsort(merit, kind="stable")
        return every[:, order], merit[order]

    def apart(self, u: Array, merit: Array, wanted: int, reach: float) -> Array:
        """Indices of the best that are not near to each other."""
        kept: list[int] = []
        for k in range(len(merit)):
            if all(np.abs(u[:, k] - u[:, j]).max() > reach for j in kept):
                kept.append(k)
                if len(kept) == wanted:
                    break
        return np.array(kept)

    def evolved(self, islands: Array, generations: int) -> tuple[Array, Array]:
        """Differential evolution of islands (free, islands, size) at once; (free, islands) and their merits."""
        n, count, size = islands.shape
        u = islands.copy()
        merit = self.merit(u.reshape(n, -1)).reshape(count, size)
        rows = np.arange(count)[:, None]
        for generation in range(generations):
            picks = self.rng.random((count, size, size)).argsort(axis=2)[..., :3] if size < 24 else None
            if picks is None:
                picks = self.rng.integers(size, size=(count, size, 3))
            best = u[:, rows, merit.argmin(axis=1)[:, None]]
            a, b, c = (u[:, rows, picks[..., k]] for k in range(3))
            factor = self.rng.uniform(0.4, 0.95, (count, size))
            towards = np.where(self.rng.random((count, size)) < 0.6, 1.0, 0.0)
            base = np.where(towards > 0, u + factor * (best - u), a)
            trial = base + factor * (b - c)
            keep = self.rng.random((n, count, size)) > np.where(generation % 2, 0.9, 0.6)
            trial = np.where(keep, u, trial)
            trial = np.where(
                trial < 0, u * self.rng.random(), np.where(trial > 1, 1 - (1 - u) * self.rng.random(), trial)
            )
            flat = trial.reshape(n, -1)
            flat = self.repaired(flat, 3, every=True) if self.thin else flat
            found = self.merit(flat).reshape(count, size)
            better = found <= merit
            u = np.where(better, flat.reshape(n, count, size), u)
            merit = np.where(better, found, merit)
        first = merit.argmin(axis=1)
        return u[:, np.arange(count), first], merit[np.arange(count), first]


def best_known(problem: Problem, seed: int = 0, effort: float = 1.0) -> Best:
    """The best design that is feasible within `MET` by isolated roots, of everything that was tried."""
    began = time.process_time()
    ends: list[tuple[str, Array]] = []
    with quiet():
        search = _Search(problem, seed)
        u, merit = search.sampled()
        ends += [("samples", u[:, k]) for k in range(min(2, u.shape[1]))]
        picked = search.apart(u[:, :4000], merit[:4000], 12, 0.12)
        starts = u[:, picked]
        size = int(np.clip(7 * search.n, 24, 42))
        found, merits = search.evolved(_islands(search, u, starts, size), int(_GENERATIONS * effort))
        order = np.argsort(merits)
        ends += [("evolution", found[:, k]) for k in order[:3]]
        pool = np.concatenate([found[:, order], starts], axis=1)
        ranks = np.concatenate([merits[order], merit[picked]])
        order = np.argsort(ranks, kind="stable")
        few = order[search.apart(pool[:, order], ranks[order], int(_LOCAL * effort), 1e-3)]
        ends += list(_locally(search, pool[:, few]))
        every = np.array([e for _, e in ends]).T
        every = search.repaired(every, 6)
        ranks = search.merit(every)
        order = np.argsort(ranks, kind="stable")
        near = every[:, order[search.apart(every[:, order], ranks[order], 3, 1e-2)]]
        fine, _ = search.evolved(_around(search, near, size), int(0.6 * _GENERATIONS * effort))
        ends += [("fine evolution", fine[:, k]) for k in range(fine.shape[1])]
        ends += [(f"{how}, margin", end) for how, end in _locally(search, fine[:, :2], 3e-10)]
        return _judged(search, ends, began)


def _islands(search: _Search, u: Array, starts: Array, size: int) -> Array:
    """Two of random good designs, the others around the best."""
    n, good = search.n, max(size, u.shape[1] // 20)
    made = [u[:, search.rng.integers(good, size=size)], u[:, search.rng.integers(u.shape[1], size=size)]]
    for k in range(_ISLANDS - 2):
        centre = starts[:, [k % starts.shape[1]]]
        made.append(np.clip(centre + 0.08 * search.rng.normal(size=(n, size)) * (np.arange(size) > 0), 0, 1))
    islands = np.stack(made, axis=1)
    return search.repaired(islands.reshape(n, -1), 8, every=True).reshape(islands.shape)


def _around(search: _Search, near: Array, size: int) -> Array:
    reach = 10.0 ** search.rng.uniform(-6, -1.5, (near.shape[1], size)) * (np.arange(size) > 0)
    moved = near[:, :, None] + reach * search.rng.normal(size=(search.n, near.shape[1], size))
    u = np.clip(moved, 0, 1)
    return search.repaired(u.reshape(search.n, -1), 6).reshape(u.shape)


def _locally(search: _Search, starts: Array, margin: float = 0.0) -> Iterator[tuple[str, Array]]:
    return (("SLSQP", end) for k in range(starts.shape[1]) for end in lifted(search.at, starts[:, k], margin))


def _judged(search: _Search, ends: list[tuple[str, Array]], began: float) -> Best:
    """The best of the ends by isolated roots, each also with its equations met as well as doubles can.

    A design that rounds one with a multiple root counts with the value of that, as it does for the package.
    """
    problem, best = search.problem, None
    every = np.array([e for _, e in ends]).T
    ranks = np.minimum(search.merit(every), search.at(search.x(every), MET).merit)
    order = np.argsort(ranks, kind="stable")
    lifts = [k for k in range(len(ends)) if ends[k][0].startswith("SLSQP")]
    for k in dict.fromkeys([*order[:8], *sorted(lifts, key=lambda k: float(ranks[k]))[:12]]):
        for u in {e.tobytes(): e for e in (every[:, k], search.repaired(every[:, [k]], 8)[:, 0])}.values():
            design = dict(zip(search.at.names, map(float, search.x(u[:, None])[:, 0]), strict=True))
            for one in exactly(problem, design):
                found = Best(one.value, one.violation, design, ends[k][0], 0.0)
                if best is None or _ahead(problem, found, best):
                    best = found
    assert best is not None
    seconds = time.process_time() - began
    value = best.value if best.feasible else float("nan")
    return Best(value, best.violation, best.design, best.how, round(seconds, 2))


def _ahead(problem: Problem, one: Best, other: Best) -> bool:
    keys = [(not b.feasible, problem.posed.sign * b.value if b.feasible else b.violation) for b in (one, other)]
    return keys[0] < keys[1]
