"""The domains of asymptotic stability and of heavy damping in a plane, bounded by exact curves.

Each arc of a boundary is a traced root pattern, not a contour of a grid. The arc ends where the other roots stop being
left of the imaginary axis, or stop being real.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tmsopt.models.user_spectrum import pattern_of
from tmsopt.problem.files import ProblemSource, pose
from tmsopt.problem.problem import Posed
from tmsopt.problem.real_form import real_form
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Array, Printable, Truth, plain
from tmsopt.roots import is_stable, real_roots
from tmsopt.roots.sign_tests import nearest_pair_mean
from tmsopt.tracing.branch import Branch, table_at
from tmsopt.tracing.continuation import INFINITE, SINGULAR
from tmsopt.tracing.equations import compute_coefficients
from tmsopt.tracing.infinity import InfinityCurve, find_infinity_curves
from tmsopt.tracing.points import is_on_axis, roots_along
from tmsopt.tracing.trace import STARTS, STEP, trace

_CORNER_DISTANCE = 5e-3
"""Largest distance, in widths of the box, from an end at infinity or a singular end to its corner."""

_EDGE_DISTANCE = 1e-9  # largest distance, in widths of the box, of a branch from an edge along which it runs

_SIDE_OFFSET = 1e-4  # distance, in widths of the box, from a curve to the designs that test its two sides


@dataclass(frozen=True)
class Arc:
    """A smooth part of a boundary.

    Attributes:
        kind: root pattern on the arc: ``weave``, ``capsize``, ``infinity`` (a root passes through infinity), ``EP2``.
        points: name of a free parameter → values along the arc.
    """

    kind: str
    points: dict[str, Array]


@dataclass(frozen=True)
class Corner:
    """A point where arcs of a boundary meet or turn back: ``EP3`` is a cusp, ``2EP2`` is a crossing.

    At ``infinity and weave`` a weave boundary meets the curve a0 = 0. At ``infinity`` two roots go to infinity.
    """

    name: str
    detail: str
    parameters: Mapping[str, float]


@dataclass(frozen=True, repr=False)
class Domain(Printable):
    """Boundaries inside a box. They end at the edges of the box. A boundary that runs along an edge is left out.

    Attributes:
        stability: arcs that bound asymptotic stability.
        heavy_damping: arcs that bound the designs whose roots are all real and negative.
        parting: arcs that separate capsize from weave among the unstable designs. There, two positive real roots merge,
            or one real root passes 0 or infinity, and no other root is real and positive.
        corners: corners of the first two boundaries.

    Example:
        >>> (corner,) = tmsopt.domain("problems/chart.toml").corners  # the tip of heavy damping, by the paper's law
        >>> corner.name, f"{corner.parameters['Fr']:.6f}", f"{tmsopt.laws.frep4(-0.4, -0.2)[0]:.6f}"
        ('EP4', '2.236318', '2.236318')

    More: docs/how_to/charts.md
    """

    stability: tuple[Arc, ...]
    heavy_damping: tuple[Arc, ...]
    parting: tuple[Arc, ...]
    corners: tuple[Corner, ...]

    def to_json(self) -> dict[str, Any]:
        """Arcs as columns of their parameters."""
        corners = [{"name": c.name, "detail": c.detail, **c.parameters} for c in self.corners]
        return plain(self, "stability heavy_damping parting") | {"corners": corners}


def domain(
    problem: ProblemSource, *, step: float = STEP, starts: int = STARTS, seed: int = 0, progress: Listener | None = None
) -> Domain:
    """Boundaries of stability and of heavy damping in the plane of the two free parameters.

    Constraints of the problem are ignored. `step`, `starts`, `seed` and `progress` are as in `trace`.

    Example:
        >>> swing = tmsopt.models.from_coefficients([1, "c", "k"])  # heavily damped beyond the parabola c² = 4 k
        >>> (arc,) = tmsopt.domain(tmsopt.Problem(swing, free={"c": (0.1, 2), "k": (0.1, 1)})).heavy_damping
        >>> bool(abs(arc.points["c"] ** 2 - 4 * arc.points["k"]).max() < 1e-12)
        True

    More: docs/how_to/charts.md
    """
    form = real_form(pose(problem))
    plane = form.problem.derive(constraints={}, minimize=None, maximize=None, locate=None)
    pattern_names = ("weave", "capsize", "EP2") if form.carrier is None else ("weave",)
    traces = (trace(plane, name, step=step, starts=starts, seed=seed, progress=progress) for name in pattern_names)
    branches_of = {t.pattern: [b for b in t.branches if not _lies_along_edge(b, plane)] for t in traces}
    start_steps(progress, "looking for corners")
    infinity_curves = list(find_infinity_curves(plane, step, starts, seed))
    infinity_corners = [c for curve in infinity_curves for c in _list_changes(curve)]

    def arcs(names: Sequence[str], find_bounds: Callable[[Branch], Truth], attribute: str) -> tuple[Arc, ...]:
        pattern_arcs = (
            arc
            for n in names
            for b in branches_of.get(n, ())
            for arc in _cut_arcs(b, find_bounds(b), plane, infinity_corners)
        )
        runs = ((curve.parameters, run) for curve in infinity_curves for run in _find_runs(getattr(curve, attribute)))
        infinity_arcs = (Arc("infinity", {n: x[start : stop + 1] for n, x in p.items()}) for p, (start, stop) in runs)
        return (*pattern_arcs, *infinity_arcs)

    corners = [c for branches in branches_of.values() for b in branches for c in _list_corners(b, plane)]
    corners += [c for curve in infinity_curves for c in _list_changes(curve, only_corners=True)]
    return Domain(
        stability=arcs(("weave", "capsize"), lambda b: _bounds_stability(b, plane), "stable"),
        heavy_damping=arcs(
            ("EP2", "capsize"), lambda b: b.heavily_damped & _has_larger_double_root(b), "heavily_damped"
        ),
        parting=arcs(("EP2", "capsize"), _parts_instabilities, "parting"),
        corners=tuple(_merge_corners(corners)),
    )


def _lies_along_edge(branch: Branch, problem: Posed) -> bool:
    """Whether a branch runs along an edge of the box. The edge bounds the domain anyway."""
    limits = ((branch.parameters[n], limit, np.ptp(ends)) for n, ends in problem.free.items() for limit in ends)
    return any(np.abs(column - limit).max() <= _EDGE_DISTANCE * width for column, limit, width in limits)


def _find_runs(is_inside: Truth) -> list[list[int]]:
    """For each run of true values: its first index, and the index after its last value."""
    runs: list[list[int]] = np.flatnonzero(np.diff(is_inside.astype(int), prepend=0, append=0)).reshape(-1, 2).tolist()
    return runs


def _list_changes(curve: InfinityCurve, only_corners: bool = False) -> Iterator[Corner]:
    """Points where another boundary meets the curve a0 = 0.

    Args:
        only_corners: list only the points where a boundary of stability or of heavy damping changes.
    """
    for row, event in curve.changes.items():
        if not only_corners or any(b[row - 1] != b[row] for b in (curve.stable, curve.heavily_damped)):
            name, detail = (f"infinity and {event}", "a0 = 0") if event != "infinity" else ("infinity", "a0 = a1 = 0")
            yield Corner(name, detail, table_at(curve.parameters, row))


def _cut_arcs(branch: Branch, is_inside: Truth, problem: Posed, infinity_corners: Sequence[Corner]) -> Iterator[Arc]:
    """An arc for each run of points that bound a domain, with the events and the corners at infinity at its ends."""
    is_bound, corner_at = is_inside.copy(), dict[int, Corner]()
    for event in branch.events:
        k = event.index
        if event.name != "end":
            is_bound[k] = bool(is_inside[max(k - 1, 0)] or is_inside[min(k + 1, len(branch) - 1)])
        elif event.detail.startswith((INFINITE, SINGULAR)) and infinity_corners:
            parameters, widths = event.parameters, {n: high - low for n, (low, high) in problem.free.items()}
            distances = [
                max(abs(parameters[n] - c.parameters[n]) / w for n, w in widths.items()) for c in infinity_corners
            ]
            if min(distances) <= _CORNER_DISTANCE:
                corner_at[k] = infinity_corners[int(np.argmin(distances))]
    for start, stop in _find_runs(is_bound):
        if stop - start > 1:
            first_corner, last_corner = ([corner_at[k].parameters] if k in corner_at else [] for k in (start, stop - 1))
            columns = {n: [p[n] for p in first_corner] + [*branch.parameters[n][start:stop]] for n in problem.free}
            yield Arc(branch.pattern, {n: np.array(c + [p[n] for p in last_corner]) for n, c in columns.items()})


def _bounds_stability(branch: Branch, problem: Posed) -> Truth:
    """Where the other roots are stable, or are on the axis and the designs on exactly one side are stable.

    If several pairs are on the axis along several curves, only the curve of the fastest pair counts.
    """
    other_factors = pattern_of(problem.model, branch.pattern).remaining_factors(list(branch.unknowns.values()))
    z = roots_along(other_factors, len(branch))
    # squared frequency of the fastest pair on the axis
    squared_frequency = np.where(is_on_axis(z), np.abs(z) ** 2, -1.0).max(axis=-1, initial=-1.0)
    if np.all(squared_frequency < 0):
        return branch.stable
    (x, dx, x_width), (y, dy, y_width) = (
        (branch.parameters[n], branch.tangent[n] / (high - low), high - low) for n, (low, high) in problem.free.items()
    )
    offset = np.array([[-_SIDE_OFFSET], [_SIDE_OFFSET]]) / (np.hypot(dx, dy) + 1e-300)
    side_designs = dict(zip(problem.free, (x - offset * x_width * dy, y + offset * y_width * dx), strict=True))
    with np.errstate(all="ignore"):  # nan, outside the range of the model, is not stable
        stable_on_left, stable_on_right = is_stable(compute_coefficients(problem, side_designs))
    is_fastest = (squared_frequency >= 0) & (branch.unknowns.get("W", np.inf) >= squared_frequency)
    return np.asarray(branch.stable | (is_fastest & (stable_on_left != stable_on_right)))


def _parts_instabilities(branch: Branch) -> Truth:
    """Where both sides are unstable, and exactly one side has a positive real root."""
    other_factor = _find_other_factor(branch)
    is_parting = branch.unknowns["r"] > 0 if branch.pattern == "EP2" else ~branch.stable
    if len(other_factor) > 1:
        _, positive_count = real_roots(np.stack(other_factor, axis=-1)[is_parting])
        is_parting[is_parting] = positive_count == 0
    return is_parting


def _find_other_factor(branch: Branch) -> list[Any]:
    """Along a curve of double roots or of roots 0, the factor of the other roots; [1] without other roots."""
    return [np.ones(len(branch)), *(column for name, column in branch.unknowns.items() if name != "r")]


def _has_larger_double_root(branch: Branch) -> Truth:
    """Where r is the larger of two double roots. With the smaller one as r, the same curve would be drawn twice."""
    if not np.any(branch.kinds == "2EP2"):
        return np.ones(len(branch), dtype=bool)
    r, second_root = branch.unknowns["r"], nearest_pair_mean(_find_other_factor(branch))
    return np.asarray((branch.kinds != "2EP2") | (r - second_root >= -1e-12 * np.abs(second_root)))


def _list_corners(branch: Branch, problem: Posed) -> Iterator[Corner]:
    """Events where a boundary of a domain turns, crosses another boundary or ends inside the box."""
    is_inside = branch.heavily_damped if branch.pattern == "EP2" else branch.stable
    ends = pattern_of(problem.model, branch.pattern).ends.values()
    for event in branch.events:
        is_corner = event.detail in ends if event.name == "end" else event.name not in ("fold", "constraint")
        if is_corner and np.any(is_inside[max(event.index - 1, 0) : event.index + 2]):
            name = "double zero" if event.name == "end" else event.name
            yield Corner(name, event.detail, {n: event.parameters[n] for n in problem.free})


def _merge_corners(corners: Sequence[Corner]) -> list[Corner]:
    """Each corner once, with all its names. For example, a weave arc and a capsize arc may have the same corner."""
    merged_corners: list[Corner] = []
    for corner in corners:
        for k, earlier in enumerate(merged_corners):
            if np.allclose(list(corner.parameters.values()), list(earlier.parameters.values()), rtol=1e-7, atol=1e-9):
                names = dict.fromkeys([*earlier.name.split(" and "), *corner.name.split(" and ")])
                merged_corners[k] = replace(earlier, name=" and ".join(names))
                break
        else:
            merged_corners.append(corner)
    return merged_corners
