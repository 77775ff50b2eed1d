"""What a front has done side by side, in functions that other processes find."""

import os
import time


def squared(ask, item):
    """The square of a number, and the process that made it."""
    return item**2, os.getpid()


def slowly_squared(ask, item):
    """The same after a while, so that another process has time to begin."""
    time.sleep(0.5)
    return squared(ask, item)


def dying_at_two(ask, item):
    """A number; any process dies of 2."""
    if item == 2:
        os._exit(3)
    return item


def interrupted_at_two(ask, item):
    """A number; the user presses Ctrl-C at 2."""
    if item == 2:
        raise KeyboardInterrupt
    return item
