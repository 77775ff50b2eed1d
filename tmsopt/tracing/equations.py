"""The equations of a pattern as a compiled curve, with variables of order 1 over the box."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.errors import input_error
from tmsopt.models.user_spectrum import pattern_of
from tmsopt.problem.evaluate import coefficients_of
from tmsopt.problem.problem import Posed
from tmsopt.program.formulate import formulate_matching, variables_of
from tmsopt.program.nlp import NLP
from tmsopt.program.starts import complete_starts, sample_box
from tmsopt.records import Array, Truth
from tmsopt.roots import Pattern
from tmsopt.tracing.chain_curve import ChainSetup, has_chain_curve, prepare_chains
from tmsopt.tracing.continuation import Curve, compile_curve
from tmsopt.tracing.solving import map_rows

_SAMPLE_SIZE = 32  # designs from which sizes of the unknowns are estimated
_MIN_LEADING = 1e-9  # smallest a0, relative to the largest coefficient, that is not negligible


def compute_coefficients(problem: Posed, columns: Mapping[str, Array]) -> Array:
    """Coefficients of many designs, shape (designs, n + 1); `columns`: free parameter → its values."""
    a = np.broadcast_arrays(*coefficients_of(problem, problem.ordered(columns)), next(iter(columns.values())))[:-1]
    return np.stack(a, axis=-1).astype(float)


@dataclass(frozen=True)
class TracingSetup:
    """All that is needed to trace one pattern of a problem.

    Attributes:
        problem: the problem, which has the pattern to locate and every constraint.
        unit: unit that the NLP has for each variable, in natural units.
        unknown_columns: indices of the pattern's unknowns among the variables.
    """

    problem: Posed
    pattern: Pattern
    nlp: NLP
    curve: Curve
    unit: Array
    unknown_columns: slice

    def has_leading_coefficient(self, a: Array) -> Truth:
        """Whether a0 is not negligible, for a of shape (…, n + 1). If all coefficients vanish, any factors fit them."""
        size = np.abs(a) / self.nlp.unit ** np.arange(a.shape[-1])
        return np.asarray(size[..., 0] > _MIN_LEADING * size.max(axis=-1))

    def list_starts(self, design: Mapping[str, float], best_first: bool) -> list[Array]:
        """All variables at a design, in units of the scale, for each guess of the unknowns.

        Args:
            best_first: sort the guesses by their residuals.
        """
        points = [x * self.unit / self.curve.scale for x in complete_starts(self.nlp, self.problem, design)]
        return sorted(points, key=lambda y: best_first and np.abs(map_rows(self.curve.evaluate, y[None])[0]).max())


Setup = TracingSetup | ChainSetup


def prepare_tracing(problem: Posed) -> Setup:
    """Compile the equations of the pattern that the problem locates."""
    pattern = pattern_of(problem.model, str(problem.locate))
    return prepare_chains(problem, pattern) if has_chain_curve(problem) else prepare_factors(problem, pattern)


def prepare_factors(problem: Posed, pattern: Pattern) -> TracingSetup:
    """Compile the equations of a pattern by the factors of the polynomial."""
    free_count = len(problem.free)
    equalities = {n: c for n, c in problem.constraints.items() if problem.conditions[n].equality}
    nlp = formulate_matching(problem.derive(constraints=equalities), pattern)
    unit, unknown_columns = np.ones(len(nlp.variables)), slice(free_count, free_count + len(pattern.unknowns))
    # the NLP has units of its own; x has natural units
    unit[unknown_columns] = np.array([nlp.unit**power for power in pattern.powers])
    x = ca.SX.sym("x", len(unit))
    g = nlp.symbolic(x / ca.DM(unit))[1]
    rows = [g[k] for k in range(len(nlp.rows)) if nlp.row_lower[k] == nlp.row_upper[k]]
    if equalities and len(rows) != len(unit) - 1:
        names = ", ".join(equalities)
        message = f"cannot trace {pattern.name} under an equality constraint on a root quantity; remove {names}"
        raise input_error(message, "constraints")
    lower, upper = np.array(nlp.lower), np.array(nlp.upper)
    for k, name in enumerate(pattern.unknowns):
        if name in pattern.ends:
            lower[free_count + k] = 0.0
    scale = unit.copy()
    scale[:free_count] = upper[:free_count] - lower[:free_count]
    sample = (
        next(complete_starts(nlp, problem, design), None) for design in islice(sample_box(problem, 0), _SAMPLE_SIZE)
    )
    if guesses := [guess for guess in sample if guess is not None]:
        scale[free_count:] = (unit * np.clip(np.median(np.abs(guesses), axis=0), 0.1, 1e3))[free_count:]
    return TracingSetup(
        problem, pattern, nlp, compile_curve(x, ca.vertcat(*rows), scale, lower, upper), unit, unknown_columns
    )


def design_at(problem: Posed, x: Array) -> dict[str, Any]:
    """Free parameters from traced variables, as floats or columns."""
    parameter_set = problem.parameter_set
    return {n: np.arctan(v) if parameter_set[n].tangent else v for n, v in zip(problem.free, x.T, strict=False)}


def limits_of(problem: Posed) -> tuple[Array, Array]:
    """Smallest and largest values of the traced variables that are free parameters."""
    sides = zip(*problem.free.values(), strict=True)
    low, high = (np.array(variables_of(problem, dict(zip(problem.free, side, strict=True)))) for side in sides)
    return low, high
