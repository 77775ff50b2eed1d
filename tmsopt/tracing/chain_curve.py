"""Curves of exceptional points by the equations of their Jordan chains, for systems without a real polynomial.

The variables are the free parameters, in widths of their ranges, and the multiple eigenvalues, in units of their
typical size. Equations that hold by a symmetry follow from the others and do no harm.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations

import casadi as ca
import numpy as np

from tmsopt.chains import Family, Target, family_of, find_point, is_crossing, nearest_crossing, raise_order, targets_of
from tmsopt.chains.points import chain_equations, project_on_axis, refine
from tmsopt.errors import input_error
from tmsopt.models import Values
from tmsopt.models.model import ROOTS
from tmsopt.problem.problem import Posed
from tmsopt.problem.symmetry import count_by_symmetry
from tmsopt.records import Array, Complex, Truth
from tmsopt.roots import Pattern
from tmsopt.roots.chains import MIN_SECOND_VALUE, eigenvalues_of, find_borders, make_chain, merged_eigenvalues, size_at
from tmsopt.tracing.continuation import Curve, make_curve
from tmsopt.tracing.solving import project_rows

_ROUNDING = 1e-13  # of an eigenvalue, as a share of their typical size
_LOW = 0.1  # a minimum below this share of the median along the curve may be 0 nearby
_ZERO_MEDIAN = 1e-9  # a function with a smaller median is 0 along the whole curve
_REACH = 0.02  # largest distance of a special point from the point of the curve next to it, in units of the scale


@dataclass(frozen=True, eq=False)
class ChainSetup:
    """All that is needed to trace one pattern of a problem by Jordan chains.

    Attributes:
        pattern: the pattern, without factors; its unknowns are the multiple eigenvalues.
        centres: for each target, the number from which its eigenvalue is measured.
        unit: unit of the eigenvalues on the curve.
    """

    problem: Posed
    pattern: Pattern
    curve: Curve
    family: Family
    targets: tuple[Target, ...]
    centres: tuple[complex, ...]
    unit: float

    def split(self, y: Array) -> tuple[Array, list[complex]]:
        """The parameters and the multiple eigenvalues of a point."""
        count = len(self.family.names)
        parts, roots = iter(y[count:].tolist()), []
        for target, centre in zip(self.targets, self.centres, strict=True):
            roots.append(centre + self.unit * sum((d * next(parts) for d in target.directions), 0j))
        return y[:count] * self.family.widths, roots

    def join(self, p: Array, roots: Sequence[complex]) -> Array:
        """The point with these parameters and multiple eigenvalues."""
        table = zip(roots, self.targets, self.centres, strict=True)
        parts = [((s - centre) / d).real / self.unit for s, target, centre in table for d in target.directions]
        return np.array([*(p / self.family.widths), *parts])

    def multiple_roots(self, y: Array) -> Complex:
        """The multiple eigenvalues of many points, shape (points, targets)."""
        roots = np.array([self.split(point)[1] for point in y], dtype=complex).reshape(len(y), len(self.targets))
        return self._remove_rounding(roots)

    def _remove_rounding(self, roots: Complex) -> Complex:
        """The roots, where real parts at rounding are 0."""
        return np.where(np.abs(roots.real) <= _ROUNDING * self.unit, 1j * roots.imag, roots)

    def unknowns(self, y: Array) -> list[Array]:
        """The unknowns of the pattern at many points."""
        pairs = zip(self.multiple_roots(y).T, self.targets, strict=True)
        return [x for s, target in pairs for x in _name_parts(s, target, self.family.is_complex).values()]

    def spectrum(self, y: Array) -> tuple[Complex, Truth]:
        """All eigenvalues of many points, and which of them the pattern places on the imaginary axis.

        The multiple eigenvalues are exact.
        """
        conjugates = [not self.family.is_complex and t.axis in ("complex", "imaginary") for t in self.targets]
        rows, multiple_roots = list[Complex](), self.multiple_roots(y)
        counts = [t.order * (1 + both) for t, both in zip(self.targets, conjugates, strict=True)]
        for point, roots in zip(y, multiple_roots, strict=True):
            others = _eigenvalues_at(self, point.tobytes())
            row = list[complex]()
            for s, target, both in zip(roots.tolist(), self.targets, conjugates, strict=True):
                for z in (s, s.conjugate()) if both else (s,):
                    row += [z] * target.order
                    others = np.delete(others, np.argsort(np.abs(others - z), kind="stable")[: target.order])
            rows.append(np.array([*row, *others]))
        table = self._remove_rounding(np.array(rows))
        is_fixed = np.repeat([t.axis in ("imaginary", "zero") for t in self.targets], counts)
        return table, np.append(is_fixed, np.zeros(table.shape[1] - len(is_fixed), dtype=bool))

    def measure(self, y: Array) -> Array:
        """Sizes at many points, one column each.

        The first is that of the equations, the next ones are those of the next equation of each chain, which is 0 where
        the order is higher. The last one, with a unit, is the second smallest singular value, which is 0 where there
        are several eigenvectors.
        """
        return np.array([_measure_point(self, point.tobytes()) for point in y]).reshape(len(y), len(self.targets) + 2)

    def find_point(self, design: Mapping[str, float], rng: np.random.Generator | None) -> Array | None:
        """A point of the curve near a design, perhaps outside the limits; None if the search fails."""
        start = np.array([float(design[n]) for n in self.family.names])
        found = find_point(self.family, self.targets, start, rng, is_nearest=False)
        if found is None or not found.is_found or found.has_higher_order:
            return None
        y = self.join(found.p, found.roots)
        if any(c.equality for c in self.problem.conditions.values()):
            (y,) = project_rows(self.curve.evaluate, y[None], [None])
        return y if np.isfinite(y).all() else None

    def special_points(self, y: Array) -> Iterator[tuple[str, Array]]:
        """Names and exact points of higher orders, and of several eigenvectors, near points along the curve."""
        sizes, roots, same = self.measure(y), self.multiple_roots(y), list(range(len(self.targets)))
        variants = list[tuple[Array, list[Target], list[int]]]()
        for k, target in enumerate(self.targets):
            higher = replace(target, order=target.order + 1)
            variants.append((sizes[:, k + 1], [*self.targets[:k], higher, *self.targets[k + 1 :]], same))
        for j, k in combinations(same, 2):
            if self.targets[j].axis == self.targets[k].axis:
                merged = replace(self.targets[j], order=self.targets[j].order + self.targets[k].order)
                others = [i for i in same if i not in (j, k)]
                places = [others.index(i) + 1 if i in others else 0 for i in same]
                distances = np.abs(roots[:, j] - roots[:, k]) / self.unit
                variants.append((distances, [merged, *(self.targets[i] for i in others)], places))
        for heights, targets, places in variants:
            for row in _find_minima(heights):
                starts = [complex(roots[row, places.index(i)]) for i in range(len(targets))]
                k = next(k for k, t in enumerate(targets) if t not in self.targets)
                with suppress(np.linalg.LinAlgError):
                    found = refine(self.family, targets, self.split(y[row])[0], starts)
                    point = self.join(found.p, [found.roots[i] for i in places])
                    if found.is_found and np.abs(point - y[row]).max() <= _REACH:
                        met, found = raise_order(self.family, targets, k, found)
                        point = self.join(found.p, [found.roots[i] for i in places])
                        yield name_target(met[k], self.family.is_complex), point
        for row in _find_minima(sizes[:, -1]):
            p, s = self.split(y[row])
            design = self.problem.ordered(dict(zip(self.family.names, p.tolist(), strict=True)))
            crossing = nearest_crossing(self.problem, self.pattern, design, _REACH)
            if is_crossing(self.problem, self.pattern, crossing):
                yield "crossing", self.join(np.array([crossing[n] for n in self.family.names]), s)


@lru_cache(maxsize=2**14)
def _eigenvalues_at(setup: ChainSetup, data: bytes) -> Complex:
    try:
        return merged_eigenvalues(setup.family.matrices(setup.split(np.frombuffer(data))[0]))
    except np.linalg.LinAlgError:
        return np.full(setup.problem.model.degree, np.nan, dtype=complex)


@lru_cache(maxsize=2**14)
def _measure_point(setup: ChainSetup, data: bytes) -> tuple[float, ...]:
    p, roots = setup.split(np.frombuffer(data))
    sizes = list[tuple[float, float, float]]()
    try:
        matrices = setup.family.matrices(p)
        for s, target in zip(roots, setup.targets, strict=True):
            size = size_at(matrices, s)
            borders, value, second_value = find_borders(matrices, s)
            typical_size = size_at(matrices, setup.unit)
            if second_value <= MIN_SECOND_VALUE * typical_size:  # the bordered matrix is singular
                sizes.append((value / typical_size, 0.0, second_value))
                continue
            chain = make_chain(matrices, s, target.order, borders)
            next_value = float(abs(chain.values[-1])) * chain.unit**target.order / size
            sizes.append((float(np.abs(chain.residuals).max()) / size, next_value, second_value))
    except np.linalg.LinAlgError:
        return (np.nan,) * (len(setup.targets) + 2)
    residuals, next_values, second_values = zip(*sizes, strict=True)
    return max(residuals), *next_values, min(second_values)


def _find_minima(heights: Array) -> list[int]:
    """Rows of a nonnegative function that may be next to its zeros."""
    middle, median = heights[1:-1], np.nanmedian(heights)
    is_minimum = (middle <= heights[:-2]) & (middle <= heights[2:]) & (middle <= _LOW * median)
    return (np.flatnonzero(is_minimum) + 1).tolist() if median > _ZERO_MEDIAN else []


def name_target(target: Target, is_complex: bool = False) -> str:
    """The pattern of a multiple eigenvalue."""
    if target.axis == "zero":
        return "double zero" if target.order == 2 else f"{target.order}-fold zero"
    if target.axis == "imaginary" and target.order == 2:
        return "resonance"
    return f"{'' if target.is_real(is_complex) or is_complex else 'C'}EP{target.order}"


def _name_parts(s: Complex, target: Target, is_complex: bool) -> dict[str, Array]:
    """The numbers that state an eigenvalue: ω = i s of a complex system; r, the square W, or b and c of a real one."""
    if target.axis == "zero":
        return {}
    if is_complex:
        parts = {"omega_re": -s.imag, "omega_im": s.real}
        return parts if target.axis == "complex" else {"omega_re": -s.imag}
    if target.axis == "imaginary":
        return {"W": s.imag**2}
    return {"r": s.real} if target.axis == "real" else {"b": -2 * s.real, "c": np.abs(s) ** 2}


def has_chain_curve(problem: Posed) -> bool:
    """Whether the pattern of a problem is traced by Jordan chains."""
    return problem.model.polynomial is None or count_by_symmetry(problem) > 0


def prepare_chains(problem: Posed, pattern: Pattern) -> ChainSetup:
    """The equations of the chains of a pattern, and the equality constraints, as a curve.

    Raises:
        InputError: for an equality constraint on a quantity of the roots.
    """
    family, targets = family_of(problem), targets_of(pattern.name, problem.model.is_complex)
    middle = eigenvalues_of(family.matrices(family.box.mean(axis=1))).mean() if family.is_complex else 0.0
    centres = tuple(project_on_axis(complex(middle), t) for t in targets)
    unit, count = family.typical_size or 1.0, len(family.names)
    equalities = [c for c in problem.conditions.values() if c.equality]
    if any(set(ROOTS) & set(c.names) for c in equalities):
        raise input_error(
            f"cannot trace {pattern.name} under an equality constraint on a root quantity; remove it", "constraints"
        )
    p = ca.SX.sym("p", count)
    values = Values(
        problem.model, problem.parameter_set, problem.ordered(dict(zip(problem.free, ca.vertsplit(p), strict=True)))
    )
    sides = ca.densify(ca.vertcat(ca.SX(0, 1), *(c(values) for c in equalities)))
    limits = ca.Function("limits", [p], [sides, ca.densify(ca.jacobian(sides, p))])

    def evaluate(y: Array) -> tuple[Array, Array]:
        p, roots = setup.split(y)
        matrices = family.matrices(p)
        equations = chain_equations(family, targets, p, roots, [find_borders(matrices, s)[0] for s in roots])
        value, jacobian = (
            equations.residual,
            np.hstack([equations.slopes * family.widths, equations.root_slopes * unit]),
        )
        if not equalities:
            return value, jacobian
        side, slopes = (part.full() for part in limits(p.tolist()))
        slopes = np.hstack([slopes * family.widths, np.zeros((len(slopes), len(y) - count))])
        return np.append(value, side), np.vstack([jacobian, slopes])

    root_count = sum(len(t.directions) for t in targets)
    unbounded = np.full(root_count, np.inf)
    equation_count = len(equalities) + sum(t.conditions(family.is_complex) + len(t.directions) for t in targets)
    low, high = (family.box / family.widths[:, None]).T
    scale = np.append(family.widths, np.full(root_count, unit))
    lower, upper = np.append(low, -unbounded), np.append(high, unbounded)
    curve = make_curve(evaluate, equation_count, scale, lower, upper)
    names = tuple(
        f"{n}{k}" if k > 1 else n
        for k, t in enumerate(targets, start=1)
        for n in _name_parts(np.zeros(1, dtype=complex), t, family.is_complex)
    )
    bare = replace(
        pattern, unknowns=names, factors=lambda u: [], rest=None, test=None, marks={}, ends={}, real_name=pattern.form
    )
    setup = ChainSetup(problem, bare, curve, family, targets, centres, unit)
    return setup
