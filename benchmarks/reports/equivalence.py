"""Section *equivalence*: what the program says now, beside what it said before the house was made smaller."""

from collections import Counter

from benchmarks.reports.tables import Asked, page, table
from benchmarks.suites.equivalence import CASES, Difference, answer_all, compare, read_net

_SHOWN = 60  # cases whose differences are listed, and differences of one
_LINES = 3


def report(asked: Asked) -> str:
    """Cases of each group that say the same, and where the others differ; ``--count`` takes every so many-th case."""
    runs = read_net()
    step = max(1, len(CASES) // asked.of(len(CASES), 40))
    cases = [case for case in CASES if case.name in runs[0]][::step]
    now = answer_all(cases, workers=asked.workers)
    differences = {c.name: compare(c.name, [run[c.name] for run in runs], now[c.name]) for c in cases}
    same, whole = Counter(c.group for c in cases if not differences[c.name]), Counter(c.group for c in cases)
    rows = [(group, count, same[group]) for group, count in whole.items()]
    rows.append(("all", len(cases), sum(same.values())))
    lines = [f"- {line}" for found in list(filter(None, differences.values()))[:_SHOWN] for line in _lines(found)]
    about = (
        "The net holds the answers of commit a0cba0dd, run three times: twice with different arithmetic and once from "
        "another seed. A number is the same within 1e-9 of its size, or within ten times what the runs differ by; "
        "values of the stored doubles of a k-fold root within 1e-9 to the power 1/k."
    )
    return page("Equivalence", asked, about, table(("group", "cases", "the same"), rows), "\n".join(lines))


def _lines(found: list[Difference]) -> list[str]:
    more = len(found) - _LINES
    return [*(f"`{one}`" for one in found[:_LINES]), *([f"… and {more} more in {found[0].case}"] if more > 0 else [])]
