"""Judges of the random systems that share nothing with the package: eigenvalues of the text, and exact polynomials."""

import re
import time
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import flint
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, differential_evolution
from scipy.spatial.distance import pdist, squareform

from benchmarks.suites.random_systems import System
from tmsopt.records import Array

Roots = NDArray[np.complex128]

ROUNDED = 1e-10
"""Relative change of a coefficient that rounding of the parameters may explain, cancellation included."""

SAME = 1e-8
"""Relative difference up to which two values count as the same."""

FLOOR = 1e-3
"""Of |value| in relative differences: an abscissa near 0 has no scale of its own."""

FEASIBLE = 1e-9
"""Violation that counts as none, relative to the size of the two sides."""

_INFEASIBLE = 1e6  # added to the violation, so that any feasible design beats any other
_ULPS = 4.0
_NEAR = 0.2  # of the largest root: distance of roots that rounding may have parted
_POPULATION, _GENERATIONS = 15, 1000
_NUMPY: Mapping[str, Any] = {"sqrt": np.sqrt}
_NUMBER = re.compile(r"(?<![\w.])(\d+\.?\d*(?:e[-+]?\d+)?)")


@dataclass(frozen=True)
class Evolved:
    """Where a differential evolution ended.

    Attributes:
        moments: CPU seconds and the least merit by then, at each generation that lowered it.
        evaluations: of the eigenvalues.
    """

    parameters: Mapping[str, float]
    moments: tuple[tuple[float, float], ...]
    evaluations: int
    seconds: float

    def reached(self, merit: float) -> float:
        """CPU seconds until a merit was met; inf if it never was."""
        return next((t for t, found in self.moments if found <= merit), float("inf"))


def worth(system: System, designs: Mapping[str, Array]) -> tuple[dict[str, Array], Array]:
    """Abscissa and damping ratio by eigenvalues, and the largest relative violation, of many designs."""
    with np.errstate(all="ignore"):
        z = np.linalg.eigvals(system.state(designs))
        size = np.abs(z)
        ratio = np.where(size > 0, -z.real / np.where(size > 0, size, 1), 0).min(axis=-1)
    found = {"abscissa": z.real.max(axis=-1), "damping_ratio": ratio}
    return found, violation(system, {**designs, **found})


def violation(system: System, values: Mapping[str, Any]) -> Array:
    """Largest over the constraints, relative to the size of the two sides."""
    worst = np.zeros(np.shape(next(iter(values.values()))))
    for text in system.constraints.values():
        comparison = "<=" if "<=" in text else ">="
        left, right = (
            np.asarray(eval(side, dict(_NUMPY), {**system.fixed, **values}), float) for side in text.split(comparison)
        )
        excess = (left - right) * (1 if comparison == "<=" else -1)
        worst = np.maximum(worst, excess / np.maximum(1, np.maximum(np.abs(left), np.abs(right))))
    return worst


def evolve(system: System, seed: int = 0, generations: int = _GENERATIONS) -> Evolved:
    """SciPy's, vectorised, on the eigenvalues of the state matrix; feasible before infeasible, then the better."""
    names = list(system.free)
    moments: list[tuple[float, float]] = []
    evaluations = 0
    began = time.process_time()

    def merit(x: Any) -> Any:
        nonlocal evaluations
        columns = x.reshape(len(names), -1)
        evaluations += columns.shape[1]
        found, beyond = worth(system, dict(zip(names, columns, strict=True)))
        every = np.where(beyond <= 0, system.sign * found[system.objective], _INFEASIBLE + beyond)
        least = float(every.min())
        if not moments or least < moments[-1][1]:
            moments.append((time.process_time() - began, least))
        return every.reshape(x.shape[1:])

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        answer = differential_evolution(
            merit,
            Bounds(*np.array(list(system.free.values())).T),
            rng=seed,
            maxiter=generations,
            popsize=_POPULATION,
            tol=SAME,
            vectorized=True,
            updating="deferred",
            polish=False,
        )
    design = dict(zip(names, np.asarray(answer.x).tolist(), strict=True))
    return Evolved(design, tuple(moments), evaluations, time.process_time() - began)


