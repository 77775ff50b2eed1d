"""All double eigenvalues of a complex matrix that is analytic in z = x + iy, by the discriminant as a polynomial in z.

If the entries of the matrix of s^(d−k) are polynomials in z of a degree of at most q k, the discriminant of the
characteristic polynomial of degree N is a polynomial in z of a degree of at most q N (N − 1). So there are at most that
many exceptional points of order 2 in the whole plane, and n (n − 1) for H₀ + z H₁ in general.
"""

import math
from dataclasses import dataclass
from fractions import Fraction

import flint
import numpy as np

from tmsopt.algebra.formula import Node, UnsupportedOperation, fold, formula, symbol
from tmsopt.algebra.identity import Field
from tmsopt.algebra.kinds import gradients
from tmsopt.models.stated.degree import DEGREES, Degree
from tmsopt.models.stated.pairs import Pair
from tmsopt.problem.problem import Posed

_MAX_DEGREE = 150  # of the discriminant; its roots take some seconds
_BITS = 64  # of the zeros
_BITS_PER_DEGREE = 12  # roots may be 1000 times farther away than the size of the box


@dataclass(frozen=True)
class Discriminant:
    """The discriminant of a complex matrix as a polynomial in z.

    Attributes:
        degree: upper bound of its degree, and so of the number of exceptional points.
        zeros: approximate zeros as rows (x, y); empty if they cannot be isolated.
    """

    degree: int
    zeros: tuple[tuple[float, float], ...]


def find_discriminant(problem: Posed) -> Discriminant | None:
    """The discriminant of a problem with two free parameters; None if its matrix is not polynomial in x + iy."""
    model = problem.model
    if not model.is_complex or model.pencil is None or len(problem.free) != 2:
        return None
    x, y = (symbol(n) for n in problem.free)
    parameters = problem.ordered({**problem.as_nodes(problem.fixed), **dict(zip(problem.free, (x, y), strict=True))})
    matrices = model.pencil(problem.parameter_set.native(parameters))
    if len(matrices) != 2:
        return None
    ratio = Fraction(0)
    for k, rows in enumerate(matrices):
        for entry in (entry for row in rows for entry in row if isinstance(entry, Pair)):
            degree = _degree_in_z(entry, x, y)
            if degree is None or (degree and not k):
                return None
            ratio = max(ratio, Fraction(degree, max(k, 1)))
    size = (len(matrices) - 1) * len(matrices[0])
    degree = math.floor(ratio * size * (size - 1))
    return Discriminant(degree, _find_zeros(problem, degree) if 0 < degree <= _MAX_DEGREE else ())


def _degree_in_z(entry: Pair, x: Node, y: Node) -> int | None:
    """Degree in z = x + iy of an entry; None if it is not a polynomial in z."""
    parts = formula([entry.re, entry.im], (x.value, y.value))
    slopes = gradients([entry.re, entry.im], [x, y])
    (re_x, re_y), (im_x, im_y) = slopes
    equations = formula([re_x - im_y, re_y + im_x], parts.names)
    try:
        field = Field(equations)
        if not all(field.is_zero(value) for value in fold(equations, field.inputs, field.kind)):
            return None
        degrees = fold(parts, dict.fromkeys(parts.names, Degree()), DEGREES)
    except (UnsupportedOperation, ZeroDivisionError, ValueError):
        return None
    transcendental = any(step.op not in _POLYNOMIAL for step in parts.steps)
    if transcendental or any(d.denominator for d in degrees):
        return None
    return max(0 if d.number is not None else d.numerator for d in degrees)


_POLYNOMIAL = {"input", "constant", "add", "sub", "mul", "neg", "square", "pow", "div"}


def _find_zeros(problem: Posed, degree: int) -> tuple[tuple[float, float], ...]:
    """Zeros of the discriminant, from its values on a circle around the box, at high precision."""
    model = problem.model
    assert model.pencil is not None
    (x, y), box = tuple(problem.free), np.array([*problem.free.values()])
    centre, radius = box.mean(axis=1), float(np.linalg.norm(np.ptp(box, axis=1))) / 2 or 1.0
    fixed = problem.exactly(problem.fixed)
    bits = 128 + _BITS_PER_DEGREE * degree
    with flint.ctx.workprec(2 * bits):
        values, points = [], []
        for k in range(degree + 1):
            w = (flint.acb(2 * k) / (degree + 1)).exp_pi_i()
            z = {x: flint.arb(centre[0]) + radius * w.real, y: flint.arb(centre[1]) + radius * w.imag}
            *_, last = model.pencil(problem.parameter_set.native(problem.ordered({**fixed, **z})))
            matrix = flint.acb_mat([[-flint.acb(entry) for entry in row] for row in last])
            polynomial = matrix.charpoly()
            try:
                roots = polynomial.roots(flint.arb(2) ** -bits)
            except ValueError:
                return ()
            slope, product = polynomial.derivative(), flint.acb(1)
            for root in roots:
                product *= slope(root)
            values.append(product)
            points.append(w)
        coefficients = [
            sum((v * (flint.acb(-2 * j * k) / (degree + 1)).exp_pi_i() for k, v in enumerate(values)), flint.acb(0))
            for j in range(degree + 1)
        ]
        while coefficients and coefficients[-1].contains(0):
            coefficients.pop()
        try:
            zeros = flint.acb_poly(coefficients).roots(flint.arb(2) ** -_BITS) if len(coefficients) > 1 else []
        except ValueError:
            return ()
        return tuple(
            (float(centre[0] + radius * w.real.mid()), float(centre[1] + radius * w.imag.mid())) for w in zeros
        )
