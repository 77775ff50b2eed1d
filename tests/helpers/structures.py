"""Factored forms of every structure of four roots, and the dimensionless design, in mpmath."""

from functools import reduce

import numpy as np
from helpers.oracles import polynomial_60, weave_Fr_60
from mpmath import mp

NATIVE = ("Fr", "mu", "chi_B", "chi_H", "zeta_B", "zeta_H", "lambda_s")
LENGTHS = {"chi_B": "x_B", "chi_H": "x_H", "zeta_B": "z_B", "zeta_H": "z_H"}


def native_60(p):
    """The seven dimensionless parameters of a design in either set."""
    exact = {name: mp.mpf(value) for name, value in p.items()}
    if "Fr" in exact:
        return {name: exact[name] for name in NATIVE}
    return {
        "Fr": exact["v"] / mp.sqrt(exact["g"] * exact["w"]),
        "mu": exact["m_H"] / exact["m_B"],
        **{chi: exact[x] / exact["w"] for chi, x in LENGTHS.items()},
        "lambda_s": exact["lambda_s"],
    }


def quantities_60(p):
    """Every derived quantity but those of the roots; None where it does not exist."""
    q = native_60(p)
    _, mu, chi_B, chi_H, zeta_B, zeta_H, lam = (q[name] for name in NATIVE)
    nu_H = (chi_H - 1) * mp.cos(lam) - zeta_H * mp.sin(lam)
    a = polynomial_60(**q)
    M = mp.matrix([[mu * zeta_H**2 + zeta_B**2, -mu * zeta_H * nu_H], [-mu * zeta_H * nu_H, mu * nu_H**2]])
    centre = (chi_B + mu * chi_H) / (1 + mu)
    found = {
        **{f"a{k}": c for k, c in enumerate(a)},
        **q,
        "nu_H": nu_H,
        "omega0": -mp.root(a[4] / a[0], 4) if a[4] / a[0] >= 0 else None,
        "Fr_c": weave_Fr_60(**{name: q[name] for name in NATIVE[1:]}),
        "chi_T": centre,
        "load_front": centre,
        "load_rear": 1 - centre,
        "ballast_rear": max(mp.mpf(0), (centre - 1) * (1 + mu)),
        "ballast_front": max(mp.mpf(0), -centre * (1 + mu)),
        "mass_margin": min(mp.eigsy(M, eigvals_only=True)),
    }
    if "g" in p:
        weight = (p["m_B"] + p["m_H"]) * p["g"]
        found |= {
            "v_c": None if found["Fr_c"] is None else found["Fr_c"] * mp.sqrt(p["g"] * p["w"]),
            "u_H": nu_H * p["w"],
            "N_F": centre * weight,
            "N_R": (1 - centre) * weight,
            "m_ballast_rear": found["ballast_rear"] * p["m_B"],
            "m_ballast_front": found["ballast_front"] * p["m_B"],
        }
    return found


def times(*factors):
    return reduce(np.convolve, [np.array(factor, dtype=object) for factor in factors], [mp.mpf(1)]).tolist()


def pair(g, W):
    return [1, -2 * g, g * g + W]


def pair_roots(g, W):
    root = mp.sqrt(mp.mpc(-W))
    return [g + root, g - root]


FORMS = {
    # structure: (factors of the unknowns, roots with multiplicity, unknowns for the printed roots)
    "EP4": (lambda r: [[1, -r]] * 4, lambda r: [r] * 4, lambda z: [z[0].real]),
    "EP3": (
        lambda r, t: [[1, -r]] * 3 + [[1, -t]],
        lambda r, t: [r, r, r, t],
        lambda z: [z[0].real, z[3].real],
    ),
    "2EP2": (
        lambda r, t: [[1, -r], [1, -r], [1, -t], [1, -t]],
        lambda r, t: [r, r, t, t],
        lambda z: [z[0].real, z[2].real],
    ),
    "CEP2": (
        lambda g, W: [pair(g, W)] * 2,
        lambda g, W: pair_roots(g, W) * 2,
        lambda z: [z[0].real, z[0].imag ** 2],
    ),
    "EP2": (
        lambda r, g, W: [[1, -r], [1, -r], pair(g, W)],
        lambda r, g, W: [r, r, *pair_roots(g, W)],
        lambda z: [z[0].real, (z[2] + z[3]).real / 2, -(((z[2] - z[3]) / 2) ** 2).real],
    ),
    "EP2+pair": (
        lambda g, W: [[1, -g], [1, -g], pair(g, W)],
        lambda g, W: [g, g, *pair_roots(g, W)],
        lambda z: [z[0].real, max(x.imag for x in z) ** 2],
    ),
    "pair+real": (
        lambda g, W, t: [pair(g, W), [1, -g], [1, -t]],
        lambda g, W, t: [*pair_roots(g, W), g, t],
        lambda z: [z[0].real, max(x.imag for x in z) ** 2, z[3].real],
    ),
    "two pairs": (
        lambda g, W, X: [pair(g, W), pair(g, X)],
        lambda g, W, X: [*pair_roots(g, W), *pair_roots(g, X)],
        lambda z: [z[0].real, max(x.imag for x in z) ** 2, min(abs(x.imag) for x in z) ** 2],
    ),
}
