"""A second global solver, in a module of its own: its process imports nothing else, so that it soon starts."""

from tmsopt.global_search import UNDECIDED, Decision


def prepare():
    """Nothing to prepare."""


def decide(_):
    """It can be anything that decides tasks; this one never does."""
    return Decision(UNDECIDED, nodes=7)
