"""Expressions and comparisons as text, evaluated by Python itself: not by the package that is judged."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from tmsopt.models import FUNCTIONS
from tmsopt.records import Array

NOWHERE = 1e3
"""Abscissa, and violation, of a design where it does not exist."""


def _arc(name: str) -> Callable[[Any], Any]:
    """An inverse function that arrays and balls name differently."""
    return lambda x: getattr(x, f"a{name}")() if hasattr(x, f"a{name}") else getattr(np, f"arc{name}")(x)


_FUNCTIONS: dict[str, Any] = {name: getattr(np, name) for name in FUNCTIONS if hasattr(np, name)} | {
    **{f"a{name}": _arc(name) for name in ("sin", "cos", "tan")},
    "min": np.minimum,
    "max": np.maximum,
    "pi": np.pi,
}


def sides(text: str) -> tuple[str, str, str]:
    """Left side, comparison, right side.

    Raises:
        ValueError: where nothing is compared.
    """
    for comparison in ("<=", ">=", "=="):
        left, found, right = text.partition(comparison)
        if found:
            return left.strip(), found, right.strip()
    raise ValueError(f"{text!r} compares nothing")


def difference(text: str) -> str:
    """Left side minus right side."""
    left, _, right = sides(text)
    return f"({left}) - ({right})"


def evaluated(text: Any, values: Mapping[str, Any]) -> Any:
    """The value of an expression, or of its compiled code."""
    return eval(text, _FUNCTIONS, values)


def excess(left: Any, comparison: str, right: Any) -> Array:
    """By how much a comparison is violated, relative to the size of the two sides; 0 where it holds."""
    apart = np.asarray(left - right, dtype=float)
    beyond = {"<=": apart, ">=": -apart, "==": np.abs(apart)}[comparison]
    size = np.maximum(1.0, np.maximum(np.abs(left), np.abs(right)))
    return np.where(np.isfinite(apart), np.maximum(beyond, 0.0) / size, NOWHERE)
