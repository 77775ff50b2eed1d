"""What an expression is computed in: floats and arrays, CasADi's symbols, balls; and how large it may become."""

import ast
import math
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import casadi as ca
import flint
import numpy as np

from tmsopt.algebra import elementary
from tmsopt.models.names import CONSTANTS, FUNCTIONS
from tmsopt.models.stated.degree import Degree, alone, applied, constant, same


@dataclass(frozen=True)
class Arithmetic:
    """What the functions, operators and numbers of an expression mean for one kind of values.

    Attributes:
        literal: from a number, as Python reads it and as it is written.
        constant: from the text of a part without names; None where such a part is computed as any other.
    """

    functions: Mapping[str, Callable[..., Any]]
    number: Callable[[Any], Any]
    operators: Mapping[type[ast.operator], Callable[[Any, Any], Any]]
    pi: Callable[[], Any] = lambda: math.pi
    literal: Callable[[Any, str], Any] = lambda value, text: float(value)
    constant: Callable[[str], Any] | None = None


def _as_array(value: Any) -> Any:
    """Python floats as NumPy's, which give nan and inf where Python raises."""
    return np.float64(value) if isinstance(value, float | int) else value


def _method(name: str) -> Callable[[Any], Any]:
    return lambda x: getattr(elementary.as_ball(x), name)()


def _fraction(value: Any, text: str) -> Any:
    """A number as its digits say; a nought may have any exponent, and 10 to that power is not to be computed."""
    return elementary.rational(Fraction(value if isinstance(value, int) or not value else text.replace("_", "")))


BINARY: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
SYMBOLIC = Arithmetic(
    {**{name: getattr(ca, name) for name in FUNCTIONS[:9]}, "abs": ca.fabs, "min": ca.fmin, "max": ca.fmax},
    _as_array,
    BINARY,
)
NUMERIC = Arithmetic(
    {
        **{name: getattr(np, name) for name in ("sin", "cos", "tan", "sqrt", "exp", "log", "abs")},
        **{"asin": np.arcsin, "acos": np.arccos, "atan": np.arctan, "min": np.minimum, "max": np.maximum},
    },
    _as_array,
    BINARY,
)
BALLS = Arithmetic(
    {
        **{name: _method(name) for name in ("sin", "cos", "tan", "asin", "acos", "atan", "exp", "log")},
        "sqrt": elementary.sqrt,
        "abs": elementary.magnitude,
        "min": elementary.lesser,
        "max": elementary.greater,
    },
    elementary.exact,
    {**BINARY, ast.Div: elementary.quotient, ast.Pow: elementary.power},
    flint.arb.pi,
    _fraction,
)
DEGREES = Arithmetic(
    {
        name: applied(same if name in ("sqrt", "abs", "min", "max") else alone, compute)
        for name, compute in NUMERIC.functions.items()
    },
    lambda x: x if isinstance(x, Degree) else constant(x),
    {sign: applied(join, join) for sign, join in BINARY.items()},
    lambda: constant(math.pi),
)


def note_constants(body: ast.expr, text: str) -> None:
    """Note the text of every part without names, for `constant_text`."""
    for node in reversed(list(ast.walk(body))):  # parts before the whole
        if isinstance(node, ast.expr):
            parts = node.args if isinstance(node, ast.Call) else ast.iter_child_nodes(node)
            known = all(constant_text(part) for part in parts if isinstance(part, ast.expr))
            if isinstance(node, ast.Name):
                known = node.id in CONSTANTS
            own = text[node.col_offset : node.end_col_offset]
            node.constant_text = own if known else ""  # type: ignore[attr-defined]


def constant_texts(body: ast.expr) -> list[str]:
    """The parts without names, each as large as it can be."""
    if own := constant_text(body):
        return [own]
    parts = body.args if isinstance(body, ast.Call) else ast.iter_child_nodes(body)
    return [text for part in parts if isinstance(part, ast.expr) for text in constant_texts(part)]


def constant_text(node: ast.expr) -> str:
    """The text of a part without names; empty for any other."""
    return str(node.constant_text)  # type: ignore[attr-defined]
