"""Symmetries of a system of matrices, found numerically and checked exactly.

H′ is a complex H minus its mean eigenfrequency, H − (tr H/n) 1. If a constant regular matrix S exists with
S H̄′ = H′ S, as for PT symmetry, also with a uniform loss, the characteristic polynomial of H′ is real. If
S H′ = −H′ S (chiral symmetry), its roots are symmetric about 0. Real matrices M s² + D s + K have a polynomial in s²
without damping, with gyroscopic forces alone, and with balanced gain and loss. Then some of the conditions for an
exceptional point hold for all parameters.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

import flint
import numpy as np

from tmsopt.algebra.balls import rational
from tmsopt.algebra.formula import UnsupportedOperation, constant, fold, formula, symbol
from tmsopt.algebra.identity import Field
from tmsopt.algebra.kinds import values
from tmsopt.models import from_coefficients
from tmsopt.models.stated.pairs import Pair, pair
from tmsopt.problem.problem import Posed, Problem
from tmsopt.records import Complex
from tmsopt.roots import composition
from tmsopt.roots.polynomial import characteristic_polynomial

_MAX_SIZE = 12  # rows of the largest matrix for which any S is sought, not only the usual ones
_SAMPLES = 3  # designs at which S is computed
_ZERO_SINGULAR_VALUE = 1e-9  # relative
_MAX_DENOMINATOR = 64  # of the entries of S
_ROUNDING = 1e-7  # distance of a computed entry from its fraction
_TRIALS = 8  # combinations of several solutions S that are tried

Rows = list[list[Pair]]


@dataclass(frozen=True)
class Symmetry:
    """Symmetries of a system, for all values of its free parameters.

    Attributes:
        is_real: whether the characteristic polynomial of H′ is real, or that of a real system a polynomial in s².
        is_chiral: whether the eigenvalues of H′ are symmetric about 0.
        has_loss: whether the mean eigenfrequency of H is complex.
        is_hermitian: whether H′ is Hermitian, so that no eigenvalue ever lacks an eigenvector. It has no other
            symmetry then.
    """

    is_real: bool = False
    is_chiral: bool = False
    has_loss: bool = False
    is_hermitian: bool = False

    def independent_conditions(self, order: int, size: int) -> int:
        """Number of conditions for an eigenvalue of a multiplicity that do not hold for all parameters.

        If all eigenvalues coincide, the conditions are the coefficients of the characteristic polynomial of H′.
        """
        count = size // 2 if self.is_chiral and order == size else order - 1
        return count if self.is_real else 2 * count


NONE = Symmetry()


def count_by_symmetry(problem: Posed) -> int:
    """How many of the conditions for the located pattern hold for all parameters, because of a symmetry of H."""
    pattern, model = problem.pattern, problem.model
    if pattern is None or model.pencil is None or model.statement is None:
        return 0
    parts, double = composition(pattern.name), "EP" if model.is_complex else "CEP"
    if any(kind != double for kind, _, _ in parts):
        return 0
    symmetry, size = find_symmetry(problem), model.degree
    return sum(count * (2 * (k - 1) - symmetry.independent_conditions(k, size)) for _, k, count in parts)


@lru_cache(maxsize=64)
def find_symmetry(problem: Posed) -> Symmetry:
    """The symmetries of a problem that has matrices."""
    model = problem.model
    assert model.pencil is not None
    *others, rows = matrices = _evaluate_matrices(problem)
    if not model.is_complex:
        return Symmetry(is_real=_has_even_polynomial(problem, matrices))
    if len(others) != 1:
        return NONE
    H, mean = centre_matrix(rows)
    n = len(H)
    conjugate = [[Pair(x.re, -x.im) for x in row] for row in H]
    negative = [[-x for x in row] for row in H]
    samples = _sample(problem, H)
    adjoint = [[conjugate[j][i] for j in range(n)] for i in range(n)]
    if _holds(np.eye(n, dtype=complex), adjoint, H):
        return Symmetry(is_hermitian=True)
    return Symmetry(
        is_real=any(_holds(S, conjugate, H) for S in _candidates(samples.conj(), samples)),
        is_chiral=any(_holds(S, H, negative) for S in _candidates(samples, -samples)),
        has_loss=bool(abs(_sample(problem, [[mean]]).imag).max() > 0),
    )


def _has_even_polynomial(problem: Posed, matrices: Sequence[Any]) -> bool:
    """Whether S Pₖ = (−1)ᵏ Pₖ S, or S Pₖᵀ = (−1)ᵏ Pₖ S, for a constant regular S and all Pₖ."""
    straight = [[[pair(x) for x in row] for row in P] for P in matrices]
    left = [[[(-1) ** k * x for x in row] for row in P] for k, P in enumerate(straight)]
    samples = np.concatenate([_sample(problem, P) for P in left])
    for right in (straight, [[list(column) for column in zip(*P, strict=True)] for P in straight]):
        right_samples = np.concatenate([_sample(problem, P) for P in right])
        for S in _candidates(right_samples, samples):
            if all(_holds(S, *sides) for sides in zip(right, left, strict=True)):
                return True
    return False


def _evaluate_matrices(problem: Posed) -> Sequence[Any]:
    """The matrices with the free parameters as symbols."""
    free = {n: symbol(n) for n in problem.free}
    parameters = problem.ordered({**problem.as_nodes(problem.fixed), **free})
    assert problem.model.pencil is not None
    return problem.model.pencil(problem.parameter_set.native(parameters))


def centre_matrix(rows: Sequence[Sequence[Any]]) -> tuple[Rows, Pair]:
    """H minus its mean eigenfrequency, and that mean, for i H."""
    H, n = [[Pair(x.im, -x.re) for x in row] for row in rows], len(rows)
    mean = sum((H[k][k] for k in range(n)), Pair(constant(0))) / n
    return [[x - mean if i == j else x for j, x in enumerate(row)] for i, row in enumerate(H)], mean


@lru_cache(maxsize=16)
def reduce_problem(problem: Posed) -> Posed | None:
    """The same question about real roots of det(ω − H′), if it is real; its unknowns are the free parameters.

    None if it is not real, or if limits use anything else than free parameters.
    """
    model, names = problem.model, tuple(problem.free)
    if not model.is_complex or problem.pattern is None or not names or problem.objective is not None or problem.cases:
        return None
    has_other_parts = any(kind != "EP" for kind, _, _ in composition(problem.pattern.name))
    uses_other_names = any(not set(c.names) <= set(names) for c in problem.conditions.values())
    if has_other_parts or uses_other_names or not find_symmetry(problem).is_real:
        return None
    *_, rows = _evaluate_matrices(problem)
    coefficients = [pair(c).re for c in characteristic_polynomial(centre_matrix(rows)[0])]
    if set(formula(coefficients).inputs) != set(names):
        return None
    reduced = from_coefficients(coefficients, name="reduced")
    return Problem(
        reduced, free=dict(problem.free), locate=problem.locate, constraints=problem.constraints, start=problem.start
    ).posed


def _sample(problem: Posed, rows: Rows) -> Complex:
    """The matrix at some designs."""
    parts = formula((y for row in rows for x in row for y in (x.re, x.im)), tuple(problem.free))
    rng, n = np.random.default_rng(0), len(rows)
    low, high = np.array([*problem.free.values()], dtype=float).reshape(-1, 2).T
    designs = low + (high - low) * rng.random((_SAMPLES, len(problem.free)))
    outputs = [np.array(values(parts, dict(zip(parts.names, p.tolist(), strict=True))), dtype=float) for p in designs]
    return np.array([x[::2] + 1j * x[1::2] for x in outputs]).reshape(-1, n, n)


def _candidates(right: Complex, left: Complex) -> Iterator[Complex]:
    """Regular matrices S of fractions with S A = B S at the samples A (`right`) and B (`left`), to rounding."""
    n = right.shape[-1]
    size = np.abs(left).max() or 1.0
    signs = np.diag((-1.0) ** np.arange(n)).astype(complex)
    for S in (np.eye(n, dtype=complex), np.eye(n, dtype=complex)[::-1], signs, signs[::-1]):
        if np.abs(S @ right - left @ S).max() <= _ROUNDING * size:
            yield S
    if n > _MAX_SIZE or not np.isfinite(left).all():
        return
    one = np.eye(n)
    equations = np.concatenate([np.kron(one, A.T) - np.kron(B, one) for A, B in zip(right, left, strict=True)])
    _, singular_values, V = np.linalg.svd(equations)
    count = int(np.sum(singular_values <= _ZERO_SINGULAR_VALUE * max(singular_values[0], 1e-300)))
    basis = _reduce_rows(V[len(V) - count :].conj()) if count else np.zeros((0, n * n), dtype=complex)
    rng = np.random.default_rng(0)
    for trial in range(_TRIALS if count else 0):
        factors = np.ones(count) if trial == 0 else rng.integers(-3, 4, count)
        yield (factors @ basis).reshape(n, n)


def _reduce_rows(basis: Complex) -> Complex:
    """The reduced row echelon form of independent rows."""
    rows, done = basis.copy(), 0
    for j in range(rows.shape[1]):
        if done == len(rows):
            break
        pivot = done + int(np.argmax(np.abs(rows[done:, j])))
        if abs(rows[pivot, j]) <= _ROUNDING:
            continue
        rows[[done, pivot]] = rows[[pivot, done]]
        rows[done] /= rows[done, j]
        others = np.arange(len(rows)) != done
        rows[others] -= np.outer(rows[others, j], rows[done])
        done += 1
    return rows


def _holds(S: Complex, right: Rows, left: Rows) -> bool:
    """Whether S is regular and S A = B S for all parameters, with the entries of S as fractions."""
    exact = [[_fraction_pair(x) for x in row] for row in S.tolist()]
    n = range(len(S))
    if any(x is None for row in exact for x in row):
        return False
    re, im = ([[rational(getattr(x, part)) for x in row] for row in exact] for part in ("re", "im"))
    real_form = [[*x, *(-b for b in y)] for x, y in zip(re, im, strict=True)]
    real_form += [[*y, *x] for x, y in zip(re, im, strict=True)]
    if flint.fmpq_mat(real_form).det() == 0:
        return False
    try:
        return all(_is_zero(exact, right, left, i, j) for i in n for j in n)
    except (UnsupportedOperation, ZeroDivisionError):
        return False


def _is_zero(S: Sequence[Sequence[Pair | None]], right: Rows, left: Rows, i: int, j: int) -> bool:
    total = Pair(constant(0))
    for k in range(len(S)):
        if (x := S[i][k]) is not None and (x.re or x.im):
            total = total + x * right[k][j]
        if (x := S[k][j]) is not None and (x.re or x.im):
            total = total - left[i][k] * x
    parts = formula([total.re, total.im])
    if not parts.inputs and all(constant(y).fraction == 0 for y in (total.re, total.im)):
        return True
    field = Field(parts)
    return all(field.is_zero(x) for x in fold(parts, field.inputs, field.kind))


def _fraction_pair(x: complex) -> Pair | None:
    """A number as a pair of fractions with small denominators; None if it is not near one."""
    parts = [Fraction(y).limit_denominator(_MAX_DENOMINATOR) for y in (x.real, x.imag)]
    if any(abs(float(f) - y) > _ROUNDING for f, y in zip(parts, (x.real, x.imag), strict=True)):
        return None
    return Pair(*parts)
