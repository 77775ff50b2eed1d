"""A design, the weights of its changes, and the polynomials of the designs around it."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tmsopt.boundaries.axis import edges_at
from tmsopt.boundaries.boundaries import measure_terms
from tmsopt.errors import Fault, InputError, is_number, suggest
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import STRUCTURE_TOLERANCE
from tmsopt.problem.real_form import real_form
from tmsopt.records import Array, Numbers
from tmsopt.roots import is_stable, multiple_real_roots, real_roots

_ZERO = 1e-12  # relative to the range of a free parameter: a smaller value counts as 0
_INSET = 1e-6  # relative to the size of a parameter: smallest distance from an excluded end of its range


@dataclass(frozen=True)
class WeightedDesign:
    """A design with the weights of the parameters that may change.

    A displacement u gives the change of each parameter in units of its weight.

    Attributes:
        stated: the problem of the user.
        problem: its form with a real polynomial.
        parameters: every parameter of the problem's set.
        weights: parameter → change that counts as 1; parameters without weight stay fixed.
    """

    stated: Posed
    problem: Posed
    parameters: Numbers
    weights: Numbers

    def displace(self, u: Any) -> dict[str, Any]:
        """Return every parameter after displacements: u has one number, array or symbol per weight."""
        displaced = {n: self.parameters[n] + weight * u[k] for k, (n, weight) in enumerate(self.weights.items())}
        return {**self.parameters, **displaced}

    def design(self, u: Array) -> dict[str, float]:
        """The parameters at a displacement, inside their ranges; a displacement to an end gives exactly the end."""
        parameters = self.displace(u)
        for k, n in enumerate(self.weights):
            physical_range = self.problem.parameter_set[n].range
            parameters[n] = min(max(float(parameters[n]), physical_range.lower), physical_range.upper)
            if physical_range.closed and u[k] <= self.lower[k]:
                parameters[n] = physical_range.lower
            if physical_range.closed and u[k] >= self.upper[k]:
                parameters[n] = physical_range.upper
        return parameters

    @cached_property
    def lower(self) -> Array:
        """Displacement of each parameter to the lower end of its physical range."""
        return self._ends[:, 0]

    @cached_property
    def upper(self) -> Array:
        """Displacement of each parameter to the upper end of its physical range."""
        return self._ends[:, 1]

    @cached_property
    def _ends(self) -> Array:
        """Displacements to both ends of each range; if a range excludes its end, to a value slightly inside."""
        displacements = []
        for n, weight in self.weights.items():
            physical_range, value = self.problem.parameter_set[n].range, self.parameters[n]
            inset = 0.0 if physical_range.closed else _INSET * abs(value)
            ends = (physical_range.lower + inset - value) / weight, (physical_range.upper - inset - value) / weight
            displacements.append((min(ends[0], 0.0), max(ends[1], 0.0)))
        return np.array(displacements)

    def clip_rays(self, directions: Array, t: Array) -> Array:
        """Displacements t · direction, clipped to the ranges."""
        return np.clip(t[..., None] * directions, self.lower, self.upper)

    def coefficients(self, u: Array) -> Array:
        """Displacements of shape (…, n) → coefficients of shape (…, degree + 1).

        Time and size are scaled so that the coefficients of the design itself are near 1.
        """
        with np.errstate(all="ignore"):
            a = self.problem.model.coefficients(self.displace(np.moveaxis(u, -1, 0)), self.problem.parameter_set)
            return np.stack(np.broadcast_arrays(*a, u[..., 0])[:-1], axis=-1) / self.scale

    @cached_property
    def is_stable(self) -> bool:
        """Whether all roots are left of the imaginary axis."""
        return bool(is_stable(self._scaled_coefficients))

    @cached_property
    def edges(self) -> tuple[str, ...]:
        """The stability boundaries that the design is on up to rounding."""
        return edges_at(self.problem, self.parameters)

    @cached_property
    def is_heavily_damped(self) -> bool:
        """Whether all roots are real and negative, multiple ones included."""
        c = self._scaled_coefficients
        return self.is_on_damping_edge or bool(c[0] != 0 and real_roots(c)[0] == len(c) - 1)

    @cached_property
    def is_on_damping_edge(self) -> bool:
        """Whether all roots are real and negative and two are equal, decided by coefficients."""
        c = self._scaled_coefficients
        if c[0] == 0 or not self.is_stable:
            return False
        roots = multiple_real_roots(c, STRUCTURE_TOLERANCE)
        return roots is not None and all(root.re < 0 for root in roots)

    @cached_property
    def sizes(self) -> Array:
        """Size of the terms of each coefficient: the unit in which equations between coefficients must hold."""
        c = self._scaled_coefficients
        return measure_terms(c) if c.any() else np.ones(len(c))

    @cached_property
    def _scaled_coefficients(self) -> Array:
        """Coefficients of the design itself, near 1."""
        return self._coefficients / self.scale

    @cached_property
    def scale(self) -> Array:
        """Size of each coefficient in the design's unit of time."""
        a = self._coefficients
        unit = abs(a[-1] / a[0]) ** (1 / (len(a) - 1)) if a[0] and a[-1] else 1.0
        powers = unit ** np.arange(len(a))
        return np.asarray(powers * (float(np.abs(a / powers).max()) or 1.0))

    @cached_property
    def _coefficients(self) -> Array:
        return np.array(self.problem.model.coefficients(self.parameters, self.problem.parameter_set), dtype=float)


