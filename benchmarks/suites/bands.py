"""Bicycles for a band of speeds: seven scenarios, six free parameters."""

from collections.abc import Mapping

from benchmarks.suites.random_designs import Box
from tmsopt import Problem, models
from tmsopt.design import Band

SPEEDS = Band(1.2, 2.4, 7)
"""Froude numbers that each bicycle must do at; 12 to 24 km/h at a wheelbase of 0.77 m."""

_BUILDER = {"nu_H": "nu_H >= 0.02", "front": "load_front <= 1", "rear": "load_front >= 0"}
_AXIS = {"nu_H": "nu_H >= 0.02"}
_BOXES: Mapping[str, tuple[Mapping[str, Box], Mapping[str, str]]] = {
    "what a builder would accept": (
        {
            "mu": (0.02, 0.2), "chi_B": (0.3, 1.2), "chi_H": (0.8, 1.2),
            "zeta_B": (-1.2, -0.3), "zeta_H": (-1.0, -0.1), "lambda_s": (0.02, 0.52),
        },
        _BUILDER,
    ),
    "the same, tilt of either sign": (
        {
            "mu": (0.02, 0.2), "chi_B": (0.3, 1.2), "chi_H": (0.8, 1.2),
            "zeta_B": (-1.2, -0.3), "zeta_H": (-1.0, -0.1), "lambda_s": (-0.52, 0.52),
        },
        _BUILDER,
    ),
    "with ballast at the rear contact": (
        {
            "mu": (0.05, 5.0), "chi_B": (0.7, 1.6), "chi_H": (0.8, 1.2),
            "zeta_B": (-1.2, -0.3), "zeta_H": (-1.0, -0.1), "lambda_s": (0.02, 1.2),
        },
        _AXIS,
    ),
    "heavy front": (
        {
            "mu": (1.0, 25.0), "chi_B": (0.5, 2.0), "chi_H": (0.9, 1.1),
            "zeta_B": (-0.8, -0.2), "zeta_H": (-0.6, -0.1), "lambda_s": (0.02, 1.3),
        },
        {**_AXIS, "front": "load_front <= 1.05"},
    ),
    "around the benchmark bicycle": (
        {
            "mu": (0.05, 0.3), "chi_B": (1.0, 1.5), "chi_H": (0.95, 1.1),
            "zeta_B": (-0.6, -0.3), "zeta_H": (-0.4, -0.1), "lambda_s": (0.02, 0.6),
        },
        {**_AXIS, "margin": "mass_margin >= 0.0001"},
    ),
}  # fmt: skip


def band_problems() -> dict[str, Problem]:
    """Six free parameters, seven speeds, in several boxes."""
    return {
        name: Problem(
            model=models.tms,
            free=free,
            scenarios={"Fr": SPEEDS},
            constraints=constraints,
            minimize="abscissa",
            title=f"band of speeds, {name}",
        )
        for name, (free, constraints) in _BOXES.items()
    }
