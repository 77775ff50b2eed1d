"""Pareto fronts by eps-constraints, warm-started along the front."""

import time
from dataclasses import replace
from itertools import takewhile
from typing import Unpack

from tmsopt.errors import MOST_POINTS, InputError, count_faults, input_error
from tmsopt.executor import Executor, cores, here, processes
from tmsopt.fronts.curve import curve
from tmsopt.fronts.front import Front, FrontPoint
from tmsopt.fronts.subproblems import FrontSolver, alone, best_first, point
from tmsopt.fronts.surface import surface
from tmsopt.fronts.team import AT_ONCE, can_send, each
from tmsopt.problem.files import Given, pose
from tmsopt.problem.solution import Solution
from tmsopt.problem.verdict.status import NotSolved
from tmsopt.program.options import CommonOptions, Options, documents_options, make_options
from tmsopt.progress import Steps

POINTS = 25
STARTS = 2
"""New starts per sub-problem, beside the neighbours' designs."""

_DEFAULTS = Options(starts=STARTS)
_ALIKE = 1e-7  # relative difference of ends that counts as no conflict, that of optima that count as the same


@documents_options(CommonOptions, _DEFAULTS)
def pareto(problem: Given, points: int = POINTS, *, workers: int | None = None, **options: Unpack[CommonOptions]) -> Front:
    """The front of two or three objectives, each minimised, with its ends, kinks and gaps.

    Two objectives: minimise one subject to the other ≤ eps, the next eps where neighbours are farthest apart and on
    the objective that changes more, then sweeps both ways that keep the better design. Three: a grid of eps over the
    payoff table, points × points but at most 12 × 12. Gaps narrower than the spacing of the points may be missed.
    Ctrl-C leaves what is known of the front, once one of its ends is.

    Args:
        problem: with ``pareto``; ``locate`` and constraints narrow the designs.
        points: asked for along the front; kinks and ends of gaps come on top. Of three objectives, limits on each of
            the last two, at most 12: the front has about the square of that in points, and fewer where limits follow
            from one another or none can meet them.
        workers: processes, by default one per core, of which up to four are of use; the front is
            the same for any number.
        options: ``starts`` per sub-problem beside the designs of the neighbours, 2 by default, ``seed`` and
            ``linear_solver`` and ``progress`` as of `solve`.

    Raises:
        NotSolved: when an objective has no optimum, carrying the best point found.
        InputError: for a problem without ``pareto``, or fewer than 2 points or more than 10000, or no process.

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
        message = 'no front is asked for; write e.g. pareto = ["abscissa", "Fr"], or use tmsopt.solve'
        raise input_error(message, "objective")
    how = make_options(options, defaults=_DEFAULTS, fewest=0)
    faults = count_faults("points", points, 2, MOST_POINTS)
    if faults := faults + ([] if workers is None else count_faults("workers", workers, 1)):
        raise InputError(faults)
    began = time.perf_counter()
    ask = FrontSolver(problem, replace(how, progress=None))
    several = min(workers or cores(), AT_ONCE) if can_send(ask) else 1
    with processes(several) if several > 1 else here() as team:
        front = _front(team, ask, points, how.progress or Steps(lambda _: None))
    if front.interrupted:
        words = f"the user stopped the search after {front.solved} sub-problems; this is what is known of the front"
        front = replace(front, notes=(*front.notes, words))
    return replace(front, seconds=time.perf_counter() - began)


def _front(team: Executor, ask: FrontSolver, points: int, progress: Steps) -> Front:
    n, easier, ends = len(ask.texts), dict[int, Solution](), dict[int, FrontPoint]()
    progress.begin("looking for the ends of the front", "sub-problem")
    progress(0, 2 * n)
    front = Front(ask.problem.problem, ask.texts, (), (), (), n, 0.0)
    try:
        for k, found in each(team, alone, ask, range(n)):
            easier[k] = found
            progress(len(easier), 2 * n)
            for solution in (easier[j] for j in takewhile(easier.__contains__, range(n))):
                if solution.status != "optimal":
                    raise NotSolved(solution)
        ask = replace(ask, easier=easier)
        for k, best in each(team, best_first, ask, range(n)):
            ends[k] = replace(point(ask, best), label=_label(ask.texts[k].strip()))
            progress(n + len(ends), 2 * n)
    except KeyboardInterrupt:
        if not ends:
            raise
        return replace(front, points=tuple(ends.values()), solved=n + len(ends), interrupted=True)
    at = tuple(ends[k] for k in range(n))
    ranges = [max(p.objectives[k] for p in at) - min(p.objectives[k] for p in at) for k in range(n)]
    conflict = [r > _ALIKE * (1 + max(abs(p.objectives[k]) for p in at)) for k, r in enumerate(ranges)]
    ask = replace(ask, ranges=tuple(ranges), ends=at)
    if not (all(conflict) if n == 2 else any(conflict)):
        best_in_all = min(at, key=lambda p: sum(p.objectives))
        note = "the objectives are not in conflict: one design is best in all of them, and the front is that point"
        return replace(front, points=(replace(best_in_all, label="best in all"),), notes=(note,))
    return (curve if n == 2 else surface)(team, ask, front, points, progress)


def _label(text: str) -> str:
    """Of the end of the front where an objective is best."""
    opposite = text.removeprefix("-").strip()
    greatest = text != opposite and opposite.isidentifier()
    return f"greatest {opposite}" if greatest else f"least {text}"
