"""The square system whose solution has a root pattern: a_k = a0 c_k, and the problem's equalities."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from tmsopt.algebra.krawczyk import ProofFailed, jacobian as jacobian_of
from tmsopt.global_search.conditions import others, values_at
from tmsopt.models import Quantity
from tmsopt.models.expression import Expression
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, RADIUS, lifted_quantities
from tmsopt.program.nlp import proof_units, scale_of, unit_near
from tmsopt.proofs.factored import abscissa_formula
from tmsopt.records import Array
from tmsopt.roots import Pattern

ROUNDINGS = 64
"""Roundings of every number of an equation that a stored design may be off by."""

_DEPENDENT = 1e-9  # relative size of what a parameter adds to the others, below which it adds nothing
_NOTHING = 1e-30  # of a range: what a solver leaves of a 0
_NEAR_ZERO = 1e-3  # of a range: what moves a parameter that is smaller than that is measured by this
_EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Equations:
    """Left sides of the pattern's and the problem's equations.

    A number goes by its parameter's name, angles by their tangent; by the name of a quantity that has an equation
    of its own; or by that of an unknown of the pattern, see `of_pattern`.

    Attributes:
        equalities: the == constraints.
        lifted: quantities in them that are unknowns with an equation.
        unit: of the roots.
        units: of numbers that are not of the size of 1, powers of 2.
    """

    problem: Posed
    pattern: Pattern
    equalities: tuple[Expression, ...]
    lifted: tuple[Quantity, ...]
    unit: float = 1.0
    units: Mapping[str, float] = field(default_factory=dict)

    @property
    def unknowns(self) -> tuple[str, ...]:
        """What is unknown besides parameters."""
        return (*(q.name for q in self.lifted), *self.of_pattern)

    @property
    def of_pattern(self) -> tuple[str, ...]:
        """Unknowns of the pattern, by names that no parameter or quantity has."""
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
        u = [at[n] for n in self.of_pattern]
        a = values.coefficients
        left = [p - a[0] * c for p, c in zip(a[1:], self.pattern.monic(u)[1:], strict=True)]
        if self.equalities:
            values = values.with_known({"abscissa": abscissa_formula(self.pattern, u)})
        return left + others(values, self.lifted, self.equalities, at)


def equations(problem: Posed, pattern: Pattern, parameters: Mapping[str, float]) -> Equations:
    """The equations of a pattern in a problem.

    Raises:
        ProofFailed: for an equality that cannot be evaluated in balls.
    """
    equalities = tuple(c for c in problem.conditions.values() if c.equality)
    beyond = [n for n in (RADIUS, "damping_ratio", ANGULAR_FREQUENCY) if any(n in c.names for c in equalities)]
    if beyond:
        raise ProofFailed(
            f"an == constraint uses {beyond[0]}, which has no equation in balls; drop it to prove the rest"
        )
    lifted = lifted_quantities(problem.model, problem.parameter_set, parameters, equalities)
    own = Equations(problem, pattern, equalities, lifted, unit_near(scale_of(problem).unit))
    units = proof_units(problem)
    units |= {q.name: unit_near(abs(float(problem.values(parameters)[q.name]))) for q in own.lifted}
    units |= {n: own.unit**power for n, power in zip(own.of_pattern, pattern.powers, strict=True)}
    return replace(own, units=units)


@dataclass(frozen=True)
class Chosen:
    """Parameters to move, and how well they are determined.

    Attributes:
        explained: moved parameter, or unknown of the equations → how far ROUNDINGS of every number may move it.
    """

    moved: tuple[str, ...]
    explained: Mapping[str, float]


def choose(system: Equations, at: Mapping[str, Any], among: Sequence[str]) -> Chosen:
    """The best conditioned of the free parameters: QR with column pivoting, once the unknowns are projected out.

    Raises:
        ProofFailed: with too few parameters, or none that the equations depend on.
    """
    count, of = system.conditions, system.problem.parameter_set
    if len(among) < count:
        raise ProofFailed(
            f"{_many(count, 'condition')} and {_many(len(among), 'free parameter')}: the pattern could not be proved "
            "for these numbers; they may be rounded, or irrational, and then an equation that vanishes cannot be told "
            f"from a small number; free {count - len(among)} more, or give fractions that have the pattern"
        )
    names = [*of.names, *system.unknowns]
    jacobian = np.array([[float(e) for e in row] for row in jacobian_of(system, at, names).tolist()])
    values = np.array([abs(float(at[n])) for n in names])
    rounding = np.abs(jacobian) @ values + 1e-300
    widths = {n: _NEAR_ZERO * (hi - lo) for n, (lo, hi) in system.problem.free.items()}
    units = [system.units.get(n, 1.0) for n in names]
    scale = np.maximum(np.where(values > 0, values, units), [widths.get(n, 0.0) for n in names])
    outside = [names.index(n) for n in system.unknowns]
    free = [names.index(n) for n in among]
    size = np.abs(jacobian)[:, [*free, *outside]] @ scale[[*free, *outside]] + 1e-300
    scaled = jacobian / size[:, None] * scale
    if not np.all(np.isfinite(scaled)):
        raise ProofFailed("the equations have no finite derivatives at the design; move it off the edge of its range")
    basis = np.linalg.qr(scaled[:, outside], mode="complete")[0][:, len(outside) :] if outside else np.eye(len(scaled))
    reduced = basis.T @ scaled[:, free]
    order, pivots = _pivoted(reduced, count)
    if count and not pivots[-1] > _DEPENDENT * max(pivots[0], 1e-3):
        idle = [n for n, k in zip(among, free, strict=True) if not np.any(jacobian[:, k])]
        why = f"; they do not depend on {', '.join(idle)}" if idle else ""
        raise ProofFailed(
            f"the equations are (nearly) singular in the free parameters {', '.join(among)}{why}; free another one"
        )
    moved = tuple(sorted((among[k] for k in order), key=of.names.index))
    square = [names.index(n) for n in (*moved, *system.unknowns)]
    effect = np.abs(np.linalg.pinv(scaled[:, square])) @ (rounding / size) * scale[square] * (ROUNDINGS * _EPS)
    floors = {n: _NOTHING * (hi - lo) for n, (lo, hi) in system.problem.free.items()}
    solved = zip((*moved, *system.unknowns), effect, strict=True)
    return Chosen(moved, {n: float(e) + 2 * _EPS * abs(float(at[n])) + floors.get(n, 0.0) for n, e in solved})


def _pivoted(columns: Array, count: int) -> tuple[list[int], list[float]]:
    """Columns that add most to those before them, and how much: QR with pivoting, and nothing of SciPy to load."""
    left, order, adds = columns, list[int](), list[float]()
    for _ in range(count):
        lengths = np.linalg.norm(left, axis=0)
        order.append(int(lengths.argmax()))
        adds.append(float(lengths.max()))
        unit = left[:, order[-1]] / (adds[-1] or 1.0)
        left = left - np.outer(unit, unit @ left)
        left[:, order] = 0.0
    return order, adds


def _many(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"
