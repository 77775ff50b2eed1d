"""The Jordan chain of an eigenvalue of a matrix polynomial, with its vectors eliminated, and clusters of eigenvalues.

Let L(s) = Σ Pₖ s^(d−k), and let b and c be vectors such that the bordered matrix B(s) = [[L(s), b], [c*, 0]] is regular
near λ. Then B(λ + t) (x(t); F(t)) = (0; 1) defines power series x(t) and F(t) = −det L/det B. So λ is a k-fold
eigenvalue with one eigenvector if and only if F₀ = … = F₍ₖ₋₁₎ = 0, and then x₀ … x₍ₖ₋₁₎ is its Jordan chain. The
series F is smooth in λ and in the entries of L, also where the eigenvalue is multiple (Govaerts, Numerical Methods for
Bifurcations of Dynamical Equilibria, SIAM 2000, chapter 3).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from math import comb
from operator import add
from typing import Any

import numpy as np

from tmsopt.records import Array, Complex

_ROUNDING = 64 * float(np.finfo(float).eps)  # of a matrix, relative to its norm
_MAX_MERGED = 1e-3  # largest distance of eigenvalues that count as one, as a share of the norm; those of an EP4
MIN_SECOND_VALUE = 1e-10
"""Least second smallest singular value of L(λ), relative to the size of L, for a single eigenvector."""


def expand(matrices: Any, s: Any, count: int) -> list[Any]:
    """Taylor coefficients L(s), L′(s), L″(s)/2 … of a matrix polynomial: at most `count`, none beyond its degree.

    Args:
        matrices: Pₖ in descending powers, of numbers of any kind.
    """
    d = len(matrices) - 1
    terms = (
        [matrices[k] * (comb(d - k, j) * s ** (d - k - j)) for k in range(d - j + 1)] for j in range(min(d + 1, count))
    )
    return [reduce(add, parts) for parts in terms]


@dataclass(frozen=True)
class Chain:
    """The power series x(t), y(t) and F(t) of a matrix polynomial at λ.

    Attributes:
        s: λ.
        terms: Taylor coefficients of L at λ.
        values: F₀ … Fₖ.
        right, left: x₀ … x₍ₖ₋₁₎ and y₀ … y₍ₖ₋₁₎ as rows, shape (k, n); y is the series of the transposed matrices.
    """

    s: complex
    terms: Sequence[Complex]
    values: Complex
    right: Complex
    left: Complex

    @property
    def order(self) -> int:
        """Length of the chain."""
        return len(self.right)

    @cached_property
    def unit(self) -> float:
        """The unit u of t in which the first and the last vector of the chain, x₀ and x_j u^j, have the same length.

        It is at most the size of the eigenvalues, because x_j may be 0 up to rounding if L has a degree above 1.
        """
        if self.order == 1:
            return 1.0
        growth = np.linalg.norm(self.right[-1]) / np.linalg.norm(self.right[0])
        *others, leading = (np.linalg.norm(P) for P in self.terms)
        size = max((P / leading) ** (1 / i) for i, P in enumerate(others[::-1], start=1)) or 1.0
        return float(min(growth ** (-1 / (self.order - 1)) if growth > 0 else np.inf, size))

    @property
    def powers(self) -> Array:
        """1, u, u² …, one for each vector."""
        return np.asarray(self.unit ** np.arange(self.order))

    @property
    def borders(self) -> tuple[Complex, Complex]:
        """b and c for the next step: the unit vectors of the left and the right eigenvector."""
        b, c = self.left[0].conj(), self.right[0]
        return b / np.linalg.norm(b), c / np.linalg.norm(c)

    @property
    def residuals(self) -> Complex:
        """F_j u^j for j < k."""
        return np.asarray(self.values[:-1] * self.powers)

    @property
    def slopes(self) -> Complex:
        """Derivatives of the residuals with respect to λ."""
        return np.asarray(self.values[1:] * np.arange(1, self.order + 1) * self.powers)

    def respond(self, change: Complex) -> Complex:
        """Derivatives of the residuals for a change of the matrices, −Σ y_a D_i x_c over a + i + c = j.

        Args:
            change: derivatives of Pₖ, in descending powers.
        """
        total = np.zeros(self.order, dtype=complex)
        for i, D in enumerate(expand(change, self.s, self.order)):
            products = self.left @ D @ self.right.T
            for j in range(i, self.order):
                total[j] -= np.trace(products[: j - i + 1, : j - i + 1][:, ::-1])
        return np.asarray(total * self.powers)

    def term_sizes(self, matrices: Complex) -> tuple[float, ...]:
        """Sizes of the sums whose values are F₀ … F₍ₖ₋₁₎: Σ |y_a| S |x_c| over a + c = j, for the sizes S of L(λ)."""
        d = len(matrices) - 1
        size = sum(abs(self.s) ** (d - k) * np.abs(P) for k, P in enumerate(matrices))
        products = np.abs(self.left) @ size @ np.abs(self.right).T
        return tuple(float(np.trace(products[: j + 1, : j + 1][:, ::-1])) for j in range(self.order))

    def backward_error(self, size: float) -> float:
        """Size of a change of the matrices, relative to `size`, after which λ has exactly this chain.

        The change is −Σ F_j b w_j*, where w_j are dual to the vectors of the chain, in all powers of s; inf if the
        vectors are dependent, because there is no such change.
        """
        count = min(len(self.terms) - 1, self.order)
        padded = np.concatenate([np.zeros((count, len(self.right[0]))), self.right * self.powers[:, None]])
        stacked = np.hstack([padded[count - i : len(padded) - i] for i in range(max(count, 1))])
        if np.linalg.matrix_rank(stacked) < self.order:  # dependent vectors are no chain
            return np.inf
        dual = np.linalg.pinv(stacked)
        return float(np.linalg.norm(dual @ self.residuals)) / size


def make_chain(matrices: Complex, s: complex, order: int, borders: tuple[Complex, Complex]) -> Chain:
    """The chain of a matrix polynomial at s.

    Args:
        borders: b and c, see `find_borders`.

    Raises:
        LinAlgError: if the bordered matrix is singular or not finite.
    """
    terms = expand(matrices, s, order + 1)
    b, c = borders
    n = len(b)
    bordered = np.zeros((n + 1, n + 1), dtype=complex)
    bordered[:n, :n], bordered[:n, n], bordered[n, :n] = terms[0], b, c.conj()
    if not np.isfinite(bordered).all():
        raise np.linalg.LinAlgError("the matrices are not finite")
    inverse = np.asarray(np.linalg.inv(bordered), dtype=complex)

    def solve_series(inverse: Complex, terms: Sequence[Complex], count: int) -> Complex:
        series = np.zeros((count, n + 1), dtype=complex)
        series[0] = inverse[:, n]
        for j in range(1, count):
            right_side = sum(terms[i] @ series[j - i, :n] for i in range(1, min(len(terms) - 1, j) + 1))
            series[j] = -inverse[:, :n] @ right_side
        return series

    right = solve_series(inverse, terms, order + 1)
    left = solve_series(inverse.T, [D.T for D in terms], order)
    return Chain(s, terms, right[:, n], right[:order, :n], left[:, :n])


def find_borders(matrices: Complex, s: complex) -> tuple[tuple[Complex, Complex], float, float]:
    """The singular vectors b and c of the smallest singular value of L(s), and the two smallest singular values.

    For 1 × 1 matrices the second one is infinite.
    """
    U, values, V = np.linalg.svd(expand(matrices, s, 1)[0])
    return (U[:, -1], V[-1].conj()), float(values[-1]), float(values[-2]) if len(values) > 1 else np.inf


def size_at(matrices: Complex, s: complex) -> float:
    """Size of the terms of L(s)."""
    d = len(matrices) - 1
    return float(sum(abs(s) ** (d - k) * np.linalg.norm(P, 2) for k, P in enumerate(matrices))) or 1.0


def scale_time(matrices: Complex) -> tuple[Complex, float]:
    """The matrices for s in a unit, a power of 2, in which none is larger than the first one, and this unit.

    With d = 1 the linearised matrix has the same rounding errors in every unit, so the unit is 1.
    """
    sizes = np.linalg.norm(matrices, axis=(-2, -1))
    steps = np.arange(1, len(matrices))
    ratios = (sizes[1:] / sizes[0]) ** (1 / steps) if len(matrices) > 2 and sizes[0] else np.ones(1)
    largest = float(ratios.max())
    unit = 2.0 ** round(np.log2(largest)) if 0 < largest < np.inf else 1.0
    return matrices / unit ** np.arange(len(matrices))[:, None, None], unit


def linearise(matrices: Any) -> Any:
    """The state matrix, with the same eigenvalues, of shape (…, d n, d n). Its last n rows are −P₀⁻¹ (P_d … P₁).

    Args:
        matrices: real or complex arrays of shape (…, d + 1, n, n).

    Raises:
        LinAlgError: if P₀ is singular.
    """
    *shape, terms, n, _ = matrices.shape
    size = (terms - 1) * n
    leading, *others = np.moveaxis(matrices, -3, 0)
    M = np.zeros((*shape, size, size), dtype=matrices.dtype) + np.eye(size, k=n)
    M[..., -n:, :] = -np.linalg.solve(leading, np.concatenate(others[::-1], axis=-1))
    return M


def linearise_batch(matrices: Any) -> tuple[Any, Any]:
    """State matrices of shape (…, d n, d n), and whether each is defined: P₀ is regular, and all entries are finite.

    An undefined one is 0.
    """
    with np.errstate(all="ignore"):
        is_singular = np.linalg.slogdet(matrices[..., 0, :, :])[0] == 0
        state = linearise(np.where(is_singular[..., None, None, None], np.nan, matrices))
    is_defined = np.isfinite(state).all(axis=(-2, -1))
    return np.where(is_defined[..., None, None], state, 0.0), is_defined


def batch_eigenvalues(matrices: Any) -> Complex:
    """The eigenvalues of matrix polynomials, shape (…, d n); nan where undefined."""
    state, is_defined = linearise_batch(matrices)
    return np.where(is_defined[..., None], np.linalg.eigvals(state), np.nan + 0j)


def eigenvalues_of(matrices: Complex) -> Complex:
    """The eigenvalues of a matrix polynomial with a regular leading matrix; for a real one real or conjugate."""
    M = linearise(matrices)
    return np.asarray(np.linalg.eigvals(M if M.imag.any() else M.real), dtype=complex)


def eigenvectors_of(matrices: Complex) -> tuple[Complex, Complex, Complex]:
    """The eigenvalues, and the left and right eigenvectors of the linearised matrix, as rows Y and columns X.

    Y X has the diagonal 1. It is infinite or large where eigenvalues nearly coincide.

    Raises:
        LinAlgError: if the matrix is not finite.
    """
    from scipy.linalg import eig

    M = linearise(matrices)
    if not np.isfinite(M).all():
        raise np.linalg.LinAlgError("the matrices are not finite")
    s, left, right = eig(M if M.imag.any() else M.real, left=True, right=True)
    with np.errstate(all="ignore"):
        return s, (left.conj() / np.sum(left.conj() * right, axis=0)).T, right


def merged_eigenvalues(matrices: Complex) -> Complex:
    """The eigenvalues; those that rounding cannot tell apart are their mean, and those near the imaginary axis on it.

    At an exceptional point of order k computed eigenvalues are off by the k-th root of the rounding error, but not
    their mean.
    """
    from scipy.sparse.csgraph import connected_components

    matrices, unit = scale_time(matrices)
    s, left, _ = eigenvectors_of(matrices)
    conditions = np.nan_to_num(np.abs(left).max(axis=1), nan=np.inf)
    errors = float(np.linalg.norm(linearise(matrices), 2)) * np.minimum(_ROUNDING * conditions, _MAX_MERGED)
    _, labels = connected_components(np.abs(s[:, None] - s) <= errors)
    is_same = labels[:, None] == labels
    means = is_same @ s / is_same.sum(axis=1)
    return np.asarray(unit * np.where(np.abs(means.real) <= errors, 1j * means.imag, means))


def linearised_slopes(matrices: Complex, slopes: Complex) -> Complex:
    """Derivatives of the last n rows of the linearised matrix, shape (m, n, d n).

    Args:
        slopes: derivatives of the matrices with respect to m parameters, shape (m, d + 1, n, n).
    """
    last_rows = linearise(matrices)[-len(matrices[0]) :]
    changes = np.array([np.hstack(list(change[:0:-1])) + change[0] @ last_rows for change in slopes])
    return -np.linalg.solve(matrices[0], changes) if len(slopes) else changes


@dataclass(frozen=True)
class Cluster:
    """Some eigenvalues of a matrix, by the Schur form of their invariant subspace.

    Attributes:
        mean: mean of the eigenvalues.
        block: the Schur block of the eigenvalues minus their mean, shape (k, k).
        right, left: bases X (n, k) and Y (k, n) of the invariant subspaces with Y X = I.
    """

    mean: complex
    block: Complex
    right: Complex
    left: Complex

    @property
    def radius(self) -> float:
        """Largest distance of an eigenvalue from the mean."""
        return float(np.abs(np.diag(self.block)).max())

    @property
    def powers(self) -> list[Complex]:
        """1, D, D² … of the block D."""
        powers = [np.eye(len(self.block), dtype=complex)]
        for _ in range(len(self.block)):
            powers.append(powers[-1] @ self.block)
        return powers

    @property
    def power_sums(self) -> Complex:
        """Σ (λ_i − mean)^j for j = 2 … k, which are 0 if and only if the eigenvalues coincide."""
        return np.array([np.trace(P) for P in self.powers[2:]], dtype=complex)

    def respond(self, change: Complex) -> tuple[complex, Complex]:
        """Derivatives of the mean and of the power sums for a change of the last rows of the matrix."""
        change_of_block = self.left[:, -len(change) :] @ change @ self.right
        k = len(self.block)
        change_of_mean = complex(np.trace(change_of_block)) / k
        centred = change_of_block - change_of_mean * np.eye(k)
        sums = [j * np.trace(P @ centred) for j, P in enumerate(self.powers[1:k], start=2)]
        return change_of_mean, np.array(sums, dtype=complex)


@dataclass(frozen=True)
class SchurForm:
    """A matrix as Q T Q* with an upper triangular T.

    Attributes:
        eigenvalues: those of a real matrix are exactly real or conjugate, and may be in another order than in T.
    """

    T: Complex
    Q: Complex
    eigenvalues: Complex


def schur_form(matrix: Complex, is_complex: bool) -> SchurForm:
    """The Schur form of a matrix, which may be real.

    Raises:
        LinAlgError: if the matrix is not finite.

    Example:
        >>> form = tmsopt.roots.schur_form(np.array([[0, 1], [-1, 0]], dtype=complex), is_complex=False)
        >>> sorted(form.eigenvalues.imag.tolist())
        [-1.0, 1.0]

    More: docs/explanation/jordan_chains.md
    """
    from scipy.linalg import schur

    if not np.isfinite(matrix).all():
        raise np.linalg.LinAlgError("the matrix is not finite")
    T, Q = schur(matrix, output="complex")
    eigenvalues = np.diag(T) if is_complex else np.linalg.eigvals(matrix.real)
    return SchurForm(T, Q, np.asarray(eigenvalues, dtype=complex))


def make_cluster(form: SchurForm, eigenvalues: Complex) -> Cluster:
    """The cluster of the given eigenvalues of a matrix.

    Example:
        >>> form = tmsopt.roots.schur_form(np.diag([1.0, 1.5, 9.0]).astype(complex), is_complex=False)
        >>> cluster = tmsopt.roots.make_cluster(form, np.array([1.0, 1.5]))
        >>> cluster.mean, cluster.radius
        ((1.25+0j), 0.25)

    More: docs/explanation/jordan_chains.md
    """
    from scipy.linalg.lapack import ztrsen, ztrsyl

    k, distances = len(eigenvalues), np.abs(np.diag(form.T)[:, None] - eigenvalues).min(axis=1)
    chosen = np.zeros(len(form.T), dtype=np.int32)
    chosen[np.argsort(distances, kind="stable")[:k]] = 1
    T, Q, *_ = ztrsen(chosen, form.T, form.Q, job=b"N")
    block, left = T[:k, :k], Q.conj().T
    if k < len(T):
        left = np.hstack([np.eye(k), ztrsyl(block, T[k:, k:], T[:k, k:], isgn=-1)[0]]) @ left
    mean = complex(np.trace(block)) / k
    return Cluster(mean, block - mean * np.eye(k), Q[:, :k], left[:k])
