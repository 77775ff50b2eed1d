"""Section *statements*: cases of each kind that tmsopt could get wrong, before and after."""

import os
import pkgutil
from concurrent.futures import ProcessPoolExecutor
from functools import cache, partial
from importlib import import_module
from pathlib import Path

from benchmarks.reports.tables import Asked
from benchmarks.suites import statements
from benchmarks.suites.statements.case import Case, verdict

HERE = Path(__file__).parents[2]


@cache
def kinds() -> dict[str, tuple[Case, ...]]:
    """Kind → its cases."""
    names = sorted(m.name for m in pkgutil.iter_modules(statements.__path__) if m.name != "case")
    found = {name: import_module(f"{statements.__name__}.{name}") for name in names}
    return {name: module.CASES for name, module in found.items() if hasattr(module, "CASES")}


def report(asked: Asked) -> str:
    """The table; `TMSOPT_BEFORE` is an earlier checkout to compare with, `TMSOPT_KINDS` names kinds by commas."""
    before, chosen = os.environ.get("TMSOPT_BEFORE"), os.environ.get("TMSOPT_KINDS")
    lines = ["## Statements", "", "| kind | cases | true before | true now |", "| --- | --- | --- | --- |"]
    false: list[str] = []
    with ProcessPoolExecutor(asked.workers) as pool:  # mpmath has one precision for all threads
        for kind, cases in kinds().items():
            if chosen and kind not in chosen.split(","):
                continue
            some = cases[: asked.count or (3 if asked.quick else None)]
            now = list(pool.map(partial(_verdict, kind, HERE), range(len(some))))
            then = list(pool.map(partial(_verdict, kind, Path(before)), range(len(some)))) if before else None
            true = sum(not v for v in then) if then else "not run"
            lines.append(f"| {kind} | {len(some)} | {true} | {sum(not v for v in now)} |")
            false += [f"- {kind}, {c.name}: {v} (truth: {c.truth})" for c, v in zip(some, now, strict=True) if v]
    return "\n".join([*lines, "", "### False now", "", *(false or ["None."])])


def _verdict(kind: str, checkout: Path, index: int) -> str:
    return verdict(kinds()[kind][index], checkout)
