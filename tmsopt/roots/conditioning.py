"""How sensitive eigenvalues are to perturbations: phase rigidity, Petermann factor and condition number.

Let L(s) = Σ Pₖ s^(d−k) have the eigenvalue s with the null vectors x and y (L(s) x = 0, y* L(s) = 0). The state matrix
(`linearise`) moves the state (q, q′ …); it is −P₀⁻¹ P₁ for d = 1. Let z and w be its right and left eigenvectors.

- The phase rigidity is r = |w* z|/(|w| |z|). It is 1 if the eigenvector is orthogonal to all others, and 0 at an
  exceptional point.
- The Petermann factor is K = 1/r².
- The condition number is κ = (Σ cₖ |s|^(d−k)) |x| |y|/|y* L′(s) x|. The largest change of s is κ ε if Pₖ changes by at
  most cₖ ε in the spectral norm, to first order in ε. For d ≥ 2, cₖ = ‖Pₖ‖ (Tisseur, Linear Algebra and its
  Applications 309, 2000, theorem 5, there divided by |s|). For d = 1, c₀ = 0 and c₁ = 1, so κ = 1/r for s − A.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from tmsopt.records import Array, Complex
from tmsopt.roots.chains import linearise, linearise_batch, make_cluster, schur_form

_ROUNDING = 2.0**-52  # a smaller relative singular value of the eigenvectors counts as this value
_MIN_RIGIDITY = 1e-12
"""With a smaller phase rigidity, rounding errors of the merging eigenvectors spoil those of other eigenvalues."""
_MIN_OTHER_RIGIDITY = 1e-6  # a larger phase rigidity belongs to an eigenvector that does not merge


@dataclass(frozen=True)
class Conditioning:
    """Sensitivities of all eigenvalues of matrix polynomials, shape (…, number of eigenvalues).

    Attributes:
        eigenvalues: in no order.
        phase_rigidity: 1 for an eigenvector that is orthogonal to all others, 0 at an exceptional point.
        condition: the condition number κ.

    Example:
        >>> tmsopt.roots.Conditioning(np.array([1j]), np.array([0.5]), np.array([2.0])).petermann.tolist()
        [4.0]

    More: docs/explanation/exceptional_points.md
    """

    eigenvalues: Complex
    phase_rigidity: Array
    condition: Array

    @property
    def petermann(self) -> Array:
        """The Petermann factor 1/r², infinite for r = 0."""
        with np.errstate(divide="ignore"):
            return np.asarray(np.power(self.phase_rigidity, -2.0))


def find_conditioning(matrices: Any) -> Conditioning:
    """Phase rigidity and condition number of every eigenvalue of L(s) = Σ Pₖ s^(d−k).

    The left eigenvectors are the rows of the inverse of the matrix of the right eigenvectors. Rounding errors of the
    matrices separate merging eigenvectors: where 2 eigenvalues coincide, r is about 1e-8 instead of 0, and it is at
    least about 1e-16. If r is below 1e-12, the values of the other eigenvalues of this design are nan.

    Args:
        matrices: Pₖ in descending powers, shape (…, d + 1, n, n).

    Returns:
        Numbers of shape (…, d n), nan if P₀ is singular or an entry is not finite.

    Example:
        >>> found = tmsopt.roots.find_conditioning([np.eye(2), [[-1, -1], [0, -2]]])  # s − A with A = [[1, 1], [0, 2]]
        >>> found.eigenvalues.real.tolist(), found.petermann.round(12).tolist()  # (1, 0) and (1, 1) are at 45°
        ([1.0, 2.0], [2.0, 2.0])

    More: docs/explanation/exceptional_points.md
    """
    P = np.asarray(matrices, dtype=np.result_type(np.asarray(matrices), float))
    n = P.shape[-1]
    state, is_defined = linearise_batch(P)
    is_defined = is_defined[..., None]
    with np.errstate(all="ignore"):
        P = np.where(is_defined[..., None, None], P, np.eye(n))
        s, right = np.linalg.eig(state)
        U, values, V = np.linalg.svd(right.astype(complex))
        left = _adjoint(V) / np.maximum(values, _ROUNDING)[..., None, :] @ _adjoint(U)
        y = left[..., -n:] @ np.linalg.inv(P[..., 0, :, :])
        condition = _size_terms(P, s) * np.linalg.norm(right[..., :n, :], axis=-2) * np.linalg.norm(y, axis=-1)
        rigidity = 1 / np.linalg.norm(left, axis=-1)
    is_merging = rigidity.min(axis=-1, keepdims=True) < _MIN_RIGIDITY
    is_known = is_defined & ~(is_merging & (rigidity > _MIN_OTHER_RIGIDITY))
    return Conditioning(
        np.where(is_defined, s, np.nan), np.where(is_known, rigidity, np.nan), np.where(is_known, condition, np.nan)
    )


def condition_eigenvalue(matrices: Complex, s: complex, multiplicity: int = 1) -> tuple[float, float]:
    """Phase rigidity and condition number of one eigenvalue that is simple or semisimple.

    For a semisimple eigenvalue, the spectral projector Π onto its eigenvectors replaces z w*/(w* z), so r = 1/‖Π‖. The
    blocks of Π for x and y replace x y*/(y* L′(s) x). Both numbers are nan if P₀ is singular.

    Args:
        matrices: Pₖ in descending powers, shape (d + 1, n, n).

    Example:
        >>> matrices = np.array([np.eye(3), -np.diag([1, 1, 2])], dtype=complex)
        >>> tmsopt.roots.condition_eigenvalue(matrices, 1.0, 2)
        (1.0, 1.0)

    More: docs/explanation/exceptional_points.md
    """
    n = matrices.shape[-1]
    try:
        cluster = make_cluster(schur_form(linearise(matrices), is_complex=True), np.full(multiplicity, s))
    except np.linalg.LinAlgError:
        cluster = None
    if cluster is None:
        return np.nan, np.nan
    change = cluster.right[:n] @ np.linalg.solve(matrices[0].T, cluster.left[:, -n:].T).T
    condition = _size_terms(matrices, np.array([s]))[0] * np.linalg.norm(change, 2)
    return float(1 / np.linalg.norm(cluster.left, 2)), float(condition)


def _size_terms(P: Any, s: Complex) -> Array:
    """Σ cₖ |s|^(d−k) for each eigenvalue, shape (…, number of eigenvalues)."""
    d = P.shape[-3] - 1
    sizes = np.linalg.norm(P, 2, axis=(-2, -1)) if d > 1 else np.array([0.0, 1.0])
    powers = np.abs(s)[..., None, :] ** np.arange(d, -1, -1)[:, None]
    return np.asarray((sizes[..., None] * powers).sum(axis=-2))


def _adjoint(A: Complex) -> Complex:
    return np.asarray(A.conj().swapaxes(-1, -2))
