"""Eigenvalues along a loop around exceptional points: how they exchange, and their geometric phases."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from tmsopt.algebra.sequence import golden_steps
from tmsopt.chains import family_of, find_point, targets_of
from tmsopt.errors import MOST_STARTS, Fault, InputError, callback_faults, count_faults, input_error, is_number, short
from tmsopt.problem import NotSolved, Problem, ProblemSource, units_of
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Array, Complex, Printable, Table, plain
from tmsopt.spectra.path import Path, follow, wrap
from tmsopt.spectra.plane import ParameterPlane, plane_of, split_complex

POINTS = 64
"""Default number of points of a loop, before it is divided."""

STARTS = 16
"""Default number of starts of the search for exceptional points inside a loop."""

_POINTS_RANGE = (8, 10_000)
_MIN_RADIUS = 1e-8  # least radius, as a share of the largest parameter: rounding deforms smaller circles
_SAME_POINT = 1e-3  # two points are one if their distance is below this share of the radius
_SAME_VALUE = 1e-2  # and if their eigenvalues differ by less than this share of the spread of all eigenvalues
_SMALL_LOOP = 1e-2  # largest radius of the loop around a single point, in radii
_ROUNDING = 1e-8  # a phase of −π, up to this angle, is π


@dataclass(frozen=True)
class Cycle:
    """Eigenvalues that exchange along a loop.

    Attributes:
        members: their numbers; each becomes the next, and the last one becomes the first.
        phase: Re γ of the geometric phase γ = i ∮ y dx, with left and right eigenvectors y x = 1, after as many turns
            as there are members; from −π to π.
        phase_imaginary: Im γ. The factor exp(i γ) of an eigenvector has the size exp(−Im γ).

    Example:
        >>> (pair,) = tmsopt.encircle("problems/loss_only_dimer.toml").cycles
        >>> pair.members, pair.turns, f"{pair.phase:.9f}"
        ((0, 1), 2, '3.141592654')

    More: docs/how_to/encircle.md
    """

    members: tuple[int, ...]
    phase: float
    phase_imaginary: float

    @property
    def turns(self) -> int:
        """Number of turns after which each member is itself again."""
        return len(self.members)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        return plain(self, "members turns phase phase_imaginary")


@dataclass(frozen=True)
class EnclosedPoint:
    """An exceptional point inside a loop.

    Attributes:
        parameters: values of the two parameters.
        eigenvalue: the multiple eigenvalue: ω for a complex system, otherwise s.
        name: ``EP2`` for two eigenvalues, or ``CEP2`` for two complex pairs of real matrices.
        order: how many eigenvalues coincide.
        winding: its part of the winding number of the loop; None if it lies on a curve of such points.

    Example:
        >>> (point,) = tmsopt.encircle("problems/loss_only_dimer.toml").inside
        >>> f"{point.parameters['k']:.6f}", f"{point.eigenvalue.imag:.6f}", point.name, point.winding
        ('0.400000', '-0.600000', 'EP2', 1)

    More: docs/how_to/encircle.md
    """

    parameters: Table[float]
    eigenvalue: complex
    name: str
    order: int
    winding: int | None


@dataclass(frozen=True, repr=False)
class Loop(Printable):
    """Eigenvalues along a circle in the plane of two parameters, the result of `encircle`.

    Attributes:
        problem: the problem in which only these two parameters are free.
        parameters: every parameter at the centre.
        radius: radius of the circle in SI units and rad, or in the model's own units.
        angles: angles along the circle, from 0 to 2π.
        eigenvalues: ω for a complex system, numbered by their real parts; otherwise s with Im s >= 0, numbered from the
            right to the left. A row for each angle; each column is continuous.
        permutation: eigenvalue k becomes eigenvalue permutation[k] after one turn.
        cycles: the cycles of the permutation, with their phases.
        winding: winding number of the discriminant of these eigenvalues. It is the sum over all exceptional points
            inside. An EP2 adds 1 or −1.
        inside: the exceptional points inside that a search found.

    Example:
        >>> loop = tmsopt.encircle("problems/pt_trimer.toml", 0.1, plane=("d1", "gain"))  # around an EP3
        >>> loop.cycles[0].turns, loop.winding, [point.order for point in loop.inside]
        (3, 2, [3])

    More: docs/how_to/encircle.md
    """

    problem: Problem
    parameters: Table[float]
    radius: float
    angles: Array = field(repr=False)
    eigenvalues: Complex = field(repr=False)
    permutation: tuple[int, ...]
    cycles: tuple[Cycle, ...]
    winding: int
    inside: tuple[EnclosedPoint, ...]

    @property
    def plane(self) -> tuple[str, ...]:
        """Names of the two parameters, the horizontal one first."""
        return tuple(self.problem.free)

    @property
    def is_complete(self) -> bool:
        """Whether the winding numbers of the points inside add up to that of the loop."""
        return sum(point.winding or 0 for point in self.inside) == self.winding

    @property
    def phase(self) -> float | None:
        """The phase of the first cycle with several members; None if no eigenvalues exchange."""
        return next((cycle.phase for cycle in self.cycles if cycle.turns > 1), None)

    def to_json(self) -> dict[str, Any]:
        """The JSON of `tmsopt encircle`."""
        letter = "omega" if self.problem.model.is_complex else "root"
        inside = [
            plain(p, "parameters name order winding") | {letter: split_complex(p.eigenvalue)} for p in self.inside
        ]
        return {
            **self.problem.posed.heading,
            "plane": list(self.plane),
            "units": units_of(self.problem.posed),
            **plain(self, "parameters radius permutation phase cycles winding"),
            "inside": inside,
            "complete": self.is_complete,
            "start": [split_complex(z) for z in self.eigenvalues[0].tolist()],
        }


def encircle(
    problem: ProblemSource,
    radius: float = 0.1,
    *,
    centre: Mapping[str, float] | None = None,
    plane: Sequence[str] | None = None,
    points: int = POINTS,
    starts: int = STARTS,
    progress: Listener | None = None,
) -> Loop:
    """Follow the eigenvalues of a system with matrices along a circle in the plane of two free parameters.

    The circle is x = x0 + r cos t, y = y0 + r sin t, counterclockwise. All numbers are in SI units and rad, or in the
    model's own units. If the problem locates a pattern, the centre is the solution. Otherwise it is the start or the
    middle of the ranges. The circle may leave the ranges.

    Args:
        problem: a problem, its file, or a solution.
        radius: r.
        centre: other values for some of the free parameters.
        plane: names of the parameters x and y; by default the first two that are free. Other free parameters keep their
            values at the centre.
        points: number of points at first. Steps are halved until every eigenvalue moves by less than a third of its
            distance from the others, and its eigenvectors change little.
        starts: number of starts of the search for exceptional points inside.
        progress: called with a `tmsopt.Progress` now and then.

    Raises:
        InputError: for a model without matrices, fewer than two free parameters or bad arguments, or if two eigenvalues
            coincide on the circle.
        NotSolved: if the pattern of the problem is not found.

    Example:
        >>> loop = tmsopt.encircle("problems/loss_only_dimer.toml")
        >>> loop.permutation, f"{loop.phase:.9f}"  # the eigenfrequencies exchange; two turns give π
        ((1, 0), '3.141592654')

    More: docs/how_to/encircle.md
    """
    faults = count_faults("points", points, *_POINTS_RANGE) + count_faults("starts", starts, 0, MOST_STARTS)
    faults += callback_faults("progress", progress)
    if not is_number(radius) or radius <= 0:
        faults.append(Fault(f"found {short(radius)}; accepted: a positive number", ("radius",)))
    base = plane_of(problem, "plane", plane, centre, progress, faults)
    if base.solution and base.solution.status != "optimal":
        raise NotSolved(base.solution)
    if radius < (least := _MIN_RADIUS * np.abs(base.centre).max()):
        raise input_error(f"found {radius:.3g}; accepted: {least:.3g} or more, because of rounding", "radius")
    path = follow(base, base.centre, radius, points)
    size = float(np.abs(path.values - path.values.mean()).max())
    start_steps(progress, "searching inside the loop")
    return Loop(
        base.problem.problem,
        base.design,
        radius,
        path.angles,
        path.values,
        path.permutation,
        tuple(_list_cycles(path)),
        path.count_windings(),
        tuple(_find_inside(base, radius, points, starts, size)),
    )


def _list_cycles(path: Path) -> Iterator[Cycle]:
    remaining = dict(enumerate(path.permutation))
    while remaining:
        members = [min(remaining)]
        while (following := remaining.pop(members[-1])) in remaining:
            members.append(following)
        logs = complex(wrap(path.logs[members].sum()))
        yield Cycle(tuple(members), -logs.imag + 2 * math.pi * (-logs.imag < _ROUNDING - math.pi), logs.real)


def _find_inside(
    plane: ParameterPlane, radius: float, points: int, starts: int, size: float
) -> Iterator[EnclosedPoint]:
    """The exceptional points inside a loop.

    Args:
        size: spread of the eigenvalues.
    """
    found = list[tuple[Array, complex, int]]()
    for p, value, order in _search(plane, radius, starts):
        if not any(
            _distance(p, q) <= _SAME_POINT * radius and abs(value - z) <= _SAME_VALUE * size for q, z, _ in found
        ):
            found.append((p, value, order))
    for p, value, order in found:
        distances = [x for q, *_ in found if (x := _distance(p, q)) > _SAME_POINT * radius]
        try:
            path = follow(plane, p, min([_SMALL_LOOP * radius, *(x / 2 for x in distances)]), points)
            winding = path.count_windings(np.argsort(np.abs(path.values[0] - value))[:order])
        except InputError:  # eigenvalues coincide around the point too
            winding = None
        name = f"{'' if plane.problem.model.is_complex or not value.imag else 'C'}EP{order}"
        yield EnclosedPoint(Table(plane.name_values(p)), value, name, order, winding)


def _distance(p: Array, q: Array) -> float:
    return float(np.linalg.norm(p - q))


def _search(plane: ParameterPlane, radius: float, starts: int) -> Iterator[tuple[Array, complex, int]]:
    """Parameters, eigenvalue and order of the points that starts in the circle reach inside it, some several times."""
    box = plane.centre[:, None] + radius * np.array([-1.0, 1.0])
    family, rng = replace(family_of(plane.problem), box=box), np.random.default_rng(0)
    names = [plane.problem.locate or "", "EP2", "" if family.is_complex else "CEP2"]
    patterns = {n: targets_of(n, family.is_complex) for n in names if "EP" in n or n == "resonance"}
    share, turn = ((0.5 + np.arange(starts)[:, None] * golden_steps(2)) % 1.0).T
    disc = radius * np.sqrt(share) * np.exp(2j * np.pi * turn)
    for k, shift in enumerate([0j, *disc]):
        for name, targets in [*patterns.items()]:
            start = plane.centre + np.array([shift.real, shift.imag])
            point = find_point(family, targets, start, rng if k % 2 else None)
            if point and point.is_found and _distance(point.p, plane.centre) < radius:
                if sum(target.conditions(family.is_complex) for target in targets) < 2:
                    del patterns[name]  # these points form curves, and one point is enough
                chains = (chain for chain in point.chains if chain.order > 1)
                yield from ((point.p, complex(plane.user_values(np.array(c.s))), c.order) for c in chains)
