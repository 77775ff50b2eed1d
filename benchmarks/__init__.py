"""Benchmarks: honest numbers, failures kept.

In: ``python -m benchmarks``, see `command`. Out: sections of results.md. `suites` has the problems, `judges` say what
a design is worth, `rivals` are what one would use instead, `reports` put them beside each other.
"""

import os
from importlib import import_module

WITHOUT = "TMSOPT_WITHOUT"
"""Variable of the environment that names a rescue of the search to do without, in this process and its workers."""


def leave_out(name: str) -> None:
    """Search without one rescue from now on; before the search is imported.

    Raises:
        KeyError: when there is none of this name.
    """
    rescues = import_module("tmsopt.search.rescues")
    kept = tuple(rescue for rescue in rescues.RESCUES if rescue.name != name)
    if len(kept) == len(rescues.RESCUES):
        raise KeyError(", ".join(rescue.name for rescue in kept))
    vars(rescues)["RESCUES"] = kept
    os.environ[WITHOUT] = name


if os.environ.get(WITHOUT):
    leave_out(os.environ[WITHOUT])
