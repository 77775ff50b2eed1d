"""Skates of two masses with the heights, the mass ratio and the front mass of Kirillov (2018), Table 1."""

import tmsopt
from tmsopt import laws

FIXED = {"chi_H": 1.0, "mu": 0.1, "zeta_B": -0.4, "zeta_H": -0.2}
BOX = {"Fr": (0.5, 4.0), "chi_B": (1.05, 3.0), "lambda_s": (0.05, 1.2)}
EP4 = laws.ep4_chi_H_1(-0.4, -0.2)


def skate(free=BOX, fixed=FIXED, **asked):
    """A problem; what is not given is as in the paper."""
    fixed = {n: x for n, x in {**FIXED, **fixed}.items() if n not in free}
    return tmsopt.Problem(tmsopt.models.tms, fixed=fixed, free=free, **asked)
