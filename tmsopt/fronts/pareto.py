"""Pareto fronts by eps-constraints, warm-started along the front."""

import time
from dataclasses import replace
from typing import Unpack

from tmsopt.design.files import Given, problem_of
from tmsopt.design.solution import NotSolved
from tmsopt.errors import MOST_POINTS, Fault, InputError, count_faults
from tmsopt.formulation.options import Asked, Options, options_of, taking
from tmsopt.fronts.curve import curve
from tmsopt.fronts.front import Front, FrontPoint
from tmsopt.fronts.subproblems import Asker, best_first, point
from tmsopt.fronts.surface import surface
from tmsopt.progress import begin

POINTS = 25
STARTS = 2
"""New starts per sub-problem, beside the neighbours' designs."""

_DEFAULTS = Options(starts=STARTS)
_ALIKE = 1e-7  # relative difference of ends that counts as no conflict, that of optima that count as the same


@taking(Asked, _DEFAULTS)
def pareto(problem: Given, points: int = POINTS, **options: Unpack[Asked]) -> Front:
    """The front of two or three objectives, each minimised, with its ends, kinks and gaps.

    Two objectives: minimise one subject to the other ≤ eps, the next eps where neighbours are farthest apart and on
    the objective that changes more, then sweeps both ways that keep the better design. Three: a grid of eps over the
    payoff table, at most 12 × 12. Gaps narrower than the spacing of the points may be missed. Ctrl-C leaves what is
    known of the front, once its ends are.

    Args:
        problem: with ``pareto``; ``locate`` and constraints narrow the designs.
        points: asked for along the front; kinks and ends of gaps come on top.
        options: ``starts`` per sub-problem beside the designs of the neighbours, 2 by default, ``seed`` and
            ``linear_solver`` and ``progress`` as of `solve`.

    Raises:
        NotSolved: when an objective has no optimum, carrying the best point found.
        InputError: for a problem without ``pareto``, or fewer than 2 points or more than 10000.
    """
    problem = problem_of(problem)
    if not problem.pareto:
        message = 'no front is asked for; write e.g. pareto = ["abscissa", "Fr"], or use tmsopt.solve'
        raise InputError([Fault(message, ("objective",))])
    how = options_of(options, defaults=_DEFAULTS, fewest=0)
    if faults := count_faults("points", points, 2, MOST_POINTS):
        raise InputError(faults)
    began = time.perf_counter()
    progress, ask = how.progress, Asker(problem, replace(how, progress=None))
    begin(progress, "following the front", "sub-problem")
    n = len(ask.texts)
    ends = tuple(_end(ask, k) for k in range(n))
    front = Front(problem, ask.texts, ends[:1], (), (), n, 0.0)
    ranges = [max(p.objectives[k] for p in ends) - min(p.objectives[k] for p in ends) for k in range(n)]
    conflict = [r > _ALIKE * (1 + max(abs(p.objectives[k]) for p in ends)) for k, r in enumerate(ranges)]
    ask = replace(ask, ranges=tuple(ranges), ends=ends)
    if not (all(conflict) if n == 2 else any(conflict)):
        best = min(ends, key=lambda p: sum(p.objectives))
        note = "the objectives are not in conflict: one design is best in all of them, and the front is that point"
        front = replace(front, points=(replace(best, label="best in all"),), notes=(note,))
    elif n == 2:
        front = curve(ask, ends, points, progress)
    else:
        found, gaps, solved, interrupted = surface(ask, ends, points, progress)
        front = replace(front, points=found, gaps=gaps, solved=solved, interrupted=interrupted)
    if front.interrupted:
        words = f"the user stopped the search after {front.solved} sub-problems; this is what is known of the front"
        front = replace(front, notes=(*front.notes, words))
    return replace(front, seconds=time.perf_counter() - began)


def _end(ask: Asker, k: int) -> FrontPoint:
    """The end of the front where objective `k` is best, with its label."""
    n = len(ask.texts)
    solution = best_first(ask, [(k + j) % n for j in range(n)])
    if solution.status != "optimal":
        raise NotSolved(solution)
    text = ask.texts[k].strip()
    opposite = text.removeprefix("-").strip()
    greatest = text != opposite and opposite.isidentifier()
    return replace(point(ask, solution), label=f"greatest {opposite}" if greatest else f"least {text}")
