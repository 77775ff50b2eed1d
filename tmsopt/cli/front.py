"""The front of a file with several objectives, a part of `tmsopt solve`."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tmsopt.cli.common import answer, saving, write_report
from tmsopt.cli.ending import INTERRUPTED
from tmsopt.cli.terminal import shown

if TYPE_CHECKING:
    from tmsopt import Problem


def write_front(
    problem: "Problem", asked: dict[str, Any], as_json: bool, plot: Path | None, csv_file: Path | None, full: bool,
    file: Path, report: Path | None,
) -> None:  # fmt: skip
    """Find the front and write it where it is asked for.

    Raises:
        NotSolved: when an objective has no optimum.
    """
    import tmsopt

    front = tmsopt.pareto(problem, progress=shown(), **asked)
    answer(as_json, front.to_json, lambda: front.report(full))
    if csv_file is not None:
        with saving("--csv", csv_file):
            front.write_csv(csv_file)
    if plot is not None:
        with saving("--plot", plot):
            tmsopt.plots.save(tmsopt.plots.front_figure(front), plot)
    write_report(front, report, file, seed=asked["seed"], full=full)
    if front.interrupted:
        sys.exit(INTERRUPTED)
