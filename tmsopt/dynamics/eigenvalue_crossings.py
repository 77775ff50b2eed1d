"""Finds values of one parameter at which eigenvalues of matrices cross the imaginary axis or meet.

Eigenvalues on a grid of values show between which of them one crosses or two meet. Newton steps for the Jordan chain
(`tmsopt.roots.chains`) then give the value to rounding. Nothing is proved between the values of the grid.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from tmsopt.chains import Axis, Family, Target, family_of, refine
from tmsopt.dynamics.crossings import Crossing, Crossings, merge_bands
from tmsopt.errors import input_error
from tmsopt.problem.evaluate import evaluate_matrices
from tmsopt.problem.problem import Posed
from tmsopt.records import Array, Complex, Numbers
from tmsopt.roots import Root, find_conditioning

_GRID_POINTS = 801
_MANY_EIGENVALUES = 12
"""With more eigenvalues a grid has a quarter of the values, because each takes 5 ms for 40 and 40 ms for 100."""

_OFFSET = 0.382  # of the grid, in steps, so that no round number is on it
_HALVINGS = 12  # of a step of the grid with a crossing, before the Newton steps
_ROUNDING = 64 * float(np.finfo(float).eps)  # error of an eigenvalue with the condition number 1
_UNKNOWN_ERROR = 1e-10  # error where the condition number is unknown, relative to the eigenvalues
_SHIFT = 1e-4  # of a value for the slopes of the eigenvalues, in steps of the grid
_MEETING_CENTRE, _MEETING_RADIUS = 0.5, 1.5
"""Two eigenvalues may meet if the square of their difference, continued by its slope, is 0 within this circle, in steps
of the grid. Where k eigenvalues meet at a distance of t steps, the slope leads to k t/2."""
_FIRST_ORDERS, _HIGHER_ORDERS = (3, 2), range(8, 3, -1)
"""Orders of a multiple eigenvalue. The higher ones are tried if Newton steps for one of the first ones succeed."""
_MAX_MOVE = 2.0  # of Newton steps for a multiple eigenvalue, in steps of the grid
_SAME = 1e-3  # distance of one event that is found twice, in steps of the grid and relative to the eigenvalues
_ACCURACY = 1e-12  # of a single eigenvalue, relative to the eigenvalues; one of order k has the k-th root


def choose_grid_size(count: int) -> int:
    """Number of values of a grid for this number of eigenvalues."""
    return _GRID_POINTS if count <= _MANY_EIGENVALUES else _GRID_POINTS // 4


def find_eigenvalue_crossings(problem: Posed, parameters: Numbers, name: str, lower: float, upper: float) -> Crossings:
    """Crossings with lower < y < upper for the parameter y, as far as a grid of values shows them.

    Args:
        parameters: every parameter of the design.

    Raises:
        InputError: if the leading matrix is singular at every value of the grid.
    """
    others = {n: x for n, x in parameters.items() if n != name}
    family = family_of(problem.derive(free={name: (lower, upper)}, fixed=others))
    scan = _Sweep(problem, others, name, family, (upper - lower) / (choose_grid_size(problem.model.degree) - 1))
    grid = scan.evaluate(np.arange(lower + _OFFSET * scan.step, upper, scan.step))
    grid = grid.select(grid.is_finite)
    if not len(grid.values):
        raise input_error("is singular for every value; accepted: matrices without a root at infinity", "M")
    found, size, rounding = list[tuple[float, Root]](), np.abs(grid.s).max(), _ACCURACY * max(abs(lower), abs(upper))
    for at, root in (*_find_meetings(scan, grid), *_find_crossings(scan, grid)):
        y = next((x for x, _ in found if abs(x - at) <= rounding), at)
        distances = ((abs(x - y), abs(complex(r.re, r.im) - complex(root.re, root.im))) for x, r in found)
        is_new = all(dy > _SAME * scan.step or ds > _SAME * size for dy, ds in distances)
        found += [(y, root)] * (is_new and lower < y < upper)
    found.sort(key=lambda event: (event[0], -event[1].re, event[1].im))
    ends = [lower, *sorted({y for y, _ in found}), upper]
    cells = [(a, b, (a + b) / 2) for a, b in pairwise(ends)]
    middles = scan.evaluate(np.array([middle for *_, middle in cells]))
    zeros, always = grid.list_permanent(family.is_complex)
    stable = middles.left == problem.model.degree
    damped = stable & (middles.s.imag == 0).all(axis=-1) & (not family.is_complex)
    marginal = middles.is_finite & (middles.right == 0) & (middles.count_meetings(zeros) == 0) & bool(always)
    is_bounded = stable | marginal

    def describe(y: float, root: Root) -> Crossing:
        s, k, cell = scan.evaluate(np.array([y])).s, root.multiplicity, ends.index(y)
        is_pair, tolerance = root.im != 0 or family.is_complex, size * _ACCURACY ** (1 / k)
        kind = (
            f"{'C' if root.im and not family.is_complex else ''}EP{k}" if k > 1 else "weave" if is_pair else "capsize"
        )
        changes = bool(is_bounded[cell - 1] != is_bounded[cell])
        return Crossing(y, kind, root, bool((s.real <= root.re + tolerance).all()), changes)

    bands = [merge_bands(cells, flags.tolist()) for flags in (stable, damped, marginal)]
    events = tuple(describe(*event) for event in found)
    return Crossings(events, bands[0], bands[1], always, bands[2], zeros)


@dataclass(frozen=True)
class _Spectra:
    """Eigenvalues with error bounds over the parameter, shape (n, degree); nan at poles."""

    values: Array
    s: Complex
    errors: Array

    @property
    def is_finite(self) -> Any:
        """Whether the eigenvalues are defined, shape (n,)."""
        return np.isfinite(self.s).all(axis=-1)

    @property
    def left(self) -> Any:
        """Number of eigenvalues that are left of the axis, and not on it within their errors."""
        return np.count_nonzero(self.s.real < -self.errors, axis=-1)

    @property
    def right(self) -> Any:
        """The same for the right."""
        return np.count_nonzero(self.s.real > self.errors, axis=-1)

    @property
    def crossing_rows(self) -> Any:
        """Numbers of the values after which an eigenvalue crosses the axis."""
        return np.flatnonzero(np.diff(self.left) * np.diff(self.right) < 0)

    def select(self, rows: Any) -> "_Spectra":
        """Some of the values."""
        return _Spectra(*(x[rows] for x in vars(self).values()))

    def without_contacts(self) -> "_Spectra":
        """The values at which no more eigenvalues are on the axis than at the next one on one side."""
        on_axis = np.pad(self.s.shape[1] - self.left - self.right, 1)
        return self.select(on_axis[1:-1] <= np.maximum(on_axis[:-2], on_axis[2:]))

    def count_meetings(self, zeros: int) -> Any:
        """Number of eigenvalues that coincide with another one within their errors, without eigenvalues 0."""
        rows = np.argsort(np.abs(self.s), axis=-1)[:, zeros:]
        s, errors = (np.take_along_axis(x, rows, axis=-1) for x in (self.s, self.errors))
        meet = np.abs(s[:, :, None] - s[:, None, :]) <= errors[:, :, None] + errors[:, None, :]
        return (meet.sum(axis=-1) > 1).sum(axis=-1)

    def list_permanent(self, is_complex: bool) -> tuple[int, tuple[str, ...]]:
        """`Crossings.zeros` and `Crossings.always`, as far as these values show them."""
        zeros = 0 if is_complex else int((np.abs(self.s) <= self.errors).sum(axis=-1).min())
        mirror = np.abs(self.s[:, :, None] + self.s[:, None, :].conj())
        is_mirrored = (mirror <= self.errors[:, :, None] + self.errors[:, None, :]).any(axis=-1).sum(
            axis=-1
        ).min() > zeros
        holds = {"capsize": zeros > 0, "weave": is_mirrored, "EP2": self.count_meetings(zeros).min() > 0}
        return zeros, tuple(kind for kind, is_permanent in holds.items() if is_permanent)


@dataclass(frozen=True)
class _Sweep:
    """The eigenvalues of a problem over one parameter, on a grid with a step."""

    problem: Posed
    others: Numbers
    name: str
    family: Family
    step: float

    def evaluate(self, values: Array) -> _Spectra:
        """Eigenvalues at values of the parameter."""
        columns, model, parameter_set = (
            {**self.others, self.name: values},
            self.problem.model,
            self.problem.parameter_set,
        )
        matrices = evaluate_matrices(model, parameter_set, columns)
        found = find_conditioning(matrices)
        size, errors = np.abs(found.eigenvalues).max(axis=-1, keepdims=True), _ROUNDING * found.condition
        if matrices.shape[1] == 2:  # the condition number is then relative to a change by 1
            errors = errors * np.linalg.norm(matrices[:, 1], axis=(-2, -1))[:, None]
        return _Spectra(values, found.eigenvalues, np.where(np.isnan(errors), _UNKNOWN_ERROR * size, errors))

    def refine(self, target: Target, y: float, s: complex, reach: float) -> tuple[float, Root] | None:
        """The event near y, by Newton steps; None if they fail or move y by more than `reach` steps of the grid."""
        try:
            point = refine(self.family, [target], np.array([y]), [s])
        except np.linalg.LinAlgError:
            return None
        if not (point.is_found and point.is_isolated and abs(point.p[0] - y) <= reach * self.step):
            return None
        rounding = _ACCURACY * max(abs(s), self.family.typical_size)
        re, im = (float(x) if abs(x) > rounding else 0.0 for x in (point.roots[0].real, point.roots[0].imag))
        return float(point.p[0]), Root(re, im, target.order)

    def refine_first(self, starts: Mapping[int, tuple[Target, float, complex, float]], orders: Iterable[int]) -> Any:
        """The event of the first of the orders at which Newton steps succeed; None if there is none."""
        return next(filter(None, (self.refine(*starts[k]) for k in orders if k in starts)), None)


def _find_crossings(scan: _Sweep, grid: _Spectra) -> Iterator[tuple[float, Root]]:
    """Eigenvalues that cross the axis: by Newton steps from the ends of short steps, or else by halvings alone."""
    spectra = grid.without_contacts()
    for _ in range(_HALVINGS):
        k = spectra.crossing_rows
        if not len(k):
            return
        middles = scan.evaluate((spectra.values[k] + spectra.values[k + 1]) / 2)
        pairs = zip(vars(spectra).values(), vars(middles).values(), strict=True)
        spectra = _Spectra(*(np.insert(x, k + 1, new, axis=0) for x, new in pairs)).without_contacts()
    for k in spectra.crossing_rows:
        y, s = float(spectra.values[k : k + 2].mean()), spectra.s[k]
        s = s[np.abs(s.real) > spectra.errors[k]]
        nearest = s[np.argsort(np.abs(s.real))[: abs(spectra.left[k + 1] - spectra.left[k])]]
        for z in nearest if scan.family.is_complex else nearest[nearest.imag >= 0]:
            is_zero = z.imag == 0 and not scan.family.is_complex
            target = Target(1, "zero" if is_zero else "imaginary")
            yield scan.refine(target, y, complex(z), _SAME) or (y, Root(0.0, float(z.imag)))


def _find_meetings(scan: _Sweep, grid: _Spectra) -> Iterator[tuple[float, Root]]:
    """Multiple eigenvalues with one eigenvector, each with the greatest order that Newton steps confirm."""
    is_complex, shifted = scan.family.is_complex, scan.evaluate(grid.values + _SHIFT * scan.step)
    for y, s, errors, next_s in zip(*vars(grid).values(), shifted.s, strict=True):
        slopes = (next_s[np.abs(s[:, None] - next_s).argmin(axis=1)] - s) / _SHIFT
        gaps, means = s[:, None] - s, (s[:, None] + s) / 2
        with np.errstate(all="ignore"):
            steps = -gaps / (2 * (slopes[:, None] - slopes))
        is_near = (np.abs(steps - _MEETING_CENTRE) <= _MEETING_RADIUS) & (np.abs(gaps) > errors[:, None] + errors)
        is_near &= np.tri(len(s), k=-1, dtype=bool) & (is_complex | (means.imag >= 0))
        for mean, part in zip(means[is_near], steps[is_near].real, strict=True):
            is_real, nearest = mean.imag == 0 and not is_complex, s[np.argsort(np.abs(s - mean))]
            axis: Axis = "real" if is_real else "complex"
            starts = {
                k: (Target(k, axis), y + part * scan.step, complex(nearest[:k].mean()), _MAX_MOVE)
                for k in range(2, len(s) + 1)
            }
            if event := scan.refine_first(starts, _FIRST_ORDERS):
                yield scan.refine_first(starts, _HIGHER_ORDERS) or event
