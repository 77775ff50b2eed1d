"""The algebra of `claims.toml`: exact rational functions, certified roots, and Newton's method in balls.

A polynomial in s is a list of coefficients in descending powers: fractions, rational functions, or balls that contain
the true value. A comparison of balls is true only if it is certain.
"""

from collections.abc import Callable, Mapping, Sequence
from math import prod
from typing import Any, TypeAlias

import flint

from tmsopt.algebra.balls import rational
from tmsopt.algebra.identity import Quotient
from tmsopt.algebra.krawczyk import enclose_solution, refine_solution
from tmsopt.roots.exact import isolated_roots
from tmsopt.roots.polynomial import determinant, product
from tmsopt.roots.stability import lienard_chipart

PRECISION = 80
"""Decimal digits carried by balls."""

Ball: TypeAlias = Any  # flint.arb
Coefficients: TypeAlias = Sequence[Any]

_SOLVED = PRECISION - 15  # decimal digits of Newton's method
_RADIUS = 50  # decimal digits of the box in which a solution is proved


def make_ring(names: str) -> dict[str, Quotient]:
    """The variables of a ring of rational functions by their names."""
    variables = flint.fmpq_mpoly_ctx.get(names.split(), "lex").gens()
    return dict(zip(names.split(), map(Quotient, variables), strict=True))


# Rational functions


def differentiate(x: Quotient, variable: Quotient) -> Quotient:
    """Derivative with respect to a variable."""
    over, under = (part.derivative(str(variable.numerator)) for part in (x.numerator, x.denominator))
    return Quotient(over * x.denominator - x.numerator * under, x.denominator**2)


def depends_on(x: Quotient, variable: Quotient) -> bool:
    """Whether a quotient depends on a variable."""
    return bool(differentiate(x, variable) != 0)


def evaluate_at(x: Quotient, values: Mapping[str, Any]) -> Any:
    """A quotient at balls, fractions or quotients for all of its variables."""
    return _evaluation(x.numerator)(values) / _evaluation(x.denominator)(values)


def substitute(x: Quotient, /, **values: Any) -> Any:
    """A quotient with values for some of its variables; a fraction if no variable is left."""
    found = evaluate_at(x, make_ring(" ".join(x.numerator.context().names())) | values)
    constant = isinstance(found, Quotient) and found.numerator.is_constant() and found.denominator.is_constant()
    return sum(found.numerator.coeffs()) / found.denominator.leading_coefficient() if constant else found


def is_positive(x: Quotient) -> bool:
    """Whether all coefficients of numerator and denominator have one sign, so x > 0 for positive variables."""
    return any(
        all(sign * c > 0 for c in [*x.numerator.coeffs(), *x.denominator.coeffs()]) and x != 0 for sign in (1, -1)
    )


def vanishes_modulo(x: Quotient, modulus: Quotient) -> bool:
    """Whether a quotient vanishes with a polynomial: its numerator is a multiple of it, its denominator is not."""
    return bool(divmod(x.numerator, modulus.numerator)[1] == 0 and divmod(x.denominator, modulus.numerator)[1] != 0)


def list_coefficients(x: Quotient, variable: Quotient) -> Coefficients:
    """Coefficients of a numerator in a single variable, descending."""
    terms = {powers[_index_of(x, variable)]: c for powers, c in x.numerator.to_dict().items()}
    return [terms.get(k, flint.fmpq(0)) for k in range(max(terms), -1, -1)]


def degree_in(x: Quotient, variable: Quotient) -> int:
    """Degree of the numerator in a variable."""
    return int(x.numerator.degrees()[_index_of(x, variable)])


def _index_of(x: Quotient, variable: Quotient) -> int:
    return int(x.numerator.context().variable_to_index(str(variable.numerator)))


def factorise(x: Quotient) -> list[Quotient]:
    """The irreducible factors of the numerator, once each."""
    return [Quotient(factor) for factor, _ in x.numerator.factor()[1]]


def resultant(x: Quotient, y: Quotient, variable: Quotient) -> Quotient:
    """Resultant of two numerators: it vanishes where both vanish for the same value of the variable."""
    return Quotient(x.numerator.resultant(y.numerator, str(variable.numerator)))


# Polynomials in s


