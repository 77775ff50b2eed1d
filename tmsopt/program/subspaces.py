"""Writes the abscissa as a variable by an invariant subspace of the rightmost eigenvalues: no polynomial is needed.

The chosen eigenvalues are in blocks of two. With t = s − γ and N = M − γ, a chain x₁ … x_m of vectors obeys

    N x_a = s_a x_(a+1),        N x_(a+1) + β x_(a+1) + (κ/s_a) x_a = s_(a+1) x_(a+2),        Wᵀ x₁ = c

for each block t² + β t + κ with β, κ ≥ 0, and 0 in place of the last vector. So the polynomial Π (t² + β t + κ) of M is
0 on the chain, and no eigenvalue of the block lies to the right of γ. An odd eigenvalue has a block t + δ, δ ≥ 0. For a
complex M, t = s − γ − i ω and the block is t² + β t + κ + τ² + i β τ. The lengths s_a, W and c are constants of a
start. The equations are bilinear, and regular where eigenvalues of one block or of several blocks coincide.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from typing import Any, Protocol

import numpy as np

from tmsopt.algebra.formula import symbol
from tmsopt.models import Values
from tmsopt.models.stated.pairs import Pair, is_zero, pair
from tmsopt.problem.cases import Case
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import matrices_at
from tmsopt.program.lifts import (
    LiftedQuantity,
    ProgramBuilder,
    covered_indices,
    pair_distance,
    pair_roots,
    real_distance,
    step_distance,
)
from tmsopt.program.nlp import NLP, AddedVariable, Contact
from tmsopt.records import AnyNumbers, Array, Complex, Numbers, Table
from tmsopt.roots.chains import linearise, make_cluster, schur_form

_MAX_WHOLE = 12  # up to this degree, all eigenvalues are in the subspace unless sizes are given
_MARGIN = 1e-6  # of the mean size of the chosen eigenvalues: distance of γ from the abscissa at a start
_DEPENDENT = 1e-9  # relative singular value of the vectors of a chain below which they are dependent


@dataclass(frozen=True)
class Spectrum:
    """The eigenvalues of one design, and the invariant subspace of the rightmost ones, in the unit of the NLP.

    Attributes:
        eigenvalues: the chosen ones, in the order of their blocks.
        state_matrix: the linearised matrix.
        basis: orthonormal basis of the subspace as columns; real for a real matrix.
    """

    eigenvalues: Complex
    state_matrix: Complex
    basis: Complex


def find_spectrum(matrices: Complex, is_complex: bool, count: int) -> Spectrum:
    """The rightmost eigenvalues of a matrix polynomial: `count`, or one more to keep a pair together.

    Raises:
        LinAlgError: if the leading matrix is singular, or the matrices are not finite.
    """
    M = linearise(matrices)
    form = schur_form(M, is_complex)
    s = form.eigenvalues[np.lexsort((form.eigenvalues.imag, -form.eigenvalues.real))]
    count = min(count, len(s))
    if not is_complex and count < len(s) and np.isclose(s[count - 1], s[count].conj(), rtol=1e-12) and s[count].imag:
        count += 1
    chosen = np.concatenate(_pair_up(s[:count]) if is_complex else pair_roots(_conjugate_pairs(s[:count])))
    Q = make_cluster(form, chosen).right if count < len(s) else np.eye(len(s), dtype=complex)
    if not is_complex:
        Q = np.linalg.svd(np.hstack([Q.real, Q.imag]))[0][:, :count].astype(complex)
    return Spectrum(chosen, M, Q)


def find_others(matrices: Complex, vectors: Complex) -> Complex:
    """The eigenvalues outside the invariant subspace that rows span, unharmed by multiple eigenvalues inside."""
    U, values, _ = np.linalg.svd(vectors.T)
    complement = U[:, np.sum(values > _DEPENDENT * values[0]) :]
    return np.linalg.eigvals(complement.conj().T @ linearise(matrices) @ complement)


def default_count(degree: int) -> int:
    """The number of eigenvalues in a subspace if none is given."""
    return degree if degree <= _MAX_WHOLE else 2


def find_spectra(
    problem: Posed, design: Numbers, cases: Sequence[Case], unit: float, counts: Iterable[int] = ()
) -> list[Spectrum]:
    """The rightmost eigenvalues of a design in each case that root quantities cover.

    Args:
        cases, unit: those of the NLP.
        counts: numbers of eigenvalues; by default `default_count`.
    """
    every, model = case_matrices(problem, design, cases, unit), problem.model
    counts = counts or [default_count(model.degree)] * len(every)
    return [find_spectrum(P, model.is_complex, count) for P, count in zip(every, counts, strict=True)]


def case_matrices(problem: Posed, design: Numbers, cases: Sequence[Case], unit: float) -> list[Complex]:
    """The matrices of a design in each case that root quantities cover, for s in a unit."""
    model, parameter_set, nominal = problem.model, problem.parameter_set, problem.ordered(design)
    every = [matrices_at(model, parameter_set, case.applied(nominal)) for case in covered_cases(cases)]
    return [P / unit ** np.arange(len(P))[:, None, None] for P in every]


def covered_cases(cases: Sequence[Case]) -> list[Case]:
    """The cases that root quantities cover: those of scenarios and tolerances, or the nominal one."""
    return [case for case in cases if not case.direction] or [Case()]


def _conjugate_pairs(s: Complex) -> Complex:
    """The upper eigenvalue of each pair, followed by its conjugate, then the real eigenvalues."""
    upper = s[s.imag > 0]
    return np.concatenate([np.stack([upper, upper.conj()], axis=1).ravel(), s[s.imag == 0]])


def _pair_up(s: Complex) -> list[Complex]:
    """Pairs of eigenvalues, the nearest ones first; an odd one comes last."""
    rest, pairs = list(s), list[Complex]()
    while len(rest) > 1:
        a, b = min(combinations(range(len(rest)), 2), key=lambda k: abs(rest[k[0]] - rest[k[1]]))
        pairs.append(np.array([rest.pop(b), rest.pop(a)]))
    return [*pairs, *([np.array(rest)] if rest else [])]


class MatrixBuilder(ProgramBuilder, Protocol):
    """An NLP under construction, with its problem and the numbers that its formula takes as parameters."""

    problem: Posed
    values: list[Values]
    numbers: Mapping[str, float]


def lift_by_subspaces(counts: Sequence[int], build: MatrixBuilder) -> LiftedQuantity:
    """The abscissa as a variable γ, with an invariant subspace of the rightmost eigenvalues in every case.

    Args:
        counts: the number of eigenvalues in each subspace; by default `default_count`.
    """
    first_index, contacts = build.size[0], list[Contact]()
    gamma, default = build.add_variable("abscissa"), default_count(build.problem.model.degree)
    for case, count in zip(build.covered_cases, counts or [default] * len(build.covered_cases), strict=True):
        contacts += _add_chain(build, gamma, case, count)
    lift = AddedVariable("abscissa", build.size[0] - first_index, lambda values, z: [])
    return LiftedQuantity(build.scale.unit * gamma, lift, tuple(contacts), ())


def _add_chain(build: MatrixBuilder, gamma: Any, case: int, count: int) -> list[Contact]:
    """Add the blocks and the chain of one case; return the ways to put an eigenvalue on the line Re s = γ."""
    *_, parameters = build.values[case].given
    E, A = _descriptor(build, parameters)
    is_complex, size, name = build.problem.model.is_complex, len(A), f"subspace.{case}"
    parts = ("re", "im") if is_complex else ("re",)

    def constants(kind: str, number: int) -> list[Any]:
        """Numbers of a start; the formula is the same for all starts, so it is compiled once."""
        names = [f"{name}.{kind}.{k}" for k in range(number)]
        build.numbers = {**build.numbers, **dict.fromkeys(names, 1.0)}
        return [symbol(n) for n in names]

    def equate(left: Sequence[Pair]) -> None:
        for entry in left:
            for part in parts:
                build.add_row("abscissa", getattr(entry, part), 0.0, 0.0)

    blocks, contacts = list[list[Any]](), list[Contact]()
    for k in range(1, (count + 1) // 2 + 1):
        index, is_pair = build.size[0], 2 * k <= count
        signs = [
            build.add_variable(f"{letter}{k}.{case}", 0.0) for letter in (("beta", "kappa") if is_pair else ("delta",))
        ]
        letters = (("omega", "tau") if is_pair else ("omega",)) if is_complex else ()
        blocks.append([*signs, *(build.add_variable(f"{letter}{k}.{case}") for letter in letters)])
        distances = enumerate((pair_distance, real_distance) if is_pair else (step_distance,))
        contacts += [Contact(partial(distance, index), variable=index + j) for j, distance in distances]
    vectors = [[Pair(*(build.add_variable(name) for _ in parts)) for _ in range(size)] for _ in range(count)]
    lengths = constants("length", count)
    left, right = ([_multiply(matrix, x) for x in vectors] for matrix in (A, E))
    right.append(np.array([Pair(0)] * size, dtype=object))
    for k, block in enumerate(blocks):
        a, is_pair = 2 * k, 2 * k + 1 < count
        centre = Pair(gamma, block[2 if is_pair else 1] if is_complex else 0)
        first = left[a] - right[a] * centre
        if not is_pair:
            equate(first + right[a] * pair(block[0]))
            continue
        beta, kappa, tau = block[0], block[1], block[3] if is_complex else 0
        last = Pair(kappa + tau * tau, beta * tau if is_complex else 0)
        second = left[a + 1] - right[a + 1] * centre
        equate(first - right[a + 1] * pair(lengths[a]))
        equate(
            second + right[a + 1] * pair(beta) + right[a] * (last / lengths[a]) - right[a + 2] * pair(lengths[a + 1])
        )
    for k in range(count):
        weights = constants(f"weight{k}", size * len(parts))
        duals = map(Pair, weights[:size], [-x for x in weights[size:]] or [0] * size)
        equate([sum((x * w for x, w in zip(vectors[0], duals, strict=True)), Pair(-1))])
    return contacts


def _multiply(matrix: Sequence[Sequence[Pair]], vector: Sequence[Pair]) -> Any:
    """The product of a matrix and a vector, without terms that are 0."""
    rows = ([y * x for y, x in zip(row, vector, strict=True) if not is_zero(y)] for row in matrix)
    return np.array([sum(terms, Pair(0)) for terms in rows], dtype=object)


def _descriptor(build: MatrixBuilder, parameters: AnyNumbers) -> tuple[list[list[Pair]], list[list[Pair]]]:
    """E and A of E x′ = A x with the eigenvalues of the matrices, in the unit of the NLP."""
    model, parameter_set = build.problem.model, build.problem.parameter_set
    assert model.pencil is not None
    leading, *others = model.pencil(parameter_set.native(parameters))
    n, d, unit = len(leading), len(others), build.scale.unit
    E = [[Pair(int(i == j)) for j in range(n * d)] for i in range(n * d)]
    A = [[Pair(int(j == i + n)) for j in range(n * d)] for i in range(n * d)]
    for i in range(n):
        E[n * (d - 1) + i][n * (d - 1) :] = map(pair, leading[i])
        A[n * (d - 1) + i] = [-pair(x) / unit ** (k + 1) for k in range(d)[::-1] for x in others[k][i]]
    return E, A


def start_subspaces(nlp: NLP, problem: Posed, spectra: Sequence[Spectrum]) -> NLP:
    """The NLP with the constants and the starting values of a start.

    Args:
        spectra: for each case that the root quantities cover.
    """
    is_complex, chosen = problem.model.is_complex, np.concatenate([one.eigenvalues for one in spectra])
    right, size = float(chosen.real.max()), float(np.abs(chosen - chosen.mean() * is_complex).mean())
    gamma = right + _MARGIN * (size or 1.0)
    numbers, guess = dict(nlp.numbers), [gamma]
    for case, one in zip(covered_indices(nlp.cases), spectra, strict=True):
        values, lengths, vectors = _make_chain(one, gamma, is_complex)
        guess += [*values, *_parts(vectors, is_complex)]
        name = f"subspace.{case}"
        numbers |= {f"{name}.length.{k}": float(x) for k, x in enumerate(lengths)}
        for k, column in enumerate(one.basis.T):
            weights = [*column.real, *(column.imag if is_complex else ())]
            numbers |= {f"{name}.weight{k}.{j}": float(x) for j, x in enumerate(weights)}
    lifts = (replace(lift, guess=lambda v, z: [guess]) if lift.name == "abscissa" else lift for lift in nlp.lifts)
    return replace(nlp, numbers=Table(numbers), lifts=tuple(lifts))


def _parts(vectors: Complex, is_complex: bool) -> list[float]:
    parts = (vectors.real, vectors.imag) if is_complex else (vectors.real,)
    return np.stack(parts, axis=-1).ravel().tolist()


def _make_chain(spectrum: Spectrum, gamma: float, is_complex: bool) -> tuple[list[float], Array, Complex]:
    """The values of the blocks, the lengths of the vectors before they become 1, and the vectors as rows."""
    M, t, values = spectrum.state_matrix, spectrum.eigenvalues - gamma, list[float]()
    x, count = spectrum.basis.sum(axis=1), len(spectrum.eigenvalues)
    vectors, lengths = [x], list[float]()
    for a in range(0, count, 2):
        pair = t[a : a + 2]
        omega = float(pair.imag.mean()) if is_complex else 0.0
        z = pair - 1j * omega
        beta = max(-float(z.sum().real), 0.0)
        N = M - (gamma + 1j * omega) * np.eye(len(M))
        if len(pair) == 1:
            values += [beta, omega] if is_complex else [beta]
            lengths.append(1.0)
            break
        product = complex(z[0] * z[1])
        tau = product.imag / beta if is_complex and beta > 0 else 0.0
        kappa = max(product.real - tau * tau, 0.0)
        values += [beta, kappa, omega, tau] if is_complex else [beta, kappa]
        y = N @ x
        lengths.append(float(np.linalg.norm(y)) or 1.0)
        y = y / lengths[-1]
        vectors.append(y)
        x = N @ y + beta * y + (kappa + tau * tau + 1j * beta * tau) / lengths[-1] * vectors[-2]
        lengths.append((float(np.linalg.norm(x)) or 1.0) if a + 2 < count else 1.0)
        x = x / lengths[-1]
        if a + 2 < count:
            vectors.append(x)
    return values, np.array(lengths), np.array(vectors)
