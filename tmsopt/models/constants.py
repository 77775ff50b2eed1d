"""Numbers in formulas of CasADi that no double is: symbols of their own, named by the text of the number."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import casadi as ca
import flint

from tmsopt.arithmetic.elementary import printed
from tmsopt.arithmetic.formulas import Formulas
from tmsopt.models.expression import parse_value

_SIGN = "="
"""No parameter has a name that begins with it."""

_DIGITS = 60


@lru_cache(maxsize=4096)
def constant(text: str) -> ca.SX:
    """A number by an expression without names, such as ``sqrt(2)``: as itself where a double is it, else a symbol."""
    with flint.ctx.workdps(_DIGITS):
        exact = parse_value(text, ()).enclosure({})
        number = float(exact)
    is_double = isinstance(exact, flint.fmpq) and printed(number) == exact
    return ca.SX.sym(_SIGN + text) if number - number == 0 and not is_double else ca.SX(number)


def constants(expressions: ca.SX) -> tuple[str, ...]:
    """Texts of the numbers in expressions that no double is."""
    names = [symbol.name() for symbol in ca.symvar(expressions)]
    return tuple(name.removeprefix(_SIGN) for name in names if name.startswith(_SIGN))


def formulas(expressions: Sequence[Any], names: Sequence[str]) -> Formulas:
    """Formulas from CasADi expressions or numbers, in symbols of these names."""
    column = ca.vertcat(*[ca.SX(e) for e in expressions])
    known = {x.name(): x for x in ca.symvar(column)}
    texts = constants(column)
    symbols = [known.get(name, ca.SX.sym(name)) for name in (*names, *(_SIGN + text for text in texts))]
    inputs = ca.vertcat(*symbols) if symbols else ca.SX(0, 1)
    return rebuilt(names, texts, ca.Function("formulas", [inputs], [ca.densify(column)]))


def rebuilt(names: Sequence[str], texts: Sequence[str], exact: ca.Function) -> Formulas:
    """Formulas from plain data: a function of parameters and then of constants."""
    return Formulas(tuple(names), exact, tuple(parse_value(text, ()) for text in texts))
