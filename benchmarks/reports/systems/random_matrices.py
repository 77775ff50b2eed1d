"""Random pencils, diabolic points and EPs next to them: is every EP2 found and proved, and is each point what it is."""

import time
from collections.abc import Mapping
from typing import Any, NamedTuple

from benchmarks.reports.tables import Asked, duration, facts, median, page, share, table
from benchmarks.suites import matrices, random_matrices as suite
from tmsopt import Problem, Solution, diagnose, models, prove, solve, solve_all

_CROSSINGS = 100  # diabolic points, and as many with a gap
_SECONDS = 5.0  # for the proof by intervals, where the discriminant proves nothing
_STARTS = 20  # of a search for points
_SAME = 1e-9  # relative distance within which a point is a zero of the discriminant
_FALSE = 1e-9  # from this backward error on, a point is none
_AT_CROSSING = 1e-4  # a point nearer to a diabolic point than this is called by its name
_PLACED = 1e-9  # error of an EP that tells it from the diabolic point at the distance 1e-6


class PencilRow(NamedTuple):
    """What became of a pencil.

    Attributes:
        size: of the matrix.
        found, missed: zeros of the discriminant in the box that are among the points, and that are not.
        false: points that are no zeros, or are called proved and are none.
        complete: whether the list is said to be proved complete.
        total: points in the plane, if it is.
    """

    size: int
    found: int
    missed: int
    false: int
    complete: bool
    total: int | None
    seconds: float

    @property
    def is_right(self) -> bool:
        """Whether all n (n − 1) points are found and proved."""
        return self.complete and not (self.missed or self.false) and self.total == self.size * (self.size - 1)


class CrossingRow(NamedTuple):
    """What is said of a matrix with a diabolic point, or with EPs next to it.

    Attributes:
        status: of the solution.
        kinds: what the double eigenvalues of the known or found point are said to be.
        error: distance of the found point and eigenvalue from the nearest known point.
        backward: norm of a change of the matrix that makes the point an EP2; both are shares of the norm.
        proof: whether the point is said to be proved.
    """

    status: str
    kinds: tuple[str, ...]
    error: float = float("inf")
    backward: float = float("inf")
    proof: bool = False


def _pose(entries: matrices.Rows, free: Mapping[str, Any], fixed: Mapping[str, float] | None = None) -> Problem:
    model = models.from_hamiltonian([[*row] for row in entries])
    return Problem(model, free=free, fixed=fixed or {}, locate=None if fixed else "EP2")


def _try_pencil(number: int, seed: int, seconds: float) -> PencilRow:
    pencil = suite.make_pencil(number, seed)
    began = time.perf_counter()
    every = solve_all(_pose(pencil.entries, dict.fromkeys("xy", suite.BOX)), seconds=seconds, starts=_STARTS)
    took, points = time.perf_counter() - began, [complex(*s.parameters.values()) for s in every.solutions]
    low, high = suite.BOX
    inside = [z for z in pencil.zeros if low <= z.real <= high and low <= z.imag <= high]

    def is_among(z: complex, others: Any) -> bool:
        return any(abs(z - w) <= _SAME * max(1.0, abs(z)) for w in others)

    found, false = sum(is_among(z, points) for z in inside), sum(not is_among(p, pencil.zeros) for p in points)
    total = every.completeness.total if every.completeness else None
    return PencilRow(len(pencil.entries), found, len(inside) - found, false, every.complete, total, took)


def _try_crossing(number: int, seed: int, gap: float) -> CrossingRow:
    system = suite.make_crossing(number, seed, gap)
    entries = system.matrices["H"]
    found = solve(_pose(entries, system.free), throw=False, starts=_STARTS)
    is_found = found.status == "optimal"
    design: Problem | Solution = found
    if not gap:
        design = _pose(entries, {}, dict(zip(system.free, map(float, system.known[0][:-1]), strict=True)))
    row = CrossingRow(found.status, tuple(d.kind for d in diagnose(design)) if is_found or not gap else ())
    if not is_found:
        return row
    omega = max(found.eigenfrequencies or (), key=lambda r: r.multiplicity)
    verdict = matrices.judge(system, [found.parameters[n] for n in system.free], complex(omega.re, omega.im))
    return row._replace(error=max(verdict.errors), backward=verdict.backward, proof=bool(gap) and prove(found).proved)


