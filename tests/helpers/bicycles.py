"""Bicycles with wheels, and their matrices as printed. Nothing here imports the package.

Source: J. P. Meijaard, J. M. Papadopoulos, A. Ruina and A. L. Schwab (2007), table 1 and appendix A.
"""

import math

import numpy as np

BENCHMARK = {
    "w": 1.02,
    "c": 0.08,
    "lambda_s": math.pi / 10,
    "g": 9.81,
    "v": 5.0,
    "r_R": 0.3,
    "m_R": 2.0,
    "I_Rxx": 0.0603,
    "I_Ryy": 0.12,
    "x_B": 0.3,
    "z_B": -0.9,
    "m_B": 85.0,
    "I_Bxx": 9.2,
    "I_Bzz": 2.8,
    "I_Bxz": 2.4,
    "x_H": 0.9,
    "z_H": -0.7,
    "m_H": 4.0,
    "I_Hxx": 0.05892,
    "I_Hzz": 0.00708,
    "I_Hxz": -0.00756,
    "r_F": 0.35,
    "m_F": 3.0,
    "I_Fxx": 0.1405,
    "I_Fyy": 0.28,
}
"""Meijaard, Papadopoulos, Ruina and Schwab (2007), table 1."""

MATRICES = (
    [[80.81722, 2.31941332208709], [2.31941332208709, 0.29784188199686]],
    [[0, 33.86641391492494], [-0.85035641456978, 1.68540397397560]],
    [[-80.95, -2.59951685249872], [-2.59951685249872, -0.80329488458618]],
    [[0, 76.59734589573222], [0, 2.65431523794604]],
)
"""M, C1, K0, K2 of the benchmark, as printed there."""

BODIES = "w c r_R m_R I_Rxx I_Ryy x_B z_B m_B I_Bxx I_Bzz I_Bxz x_H z_H m_H I_Hxx I_Hzz I_Hxz r_F m_F I_Fxx I_Fyy"


