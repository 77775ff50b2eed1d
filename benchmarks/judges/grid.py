"""An independent judge of designs: numeric eigenvalues on dense grids of scenarios and tolerances.

It shares the model with `tmsopt.problem` and nothing else: expressions are Python's own, roots are those of companion
matrices, the worst case is the worst of a grid. Beside a multiple root eigenvalues scatter, by 4e-4 at a 4-fold one;
what rounding of the coefficients does to them is measured, and granted to whoever claims a value.
"""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from types import CodeType
from typing import Any

import numpy as np

from benchmarks.judges.eigenvalues import worst_roots
from benchmarks.judges.text import NOWHERE, evaluated, excess, sides
from tmsopt import Problem
from tmsopt.models import Values
from tmsopt.problem import Band
from tmsopt.records import Array

_ROUNDING = 2e-15  # relative, of a coefficient: a dozen roundings of doubles
_TRIALS = 12
_GRANTED = 3.0  # times the scatter seen in the trials
_WITHIN = 400  # points inside a tolerance box, besides its corners


@dataclass(frozen=True)
class Cases:
    """Variations of a design in arrays, shape (cases,) each.

    Attributes:
        at: parameter → values in place of the nominal one.
        offset: parameter → what is added.
    """

    at: Mapping[str, Array]
    offset: Mapping[str, Array]
    count: int


@dataclass(frozen=True)
class Judged:
    """What designs are worth, shape (designs,) each.

    Attributes:
        value: the objective in the problem's own sense, worst over the cases.
        violation: largest over the constraints and cases, relative to the size of the two sides.
        abscissa, damping_ratio: worst over the cases.
    """

    value: Array
    violation: Array
    abscissa: Array
    damping_ratio: Array


def cases_of(problem: Problem, points: int, inside: int = 0) -> Cases:
    """A grid of `points` per band with the corners of the tolerance box, and points inside both."""
    scenarios = {n: _points(s, points) for n, s in problem.posed.scenarios.items()}
    signs = [np.array([-1.0, 1.0])] * len(problem.tolerances)
    grid = np.array(list(itertools.product(*scenarios.values(), *signs)))
    if inside and (problem.tolerances or len(scenarios) > 1):
        rng = np.random.default_rng(0)
        drawn = [_drawn(rng, s, inside) for s in problem.posed.scenarios.values()]
        drawn += [rng.uniform(-1, 1, inside) for _ in problem.tolerances]
        grid = np.concatenate([grid, np.array(drawn).T])
    columns = list(grid.T)
    at = dict(zip(scenarios, columns, strict=False))
    rest = columns[len(scenarios) :]
    offset = {n: t * c for (n, t), c in zip(problem.tolerances.items(), rest, strict=True)}
    return Cases(at, offset, len(grid))


def _points(scenario: Any, points: int) -> Array:
    return np.linspace(scenario.min, scenario.max, points) if isinstance(scenario, Band) else np.array(scenario)


def _drawn(rng: np.random.Generator, scenario: Any, count: int) -> Array:
    return rng.uniform(scenario.min, scenario.max, count) if isinstance(scenario, Band) else rng.choice(scenario, count)


