"""Formulas as plain data that another process can read: nested tuples, with doubles below and above each number."""

from collections.abc import Sequence
from typing import Any

import flint

from tmsopt.arithmetic.formal import Formal, Symbol, by_symbol
from tmsopt.arithmetic.intervals import interval
from tmsopt.arithmetic.walk import NotAccepted

Tree = tuple[Any, ...]
"""``("x", number of a variable)``, ``("c", least, greatest)``, ``("+", tree, tree)``, ``("*", tree, tree)``,
``("^", tree, power)``, or ``(function, tree)``."""

PARTIAL = ("inv", "sqrt", "asin", "acos")
"""Functions that do not exist, or have no slope, somewhere; not log, at which codac 2.1.2 ends its process."""

_FUNCTIONS = (*PARTIAL, "abs", "exp", "sin", "cos", "atan")


def tree(formula: Any, names: Sequence[str]) -> Tree:
    """A formula in variables of these names, each taken out of as many terms as hold it (Horner's rule).

    Raises:
        NotAccepted: for another function than these.
    """
    return _of_terms(formula.terms if isinstance(formula, Formal) else {(): formula}, names)


def _of_terms(terms: Any, names: Sequence[str]) -> Tree:
    if (parts := by_symbol(terms)) is None:
        return ("c", *ends(terms.get((), flint.fmpq(0))))
    symbol, power, inner, rest = parts
    taken = _of_symbol(symbol, names)
    if power > 1:
        taken = ("^", taken, power)
    factor = _of_terms(inner, names)
    if factor != ("c", 1.0, 1.0):
        taken = ("*", factor, taken)
    return ("+", taken, _of_terms(rest, names)) if rest else taken


def _of_symbol(symbol: Symbol, names: Sequence[str]) -> Tree:
    if symbol.argument is None:
        return ("x", names.index(symbol.name))
    if symbol.name not in _FUNCTIONS:
        raise NotAccepted(symbol.name)
    return (symbol.name, tree(symbol.argument, names))


def ends(number: Any) -> tuple[float, float]:
    """Doubles below and above a number, or twice the double that it is."""
    ball = flint.arb(number)
    if ball.is_finite() and ball.is_exact() and flint.arb(float(ball)) == ball:
        return float(ball), float(ball)
    return interval(ball)


def partial(found: Tree) -> set[tuple[str, Tree]]:
    """Functions in a tree that must be looked at before slopes are taken, with their arguments."""
    own = {(found[0], found[1])} if found[0] in PARTIAL else set()
    return own.union(*(partial(part) for part in found[1:] if isinstance(part, tuple)))
