"""Infeasible problems, each with the closed form that excludes it."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.suites.random_designs import SEED, Box, rounded
from tmsopt import Problem
from tmsopt.models import tms
from tmsopt.problem import Band

_BOX: Mapping[str, Box] = {
    "Fr": (0.8, 4.0),
    "mu": (0.05, 3.0),
    "chi_B": (1.05, 2.0),
    "chi_H": (0.85, 1.15),
    "zeta_B": (-1.2, -0.3),
    "zeta_H": (-0.9, -0.15),
    "lambda_s": (0.05, 1.0),
}


@dataclass(frozen=True)
class Conflict:
    """A problem without a solution.

    Attributes:
        why: the inequality that excludes it.
        short: how much is missing by that inequality, greater than 0, in the units of the limit that it is about.
    """

    problem: Problem
    kind: str
    why: str
    short: float


def conflicts(count: int = 50, seed: int = SEED) -> list[Conflict]:
    """Every kind in turn."""
    return [conflict(index, seed) for index in range(count)]


def conflict(index: int, seed: int = SEED) -> Conflict:
    """One conflict, the same whatever the others are."""
    rng = np.random.default_rng([seed, index, 2])
    return list(_KINDS.values())[index % len(_KINDS)](rng)


def moved(problem: Problem, amounts: Mapping[str, float], share: float = 1.0) -> Problem:
    """The problem with its limits moved by a share of the amounts: constraints by name, bounds as ``Fr.max``.

    Amounts of an equality are signed: they are added to its right-hand side.
    """
    constraints: dict[str, str] = {}
    for name, text in problem.constraints.items():
        amount = share * amounts.get(name, 0.0)
        comparison = problem.posed.conditions[name].comparison
        left, right = text.split(comparison)
        constraints[name] = f"{left} {comparison} ({right}) {'-' if comparison == '>=' else '+'} {amount!r}"
    free = {
        n: (lo - share * amounts.get(f"{n}.min", 0.0), hi + share * amounts.get(f"{n}.max", 0.0))
        for n, (lo, hi) in problem.free.items()
    }
    return replace(problem, constraints=constraints, free=free)


def _contradiction(rng: np.random.Generator) -> Conflict:
    """Two limits on one expression."""
    expression = str(rng.choice(["chi_B - chi_H", "mu*chi_H + chi_B", "Fr*lambda_s", "zeta_B*zeta_H"]))
    low, apart = rounded(rng.uniform(0.4, 0.6)), rounded(rng.uniform(0.05, 0.3))
    least = rounded(low + apart)
    texts = [f"{expression} <= {low}", f"{expression} >= {least}", "nu_H >= 0.02"]
    return _conflict(rng, "two constraints contradict", 4, texts, f"{least} > {low}", least - low)


def _bound(rng: np.random.Generator) -> Conflict:
    """More than the best corner of the box has, for a product that grows in both."""
    most = _BOX["Fr"][1] * _BOX["chi_B"][1]
    wanted = rounded(most * rng.uniform(1.03, 1.3))
    texts = [f"Fr*chi_B >= {wanted}", "nu_H >= 0.01"]
    return _conflict(rng, "a bound against a constraint", 4, texts, f"Fr chi_B <= {most}", wanted - most)


def _geometric_mean(rng: np.random.Generator) -> Conflict:
    """The abscissa cannot be left of omega0, which chi_H = 1 ties to the heights alone (equation w0)."""
    heights = {"zeta_B": rounded(rng.uniform(-1.2, -0.3)), "zeta_H": rounded(rng.uniform(-0.9, -0.15))}
    omega0 = -((heights["zeta_B"] * heights["zeta_H"]) ** -0.25)
    wanted = rounded(omega0 * rng.uniform(1.03, 1.3))
    why = f"abscissa >= omega0 = {omega0:.6g}"
    fixed = {"chi_H": 1.0, **heights}
    return _conflict(rng, "abscissa left of omega0", 5, [f"abscissa <= {wanted}"], why, omega0 - wanted, fixed)


def _heights(rng: np.random.Generator) -> Conflict:
    """The same with free heights: omega0 is leftmost at the lowest centres of mass."""
    omega0 = -((_BOX["zeta_B"][1] * _BOX["zeta_H"][1]) ** -0.25)
    wanted = rounded(omega0 * rng.uniform(1.02, 1.2))
    why = f"abscissa >= omega0 >= {omega0:.6g}"
    texts = [f"abscissa <= {wanted}", "nu_H >= 0.005"]
    return _conflict(rng, "abscissa left of every omega0", 5, texts, why, omega0 - wanted, {"chi_H": 1.0})


def _no_damping(rng: np.random.Generator) -> Conflict:
    """At chi_H = 1 with normal rake, a0 > 0 and a3 = Fr (1 − chi_B) zeta_B < 0 for chi_B < 1: never stable."""
    most = rounded(rng.uniform(0.7, 0.97))
    wanted = str(rng.choice(["damping_ratio >= 1", "damping_ratio >= 0.3", "abscissa <= -0.05"]))
    why = f"chi_B <= {most} < 1 makes a3 negative"
    box = {**_BOX, "chi_B": (0.5, most)}
    texts = [wanted, "nu_H >= 0.02"]
    return _conflict(rng, "damping where there is none", 6, texts, why, 1 - most, {"chi_H": 1.0}, box=box)


def _band(rng: np.random.Generator) -> Conflict:
    """Stable only above Fr_c, with Fr_c² = T (r² chi_B …): at chi_H = 1 and chi_B = r, Fr_c² = T (r + 1)/(r − 1)."""
    heights = {"zeta_B": -0.4, "zeta_H": -0.2, "chi_B": 2.0, "chi_H": 1.0}
    # Fr_c² = zeta_B (zeta_B − zeta_H) chi_B T / ((chi_B − 1)(zeta_B − zeta_H chi_B) zeta_B) has a pole at chi_B = 2
    heights["chi_B"] = rounded(rng.uniform(1.2, 1.7))
    least = rounded(rng.uniform(0.3, 0.6))
    squared = (-0.4 + 0.2) * heights["chi_B"] * math.tan(least)
    squared /= (heights["chi_B"] - 1) * (-0.4 + 0.2 * heights["chi_B"])
    low = rounded(math.sqrt(squared) * rng.uniform(0.6, 0.9))
    box = {**_BOX, "lambda_s": (least, 1.0)}
    why = f"Fr_c >= {math.sqrt(squared):.6g} > {low}"
    short = math.sqrt(squared) - low
    speeds = {"Fr": Band(low, rounded(2.5 * low), int(rng.integers(3, 8)))}
    return _conflict(rng, "a band that begins below Fr_c", 2, ["abscissa <= -0.01"], why, short, heights, box, speeds)


def _equality(rng: np.random.Generator) -> Conflict:
    """An equality that the box has no room for once an inequality holds."""
    wanted, most = rounded(rng.uniform(2.9, 3.1)), rounded(rng.uniform(1.3, 1.6))
    short = wanted - most - _BOX["chi_H"][1]
    texts = [f"chi_B + chi_H == {wanted}", f"chi_B <= {most}", "nu_H >= 0.01"]
    why = f"chi_B + chi_H <= {most} + {_BOX['chi_H'][1]}"
    return _conflict(rng, "an equality against an inequality", 5, texts, why, short)


def _loads(rng: np.random.Generator) -> Conflict:
    """The loads of the two wheels add up to 1."""
    front, rear = rounded(rng.uniform(0.4, 0.6)), rounded(rng.uniform(0.2, 0.35))
    texts = [f"load_front <= {front}", f"load_rear <= {rear}", "nu_H >= 0.01"]
    box = {**_BOX, "chi_B": (0.3, 1.5)}
    why = "load_front + load_rear = 1"
    return _conflict(rng, "loads that do not add up", 5, texts, why, 1 - front - rear, box=box)


def _tolerance(rng: np.random.Generator) -> Conflict:
    """Limits closer together than the tolerance is wide."""
    low, apart, off = (
        rounded(rng.uniform(1.2, 1.5)),
        rounded(rng.uniform(0.005, 0.02)),
        rounded(rng.uniform(0.015, 0.03)),
    )
    high = round(low + apart, 6)
    texts = [f"chi_B >= {low}", f"chi_B <= {high}", "nu_H >= 0.02"]
    why = f"chi_B is off by {off} either way"
    short = 2 * off - (high - low)
    return _conflict(rng, "a tolerance wider than its limits", 5, texts, why, short, tolerances={"chi_B": off})


def _slow(rng: np.random.Generator) -> Conflict:
    """The mean of the roots is −a1/(4 a0), at chi_H = 1 Fr (1/|zeta_H| − chi_B/|zeta_B|)/(4 T) in size."""
    box = {**_BOX, "Fr": (0.3, 0.6), "lambda_s": (0.5, 1.0)}
    T = math.tan(0.5)
    steepest = 0.6 * (1 / 0.15 - 1.05 / 1.2) / T / 4
    omega0 = (0.3 * 0.15) ** -0.25
    least = min(steepest, omega0)
    wanted = rounded(-least * rng.uniform(1.05, 1.3))
    why = f"abscissa >= mean of the roots >= {-steepest:.6g}, and >= omega0 >= {-omega0:.6g}"
    texts = [f"abscissa <= {wanted}", "load_front <= 1.6"]
    return _conflict(rng, "roots whose mean is too far right", 6, texts, why, -least - wanted, {"chi_H": 1.0}, box=box)


_KINDS: Mapping[str, Callable[[np.random.Generator], Conflict]] = {
    kind.__name__: kind
    for kind in (
        _contradiction,
        _bound,
        _geometric_mean,
        _heights,
        _no_damping,
        _band,
        _equality,
        _loads,
        _tolerance,
        _slow,
    )
}


def _conflict(
    rng: np.random.Generator,
    kind: str,
    count: int,
    constraints: list[str],
    why: str,
    short: float,
    fixed: Mapping[str, float] | None = None,
    box: Mapping[str, Box] = _BOX,
    scenarios: Mapping[str, Band] | None = None,
    tolerances: Mapping[str, float] | None = None,
) -> Conflict:
    """Free parameters are those that the constraints name, and others up to `count`."""
    fixed, scenarios = dict(fixed or {}), scenarios or {}
    open_ = [n for n in box if n not in fixed and n not in scenarios]
    named = [n for n in open_ if any(n in text for text in constraints)]
    if any("load" in text or "chi_T" in text for text in constraints):
        named += [n for n in ("mu", "chi_B", "chi_H") if n in open_ and n not in named]
    others = [n for n in open_ if n not in named]
    chosen = named + [str(n) for n in rng.permutation(others)][: max(0, count - len(named))]
    fixed |= {n: rounded(float(rng.uniform(*box[n]))) for n in open_ if n not in chosen}
    objective = str(rng.choice(["abscissa", "abscissa + 0.1*lambda_s"]))
    problem = Problem(
        model=tms,
        fixed=fixed,
        free={n: box[n] for n in box if n in chosen},
        scenarios=scenarios,
        tolerances=tolerances or {},
        constraints={f"c{k}": text for k, text in enumerate(constraints, start=1)},
        minimize=objective,
        title=f"conflict: {kind}",
    )
    return Conflict(problem, kind, why, short)
