"""Bicycles with χ_H = 1 in the coordinates that take the radicals away.

ζ_B = −q² r, ζ_H = −q²/r, so √(ζ_B/ζ_H) = r, ω0 = −1/q, and h = √(ζ_B ζ_H) = q². At χ_B = r the roots over |ω0|,
σ = q s, obey the palindromic σ⁴ + B1 σ³ + B2 σ² + B1 σ + 1, that is u² + B1 u + B2 − 2 = 0 with u = σ + 1/σ.
"""

import random
from collections.abc import Iterator
from functools import cache
from typing import Any

import flint

from tmsopt.arithmetic.identity import Quotient
from tmsopt.models import copo
from tmsopt.models.exact import Tilt
from tmsopt.paper.ledger.algebra import matched, polynomials, positive, q, ring, stable, substitute
from tmsopt.paper.ledger.printed import laws

_NAMES = "Fr mu chi_B chi_H zeta_B zeta_H T"
Design = tuple[Any, ...]  # Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T as fractions


HEIGHTS = q("-0.4"), q("-0.2")
"""ζ_B and ζ_H of every design of the section."""


def quartic(Fr: Any, chi_B: Any, T: Any, r: Any, scale: Any) -> list[Any]:
    """Coefficients with χ_H = 1, in the coordinates r and q (here `scale`)."""
    nothing = 0 * T
    return copo(Fr, nothing, chi_B, 1 + nothing, -(scale**2) * r, -(scale**2) / r, T)


def normal(Fr: Any, chi_B: Any, T: Any, r: Any, scale: Any) -> list[Any]:
    """Coefficients of the monic polynomial in σ = q s."""
    a = quartic(Fr, chi_B, T, r, scale)
    return [a[k] / a[0] * scale**k for k in range(5)]


def palindrome() -> tuple[Quotient, Quotient, tuple[Quotient, ...]]:
    """B1, B2 at χ_B = r and the variables Fr, T, r, q they are made of.

    Raises:
        ArithmeticError: if the polynomial in σ is not palindromic.
    """
    Fr, T, r, scale = variables = ring("Fr T r q")
    b = normal(Fr, r, T, r, scale)
    if not (b[4] == 1 and b[1] == b[3]):
        raise ArithmeticError("the polynomial is not palindromic at χ_B = r")
    return b[1], b[2], variables


def general() -> tuple[list[Any], tuple[Quotient, ...]]:
    """Coefficients of any bicycle and its seven parameters, as variables."""
    variables = ring(_NAMES)
    return copo(*variables), variables


def monic() -> tuple[list[Any], tuple[Quotient, ...]]:
    """Coefficients of the monic polynomial in σ for any χ_B, and the variables Fr, χ_B, T, r, q."""
    variables = ring("Fr chi_B T r q")
    return normal(*variables), variables


def grown() -> tuple[list[Any], tuple[Quotient, ...]]:
    """Those at χ_B = r = 1 + ρ and the variables Fr, T, ρ, q: all signs show."""
    Fr, T, rho, scale = variables = ring("Fr T rho q")
    return normal(Fr, 1 + rho, T, 1 + rho, scale), variables


def by_hand(Fr: str, T: str) -> list[Any]:
    """The bicycle with ζ_B = −2, ζ_H = −1/2, χ_B = 2 (r = 2, h = 1), monic, in fractions."""
    return normal(q(Fr), q(2), q(T), q(2), q(1))


def tilt_of_EP4(r: Any, h: Any) -> Any:
    """tan λ_s of the EP4, compact: not the printed form; see the entry tls for its proof."""
    return (r - 1) * (r**2 + 6 * r + 1) / (16 * h * (r + 1))


def speed_of_EP4(r: Any, scale: Any) -> Any:
    """Its Froude number; see the entry compact."""
    return (r**2 + 6 * r + 1) / (4 * scale * (r + 1))


def fourfold() -> bool:
    """That tilt and speed at χ_B = r give (σ + 1)⁴, for all heights."""
    r, scale = ring("r q")
    return normal(speed_of_EP4(r, scale), r, tilt_of_EP4(r, scale**2), r, scale) == [1, 4, 6, 4, 1]


def order_identity() -> bool:
    """At B1 = 4, (u1 + 2)(u2 + 2) has the sign of tan λ_s less that of the EP4: it decides which u meets −2."""
    T, r, scale = ring("T r q")
    b = normal(4 * scale * T / (r - 1), r, T, r, scale)
    return bool(b[1] == 4 and b[2] - 6 == 16 * scale**2 * (r + 1) * (T - tilt_of_EP4(r, scale**2)) / (r * (r - 1)))


