"""First- and second-order conditions at a point of a smooth program, by linear algebra in scaled variables."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tmsopt.analysis.program import LocalProgram
from tmsopt.records import Array

STATIONARY = 1e-8
"""Largest share of the gradient that the multipliers do not explain at a stationary point; usually it is 1e-12."""

POSITIVE = 1e-7
"""Smallest multiplier (for rows and gradient of length 1) whose sign is significant; residuals are 1e-12."""

_RANK = 1e-9  # singular value of rows of length 1 below which they are dependent
_MIN_CURVATURE = 1e-7  # smallest curvature, relative to the largest, whose sign is significant


@dataclass(frozen=True)
class Conditions:
    """First- and second-order conditions at a point.

    Attributes:
        multipliers: y with ∇f = Σ yᵢ ∇hᵢ, one number for each active row: the change of f per unit of hᵢ.
        scaled: the multipliers for rows of length 1 and a gradient of length 1.
        residual: share of the gradient that the multipliers do not explain.
        independent: whether the gradients ∇h are linearly independent, so that the multipliers are unique.
        downhill: feasible direction of descent, to first order or by negative curvature; 0 without such a direction.
        curvature: smallest curvature of f − y·h in the null space of the firm rows, in scaled variables and relative to
            the largest curvature; nan if the null space is empty.
        firm: which rows are equalities or have positive multipliers.
    """

    multipliers: Array
    scaled: Array
    residual: float
    independent: bool
    downhill: Array
    curvature: float
    firm: NDArray[np.bool_]


def evaluate_conditions(program: LocalProgram) -> Conditions:
    """Multipliers, rank and curvature at the point of a program."""
    gradient, _, jacobian, _ = program.evaluate(program.x)
    signed = np.array([row.signed for row in program.rows])
    slope, rows = gradient * program.sizes, jacobian * program.sizes
    lengths = np.linalg.norm(rows, axis=1)
    lengths[lengths == 0] = 1.0
    steepness = float(np.linalg.norm(slope)) or 1.0
    unit, target = rows / lengths[:, None], slope / steepness
    independent = bool(np.sum(np.linalg.svd(unit, compute_uv=False) > _RANK) == len(unit))
    y = np.linalg.lstsq(unit.T, target, rcond=_RANK)[0]
    downhill, curvature = np.zeros_like(slope), np.nan
    if not independent or np.any(y[signed] < -POSITIVE) or np.linalg.norm(target - unit.T @ y) > STATIONARY:
        from scipy.optimize import lsq_linear  # takes 0.25 s to import, and is rarely needed

        lower_bounds = np.where(signed, 0.0, -np.inf)
        bounded_multipliers = lsq_linear(unit.T, target, bounds=(lower_bounds, np.inf), method="bvls", tol=1e-14).x
        residual_gradient = target - unit.T @ bounded_multipliers
        if np.linalg.norm(residual_gradient) > STATIONARY:
            # the gradient minus its projection onto the cone of multipliers
            downhill = -residual_gradient * program.sizes
        y = y if independent else bounded_multipliers
    residual = float(np.linalg.norm(target - unit.T @ y))
    multipliers, firm = y * steepness / lengths, ~signed | (y > POSITIVE)
    if not downhill.any():
        curvature, direction = _compute_curvature(program, multipliers, unit[firm], steepness)
        downhill = direction * program.sizes if curvature < -_MIN_CURVATURE else downhill
    return Conditions(multipliers, y, residual, independent, downhill, curvature, firm)


def curvature_sign(curvature: float) -> int:
    """Sign of a curvature; 0 within rounding, and for nan."""
    return int(curvature > _MIN_CURVATURE) - int(curvature < -_MIN_CURVATURE)


def _compute_curvature(program: LocalProgram, multipliers: Array, firm: Array, steepness: float) -> tuple[float, Array]:
    """Smallest curvature in the null space of the firm rows, relative to the largest or to the slope; its direction."""
    _, lengths, directions = np.linalg.svd(firm)
    free = directions[np.sum(lengths > _RANK * lengths.max(initial=0.0)) :].T  # columns: a basis of the null space
    if not free.shape[1]:
        return np.nan, np.zeros(len(program.x))
    hessian = program.evaluate(program.x, multipliers)[3] * np.outer(program.sizes, program.sizes)
    values, vectors = np.linalg.eigh(free.T @ hessian @ free)
    return float(values[0] / max(np.abs(values).max(), steepness)), free @ vectors[:, 0]
