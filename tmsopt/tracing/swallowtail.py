"""The discriminant surface around an EP4: a swallowtail, parametrised by its double root and cut along its edges.

The coefficients are affine functions of two parameters, here chi_B and T = tan λ_s. At a given value of the third
parameter, Fr, a double root r satisfies two linear equations p(r) = p′(r) = 0. So (Fr, r) parametrises the whole
surface. The surface turns back where the root is triple (EP3), and crosses itself where two other roots form a second
double root (2EP2). The surface is cut along these edges into smooth patches.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from itertools import groupby, pairwise
from typing import Any

import numpy as np

from tmsopt.errors import input_error
from tmsopt.problem.files import ProblemSource, pose
from tmsopt.problem.problem import Posed, Problem
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Array, Printable, plain
from tmsopt.roots import is_stable, real_roots
from tmsopt.roots.sign_tests import double_root_test
from tmsopt.tracing.branch import EventPoint, Trace
from tmsopt.tracing.equations import compute_coefficients, design_at, limits_of
from tmsopt.tracing.events import has_sign_change
from tmsopt.tracing.solving import find_zeros
from tmsopt.tracing.trace import STARTS, trace

Cut = tuple[float, str]
"""A double root, and the kind of the edge at this root: an edge of the surface or of the box."""

AffineCoefficients = tuple[Array, Array, Array]
"""Coefficients A, B, C of a polynomial A + x B + y C, where x and y are the last two variables."""

_MIN_DEGREE = 4  # lowest degree with two double roots

_SCAN_POINTS = 2000  # number of double roots r at which edges are searched
_SAME_ROW = 1e-12  # distance, in widths of the box, up to which two rows count as one
_OFFSETS = np.array([1e-7, 4e-5, 1e-4, 1e-3, 4e-3, 0.012])
_ROWS_AROUND = np.concatenate([-_OFFSETS[::-1], _OFFSETS])
"""Distances of additional rows from a value of Fr at which the number of edges changes."""


@dataclass(frozen=True)
class Patch:
    """A smooth part of the surface, as arrays of shape (rows, columns). A row has one value of Fr.

    Attributes:
        points: name of a free parameter → its values.
        r: the double root.
        heavily_damped: whether the patch bounds the heavily damped designs.
    """

    points: dict[str, Array]
    r: Array
    heavily_damped: bool


@dataclass(frozen=True, repr=False)
class Swallowtail(Printable):
    """The surface with its edges.

    Attributes:
        axes: the three free parameters; a row of a patch has one value of the first.
        cusps: traced EP3 curves, the cuspidal edges.
        crossing: the traced EP set: 2EP2 where the surface intersects itself, and CEP2 on the rest of the curve.

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
    problem: ProblemSource, rows: int = 48, across: int = 24, starts: int = STARTS, *, progress: Listener | None = None
) -> Swallowtail:
    """The surface of real negative double roots in the box of three free parameters.

    The coefficients must be affine functions of the last two parameters.

    Args:
        problem: with Fr, chi_B and lambda_s free, or three parameters of another model whose coefficients are affine
            in the last two (in their tangents, for angles).
        rows, across: number of points along the first parameter, and along r between two edges.
        starts: number of starts for tracing the edges; see `trace`.
        progress: function called with a `tmsopt.Progress` now and then.

    Raises:
        InputError: for another number of free parameters, coefficients that are not affine in two of them, or a
            model of degree 2 or 3, which cannot have two double roots.

    Example:
        >>> surface = tmsopt.swallowtail("problems/ep_set.toml", rows=4, across=4, starts=8)
        >>> [f"{event.parameters['chi_B']:.6f}" for event in surface.crossing.events if event.name == "EP4"]  # √2
        ['1.414214']

    More: docs/how_to/tracing.md
    """
    plane = pose(problem).derive(constraints={}, minimize=None, maximize=None, locate=None)
    if plane.model.degree < _MIN_DEGREE:
        message = (
            f"model '{plane.model.name}' has degree {plane.model.degree}; accepted: {_MIN_DEGREE} or more, since a "
            "swallowtail crosses itself at two double roots; trace EP2 and EP3 instead"
        )
        raise input_error(message, "model")
    if len(plane.free) != 3:
        raise input_error(f"found {len(plane.free)} free parameters; accepted: 3 for a surface", "parameters")
    first_name, *pair_names = plane.free
    if not _is_affine(plane):
        message = f"the coefficients are not affine in {' and '.join(pair_names)}; "
        message += "put two parameters last in which they are affine"
        raise input_error(message, "parameters")
    cusps, crossing = (trace(plane, name, starts=starts, progress=progress) for name in ("EP3", "2EP2"))
    grid = _choose_rows(plane, rows, (*cusps.events, *crossing.events))
    scan = np.union1d(
        -np.geomspace(1e3, 1e-3, _SCAN_POINTS), [b.unknowns["r"][e.index] for b in cusps.branches for e in b.events]
    )
    cuts, steps = [], start_steps(progress, "cutting the surface", "row")
    for row_count, value in enumerate(grid.tolist(), 1):
        cuts.append(_find_cuts(plane, value, scan[scan < 0]))
        if steps:
            steps(row_count, len(grid))
    patches = []
    # neighbouring rows with the same cuts form one set of patches
    for _, run in groupby(range(len(grid)), key=lambda k: [[kind for _, kind in interval] for interval in cuts[k]]):
        rows_of_run = list(run)
        for intervals in zip(*(cuts[k] for k in rows_of_run), strict=True) if len(rows_of_run) > 1 else ():
            table = np.array([[r for r, _ in interval] for interval in intervals])
            patches += [
                _make_patch(plane, grid[rows_of_run], left_edge, right_edge, across)
                for left_edge, right_edge in pairwise(table.T)
            ]
    return Swallowtail(plane.problem, (first_name, pair_names[0], pair_names[1]), tuple(patches), cusps, crossing)


