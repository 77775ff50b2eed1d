"""Verdicts of `tmsopt verify`, each against a computation of its own.

The coefficients are those of det(M s² + V s + P) of two point masses on skates, written here once more from the masses'
equations as the paper prints them; roots are eigenvalues by NumPy, counts of real roots Sturm's chain in fractions.
"""

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise

import numpy as np

from benchmarks.suites.statements.case import Answer, Case

_CONDITION, _FAILS, _EXACT = "holds only under a stated condition", "does not hold", "exact"


def coefficients(
    Fr: str | float,
    mu: str | float,
    chi_B: str | float,
    chi_H: str | float,
    zeta_B: str | float,
    zeta_H: str | float,
    T: str | float,
) -> list[Fraction]:
    """Of the paper's characteristic polynomial, descending, with T = tan λ_s."""
    f, m, b, h, zb, zh, t = map(Fraction, (Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T))
    nu = h - 1 - zh * t  # of the front mass from the steer axis, over cos λ_s
    mass = [[zb**2 + m * zh**2, -m * nu * zh], [-m * nu * zh, m * nu**2]]
    speed = [[Fraction(0), -(f * b * zb) - f * m * h * zh], [Fraction(0), f * m * h * nu]]
    still = [[zb + m * zh, -(f**2) * (zb + m * zh) - m * nu], [-m * nu, m * nu * (f**2 - t)]]
    first = [[[mass[i][j], speed[i][j], still[i][j]] for j in (0, 1)] for i in (0, 1)]
    found = [Fraction(0)] * 5
    for sign, one, two in ((1, first[0][0], first[1][1]), (-1, first[0][1], first[1][0])):
        for i, x in enumerate(one):
            for k, y in enumerate(two):
                found[i + k] += sign * x * y
    return found


def _remainder(a: list[Fraction], b: list[Fraction]) -> list[Fraction]:
    a = list(a)
    while len(a) >= len(b):
        share = a[0] / b[0]
        a = [x - share * y for x, y in zip(a, [*b, *[Fraction(0)] * (len(a) - len(b))], strict=True)][1:]
    while a and a[0] == 0:
        a.pop(0)
    return a


def real_roots(a: Sequence[Fraction]) -> int:
    """Number of different real roots, by Sturm's chain in fractions."""
    chain = [list(a), [c * (len(a) - 1 - k) for k, c in enumerate(a[:-1])]]
    while chain[-1]:
        chain.append([-c for c in _remainder(chain[-2], chain[-1])])
    chain.pop()
    signs = [[c[0] * (end if (len(c) - 1) % 2 else 1) > 0 for c in chain] for end in (-1, 1)]
    low, high = (sum(x != y for x, y in pairwise(s)) for s in signs)
    return low - high


def _judge(key: str, verdict: str, truth: bool, words: tuple[str, ...] = ()):  # type: ignore[no-untyped-def]
    def judge(answer: Answer) -> str:
        if not truth:
            return "the computation does not support this case"
        entry = next(e for e in answer.data["entries"] if e["key"] == key)
        if entry["verdict"] != verdict:
            return f"{key} is said to be '{entry['verdict']}'"
        missing = [w for w in words if w not in entry["statement"] + entry["remark"]]
        return f"{key} does not say {missing}" if missing else ""

    return judge


def _case(name: str, key: str, verdict: str, truth: bool, source: str, words: tuple[str, ...] = ()) -> Case:
    return Case(name, {}, ("verify", "--only", key, "--json"), _judge(key, verdict, truth, words), source)


def _meets(tilt: str, chi_B: str, speeds: tuple[str, ...]) -> bool:
    """Whether the number of real roots changes with the speed, so that curves of eigenvalues meet."""
    counts = {real_roots(coefficients(Fr, "1", chi_B, "1", "-0.4", "-0.2", tilt)) for Fr in speeds}
    return len(counts) > 1


def _spectrum(*design: str) -> np.ndarray:
    return np.roots([float(c) for c in coefficients(*design)])


def _stable(*design: str) -> bool:
    return bool(_spectrum(*design).real.max() < 0)


def _printed(Fr: str, mu: str, chi_B: str, chi_H: str, zeta_B: str, zeta_H: str, T: str) -> bool:
    """Whether the printed conditions hold, the critical speed found as that of an imaginary pair by bisection."""
    m, b, h, zb, zh, t = map(float, (mu, chi_B, chi_H, zeta_B, zeta_H, T))
    if not (h > 1 + zh * t and h < 1 - zb / m * t and h < b and zh > zb):
        return False

    def hurwitz(f: float) -> float:
        a = [float(c) for c in coefficients(str(f), mu, chi_B, chi_H, zeta_B, zeta_H, T)]
        return (a[1] * a[2] * a[3] - a[0] * a[3] ** 2 - a[4] * a[1] ** 2) / (a[1] * a[3])

    lead = hurwitz(2.0) - hurwitz(1.0)  # the quotient is affine in Fr²
    square = 1 - 3 * hurwitz(1.0) / lead
    return 0 < square < float(Fr) ** 2


