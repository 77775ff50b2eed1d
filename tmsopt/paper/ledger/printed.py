"""What the paper prints, on exact numbers; T = tan λ_s.

Most formulas are those of `laws`. Those that have no exact value stand here without their roots: a formula for ω0 gives
ω0⁴, one for Fr gives Fr², and √|ζ| is an argument.
"""

from typing import Any

from tmsopt import laws as _laws

laws: Any = _laws
"""The laws of the paper, which take exact numbers too, and for λ_s a `Tilt`."""


def nu_H(chi_H: Any, zeta_H: Any, sine: Any, cosine: Any) -> Any:
    """ν_H."""
    return (chi_H - 1) * cosine - zeta_H * sine


def w0(mu: Any, chi_H: Any, zeta_B: Any, zeta_H: Any, T: Any) -> Any:
    """ω0⁴ (w0)."""
    return 1 / zeta_B**2 * (zeta_B * T + mu * (chi_H - 1)) / (zeta_H * T - (chi_H - 1))


E1 = {"T": "-0.432", "1": "-0.0272", "Fr^2": "0.08", "mu": "0.004"}
E2 = {"T": "0.368", "mu": "-0.02", "1": "-0.0032"}
E3 = {"T": "0.192", "1": "-0.0048", "Fr": "-0.136", "Fr^2": "0.08", "mu": "-0.016"}
"""Coefficients of (e1), (e2), (e3) by their terms."""


def frm(root_B: Any, root_H: Any, T: Any) -> Any:
    """Fr_min² (frm), from √|ζ_B| and √|ζ_H|."""
    return (root_B + root_H) / (root_B - root_H) * T


def frep4(Fr: Any, omega0: Any, zeta_B: Any, T: Any) -> Any:
    """The quadratic in Fr (frep4)."""
    return (omega0**2 * zeta_B - 1) * Fr**2 + 2 * omega0**3 * zeta_B * Fr - (omega0**2 * zeta_B + 1) * T


def epset(omega0: Any, zeta_B: Any, T: Any) -> Any:
    """Fr² on the EP set (epset)."""
    ratio = (omega0**2 * zeta_B - 1) / (omega0**2 * zeta_B + 1)
    return ratio**2 * (4 * T**2) / (omega0**4 * zeta_B + 4 * T * ratio)
