"""The least abscissa that anybody reached on each random design, looked for in every way there is.

What a global bound is judged against: none may lie above a value that a feasible design has. Therefore a value counts
only with its design, which the judge must find feasible, and the abscissa of the parameters exactly as stored stands
beside it.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import click
from tqdm import tqdm

from benchmarks.judges import EXACT, MET, Attempt, attempt, confirmed, same, started_at, verdict
from benchmarks.reports.tables import Asked, facts, origin, page
from benchmarks.rivals import differential, least_violation
from benchmarks.suites import REFERENCES, SEED, Reference, random_problem, read, references, write
from benchmarks.timing import over_processes
from tmsopt import Problem
from tmsopt.evaluation import realised_abscissa

FEW = 64
"""Starts where the default solve says that nothing is feasible: the evolutions check that claim better than starts."""


@dataclass(frozen=True)
class Settings:
    """What the values depend on, besides the versions.

    Attributes:
        seed: of the problems.
        starts: of the long run, all of them tried, with seed 1.
        evolutions: seeds of the vectorised differential evolution, from 0.
    """

    seed: int = SEED
    starts: int = 500
    evolutions: int = 3


def reference(index: int, settings: Settings) -> Reference:
    """Everything that might do well on one problem, judged."""
    problem = random_problem(index, settings.seed)
    default = attempt("default", problem)
    claimed = default.status == "infeasible"
    starts = min(FEW, settings.starts) if claimed else settings.starts
    ends = [differential(problem, seed).parameters for seed in range(settings.evolutions)]
    if claimed:
        ends.append(least_violation(problem).parameters)
    attempts = [default, attempt("starts", problem, starts=starts, seed=1, exhaustive=not claimed)]
    attempts += [attempt("from evolution", started_at(problem, end), starts=1) for end in ends]
    return best_of(problem, index, attempts, ends)


class _Reached(NamedTuple):
    source: str
    value: float
    violation: float
    parameters: Mapping[str, float]


def best_of(
    problem: Problem, index: int, attempts: Sequence[Attempt], ends: Sequence[Mapping[str, float]]
) -> Reference:
    """The least value at a feasible design; of those that agree with it, the design that violates least."""
    good = [a.optimal and a.violation <= MET and confirmed(problem, a.parameters, a.value) for a in attempts]
    solved = [_Reached(a.source, a.value, a.violation, a.parameters) for a in attempts]
    evolved = [_ended(problem, end) for end in ends]
    feasible = [r for r, counts in zip(solved, good, strict=True) if counts]
    feasible += [r for r in evolved if r.violation <= EXACT and math.isfinite(r.value)]
    doubtful = {a.source for a, counts in zip(attempts, good, strict=True) if a.optimal and not counts}
    if feasible:
        least = min(r.value for r in feasible)
        best = min((r for r in feasible if same(r.value, least)), key=lambda r: (r.violation, r.value))
    else:
        best = min((*solved, *evolved), key=lambda r: r.violation)
    known = {s: min(r.value for r in feasible if r.source == s) for s in dict.fromkeys(r.source for r in feasible)}
    return Reference(
        index=index,
        solvable=bool(feasible),
        value=best.value if feasible else math.nan,
        realised=realised_abscissa(problem.posed, problem.posed.ordered(best.parameters)) if feasible else math.nan,
        violation=best.violation,
        parameters=problem.posed.ordered(best.parameters),
        known=known,
        doubtful=tuple(sorted(doubtful)),
    )


def _ended(problem: Problem, end: Mapping[str, float]) -> _Reached:
    """An evolution's end; eigenvalues may flatter a design beside a multiple root by 1e-4, isolated roots do not."""
    design = problem.posed.ordered({n: end[n] for n in problem.free})
    return _Reached("evolution", realised_abscissa(problem.posed, design), verdict(problem, design).violation, design)


def run(count: int, settings: Settings, workers: int, path: Path, command: str) -> dict[int, Reference]:
    """All problems that are not in the file yet, which is written anew after each.

    Raises:
        click.UsageError: where the file is of other settings.
    """
    kept = read(path)
    if kept and kept["settings"] != asdict(settings):
        raise click.UsageError(f"{path} was made with {kept['settings']}, asked is {asdict(settings)}; move it aside")
    found = references(path)
    missing = [i for i in range(count) if i not in found]
    for one in tqdm(
        over_processes(partial(reference, settings=settings), missing, workers),
        "references",
        count,
        unit="problem",
        initial=count - len(missing),
    ):
        found[one.index] = one
        write(path, {"origin": origin(command), "settings": asdict(settings)}, "problems", found.values())
    return found


def report(asked: Asked) -> str:
    """What is missing in the file, computed; who reached the values."""
    settings = Settings(asked.seed, 4, 1) if asked.quick else Settings(asked.seed)
    path = REFERENCES if asked.seed == SEED else REFERENCES.with_stem(f"references_{asked.seed}")
    with TemporaryDirectory() as folder:
        place = Path(folder) / path.name if asked.quick else path
        found = run(asked.of(200, 2), settings, asked.workers, place, asked.command).values()
    solvable = [one for one in found if one.solvable]
    rows: list[tuple[str, object]] = [("problems", len(found)), ("solvable", len(solvable))]
    rows += [
        (f"of these, reached by {source}", sum(source in one.by for one in solvable))
        for source in ("default", "starts", "evolution", "from evolution")
    ]
    rows += [("claims not confirmed", {one.index: one.doubtful for one in found if one.doubtful} or "none")]
    return page("Best values of the random designs", asked, facts(rows), f"Kept in `{path}`.")
