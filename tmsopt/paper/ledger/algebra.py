"""The functions that `claims.toml` can use: every function of this module, and the others in `VOCABULARY`.

They compute with exact rational functions, certified roots, Newton's method, and random rational bicycles. A *ball* is
an interval, a midpoint with a radius, that contains the true value; a comparison of balls is true only if it is
certain. A polynomial in s is a list of coefficients in descending powers: fractions, rational functions or balls.
"""

import random
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from inspect import isfunction
from math import prod
from typing import Any, TypeAlias

import flint

from tmsopt import laws
from tmsopt.algebra.balls import Tilt, rational
from tmsopt.algebra.identity import Quotient
from tmsopt.algebra.krawczyk import enclose_solution, refine_solution
from tmsopt.models import copo, matrices, tms
from tmsopt.paper.ledger.entry import judge_decimal
from tmsopt.roots.exact import isolated_roots
from tmsopt.roots.polynomial import determinant, evaluate, product, quadratic_pencil, shift
from tmsopt.roots.stability import lienard_chipart

PRECISION = 80
"""Decimal digits with which balls are computed."""

Coefficients: TypeAlias = Sequence[Any]

_NEWTON_DIGITS = PRECISION - 15  # decimal digits to which Newton's method converges
_BOX_DIGITS = 50  # decimal digits of the box in which a solution is proved
_SAMPLE_SIZE = 4000  # number of random bicycles
_LAWS: Any = laws  # the type is Any, because the laws accept exact numbers too


@cache
def make_ring(names: str) -> dict[str, Quotient]:
    """A ring of rational functions: name → variable."""
    variables = flint.fmpq_mpoly_ctx.get(names.split(), "lex").gens()
    return dict(zip(names.split(), map(Quotient, variables), strict=True))


# Rational functions


def differentiate(x: Quotient, variable: Quotient) -> Quotient:
    """Derivative of a rational function with respect to a variable."""
    numerator, denominator = (part.derivative(str(variable.numerator)) for part in (x.numerator, x.denominator))
    return Quotient(numerator * x.denominator - x.numerator * denominator, x.denominator**2)


def evaluate_at(x: Quotient, values: Mapping[str, Any]) -> Any:
    """The value of a quotient for given values of all its variables: balls, fractions or quotients."""
    return _evaluate(x.numerator, values) / _evaluate(x.denominator, values)


def substitute(x: Quotient, /, **values: Any) -> Any:
    """Substitute values for some variables of a quotient; the result is a fraction if no variable remains."""
    result = evaluate_at(x, make_ring(" ".join(x.numerator.context().names())) | values)
    is_constant = isinstance(result, Quotient) and result.numerator.is_constant() and result.denominator.is_constant()
    return sum(result.numerator.coeffs()) / result.denominator.leading_coefficient() if is_constant else result


def is_positive(x: Quotient) -> bool:
    """Whether all coefficients of numerator and denominator have one sign, so that x > 0 for positive variables."""
    coefficients = [*x.numerator.coeffs(), *x.denominator.coeffs()]
    return x != 0 and any(all(sign * c > 0 for c in coefficients) for sign in (1, -1))


def vanishes_modulo(x: Quotient, modulus: Quotient) -> bool:
    """Whether a polynomial divides the numerator of a quotient, but not its denominator."""
    numerator, denominator = (divmod(part, modulus.numerator)[1] for part in (x.numerator, x.denominator))
    return bool(numerator == 0 and denominator != 0)


def list_coefficients(x: Quotient, variable: Quotient) -> Coefficients:
    """Coefficients of the numerator, which has a single variable, in descending powers."""
    terms = {powers[_index_of(x, variable)]: c for powers, c in x.numerator.to_dict().items()}
    return [terms.get(k, flint.fmpq(0)) for k in range(max(terms), -1, -1)]


def degree_in(x: Quotient, variable: Quotient) -> int:
    """Degree of the numerator in a variable."""
    return int(x.numerator.degrees()[_index_of(x, variable)])


def _index_of(x: Quotient, variable: Quotient) -> int:
    return int(x.numerator.context().variable_to_index(str(variable.numerator)))


def factorise(x: Quotient) -> list[Quotient]:
    """The different irreducible factors of the numerator."""
    return [Quotient(factor) for factor, _ in x.numerator.factor()[1]]


def resultant(x: Quotient, y: Quotient, variable: Quotient) -> Quotient:
    """Resultant of two numerators; it vanishes where both have a common zero in the variable."""
    return Quotient(x.numerator.resultant(y.numerator, str(variable.numerator)))


def _evaluate(polynomial: Any, values: Mapping[str, Any]) -> Any:
    names = polynomial.context().names()
    terms = (
        prod((values[name] ** power for name, power in zip(names, powers, strict=True) if power), start=coefficient)
        for powers, coefficient in polynomial.terms()
    )
    return sum(terms, start=flint.fmpq(0))


# Polynomials in s


def is_stable(p: Coefficients) -> bool:
    """Whether every root certainly has Re s < 0, by the Liénard–Chipart conditions for fractions or balls."""
    if not (p[0] > 0 or p[0] < 0):
        return False
    return all(bool(quantity > 0) for quantity in lienard_chipart([c if p[0] > 0 else -c for c in p]))


