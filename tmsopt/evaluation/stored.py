"""Rounds an ideal design to doubles, so that the exact roots of the rounded design still satisfy the limits.

A change ε of a coefficient moves an m-fold root s₀ by about ε^(1/m). So the doubles nearest to the numbers of an ideal
design violate a limit by about 1e-8 at a double root and by about 1e-4 at a 4-fold root. The remedy is to spread the
roots along the limit. Let u be the direction of the limit, s = s₀ + u t, and ∏ (t − tⱼ) = tᵐ + c₁ tᵐ⁻¹ + … + c_m.
Roots that are spread evenly over −h ≤ t ≤ h stay within d of their line if cₖ is within h^(k−1) d / 2 of its target
across the limit, and within hᵏ / 8 of its target along the limit (k ≥ 2). The line may lie inside the limit by about
h². This distance and the spread each worsen the objective by about h².

Doubles near such a design form a lattice. A reduced basis (Lenstra, Lenstra and Lovász 1982) and the nearest-plane
method (Babai 1986) give the closest point of the lattice, which is then checked by exact roots. h grows until a point
satisfies every limit.
"""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import flint
import numpy as np

from tmsopt.algebra.balls import as_ball
from tmsopt.evaluation.recheck import FEASIBILITY_TOLERANCE, Evaluation, find_missed_limits, recheck
from tmsopt.models import Values
from tmsopt.problem.cases import Case
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, ROOT_NAMES, approximate_eigenvalues
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import amounts_text, unit_at
from tmsopt.records import Array, Numbers
from tmsopt.roots import Root, Structure, product
from tmsopt.roots.exact import isolated_roots
from tmsopt.roots.patterns.root_enclosures import nearest_roots

_DIGITS = 150  # digits of the arithmetic, since slopes are differences over 2⁻¹⁰⁰ of a parameter
_SPREADS = 4.0 ** np.arange(10) * 2e-12  # values of h²/(s₀² C(m, 2)) to try, from 2e-12 to 5e-7
_SAME_LINE = 1e-6  # relative distance from the worst root within which another root is also on the limit
_NEWTON_STEPS = 4  # number of steps of Newton's method
_MAX_TRIALS = 4  # greatest number of lattice points to check for each spread
_VARIED_VECTORS = 4  # number of basis vectors that are varied around the closest lattice point
_RANK_TOLERANCE = 1e-9  # relative singular value below which a direction changes nothing
_LATTICE_STEP = 3e-12  # relative size of steps on the lattice, small enough for constant slopes
_MIN_SIZE = 1e-3  # natural size of a parameter near 0, as a share of its range
_MIN_STEP = 1e-20  # relative step of a parameter that is 0
_BITS = 60  # fractional bits of the lattice coordinates
_ZERO_SIZE = 1e-14  # share of the size of the roots below which an abscissa counts as 0
_SHOWN_DIFFERENCE = 1e-6  # relative difference of the two abscissas above which both are shown
_SHOWN_DIGITS = 7  # digits of an abscissa that is shown
_ULP_COUNTS = (1, -1, 4, -4, 16, -16, 64, -64, 256, -256)  # units in the last place by which a parameter is changed
_END_DISTANCE = 1e-9  # share of a range; a parameter that is closer to an end stays at the end


@dataclass(frozen=True)
class _Cluster:
    """A multiple root on a limit.

    Attributes:
        case: the case that has the root.
        root: the root of the ideal design, on or above the real axis.
        direction: unit vector along the limit; the feasible side is to the left of this vector.
        is_equality: whether the limit is an equality.
    """

    case: Case
    root: Root
    direction: complex
    is_equality: bool

    @property
    def centre(self) -> complex:
        """The multiple root s₀."""
        return complex(self.root.re, self.root.im)

    def components(self) -> Iterator[tuple[int, bool]]:
        """(k, is_real) for each real or imaginary part of a cₖ that has a target.

        A part without a target is 0 by symmetry, or free to change.
        """
        for k in range(1, self.root.multiplicity + 1):
            for is_real in (True, False):
                is_free = k == 1 and is_real
                is_zero = not self.root.im and is_real != (k % 2 == 0 or self.direction.imag == 0)
                if not is_free and not is_zero:
                    yield k, is_real


