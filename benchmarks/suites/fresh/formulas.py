"""Formulas of problem files as NumPy arrays and as numbers of 50 digits.

In: a text such as ``"2*k + sqrt(c)"`` and values of its names. Out: the value in the arithmetic of a `Field`. Literals
are the decimals that they show: 0.1 is 1/10 to all the digits of the field.
"""

import ast
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import mpmath
import numpy as np

DIGITS = 80
"""Of the working precision; the verdicts need 50."""

FUNCTIONS = ("sqrt", "exp", "log", "sin", "cos", "tan")


@dataclass(frozen=True)
class Field:
    """Numbers of one kind.

    Attributes:
        number: of a decimal as text.
        functions: name → function.
    """

    number: Callable[[str], Any]
    functions: Mapping[str, Callable[..., Any]]


def many_digits() -> Any:
    """A context of `DIGITS` digits, or of those that are in use where these are more."""
    return mpmath.workdps(max(DIGITS, mpmath.mp.dps))


def _mpmath(name: str) -> Callable[[Any], Any]:
    function = getattr(mpmath, name)

    def value(x: Any) -> Any:
        with many_digits():
            return function(x)

    return value


def exact(text: str | float) -> Any:
    """A decimal, or a double, as it is."""
    with many_digits():
        return mpmath.mpf(text)


FLOATS = Field(float, {**{name: getattr(np, name) for name in FUNCTIONS}, "abs": np.abs})
MANY_DIGITS = Field(exact, {**{name: _mpmath(name) for name in FUNCTIONS}, "abs": abs})

_OPERATORS: dict[type, Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}


@cache
def _tree(text: str) -> ast.expr:
    return ast.parse(text.strip(), mode="eval").body


def evaluate(text: str, values: Mapping[str, Any], field: Field) -> Any:
    """The value of an expression.

    Raises:
        ValueError: for anything but numbers, names, functions and operators.
    """

    def value(node: ast.expr) -> Any:
        match node:
            case ast.Constant():
                decimal = ast.get_source_segment(text.strip(), node) or ""
                return field.number(decimal.rstrip("j")) * (1j if decimal.endswith("j") else 1)
            case ast.Name(id=name):
                return values[name]
            case ast.BinOp(left=left, op=op, right=right):
                return _OPERATORS[type(op)](value(left), value(right))
            case ast.UnaryOp(op=op, operand=operand):
                return _OPERATORS[type(op)](value(operand))
            case ast.Call(func=ast.Name(id=name), args=args):
                return field.functions[name](*map(value, args))
        raise ValueError(f"{text}: {ast.dump(node)}")

    with many_digits():
        return value(_tree(text))


def sides(text: str) -> tuple[str, str, str]:
    """Left side, sign and right side of a limit."""
    sign = next(s for s in ("<=", ">=", "==") if s in text)
    left, right = text.split(sign)
    return left, sign, right


def excess(text: str, values: Mapping[str, Any], field: Field) -> tuple[Any, Any]:
    """By how much a limit is violated, negative where it holds, and the size of its right side, at least 1."""
    left, sign, right = sides(text)
    a, b = evaluate(left, values, field), evaluate(right, values, field)
    return {"<=": a - b, ">=": b - a, "==": abs(a - b)}[sign], max(abs(b), 1)


def names(text: str) -> set[str]:
    """The names in an expression or a limit."""
    return {node.id for node in ast.walk(ast.parse(text.strip(), mode="eval")) if isinstance(node, ast.Name)}
