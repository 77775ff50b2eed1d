"""Independent oracles of curves and regions in parameter space: certified special points, exact classes of designs.

Nothing here imports the package. The polynomial comes from `oracles.symbolic_copo`, the determinant of the printed
matrices, with T = tan(lambda_s); tilts are given in rad and turned into T at 40 digits or more.
"""

from fractions import Fraction
from functools import cache

import flint
import numpy as np
import sympy
from helpers.oracles import rational_polynomial, routh_exact, symbolic_copo
from mpmath import mp

DIGITS = 40
COPO, SYMBOLS = symbolic_copo()
S, R, B, C, W = sympy.symbols("s r b c W", real=True)
_P = sum(a * S ** (4 - k) for k, a in enumerate(COPO))


# Special points as square systems of polynomial equations


def equations(pattern):
    """What a pattern demands, without the factored form where there is another: derivatives, coefficients, minors."""
    a0, a1, a2, a3, a4 = COPO
    hurwitz = a1 * a2 * a3 - a0 * a3**2 - a1**2 * a4
    return {
        "EP2": [sympy.diff(_P, S, k) for k in range(2)],
        "EP3": [sympy.diff(_P, S, k) for k in range(3)],
        "EP4": [sympy.diff(_P, S, k) for k in range(4)],
        # (s² + bs + c)²: a1 = 2b a0, a2 = (b² + 2c) a0, a3 = 2bc a0, a4 = c² a0
        "2EP2": [a1 - 2 * B * a0, a2 - (B**2 + 2 * C) * a0, a3 - 2 * B * C * a0, a4 - C**2 * a0],
        "weave": [hurwitz],
        "capsize": [a4],
        "double zero": [a3, a4],
        "EP2 on the axis": [sympy.diff(_P, S, 0), sympy.diff(_P, S, 1), hurwitz],
    }[pattern]


class Point(dict):
    """Name → 40-digit value of the unknowns that solve a system; the tilt as T and, derived, lambda_s."""

    @property
    def lambda_s(self):
        with mp.workdps(DIGITS):
            return mp.atan(self["T"])


def certified(system, start, fixed, radius=1e-25):
    """The solution near `start`, whose keys are the unknowns: Newton at 40 digits, then proven by interval Newton.

    `lambda_s` in `start` or `fixed` is turned into T. Raises AssertionError if balls of `radius` around the solution
    do not provably hold exactly one solution.
    """
    with mp.workdps(DIGITS + 20):
        known = {n: mp.mpf(v) for n, v in fixed.items()}
        begin = {n: mp.mpf(v) for n, v in start.items()}
        for values in (known, begin):
            if "lambda_s" in values:
                values["T"] = mp.tan(values.pop("lambda_s"))
        names = tuple(begin)
        F, J = _compiled(tuple(system), names, tuple(known))
        x = mp.matrix([begin[n] for n in names])
        for _ in range(60):
            step = mp.lu_solve(mp.matrix(J(*x, *known.values())), mp.matrix(F(*x, *known.values())))
            x -= step
            if max(abs(v) for v in step) < mp.mpf(10) ** -(DIGITS + 5):
                break
        else:
            raise AssertionError(f"no solution near {dict(start)}")
        _prove(F, J, list(x), list(known.values()), radius)
        return Point(zip(names, (+v for v in x), strict=True))


@cache
def _compiled(system, names, known):
    of = {**SYMBOLS, "s": S, "b": B, "c": C}
    unknowns = [of[n] for n in names]
    arguments = unknowns + [of[n] for n in known]
    F = sympy.lambdify(arguments, list(system), modules="mpmath")
    J = sympy.lambdify(arguments, [[sympy.diff(f, u) for u in unknowns] for f in system], modules="mpmath")
    return F, J


def _prove(F, J, x, known, radius):
    """Interval Newton: N(X) = m − J(X)⁻¹ F(m) inside X proves one solution in X."""
    before, flint.ctx.dps = flint.ctx.dps, DIGITS + 30
    try:
        middle = [_ball(v) for v in x]
        given = [_ball(v) for v in known]
        wide = [m + flint.arb(0, radius) for m in middle]
        n = len(x)
        values = flint.arb_mat(n, 1, [flint.arb(v) for v in F(*middle, *given)])
        slopes = flint.arb_mat([[flint.arb(v) for v in row] for row in J(*wide, *given)])
        newton = slopes.solve(values)
        for k in range(n):
            image = middle[k] - newton[k, 0]
            assert wide[k].contains_interior(image), (k, image)
    finally:
        flint.ctx.dps = before


