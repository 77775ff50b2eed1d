"""Section *fresh*: random problems of twelve families, judged by eigenvalues, evolution and 50 digits.

``TMSOPT_CACHE`` names a JSON file that keeps what is known of the problems; the answers are kept next to it, with the
ending ``.answers.json``. A run that was stopped goes on from both. ``TMSOPT_BEFORE`` names another checkout to judge.
"""

import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from benchmarks.reports.tables import Asked, page, table
from benchmarks.suites.fresh import COUNT, FAMILIES, KINDS, Cache, Problem, Verdict, ask, judge, known, problems

HERE = Path(__file__).parents[2]


def report(asked: Asked) -> str:
    """The tables: verdicts by family, and every failure."""
    path = Path(os.environ["TMSOPT_CACHE"]) if os.environ.get("TMSOPT_CACHE") else None
    references, answers = Cache(path), Cache(path.with_suffix(".answers.json") if path else None)
    checkout = Path(os.environ.get("TMSOPT_BEFORE", HERE))
    some = problems(asked.of(COUNT, 2))
    for problem in some:
        if problem.name not in references:
            references.keep(problem.name, known(problem))
    missing = [p for p in some if p.name not in answers]
    with ThreadPoolExecutor(asked.workers) as pool:
        for problem, said in zip(missing, pool.map(lambda p: ask(p, checkout), missing), strict=True):
            answers.keep(problem.name, said)
    verdicts = {p.name: _verdict(p, references[p.name], answers[p.name]) for p in some}
    header = [
        "family",
        "problems",
        "answered",
        *(f"false: {kind}" for kind in KINDS),
        "limits missed, as it says",
        "a better design is likely",
    ]
    rows = [_row(family, {n: v for n, v in verdicts.items() if n.split("/")[0] == family}) for family in FAMILIES]
    lines = [
        f"- {name}: {kind}: {words}{'; it says that a better design is likely' * v.doubtful}"
        for name, v in verdicts.items()
        for kind, words in v.false.items()
    ]
    silent = [f"- {name}: {v.answer}" for name, v in verdicts.items() if not v.answered]
    return page(
        "Fresh",
        asked,
        _ABOUT,
        table(header, [*rows, _row("all", verdicts)]),
        "### False",
        "\n".join(lines) or "None.",
        "### Without an answer",
        "\n".join(silent) or "None.",
    )


_ABOUT = (
    "The references share no code with tmsopt: eigenvalues by NumPy, SciPy's differential evolution and climbs from "
    "many designs, polishes by Nelder–Mead and SLSQP, 50 digits by mpmath. An optimum is false where a feasible design "
    "is better by 1e-6 of it; a limit is violated from 1e-9 of it on."
)


def _verdict(problem: Problem, reference: Mapping[str, Any], answer: Mapping[str, Any]) -> Verdict:
    """Of one problem; an answer that cannot be read counts as none."""
    try:
        return judge(problem, reference, answer)
    except (KeyError, TypeError, ValueError, ZeroDivisionError) as error:
        return Verdict(f"not judged: {type(error).__name__}: {error}", False)


def _row(name: str, verdicts: dict[str, Verdict]) -> list[object]:
    found = verdicts.values()
    false = [sum(kind in v.false for v in found) for kind in KINDS]
    return [
        name,
        len(verdicts),
        sum(v.answered for v in found),
        *false,
        sum(v.missed for v in found),
        sum(v.doubtful for v in found),
    ]
