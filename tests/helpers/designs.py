"""Designs that several tests share: random ones, and a robot as a builder writes it."""

import math

import numpy as np

ROBOT = """
title = "A small self-stable robot"
model = "tms"

[parameters]
w = "80 cm"
v = { min = "5 km/h", max = "15 km/h" }
lambda_s = { min = "5 deg", max = "30 deg" }
m_B = "10 kg"
x_B = { min = "20 cm", max = "120 cm" }
z_B = { min = "-60 cm", max = "-300 mm" }
m_H = { min = "500 g", max = "2 kg" }
x_H = { min = "60 cm", max = "100 cm" }
z_H = { min = "-50 cm", max = "-10 cm" }

[objective]
minimize = "abscissa"

[constraints]
%s
"""


def designs(count, seed=0):
    """Random designs of both tilt signs, χ_H ≠ 1."""
    rng = np.random.default_rng(seed)
    return [
        {
            "Fr": rng.uniform(0.05, 6),
            "mu": 10 ** rng.uniform(-1.5, 1.5),
            "chi_B": rng.uniform(-1, 3),
            "chi_H": rng.uniform(-1, 3),
            "zeta_B": -(10 ** rng.uniform(-1.3, 0.3)),
            "zeta_H": -(10 ** rng.uniform(-1.3, 0.3)),
            "lambda_s": math.atan(rng.uniform(-3, 3)),
        }
        for _ in range(count)
    ]


def wide_designs(seed, count):
    """Both tilt signs in equal numbers and χ_H ≠ 1, over a box much wider than any bicycle."""
    rng = np.random.default_rng(seed)
    return {
        "Fr": rng.uniform(0.01, 6, count),
        "mu": 10 ** rng.uniform(-2, 1.5, count),
        "chi_B": rng.uniform(-1, 3, count),
        "chi_H": rng.uniform(-1, 3, count),
        "zeta_B": -(10 ** rng.uniform(-1.3, 0.3, count)),
        "zeta_H": -(10 ** rng.uniform(-1.3, 0.3, count)),
        "lambda_s": np.arctan(rng.uniform(-3, 3, count)),
    }
