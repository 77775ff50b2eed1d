"""Computes Pareto fronts: one objective is minimised with limits eps on the others, starting from nearby designs."""

import time
from dataclasses import replace
from itertools import takewhile
from typing import Unpack

import numpy as np

from tmsopt.errors import MOST_POINTS, InputError, count_faults, input_error
from tmsopt.executor import Executor, cores, in_process, processes
from tmsopt.fronts.curve import fill_curve
from tmsopt.fronts.front import Front, FrontPoint
from tmsopt.fronts.subproblems import (
    MAX_PARALLEL,
    FrontSolver,
    can_pickle,
    front_point,
    map_items,
    minimise_without_limits,
    solve_end,
)
from tmsopt.fronts.surface import fill_surface
from tmsopt.problem.files import ProblemSource, pose
from tmsopt.problem.solution import Solution
from tmsopt.problem.verdict.status import NotSolved
from tmsopt.program.options import CommonOptions, Options, documents_options, make_options
from tmsopt.progress import Steps

POINTS = 25
"""Default number of points."""

STARTS = 2
"""Default number of new starts per sub-problem, in addition to the designs of the neighbours."""

_DEFAULTS = Options(starts=STARTS)
_NO_CONFLICT = 1e-7  # largest relative difference of an objective between the ends that is no conflict


@documents_options(CommonOptions, _DEFAULTS)
def pareto(
    problem: ProblemSource, points: int = POINTS, *, workers: int | None = None, **options: Unpack[CommonOptions]
) -> Front:
    """Compute the Pareto front of two or three objectives, each minimised, with its ends, kinks and gaps.

    With two objectives, each sub-problem minimises one and limits the other by eps. The next eps lies between the
    neighbours that are farthest apart, on the objective that changes more there; sweeps in both directions then keep
    the better design. With three objectives, the limits on two of them form a grid of points × points values, at most
    12 × 12, over their ranges at the ends of the front. Gaps narrower than the spacing of the points may be missed.
    After Ctrl-C, the points that were found are returned, if an end of the front is known.

    Args:
        problem: a problem with ``pareto``; ``locate`` and constraints restrict the designs.
        points: number of points along the front; kinks and ends of gaps are added. With three objectives, number of
            limits on each of the last two, at most 12: the front has at most about the square of this number of
            points, and fewer where different limits give the same design or cannot be met.
        workers: number of processes, by default one per core; at most four are used. The front does not depend on it.
        options: ``starts`` (new starts per sub-problem, 2 by default), ``seed``, ``linear_solver`` and ``progress``,
            as for `solve`.

    Raises:
        NotSolved: if no optimum of an objective is found; the exception holds the best point that was found.
        InputError: for a problem without ``pareto``, fewer than 2 or more than 10000 points, or less than one process.

    Example:
        >>> swing = tmsopt.models.from_coefficients([1, "c", 1])  # the abscissa is -c/2 up to c = 2
        >>> asked = tmsopt.Problem(swing, free={"c": (1, 3)}, pareto=("abscissa", "c"))
        >>> front = [point.objectives for point in tmsopt.pareto(asked, points=5, workers=1).points]
        >>> all(abs(a + c / 2) < 1e-6 for a, c in front)
        True

    More: docs/how_to/fronts.md
    """
    problem = pose(problem)
    if not problem.pareto:
        message = 'no front is asked for; add e.g. pareto = ["abscissa", "Fr"], or call tmsopt.solve'
        raise input_error(message, "objective")
    choices = make_options(options, defaults=_DEFAULTS, min_starts=0)
    faults = count_faults("points", points, 2, MOST_POINTS)
    if faults := faults + ([] if workers is None else count_faults("workers", workers, 1)):
        raise InputError(faults)
    start_time = time.perf_counter()
    solver = FrontSolver(problem, replace(choices, progress=None))
    worker_count = min(workers or cores(), MAX_PARALLEL) if can_pickle(solver) else 1
    with processes(worker_count) if worker_count > 1 else in_process() as executor:
        front = _compute_front(executor, solver, points, choices.progress or Steps(lambda _: None))
    if front.interrupted:
        note = f"the user stopped the search after {front.solved} sub-problems; the front holds the points found so far"
        front = replace(front, notes=(*front.notes, note))
    return replace(front, seconds=time.perf_counter() - start_time)


def _compute_front(executor: Executor, solver: FrontSolver, points: int, progress: Steps) -> Front:
    """Compute the ends of the front, then the points between them."""
    n, single_optima, ends = len(solver.texts), dict[int, Solution](), dict[int, FrontPoint]()
    progress.begin("looking for the ends of the front", "sub-problem")
    progress(0, 2 * n)
    front = Front(solver.problem.problem, solver.texts, (), (), (), n, 0.0)
    try:
        for k, optimum in map_items(executor, minimise_without_limits, solver, range(n)):
            single_optima[k] = optimum
            progress(len(single_optima), 2 * n)
            for solution in (single_optima[j] for j in takewhile(single_optima.__contains__, range(n))):
                if solution.status != "optimal":
                    raise NotSolved(solution)
        solver = replace(solver, single_optima=single_optima)
        for k, end_solution in map_items(executor, solve_end, solver, range(n)):
            ends[k] = replace(front_point(solver, end_solution), label=_label(solver.texts[k].strip()))
            progress(n + len(ends), 2 * n)
    except KeyboardInterrupt:
        if not ends:
            raise
        return replace(front, points=tuple(ends.values()), solved=n + len(ends), interrupted=True)
    end_points = tuple(ends[k] for k in range(n))
    values = np.array([p.objectives for p in end_points])
    ranges = np.ptp(values, axis=0)
    has_conflict = ranges > _NO_CONFLICT * (1 + np.abs(values).max(axis=0))
    solver = replace(solver, ranges=tuple(ranges.tolist()), ends=end_points)
    if not (has_conflict.all() if n == 2 else has_conflict.any()):
        best_in_all = min(end_points, key=lambda p: sum(p.objectives))
        note = "the objectives do not conflict: one design is best in all of them, and the front is that point"
        return replace(front, points=(replace(best_in_all, label="best in all"),), notes=(note,))
    return (fill_curve if n == 2 else fill_surface)(executor, solver, front, points, progress)


def _label(text: str) -> str:
    """The label of the end of the front at which an objective is best."""
    positive_text = text.removeprefix("-").strip()
    is_maximised = text != positive_text and positive_text.isidentifier()
    return f"greatest {positive_text}" if is_maximised else f"least {text}"