def find_storable_design(
    problem: Posed, parameters: Numbers, checked: Evaluation, cases: Sequence[Case]
) -> tuple[Numbers, Evaluation, Numbers]:
    """Move a feasible design as little as needed until its roots, exactly as stored, satisfy the limits.

    The design also moves if its objective is undefined as stored, for example if rounding makes the argument of a
    square root negative.

    Returns:
        The design; its recheck, with the structure of the ideal design; and an empty table. If no such design is found:
        the given design, its recheck, and limit → amount by which the stored design violates the limit.
    """
    amounts = {} if checked.violations else find_missed_limits(problem, parameters, cases, checked.robustness)
    if checked.violations or (not amounts and _has_objective(problem, parameters)):
        return parameters, checked, {}
    if amounts:
        clusters = _find_clusters(problem, parameters, checked, cases, list(amounts))
        ends = problem.free.items()
        inner_names = [
            n for n, (lo, hi) in ends if min(parameters[n] - lo, hi - parameters[n]) > _END_DISTANCE * (hi - lo)
        ]
        groups = [names for names in dict.fromkeys((tuple(inner_names), tuple(problem.free))) if names and clusters]
        attempts = (
            _SpreadRoots(problem, parameters, clusters, names, spread)
            for names, spread in itertools.product(groups, _SPREADS.tolist())
        )
        designs: Iterator[dict[str, float]] = (design for attempt in attempts for design in attempt.designs())
    else:  # move one free parameter by a few units in the last place
        near_designs = (
            {**parameters, name: x}
            for count, (name, (lower, upper)) in itertools.product(_ULP_COUNTS, problem.free.items())
            if lower <= (x := parameters[name] + count * math.ulp(parameters[name])) <= upper
        )
        designs = (design for design in near_designs if _has_objective(problem, design))
    for design in designs:
        if not find_missed_limits(problem, design, cases, checked.robustness):
            new_check = recheck(problem, design, cases, checked.robustness)
            if set(new_check.violations) <= set(problem.asked_of_roots):
                return design, _keep_structure(problem, design, checked, new_check), {}
    return parameters, checked, amounts


def _has_objective(problem: Posed, parameters: Numbers) -> bool:
    """Whether the objective is defined at the parameters exactly as stored; root quantities are always defined."""
    objective = problem.objective
    if objective is None or set(objective.names) & set(ROOT_NAMES):
        return True
    with flint.ctx.workdps(_DIGITS):
        exact = {n: flint.arb(x) for n, x in parameters.items()}
        return bool(as_ball(objective(Values(problem.model, problem.parameter_set, exact))).is_finite())


def abscissa_as_stored(solution: Solution) -> str:
    """The abscissa as stored, in words. The ideal abscissa comes first, unless it is the objective.

    Empty if the two differ by at most a millionth.
    """
    ideal, realised = solution.abscissa, solution.abscissa_realised
    size = max((r.size for r in solution.roots), default=0.0)
    ideal, realised = (x if abs(x) > _ZERO_SIZE * size else 0.0 for x in (ideal, realised))
    if not abs(realised - ideal) > _SHOWN_DIFFERENCE * abs(ideal) + FEASIBILITY_TOLERANCE * size:
        return ""
    design = solution.worst.applied(solution.parameters) if solution.worst else solution.parameters
    problem = solution.problem.posed
    unit = unit_at(problem, "abscissa", design)
    name = "largest Im ω" if problem.model.is_complex else "abscissa"
    prefix = "" if problem.goal == "abscissa" else f"{name} {unit.show(ideal, _SHOWN_DIGITS)}, "
    return f"{prefix}{unit.number(realised, _SHOWN_DIGITS)} in double precision"


def missed_note(problem: Posed, amounts: Numbers) -> tuple[str, ...]:
    """A sentence on the limits that the stored parameters violate; empty if they violate no limit."""
    reason = (
        "no doubles nearby that satisfy every limit were found" if problem.free else "the ideal design satisfies them"
    )
    return (
        (f"rounded to doubles, the parameters violate {amounts_text(problem, amounts)}; {reason}",) if amounts else ()
    )


