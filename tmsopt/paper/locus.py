"""Root loci of the designs of Table 1 over the Froude number."""

from collections.abc import Iterator
from dataclasses import dataclass

from tmsopt.dynamics import Growth, growth
from tmsopt.models import tms
from tmsopt.paper.reference import ReferenceBicycle, table_1
from tmsopt.problem.problem import Problem

FR_MAX = 5.0
"""End of the sweeps over Fr."""

_SAME = 1e-6  # distance in Fr of the two double roots into which rounding splits an exceptional point


@dataclass(frozen=True)
class LocusRow:
    """Roots over Fr at one steer axis tilt, for χ_B of the law (first), and for χ_B smaller and larger by `offset`."""

    bicycle: ReferenceBicycle
    offset: float
    loci: tuple[Growth, ...]


def table_1_loci() -> tuple[LocusRow, ...]:
    """The three rows of the paper's figure: tilts of Table 1, χ_B = √2 and close to it, 0 < Fr ≤ 5."""
    rows = zip(table_1(), (0.01, 0.01, 0.1), strict=True)
    return tuple(
        LocusRow(b, offset, tuple(sweep_Fr(b, shift) for shift in (0.0, -offset, offset))) for b, offset in rows
    )


def sweep_Fr(bicycle: ReferenceBicycle, shift: float = 0.0) -> Growth:
    """Roots of a bicycle with shifted χ_B over 0 < Fr ≤ 5."""
    parameters = {**bicycle.parameters, "chi_B": bicycle.parameters["chi_B"] + shift}
    return growth(Problem(tms, fixed=parameters), end=FR_MAX)


def multiple_roots(data: Growth) -> Iterator[tuple[str, float, complex]]:
    """Name, Fr and value of each multiple root: the exceptional point of the design, and every ``EP2``."""
    yield from ((data.structure, data.design, complex(r.re, r.im)) for r in data.multiple)
    for event in data.events:
        if event.kind == "EP2" and abs(event.at - data.design) > _SAME:
            yield "EP2", event.at, complex(event.root.re)
