"""tan, sqrt and positive part of whatever number a formula is given: floats, arrays, CasADi expressions, balls."""

from typing import Any

import casadi as ca
import numpy as np


def tan(x: Any) -> Any:
    """Tangent of x (radians); of a symbolic arctangent, its argument, so that formulas in tan stay polynomial."""
    if hasattr(x, "is_op") and x.is_op(ca.OP_ATAN):
        return x.dep(0)
    return x.tan() if hasattr(x, "tan") else np.tan(np.asarray(x, dtype=float))[()]


def sqrt(x: Any) -> Any:
    """Square root of x; nan, without a warning, for a negative float."""
    if hasattr(x, "sqrt"):
        return x.sqrt()
    with np.errstate(invalid="ignore"):
        return np.sqrt(np.asarray(x, dtype=float))[()]


def positive_part(x: Any) -> Any:
    """x where it is positive, else 0; exact, for (x + |x|)/2 only doubles and halves."""
    return (x + abs(x)) / 2
