"""Traces a root pattern through parameter space: every branch in the box, with its events."""

import time
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from typing import Any

import numpy as np

from tmsopt.errors import (
    MOST_STARTS,
    Fault,
    InputError,
    callback_faults,
    count_faults,
    input_error,
    is_number,
    list_faults,
    short,
    suggest,
    table_faults,
)
from tmsopt.models.user_spectrum import pattern_of, patterns_of
from tmsopt.problem.files import ProblemSource, pose
from tmsopt.problem.freedom import degrees_of_freedom
from tmsopt.problem.problem import Posed
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Array
from tmsopt.tracing.branch import Trace
from tmsopt.tracing.chain_curve import has_chain_curve
from tmsopt.tracing.continuation import Walk
from tmsopt.tracing.description import make_branches
from tmsopt.tracing.equations import prepare_tracing
from tmsopt.tracing.events import Event, check_events
from tmsopt.tracing.seeds import find_missed_seeds, find_seeds, walk_new_curves

STARTS = 48
STEP = 0.005
MAX_POINTS = 200_000


def trace(
    problem: ProblemSource,
    pattern: str | None = None,
    *,
    step: float = STEP,
    starts: int = STARTS,
    seed: int = 0,
    most: int = MAX_POINTS,
    through: Sequence[Mapping[str, float]] = (),
    events: Sequence[Event] = (),
    progress: Listener | None = None,
) -> Trace:
    """Trace every branch of a pattern in the box. The pattern needs one free parameter more than it has conditions.

    Args:
        pattern: name of the pattern; by default the pattern that the problem locates.
        step: longest step, in widths of the box.
        starts: number of designs from which branches are searched. With two free parameters and one condition (EP2,
            weave, capsize), a grid of 256 × 256 designs (96 × 96 above degree 4) finds the branches that they miss.
            Otherwise the search ends when this many designs in a row find no new branch, and it can miss a branch that
            is far from all of them.
        most: largest number of points of a branch in one direction.
        through: points in the box (values of every free parameter) from which the search begins.
        events: events to locate in addition to the built-in ones.
        progress: function called with a `tmsopt.Progress` now and then.

    Raises:
        InputError: for an unknown pattern, equations that do not leave a curve, options out of range, or an event whose
            function raises or returns no finite number.

    Example:
        >>> swing = tmsopt.models.from_coefficients([1, "c", "k"])  # EP2 where c² = 4 k
        >>> (branch,) = tmsopt.trace(tmsopt.Problem(swing, free={"c": (0.1, 2), "k": (0.1, 1)}), "EP2").branches
        >>> bool(abs(branch.parameters["c"] ** 2 - 4 * branch.parameters["k"]).max() < 1e-12)
        True

    More: docs/how_to/tracing.md
    """
    started = time.perf_counter()
    problem, checked_events = locate_pattern(pose(problem), pattern), check_events(events)
    counts = ("starts", starts, 0, MOST_STARTS), ("seed", seed, 0, None), ("most", most, _MIN_POINTS, None)
    check_options(problem, step, *counts, through=through, progress=progress)
    steps = start_steps(progress, f"tracing {problem.locate}", "start")
    setup = prepare_tracing(problem)
    walks: list[Walk] = []
    tried_starts = 0

    def find_points() -> Iterator[list[Array]]:
        nonlocal tried_starts
        for count, seeds in chain(find_seeds(setup, starts, seed, through, walks), find_missed_seeds(setup, walks)):
            tried_starts = max(tried_starts, count)
            if steps:
                steps(tried_starts, max(tried_starts, starts), f"{len(walks)} branch{'es' * (len(walks) != 1)}")
            yield seeds

    walk_new_curves(setup.curve, find_points(), step, most, walks)
    with np.errstate(all="ignore"):  # values near infinity may not be finite
        # a branch with the residual nan is left out
        branches = [b for w in walks for b in make_branches(setup, w, checked_events) if b.residual <= _MAX_RESIDUAL]
    branches.sort(key=lambda b: -float(b.arclength[-1]))
    seconds = time.perf_counter() - started
    return Trace(
        problem.problem, str(problem.locate), tuple(branches), tried_starts, seconds, sum(w.seconds for w in walks)
    )


