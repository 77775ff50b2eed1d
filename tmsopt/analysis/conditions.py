"""First- and second-order conditions at a point of a smooth program, by linear algebra in scaled variables."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tmsopt.analysis.program import LocalProgram
from tmsopt.records import Array

STATIONARY = 1e-8
"""Part of the gradient that no multipliers explain, up to which a point is stationary: a polished one has 1e-12."""

POSITIVE = 1e-7
"""Multiplier, of scaled rows and for a gradient of 1, from which its sign is believed; residuals are 1e-12."""

_RANK = 1e-9  # singular value of scaled rows of length 1 below which they are dependent
_CURVED = 1e-7  # curvature, of the largest there is, from which its sign is believed


@dataclass(frozen=True)
class Conditions:
    """What the derivatives say.

    Attributes:
        multipliers: y with ∇f = Σ yᵢ ∇hᵢ, one per held row: change of f per unit of hᵢ.
        scaled: the same for rows of length 1 and a gradient of length 1.
        residual: part of the gradient that is left, as a share of it.
        independent: whether the gradients ∇h are, so that the multipliers are the only ones.
        downhill: direction of descent that the held rows leave open to first order, or with negative curvature.
        curvature: least curvature of f − y·h along what is held firmly, in scaled variables and as a share of the
            largest; nan where nothing is left to move.
        firm: which rows are equalities or have positive multipliers.
    """

    multipliers: Array
    scaled: Array
    residual: float
    independent: bool
    downhill: Array
    curvature: float
    firm: NDArray[np.bool_]


def conditions(program: LocalProgram) -> Conditions:
    """Multipliers, rank and curvature at the point of a program."""
    gradient, _, jacobian, _ = program.at(program.x)
    signed = np.array([held.signed for held in program.held])
    slope, rows = gradient * program.sizes, jacobian * program.sizes
    lengths = np.linalg.norm(rows, axis=1)
    lengths[lengths == 0] = 1.0
    steepness = float(np.linalg.norm(slope)) or 1.0
    unit, target = rows / lengths[:, None], slope / steepness
    independent = bool(np.sum(np.linalg.svd(unit, compute_uv=False) > _RANK) == len(unit))
    y = np.linalg.lstsq(unit.T, target, rcond=_RANK)[0]
    downhill, curvature = np.zeros_like(slope), np.nan
    if not independent or np.any(y[signed] < -POSITIVE) or np.linalg.norm(target - unit.T @ y) > STATIONARY:
        from scipy.optimize import lsq_linear  # a quarter of a second, paid only where multipliers are in question

        least = np.where(signed, 0.0, -np.inf)
        allowed = lsq_linear(unit.T, target, bounds=(least, np.inf), method="bvls", tol=1e-14).x
        left = target - unit.T @ allowed
        if np.linalg.norm(left) > STATIONARY:
            downhill = -left * program.sizes  # what is left of the gradient, once the cone of multipliers is used up
        y = y if independent else allowed
    residual = float(np.linalg.norm(target - unit.T @ y))
    multipliers, firm = y * steepness / lengths, ~signed | (y > POSITIVE)
    if not downhill.any():
        curvature, along = _curvature(program, multipliers, unit[firm], steepness)
        downhill = along * program.sizes if curvature < -_CURVED else downhill
    return Conditions(multipliers, y, residual, independent, downhill, curvature, firm)


def curved(curvature: float) -> int:
    """Sign of a curvature; 0 where rounding decides it, or there is none."""
    return int(curvature > _CURVED) - int(curvature < -_CURVED)


def _curvature(program: LocalProgram, multipliers: Array, firm: Array, steepness: float) -> tuple[float, Array]:
    """Least curvature along what is held firmly, relative to the largest or the slope, and its direction."""
    _, lengths, directions = np.linalg.svd(firm)
    free = directions[np.sum(lengths > _RANK * lengths.max(initial=0.0)) :].T  # columns that no row changes
    if not free.shape[1]:
        return np.nan, np.zeros(len(program.x))
    hessian = program.at(program.x, multipliers)[3] * np.outer(program.sizes, program.sizes)
    values, vectors = np.linalg.eigh(free.T @ hessian @ free)
    return float(values[0] / max(np.abs(values).max(), steepness)), free @ vectors[:, 0]
