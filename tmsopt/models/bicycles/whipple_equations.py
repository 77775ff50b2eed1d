"""The linear Carvallo–Whipple bicycle: its matrices and its characteristic polynomial, without division.

The equations are those of Meijaard, Papadopoulos, Ruina and Schwab (2007), appendix A, with x forward and z down from
the rear contact, and with two differences. The sums over handlebar and front wheel are about the steer axis, because a
front assembly without mass has no centre of mass. Each wheel has a parameter for its spin S = I_yy/r, the angular
momentum at a speed of 1, in addition to its radius, so that a wheel without size needs no special case.
"""

from typing import Any

from tmsopt.models.model import Matrix


def matrices(
    w: Any,
    c: Any,
    r_R: Any,
    m_R: Any,
    I_Rxx: Any,
    S_R: Any,
    x_B: Any,
    z_B: Any,
    m_B: Any,
    I_Bxx: Any,
    I_Bzz: Any,
    I_Bxz: Any,
    x_H: Any,
    z_H: Any,
    m_H: Any,
    I_Hxx: Any,
    I_Hzz: Any,
    I_Hxz: Any,
    r_F: Any,
    m_F: Any,
    I_Fxx: Any,
    S_F: Any,
    sine: Any,
    cosine: Any,
    turn: Any,
) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """M, C1, K0, K2 of M q″ + v C1 q′ + (g K0 + v² K2) q = 0, q = (lean, steer), from numbers of any kind.

    Args:
        S_R, S_F: spins I_yy/r of the wheels.
        sine, cosine: sine and cosine of the steer axis tilt.
        turn: cosine/w, the curvature of the path for a steer angle of 1.

    For a steer angle in a unit k times as large, multiply `sine`, `cosine` and `turn` by k.
    """
    m_T = m_R + m_B + m_H + m_F
    first_x = x_B * m_B + x_H * m_H + w * m_F
    first_z = z_B * m_B + z_H * m_H - r_R * m_R - r_F * m_F
    I_Txx = I_Rxx + I_Bxx + I_Hxx + I_Fxx
    I_Txx = I_Txx + m_R * r_R * r_R + m_B * z_B * z_B + m_H * z_H * z_H + m_F * r_F * r_F
    I_Txz = I_Bxz + I_Hxz - m_B * x_B * z_B - m_H * x_H * z_H + m_F * w * r_F
    I_Tzz = I_Rxx + I_Bzz + I_Hzz + I_Fxx + m_B * x_B * x_B + m_H * x_H * x_H + m_F * w * w

    # Sums of the front assembly about the steer axis. The axis meets the ground at the distance c ahead of the
    # front contact.
    u_H = (x_H - w - c) * cosine - z_H * sine
    u_F = r_F * sine - c * cosine
    first_u = m_H * u_H + m_F * u_F
    about_x = (I_Hxx + I_Fxx) * sine + I_Hxz * cosine
    about_z = I_Hxz * sine + (I_Hzz + I_Fxx) * cosine
    I_All = m_H * u_H * u_H + m_F * u_F * u_F + about_x * sine + about_z * cosine
    I_Alx = m_F * u_F * r_F - m_H * u_H * z_H + about_x
    I_Alz = m_H * u_H * x_H + m_F * u_F * w + about_z

    yaw = c * turn  # yaw angle of the rear frame for a steer angle of 1
    S_A = first_u + yaw * first_x
    S_T = S_R + S_F
    spin = yaw * S_T + S_F * cosine
    zero = 0 * m_T

    mixed = I_Alx + yaw * I_Txz
    M = [[I_Txx, mixed], [mixed, I_All + 2 * yaw * I_Alz + yaw * yaw * I_Tzz]]
    C1 = [[zero, spin + I_Txz * turn - yaw * first_z], [-spin, I_Alz * turn + yaw * (S_A + I_Tzz * turn)]]
    K0 = [[first_z, -S_A], [-S_A, -S_A * sine]]
    K2 = [[zero, (S_T - first_z) * turn], [zero, (S_A + S_F * sine) * turn]]
    return M, C1, K0, K2


def tangent_matrices(T: Any, w: Any, **bodies: Any) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """M, C1, K0 and K2 with T = tan λ, for a steer angle in units of cos λ/w.

    Args:
        bodies: the remaining lengths, masses, inertias and spins, as in `matrices`.
    """
    return matrices(w, **bodies, sine=w * T, cosine=w, turn=1)


def powers_of_speed(M: Matrix, C1: Matrix, K0: Matrix, K2: Matrix) -> tuple[Any, ...]:
    """The numbers b0 … b7 in the coefficients of det(M s² + v C1 s + g K0 + v² K2).

    a0 = b0, a1 = v b1, a2 = g b2 + v² b3, a3 = v (g b4 + v² b5), a4 = g (g b6 + v² b7): the
    lean equation has neither damping nor stiffness from the speed, so no higher power appears.
    """
    return (
        M[0][0] * M[1][1] - M[0][1] * M[1][0],
        _mixed_determinant(M, C1),
        _mixed_determinant(M, K0),
        _mixed_determinant(M, K2) - C1[0][1] * C1[1][0],
        _mixed_determinant(C1, K0),
        -C1[1][0] * K2[0][1],
        K0[0][0] * K0[1][1] - K0[0][1] * K0[1][0],
        K0[0][0] * K2[1][1] - K0[1][0] * K2[0][1],
    )


def carvallo_whipple(v: Any, g: Any, **other_parameters: Any) -> list[Any]:
    """Coefficients a0 … a4 of det(M s² + v C1 s + g K0 + v² K2) · (w/cos λ)², with T = tan λ, by ``+ - *`` only.

    The factor comes from a steer angle in units of cos λ/w, in which the equations are polynomials in T and w.

    Args:
        other_parameters: the arguments of `tangent_matrices`.
    """
    b = powers_of_speed(*tangent_matrices(**other_parameters))
    v2 = v * v
    return [b[0], v * b[1], g * b[2] + v2 * b[3], v * (g * b[4] + v2 * b[5]), g * (g * b[6] + v2 * b[7])]


def _mixed_determinant(A: Matrix, B: Matrix) -> Any:
    """The terms of det(A + B) that contain one entry of A and one of B."""
    return A[0][0] * B[1][1] + A[1][1] * B[0][0] - A[0][1] * B[1][0] - A[1][0] * B[0][1]
