"""Time that advice may take to be tried, so that an answer does not wait long for it."""

import time
from dataclasses import replace

from tmsopt.program.options import Options
from tmsopt.progress import Progress, Steps

SECONDS = 2.5
"""Of this process, at least: what a problem of seven free parameters takes to be solved again."""

SHARE = 0.3
"""Of what was spent before."""


class Spent(Exception):
    """The time is over: what was being tried is not told."""


def within(options: Options, spent: float = 0.0) -> Options:
    """The same options for work that ends with `Spent` once it has taken its share of the time spent before."""
    end = time.process_time() + max(SECONDS, SHARE * spent)

    def told(_: Progress) -> None:
        if time.process_time() > end:
            raise Spent

    steps = Steps(told)
    steps.begin("solving again", "start")
    return replace(options, progress=steps, near=None)