def is_stable(p: Coefficients) -> bool:
    """Whether every root certainly lies in Re s < 0, by Liénard–Chipart on fractions or balls."""
    if not (p[0] > 0 or p[0] < 0):
        return False
    return all(bool(quantity > 0) for quantity in lienard_chipart([c if p[0] > 0 else -c for c in p]))


def certified_roots(p: Coefficients) -> list[Any]:
    """Isolating balls of the roots of a polynomial with fractions, repeated by multiplicity."""
    return [z for z, multiplicity in isolated_roots(p) for _ in range(multiplicity)]


def ball_roots(p: Coefficients) -> list[Any]:
    """Isolating balls of the simple roots of a polynomial with balls for coefficients."""
    polynomial: Any = flint.acb_poly([flint.acb(c) for c in reversed(p)])
    return list(polynomial.roots())


def count_real_roots(p: Coefficients) -> int:
    """Number of real roots of a polynomial with fractions, with multiplicity."""
    return sum(z.imag == 0 for z in certified_roots(p))


def is_heavily_damped(p: Coefficients) -> bool:
    """Whether all roots of a polynomial with fractions are simple, real and negative."""
    return all(m == 1 and z.imag == 0 and bool(z.real < 0) for z, m in isolated_roots(p))


# Systems of equations in balls


def match_factors(
    p: Coefficients, parts: Sequence[Coefficients], guess: Mapping[str, float], known: Mapping[str, Any]
) -> dict[str, Ball]:
    """The proved unknowns near a guess for which a polynomial is its leading coefficient times monic factors.

    Raises:
        ArithmeticError: if no unique solution is proved.
    """
    names = list(guess)
    sides = [_evaluation(equation.numerator) for equation in _differences(p, parts)]

    def system(unknowns: Mapping[str, Any]) -> list[Any]:
        return [side({**known, **unknowns}) for side in sides]

    middle = refine_solution(system, {name: flint.arb(value) for name, value in guess.items()}, names, _SOLVED)
    return dict(enclose_solution(system, middle, names, _RADIUS).balls)


def tangent(p: Coefficients, parts: Sequence[Coefficients], names: str, point: Mapping[str, Any]) -> list[Ball]:
    """The direction, at a point, of the curve on which a polynomial has monic factors (one unknown more)."""
    rows = [equation.numerator for equation in _differences(p, parts)]
    return kernel([[_evaluation(row.derivative(name))(point) for name in names.split()] for row in rows])


def kernel(matrix: Sequence[Sequence[Any]]) -> list[Any]:
    """A null vector of a matrix with one more column than rows."""
    leave = range(len(matrix) + 1)
    return [(-1) ** k * det([[e for j, e in enumerate(row) if j != k] for row in matrix]) for k in leave]


def det(matrix: Sequence[Sequence[Any]]) -> Any:
    """A determinant."""
    return determinant([[[entry] for entry in row] for row in matrix])[0]


def _differences(p: Coefficients, parts: Sequence[Coefficients]) -> list[Any]:
    """Differences between a polynomial and its leading coefficient times the product of monic factors."""
    return [a - p[0] * m for a, m in zip(p[1:], product(*parts)[1:], strict=True)]


def _evaluation(polynomial: Any) -> Callable[[Mapping[str, Any]], Any]:
    """A function that evaluates a polynomial repeatedly."""
    names = polynomial.context().names()
    terms = [
        (coefficient, [(name, power) for name, power in zip(names, powers, strict=True) if power])
        for powers, coefficient in polynomial.to_dict().items()
    ]

    def value(values: Mapping[str, Any]) -> Any:
        return sum(
            (prod((values[n] ** power for n, power in powers), start=c) for c, powers in terms), start=flint.fmpq(0)
        )

    return value


# Balls


def sqrt(x: Any) -> Any:
    """The square root of a real or complex ball, or of a fraction, as a ball."""
    return (x if isinstance(x, flint.acb) else flint.arb(x)).sqrt()


def is_zero(x: Ball) -> bool:
    """Whether a ball contains 0 and is within 1e-40 of it."""
    return bool(x.contains(0) and abs(x) < rational("1e-40"))


def round_to_six(x: Ball) -> Any:
    """A ball to six decimals, as a fraction."""
    return rational(f"{float(x.mid()):.6f}")
