"""A problem as its rivals see it: eigenvalues, a box, constraints, and no equality, which is solved for a parameter."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.judges import NOWHERE, difference, eigenvalues, evaluated
from tmsopt import Problem
from tmsopt.models import copo, tms
from tmsopt.problem import parse_value
from tmsopt.records import Array

Watch = Callable[[Array, Array], None]
"""Told of every evaluation: designs of shape (n, m) and their abscissae (m,)."""

FEASIBLE = 1e-6
"""Violation, relative to the size of the two sides, up to which a rival's design counts as feasible."""

_PENALTY = 1e3
_QUANTITIES = {q.name: q.value for q in tms.quantities}


@dataclass(frozen=True)
class Found:
    """What a rival ended with.

    Attributes:
        value: abscissa by the rival's own eigenvalues.
        violation: largest violation of a constraint or of the box, relative to the size of the two sides.
        seconds: of all its starts.
    """

    method: str
    value: float
    violation: float
    parameters: Mapping[str, float]
    seconds: float

    @property
    def feasible(self) -> bool:
        """Whether the design counts."""
        return self.violation <= FEASIBLE and self.value < NOWHERE


class Reduced:
    """A problem without its equality: the free parameters that are left, the abscissa and g(x) >= 0, vectorised."""

    def __init__(self, problem: Problem, watch: Watch | None = None) -> None:
        self.problem = problem
        self._watch = watch
        conditions = list(problem.posed.conditions.values())
        equalities = [c.text for c in conditions if c.comparison == "=="]
        self._solved = _solvable(problem, equalities[0]) if equalities else ""
        self._equation = compile(difference(equalities[0]), "equality", "eval") if equalities else None
        self._rows = [
            (compile(difference(c.text), c.text, "eval"), -1.0 if c.comparison == "<=" else 1.0)
            for c in conditions
            if c.comparison != "=="
        ]
        self._used = [q for q in _QUANTITIES if any(q in c.names for c in conditions)]
        self.names = [n for n in problem.free if n != self._solved]
        self.lower, self.upper = np.array([problem.free[n] for n in self.names]).reshape(-1, 2).T

    @property
    def constrained(self) -> bool:
        """Whether any inequality is left."""
        return bool(self._rows or self._solved)

    def parameters(self, x: Array) -> dict[str, Any]:
        """Every parameter for the free ones, x of shape (n,) or (n, m)."""
        values: dict[str, Any] = {**self.problem.fixed, **dict(zip(self.names, x, strict=True))}
        if self._solved:
            values[self._solved] = self._eliminated(values)
        return values

    def coefficients(self, x: Array) -> Array:
        """Those of the polynomial, of shape (5,) or (m, 5)."""
        return np.stack(np.broadcast_arrays(*_coefficients(self.parameters(x)), x[0])[:-1], axis=-1)

    def abscissa(self, x: Array) -> float:
        """Largest real part of the eigenvalues of one design."""
        coefficients = self.coefficients(x)
        regular = bool(np.all(np.isfinite(coefficients)))
        value = float(np.roots(coefficients).real.max(initial=-NOWHERE)) if regular else NOWHERE
        if self._watch:
            self._watch(x[:, None], np.array([value]))
        return value

    def abscissae(self, x: Array) -> Array:
        """The same for designs of shape (n, m), by stacked companion matrices as in `numpy.roots`."""
        values: Array = eigenvalues(self.coefficients(x)).real.max(axis=-1)
        if self._watch:
            self._watch(x, values)
        return values

    def penalised(self, x: Array) -> Any:
        """Abscissa with violations as an exact penalty, of one design (n,) or of many (n, m)."""
        abscissa = self.abscissa(x) if x.ndim == 1 else self.abscissae(x)
        return abscissa + _PENALTY * np.maximum(-self.rows(x), 0.0).sum(axis=0)

    def rows(self, x: Array) -> Array:
        """g(x) of shape (rows,) or (rows, m), at least 0 where a design is feasible."""
        values = self.parameters(x)
        solved = [values[self._solved]] if self._solved else []
        if self._used:
            values |= {f"a{k}": np.asarray(a)[()] for k, a in enumerate(_coefficients(values))}
            values |= {name: _QUANTITIES[name](values) for name in self._used}
        g = [sign * evaluated(code, values) for code, sign in self._rows]
        for value in solved:
            lower, upper = self.problem.free[self._solved]
            g += [value - lower, upper - value]
        found = np.array([np.broadcast_to(row, np.shape(x)[1:]) for row in g], dtype=float).reshape(
            len(g), *x.shape[1:]
        )
        return np.where(np.isfinite(found), found, -NOWHERE)

    def found(self, method: str, x: Array, seconds: float) -> Found:
        """A rival's end point, judged."""
        x = np.clip(x, self.lower, self.upper)
        parameters = {n: float(v) for n, v in self.parameters(x).items()}
        return Found(method, self.abscissa(x), _violation(self.problem, parameters), parameters, seconds)

    def _eliminated(self, values: dict[str, Any]) -> Any:
        assert self._equation is not None
        first, second = (evaluated(self._equation, values | {self._solved: v}) for v in (0.25, 0.75))
        return 0.25 - 0.5 * first / (second - first)


def _coefficients(p: Mapping[str, Any]) -> list[Any]:
    T = np.tan(p["lambda_s"])
    return copo(p["Fr"], p["mu"], p["chi_B"], p["chi_H"], p["zeta_B"], p["zeta_H"], T)


def _violation(problem: Problem, parameters: Mapping[str, float]) -> float:
    """Largest violation, by the package's own evaluation and not by what the rival was told."""
    values = problem.posed.values(parameters)
    worst = [c.violation(values) for c in problem.posed.conditions.values()]
    worst += [max(lo - parameters[n], parameters[n] - hi, 0.0) for n, (lo, hi) in problem.free.items()]
    largest = float(np.max(worst, initial=0.0))
    return largest if np.isfinite(largest) else np.inf


def _solvable(problem: Problem, equality: str) -> str:
    """A free parameter in which the equality is linear, so that it can be solved for it."""
    expression = parse_value(difference(equality), problem.posed.vocabulary)
    rng = np.random.default_rng(0)
    designs = [{n: rng.uniform(*ends) for n, ends in problem.free.items()} for _ in range(3)]

    def at(design: Mapping[str, float], name: str, value: float) -> float:
        return float(expression(problem.posed.values(problem.posed.ordered({**design, name: value}))))

    def second_differences(name: str) -> Iterable[tuple[float, float]]:
        for design in designs:
            low, middle, high = (at(design, name, v) for v in (0.25, 0.5, 0.75))
            yield abs(low - 2 * middle + high), abs(high - low)

    for name in problem.free:
        if all(bend <= 1e-12 * (1 + slope) and slope > 1e-9 for bend, slope in second_differences(name)):
            return name
    raise ValueError(f"{equality!r} is not linear in any free parameter")
