"""Problems whose best basin is narrow or hidden: gains beside zero in wide boxes, plateaus, wells of exponentials.

The files and the best values known are kept. They were drawn, and searched for by samples, differential evolution and
Nelder-Mead on NumPy's eigenvalues, by code that is no longer here: commit f0bd6ed8 has it.
"""

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path

FAMILIES = ("gains", "plateaus", "wells")


@dataclass(frozen=True)
class Hidden:
    """A problem.

    Attributes:
        index: below 60 of *gains*, from 120 of *wells*.
        value: the best that is known.
        design: where.
        text: its file.
    """

    index: int
    name: str
    value: float
    design: list[float]
    text: str

    @property
    def sign(self) -> int:
        """−1 where the objective is maximised."""
        return -1 if "\nmaximize" in self.text else 1


@cache
def hidden() -> dict[int, Hidden]:
    """By index."""
    rows = json.loads(Path(__file__).with_suffix(".json").read_text(encoding="utf-8"))
    return {row["index"]: Hidden(**row) for row in rows}
