"""Hard problems: is what `solve` calls optimal the best known, and has what it calls infeasible no feasible design?"""

import math
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from tqdm import tqdm

from benchmarks.judges import SCALE, SOLVED, Designs, exactly
from benchmarks.reports.designs.hard_references import path_of, run
from benchmarks.reports.tables import Asked, facts, median, page, table
from benchmarks.suites import HARD_COUNT, HARD_SEED, Target, hard_family, hard_problem, targets
from benchmarks.timing import over_processes
from tmsopt import Problem, solve

CLAIMED = 1e-8
"""Violation that a claimed design may have: ten times what the package allows itself."""

UNBOUNDED = 1e6
"""Best known objective beyond which there is no best design."""

SINGULAR = 1e-7
"""Of the median of |a0| in the box: below it, a mass matrix that the best known design wants to be singular."""

RIGHT, OPTIMAL, INFEASIBLE = "right", "false optimal", "false infeasible"
UNANSWERED, CRASHED = "unanswered", "crashed"
LABELS = (RIGHT, OPTIMAL, INFEASIBLE, UNANSWERED, CRASHED)


@dataclass(frozen=True)
class Verdict:
    """One solve at default settings, and what is known of the problem.

    Attributes:
        label: one of `LABELS`.
        why: what is wrong with it, empty where it is right.
        excess: of the claimed value over the best known, relative to that or to `SCALE`; nan where there is none.
        better: whether the claim is confirmed, and better than the reference.
        seconds: of the processor.
        target: the reference.
    """

    index: int
    family: str
    label: str
    why: str
    status: str
    value: float
    design: Mapping[str, float]
    excess: float
    better: bool
    seconds: float
    notes: Sequence[str]
    target: Target


def judged(index: int, seed: int, target: Target) -> Verdict:
    """A solve of one problem with default settings, judged."""
    problem = hard_problem(index, seed)
    began = time.process_time()
    nothing = Verdict(index, hard_family(index), CRASHED, "", "", math.nan, {}, math.nan, False, 0.0, (), target)
    try:
        solution = solve(problem, throw=False)
    except Exception as error:
        why = f"{type(error).__name__}: {error}"[:200]
        return replace(nothing, why=why, seconds=time.process_time() - began)
    design = {n: float(solution.parameters[n]) for n in problem.free}
    own = replace(
        nothing,
        status=solution.status,
        value=float(solution.value),
        design=design,
        seconds=time.process_time() - began,
        notes=tuple(solution.notes),
    )
    match solution.status:
        case "optimal":
            return _optimal(problem, own)
        case "infeasible":
            least = f"feasible at {target.value:.9g}, violation {target.violation:.0e}"
            return replace(own, label=INFEASIBLE, why=least) if target.solvable else replace(own, label=RIGHT)
        case _:
            honest = bool(solution.notes) and (open_ended(problem, target) or _surpassed(problem, own))
            return replace(own, label=RIGHT) if honest else replace(own, label=UNANSWERED, why=_unanswered(target))


def _surpassed(problem: Problem, own: Verdict) -> bool:
    """Whether a design that is said not to be the best is what it claims to be, and better than the best known."""
    if confirmed_value(problem, own.design, own.value):
        return False
    return not own.target.solvable or problem.posed.sign * (own.value - own.target.value) <= SOLVED * SCALE


def open_ended(problem: Problem, target: Target) -> bool:
    """Whether there is no best design: the best known has no bound, or all but no mass."""
    if not target.solvable or abs(target.value) > UNBOUNDED:
        return target.solvable
    at = Designs(problem)
    lower, upper = at.lower[:, None], at.upper[:, None]
    some = lower + (upper - lower) * np.random.default_rng(0).random((len(lower), 500))
    x = np.concatenate([some, np.array([[target.design[n]] for n in at.names])], axis=1)
    leading = np.abs(at.coefficients(at.values(x), x.shape[1])[:, 0])
    return bool(leading[-1] < SINGULAR * np.nanmedian(leading))


def _unanswered(target: Target) -> str:
    return f"best known {target.value:.9g}" if target.solvable else "no feasible design known"


