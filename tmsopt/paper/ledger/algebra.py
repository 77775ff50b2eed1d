"""The words of `claims.toml`, besides its definitions: every function here, and the others of `VOCABULARY`.

Exact rational functions, certified roots, Newton's method in balls, and random rational bicycles. A polynomial in s is
a list of coefficients in descending powers: fractions, rational functions, or balls that contain the true value. A
comparison of balls is true only if it is certain.
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
"""Decimal digits carried by balls."""

Coefficients: TypeAlias = Sequence[Any]

_SOLVED = PRECISION - 15  # decimal digits of Newton's method
_RADIUS = 50  # decimal digits of the box in which a solution is proved
_COUNT = 4000  # random bicycles
_LAWS: Any = laws  # typed loosely, because the laws accept exact numbers too


@cache
def make_ring(names: str) -> dict[str, Quotient]:
    """The variables of a ring of rational functions by their names."""
    variables = flint.fmpq_mpoly_ctx.get(names.split(), "lex").gens()
    return dict(zip(names.split(), map(Quotient, variables), strict=True))


# Rational functions


def differentiate(x: Quotient, variable: Quotient) -> Quotient:
    """Derivative with respect to a variable."""
    over, under = (part.derivative(str(variable.numerator)) for part in (x.numerator, x.denominator))
    return Quotient(over * x.denominator - x.numerator * under, x.denominator**2)


def evaluate_at(x: Quotient, values: Mapping[str, Any]) -> Any:
    """A quotient at balls, fractions or quotients for all of its variables."""
    return _evaluate(x.numerator, values) / _evaluate(x.denominator, values)


def substitute(x: Quotient, /, **values: Any) -> Any:
    """A quotient with values for some of its variables; a fraction if no variable is left."""
    found = evaluate_at(x, make_ring(" ".join(x.numerator.context().names())) | values)
    constant = isinstance(found, Quotient) and found.numerator.is_constant() and found.denominator.is_constant()
    return sum(found.numerator.coeffs()) / found.denominator.leading_coefficient() if constant else found


def is_positive(x: Quotient) -> bool:
    """Whether all coefficients of numerator and denominator have one sign, so x > 0 for positive variables."""
    coefficients = [*x.numerator.coeffs(), *x.denominator.coeffs()]
    return x != 0 and any(all(sign * c > 0 for c in coefficients) for sign in (1, -1))


def vanishes_modulo(x: Quotient, modulus: Quotient) -> bool:
    """Whether a quotient vanishes with a polynomial: its numerator is a multiple of it, its denominator is not."""
    over, under = (divmod(part, modulus.numerator)[1] for part in (x.numerator, x.denominator))
    return bool(over == 0 and under != 0)


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


def _evaluate(polynomial: Any, values: Mapping[str, Any]) -> Any:
    names = polynomial.context().names()
    terms = (
        prod((values[name] ** power for name, power in zip(names, powers, strict=True) if power), start=coefficient)
        for powers, coefficient in polynomial.terms()
    )
    return sum(terms, start=flint.fmpq(0))


# Polynomials in s


def is_stable(p: Coefficients) -> bool:
    """Whether every root certainly lies in Re s < 0, by Liénard–Chipart on fractions or balls."""
    if not (p[0] > 0 or p[0] < 0):
        return False
    return all(bool(quantity > 0) for quantity in lienard_chipart([c if p[0] > 0 else -c for c in p]))


def ball_roots(p: Coefficients) -> list[Any]:
    """Isolating balls of the simple roots of a polynomial with balls for coefficients."""
    polynomial: Any = flint.acb_poly([flint.acb(c) for c in reversed(p)])
    return list(polynomial.roots())


def match_factors(
    p: Coefficients, parts: Sequence[Coefficients], guess: Mapping[str, float], known: Mapping[str, Any]
) -> dict[str, Any]:
    """The proved unknowns near a guess for which a polynomial is its leading coefficient times monic factors, in balls.

    Raises:
        ArithmeticError: if no unique solution is proved.
    """
    names = list(guess)
    sides = [(a - p[0] * m).numerator for a, m in zip(p[1:], product(*parts)[1:], strict=True)]

    def system(unknowns: Mapping[str, Any]) -> list[Any]:
        return [_evaluate(side, {**known, **unknowns}) for side in sides]

    middle = refine_solution(system, {name: flint.arb(value) for name, value in guess.items()}, names, _SOLVED)
    return dict(enclose_solution(system, middle, names, _RADIUS).balls)


# Numbers


def sqrt(x: Any) -> Any:
    """The square root of a real or complex ball, or of a fraction, as a ball."""
    return (x if isinstance(x, flint.acb) else flint.arb(x)).sqrt()


def round_to_six(x: Any) -> Any:
    """A ball to six decimals, as a fraction."""
    return rational(f"{float(x.mid()):.6f}")


# Random rational bicycles, each with the five printed conditions and its stability by Liénard–Chipart


@cache
def draw_sample() -> list[dict[str, Any]]:
    """Bicycles in every sign regime, Fr of both signs: see `describe_design`."""
    return [describe_design(*design) for design in _draw_designs()]


def describe_design(*design: Any) -> dict[str, Any]:
    """Facts about a bicycle, in fractions, from Fr, μ, χ_B, χ_H, ζ_B, ζ_H and tan λ_s.

    `skew` is a1/(Fr ζ_B); `square` is Fr_c² by flus, None if infinite; `lines` are the five conditions lscf, `admitted`
    is whether all of them hold, and `stable` is whether the bicycle is stable.
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

    for k in range(_COUNT):
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
    "laws": vars(laws),  # as the paper prints them; laws.NAME
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
