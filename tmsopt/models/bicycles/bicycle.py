"""Formulas of quantities that bicycles of every model have."""

from collections.abc import Mapping
from typing import Any

from tmsopt.arithmetic.elementary import quotient, sqrt

_TINY = 1e-300  # keeps 0/0 away where all masses are on the ground line, and changes nothing else


def omega0(v: Mapping[str, Any]) -> Any:
    """−(a4/a0)^(1/4), minus the geometric mean of the roots."""
    return -sqrt(sqrt(quotient(v["a4"], v["a0"])))


def omega0_equation(v: Mapping[str, Any], x: Any) -> Any:
    """0 exactly where x is ω0, within its range."""
    return x * x * x * x * v["a0"] - v["a4"]


def nothing(v: Mapping[str, Any]) -> Any:
    """0, which a mass is never less than."""
    return 0


def smaller_eigenvalue(first: Any, mixed: Any, second: Any, determinant: Any) -> Any:
    """Of a symmetric 2 × 2 matrix that is not negative, as 2 det/(tr + √(tr² − 4 det)).

    tr² − 4 det = (first − second)² + 4 mixed² is a sum of squares, so nothing cancels. There is no equation: the
    larger eigenvalue would satisfy it too, and the formula is smooth wherever the two eigenvalues differ.
    """
    apart = sqrt((first - second) * (first - second) + 4 * mixed * mixed)
    return 2 * determinant / (first + second + apart + _TINY)
