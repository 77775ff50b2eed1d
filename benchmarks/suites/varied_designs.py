"""Random design problems of every kind: scenarios, tolerances, damping, objectives, both tilts, SI."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.judges import Judge
from benchmarks.suites.random_designs import SEED, Box, drawn_box, drawn_value, rounded
from tmsopt import Problem
from tmsopt.models import tms
from tmsopt.problem import Band

RANGES: Mapping[str, Box] = {
    "Fr": (0.5, 5.0),
    "mu": (0.03, 12.0),
    "chi_B": (0.4, 2.5),
    "chi_H": (0.75, 1.25),
    "zeta_B": (-1.4, -0.15),
    "zeta_H": (-1.0, -0.1),
    "lambda_s": (0.03, 1.25),
}
SI_NAMES = dict(zip(RANGES, ("v", "m_H", "x_B", "x_H", "z_B", "z_H", "lambda_s"), strict=True))
_SPREAD = 1000  # designs of the box that tell what can be had in it
_CHOICE = 4  # boxes of which the most stable is taken, in most problems: few of them have any stable design
_COARSE = 3  # points of a band for them

# Expression, comparison and weight; the limit is drawn. Native names serve SI problems too.
_ROOTS = (
    ("abscissa", "<=", 8),
    ("damping_ratio", ">=", 6),
    ("abscissa", ">=", 1),
    ("damping_ratio", "<=", 1),
    ("abscissa", "==", 0.7),
    ("abscissa + 0.2*damping_ratio", "<=", 0.5),
)
_PLAIN = (
    ("load_front", "<=", 3),
    ("load_rear", ">=", 1),
    ("nu_H", "<=", 2),
    ("chi_B - chi_H", ">=", 1),
    ("mu*zeta_H + zeta_B", ">=", 1),
    ("tan(lambda_s)", "<=", 1),
    ("zeta_H - zeta_B", ">=", 1),
    ("zeta_B*zeta_H", "<=", 1),
    ("mu*chi_H + chi_B", "<=", 1),
    ("Fr*chi_B", "<=", 1),
    ("sqrt(1 + mu)*chi_B", "<=", 1),
    ("max(Fr/4, chi_B)", "<=", 0.5),
    ("abs(chi_B - chi_H)", "<=", 1),
    ("mass_margin", ">=", 1),
    ("Fr_c", "<=", 1),
    ("Fr - 1.1*Fr_c", ">=", 3),
    ("omega0", "<=", 1),
    ("omega0", ">=", 0.5),
)
_OBJECTIVES: tuple[tuple[str, str, float], ...] = (
    ("minimize", "abscissa", 3.5),
    ("maximize", "damping_ratio", 4),
    ("minimize", "Fr", 4),
    ("maximize", "Fr", 3),
    ("minimize", "Fr_c", 3),
    ("minimize", "lambda_s", 1),
    ("maximize", "lambda_s", 1),
    ("minimize", "chi_B", 1),
    ("maximize", "chi_B", 0.5),
    ("minimize", "mu", 1),
    ("maximize", "mu*chi_H - chi_B", 0.5),
    ("maximize", "zeta_B + zeta_H", 1),
    ("minimize", "(chi_B - 1)**2 + (zeta_B + 0.6)**2 + lambda_s**2", 1),
    ("maximize", "nu_H", 0.5),
    ("minimize", "load_front", 1),
    ("minimize", "abscissa + 0.1*Fr", 1.5),
    ("minimize", "abscissa + 0.05*mu", 0.7),
    ("minimize", "abscissa - 0.3*damping_ratio", 1),
    ("maximize", "damping_ratio - 0.1*lambda_s**2", 1),
    ("maximize", "mass_margin", 0.5),
)


def varied_problem(index: int, seed: int = SEED) -> Problem:
    """One problem, the same whatever the others are; 1 to 7 free parameters in turn, a few are infeasible."""
    rng = np.random.default_rng([seed, index, 1])
    boxes = [
        _Box(_frame(rng, 1 + index % len(RANGES)), rng) for _ in range(int(rng.choice([1, _CHOICE], p=[0.3, 0.7])))
    ]
    box = min(boxes, key=lambda b: b.least_abscissa)
    sense, objective = _objective(rng, box)
    constraints = _constraints(rng, box, objective)
    return Problem(
        **box.frame,
        constraints={f"c{k}": text for k, text in enumerate(constraints, start=1)},
        title=f"varied design {index} of seed {seed}",
        minimize=objective if sense == "minimize" else None,
        maximize=objective if sense == "maximize" else None,
    )


def _frame(rng: np.random.Generator, count: int) -> dict[str, Any]:
    """Everything but constraints and objective."""
    scenarios = _scenarios(rng) if rng.random() < 0.5 else {}
    eligible = [n for n in RANGES if n not in scenarios]
    count = min(count, len(eligible))
    free = {str(n) for n in rng.choice(eligible, count, replace=False)}
    tilt = str(rng.choice(["forward", "backward", "either"], p=[0.7, 0.13, 0.17]))
    tilts = {"forward": RANGES["lambda_s"], "backward": (-1.2, -0.03), "either": (-0.9, 1.1)}
    ranges = {**RANGES, "lambda_s": tilts[tilt]}
    boxes = {n: drawn_box(rng, n, ranges[n]) for n in ranges if n in free}
    fixed = {n: rounded(drawn_value(rng, n, ranges[n])) for n in eligible if n not in free}
    if "chi_H" in fixed and rng.random() < 0.35:
        fixed["chi_H"] = 1.0
    tolerances = _tolerances(rng, [*boxes, *fixed]) if rng.random() < 0.3 else {}
    frame: dict[str, Any] = {
        "model": tms,
        "fixed": fixed,
        "free": boxes,
        "scenarios": scenarios,
        "tolerances": tolerances,
    }
    return _in_si(rng, frame) if rng.random() < 0.15 else frame


def _scenarios(rng: np.random.Generator) -> dict[str, Any]:
    kind = str(rng.choice(["band", "list", "mu", "load", "both"], p=[0.55, 0.15, 0.1, 0.1, 0.1]))
    low = rng.uniform(0.6, 2.5)
    speeds = Band(rounded(low), rounded(low * rng.uniform(1.1, 2.5)), int(rng.integers(2, 8)))
    masses = sorted(rounded(float(m)) for m in np.exp(rng.uniform(np.log(0.03), np.log(5), 2)))
    centre = rng.uniform(0.6, 1.8)
    match kind:
        case "band":
            return {"Fr": speeds}
        case "list":
            return {"Fr": sorted(rounded(float(f)) for f in rng.uniform(0.6, 4, int(rng.integers(2, 5))))}
        case "mu":
            return {"mu": Band(masses[0], rounded(1.1 * masses[1]), int(rng.integers(2, 6)))}
        case "load":
            return {"chi_B": Band(rounded(centre), rounded(centre * rng.uniform(1.05, 1.4)), int(rng.integers(2, 6)))}
        case _:
            return {"Fr": speeds, "mu": masses}


def _tolerances(rng: np.random.Generator, names: Sequence[str]) -> dict[str, float]:
    few = rng.choice([n for n in names if n != "mu"], min(len(names) - 1, int(rng.integers(1, 3))), replace=False)
    return {str(n): rounded(float(rng.uniform(0.003, 0.02))) for n in few}


def _in_si(rng: np.random.Generator, frame: Mapping[str, Any]) -> dict[str, Any]:
    """The same in metres, seconds and kilograms."""
    w, m_B = rounded(rng.uniform(0.8, 1.3)), rounded(rng.uniform(3, 60))
    unit = dict.fromkeys(RANGES, w) | {"Fr": float(np.sqrt(9.81 * w)), "mu": m_B, "lambda_s": 1.0}

    def scaled(name: str, value: Any) -> Any:
        if isinstance(value, Band):
            return Band(rounded(value.min * unit[name]), rounded(value.max * unit[name]), value.points)
        if isinstance(value, tuple | list):
            return tuple(rounded(v * unit[name]) for v in value)
        return rounded(value * unit[name])

    tables = ("fixed", "free", "scenarios", "tolerances")
    moved = {t: {SI_NAMES[n]: scaled(n, v) for n, v in frame[t].items()} for t in tables}
    moved["fixed"] |= {"w": w, "m_B": m_B}
    return {**frame, **moved}


@dataclass(frozen=True)
class _Anchor:
    """What an expression is worth at one good design of the box, and how much it varies over the others."""

    value: float
    spread: float


class _Box:
    """A frame, and what expressions are worth in it."""

    def __init__(self, frame: Mapping[str, Any], rng: np.random.Generator) -> None:
        self.frame = frame
        self.problem = Problem(**frame, minimize="abscissa")
        lower, upper = np.array([*self.problem.free.values()]).reshape(-1, 2).T
        self.designs = rng.uniform(lower, upper, (_SPREAD, len(lower))).T
        judge = Judge(self.problem, _COARSE)
        judged = judge(self.designs)
        nu = self._worth("nu_H")
        self.side = 1.0 if np.median(nu[np.isfinite(nu)]) > 0 else -1.0
        regular = np.where(self.side * nu > 0.02, judged.abscissa, 1e6)
        self.least_abscissa = float(regular.min())
        few = np.argsort(regular)[: _SPREAD // 100]
        self.anchor = int(rng.choice(few)) if regular.min() < 1e6 else int(np.argmin(judged.abscissa))

    def __call__(self, expression: str) -> _Anchor | None:
        """None where the expression is constant or does not exist at the good design."""
        values = self._worth(expression)
        finite = values[np.isfinite(values) & (np.abs(values) < 1e3)]
        value = float(values[self.anchor])
        if len(finite) < 20 or not np.isfinite(value) or abs(value) >= 1e3:
            return None
        spread = float(np.subtract(*np.percentile(finite, [75, 25])))
        return _Anchor(value, spread) if spread > 1e-6 * abs(value) else None

    def _worth(self, expression: str) -> Any:
        """Of the expression as an objective to keep small: the largest over the cases."""
        problem = Problem(**self.frame, minimize=expression)
        return Judge(problem, _COARSE).worth(self.designs)

    def least(self, expression: str) -> _Anchor | None:
        """The same, the least over the cases."""
        found = self(f"-({expression})")
        return _Anchor(-found.value, found.spread) if found else None


def _objective(rng: np.random.Generator, box: _Box) -> tuple[str, str]:
    weights = np.array([w for *_, w in _OBJECTIVES])
    while True:
        sense, text, _ = _OBJECTIVES[int(rng.choice(len(_OBJECTIVES), p=weights / weights.sum()))]
        if box(text) is not None and not (text == "Fr" and {"Fr", "v"} & set(box.problem.scenarios)):
            return sense, text


def _constraints(rng: np.random.Generator, box: _Box, objective: str) -> list[str]:
    rooted = "abscissa" in objective or "damping_ratio" in objective
    chosen = []
    if box("nu_H") is not None:
        least = rounded(rng.uniform(0.01, 0.03))
        chosen.append(f"nu_H >= {least}" if box.side > 0 else f"nu_H <= {-least}")
    demanding = rng.random() < 0.08
    if rng.random() < 0.05 and objective != "damping_ratio":
        chosen.append("damping_ratio >= 1")
        rooted = True
    wanted = len(chosen) + int(rng.integers(0, 3)) + (0 if rooted else 1)
    while len(chosen) < wanted:
        table = _ROOTS if not rooted or rng.random() < 0.35 else _PLAIN
        weights = np.array([w for *_, w in table])
        expression, comparison, _ = table[int(rng.choice(len(table), p=weights / weights.sum()))]
        found = box.least(expression) if comparison == ">=" else box(expression)
        if found is None or expression == objective or any(c.startswith(f"{expression} ") for c in chosen):
            rooted = rooted or rng.random() < 0.05  # a box in which roots do not differ
            continue
        chosen.append(f"{expression} {comparison} {_limit(rng, found, comparison, demanding)}")
        rooted, demanding = True, False
    return chosen


def _limit(rng: np.random.Generator, found: _Anchor, comparison: str, demanding: bool) -> float:
    """A limit of the value's own sign that the good design keeps; a demanding one asks for more than it has."""
    margin = float(rng.uniform(-1.5, -0.3)) if demanding else float(rng.uniform(0.0, 0.25))
    sign = {"<=": 1.0, ">=": -1.0, "==": 1.0}[comparison]
    limit = found.value + sign * margin * found.spread
    return rounded(limit if demanding or limit * found.value > 0 else found.value / 2)
