"""Formulas that all bicycle models share."""

import math
from typing import Any

from tmsopt.algebra.kinds import choose, less, quotient_or_nan, sqrt, tan
from tmsopt.models.bicycles.tables import quantities
from tmsopt.models.model import NumberFunction, Quantity
from tmsopt.models.tables import read_table
from tmsopt.records import AnyNumbers

WORDS = "weave", "capsize"
"""Names of the two ways to lose stability: a pair of roots on the imaginary axis, and a root 0."""

_TINY = 1e-300  # prevents 0/0 if all masses are on the ground; it changes no other result


def omega0(v: AnyNumbers) -> Any:
    """−(a4/a0)^(1/4), minus the geometric mean of the roots."""
    return -sqrt(sqrt(quotient_or_nan(v["a4"], v["a0"])))


def omega0_equation(v: AnyNumbers, x: Any) -> Any:
    """An expression that is 0 exactly if x = ω0, for x within the range of ω0."""
    return x * x * x * x * v["a0"] - v["a4"]


def smaller_eigenvalue(M11: Any, M12: Any, M22: Any, determinant: Any) -> Any:
    """The smaller eigenvalue of a positive semidefinite 2 × 2 matrix M, 2 det/(tr + √(tr² − 4 det)).

    tr² − 4 det = (M11 − M22)² + 4 M12² is a sum of squares, so subtraction loses no digits. The quantity has no
    `equation`, because the larger eigenvalue would satisfy it too. The formula is smooth if the eigenvalues differ.
    """
    gap = sqrt((M11 - M22) * (M11 - M22) + 4 * M12 * M12)
    return 2 * determinant / (M11 + M22 + gap + _TINY)


def contact_path(p: AnyNumbers) -> tuple[Any, Any, Any, Any, Any]:
    """Coefficients e, f, v, w and −c cos λ_s of the paths of the wheel contacts, which do not slip sideways.

    The yaw rate is ψ′ = e δ + f δ′ = (v δ + c δ′) cos λ_s/w. The contact points move to the right by y_rear, with
    y_rear′ = v ψ, and y_front = y_rear + w ψ − c cos λ_s δ. In dimensionless parameters w is 1 and v is Fr.
    """
    T, v, w, c = tan(p["lambda_s"]), p["v"] if "v" in p else p["Fr"], p.get("w", 1), p.get("c", 0)
    cosine = 1 / sqrt(1 + T * T)
    return v * cosine / w, c * cosine / w, v, w, -c * cosine


def time_quantities(rate: NumberFunction, expression: str) -> tuple[Quantity, ...]:
    """Quantities with a unit of time, for parameters in SI.

    Args:
        rate: function of the parameters that gives the unit of rates in 1/s.
        expression: the same unit as an expression.
    """

    def decay_time(v: AnyNumbers) -> Any:
        abscissa = v["abscissa"]
        return choose(less(abscissa, 0), quotient_or_nan(1, -abscissa * rate(v)), math.nan)

    rows = read_table("bicycles/times").items()
    formatted = {name: {**row, "stands_for": row["stands_for"].format(rate=expression)} for name, row in rows}
    return quantities(formatted, {"decay_time": {"value": decay_time}})
