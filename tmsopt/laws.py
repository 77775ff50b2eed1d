"""Closed-form laws of the two-mass-skate (TMS) bicycle, each named after its equation label in the source.

Source: O. N. Kirillov, *Localizing EP sets in dissipative systems and the self-stability of bicycles* (2018).
The module imports nothing from the package: tests use it as an independent reference.

Symbols, all dimensionless (lengths over the wheelbase w, time over sqrt(w/g)): `Fr` Froude number
v/sqrt(g w), `mu` mass ratio m_H/m_B, `chi_B`, `chi_H` horizontal and `zeta_B`, `zeta_H` vertical positions
of the two masses (z points down, so zeta < 0), `lambda_s` steer axis tilt in rad, `omega0` the multiple root
(negative). The docstrings also use r = sqrt(zeta_B/zeta_H) and h = sqrt(zeta_B zeta_H).

Every function takes floats or arrays, broadcasts them, and returns float64 of the broadcast shape, with a
leading axis where the docstring says so. No value of an argument causes an error or a warning: a pole gives inf or
nan, and the square root of a negative number gives nan. "chi_H = 1" in a docstring is a condition, not an argument.
Exact number types give exact results if they have a method `sqrt`, and lambda_s also a method `tan`.
"""

from collections.abc import Callable
from functools import wraps
from typing import NamedTuple, ParamSpec, TypeAlias, TypeVar, cast

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]
Truth: TypeAlias = npt.NDArray[np.bool_]
Real: TypeAlias = float | Array

P = ParamSpec("P")
R = TypeVar("R")

LABELS: dict[str, str] = {
    "matrices": "mass, velocity and position matrices of the linearised equations",
    "copo": "coefficients of the characteristic polynomial",
    "lscf": "conditions for asymptotic stability (printed form; see the docstring for where it fails)",
    "flus": "square of the critical Froude number of weaving",
    "bench": "the benchmark bicycle, SI units",
    "w0": "lower bound of the spectral abscissa, attained at EP4",
    "4poly": "the monic polynomial with a four-fold root",
    "a1a3": "EP4 conditions on a1 and a3",
    "chib": "EP4 scaling law for chi_B",
    "a2": "EP4 condition on a2",
    "e1": "a2 for the benchmark geometry and omega0 = -1",
    "e2": "w0 for the benchmark geometry and omega0 = -1",
    "e3": "p(-1) = 0 for the benchmark geometry",
    "Frc1": "square of the critical Froude number, chi_H = 1",
    "chibm": "chi_B of the least critical Froude number, chi_H = 1",
    "frm": "the least critical Froude number, chi_H = 1",
    "w01": "the four-fold root, chi_H = 1",
    "chib1": "EP4 scaling law for chi_B, chi_H = 1",
    "tls": "tan(lambda_s) at EP4, chi_H = 1",
    "frep4": "Froude number at EP4, chi_H = 1",
    "epset": "Froude number on the EP set (2EP2, EP4, CEP2), chi_H = 1",
    "dp": "design principle: chi_B and the range of tan(lambda_s), chi_H = 1",
}
"""Label of an equation in the source → its meaning."""

bench: dict[str, float] = {
    "w": 1.0,
    "lambda_s": np.pi * 5 / 180,
    "m_H": 1.0,
    "m_B": 10.0,
    "x_B": 1.2,
    "x_H": 1.02,
    "z_B": -0.4,
    "z_H": -0.2,
}
"""`bench`: the benchmark bicycle in SI units (m, kg, rad)."""


