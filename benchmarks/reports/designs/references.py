"""The least abscissa that anybody reached on each random design: ``python -m benchmarks.references``.

What a global bound is judged against: none may lie above a value that a feasible design has. Therefore a value counts
only with its design, which the judge of `benchmarks.judges.grid` must find feasible, and the abscissa of the parameters
exactly as stored stands beside it.
"""

import json
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from itertools import combinations
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import click
import flint
import numpy as np
from tqdm import tqdm

from benchmarks.judges.grid import verdict
from benchmarks.reports.designs.random_designs import EXACT, started_at
from benchmarks.reports.designs.varied_designs import Attempt, attempt
from benchmarks.reports.tables import origin
from benchmarks.rivals.reduced import differential
from benchmarks.suites.conflicts import least_violation
from benchmarks.suites.random_designs import SEED, random_problem
from tmsopt.checks.recheck import FEASIBLE, realised_abscissa
from tmsopt.design.problem import Problem
from tmsopt.roots import exact_roots

PATH = Path("benchmarks/suites/references.json")
"""Where the values are kept."""

FEW = 64
"""Starts where the default solve says that nothing is feasible: the evolutions check that claim better than starts."""

SAME = 1e-8
"""Relative difference up to which two values count as the same."""

ROUNDED = 1e-10
"""Relative change of a coefficient that rounding of the parameters may explain, cancellation included."""

_DIGITS = 120  # products of five doubles are exact, and the tangent is right far beyond the answer
_FLOOR = 1e-3  # of |value| in relative differences: an abscissa near 0 has no scale of its own


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


@dataclass(frozen=True)
class Reference:
    """The best that is known of one random problem.

    Attributes:
        solvable: whether a feasible design is known.
        value: its abscissa; at an exceptional point that of the ideal design, as `solve` reports it; nan without one.
        realised: abscissa of the parameters exactly as stored, from isolated roots; no true bound lies above it,
            but for the violation.
        violation: largest, relative to the size of the two sides, by the judge; the least known where none is feasible.
        parameters: of that design; all seven.
        known: source → least value it reached at a feasible design: ``default``, ``starts``, ``evolution`` (its own
            end, if it is feasible within 1e-12), ``from evolution`` (solved from that end).
        doubtful: sources that claimed an optimum that the judge does not confirm.
    """

    index: int
    solvable: bool
    value: float
    realised: float
    violation: float
    parameters: Mapping[str, float]
    known: Mapping[str, float]
    doubtful: tuple[str, ...] = ()

    @property
    def by(self) -> tuple[str, ...]:
        """Who reached the value."""
        return tuple(source for source, value in self.known.items() if _same(value, self.value))


def references(path: Path = PATH) -> dict[int, Reference]:
    """Index → what is known, as kept in the file; empty where there is none."""
    return {row["index"]: _reference(row) for row in _read(path).get("problems", [])}


def reference(index: int, settings: Settings) -> Reference:
    """Everything that might do well on one problem, judged."""
    problem = random_problem(index, settings.seed)
    default = attempt("default", problem)
    claimed = default.status == "infeasible"
    starts = min(FEW, settings.starts) if claimed else settings.starts
    ends = [differential(problem, seed, vectorized=True).parameters for seed in range(settings.evolutions)]
    if claimed:
        ends.append(least_violation(problem).parameters)
    attempts = [default, attempt("starts", problem, starts=starts, seed=1, exhaustive=not claimed)]
    attempts += [attempt("from evolution", started_at(problem, end), starts=1) for end in ends]
    return best_of(problem, index, attempts, ends)


@dataclass(frozen=True)
class _Reached:
    source: str
    value: float
    violation: float
    parameters: Mapping[str, float]


def best_of(
    problem: Problem, index: int, attempts: Sequence[Attempt], ends: Sequence[Mapping[str, float]]
) -> Reference:
    """The least value at a feasible design; of those that agree with it, the design that violates least."""
    good = [a.status == "optimal" and a.violation <= FEASIBLE and confirmed(problem, a) for a in attempts]
    solved = [_Reached(a.source, a.value, a.violation, a.parameters) for a in attempts]
    evolved = [_ended(problem, end) for end in ends]
    feasible = [r for r, counts in zip(solved, good, strict=True) if counts]
    feasible += [r for r in evolved if r.violation <= EXACT and math.isfinite(r.value)]
    doubtful = {a.source for a, counts in zip(attempts, good, strict=True) if a.status == "optimal" and not counts}
    if feasible:
        least = min(r.value for r in feasible)
        best = min((r for r in feasible if _same(r.value, least)), key=lambda r: (r.violation, r.value))
    else:
        best = min((*solved, *evolved), key=lambda r: r.violation)
    known = {s: min(r.value for r in feasible if r.source == s) for s in dict.fromkeys(r.source for r in feasible)}
    return Reference(
        index=index,
        solvable=bool(feasible),
        value=best.value if feasible else math.nan,
        realised=realised_abscissa(problem, problem.ordered(best.parameters)) if feasible else math.nan,
        violation=best.violation,
        parameters=problem.ordered(best.parameters),
        known=known,
        doubtful=tuple(sorted(doubtful)),
    )


def confirmed(problem: Problem, claim: Attempt) -> bool:
    """Whether the claimed value is that of the design, or of an exceptional point that the design rounds.

    The grant of the judge is not enough here: it is what rounding of coefficients does to eigenvalues of the stored
    design, and where rounded parameters already took that away from the point, further rounding does little.
    """
    return any(_same(claim.value, v) for v in abscissae_near(problem, claim.parameters))


