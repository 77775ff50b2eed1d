"""The nearest point of a boundary: by how much a design may change before it is unstable, or heavily damped no more."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from tmsopt.boundaries.approach import ALIKE, Approach, Method, approach
from tmsopt.boundaries.boundaries import Edge, edges
from tmsopt.boundaries.rays import RayCrossing, between, elsewhere, most_damped, ray_crossings
from tmsopt.boundaries.surroundings import WeightedDesign, placed
from tmsopt.boundaries.witness import exactly_stable, is_boundary
from tmsopt.errors import InputError, input_error, suggest, table_faults
from tmsopt.problem.files import Given, pose
from tmsopt.problem.problem import Posed, Problem
from tmsopt.problem.solution import Solution
from tmsopt.program.ipopt import ipopt
from tmsopt.program.sqp import sqp
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Array, Numbers, Printable, Table, plain

STABILITY = ("weave", "capsize", "infinity")
"""The boundaries of stability: a pair on the imaginary axis, a root 0, a root through infinity."""

KINDS = (*STABILITY, "heavy damping")
"""All boundaries; that of heavy damping has several edges."""

_ROUNDS = 3
_KEPT = 256  # designs
_NOTHING, _SHIFT = 1e-12, 1e-3  # of a weight: what is 0 but for rounding; how far it is moved to see what it does


@dataclass(frozen=True, repr=False)
class Nearest(Printable):
    """The nearest point of a boundary.

    Attributes:
        kind: ``weave``, ``capsize``, ``infinity`` or ``heavy damping``.
        distance: √Σ ((x − x0)/weight)²; inf where none was found.
        parameters: every parameter of the point; empty where none was found.
        direction: (x − x0)/weight of each parameter that has a weight.
        refined: whether the point meets the conditions of a locally nearest one to rounding; else it is the best
            crossing seen. That no nearer point is far from it is not proved: it is the nearest that was found.
        direct: whether the straight way there stays on one side of the boundaries until it ends.

    Example:
        >>> swing = tmsopt.Problem(tmsopt.models.from_coefficients([1, "c", "k"]), fixed={"c": 1.0, "k": 4.0})
        >>> found = tmsopt.nearest(swing, "capsize", weights={"c": 1.0, "k": 1.0})  # at k = 0
        >>> f"{found.distance:.6f} {found.direction['k']:.6f}"
        '4.000000 -4.000000'

    More: docs/how_to/tolerances.md
    """

    kind: str
    distance: float = math.inf
    parameters: Table[float] = field(default_factory=Table)
    direction: Table[float] = field(default_factory=Table)
    refined: bool = False
    direct: bool = False

    @property
    def found(self) -> bool:
        """Whether there is such a point."""
        return math.isfinite(self.distance)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        return plain(self, "kind found distance parameters direction refined direct")


@dataclass(frozen=True, repr=False)
class Robustness(Printable):
    """How far a design is from each boundary.

    Attributes:
        problem: whose design it is.
        stable: whether all roots are left of the imaginary axis, beyond what rounding makes of them.
        edges: the boundaries of stability that the design stands on as far as rounding tells; its other roots are left
            of the axis. The distance to these is 0.
        zeros: parameters at 0 that take a design on the edge off it alone, such as the damping of one without any.
        heavily_damped: whether all roots are real and negative, multiple ones included.
        parameters: every parameter of the design.
        weights: the unit of change of each parameter that may change.
        weave, capsize, infinity: nearest points of the boundaries of stability.
        heavy_damping: nearest point of the edge of heavy damping: the way out of it for a heavily damped design, the
            way into it for another; distance 0 on the edge, as for an EP4.

    Example:
        >>> swing = tmsopt.Problem(tmsopt.models.from_coefficients([1, "c", "k"]), fixed={"c": 1.0, "k": 4.0})
        >>> margins = tmsopt.robustness(swing, weights={"c": 1.0, "k": 1.0})  # weave at c = 0, capsize at k = 0
        >>> [f"{x:.6f}" for x in (margins.weave.distance, margins.capsize.distance, margins.radius)]
        ['1.000000', '4.000000', '1.000000']

    More: docs/how_to/tolerances.md
    """

    problem: Problem = field(repr=False)
    stable: bool
    edges: tuple[str, ...]
    zeros: tuple[str, ...]
    heavily_damped: bool
    parameters: Table[float]
    weights: Table[float]
    weave: Nearest
    capsize: Nearest
    infinity: Nearest
    heavy_damping: Nearest = field(default_factory=lambda: Nearest("heavy damping"))

    @property
    def limit(self) -> Nearest:
        """The nearest point of the boundary of stability."""
        return min((self.weave, self.capsize, self.infinity), key=lambda n: n.distance)

    @property
    def radius(self) -> float:
        """Least change that ends stability; 0 for a design that is not stable."""
        return self.limit.distance if self.stable else 0.0

    @property
    def relative(self) -> bool:
        """Whether the distances are of relative changes."""
        return all(weight == abs(self.parameters[n]) for n, weight in self.weights.items())

    @property
    def to_stability(self) -> float:
        """Least change that brings stability; 0 for a design that is stable."""
        return 0.0 if self.stable else self.limit.distance

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        return {
            **plain(self, "stable heavily_damped radius to_stability"),
            "limit": self.limit.kind if self.limit.found else None,
            **plain(self, "edges zeros parameters weights"),
            "nearest": {n.kind: n.to_json() for n in (self.weave, self.capsize, self.infinity, self.heavy_damping)},
        }


def nearest(
    design: Given,
    pattern: str,
    *,
    parameters: Numbers | None = None,
    weights: Numbers | None = None,
    progress: Listener | None = None,
) -> Nearest:
    """The nearest point of one boundary: ``weave``, ``capsize``, ``infinity`` or ``heavy damping``.

    The distance is √Σ ((x − x0)/weight)² over the parameters that have a weight; the others stay. Parameters stay
    inside their physical ranges; the box and the constraints of the problem play no part. For a heavily damped design
    the edge of heavy damping is the way out of it, for another the way into it.

    Args:
        design: a solution; or a problem or its file, with `parameters`.
        parameters: a value per parameter (rad, SI units); by default those of the solution, or all fixed ones.
        weights: parameter → change that counts as 1; by default those of the problem, or else |x0| for every
            parameter, fixed ones too, except those with a default value (g), so that distances are relative. Where
            x0 = 0 it is 1, or for a parameter with a unit the largest of the same unit.
        progress: called with a `tmsopt.Progress` now and then.

    Raises:
        InputError: for another pattern, or parameters or weights that are not accepted.

    Example:
        >>> swing = tmsopt.Problem(tmsopt.models.from_coefficients([1, "c", "k"]), fixed={"c": 1.0, "k": 4.0})
        >>> found = tmsopt.nearest(swing, "heavy damping", weights={"c": 1.0})  # at c = 2 sqrt(k) = 4
        >>> f"{found.distance:.6f} {found.parameters['c']:.6f}"
        '3.000000 4.000000'

    More: docs/how_to/tolerances.md
    """
    if pattern not in KINDS:
        raise input_error(f"unknown boundary {pattern!r}; {suggest(pattern, KINDS)}", "pattern")
    place = _place(design, parameters, weights)
    start_steps(progress, f"looking for the nearest {pattern}")
    return _nearest(place, ray_crossings(place), pattern)


def robustness(
    design: Given,
    *,
    parameters: Numbers | None = None,
    weights: Numbers | None = None,
    progress: Listener | None = None,
) -> Robustness:
    """The nearest points of all boundaries, and the radius within which a design stays stable.

    Arguments, distances and exceptions are those of `nearest`.

    Example:
        >>> swing = tmsopt.Problem(tmsopt.models.from_coefficients([1, "c", "k"]), fixed={"c": 1.0, "k": 4.0})
        >>> f"{tmsopt.robustness(swing, weights={'c': 1.0, 'k': 10.0}).radius:.6f}"  # to k = 0
        '0.400000'

    More: docs/how_to/tolerances.md
    """
    place = _place(design, parameters, weights)
    start_steps(progress, "looking for the nearest boundaries")
    return _surveyed(place)


def robustness_at(problem: Posed, parameters: Numbers) -> Robustness:
    """The same for the boundaries of stability alone, with the weights of the problem; kept for a while.

    IPOPT, which searches for designs, has no part in it.
    """
    return _at(problem, Table(parameters), Table(problem.weights))


@lru_cache(maxsize=_KEPT)
def _at(problem: Posed, parameters: Table[float], weights: Table[float]) -> Robustness:
    return _surveyed(placed(problem, parameters, weights or None), STABILITY, sqp)


def _surveyed(place: WeightedDesign, kinds: Sequence[str] = KINDS, method: Method = ipopt) -> Robustness:
    damped = "heavy damping" in kinds
    seen = ray_crossings(place, damped)
    found = [_nearest(place, seen, kind, method) for kind in kinds]
    limit = min((n for n in found if n.kind in STABILITY), key=lambda n: n.distance)
    if limit.found and not limit.direct:  # another boundary is nearer, and no ray met it
        u = np.array([limit.direction[n] for n in place.weights])
        seen = sorted([*seen, *between(place, u, damped)], key=lambda c: c.distance)
        found = [_nearest(place, seen, kind, method) for kind in kinds]
    stable = place.stable and not place.stands_on
    own = Table(place.parameters), Table(place.weights)
    zeros = _zeros(place) if place.stands_on else ()
    return Robustness(place.problem.problem, stable, place.stands_on, zeros, place.heavily_damped, *own, *found)


def _zeros(place: WeightedDesign) -> tuple[str, ...]:
    """Parameters at 0 each of which makes a design stable alone: the edge is where what they stand for is not there."""
    own = place.parameters
    return tuple(
        n
        for n, weight in place.weights.items()
        if abs(own[n]) <= _NOTHING * weight
        and any(exactly_stable(place.problem, {**own, n: moved * weight}) for moved in (_SHIFT, -_SHIFT))
    )


def _place(design: Given, parameters: Numbers | None, weights: Numbers | None) -> WeightedDesign:
    problem = pose(design)
    given = {"parameters": (parameters, "{'Fr': 1.2, 'mu': 0.1}"), "weights": (weights, "{'lambda_s': 0.01}")}
    if faults := [f for n, (x, example) in given.items() if x is not None for f in table_faults(n, x, example)]:
        raise InputError(faults)
    if weights is None and problem.weights:
        weights = problem.weights
    if isinstance(design, Solution):
        return placed(problem, design.parameters if parameters is None else parameters, weights)
    if parameters is None and problem.free:
        message = f"missing; the problem frees {' '.join(problem.free)}: give their values, or a solution"
        raise input_error(message, "parameters")
    return placed(problem, problem.ordered(parameters or {}), weights)


def _nearest(place: WeightedDesign, seen: list[RayCrossing], kind: str, method: Method = ipopt) -> Nearest:
    """The least distance over the pieces of one boundary; the way into heavy damping is sought without a ray too."""
    heavy = kind == "heavy damping"
    if place.problem.model.carrier is not None and kind != "weave":  # eigenfrequencies pass the real line alone
        return Nearest(kind)
    if kind in place.stands_on or (heavy and place.on_edge):
        zero = dict.fromkeys(place.weights, 0.0)
        return Nearest(kind, 0.0, Table(place.parameters), Table(zero), refined=True, direct=True)
    mine = [s for s in seen if (s.edge not in STABILITY if heavy else s.edge == kind)]
    starts: dict[tuple[str, float], list[Array]] = {}
    for crossing in mine:
        starts.setdefault((crossing.edge, crossing.sign), []).append(crossing.u)
    if heavy and not place.heavily_damped:
        sign = float(np.sign(place.coefficients(np.zeros(len(place.weights)))[0]))
        starts.setdefault(("real", sign), []).extend(most_damped(place, sign))
    pieces = edges(place.problem.model.degree)
    found = [_best(place, pieces[edge], sign, points, method) for (edge, sign), points in starts.items()]
    best = min([Approach(), *found], key=lambda each: each.distance)
    if mine and mine[0].distance < best.distance * (1 - ALIKE):
        best = Approach(mine[0].u, False)
    if not best.u.size or not is_boundary(place, best.u, heavy):
        return Nearest(kind)
    direct = not between(place, best.u, heavy)
    direction = Table(dict(zip(place.weights, best.u.tolist(), strict=True)))
    there = {n: 0.0 if abs(x) <= _NOTHING * place.weights.get(n, 0.0) else x for n, x in place.design(best.u).items()}
    return Nearest(kind, best.distance, Table(there), direction, best.refined, direct)


def _best(place: WeightedDesign, edge: Edge, sign: float, starts: list[Array], method: Method) -> Approach:
    """The nearest of where the starts lead; what is crossed on the way there is started from too, and points as far."""
    best = Approach()
    size = min((float(np.linalg.norm(u)) for u in starts if u.any()), default=1.0)
    run = approach(place, edge, sign, size, method)
    for turn in range(_ROUNDS):
        before = best.distance
        for u in starts:
            best = run(u, best)
        if not best.u.size:
            break
        met = between(place, best.u, edge.real)
        starts = [c.u for c in met if (c.edge, c.sign) == (edge.name, sign)]
        if edge.name == "real" and best.distance < before:  # no rays came there, and starts much alike end alike
            starts += elsewhere(place, best.distance, turn)
        if not starts:
            break
    return best
