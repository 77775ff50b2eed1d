"""Narrow optima: is what `solve` calls optimal the best known, where the best basin is narrow or hidden?"""

import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from tqdm import tqdm

from benchmarks.reports.tables import Asked, facts, median, page, table
from benchmarks.suites.narrow_optima import FAMILIES, hidden
from benchmarks.timing import over_processes
from tmsopt import solve

BEATEN, LEAST = 1e-6, 1e-3
"""Relative difference from the best known that makes an optimum false, and the least value that it is relative to."""


@dataclass(frozen=True)
class Answer:
    """A solve at default settings.

    Attributes:
        excess: over the best known, relative.
        sure: the words of its starts.
    """

    name: str
    status: str
    value: float
    known: float
    excess: float
    sure: str
    seconds: float

    @property
    def false(self) -> bool:
        """Whether it is called optimal and beaten."""
        return self.status == "optimal" and self.excess > BEATEN

    @property
    def honest(self) -> bool:
        """Whether it says that a better one is to be expected."""
        return "better" in self.sure


def answer(index: int, seed: int) -> Answer:
    """The solve of one problem, from its file."""
    problem = hidden()[index]
    known = problem.value
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "problem.toml")
        path.write_text(problem.text, encoding="utf-8")
        began = time.process_time()
        found = solve(path, throw=False, seed=seed, stability=0.0)
        seconds = time.process_time() - began
    excess = problem.sign * (found.value - known) / max(LEAST, abs(known))
    return Answer(problem.name, found.status, found.value, known, excess, ", ".join(found.starts.sureness), seconds)


def report(asked: Asked) -> str:
    """The report in Markdown."""
    kept = list(hidden())
    indices = kept[:: max(1, len(kept) // asked.of(len(kept), 6))]
    every = over_processes(partial(answer, seed=0), indices, asked.workers)
    return page("Narrow optima", asked, *parts(list(tqdm(every, "narrow optima", len(indices)))))


def parts(answers: list[Answer]) -> Iterator[str]:
    """Counts by family, and every false optimum."""
    rows = []
    for family in FAMILIES:
        some = [a for a in answers if a.name.startswith(family)]
        false = [a for a in some if a.false]
        no = sum(a.status != "optimal" for a in some)
        better = sum(a.excess < -BEATEN for a in some)
        rows.append(
            (family, len(some), len(false), sum(a.honest for a in false), no, better, median(a.seconds for a in some))
        )
    yield facts([("problems", len(answers)), ("**false optima**", sum(a.false for a in answers))])
    yield (
        "*Gains*: two gains in boxes 50 to 80 wide, three roots meet where one is within 0.3 of zero. *Plateaus*: the "
        "damping ratio, −1 in at least 97 % of the box. *Wells*: five to twelve of `exp(-30*…)` to `exp(-80*…)` in two "
        "or three parameters. The best known come from samples, differential evolution and Nelder–Mead on NumPy's "
        f"eigenvalues. An optimum is false if that beats it by more than {BEATEN:.0e}, whatever it says of its starts."
    )
    yield table(
        ("family", "problems", "false", "of these with a doubt", "not optimal", "better than known", "median time"),
        rows,
    )
    yield table(
        ("problem", "value", "best known", "its starts"),
        [(a.name, f"{a.value:.8g}", f"{a.known:.8g}", a.sure) for a in answers if a.false],
        "No false optimum.",
    )
