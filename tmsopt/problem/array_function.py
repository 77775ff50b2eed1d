"""Expressions of a problem over arrays of designs, all at once: quantities of charts and studies."""

import threading
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.algebra.arrays import Program, program
from tmsopt.algebra.walk import NotAccepted
from tmsopt.errors import Fault, InputError
from tmsopt.models import Values
from tmsopt.problem.expression import Expression, ExpressionError
from tmsopt.problem.problem import Problem
from tmsopt.problem.quantities import ARRAY_ROOT_QUANTITIES, NO_RADIUS, ROOT_QUANTITIES

_ROOT = tuple(q.name for q in ROOT_QUANTITIES)


@dataclass(frozen=True)
class ArrayFunction:
    """Expressions as a function of arrays of parameters.

    Attributes:
        program: computes those that CasADi can write down of the parameters and the root quantities.
        written: names of these.
        others: those that it cannot, evaluated by the formulas of the model on whole arrays.
    """

    problem: Problem
    program: Program = field(repr=False)
    written: tuple[str, ...]
    others: Mapping[str, Expression]

    def __call__(self, columns: Mapping[str, Any]) -> dict[str, Any]:
        """Values of the expressions, of a comparison left minus right; nan where one does not exist.

        Args:
            columns: every parameter, and root quantities where they are known already, as numbers
                or arrays whose shapes broadcast. Axes of a grid are best given in shapes (1, n) and (m, 1).

        Returns:
            Name → value, of the shape that the expression depends on, which broadcasts to that of the grid.
        """
        of, known = self.problem.parameter_set, columns
        names = (*of.names, *_ROOT)
        inputs = {k: names[k] for k in self.program.arguments}
        with np.errstate(all="ignore"):
            if self.others or set(inputs.values()) - set(columns):  # the formulas of the model themselves, on arrays
                given = {n: np.asarray(columns[n], dtype=float)[()] for n in of.names}
                known = Values(self.problem.model, of, given, extra=ARRAY_ROOT_QUANTITIES)
                for name in set(_ROOT) & set(columns):
                    known.define(name, columns[name])
            found = dict(zip(self.written, self.program({k: known[n] for k, n in inputs.items()}), strict=True))
            return found | {n: np.asarray(e(known), dtype=float)[()] for n, e in self.others.items()}

    @property
    def names(self) -> tuple[str, ...]:
        """Of the expressions."""
        return (*self.written, *self.others)


def array_function(problem: Problem, expressions: Mapping[str, str | Expression]) -> ArrayFunction:
    """Expressions in the vocabulary of a problem as a function of arrays of designs.

    Args:
        expressions: name → expression, as text or parsed; names of quantities, such as ``a0``, are expressions.

    Raises:
        InputError: for a text that is no expression of this problem.
    """
    of, stated = problem.parameter_set, parse_all(problem, expressions)
    with _as_written():
        symbols = {n: ca.SX.sym(n) for n in (*of.names, *_ROOT)}
        values = Values(problem.model, of, {n: symbols[n] for n in of.names}, extra=(NO_RADIUS,))
        for name in _ROOT:
            values.define(name, symbols[name])
        written = {n: s for n, e in stated.items() if (s := _symbolic(e, values)) is not None}
        column = ca.densify(ca.vertcat(*written.values())) if written else ca.SX(0, 1)
        function = ca.Function("f", [ca.vertcat(*symbols.values())], [column], {"cse": True})
    try:
        found = program(function)
    except NotAccepted:  # an operation that only CasADi has: every expression by the formulas
        written, found = {}, Program(())
    others = {n: e for n, e in stated.items() if n not in written}
    return ArrayFunction(problem, found, tuple(written), others)


def parse_all(problem: Problem, expressions: Mapping[str, str | Expression]) -> dict[str, Expression]:
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


def _symbolic(expression: Expression, values: Values) -> Any:
    """A scalar CasADi expression, or None for a formula that does not take symbols."""
    try:
        found = expression.symbolic(values)
    except (TypeError, ValueError, AttributeError, NotImplementedError, RuntimeError):
        return None
    scalar = ca.SX(found) if isinstance(found, ca.SX | float | int) else None
    return scalar if scalar is not None and scalar.shape == (1, 1) else None


_ONE_AT_A_TIME = threading.Lock()


@contextmanager
def _as_written() -> Iterator[None]:
    """CasADi without its simplifications, such as x for sqrt(x)**2: they change roundings and where a value exists.

    The switch is one for the whole process; an expression that another thread writes meanwhile is a little longer.
    """
    with _ONE_AT_A_TIME, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of NumPy's functions on symbols
        before = ca.GlobalOptions.getSimplificationOnTheFly()
        ca.GlobalOptions.setSimplificationOnTheFly(False)
        try:
            yield
        finally:
            ca.GlobalOptions.setSimplificationOnTheFly(before)