def _choose_rows(problem: Posed, count: int, events: Iterable[EventPoint]) -> Array:
    """Values of the first parameter: evenly spaced values, and more around each change of the number of edges."""
    name, (low, high) = next(iter(problem.free.items()))
    changes = [
        e.parameters[name] + _ROWS_AROUND for e in events if e.name == "EP4" or (e.name == "fold" and name in e.detail)
    ]
    grid = np.unique(np.concatenate([np.linspace(low, high, count), *changes]))
    grid = grid[(grid >= low) & (grid <= high)]
    # an EP4 is an event of several traces, so values may repeat
    return np.asarray(grid[np.append(True, np.diff(grid) > _SAME_ROW * (high - low))])


def _compute_polynomials(problem: Posed, x: Any) -> Array:
    """Coefficients at variables x (for an angle, its tangent), shape (designs, n + 1)."""
    return compute_coefficients(problem, design_at(problem, np.asarray(x)))


def _split_affine(problem: Posed, first_value: float) -> AffineCoefficients:
    constant, at_first_unit, at_second_unit = _compute_polynomials(
        problem, [(first_value, 0.0, 0.0), (first_value, 1.0, 0.0), (first_value, 0.0, 1.0)]
    )
    return constant, at_first_unit - constant, at_second_unit - constant


def _is_affine(problem: Posed) -> bool:
    first_value = float(np.mean(next(iter(problem.free.values()))))
    A, B, C = _split_affine(problem, first_value)
    predicted = np.array([A + 2 * B + 3 * C, A - B + C / 2])
    actual = _compute_polynomials(problem, [(first_value, 2.0, 3.0), (first_value, -1.0, 0.5)])
    return bool(np.all(np.abs(actual - predicted) <= 1e-9 * np.abs(predicted).max(axis=1, keepdims=True)))


def _solve_double_root(affine: AffineCoefficients, r: Array) -> tuple[Array, Array]:
    """x and y for which r is a double root: p(r) = p′(r) = 0 by Cramer's rule."""
    (A, B, C), (dA, dB, dC) = ([np.polyval(p, r) for p in affine], [np.polyval(np.polyder(p), r) for p in affine])
    with np.errstate(all="ignore"):
        determinant = B * dC - C * dB
        return (C * dA - A * dC) / determinant, (A * dB - B * dA) / determinant


def _find_cuts(problem: Posed, first_value: float, scan: Array) -> list[list[Cut]]:
    """For each interval of r inside the box, in ascending order: its two ends, and the edges between the ends.

    Edges are zeros of three functions of r: of the distance to the box, of the polynomial of the other roots at r
    (EP3), and of the discriminant of this polynomial (2EP2).

    Args:
        scan: values of r between which the edges are searched.
    """
    affine, (low, high) = _split_affine(problem, first_value), (limit[1:, None] for limit in limits_of(problem))

    def tests(r: Array) -> list[Array]:
        x = np.stack(_solve_double_root(affine, r))
        slack = np.min(np.minimum(x - low, high - x) / (high - low), axis=0)
        quotient = _divide(_divide(affine[0][:, None] + np.tensordot(np.stack(affine[1:]), x, (0, 0)), r), r)
        return [np.where(np.isfinite(slack), slack, -1.0), np.polyval(quotient, r), double_root_test(list(quotient))]

    cuts: list[Cut] = []
    values = tests(scan)
    for k, kind in enumerate(("box", "EP3", "2EP2")):
        rows = np.flatnonzero(has_sign_change(values[k]))
        value = partial(lambda k, start, s: tests(start + s)[k], k, scan[rows])
        cuts += [(float(r), kind) for r in scan[rows] + find_zeros(value, np.diff(scan)[rows])]
    ends = [r for r in (scan[0], scan[-1]) if values[0][r == scan][0] > 0]
    cuts = sorted([*cuts, *((float(r), "box") for r in ends)])
    box_cuts = [k for k, (_, kind) in enumerate(cuts) if kind == "box"]
    return [cuts[i : j + 1] for i, j in zip(box_cuts[::2], box_cuts[1::2], strict=True)]


def _divide(p: Array, r: Array) -> Array:
    """Quotients of polynomials by s − r, coefficients first, by Horner's rule."""
    rows = [p[0]]
    for row in p[1:-1]:
        rows.append(row + rows[-1] * r)
    return np.stack(rows)


def _make_patch(problem: Posed, grid: Array, left_edge: Array, right_edge: Array, across: int) -> Patch:
    positions = (1 - np.cos(np.linspace(0, np.pi, across))) / 2  # dense at the edges, where the surface turns back
    r = left_edge[:, None] + (right_edge - left_edge)[:, None] * positions
    pairs = [
        _solve_double_root(_split_affine(problem, first_value), row)
        for first_value, row in zip(grid.tolist(), r, strict=True)
    ]
    x = np.stack([np.broadcast_to(grid[:, None], r.shape), *np.array(pairs).transpose(1, 0, 2)], axis=-1)
    points = design_at(problem, x.reshape(-1, 3))
    middle = len(grid) // 2, across // 2
    p, root = _compute_polynomials(problem, [x[middle]])[0], r[middle]
    quotient = np.polydiv(p, np.array([1.0, -2 * root, root * root]))[
        0
    ]  # the polynomial of the other roots, divided by (s − r)²
    negative_count, _ = real_roots(quotient)
    heavily_damped = bool(is_stable(quotient) and negative_count == len(quotient) - 1)
    return Patch({n: column.reshape(r.shape) for n, column in points.items()}, r, heavily_damped)
