"""Bicycles for a band of speeds: seven scenarios, six free parameters, and a proof between the scenarios.

The proof is independent of the package's own: with the speed as an indeterminate, the coefficients of p(s + γ) and its
Hurwitz determinant are polynomials in Fr, enclosed in ball arithmetic; on an interval a polynomial lies between the
least and the greatest of its Bernstein coefficients.
"""

import math
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import comb
from typing import Any

import flint
import numpy as np

from benchmarks.judge import eigenvalues
from tmsopt.design.cases import Band
from tmsopt.design.problem import Problem
from tmsopt.design.solution import Solution
from tmsopt.formulation.options import Options
from tmsopt.models import tms
from tmsopt.models.tms import copo
from tmsopt.solver.multistart import search
from tmsopt.solver.solve import solve
from tmsopt.solver.workspace import workspace

SPEEDS = Band(1.2, 2.4, 7)
"""Froude numbers that each bicycle must do at; 12 to 24 km/h at a wheelbase of 0.77 m."""

STARTS = 50
CHECKED = 10_000
"""Speeds at which the roots are computed."""

MARGIN = 1e-6
"""Added to the claimed abscissa for the proof: at the worst speed the claim holds with equality, up to the last bit,
and no enclosure can decide an equality."""

_BITS = 400
_DEEPEST = 60  # halvings of the band: then a piece is 1e-18 wide

_BUILDER = {"nu_H": "nu_H >= 0.02", "front": "load_front <= 1", "rear": "load_front >= 0"}
_AXIS = {"nu_H": "nu_H >= 0.02"}
_BOXES: Mapping[str, tuple[Mapping[str, tuple[float, float]], Mapping[str, str]]] = {
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


@dataclass(frozen=True)
class Ride:
    """What became of one box.

    Attributes:
        per_start: seconds of a solve that tries all starts, over their number.
        single: median seconds of one start: its first variables and its run of IPOPT.
        feasible: share of the starts that ended feasible.
        highest: largest abscissa over `CHECKED` speeds, by eigenvalues.
        excess: of `highest` over the claim; next to multiple roots eigenvalues scatter to the right by up to 4e-4.
        proved: whether the abscissa is at most the claim + `MARGIN` at every speed of the band.
        stable: whether it is below 0 at every speed.
        pieces: of the band in the proof.
        own: what the solution itself says of the band, if it does.
    """

    name: str
    solution: Solution
    per_start: float
    single: float
    feasible: float
    highest: float
    proved: bool
    stable: bool
    pieces: int
    own: str

    @property
    def excess(self) -> float:
        """Of the highest abscissa over the claim."""
        return self.highest - self.solution.abscissa


def band_problems() -> dict[str, Problem]:
    """Six free parameters, seven speeds, in several boxes."""
    return {
        name: Problem(
            model=tms,
            free=free,
            scenarios={"Fr": SPEEDS},
            constraints=constraints,
            minimize="abscissa",
            title=f"band of speeds, {name}",
        )
        for name, (free, constraints) in _BOXES.items()
    }


def ride(name: str, problem: Problem) -> Ride:
    """Solve, time and verify one box."""
    solve(problem, starts=1, throw=False)  # imports and first allocations are nobody's time
    began = time.perf_counter()
    solution = solve(problem, starts=STARTS, exhaustive=True, throw=False)
    seconds = time.perf_counter() - began
    proved, pieces = abscissa_below(solution.parameters, SPEEDS.min, SPEEDS.max, solution.abscissa + MARGIN)
    return Ride(
        name=name,
        solution=solution,
        per_start=seconds / solution.starts.tried,
        single=float(np.median(list(_single(problem)))),
        feasible=solution.starts.converged / solution.starts.tried,
        highest=highest_abscissa(solution.parameters, CHECKED),
        proved=proved,
        stable=abscissa_below(solution.parameters, SPEEDS.min, SPEEDS.max, 0.0)[0],
        pieces=pieces,
        own=own_proof(solution),
    )


def own_proof(solution: Solution) -> str:
    """The solution's own proof between the scenarios; empty where it offers none."""
    cover = solution.cover
    return "" if cover is None else f"{'yes' if cover.proven else 'no'}, {cover.boxes} boxes"


def _single(problem: Problem) -> Iterable[float]:
    """Seconds of each start."""
    times: list[float] = []
    options = Options(STARTS, progress=lambda done, most: times.append(time.perf_counter()), exhaustive=True)
    for part in workspace(problem, options).parts():
        nlp = part.formulate(problem.cases)
        times[:] = [time.perf_counter()]
        search(part, nlp)
        yield from np.diff(times).tolist()


def highest_abscissa(parameters: Mapping[str, float], count: int) -> float:
    """Over evenly spaced speeds, by numeric roots."""
    speeds = np.linspace(SPEEDS.min, SPEEDS.max, count)
    a = np.stack(np.broadcast_arrays(*_coefficients(parameters, speeds, math.tan(parameters["lambda_s"]))), axis=-1)
    return float(eigenvalues(a).real.max())


def abscissa_below(parameters: Mapping[str, float], least: float, most: float, gamma: float) -> tuple[bool, int]:
    """Whether all roots are left of gamma at every speed from least to most, proved; and on how many pieces.

    With a0 > 0 that is so when every coefficient of p(t + γ) and c1 c2 c3 − c0 c3² − c4 c1² are positive
    (Liénard and Chipart). The parameters are taken exactly as stored.
    """
    with flint.ctx.workprec(_BITS):
        speed = flint.arb_poly([0, 1])
        exact = {name: flint.arb(value) for name, value in parameters.items()}
        a = [flint.arb_poly([0]) + c for c in _coefficients(exact, speed, exact["lambda_s"].tan())]
        if a[0](flint.arb(least)) < 0:
            a = [-c for c in a]
        c = _shifted(a, flint.arb(gamma))
        wanted = [*c, c[1] * c[2] * c[3] - c[0] * c[3] * c[3] - c[4] * c[1] * c[1]]
        pieces = [_positive(poly, flint.arb(least), flint.arb(most), _DEEPEST) for poly in wanted]
    return all(pieces), sum(pieces)


def _coefficients(parameters: Mapping[str, Any], speed: Any, tangent: Any) -> list[Any]:
    names = ("mu", "chi_B", "chi_H", "zeta_B", "zeta_H")
    return copo(Fr=speed, T=tangent, **{n: parameters[n] for n in names})


def _shifted(a: list[Any], gamma: Any) -> list[Any]:
    """Coefficients of p(t + γ), by the binomial theorem."""
    n = len(a) - 1
    return [
        sum((a[i] * (comb(n - i, k - i) * gamma ** (k - i)) for i in range(k + 1)), start=0 * a[0])
        for k in range(n + 1)
    ]


def _positive(poly: Any, least: Any, most: Any, deepest: int) -> int:
    """Pieces of the interval on which the Bernstein coefficients prove the polynomial positive; 0 where they fail."""
    n = max(poly.degree(), 0)
    inner = poly(flint.arb_poly([least, most - least]))
    b = [sum(inner[i] * comb(k, i) / comb(n, i) for i in range(k + 1)) for k in range(n + 1)]
    if all(value > 0 for value in b):
        return 1
    if deepest == 0 or not b[0] > 0 or not b[-1] > 0:
        return 0
    middle = (least + most) / 2
    left = _positive(poly, least, middle, deepest - 1)
    right = _positive(poly, middle, most, deepest - 1) if left else 0
    return left + right if right else 0
