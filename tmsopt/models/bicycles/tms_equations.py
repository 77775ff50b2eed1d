"""The equations of motion of the two-mass-skate bicycle: its matrices and its characteristic polynomial."""

from typing import Any


def copo(Fr: Any, mu: Any, chi_B: Any, chi_H: Any, zeta_B: Any, zeta_H: Any, T: Any) -> list[Any]:
    """Coefficients a0 … a4 of the characteristic polynomial, with T = tan λ_s (equation copo).

    This is det(M s² + V s + P) / (μ ν_H cos λ_s), by plain arithmetic on numbers of any kind.

    Example:
        >>> a = tmsopt.models.copo(Fr=1, mu=0.1, chi_B=2**0.5, chi_H=1, zeta_B=-0.4, zeta_H=-0.2, T=1)
        >>> same = tmsopt.models.copo(Fr=1, mu=9.0, chi_B=2**0.5, chi_H=1, zeta_B=-0.4, zeta_H=-0.2, T=1)
        >>> a == same  # at chi_H = 1 the mass ratio has no effect
        True

    More: docs/explanation/paper.md
    """
    return [
        (chi_H - 1 - zeta_H * T) * zeta_B * zeta_B,
        Fr * (zeta_B * chi_H - zeta_H * chi_B) * zeta_B,
        Fr * Fr * (zeta_B - zeta_H) * zeta_B - zeta_B * (zeta_B + zeta_H) * T - (chi_H - 1) * (mu * zeta_H - zeta_B),
        Fr * (chi_H - chi_B) * zeta_B,
        -zeta_B * T - mu * (chi_H - 1),
    ]


def compact_copo(Fr: Any, mu: Any, chi_B: Any, chi_H: Any, zeta_B: Any, zeta_H: Any, T: Any) -> list[Any]:
    """The coefficients of `copo` divided by −ζ_B > 0, computed with nine products and one quotient."""
    front_offset, height_difference = chi_H - 1, zeta_B - zeta_H
    lever, arm = Fr * (chi_H - chi_B), Fr * height_difference
    gravity = T + mu * front_offset / zeta_B
    return [
        zeta_B * (zeta_H * T - front_offset),
        -zeta_H * lever - chi_H * arm,
        zeta_H * gravity + zeta_B * T - front_offset - Fr * arm,
        -lever,
        gravity,
    ]


def matrices(
    Fr: Any, mu: Any, chi_B: Any, chi_H: Any, zeta_B: Any, zeta_H: Any, sine: Any, cosine: Any
) -> tuple[list[list[Any]], list[list[Any]], list[list[Any]]]:
    """M, V and P of M q″ + V q′ + P q = 0, q = (lean, steer), from the sine and cosine of the steer axis tilt.

    Equation `matrices` of the paper, as nested lists of numbers of any kind.

    Example:
        >>> design = (1.0, 0.1, 1.2, 1.02, -0.4, -0.2)
        >>> pencil = tmsopt.roots.quadratic_pencil(*tmsopt.models.matrices(*design, sine=0.6, cosine=0.8))
        >>> {round(x / a, 9) for x, a in zip(pencil, tmsopt.models.copo(*design, T=0.75))}  # μ ν_H cos λ_s
        {0.01088}

    More: docs/explanation/paper.md
    """
    nu_H = (chi_H - 1) * cosine - zeta_H * sine
    lean = mu * zeta_H + zeta_B
    M = [[mu * zeta_H * zeta_H + zeta_B * zeta_B, -mu * zeta_H * nu_H], [-mu * zeta_H * nu_H, mu * nu_H * nu_H]]
    V = [[0 * Fr, -(mu * chi_H * zeta_H + chi_B * zeta_B) * Fr * cosine], [0 * Fr, mu * chi_H * nu_H * Fr * cosine]]
    P = [[lean, -Fr * Fr * cosine * lean - mu * nu_H], [-mu * nu_H, mu * (Fr * Fr * cosine - sine) * nu_H]]
    return M, V, P
