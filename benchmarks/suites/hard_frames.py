"""Boxes for hard problems, and what expressions are worth in them: limits that one good design of the box meets."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from benchmarks.judges import NOWHERE, eigenvalues, evaluated, root_values
from benchmarks.suites.random_designs import Box, drawn_box, drawn_value, rounded
from benchmarks.suites.varied_designs import RANGES
from tmsopt import Problem
from tmsopt.models import Model, Values, tms, whipple
from tmsopt.records import Array

ROBOT: Mapping[str, Box] = {
    "v": (1.7, 3.0),
    "m_H": (0.4, 4.0),
    "x_B": (0.03, 0.4),
    "x_H": (0.15, 0.36),
    "z_B": (-0.35, -0.06),
    "z_H": (-0.3, -0.03),
    "lambda_s": (0.03, 0.7),
}
WHEELS: Mapping[str, Box] = {**ROBOT, "c": (-0.02, 0.03)}
_SPREAD = 600  # designs of a box that tell what can be had in it
_CHOICE = 4  # boxes of which the most stable is taken: few of them have any stable design


@dataclass(frozen=True)
class Frame:
    """Everything of a problem but what is asked."""

    model: Model
    fixed: Mapping[str, float]
    free: Mapping[str, Box]
    rng: np.random.Generator = field(compare=False)

    @cached_property
    def designs(self) -> Array:
        """Random ones, shape (free, designs)."""
        lower, upper = np.array([*self.free.values()]).reshape(-1, 2).T
        return self.rng.uniform(lower, upper, (_SPREAD, len(lower))).T

    @cached_property
    def values(self) -> Values:
        """Everything derived from them, by eigenvalues."""
        at: dict[str, Any] = {**self.fixed, **dict(zip(self.free, self.designs, strict=True))}
        problem = Problem(model=self.model, fixed=self.fixed, free=self.free, minimize="abscissa")
        with np.errstate(all="ignore"):
            values = Values(self.model, problem.posed.parameter_set, {**problem.fixed, **at})
            a = np.stack(np.broadcast_arrays(*values.coefficients, self.designs[0]), axis=-1)[:, :-1]
            abscissa, ratio = root_values(eigenvalues(np.asarray(a, float)))
        return values.with_known({"abscissa": abscissa, "damping_ratio": ratio})

    @cached_property
    def anchor(self) -> int:
        """One of the most stable of them."""
        return int(self.rng.choice(np.argsort(self.values["abscissa"], kind="stable")[: _SPREAD // 60]))

    @property
    def least(self) -> float:
        """Abscissa of the most stable of them."""
        return float(np.min(self.values["abscissa"]))

    def worth(self, text: str) -> Array:
        """Of an expression, for each of them."""
        with np.errstate(all="ignore"):
            found = np.asarray(evaluated(text, self.values), dtype=float)
        return np.where(np.abs(found) < NOWHERE, found, np.nan) * np.ones(_SPREAD)

    def usable(self, text: str) -> bool:
        """Whether it varies, and exists at most designs and at the anchor."""
        found = self.worth(text)
        finite = found[np.isfinite(found)]
        return bool(len(finite) > _SPREAD // 2 and np.isfinite(found[self.anchor]) and np.ptp(finite) > 1e-9)

    def iqr(self, text: str) -> float:
        """Its interquartile range."""
        return float(np.subtract(*np.nanpercentile(self.worth(text), [75, 25])))

    def at_anchor(self, text: str) -> float:
        """What it is worth at the anchor."""
        return float(self.worth(text)[self.anchor])

    def limit(self, text: str, comparison: str, slack: float | None = None) -> str:
        """A comparison with a number that the anchor meets, `slack` times the interquartile range away."""
        margin = self.rng.uniform(0, 0.25) if slack is None else slack
        sign = {"<=": 1.0, ">=": -1.0, "==": 0.0}[comparison]
        return f"{text} {comparison} {number(self.at_anchor(text) + sign * margin * self.iqr(text))}"

    def band(self, text: str, share: float) -> str:
        """A band around the anchor's value, which that share of the designs meets, roughly."""
        return f"abs({text} - {signed(number(self.at_anchor(text), 6))}) <= {number(share * self.iqr(text))}"

    def unit(self, name: str) -> str:
        """A free parameter as a text that goes from about −1 to 1."""
        lower, upper = self.free[name]
        half = number((upper - lower) / 2, 2)
        return f"({name} - {signed(number((lower + upper) / 2, 2))})/{half}"

    def filled(self, template: str) -> str:
        """A template with free parameters for {a}, {b} and {c}, scaled so that they go from about −1 to 1."""
        names = list(self.free)
        drawn = [str(n) for n in self.rng.permutation(names)]
        drawn += [str(self.rng.choice(names)) for _ in range(3)]
        return template.format(**{k: f"({self.unit(n)})" for k, n in zip("abc", drawn, strict=False)})

    def one_of(self, templates: Sequence[str]) -> str:
        """A filled template that can be used."""
        for _ in range(200):
            text = self.filled(str(self.rng.choice(templates)))
            if self.usable(text):
                return text
        raise ValueError(f"nothing fits {list(self.free)}")

    def some_of(self, texts: Sequence[str]) -> str:
        """An expression that can be used, without filling."""
        usable = [t for t in texts if self.usable(t)]
        return str(self.rng.choice(usable)) if usable else self.filled("{a}")


