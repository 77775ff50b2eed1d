"""Expressions of a problem over arrays of designs, all at once: quantities of charts and studies."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tmsopt.algebra.arrays import on_arrays
from tmsopt.algebra.formula import Formula, formula, symbol
from tmsopt.errors import Fault, InputError
from tmsopt.models import Values
from tmsopt.problem.expression import Expression, ExpressionError
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import NO_RADIUS, ROOT_QUANTITIES

_ROOT = tuple(q.name for q in ROOT_QUANTITIES)


@dataclass(frozen=True)
class ArrayFunction:
    """Expressions as a function of arrays of parameters.

    Attributes:
        formula: of the parameters and the root quantities, an output for each expression.
        names: of the expressions.
    """

    problem: Posed
    formula: Formula = field(repr=False)
    names: tuple[str, ...]

    def __call__(self, columns: Mapping[str, Any]) -> dict[str, Any]:
        """Values of the expressions, of a comparison left minus right; nan where one does not exist.

        Args:
            columns: every parameter, and root quantities where they are known already, as numbers
                or arrays whose shapes broadcast. Axes of a grid are best given in shapes (1, n) and (m, 1).

        Returns:
            Name → value, of the shape that the expression depends on, which broadcasts to that of the grid.
        """
        of, known = self.problem.parameter_set, columns
        if missing := set(self.formula.inputs) - set(columns):
            with np.errstate(all="ignore"):
                given = {n: np.asarray(columns[n], dtype=float)[()] for n in of.names}
                values = self.problem.columns(given)
                known = {**columns, **{n: values[n] for n in missing}}
        return dict(zip(self.names, on_arrays(self.formula, known), strict=True))


def array_function(problem: Posed, expressions: Mapping[str, str | Expression]) -> ArrayFunction:
    """Expressions in the vocabulary of a problem as a function of arrays of designs.

    Args:
        expressions: name → expression, as text or parsed; names of quantities, such as ``a0``, are expressions.

    Raises:
        InputError: for a text that is no expression of this problem.
    """
    nodes = nodes_of(problem, expressions)
    return ArrayFunction(problem, formula(nodes.values(), (*problem.parameter_set.names, *_ROOT)), tuple(nodes))


def nodes_of(problem: Posed, expressions: Mapping[str, str | Expression]) -> dict[str, Any]:
    """Expressions as nodes in the parameters and the root quantities; of comparisons left minus right."""
    of = problem.parameter_set
    values = Values(problem.model, of, {n: symbol(n) for n in of.names}, extra=(NO_RADIUS,))
    values = values.with_known({n: symbol(n) for n in _ROOT})
    return {n: e(values) for n, e in parse_all(problem, expressions).items()}


def parse_all(problem: Posed, expressions: Mapping[str, str | Expression]) -> dict[str, Expression]:
    """Expressions in the vocabulary of a problem; what is parsed already stays as it is.

    Raises:
        InputError: for every text that is no expression of this problem.
    """
    found: dict[str, Expression] = {}
    faults: list[Fault] = []
    for name, given in expressions.items():
        try:
            found[name] = given if isinstance(given, Expression) else problem.read(given)
        except ExpressionError as error:
            faults.append(Fault(str(error), ("quantities", name)))
    if faults:
        raise InputError(faults)
    return found
