"""The square system of a root pattern: a_k = a0 c_k (c_k are the pattern's coefficients), and the == constraints."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from tmsopt.algebra.krawczyk import ProofFailed, jacobian as jacobian_of
from tmsopt.global_search.pattern_equations import extra_equations, values_at
from tmsopt.models import Quantity
from tmsopt.models.expression import Expression
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, RADIUS, lifted_quantities
from tmsopt.program.nlp import proof_units, scale_of, unit_near
from tmsopt.proofs.factorisation import abscissa_formula
from tmsopt.records import Array
from tmsopt.roots import Pattern

ROUNDINGS = 64
"""A stored design may miss an equation by this many roundings of each number."""

_MIN_PIVOT = 1e-9  # relative to the largest pivot: the equations do not determine a parameter with a smaller one
_ZERO_REMAINDER = 1e-30  # relative to a range: a solver may leave a parameter this far from 0
_MIN_SCALE = 1e-3  # relative to a range: least scale of a parameter
_EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Equations:
    """The equations of a pattern and a problem; a call computes their left sides.

    The arguments have the names of parameters (the number for an angle is its tangent), of lifted quantities, and of
    unknowns of the pattern (see `pattern_unknowns`).

    Attributes:
        equalities: the == constraints.
        lifted: quantities in these constraints that are unknowns with an equation of their own.
        unit: unit of the roots, a power of 2.
        units: units of the numbers whose size is not about 1, powers of 2.
    """

    problem: Posed
    pattern: Pattern
    equalities: tuple[Expression, ...]
    lifted: tuple[Quantity, ...]
    unit: float = 1.0
    units: Mapping[str, float] = field(default_factory=dict)

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the unknowns that are not parameters."""
        return (*(q.name for q in self.lifted), *self.pattern_unknowns)

    @property
    def pattern_unknowns(self) -> tuple[str, ...]:
        """Names of the unknowns of the pattern; they differ from the names of parameters and quantities."""
        parameter_set = self.problem.parameter_set
        used_names = {*parameter_set.names, *self.problem.model.quantity_names(parameter_set)}
        return tuple(f"{self.pattern.name}.{u}" if u in used_names else u for u in self.pattern.unknowns)

    @property
    def condition_count(self) -> int:
        """Number of conditions on the parameters."""
        return self.pattern.codimension + len(self.equalities)

    def term_sizes(self) -> float:
        """Size of the terms of an equation that the parameters do not show: none."""
        return 0.0

    def __call__(self, point: Mapping[str, Any]) -> list[Any]:
        """Compute the left sides."""
        values = values_at(self.problem, self.lifted, point, {})
        u = [point[n] for n in self.pattern_unknowns]
        a = values.coefficients
        left_sides = [p - a[0] * c for p, c in zip(a[1:], self.pattern.monic(u)[1:], strict=True)]
        if self.equalities:
            values = values.with_known({"abscissa": abscissa_formula(self.pattern, u)})
        return left_sides + extra_equations(values, self.lifted, self.equalities, point)


def build_equations(problem: Posed, pattern: Pattern, parameters: Mapping[str, float]) -> Equations:
    """Build the equations of a pattern in a problem.

    Raises:
        ProofFailed: for an equality of a quantity that ball arithmetic does not support.
    """
    equalities = tuple(c for c in problem.conditions.values() if c.equality)
    unsupported = [n for n in (RADIUS, "damping_ratio", ANGULAR_FREQUENCY) if any(n in c.names for c in equalities)]
    if unsupported:
        raise ProofFailed(f"a proof does not support == constraints on {unsupported[0]}; drop it to prove the rest")
    lifted = lifted_quantities(problem.model, problem.parameter_set, parameters, equalities)
    system = Equations(problem, pattern, equalities, lifted, unit_near(scale_of(problem).unit))
    units = proof_units(problem)
    units |= {q.name: unit_near(abs(float(problem.values(parameters)[q.name]))) for q in system.lifted}
    units |= {n: system.unit**power for n, power in zip(system.pattern_unknowns, pattern.powers, strict=True)}
    return replace(system, units=units)


