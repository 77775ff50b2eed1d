"""The discriminant surface around an EP4: a swallowtail, parametrised by its double root and cut along its edges.

In two of the parameters, here chi_B and T = tan λ_s, the coefficients are affine. A double root r at a given value of
the third, Fr, is then two linear equations p(r) = p′(r) = 0, so (Fr, r) parametrises the whole surface. It turns back
where the root is triple (EP3) and meets itself where a second pair is double (2EP2); cut there, every patch is smooth.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np
from scipy.optimize import brentq

from tmsopt.errors import Fault, InputError
from tmsopt.problem.files import Given, pose
from tmsopt.problem.problem import Posed, Problem
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Array, Printable, plain
from tmsopt.roots import determinant, is_stable, real_roots
from tmsopt.tracing.branch import Trace
from tmsopt.tracing.equations import Traced, prepare
from tmsopt.tracing.solving import project
from tmsopt.tracing.trace import STARTS, trace

Cut = tuple[float, str]

_LEAST = 4  # degree

_SCAN = 2000
_BESIDE = np.array([1e-7, 4e-5, 1e-4, 1e-3, 4e-3, 0.012])
_AROUND = np.concatenate([-_BESIDE[::-1], _BESIDE])
"""Rows on either side of a value of Fr where the number of edges changes."""


@dataclass(frozen=True)
class Patch:
    """A smooth piece of the surface, arrays of shape (rows, columns): a row has one Fr, a column one share of r.

    Attributes:
        points: name of a free parameter → its values.
        r: the double root.
        heavily_damped: whether the piece bounds the heavily damped designs.
    """

    points: dict[str, Array]
    r: Array
    heavily_damped: bool


@dataclass(frozen=True, repr=False)
class Swallowtail(Printable):
    """The surface with its edges.

    Attributes:
        axes: the three free parameters; rows of patches have one value of the first.
        cusps: traced EP3 curves, the cuspidal edges.
        crossing: the traced EP set, 2EP2 on the self-intersection of the surface and CEP2 beyond it.

    Example:
        >>> surface = tmsopt.swallowtail("problems/ep_set.toml", rows=4, across=4, starts=8)
        >>> surface.cusps.pattern, surface.crossing.pattern
        ('EP3', '2EP2')

    More: docs/how_to/tracing.md
    """

    problem: Problem
    axes: tuple[str, str, str]
    patches: tuple[Patch, ...]
    cusps: Trace
    crossing: Trace

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``: patches as rows of their points, edges as traces."""
        return self.problem.posed.heading | plain(self, "axes patches cusps crossing")


def swallowtail(
    problem: Given, rows: int = 48, across: int = 24, starts: int = STARTS, *, progress: Listener | None = None
) -> Swallowtail:
    """The surface of real negative double roots in the box of three free parameters: one, and an affine pair.

    Args:
        problem: with Fr, chi_B and lambda_s free, or three parameters of another model of which the coefficients
            are affine in the last two (their tangents, for angles).
        rows, across: points along the first parameter, and along r between two edges.
        starts: of the traces of its edges; see `trace`.
        progress: called with a `tmsopt.Progress` now and then.

    Raises:
        InputError: for another number of free parameters, coefficients that are not affine in two of them, or a
            model of degree 2 or 3, whose roots cannot meet two by two.

    Example:
        >>> surface = tmsopt.swallowtail("problems/ep_set.toml", rows=4, across=4, starts=8)
        >>> [f"{event.parameters['chi_B']:.6f}" for event in surface.crossing.events if event.name == "EP4"]  # √2
        ['1.414214']

    More: docs/how_to/tracing.md
    """
    problem = pose(problem)
    if problem.model.degree < _LEAST:
        message = (
            f"model '{problem.model.name}' has degree {problem.model.degree}; accepted: {_LEAST} or more, for a "
            "swallowtail crosses itself where two double roots stand side by side; trace EP2 and EP3 instead"
        )
        raise InputError([Fault(message, ("model",))])
    if len(problem.free) != 3:
        message = f"a surface takes three free parameters, and {len(problem.free)} are free"
        raise InputError([Fault(message, ("parameters",))])
    plain = problem.derive(constraints={}, minimize=None, maximize=None, locate=None)
    names = list(plain.free)
    axes = (names[0], names[1], names[2])
    affine = _Affine(plain, axes)
    cusps = trace(plain, "EP3", starts=starts, progress=progress)
    crossing = trace(plain, "2EP2", starts=starts, progress=progress)
    events = [*cusps.events, *crossing.events]
    # The number of edges in a row changes at EP4, and at folds of the edges.
    changes = [e for e in events if e.name == "EP4" or (e.name == "fold" and axes[0] in e.detail)]
    low, high = plain.free[axes[0]]
    grid = np.unique(
        np.concatenate([np.linspace(low, high, rows), *(e.parameters[axes[0]] + _AROUND for e in changes)])
    )
    grid = grid[(grid >= low) & (grid <= high)]
    ready, cuts, steps = prepare(crossing.problem.posed), [], start_steps(progress, "cutting the surface", "row")
    for done, value in enumerate(grid, 1):
        cuts.append(_cuts(affine, float(value), crossing, ready))
        if steps:
            steps(done, len(grid))
    patches = []
    # Neighbouring rows with the same cuts in the same order belong to one set of patches.
    for _, run in groupby(range(len(grid)), key=lambda k: [[kind for _, kind in interval] for interval in cuts[k]]):
        inside = list(run)
        if len(inside) < 2:
            continue
        for interval in range(len(cuts[inside[0]])):
            table = np.array([[r for r, _ in cuts[k][interval]] for k in inside])
            patches += [
                _patch(affine, grid[inside], left, right, across)
                for left, right in zip(table.T[:-1], table.T[1:], strict=True)
            ]
    return Swallowtail(plain.problem, axes, tuple(patches), cusps, crossing)