class Judge:
    """Evaluates many designs of one problem at once.

    Args:
        points: per band.
        inside: random points of bands and tolerance box together.
    """

    def __init__(self, problem: Problem, points: int = 33, inside: int = 0) -> None:
        self.problem = problem
        self.names = list(problem.free)
        self.lower, self.upper = np.array([problem.free[n] for n in self.names]).reshape(-1, 2).T
        self.cases = cases_of(problem, points, inside)
        self._rows = [_compiled(c.text) for c in problem.posed.conditions.values()]
        self._objective = (
            compile(problem.posed.objective.text, "objective", "eval") if problem.posed.objective else None
        )
        self._sign = -1.0 if problem.posed.sense == "maximize" else 1.0

    def worth(self, x: Array) -> Array:
        """The objective alone, worst over the cases, without roots if it is not about them."""
        assert self.problem.posed.objective is not None
        return (
            self(x).value if {"abscissa", "damping_ratio"} & set(self.problem.posed.objective.names) else self._plain(x)
        )

    def __call__(self, x: Array, shift: float = 0.0) -> Judged:
        """Designs of shape (free, designs); root quantities better by `shift` times what rounding does to them."""
        size = (x.shape[1], self.cases.count)
        with np.errstate(all="ignore"):
            one, each = self._values(x)
            a = np.stack([np.broadcast_to(np.asarray(c, float), size) for c in each.coefficients], axis=-1)
            abscissa, damping = worst_roots(a)
            if shift:
                moved = [worst_roots(a * r) for r in _rounded(a.shape[-1])]
                scatter = [np.ptp(np.array([m[k] for m in moved]), axis=0) for k in (0, 1)]
                abscissa, damping = abscissa - shift * scatter[0], damping + shift * scatter[1]
            known = {"abscissa": abscissa[:, None], "damping_ratio": damping[:, None]}
            each, one = each.with_known(known), one.with_known(known)
            violation = np.zeros(x.shape[1])
            for left, comparison, right in self._rows:
                values = one if comparison == "==" else each
                found = np.atleast_2d(excess(evaluated(left, values), comparison, evaluated(right, values)))
                violation = np.maximum(violation, np.broadcast_to(found, (x.shape[1], found.shape[-1])).max(axis=1))
            value = np.full(x.shape[1], np.nan) if self._objective is None else self._worst(each, size)
        violation = np.where(np.isfinite(abscissa) & (abscissa < NOWHERE), violation, NOWHERE)
        return Judged(value, violation, abscissa, damping)

    def _plain(self, x: Array) -> Array:
        with np.errstate(all="ignore"):
            return self._worst(self._values(x)[1], (x.shape[1], self.cases.count))

    def _worst(self, each: Values, size: tuple[int, int]) -> Array:
        assert self._objective is not None
        found = np.broadcast_to(evaluated(self._objective, each), size)
        return np.asarray(self._sign * np.where(np.isfinite(found), self._sign * found, NOWHERE).max(axis=1))

    def _values(self, x: Array) -> tuple[Values, Values]:
        """The nominal designs, shape (designs, 1), and all cases of them, shape (designs, cases)."""
        of, model = self.problem.posed.parameter_set, self.problem.model
        nominal = {**self.problem.fixed, **{n: x[k][:, None] for k, n in enumerate(self.names)}}
        varied = {**nominal, **{n: v[None, :] for n, v in self.cases.at.items()}}
        varied |= {n: varied[n] + o[None, :] for n, o in self.cases.offset.items()}
        return Values(model, of, nominal), Values(model, of, varied)

    def of(self, parameters: Mapping[str, float], shift: float = 0.0) -> Judged:
        """One design."""
        return self(np.array([[parameters[n]] for n in self.names]).reshape(-1, 1), shift)


@dataclass(frozen=True)
class Verdict:
    """What the judge says of one claimed design.

    Attributes:
        violation: largest, with the scatter of multiple roots granted, and of the box.
        value: the objective by eigenvalues.
        granted: how far beyond `value` a claim may lie because of that scatter.
    """

    violation: float
    value: float
    granted: float


def verdict(problem: Problem, parameters: Mapping[str, float], points: int = 1025) -> Verdict:
    """Judge a claimed design on a dense grid."""
    if len(problem.posed.scenarios) > 1 or problem.tolerances:
        points = min(points, 257)
    judge = Judge(problem, points, inside=_WITHIN)
    plain, granted = judge.of(parameters), judge.of(parameters, _GRANTED)
    box = max((max(lo - parameters[n], parameters[n] - hi) for n, (lo, hi) in problem.free.items()), default=0.0)
    violation = max(min(float(plain.violation[0]), float(granted.violation[0])), box, 0.0)
    return Verdict(violation, float(plain.value[0]), abs(float(granted.value[0] - plain.value[0])))


def _rounded(size: int) -> list[Array]:
    rng = np.random.default_rng(0)
    return [1 + _ROUNDING * rng.choice([-1.0, 1.0], size) for _ in range(_TRIALS)]


def _compiled(text: str) -> tuple[CodeType, str, CodeType]:
    left, comparison, right = sides(text)
    return compile(left, text, "eval"), comparison, compile(right, text, "eval")
