"""Eigenvalues of Whipple's bicycle without wheels and trail, with a controller: nothing here imports the package.

Source: J. P. Meijaard, J. M. Papadopoulos, A. Ruina and A. L. Schwab (2007), appendix A, with c = 0 and no wheels.
"""

from collections.abc import Mapping

import numpy as np


def largest_real_part(p: Mapping[str, float]) -> float:
    """Of the eigenvalues, in 1/s; inertias, gains and the lag of a motor that are left out are 0."""
    inertia = {n: p.get(n, 0.0) for n in ("I_Bxx", "I_Bzz", "I_Hxx", "I_Hzz")}
    sine, cosine, k = np.sin(p["lambda_s"]), np.cos(p["lambda_s"]), np.cos(p["lambda_s"]) / p["w"]
    x_B, z_B, m_B, x_H, z_H, m_H = (p[n] for n in ("x_B", "z_B", "m_B", "x_H", "z_H", "m_H"))
    moment = m_B * z_B + m_H * z_H
    I_Txx = inertia["I_Bxx"] + inertia["I_Hxx"] + m_B * z_B**2 + m_H * z_H**2
    I_Txz = -m_B * x_B * z_B - m_H * x_H * z_H
    u_A = (x_H - p["w"]) * cosine - z_H * sine
    I_All = m_H * u_A**2 + inertia["I_Hxx"] * sine**2 + inertia["I_Hzz"] * cosine**2
    I_Alx = -m_H * u_A * z_H + inertia["I_Hxx"] * sine
    I_Alz = m_H * u_A * x_H + inertia["I_Hzz"] * cosine
    S_A, v, g = m_H * u_A, p["v"], p.get("g", 9.81)
    M = np.array([[I_Txx, I_Alx], [I_Alx, I_All]])
    D = v * np.array([[0, I_Txz * k], [0, I_Alz * k]])
    K = g * np.array([[moment, -S_A], [-S_A, -S_A * sine]]) + v * v * np.array([[0, -moment * k], [0, S_A * k]])
    gains = [[p.get("k_phi", 0.0), p.get("k_delta", 0.0)], [p.get("k_phidot", 0.0), p.get("k_deltadot", 0.0)]]
    lag = p.get("lag", 0.0)
    size = 5 if lag else 4
    A = np.zeros((size, size))
    A[:2, 2:4] = np.eye(2)
    torque = np.array([*gains[0], *gains[1]])  # of minus the steer torque, per state
    A[2:4, :4] = -np.linalg.solve(M, np.hstack([K, D]))
    push = np.linalg.solve(M, [0.0, 1.0])
    if lag:
        A[2:4, 4] = push
        A[4, :4], A[4, 4] = -torque / lag, -1 / lag
    else:
        A[2:4, :4] -= np.outer(push, torque)
    return float(np.linalg.eigvals(A).real.max())