def abscissae_near(problem: Problem, design: Mapping[str, float]) -> list[float]:
    """Abscissa of a design as stored, and of polynomials with a multiple root whose coefficients it rounds.

    Roots whose sum is real, or two pairs, are put into their mean; that counts if it changes no coefficient by more
    than `ROUNDED`, relative to the sum of the absolute products in it. Isolated roots of the exact coefficients.
    """
    with flint.ctx.workdps(_DIGITS):
        exact = {n: flint.arb(v) for n, v in problem.ordered({n: design[n] for n in problem.free}).items()}
        found = exact_roots(problem.model.coefficients(exact, problem.parameter_set))
    z = np.array([complex(r.re, r.im) for r in found for _ in range(r.multiplicity)])
    groups = [list(g) for k in (2, 3, 4) for g in combinations(range(len(z)), k)]
    merges = [[g] for g in groups if abs(z[g].sum().imag) <= 1e-14 * np.abs(z).max()]  # conjugates come together
    merges.append([np.flatnonzero(z.imag > 0).tolist(), np.flatnonzero(z.imag < 0).tolist()])
    near = [float(z.real.max())]
    for merge in merges:
        merged = z.copy()
        for group in filter(None, merge):
            merged[group] = z[group].mean()
        if np.all(np.abs(np.poly(merged) - np.poly(z)) <= ROUNDED * np.poly(-np.abs(z))):
            near.append(float(merged.real.max()))
    return near


def _ended(problem: Problem, end: Mapping[str, float]) -> _Reached:
    """An evolution's end; eigenvalues may flatter a design beside a multiple root by 1e-4, isolated roots do not."""
    design = problem.ordered({n: end[n] for n in problem.free})
    return _Reached("evolution", realised_abscissa(problem, design), verdict(problem, design).violation, design)


def _same(value: float, best: float) -> bool:
    return abs(value - best) <= SAME * max(_FLOOR, abs(best))


def run(count: int, settings: Settings, workers: int, path: Path, command: str) -> dict[int, Reference]:
    """All problems that are not in the file yet, which is written anew after each.

    Raises:
        click.UsageError: where the file is of other settings.
    """
    kept = _read(path)
    if kept and kept["settings"] != asdict(settings):
        raise click.UsageError(
            f"{path} was made with {kept['settings']}, asked is {asdict(settings)}; name another file by --output"
        )
    found = references(path)
    missing = [i for i in range(count) if i not in found]
    for one in tqdm(
        _each(missing, settings, workers), "references", count, unit="problem", initial=count - len(missing)
    ):
        found[one.index] = one
        _write(path, settings, command, found)
    return found


def _each(indices: Sequence[int], settings: Settings, workers: int) -> Iterator[Reference]:
    if not indices:
        return  # processes take a second to begin
    with get_context("spawn").Pool(workers) as pool:  # ends its processes when interrupted
        yield from pool.imap_unordered(partial(reference, settings=settings), indices)


def _read(path: Path) -> dict[str, Any]:
    return dict(json.loads(path.read_text(encoding="utf-8"))) if path.exists() else {}


def _write(path: Path, settings: Settings, command: str, found: Mapping[int, Reference]) -> None:
    """One line per problem; the old file stays until the new one is complete."""
    rows = ",\n".join(json.dumps(_row(found[i]), allow_nan=False) for i in sorted(found))
    head = f'"origin": {json.dumps(origin(command))},\n"settings": {json.dumps(asdict(settings))}'
    draft = path.with_suffix(".part")
    draft.write_text(f'{{\n{head},\n"problems": [\n{rows}\n]\n}}\n', encoding="utf-8")
    os.replace(draft, path)


def _row(one: Reference) -> dict[str, Any]:
    return {n: None if isinstance(v, float) and math.isnan(v) else v for n, v in asdict(one).items()}


def _reference(row: Mapping[str, Any]) -> Reference:
    numbers = {n: math.nan if row[n] is None else row[n] for n in ("value", "realised", "violation")}
    return Reference(**{**row, **numbers, "doubtful": tuple(row["doubtful"])})


@click.command()
@click.option("--count", default=200, show_default=True, help="problems")
@click.option("--seed", default=SEED, show_default=True, help="of the problems")
@click.option("--starts", default=Settings.starts, show_default=True, help="of the long run, all of them tried")
@click.option("--evolutions", default=Settings.evolutions, show_default=True, help="differential evolutions of each")
@click.option("--workers", default=1, show_default=True, help="processes")
@click.option(
    "--output", type=click.Path(dir_okay=False, path_type=Path), default=PATH, show_default=True,
    help="file that keeps the values; what is in it already is not computed again",
)  # fmt: skip
def main(count: int, seed: int, starts: int, evolutions: int, workers: int, output: Path) -> None:
    """Look for the least abscissa of each random design in every way there is, and keep it with its design."""
    settings = Settings(seed, starts, evolutions)
    command = f"python -m benchmarks.references --count {count} --seed {seed} --starts {starts}"
    command += f" --evolutions {evolutions}"
    found = run(count, settings, workers, output, command).values()
    solvable = [one for one in found if one.solvable]
    click.echo(f"{len(found)} problems, {len(solvable)} solvable; reached by:")
    for source in ("default", "starts", "evolution", "from evolution"):
        click.echo(f"  {source:14} {sum(source in one.by for one in solvable)}")
    doubtful = {one.index: one.doubtful for one in found if one.doubtful}
    click.echo(f"claims not confirmed: {doubtful or 'none'}")


if __name__ == "__main__":
    main()