def _law(formula: Callable[P, R]) -> Callable[P, R]:
    """Evaluate a formula in float64 without exceptions or warnings; a pole gives inf or nan."""

    @wraps(formula)
    def evaluate(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            positional = [np.asarray(value, float)[()] for value in args]
            named = {name: np.asarray(value, float)[()] for name, value in kwargs.items()}
        except TypeError:  # exact numbers
            return formula(*args, **kwargs)
        with np.errstate(all="ignore"):
            return cast(Callable[..., R], formula)(*positional, **named)

    return evaluate


def _stack(*parts: Real) -> Array:
    return np.stack(np.broadcast_arrays(*parts))


_tan: Callable[[Real], Real] = np.tan
_sqrt: Callable[[Real], Real] = np.sqrt


# The model and its stability


@_law
def matrices(
    Fr: Real, mu: Real, chi_B: Real, chi_H: Real, zeta_B: Real, zeta_H: Real, lambda_s: Real
) -> tuple[Array, Array, Array]:
    """Matrices M, V, P of M q'' + V q' + P q = 0 with q = (lean, steer), of shape (..., 2, 2). Equation `matrices`.

    Example:
        >>> M, V, P = tmsopt.laws.matrices(Fr=1, mu=0.1, chi_B=1.2, chi_H=1.02, zeta_B=-0.4, zeta_H=-0.2, lambda_s=0)
        >>> print(f"{M[0, 0]:.3f} {V[0, 1]:.4f} {P[0, 0]:.2f}")  # mu zeta_H^2 + zeta_B^2, ...
        0.164 0.5004 -0.42

    More: docs/explanation/paper.md
    """
    cos, sin = np.cos(lambda_s), np.sin(lambda_s)
    nu_H = (chi_H - 1) * cos - zeta_H * sin
    weight = mu * zeta_H + zeta_B
    gyro = -mu * chi_H * zeta_H - chi_B * zeta_B
    mass = mu * zeta_H**2 + zeta_B**2, -mu * zeta_H * nu_H, -mu * zeta_H * nu_H, mu * nu_H**2
    velocity = 0.0, gyro * Fr * cos, 0.0, mu * chi_H * nu_H * Fr * cos
    position = weight, -(Fr**2) * cos * weight - mu * nu_H, -mu * nu_H, mu * (Fr**2 * cos - sin) * nu_H

    entries = _stack(*mass, *velocity, *position)
    shape = (3, 2, 2, *entries.shape[1:])
    M, V, P = np.moveaxis(entries.reshape(shape), (1, 2), (-2, -1))
    return M, V, P


@_law
def copo(Fr: Real, mu: Real, chi_B: Real, chi_H: Real, zeta_B: Real, zeta_H: Real, lambda_s: Real) -> Array:
    """Coefficients a0, ..., a4 of the characteristic polynomial, shape (5, ...). Equation `copo`.

    The polynomial is det(M s^2 + V s + P) / (mu nu_H cos(lambda_s)). It is not monic, and a0 < 0 where nu_H < 0. The
    order is the same as in `np.polyval`.

    Example:
        >>> a = tmsopt.laws.copo(2.337214017, 20.84626701, 1.19, 1.02, -0.4, -0.2, 0.8514403685)  # four roots at -1
        >>> (a / a[0]).round(6)
        array([1., 4., 6., 4., 1.])

    More: docs/explanation/paper.md
    """
    T, k = _tan(lambda_s), chi_H - 1
    a0 = -(zeta_H * T - chi_H + 1) * zeta_B**2
    a1 = Fr * (zeta_B * chi_H - zeta_H * chi_B) * zeta_B
    a2 = Fr**2 * (zeta_B - zeta_H) * zeta_B - zeta_B * (zeta_B + zeta_H) * T - k * (mu * zeta_H - zeta_B)
    a3 = -Fr * (chi_B - chi_H) * zeta_B
    a4 = -zeta_B * T - mu * k
    return _stack(a0, a1, a2, a3, a4)


@_law
def flus(mu: Real, chi_B: Real, chi_H: Real, zeta_B: Real, zeta_H: Real, lambda_s: Real) -> Real:
    """Square of the critical Froude number of weaving; not finite at chi_B = chi_H. Equation `flus`.

    At this value of Fr^2, a1 a2 a3 - a0 a3^2 - a1^2 a4 is zero, for every chi_H and either sign of lambda_s. The value
    is negative if no speed gives a zero. It bounds the stable speeds only where a0, a1, a3, a4 have the same sign, and
    is positive there for chi_H > 0. Elsewhere a positive value is not a stability boundary.

    Example:
        >>> square = tmsopt.laws.flus(0.1, 1.2, 1.02, -0.4, -0.2, tmsopt.laws.bench["lambda_s"])
        >>> print(f"{(9.81 * square) ** 0.5:.6f} m/s")  # the benchmark
        2.841008 m/s

    More: docs/explanation/weave_and_capsize.md
    """
    T, k, skew = _tan(lambda_s), chi_H - 1, zeta_B * chi_H - zeta_H * chi_B
    return (
        (zeta_B - zeta_H) / (chi_B - chi_H) * chi_B * chi_H / skew * T
        + k / (chi_B - chi_H) * chi_H / zeta_B * mu
        - k / skew * chi_B
    )


@_law
def Fr_c(mu: Real, chi_B: Real, chi_H: Real, zeta_B: Real, zeta_H: Real, lambda_s: Real) -> Real:
    """Critical Froude number, the square root of `flus`; nan where `flus` is negative.

    Example:
        >>> print(f"{tmsopt.laws.Fr_c(0.1, 1.2, 1.02, -0.4, -0.2, tmsopt.laws.bench['lambda_s']):.6f}")
        0.907064

    More: docs/explanation/weave_and_capsize.md
    """
    return _sqrt(flus(mu, chi_B, chi_H, zeta_B, zeta_H, lambda_s))


@_law
def lscf(Fr: Real, mu: Real, chi_B: Real, chi_H: Real, zeta_B: Real, zeta_H: Real, lambda_s: Real) -> Truth:
    """The five stability conditions in the order of the paper, boolean of shape (5, ...). Equation `lscf`.

    For lambda_s > 0 all five are necessary; for chi_H >= 1 they are also sufficient. For chi_H < 1 they are NOT
    sufficient, contrary to the paper: the condition a1 > 0, that is zeta_B chi_H < zeta_H chi_B, is missing. A
    counterexample is chi_H = 0.9, chi_B = 1.2, zeta_B = -0.5, zeta_H = -0.4, mu = 5, tan(lambda_s) = 0.5 with
    Fr_c = 1: it is unstable at every Fr > 1. For lambda_s < 0 the five never hold together. There a bicycle is stable
    exactly if the first four inequalities hold in reverse, zeta_B chi_H > zeta_H chi_B, and Fr > Fr_c.
    `lscf_complete` is valid everywhere.

    Example:
        >>> benchmark = 0.1, 1.2, 1.02, -0.4, -0.2, tmsopt.laws.bench["lambda_s"]
        >>> [tmsopt.laws.lscf(Fr, *benchmark).tolist() for Fr in (0.90, 0.91)]
        [[True, True, True, True, False], [True, True, True, True, True]]

    More: docs/explanation/weave_and_capsize.md
    """
    T, critical = _tan(lambda_s), Fr_c(mu, chi_B, chi_H, zeta_B, zeta_H, lambda_s)
    conditions = (
        chi_H > 1 + zeta_H * T,
        chi_H < 1 - zeta_B / mu * T,
        chi_H < chi_B,
        zeta_H > zeta_B,
        (Fr > critical) & (critical > 0),
    )
    return np.stack(np.broadcast_arrays(*conditions))


@_law
def lscf_complete(Fr: Real, mu: Real, chi_B: Real, chi_H: Real, zeta_B: Real, zeta_H: Real, lambda_s: Real) -> Truth:
    """True if the bicycle is asymptotically stable, by the complete Lienard-Chipart conditions on `copo`.

    The result is valid for any chi_H and either sign of lambda_s, because the coefficients are multiplied by the sign
    of a0.

    Example:
        >>> from math import atan
        >>> counterexample = 2, 5, 1.2, 0.9, -0.5, -0.4, atan(0.5)
        >>> bool(tmsopt.laws.lscf(*counterexample).all()), bool(tmsopt.laws.lscf_complete(*counterexample))
        (True, False)

    More: docs/explanation/weave_and_capsize.md
    """
    a = copo(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, lambda_s)
    a0, a1, a2, a3, a4 = a * np.sign(a[0])
    hurwitz = a1 * a2 * a3 - a0 * a3**2 - a1**2 * a4
    stable: Truth = (a0 > 0) & (a1 > 0) & (a2 > 0) & (a3 > 0) & (a4 > 0) & (hurwitz > 0)
    return stable


# The exceptional point of order 4, any chi_H


class EP4(NamedTuple):
    """A design with a four-fold root `omega0`; `mu` is nan if the mass ratio is free (chi_H = 1).

    Example:
        >>> design = tmsopt.laws.ep4_chi_H_1(-0.4, -0.2)
        >>> print(f"{design.chi_B:.6f} {design.lambda_s:.6f} {design.mu}")
        1.414214 0.410678 nan

    More: docs/explanation/exceptional_points.md
    """

    omega0: Real
    chi_B: Real
    tan_lambda_s: Real
    Fr: Real
    mu: Real

    @property
    def lambda_s(self) -> Real:
        """Steer axis tilt in rad, in (-pi/2, pi/2)."""
        angle: Real = np.arctan(self.tan_lambda_s)
        return angle


@_law
def w0(mu: Real, chi_H: Real, zeta_B: Real, zeta_H: Real, lambda_s: Real) -> Real:
    """The lower bound -(a4/a0)^(1/4) of the spectral abscissa; nan where a4/a0 < 0. Equation `w0`.

    Example:
        >>> print(f"{tmsopt.laws.w0(0.1, 1, -0.4, -0.2, 0.3):.8f} {-(0.4 * 0.2) ** -0.25:.8f}")
        -1.88030155 -1.88030155

    More: docs/explanation/exceptional_points.md
    """
    T, k = _tan(lambda_s), chi_H - 1
    return -_sqrt(_sqrt((zeta_B * T + mu * k) / (zeta_H * T - k) / zeta_B**2))


@_law
def poly4(omega0: Real) -> Array:
    """Coefficients of (s - omega0)^4, shape (5, ...). Equation `4poly`; its p(s) is the monic polynomial copo / a0.

    Example:
        >>> tmsopt.laws.poly4(-1)
        array([1., 4., 6., 4., 1.])

    More: docs/explanation/exceptional_points.md
    """
    return _stack(omega0**0, -4 * omega0, 6 * omega0**2, -4 * omega0**3, omega0**4)


@_law
def a1a3(Fr: Real, chi_B: Real, chi_H: Real, zeta_B: Real, zeta_H: Real, lambda_s: Real, omega0: Real) -> Array:
    """Residuals a1 + 4 omega0 a0 and a3 + 4 omega0^3 a0, shape (2, ...); both are 0 at EP4. Equation `a1a3`.

    Example:
        >>> residuals = tmsopt.laws.a1a3(2.337214017, 1.19, 1.02, -0.4, -0.2, 0.8514403685, omega0=-1)
        >>> bool(abs(residuals).max() < 1e-9)
        True

    More: docs/explanation/paper.md
    """
    a0, a1, _, a3, _ = copo(Fr, 0, chi_B, chi_H, zeta_B, zeta_H, lambda_s)
    return _stack(a1 + 4 * omega0 * a0, a3 + 4 * omega0**3 * a0)


@_law
def chib(omega0: Real, chi_H: Real, zeta_B: Real, zeta_H: Real) -> Real:
    """chi_B at EP4. This scaling law gives a3/a1 = omega0^2. Equation `chib`.

    Example:
        >>> print(f"{tmsopt.laws.chib(-1, 1.02, -0.4, -0.2):.6f}")
        1.190000

    More: docs/explanation/paper.md
    """
    return (omega0**2 * zeta_B - 1) / (omega0**2 * zeta_H - 1) * chi_H


@_law
def a2(Fr: Real, mu: Real, chi_H: Real, zeta_B: Real, zeta_H: Real, lambda_s: Real, omega0: Real) -> Real:
    """Left side minus right side of the EP4 condition a2 = 6 omega0^2 a0, divided by zeta_B. Equation `a2`.

    Example:
        >>> residual = tmsopt.laws.a2(2.337214017, 20.84626701, 1.02, -0.4, -0.2, 0.8514403685, omega0=-1)
        >>> bool(abs(residual) < 1e-9)
        True

    More: docs/explanation/paper.md
    """
    left = Fr**2 * (zeta_B - zeta_H) + (6 * omega0**2 * zeta_H * zeta_B - zeta_B - zeta_H) * _tan(lambda_s)
    return left - (chi_H - 1) * (6 * omega0**2 * zeta_B**2 + mu * zeta_H - zeta_B) / zeta_B


@_law
def e1(Fr: Real, mu: Real, lambda_s: Real) -> Real:
    """Left side of `e1`: a2 - 6 a0 at chi_B, chi_H, zeta_B, zeta_H = 1.19, 1.02, -0.4, -0.2, omega0 = -1.

    Example:
        >>> bool(abs(tmsopt.laws.e1(2.337214017, 20.84626701, 0.8514403685)) < 1e-9)
        True

    More: docs/explanation/paper.md
    """
    return -0.432 * _tan(lambda_s) - 0.0272 + 0.08 * Fr**2 + 0.004 * mu


@_law
def e2(mu: Real, lambda_s: Real) -> Real:
    """Left side of `e2`: a4 - a0 for the geometry of `e1`.

    Example:
        >>> bool(abs(tmsopt.laws.e2(20.84626701, 0.8514403685)) < 1e-9)
        True

    More: docs/explanation/paper.md
    """
    return 0.368 * _tan(lambda_s) - 0.02 * mu - 0.0032


@_law
def e3(Fr: Real, mu: Real, lambda_s: Real) -> Real:
    """Left side of `e3`: p(-1) for the geometry of `e1`.

    Example:
        >>> bool(abs(tmsopt.laws.e3(2.337214017, 20.84626701, 0.8514403685)) < 1e-9)
        True

    More: docs/explanation/paper.md
    """
    return 0.192 * _tan(lambda_s) - 0.0048 - 0.136 * Fr + 0.08 * Fr**2 - 0.016 * mu


@_law
def ep4(omega0: Real, zeta_B: Real, zeta_H: Real, chi_H: Real) -> tuple[EP4, EP4]:
    """Both designs with the four-fold root `omega0`, from `chib`, `a1a3`, `a2` and `w0`.

    All fields have the same shape. For zeta_B, zeta_H < 0 both designs are real. The first can be a bicycle: it has
    Fr > 0 if omega0 < 0 < chi_H, and mu > 0 only if (chi_H - 1) (zeta_H - zeta_B) (abs(w01) - abs(omega0)) > 0. The
    second always has mu < 0. Fr, mu and tan_lambda_s are nan where they would be complex (possible for zeta_H > 0), at
    zeta_B = zeta_H, where no EP4 exists, and at chi_H = 1, where omega0 must be `w01` and mu is free: use
    `ep4_chi_H_1` there.

    Example:
        >>> bicycle, other = tmsopt.laws.ep4(-1, -0.4, -0.2, 1.02)
        >>> print(f"{bicycle.Fr:.9f} {bicycle.mu:.8f} {bicycle.lambda_s:.10f}", bool(other.mu < 0))
        2.337214017 20.84626701 0.8514403685 True

    More: docs/explanation/paper.md
    """
    # With u = zeta_H T - k the conditions reduce to a quadratic equation for u. Its discriminant is a sum of squares in
    # y = -omega0^2 zeta_H, and S > 2, so neither root loses digits by cancellation, even if the two are close. The
    # second root has u + k = k lift / (zeta_B S), which needs no difference of nearly equal numbers either.
    k, y, fall = chi_H - 1, -(omega0**2) * zeta_H, zeta_B - zeta_H
    S = 1 + 6 * y + y**2 + _sqrt((1 - y) ** 4 + 16 * y * (1 + y) ** 2 * (1 - 2 / chi_H) ** 2)
    u = -S * fall * chi_H**2 / (32 * y * (1 + y) ** 2 * zeta_B)
    lift = zeta_B * (S - 2) + 2 * zeta_H

    tilts = (u + k) / zeta_H, k * lift / (zeta_B * zeta_H * S)
    froudes = -omega0 * S * chi_H / (8 * y * (1 + y)), -8 * omega0 * (1 + y) * k / (chi_H * S)
    mass_ratios = (
        -zeta_B / zeta_H * (u * (1 - omega0**4 * zeta_B * zeta_H) / k + 1),
        -(lift / zeta_H + 2 * omega0**4 * zeta_B * fall) / S,
    )
    exists = np.where((k != 0) & (fall != 0), 1.0, np.nan)

    def branch(T: Real, Fr: Real, mu: Real) -> EP4:
        chi_B = chib(omega0, chi_H, zeta_B, zeta_H)
        fields = np.broadcast_arrays(omega0, chi_B, T * exists, Fr * exists, mu * exists)
        return EP4(*(field[()] for field in fields))

    first, second = map(branch, tilts, froudes, mass_ratios)
    return first, second


# chi_H = 1


@_law
def Frc1(chi_B: Real, zeta_B: Real, zeta_H: Real, lambda_s: Real) -> Real:
    """Square of the critical Froude number for chi_H = 1; it has the same sign as `flus`. Equation `Frc1`.

    Example:
        >>> square = tmsopt.laws.Frc1(2**0.5, -0.4, -0.2, tmsopt.laws.ep4_chi_H_1(-0.4, -0.2).lambda_s)
        >>> print(f"{square**0.5:.8f} {(30 * 2**0.5 + 120) ** 0.5 / 8:.8f}")  # Table 1
        1.59308274 1.59308274

    More: docs/explanation/weave_and_capsize.md
    """
    return (zeta_B - zeta_H) / (zeta_B - chi_B * zeta_H) * chi_B / (chi_B - 1) * _tan(lambda_s)


@_law
def chibm(zeta_B: Real, zeta_H: Real) -> Real:
    """The chi_B that minimises `Frc1` between its poles chi_B = 1 and chi_B = zeta_B/zeta_H. Equation `chibm`.

    Example:
        >>> print(f"{tmsopt.laws.chibm(-0.4, -0.2):.8f}")  # the square root of 2
        1.41421356

    More: docs/explanation/paper.md
    """
    return _sqrt(zeta_B / zeta_H)


@_law
def frm(zeta_B: Real, zeta_H: Real, lambda_s: Real) -> Real:
    """The smallest critical Froude number over chi_B (not its square); chi_B is `chibm` there. Equation `frm`.

    It is nan unless abs(zeta_B) > abs(zeta_H) and lambda_s >= 0, or both inequalities are reversed.

    Example:
        >>> tilt = tmsopt.laws.ep4_chi_H_1(-0.4, -0.2).lambda_s
        >>> print(f"{tmsopt.laws.frm(-0.4, -0.2, tilt - 0.05):.6f} {tmsopt.laws.frm(-0.4, -0.2, tilt + 0.80):.6f}")
        1.482682 3.934332

    More: docs/explanation/weave_and_capsize.md
    """
    b, h = _sqrt(np.abs(zeta_B)), _sqrt(np.abs(zeta_H))
    return _sqrt((b + h) / (b - h) * _tan(lambda_s))


@_law
def w01(zeta_B: Real, zeta_H: Real) -> Real:
    """The four-fold root -(zeta_B zeta_H)^(-1/4) for chi_H = 1; it equals the bound `w0`. Equation `w01`.

    Example:
        >>> print(f"{tmsopt.laws.w01(-0.4, -0.2):.8f} {-(5**0.5) / 2**0.25:.8f}")  # Table 1
        -1.88030155 -1.88030155

    More: docs/explanation/exceptional_points.md
    """
    return -_sqrt(_sqrt(1 / (zeta_B * zeta_H)))


@_law
def chib1(zeta_B: Real, zeta_H: Real) -> Real:
    """chi_B at EP4 and on the EP set; the same value as `chibm`. Equation `chib1`.

    Example:
        >>> print(f"{tmsopt.laws.chib1(-1.158, -0.526):.3f}")  # the built machine has 1.526
        1.484

    More: docs/explanation/paper.md
    """
    return _sqrt(zeta_B / zeta_H)


@_law
def tls(zeta_B: Real, zeta_H: Real) -> Real:
    """tan(lambda_s) at EP4, not lambda_s itself; it is negative for abs(zeta_B) < abs(zeta_H). Equation `tls`.

    Example:
        >>> print(f"{tmsopt.laws.tls(-0.4, -0.2):.8f} {15 / 4 - 75 / 32 * 2**0.5:.8f}")
        0.43543696 0.43543696

    More: docs/explanation/paper.md
    """
    w2 = w01(zeta_B, zeta_H) ** 2
    total = (zeta_B + zeta_H) * w2
    return w2 * (zeta_B - zeta_H) / (16 * zeta_H) * (total - 6) / (total - 2)


@_law
def frep4(zeta_B: Real, zeta_H: Real) -> tuple[Real, Real]:
    """Both roots of the paper's quadratic equation for Fr at EP4: first the true, then the spurious. Equation `frep4`.

    The quadratic equation contains `tls`. The true root is positive. The spurious root is not an EP4; it equals
    -(r - 1)^2 abs(omega0) / (4 (r + 1)) and is never positive.

    Example:
        >>> true, spurious = tmsopt.laws.frep4(-0.4, -0.2)
        >>> print(f"{true:.8f} {3 / 8 * (110 * 2**0.5 - 120) ** 0.5:.8f}", bool(spurious < 0))
        2.23631752 2.23631752 True

    More: docs/explanation/paper.md
    """
    w = w01(zeta_B, zeta_H)
    a, half_b, c = w**2 * zeta_B - 1, w**3 * zeta_B, -(w**2 * zeta_B + 1) * tls(zeta_B, zeta_H)
    half_sum = -(half_b + _sqrt(half_b**2 - a * c))  # half_b > 0 and a c <= 0, so this sum loses no digits
    return half_sum / a, c / half_sum


@_law
def epset(zeta_B: Real, zeta_H: Real, lambda_s: Real) -> Real:
    """Froude number at which a design with chi_H = 1, chi_B = `chib1` has two double roots. Equation `epset`.

    It is nan unless tan(lambda_s) (r + 1)/(r - 1) > r/(4 h); if both sides are equal, it is infinite. The double roots
    are real (2EP2) if abs(tan(lambda_s)) is smaller than abs(`tls`), and complex (CEP2) if it is larger.

    Example:
        >>> tilt = tmsopt.laws.ep4_chi_H_1(-0.4, -0.2).lambda_s
        >>> print(f"{tmsopt.laws.epset(-0.4, -0.2, tilt - 0.05):.6f} {tmsopt.laws.epset(-0.4, -0.2, tilt + 0.80):.6f}")
        2.257421 4.103508

    More: docs/explanation/exceptional_points.md
    """
    w, T = w01(zeta_B, zeta_H), _tan(lambda_s)
    ratio = (w**2 * zeta_B - 1) / (w**2 * zeta_B + 1)
    return ratio * 2 * T / _sqrt(w**4 * zeta_B + 4 * T * ratio)


@_law
def dp(zeta_B: Real, zeta_H: Real) -> tuple[Real, Real]:
    """chi_B, and the largest tan(lambda_s) for which some speed gives heavy damping. Equation `dp`.

    The paper's range 0 < tan(lambda_s) <= bound is empty for abs(zeta_B) < abs(zeta_H). By duality (`dual`) the range
    there is bound <= tan(lambda_s) < 0.

    Example:
        >>> tmsopt.laws.dp(-0.4, -0.2) == (tmsopt.laws.chib1(-0.4, -0.2), tmsopt.laws.tls(-0.4, -0.2))
        True

    More: docs/explanation/paper.md
    """
    return chib1(zeta_B, zeta_H), tls(zeta_B, zeta_H)


# chi_H = 1, compact forms not in the paper


@_law
def ep4_chi_H_1(zeta_B: Real, zeta_H: Real) -> EP4:
    """The EP4 for chi_H = 1 in compact form.

    mu is nan, because the EP4 does not depend on the mass ratio. At zeta_B = zeta_H no EP4 exists, and tan_lambda_s and
    Fr are nan.

    Example:
        >>> design = tmsopt.laws.ep4_chi_H_1(-0.4, -0.2)
        >>> print(f"{design.Fr:.8f} {design.tan_lambda_s:.8f}")
        2.23631752 0.43543696

    More: docs/explanation/paper.md
    """
    r, h = _sqrt(zeta_B / zeta_H), _sqrt(zeta_B * zeta_H)
    step = np.where(r == 1, np.nan, (r**2 + 6 * r + 1) / (r + 1))[()]  # a1 = a3 = 0 at r = 1: no EP4 exists
    return EP4(-1 / _sqrt(h), r, (r - 1) * step / (16 * h), step / (4 * _sqrt(h)), np.nan * r)


@_law
def Fr_c2_chi_H_1(zeta_B: Real, zeta_H: Real, lambda_s: Real) -> Real:
    """Square of the critical Froude number for chi_H = 1 and chi_B = `chib1`; it is `frm` squared.

    Example:
        >>> print(f"{tmsopt.laws.Fr_c2_chi_H_1(-0.4, -0.2, 0.3):.8f} {tmsopt.laws.frm(-0.4, -0.2, 0.3) ** 2:.8f}")
        1.80294379 1.80294379

    More: docs/explanation/weave_and_capsize.md
    """
    r = _sqrt(zeta_B / zeta_H)
    return _tan(lambda_s) * (r + 1) / (r - 1)


@_law
def dual(Fr: Real, chi_B: Real, zeta_B: Real, zeta_H: Real, lambda_s: Real) -> dict[str, Real]:
    """The dual design, which has the same spectrum for chi_H = 1, as keyword arguments.

    The dual of the dual is the original design. Duality exchanges the heights of the masses and reverses the sign of
    lambda_s, so it maps the two classes of stable bicycles onto each other. Pass the result to `copo` with chi_H = 1
    and any mu.

    Example:
        >>> bicycle = dict(Fr=2, chi_B=1.4, zeta_B=-0.4, zeta_H=-0.2, lambda_s=0.3)
        >>> a, b = (tmsopt.laws.copo(mu=1, chi_H=1, **d) for d in (bicycle, tmsopt.laws.dual(**bicycle)))
        >>> bool(abs(b / b[0] - a / a[0]).max() < 1e-12)  # the same coefficients up to a factor
        True

    More: docs/explanation/paper.md
    """
    tilt: Real = np.arctan(-_tan(lambda_s) / chi_B**2)
    return {"Fr": Fr / chi_B, "chi_B": 1 / chi_B, "zeta_B": zeta_H, "zeta_H": zeta_B, "lambda_s": tilt}
