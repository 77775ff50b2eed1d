"""Finds the nearest point of each boundary: how far a design may change before it loses stability or heavy damping."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from tmsopt.boundaries.approach import SAME_DISTANCE, EdgePoint, Method, make_edge_search
from tmsopt.boundaries.boundaries import Edge, list_edges
from tmsopt.boundaries.exact_check import is_boundary, is_exactly_stable
from tmsopt.boundaries.rays import (
    RayCrossing,
    draw_points,
    find_crossings_on_segment,
    find_most_damped,
    find_ray_crossings,
)
from tmsopt.boundaries.weighted_design import WeightedDesign, weight_design
from tmsopt.errors import InputError, input_error, suggest, table_faults
from tmsopt.problem.files import ProblemSource, pose
from tmsopt.problem.problem import Posed, Problem
from tmsopt.problem.solution import Solution
from tmsopt.program.ipopt import make_ipopt
from tmsopt.program.sqp import make_sqp
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Array, Numbers, Printable, Table, plain

STABILITY = ("weave", "capsize", "infinity")
"""The boundaries of stability: a pair on the imaginary axis, a root 0, a root through infinity."""

KINDS = (*STABILITY, "heavy damping")
"""All boundaries; the boundary of heavy damping has several edges."""

_ROUNDS = 3  # rounds of runs; each starts from the crossings on the segment to the best point so far
_MAX_DESIGNS = 256  # in the cache
_ZERO = 1e-12  # relative to the weight: largest value that counts as 0
_TRIAL_CHANGE = 1e-3  # relative to the weight: change that tests whether a design becomes stable


@dataclass(frozen=True, repr=False)
class Nearest(Printable):
    """The nearest point of a boundary.

    Attributes:
        kind: ``weave``, ``capsize``, ``infinity`` or ``heavy damping``.
        distance: √Σ ((x − x0)/weight)²; inf if no point was found.
        parameters: every parameter of the point; empty if no point was found.
        direction: (x − x0)/weight of each parameter that has a weight.
        refined: whether the point satisfies the conditions of a locally nearest point up to rounding; else it is the
            best crossing found. In both cases, a nearer point may exist elsewhere.
        direct: whether the segment from the design to the point crosses no boundary before its end.

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
        """Whether a point was found."""
        return math.isfinite(self.distance)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        return plain(self, "kind found distance parameters direction refined direct")


