"""Quantities along a traced curve: parameters, values, stability, and the functions whose zeros are events."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from tmsopt.models import Values
from tmsopt.problem.problem import Problem
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, NO_RADIUS, ROOT_QUANTITIES
from tmsopt.records import Array, Complex, Truth
from tmsopt.roots import Pattern, is_stable, lienard_chipart, roots
from tmsopt.roots.meetings import CLOSED, balance, nearest_two

Function = Callable[[Array, Array], Array]

NOTHING = 1e-9  # a function smaller than this all along the curve is 0 on it, not an event of it

CHANGES = "stability changes"
"""Detail of the marks that count only where they change it."""

_ROUNDED = 1e-14  # a tangent, its inverse and the scale, or a real part beside the modulus: some roundings
_REAL = 1e-6  # of |s|: a factor with a double root has coefficients right to 1e-15 and roots to the root of that


@dataclass(frozen=True)
class Mark:
    """A function of points x and tangents t, both of shape (n, variables), whose zeros are events."""

    name: str
    detail: str
    value: Function


def parameters_of(problem: Problem, x: Array) -> dict[str, Array]:
    """Every parameter of the problem along traced variables, shape (n,) each."""
    of = problem.parameter_set
    free = {
        n: _within(np.arctan(v) if of[n].tangent else v, *problem.free[n])
        for n, v in zip(problem.free, x.T, strict=False)
    }
    return {n: np.array(np.broadcast_to(v, len(x)), dtype=float) for n, v in problem.ordered(free).items()}


def _within(v: Array, low: float, high: float) -> Array:
    """A limit met exactly, where a tangent and its inverse have rounded past it."""
    limited = np.clip(v, low, high)
    return np.where(np.abs(v - limited) <= _ROUNDED * (1 + np.abs(v)), limited, v)


def values_of(problem: Problem, pattern: Pattern, columns: Mapping[str, Array], u: list[Array]) -> Values:
    """Quantities along a curve; those of the roots come from the factors, where multiple roots are exact."""

    def factor_roots() -> Complex:
        parts = [np.stack(np.broadcast_arrays(*f, u[0]), axis=-1)[:, :-1] for f in pattern.factors(u)]
        return np.concatenate([_roots(part) for part in parts], axis=-1)

    def damping_ratio(_: Any) -> Array:
        z = factor_roots()
        return np.asarray(np.min(-z.real / (np.abs(z) + 1e-300), axis=-1))

    formulas = {
        "abscissa": lambda _: np.asarray(factor_roots().real.max(axis=-1)),
        "damping_ratio": damping_ratio,
        ANGULAR_FREQUENCY: lambda _: np.asarray(factor_roots().imag.max(axis=-1)),
    }
    extra = [*(replace(q, value=formulas[q.name]) for q in ROOT_QUANTITIES), NO_RADIUS]
    return Values(problem.model, problem.parameter_set, columns, extra=extra)


def stability(factors: list[list[Any]], count: int) -> Truth:
    """Where every factor has its roots left of the imaginary axis, from coefficients; no factor counts as stable.

    Roots that stay on the axis up to rounding are not left of it, whatever the sign of that.
    """
    stable = on_axis(factors, count) < 0
    for factor in factors:
        if len(factor) - 1 > CLOSED:
            stable &= is_stable(_rows(factor, count))
            continue
        for quantity in lienard_chipart(factor):
            stable &= np.broadcast_to(np.asarray(quantity, dtype=float) > 0, count)
    return stable


def on_axis(factors: list[list[Any]], count: int) -> Array:
    """Square of the modulus of the fastest root on the imaginary axis, up to rounding; −1 where none lies there."""
    fastest = np.full(count, -1.0)
    for factor in factors:
        z = _roots(_rows(factor, count))
        tied = np.where(np.abs(z.real) <= _ROUNDED * np.abs(z), np.abs(z) ** 2, -1.0)
        fastest = np.maximum(fastest, tied.max(axis=-1, initial=-1.0))
    return fastest


def all_real(factors: list[list[Any]], count: int) -> Truth:
    """Where every root of the factors is real and negative."""
    real = stability(factors, count)
    for factor in factors:
        z = _roots(_rows(factor, count))
        real &= np.all(np.abs(z.imag) <= _REAL * np.abs(z), axis=-1)
    return real


def _roots(rows: Array) -> Complex:
    """Roots of one factor along a curve; nan where it is beyond doubles, as beside infinity."""
    known = np.isfinite(rows).all(axis=1) & (rows[:, 0] != 0)
    found = np.full((len(rows), rows.shape[1] - 1), np.nan, dtype=complex)
    found[known] = roots(rows[known])
    return found


def _rows(factor: list[Any], count: int) -> Array:
    """Coefficients of one factor along a curve, shape (count, degree + 1)."""
    return np.stack([np.broadcast_to(np.asarray(c, dtype=float), count) for c in factor], axis=-1)


def satisfied(problem: Problem, values: Values, count: int) -> Truth:
    inside = np.ones(count, dtype=bool)
    for condition in problem.conditions.values():
        if not condition.equality:
            inside &= condition.holds(np.broadcast_to(np.asarray(condition(values), dtype=float), count))
    return inside


def marks(problem: Problem, pattern: Pattern, unknowns: slice, within: Sequence[str]) -> Iterator[Mark]:
    def of_unknowns(function: Callable[[list[Array]], Any]) -> Function:
        return lambda x, t: np.asarray(function([x[:, k] for k in range(unknowns.start, unknowns.stop)]))

    def of_factor(number: int, k: int) -> Function:
        return of_unknowns(lambda u: margins(pattern.remaining(u)[number])[k])

    def of_tangent(k: int) -> Function:
        free = len(problem.free)  # by the arclength in the parameters: the unknowns may move much faster
        return lambda x, t: np.asarray(t[:, k] / (np.linalg.norm(t[:, :free], axis=1) + 1e-300))

    for name, special in pattern.marks.items():
        yield Mark(name, "", of_unknowns(partial(_reduced, pattern, special)))
    if pattern.form == "EP2" and "2EP2" in within:  # q(r) has a double zero where r is the double root of q
        yield Mark("EP4", "", of_unknowns(lambda u: u[0] - nearest_two(pattern.factors(u)[-1])))
    example = [np.ones(1)] * len(pattern.unknowns)
    for number, factor in enumerate(pattern.remaining(example)):
        for k in range(len(margins(factor))):
            name = "capsize" if k == 0 else "weave"  # the first quantity is the constant term
            yield Mark(name, CHANGES, of_factor(number, k))
    for k, parameter in enumerate(problem.free):
        yield Mark("fold", parameter, of_tangent(k))
    for name, condition in problem.conditions.items():
        if not condition.equality:
            yield Mark("constraint", name, _condition(problem, pattern, unknowns, condition))


def _reduced(pattern: Pattern, special: Callable[[Sequence[Any]], Any], u: list[Array]) -> Any:
    return special(pattern.reduced(u))


def margins(factor: list[Any]) -> list[Any]:
    """Quantities of which one vanishes wherever a root of the factor comes to the imaginary axis, the first at 0."""
    return lienard_chipart(factor) if len(factor) - 1 <= CLOSED else [factor[-1], balance(factor)]


def _condition(problem: Problem, pattern: Pattern, unknowns: slice, condition: Callable[[Values], Any]) -> Function:
    def value(x: Array, t: Array) -> Array:
        u = [x[:, k] for k in range(unknowns.start, unknowns.stop)]
        return np.asarray(condition(values_of(problem, pattern, parameters_of(problem, x), u)), dtype=float)

    return value


def sign_changes(value: Array) -> Truth:
    """Where a sequence changes sign from one entry to the next; a 0 has the sign before it, or that after the first."""
    sign = np.sign(value)
    if np.any(sign):
        sign[0] = sign[0] or sign[np.flatnonzero(sign)[0]]
    for k in range(1, len(sign)):
        sign[k] = sign[k] or sign[k - 1]
    return np.asarray(sign[1:] * sign[:-1] < 0)


def vanishes(special: Callable[[Sequence[Any]], Any], pattern: Pattern, u: list[Array]) -> bool:
    """Whether a mark of a pattern is 0 along the whole curve, up to rounding."""
    return bool(np.median(np.abs(special(pattern.reduced(u)))) <= NOTHING)
