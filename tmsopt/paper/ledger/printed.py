"""The formulas exactly as the paper prints them, in plain arithmetic on any numbers; T = tan λ_s.

Fourth and square roots are left out: a formula for ω0 gives ω0⁴, one for Fr gives Fr², and √|ζ| is an argument.
"""

from typing import Any


def coefficients(Fr: Any, mu: Any, chi_B: Any, chi_H: Any, zeta_B: Any, zeta_H: Any, T: Any) -> list[Any]:
    """a0 … a4 (copo), in the printed arrangement."""
    return [
        -(zeta_H * T - chi_H + 1) * zeta_B**2,
        Fr * (zeta_B * chi_H - zeta_H * chi_B) * zeta_B,
        Fr**2 * (zeta_B - zeta_H) * zeta_B - zeta_B * (zeta_B + zeta_H) * T - (chi_H - 1) * (mu * zeta_H - zeta_B),
        -Fr * (chi_B - chi_H) * zeta_B,
        -zeta_B * T - mu * (chi_H - 1),
    ]


def nu_H(chi_H: Any, zeta_H: Any, sine: Any, cosine: Any) -> Any:
    """ν_H."""
    return (chi_H - 1) * cosine - zeta_H * sine


def flus(mu: Any, chi_B: Any, chi_H: Any, zeta_B: Any, zeta_H: Any, T: Any) -> Any:
    """Fr_c² (flus)."""
    first = (zeta_B - zeta_H) / (chi_B - chi_H) * (chi_B * chi_H) / (zeta_B * chi_H - zeta_H * chi_B) * T
    second = (chi_H - 1) / (chi_B - chi_H) * (chi_H / zeta_B) * mu
    return first + second - (chi_H - 1) / (zeta_B * chi_H - zeta_H * chi_B) * chi_B


def w0(mu: Any, chi_H: Any, zeta_B: Any, zeta_H: Any, T: Any) -> Any:
    """ω0⁴ (w0)."""
    return 1 / zeta_B**2 * (zeta_B * T + mu * (chi_H - 1)) / (zeta_H * T - (chi_H - 1))


def poly4(omega0: Any) -> list[Any]:
    """Coefficients of (s − ω0)⁴ (4poly)."""
    return [omega0**0, -4 * omega0, 6 * omega0**2, -4 * omega0**3, omega0**4]


def chib(omega0: Any, chi_H: Any, zeta_B: Any, zeta_H: Any) -> Any:
    """χ_B (chib)."""
    return (omega0**2 * zeta_B - 1) / (omega0**2 * zeta_H - 1) * chi_H


def a2(Fr: Any, mu: Any, chi_H: Any, zeta_B: Any, zeta_H: Any, T: Any, omega0: Any) -> Any:
    """Left less right side (a2)."""
    left = Fr**2 * (zeta_B - zeta_H) + (6 * omega0**2 * zeta_H * zeta_B - zeta_B - zeta_H) * T
    return left - (chi_H - 1) * (6 * omega0**2 * zeta_B**2 + mu * zeta_H - zeta_B) / zeta_B


E1 = {"T": "-0.432", "1": "-0.0272", "Fr^2": "0.08", "mu": "0.004"}
E2 = {"T": "0.368", "mu": "-0.02", "1": "-0.0032"}
E3 = {"T": "0.192", "1": "-0.0048", "Fr": "-0.136", "Fr^2": "0.08", "mu": "-0.016"}
"""Coefficients of (e1), (e2), (e3) by their terms."""


def Frc1(chi_B: Any, zeta_B: Any, zeta_H: Any, T: Any) -> Any:
    """Fr_c² (Frc1)."""
    return (zeta_B - zeta_H) / (zeta_B - chi_B * zeta_H) * chi_B / (chi_B - 1) * T


def frm(root_B: Any, root_H: Any, T: Any) -> Any:
    """Fr_min² (frm), from √|ζ_B| and √|ζ_H|."""
    return (root_B + root_H) / (root_B - root_H) * T


def w01(zeta_B: Any, zeta_H: Any) -> Any:
    """ω0⁴ (w01)."""
    return 1 / (zeta_B * zeta_H)


def tls(omega0: Any, zeta_B: Any, zeta_H: Any) -> Any:
    """T at EP4 (tls)."""
    total = (zeta_B + zeta_H) * omega0**2
    return omega0**2 * (zeta_B - zeta_H) / (16 * zeta_H) * ((total - 6) / (total - 2))


def frep4(Fr: Any, omega0: Any, zeta_B: Any, T: Any) -> Any:
    """The quadratic in Fr (frep4)."""
    return (omega0**2 * zeta_B - 1) * Fr**2 + 2 * omega0**3 * zeta_B * Fr - (omega0**2 * zeta_B + 1) * T


def epset(omega0: Any, zeta_B: Any, T: Any) -> Any:
    """Fr² on the EP set (epset)."""
    ratio = (omega0**2 * zeta_B - 1) / (omega0**2 * zeta_B + 1)
    return ratio**2 * (4 * T**2) / (omega0**4 * zeta_B + 4 * T * ratio)
