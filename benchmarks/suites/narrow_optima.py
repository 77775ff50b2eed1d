"""Problems whose best basin is narrow or hidden: gains beside zero in wide boxes, plateaus, wells of exponentials.

Each is a problem file and the same question as formulas of NumPy. Nothing here comes from the package, and the
reference values come from samples, differential evolution and Nelder-Mead on eigenvalues.
"""

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import differential_evolution, minimize

from benchmarks.judges.eigenvalues import companion

Array = NDArray[np.float64]
Ends = tuple[float, float]

FAMILIES = ("gains", "plateaus", "wells")
EACH = 60
DATA = Path(__file__).with_suffix(".json")

_TRIED = 400  # draws of a family until one is as it should be
_SAMPLE = 60_000  # designs of a reference, half of them even in the box
_POLISHED = 24  # of these, apart from each other
_MEET = 0.05  # relative distance of roots of a triple one, by doubles, and of a descent from the best
_DESCENTS, _LED = 6, 2  # from random designs, and how many of them may lead to the best
_CLOSE = 0.3  # gain that counts as beside zero in a box 50 to 80 wide
_FLAT = 0.97  # share of a box with a positive real root, at least
_STEEP = 7.0  # of the scale that sees values beside zero


@dataclass(frozen=True)
class Hidden:
    """A problem.

    Attributes:
        text: its file.
        free: ranges.
        worth: the objective to be minimised, of columns of parameters.
        sign: of the objective in `worth`.
        known: where three roots meet.
    """

    name: str
    text: str
    free: Mapping[str, Ends]
    worth: Callable[[Array], Array]
    sign: float = 1.0
    known: tuple[float, ...] = ()


@cache
def hidden(index: int) -> Hidden:
    """Problem 0 to 179, sixty of each family; the same for ever."""
    return _drawn(index, references()[index].attempt)


@dataclass(frozen=True)
class Reference:
    """The best value known and where it is; and the draw that is the problem."""

    attempt: int
    value: float
    design: list[float]


@cache
def references() -> dict[int, Reference]:
    """By index, as kept."""
    return {int(k): Reference(**row) for k, row in json.loads(DATA.read_text(encoding="utf-8")).items()}


