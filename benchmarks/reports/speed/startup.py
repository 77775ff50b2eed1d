"""How long Python takes until tmsopt is there, beside what it cannot do without."""

import subprocess
import sys
from collections.abc import Mapping
from functools import partial

from benchmarks.reports.tables import Asked, duration, page, table, times
from benchmarks.suites import PROBLEMS
from benchmarks.timing import best

_MAIN = "from tmsopt.cli import main; main()"

PYTHON = "python -c pass"
COMMANDS: Mapping[str, tuple[str, ...]] = {
    PYTHON: ("pass",),
    "import numpy": ("import numpy",),
    "import casadi": ("import casadi",),
    "import scipy.optimize": ("import scipy.optimize",),
    "import tmsopt": ("import tmsopt",),
    "import tmsopt; tmsopt.solve": ("import tmsopt; tmsopt.solve",),
    "tmsopt --help": (_MAIN, "--help"),
    "tmsopt solve problems/ep4.toml --json": (_MAIN, "solve", "problems/ep4.toml", "--json"),
}
"""By name: what follows ``python -c``."""


def start(arguments: tuple[str, ...]) -> None:
    """A new interpreter, until it has ended.

    Raises:
        subprocess.CalledProcessError: when it ended badly.
    """
    subprocess.run([sys.executable, "-c", *arguments], cwd=PROBLEMS.parent, check=True, capture_output=True)


def report(asked: Asked) -> str:
    """The report in Markdown."""
    works = {name: partial(start, given) for name, given in COMMANDS.items()}
    for work in works.values():  # compiled files and the disk's cache are nobody's time
        work()
    repeats = 2 if asked.quick else 10
    seconds = best(works, repeats)
    python, casadi = seconds[PYTHON], seconds["import casadi"]
    rows = [(f"`{n}`", duration(s), times(s / python), times(s / casadi)) for n, s in seconds.items()]
    note = f"The least of {repeats} rounds, in which all take turns, each in a new process with its files in memory."
    header = ("in a new process", "time", f"`{PYTHON}` = 1", "`import casadi` = 1")
    return page("Start-up", asked, table(header, rows), note)
