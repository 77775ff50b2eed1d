"""Exact polynomials and quotients, balls, certified roots and Newton's method in balls."""

from collections.abc import Callable, Mapping, Sequence
from math import prod
from typing import Any, TypeAlias

import flint

from tmsopt.arithmetic.elementary import rational
from tmsopt.arithmetic.identity import Quotient
from tmsopt.arithmetic.krawczyk import enclosed, refined
from tmsopt.roots.exact import isolated_roots
from tmsopt.roots.polynomial import determinant, product, shift
from tmsopt.roots.stability import lienard_chipart

PRECISION = 80
"""Decimal digits carried by balls."""

Polynomial: TypeAlias = Any  # flint.fmpq_mpoly
Ball: TypeAlias = Any  # flint.arb

_SOLVED = PRECISION - 15  # decimal digits to which Newton's method goes
_RADIUS = 50  # of the box in which a solution is proved


def q(text: str | int) -> Any:
    """An exact fraction from decimal or fraction text."""
    return rational(text)


def ring(names: str) -> tuple[Quotient, ...]:
    """The variables of a ring of rational functions, as quotients."""
    return tuple(Quotient(x, x * 0 + 1) for x in polynomials(names))


def polynomials(names: str) -> tuple[Polynomial, ...]:
    """The variables of a polynomial ring over the rationals."""
    return tuple(flint.fmpq_mpoly_ctx.get(names.split(), "lex").gens())


def vanishes(value: Quotient, modulo: Polynomial) -> bool:
    """Whether a quotient is 0 where `modulo` is: its numerator is a multiple, its denominator is not."""
    return bool(divmod(value.over, modulo)[1] == 0 and divmod(value.under, modulo)[1] != 0)


def evaluate(polynomial: Polynomial, at: Mapping[str, Any]) -> Ball:
    """Value of a polynomial at balls, by the names of its variables."""
    return _evaluation(polynomial)(at)


def _evaluation(polynomial: Polynomial) -> Callable[[Mapping[str, Any]], Ball]:
    """Its value as a function, for those who need it often."""
    names = polynomial.context().names()
    terms = [
        (flint.arb(coefficient), [(name, power) for name, power in zip(names, powers, strict=True) if power])
        for powers, coefficient in polynomial.to_dict().items()
    ]

    def value(at: Mapping[str, Any]) -> Ball:
        each = (prod((at[name] ** power for name, power in factors), start=term) for term, factors in terms)
        return sum(each, flint.arb(0))

    return value


def substitute(polynomial: Polynomial, values: Mapping[str, Any]) -> Polynomial:
    """A polynomial with some variables replaced by fractions."""
    return polynomial.subs(dict(values))


def positive(polynomial: Polynomial) -> bool:
    """Whether every coefficient is positive, so that the polynomial is, where all variables are positive."""
    coefficients = list(polynomial.coeffs())
    return bool(coefficients) and all(c > 0 for c in coefficients)


def positive_quotient(value: Quotient) -> bool:
    """Likewise for a quotient."""
    return any(positive(sign * value.over) and positive(sign * value.under) for sign in (1, -1))


# Polynomials in one variable, coefficients descending


def stable(coefficients: Sequence[Any]) -> bool:
    """Whether every root lies in Re s < 0, certainly: Liénard–Chipart on fractions or balls."""
    leading = coefficients[0]
    if not (leading > 0 or leading < 0):
        return False
    signed = [c if leading > 0 else -c for c in coefficients]
    return all(bool(quantity > 0) for quantity in lienard_chipart(signed))


def real_roots(coefficients: Sequence[Any]) -> int:
    """How many of its roots are real, with multiplicity, certainly."""
    return sum(m for z, m in isolated_roots(coefficients) if z.imag == 0)


def stable_left_of(coefficients: Sequence[Any], gamma: Any) -> bool:
    """Whether every root lies in Re s < gamma, certainly."""
    return stable(shift(coefficients, gamma))