class _Affine:
    """Coefficients p = A + x B + y C in the affine pair (x, y), at a value of the first parameter."""

    def __init__(self, problem: Posed, axes: Sequence[str]) -> None:
        self.problem, self.axes = problem, axes
        self._is_affine()

    def at(self, first: float) -> tuple[Array, Array, Array]:
        constant = self._coefficients(first, 0.0, 0.0)
        return constant, self._coefficients(first, 1.0, 0.0) - constant, self._coefficients(first, 0.0, 1.0) - constant

    def limits(self) -> Array:
        """Least and greatest x and y, shape (2, 2)."""
        of = self.problem.parameter_set
        ends = (self.problem.free[n] for n in self.axes[1:])
        return np.array([np.tan(e) if of[n].tangent else e for n, e in zip(self.axes[1:], ends, strict=True)])

    def natural(self, x: Array, y: Array) -> tuple[Array, Array]:
        of = self.problem.parameter_set
        x, y = (np.arctan(v) if of[n].tangent else v for n, v in zip(self.axes[1:], (x, y), strict=True))
        return x, y

    def _coefficients(self, first: float, x: float, y: float) -> Array:
        values = dict(zip(self.axes, (first, *(float(v) for v in self.natural(np.array(x), np.array(y)))), strict=True))
        a = self.problem.model.coefficients(self.problem.ordered(values), self.problem.parameter_set)
        return np.array([float(c) for c in a])

    def _is_affine(self) -> None:
        first = float(np.mean(self.problem.free[self.axes[0]]))
        A, B, C = self.at(first)
        for x, y in ((2.0, 3.0), (-1.0, 0.5)):
            predicted = A + x * B + y * C
            leeway = 1e-9 * np.abs(predicted).max()
            if not np.allclose(self._coefficients(first, x, y), predicted, rtol=1e-9, atol=leeway):
                pair = " and ".join(self.axes[1:])
                message = f"the coefficients are not affine in {pair}; put two in which they are last"
                raise InputError([Fault(message, ("parameters",))])


def _on_surface(parts: tuple[Array, Array, Array], r: Array) -> tuple[Array, Array]:
    """x and y for which r is a double root: p(r) = p′(r) = 0 by Cramer's rule."""
    (A, B, C), (dA, dB, dC) = ([np.polyval(p, r) for p in parts], [np.polyval(np.polyder(p), r) for p in parts])
    with np.errstate(all="ignore"):
        size = B * dC - C * dB
        return (C * dA - A * dC) / size, (A * dB - B * dA) / size


