"""Descends from a design by the BFGS method on the eigenvalues, with analytic slopes, to a kink of the objective.

BFGS with a weak Wolfe line search goes on at kinks (Lewis and Overton, Mathematical Programming 141, 2013), but
converges slowly there and loses digits at multiple eigenvalues; IPOPT goes on from its end. The parameters are functions
of free variables y: p = p(sin y), with small values resolved where a range contains 0.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tmsopt.algebra.arrays import evaluate_on_arrays
from tmsopt.algebra.formula import Formula, formula, symbol
from tmsopt.algebra.kinds import gradients
from tmsopt.chains import family_of
from tmsopt.models.model import ROOTS
from tmsopt.problem import Case, Posed
from tmsopt.problem.dependence import WORSE_DIRECTION
from tmsopt.problem.evaluate import nodes_of
from tmsopt.problem.quantities import ANGULAR_FREQUENCY
from tmsopt.program.unit_box import UnitBox
from tmsopt.records import Array, Complex
from tmsopt.roots.chains import eigenvectors_of, linearised_slopes

_MAX_STEPS = 200
_ARMIJO, _WOLFE = 1e-4, 0.9  # of the weak Wolfe conditions
_MAX_TRIALS = 20  # steps of a line search
_FLAT = 1e-4  # relative decrease over the last steps below which the descent ends
_PATIENCE = 10  # these last steps
_PENALTY = 10.0  # weight of the excess over a limit, in units of the spread of the objective
_INSIDE = 0.99999  # a start on a face of the box is moved inside, where the slope by y is not 0
_DIFFERENCE = 1e-6  # step of y for the slopes of p


@dataclass(frozen=True, eq=False)
class Descent:
    """The objective with a penalty for violated limits, as a function of y.

    Attributes:
        spread: unit of the objective.
        scales: unit of the excess over each limit.
    """

    problem: Posed
    space: UnitBox
    spread: float
    scales: Array

    def run(self, design: Mapping[str, float]) -> dict[str, float]:
        """The design where the descent from another one ends."""
        w = self.space.spread_near_zero(self.space.point(design))
        y = np.arcsin(np.clip(2 * w - 1, -_INSIDE, _INSIDE))
        value, slope = self.value(y)
        if not np.isfinite(value):
            return dict(design)
        H, values = np.eye(len(y)) / (np.linalg.norm(slope) or 1.0), [value]
        for step_count in range(_MAX_STEPS):
            direction = -H @ slope
            if not slope @ direction < 0:
                break
            step, new_value, new_slope = self._search_line(y, value, slope, direction)
            if step is None:
                break
            s, g = step, new_slope - slope
            y, value, slope = y + step, new_value, new_slope
            values.append(value)
            if s @ g > 0:
                if not step_count:
                    H *= (s @ g) / (g @ g) / H[0, 0]
                V = np.eye(len(y)) - np.outer(s, g) / (s @ g)
                H = V @ H @ V.T + np.outer(s, s) / (s @ g)
            if len(values) > _PATIENCE and values[-_PATIENCE] - value < _FLAT * (abs(value) + 1e-300):
                break
        return {n: float(x) for n, x in self._parameters(y).items()}

    def _search_line(self, y: Array, value: float, slope: Array, direction: Array) -> tuple[Array | None, float, Array]:
        low, high, t = 0.0, np.inf, 1.0
        fall = float(slope @ direction)
        best: tuple[Array | None, float, Array] = (None, value, slope)
        for _ in range(_MAX_TRIALS):
            new_value, new_slope = self.value(y + t * direction)
            if not new_value <= value + _ARMIJO * t * fall:
                high = t
            elif new_slope @ direction < _WOLFE * fall:
                low, best = t, (t * direction, new_value, new_slope)
            else:
                return t * direction, new_value, new_slope
            t = (low + high) / 2 if np.isfinite(high) else 2 * low
        return best

    def _parameters(self, y: Array) -> dict[str, Array]:
        return self.space.designs(self.space.sample_near_zero((1 + np.sin(y)) / 2))

    def value(self, y: Array) -> tuple[float, Array]:
        """The objective with penalties, and its slope by y; inf where it has no value."""
        steps = self._parameters(y[None] + _DIFFERENCE * np.array([[0.0], [1.0], [-1.0]]))
        design = {n: float(x[0]) for n, x in steps.items()}
        widths = np.array([(x[1] - x[2]) / (2 * _DIFFERENCE) for x in steps.values()])
        with np.errstate(all="ignore"):
            try:
                roots, slopes = self._worst_roots(design)
            except np.linalg.LinAlgError:
                return np.inf, np.zeros(len(y))
            columns = {**self.problem.ordered(design), **roots}
            outputs = np.array([float(x) for x in evaluate_on_arrays(self._formula, columns)])
        size = len(outputs) // (1 + len(self._names))
        parts, partial_slopes = outputs[:size], outputs[size:].reshape(size, -1)
        weights = self._weights(parts)
        chain = np.stack([slopes[n] if n in slopes else self._unit(n) for n in self._names])
        slope = (weights @ partial_slopes) @ chain * widths
        value = float(weights @ parts)
        return (value, slope) if np.isfinite([value, *slope]).all() else (np.inf, np.zeros(len(y)))

    def _weights(self, parts: Array) -> Array:
        has_objective = self.problem.objective is not None
        weights = np.full(len(parts), 1.0)
        if has_objective:
            weights[0] = 1 / self.spread
        limits = parts[has_objective:]
        is_equality = np.array([c.equality for c in self.problem.conditions.values()], dtype=bool)
        signs = np.where(is_equality, np.sign(limits), limits > 0)
        weights[has_objective:] = _PENALTY * signs / self.scales
        return weights

    def _unit(self, name: str) -> Array:
        return np.array([float(n == name) for n in self.problem.free])

    @property
    def _names(self) -> tuple[str, ...]:
        return (*self.problem.parameter_set.names, *ROOTS)

    @cached_property
    def _formula(self) -> Formula:
        """Objective and conditions, where less is better, and their slopes by parameters and root quantities."""
        problem = self.problem
        expressions = {"": problem.objective} if problem.objective else {}
        nodes = nodes_of(problem, {**expressions, **problem.conditions})
        signs = [*([problem.sign] if problem.objective else []), *(c.sign for c in problem.conditions.values())]
        parts = [sign * node for sign, node in zip(signs, nodes.values(), strict=True)]
        rows = gradients(parts, [symbol(n) for n in self._names])
        return formula([*parts, *(x for row in rows for x in row)], self._names)

    def _worst_roots(self, design: Mapping[str, float]) -> tuple[dict[str, float], dict[str, Array]]:
        """Root quantities in their worst cases, and their slopes by the free parameters."""
        problem, found = self.problem, dict[str, tuple[float, Array]]()
        for case in [case for case in problem.cases if not case.direction] or [Case()]:
            parameters = case.applied(problem.ordered(design))
            family = family_of(problem, parameters)
            matrices, slopes = family.expand(np.array([parameters[n] for n in problem.free]))
            s, left, right = eigenvectors_of(matrices)
            changes = linearised_slopes(matrices, slopes)
            n = len(matrices[0])

            def slope_of(k: int) -> Complex:
                return left[k, -n:] @ changes @ right[:, k]

            for name, value, k, direction in self._quantities(s):
                if name not in found or value * WORSE_DIRECTION[name] > found[name][0] * WORSE_DIRECTION[name]:
                    found[name] = value, (direction * slope_of(k)).real
        return {n: x for n, (x, _) in found.items()}, {n: slope for n, (_, slope) in found.items()}

    def _quantities(self, s: Complex):
        k = int(np.argmax(s.real))
        yield "abscissa", float(s[k].real), k, 1.0
        k = int(np.argmax(np.abs(s.imag)))
        yield ANGULAR_FREQUENCY, float(abs(s[k].imag)), k, -1j * np.sign(s[k].imag)
        if not self.problem.model.is_complex:
            sizes = np.abs(s) + 1e-300
            k = int(np.argmin(-s.real / sizes))
            z, r = s[k], sizes[k]
            # d(−Re s/|s|) = Re((−1/|s| + Re s conj(s)/|s|³) ds)
            yield "damping_ratio", float(-z.real / r), k, -1 / r + z.real * z.conjugate() / r**3
