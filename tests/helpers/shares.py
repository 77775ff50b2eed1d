"""What a front has done side by side, in functions that other processes find."""

import os


def squared(ask, item):
    """The square of a number, and the process that made it."""
    return item**2, os.getpid()


def interrupted_at_two(ask, item):
    """A number; the user presses Ctrl-C at 2."""
    if item == 2:
        raise KeyboardInterrupt
    return item
