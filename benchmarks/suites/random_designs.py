"""Random constrained designs of the two-mass-skate bicycle: a fixed seed gives the same problems for ever."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tmsopt import Problem
from tmsopt.models import tms
from tmsopt.problem import parse_value

SEED = 2018

Box = tuple[float, float]

RANGES: Mapping[str, Box] = {
    "Fr": (0.1, 8.0),
    "mu": (0.01, 25.0),
    "chi_B": (0.3, 3.0),
    "chi_H": (0.7, 1.3),
    "zeta_B": (-1.5, -0.1),
    "zeta_H": (-1.0, -0.05),
    "lambda_s": (0.02, 1.3),
}
_LOGARITHMIC = ("mu",)

# Expressions with one bound each, whose value is drawn from the values that the expression has in the box.
TEMPLATES: tuple[tuple[str, str], ...] = (
    ("chi_B - chi_H", ">="),
    ("chi_B + chi_H", "<="),
    ("chi_T", "<="),
    ("chi_T", ">="),
    ("Fr*chi_B", "<="),
    ("Fr*mu", ">="),
    ("mu*zeta_H", ">="),
    ("mu*zeta_H + zeta_B", ">="),
    ("tan(lambda_s)", "<="),
    ("lambda_s", ">="),
    ("sin(lambda_s)*Fr", "<="),
    ("cos(lambda_s)*chi_B", ">="),
    ("zeta_B*zeta_H", ">="),
    ("zeta_B*zeta_H", "<="),
    ("zeta_H - zeta_B", ">="),
    ("zeta_B**2 + mu*zeta_H**2", "<="),
    ("Fr**2 + chi_B**2", "<="),
    ("(chi_B - 1.2)**2 + (Fr - 2)**2 + (lambda_s - 0.5)**2", "<="),
    ("Fr**2*chi_B/9.81 - mu", "<="),
    ("mu*chi_H + chi_B", "<="),
    ("Fr_c", "<="),
    ("Fr - Fr_c", ">="),
    ("omega0", ">="),
    ("omega0", "<="),
    ("sqrt(-zeta_B) + sqrt(-zeta_H)", ">="),
    ("sqrt(1 + mu)*chi_B", "<="),
    ("exp(-Fr) + mu/10", "<="),
    ("exp(-lambda_s)*chi_B", ">="),
    ("log(1 + mu)*Fr", "<="),
    ("abs(chi_B - chi_H)", "<="),
    ("max(Fr/4, chi_B)", "<="),
    ("nu_H", "<="),
)
_EQUALITIES = (
    "zeta_B - 2*zeta_H",
    "zeta_B - zeta_H",
    "chi_B - chi_H",
    "zeta_B*zeta_H",
    "Fr - 4*lambda_s",
    "Fr*chi_B - mu",
    "mu*zeta_H - 3*zeta_B",
    "lambda_s + chi_B/3",
    "Fr*chi_H - mu",
)
_SPREAD = 64  # designs of the box that tell which values an expression takes


def random_problem(index: int, seed: int = SEED) -> Problem:
    """One problem of the suite, the same whatever the others are.

    1 to 7 free parameters in turn and 1 to 4 constraints; some are infeasible or never stable.
    """
    rng = np.random.default_rng([seed, index])
    draw = _draw(rng, 1 + index % len(RANGES))
    constraints = _constraints(rng, draw)
    return Problem(
        model=tms,
        fixed=draw.problem.fixed,
        free=draw.problem.free,
        constraints={f"c{k}": text for k, text in enumerate(constraints, start=1)},
        minimize="abscissa",
        title=f"random design {index} of seed {seed}",
    )


@dataclass(frozen=True)
class _Draw:
    """A box, and what expressions are worth in it."""

    problem: Problem
    designs: Mapping[str, np.ndarray]

    def values(self, expression: str) -> np.ndarray | None:
        """Finite values over the designs; None where the expression is constant or rarely exists."""
        problem = self.problem
        values = parse_value(expression, problem.posed.vocabulary)(
            problem.posed.values(problem.posed.ordered(self.designs))
        )
        found = np.broadcast_to(np.asarray(values, dtype=float), _SPREAD)
        found = found[np.isfinite(found)]
        constant = len(found) < 3 or float(np.ptp(found)) <= 1e-9 * float(np.abs(found).max())
        return None if constant else found


def _draw(rng: np.random.Generator, count: int) -> _Draw:
    free = {str(n) for n in rng.choice(list(RANGES), count, replace=False)}
    tilt = rng.choice(["forward", "backward", "either"], p=[0.75, 0.15, 0.1])
    ranges = dict(RANGES) | {
        "lambda_s": {"forward": (0.02, 1.3), "backward": (-1.3, -0.02), "either": (-1.0, 1.2)}[tilt]
    }
    boxes = {n: drawn_box(rng, n, ranges[n]) for n in ranges if n in free}
    fixed = {n: rounded(drawn_value(rng, n, ranges[n])) for n in ranges if n not in free}
    if "chi_H" in fixed and rng.random() < 0.35:
        fixed["chi_H"] = 1.0
    problem = Problem(model=tms, fixed=fixed, free=boxes, minimize="abscissa")
    return _Draw(problem, {n: rng.uniform(*ends, _SPREAD) for n, ends in problem.posed.free.items()})


def drawn_box(rng: np.random.Generator, name: str, ends: Box) -> Box:
    """A range within the given one, in a quarter of the draws all of it."""
    if rng.random() < 0.25:
        return ends
    while True:
        lower, upper = sorted(rounded(drawn_value(rng, name, ends)) for _ in range(2))
        if upper - lower >= 0.05 * abs(upper):
            return lower, upper


def drawn_value(rng: np.random.Generator, name: str, ends: Box) -> float:
    """A value within a range, even in the logarithm for a mass ratio."""
    if name in _LOGARITHMIC:
        return float(np.exp(rng.uniform(*np.log(ends))))
    return float(rng.uniform(*ends))


def _constraints(rng: np.random.Generator, draw: _Draw) -> list[str]:
    wanted = int(rng.integers(1, 5))
    chosen = [_distance(rng, draw)] if draw.values("nu_H") is not None and rng.random() < 0.9 else []
    if len(draw.problem.free) > 1 and rng.random() < 0.2:
        chosen += _equality(rng, draw)
    contradictory = rng.random() < 0.08
    while len(chosen) < wanted or not chosen:
        chosen.append(_inequality(rng, draw, contradictory))
        contradictory = False
    return chosen


def _distance(rng: np.random.Generator, draw: _Draw) -> str:
    """A limit that keeps the mass matrix regular, on a side of 0 that the box has."""
    nu = draw.values("nu_H")
    assert nu is not None
    least = rounded(rng.uniform(0.005, 0.1))
    return f"nu_H >= {least}" if rng.choice(nu) > 0 else f"nu_H <= {-least}"


def _equality(rng: np.random.Generator, draw: _Draw) -> list[str]:
    expression = str(rng.choice(_EQUALITIES))
    values = draw.values(expression)
    return [] if values is None else [f"{expression} == {rounded(rng.choice(values))}"]


def _inequality(rng: np.random.Generator, draw: _Draw, contradictory: bool) -> str:
    while True:
        expression, comparison = TEMPLATES[int(rng.integers(len(TEMPLATES)))]
        values = draw.values(expression)
        if values is None:
            continue
        limit = float(rng.choice(values))
        if contradictory:
            beyond = rng.uniform(0.05, 0.5) * float(np.ptp(values))
            limit = float(values.max()) + beyond if comparison == ">=" else float(values.min()) - beyond
        elif expression == "chi_T" and comparison == "<=" and rng.random() < 0.7:
            limit = 1.0
        return f"{expression} {comparison} {rounded(limit)}"


def rounded(value: float) -> float:
    """Three significant digits, as a person would write."""
    return round(value, 2 - math.floor(math.log10(abs(value)))) if value else 0.0