def _drawn(index: int, attempt: int) -> Hidden:
    made = {"gains": _gains, "plateaus": _plateau, "wells": _well}[FAMILIES[index // EACH]]
    return made(np.random.default_rng([37, index, attempt]), index % EACH)


def _is_hidden(problem: Hidden) -> bool:
    """Whether a draw is as its family says, by a small sample and descents from random designs."""
    if problem.name.startswith("wells"):
        return True
    lower, upper = np.array([*problem.free.values()]).T
    rng = np.random.default_rng(0)
    some = rng.uniform(lower[:, None], upper[:, None], (len(lower), 4000))
    if problem.sign < 0:
        if np.mean(problem.worth(some) >= 1) < _FLAT:
            return False
        return -0.99 < _best_of_sample(problem, 0, _SAMPLE // 6, _POLISHED // 4)[0] < 0.99
    x = np.array(problem.known)
    best = float(problem.worth(x[:, None])[0])
    if not (best < 0 and np.all((lower < x) & (x < upper))):
        return False
    drawn = _placed(rng.random((len(lower), 4000)), lower, upper, _STEEP)
    if min(problem.worth(some).min(), problem.worth(drawn).min()) < best * (1 + _MEET):
        return False
    best = _descended(problem, x)
    ends = [_descended(problem, some[:, k]) for k in range(_DESCENTS)]
    return sum(end < best + _MEET * abs(best) for end in ends) <= _LED


def reference(index: int) -> Reference:
    """The same, computed: the best of a sample, of differential evolution and of what they are polished to."""
    attempt = next(k for k in range(_TRIED) if _is_hidden(_drawn(index, k)))
    problem = _drawn(index, attempt)
    lower, upper = np.array([*problem.free.values()]).T
    found = [_best_of_sample(problem, index)]
    for seed, steep in ((1, 0.0), (2, _STEEP), (3, _STEEP)):

        def worth(y: Array, steep: float = steep) -> Any:
            return np.nan_to_num(problem.worth(_placed(y, lower, upper, steep)), nan=1e9)

        unit: Any = [(0.0, 1.0)] * len(lower)
        ended = differential_evolution(
            worth,
            unit,
            seed=seed,
            vectorized=True,
            updating="deferred",
            popsize=30,
            maxiter=400,
            tol=1e-12,
            polish=False,
        )
        found.append(_polished(problem, _placed(ended.x, lower, upper, steep)))
    value, x = min(found, key=lambda pair: pair[0])
    return Reference(attempt, problem.sign * value, [float(v) for v in x])


def _best_of_sample(problem: Hidden, seed: int, size: int = _SAMPLE, polished: int = _POLISHED) -> tuple[float, Array]:
    lower, upper = np.array([*problem.free.values()]).T
    y = np.random.default_rng([seed, 1]).random((len(lower), size))
    x = np.concatenate([_placed(y[:, ::2], lower, upper, 0.0), _placed(y[:, 1::2], lower, upper, _STEEP)], axis=1)
    worth = np.nan_to_num(problem.worth(x), nan=1e9)
    found: list[tuple[float, Array]] = []
    chosen: list[Array] = []
    for k in np.argsort(worth):
        place = _scale(x[:, k], lower, upper)
        if len(chosen) < polished and not any(np.abs(place - other).max() < 0.05 for other in chosen):
            chosen.append(place)
            found.append(_polished(problem, x[:, k]))
    return min(found, key=lambda pair: pair[0])


def _inside(problem: Hidden) -> Callable[[Array], float]:
    lower, upper = np.array([*problem.free.values()]).T

    def worth(z: Array) -> float:
        value = float(problem.worth(np.clip(z, lower, upper)[:, None])[0])
        return value if math.isfinite(value) else 1e9

    return worth


def _descended(problem: Hidden, x: Array) -> float:
    return float(minimize(_inside(problem), x, method="Nelder-Mead", options={"maxfev": 150 * len(x)}).fun)


def _polished(problem: Hidden, x: Array) -> tuple[float, Array]:
    lower, upper = np.array([*problem.free.values()]).T
    worth = _inside(problem)

    for reach in (0.03, 1e-3, 1e-5, 1e-3, 1e-6):
        step = reach * np.maximum(np.abs(x), 0.01 * (upper - lower))
        corners = np.concatenate([x[None], x + np.diag(np.where(x + step > upper, -step, step))])
        ended = minimize(
            worth,
            x,
            method="Nelder-Mead",
            options={"initial_simplex": corners, "xatol": 1e-13, "fatol": 1e-15, "maxfev": 250 * len(x)},
        )
        if ended.fun <= worth(x):
            x = np.clip(ended.x, lower, upper)
    return worth(x), x


def _placed(y: Array, lower: Array, upper: Array, steep: float) -> Array:
    """Points of the unit cube in the box, evenly or on a scale that sees small values."""
    shape = (-1, *[1] * (y.ndim - 1))
    lower, upper = lower.reshape(shape), upper.reshape(shape)
    if not steep:
        return np.asarray(lower + (upper - lower) * y)
    size = np.maximum(np.abs(lower), np.abs(upper)) / math.sinh(steep)
    ends = np.arcsinh(lower / size), np.arcsinh(upper / size)
    return np.asarray(np.clip(size * np.sinh(ends[0] + (ends[1] - ends[0]) * y), lower, upper))


def _scale(x: Array, lower: Array, upper: Array) -> Array:
    size = np.maximum(np.abs(lower), np.abs(upper)) / math.sinh(_STEEP)
    low, high = np.arcsinh(lower / size), np.arcsinh(upper / size)
    return np.asarray((np.arcsinh(x / size) - low) / (high - low))


# Gains beside zero


BENCHMARK: Mapping[str, float] = {
    "w": 1.02,
    "c": 0.08,
    "lambda_s": math.radians(18),
    "g": 9.81,
    "r_R": 0.3,
    "m_R": 2.0,
    "I_Rxx": 0.0603,
    "I_Ryy": 0.12,
    "x_B": 0.3,
    "z_B": -0.9,
    "m_B": 85.0,
    "I_Bxx": 9.2,
    "I_Bzz": 11.0,
    "I_Bxz": 2.4,
    "x_H": 0.9,
    "z_H": -0.7,
    "m_H": 4.0,
    "I_Hxx": 0.05892,
    "I_Hzz": 0.00708,
    "I_Hxz": -0.00756,
    "r_F": 0.35,
    "m_F": 3.0,
    "I_Fxx": 0.1405,
    "I_Fyy": 0.28,
}
"""Meijaard, Papadopoulos, Ruina and Schwab (2007), table 1; I_Bzz 2.8 there."""

_STATES = ("k_phi", "k_phidot", "k_delta", "k_deltadot")


def whipple(p: Mapping[str, float]) -> tuple[Array, Array, Array, Array]:
    """M, C1, K0, K2 of appendix A of the same."""
    s, k = math.sin(p["lambda_s"]), math.cos(p["lambda_s"])
    w, c = p["w"], p["c"]
    m_T = p["m_R"] + p["m_B"] + p["m_H"] + p["m_F"]
    x_T = (p["x_B"] * p["m_B"] + p["x_H"] * p["m_H"] + w * p["m_F"]) / m_T
    z_T = (-p["r_R"] * p["m_R"] + p["z_B"] * p["m_B"] + p["z_H"] * p["m_H"] - p["r_F"] * p["m_F"]) / m_T
    Txx = (
        p["I_Rxx"]
        + p["I_Bxx"]
        + p["I_Hxx"]
        + p["I_Fxx"]
        + p["m_R"] * p["r_R"] ** 2
        + p["m_B"] * p["z_B"] ** 2
        + p["m_H"] * p["z_H"] ** 2
        + p["m_F"] * p["r_F"] ** 2
    )
    Txz = p["I_Bxz"] + p["I_Hxz"] - p["m_B"] * p["x_B"] * p["z_B"] - p["m_H"] * p["x_H"] * p["z_H"]
    Txz += p["m_F"] * w * p["r_F"]
    Tzz = (
        p["I_Rxx"]
        + p["I_Bzz"]
        + p["I_Hzz"]
        + p["I_Fxx"]
        + p["m_B"] * p["x_B"] ** 2
        + p["m_H"] * p["x_H"] ** 2
        + p["m_F"] * w * w
    )
    m_A = p["m_H"] + p["m_F"]
    x_A = (p["x_H"] * p["m_H"] + w * p["m_F"]) / m_A
    z_A = (p["z_H"] * p["m_H"] - p["r_F"] * p["m_F"]) / m_A
    Axx = p["I_Hxx"] + p["I_Fxx"] + p["m_H"] * (p["z_H"] - z_A) ** 2 + p["m_F"] * (p["r_F"] + z_A) ** 2
    Axz = p["I_Hxz"] - p["m_H"] * (p["x_H"] - x_A) * (p["z_H"] - z_A) + p["m_F"] * (w - x_A) * (p["r_F"] + z_A)
    Azz = p["I_Hzz"] + p["I_Fxx"] + p["m_H"] * (p["x_H"] - x_A) ** 2 + p["m_F"] * (w - x_A) ** 2
    u_A = (x_A - w - c) * k - z_A * s
    All = m_A * u_A**2 + Axx * s * s + 2 * Axz * s * k + Azz * k * k
    Alx = -m_A * u_A * z_A + Axx * s + Axz * k
    Alz = m_A * u_A * x_A + Axz * s + Azz * k
    mu = c / w * k
    S_R, S_F = p["I_Ryy"] / p["r_R"], p["I_Fyy"] / p["r_F"]
    S_T, S_A = S_R + S_F, m_A * u_A + mu * m_T * x_T
    M = np.array([[Txx, Alx + mu * Txz], [Alx + mu * Txz, All + 2 * mu * Alz + mu * mu * Tzz]])
    C1 = np.array(
        [
            [0.0, mu * S_T + S_F * k + Txz * k / w - mu * m_T * z_T],
            [-(mu * S_T + S_F * k), Alz * k / w + mu * (S_A + Tzz * k / w)],
        ]
    )
    K0 = np.array([[m_T * z_T, -S_A], [-S_A, -S_A * s]])
    K2 = np.array([[0.0, (S_T - m_T * z_T) * k / w], [0.0, (S_A + S_F * s) * k / w]])
    return M, C1, K0, K2


def _gains(rng: np.random.Generator, number: int) -> Hidden:
    """Two of four gains of a bicycle, or of two coupled masses; the others such that three roots meet beside zero."""
    stated, bicycle = number % 3 == 2, dict[str, float]()
    if stated:
        M, D, K = np.eye(2), rng.normal(0, 0.5, (2, 2)).round(3), rng.normal(0, 1.0, (2, 2)).round(3)
    else:
        bicycle = {n: float(f"{x * rng.uniform(0.8, 1.2):.4g}") for n, x in BENCHMARK.items()}
        bicycle |= {"g": 9.81, "v": float(f"{rng.uniform(1.0, 7.0):.3g}")}
        M, C1, K0, K2 = whipple(bicycle)
        D, K = bicycle["v"] * C1, 9.81 * K0 + bicycle["v"] ** 2 * K2
    beside, other = (str(n) for n in rng.choice(_STATES, 2, replace=False))
    known = _triple(M, D, K, rng.uniform(0.3, 3.0), beside, rng.uniform(-_CLOSE, _CLOSE))
    fixed = {n: float(f"{known[n]:.5g}") for n in _STATES if n not in (beside, other)}
    D, K = D.copy(), K.copy()
    for name, x in fixed.items():
        (D if "dot" in name else K)[1, 0 if "phi" in name else 1] += x
    free = {n: _wide(rng) for n in _STATES if n in (beside, other)}
    text = _stated_file(M, D, K, free) if stated else _whipple_file(bicycle, free, fixed)

    def roots(x: Array) -> Any:
        return _eigenvalues(M, D, K, dict(zip(free, x, strict=True)))

    text += '[objective]\nminimize = "abscissa"\n'
    place = tuple(known[n] for n in free)
    return Hidden(f"gains {number}", text, free, lambda x: roots(x).real.max(axis=-1), known=place)


def _triple(M: Array, D: Array, K: Array, root: float, beside: str, value: float) -> dict[str, float]:
    """All four gains for (s + root)^3 (s + b), b such that one of them has a value: the coefficients are linear."""

    def coefficients(gains: Array) -> Array:
        z = _eigenvalues(M, D, K, {n: np.array([x]) for n, x in zip(_STATES, gains, strict=True)})[0]
        return np.asarray(np.poly(z).real[1:])

    still = coefficients(np.zeros(4))
    slopes = np.array([coefficients(unit) - still for unit in np.eye(4)]).T
    ends = [np.linalg.solve(slopes, np.poly([-root] * 3 + [-b])[1:] - still) for b in (0.0, 1.0)]
    k = _STATES.index(beside)
    b = (value - ends[0][k]) / (ends[1][k] - ends[0][k])
    return dict(zip(_STATES, (ends[0] + b * (ends[1] - ends[0])).tolist(), strict=True))


def _wide(rng: np.random.Generator) -> Ends:
    width, share = rng.uniform(50, 80), rng.uniform(0.3, 0.7)
    return round(-width * share, 1), round(width * (1 - share), 1)


def _eigenvalues(M: Array, D: Array, K: Array, gains: Mapping[str, Array]) -> Any:
    """Of M q″ + D q′ + K q with a torque on the second coordinate."""
    count = len(next(iter(gains.values())))
    inverse = np.linalg.inv(M)
    d, k = np.tile(D, (count, 1, 1)), np.tile(K, (count, 1, 1))
    for name, x in gains.items():
        (d if "dot" in name else k)[:, 1, 0 if "phi" in name else 1] += x
    A = np.zeros((count, 4, 4))
    A[:, :2, 2:] = np.eye(2)
    A[:, 2:, :2], A[:, 2:, 2:] = -inverse @ k, -inverse @ d
    return np.linalg.eigvals(A)


def _whipple_file(bicycle: Mapping[str, float], free: Mapping[str, Ends], given: Mapping[str, float]) -> str:
    fixed, held = ("\n".join(f"{n} = {x!r}" for n, x in some.items()) for some in (bicycle, given))
    gains = "\n".join(f"{n} = {{ min = {lo!r}, max = {hi!r} }}" for n, (lo, hi) in free.items())
    return f'model = "whipple"\n[parameters]\n{fixed}\n[feedback]\n{held}\n{gains}\n'


def _stated_file(M: Array, D: Array, K: Array, free: Mapping[str, Ends]) -> str:
    d, k = ([[repr(float(x)) for x in row] for row in matrix] for matrix in (D, K))
    for name in free:
        (d if "dot" in name else k)[1][0 if "phi" in name else 1] += f" + {name}"
    return _file({"M": [[repr(float(x)) for x in row] for row in M], "D": d, "K": k}, free)


def _file(matrices: Mapping[str, Any], free: Mapping[str, Ends], goal: str = "") -> str:
    lines = "\n".join(f"{n} = {json.dumps(rows)}" for n, rows in matrices.items())
    ranges = "\n".join(f"{n} = {{ min = {lo!r}, max = {hi!r} }}" for n, (lo, hi) in free.items())
    return f"[model]\n{lines}\n[parameters]\n{ranges}\n{goal}"


# Plateaus of the damping ratio


def _ratio(z: Any) -> Array:
    size = np.abs(z)
    return np.asarray(np.where(size > 0, -z.real / np.where(size > 0, size, 1.0), 0.0).min(axis=-1))


def _plateau(rng: np.random.Generator, number: int) -> Hidden:
    """Most designs of the box have a positive real root: state feedback on unstable plants, bicycles, polynomials."""
    match number % 3:
        case 0:
            text, free, roots = _plant(rng)
        case 1:
            text, free, roots = _slow_bicycle(rng)
        case _:
            text, free, roots = _unstable_polynomial(rng)

    def worth(x: Array) -> Array:
        return -_ratio(roots(x))

    return Hidden(f"plateaus {number}", text + '[objective]\nmaximize = "damping_ratio"\n', free, worth, -1.0)


def _plant(rng: np.random.Generator) -> tuple[str, dict[str, Ends], Callable[[Array], Any]]:
    """A = A0 + B k with one input: static feedback of two or three of three to five states."""
    size = int(rng.integers(3, 6))
    A0 = rng.normal(0, 1, (size, size)).round(2)
    B = rng.normal(0, 1, size).round(2)
    states = sorted(int(k) for k in rng.choice(size, int(rng.integers(2, 4)), replace=False))
    free = {f"k{s + 1}": _wide(rng) for s in states}
    rows = [
        [repr(float(A0[i, j])) + (f" + {float(B[i])!r}*k{j + 1}" if j in states else "") for j in range(size)]
        for i in range(size)
    ]

    def roots(x: Array) -> Any:
        A = np.tile(A0, (x.shape[1], 1, 1))
        for row, s in zip(x, states, strict=True):
            A[:, :, s] += row[:, None] * B
        return np.linalg.eigvals(A)

    return _file({"A": rows}, free), free, roots


def _slow_bicycle(rng: np.random.Generator) -> tuple[str, dict[str, Ends], Callable[[Array], Any]]:
    bicycle = {n: float(f"{x * rng.uniform(0.8, 1.2):.4g}") for n, x in BENCHMARK.items()}
    bicycle |= {"g": 9.81, "v": float(f"{rng.uniform(1.5, 6.0):.3g}")}
    M, C1, K0, K2 = whipple(bicycle)
    D, K = bicycle["v"] * C1, 9.81 * K0 + bicycle["v"] ** 2 * K2
    names = sorted((str(n) for n in rng.choice(_STATES, int(rng.integers(2, 4)), replace=False)), key=_STATES.index)
    free = {n: (round(2 * lo, 1), round(2 * hi, 1)) for n in names for lo, hi in [_wide(rng)]}
    return _whipple_file(bicycle, free, {}), free, lambda x: _eigenvalues(M, D, K, dict(zip(free, x, strict=True)))


def _unstable_polynomial(rng: np.random.Generator) -> tuple[str, dict[str, Ends], Callable[[Array], Any]]:
    """Degree 3 to 6, the constant positive in a small part of the box only."""
    degree, count = int(rng.integers(3, 7)), int(rng.integers(2, 5))
    free = {f"x{k + 1}": (-1.0, 1.0) for k in range(count)}
    base = np.abs(np.poly(-rng.uniform(0.3, 2.0, degree)).real)
    slopes = (rng.normal(0, 0.5, (degree + 1, count)) * base[:, None]).round(3)
    centre = rng.uniform(-0.8, 0.8, count).round(2)
    radius = round(float(rng.uniform(0.1, 0.35)), 2)
    slopes[0] = 0
    base = base.round(3)
    distance = " + ".join(f"(x{k + 1} - {float(c)!r})**2" for k, c in enumerate(centre))
    rows = [
        repr(float(b)) + "".join(f" + {float(s)!r}*x{k + 1}" for k, s in enumerate(row) if s)
        for b, row in zip(base, slopes, strict=True)
    ]
    rows[-1] = f"{float(base[-1])!r}*({radius!r}**2 - ({distance}))/{radius!r}**2"

    def roots(x: Array) -> Any:
        a = base[:, None] + slopes @ x
        a[-1] = base[-1] * (radius**2 - ((x - centre[:, None]) ** 2).sum(axis=0)) / radius**2
        return np.linalg.eigvals(companion(a.T))

    return _file({"coefficients": rows}, free), free, roots


# Wells of exponentials


def _well(rng: np.random.Generator, number: int) -> Hidden:
    """Two or three parameters; in the damping of one to two oscillators a broad slope and some narrow wells."""
    count = 2 + number % 2
    low, high = (0.0, 1.0) if number % 4 == 0 else (-1.0, 1.0) if number % 4 == 1 else (-2.0, 2.0)
    names = [f"x{k + 1}" for k in range(count)]
    free = dict.fromkeys(names, (low, high))
    broad = rng.uniform(low, high, count).round(2)
    steep = [int(rng.integers(30, 80)) for _ in range(int(rng.integers(5, 13)))]
    centres = rng.uniform(low + 0.1, high - 0.1, (len(steep), count)).round(3)
    depths = np.sort(rng.uniform(0.3, 1.5, len(steep))).round(3)
    layer = number % 3 == 0
    square = "({})**2"
    ridge = " + ".join(square.format(f"{n} - {float(c)!r}") for n, c in zip(names, broad, strict=True))
    text = [f"0.5 + 0.6*exp(-({ridge})/2)"]
    for depth, steepness, centre in zip(depths, steep, centres, strict=True):
        r = " + ".join(square.format(f"{n} - {float(c)!r}") for n, c in zip(names, centre, strict=True))
        text.append(f"{float(depth)!r}*exp(-{steepness}*({r}))")
    if layer:
        text.append(f"0.8*exp(-40*({names[0]} - {low!r})) * exp(-30*({names[1]} - {float(broad[1])!r})**2)")
    damping = " + ".join(text)
    size = int(rng.integers(1, 3))
    other = [round(float(v), 2) for v in rng.uniform(2.0, 5.0, 2)]

    def strength(x: Array) -> Array:
        found = 0.5 + 0.6 * np.exp(-((x - broad[:, None]) ** 2).sum(axis=0) / 2)
        for depth, steepness, centre in zip(depths, steep, centres, strict=True):
            found = found + depth * np.exp(-steepness * ((x - centre[:, None]) ** 2).sum(axis=0))
        if layer:
            found = found + 0.8 * np.exp(-40 * (x[0] - low)) * np.exp(-30 * (x[1] - broad[1]) ** 2)
        return np.asarray(found)

    if size == 1:
        rows = ["1", damping, repr(other[0])]

        def worth(x: Array) -> Array:
            a = np.stack([np.ones(x.shape[1]), strength(x), np.full(x.shape[1], other[0])], axis=-1)
            return np.asarray(np.linalg.eigvals(companion(a)).real.max(axis=-1))

    else:
        rows = ["1", f"1 + ({damping})", repr(other[1] + 4), f"1 + {other[0]!r}*({damping})", repr(other[1])]

        def worth(x: Array) -> Array:
            one, d = np.ones(x.shape[1]), strength(x)
            a = np.stack([one, 1 + d, (other[1] + 4) * one, 1 + other[0] * d, other[1] * one], axis=-1)
            return np.asarray(np.linalg.eigvals(companion(a)).real.max(axis=-1))

    text_of_file = _file({"coefficients": rows}, free, '[objective]\nminimize = "abscissa"\n')
    return Hidden(f"wells {number}", text_of_file, free, worth)