def asymmetry_identity() -> bool:
    """b4 = 1, and b3² − b1² vanishes only at χ_B = ±r."""
    b, (Fr, chi_B, T, r, scale) = monic()
    difference = Fr**2 * (r**2 - 1) * (chi_B**2 - r**2) / (scale**2 * T**2 * r**2)
    return bool(b[4] == 1 and b[3] ** 2 - b[1] ** 2 == difference)


def pole(T: Any, r: Any, scale: Any) -> Any:
    """What must be positive for the EP set to have a real speed: the tilt beyond its pole."""
    return 4 * scale**2 * T * (r + 1) - r * (r - 1)


def at_heights(Fr: Any, chi_B: Any, T: Any) -> list[Any]:
    """Coefficients with χ_H = 1 for ζ_B = −0.4, ζ_H = −0.2; μ has no influence."""
    return copo(Fr, q(0), chi_B, q(1), *HEIGHTS, T)


def lifted(names: str) -> tuple[list[Any], tuple[Any, ...]]:
    """These with Fr, χ_B, T, and the further unknowns, as polynomials of one ring."""
    Fr, chi_B, T, *unknowns = polynomials(f"Fr chi_B T {names}")
    return at_heights(Fr, chi_B, T), tuple(unknowns)


def are_real(pair: dict[str, Any]) -> bool:
    """Whether s² + b s + c has two different real roots, certainly."""
    return bool(pair["b"] ** 2 > 4 * pair["c"])


def are_complex(pair: dict[str, Any]) -> bool:
    """Whether it has a complex pair, certainly."""
    return bool(pair["b"] ** 2 < 4 * pair["c"])


@cache
def ep4() -> dict[str, Any]:
    """Fr, χ_B, T and the 4-fold root s for ζ_B = −0.4, ζ_H = −0.2, all four unknown, proved in balls."""
    a, (s,) = lifted("s")
    return matched(a, [[1, -s]] * 4, {"Fr": 2.2, "chi_B": 1.4, "T": 0.43, "s": -1.9}, {})


def tilted(offset: str) -> Any:
    """tan(λ_s of the EP4 + offset), from the solved EP4."""
    return (ep4()["T"].atan() + flint.arb(q(offset))).tan()


@cache
def double_pair(offset: str) -> dict[str, Any]:
    """Fr, χ_B, b, c with p = a0 (s² + b s + c)² at that tilt, proved in balls."""
    a, (b, c) = lifted("b c")
    guess = {"-0.05": (2.26, 4.1), "0.80": (4.1, 1.5), "-0.18": (2.9, 8.0)}[offset]
    tilt = {"T": tilted(offset)}
    return matched(a, [[1, b, c], [1, b, c]], {"Fr": guess[0], "chi_B": 1.4, "b": guess[1], "c": 3.5}, tilt)


@cache
def ep3_left() -> dict[str, Any]:
    """Fr, T, the triple root a and the simple root t at χ_B = √2 − 0.1, proved in balls."""
    p, (a, t) = lifted("a t")
    guess = {"Fr": 2.02, "T": 0.2, "a": -0.94, "t": -14.9}
    off = {"chi_B": flint.arb(2).sqrt() - flint.arb(q("0.1"))}
    return {**matched(p, [*[[1, -a]] * 3, [1, -t]], guess, off), **off}


@cache
def ep3_right(upper: bool, offset: str = "-0.18") -> dict[str, Any]:
    """Fr, χ_B, a, t at a tilt beside the EP4's: χ_B above √2, or below."""
    p, (a, t) = lifted("a t")
    guesses = {
        ("-0.18", True): (2.185, 1.515, -3.68, -0.25), ("-0.18", False): (2.086, 1.339, -1.025, -11.6),
        ("-0.05", True): (2.2352, 1.4283, -2.581, -0.727), ("-0.05", False): (2.2171, 1.4025, -1.396, -4.59),
    }  # fmt: skip
    guess = dict(zip(("Fr", "chi_B", "a", "t"), guesses[offset, upper], strict=True))
    off = {"T": tilted(offset)}
    return {**matched(p, [*[[1, -a]] * 3, [1, -t]], guess, off), **off}


@cache
def weave(offset: str, chi_B: str = "") -> dict[str, Any]:
    """Fr, ω² and the other factor at the weave boundary at that tilt; χ_B = √2 plus the given number."""
    a, (W, b, c) = lifted("W b c")
    at = {"T": tilted(offset), "chi_B": ep4()["chi_B"] + flint.arb(q(chi_B or "0"))}
    slope = float(at["T"].mid())
    guess = {"Fr": (5.8 * slope) ** 0.5, "W": 3.5, "b": 2.0 / slope**0.5, "c": 3.5}
    return matched(a, [[1, 0, W], [1, b, c]], guess, at)


@cache
def designs() -> tuple[tuple[Design, bool], ...]:
    """Rational designs in every sign regime, Fr of both signs, and whether each is stable, by its Routh conditions."""
    return tuple((design, stable(copo(*design))) for design in _designs(4000))