def _optimal(problem: Problem, own: Verdict) -> Verdict:
    claim = confirmed_value(problem, own.design, own.value)
    if claim:
        return replace(own, label=OPTIMAL, why=claim)
    best = own.target.value
    if not own.target.solvable:
        return replace(own, label=RIGHT, better=True)
    excess = problem.posed.sign * (own.value - best) / max(SCALE, abs(best))
    label, why = (OPTIMAL, f"{excess:.1e} off the best known") if excess > SOLVED else (RIGHT, "")
    return replace(own, label=label, why=why, excess=excess, better=excess < -SOLVED)


def confirmed_value(problem: Problem, design: Mapping[str, float], claimed: float) -> str:
    """What is wrong with a claim, by isolated roots; those of a multiple root that the design rounds count too."""
    found = list(exactly(problem, design))
    feasible = [one for one in found if one.violation <= CLAIMED]
    if not feasible:
        return f"violates by {min(one.violation for one in found):.1e}"
    if any(abs(one.value - claimed) <= SOLVED * max(SCALE, abs(claimed)) for one in feasible):
        return ""
    return f"claims {claimed:.9g}, is {feasible[0].value:.9g}"


def judge_all(
    seed: int = HARD_SEED,
    indices: Iterable[int] = range(HARD_COUNT),
    workers: int = 1,
    known: Mapping[int, Target] | None = None,
) -> list[Verdict]:
    """Solves of all of them that have a reference, in as many processes as there are workers."""
    kept = targets(path_of(seed)) if known is None else known
    wanted = [i for i in indices if i in kept]
    every = over_processes(partial(_one, seed=seed), [kept[i] for i in wanted], workers)
    return list(tqdm(every, "hard problems", len(wanted)))


def _one(target: Target, seed: int) -> Verdict:
    return judged(target.index, seed, target)


def report(asked: Asked) -> str:
    """The report in Markdown."""
    indices = range(asked.of(HARD_COUNT, 3))
    known = run(indices, asked.seed, asked.workers, asked.command)
    return page("Hard problems", asked, *parts(judge_all(asked.seed, indices, min(asked.workers, 2), known)))


def parts(verdicts: Sequence[Verdict]) -> Iterator[str]:
    """Counts, a table by family, and every failure."""
    counts = {label: sum(v.label == label for v in verdicts) for label in LABELS}
    solvable = [v for v in verdicts if v.target.solvable or v.better]
    yield facts(
        [
            ("problems", len(verdicts)),
            ("with a feasible design", len(solvable)),
            *((f"**{label}**", count) for label, count in counts.items()),
            ("optimal, confirmed, and better than the reference", sum(v.better for v in verdicts)),
            ("median time", median(v.seconds for v in verdicts)),
            ("90 % of times below", median((v.seconds for v in verdicts), 0.9)),
            ("longest", median((v.seconds for v in verdicts), 1.0)),
        ]
    )
    yield (
        "References of seeds 1 to 3 come from samples, differential evolution and SLSQP on eigenvalues, those of other "
        "seeds from differential evolution, all without the package. They count if they violate nothing by more than "
        f"1e-9 by isolated roots. Right is an optimum that is what it claims to be, within {SOLVED:.0e} of the best "
        f"known, relative to it or to {SCALE}; infeasible where no feasible design is known; no optimum, with a note, "
        "where the best known has no bound or a singular mass matrix, or is surpassed. Times are CPU times."
    )
    names = dict.fromkeys(hard_family(i) for i in range(HARD_COUNT))
    rows = [
        (name, len(some), *(sum(v.label == label for v in some) for label in LABELS), median(v.seconds for v in some))
        for name in names
        if (some := [v for v in verdicts if v.family == name])
    ]
    yield table(("family", "problems", *LABELS, "median time"), rows)
    yield "### Failures"
    failures = [
        (
            v.index,
            v.family,
            v.label,
            f"{v.value:.10g}",
            f"{v.target.value:.10g}",
            v.why,
            f"{v.seconds:.2g} s",
            ", ".join(f"{n}={x:.6g}" for n, x in v.target.design.items()),
        )
        for v in verdicts
        if v.label != RIGHT
    ]
    header = ("problem", "family", "label", "value", "best known", "why", "time", "design of the reference")
    yield table(header, failures, "None.")
