"""A problem made ready to be traced: its pattern's equations as a curve, in units of its coefficients over the box."""

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
from tmsopt.program.starts import spread
from tmsopt.records import Array, Truth
from tmsopt.roots import Pattern, roots
from tmsopt.tracing.continuation import Curve, curve

_SAMPLE = 32  # designs by which sizes are judged
_VANISHED = 1e-9


def sizes(problem: Posed) -> Array:
    """Median sizes of the coefficients over the box of the free parameters; 0 of one that is mostly 0 there."""
    a = np.abs(_coefficients(problem, list(islice(spread(problem, 0), _SAMPLE))))
    a = a[np.all(np.isfinite(a), axis=1)]
    return np.median(a, axis=0) if len(a) else np.zeros(problem.model.degree + 1)


def coefficients(problem: Posed, columns: Mapping[str, Array]) -> Array:
    """Coefficients of the designs given by columns of the free parameters, shape (designs, n + 1)."""
    a = np.broadcast_arrays(*coefficients_of(problem, problem.ordered(columns)), next(iter(columns.values())))[:-1]
    return np.stack(a, axis=-1).astype(float)


def _coefficients(problem: Posed, designs: Sequence[Mapping[str, float]]) -> Array:
    """Coefficients of a list of designs, with a parameter or more."""
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
    sample = starting_points(nlp, problem, list(islice(spread(problem, 0), _SAMPLE)))
    if known := [points[0] for points in sample if points]:
        scale[free:] = np.clip(np.median(np.abs(known), axis=0), 0.1 * unit, 1e3 * unit)[free:]
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


def starting_points(nlp: NLP, problem: Posed, designs: Sequence[Mapping[str, float]]) -> list[list[Array]]:
    """All variables at each design, for every guess of the pattern's unknowns; none where it has no polynomial."""
    a = _coefficients(problem, designs)
    proper = np.all(np.isfinite(a), axis=1) & (a[:, 0] != 0)
    found: list[list[Array]] = [[] for _ in designs]
    for k, z in zip(np.flatnonzero(proper).tolist(), roots(a[proper]) if np.any(proper) else (), strict=True):
        values = [problem.values(problem.ordered(designs[k]))] if len(nlp.lifts) > 1 else []
        # the pattern's guesses are of the roots themselves, all others in the unit of the NLP
        first, *others = (lift.guess(values, [z / nlp.unit if j else z]) for j, lift in enumerate(nlp.lifts))
        rest = [x for guesses in others for x in (guesses or [[np.nan]])[0]]
        found[k] = [np.array([*variables_of(problem, designs[k]), *guess, *rest]) for guess in first]
    return found
