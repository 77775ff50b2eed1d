"""Expressions of a problem over arrays of designs, all at once: quantities of charts and studies."""

import threading
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.arithmetic.arrays import Program, program
from tmsopt.arithmetic.walk import NotAccepted
from tmsopt.design.expression import Expression, ExpressionError
from tmsopt.design.problem import Problem
from tmsopt.design.quantities import ARRAY_ROOT_QUANTITIES, NO_RADIUS, ROOT_QUANTITIES
from tmsopt.errors import Fault, InputError
from tmsopt.models import Model, ParameterSet, Values
from tmsopt.records import Array

_ROOT = tuple(q.name for q in ROOT_QUANTITIES)


@dataclass(frozen=True)
class ArrayFunction:
    """Expressions as a function of arrays of parameters.

    Attributes:
        program: computes those that CasADi can write down of the parameters and the root quantities.
        written: names of these.
        others: those that it cannot, evaluated by the formulas of the model on whole arrays.
        known: parameters that were given for good, see `settled`.
    """

    model: Model = field(repr=False)
    of: ParameterSet = field(repr=False)
    program: Program = field(repr=False)
    written: tuple[str, ...]
    others: Mapping[str, Expression]
    known: Mapping[str, Any] = field(default_factory=dict, repr=False)

    def __call__(self, columns: Mapping[str, Any], into: Mapping[str, Array] | None = None) -> dict[str, Any]:
        """Values of the expressions, of a comparison left minus right; nan where one does not exist.

        Args:
            columns: every parameter that is not settled, and root quantities where they are known already, as numbers
                or arrays whose shapes broadcast. Axes of a grid are best given in shapes (1, n) and (m, 1).
            into: name → array for the values, used if they have the shape of the grid.

        Returns:
            Name → value, of the shape that the expression depends on, which broadcasts to that of the grid.
        """
        columns = {**self.known, **columns}
        if unknown := [n for n in _ROOT if n not in columns and n in self.inputs]:
            values = self._values(columns)
            with np.errstate(all="ignore"):
                columns |= {n: values[n] for n in unknown}
        places = {k: into[n] for k, n in enumerate(self.written) if n in into} if into else {}
        found = dict(zip(self.written, self.program(self._arguments(columns), places), strict=True))
        if self.others:
            values = self._values(columns)
            found |= {n: np.asarray(e(values), dtype=float)[()] for n, e in self.others.items()}
        return found

    @property
    def inputs(self) -> set[str]:
        """Names of the parameters and root quantities that are not settled."""
        return {(*self.of.names, *_ROOT)[k] for k in self.program.arguments}

    @property
    def names(self) -> tuple[str, ...]:
        """Of the expressions."""
        return (*self.written, *self.others)

    def settled(self, columns: Mapping[str, Any]) -> "ArrayFunction":
        """The same with some parameters given for good: what depends on them alone is computed once, now."""
        rest = self.program.settled(self._arguments(columns))
        return replace(self, program=rest, known={**self.known, **columns})

    def _arguments(self, columns: Mapping[str, Any]) -> dict[int, Any]:
        return {k: columns[n] for k, n in enumerate((*self.of.names, *_ROOT)) if n in columns}

    def _values(self, columns: Mapping[str, Any]) -> Values:
        """The formulas of the model themselves, on arrays."""
        with np.errstate(all="ignore"):
            arrays = {n: np.asarray(columns[n], dtype=float)[()] for n in self.of.names}
            values = Values(self.model, self.of, arrays, extra=ARRAY_ROOT_QUANTITIES)
        for name in set(_ROOT) & set(columns):
            values.define(name, columns[name])
        return values


def array_function(problem: Problem, expressions: Mapping[str, str | Expression]) -> ArrayFunction:
    """Expressions in the vocabulary of a problem as a function of arrays of designs.

    Args:
        expressions: name → expression, as text or parsed; names of quantities, such as ``a0``, are expressions.

    Raises:
        InputError: for a text that is no expression of this problem.
    """
    model, of, stated = problem.model, problem.parameter_set, parsed(problem, expressions)
    with _as_written():
        symbols = {n: ca.SX.sym(n) for n in (*of.names, *_ROOT)}
        values = Values(model, of, {n: symbols[n] for n in of.names}, extra=(NO_RADIUS,))
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
    return ArrayFunction(model, of, found, tuple(written), others)


def parsed(problem: Problem, expressions: Mapping[str, str | Expression]) -> dict[str, Expression]:
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
