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

_BITS = 424  # 127 digits, because changes down to 1e-16 are differences of coefficients
_MAX_ORDERS = 64  # most orders of a power series; FLINT keeps 10 orders by default
_ROUNDING = 2.0**-50  # relative rounding error of a parameter, a double after a few operations
_NEAR_ZERO = 1e-3  # share of a range below which a parameter may be a rounded 0; its size is then the width
_ZERO = 1e-12  # share of a size below which a parameter changes absolutely, not relatively
_MAX_MOVE = 0.01  # largest move of a parameter, relative to its size; a point farther away is another point
_MAX_RATIO = 0.9  # ratio of successive residuals above which the iteration ends
# relative singular values below which directions are dropped; the best of the three counts
_RANKS = (1e-3, 1e-7, 1e-12)
_CONVERGED = 2.0**-200  # relative residual of conditions that hold to all digits
_STEP_ERROR = 4  # error of the result relative to the last step, also for singular conditions

Polynomial = Callable[[Mapping[str, Any]], list[Any]]
"""Values of parameters (intervals or series) → coefficients, descending."""


@dataclass(frozen=True)
class RootPoint:
    """A multiple root and the parameters at which it exists.

    Attributes:
        polynomial: the polynomial with the user's roots. For a complex H it is det (s + iH), which has neither the
            carrier nor the conjugate roots.
        values: parameter → midpoint of its interval.
        doubt: parameter → its error, from rounding or from the refinement.
        sizes: parameter → its size; for a parameter that is 0, the width of its range, or 0 if it is fixed.
        free: parameters that are refined first.
        s: the root, a number without an error radius.
        real: whether the root and the coefficients are real.
        geometric: number of independent eigenvectors.
        unit: size of the roots, which is the unit of distances from the root.
        residual: relative residual of the conditions for the root.
        width: error of the root, in its unit.
        refined_names: parameters that are refined together with the root; empty if only the root is refined.
    """

    polynomial: Polynomial
    values: Mapping[str, Any]
    doubt: Numbers
    sizes: Numbers
    free: Collection[str]
    s: Any
    multiplicity: int
    real: bool
    geometric: int = 1
    unit: float = 1.0
    residual: float = 0.0
    width: float = _ROUNDING
    refined_names: Sequence[str] = ()

    def relative(self, name: str) -> bool:
        """Whether changes of a parameter are relative to its value; they are absolute if the value is 0."""
        return bool(abs(self.values[name]) > max(2 * self.doubt[name], _ZERO * self.sizes[name]))

    def step(self, name: str) -> Any:
        """The change of a parameter for ε = 1."""
        return self.values[name] if self.relative(name) else flint.arb(1)

    def perturb(self, name: str, by: Any, doubt: bool = False) -> list[Any]:
        """Coefficients of the polynomial after a change of one parameter.

        Args:
            doubt: whether the parameters are intervals with their errors as radius.
        """
        values = {n: flint.arb(x, self.doubt[n]) if doubt else x for n, x in self.values.items()}
        return self.polynomial({**values, name: values[name] + by})

    def expand(self, scale: Any = 1) -> list[Any]:
        """Coefficients in t of the unperturbed polynomial."""
        return self.taylor(self.polynomial(self.values), scale)

    def taylor(self, coefficients: Sequence[Any], scale: Any = 1, doubt: bool = False) -> list[Any]:
        """Coefficients in t of p(s + unit · scale · t), ascending."""
        s = self.s
        if doubt:
            radius = flint.arb(0, self.unit * self.width)
            s = s + (flint.acb(radius) if self.real else flint.acb(radius, radius))
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
    """Matrices of the matrix polynomial whose roots are diagnosed, in descending powers; of s + iH for a complex H."""
    native = parameter_set.native(values)
    if model.double is None:
        assert model.pencil is not None
        return model.pencil(native)
    identity, real_form = model.double(native)  # real form: I and −[[J, R], [−R, J]]
    n = len(real_form) // 2
    both = [
        [_to_complex(row[j]) - flint.acb(0, 1) * _to_complex(row[n + j]) for j in range(n)] for row in real_form[:n]
    ]
    return [row[:n] for row in identity[:n]], both


def refine_root(
    model: Model, parameter_set: ParameterSet, design: Numbers, widths: Numbers, s: complex, multiplicity: int
) -> RootPoint:
    """A multiple root of the stored parameters: the zero of the derivative of order multiplicity − 1."""
    sizes = {n: width if abs(x) <= _NEAR_ZERO * (width := widths.get(n, 0.0)) else abs(x) for n, x in design.items()}
    values = {n: flint.arb(exact(x)) for n, x in design.items()}
    doubt = {n: _ROUNDING * x for n, x in sizes.items()}
    real = model.double is None and s.imag == 0

    def polynomial(values: Mapping[str, Any]) -> list[Any]:
        """The polynomial with the user's roots."""
        if model.double is None:
            return model.coefficients(values, parameter_set)
        _, negative = evaluate_pencil(model, parameter_set, values)
        return characteristic_polynomial([[-x for x in row] for row in negative])

    point = RootPoint(polynomial, values, doubt, sizes, widths, flint.acb(s), multiplicity, real)
    return _improve_point(replace(point, unit=max(_bound_roots(point), abs(s)) or 1.0))


