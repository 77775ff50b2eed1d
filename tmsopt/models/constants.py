"""Numbers in formulas of CasADi, which folds them to doubles: symbols of their own, named by the text of the number."""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import casadi as ca

from tmsopt.algebra.formulas import Formulas
from tmsopt.models.exact import constant
from tmsopt.models.expression import parse_value

_SIGN = "="
"""No parameter has a name that begins with it."""


@lru_cache(maxsize=4096)
def number_symbol(text: str) -> ca.SX:
    """A symbol for an expression without names, such as ``sqrt(2)``; 0 and what has no value are constants."""
    try:
        number = float(constant(text))
    except ValueError:
        return ca.SX(math.nan)
    return ca.SX.sym(_SIGN + text) if number else ca.SX(0.0)


def number_of(symbol: ca.SX) -> float | None:
    """The number that a symbol stands for, or that is a constant of CasADi; None for anything else."""
    if symbol.is_constant():
        return float(symbol)
    name = symbol.name() if symbol.is_symbolic() else ""
    return float(constant(name.removeprefix(_SIGN))) if name.startswith(_SIGN) else None


def number_texts(expressions: ca.SX) -> tuple[str, ...]:
    """Texts of the numbers in expressions."""
    names = [symbol.name() for symbol in ca.symvar(expressions)]
    return tuple(name.removeprefix(_SIGN) for name in names if name.startswith(_SIGN))


def formulas(expressions: Sequence[Any], names: Sequence[str]) -> Formulas:
    """Formulas from CasADi expressions or numbers, in symbols of these names."""
    column = ca.vertcat(*[ca.SX(e) for e in expressions])
    known = {x.name(): x for x in ca.symvar(column)}
    texts = number_texts(column)
    symbols = [known.get(name, ca.SX.sym(name)) for name in (*names, *(_SIGN + text for text in texts))]
    inputs = ca.vertcat(*symbols) if symbols else ca.SX(0, 1)
    return rebuilt(names, texts, ca.Function("formulas", [inputs], [ca.densify(column)]))


def rebuilt(names: Sequence[str], texts: Sequence[str], exact: ca.Function) -> Formulas:
    """Formulas from plain data: a function of parameters and then of constants."""
    return Formulas(tuple(names), exact, tuple(parse_value(text, ()) for text in texts))