@dataclass(frozen=True, repr=False)
class Robustness(Printable):
    """How far a design is from each boundary.

    Attributes:
        problem: the problem of the design.
        stable: whether all roots are left of the imaginary axis by more than rounding.
        edges: the boundaries of stability that the design is on up to rounding, at distance 0; its other roots are left
            of the axis.
        zeros: parameters that are 0, if a change of any one of them makes a design on an edge stable, such as a missing
            damping.
        heavily_damped: whether all roots are real and negative, multiple ones included.
        parameters: every parameter of the design.
        weights: the unit of change of each parameter that may change.
        weave, capsize, infinity: nearest points of the boundaries of stability.
        heavy_damping: nearest point of the edge of heavy damping. A heavily damped design would lose heavy damping
            there, and any other would gain it. The distance is 0 for a design on the edge, such as an EP4.

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
        """The nearest of the points of `weave`, `capsize` and `infinity`: there stability begins or ends."""
        return min((self.weave, self.capsize, self.infinity), key=lambda n: n.distance)

    @property
    def radius(self) -> float:
        """Smallest change that ends stability; 0 for an unstable design."""
        return self.limit.distance if self.stable else 0.0

    @property
    def relative(self) -> bool:
        """Whether the distances measure relative changes, because each weight is the size of its parameter."""
        return all(weight == abs(self.parameters[n]) for n, weight in self.weights.items())

    @property
    def to_stability(self) -> float:
        """Smallest change that makes the design stable; 0 for a stable design."""
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
    design: ProblemSource,
    pattern: str,
    *,
    parameters: Numbers | None = None,
    weights: Numbers | None = None,
    progress: Listener | None = None,
) -> Nearest:
    """The nearest point of one boundary: ``weave``, ``capsize``, ``infinity`` or ``heavy damping``.

    The distance is √Σ ((x − x0)/weight)² over the parameters that have a weight; the others stay fixed. Parameters
    stay inside their physical ranges; the box and the constraints of the problem are ignored. At the edge of heavy
    damping, a heavily damped design loses heavy damping, and any other design gains it.

    Args:
        design: a solution; or a problem or its file, with `parameters`.
        parameters: parameter → value (rad, SI units); by default the values of the solution, or all fixed values.
        weights: parameter → change that counts as 1. By default these are the weights of the problem. Without any, the
            weight of every free or fixed parameter is |x0|, so that distances are relative; parameters with a default
            value (g) have no weight. If x0 = 0, the weight is 1, or for a parameter with a unit the largest |x0| of the
            same unit.
        progress: function called with a `tmsopt.Progress` now and then.

    Raises:
        InputError: for an unknown pattern, or parameters or weights out of range.

    Example:
        >>> swing = tmsopt.Problem(tmsopt.models.from_coefficients([1, "c", "k"]), fixed={"c": 1.0, "k": 4.0})
        >>> found = tmsopt.nearest(swing, "heavy damping", weights={"c": 1.0})  # at c = 2 sqrt(k) = 4
        >>> f"{found.distance:.6f} {found.parameters['c']:.6f}"
        '3.000000 4.000000'

    More: docs/how_to/tolerances.md
    """
    if pattern not in KINDS:
        raise input_error(f"unknown boundary {pattern!r}; {suggest(pattern, KINDS)}", "pattern")
    base = _weight_given_design(design, parameters, weights)
    start_steps(progress, f"looking for the nearest {pattern}")
    return _find_nearest(base, find_ray_crossings(base), pattern)


def robustness(
    design: ProblemSource,
    *,
    parameters: Numbers | None = None,
    weights: Numbers | None = None,
    progress: Listener | None = None,
) -> Robustness:
    """The nearest point of each boundary, and the radius within which a design stays stable.

    Arguments, distances and exceptions are as in `nearest`.

    Example:
        >>> swing = tmsopt.Problem(tmsopt.models.from_coefficients([1, "c", "k"]), fixed={"c": 1.0, "k": 4.0})
        >>> f"{tmsopt.robustness(swing, weights={'c': 1.0, 'k': 10.0}).radius:.6f}"  # to k = 0
        '0.400000'

    More: docs/how_to/tolerances.md
    """
    base = _weight_given_design(design, parameters, weights)
    start_steps(progress, "looking for the nearest boundaries")
    return _survey_boundaries(base)


def find_stability_margins(problem: Posed, parameters: Numbers) -> Robustness:
    """Find the nearest points of the boundaries of stability only, with the weights of the problem; results are cached.

    The solver is not IPOPT, because IPOPT also searches for the designs.
    """
    return _measure_margins(problem, Table(parameters), Table(problem.weights))


@lru_cache(maxsize=_MAX_DESIGNS)
def _measure_margins(problem: Posed, parameters: Table[float], weights: Table[float]) -> Robustness:
    return _survey_boundaries(weight_design(problem, parameters, weights or None), STABILITY, make_sqp)


def _survey_boundaries(base: WeightedDesign, kinds: Sequence[str] = KINDS, method: Method = make_ipopt) -> Robustness:
    with_damping = "heavy damping" in kinds
    crossings = find_ray_crossings(base, with_damping)
    points = [_find_nearest(base, crossings, kind, method) for kind in kinds]
    limit = min((n for n in points if n.kind in STABILITY), key=lambda n: n.distance)
    if limit.found and not limit.direct:  # the segment has a nearer crossing, which no ray found
        u = np.array([limit.direction[n] for n in base.weights])
        crossings = sorted([*crossings, *find_crossings_on_segment(base, u, with_damping)], key=lambda c: c.distance)
        points = [_find_nearest(base, crossings, kind, method) for kind in kinds]
    stable = base.is_stable and not base.edges
    design_tables = Table(base.parameters), Table(base.weights)
    zeros = _find_stabilising_zeros(base) if base.edges else ()
    return Robustness(base.stated.problem, stable, base.edges, zeros, base.is_heavily_damped, *design_tables, *points)


def _find_stabilising_zeros(base: WeightedDesign) -> tuple[str, ...]:
    """Find the parameters that are 0 and make the design stable if one of them changes."""
    parameters = base.parameters
    return tuple(
        n
        for n, weight in base.weights.items()
        if abs(parameters[n]) <= _ZERO * weight
        and any(
            is_exactly_stable(base.problem, {**parameters, n: shift * weight})
            for shift in (_TRIAL_CHANGE, -_TRIAL_CHANGE)
        )
    )


def _weight_given_design(design: ProblemSource, parameters: Numbers | None, weights: Numbers | None) -> WeightedDesign:
    problem = pose(design)
    tables = {"parameters": (parameters, "{'Fr': 1.2, 'mu': 0.1}"), "weights": (weights, "{'lambda_s': 0.01}")}
    if faults := [f for n, (x, example) in tables.items() if x is not None for f in table_faults(n, x, example)]:
        raise InputError(faults)
    if weights is None and problem.weights:
        weights = problem.weights
    if isinstance(design, Solution):
        return weight_design(problem, design.parameters if parameters is None else parameters, weights)
    if parameters is None and problem.free:
        message = f"missing; give values of the free parameters {' '.join(problem.free)}, or a solution"
        raise input_error(message, "parameters")
    return weight_design(problem, problem.ordered(parameters or {}), weights)


def _find_nearest(
    base: WeightedDesign, crossings: list[RayCrossing], kind: str, method: Method = make_ipopt
) -> Nearest:
    """Find the nearest point of one boundary, over all its edges; for heavy damping, some starts are no crossings."""
    is_damping = kind == "heavy damping"
    if base.stated.model.is_complex and kind != "weave":  # an eigenfrequency can only cross the real line
        return Nearest(kind)
    if kind in base.edges or (is_damping and base.is_on_damping_edge):
        no_change = dict.fromkeys(base.weights, 0.0)
        return Nearest(kind, 0.0, Table(base.parameters), Table(no_change), refined=True, direct=True)
    edge_crossings = [s for s in crossings if (s.edge not in STABILITY if is_damping else s.edge == kind)]
    starts: dict[tuple[str, float], list[Array]] = {}
    for crossing in edge_crossings:
        starts.setdefault((crossing.edge, crossing.sign), []).append(crossing.u)
    if is_damping and not base.is_heavily_damped:
        sign = float(np.sign(base.coefficients(np.zeros(len(base.weights)))[0]))
        starts.setdefault(("real", sign), []).extend(find_most_damped(base, sign))
    edges = list_edges(base.problem.model.degree)
    ends = [_find_nearest_on_edge(base, edges[name], sign, points, method) for (name, sign), points in starts.items()]
    best = min([EdgePoint(), *ends], key=lambda end: end.distance)
    if edge_crossings and edge_crossings[0].distance < best.distance * (1 - SAME_DISTANCE):
        best = EdgePoint(edge_crossings[0].u, False)
    points = [best, *(EdgePoint(crossing.u, False) for crossing in edge_crossings[: 1 - is_damping])]
    best = next((e for e in points if e.u.size and is_boundary(base, e.u, is_damping)), EdgePoint())
    if not best.u.size:
        return Nearest(kind)
    direct = not find_crossings_on_segment(base, best.u, is_damping)
    direction = Table(dict(zip(base.weights, best.u.tolist(), strict=True)))
    parameters = {n: 0.0 if abs(x) <= _ZERO * base.weights.get(n, 0.0) else x for n, x in base.design(best.u).items()}
    return Nearest(kind, best.distance, Table(parameters), direction, best.refined, direct)


def _find_nearest_on_edge(
    base: WeightedDesign, edge: Edge, sign: float, starts: list[Array], method: Method
) -> EdgePoint:
    """Run from all starts and keep the nearest end; the crossings on the segment to it start the next round."""
    best = EdgePoint()
    size = min((float(np.linalg.norm(u)) for u in starts if u.any()), default=1.0)
    run = make_edge_search(base, edge, sign, size, method)
    for round_number in range(_ROUNDS):
        last_distance = best.distance
        for u in starts:
            best = run(u, best)
        if not best.u.size:
            break
        crossings = find_crossings_on_segment(base, best.u, edge.is_real)
        starts = [c.u for c in crossings if (c.edge, c.sign) == (edge.name, sign)]
        if (
            edge.name == "real" and best.distance < last_distance
        ):  # no ray leads there, and similar starts end at the same point
            starts += draw_points(base, best.distance, round_number)
        if not starts:
            break
    return best
