"""Finds points on the curves of a pattern: from many designs, from a grid, and where curves return from infinity."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import chain, cycle, islice
from typing import Any

import numpy as np

from tmsopt.problem.problem import Posed
from tmsopt.program.starts import sample_box
from tmsopt.records import Array, Truth
from tmsopt.roots.sign_tests import MAX_CLOSED_FORM_DEGREE
from tmsopt.tracing.chain_curve import ChainSetup
from tmsopt.tracing.continuation import INFINITE, Curve, Walk, is_on_walk, walk_both_ways
from tmsopt.tracing.equations import Setup, compute_coefficients, design_at
from tmsopt.tracing.solving import project_rows

_EXTRAPOLATION_SIZE = 300.0  # size of an unknown at which extrapolation through infinity begins
_MAX_UNKNOWN = 1e5  # largest unknown of a seed, in units of its scale; above this size a0 nearly vanishes
_MAX_ROUNDS = 8  # the search uses at most this many rounds of `starts` designs
_MAX_GUESSES = 4  # number of starting values of the unknowns that are tried at each design

_GRID_POINTS = 256
"""Grid points along each axis; an edge of the grid is about as long as a step of a trace."""

_GRID_POINTS_AT_HIGH_DEGREE = 96
"""Grid points along each axis if the degree has no closed forms. Then 9,216 polynomials take one or two seconds."""

_MAX_USELESS_DESIGNS = 32  # designs in a row without a new curve, after which the search ends
_BLOCK_SIZE = 256  # points per block of distances


def find_missed_designs(
    problem: Posed, curve: Curve, test: Callable[[Sequence[Any]], Any], walks: Sequence[Walk]
) -> Iterator[dict[str, float]]:
    """Designs near sign changes of a function of the coefficients that are not near any walk.

    The designs are midpoints of edges of a grid over the box. Values that are nan do not count. `walks` may grow during
    the search. Edges on which a0 also changes sign come last, and only as long as they lead to new curves, because a0
    causes most of these sign changes.
    """
    low, high = np.array(list(problem.free.values())).T
    point_count = _GRID_POINTS if problem.model.degree <= MAX_CLOSED_FORM_DEGREE else _GRID_POINTS_AT_HIGH_DEGREE
    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, point_count)] * 2, indexing="ij"), axis=-1)
    with np.errstate(all="ignore"):
        a = compute_coefficients(
            problem, dict(zip(problem.free, np.moveaxis(low + grid * (high - low), -1, 0), strict=True))
        )
        value = np.broadcast_to(np.asarray(test(list(np.moveaxis(a, -1, 0))), dtype=float), grid.shape[:2])
    for has_a0_change in (False, True):
        middles = []
        for axis in (0, 1):
            test_changes, a0_changes = (np.nan_to_num(np.diff(np.sign(v), axis=axis)) != 0 for v in (value, a[..., 0]))
            middles.append(np.argwhere(test_changes & (a0_changes == has_a0_change)) + np.eye(2)[axis] / 2)
        remaining_middles = np.concatenate(middles) / (point_count - 1)
        np.random.default_rng(0).shuffle(remaining_middles)  # neighbours mostly belong to one branch
        useless_count = seen_walk_count = 0
        while len(remaining_middles) and (useless_count < _MAX_USELESS_DESIGNS or not has_a0_change):
            useless_count = useless_count + 1 if seen_walk_count == len(walks) else 0
            for walk in walks[seen_walk_count:]:
                line = np.stack([*design_at(problem, walk.y * curve.scale).values()], axis=-1)
                remaining_middles = remaining_middles[
                    is_far_from_line(remaining_middles, (line - low) / (high - low), 1 / (point_count - 1))
                ]
            seen_walk_count = len(walks)
            if len(remaining_middles):
                yield dict(zip(problem.free, (low + remaining_middles[0] * (high - low)).tolist(), strict=True))
                remaining_middles = remaining_middles[1:]


def is_far_from_line(points: Array, line: Array, distance: float) -> Truth:
    """Which of the points, shape (n, 2), are farther than a distance from a polyline of shape (m, 2)."""
    start, edges, is_far = line[:-1] @ (1, 1j), np.diff(line, axis=0) @ (1, 1j) + 1e-300, []  # in the complex plane
    for block in np.array_split(points @ (1, 1j), len(points) // _BLOCK_SIZE + 1):
        offset = block[:, None] - start
        position = np.clip((offset / edges).real, 0, 1)
        is_far.append(np.abs(offset - position * edges).min(axis=1) > distance)
    return np.concatenate(is_far)


def walk_new_curves(
    curve: Curve, points: Iterable[Iterable[Array]], step: float, max_points: int, walks: list[Walk]
) -> None:
    """Walk the curves through the points, and add them to `walks`. Skip points that are on one of the `walks`."""
    for y in chain.from_iterable(points):
        if (
            not any(is_on_walk(curve, walk, y) for walk in walks)
            and (new_walk := walk_both_ways(curve, y, step, max_points)) is not None
        ):
            walks.append(new_walk)


def find_seeds(
    setup: Setup, starts: int, seed: int, through: Sequence[Mapping[str, float]], walks: Sequence[Walk]
) -> Iterator[tuple[int, list[Array]]]:
    """For each design, the number of designs so far, and the points of the pattern's curves near this design.

    Without a grid test, the search continues until `starts` designs in a row find no new curve. `walks` grows during
    the search.
    """
    problem = setup.problem
    free_count = len(problem.free)
    first_designs = [*through, *([problem.start] if set(problem.start) == set(problem.free) else [])]
    yield from (
        (0, points) for points in _project_designs(setup, first_designs, [None] * len(first_designs), _MAX_GUESSES)
    )
    useless_count, walk_count, count = 0, len(walks), 0
    held_variables = cycle([None, *range(free_count)])
    designs = sample_box(problem, seed)
    while count < (starts if _choose_grid_test(setup) else _MAX_ROUNDS * starts):
        for points in _project_designs(
            setup, list(islice(designs, starts)), list(islice(held_variables, starts)), _MAX_GUESSES
        ):
            if useless_count >= starts:
                return
            count += 1
            yield count, points
            useless_count, walk_count = (useless_count + 1 if len(walks) == walk_count else 0), len(walks)


def _choose_grid_test(setup: Setup) -> Callable[[Sequence[Any]], Any] | None:
    """The function whose sign changes on a grid show every branch that is not too short, if there is one."""
    return setup.pattern.test if len(setup.problem.free) == 2 else None


def find_missed_seeds(setup: Setup, walks: Sequence[Walk]) -> Iterator[tuple[int, list[Array]]]:
    """Points of curves that are not walked yet: near sign changes on a grid, and where curves return from infinity."""
    test = _choose_grid_test(setup)
    missed = find_missed_designs(setup.problem, setup.curve, test, walks) if test else ()
    for design in chain(missed, _list_designs_beyond_infinity(setup, walks)):
        yield 0, _project_designs(setup, [design])[0]


def _list_designs_beyond_infinity(setup: Setup, walks: Sequence[Walk]) -> Iterator[dict[str, Any]]:
    """Designs near which a curve may return from infinity, where a root goes from −∞ to +∞ or back.

    The distance of the parameters from a0 = 0 is proportional to the inverse of the unknown that grows. So two points
    are enough to extrapolate the limit, and a point on its other side.
    """
    free_count = len(setup.problem.free)
    for walk in walks:  # `walks` grows during the loop
        for end, y in zip(walk.ends, (walk.y[::-1], walk.y), strict=True):
            if end.reason != INFINITE:
                continue
            size = np.abs(y[:, free_count:]).max(axis=1)
            row = np.max(np.flatnonzero(size < _EXTRAPOLATION_SIZE), initial=0)
            if row < len(y) - 2:
                (near_point, far_point), weight = (y[row, :free_count], y[-1, :free_count]), size[row] / size[-1]
                limit = (far_point - weight * near_point) / (1 - weight)
                x = (2 * limit - near_point) * setup.curve.scale[:free_count]
                yield design_at(setup.problem, x)


def _project_designs(
    setup: Setup,
    designs: Sequence[Mapping[str, float]],
    held_variables: Sequence[int | None] = (None,),
    max_guesses: int = 1,
) -> list[list[Array]]:
    """Points of the curves in the box near each design, from the best guesses, with one variable held constant."""
    curve, free_count = setup.curve, len(setup.problem.free)
    if isinstance(setup, ChainSetup):
        rng = np.random.default_rng(0)  # every second design chooses freely which eigenvalues shall meet
        found = [setup.find_point(design, rng if k % 2 else None) for k, design in enumerate(designs)]
        return [[y] if y is not None and np.all((curve.lower <= y) & (y <= curve.upper)) else [] for y in found]
    starts = [
        (k, y)
        for k, design in enumerate(designs)
        for y in setup.list_starts(design, best_first=max_guesses == 1)[:max_guesses]
    ]
    if not starts:
        return [[] for _ in designs]
    design_indices = [k for k, _ in starts]
    y = project_rows(curve.evaluate, np.array([y for _, y in starts]), [held_variables[k] for k in design_indices])
    is_inside = np.all((y >= curve.lower - 1e-12) & (y <= curve.upper + 1e-12), axis=1)  # false for nan
    is_inside &= np.abs(y[:, free_count:]).max(axis=1) <= _MAX_UNKNOWN
    y = np.clip(y, curve.lower, curve.upper)
    is_inside[is_inside] = setup.has_leading_coefficient(
        compute_coefficients(setup.problem, design_at(setup.problem, y[is_inside] * curve.scale))
    )
    return [
        [y[i] for i, design_index in enumerate(design_indices) if design_index == k and is_inside[i]]
        for k in range(len(designs))
    ]
