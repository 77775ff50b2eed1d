"""A proof over a band of speeds that is independent of the package's own.

With the speed as an indeterminate, the coefficients of p(s + γ) and its Hurwitz determinant are polynomials in Fr,
enclosed in ball arithmetic; on an interval a polynomial lies between the least and the greatest of its Bernstein
coefficients.
"""

import math
from collections.abc import Mapping
from math import comb
from typing import Any

import flint
import numpy as np

from benchmarks.judges.eigenvalues import eigenvalues
from tmsopt.models import copo

_BITS = 400
_DEEPEST = 60  # halvings of the band: then a piece is 1e-18 wide


def highest_abscissa(parameters: Mapping[str, float], least: float, most: float, count: int) -> float:
    """Over evenly spaced speeds, by numeric roots."""
    speeds = np.linspace(least, most, count)
    a = np.stack(np.broadcast_arrays(*_coefficients(parameters, speeds, math.tan(parameters["lambda_s"]))), axis=-1)
    return float(eigenvalues(a).real.max())


def abscissa_below(parameters: Mapping[str, float], least: float, most: float, gamma: float) -> tuple[bool, int]:
    """Whether all roots are left of gamma at every speed from least to most, proved; and on how many pieces.

    With a0 > 0 that is so when every coefficient of p(t + γ) and c1 c2 c3 − c0 c3² − c4 c1² are positive
    (Liénard and Chipart). The parameters are taken exactly as stored.
    """
    with flint.ctx.workprec(_BITS):
        speed = flint.arb_poly([0, 1])
        exact = {name: flint.arb(value) for name, value in parameters.items()}
        a = [flint.arb_poly([0]) + c for c in _coefficients(exact, speed, exact["lambda_s"].tan())]
        if a[0](flint.arb(least)) < 0:
            a = [-c for c in a]
        c = _shifted(a, flint.arb(gamma))
        wanted = [*c, c[1] * c[2] * c[3] - c[0] * c[3] * c[3] - c[4] * c[1] * c[1]]
        pieces = [_positive(poly, flint.arb(least), flint.arb(most), _DEEPEST) for poly in wanted]
    return all(pieces), sum(pieces)


def _coefficients(parameters: Mapping[str, Any], speed: Any, tangent: Any) -> list[Any]:
    names = ("mu", "chi_B", "chi_H", "zeta_B", "zeta_H")
    return copo(Fr=speed, T=tangent, **{n: parameters[n] for n in names})


def _shifted(a: list[Any], gamma: Any) -> list[Any]:
    """Coefficients of p(t + γ), by the binomial theorem."""
    n = len(a) - 1
    return [
        sum((a[i] * (comb(n - i, k - i) * gamma ** (k - i)) for i in range(k + 1)), start=0 * a[0])
        for k in range(n + 1)
    ]


def _positive(poly: Any, least: Any, most: Any, deepest: int) -> int:
    """Pieces of the interval on which the Bernstein coefficients prove the polynomial positive; 0 where they fail."""
    n = max(poly.degree(), 0)
    inner = poly(flint.arb_poly([least, most - least]))
    b = [sum(inner[i] * comb(k, i) / comb(n, i) for i in range(k + 1)) for k in range(n + 1)]
    if all(value > 0 for value in b):
        return 1
    if deepest == 0 or not b[0] > 0 or not b[-1] > 0:
        return 0
    middle = (least + most) / 2
    left = _positive(poly, least, middle, deepest - 1)
    right = _positive(poly, middle, most, deepest - 1) if left else 0
    return left + right if right else 0