def exact_polynomial(system: System, design: Mapping[str, float]) -> Any:
    """The characteristic polynomial of the numbers as stored, in rational arithmetic (`flint.fmpq_poly`)."""
    numbers = {n: Fraction(v) for n, v in {**system.fixed, **design}.items()}
    found = {
        n: flint.fmpq_mat(len(rows), len(rows[0]), [_rational(_exact(text, numbers)) for row in rows for text in row])
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


def _exact(text: str, numbers: Mapping[str, Fraction]) -> Fraction:
    """A text with its decimal numbers as the doubles that they are everywhere else."""
    return Fraction(eval(_NUMBER.sub(r"F(\1)", text), {"F": Fraction}, dict(numbers)))


def _rational(x: Fraction) -> Any:
    return flint.fmpq(x.numerator, x.denominator)


def ideals(system: System, design: Mapping[str, float]) -> Iterator[Roots]:
    """The roots of a design as stored, and of polynomials with multiple roots whose coefficients it rounds.

    Roots near each other are put into their mean, for every distance at which there are more of them together. That
    counts if it changes no coefficient by more than `ROUNDED`, relative to the sum of the absolute products in it, or
    than a few units in the last place of each parameter do.
    """
    polynomial = exact_polynomial(system, design)
    z = _isolated(polynomial)
    yield z
    apart = squareform(pdist(np.column_stack([z.real, z.imag])))
    granted = ROUNDED * np.poly(-np.abs(z)) + _ULPS * _moved(system, design, polynomial)
    own = np.poly(z)
    for reach in np.unique(apart[(apart > 0) & (apart <= _NEAR * np.abs(z).max())]):
        merged = z.copy()
        for group in _together(apart <= reach):
            merged[group] = z[group].mean()
        merged.imag[np.abs(merged.imag) <= 1e-14 * np.abs(z).max()] = 0
        if np.all(np.abs(np.poly(merged) - own) <= granted):
            yield merged


def _isolated(polynomial: Any) -> Roots:
    """All roots, correctly rounded."""
    found = polynomial.complex_roots()
    return np.array([complex(float(r.real.mid()), float(r.imag.mid())) for r, m in found for _ in range(m)])


def _moved(system: System, design: Mapping[str, float], polynomial: Any) -> Array:
    """By how much the monic coefficients move, descending, when each free parameter moves by its last place."""
    total = np.zeros(system.degree + 1)
    for name, value in design.items():
        other = exact_polynomial(system, {**design, name: float(np.nextafter(value, np.inf))})
        change = other / other[other.degree()] - polynomial / polynomial[polynomial.degree()]
        total += [abs(float(flint.arb(change[k]))) for k in range(system.degree, -1, -1)]
    return total


def _together(near: NDArray[np.bool_]) -> Iterator[list[int]]:
    left = set(range(len(near)))
    while left:
        group, more = set(), {left.pop()}
        while more:
            one = more.pop()
            group.add(one)
            new = {int(k) for k in np.flatnonzero(near[one])} & left
            left -= new
            more |= new
        yield sorted(group)


def values_of(z: Roots) -> dict[str, float]:
    """Abscissa and damping ratio of roots."""
    size = np.abs(z)
    ratio = np.where(size > 0, -z.real / np.where(size > 0, size, 1), 0)
    return {"abscissa": float(z.real.max()), "damping_ratio": float(ratio.min())}


def worth_of(system: System, design: Mapping[str, float], found: Mapping[str, float]) -> float:
    """The objective of one design with known root quantities."""
    return float(eval(system.objective, dict(_NUMPY), {**system.fixed, **design, **found}))


def relative(system: System, value: float, best: float) -> float:
    """Excess of a value over the best one, in units of that or of `FLOOR`."""
    return system.sign * (value - best) / max(FLOOR, abs(best))


def confirmed(system: System, design: Mapping[str, float], claimed: float) -> bool:
    """Whether a claimed value is that of the design, or of a multiple root that it rounds, and every limit is met.

    A pattern must be there too: as many roots together as it asks for.
    """
    for z in ideals(system, design):
        found = values_of(z)
        value = worth_of(system, design, found)
        beyond = float(violation(system, {**design, **found}))
        if abs(value - claimed) <= SAME * max(FLOOR, abs(value)) and beyond <= FEASIBLE and _has(system, z):
            return True
    return False


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