def _designs(count: int) -> Iterator[Design]:
    pick = random.Random(1)

    def tenths(low: int, high: int) -> Any:
        return q(pick.randint(10 * low, 10 * high)) / 10

    for k in range(count):
        chi_H = 1 + tenths(-1, 1) / 3 if k % 2 else tenths(-2, 3)
        zeta_B, zeta_H = -q(pick.randint(1, 40)) / 20, -q(pick.randint(0, 40)) / 20
        mu, T = q(pick.choice((1, 2, 5, 10, 50, 200))) / 10, q(pick.choice((1, 3, 7, 15, 60))) / 10
        Fr = tenths(0, 8) + q("1/20")
        signs = (pick.choice((1, 1, 1, -1)), pick.choice((1, -1)))
        yield signs[0] * Fr, mu, tenths(-2, 3) + q("1/50"), chi_H, zeta_B, zeta_H, signs[1] * T


def first_four(design: Design) -> list[bool]:
    _, mu, chi_B, chi_H, zeta_B, zeta_H, T = design
    return [chi_H > 1 + zeta_H * T, chi_H < 1 - zeta_B / mu * T, chi_H < chi_B, zeta_H > zeta_B]


def critical_square(design: Design) -> Any:
    """Fr_c² (flus)."""
    return laws.flus(*design[1:6], Tilt(design[6]))


def fifth(design: Design) -> bool:
    Fr, _, chi_B, chi_H, zeta_B, zeta_H, _ = design
    if zeta_B * chi_H == zeta_H * chi_B:
        return False
    square = critical_square(design)
    return bool(square > 0 and Fr > 0 and Fr * Fr > square)


def admitted(design: Design) -> bool:
    """Whether all five printed conditions hold."""
    return all(first_four(design)) and fifth(design)


def class_identity() -> bool:
    """a4 + μ a0/ζ_B² = −T (ζ_B + μ ζ_H): with T > 0 not both a0 and a4 are negative, with T < 0 not both positive."""
    a, (_, mu, _, _, zeta_B, zeta_H, T) = general()
    return bool(a[4] + mu * a[0] / zeta_B**2 == -T * (zeta_B + mu * zeta_H))


def standstill_identity() -> bool:
    """At Fr = 0, a2 is minus a positive combination of a0 and a4; with y = −ζ > 0."""
    mu, k, y_B, y_H, T = ring("mu k y_B y_H T")
    a = copo(0 * T, mu, 2 * k, 1 + k, -y_B, -y_H, T)
    weight = y_B + mu * y_H
    return bool(a[2] * weight == -a[4] * (y_B**2 + mu * y_H**2) - a[0] * (1 + mu))


def hurwitz_identity() -> bool:
    """a1 a2 a3 − a0 a3² − a4 a1² is (ζ_B − ζ_H) ζ_B a1 a3 (Fr² − flus), and so affine in Fr² beside Fr²."""
    (a0, a1, a2, a3, a4), (Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T) = general()
    square = laws.flus(mu, chi_B, chi_H, zeta_B, zeta_H, Tilt(T))
    return bool(a1 * a2 * a3 - a0 * a3**2 - a4 * a1**2 == (zeta_B - zeta_H) * zeta_B * a1 * a3 * (Fr**2 - square))


def necessary(line: int) -> bool:
    """No stable design of the sample with λ_s > 0 and Fr > 0 breaks a line of the conditions."""
    chosen = (design for design, is_stable in designs() if is_stable and design[0] > 0 and design[6] > 0)
    return all([*first_four(design), fifth(design)][line] for design in chosen)


def symmetric() -> tuple[list[Any], list[Any]]:
    """Four variables and their elementary symmetric polynomials e1 … e4."""
    x = list(polynomials("x1 x2 x3 x4"))
    e = [x[0] * 0 + 1, *[x[0] * 0] * 4]
    for variable in x:
        e = [e[0]] + [e[k] + variable * e[k - 1] for k in range(1, 5)]
    return x, e[1:]


def newton_inequalities() -> bool:
    """For positive x with product 1: 3 e1² − 8 e2 and 3 e3² − 8 e2 e4 are sums of squares, e2 ≥ 6 likewise."""
    x, (e1, e2, e3, e4) = symmetric()
    pairs = [(i, j) for i in range(4) for j in range(i)]
    first = sum(((x[i] - x[j]) ** 2 for i, j in pairs), x[0] * 0)
    others = {(i, j): [k for k in range(4) if k not in (i, j)] for i, j in pairs}
    last = sum((((x[i] - x[j]) * x[k] * x[m]) ** 2 for (i, j), (k, m) in others.items()), x[0] * 0)
    # with x = y²: e2 − 6 √e4 as squares over the three pairings
    squared = sum((x[i] ** 2 * x[j] ** 2 for i, j in pairs), x[0] * 0)
    pairings = (((0, 1), (2, 3)), ((0, 2), (1, 3)), ((0, 3), (1, 2)))
    middle = sum(((x[a] * x[b] - x[c] * x[d]) ** 2 for (a, b), (c, d) in pairings), x[0] * 0)
    return bool(
        3 * e1**2 - 8 * e2 == first
        and 3 * e3**2 - 8 * e2 * e4 == last
        and squared - 6 * x[0] * x[1] * x[2] * x[3] == middle
    )


