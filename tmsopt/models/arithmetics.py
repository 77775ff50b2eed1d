"""What an expression is computed in: floats and arrays, CasADi's symbols, balls; and how large it may become."""

import ast
import math
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca
import flint
import numpy as np

from tmsopt.arithmetic import elementary
from tmsopt.models.names import FUNCTIONS
from tmsopt.models.stated.degree import Degree, alone, applied, constant, same


@dataclass(frozen=True)
class Arithmetic:
    """What the functions, operators and numbers of an expression mean for one kind of values."""

    functions: Mapping[str, Callable[..., Any]]
    number: Callable[[Any], Any]
    operators: Mapping[type[ast.operator], Callable[[Any, Any], Any]]
    pi: Any = lambda: math.pi


def _as_array(value: Any) -> Any:
    """Python floats as NumPy's, which give nan and inf where Python raises."""
    return np.float64(value) if isinstance(value, float | int) else value


def _method(name: str) -> Callable[[Any], Any]:
    return lambda x: getattr(elementary.as_ball(x), name)()


BINARY: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}  # fmt: skip
SYMBOLIC = Arithmetic(
    {**{name: getattr(ca, name) for name in FUNCTIONS[:9]}, "abs": ca.fabs, "min": ca.fmin, "max": ca.fmax}, _as_array,
    BINARY,
)  # fmt: skip
NUMERIC = Arithmetic(
    {
        **{name: getattr(np, name) for name in ("sin", "cos", "tan", "sqrt", "exp", "log", "abs")},
        **{"asin": np.arcsin, "acos": np.arccos, "atan": np.arctan, "min": np.minimum, "max": np.maximum},
    },
    _as_array, BINARY,
)  # fmt: skip
BALLS = Arithmetic(
    {
        **{name: _method(name) for name in ("sin", "cos", "tan", "asin", "acos", "atan", "exp", "log")},
        "sqrt": elementary.sqrt, "abs": elementary.magnitude, "min": elementary.lesser, "max": elementary.greater,
    },
    elementary.exact, {**BINARY, ast.Div: elementary.quotient, ast.Pow: elementary.power}, flint.arb.pi,
)  # fmt: skip
DEGREES = Arithmetic(
    {
        name: applied(same if name in ("sqrt", "abs", "min", "max") else alone, compute)
        for name, compute in NUMERIC.functions.items()
    },
    lambda x: x if isinstance(x, Degree) else constant(x),
    {sign: applied(join, join) for sign, join in BINARY.items()},
    lambda: constant(math.pi),
)