def ball_roots(p: Coefficients) -> list[Any]:
    """Isolating balls of the simple roots of a polynomial whose coefficients are balls."""
    polynomial: Any = flint.acb_poly([flint.acb(c) for c in reversed(p)])
    return list(polynomial.roots())


def match_factors(
    p: Coefficients, factors: Sequence[Coefficients], guess: Mapping[str, float], known_values: Mapping[str, Any]
) -> dict[str, Any]:
    """Solve for unknowns near a guess, so that a polynomial is its leading coefficient times monic factors.

    The result is unknown → ball; exactly one solution is proved to lie in these balls.

    Raises:
        ArithmeticError: if no unique solution is proved.
    """
    names = list(guess)
    sides = [(a - p[0] * m).numerator for a, m in zip(p[1:], product(*factors)[1:], strict=True)]

    def system(unknowns: Mapping[str, Any]) -> list[Any]:
        return [_evaluate(side, {**known_values, **unknowns}) for side in sides]

    middle = refine_solution(system, {name: flint.arb(value) for name, value in guess.items()}, names, _NEWTON_DIGITS)
    return dict(enclose_solution(system, middle, names, _BOX_DIGITS).balls)


# Numbers


def sqrt(x: Any) -> Any:
    """The square root of a real or complex ball, or of a fraction, as a ball."""
    return (x if isinstance(x, flint.acb) else flint.arb(x)).sqrt()


def round_to_six(x: Any) -> Any:
    """The midpoint of a ball, rounded to six decimals, as a fraction."""
    return rational(f"{float(x.mid()):.6f}")


# Random rational bicycles, each with the five conditions of the paper and with its stability by Liénard–Chipart


@cache
def draw_sample() -> list[dict[str, Any]]:
    """Random bicycles, in which parameters, and also Fr, have both signs; see `describe_design`."""
    return [describe_design(*design) for design in _draw_designs()]


def describe_design(*design: Any) -> dict[str, Any]:
    """Facts about a bicycle, in fractions, from Fr, μ, χ_B, χ_H, ζ_B, ζ_H and tan λ_s.

    `skew` is a1/(Fr ζ_B). `square` is Fr_c² by equation flus, None if it is infinite. `lines` are the five conditions
    of equation lscf, `admitted` says whether all of them hold, and `stable` whether the bicycle is stable.
    """
    Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T = map(rational, design)
    skew = zeta_B * chi_H - zeta_H * chi_B
    square = _LAWS.flus(mu, chi_B, chi_H, zeta_B, zeta_H, Tilt(T)) if skew != 0 else None
    lines = [chi_H > 1 + zeta_H * T, chi_H < 1 - zeta_B / mu * T, chi_H < chi_B, zeta_H > zeta_B]
    lines.append(square is not None and square > 0 and Fr > 0 and Fr * Fr > square)
    facts = {"Fr": Fr, "chi_H": chi_H, "T": T, "skew": skew, "square": square, "lines": lines}
    return facts | {"admitted": all(lines), "stable": is_stable(copo(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T))}


def _draw_designs() -> Iterator[tuple[Any, ...]]:
    pick = random.Random(1)

    def tenths(low: int, high: int) -> Any:
        return rational(pick.randint(10 * low, 10 * high)) / 10

    def one_of(*values: int) -> Any:
        return rational(pick.choice(values))

    for k in range(_SAMPLE_SIZE):
        chi_H = 1 + tenths(-1, 1) / 3 if k % 2 else tenths(-2, 3)
        zeta_B, zeta_H = -rational(pick.randint(1, 40)) / 20, -rational(pick.randint(0, 40)) / 20
        mu, T = one_of(1, 2, 5, 10, 50, 200) / 10, one_of(1, 3, 7, 15, 60) / 10
        Fr = tenths(0, 8) + rational("1/20")
        forward, right = one_of(1, 1, 1, -1), one_of(1, -1)
        yield forward * Fr, mu, tenths(-2, 3) + rational("1/50"), chi_H, zeta_B, zeta_H, right * T


_BUILT_IN: Any = (abs, all, any, dict, int, len, list, max, min, range, sum)
_IMPORTED: Any = (copo, determinant, draw_sample, evaluate, isolated_roots, matrices, quadratic_pencil, shift, Tilt)

VOCABULARY: Mapping[str, Any] = {
    **{name: word for name, word in globals().items() if isfunction(word)},
    **{word.__name__: word for word in (*_BUILT_IN, *_IMPORTED)},
    "laws": vars(laws),  # laws as the paper prints them; an expression calls laws.NAME
    "SI_PARAMETERS": [name for name in tms.sets[1].names if name != "g"],
    "verdict_on": lambda printed, value: judge_decimal(printed, value).verdict,
    "ball": flint.arb,
    "complex_ball": flint.acb,
    "pi": flint.arb.pi,
    "tan": lambda x: flint.arb(x).tan(),
    "atan": lambda x: flint.arb(x).atan(),
    "overlap": lambda x, y: flint.arb(x).overlaps(flint.arb(y)),
    "real": lambda z: z.real,
    "imaginary": lambda z: z.imag,
    "middle": lambda x: float(x.mid()),
    "rank": lambda rows: flint.fmpz_mat(rows).rank(),
}
