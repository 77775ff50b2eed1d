"""The square system of a root pattern: a_k = a0 c_k, and the problem's equalities."""

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
"""Roundings of each number by which a stored design may miss an equation."""

_MIN_PIVOT = 1e-9  # relative: a parameter that adds less to the others counts as dependent
_ZERO = 1e-30  # of a range: the remainder that a solver leaves for 0
_MIN_SCALE = 1e-3  # of a range: least scale of a parameter
_EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Equations:
    """Left sides of the equations of a pattern and a problem.

    Numbers have the names of parameters (angles stand for their tangents), of lifted quantities, and of unknowns of
    the pattern, see `pattern_unknowns`.

    Attributes:
        equalities: the == constraints.
        lifted: quantities in them that are unknowns with an equation.
        unit: unit of the roots, a power of 2.
        units: units of numbers that are not about 1, powers of 2.
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
        """Names of the unknowns of the pattern, different from those of parameters and quantities."""
        of = self.problem.parameter_set
        taken = {*of.names, *self.problem.model.quantity_names(of)}
        return tuple(f"{self.pattern.name}.{u}" if u in taken else u for u in self.pattern.unknowns)

    @property
    def conditions(self) -> int:
        """Number of conditions on the parameters."""
        return self.pattern.codimension + len(self.equalities)

    def __call__(self, at: Mapping[str, Any]) -> list[Any]:
        """The left sides."""
        values = values_at(self.problem, self.lifted, at, {})
        u = [at[n] for n in self.pattern_unknowns]
        a = values.coefficients
        left = [p - a[0] * c for p, c in zip(a[1:], self.pattern.monic(u)[1:], strict=True)]
        if self.equalities:
            values = values.with_known({"abscissa": abscissa_formula(self.pattern, u)})
        return left + extra_equations(values, self.lifted, self.equalities, at)


def build_equations(problem: Posed, pattern: Pattern, parameters: Mapping[str, float]) -> Equations:
    """The equations of a pattern in a problem.

    Raises:
        ProofFailed: for an equality of a quantity that balls do not support.
    """
    equalities = tuple(c for c in problem.conditions.values() if c.equality)
    unsupported = [n for n in (RADIUS, "damping_ratio", ANGULAR_FREQUENCY) if any(n in c.names for c in equalities)]
    if unsupported:
        raise ProofFailed(f"a proof does not support == constraints on {unsupported[0]}; drop it to prove the rest")
    lifted = lifted_quantities(problem.model, problem.parameter_set, parameters, equalities)
    own = Equations(problem, pattern, equalities, lifted, unit_near(scale_of(problem).unit))
    units = proof_units(problem)
    units |= {q.name: unit_near(abs(float(problem.values(parameters)[q.name]))) for q in own.lifted}
    units |= {n: own.unit**power for n, power in zip(own.pattern_unknowns, pattern.powers, strict=True)}
    return replace(own, units=units)


@dataclass(frozen=True)
class MovedParameters:
    """The parameters to solve for, and how well the equations determine them.

    Attributes:
        explained: parameter or unknown → how far ROUNDINGS of each number may move it.
    """

    moved: tuple[str, ...]
    explained: Mapping[str, float]


def choose_moved(system: Equations, at: Mapping[str, Any], among: Sequence[str]) -> MovedParameters:
    """Choose the best conditioned free parameters by QR with column pivoting, after projecting out the unknowns.

    Raises:
        ProofFailed: if there are too few parameters, or the equations do not determine them.
    """
    count, of = system.conditions, system.problem.parameter_set
    if len(among) < count:
        raise ProofFailed(
            f"{_count(count, 'condition')} and {_count(len(among), 'free parameter')}: the pattern could not be proved "
            "for these numbers, which may be rounded, or irrational; "
            f"free {count - len(among)} more, or give fractions that have the pattern"
        )
    names = [*of.names, *system.unknowns]
    jacobian = np.array([[float(e) for e in row] for row in jacobian_of(system, at, names).tolist()])
    values = np.array([abs(float(at[n])) for n in names])
    rounding = np.abs(jacobian) @ values + 1e-300
    widths = {n: _MIN_SCALE * (hi - lo) for n, (lo, hi) in system.problem.free.items()}
    units = [system.units.get(n, 1.0) for n in names]
    scale = np.maximum(np.where(values > 0, values, units), [widths.get(n, 0.0) for n in names])
    outside = [names.index(n) for n in system.unknowns]
    free = [names.index(n) for n in among]
    size = np.abs(jacobian)[:, [*free, *outside]] @ scale[[*free, *outside]] + 1e-300
    scaled = jacobian / size[:, None] * scale
    if not np.all(np.isfinite(scaled)):
        raise ProofFailed(
            "the equations have no finite derivatives at the design; move it away from the end of its range"
        )
    basis = np.linalg.qr(scaled[:, outside], mode="complete")[0][:, len(outside) :] if outside else np.eye(len(scaled))
    reduced = basis.T @ scaled[:, free]
    order, pivots = _pivot_columns(reduced, count)
    if count and not pivots[-1] > _MIN_PIVOT * max(pivots[0], 1e-3):
        idle = [n for n, k in zip(among, free, strict=True) if not np.any(jacobian[:, k])]
        why = f"; they do not depend on {', '.join(idle)}" if idle else ""
        raise ProofFailed(
            f"the equations are (nearly) singular in the free parameters {', '.join(among)}{why}; free another one"
        )
    moved = tuple(sorted((among[k] for k in order), key=of.names.index))
    square = [names.index(n) for n in (*moved, *system.unknowns)]
    effect = np.abs(np.linalg.pinv(scaled[:, square])) @ (rounding / size) * scale[square] * (ROUNDINGS * _EPS)
    floors = {n: _ZERO * (hi - lo) for n, (lo, hi) in system.problem.free.items()}
    solved = zip((*moved, *system.unknowns), effect, strict=True)
    return MovedParameters(moved, {n: float(e) + 2 * _EPS * abs(float(at[n])) + floors.get(n, 0.0) for n, e in solved})


def _pivot_columns(columns: Array, count: int) -> tuple[list[int], list[float]]:
    """Order and sizes of the pivots of QR with column pivoting; avoids loading SciPy."""
    left, order, adds = columns, list[int](), list[float]()
    for _ in range(count):
        lengths = np.linalg.norm(left, axis=0)
        order.append(int(lengths.argmax()))
        adds.append(float(lengths.max()))
        unit = left[:, order[-1]] / (adds[-1] or 1.0)
        left = left - np.outer(unit, unit @ left)
        left[:, order] = 0.0
    return order, adds


def _count(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"
