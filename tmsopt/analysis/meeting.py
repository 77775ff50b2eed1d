"""A multiple root and its parameters, to as many digits as they can be met to, and the polynomial about it."""

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

_BITS = 424  # 127 digits: changes down to 1e-16 are differences of coefficients
_CAP = 64  # orders of a power series, of which FLINT keeps 10 if not told
_ROUNDING = 2.0**-50  # relative, of a parameter: that of a double, and of the few operations it may have gone through
_NEAR = 1e-3  # of the range of a parameter: what is smaller may be meant to be 0, and is met to less than its digits
_ZERO = 1e-12  # of the size of a parameter: a change relative to so little is none
_FARTHEST = 0.01  # of a parameter's size, or of its range where it is 0: a point beyond is another one
_SLOW = 0.9  # of the residual before: a step that leaves more ends the search
_RANKS = (1e-3, 1e-7, 1e-12)  # relative singular values of directions in which nothing is moved: the best counts
_MET = 2.0**-200  # relative: conditions that are met to all digits
_LAST = 4  # times the last step, which where conditions are singular is as long as what is left

Polynomial = Callable[[Mapping[str, Any]], list[Any]]
"""Values of parameters, balls or series of these → coefficients, descending."""


@dataclass(frozen=True)
class Meeting:
    """A multiple root where it is met.

    Attributes:
        polynomial: whose roots the user reads: of a complex H det (s + iH), without carrier and conjugates.
        values: parameter → its middle.
        doubt: parameter → how far the true one may be off: its rounding, or what could not be polished.
        sizes: parameter → its size; of one that is 0 the width of its range, and 0 of one that is fixed.
        free: parameters that may be moved first.
        s: the root, without a radius.
        real: whether the root and the coefficients are real.
        geometric: number of independent eigenvectors.
        unit: size of the roots about it.
        off: relative size of what is left of the conditions for the root.
        width: how far the root may be off, in its unit.
        moving: parameters that are moved with the root, so that all conditions are met; none where its place alone is.
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
    off: float = 0.0
    width: float = _ROUNDING
    moving: Sequence[str] = ()

    def relative(self, name: str) -> bool:
        """Whether changes of a parameter are relative to its value; of one that is 0 they are absolute."""
        return bool(abs(self.values[name]) > max(2 * self.doubt[name], _ZERO * self.sizes[name]))

    def step(self, name: str) -> Any:
        """The change of a parameter that ε = 1 stands for."""
        return self.values[name] if self.relative(name) else flint.arb(1)

    def changed(self, name: str, by: Any, doubt: bool = False) -> list[Any]:
        """Coefficients for a change of one parameter.

        Args:
            doubt: whether parameters are as wide as their doubt.
        """
        values = {n: flint.arb(x, self.doubt[n]) if doubt else x for n, x in self.values.items()}
        return self.polynomial({**values, name: values[name] + by})

    def own(self, scale: Any = 1) -> list[Any]:
        """The same of its own polynomial."""
        return self.taylor(self.polynomial(self.values), scale)

    def taylor(self, coefficients: Sequence[Any], scale: Any = 1, doubt: bool = False) -> list[Any]:
        """Coefficients in t of p(s + unit · scale · t), ascending."""
        s = self.s
        if doubt:
            wide = flint.arb(0, self.unit * self.width)
            s = s + (flint.acb(wide) if self.real else flint.acb(wide, wide))
        found = flint.acb_poly(list(coefficients[::-1]))(flint.acb_poly([s, self.unit * flint.arb(scale)]))
        return [found[j] for j in range(len(coefficients))]


@contextmanager
def many_digits() -> Iterator[None]:
    """The precision of a diagnosis, and all orders of power series."""
    cap, flint.ctx.cap = flint.ctx.cap, _CAP
    try:
        with flint.ctx.workprec(_BITS):
            yield
    finally:
        flint.ctx.cap = cap


def pencil_of(model: Model, of: ParameterSet, values: Mapping[str, Any]) -> tuple[Matrix, ...]:
    """Matrices of the matrix polynomial with these roots, in descending powers; of a complex H those of s + iH."""
    native = of.native(values)
    if model.double is None:
        assert model.pencil is not None
        return model.pencil(native)
    one, found = model.double(native)  # of the double, I and −[[J, R], [−R, J]]
    n = len(found) // 2
    both = [[_complex(row[j]) - flint.acb(0, 1) * _complex(row[n + j]) for j in range(n)] for row in found[:n]]
    return [row[:n] for row in one[:n]], both


def met(
    model: Model,
    of: ParameterSet,
    design: Numbers,
    widths: Numbers,
    s: complex,
    multiplicity: int,
) -> Meeting:
    """A root where it is stored, its place alone made exact: there the derivative before the first that stays is 0."""
    sizes = {n: width if abs(x) <= _NEAR * (width := widths.get(n, 0.0)) else abs(x) for n, x in design.items()}
    values = {n: flint.arb(exact(x)) for n, x in design.items()}
    doubt = {n: _ROUNDING * x for n, x in sizes.items()}
    real = model.double is None and s.imag == 0

    def polynomial(values: Mapping[str, Any]) -> list[Any]:
        """The one whose roots the user reads."""
        if model.double is None:
            return model.coefficients(values, of)
        return characteristic_polynomial([[-x for x in row] for row in pencil_of(model, of, values)[1]])

    found = Meeting(polynomial, values, doubt, sizes, widths, flint.acb(s), multiplicity, real)
    return _improved(replace(found, unit=max(_size(found), abs(s)) or 1.0))


def polished(found: Meeting, geometric: int) -> Meeting:
    """The nearest point at which the root is met, by Gauss and Newton's steps in parameters and root.

    The conditions: p and its derivatives below the multiplicity are 0 at the root and, with g independent eigenvectors,
    so are all derivatives of p in s and a parameter of an order below g.
    """
    every = [n for n, size in found.sizes.items() if size > 0]
    best = _improved(replace(found, geometric=geometric, moving=[n for n in every if n in found.free]))
    return best if best.off < _MET else _improved(replace(best, moving=every))


def _improved(start: Meeting) -> Meeting:
    """With conditions met better by what may be moved; the place alone where nothing may."""
    best, lead = start, abs(start.own()[start.multiplicity]).mid()
    left = _conditions(best, lead)
    off = _norm(left)
    while 2.0 ** (-2 * _BITS // 3) < off < np.inf:
        tried = []
        for step in _steps(best, left, lead):
            at = _moved(best, step)
            if all(abs(at.values[n] - start.values[n]) <= _FARTHEST * start.sizes[n] for n in start.moving):
                tried.append((_norm(new := _conditions(at, lead)), at, new, step))
        new_off, at, new, step = min(tried, key=lambda each: each[0], default=(off, best, left, []))
        if not new_off < _SLOW * off:
            break
        lengths = {n: _LAST * abs(float(x)) for n, x in zip(start.moving, step, strict=False)}
        doubt = {n: max(_ROUNDING, lengths.get(n, 0.0)) * x for n, x in start.sizes.items()}
        width = max(_ROUNDING, _LAST * float(abs(step[-1])), float(new_off))
        best, off, left = replace(at, doubt=doubt, width=width), new_off, new
    parts, least = (best.s.real, best.s.imag), best.unit * best.width  # what is 0 but for rounding is 0
    return replace(best, off=float(off), s=flint.acb(*(flint.arb(0) if abs(x) <= least else x for x in parts)))


def _conditions(at: Meeting, lead: Any) -> list[Any]:
    """What must be 0, relative; of a place alone what makes it the mean of the roots that nearly meet."""
    k, g = at.multiplicity, at.geometric
    found = at.own()[0 if at.moving else k - 1 : k]
    for name in at.values if at.moving and g > 1 else ():
        series = at.changed(name, flint.arb_series([0, at.sizes[name] or 1], prec=g))
        for m in range(1, g):
            found += at.taylor(order(series, m))[: g - m]
    return [x / lead for x in found]


def _steps(at: Meeting, left: Sequence[Any], lead: Any) -> Iterator[list[Any]]:
    """Least-squares steps: of parameters in their sizes, then of the root in its unit."""
    small, count = flint.arb(2) ** (-_BITS // 3), len(at.moving)
    size = max(abs(x) for x in left).mid()
    columns = []
    for shift in np.eye(count + 1).tolist():
        ahead = _conditions(_moved(at, [small * x for x in shift]), lead)
        columns.append([(a - b) / small for a, b in zip(ahead, left, strict=True)])
    if not at.real:
        columns.append([flint.acb(0, 1) * x for x in columns[-1]])
    matrix = np.array([[middle(x) for x in column] for column in columns]).T
    right = np.array([middle(x / size) for x in left])
    J, r = (np.concatenate([x.real, x.imag]) for x in (matrix, right))
    for rank in _RANKS if np.isfinite(J).all() else ():  # where conditions are singular their slopes vanish too
        found = np.linalg.lstsq(J, -r, rcond=rank)[0]
        yield [*(size * float(x) for x in found[:count]), size * flint.acb(*found[count:].tolist())]


def _moved(at: Meeting, step: Sequence[Any]) -> Meeting:
    moved = {n: (at.values[n] + at.sizes[n] * x).mid() for n, x in zip(at.moving, step, strict=False)}
    s = at.s + at.unit * step[-1]
    return replace(at, values={**at.values, **moved}, s=flint.acb(s.real.mid(), s.imag.mid()))


def _size(at: Meeting) -> float:
    """A bound on the roots, of the sizes of coefficients, as each parameter changes by a half of its size."""
    each = (at.polynomial(at.values), *(at.changed(n, flint.arb(x / 2 or 1)) for n, x in at.sizes.items()))
    ratios = (abs(middle(flint.acb(x) / c[0])) ** (1 / k) for c in each for k, x in enumerate(c[1:], start=1))
    return max(filter(np.isfinite, ratios), default=0.0)


def _norm(left: Sequence[Any]) -> Any:
    sizes = [abs(x) for x in left]
    return max((x.mid() for x in sizes), default=flint.arb(0)) if all(x.is_finite() for x in sizes) else np.inf


def order(series: Sequence[Any], m: int) -> list[Any]:
    """The coefficients of ε to a power."""
    return [
        c[m] if isinstance(c, flint.arb_series | flint.acb_series) else flint.acb(c if m == 0 else 0) for c in series
    ]


def _complex(x: Any) -> Any:
    return flint.acb_series(x) if isinstance(x, flint.arb_series) else flint.acb(flint.arb(x))


def middle(x: Any) -> complex:
    """The middle of a complex ball."""
    return complex(float(x.real.mid()), float(x.imag.mid()))
