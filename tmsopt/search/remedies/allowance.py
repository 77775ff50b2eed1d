"""The time that advice may take, so that the answer is not delayed much."""

import time
from dataclasses import replace

from tmsopt.program.options import Options
from tmsopt.progress import Progress, Steps

SECONDS = 2.5
"""Least allowance in seconds of process time: enough to solve a problem with seven free parameters again."""

SHARE = 0.3
"""Allowance as a share of the time spent before."""


class OutOfTime(Exception):
    """Raised when the allowance is used up."""


def limit_time(options: Options, spent: float = 0.0) -> Options:
    """A copy of the options with which work raises `OutOfTime` once its allowance is used up."""
    end = time.process_time() + max(SECONDS, SHARE * spent)

    def check_time(_: Progress) -> None:
        if time.process_time() > end:
            raise OutOfTime

    steps = Steps(check_time)
    steps.begin("solving again", "start")
    return replace(options, progress=steps, near=None)