def report(asked: Asked) -> str:
    """The page: totals of the three kinds, and the pencils by size."""
    counts, step = asked.of(len(suite.SIZES), 5), len(suite.SIZES)
    numbers = range(0, step, max(1, step // counts))
    pencils = [_try_pencil(k, asked.seed, asked.within(_SECONDS, 1.0)) for k in numbers]
    crossings = range(asked.of(_CROSSINGS, 4))
    diabolic, near = ([_try_crossing(k, asked.seed, gap) for k in crossings] for gap in (0.0, suite.GAP))
    incomplete = [r for r in pencils if not r.complete]
    totals = [
        ("pencils whose n (n − 1) EP2 are all found and proved", share(r.is_right for r in pencils)),
        ("the others, said to be incomplete", share(r in incomplete for r in pencils if not r.is_right)),
        ("**false**: said to be complete and not", sum(r.complete and not r.is_right for r in pencils)),
        ("**false** points", sum(r.false for r in pencils)),
        (
            "EP2 found in the incomplete lists",
            f"{sum(r.found for r in incomplete)} of {sum(r.found + r.missed for r in incomplete)}",
        ),
        ("diabolic points that `solve` does not call an EP", share(not _is_false(r) for r in diabolic)),
        (
            "of these, another EP2 is found in the ranges, and is one",
            sum(r.status == "optimal" and not _is_false(r) for r in diabolic),
        ),
        ("diabolic points that `diagnose` calls semisimple", share(r.kinds == ("semisimple",) for r in diabolic)),
        ("**false**: called defective", sum("defective" in r.kinds for r in diabolic)),
        (
            f"EPs {suite.GAP:g} away from a diabolic point that `solve` finds, to {_PLACED:g}",
            share(r.error <= _PLACED and r.backward <= _FALSE for r in near),
        ),
        (
            "of these, `diagnose` calls them defective",
            share(r.kinds == ("defective",) for r in near if r.error <= _PLACED),
        ),
        ("of these, proved", share(r.proof for r in near if r.error <= _PLACED)),
    ]
    header = ("n", "pencils", "all found and proved", "incomplete", "median time", "longest")
    rows = []
    for n in sorted({r.size for r in pencils}):
        some = [r for r in pencils if r.size == n]
        times = [r.seconds for r in some]
        rows.append(
            (
                n,
                len(some),
                sum(r.is_right for r in some),
                sum(not r.complete for r in some),
                median(times),
                duration(max(times)),
            )
        )
    return page("Random pencils and diabolic points", asked, facts(totals), table(header, rows), _ABOUT)


def _is_false(row: CrossingRow) -> bool:
    """Whether a diabolic point, or no point at all, is called an EP."""
    return row.status == "optimal" and (row.error <= _AT_CROSSING or row.backward > _FALSE)


_ABOUT = (
    "A pencil is H₀ + (x + i y) H₁ with normal complex entries of three decimals, and x and y from -1000 to 1000. Its "
    "EP2 are the zeros of the discriminant, from the entries alone: a Sylvester determinant in balls, interpolated. A "
    "diabolic point is a double eigenvalue with two eigenvectors in a matrix of size 2 to 4 with random derivatives by "
    "x and y, hidden by a similarity, by turns whole and exact, or unitary in doubles. The EPs next to one come from a "
    f"perturbation that is not Hermitian; they are {suite.GAP:g} away from it in x and y. Errors are shares of the "
    f"norm of the matrix, in 80 digits. A search has {_STARTS} starts."
)
