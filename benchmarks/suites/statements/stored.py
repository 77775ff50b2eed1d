"""The design that is handed over keeps its limits on the roots: judged at 60 digits on the doubles of the answer.

The equations of each system are written here again, from the characteristic polynomial, the matrices, or for bicycles
from Kirillov (2018) and from appendix A of Meijaard, Papadopoulos, Ruina and Schwab (2007).
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mpmath import mp

from benchmarks.suites.statements.case import Answer, Case

Given = Mapping[str, Any]
Polynomial = Callable[[Given], Sequence[Any]]

_DIGITS = 60
_KEPT = 1e-9  # relative to the greater of 1 and the limit
_TOLD = 0.01  # relative: what an amount that is told may be off
_TRUTH = "roots at 60 digits of the parameters exactly as they stand in the answer"


@dataclass(frozen=True)
class Limit:
    """A constraint on the roots: its name, what it says of which quantity, sign and number."""

    quantity: str
    sign: str
    number: float
    name: str = "limit"

    @property
    def line(self) -> str:
        """As in a problem file."""
        return f'{self.name} = "{self.quantity} {self.sign} {self.number!r}"'

    def miss(self, roots: Sequence[Any]) -> Any:
        """By how much roots in 1/s, or in the unit of the limit, miss it."""
        abscissa = max(z.real for z in roots)
        value = {
            "abscissa": lambda: abscissa,
            "decay_rate": lambda: -abscissa,
            "decay_time": lambda: -1 / abscissa,
            "damping_ratio": lambda: min(-z.real / abs(z) for z in roots),
            "angular_frequency": lambda: max(abs(z.imag) for z in roots),
        }[self.quantity]()
        excess = value - mp.mpf(self.number)
        return abs(excess) if self.sign == "==" else excess if self.sign == "<=" else -excess


@dataclass(frozen=True)
class System:
    """A file without its objective and limits, and the characteristic polynomial of it, descending."""

    text: str
    polynomial: Polynomial
    rate: Callable[[Given], Any] = lambda given: mp.mpf(1)  # 1/s, or the unit of the limit, per unit of a root


def _roots(polynomial: Sequence[Any]) -> list[Any]:
    return list(mp.polyroots(list(polynomial), maxsteps=2000, extraprec=600))


def false_of(system: System, limits: Sequence[Limit], found: Mapping[str, Any], cases: Sequence[Given] = ({},)) -> str:
    """What a design of JSON misses without a word, or says wrongly that it misses."""
    with mp.workdps(_DIGITS):
        parameters = {name: mp.mpf(value) for name, value in found["parameters"].items()}
        each = [{**parameters, **{n: mp.mpf(x) for n, x in case.items()}} for case in cases]
        roots = [[z * system.rate(given) for z in _roots(system.polynomial(given))] for given in each]
        for limit in limits:
            miss = max(limit.miss(z) for z in roots)
            told = found.get("missed_as_stored", {}).get(limit.name)
            if miss > _KEPT * max(1.0, abs(limit.number)):
                if told is None or not abs(told - miss) <= _TOLD * miss:
                    return f"{limit.name} is missed by {float(miss):.2g}; told: {told}"
            elif told is not None:
                return f"{limit.name} is said to be missed by {told:.2g}, and is kept"
    return ""


def _case(
    name: str,
    system: System,
    objective: str,
    limits: Sequence[Limit],
    more: Sequence[str] = (),
    scenarios: str = "",
    cases: Sequence[Given] = ({},),
) -> Case:
    lines = [system.text, "[objective]", objective, "[constraints]", *(limit.line for limit in limits), *more]

    def judge(answer: Answer) -> str:
        found = answer.data
        return false_of(system, limits, found, cases) if found["status"] == "optimal" else f"status {found['status']}"

    text = "\n".join([f'title = "{name}"', *lines, scenarios, ""])
    return Case(f"stored: {name}", {"p.toml": text}, ("solve", "p.toml", "--json"), judge, _TRUTH)


# Systems by coefficients: names of the free parameters, and each coefficient as text and as a number.


def _stated(coefficients: Sequence[str], free: Mapping[str, tuple[float, float]], fixed: Given | None = None) -> System:
    listed = ", ".join(f'"{c}"' for c in coefficients)
    boxes = [f"{n} = {{ min = {lo}, max = {hi} }}" for n, (lo, hi) in free.items()]
    text = "\n".join(["[model]", f"coefficients = [{listed}]", "[parameters]", *boxes, *_fixed(fixed)])
    return System(text, lambda given: [_number(c, given) for c in coefficients])


def _number(text: str, given: Given) -> Any:
    """A sum of products of names and numbers."""
    products = ([x.strip() for x in term.split("*")] for term in text.split("+"))
    return mp.fsum(mp.fprod(given[x] if x in given else mp.mpf(float(x)) for x in each) for each in products)


def _fixed(fixed: Given | None) -> list[str]:
    return [f"{n} = {x!r}" for n, x in (fixed or {}).items()]


def _box(names: str, low: float = 0.0, high: float = 20.0) -> dict[str, tuple[float, float]]:
    return dict.fromkeys(names, (low, high))


# Systems by matrices, M s² + D s + K.


def _product(p: Sequence[Any], q: Sequence[Any]) -> list[Any]:
    found = [mp.mpf(0)] * (len(p) + len(q) - 1)
    for i, a in enumerate(p):
        for j, b in enumerate(q):
            found[i + j] += a * b
    return found


def _determinant(rows: Sequence[Sequence[Sequence[Any]]]) -> list[Any]:
    """Of a matrix of polynomials of degree 2, along the first row."""
    if len(rows) == 1:
        return list(rows[0][0])
    total = [mp.mpf(0)] * (2 * len(rows) + 1)
    for k, entry in enumerate(rows[0]):
        minor = _determinant([[*row[:k], *row[k + 1 :]] for row in rows[1:]])
        for i, c in enumerate(_product(entry, minor)):
            total[i] += (-1) ** k * c
    return total


def _matrices(
    M: Sequence[Sequence[str]],
    D: Sequence[Sequence[str]],
    K: Sequence[Sequence[str]],
    free: Mapping[str, tuple[float, float]],
    fixed: Given | None = None,
) -> System:
    def written(name: str, rows: Sequence[Sequence[str]]) -> str:
        return f"{name} = {[list(row) for row in rows]}"

    boxes = [f"{n} = {{ min = {lo}, max = {hi} }}" for n, (lo, hi) in free.items()]
    text = "\n".join(
        ["[model]", written("M", M), written("D", D), written("K", K), "[parameters]", *boxes, *_fixed(fixed)]
    )

    def polynomial(given: Given) -> list[Any]:
        n = range(len(M))
        return _determinant([[[_number(A[i][j], given) for A in (M, D, K)] for j in n] for i in n])

    return System(text, polynomial)


# Bicycles.


def _skates(given: Given) -> list[Any]:
    """The polynomial copo of Kirillov (2018), in dimensionless parameters."""
    Fr, mu, cB, cH, zB, zH = (given[n] for n in ("Fr", "mu", "chi_B", "chi_H", "zeta_B", "zeta_H"))
    T = mp.tan(given["lambda_s"])
    return [
        zB**2 * (cH - 1 - zH * T),
        Fr * zB * (zB * cH - zH * cB),
        Fr**2 * zB * (zB - zH) - zB * (zB + zH) * T - (cH - 1) * (mu * zH - zB),
        Fr * zB * (cH - cB),
        -zB * T - mu * (cH - 1),
    ]


def _si_skates(given: Given) -> list[Any]:
    w = given["w"]
    native = {f"chi_{k}": given[f"x_{k}"] / w for k in "BH"} | {f"zeta_{k}": given[f"z_{k}"] / w for k in "BH"}
    native |= {"Fr": given["v"] / mp.sqrt(given["g"] * w), "mu": given["m_H"] / given["m_B"]}
    return _skates(native | {"lambda_s": given["lambda_s"]})


def _wheels(given: Given) -> list[Any]:
    """Meijaard et al. (2007), appendix A, with steer torque −(k_phi φ + k_phidot φ̇ + k_delta δ + k_deltadot δ̇)."""
    p = {n: given.get(n, mp.mpf(0)) for n in (*given, "k_phi", "k_phidot", "k_delta", "k_deltadot", "I_Rxx", "I_Fxx")}
    w, c, v, g, lam = p["w"], p["c"], p["v"], p["g"], p["lambda_s"]
    mR, mB, mH, mF, rR, rF = (p[n] for n in ("m_R", "m_B", "m_H", "m_F", "r_R", "r_F"))
    xB, zB, xH, zH = (p[n] for n in ("x_B", "z_B", "x_H", "z_H"))
    mT = mR + mB + mH + mF
    xT = (xB * mB + xH * mH + w * mF) / mT
    zT = (-rR * mR + zB * mB + zH * mH - rF * mF) / mT
    Txx = p["I_Rxx"] + p["I_Bxx"] + p["I_Hxx"] + p["I_Fxx"] + mR * rR**2 + mB * zB**2 + mH * zH**2 + mF * rF**2
    Txz = p["I_Bxz"] + p["I_Hxz"] - mB * xB * zB - mH * xH * zH + mF * w * rF
    Tzz = p["I_Rxx"] + p["I_Bzz"] + p["I_Hzz"] + p["I_Fxx"] + mB * xB**2 + mH * xH**2 + mF * w**2
    mA = mH + mF
    xA, zA = (xH * mH + w * mF) / mA, (zH * mH - rF * mF) / mA
    Axx = p["I_Hxx"] + p["I_Fxx"] + mH * (zH - zA) ** 2 + mF * (rF + zA) ** 2
    Axz = p["I_Hxz"] - mH * (xH - xA) * (zH - zA) + mF * (w - xA) * (rF + zA)
    Azz = p["I_Hzz"] + p["I_Fxx"] + mH * (xH - xA) ** 2 + mF * (w - xA) ** 2
    sin, cos = mp.sin(lam), mp.cos(lam)
    uA = (xA - w - c) * cos - zA * sin
    All = mA * uA**2 + Axx * sin**2 + 2 * Axz * sin * cos + Azz * cos**2
    Alx = -mA * uA * zA + Axx * sin + Axz * cos
    Alz = mA * uA * xA + Axz * sin + Azz * cos
    mu = c / w * cos
    SR, SF = p["I_Ryy"] / rR, p["I_Fyy"] / rF
    ST, SA = SR + SF, mA * uA + mu * mT * xT
    M = [[Txx, Alx + mu * Txz], [Alx + mu * Txz, All + 2 * mu * Alz + mu**2 * Tzz]]
    K0 = [[mT * zT, -SA], [-SA, -SA * sin]]
    K2 = [[mp.mpf(0), (ST - mT * zT) / w * cos], [mp.mpf(0), (SA + SF * sin) / w * cos]]
    C1 = [
        [mp.mpf(0), mu * ST + SF * cos + Txz / w * cos - mu * mT * zT],
        [-(mu * ST + SF * cos), Alz / w * cos + mu * (SA + Tzz / w * cos)],
    ]
    D = [[v * x for x in row] for row in C1]
    K = [[g * a + v**2 * b for a, b in zip(*rows, strict=True)] for rows in zip(K0, K2, strict=True)]
    D[1] = [D[1][0] + p["k_phidot"], D[1][1] + p["k_deltadot"]]
    K[1] = [K[1][0] + p["k_phi"], K[1][1] + p["k_delta"]]
    return _determinant([[[M[i][j], D[i][j], K[i][j]] for j in range(2)] for i in range(2)])


_BENCHMARK = """model = "whipple"
[parameters]
w = 1.02
c = 0.08
r_R = 0.3
m_R = 2
I_Rxx = 0.0603
I_Ryy = 0.12
x_B = 0.3
z_B = -0.9
m_B = 85
I_Bxx = 9.2
I_Bzz = 2.8
I_Bxz = 2.4
x_H = 0.9
z_H = -0.7
m_H = 4
I_Hxx = 0.05892
I_Hzz = 0.00708
I_Hxz = -0.00756
r_F = 0.35
m_F = 3
I_Fxx = 0.1405
I_Fyy = 0.28
lambda_s = 0.3125
"""


def _driven(speed: str, gains: str, reach: float = 100) -> System:
    boxes = "\n".join(f"{n} = {{ min = {-reach}, max = {reach} }}" for n in gains.split())
    return System(f"{_BENCHMARK}v = {speed}\n[feedback]\n{boxes}", _wheels)


def _dimensionless(lines: str) -> System:
    return System('model = "tms"\n[parameters]\n' + "\n".join(lines.split("; ")), _skates)


def _si(lines: str) -> System:
    text = 'model = "tms"\n[parameters]\n' + "\n".join(lines.split("; "))
    return System(text, _si_skates, lambda given: mp.sqrt(given["g"] / given["w"]))


def _fast(number: float, quantity: str = "abscissa") -> list[Limit]:
    return [Limit(quantity, "<=", -number if quantity == "abscissa" else number)]


def _polynomials() -> Iterator[Case]:
    """Least sums of coefficients with every root left of a line: the n-fold root on it."""
    for n, numbers in ((2, (1.1, 0.3)), (3, (1.1, 0.7, 2.3)), (4, (1.1, 0.7, 0.3, 2.3)), (5, (1.1, 0.6))):
        names = "abcde"[:n]
        for number in numbers:
            box = _box(names, 0, 400)
            goal = f'minimize = "{" + ".join(names)}"'
            yield _case(f"{n}-fold root at -{number}", _stated(["1", *names], box), goal, _fast(number))
    mixed = _stated(["1", "a + b", "a*b + c", "b*c + 0.5*d", "d"], _box("abcd"))
    for number in (0.9, 0.35, 0.6):
        yield _case(f"products of four, {number}", mixed, 'minimize = "a + 2*b + c + d"', _fast(number))
    for ratio, top in ((0.6, 30.0), (0.35, 30.0), (0.9, 30.0)):
        damped = _stated(["1", "a", "b", "c", "1"], _box("abc", 0, top))
        limits = [Limit("damping_ratio", ">=", ratio)]
        yield _case(f"quartic of damping ratio {ratio}", damped, 'minimize = "a + c"', limits)
    for names in ("ab", "abc"):
        real = _stated(["1", *names, "1.75"], _box(names, 0, 30))
        goal = f'minimize = "{" + ".join(names)}"'
        yield _case(f"all {len(names) + 1} roots real", real, goal, [Limit("damping_ratio", ">=", 1.0)])
    for number in (0.7, 0.45):
        band = _stated(["1", "a", "b", "c + m"], _box("abc"), {"m": 0.5})
        cases = [{"m": x} for x in (0.25, 0.75)]
        scenarios = "[scenarios]\nm = [0.25, 0.75]"
        band = System(band.text.replace("\nm = 0.5", ""), band.polynomial)
        yield _case(f"two masses, {number}", band, 'minimize = "a + b + c"', _fast(number), (), scenarios, cases)
    for number in (1.1, 0.7, 1.9):
        limits = [Limit("abscissa", "==", -number)]
        yield _case(f"EP3 at -{number}", _stated(["1", *"abc"], _box("abc")), 'locate = "EP3"', limits)
        yield _case(f"EP4 at -{number}", _stated(["1", *"abcd"], _box("abcd", 0, 40)), 'locate = "EP4"', limits)
    kept = _stated(["1", *"abc"], _box("abc"))
    yield _case("EP3 left of -0.7", kept, 'locate = "EP3"\nminimize = "a"', _fast(0.7))
    for n, x in ((3, 1.1), (4, 0.7), (2, 0.3)):
        fixed = {name: math.comb(n, k + 1) * x ** (k + 1) for k, name in enumerate("abcd"[:n])}
        yield _case(f"given, {n}-fold at -{x}", _stated(["1", *"abcd"[:n]], {}, fixed), "", _fast(x))


def _oscillators() -> Iterator[Case]:
    """Masses, dashpots and springs."""
    one = [["1"]]
    for number in (1.3, 0.45):
        box = {"c": (0, 20), "k": (0, 20)}
        yield _case(f"one mass, {number}", _matrices(one, [["c"]], [["k"]], box), 'minimize = "c + k"', _fast(number))
    chain = [["k + q", "-1*q"], ["-1*q", "q"]]
    dashpots = [["c + d", "-1*d"], ["-1*d", "d"]]
    box = {"c": (0, 20), "d": (0, 20), "k": (0, 20), "q": (0, 20)}
    for number in (0.4, 1.1):
        system = _matrices([["1", "0"], ["0", "1"]], dashpots, chain, box)
        yield _case(f"two masses, {number}", system, 'minimize = "c + d + k + q"', _fast(number))
    tuned = {"m": (0.05, 2), "d": (0, 5), "q": (0, 5)}
    for number in (0.12, 0.15, 0.18):
        system = _matrices(
            [["1", "0"], ["0", "m"]], [["d", "-1*d"], ["-1*d", "d"]], [["1 + q", "-1*q"], ["-1*q", "q"]], tuned
        )
        yield _case(f"tuned mass, {number}", system, 'minimize = "m"', _fast(number))
    system = _matrices(
        [["1", "0"], ["0", "m"]], [["d", "-1*d"], ["-1*d", "d"]], [["1 + q", "-1*q"], ["-1*q", "q"]], tuned
    )
    for ratio in (0.15, 0.2, 0.25):
        yield _case(f"tuned mass of ratio {ratio}", system, 'minimize = "m"', [Limit("damping_ratio", ">=", ratio)])
    gains = {"p": (-20, 20), "r": (-20, 20), "d": (-20, 20), "e": (-20, 20)}
    driven = _matrices([["1", "0"], ["0", "0.5"]], [["0.25", "0"], ["r", "d"]], [["-2", "1"], ["p", "e"]], gains)
    for number in (0.9, 0.65):
        yield _case(f"a driven pair, {number}", driven, 'minimize = "p**2 + r**2 + d**2 + e**2"', _fast(number))


def _bicycles() -> Iterator[Case]:
    heights = "chi_H = 1.0; zeta_H = -0.2; zeta_B = { min = -2, max = -0.05 }; mu = 0.1"
    rest = "chi_B = { min = 1.01, max = 5 }; Fr = { min = 0.01, max = 10 }; lambda_s = { min = 0.02, max = 1.4 }"
    skates = _dimensionless(f"{heights}; {rest}")
    for number in (1.4, 1.55, 1.7, 1.9, 2.1):
        yield _case(f"the tallest of {number}", skates, 'minimize = "zeta_B"', _fast(number))
    fixed = _dimensionless(f"chi_H = 1.0; zeta_H = -0.2; zeta_B = -0.4; mu = 0.1; {rest}")
    for number in (1.8, 1.83, 1.86):
        yield _case(f"the slowest of {number}", fixed, 'minimize = "Fr"', _fast(number))
    for ratio in (1.0,):
        yield _case(f"the slowest of ratio {ratio}", fixed, 'minimize = "Fr"', [Limit("damping_ratio", ">=", ratio)])
    si = _si(
        "w = 1.25; v = { min = 0.5, max = 9 }; g = 9.8125; lambda_s = { min = 0.02, max = 1.4 }; m_B = 40; "
        "x_B = { min = 0.3, max = 6 }; z_B = { min = -2, max = -0.05 }; m_H = 4; x_H = 1.25; z_H = -0.25"
    )
    for limit in (Limit("decay_time", "<=", 0.25), Limit("decay_rate", ">=", 4.2), Limit("decay_time", "<=", 0.22)):
        yield _case(f"{limit.quantity} {limit.number}", si, 'minimize = "z_B"', [limit])
    for speed, gains, number in (
        ("1.75", "k_phi k_phidot k_delta k_deltadot", 3.0),
        ("1.75", "k_phi k_phidot k_delta k_deltadot", 4.0),
        ("2.25", "k_phi k_phidot k_delta k_deltadot", 3.4),
        ("5.0", "k_phi k_phidot k_delta k_deltadot", 2.9),
        ("3.5", "k_phi k_phidot k_delta k_deltadot", 2.3),
        ("2.5", "k_phidot k_delta k_deltadot", 0.55),
        ("4.0", "k_phi k_phidot k_deltadot", 1.15),
    ):
        goal = f'minimize = "{" + ".join(f"abs({n})" for n in gains.split())}"'
        yield _case(f"gains at {speed} m/s, {number}", _driven(speed, gains), goal, _fast(number))
        goal = f'minimize = "{" + ".join(f"{n}**2" for n in gains.split())}"'
        yield _case(f"squares at {speed} m/s, {number}", _driven(speed, gains), goal, _fast(number))


CASES: tuple[Case, ...] = (*_polynomials(), *_oscillators(), *_bicycles())
