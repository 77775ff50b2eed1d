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

_MIN_SINGULAR_VALUE = 1e-9  # smallest singular value of rows of length 1 that are independent
_MIN_CURVATURE = 1e-7  # smallest curvature, relative to the largest, whose sign is significant


@dataclass(frozen=True)
class Conditions:
    """First- and second-order conditions at a point.

    Attributes:
        multipliers: y with ∇f = Σ yᵢ ∇hᵢ, one number for each active row: the change of f per unit of hᵢ.
        scaled_multipliers: the multipliers for rows of length 1 and a gradient of length 1.
        residual: share of the gradient that the multipliers do not explain.
        is_independent: whether the gradients ∇h are linearly independent, so that the multipliers are unique.
        descent_direction: feasible direction of descent, to first order or by negative curvature; 0 if there is none.
        curvature: smallest curvature of f − y·h in the null space of the firm rows, in scaled variables and relative to
            the largest curvature; nan if the null space is empty.
        is_firm: whether each row is firm: an equality, or a row with a positive multiplier.
    """

    multipliers: Array
    scaled_multipliers: Array
    residual: float
    is_independent: bool
    descent_direction: Array
    curvature: float
    is_firm: NDArray[np.bool_]


def evaluate_conditions(program: LocalProgram) -> Conditions:
    """Multipliers, rank and curvature at the point of a program."""
    gradient, _, jacobian, _ = program.evaluate(program.x)
    is_inequality = np.array([row.is_inequality for row in program.rows])
    scaled_gradient, scaled_rows = gradient * program.sizes, jacobian * program.sizes
    lengths = np.linalg.norm(scaled_rows, axis=1)
    lengths[lengths == 0] = 1.0
    gradient_length = float(np.linalg.norm(scaled_gradient)) or 1.0
    unit_rows, unit_gradient = scaled_rows / lengths[:, None], scaled_gradient / gradient_length
    is_independent = bool(np.sum(np.linalg.svd(unit_rows, compute_uv=False) > _MIN_SINGULAR_VALUE) == len(unit_rows))
    y = np.linalg.lstsq(unit_rows.T, unit_gradient, rcond=_MIN_SINGULAR_VALUE)[0]
    descent_direction, curvature = np.zeros_like(scaled_gradient), np.nan
    if (
        not is_independent
        or np.any(y[is_inequality] < -POSITIVE)
        or np.linalg.norm(unit_gradient - unit_rows.T @ y) > STATIONARY
    ):
        from scipy.optimize import lsq_linear  # takes 0.25 s to import, and is rarely needed

        lower_bounds = np.where(is_inequality, 0.0, -np.inf)
        bounded_multipliers = lsq_linear(
            unit_rows.T, unit_gradient, bounds=(lower_bounds, np.inf), method="bvls", tol=1e-14
        ).x
        residual_gradient = unit_gradient - unit_rows.T @ bounded_multipliers
        if np.linalg.norm(residual_gradient) > STATIONARY:
            # the gradient minus its projection onto the cone of multipliers
            descent_direction = -residual_gradient * program.sizes
        y = y if is_independent else bounded_multipliers
    residual = float(np.linalg.norm(unit_gradient - unit_rows.T @ y))
    multipliers, is_firm = y * gradient_length / lengths, ~is_inequality | (y > POSITIVE)
    if not descent_direction.any():
        curvature, direction = _compute_curvature(program, multipliers, unit_rows[is_firm], gradient_length)
        descent_direction = direction * program.sizes if curvature < -_MIN_CURVATURE else descent_direction
    return Conditions(multipliers, y, residual, is_independent, descent_direction, curvature, is_firm)


def curvature_sign(curvature: float) -> int:
    """Sign of a curvature; 0 if rounding errors may cause it, and for nan."""
    return int(curvature > _MIN_CURVATURE) - int(curvature < -_MIN_CURVATURE)


def _compute_curvature(
    program: LocalProgram, multipliers: Array, firm_rows: Array, gradient_length: float
) -> tuple[float, Array]:
    """Return the smallest curvature in the null space of the firm rows, and its direction.

    The curvature is relative to the largest curvature, or to the gradient if this is larger.
    """
    _, lengths, directions = np.linalg.svd(firm_rows)
    rank = np.sum(lengths > _MIN_SINGULAR_VALUE * lengths.max(initial=0.0))
    null_space = directions[rank:].T  # columns: a basis
    if not null_space.shape[1]:
        return np.nan, np.zeros(len(program.x))
    hessian = program.evaluate(program.x, multipliers)[3] * np.outer(program.sizes, program.sizes)
    values, vectors = np.linalg.eigh(null_space.T @ hessian @ null_space)
    return float(values[0] / max(np.abs(values).max(), gradient_length)), null_space @ vectors[:, 0]
