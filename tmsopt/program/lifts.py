"""Writes root quantities as variables of an NLP, defined by polynomial factors: no root is computed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np

from tmsopt.models import Values
from tmsopt.models.expression import Expression
from tmsopt.problem.cases import Case
from tmsopt.program.nlp import AddedVariable, Contact, Factor, Scale
from tmsopt.records import Array
from tmsopt.roots import product, shift
from tmsopt.roots.patterns.pattern import Roots


class ProgramBuilder(Protocol):
    """An NLP under construction."""

    def add_variable(self, name: str, lower: float = ..., upper: float = ...) -> Any:
        """A new variable."""

    def add_row(self, name: str, expression: Any, lower: float, upper: float) -> None:
        """A new row."""

    def add_equations(self, name: str, left: Sequence[Any], right: Sequence[Any]) -> None:
        """New rows that equate two lists of coefficients."""

    def polynomial(self, case: int) -> list[Any]:
        """Coefficients in one case, in the units of the NLP."""

    @property
    def covered_cases(self) -> Sequence[int]:
        """Indices of the cases over which a root quantity takes its worst value."""

    @property
    def scale(self) -> Scale:
        """The units of the NLP for the roots and for a0."""

    @property
    def a0_sign(self) -> int:
        """Sign of a0 in an NLP whose feasible set includes a0 = 0; 0 otherwise."""

    @property
    def size(self) -> tuple[int, int]:
        """Number of variables and rows so far."""


def covered_indices(cases: Sequence[Case]) -> list[int]:
    """Indices of the cases over which a root quantity takes its worst value; 0 is the nominal one."""
    return [k for k, case in enumerate(cases, start=1) if not case.direction] or [0]


@dataclass(frozen=True)
class LiftedQuantity:
    """A root quantity as a variable.

    Attributes:
        symbol: the quantity, in the units of the problem.
        lift: the variables that define it, and their starting values.
        contacts: the ways in which a root can lie on the edge of the region that the variable bounds.
        products: the factors of each case.
    """

    symbol: Any
    lift: AddedVariable
    contacts: tuple[Contact, ...]
    products: tuple[tuple[Factor, ...], ...]


def _lift_by_factors(
    build: ProgramBuilder,
    name: str,
    bounds: tuple[float, float],
    quadratic: Callable[[Any, int, int, Any], tuple[list[Any], list[Contact]]],
    guess_edge: Callable[[bool, Roots, float], float],
    unit: float = 1.0,
    linear_term: tuple[str, float] = ("d", 0.0),
    value_if_all_real: float | None = None,
    is_shifted: bool = False,
    is_squared: bool = False,
) -> LiftedQuantity:
    """A root quantity as a variable v, with the polynomial of each covered case as a product of quadratic factors.

    If the degree is odd, the product has one linear factor too. The factors are monic, unless the NLP includes a0 = 0:
    then one factor has the leading coefficient ±a0.

    Args:
        name: name of the quantity and of its rows.
        bounds: lower and upper bound of v.
        quadratic: (v, number, case, leading) → coefficients and contacts of a factor; `leading` is ±a0 for the factor
            with this leading coefficient, None for monic factors.
        guess_edge: (is_near, roots, their mean size) → starting value of v, for which the factors are feasible;
            `is_near` tells whether the start is near a solution.
        unit: unit of v.
        linear_term: name and lower bound of the constant term of the linear factor.
        value_if_all_real: the value of v that is possible only if all roots are real.
        is_shifted: whether the polynomials are shifted by v, so that a root of a linear factor may be on the edge.
        is_squared: see `Factor`.
    """
    first_index = build.size[0]
    edge = build.add_variable(name, *bounds)
    contacts: list[Contact] = []
    if value_if_all_real is not None:
        contacts = [Contact(lambda x: value_if_all_real, variable=first_index, value=value_if_all_real)]
    sign, products = build.a0_sign, list[tuple[Factor, ...]]()
    for case in build.covered_cases:
        a, factors, factor_coefficients = build.polynomial(case), list[Factor](), list[list[Any]]()
        quadratic_count, is_odd = divmod(len(a) - 1, 2)
        if sign:
            build.add_row("a0", sign * a[0], 0.0, np.inf)
        for k in range(1, quadratic_count + 1):
            index, leading = build.size[0], sign * a[0] if sign and k == 1 and not is_odd else None
            coefficients, factor_contacts = quadratic(edge, k, case, leading)
            factor_coefficients.append(coefficients)
            if leading is None:
                factors.append(Factor(index, is_squared=is_squared))
            if leading is None or quadratic_count == 1:  # the largest roots are not on the edge
                contacts += factor_contacts
        if is_odd:
            index, (letter, lower) = build.size[0], linear_term
            factor_coefficients.append([sign * a[0] if sign else 1, build.add_variable(f"{letter}.{case}", lower)])
            if not sign:
                factors.append(Factor(index, is_linear=True))
            if is_shifted and (not sign or not quadratic_count):
                contacts.append(Contact(partial(step_distance, index), variable=index))
        matched = [(sign or a[0]) * c for c in product(*factor_coefficients)]
        build.add_equations(name, shift(a, edge) if is_shifted else a, matched)
        products.append(tuple(factors))
    leading_scale = abs(sign) / build.scale.a0_unit
    guesses = (
        partial(
            _guess_factors, build.covered_cases, leading_scale, is_shifted, is_squared, partial(guess_edge, is_near)
        )
        for is_near in (False, True)
    )
    lift = AddedVariable(name, build.size[0] - first_index, *guesses)
    return LiftedQuantity(unit * edge, lift, tuple(contacts), tuple(products))


def lift_abscissa(build: ProgramBuilder) -> LiftedQuantity:
    """γ with p(t + γ) = a0 ∏ (t² + βᵢ t + κᵢ), βᵢ, κᵢ ≥ 0, in every case. So no root is to the right of γ.

    An odd degree adds one factor t + δ, δ ≥ 0. Any β = 0, κ = 0 or δ = 0 puts a root on the line Re s = γ. If the NLP
    includes a0 = 0, the first factor is ±a0 t² + βt + κ, so that a root may go to infinity; for an odd degree the
    linear factor is ±a0 t + δ instead.
    """

    def quadratic(gamma: Any, k: int, case: int, leading: Any) -> tuple[list[Any], list[Contact]]:
        index = build.size[0]
        beta, kappa = build.add_variable(f"beta{k}.{case}", 0.0), build.add_variable(f"kappa{k}.{case}", 0.0)
        distances = (pair_distance, real_distance)
        contacts = [Contact(partial(distance, index), variable=index + j) for j, distance in enumerate(distances)]
        return [1 if leading is None else leading, beta, kappa], contacts

    def guess_edge(is_near: bool, z: Roots, size: float) -> float:
        """γ to the right of the rightmost root; near a solution by at most a tenth of the abscissa."""
        right, step = float(z.real.max()), 0.05 * size
        return right + (min(step, 0.1 * abs(right)) + 1e-6 if is_near else step + 1e-3)

    bounds = (-np.inf, np.inf)
    return _lift_by_factors(
        build, "abscissa", bounds, quadratic, guess_edge, build.scale.unit, ("delta", 0.0), is_shifted=True
    )


def lift_damping_ratio(build: ProgramBuilder) -> LiftedQuantity:
    """ζ with p = a0 ∏ (s² + pᵢ s + wᵢ²), wᵢ ≥ 0, pᵢ ≥ 2 ζ wᵢ, in every case. So no damping ratio is below ζ.

    pᵢ = 2 ζ wᵢ puts a pair on the edge of the sector; ζ = 1 is possible only if all roots are real. An odd degree adds
    one factor s + d, d ≥ 0. If the NLP includes a0 = 0, the first factor is m² s² + p s + w² with m² = ±a0 and
    p ≥ 2 ζ m w; for an odd degree the linear factor is ±a0 s + d instead.
    """

    def quadratic(zeta: Any, k: int, case: int, leading: Any) -> tuple[list[Any], list[Contact]]:
        index = build.size[0]
        p, w, m = build.add_variable(f"p{k}.{case}"), build.add_variable(f"w{k}.{case}", 0.0), 1.0
        if leading is not None:
            m = build.add_variable(f"m.{case}", 0.0)
            build.add_row("damping_ratio", m * m - leading, 0.0, 0.0)
        build.add_row("damping_ratio", p - 2 * zeta * m * w, 0.0, np.inf)
        return [m * m, p, w * w], [Contact(partial(_sector_distance, index), row=build.size[1] - 1)]

    def guess_edge(is_near: bool, z: Roots, size: float) -> float:
        """ζ slightly below the smallest damping ratio."""
        return float(np.clip(np.min(-z.real / (np.abs(z) + 1e-300)) - 0.05, -0.95, 0.95))

    bounds = (-1.0, 1.0)
    return _lift_by_factors(
        build, "damping_ratio", bounds, quadratic, guess_edge, value_if_all_real=1.0, is_squared=True
    )


def lift_angular_frequency(build: ProgramBuilder) -> LiftedQuantity:
    """Ω with p = a0 ∏ (s² + pᵢ s + qᵢ), pᵢ² + 4 Ω² ≥ 4 qᵢ, Ω ≥ 0, in every case. So no |Im s| is above Ω.

    All roots are in the strip |Im s| ≤ Ω. pᵢ² + 4 Ω² = 4 qᵢ puts a pair on the edge of the strip; Ω = 0 is possible
    only if all roots are real. An odd degree adds one factor s + d. If the NLP includes a0 = 0, the first factor is
    m s² + p s + q with m = ±a0 and p² + 4 m² Ω² ≥ 4 m q; for an odd degree the linear factor is m s + d instead.
    """

    def quadratic(omega: Any, k: int, case: int, leading: Any) -> tuple[list[Any], list[Contact]]:
        index = build.size[0]
        p, q = build.add_variable(f"p{k}.{case}"), build.add_variable(f"q{k}.{case}")
        m = 1 if leading is None else leading
        build.add_row("angular_frequency", p * p + 4 * m * m * omega * omega - 4 * m * q, 0.0, np.inf)
        return [m, p, q], [Contact(partial(_strip_distance, index), row=build.size[1] - 1)]

    def guess_edge(is_near: bool, z: Roots, size: float) -> float:
        """Ω slightly above the largest |Im s|."""
        return float(np.abs(z.imag).max()) + (1e-6 if is_near else 0.05 * size + 1e-3)

    bounds, linear_term = (0.0, np.inf), ("d", -np.inf)
    return _lift_by_factors(
        build, "angular_frequency", bounds, quadratic, guess_edge, build.scale.unit, linear_term, value_if_all_real=0.0
    )


def lift_positive_root(build: ProgramBuilder) -> AddedVariable:
    """A real root r ≥ 0, that is, a damping ratio of −1, for a single case: p = a0 (s − r) q(s)."""
    (case,) = build.covered_cases
    a = build.polynomial(case)
    r, *q = build.add_variable("r", 0.0), *(build.add_variable(f"q{k}") for k in range(1, len(a) - 1))
    build.add_equations("damping_ratio", a, [a[0] * c for c in product([1, -r], [1, *q])])
    return AddedVariable("r", len(a) - 1, partial(_guess_positive_root, case))


def lift_real_roots(build: ProgramBuilder, has_abscissa: bool) -> LiftedQuantity:
    """Heavy damping: γ ≤ 0 and roots γ − d₁, γ − d₁ − d₂, …, all dᵢ ≥ 0, in every case.

    `lift_damping_ratio` and `lift_abscissa` together would need twice as many equations. This formulation is regular at
    multiple roots: dᵢ between equal roots are at their bound 0, whereas constraints p² ≥ 4q have dependent gradients.
    d₁ = 0 puts a root on the line Re s = γ.

    Args:
        has_abscissa: whether γ is a variable, the abscissa; otherwise γ = 0.
    """
    cases, first_index = build.covered_cases, build.size[0]
    gamma = build.add_variable("abscissa", upper=0.0) if has_abscissa else 0.0
    contacts: list[Contact] = []
    for case in cases:
        a = build.polynomial(case)
        index = build.size[0]
        steps = [build.add_variable(f"d{k}.{case}", 0.0) for k in range(1, len(a))]
        contacts.append(Contact(partial(step_distance, index), variable=index))
        distances = [sum(steps[:k], 0) for k in range(1, len(a))]
        build.add_equations("abscissa", shift(a, gamma), [a[0] * c for c in product(*([1, d] for d in distances))])
    lift = AddedVariable("abscissa", build.size[0] - first_index, partial(_guess_real_roots, cases, has_abscissa))
    return LiftedQuantity(build.scale.unit * gamma, lift, tuple(contacts), ())


def lift_radius(build: ProgramBuilder, direction_cases: Sequence[int]) -> AddedVariable:
    """Stability at the distance `radius` in the directions of the given cases: p = a0 ∏ (s² + bᵢ s + cᵢ), bᵢ, cᵢ ≥ 0.

    An odd degree adds one factor s + b. a0 has the same sign as in the nominal case.
    """
    size = 0
    for case in direction_cases:
        a = build.polynomial(case)
        factors = [
            [1, build.add_variable(f"b{k}.{case}", 0.0), build.add_variable(f"c{k}.{case}", 0.0)]
            for k in range(1, (len(a) - 1) // 2 + 1)
        ]
        if len(a) % 2 == 0:
            factors.append([1, build.add_variable(f"b.{case}", 0.0)])
        size += len(a) - 1
        build.add_row("radius", a[0] * build.polynomial(0)[0], 0.0, np.inf)
        build.add_equations("radius", a, [a[0] * c for c in product(*factors)])
    return AddedVariable("directions", size, partial(_guess_factors_at_radius, direction_cases))


def lift_quantity(build: ProgramBuilder, name: str, case: int, ends: tuple[float, float]) -> tuple[Any, AddedVariable]:
    """A variable for a derived quantity; the caller adds the equation without division that defines it."""
    symbol = build.add_variable(name if case == 0 else f"{name}.{case}", *ends)
    return symbol, AddedVariable(name, 1, lambda values, z: [[_finite(values[case][name])]])


def guess_worst_value(
    sign: float, expression: Expression, cases: Sequence[int], values: Sequence[Values], z: Sequence[Any]
) -> list[list[float]]:
    """The worst finite value over the cases."""
    case_values = [sign * float(expression(values[k])) for k in cases]
    return [[max((v for v in case_values if np.isfinite(v)), default=0.0)]]


_MAX_DOUBLE_GAP = 1e-3  # two real roots with a smaller distance, relative to the largest root, may be one double root


def pair_distance(index: int, x: Array) -> float:
    """Distance from the line to a complex pair of t² + βt + κ, or to the middle of a real pair."""
    return float(x[index] / 2)


def real_distance(index: int, x: Array) -> float:
    """Distance from the line to the nearer real root; for a complex pair, its distance plus |Im s|."""
    half, kappa = x[index] / 2, x[index + 1]
    offset = float(np.sqrt(abs(half * half - kappa)))
    return float(half + offset if half * half < kappa else kappa / (half + offset or 1.0))


def step_distance(index: int, x: Array) -> float:
    """Distance from the line to the rightmost root."""
    return float(x[index])


def _sector_distance(index: int, x: Array) -> float:
    """Damping ratio of a pair; the pair with the smallest ratio is on the edge."""
    p, w = x[index], x[index + 1]
    return float(p / (2 * w)) if w > 0 else np.inf


def _strip_distance(index: int, x: Array) -> float:
    """−|Im s| of a complex pair, so that the pair with the largest |Im s| is nearest; positive for two real roots."""
    square = x[index] ** 2 / 4 - x[index + 1]
    return float(np.copysign(np.sqrt(abs(square)), square))


def _finite(value: Any) -> float:
    return float(value) if np.isfinite(value) else 1.0


def pair_roots(z: Roots) -> list[Roots]:
    """Roots in pairs: conjugate roots, nearly equal real roots, then neighbouring real roots.

    If the number of roots is odd, a single real root comes last: the leftmost root that is not nearly equal to another.
    """
    pairs, real_roots = [z[k : k + 2] for k in range(0, len(z) - 1, 2) if z[k].imag], np.sort(z[z.imag == 0].real)
    single_root = real_roots[:0]
    while len(real_roots) > 1:
        gaps = np.diff(real_roots)
        k = int(np.argmin(gaps))
        if gaps[k] > _MAX_DOUBLE_GAP * np.abs(z).max():
            if len(real_roots) % 2:
                single_root, real_roots = real_roots[:1], real_roots[1:]
                continue
            k = 0
        pairs.append(real_roots[k : k + 2].astype(complex))
        real_roots = np.delete(real_roots, [k, k + 1])
    single_root = real_roots if len(real_roots) else single_root
    return [*pairs, *([single_root.astype(complex)] if len(single_root) else [])]


def factors_of(z: Roots, gamma: float, leading: float = 1.0) -> list[float]:
    """β and κ of each quadratic factor in t = s − γ, then δ of the linear factor, if there is one.

    Args:
        leading: leading coefficient of the linear factor. If there is no linear factor, the first quadratic factor has
            it; unless it is 1, this factor then has the largest roots.
    """
    pairs = [pair - gamma for pair in pair_roots(z)]
    if leading != 1.0:
        pairs.sort(key=lambda pair: (len(pair) < 2, -abs(pair.prod())))
    scales = [1.0] * len(pairs)
    scales[-(len(z) % 2)] = leading
    factors = [
        (a * -pair.sum().real, a * pair.prod().real)[: len(pair)] for a, pair in zip(scales, pairs, strict=False)
    ]
    return [float(c) for factor in factors for c in factor]


def _guess_factors(
    cases: Sequence[int],
    leading_scale: float,
    is_shifted: bool,
    is_squared: bool,
    guess_edge: Callable[[Roots, float], float],
    values: Sequence[Values],
    z: Sequence[Roots],
) -> list[list[float]]:
    """The value of `guess_edge` for v in `_lift_by_factors`, and factors that match the coefficients exactly.

    Args:
        leading_scale: |a0| in the NLP relative to a0; 0 if all factors are monic.
    """
    roots = np.concatenate([z[case] for case in cases])
    edge = guess_edge(roots, float(np.abs(roots).mean()))
    guess = [edge]
    for case in cases:
        a0 = leading_scale * abs(float(values[case].coefficients[0])) if leading_scale else 1.0
        factors = factors_of(z[case], edge if is_shifted else 0.0, a0)
        if is_squared:
            factors = [float(np.sqrt(abs(c))) if k % 2 else c for k, c in enumerate(factors)]
            if leading_scale and len(z[case]) % 2 == 0:
                factors.insert(2, float(np.sqrt(a0)))
        guess += factors
    return [guess]


def _guess_real_roots(
    cases: Sequence[int], has_abscissa: bool, values: Sequence[Values], z: Sequence[Roots]
) -> list[list[float]]:
    """Real roots at the real parts of the roots of the design, but to the left of 0."""
    roots = np.concatenate([z[case] for case in cases])
    gamma = min(float(roots.real.max()) + 0.05 * float(np.abs(roots).mean()) + 1e-3, -1e-3) if has_abscissa else 0.0
    steps = [np.diff(np.sort(np.maximum(gamma - z[case].real, 1e-3)), prepend=0.0) for case in cases]
    return [[*([gamma] if has_abscissa else []), *(float(d) for case_steps in steps for d in case_steps)]]


def _guess_positive_root(case: int, values: Sequence[Values], z: Sequence[Roots]) -> list[list[float]]:
    """The rightmost root that is nearly real, and the polynomial of the other roots."""
    index = int(np.argmax(z[case].real - 2 * np.abs(z[case].imag)))
    quotient = np.atleast_1d(np.poly(np.delete(z[case], index))).real
    return [[max(float(z[case][index].real), 0.0), *map(float, quotient[1:])]]


def _guess_factors_at_radius(
    direction_cases: Sequence[int], values: Sequence[Values], z: Sequence[Roots]
) -> list[list[float]]:
    """The factors at the radius at which the cases were evaluated."""
    return [[max(c, 0.0) for case in direction_cases for c in factors_of(z[case], 0.0)]]