def locate_pattern(problem: Posed, name: str | None) -> Posed:
    """The problem with the pattern as its only objective.

    Raises:
        InputError: for an unknown pattern, or if the pattern does not leave one degree of freedom.
    """
    name = name or problem.locate
    names = patterns_of(problem.model)
    if name is None:
        message = f"no pattern to trace; name one, or set locate in the problem. accepted: {' '.join(names)}"
        raise input_error(message, "objective", "locate")
    try:
        name = pattern_of(problem.model, str(name)).name
    except ValueError as error:
        reason = "" if str(error).endswith("is no pattern") else f": {error}"
        message = f"unknown pattern '{name}'{reason}; {suggest(str(name), names)}"
        raise input_error(message, "objective", "locate") from error
    problem_with_pattern = problem.derive(locate=name, minimize=None, maximize=None)
    freedom = degrees_of_freedom(problem_with_pattern)
    if freedom.count > 1 or (freedom.count < 1 and not _has_curve(problem_with_pattern)):
        free, needed_count = ", ".join(problem.free) or "none", freedom.conditions + 1
        advice = (
            f"free {needed_count - freedom.free} more"
            if freedom.count < 1
            else f"fix {freedom.count - 1} of them, or add as many == constraints"
        )
        message = (
            f"a curve of {name} needs {needed_count} free parameters ({freedom.describe_conditions()}, and one to move "
            f"along), found {freedom.free} ({free}); {advice}"
        )
        raise input_error(message, "parameters")
    return problem_with_pattern


def _has_curve(problem: Posed) -> bool:
    """Whether the chains have a curve although the problem counts too many conditions, because some are dependent."""
    if not has_chain_curve(problem) or not problem.free:
        return False
    setup, walks = prepare_tracing(problem), list[Walk]()
    seeds = (points for _, points in find_seeds(setup, _FEW_STARTS, 0, (), walks))
    walk_new_curves(setup.curve, seeds, STEP, _MIN_POINTS, walks)
    return bool(walks)


def check_options(
    problem: Posed, step: Any, *counts: tuple[str, Any, int, int | None], through: Any = (), progress: Any = None
) -> None:
    """Check the options of a trace.

    Args:
        counts: for each count, its name, its value, and its smallest and largest accepted value.

    Raises:
        InputError: with all faults.
    """
    faults = [fault for count in counts for fault in count_faults(*count)]
    faults += [*callback_faults("progress", progress), *list_faults("through", through, _DESIGN_EXAMPLE)]
    if not is_number(step) or not STEP_RANGE[0] <= step <= STEP_RANGE[1]:
        faults.append(
            Fault(f"found {step!r}; accepted: a number from {STEP_RANGE[0]:g} to {STEP_RANGE[1]:g}", ("step",))
        )
    for design in through if not faults else ():
        if design_faults := table_faults("through", design, _DESIGN_EXAMPLE):
            faults += design_faults
        elif set(design) != set(problem.free):
            names = ", ".join(problem.free)
            faults.append(Fault(f"found {', '.join(design) or 'nothing'}; accepted: each of {names}", ("through",)))
        else:
            for n, (low, high) in problem.free.items():
                if not is_number(design[n]) or not low <= design[n] <= high:
                    message = f"{n} = {short(design[n])} lies outside the box; accepted: {low:g} to {high:g}"
                    faults.append(Fault(message, ("through",)))
    if faults:
        raise InputError(faults)


STEP_RANGE = (1e-6, 0.1)
"""Smallest and largest `step`."""

_DESIGN_EXAMPLE = "{'Fr': 1.2, 'mu': 0.1}"
_FEW_STARTS = 6  # designs from which a curve is searched that has more conditions than the problem counts
_MIN_POINTS = 4  # smallest accepted `most`
_MAX_RESIDUAL = 1e-3  # largest mismatch of a coefficient on a curve of the pattern
