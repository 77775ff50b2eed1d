"""Problems of the paper: its exceptional points, and the EP set and plane of its figures."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tmsopt import Problem, models

PROBLEMS = Path(__file__).parents[2] / "problems"
"""Problem files."""

HEIGHTS: Mapping[str, float] = {"zeta_B": -0.4, "zeta_H": -0.2, "mu": 0.1, "chi_H": 1.0}

_PLANE = {"Fr": (0.01, 5.0), "lambda_s": (0.01, 1.4)}
PLANE = Problem(models.tms, fixed={**HEIGHTS, "chi_B": math.sqrt(2)}, free=_PLANE)
"""Speed and tilt where chi_B is on the scaling law."""

EP_SET = Problem(
    models.tms, fixed=HEIGHTS, free={"Fr": (0.5, 4.0), "chi_B": (1.01, 3.0), "lambda_s": (0.02, 1.4)}, locate="2EP2"
)
"""2EP2 through EP4 to CEP2."""

_ROOT2 = math.sqrt(2)
_TILT = math.atan(15 / 4 - 75 * _ROOT2 / 32)
_FR = 3 * math.sqrt(110 * _ROOT2 - 120) / 8
_MACHINE = {"zeta_B": -1.158, "zeta_H": -0.526}


@dataclass(frozen=True)
class Point:
    """A point of the paper: where it is printed, the pattern, what is held and about where it is."""

    place: str
    pattern: str
    held: Mapping[str, float]
    near: Mapping[str, float]

    def problem(self) -> Problem:
        """The pattern is located in a box a fifth of its numbers wide, either way."""
        free = {n: (x - abs(x) / 5, x + abs(x) / 5) for n, x in self.near.items()}
        return Problem(models.tms, fixed=self.held, free=free, start=self.near, locate=self.pattern)


POINTS = (
    Point("Table 1, row 1; Figs. fig00, fig1", "EP4", HEIGHTS, {"Fr": 2.24, "chi_B": 1.41, "lambda_s": 0.41}),
    Point("Table 1, row 2", "2EP2", {**HEIGHTS, "lambda_s": _TILT - 0.05}, {"Fr": 2.26, "chi_B": 1.41}),
    Point("Table 1, row 3", "CEP2", {**HEIGHTS, "lambda_s": _TILT + 0.8}, {"Fr": 4.1, "chi_B": 1.41}),
    Point("Table 1, Fr_c of row 1", "weave", {**HEIGHTS, "lambda_s": _TILT, "chi_B": _ROOT2}, {"Fr": 1.6}),
    Point("Table 1, Fr_c of row 2", "weave", {**HEIGHTS, "lambda_s": _TILT - 0.05, "chi_B": _ROOT2}, {"Fr": 1.5}),
    Point("Table 1, Fr_c of row 3", "weave", {**HEIGHTS, "lambda_s": _TILT + 0.8, "chi_B": _ROOT2}, {"Fr": 3.9}),
    Point(
        "optimised benchmark, ω0 not held",
        "EP4",
        {**HEIGHTS, "chi_H": 1.02, "mu": 20.846267012761306},
        {"Fr": 2.34, "chi_B": 1.19, "lambda_s": 0.85},
    ),
    Point("fold, Fr = √5", "2EP2", {**HEIGHTS, "lambda_s": 0.4051965261014}, {"Fr": 2.24, "chi_B": 1.41}),
    Point("Fig. fig00, Fr_EP4 + 0.5", "2EP2", {**HEIGHTS, "Fr": _FR + 0.5}, {"chi_B": 1.41, "lambda_s": 0.24}),
    Point("Fig. fig00, Fr_EP4 + 0.5", "CEP2", {**HEIGHTS, "Fr": _FR + 0.5}, {"chi_B": 1.41, "lambda_s": 0.87}),
    Point("Fig. fig2, left", "EP3", {**HEIGHTS, "chi_B": _ROOT2 - 0.1}, {"Fr": 2.02, "lambda_s": 0.2}),
    Point("Fig. fig2, right", "EP3", {**HEIGHTS, "lambda_s": _TILT - 0.18}, {"Fr": 2.185, "chi_B": 1.515}),
    Point("Fig. fig2, right", "EP3", {**HEIGHTS, "lambda_s": _TILT - 0.18}, {"Fr": 2.086, "chi_B": 1.339}),
    Point("Fig. fig2, right", "2EP2", {**HEIGHTS, "lambda_s": _TILT - 0.18}, {"Fr": 3.97, "chi_B": 1.41}),
    Point("spire at the tilt of row 2", "EP3", {**HEIGHTS, "lambda_s": _TILT - 0.05}, {"Fr": 2.2352, "chi_B": 1.4283}),
    Point("spire at the tilt of row 2", "EP3", {**HEIGHTS, "lambda_s": _TILT - 0.05}, {"Fr": 2.2171, "chi_B": 1.4025}),
    Point(
        "dual of row 1",
        "EP4",
        {**HEIGHTS, "zeta_B": -0.2, "zeta_H": -0.4},
        {"Fr": _FR / _ROOT2, "chi_B": 0.707, "lambda_s": -0.215},
    ),
    Point(
        "experimental machine",
        "EP4",
        {**_MACHINE, "chi_H": 0.921, "chi_B": 1.526},
        {"Fr": 1.38, "mu": 0.98, "lambda_s": 0.244},
    ),
    Point(
        "experimental machine, chi_H = 1",
        "EP3",
        {**_MACHINE, "mu": 0.1, "chi_H": 1.0, "chi_B": 1.526},
        {"Fr": 1.31, "lambda_s": 0.17},
    ),
)
"""Points of the text, Table 1 and the figures."""
