"""Root loci of the designs of Table 1 over the Froude number."""

from collections.abc import Iterator
from dataclasses import dataclass

from tmsopt.dynamics import Growth, growth
from tmsopt.models import tms
from tmsopt.paper.reference import ReferenceBicycle, table_1
from tmsopt.problem.problem import Problem

FR_MAX = 5.0
"""Largest Froude number of the root loci."""

_SPLIT_DISTANCE = 1e-6  # rounding splits an exceptional point into two double roots; they are closer than this in Fr


@dataclass(frozen=True)
class LocusRow:
    """Roots over Fr at one steer axis tilt: first for χ_B of the law, then for χ_B smaller and larger by `offset`."""

    bicycle: ReferenceBicycle
    offset: float
    loci: tuple[Growth, ...]


def table_1_loci() -> tuple[LocusRow, ...]:
    """The three rows of the paper's figure, one for each tilt of Table 1; χ_B is √2 or close to it, 0 < Fr ≤ 5."""
    rows = zip(table_1(), (0.01, 0.01, 0.1), strict=True)
    return tuple(
        LocusRow(bicycle, offset, tuple(sweep_Fr(bicycle, shift) for shift in (0.0, -offset, offset)))
        for bicycle, offset in rows
    )


def sweep_Fr(bicycle: ReferenceBicycle, shift: float = 0.0) -> Growth:
    """Roots of a bicycle with shifted χ_B over 0 < Fr ≤ 5."""
    parameters = {**bicycle.parameters, "chi_B": bicycle.parameters["chi_B"] + shift}
    return growth(Problem(tms, fixed=parameters), end=FR_MAX)


def multiple_roots(data: Growth) -> Iterator[tuple[str, float, complex]]:
    """Name, Fr and value of each multiple root: first the exceptional point of the design, then every other ``EP2``."""
    yield from ((data.structure, data.design, complex(r.re, r.im)) for r in data.multiple)
    for event in data.events:
        if event.kind == "EP2" and abs(event.at - data.design) > _SPLIT_DISTANCE:
            yield "EP2", event.at, complex(event.root.re)
