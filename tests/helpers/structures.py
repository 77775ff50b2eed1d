"""Factored forms of every structure of four roots, and the dimensionless design, in mpmath."""

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


def times(*factors):
    found = [mp.mpf(1)]
    for factor in factors:
        longer = [mp.mpf(0)] * (len(found) + len(factor) - 1)
        for i, x in enumerate(found):
            for j, y in enumerate(factor):
                longer[i + j] += x * y
        found = longer
    return found


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
