"""A multiple root and the parameters at which it exists, to many digits, and the polynomial around the root."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import flint
import numpy as np

from tmsopt.algebra.balls import exact
from tmsopt.models import Model, ParameterSet
from tmsopt.models.model import Matrix
from tmsopt.records import Numbers
from tmsopt.roots.polynomial import characteristic_polynomial

_BITS = 424  # 127 digits; a shift by ε = 1e-16 is a difference of coefficients, in which most digits cancel
_MAX_ORDERS = 64  # largest number of orders of a power series; the default of FLINT is 10
_ROUNDING = 2.0**-50  # relative rounding error of a parameter, a double after a few operations
_ROUNDED_ZERO_SHARE = 1e-3
"""A value below this share of its range may be a rounded 0; its size is then the width of the range."""
_ZERO_SHARE = 1e-12  # the change of a value below this share of its size is absolute, not relative
_MAX_MOVE = 0.01  # largest move of a parameter, relative to its size; a point farther away is another point
_MAX_RATIO = 0.9  # ratio of successive residuals above which the iteration ends
_RANK_CUTOFFS = (1e-3, 1e-7, 1e-12)
"""Relative singular values below which directions are dropped. Each cutoff gives a step, and the best step counts."""
_CONVERGED = 2.0**-200  # relative residual of conditions that hold to all digits
_STEP_ERROR = 4  # largest error of the result, relative to the last step, also for singular conditions

Polynomial = Callable[[Mapping[str, Any]], list[Any]]
"""Values of parameters (intervals or series) → coefficients, descending."""


@dataclass(frozen=True)
class RootPoint:
    """A multiple root and the parameters at which it exists.

    Attributes:
        polynomial: the polynomial of the system as the user states it. For a complex H it is det (s + iH). It does not
            contain the carrier (a constant that the model adds to all eigenfrequencies) or conjugate roots.
        values: parameter → midpoint of its interval.
        errors: parameter → its error, from rounding or from the refinement.
        sizes: parameter → its size; for a parameter that is 0, the width of its range, or 0 if it is fixed.
        free_names: parameters that are refined first.
        s: the root, a number without an error radius.
        is_real: whether the root and the coefficients are real.
        geometric: number of independent eigenvectors.
        unit: size of the roots, which is the unit of distances from the root.
        residual: relative residual of the conditions for the root.
        root_error: error of the root, in `unit`.
        refined_names: parameters that are refined together with the root; empty if only the root is refined.
    """

    polynomial: Polynomial
    values: Mapping[str, Any]
    errors: Numbers
    sizes: Numbers
    free_names: Collection[str]
    s: Any
    multiplicity: int
    is_real: bool
    geometric: int = 1
    unit: float = 1.0
    residual: float = 0.0
    root_error: float = _ROUNDING
    refined_names: Sequence[str] = ()

    def is_relative(self, name: str) -> bool:
        """Whether changes of a parameter are relative to its value; they are absolute if the value may be 0."""
        return bool(abs(self.values[name]) > max(2 * self.errors[name], _ZERO_SHARE * self.sizes[name]))

    def step(self, name: str) -> Any:
        """The change of a parameter for ε = 1."""
        return self.values[name] if self.is_relative(name) else flint.arb(1)

    def perturb(self, name: str, change: Any, with_errors: bool = False) -> list[Any]:
        """Coefficients of the polynomial after a change of one parameter.

        Args:
            with_errors: whether the parameters are intervals with their errors as radius.
        """
        values = {n: flint.arb(x, self.errors[n]) if with_errors else x for n, x in self.values.items()}
        return self.polynomial({**values, name: values[name] + change})

    def expand(self, scale: Any = 1) -> list[Any]:
        """Coefficients in t of the unperturbed polynomial, as in `taylor`."""
        return self.taylor(self.polynomial(self.values), scale)

    def taylor(self, coefficients: Sequence[Any], scale: Any = 1, with_errors: bool = False) -> list[Any]:
        """Coefficients in t of p(s + unit · scale · t), ascending."""
        s = self.s
        if with_errors:
            radius = flint.arb(0, self.unit * self.root_error)
            s = s + (flint.acb(radius) if self.is_real else flint.acb(radius, radius))
        expansion = flint.acb_poly(list(coefficients[::-1]))(flint.acb_poly([s, self.unit * flint.arb(scale)]))
        return [expansion[j] for j in range(len(coefficients))]


@contextmanager
def high_precision() -> Iterator[None]:
    """Set the precision of a diagnosis, and the number of orders of power series."""
    cap, flint.ctx.cap = flint.ctx.cap, _MAX_ORDERS
    try:
        with flint.ctx.workprec(_BITS):
            yield
    finally:
        flint.ctx.cap = cap


def evaluate_pencil(model: Model, parameter_set: ParameterSet, values: Mapping[str, Any]) -> tuple[Matrix, ...]:
    """Matrices, in descending powers, of the matrix polynomial whose roots are diagnosed."""
    assert model.pencil is not None
    return model.pencil(parameter_set.native(values))


def refine_root(
    model: Model, parameter_set: ParameterSet, design: Numbers, range_widths: Numbers, s: complex, multiplicity: int
) -> RootPoint:
    """A multiple root of the stored parameters: the zero of the derivative of order multiplicity − 1."""
    sizes = {
        n: width if abs(x) <= _ROUNDED_ZERO_SHARE * (width := range_widths.get(n, 0.0)) else abs(x)
        for n, x in design.items()
    }
    values = {n: flint.arb(exact(x)) for n, x in design.items()}
    errors = {n: _ROUNDING * x for n, x in sizes.items()}
    is_real = not model.is_complex and s.imag == 0

    def polynomial(values: Mapping[str, Any]) -> list[Any]:
        """The polynomial of the system as the user states it."""
        if not model.is_complex:
            return model.coefficients(values, parameter_set)
        _, i_times_h = evaluate_pencil(model, parameter_set, values)
        return characteristic_polynomial([[-x for x in row] for row in i_times_h])

    point = RootPoint(polynomial, values, errors, sizes, range_widths.keys(), flint.acb(s), multiplicity, is_real)
    return _improve_point(replace(point, unit=max(_measure_roots(point), abs(s)) or 1.0))


def refine_point(point: RootPoint, geometric: int) -> RootPoint:
    """The nearest point at which the root is multiple, by Gauss-Newton steps of the parameters and the root.

    The conditions are that p and its derivatives of an order below the multiplicity are 0 at the root. With g
    independent eigenvectors, all derivatives of p in s and one parameter of total order below g are also 0.
    """
    names = [n for n, size in point.sizes.items() if size > 0]
    free_names = [n for n in names if n in point.free_names]
    point = _improve_point(replace(point, geometric=geometric, refined_names=free_names))
    return point if point.residual < _CONVERGED else _improve_point(replace(point, refined_names=names))


def _improve_point(start: RootPoint) -> RootPoint:
    """Refine the root, and the parameters in `refined_names`, until the conditions hold or stop improving."""
    best_point, kth_coefficient = start, abs(start.expand()[start.multiplicity]).mid()
    residuals = _evaluate_conditions(best_point, kth_coefficient)
    largest_residual = _measure_residuals(residuals)
    while 2.0 ** (-2 * _BITS // 3) < largest_residual < np.inf:
        candidates = []
        for step in _list_steps(best_point, residuals, kth_coefficient):
            point = _apply_step(best_point, step)
            if all(abs(point.values[n] - start.values[n]) <= _MAX_MOVE * start.sizes[n] for n in start.refined_names):
                new_residuals = _evaluate_conditions(point, kth_coefficient)
                candidates.append((_measure_residuals(new_residuals), point, new_residuals, step))
        new_largest_residual, point, new_residuals, step = min(
            candidates, key=lambda candidate: candidate[0], default=(largest_residual, best_point, residuals, [])
        )
        if not new_largest_residual < _MAX_RATIO * largest_residual:
            break
        lengths = {n: _STEP_ERROR * abs(float(x)) for n, x in zip(start.refined_names, step, strict=False)}
        errors = {n: max(_ROUNDING, lengths.get(n, 0.0)) * x for n, x in start.sizes.items()}
        root_error = max(_ROUNDING, _STEP_ERROR * float(abs(step[-1])), float(new_largest_residual))
        best_point = replace(point, errors=errors, root_error=root_error)
        largest_residual, residuals = new_largest_residual, new_residuals
    rounding, s = best_point.unit * best_point.root_error, best_point.s
    parts = (flint.arb(0) if abs(x) <= rounding else x for x in (s.real, s.imag))  # parts within rounding become 0
    return replace(best_point, residual=float(largest_residual), s=flint.acb(*parts))


def _evaluate_conditions(point: RootPoint, kth_coefficient: Any) -> list[Any]:
    """Relative residuals of the conditions for the root.

    If only the root is refined, the only condition is that the derivative of order k − 1 is 0. The root is then about
    the mean of the nearby roots.
    """
    k, g = point.multiplicity, point.geometric
    residuals = point.expand()[0 if point.refined_names else k - 1 : k]
    for name in point.values if point.refined_names and g > 1 else ():
        series = point.perturb(name, flint.arb_series([0, point.sizes[name] or 1], prec=g))
        for m in range(1, g):
            residuals += point.taylor(coefficients_of_order(series, m))[: g - m]
    return [x / kth_coefficient for x in residuals]


def _list_steps(point: RootPoint, residuals: Sequence[Any], kth_coefficient: Any) -> Iterator[list[Any]]:
    """Least-squares steps: parameters relative to their sizes, then the root in its unit."""
    small_step, count = flint.arb(2) ** (-_BITS // 3), len(point.refined_names)
    residual_size = max(abs(x) for x in residuals).mid()
    columns = []
    for shift in np.eye(count + 1).tolist():
        residuals_ahead = _evaluate_conditions(_apply_step(point, [small_step * x for x in shift]), kth_coefficient)
        columns.append([(a - b) / small_step for a, b in zip(residuals_ahead, residuals, strict=True)])
    if not point.is_real:
        columns.append([flint.acb(0, 1) * x for x in columns[-1]])
    matrix = np.array([[midpoint(x) for x in column] for column in columns]).T
    right_side = np.array([midpoint(x / residual_size) for x in residuals])
    J, r = (np.concatenate([x.real, x.imag]) for x in (matrix, right_side))
    for cutoff in _RANK_CUTOFFS if np.isfinite(J).all() else ():  # at singular conditions, slopes vanish
        solution = np.linalg.lstsq(J, -r, rcond=cutoff)[0]
        step = [*map(float, solution[:count]), flint.acb(*solution[count:].tolist())]
        yield [residual_size * x for x in step]


def _apply_step(point: RootPoint, step: Sequence[Any]) -> RootPoint:
    new_values = {
        n: (point.values[n] + point.sizes[n] * x).mid() for n, x in zip(point.refined_names, step, strict=False)
    }
    s = point.s + point.unit * step[-1]
    return replace(point, values={**point.values, **new_values}, s=flint.acb(s.real.mid(), s.imag.mid()))


def _measure_roots(point: RootPoint) -> float:
    """A size of the roots: the largest |aₖ/a0|^(1/k), also after a change of any parameter by half its size.

    No root is larger than twice this size.
    """
    polynomials = (
        point.polynomial(point.values),
        *(point.perturb(n, flint.arb(x / 2 or 1)) for n, x in point.sizes.items()),
    )
    ratios = (abs(midpoint(flint.acb(x) / c[0])) ** (1 / k) for c in polynomials for k, x in enumerate(c[1:], start=1))
    return max(filter(np.isfinite, ratios), default=0.0)


def _measure_residuals(residuals: Sequence[Any]) -> Any:
    sizes = [abs(x) for x in residuals]
    return max((x.mid() for x in sizes), default=flint.arb(0)) if all(x.is_finite() for x in sizes) else np.inf


def coefficients_of_order(series: Sequence[Any], m: int) -> list[Any]:
    """The coefficients of ε^m."""
    return [
        c[m] if isinstance(c, flint.arb_series | flint.acb_series) else flint.acb(c if m == 0 else 0) for c in series
    ]


def midpoint(x: Any) -> complex:
    """The midpoint of a complex interval."""
    return complex(float(x.real.mid()), float(x.imag.mid()))
