"""Find all points with a pattern in a system of matrices: by the discriminant, or by chains from many starts."""

import time

import flint
import numpy as np

from tmsopt.algebra.balls import number
from tmsopt.algebra.krawczyk import Enclosure
from tmsopt.chains import family_of, find_discriminant, refine_near, targets_of
from tmsopt.global_search import Completeness
from tmsopt.global_search.chain_equations import prove_point
from tmsopt.problem import Posed
from tmsopt.records import Table

_WORK_DIGITS = 60  # decimal digits in which points are written
_RESULT_DIGITS = 25  # decimal digits of a point


def prove_all_points(problem: Posed) -> Completeness | None:
    """All exceptional points of order 2 of a complex matrix that is analytic in x + iy, with proof.

    If as many points as the degree of the discriminant are proved, there are no others in the whole plane. None if the
    discriminant does not tell their number, or not all of them are found.
    """
    began = time.perf_counter()
    if problem.locate != "EP2" or problem.conditions or (discriminant := find_discriminant(problem)) is None:
        return None
    family, targets = family_of(problem), targets_of("EP2", is_complex=True)
    proved = list[Enclosure]()
    with flint.ctx.workdps(_WORK_DIGITS):
        for zero in discriminant.zeros:
            point = refine_near(family, targets, np.array(zero))
            if point is None or not point.is_found:
                return None
            enclosure = prove_point(problem, dict(zip(problem.free, point.p.tolist(), strict=True)))
            if enclosure is None:
                return None
            if not any(_overlaps(problem, enclosure, other) for other in proved):
                proved.append(enclosure)
        if len(proved) < discriminant.degree:
            return None
        inside = [e.balls for e in proved if all(lo <= e.balls[n].mid() <= hi for n, (lo, hi) in problem.free.items())]
        designs = [Table({n: number(balls[n], _RESULT_DIGITS) for n in problem.free}) for balls in inside]
    designs.sort(key=lambda design: [float(x) for x in design.values()])
    seconds = time.perf_counter() - began
    return Completeness(True, designs=tuple(designs), limits=("",) * len(designs), seconds=seconds, total=len(proved))


def _overlaps(problem: Posed, one: Enclosure, other: Enclosure) -> bool:
    return all(one.balls[n].overlaps(other.balls[n]) for n in problem.free)
