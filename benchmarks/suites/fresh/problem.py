"""A problem: its file, and its own evaluation of roots, objective and limits, for many designs at once or to 50 digits.

`measure` takes designs as a NumPy array; `measure_exactly` one design as doubles, at `DIGITS` digits.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import mpmath
import numpy as np
import numpy.typing as npt

from benchmarks.suites.fresh.bicycles import whipple
from benchmarks.suites.fresh.formulas import FLOATS, MANY_DIGITS, Field, evaluate, exact, excess, many_digits, names

Floats = npt.NDArray[np.float64]
Entries = tuple[tuple[str, ...], ...]

ROOT_QUANTITIES = ("abscissa", "damping_ratio", "decay_rate")


@dataclass(frozen=True)
class System:
    """Where the roots come from.

    Attributes:
        kind: ``coefficients`` (one row, descending), ``A``, ``MDK`` (three matrices), ``H`` or ``whipple``.
        entries: matrices of texts.
        quantities: names → texts, each of those before it.
        rate: the unit of the abscissa in 1/s.
    """

    kind: str
    entries: tuple[Entries, ...] = ()
    quantities: tuple[tuple[str, str], ...] = ()
    rate: str = "1"


@dataclass(frozen=True)
class Problem:
    """One problem.

    Attributes:
        name: family and number.
        text: the file.
        free: parameter → limits; of these the designs are rows.
        fixed: parameter → decimal.
        sense: ``minimize``, ``maximize`` or ``locate``.
        objective: an expression, or a pattern.
        limits: name → comparison.
        cases: values of parameters; the worst counts.
        feasible: a design that is feasible by construction.
        infeasible: why no design is feasible.
        points: exceptional points known by construction.
        defective: whether points of the pattern may exist; False where none can.
    """

    name: str
    text: str
    system: System
    free: Mapping[str, tuple[float, float]]
    fixed: Mapping[str, str]
    sense: str
    objective: str
    limits: Mapping[str, str] = field(default_factory=dict)
    cases: tuple[Mapping[str, str], ...] = ({},)
    feasible: Mapping[str, float] | None = None
    infeasible: str = ""
    points: tuple[Mapping[str, float], ...] = ()
    defective: bool = True

    @property
    def family(self) -> str:
        """Which family it belongs to."""
        return self.name.split("/")[0]

    @property
    def box(self) -> Floats:
        """Lower and upper limits of the free parameters, one row each."""
        return np.array(list(self.free.values()), dtype=float)

    @property
    def sign(self) -> int:
        """1 where the objective is minimised, −1 where it is maximised."""
        return -1 if self.sense == "maximize" else 1

    @property
    def asks_roots(self) -> bool:
        """Whether roots have a say."""
        texts = [*self.limits.values(), *([self.objective] if self.sense != "locate" else [])]
        return any(names(t) & set(ROOT_QUANTITIES) for t in texts)


def assign(problem: Problem, design: Mapping[str, Any], case: Mapping[str, str], kind: Field) -> dict[str, Any]:
    """Every parameter and quantity but those of roots."""
    values: dict[str, Any] = {name: kind.number(text) for name, text in {**problem.fixed, **case}.items()}
    values |= {name: x for name, x in design.items() if name not in case}
    for name, text in problem.system.quantities:
        values[name] = evaluate(text, values, kind)
    return values


def _stack(rows: Sequence[Sequence[Any]], count: int, dtype: type) -> npt.NDArray[Any]:
    found: npt.NDArray[Any] = np.empty((count, len(rows), len(rows[0])), dtype=dtype)
    for i, row in enumerate(rows):
        for j, x in enumerate(row):
            found[:, i, j] = x
    return found


def state_matrix(system: System, values: Mapping[str, Any], count: int) -> npt.NDArray[Any]:
    """Matrices whose eigenvalues are the roots, one for each design."""
    filled = [[[evaluate(t, values, FLOATS) for t in row] for row in matrix] for matrix in system.entries]
    if system.kind == "H":
        return -1j * _stack(filled[0], count, complex)
    if system.kind == "A":
        return _stack(filled[0], count, float)
    if system.kind == "coefficients":
        row = _stack(filled[0], count, float)[:, 0, :]
        found: npt.NDArray[Any] = np.zeros((count, row.shape[1] - 1, row.shape[1] - 1))
        found[:, 0, :] = -row[:, 1:] / np.where(row[:, :1] == 0, 1e-300, row[:, :1])
        found[:, range(1, found.shape[1]), range(found.shape[1] - 1)] = 1
        return found
    mass, damping, stiffness = whipple(values, np.sin, np.cos) if system.kind == "whipple" else filled
    m, d, k = (_stack(x, count, float) for x in (mass, damping, stiffness))
    n = m.shape[1]
    found = np.zeros((count, 2 * n, 2 * n))
    found[:, :n, n:] = np.eye(n)
    found[:, n:, :] = -np.linalg.solve(m, np.concatenate([k, d], axis=2))
    return found


def eigenvalues(matrices: npt.NDArray[Any]) -> npt.NDArray[np.complex128]:
    """Of many matrices; not numbers where entries are none or too large."""
    good = np.all(np.isfinite(matrices) & (np.abs(matrices) < 1e100), axis=(1, 2))
    found = np.full(matrices.shape[:2], np.nan, dtype=complex)
    found[good] = np.linalg.eigvals(matrices[good])
    return found


def measure(problem: Problem, designs: Floats) -> tuple[Floats, Floats]:
    """Objective, to be minimised, and the worst violation relative to its limit, of designs by rows."""
    count = len(designs)
    design = dict(zip(problem.free, designs.T, strict=True))
    worst, missed = np.full(count, -np.inf), np.zeros(count)
    with np.errstate(all="ignore"):
        for case in problem.cases:
            values = assign(problem, design, case, FLOATS)
            if problem.asks_roots:
                roots = eigenvalues(state_matrix(problem.system, values, count))
                values["abscissa"] = roots.real.max(axis=1)
                values["damping_ratio"] = (-roots.real / np.maximum(np.abs(roots), 1e-300)).min(axis=1)
                values["decay_rate"] = -values["abscissa"] * evaluate(problem.system.rate, values, FLOATS)
            if problem.sense != "locate":
                worst = np.maximum(worst, problem.sign * evaluate(problem.objective, values, FLOATS))
            for text in problem.limits.values():
                over, size = excess(text, values, FLOATS)
                missed = np.maximum(missed, over / size)
    return np.where(np.isfinite(worst), worst, 1e30), np.where(np.isfinite(missed), np.maximum(missed, 0), 1e30)


def polynomial(system: System, values: Mapping[str, Any]) -> list[Any]:
    """Coefficients at many digits, descending; of matrices by Faddeev and LeVerrier."""
    with many_digits():
        if system.kind == "coefficients":
            return [evaluate(t, values, MANY_DIGITS) for t in system.entries[0][0]]
        return characteristic(matrix_exactly(system, values))


def characteristic(matrix: Any) -> list[Any]:
    """Coefficients of det(s − matrix), descending, at the working precision."""
    n = matrix.rows
    found, power = [mpmath.mpf(1)], mpmath.eye(n)
    for k in range(1, n + 1):
        product = matrix * power
        found.append(-sum(product[i, i] for i in range(n)) / k)
        power = product + found[-1] * mpmath.eye(n)
    return found


def matrix_exactly(system: System, values: Mapping[str, Any]) -> Any:
    """The state matrix at many digits."""
    with many_digits():
        if system.kind == "whipple":
            blocks = [mpmath.matrix(x) for x in whipple(values, mpmath.sin, mpmath.cos)]
        else:
            blocks = [
                mpmath.matrix([[evaluate(t, values, MANY_DIGITS) for t in row] for row in matrix])
                for matrix in system.entries
            ]
        if system.kind == "H":
            return -1j * blocks[0]
        if system.kind == "A":
            return blocks[0]
        if system.kind == "coefficients":
            row, n = blocks[0], blocks[0].cols - 1
            found = mpmath.zeros(n, n)
            for j in range(n):
                found[0, j] = -row[0, j + 1] / row[0, 0]
                if j:
                    found[j, j - 1] = mpmath.mpf(1)
            return found
        inverse, n = blocks[0] ** -1, blocks[0].rows
        lower_right, lower_left = -inverse * blocks[1], -inverse * blocks[2]
        found = mpmath.zeros(2 * n, 2 * n)
        for i in range(n):
            found[i, n + i] = mpmath.mpf(1)
            for j in range(n):
                found[n + i, j], found[n + i, n + j] = lower_left[i, j], lower_right[i, j]
        return found


def roots_exactly(coefficients: Sequence[Any]) -> list[Any]:
    """Roots to 50 digits, near a multiple root too; one that is exactly k-fold to 72/k, as it is pulled apart first."""
    with many_digits():
        try:
            return list(mpmath.polyroots(list(coefficients), maxsteps=300, extraprec=600))
        except mpmath.libmp.NoConvergence:
            apart = [c * (1 + k * mpmath.mpf("1e-72")) for k, c in enumerate(coefficients)]
            return list(mpmath.polyroots(apart, maxsteps=2000, extraprec=600))


@dataclass(frozen=True)
class Measured:
    """A design at many digits: worst objective (as the file has it), limits → relative violation, the abscissa."""

    objective: float
    violations: Mapping[str, float]
    abscissa: float


def measure_exactly(problem: Problem, design: Mapping[str, float]) -> Measured:
    """What a design is worth, all its parameters taken as the doubles that a saved file hands over."""
    worst, abscissa, violations = None, -mpmath.inf, dict.fromkeys(problem.limits, 0.0)
    with many_digits():
        for case in problem.cases:
            stored = {n: float(text) for n, text in {**problem.fixed, **case}.items()} | {
                n: design[n] for n in problem.free
            }
            values = assign(problem, {n: exact(x) for n, x in stored.items()}, {}, MANY_DIGITS)
            roots = roots_exactly(polynomial(problem.system, values))
            values["abscissa"] = max(mpmath.re(s) for s in roots)
            values["damping_ratio"] = min(-mpmath.re(s) / abs(s) if s else mpmath.mpf(1) for s in roots)
            values["decay_rate"] = -values["abscissa"] * evaluate(problem.system.rate, values, MANY_DIGITS)
            abscissa = max(abscissa, values["abscissa"])
            if problem.sense != "locate":
                value = problem.sign * evaluate(problem.objective, values, MANY_DIGITS)
                worst = value if worst is None else max(worst, value)
            for name, text in problem.limits.items():
                over, size = excess(text, values, MANY_DIGITS)
                violations[name] = max(violations[name], float(over / size))
    for name, (low, high) in problem.free.items():
        over = max(low - design[name], design[name] - high)
        violations[name] = max(0.0, over / max(abs(low), abs(high)))
    return Measured(
        problem.sign * float(worst) if worst is not None else 0.0,
        {name: v for name, v in violations.items() if v > 0},
        float(abscissa),
    )