def _ball(value):
    sign, mantissa, exponent, _ = value._mpf_
    mantissa = int(mantissa)
    return flint.arb(-mantissa if sign else mantissa) * flint.arb(2) ** int(exponent)


# Closed forms for chi_H = 1 at 40 digits, from the paper


def epset_Fr(zeta_B, zeta_H, lambda_s):
    """Fr on the EP set, equation `epset`, for the tilt exactly as given."""
    with mp.workdps(DIGITS):
        zB, zH, T = mp.mpf(zeta_B), mp.mpf(zeta_H), mp.tan(mp.mpf(lambda_s))
        w2 = 1 / mp.sqrt(zB * zH)
        ratio = (w2 * zB - 1) / (w2 * zB + 1)
        return ratio * 2 * T / mp.sqrt(w2 * w2 * zB + 4 * T * ratio)


FR_C2_SLOPE = float(3 + 2 * mp.sqrt(2))
"""Fr_c²/tan(lambda_s) for the paper's heights and chi_B = √2, equation `frm`: (√2 + 1)/(√2 − 1)."""


# Exact classes of designs


def exact_polynomial(design):
    """Coefficients of a dimensionless design in Fractions; tan(lambda_s) is rounded to 40 digits."""
    with mp.workdps(DIGITS):
        sign, mantissa, exponent, _ = mp.tan(mp.mpf(design["lambda_s"]))._mpf_
    T = flint.fmpq((-1) ** sign * int(mantissa)) * flint.fmpq(2) ** exponent
    rest = [flint.fmpq(*float(design[n]).as_integer_ratio()) for n in SYMBOLS if n != "T"]
    return [Fraction(int(a.p), int(a.q)) for a in map(flint.fmpq, _EXACT(*rest, T))]


_EXACT = sympy.lambdify(list(SYMBOLS.values()), COPO, modules="math")
"""By + - * and whole powers alone; fast in FLINT's rationals."""


def sturm(coefficients):
    """Numbers of different real roots below, at and above 0: FLINT isolates roots, and the imaginary part of a real one is 0."""
    p = [Fraction(c) for c in coefficients]
    zero = int(p[-1] == 0)
    while p[-1] == 0:
        p.pop()
    found = [z.real for z, _ in rational_polynomial(p).complex_roots() if z.imag == 0]
    return sum(x < 0 for x in found), zero, sum(x > 0 for x in found)


def stable(a):
    """All roots left of the imaginary axis, by the exact Routh table."""
    return a[0] != 0 and routh_exact(a)


def damped(a):
    """All roots negative and different, by exact counting; boundaries themselves do not count."""
    return a[0] != 0 and sturm(a)[0] == len(a) - 1


def kind(a):
    """The class of a polynomial by exact arithmetic."""
    if a[0] == 0:
        return "undefined"
    if stable(a):
        return "heavily damped" if sturm(a)[0] == len(a) - 1 else "stable"
    return "capsize" if sum(sturm(a)[1:]) else "weave"


# Polylines in a plane


def distance(point, arcs):
    """Distance from a point to polylines given as arrays of shape (n, 2)."""
    best = np.inf
    for arc in arcs:
        p, d = arc[:-1], np.diff(arc, axis=0)
        length = np.maximum(np.sum(d * d, axis=1), 1e-300)
        share = np.clip(np.sum((np.asarray(point) - p) * d, axis=1) / length, 0, 1)
        best = min(best, float(np.min(np.hypot(*(p + share[:, None] * d - point).T))))
    return best


def changes(inside, begin, end, samples):
    """Points on a segment where a truth changes, bisected to 1e-10 of its length; found among `samples` points."""
    shares = np.linspace(0, 1, samples)
    truths = [inside(begin + s * (end - begin)) for s in shares]
    for k in range(samples - 1):
        if truths[k] == truths[k + 1]:
            continue
        low, high = shares[k], shares[k + 1]
        while high - low > 1e-10:
            middle = (low + high) / 2
            low, high = (middle, high) if inside(begin + middle * (end - begin)) == truths[k] else (low, middle)
        yield begin + high * (end - begin)
