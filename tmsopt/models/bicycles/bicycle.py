"""Formulas of quantities that bicycles of every model have."""

import math
from collections.abc import Mapping
from typing import Any

from tmsopt.algebra.kinds import choose, less, quotient, sqrt, tan
from tmsopt.models.bicycles.tables import quantities
from tmsopt.models.model import Computed, Quantity
from tmsopt.models.tables import read_table

WORDS = "weave", "capsize"
"""What a bicycle does beyond a pair on the imaginary axis, and beyond a root 0."""

_TINY = 1e-300  # keeps 0/0 away where all masses are on the ground line, and changes nothing else


def omega0(v: Mapping[str, Any]) -> Any:
    """−(a4/a0)^(1/4), minus the geometric mean of the roots."""
    return -sqrt(sqrt(quotient(v["a4"], v["a0"])))


def omega0_equation(v: Mapping[str, Any], x: Any) -> Any:
    """0 exactly where x is ω0, within its range."""
    return x * x * x * x * v["a0"] - v["a4"]


def smaller_eigenvalue(first: Any, mixed: Any, second: Any, determinant: Any) -> Any:
    """Of a symmetric 2 × 2 matrix that is not negative, as 2 det/(tr + √(tr² − 4 det)).

    tr² − 4 det = (first − second)² + 4 mixed² is a sum of squares, so nothing cancels. There is no equation: the
    larger eigenvalue would satisfy it too, and the formula is smooth wherever the two eigenvalues differ.
    """
    apart = sqrt((first - second) * (first - second) + 4 * mixed * mixed)
    return 2 * determinant / (first + second + apart + _TINY)


def contact_path(p: Mapping[str, Any]) -> tuple[Any, Any, Any, Any, Any]:
    """How the contacts go, as e, f, v, w, −c cos λ_s, the wheels rolling and the skates sliding without slip.

    ψ′ = e δ + f δ′ = (v δ + c δ′) cos λ_s/w; to the right y_rear′ = v ψ, y_front = y_rear + w ψ − c cos λ_s δ. Without
    units w is 1 and v is Fr.
    """
    T, v, w, c = tan(p["lambda_s"]), p["v"] if "v" in p else p["Fr"], p.get("w", 1), p.get("c", 0)
    cosine = 1 / sqrt(1 + T * T)
    return v * cosine / w, c * cosine / w, v, w, -c * cosine


def times(rate: Computed, written: str) -> tuple[Quantity, ...]:
    """Quantities of time, for parameters in SI.

    Args:
        rate: how many 1/s a rate of 1 is, and the same as the expression that is written.
    """

    def decay_time(v: Mapping[str, Any]) -> Any:
        abscissa = v["abscissa"]
        return choose(less(abscissa, 0), quotient(1, -abscissa * rate(v)), math.nan)

    rows = read_table("bicycles/times").items()
    told = {name: {**row, "stands_for": row["stands_for"].format(rate=written)} for name, row in rows}
    return quantities(told, {"decay_time": {"value": decay_time}})