def refine_point(point: RootPoint, geometric: int) -> RootPoint:
    """The nearest point at which the root is multiple, by Gauss-Newton steps of the parameters and the root.

    The conditions are that p and its derivatives of an order below the multiplicity are 0 at the root. With g
    independent eigenvectors, all mixed derivatives of p in s and a parameter of an order below g are also 0.
    """
    names = [n for n, size in point.sizes.items() if size > 0]
    free_names = [n for n in names if n in point.free]
    point = _improve_point(replace(point, geometric=geometric, refined_names=free_names))
    return point if point.residual < _CONVERGED else _improve_point(replace(point, refined_names=names))


def _improve_point(start: RootPoint) -> RootPoint:
    """Refine the root, and the parameters in `refined_names`, until the conditions hold or stop improving."""
    best_point, lead = start, abs(start.expand()[start.multiplicity]).mid()
    residuals = _evaluate_conditions(best_point, lead)
    largest = _find_largest(residuals)
    while 2.0 ** (-2 * _BITS // 3) < largest < np.inf:
        candidates = []
        for step in _list_steps(best_point, residuals, lead):
            point = _apply_step(best_point, step)
            if all(abs(point.values[n] - start.values[n]) <= _MAX_MOVE * start.sizes[n] for n in start.refined_names):
                new_residuals = _evaluate_conditions(point, lead)
                candidates.append((_find_largest(new_residuals), point, new_residuals, step))
        new_largest, point, new_residuals, step = min(
            candidates, key=lambda each: each[0], default=(largest, best_point, residuals, [])
        )
        if not new_largest < _MAX_RATIO * largest:
            break
        lengths = {n: _STEP_ERROR * abs(float(x)) for n, x in zip(start.refined_names, step, strict=False)}
        doubt = {n: max(_ROUNDING, lengths.get(n, 0.0)) * x for n, x in start.sizes.items()}
        width = max(_ROUNDING, _STEP_ERROR * float(abs(step[-1])), float(new_largest))
        best_point, largest, residuals = replace(point, doubt=doubt, width=width), new_largest, new_residuals
    rounding, s = best_point.unit * best_point.width, best_point.s
    parts = (flint.arb(0) if abs(x) <= rounding else x for x in (s.real, s.imag))  # parts within rounding become 0
    return replace(best_point, residual=float(largest), s=flint.acb(*parts))


def _evaluate_conditions(point: RootPoint, lead: Any) -> list[Any]:
    """Relative residuals of the conditions. Without parameters to refine, the root is the mean of the nearby roots."""
    k, g = point.multiplicity, point.geometric
    residuals = point.expand()[0 if point.refined_names else k - 1 : k]
    for name in point.values if point.refined_names and g > 1 else ():
        series = point.perturb(name, flint.arb_series([0, point.sizes[name] or 1], prec=g))
        for m in range(1, g):
            residuals += point.taylor(coefficients_of_order(series, m))[: g - m]
    return [x / lead for x in residuals]


def _list_steps(point: RootPoint, residuals: Sequence[Any], lead: Any) -> Iterator[list[Any]]:
    """Least-squares steps: parameters relative to their sizes, then the root in its unit."""
    small_step, count = flint.arb(2) ** (-_BITS // 3), len(point.refined_names)
    size = max(abs(x) for x in residuals).mid()
    columns = []
    for shift in np.eye(count + 1).tolist():
        residuals_ahead = _evaluate_conditions(_apply_step(point, [small_step * x for x in shift]), lead)
        columns.append([(a - b) / small_step for a, b in zip(residuals_ahead, residuals, strict=True)])
    if not point.real:
        columns.append([flint.acb(0, 1) * x for x in columns[-1]])
    matrix = np.array([[midpoint(x) for x in column] for column in columns]).T
    right = np.array([midpoint(x / size) for x in residuals])
    J, r = (np.concatenate([x.real, x.imag]) for x in (matrix, right))
    for rank in _RANKS if np.isfinite(J).all() else ():  # singular conditions have slopes 0
        solution = np.linalg.lstsq(J, -r, rcond=rank)[0]
        yield [*(size * float(x) for x in solution[:count]), size * flint.acb(*solution[count:].tolist())]


def _apply_step(point: RootPoint, step: Sequence[Any]) -> RootPoint:
    new_values = {
        n: (point.values[n] + point.sizes[n] * x).mid() for n, x in zip(point.refined_names, step, strict=False)
    }
    s = point.s + point.unit * step[-1]
    return replace(point, values={**point.values, **new_values}, s=flint.acb(s.real.mid(), s.imag.mid()))


def _bound_roots(point: RootPoint) -> float:
    """A bound on the size of the roots, also after a change of any parameter by half its size."""
    polynomials = (
        point.polynomial(point.values),
        *(point.perturb(n, flint.arb(x / 2 or 1)) for n, x in point.sizes.items()),
    )
    ratios = (abs(midpoint(flint.acb(x) / c[0])) ** (1 / k) for c in polynomials for k, x in enumerate(c[1:], start=1))
    return max(filter(np.isfinite, ratios), default=0.0)


def _find_largest(residuals: Sequence[Any]) -> Any:
    sizes = [abs(x) for x in residuals]
    return max((x.mid() for x in sizes), default=flint.arb(0)) if all(x.is_finite() for x in sizes) else np.inf


def coefficients_of_order(series: Sequence[Any], m: int) -> list[Any]:
    """The coefficients of ε^m."""
    return [
        c[m] if isinstance(c, flint.arb_series | flint.acb_series) else flint.acb(c if m == 0 else 0) for c in series
    ]


def _to_complex(x: Any) -> Any:
    return flint.acb_series(x) if isinstance(x, flint.arb_series) else flint.acb(flint.arb(x))


def midpoint(x: Any) -> complex:
    """The midpoint of a complex interval."""
    return complex(float(x.real.mid()), float(x.imag.mid()))
