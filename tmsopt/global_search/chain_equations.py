"""The equations of Jordan chains in ball arithmetic, for a pattern of a system of matrices.

See `tmsopt.roots.chains`: F₀ … F₍ₖ₋₁₎ are 0, where F is the power series of a bordered matrix with constant borders.

If the characteristic polynomial is real on a line of eigenvalues because of a symmetry, F is real there up to a factor
−1/det B. Then one part of each F_j is enough, if that part of the factor is not 0, and the eigenvalue has one unknown.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

import flint
import numpy as np

from tmsopt.algebra.balls import complex_ball
from tmsopt.algebra.krawczyk import Enclosure, ProofFailed, enclose_solution, refine_solution
from tmsopt.chains.family import family_of
from tmsopt.chains.points import ExceptionalPoint, Target, measure_point, targets_of
from tmsopt.models.expression import Expression
from tmsopt.problem.problem import Posed
from tmsopt.problem.symmetry import NONE, Symmetry, count_by_symmetry, find_symmetry
from tmsopt.program.nlp import proof_units, scale_of, unit_near
from tmsopt.records import Complex, Numbers
from tmsopt.roots import Pattern, composition
from tmsopt.roots.chains import Chain, expand

MAX_PROVED_SIZE = 40
"""Largest number of roots of a system whose points are proved in a search; a larger one takes seconds for each."""

_ON_AXIS = 1e-9  # relative distance of an eigenvalue from the axis of a symmetry
_PROOF_DIGITS = 40  # decimal digits of a proved point
_GUARD_DIGITS = 20


@dataclass(frozen=True, eq=False)
class ChainEquations:
    """The equations of the chains of a pattern; a call computes their left sides.

    The arguments have the names of parameters, and of the real and imaginary parts of the multiple eigenvalues.

    Attributes:
        targets: the multiple eigenvalues.
        roots: these eigenvalues in doubles.
        borders: b and c of each target, as columns.
        units: name → its unit.
        sizes: size of the terms of each F_j of each target, for their rounding.
        symmetry: the symmetry that reduces the equations.
        phases: with a real polynomial, the phase of −1/det B at each eigenvalue; else empty.
    """

    problem: Posed
    pattern: Pattern
    targets: tuple[Target, ...]
    roots: tuple[complex, ...]
    borders: tuple[tuple[Any, Any], ...]
    units: Mapping[str, float]
    sizes: tuple[tuple[float, ...], ...] = ()
    symmetry: Symmetry = NONE
    phases: tuple[complex, ...] = ()
    equalities: tuple[Expression, ...] = ()
    lifted: tuple[Any, ...] = ()

    @property
    def is_complex(self) -> bool:
        """Whether the matrices are complex."""
        return self.problem.model.is_complex

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the parts of the eigenvalues."""
        return tuple(name for names in self.parts for name in names)

    pattern_unknowns = unknowns

    @property
    def parts(self) -> list[tuple[str, ...]]:
        """For each target, the names of the parts of its eigenvalue that are unknown."""
        names = ({1: "re", 1j: "im"}[d] for t in self.targets for d in t.directions)
        return [tuple(f"s{k}.{next(names)}" for _ in t.directions) for k, t in enumerate(self.targets, start=1)]

    @property
    def condition_count(self) -> int:
        """Number of conditions on the parameters."""
        if self.symmetry == NONE:
            return sum(t.conditions(self.is_complex) for t in self.targets)
        size = self.problem.model.degree
        return sum(self.symmetry.independent_conditions(t.order, size) for t in self.targets)

    def start_values(self) -> Iterator[dict[str, Any]]:
        """Start values of the unknowns."""
        values = [x for s, t in zip(self.roots, self.targets, strict=True) for x in self._select(s, t)]
        yield dict(zip(self.unknowns, map(flint.arb, values), strict=True))

    @staticmethod
    def _select(s: complex, target: Target) -> list[float]:
        return [s.real if d == 1 else s.imag for d in target.directions]

    def eigenvalues(self, point: Mapping[str, Any]) -> list[Any]:
        """The multiple eigenvalues at a point, as complex balls."""
        mean = self._mean(self._evaluate(point)) if self._is_relative else 0
        return [s + mean for s in self._relative_eigenvalues(point)]

    @property
    def _is_relative(self) -> bool:
        """Whether the unknown eigenvalues are distances from the mean, on which the symmetry acts."""
        return self.symmetry != NONE and self.is_complex

    def _relative_eigenvalues(self, point: Mapping[str, Any]) -> list[Any]:
        zero, unit = flint.acb(0), {1: flint.acb(1), 1j: flint.acb(0, 1)}
        return [
            sum((unit[d] * point[n] for d, n in zip(t.directions, names, strict=True)), zero)
            for t, names in zip(self.targets, self.parts, strict=True)
        ]

    def __call__(self, point: Mapping[str, Any]) -> list[Any]:
        """Compute the left sides."""
        matrices = self._matrices(point)
        series = self._series(matrices, point)
        return [x for k, one in enumerate(series) for x in self._parts(k, one.values[:-1])]

    def _series(self, matrices: Sequence[Any], point: Mapping[str, Any]) -> list["_Series"]:
        chains = zip(self._relative_eigenvalues(point), self.targets, self.borders, strict=True)
        return [_Series(matrices, s, target.order, b, c) for s, target, (b, c) in chains]

    def _parts(self, target: int, values: Sequence[Any]) -> list[Any]:
        """The real equations of complex values F₀ … F₍ₖ₋₁₎ of one target."""
        used = [(j, values[j]) for j in self._value_indices(target)]
        if self.phases:  # a distance t along the imaginary axis is i times a real number
            z = flint.acb(self.phases[target].real, -self.phases[target].imag)
            return [(z * flint.acb(0, 1) ** j * x).real for j, x in used]
        imaginary = [] if self._has_real_equations(target) else [x.imag for _, x in used]
        return [*(x.real for _, x in used), *imaginary]

    def check(self, point: Mapping[str, Any]) -> None:
        """Check that one part of each F_j is enough.

        Raises:
            ProofFailed: if that part of −1/det B may be 0.
        """
        for phase, one in zip(self.phases, self._series(self._matrices(point), point), strict=False):
            if (flint.acb(phase.real, -phase.imag) / one.determinant).real.contains(0):
                raise ProofFailed("the symmetry does not reduce the equations there: a phase may vanish")

    def term_sizes(self) -> list[float]:
        """Size of the terms of each equation; a stored design may miss the equation by a rounding of it."""
        return [
            sizes[j]
            for k, sizes in enumerate(self.sizes)
            for _ in range(1 if self._has_real_equations(k) else 2)
            for j in self._value_indices(k)
        ]

    def _has_real_equations(self, target: int) -> bool:
        return bool(self.phases) or self.targets[target].is_real(self.is_complex)

    def _value_indices(self, target: int) -> range:
        """The j of the F_j that are not 0 by symmetry: about 0, every second one if the eigenvalues are symmetric."""
        order, is_centred = self.targets[target].order, self.targets[target].axis == "zero" and self.is_complex
        return range(order % 2, order, 2) if is_centred else range(order)

    def jacobian(self, point: Mapping[str, Any], names: Sequence[str]) -> Any:
        """Derivatives of the left sides, with one column for each of `names`."""
        series, columns = self._series(self._matrices(point), point), []
        for name in names:
            column = list[Any]()
            changes = None if name in self.unknowns else self._slopes(point, name)
            for k, (one, target, parts) in enumerate(zip(series, self.targets, self.parts, strict=True)):
                if changes is not None:
                    values = one.respond(changes)
                else:
                    directions = dict(zip(parts, target.directions, strict=True))
                    factor = flint.acb(directions[name]) if name in parts else flint.acb(0)
                    values = [factor * (j + 1) * x for j, x in enumerate(one.values[1:])]
                column += self._parts(k, values)
            columns.append(column)
        return flint.arb_mat([list(row) for row in zip(*columns, strict=True)])

    def _matrices(self, point: Mapping[str, Any]) -> list[Any]:
        return [
            flint.acb_mat([[flint.acb(x) for x in row] for row in P]) for P in self._relative(self._evaluate(point))
        ]

    def _slopes(self, point: Mapping[str, Any], name: str) -> list[Any] | None:
        """Derivatives of the matrices with respect to a parameter."""
        series = self._relative(self._evaluate({**point, name: flint.arb_series([point[name], 1], prec=2)}))
        return [
            flint.acb_mat([[complex_ball(x)[1] if hasattr(x, "prec") else flint.acb(0) for x in row] for row in P])
            for P in series
        ]

    def _evaluate(self, point: Mapping[str, Any]) -> Any:
        problem = self.problem
        assert problem.model.pencil is not None
        return problem.model.pencil(problem.parameter_set.native({n: point[n] for n in problem.parameter_set.names}))

    @staticmethod
    def _mean(matrices: Sequence[Any]) -> Any:
        """The mean eigenvalue of 1 s + P₁."""
        last = matrices[-1]
        return -sum((last[k][k] for k in range(1, len(last))), last[0][0]) / len(last)

    def _relative(self, matrices: Sequence[Any]) -> Sequence[Any]:
        """The matrices for eigenvalues relative to their mean, if a symmetry acts on these."""
        if not self._is_relative:
            return matrices
        first, last = matrices
        mean = self._mean(matrices)
        return first, [[x + mean if i == j else x for j, x in enumerate(row)] for i, row in enumerate(last)]