def _cuts(affine: _Affine, first: float, crossing: Trace, ready: Traced) -> list[list[Cut]]:
    """For each interval of r inside the box, ascending: its ends, and the edges between them."""
    parts = affine.at(first)
    limits = affine.limits()

    def slack(r: Array) -> Array:
        inside = zip(_on_surface(parts, r), limits, strict=True)
        least = np.minimum(*(np.minimum(v - low, high - v) / (high - low) for v, (low, high) in inside))
        return np.where(np.isfinite(least), least, -1.0)

    scan = -np.geomspace(1e3, 1e-3, _SCAN)
    shown = slack(scan) > 0
    bounds = np.flatnonzero(np.diff(np.concatenate([[0], shown.astype(int), [0]])))
    edges = [(r, "EP3") for r in _triple(parts)] + [(r, "2EP2") for r in _doubles(affine, first, crossing, ready)]
    intervals = []
    for start, stop in zip(bounds[::2], bounds[1::2], strict=True):
        ends = [scan[start], scan[stop - 1]]
        for k, row in ((0, start), (1, stop)):
            if 0 < row < _SCAN:
                ends[k] = brentq(lambda r: float(slack(np.array(r))), scan[row - 1], scan[row])
        low, high = float(ends[0]), float(ends[1])
        between = sorted((r, kind) for r, kind in edges if low < r < high)
        intervals.append([(low, "box"), *between, (high, "box")])
    return intervals


def _triple(parts: tuple[Array, Array, Array]) -> list[float]:
    """Real triple roots: p, p′ and p″ vanish together for some (x, y) exactly where their determinant does."""
    rows = [[np.polyder(p, k).tolist() for p in parts] for k in range(3)]
    found = np.roots(np.trim_zeros(np.array(determinant(rows)), "f"))
    return [float(z.real) for z in found if abs(z.imag) <= 1e-9 * abs(z) and z.real < 0]


def _doubles(affine: _Affine, first: float, crossing: Trace, ready: Traced) -> list[float]:
    """Both double roots of every 2EP2 at this value of the first parameter."""
    found: list[float] = []
    for branch in crossing.branches:
        along = branch.parameters[affine.axes[0]] - first
        for k in np.flatnonzero(along[1:] * along[:-1] <= 0):
            share = along[k] / (along[k] - along[k + 1]) if along[k] != along[k + 1] else 0.0
            columns = [branch.parameters[n] for n in affine.axes] + list(branch.unknowns.values())
            start = np.array([c[k] + share * (c[k + 1] - c[k]) for c in columns])
            of = affine.problem.parameter_set
            for index, name in enumerate(affine.axes):
                start[index] = np.tan(start[index]) if of[name].tangent else start[index]
            start[0] = first
            end = project(ready.on.evaluate, start / ready.on.scale, held=0)
            if end is None:
                continue
            b, c = (end * ready.on.scale)[3:5]
            spread = b * b / 4 - c
            if spread > 0:
                found += [float(-b / 2 - np.sqrt(spread)), float(-b / 2 + np.sqrt(spread))]
    return found


def _patch(affine: _Affine, grid: Array, left: Array, right: Array, across: int) -> Patch:
    share = (1 - np.cos(np.linspace(0, np.pi, across))) / 2  # crowds at the edges, where the surface turns
    r = left[:, None] + (right - left)[:, None] * share
    x, y = np.empty_like(r), np.empty_like(r)
    for k, first in enumerate(grid):
        x[k], y[k] = _on_surface(affine.at(float(first)), r[k])
    points = dict(zip(affine.axes, (np.broadcast_to(grid[:, None], r.shape), *affine.natural(x, y)), strict=True))
    middle = (len(grid) // 2, across // 2)
    damped = _damped(affine.at(float(grid[middle[0]])), float(x[middle]), float(y[middle]), float(r[middle]))
    return Patch(points, r, damped)


def _damped(parts: tuple[Array, Array, Array], x: float, y: float, r: float) -> bool:
    """Whether the other two roots are real and negative as well, from the quotient by (s − r)²."""
    A, B, C = parts
    quotient = np.polydiv(A + x * B + y * C, np.array([1.0, -2 * r, r * r]))[0]
    negative, _ = real_roots(quotient)
    return bool(is_stable(quotient) and negative == len(quotient) - 1)