@dataclass(frozen=True)
class MovedParameters:
    """The parameters to solve for, and how well the equations determine them.

    Attributes:
        explained: parameter or unknown → how far the rounding of the stored numbers may move it.
    """

    moved: tuple[str, ...]
    explained: Mapping[str, float]


def choose_moved(system: Any, point: Mapping[str, Any], candidates: Sequence[str]) -> MovedParameters:
    """Choose the free parameters that the equations determine best, by QR with column pivoting without the unknowns.

    Raises:
        ProofFailed: if there are too few parameters, or the equations do not determine them.
    """
    count, parameter_set = system.condition_count, system.problem.parameter_set
    if len(candidates) < count:
        raise ProofFailed(
            f"{_count(count, 'condition')} and {_count(len(candidates), 'free parameter')}: the pattern could not be "
            "proved for these numbers, which may be rounded, or irrational; "
            f"free {count - len(candidates)} more, or give fractions that have the pattern"
        )
    names = [*parameter_set.names, *system.unknowns]
    jacobian = np.array([[float(e) for e in row] for row in jacobian_of(system, point, names).tolist()])
    values = np.array([abs(float(point[n])) for n in names])
    rounding = np.maximum(np.abs(jacobian) @ values, system.term_sizes()) + 1e-300
    widths = {n: _MIN_SCALE * (hi - lo) for n, (lo, hi) in system.problem.free.items()}
    units = [system.units.get(n, 1.0) for n in names]
    scale = np.maximum(np.where(values > 0, values, units), [widths.get(n, 0.0) for n in names])
    unknown_columns = [names.index(n) for n in system.unknowns]
    candidate_columns = [names.index(n) for n in candidates]
    row_sizes = (
        np.abs(jacobian)[:, [*candidate_columns, *unknown_columns]] @ scale[[*candidate_columns, *unknown_columns]]
        + 1e-300
    )
    scaled_jacobian = jacobian / row_sizes[:, None] * scale
    if not np.all(np.isfinite(scaled_jacobian)):
        raise ProofFailed(
            "the equations have no finite derivatives at the design; move it away from the end of its range"
        )
    basis = (
        np.linalg.qr(scaled_jacobian[:, unknown_columns], mode="complete")[0][:, len(unknown_columns) :]
        if unknown_columns
        else np.eye(len(scaled_jacobian))
    )
    reduced_jacobian = basis.T @ scaled_jacobian[:, candidate_columns]
    order, pivots = _pivot_columns(reduced_jacobian, count)
    if count and not pivots[-1] > _MIN_PIVOT * max(pivots[0], 1e-3):
        idle_names = [n for n, k in zip(candidates, candidate_columns, strict=True) if not np.any(jacobian[:, k])]
        reason = f"; they do not depend on {', '.join(idle_names)}" if idle_names else ""
        raise ProofFailed(
            f"the equations are (nearly) singular in the free parameters {', '.join(candidates)}{reason}; "
            "free another one"
        )
    moved_names = tuple(sorted((candidates[k] for k in order), key=parameter_set.names.index))
    solved_columns = [names.index(n) for n in (*moved_names, *system.unknowns)]
    rounding_effects = (
        np.abs(np.linalg.pinv(scaled_jacobian[:, solved_columns]))
        @ (rounding / row_sizes)
        * scale[solved_columns]
        * (ROUNDINGS * _EPS)
    )
    floors = {n: _ZERO_REMAINDER * (hi - lo) for n, (lo, hi) in system.problem.free.items()}
    solved = zip((*moved_names, *system.unknowns), rounding_effects, strict=True)
    return MovedParameters(
        moved_names, {n: float(e) + 2 * _EPS * abs(float(point[n])) + floors.get(n, 0.0) for n, e in solved}
    )


def _pivot_columns(columns: Array, count: int) -> tuple[list[int], list[float]]:
    """Compute order and sizes of the pivots of QR with column pivoting, without loading SciPy."""
    residual, order, sizes = columns, list[int](), list[float]()
    for _ in range(count):
        lengths = np.linalg.norm(residual, axis=0)
        order.append(int(lengths.argmax()))
        sizes.append(float(lengths.max()))
        unit = residual[:, order[-1]] / (sizes[-1] or 1.0)
        residual = residual - np.outer(unit, unit @ residual)
        residual[:, order] = 0.0
    return order, sizes


def _count(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"
