"""Section (e): how long Python takes until tmsopt is there, beside what it cannot do without."""

import subprocess
import sys
from collections.abc import Mapping
from functools import partial
from pathlib import Path

from benchmarks.reports.tables import origin, table
from benchmarks.timing import best, duration, times

_ROOT = Path(__file__).parents[3]
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
    "tmsopt solve problems/ep4.toml --brief": (_MAIN, "solve", "problems/ep4.toml", "--brief"),
}
"""By name: what follows ``python -c``."""


def start(arguments: tuple[str, ...]) -> None:
    """A new interpreter, until it has ended.

    Raises:
        subprocess.CalledProcessError: when it ended badly.
    """
    subprocess.run([sys.executable, "-c", *arguments], cwd=_ROOT, check=True, capture_output=True)


def section(command: str, quick: bool = False) -> str:
    """The report in Markdown."""
    works = {name: partial(start, given) for name, given in COMMANDS.items()}
    for work in works.values():  # compiled files and the disk's cache are nobody's time
        work()
    repeats = 2 if quick else 10
    seconds = best(works, repeats)
    rows = [(f"`{n}`", duration(s), times(s / seconds[PYTHON]), times(s / seconds["import casadi"]))
            for n, s in seconds.items()]  # fmt: skip
    note = f"The least of {repeats} rounds, in which all take turns, each in a new process with its files in memory."
    header = ("in a new process", "time", f"`{PYTHON}` = 1", "`import casadi` = 1")
    return "\n\n".join(["## Start-up", origin(command), table(header, rows), note]) + "\n"
