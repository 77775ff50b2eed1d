"""A study as data: a problem, and what varies from row to row."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from tmsopt.design.problem import Problem
from tmsopt.design.search import STARTS


@dataclass(frozen=True)
class Study:
    """A problem and what varies from row to row; see `load_study` for its file form.

    Attributes:
        problem: what is asked of every row; what varies has some value here too.
        columns: what varies → its value in every row; all of the same length. Names are fixed parameters,
            ``lambda_s.min`` and ``lambda_s.max`` of a free one, and ``trail.limit``, the number that the constraint
            ``trail`` compares with.
        title: one line for reports.
        seed: the rows' own seeds follow from it.
        starts: of a row, at most.
        warm: whether neighbours start each other.
        report: expressions recorded for every row beside parameters and abscissa.
    """

    problem: Problem
    columns: Mapping[str, Sequence[float]] = field(default_factory=dict)
    title: str = ""
    seed: int = 0
    starts: int = STARTS
    warm: bool = False
    report: Sequence[str] = ()
