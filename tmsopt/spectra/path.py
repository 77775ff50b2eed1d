"""Eigenvalues followed along a circle in a plane of parameters, with their geometric phases.

The circle is divided until the eigenvalues of neighbouring points can be assigned to each other without doubt. Left
and right eigenvectors y and x with y x = 1 give the phase γ = i Σ log y(t) x(t + h) along a closed path. It does not
depend on the lengths of the vectors. The mean of this sum and of −Σ log y(t + h) x(t) has an error of h² only.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from tmsopt.errors import input_error
from tmsopt.records import Array, Complex
from tmsopt.spectra.plane import ParameterPlane, order_by_parts

_MAX_MOVE = 1 / 3  # largest move of an eigenvalue between two points, as a share of its distance from the others
_MAX_TURN = 0.5  # largest difference of y(t) x(t + h) y(t + h) x(t) from 1
_MIN_STEP = 1e-8  # least angle between two points; if more are needed, two eigenvalues coincide on the circle
_PHASE_TOLERANCE = 1e-9  # change of the phases, if the steps are halved, that ends their improvement
_MAX_EIGENVALUES = 20_000  # number of eigenvalues at all points that ends it too
_MAX_UNCLEAR = 100_000  # the same number, at which eigenvalues that are not assigned coincide along an arc


@dataclass(frozen=True)
class Path:
    """Eigenvalues along a circle, once around it counterclockwise.

    Attributes:
        angles: shape (k + 1,), from 0 to 2π.
        values: the eigenvalues that the user sees, shape (k + 1, n); each column is continuous.
        permutation: eigenvalue j becomes eigenvalue permutation[j].
        logs: Σ log y(t) x(t + h) of each eigenvalue, in the limit h → 0.
    """

    angles: Array
    values: Complex
    permutation: tuple[int, ...]
    logs: Complex

    def count_windings(self, indices: Any = slice(None)) -> int:
        """The winding number of the discriminant Π (λ_i − λ_j)² of eigenvalues that exchange only with each other."""
        values = self.values[:, indices]
        i, j = np.triu_indices(values.shape[1], 1)
        differences = values[:, i] - values[:, j]
        return round(float(np.angle(differences[1:] / differences[:-1]).sum()) / np.pi)


def follow(plane: ParameterPlane, centre: Array, radius: float, points: int) -> Path:
    """Follow the eigenvalues around a circle; for real matrices those with Im s >= 0, because the others mirror them.

    Args:
        points: number of points at first.

    Raises:
        InputError: if two eigenvalues coincide on the circle, or if the matrices are not defined there.
    """

    def place(angles: Array) -> Array:
        return np.asarray(centre + radius * np.stack([np.cos(angles), np.sin(angles)], axis=-1))

    def compute(angles: Array) -> list[Any]:
        try:
            values, right = np.linalg.eig(plane.matrices(place(angles)))
        except np.linalg.LinAlgError:
            words = "the matrices are singular or not defined on the circle; choose another radius, centre or plane"
            raise input_error(words, "radius") from None
        return [angles, values.astype(complex), right, np.linalg.pinv(right)]

    states = compute(2 * np.pi * np.arange(points) / points)
    best: Complex | None = None
    logs: Complex | None = None
    while True:
        with np.errstate(all="ignore"):  # a product of eigenvectors may be 0
            nearest, terms, are_clear = _match(*states[1:])
        steps, chosen = np.diff(states[0], append=2 * np.pi), ~are_clear
        if are_clear.all():
            tracks, finer = _add_along_tracks(nearest, terms)
            last, best = best, finer if logs is None else finer + wrap(finer - logs) / 3
            has_converged = last is not None and np.abs(wrap(best - last)).max() <= _PHASE_TOLERANCE
            if has_converged or nearest.size >= _MAX_EIGENVALUES:
                break
            logs = finer
            chosen[:] = True
        elif steps.min() < _MIN_STEP or nearest.size >= _MAX_UNCLEAR:
            raise input_error(_describe_coincidence(plane, *place(states[0][steps.argmin()])), "radius")
        added = compute(states[0][chosen] + steps[chosen] / 2)
        order = np.argsort(np.concatenate([states[0], added[0]]))
        states = [np.concatenate(pair)[order] for pair in zip(states, added, strict=True)]
    values = plane.user_values(np.take_along_axis(np.append(states[1], states[1][:1], axis=0), tracks, axis=1))
    order = order_by_parts(values[0])
    if not plane.problem.model.is_complex:
        order = order[values[0, order].imag >= 0][::-1]
    permutation = tuple(order.tolist().index(k) for k in tracks[-1][order])
    return Path(np.append(states[0], 2 * np.pi), values[:, order], permutation, best[order])


def _describe_coincidence(plane: ParameterPlane, x: float, y: float) -> str:
    place = f"at {plane.names[0]} = {x:.6g}, {plane.names[1]} = {y:.6g}"
    curves = "" if plane.problem.model.is_complex else "; real double roots form curves, which such a circle may cross"
    return f"two eigenvalues coincide on the circle, {place}; choose another radius, centre or plane{curves}"


def _match(values: Complex, right: Complex, left: Complex) -> tuple[Any, Complex, Any]:
    """Compare each point with the next one.

    Returns:
        For each point and eigenvalue the nearest eigenvalue at the next point, and log y(t) x(t + h) with an error of
        h³. For each point, whether the eigenvalues are assigned without doubt.
    """
    next_values, next_right, next_left = (np.roll(a, -1, axis=0) for a in (values, right, left))
    moves = np.abs(values[:, :, None] - next_values[:, None, :])
    nearest = moves.argmin(axis=2)
    gaps = (np.abs(values[:, :, None] - values[:, None, :]) + np.diag(np.full(values.shape[1], np.inf))).min(axis=2)
    x = np.take_along_axis(next_right, nearest[:, None, :], axis=2)
    y = np.take_along_axis(next_left, nearest[:, :, None], axis=1)
    forward = np.einsum("tki,tik->tk", left, x).astype(complex)
    both = forward * np.einsum("tki,tik->tk", y, right)
    are_clear = (moves.min(axis=2) < _MAX_MOVE * gaps) & (np.abs(both - 1) < _MAX_TURN)
    return nearest, np.log(forward) - np.log(both) / 2, are_clear.all(axis=1)


def _add_along_tracks(nearest: Any, terms: Complex) -> tuple[Any, Complex]:
    """The index of each eigenvalue of the first point at every point and after the turn, and the sum of its terms."""
    tracks, total = [np.arange(nearest.shape[1])], np.zeros(nearest.shape[1], dtype=complex)
    for following, term in zip(nearest, terms, strict=True):
        total += term[tracks[-1]]
        tracks.append(following[tracks[-1]])
    return np.array(tracks), total


def wrap(logs: Complex) -> Complex:
    """Logarithms with imaginary parts from −π to π."""
    return np.asarray(logs - 2j * np.pi * np.round(logs.imag / (2 * np.pi)))