def unstable(coefficients: Sequence[Any]) -> bool:
    """Whether some root lies in Re s > 0, by isolating balls around the roots."""
    return any(bool(z.real > 0) for z, _ in isolated_roots(coefficients))


def ball_roots(coefficients: Sequence[Ball]) -> list[Any]:
    """Certified isolating balls of the simple roots of a polynomial with balls for coefficients."""
    polynomial: Any = flint.acb_poly([flint.acb(c) for c in reversed(coefficients)])
    found: list[Any] = polynomial.roots()
    return found


def heavily_damped(coefficients: Sequence[Any]) -> bool:
    """Whether all roots of a polynomial with fractions are simple, real and negative."""
    found = isolated_roots(coefficients)
    return all(m == 1 and z.imag == 0 and bool(z.real < 0) for z, m in found)


# Systems of equations in balls


def matched(
    coefficients: Sequence[Polynomial], factors: Sequence[Sequence[Any]], guess: Mapping[str, float],
    known: Mapping[str, Any],
) -> dict[str, Ball]:  # fmt: skip
    """The unknowns near a guess with which a polynomial is its leading coefficient times monic factors, proved.

    Raises:
        ArithmeticError: where no unique solution is proved.
    """
    names = list(guess)
    with flint.ctx.workdps(PRECISION):
        sides = [_evaluation(equation) for equation in _differences(coefficients, factors)]

        def system(at: Mapping[str, Any]) -> list[Any]:
            return [side({**known, **at}) for side in sides]

        middle = refined(system, {name: flint.arb(value) for name, value in guess.items()}, names, _SOLVED)
        return dict(enclosed(system, middle, names, _RADIUS).balls)


def minors(matrix: Sequence[Sequence[Any]]) -> list[Any]:
    """The determinants of a matrix with one more column than rows, each without one column."""
    rows = [[[entry] for entry in row] for row in matrix]
    return [
        determinant([[e for k, e in enumerate(row) if k != leave] for row in rows])[0] for leave in range(len(rows) + 1)
    ]


def _differences(coefficients: Sequence[Any], factors: Sequence[Sequence[Any]]) -> list[Any]:
    """What must vanish for a polynomial to be its leading coefficient times the product of monic factors."""
    return [a - coefficients[0] * m for a, m in zip(coefficients[1:], product(*factors)[1:], strict=True)]


def slope(quotient: Quotient, name: str) -> Quotient:
    """Derivative of a quotient with respect to a variable."""
    over, under = quotient.over, quotient.under
    return Quotient(over.derivative(name) * under - over * under.derivative(name), under**2)


def depends(quotient: Quotient, name: str) -> bool:
    """Whether a quotient depends on a variable."""
    return bool(slope(quotient, name) != 0)


def kernel(matrix: Sequence[Sequence[Ball]]) -> list[Ball]:
    """The vector, up to a factor, that a matrix with one more column than rows maps to 0."""
    return [m if k % 2 == 0 else -m for k, m in enumerate(minors(matrix))]


def jacobian(equations: Sequence[Polynomial], names: Sequence[str], at: Mapping[str, Any]) -> list[list[Ball]]:
    """Derivatives of polynomials at balls, a row per polynomial."""
    return [[evaluate(e.derivative(name), at) for name in names] for e in equations]


def tangent(
    coefficients: Sequence[Polynomial], factors: Sequence[Sequence[Any]], names: Sequence[str], at: Mapping[str, Any]
) -> list[Ball]:
    """The direction of the curve of one unknown more on which a polynomial has monic factors, at a point of it."""
    return kernel(jacobian(_differences(coefficients, factors), names, at))


def composed(quotient: Quotient, at: Mapping[str, Quotient]) -> Quotient:
    """A quotient with quotients put in for its variables."""

    def put(polynomial: Any) -> Quotient:
        names = polynomial.context().names()
        total = 0 * at[names[0]]
        for powers, coefficient in polynomial.to_dict().items():
            term = total * 0 + coefficient
            for name, power in zip(names, powers, strict=True):
                term = term * at[name] ** power
            total = total + term
        return total

    return put(quotient.over) / put(quotient.under)
