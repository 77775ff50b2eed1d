"""The two bicycles, from the papers: two masses on skates (Kirillov 2018), Whipple's (Meijaard and others 2007).

Any arithmetic: the functions take numbers, arrays or numbers of 50 digits with the sine and cosine of the same kind.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

TMS = (
    "-(zeta_H*tan(lambda_s) - chi_H + 1)*zeta_B**2",
    "Fr*(zeta_B*chi_H - zeta_H*chi_B)*zeta_B",
    "Fr**2*(zeta_B - zeta_H)*zeta_B - zeta_B*(zeta_B + zeta_H)*tan(lambda_s) - (chi_H - 1)*(mu*zeta_H - zeta_B)",
    "-Fr*(chi_B - chi_H)*zeta_B",
    "-zeta_B*tan(lambda_s) - mu*(chi_H - 1)",
)
"""Coefficients of the skates, descending: equation copo."""

NU_H = ("nu_H", "(chi_H - 1)*cos(lambda_s) - zeta_H*sin(lambda_s)")

SI = (
    ("Fr", "v/sqrt(g*w)"),
    ("mu", "m_H/m_B"),
    ("chi_B", "x_B/w"),
    ("chi_H", "x_H/w"),
    ("zeta_B", "z_B/w"),
    ("zeta_H", "z_H/w"),
    NU_H,
    ("u_H", "nu_H*w"),
    ("N_F", "g*(m_B*x_B + m_H*x_H)/w"),
    ("N_R", "g*(m_B*(w - x_B) + m_H*(w - x_H))/w"),
)
"""Quantities of the skates in SI, each from those before it."""

BENCHMARK = {
    "w": 1.02,
    "c": 0.08,
    "v": 4.6,
    "r_R": 0.3,
    "m_R": 2,
    "I_Rxx": 0.0603,
    "I_Ryy": 0.12,
    "x_B": 0.3,
    "z_B": -0.9,
    "m_B": 85,
    "I_Bxx": 9.2,
    "I_Bzz": 2.8,
    "I_Bxz": 2.4,
    "x_H": 0.9,
    "z_H": -0.7,
    "m_H": 4,
    "I_Hxx": 0.05892,
    "I_Hzz": 0.00708,
    "I_Hxz": -0.00756,
    "r_F": 0.35,
    "m_F": 3,
    "I_Fxx": 0.1405,
    "I_Fyy": 0.28,
}
"""Table 1 of Meijaard and others (2007), but for the tilt, which is 18 degrees."""

Matrix = list[list[Any]]


def whipple(
    p: Mapping[str, Any], sine: Callable[[Any], Any], cosine: Callable[[Any], Any]
) -> tuple[Matrix, Matrix, Matrix]:
    """M, damping and stiffness of Whipple's bicycle, with gains: appendix A. What is left out is 0."""

    def of(name: str) -> Any:
        return p.get(name, 0)

    w, c, v, g, tilt = p["w"], of("c"), p["v"], p["g"], p["lambda_s"]
    r_R, m_R, x_B, z_B, m_B = of("r_R"), of("m_R"), p["x_B"], p["z_B"], p["m_B"]
    x_H, z_H, m_H, r_F, m_F = p["x_H"], p["z_H"], p["m_H"], of("r_F"), of("m_F")
    sin, cos = sine(tilt), cosine(tilt)
    m_T = m_R + m_B + m_H + m_F  # A1
    x_T = (x_B * m_B + x_H * m_H + w * m_F) / m_T  # A2
    z_T = (-r_R * m_R + z_B * m_B + z_H * m_H - r_F * m_F) / m_T  # A3
    I_Txx = of("I_Rxx") + of("I_Bxx") + of("I_Hxx") + of("I_Fxx")
    I_Txx = I_Txx + m_R * r_R**2 + m_B * z_B**2 + m_H * z_H**2 + m_F * r_F**2  # A4
    I_Txz = of("I_Bxz") + of("I_Hxz") - m_B * x_B * z_B - m_H * x_H * z_H + m_F * w * r_F  # A5
    I_Tzz = of("I_Rxx") + of("I_Bzz") + of("I_Hzz") + of("I_Fxx")
    I_Tzz = I_Tzz + m_B * x_B**2 + m_H * x_H**2 + m_F * w**2  # A6, A7
    m_A = m_H + m_F  # A8
    x_A = (x_H * m_H + w * m_F) / m_A  # A9
    z_A = (z_H * m_H - r_F * m_F) / m_A
    I_Axx = of("I_Hxx") + of("I_Fxx") + m_H * (z_H - z_A) ** 2 + m_F * (r_F + z_A) ** 2  # A10
    I_Axz = of("I_Hxz") - m_H * (x_H - x_A) * (z_H - z_A) + m_F * (w - x_A) * (r_F + z_A)  # A11
    I_Azz = of("I_Hzz") + of("I_Fxx") + m_H * (x_H - x_A) ** 2 + m_F * (w - x_A) ** 2  # A12
    u_A = (x_A - w - c) * cos - z_A * sin  # A13
    I_All = m_A * u_A**2 + I_Axx * sin**2 + 2 * I_Axz * sin * cos + I_Azz * cos**2  # A14
    I_Alx = -m_A * u_A * z_A + I_Axx * sin + I_Axz * cos  # A15
    I_Alz = m_A * u_A * x_A + I_Axz * sin + I_Azz * cos  # A16
    trail = c / w * cos  # A17, named mu there
    S_R = of("I_Ryy") / r_R if "r_R" in p else 0  # A18
    S_F = of("I_Fyy") / r_F if "r_F" in p else 0
    S_T = S_R + S_F
    S_A = m_A * u_A + trail * m_T * x_T  # A19
    mass = [
        [I_Txx, I_Alx + trail * I_Txz],
        [I_Alx + trail * I_Txz, I_All + 2 * trail * I_Alz + trail**2 * I_Tzz],
    ]  # A20
    damping = [
        [0 * v, v * (trail * S_T + S_F * cos + I_Txz / w * cos - trail * m_T * z_T)],
        [
            -v * (trail * S_T + S_F * cos),
            v * (I_Alz / w * cos + trail * (S_A + I_Tzz / w * cos)),
        ],
    ]  # A24
    stiffness = [
        [g * m_T * z_T, -g * S_A + v**2 * (S_T - m_T * z_T) / w * cos],
        [-g * S_A, -g * S_A * sin + v**2 * (S_A + S_F * sin) / w * cos],
    ]  # A21, A22
    for column, lean in enumerate(("phi", "delta")):
        damping[1][column] = damping[1][column] + of(f"k_{lean}dot") + of(f"k_{lean}dot_v") * v
        stiffness[1][column] = stiffness[1][column] + of(f"k_{lean}") + of(f"k_{lean}_v") * v
    time = p.get("time", 1)  # the unit of time in seconds
    return mass, [[time * x for x in row] for row in damping], [[time**2 * x for x in row] for row in stiffness]


def largest_real_part(p: Mapping[str, float]) -> float:
    """Of the eigenvalues, in 1/s, with a controller whose motor may lag."""
    lag, passive = p.get("lag", 0.0), {n: x for n, x in p.items() if not n.startswith("k_")}
    (M, D, K), (_, damping, stiffness) = (whipple({"g": 9.81, **some}, np.sin, np.cos) for some in (p, passive))
    active: Any = np.hstack([K, D])
    forces: Any = np.hstack([stiffness, damping])
    A = np.zeros((5, 5) if lag else (4, 4))
    A[:2, 2:4] = np.eye(2)
    A[2:4, :4] = -np.linalg.solve(M, forces if lag else active)
    if lag:
        A[2:4, 4], A[4, :4], A[4, 4] = np.linalg.inv(M)[:, 1], (forces - active)[1] / lag, -1 / lag
    return float(np.linalg.eigvals(A).real.max())
