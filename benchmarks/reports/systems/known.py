"""The best value that anybody reached on each random system: ``python -m benchmarks.known``."""

import json
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np
from tqdm import tqdm

from benchmarks.judges.exact import Evolved, confirmed, evolve, ideals, relative, values_of, violation, worth_of
from benchmarks.reports.designs.random_designs import started_at
from benchmarks.reports.tables import origin
from benchmarks.suites.random_systems import COUNT, System, random_system
from tmsopt import solve
from tmsopt.design.solution import Solution

PATH = Path("benchmarks/suites/oscillators.json")
"""Where the values are kept."""

STARTS = 32
"""Of the long run, all of them tried, with seed 1."""

_EVOLUTIONS = 1


@dataclass(frozen=True)
class Known:
    """The best that is known of one system.

    Attributes:
        value: of the objective, at a multiple root that of the ideal design.
        parameters: the free ones of that design.
        known: source → value it reached: ``starts``, ``from evolution`` (solved from the end of one), ``evolution``
            (the best of them, by isolated roots of the exact polynomial of its end).
        evaluations: of the eigenvalues, by the differential evolution with seed 0.
    """

    index: int
    value: float
    parameters: Mapping[str, float]
    known: Mapping[str, float]
    evaluations: int


def known(path: Path = PATH) -> dict[int, Known]:
    """Index → what is known, as kept in the file; empty where there is none."""
    rows = json.loads(path.read_text(encoding="utf-8"))["systems"] if path.exists() else []
    return {row["index"]: Known(**row) for row in rows}


def claimed(system: System, solution: Solution) -> tuple[float, dict[str, float]] | None:
    """Value and free parameters of a solution that the judges confirm; None for any other."""
    design = {n: float(solution.parameters[n]) for n in system.free}
    good = solution.status == "optimal" and confirmed(system, design, solution.value)
    return (solution.value, design) if good else None


def looked_for(index: int, starts: int = STARTS, evolutions: int = _EVOLUTIONS) -> Known:
    """Everything that might do well on one system, judged."""
    system = random_system(index)
    ends = [] if "locate" in system.goal else [evolve(system, seed) for seed in range(evolutions)]
    solved = [("starts", solve(system.problem, starts=starts, seed=1, exhaustive=True, throw=False))]
    solved += [("from evolution", solve(started_at(system.problem, e.parameters), starts=1, throw=False)) for e in ends]
    found = [(source, *good) for source, s in solved if (good := claimed(system, s)) is not None]
    found += [("evolution", *end) for e in ends if (end := _ended(system, e)) is not None]
    return _best(system, found, ends)


def _best(system: System, found: Sequence[tuple[str, float, dict[str, float]]], ends: Sequence[Evolved]) -> Known:
    least: dict[str, float] = {}
    for source, value, _ in found:
        least[source] = min((least.get(source, value), value), key=lambda v: system.sign * v)
    top = min(found, key=lambda f: system.sign * f[1], default=("", math.nan, {}))
    return Known(system.index, top[1], top[2], least, ends[0].evaluations if ends else 0)


def _ended(system: System, end: Evolved) -> tuple[float, dict[str, float]] | None:
    """An evolution's end by isolated roots, which do not flatter a design beside a multiple root."""
    design = dict(end.parameters)
    own = values_of(next(ideals(system, design)))
    return (worth_of(system, design, own), design) if float(violation(system, {**design, **own})) <= 0 else None


def keep(rows: Mapping[int, Known], command: str, path: Path = PATH) -> None:
    """One line per system; the old file stays until the new one is complete."""
    lines = ",\n".join(json.dumps(_row(rows[k])) for k in sorted(rows))
    draft = path.with_suffix(".part")
    draft.write_text(f'{{\n"origin": {json.dumps(origin(command))},\n"systems": [\n{lines}\n]\n}}\n', encoding="utf-8")
    os.replace(draft, path)


def _row(one: Known) -> dict[str, Any]:
    return asdict(one)


def better(system: System, one: Known, other: Known | None) -> Known:
    """Two looks at a system in one."""
    if other is None:
        return one
    found = [(s, v, dict(k.parameters)) for k in (one, other) for s, v in k.known.items() if np.isfinite(v)]
    best = min((one, other), key=lambda k: system.sign * k.value if math.isfinite(k.value) else math.inf)
    least = {s: min((v for t, v, _ in found if t == s), key=lambda v: system.sign * v) for s, _, _ in found}
    return Known(one.index, best.value, best.parameters, least, one.evaluations)


@click.command()
@click.option("--count", default=COUNT, show_default=True, help="systems")
@click.option("--starts", default=STARTS, show_default=True, help="of the long run, all of them tried")
@click.option("--again", is_flag=True, help="look again at those that are known, and keep the better")
@click.option("--output", type=click.Path(dir_okay=False, path_type=Path), default=PATH, show_default=True)
def main(count: int, starts: int, again: bool, output: Path) -> None:
    """Look for the best value of each random system in every way there is, and keep it with its design."""
    rows = known(output)
    command = f"python -m benchmarks.known --count {count} --starts {starts}"
    for index in tqdm([k for k in range(count) if again or k not in rows], "known", unit="system"):
        rows[index] = better(random_system(index), looked_for(index, starts), rows.get(index))
        keep(rows, command, output)
    for source in ("starts", "from evolution", "evolution"):
        near = [
            relative(random_system(k), r.known[source], r.value) <= 1e-8 for k, r in rows.items() if source in r.known
        ]
        click.echo(f"  {source:14} {sum(near)} of {len(rows)}")


if __name__ == "__main__":
    main()
