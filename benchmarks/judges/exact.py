"""Judges by exact polynomials: of the numbers as stored, and of the multiple roots that these round."""

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import Any

import flint
import numpy as np
from scipy.sparse.csgraph import connected_components
from scipy.spatial.distance import pdist, squareform

from benchmarks.judges.eigenvalues import Roots, root_values
from benchmarks.judges.system import FLOOR, System
from tmsopt import Problem
from tmsopt.models import Values
from tmsopt.records import Array
from tmsopt.roots import exact_roots

ROUNDED = 1e-10
"""Relative change of a coefficient that rounding of the parameters may explain, cancellation included."""

SAME = 1e-8
"""Relative difference up to which two values count as the same."""

DIGITS = 120
"""Digits of what is called exact: products of five doubles are, and the tangent is right far beyond the answer."""

MET = 1e-9
"""Violation that counts as none, relative to the size of the two sides."""

_ULPS = 4.0
_NEAR = 0.2  # of the largest root: distance of roots that rounding may have parted
_NUMBER = re.compile(r"(?<![\w.])(\d+\.?\d*(?:e[-+]?\d+)?)")


def same(value: float, best: float) -> bool:
    """Whether two values are the same one."""
    return abs(value - best) <= SAME * max(FLOOR, abs(best))


def confirmed(problem: Problem, design: Mapping[str, float], claimed: float) -> bool:
    """Whether a claimed abscissa is that of the design, or of an exceptional point that the design rounds.

    The grant of `Verdict` is not enough here: it is what rounding of coefficients does to eigenvalues of the stored
    design, and where rounded parameters already took that away from the point, further rounding does little.
    """
    return any(same(claimed, float(near.real.max())) for near in near_roots(problem, design))


def stored_values(problem: Problem, design: Mapping[str, float]) -> Values:
    """Everything but the roots, of the parameters as stored, in balls of the digits that hold at the time."""
    stored = problem.posed.ordered({n: design[n] for n in problem.free})
    return Values(problem.model, problem.posed.parameter_set, {n: flint.arb(v) for n, v in stored.items()})


def near_roots(problem: Problem, design: Mapping[str, float]) -> Iterator[Roots]:
    """The roots of a design as stored, then of polynomials with multiple roots whose coefficients it rounds.

    Raises:
        ZeroDivisionError: where a coefficient does not exist, or the leading one is 0.
    """
    with flint.ctx.workdps(DIGITS):
        a = [flint.arb(c) for c in stored_values(problem, design).coefficients]
        if not all(c.is_finite() for c in a) or a[0].contains(0):
            raise ZeroDivisionError("no roots")
        found = exact_roots(a)
    z = np.array([complex(r.re, r.im) for r in found for _ in range(r.multiplicity)])
    yield from _rounded(z, ROUNDED * _sizes(z))


def confirmed_system(system: System, design: Mapping[str, float], claimed: float) -> bool:
    """Whether a claimed value is that of the design, or of a multiple root that it rounds, and every limit is met.

    A pattern must be there too: as many roots together as it asks for.
    """
    for z in ideals(system, design):
        values = {**design, **values_of(z)}
        met = float(system.violation(values)) <= MET and _has(system, z)
        if met and same(claimed, float(system.worth(values))):
            return True
    return False


def values_of(z: Roots) -> dict[str, float]:
    """Abscissa and damping ratio of roots."""
    return dict(zip(("abscissa", "damping_ratio"), map(float, root_values(z)), strict=True))


def ideals(system: System, design: Mapping[str, float]) -> Iterator[Roots]:
    """The roots of a design as stored, and of polynomials with multiple roots whose coefficients it rounds.

    Rounding explains `ROUNDED`, relative to the sum of the absolute products in a coefficient, and what a few units
    in the last place of each parameter do to it.
    """
    polynomial = exact_polynomial(system, design)
    found = polynomial.complex_roots()
    z = np.array([complex(float(r.real.mid()), float(r.imag.mid())) for r, m in found for _ in range(m)])
    return _rounded(z, ROUNDED * _sizes(z) + _ULPS * _moved(system, design, polynomial))


def _sizes(z: Roots) -> Array:
    """Sums of the absolute products in each coefficient."""
    return np.asarray(np.poly(-np.abs(z)), dtype=float)


def _rounded(z: Roots, granted: Array) -> Iterator[Roots]:
    """The roots, and every merging of near ones into their mean that changes no coefficient by more than granted.

    Roots are merged that are nearer to each other than some distance, for every distance that makes a difference.
    """
    yield z
    apart = squareform(pdist(np.column_stack([z.real, z.imag])))
    for reach in np.unique(apart[(apart > 0) & (apart <= _NEAR * np.abs(z).max())]):
        merged = z.copy()
        count, part = connected_components(apart <= reach)
        for k in range(count):
            merged[part == k] = z[part == k].mean()
        merged.imag[np.abs(merged.imag) <= 1e-14 * np.abs(z).max()] = 0
        if np.all(np.abs(np.poly(merged) - np.poly(z)) <= granted):
            yield merged


def exact_polynomial(system: System, design: Mapping[str, float]) -> Any:
    """The characteristic polynomial of the numbers as stored, in rational arithmetic (`flint.fmpq_poly`)."""
    numbers = {n: Fraction(v) for n, v in {**system.fixed, **design}.items()}
    found = {
        n: flint.fmpq_mat(len(rows), len(rows[0]), [_exact(text, numbers) for row in rows for text in row])
        for n, rows in system.matrices.items()
    }
    if "coefficients" in found:
        row = found["coefficients"]
        return flint.fmpq_poly([row[0, k] for k in range(row.ncols() - 1, -1, -1)])
    if "A" in found:
        return found["A"].charpoly()
    size = found["M"].nrows()
    inverse = found["M"].inv()
    lower = [inverse * found["K"], inverse * found["D"]]
    entries = [flint.fmpq(int(j == i + size)) for i in range(size) for j in range(2 * size)]
    entries += [-lower[j // size][i, j % size] for i in range(size) for j in range(2 * size)]
    return flint.fmpq_mat(2 * size, 2 * size, entries).charpoly()


def _exact(text: str, numbers: Mapping[str, Fraction]) -> Any:
    """A text with its decimal numbers as the doubles that they are everywhere else."""
    found = Fraction(eval(_NUMBER.sub(r"F(\1)", text), {"F": Fraction}, dict(numbers)))
    return flint.fmpq(found.numerator, found.denominator)


def _moved(system: System, design: Mapping[str, float], polynomial: Any) -> Array:
    """By how much the monic coefficients move, descending, when each free parameter moves by its last place."""
    total = np.zeros(system.degree + 1)
    for name, value in design.items():
        other = exact_polynomial(system, {**design, name: float(np.nextafter(value, np.inf))})
        change = other / other[other.degree()] - polynomial / polynomial[polynomial.degree()]
        total += [abs(float(flint.arb(change[k]))) for k in range(system.degree, -1, -1)]
    return total


def _has(system: System, z: Roots) -> bool:
    """Whether roots have the pattern that is asked for, if any; its closure counts, as EP5 for EP2+EP2."""
    left = Counter(z[z.imag >= 0].tolist())
    for part in filter(None, system.goal.get("locate", "").split("+")):
        pair, k = part.startswith("C"), int(part.removeprefix("C").removeprefix("EP"))
        needs = {w: k if pair and w.imag else 2 * k if pair else k for w in left if pair or not w.imag}
        enough = [w for w, need in needs.items() if left[w] >= need]
        if not enough:
            return False
        taken = max(enough, key=lambda w: left[w])
        left[taken] -= needs[taken]
    return True
