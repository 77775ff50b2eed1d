"""The domains of asymptotic stability and of heavy damping in a plane, bounded by exact curves.

A boundary is not read off a grid: each arc is a traced root pattern, cut where the other roots cease to be left of
the imaginary axis, or real.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from tmsopt.design.problem import Problem
from tmsopt.design.starts import spread
from tmsopt.models import Values
from tmsopt.roots import is_stable
from tmsopt.study.branch import Branch, Event
from tmsopt.study.continuation import Walk, both_ways, contains, curve, project
from tmsopt.study.trace import STARTS, STEP, trace

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Arc:
    """A piece of a boundary.

    Attributes:
        kind: root pattern on it: ``weave``, ``capsize``, ``infinity`` (a root passes through infinity), ``EP2``.
        points: name of a free parameter → values along the arc.
    """

    kind: str
    points: dict[str, Array]


@dataclass(frozen=True)
class Corner:
    """A point where arcs of a boundary meet or turn back: ``EP3`` is a cusp, ``2EP2`` a crossing."""

    name: str
    detail: str
    parameters: dict[str, float]


@dataclass(frozen=True)
class Domain:
    """Boundaries inside a box; where a domain leaves the box, its boundary ends at the edge.

    Attributes:
        stability: arcs that bound asymptotic stability.
        heavy_damping: arcs that bound the designs whose roots are all real and negative.
        merging: arcs on which two positive real roots merge, between capsize and weave.
        corners: of the first two boundaries.
    """

    stability: tuple[Arc, ...]
    heavy_damping: tuple[Arc, ...]
    merging: tuple[Arc, ...]
    corners: tuple[Corner, ...]

    def to_json(self) -> dict[str, Any]:
        """Arcs as columns of their parameters."""
        return {
            name: [{"kind": arc.kind, "points": {n: c.tolist() for n, c in arc.points.items()}} for arc in arcs]
            for name, arcs in (
                ("stability", self.stability),
                ("heavy_damping", self.heavy_damping),
                ("merging", self.merging),
            )
        } | {"corners": [{"name": c.name, "detail": c.detail, **c.parameters} for c in self.corners]}


def domain(problem: Problem, *, step: float = STEP, starts: int = STARTS, seed: int = 0) -> Domain:
    """Boundaries of stability and of heavy damping in the plane of the two free parameters.

    Constraints of the problem are left aside. `step`, `starts` and `seed` are those of `trace`.
    """
    plane = replace(problem, constraints={}, minimize=None, maximize=None, locate=None)
    found = {
        name: trace(plane, name, step=step, starts=starts, seed=seed).branches for name in ("weave", "capsize", "EP2")
    }
    unstable_beyond = [b for name in ("weave", "capsize") for b in found[name]]
    infinite = list(_through_infinity(plane, step, starts, seed))
    stability = [arc for b in unstable_beyond for arc in _pieces(b, b.stable, plane)]
    damping = [arc for b in found["EP2"] for arc in _pieces(b, b.heavily_damped & _once(b), plane)]
    damping += [arc for b in found["capsize"] for arc in _pieces(b, b.heavily_damped, plane)]
    stability += infinite
    merging = [arc for b in found["EP2"] for arc in _pieces(b, b.unknowns["r"] > 0, plane)]
    corners = [c for b in (*unstable_beyond, *found["EP2"]) for c in _corners(b, b.stable, b.heavily_damped, plane)]
    return Domain(tuple(stability), tuple(damping), tuple(merging), tuple(_distinct(corners)))


def _pieces(branch: Branch, inside: NDArray[np.bool_], problem: Problem) -> Iterator[Arc]:
    """Runs of points that bound a domain; the events at their ends belong to them."""
    marked = inside.copy()
    for event in branch.events:
        k = event.index
        if event.name != "end":
            marked[k] = bool(inside[max(k - 1, 0)] or inside[min(k + 1, len(branch) - 1)])
    edges = np.flatnonzero(np.diff(np.concatenate([[0], marked.astype(int), [0]])))
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        if stop - start > 1:
            yield Arc(branch.pattern, {n: branch.parameters[n][start:stop] for n in problem.free})


def _once(branch: Branch) -> NDArray[np.bool_]:
    """Where a curve of two double roots is met by the larger of them: the other draws the same curve again."""
    r, b = branch.unknowns["r"], branch.unknowns["b"]
    return np.asarray((branch.kinds != "2EP2") | (2 * r + b >= -1e-12 * np.abs(b)))


def _corners(
    branch: Branch, stable: NDArray[np.bool_], damped: NDArray[np.bool_], problem: Problem
) -> Iterator[Corner]:
    """Events where a boundary of a domain turns, crosses another or ends inside the box."""
    inside = damped if branch.pattern == "EP2" else stable
    for event in branch.events:
        k = event.index
        near = inside[max(k - 1, 0)] or inside[min(k + 1, len(branch) - 1)]
        if near and _turns(branch, event):
            name = "double zero" if event.name == "end" else event.name
            yield Corner(name, event.detail, {n: event.parameters[n] for n in problem.free})


def _turns(branch: Branch, event: Event) -> bool:
    if event.name == "end":
        return not event.detail.endswith((".min", ".max")) and "0" in event.detail and branch.pattern == "weave"
    return event.name in ("EP4", "EP3", "2EP2", "double zero", "weave", "capsize")


def _distinct(corners: list[Corner]) -> list[Corner]:
    """Each place once, with every name it has: where a weave arc meets a capsize arc, both end there."""
    found: list[Corner] = []
    for corner in corners:
        for k, other in enumerate(found):
            if np.allclose(list(corner.parameters.values()), list(other.parameters.values()), rtol=1e-7, atol=1e-9):
                names = dict.fromkeys([*other.name.split(" and "), corner.name])
                found[k] = replace(other, name=" and ".join(names))
                break
        else:
            found.append(corner)
    return found


def _through_infinity(problem: Problem, step: float, starts: int, seed: int) -> Iterator[Arc]:
    """Curves a0 = 0 on which the other roots are stable: there a root goes through infinity, from side to side."""
    x = ca.SX.sym("x", 2)
    of = problem.parameter_set
    symbols = {n: ca.atan(x[k]) if of[n].tangent else x[k] for k, n in enumerate(problem.free)}
    a = Values(problem.model, of, problem.ordered(symbols)).coefficients
    if not ca.SX(a[0]).is_constant() and ca.depends_on(a[0], x):
        ends = [[np.tan(e) if of[n].tangent else e for e in problem.free[n]] for n in problem.free]
        lower, upper = np.array(ends).T
        on = curve(x, ca.SX(a[0]), upper - lower, lower, upper)
        rest = ca.Function("rest", [x], [ca.vertcat(*a[1:])])
        walks: list[Walk] = []
        for count, design in zip(range(starts), spread(problem, seed), strict=False):
            start = np.array([np.tan(v) if of[n].tangent else v for n, v in design.items()]) / on.scale
            y = project(on.evaluate, start, held=count % 2)
            if (
                y is None
                or np.any(y < on.lower)
                or np.any(y > on.upper)
                or any(contains(on, w, y, step) for w in walks)
            ):
                continue
            walked = both_ways(on, y, step, 10**6)
            if walked is None:
                continue
            walks.append(walked)
            points = walked.y * on.scale
            c = np.array(rest.map(len(points))(points.T)).T
            stable = np.zeros(len(points), dtype=bool)
            proper = c[:, 0] != 0
            stable[proper] = is_stable(c[proper])
            columns = {n: np.arctan(v) if of[n].tangent else v for n, v in zip(problem.free, points.T, strict=True)}
            edges = np.flatnonzero(np.diff(np.concatenate([[0], stable.astype(int), [0]])))
            for first, last in zip(edges[::2], edges[1::2], strict=True):
                yield Arc("infinity", {n: v[first:last] for n, v in columns.items()})