def has_chain_proof(problem: Posed, name: str) -> bool:
    """Whether the equations of chains prove a pattern of a problem: its model is stated by matrices."""
    model = problem.model
    if model.statement is None or model.pencil is None or any(c.equality for c in problem.conditions.values()):
        return False
    try:
        composition(name)
    except ValueError:  # a structure with simple roots on one line
        return False
    return True


def build_chain_equations(
    problem: Posed, pattern: Pattern, parameters: Numbers, uses_symmetry: bool = True
) -> ChainEquations:
    """Build the equations of the chains of a pattern, near a stored design.

    Args:
        uses_symmetry: whether the fixed parameters have exactly the values of the problem, whose symmetry is known.

    Raises:
        ProofFailed: if the design has no such chains.
    """
    model = problem.model
    targets, family = targets_of(pattern.name, model.is_complex), family_of(problem, parameters)
    point = measure_point(family, targets, np.array([parameters[n] for n in problem.free]))
    if point is None or not point.is_defective:
        raise ProofFailed(f"no Jordan chains of {pattern.name} near the design: eigenvalues have several eigenvectors")
    borders = tuple(tuple(map(_column, chain.borders)) for chain in point.chains)
    is_as_posed = uses_symmetry and all(parameters[n] == x for n, x in problem.fixed.items())
    symmetry = _usable_symmetry(problem, point, family.typical_size) if is_as_posed else NONE
    phases = tuple[complex, ...]()
    roots = point.roots
    if symmetry != NONE:
        roots = tuple(
            s - _mean_eigenvalue(chain, model.is_complex) for s, chain in zip(roots, point.chains, strict=True)
        )
        is_centred = symmetry.is_chiral and targets[0].order == model.degree
        targets = tuple(replace(t, axis="zero" if is_centred else "imaginary") for t in targets)
        if symmetry.is_real:
            ends = (1j**chain.order * chain.values[-1] for chain in point.chains)
            phases = tuple(complex(z / abs(z)) for z in ends)
    sizes = tuple(chain.term_sizes(family.matrices(point.p)) for chain in point.chains)
    unit = unit_near(scale_of(problem).unit)
    system = ChainEquations(problem, pattern, targets, roots, borders, proof_units(problem), sizes, symmetry, phases)
    return replace(system, units={**system.units, **dict.fromkeys(system.unknowns, unit)})


