"""Section *statements*: cases of each kind that tmsopt could get wrong; ``--count`` limits those of each kind."""

from concurrent.futures import ProcessPoolExecutor

from tqdm import tqdm

from benchmarks.reports.tables import Asked, page, table
from benchmarks.suites.statements import Case, cases, find_false


def report(asked: Asked) -> str:
    """How many statements of each kind are true, and what is false."""
    kinds: dict[str, list[Case]] = {}
    for case in cases():
        kinds.setdefault(case.kind, []).append(case)
    some = [case for every in kinds.values() for case in every[: asked.of(len(every), 3)]]
    with ProcessPoolExecutor(asked.workers) as pool:  # mpmath has one precision for all threads
        answers = list(tqdm(pool.map(find_false, some), "statements", len(some)))
    false = [(case.kind, case.name, words) for case, words in zip(some, answers, strict=True) if words]
    counts = [[c.kind for c in some].count(kind) for kind in kinds]
    rows = [(kind, n, n - sum(kind == wrong for wrong, *_ in false)) for kind, n in zip(kinds, counts, strict=True)]
    return page(
        "Statements that a closed form can refute",
        asked,
        table(("kind", "cases", "true"), rows),
        "### False",
        table(("kind", "case", "what is false"), false, "None."),
    )
