"""Independent oracles: 60-digit and exact arithmetic on the two-mass-skate model and on polynomials.

Nothing here imports the package. Polynomials are lists of coefficients, highest power first. Floats are taken
exactly, so the 60 digits refer to the very numbers the package was given.

Source of the model: O. N. Kirillov (2018), equation `matrices`.
"""

from fractions import Fraction

import flint
import numpy as np
import sympy  # type: ignore[import-untyped]
from mpmath import mp

DIGITS = 60
GUARD = 20  # digits carried and not promised


# The model at 60 digits, from its matrices


def polynomial_60(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, lambda_s):
    """a0, ..., a4 of det(M s^2 + V s + P) / (mu nu_H cos(lambda_s)); mu, nu_H and cos(lambda_s) not 0."""
    with mp.workdps(DIGITS + GUARD):
        Fr, mu, chi_B, chi_H, zeta_B, zeta_H, lambda_s = map(_mpf, (Fr, mu, chi_B, chi_H, zeta_B, zeta_H, lambda_s))
        cos, sin = mp.cos(lambda_s), mp.sin(lambda_s)
        M, V, P, nu_H = matrices(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, cos, sin)
        return _rounded(a / (mu * nu_H * cos) for a in _determinant(M, V, P))


def polynomial_exact(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, tan_lambda_s):
    """The same coefficients as Fractions, for rational data and a rational tan(lambda_s).

    cos(lambda_s) may be irrational, but with sin = T cos the second row and the second column of the matrices
    each have it as a factor, and it leaves the quotient. So cos = 1 and sin = T serve.
    """
    Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T = map(Fraction, (Fr, mu, chi_B, chi_H, zeta_B, zeta_H, tan_lambda_s))
    M, V, P, nu_H = matrices(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, Fraction(1), T)
    return [a / (mu * nu_H) for a in _determinant(M, V, P)]


def symbolic_copo():
    """The coefficients a0, ..., a4 as expanded SymPy expressions, and their symbols by name.

    The symbols are Fr, mu, chi_B, chi_H, zeta_B, zeta_H and T = tan(lambda_s).
    """
    names = "Fr mu chi_B chi_H zeta_B zeta_H T"
    symbols = dict(zip(names.split(), sympy.symbols(names, real=True), strict=True))
    Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T = symbols.values()
    cos = sympy.Symbol("c", positive=True)
    M, V, P, nu_H = matrices(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, cos, T * cos)
    return [sympy.expand(sympy.cancel(a / (mu * nu_H * cos))) for a in _determinant(M, V, P)], symbols


def matrices(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, cos, sin):
    """M, V, P as printed, and nu_H, in whatever arithmetic the arguments bring."""
    nu_H = (chi_H - 1) * cos - zeta_H * sin
    M = [[mu * zeta_H**2 + zeta_B**2, -mu * zeta_H * nu_H], [-mu * zeta_H * nu_H, mu * nu_H**2]]
    V = [[0 * Fr, (-mu * chi_H * zeta_H - chi_B * zeta_B) * Fr * cos], [0 * Fr, mu * chi_H * nu_H * Fr * cos]]
    P = [
        [mu * zeta_H + zeta_B, -(Fr**2) * cos * (mu * zeta_H + zeta_B) - mu * nu_H],
        [-mu * nu_H, mu * (Fr**2 * cos - sin) * nu_H],
    ]
    return M, V, P, nu_H


def _determinant(M, V, P):
    """Coefficients of det(M s^2 + V s + P) for 2x2 matrices."""
    entry = [[(M[i][j], V[i][j], P[i][j]) for j in range(2)] for i in range(2)]
    main, cross = _product(entry[0][0], entry[1][1]), _product(entry[0][1], entry[1][0])
    return [a - b for a, b in zip(main, cross, strict=True)]


def ep4_of_heights(zeta_B, zeta_H):
    """Compact forms of χ_B, T, Fr and the 4-fold root at χ_H = 1 (equations chib1, tls, frep4, w01)."""
    r, h = mp.sqrt(zeta_B / zeta_H), mp.sqrt(zeta_B * zeta_H)
    T = (r - 1) * (r**2 + 6 * r + 1) / (16 * h * (r + 1))
    Fr = (r**2 + 6 * r + 1) / (4 * mp.sqrt(h) * (r + 1))
    return {"chi_B": r, "T": T, "Fr": Fr, "r": -1 / mp.sqrt(h)}


# Roots at 60 digits


