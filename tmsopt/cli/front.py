"""The front of a file with several objectives, a part of `tmsopt solve`."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tmsopt.cli.common import progress, saving, write_json

if TYPE_CHECKING:
    from tmsopt import Problem


def check_options(problem: "Problem", given: Sequence[str], every: bool) -> None:
    """Refuse options that mean nothing for this problem.

    Raises:
        InputError: naming each of them.
    """
    from tmsopt import Fault, InputError

    if every and (alone := [o for o in given if o in ("--certify", "--diagnose", "--plot")]):
        message = "is for one design, and --all looks for all of them; leave one of the two out"
        raise InputError([Fault(message, (option,)) for option in alone])
    if problem.pareto:
        if alone := [o for o in given if o in ("--certify", "--diagnose")]:
            message = "is for one design, and the file asks for a front; write minimize with one of the expressions"
            raise InputError([Fault(message, (option,)) for option in alone])
        wrong = [o for o in given if o in ("--wheelbase", "--rear-mass")]
        message = "scales one design, and the file asks for a front; write the problem in SI instead"
    else:
        wrong = [o for o in given if o in ("--points", "--csv")]
        message = 'is for a front; write pareto = ["abscissa", "Fr"] under [objective], or leave the option out'
    if wrong:
        raise InputError([Fault(message, (option,)) for option in wrong])


def write_front(
    problem: "Problem", asked: dict[str, Any], as_json: bool, plot: Path | None, csv_file: Path | None
) -> None:
    """Find the front and write it where it is asked for.

    Raises:
        NotSolved: when an objective has no optimum.
    """
    import tmsopt

    with progress("sub-problem") as update:
        front = tmsopt.pareto(problem, progress=update, **asked)
    if as_json:
        write_json(front.to_json())
    else:
        click.echo(tmsopt.report.front_table(front))
    if csv_file is not None:
        with saving("--csv", csv_file):
            front.write_csv(csv_file)
    if plot is not None:
        with saving("--plot", plot):
            tmsopt.plots.save(tmsopt.plots.front_figure(front), plot)