def _usable_symmetry(problem: Posed, point: ExceptionalPoint, size: float) -> Symmetry:
    """The symmetry of a problem, if it reduces the equations of a point: its eigenvalues lie on the line of symmetry.

    Args:
        size: typical size of the eigenvalues.
    """
    symmetry = find_symmetry(problem) if count_by_symmetry(problem) else NONE
    distances = (chain.s - _mean_eigenvalue(chain, problem.model.is_complex) for chain in point.chains)
    is_off = symmetry.is_real and any(abs(s.real) > _ON_AXIS * (abs(s) + size) for s in distances)
    return NONE if is_off else symmetry


def _mean_eigenvalue(chain: Chain, is_complex: bool) -> complex:
    """The mean eigenvalue of a complex matrix, 0 for a real system."""
    return complex(chain.s - np.trace(chain.terms[0]) / len(chain.terms[0])) if is_complex else 0j


def _column(vector: Complex) -> Any:
    return flint.acb_mat([[flint.acb(z.real, z.imag)] for z in vector.tolist()])


class _Series:
    """The power series of the bordered matrix at s, as `tmsopt.roots.chains.Chain` in balls.

    Raises:
        ProofFailed: if the bordered matrix may be singular.
    """

    def __init__(self, matrices: Sequence[Any], s: Any, order: int, b: Any, c: Any) -> None:
        terms = expand(matrices, s, order + 1)
        n = terms[0].nrows()
        rows = [[*row, b[i, 0]] for i, row in enumerate(terms[0].tolist())]
        bordered = flint.acb_mat([*rows, [*(c[i, 0].conjugate() for i in range(n)), 0]])
        try:
            inverse = bordered.inv()
        except ZeroDivisionError:
            raise ProofFailed("an eigenvalue may have several eigenvectors: the bordered matrix is singular") from None
        self.s, self.order, self._bordered = s, order, bordered
        right = _solve(inverse, terms, order + 1)
        left = _solve(inverse.transpose(), [D.transpose() for D in terms], order)
        self.values = [x[n, 0] for x in right]
        self._right = [_head(x, n) for x in right[:-1]]
        self._left = [_head(y, n).transpose() for y in left]

    @property
    def determinant(self) -> Any:
        """det B."""
        return self._bordered.det()

    def respond(self, changes: Sequence[Any]) -> list[Any]:
        """Derivatives of F₀ … F₍ₖ₋₁₎ for a change of the matrices."""
        terms = expand(changes, self.s, self.order)
        totals = [flint.acb(0)] * self.order
        for i, D in enumerate(terms):
            images = [D * x for x in self._right[: self.order - i]]
            for a, y in enumerate(self._left[: self.order - i]):
                for k, image in enumerate(images[: self.order - i - a]):
                    totals[i + a + k] -= (y * image)[0, 0]
        return totals


