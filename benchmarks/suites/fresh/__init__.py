"""Fresh random problems of twelve families, and a judge of their answers that shares no code with tmsopt.

In: a number of problems of each family. Out: problems with their files (`problems`), what is known of them (`known`:
eigenvalues, differential evolution, polishes, 50 digits; kept in a file) and verdicts on answers (`judge`). Open
`problem` first.
"""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.suites.fresh.edges import EDGES
from benchmarks.suites.fresh.judge import KINDS, Verdict, ask, judge
from benchmarks.suites.fresh.machines import MACHINES
from benchmarks.suites.fresh.matrices import MATRICES
from benchmarks.suites.fresh.meetings import MEETINGS
from benchmarks.suites.fresh.points import known_points
from benchmarks.suites.fresh.problem import Problem
from benchmarks.suites.fresh.reference import reference

__all__ = ["COUNT", "FAMILIES", "KINDS", "Cache", "Problem", "Verdict", "ask", "judge", "known", "problems"]

FAMILIES = {**MACHINES, **MATRICES, **MEETINGS, **EDGES}

COUNT = 40
"""Problems of each family."""


def problems(count: int = COUNT) -> list[Problem]:
    """So many of each family, always the same."""
    return [make(number) for make in FAMILIES.values() for number in range(count)]


def known(problem: Problem) -> dict[str, Any]:
    """What is known of a problem, as plain data."""
    return {"points": known_points(problem)} if problem.sense == "locate" else reference(problem).to_json()


class Cache:
    """Plain data by name in a JSON file, written after each; without a path kept in memory."""

    def __init__(self, path: Path | None) -> None:
        """With what the file has."""
        self.path = path
        self.data: dict[str, Any] = json.loads(path.read_text(encoding="utf-8")) if path and path.exists() else {}

    def __contains__(self, name: str) -> bool:
        """Whether it is there."""
        return name in self.data

    def __getitem__(self, name: str) -> Any:
        """What is kept."""
        return self.data[name]

    def keep(self, name: str, value: Mapping[str, Any]) -> None:
        """Keep it, in the file too."""
        self.data[name] = value
        if self.path:
            aside = self.path.with_suffix(".part")
            aside.write_text(json.dumps(self.data), encoding="utf-8")
            os.replace(aside, self.path)