_UPPER, _MIDDLE = "0.435437", "0.377177"
_MEETINGS = [
    (f"{row} row, χ_B = {chi_B}", tilt, chi_B, speeds)
    for row, tilt, chi_B, speeds in (
        ("upper", _UPPER, "1.404214", ("2.2", "2.3")),
        ("upper", _UPPER, "1.424214", ("2.2", "2.3")),
        ("upper", _UPPER, "1.4", ("2.1", "2.4")),
        ("upper", _UPPER, "1.43", ("2.1", "2.4")),
        ("middle", _MIDDLE, "1.404214", ("2.2", "2.221")),
        ("middle", _MIDDLE, "1.404214", ("2.221", "2.4")),
        ("middle", _MIDDLE, "1.424214", ("2.2", "2.239")),
        ("middle", _MIDDLE, "1.424214", ("2.239", "2.4")),
    )
]
"""Curves that meet near the EP4 and the 2EP2, off χ_B = √2."""

_FASTER = [
    ("2.2361", "1.9795", "1.4407", "0.98", "-0.4", "-0.2", "0.4468"),
    ("2.2362", "1.9673", "1.4754", "0.95", "-0.4", "-0.2", "0.4903"),
    ("2.2413", "1.9969", "1.5118", "0.90", "-0.4", "-0.2", "0.6248"),
]
_BY_MASS = [
    ("2.24", mu, "1.35", "1.02", "-0.4", "-0.2", "0.5") for mu in ("1", "5.8")
]  # whose spectra differ, and would not at χ_H = 1
_ADMITTED = [
    ("2", "5", "1.2", "0.9", "-0.5", "-0.4", "0.5"),
    ("10", "5", "1.2", "0.9", "-0.5", "-0.4", "0.5"),
    ("3", "5", "1.2", "0.9", "-0.5", "-0.4", "0.5"),
]
"""Unstable bicycles that meet all five printed conditions."""


def _capsize(k: tuple[float, float, float], c: tuple[float, float], g: float) -> float:
    """Speed at which det(g K0 + v² K2) = 0, by bisection between 5 and 7 m/s."""
    low, high = 5.0, 7.0
    for _ in range(80):
        v = (low + high) / 2
        value = g * k[0] * (g * k[2] + v**2 * c[1]) - g * k[1] * (g * k[1] + v**2 * c[0])
        low, high = (v, high) if value > 0 else (low, v)
    return low


_SPEED = _capsize((-80.95, -2.59951685249872, -0.80329488458618), (76.59734589573222, 2.65431523794604), 9.81)
_REPELS = "two real roots meet where the number of real ones changes: Sturm's chain, in fractions"
_AT_1 = [_spectrum("2.24", mu, "1.35", "1", "-0.4", "-0.2", "0.5") for mu in ("1", "5.8")]

CASES: tuple[Case, ...] = (
    *(
        _case(f"repelling: {name}", "fig3-repelling", _CONDITION, _meets(tilt, chi_B, speeds), _REPELS)
        for name, tilt, chi_B, speeds in _MEETINGS
    ),
    _case(
        "repelling: said of EPs",
        "fig3-repelling",
        _CONDITION,
        not _meets("1.7405", "1.5142", ("3.5", "3.9", "4.1", "4.3")),
        "the caption; near the CEP2 no real root comes",
        ("near EPs", "CEP2"),
    ),
    *(
        _case(
            f"generality: faster with χ_H = {d[3]}",
            "chi_H-generality",
            _CONDITION,
            bool(_spectrum(*d).real.max() < -((0.4 * 0.2) ** -0.25)),
            "eigenvalues, and |a4/a0|^(1/4) at χ_H = 1",
        )
        for d in _FASTER
    ),
    _case(
        "generality: μ",
        "chi_H-generality",
        _CONDITION,
        bool(abs(np.sort_complex(_spectrum(*_BY_MASS[0])) - np.sort_complex(_spectrum(*_BY_MASS[1]))).max() > 0.1)
        and bool(abs(np.sort_complex(_AT_1[0]) - np.sort_complex(_AT_1[1])).max() < 1e-9),
        "two spectra that differ in μ alone, at χ_H = 1.02 and at 1",
        ("μ",),
    ),
    *(
        _case(
            f"generality: unstable at Fr = {d[0]}",
            "chi_H-generality",
            _CONDITION,
            _printed(*d) and not _stable(*d),
            "eigenvalues of a bicycle that the printed conditions admit",
            ("lscf",),
        )
        for d in _ADMITTED
    ),
    _case(
        "numerical: capsize in closed form",
        "conclusion-numerical",
        _FAILS,
        abs(_SPEED - 6.02426201538837) < 1e-9,
        "Meijaard et al. (2007), Table 2, and a bisection",
        ("Whipple",),
    ),
    _case(
        "numerical: GAS2018",
        "conclusion-numerical",
        _FAILS,
        True,
        "what the paper itself reports in Section 2.2",
        ("GAS2018",),
    ),
    Case(
        "counts: nothing lost",
        {},
        ("verify", "--only", "*-1", "--only", "fig3-*", "--json"),
        lambda a: "" if sum(a.data["counts"].values()) == len(a.data["entries"]) > 2 else "counts differ from entries",
        "a sum",
    ),
    _case(
        "three designs: still exact",
        "fig3-EPs",
        _EXACT,
        real_roots(coefficients("2.24", "1", "1.4142136", "1", "-0.4", "-0.2", _MIDDLE)) == 4,
        "Sturm's chain",
    ),
)