def tilt_of_roots() -> bool:
    """With e1, e2, e3 of the roots −x over |ω0|: h T (r e1 + e3)² = (r² − 1)(r e2 + r² + 1), for any Fr and χ_B."""
    b, (_, _, T, r, scale) = monic()
    return bool(b[4] == 1 and scale**2 * T * (r * b[1] + b[3]) ** 2 == (r**2 - 1) * (r * b[2] + r**2 + 1))


def tilt_bound() -> bool:
    """No heavily damped bicycle has a steeper tilt than the EP4, and at that tilt only the EP4 is real-rooted.

    With m = e2/6 ≥ 1, (r e1 + e3)² ≥ 16 m (r + 1)², and (r² + 6 r + 1) m − (6 r m + r² + 1) = (r² + 1)(m − 1) ≥ 0.
    """
    r, m, h = ring("r m h")
    bound = (r**2 - 1) * (6 * r * m + r**2 + 1) / (16 * m * (r + 1) ** 2 * h)
    excess = tilt_of_EP4(r, h) - bound
    gap = (r**2 - 1) * (r**2 + 1) * (m - 1) / (16 * m * (r + 1) ** 2 * h)
    return newton_inequalities() and tilt_of_roots() and excess == gap


def triple_roots_are_slow() -> bool:
    """EP3 bicycles, heavily damped, have Fr ≤ Fr_EP4 for r > 1, with equality at the EP4 only.

    With f = q Fr, roots −a, −a, −a, −a⁻³ and r = 1 + ρ, f(EP4) − f(a) is (a − 1)² times a polynomial over positive
    terms; the discriminant of the polynomial has no zero for ρ > 0, and at ρ = 1 it has no real zero a.
    """
    a, rho = polynomials("a rho")
    r = 1 + rho
    speed = 3 * r * (a**5 + a) + (r**2 + 1) * a**3  # (r e2 + r² + 1) a³
    sums = r * (3 * a**4 + 1) + a**6 + 3 * a**2  # (r e1 + e3) a³
    excess = (r**2 + 6 * r + 1) * sums - 4 * (r + 1) * speed
    rest, remainder = divmod(excess, (a - 1) ** 2)
    factors = [factor for factor, _ in rest.discriminant("a").factor()[1]]
    at_1 = substitute(rest, {"rho": q(1)}).to_dict()
    quartic_at_1: Any = flint.fmpq_poly([at_1.get((k, 0), q(0)) for k in range(rest.degrees()[0] + 1)])
    real: Any = quartic_at_1.complex_roots()
    return (
        remainder == 0
        and all(positive(factor) for factor in factors)
        and not any(z.imag == 0 for z, _ in real)
        and at_1[(0, 0)] > 0
    )


def smooth_parts_have_no_maximum() -> bool:
    """On the part of the boundary with one double root −a, tan λ_s at fixed Fr is stationary only at a² = r.

    There the multiplier 1/(1 − f/√r) is negative for f > √r, so it is a minimum; f(EP4) > √r by (√r − 1)⁴.
    """
    root, f = ring("root f")
    r, a = root**2, root
    y = 1 / (1 - f / root)  # d(r e1 + e3) = y (a² de1 − a de2 + de3) + z (r de2 − f d(r e1 + e3))
    z = y * a / r
    stationary = r * (1 + z * f) == y * a**2 and z * r == y * a and 1 + z * f == y
    speed = (r**2 + 6 * r + 1) / (4 * (r + 1))
    return bool(stationary and speed - root == (root - 1) ** 4 / (4 * (r + 1)))


def one_pair_of_double_roots() -> bool:
    """At fixed f the 2EP2 have U = x + 1/x > 2 with r U² − 2 f (r + 1) U + (r + 1)² = 0: one for f > f(EP4)."""
    f, r, U = ring("f r U")
    e1, e2 = 2 * U, U**2 + 2
    relation = r * e2 + r**2 + 1 - f * (r * e1 + e1)
    at_2 = r * 4 - 4 * f * (r + 1) + (r + 1) ** 2
    speed = (r**2 + 6 * r + 1) / (4 * (r + 1))
    return bool(relation == r * U**2 - 2 * f * (r + 1) * U + (r + 1) ** 2 and at_2 == 4 * (r + 1) * (speed - f))
