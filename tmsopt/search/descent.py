"""Descends from a design by the BFGS method on the eigenvalues, with analytic slopes, to a kink of the objective.

BFGS with a weak Wolfe line search goes on at kinks (Lewis and Overton, Mathematical Programming 141, 2013), but slowly;
IPOPT goes on from its end. The parameters are functions of free variables y: p = p(sin y), with small values resolved.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from tmsopt.algebra.arrays import evaluate_on_arrays
from tmsopt.algebra.formula import Formula, formula, symbol
from tmsopt.algebra.kinds import gradients
from tmsopt.chains import family_of
from tmsopt.problem import Posed
from tmsopt.problem.evaluate import nodes_of
from tmsopt.program.subspaces import covered_cases
from tmsopt.program.unit_box import UnitBox
from tmsopt.records import Array
from tmsopt.roots.chains import eigenvectors_of, linearised_slopes

_MAX_STEPS = 200
_ARMIJO, _WOLFE = 1e-4, 0.9  # of the weak Wolfe conditions
_MAX_TRIALS = 20  # steps of a line search
_FLAT = 1e-4  # relative decrease over the last steps below which IPOPT goes on
_PATIENCE = 10  # these last steps
_PENALTY = 10.0  # weight of the excess over a limit, in units of the spread of the objective
_INSIDE = 0.99999  # a start on a face of the box is moved inside, where the slope by y is not 0
_DIFFERENCE = 1e-6  # step of y for the slopes of p


class _Value(NamedTuple):
    """The objective with its penalties, and its slope by y."""

    height: float
    slope: Array


@dataclass(frozen=True, eq=False)
class Descent:
    """The objective plus a penalty for violated limits, as a function of y.

    Attributes:
        spread: unit of the objective.
        scales: unit of the excess over each limit.
    """

    space: UnitBox
    spread: float
    scales: Array

    @property
    def problem(self) -> Posed:
        """The problem."""
        return self.space.problem

    def run(self, design: Mapping[str, float]) -> dict[str, float]:
        """The design where the descent from another one ends."""
        y = np.arcsin(np.clip(2 * self.space.spread_near_zero(self.space.point(design)) - 1, -_INSIDE, _INSIDE))
        value = self._value(y)
        if not np.isfinite(value.height):
            return dict(design)
        inverse, heights = np.eye(len(y)) / (np.linalg.norm(value.slope) or 1.0), [value.height]
        for step_count in range(_MAX_STEPS):
            step, new_value = self._search_line(y, value, -inverse @ value.slope)
            if not step.any():
                break
            change = new_value.slope - value.slope
            y, value, product = y + step, new_value, float(step @ change)
            heights.append(value.height)
            if product > 0:
                if not step_count:
                    inverse *= product / (change @ change) / inverse[0, 0]
                projector = np.eye(len(y)) - np.outer(step, change) / product
                inverse = projector @ inverse @ projector.T + np.outer(step, step) / product
            if len(heights) > _PATIENCE and heights[-_PATIENCE] - value.height < _FLAT * abs(value.height):
                break
        return {n: float(x) for n, x in self._design(y).items()}

    def _search_line(self, y: Array, value: _Value, direction: Array) -> tuple[Array, _Value]:
        """A step that satisfies the weak Wolfe conditions, or else the longest one with enough decrease, or 0."""
        low, high, t, fall = 0.0, np.inf, 1.0, float(value.slope @ direction)
        best = 0 * direction, value
        for _ in range(_MAX_TRIALS if fall < 0 else 0):
            new_value = self._value(y + t * direction)
            if not new_value.height <= value.height + _ARMIJO * t * fall:
                high = t
            elif new_value.slope @ direction < _WOLFE * fall:
                low, best = t, (t * direction, new_value)
            else:
                return t * direction, new_value
            t = (low + high) / 2 if np.isfinite(high) else 2 * low
        return best

    def _design(self, y: Array) -> dict[str, Array]:
        return self.space.designs(self.space.sample_near_zero((1 + np.sin(y)) / 2))

    def _value(self, y: Array) -> _Value:
        columns = self._design(y[None] + _DIFFERENCE * np.array([[0.0], [1.0], [-1.0]]))
        design = {n: float(x[0]) for n, x in columns.items()}
        stretches = np.array([(x[1] - x[2]) / (2 * _DIFFERENCE) for x in columns.values()])
        undefined = _Value(np.inf, np.zeros(len(y)))
        with np.errstate(all="ignore"):
            try:
                abscissa, slope = self._worst_abscissa(design)
            except np.linalg.LinAlgError:
                return undefined
            known = {**self.problem.ordered(design), "abscissa": abscissa}
            outputs = np.array([float(x) for x in evaluate_on_arrays(self._formula, known)])
            parts, slopes = np.split(outputs, [len(outputs) // (1 + len(self._names))])
            weights, free = self._weigh(parts), list(self.problem.free)
            inputs = np.array([*([n == m for m in free] for n in self.problem.parameter_set.names), slope])
            slope = weights @ slopes.reshape(len(parts), -1) @ inputs * stretches
        value = _Value(float(weights @ parts), slope)
        return value if np.isfinite([value.height, *slope]).all() else undefined

    def _weigh(self, parts: Array) -> Array:
        """Weights of the objective and of the violated limits."""
        count = len(parts) - len(self.problem.conditions)
        is_equality = np.array([c.equality for c in self.problem.conditions.values()], dtype=bool)
        signs = np.where(is_equality, np.sign(parts[count:]), parts[count:] > 0)
        return np.array([*[1 / self.spread] * count, *_PENALTY * signs / self.scales])

    @property
    def _names(self) -> tuple[str, ...]:
        return (*self.problem.parameter_set.names, "abscissa")

    @cached_property
    def _formula(self) -> Formula:
        """Objective and limits, where less is better, and their slopes by the parameters and the abscissa."""
        problem, symbols = self.problem, [symbol(n) for n in self._names]
        objectives = {"": problem.objective} if problem.objective else {}
        nodes = nodes_of(problem, {**objectives, **problem.conditions})
        signs = [*[problem.sign] * len(objectives), *(c.sign for c in problem.conditions.values())]
        parts = [sign * node for sign, node in zip(signs, nodes.values(), strict=True)]
        return formula([*parts, *(x for row in gradients(parts, symbols) for x in row)], self._names)

    def _worst_abscissa(self, design: Mapping[str, float]) -> tuple[float, Array]:
        """The abscissa in its worst case, with its slopes by the free parameters."""
        problem, worst = self.problem, (-np.inf, np.zeros(self.space.size))
        for case in covered_cases(problem.cases):
            parameters = case.applied(problem.ordered(design))
            matrices, slopes = family_of(problem, parameters).expand(np.array([parameters[n] for n in problem.free]))
            s, left, right = eigenvectors_of(matrices)
            k, changes = int(np.argmax(s.real)), linearised_slopes(matrices, slopes)
            if s[k].real > worst[0]:
                worst = float(s[k].real), (left[k, -len(matrices[0]) :] @ changes @ right[:, k]).real
        return worst