def bicycles(count, seed=0):
    """Random bicycles with everything that a bicycle can have, of both tilt signs and trails."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        r, m = rng.uniform(0.1, 0.5, 2), rng.uniform(0.5, 5, 2)
        inertia = m * r * r * rng.uniform(0.3, 1, 2)
        yield {
            "w": rng.uniform(0.6, 1.6),
            "c": rng.uniform(-0.2, 0.2),
            "lambda_s": math.atan(rng.uniform(-2, 2)),
            "g": rng.uniform(1, 20),
            "v": rng.uniform(0.1, 12),
            "r_R": r[0],
            "m_R": m[0],
            "I_Rxx": inertia[0] / 2,
            "I_Ryy": inertia[0],
            "x_B": rng.uniform(-0.5, 2),
            "z_B": -rng.uniform(0.1, 1.2),
            "m_B": rng.uniform(3, 90),
            "I_Bxx": rng.uniform(0, 10),
            "I_Bzz": rng.uniform(0, 3),
            "I_Bxz": rng.uniform(-2, 2),
            "x_H": rng.uniform(0, 1.5),
            "z_H": -rng.uniform(0.1, 1.2),
            "m_H": rng.uniform(0.5, 6),
            "I_Hxx": rng.uniform(0, 0.3),
            "I_Hzz": rng.uniform(0, 0.1),
            "I_Hxz": rng.uniform(-0.05, 0.05),
            "r_F": r[1],
            "m_F": m[1],
            "I_Fxx": inertia[1] / 2,
            "I_Fyy": inertia[1],
        }


def appendix(p, sine, cosine):
    """M, C1, K0, K2 by appendix A of the paper, as it is printed: with the front assembly's common centre of mass."""
    (
        w,
        c,
        r_R,
        m_R,
        I_Rxx,
        I_Ryy,
        x_B,
        z_B,
        m_B,
        I_Bxx,
        I_Bzz,
        I_Bxz,
        x_H,
        z_H,
        m_H,
        I_Hxx,
        I_Hzz,
        I_Hxz,
        r_F,
        m_F,
        I_Fxx,
        I_Fyy,
    ) = (p[n] for n in BODIES.split())
    m_T = m_R + m_B + m_H + m_F
    x_T = (x_B * m_B + x_H * m_H + w * m_F) / m_T
    z_T = (-r_R * m_R + z_B * m_B + z_H * m_H - r_F * m_F) / m_T
    I_Txx = I_Rxx + I_Bxx + I_Hxx + I_Fxx + m_R * r_R**2 + m_B * z_B**2 + m_H * z_H**2 + m_F * r_F**2
    I_Txz = I_Bxz + I_Hxz - m_B * x_B * z_B - m_H * x_H * z_H + m_F * w * r_F
    I_Tzz = I_Rxx + I_Bzz + I_Hzz + I_Fxx + m_B * x_B**2 + m_H * x_H**2 + m_F * w**2
    m_A = m_H + m_F
    x_A, z_A = (x_H * m_H + w * m_F) / m_A, (z_H * m_H - r_F * m_F) / m_A
    I_Axx = I_Hxx + I_Fxx + m_H * (z_H - z_A) ** 2 + m_F * (r_F + z_A) ** 2
    I_Axz = I_Hxz - m_H * (x_H - x_A) * (z_H - z_A) + m_F * (w - x_A) * (r_F + z_A)
    I_Azz = I_Hzz + I_Fxx + m_H * (x_H - x_A) ** 2 + m_F * (w - x_A) ** 2
    u_A = (x_A - w - c) * cosine - z_A * sine
    I_All = m_A * u_A**2 + I_Axx * sine**2 + 2 * I_Axz * sine * cosine + I_Azz * cosine**2
    I_Alx = -m_A * u_A * z_A + I_Axx * sine + I_Axz * cosine
    I_Alz = m_A * u_A * x_A + I_Axz * sine + I_Azz * cosine
    mu = c / w * cosine
    S_R, S_F = I_Ryy / r_R, I_Fyy / r_F
    S_T, S_A = S_R + S_F, m_A * u_A + mu * m_T * x_T
    k = cosine / w
    return (
        [[I_Txx, I_Alx + mu * I_Txz], [I_Alx + mu * I_Txz, I_All + 2 * mu * I_Alz + mu**2 * I_Tzz]],
        [
            [0, mu * S_T + S_F * cosine + I_Txz * k - mu * m_T * z_T],
            [-(mu * S_T + S_F * cosine), I_Alz * k + mu * (S_A + I_Tzz * k)],
        ],
        [[m_T * z_T, -S_A], [-S_A, -S_A * sine]],
        [[0, (S_T - m_T * z_T) * k], [0, (S_A + S_F * sine) * k]],
    )


def matrices(p):
    """M, C1, g K0, K2 of parameters that may be arrays: 2 × 2 in the last two axes."""
    found = appendix(p, np.sin(p["lambda_s"]), np.cos(p["lambda_s"]))
    one = np.ones(np.broadcast(*(p[n] for n in BODIES.split())).shape)
    M, C1, K0, K2 = (np.moveaxis(np.array([[x * one for x in row] for row in A]), (0, 1), (-2, -1)) for A in found)
    return M, C1, p.get("g", 9.81) * K0, K2


def abscissa(p, v, gains=(0.0, 0.0, 0.0, 0.0)):
    """Largest real part of the eigenvalues, of every design or row of gains at once."""
    M, C1, gK0, K2 = matrices(p)
    v, k = np.asarray(v, dtype=float)[..., None, None], np.asarray(gains)
    nothing = np.zeros(k.shape[:-1])
    K = gK0 + v**2 * K2 + np.moveaxis(np.array([[nothing, nothing], [k[..., 0], k[..., 2]]]), (0, 1), (-2, -1))
    D = v * C1 + np.moveaxis(np.array([[nothing, nothing], [k[..., 1], k[..., 3]]]), (0, 1), (-2, -1))
    below = -np.linalg.solve(M, np.concatenate(np.broadcast_arrays(K, D), axis=-1))
    above = np.broadcast_to(np.eye(2, 4, k=2), below.shape)
    return np.linalg.eigvals(np.concatenate([above, below], axis=-2)).real.max(axis=-1)