def _find_clusters(
    problem: Posed, parameters: Numbers, checked: Evaluation, cases: Sequence[Case], names: Sequence[str]
) -> list[_Cluster]:
    """The multiple roots that lie on the named limits."""
    limited_names = {name for limit in names for name in problem.conditions[limit].names}
    is_equality = any(problem.conditions[limit].equality for limit in names)
    clusters = []
    for case in [case for case in cases if not case.direction] or [Case()]:  # without cases of the robustness radius
        structure = problem.values(case.applied(parameters))["structure"]
        size = _SAME_LINE * max(r.size for r in structure.roots)
        for root in structure.roots:
            z = complex(root.re, root.im)
            if root.multiplicity == 1 or root.im < 0 or z == 0:
                continue
            is_at_frequency_limit = (
                ANGULAR_FREQUENCY in limited_names and root.im >= checked.quantities[ANGULAR_FREQUENCY] - size
            )
            is_at_damping_limit = "damping_ratio" in limited_names and -root.re <= (
                checked.quantities["damping_ratio"] + _SAME_LINE
            ) * abs(z)
            if is_at_frequency_limit or is_at_damping_limit or root.re >= checked.structure.abscissa - size:
                direction = -1.0 if is_at_frequency_limit else z / abs(z) if is_at_damping_limit else 1j
                clusters.append(_Cluster(case, root, direction, is_equality))
    return clusters


@dataclass(frozen=True)
class _SpreadRoots:
    """A design whose multiple roots are to be spread along their limits.

    Attributes:
        names: parameters that may move.
        spread: h²/(s₀² C(m, 2)).
    """

    problem: Posed
    parameters: Numbers
    clusters: Sequence[_Cluster]
    names: Sequence[str]
    spread: float

    @cached_property
    def requirements(self) -> Array:
        """A row of targets, a row of tolerances and a row of natural sizes; a column for each part of each cₖ."""
        columns = []
        for cluster in self.clusters:
            m, size = cluster.root.multiplicity, abs(cluster.centre)
            h = size * math.sqrt(self.spread * math.comb(m, 2))
            inner_distance = 0.0 if cluster.is_equality else size * self.spread
            c = np.poly(h * np.linspace(-1, 1, m) + 1j * inner_distance)
            max_distance = (FEASIBILITY_TOLERANCE * size + inner_distance) / 2
            for k, is_real in cluster.components():
                tolerance = h**k / 8 if is_real else h ** (k - 1) * max_distance
                columns.append((c[k].real if is_real else c[k].imag, tolerance, size**k))
        return np.array(columns).T

    @cached_property
    def natural_sizes(self) -> Array:
        """Natural sizes of the parameters that may move."""
        free = self.problem.free
        return np.array([max(abs(self.parameters[n]), _MIN_SIZE * np.ptp(free[n])) for n in self.names])

    def designs(self) -> Iterator[dict[str, float]]:
        """Doubles in the box that are close to the design with spread clusters, the most promising first."""
        _, tolerances, _ = self.requirements
        lattice_steps = _LATTICE_STEP * self.natural_sizes
        with flint.ctx.workdps(_DIGITS):
            exact_design, slope = self.solve_exactly()
            start = {n: float(exact_design[n]) for n in self.names}
            rounded_design = {**exact_design, **{n: flint.arb(x) for n, x in start.items()}}
            deviations = [float(x) for x in self.deviations(rounded_design)]
            rounding = np.array([float(rounded_design[n] - exact_design[n]) for n in self.names])
        if not np.all(np.isfinite([*deviations, *start.values(), *slope.ravel()])):
            return
        units = np.maximum([math.ulp(x) for x in start.values()], _MIN_STEP * self.natural_sizes)
        rows = np.hstack([slope * units[:, None] / tolerances, np.diag(units / lattice_steps)])
        for counts in _list_combinations(rows, np.array([*(deviations / tolerances), *(rounding / lattice_steps)])):
            steps = zip(start.items(), counts, units.tolist(), strict=True)
            design = {**self.parameters, **{n: x + count * unit for (n, x), count, unit in steps}}
            if all(lo <= design[n] <= hi for n, (lo, hi) in self.problem.free.items()):
                yield design

    def solve_exactly(self) -> tuple[dict[str, Any], Array]:
        """The exact design after Newton steps with constant slopes, and these slopes of the deviations."""
        (_, _, size), widths = self.requirements, self.natural_sizes
        design = {n: flint.arb(x) for n, x in self.parameters.items()}
        deviations, slopes = self.deviations(design), []
        for n, width in zip(self.names, widths.tolist(), strict=True):
            step = flint.arb(width) * flint.arb(2) ** -100
            changed = self.deviations({**design, n: design[n] + step})
            slopes.append([float((b - a) / step) for a, b in zip(deviations, changed, strict=True)])
        slope = np.array(slopes)
        if np.all(np.isfinite(slope)):
            inverse = np.linalg.pinv((slope * widths[:, None] / size).T, rcond=_RANK_TOLERANCE)
            for _ in range(_NEWTON_STEPS):
                steps = widths * (inverse @ (np.array([float(x) for x in self.deviations(design)]) / size))
                for n, step in zip(self.names, steps.tolist(), strict=True):
                    design[n] = (design[n] - flint.arb(step)).mid()
        return design, slope

    def deviations(self, design: Mapping[str, Any]) -> list[Any]:
        """Each part of each cₖ of an exact design, minus its target."""
        parts, (targets, _, _) = [], self.requirements.tolist()
        for cluster in self.clusters:
            roots = _find_roots(self.problem, cluster.case.applied(design))
            if not roots:
                return [flint.arb("nan")] * len(targets)
            centre, direction = flint.acb(cluster.centre), flint.acb(cluster.direction)
            z = sorted(roots, key=lambda z: float(abs(z - centre)))
            c = product(*([flint.acb(1), (centre - root) / direction] for root in z[: cluster.root.multiplicity]))
            parts += [c[k].real if is_real else c[k].imag for k, is_real in cluster.components()]
        return [(x - t).mid() for x, t in zip(parts, targets, strict=True)]