def _solve(inverse: Any, terms: Sequence[Any], count: int) -> list[Any]:
    n = terms[0].nrows()
    series = [inverse * flint.acb_mat([[int(i == n)] for i in range(n + 1)])]
    for j in range(1, count):
        products = [terms[i] * _head(series[j - i], n) for i in range(1, min(len(terms) - 1, j) + 1)]
        total = reduce(lambda a, b: a + b, products)
        series.append(inverse * flint.acb_mat([*([-x] for x in total.entries()), [0]]))
    return series


def _head(vector: Any, n: int) -> Any:
    return flint.acb_mat([[vector[i, 0]] for i in range(n)])


def prove_point(problem: Posed, parameters: Numbers) -> Enclosure | None:
    """Prove by Krawczyk's test that a point with the located pattern exists near a stored one; None if it fails.

    There must be as many free parameters as conditions. Numbers stand for the shortest decimals that print them.
    """
    assert problem.pattern is not None
    with flint.ctx.workdps(_PROOF_DIGITS + _GUARD_DIGITS):
        exact = {n: flint.arb(x) for n, x in problem.exactly(problem.ordered(parameters)).items()}
        try:
            system = build_chain_equations(problem, problem.pattern, parameters)
            if system.condition_count != len(problem.free):
                return None
            names = [*problem.free, *system.unknowns]
            start = {**exact, **next(system.start_values())}
            middle = refine_solution(system, start, names, _PROOF_DIGITS, system.units)
            enclosure = enclose_solution(system, middle, names, _PROOF_DIGITS, system.units)
            system.check({**exact, **enclosure.balls})
        except ProofFailed:
            return None
    return enclosure
