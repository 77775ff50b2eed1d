"""How large the coefficients of a problem are over its box, so that no unit of time or mass matters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.errors import refusal
from tmsopt.models.user_spectrum import pattern_of
from tmsopt.problem.problem import Posed
from tmsopt.program.formulate import matching, variables_of
from tmsopt.program.nlp import NLP
from tmsopt.program.starts import spread
from tmsopt.records import Array, Complex, Truth
from tmsopt.roots import Pattern, roots
from tmsopt.tracing.continuation import Curve, curve

_SAMPLE = 32  # designs by which sizes are judged
_VANISHED = 1e-9


def sizes(problem: Posed) -> Array:
    """Median sizes of the coefficients over the box of the free parameters; 0 of one that is mostly 0 there."""
    a = _coefficients(problem, list(islice(spread(problem, 0), _SAMPLE)))
    a = np.abs(a[np.all(np.isfinite(a), axis=1)])
    return np.median(a, axis=0) if len(a) else np.zeros(problem.model.degree + 1)


def coefficients(problem: Posed, columns: Mapping[str, Array]) -> Array:
    """Coefficients of the designs given by columns of the free parameters, shape (designs, n + 1)."""
    a = problem.model.coefficients(problem.ordered(columns), problem.parameter_set)
    shape = np.shape(next(iter(columns.values())))
    return np.stack([np.broadcast_to(np.asarray(c, dtype=float), shape) for c in a], axis=-1)


def _coefficients(problem: Posed, designs: Sequence[Mapping[str, float]]) -> Array:
    """Likewise of a list of designs, with a parameter or more."""
    with np.errstate(all="ignore"):
        return coefficients(problem, {n: np.array([d[n] for d in designs]) for n in problem.free})


@dataclass(frozen=True)
class Traced:
    """A problem made ready for tracing one pattern.

    Attributes:
        problem: with the pattern to locate and every constraint.
        unknowns: where the unknowns of the pattern stand among the variables.
        size: of the coefficients over the box.
    """

    problem: Posed
    pattern: Pattern
    nlp: NLP
    on: Curve
    unknowns: slice
    size: Array

    def leads(self, a: Array) -> Truth:
        """Whether a0 is there at all, beside the others: at a0 = a1 = … = 0 any factors fit; a of shape (…, n + 1)."""
        known = self.size > 0
        share = np.abs(a[..., known]) / self.size[known]
        return np.asarray(np.abs(a[..., 0]) > _VANISHED * self.size[0] * share.max(axis=-1, initial=0.0))


def prepare(problem: Posed, pattern: Pattern | None = None) -> Traced:
    """The equations of a pattern, by default the one that the problem locates, compiled for tracing."""
    pattern, free = pattern or pattern_of(problem.model, str(problem.locate)), len(problem.free)
    equalities = {n: c for n, c in problem.constraints.items() if problem.conditions[n].equality}
    nlp = matching(problem.derive(constraints=equalities), pattern)
    unit, unknowns = np.ones(len(nlp.variables)), slice(free, free + len(pattern.unknowns))
    unit[unknowns] = np.array([nlp.unit**power for power in pattern.powers])  # of the NLP; x has natural units
    x = ca.SX.sym("x", len(unit))
    g = nlp.symbolic(x / ca.DM(unit))[1]
    rows = [g[k] for k in range(len(nlp.rows)) if nlp.row_lower[k] == nlp.row_upper[k]]
    if equalities and len(rows) != len(unit) - 1:
        names = ", ".join(equalities)
        message = f"an equality of a root quantity cannot be traced along {pattern.name}; leave out {names}"
        raise refusal(message, "constraints")
    lower, upper = np.array(nlp.lower), np.array(nlp.upper)
    for k, name in enumerate(pattern.unknowns):
        if name in pattern.ends:
            lower[free + k] = 0.0
    scale = unit.copy()
    scale[:free] = upper[:free] - lower[:free]
    sample = starting_points(nlp, problem, list(islice(spread(problem, 0), _SAMPLE)), 1)
    known = np.array([s[0] for s in sample if s]).reshape(-1, len(nlp.variables))
    if known.size:
        scale[free:] = np.clip(np.median(np.abs(known[:, free:]), axis=0), 0.1 * unit[free:], 1e3 * unit[free:])
    on = curve(x, ca.vertcat(*rows), scale, lower, upper)
    return Traced(problem, pattern, nlp, on, unknowns, sizes(problem))


def symbols_of(problem: Posed, x: Sequence[Any]) -> dict[str, Any]:
    """Free parameters for traced variables that are CasADi expressions."""
    of = problem.parameter_set
    return {n: ca.atan(v) if of[n].tangent else v for n, v in zip(problem.free, x, strict=False)}


def design_at(problem: Posed, x: Array) -> dict[str, Any]:
    """Free parameters for traced variables, floats or columns."""
    of = problem.parameter_set
    return {n: np.arctan(v) if of[n].tangent else v for n, v in zip(problem.free, x.T, strict=False)}


def limits_of(problem: Posed) -> tuple[Array, Array]:
    """Least and greatest values of the traced variables that are free parameters."""
    sides = zip(*problem.free.values(), strict=True)
    low, high = (np.array(variables_of(problem, dict(zip(problem.free, side, strict=True)))) for side in sides)
    return low, high


def starting_points(
    nlp: NLP, problem: Posed, designs: Sequence[Mapping[str, float]], count: int | None = None
) -> list[list[Array]]:
    """All variables for each design, for the first guesses of the pattern's unknowns, as many as asked for, or all."""
    a = _coefficients(problem, designs)
    proper = np.all(np.isfinite(a), axis=1) & (a[:, 0] != 0)
    found = iter(roots(a[proper]) if np.any(proper) else ())
    known = zip(designs, proper, strict=True)
    return [_guessed(nlp, problem, d, next(found), count) if there else [] for d, there in known]


def _guessed(nlp: NLP, problem: Posed, design: Mapping[str, float], z: Complex, count: int | None) -> list[Array]:
    values = [problem.values(problem.ordered(design))] if len(nlp.lifts) > 1 else []  # the pattern's takes the roots
    guesses = [lift.guess(values, [z / nlp.unit if k else z]) for k, lift in enumerate(nlp.lifts)]  # those in its unit
    if not all(guesses):
        return []
    x, others = variables_of(problem, design), [c for guess in guesses[1:] for c in guess[0]]
    return [np.array([*x, *first, *others]) for first in guesses[0][:count]]