def roots_60(coefficients):
    """All roots with multiplicity, sorted by real then imaginary part; the leading coefficient must not be 0.

    Raises mpmath.NoConvergence rather than returning roots that are not settled.
    """
    with mp.workdps(DIGITS + GUARD):
        a = [_mpf(c) for c in coefficients]
        if a[0] == 0:
            raise ValueError("the leading coefficient is 0: drop it, the degree is lower")
        zeros = 0
        while len(a) > 1 and a[-1] == 0:
            a.pop()
            zeros += 1
        found = [mp.mpc(0)] * zeros
        if len(a) > 1:
            # n-fold roots converge linearly and lose a factor n of the digits: hence steps and precision
            found += mp.polyroots(a, maxsteps=5000, extraprec=mp.prec * len(a))
        found = [mp.mpc(root) for root in found]
    return sorted((+root for root in _at_60(found)), key=lambda root: (root.real, root.imag))


def abscissa_60(coefficients):
    """The largest real part of the roots."""
    return max(root.real for root in roots_60(coefficients))


def is_stable_60(coefficients):
    """Whether every root has a negative real part, by the roots; on the axis only `routh_exact` can tell."""
    return bool(abscissa_60(coefficients) < 0)


def weave_Fr_60(mu, chi_B, chi_H, zeta_B, zeta_H, lambda_s):
    """The Froude number at which the Hurwitz determinant of the 60-digit polynomial vanishes; None where it has no zero.

    Over Fr² the determinant is linear in Fr², so its values at two speeds tell the zero.
    """

    def determinant(Fr):
        a0, a1, a2, a3, a4 = polynomial_60(mp.mpf(Fr), mu, chi_B, chi_H, zeta_B, zeta_H, lambda_s)
        return (a1 * a2 * a3 - a0 * a3**2 - a1**2 * a4) / Fr**2

    with mp.workdps(DIGITS + GUARD):
        if zeta_B == zeta_H:  # a common factor of the determinant, which leaves its zero: go around
            zeta_B = _mpf(zeta_B) * (1 + mp.mpf(10) ** -25)
        if chi_B == chi_H:
            return None  # a3 = 0, and the determinant does not depend on the speed
        one, two = determinant(1), determinant(2)
        square = 1 - 3 * one / (two - one)
        return mp.sqrt(square) if square >= 0 else None


# Exact arithmetic


def exact_multiplicities(coefficients):
    """(multiplicity, degree) of each square-free part over the rationals, sorted.

    [(1, 2), (3, 1)] is one triple root and two simple ones. Coefficients are rational; floats are exact.
    """
    _, factors = rational_polynomial(coefficients).factor_squarefree()
    return sorted((multiplicity, factor.degree()) for factor, multiplicity in factors)


def certified_roots(coefficients):
    """Each distinct root once, with its exact multiplicity, from balls that provably isolate it (FLINT)."""
    with flint.ctx.workdps(DIGITS + GUARD), mp.workdps(DIGITS + GUARD):
        balls = rational_polynomial(coefficients).complex_roots()
        return [(mp.mpc(_middle(ball.real), _middle(ball.imag)), count) for ball, count in balls]


def routh_exact(coefficients):
    """Whether all roots lie in the open left half plane, by the Routh table in Fractions.

    Any degree and either sign of the leading coefficient, which must not be 0.
    """
    a = [Fraction(c) for c in coefficients]
    if a[0] == 0:
        raise ValueError("the leading coefficient is 0: drop it, the degree is lower")
    upper = [c / a[0] for c in a[0::2]]
    lower = [c / a[0] for c in a[1::2]]
    while lower:
        if lower[0] <= 0:
            return False
        ratio = upper[0] / lower[0]
        padded = lower[1:] + [Fraction(0)] * (len(upper) - len(lower))
        upper, lower = lower, [p - ratio * q for p, q in zip(upper[1:], padded, strict=True)]
    return True


def discriminant_exact(coefficients):
    """Discriminant (-1)^(n(n-1)/2) Res(p, p') / a0 by FLINT, as a Fraction; degree >= 1."""
    found = rational_polynomial(coefficients).discriminant()
    return Fraction(int(found.p), int(found.q))


# Small change


def rational_polynomial(coefficients):
    """The polynomial in FLINT's rationals."""
    exact = [Fraction(c) for c in reversed(coefficients)]
    return flint.fmpq_poly([flint.fmpq(c.numerator, c.denominator) for c in exact])


def _product(p, q):
    return np.convolve(np.array(p, dtype=object), np.array(q, dtype=object)).tolist()


def _mpf(value):
    """Exact for floats (NumPy's too) and mpf; Fractions are rounded to the working precision."""
    if isinstance(value, Fraction):
        return mp.mpf(value.numerator) / value.denominator
    return value if isinstance(value, mp.mpf) else mp.mpf(float(value) if isinstance(value, float) else value)


def _middle(ball):
    mantissa, exponent = ball.mid().man_exp()
    return mp.ldexp(mp.mpf(int(mantissa)), int(exponent))


def _at_60(values):
    with mp.workdps(DIGITS):
        return [+value for value in values]


def _rounded(values):
    return _at_60(list(values))