def number(value: float, digits: int = 3) -> float:
    """A few significant digits, as a person would write."""
    return round(value, digits - 1 - math.floor(math.log10(abs(value)))) if value else 0.0


def signed(value: float) -> str:
    """A number that may stand after a minus sign."""
    return f"({value})" if value < 0 else f"{value}"


def best_frame(rng: np.random.Generator, make: Callable[[np.random.Generator], Frame]) -> Frame:
    """The most stable of a few."""
    frames = [make(rng) for _ in range(_CHOICE)]
    return min(frames, key=lambda f: f.least)


def native(rng: np.random.Generator, count: int, tilt: str = "") -> Frame:
    """The skates without units, with some free parameters."""
    tilt = tilt or str(rng.choice(["forward", "backward", "either"], p=[0.65, 0.15, 0.2]))
    ranges = {**RANGES, "lambda_s": {"forward": (0.03, 1.25), "backward": (-1.2, -0.03), "either": (-0.9, 1.1)}[tilt]}
    free = {str(n) for n in rng.choice(list(ranges), count, replace=False)}
    if tilt == "either" and "lambda_s" not in free:
        free = {*sorted(free)[1:], "lambda_s"}
    boxes = {
        n: ranges[n] if n == "lambda_s" and tilt == "either" else drawn_box(rng, n, ranges[n])
        for n in ranges
        if n in free
    }
    return Frame(tms, {n: rounded(drawn_value(rng, n, ranges[n])) for n in ranges if n not in free}, boxes, rng)


def robot(rng: np.random.Generator, count: int) -> Frame:
    """A robot bicycle of a quarter of a metre and about 12 kg, on skates, in SI."""
    boxes, fixed = _machine(rng, count, ROBOT)
    return Frame(tms, fixed | {"w": 0.25, "m_B": number(rng.uniform(8, 11.5), 2)}, boxes, rng)


def wheeled(rng: np.random.Generator, count: int) -> Frame:
    """The same on small wheels, with trail."""
    boxes, fixed = _machine(rng, count, WHEELS)
    radius, mass = number(rng.uniform(0.03, 0.07), 2), number(rng.uniform(0.1, 0.5), 2)
    hoop = number(mass * radius**2, 3)
    wheels = {
        f"{letter}_{wheel}{axis}": value
        for wheel in "RF"
        for letter, axis, value in (("r", "", radius), ("m", "", mass), ("I", "yy", hoop), ("I", "xx", hoop / 2))
    }
    bodies = {"I_Bxx": 0.02, "I_Bzz": 0.015, "I_Hxx": 0.002, "I_Hzz": 0.001}
    drawn = {n: number(v * rng.uniform(0.5, 2), 2) for n, v in bodies.items()}
    return Frame(whipple, {**fixed, **wheels, **drawn, "w": 0.25, "m_B": number(rng.uniform(7, 11), 2)}, boxes, rng)


def _machine(
    rng: np.random.Generator, count: int, ranges: Mapping[str, Box]
) -> tuple[dict[str, Box], dict[str, float]]:
    either = rng.random() < 0.35
    tilts: Box = (-0.6, 0.6) if either else ranges["lambda_s"]
    ranges = {**ranges, "lambda_s": tilts}
    names = {str(n) for n in rng.choice(list(ranges), count, replace=False)}
    if either:
        names = {*sorted(names - {"lambda_s"})[: count - 1], "lambda_s"}
    whole = bool(rng.random() < 0.5) and count < len(ROBOT)  # all free in the whole box: one problem is enough
    free = {n: ranges[n] if whole or n == "lambda_s" else drawn_box(rng, n, ranges[n]) for n in ranges if n in names}
    return free, {n: rounded(float(rng.uniform(*ranges[n]))) for n in ranges if n not in names}
