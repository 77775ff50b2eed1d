"""Bicycles for a band of speeds: seven scenarios, six free parameters."""

from collections.abc import Mapping

from benchmarks.suites.random_designs import Box
from tmsopt import Problem, models
from tmsopt.problem import Band

SPEEDS = Band(1.2, 2.4, 7)
"""Froude numbers that each bicycle must do at; 12 to 24 km/h at a wheelbase of 0.77 m."""

_AXIS = {"nu_H": "nu_H >= 0.02"}
_BUILDER = {**_AXIS, "front": "load_front <= 1", "rear": "load_front >= 0"}
_FREE = ("mu", "chi_B", "chi_H", "zeta_B", "zeta_H", "lambda_s")
_BIKE = ((0.02, 0.2), (0.3, 1.2), (0.8, 1.2), (-1.2, -0.3), (-1.0, -0.1))
_BALLAST = ((0.05, 5.0), (0.7, 1.6), (0.8, 1.2), (-1.2, -0.3), (-1.0, -0.1))
_HEAVY = ((1.0, 25.0), (0.5, 2.0), (0.9, 1.1), (-0.8, -0.2), (-0.6, -0.1))
_AROUND = ((0.05, 0.3), (1.0, 1.5), (0.95, 1.1), (-0.6, -0.3), (-0.4, -0.1))
_BOXES: Mapping[str, tuple[tuple[Box, ...], Mapping[str, str]]] = {
    "what a builder would accept": ((*_BIKE, (0.02, 0.52)), _BUILDER),
    "the same, tilt of either sign": ((*_BIKE, (-0.52, 0.52)), _BUILDER),
    "with ballast at the rear contact": ((*_BALLAST, (0.02, 1.2)), _AXIS),
    "heavy front": ((*_HEAVY, (0.02, 1.3)), {**_AXIS, "front": "load_front <= 1.05"}),
    "around the benchmark bicycle": ((*_AROUND, (0.02, 0.6)), {**_AXIS, "margin": "mass_margin >= 0.0001"}),
}
"""Ranges of the free parameters, and constraints."""


def band_problems() -> dict[str, Problem]:
    """Six free parameters, seven speeds, in several boxes."""
    return {
        name: Problem(
            model=models.tms,
            free=dict(zip(_FREE, ranges, strict=True)),
            scenarios={"Fr": SPEEDS},
            constraints=constraints,
            minimize="abscissa",
            title=f"band of speeds, {name}",
        )
        for name, (ranges, constraints) in _BOXES.items()
    }