def _find_roots(problem: Posed, parameters: Mapping[str, Any]) -> list[Any]:
    """The roots of a design of balls; none if a coefficient or an eigenvalue is not finite."""
    if problem.model.polynomial is None:
        try:
            return approximate_eigenvalues(problem.model, problem.parameter_set, parameters)[0]
        except (ZeroDivisionError, ValueError):
            return []
    a = problem.model.coefficients(parameters, problem.parameter_set)
    return [z for z, m in isolated_roots(a) for _ in range(m)] if all(c.is_finite() for c in a) else []


def _list_combinations(rows: Array, residual: Array) -> Iterator[list[int]]:
    """Integer combinations of rows whose sum with `residual` is smallest; the best combination comes first."""
    integers = [[int(math.ldexp(x, _BITS)) for x in row] for row in rows.tolist()]
    reduced, transform = flint.fmpz_mat(integers).lll(True)
    n = len(rows)
    basis = np.array([[math.ldexp(int(reduced[i, j]), -_BITS) for j in range(len(residual))] for i in range(n)])
    q, r = np.linalg.qr(basis.T)
    remainder, combination = residual, [0] * n
    for i in range(n)[::-1]:
        combination[i] = -round(float(q[:, i] @ remainder / r[i, i]))
        remainder = remainder + combination[i] * basis[i]
    neighbours = itertools.product((0, 1, -1), repeat=min(n, _VARIED_VECTORS))
    ranked = sorted(neighbours, key=lambda changes: float(np.abs(remainder + changes @ basis[: len(changes)]).max()))
    for changes in ranked[:_MAX_TRIALS]:
        coefficients = [a + b for a, b in itertools.zip_longest(combination, changes, fillvalue=0)]
        yield [sum(c * int(transform[i, j]) for i, c in enumerate(coefficients)) for j in range(n)]


def _keep_structure(problem: Posed, design: Numbers, checked: Evaluation, new_check: Evaluation) -> Evaluation:
    """The recheck of a moved design, with the structure of the ideal design."""
    structure = new_check.structure
    if structure.name != checked.structure.name:
        with flint.ctx.workdps(_DIGITS):
            exact = {n: flint.arb(x) for n, x in checked.worst.applied(design).items()}
            a = problem.model.coefficients(exact, problem.parameter_set)
            exact_roots = (a and nearest_roots(a, checked.structure.roots)) or ()
        roots = tuple(Root(float(r.re), float(r.im), r.multiplicity) for r in exact_roots) or checked.structure.roots
        structure = Structure(checked.structure.name, roots, checked.structure.distance)
    return replace(new_check, structure=structure, violations=checked.violations, amounts=checked.amounts)
