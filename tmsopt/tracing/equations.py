"""How large the coefficients of a problem are over its box, so that no unit of time or mass matters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.errors import refusal
from tmsopt.models.user_spectrum import pattern_of
from tmsopt.problem.evaluate import coefficients_of
from tmsopt.problem.problem import Posed
from tmsopt.program.formulate import matching, variables_of
from tmsopt.program.nlp import NLP
from tmsopt.program.starts import completions, spread
from tmsopt.records import Array, Truth
from tmsopt.roots import Pattern
from tmsopt.tracing.continuation import Curve, curve

_SAMPLE = 32  # designs by which sizes are judged
_VANISHED = 1e-9


def sizes(problem: Posed) -> Array:
    """Median sizes of the coefficients over the box of the free parameters; 0 of one that is mostly 0 there."""
    designs = list(islice(spread(problem, 0), _SAMPLE))
    with np.errstate(all="ignore"):
        a = np.abs(coefficients(problem, {n: np.array([d[n] for d in designs]) for n in problem.free}))
    a = a[np.all(np.isfinite(a), axis=1)]
    return np.median(a, axis=0) if len(a) else np.zeros(problem.model.degree + 1)


def coefficients(problem: Posed, columns: Mapping[str, Array]) -> Array:
    """Coefficients of the designs given by columns of the free parameters, shape (designs, n + 1)."""
    a = np.broadcast_arrays(*coefficients_of(problem, problem.ordered(columns)), next(iter(columns.values())))[:-1]
    return np.stack(a, axis=-1).astype(float)


@dataclass(frozen=True)
class Traced:
    """A problem made ready for tracing one pattern.

    Attributes:
        problem: with the pattern to locate and every constraint.
        unit: of each variable in the NLP; here they have natural units.
        unknowns: where the unknowns of the pattern stand among the variables.
        size: of the coefficients over the box.
    """

    problem: Posed
    pattern: Pattern
    nlp: NLP
    on: Curve
    unit: Array
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
    sample = (starting_points(nlp, unit, problem, d)[:1] for d in islice(spread(problem, 0), _SAMPLE))
    if known := [point for points in sample for point in points]:
        scale[free:] = np.clip(np.median(np.abs(known), axis=0), 0.1 * unit, 1e3 * unit)[free:]
    on = curve(x, ca.vertcat(*rows), scale, lower, upper)
    return Traced(problem, pattern, nlp, on, unit, unknowns, sizes(problem))


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


def starting_points(nlp: NLP, unit: Array, problem: Posed, design: Mapping[str, float]) -> list[Array]:
    """All variables at a design, for the first guesses of the pattern's unknowns; none where it has no polynomial."""
    a = [float(c) for c in problem.values(problem.ordered(design)).coefficients]
    proper = a[0] != 0 and np.all(np.isfinite(a))
    return [x * unit for x in completions(nlp, problem, design)] if proper else []
