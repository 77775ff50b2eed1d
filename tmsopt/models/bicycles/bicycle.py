"""Formulas of quantities that bicycles of every model have."""

import math
from collections.abc import Mapping
from typing import Any

from tmsopt.algebra.kinds import choose, less, pi, quotient, sqrt, tan
from tmsopt.models.model import Computed, Quantity, Range

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
    decay = f"-(abscissa*{written})"
    return (
        Quantity(
            "decay_rate",
            "1/s",
            "how fast the slowest part of a disturbance dies out",
            r"-\alpha",
            lambda v: -_of_roots(v, "abscissa") * rate(v),
            aside=True,
            stands_for=f"({decay})",
        ),
        Quantity(
            "decay_time",
            "s",
            "in which the slowest part of a disturbance falls to 1/e",
            r"\tau",
            lambda v: choose(less(a := _of_roots(v, "abscissa"), 0), quotient(1, -a * rate(v)), math.nan),
            range=Range(lower=0.0),
            aside=True,
            stands_for=f"(1/max({decay}, 0))",
        ),
        Quantity(
            "frequency",
            "Hz",
            "of the fastest oscillation, 0 where nothing oscillates",
            "f",
            lambda v: _of_roots(v, "angular_frequency") * rate(v) / (2 * pi(rate(v))),
            range=Range(lower=0.0),
            aside=True,
            stands_for=f"(angular_frequency*{written}/(2*pi))",
        ),
    )


def _of_roots(v: Mapping[str, Any], name: str) -> Any:
    """A quantity of the roots, where these are known; else nan."""
    return v.get(name, math.nan)