def weight_design(problem: Posed, parameters: Numbers, weights: Numbers | None) -> WeightedDesign:
    """A design with checked parameters and weights.

    Raises:
        InputError: with all faults, or for matrices that are too large.
    """
    faults = [*parameter_faults(problem, parameters)]
    faults += [] if weights is None else _weight_faults(problem, weights)
    if faults:
        raise InputError(faults)
    values = {n: float(parameters[n]) for n in problem.parameter_set.names}
    weights = default_weights(problem, values) if weights is None else weights
    return WeightedDesign(
        problem, real_form(problem).problem, values, {n: float(weights[n]) for n in values if weights.get(n, 0.0) > 0}
    )


def default_weights(problem: Posed, parameters: Numbers) -> dict[str, float]:
    """The |value| of each parameter that may change; for a value 0, the largest |value| of the same unit, or else 1."""
    parameter_set = problem.parameter_set
    weights = {}
    widths = {n: high - low for n, (low, high) in problem.free.items()}
    sizes = {n: abs(x) if abs(x) > _ZERO * widths.get(n, 0.0) else 0.0 for n, x in parameters.items()}
    for p in (p for p in parameter_set.parameters if p.may_change(sizes[p.name])):
        peers = [sizes[q.name] for q in parameter_set.parameters if q.unit == p.unit and p.unit not in ("1", "rad")]
        weights[p.name] = sizes[p.name] or max(peers, default=0.0) or 1.0
    return weights


def parameter_faults(problem: Posed, parameters: Numbers) -> Iterator[Fault]:
    """Faults in the parameters of a design."""
    parameter_set = problem.parameter_set
    for name in parameters:
        if name not in parameter_set.names:
            yield Fault(f"unknown parameter '{name}'; {suggest(name, parameter_set.names)}", ("parameters", name))
    for name in parameter_set.names:
        key = ("parameters", name)
        if name not in parameters:
            yield Fault("missing; give a value for every parameter", key)
        elif not is_number(parameters[name]):
            yield Fault(f"found {parameters[name]!r}; accepted: a finite number", key)
        elif parameters[name] not in parameter_set[name].range:
            yield Fault(
                f"found {parameters[name]:.6g}; {parameter_set[name].meaning} is {parameter_set[name].range}", key
            )


def _weight_faults(problem: Posed, weights: Numbers) -> Iterator[Fault]:
    parameter_set = problem.parameter_set
    for name, weight in weights.items():
        key = ("weights", name)
        if name not in parameter_set.names:
            yield Fault(f"unknown parameter '{name}'; {suggest(name, parameter_set.names)}", key)
        elif not is_number(weight) or weight < 0:
            yield Fault(f"found {weight!r}; accepted: a number above 0, or 0 for a parameter that stays fixed", key)
    if not any(is_number(w) and w > 0 for w in weights.values()):
        message = f"no weight is above 0; give a positive weight to at least one of: {' '.join(parameter_set.names)}"
        yield Fault(message, ("weights",))
