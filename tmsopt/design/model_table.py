"""The [model] table of a problem file: the user's own system, by matrices or coefficients written as expressions."""

import math
from collections.abc import Mapping
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.design.expression import Expression, ExpressionError, parse_value
from tmsopt.errors import Fault, short, suggest
from tmsopt.models import Model, Unfit, from_coefficients, from_matrices
from tmsopt.models.names import unusable

_MATRICES = ("M", "D", "K", "A")
_KEYS = ("name", *_MATRICES, "coefficients", "quantities")

_EXAMPLE = (
    "write M = [['m']], D = [['c']], K = [['k']], or A = [['a', '1'], ['b', '0']], or coefficients = ['1', 'c', 'k']"
)


def stated_model(table: Mapping[str, Any]) -> tuple[list[Fault], Model | None]:
    """The model of a [model] table, and what is wrong with it.

    An entry is a number or an expression; each name in one is a parameter, unless it is one of ``[model.quantities]``,
    which may use one another.
    """
    reader = _Reader(table)
    given = [key for key in (*_MATRICES, "coefficients") if key in table]
    for key in table:
        if key not in _KEYS:
            reader.fault(f"unknown key '{key}'; {suggest(key, _KEYS)}", key)
    name = table.get("name", "stated")
    if not isinstance(name, str) or not name.strip() or not name.isprintable():
        reader.fault(f"found {short(name)}; accepted: a text of one line in quotes", "name")
    if not given:
        reader.fault(f"states no system; {_EXAMPLE}")
    if "coefficients" in given and len(given) > 1:
        reader.fault(f"stands beside {given[0]}; keep coefficients, or the matrices", "coefficients")
    reader.read_quantities()
    entries = {key: reader.matrix(key) for key in given if key != "coefficients"}
    row = reader.row(table["coefficients"], ("coefficients",)) if "coefficients" in given else []
    quantities = {n: reader.quantity(n) for n in reader.written}
    if reader.faults:
        return reader.faults, None
    try:
        if row:
            return [], from_coefficients(row, name=name.strip(), quantities=quantities)
        return [], from_matrices(**entries, name=name.strip(), quantities=quantities)
    except Unfit as error:
        where, _, rest = error.message.partition(": ")
        if error.key == "quantities" and where in quantities:
            return [Fault(rest, ("model", "quantities", where))], None
        return [Fault(error.message, ("model", error.key))], None


class _Reader:
    """Turns texts into expressions of shared symbols, and collects what is wrong; discarded after one table."""

    def __init__(self, table: Mapping[str, Any]) -> None:
        self.table = table
        self.faults: list[Fault] = []
        self.symbols: dict[str, Any] = {}
        self.written: dict[str, Expression | None] = {}
        self.known: dict[str, Any] = {}

    def fault(self, message: str, *key: str) -> None:
        self.faults.append(Fault(message, ("model", *key)))

    def matrix(self, key: str) -> list[list[Any]]:
        rows = self.table[key]
        if not isinstance(rows, list) or not rows or not all(isinstance(row, list) for row in rows):
            self.fault(f"found {short(rows)}; accepted: rows in brackets, such as [['m', 0], [0, 'm']]", key)
            return []
        return [self.row(row, (key, str(k))) for k, row in enumerate(rows, start=1)]

    def row(self, entries: Any, place: tuple[str, ...]) -> list[Any]:
        if not isinstance(entries, list) or not entries:
            self.fault(f"found {short(entries)}; accepted: expressions in brackets, such as ['1', 'c', 'k']", place[0])
            return []
        many = len(place) > 1
        return [
            self.entry(entry, place[0], f"row {place[1]}, column {k}" if many else f"entry {k}")
            for k, entry in enumerate(entries, start=1)
        ]

    def entry(self, entry: Any, key: str, where: str) -> Any:
        """One entry as a number or CasADi expression."""
        if isinstance(entry, int | float) and not isinstance(entry, bool) and _is_finite(entry):
            return entry
        if not isinstance(entry, str):
            self.fault(f"{where}: found {short(entry)}; accepted: a finite number, or an expression in quotes", key)
            return 0
        expression = self.parsed(entry, (key,), f"{where}: ")
        return self.symbolic(expression) if expression else 0

    def read_quantities(self) -> None:
        """The formulas of the quantities, each to be had by `quantity`."""
        written = self.table.get("quantities", {})
        if not isinstance(written, dict):
            self.fault(f"found {short(written)}; accepted: a table [model.quantities]", "quantities")
            return
        for name, text in written.items():
            key = ("quantities", name)
            if why := unusable(name):
                self.fault(f"'{name}' {why}; give the quantity a name of its own", *key)
            elif not isinstance(text, str):
                self.fault(f"found {short(text)}; accepted: an expression in quotes, such as 'k1/k2'", *key)
            else:
                self.written[name] = self.parsed(text, key, "")
        for name in list(self.written):
            if circle := self.circle((name,)):
                self.fault(f"uses itself: {' → '.join(circle)}; write it in parameters", "quantities", name)
                self.written[name] = None

    def circle(self, path: tuple[str, ...]) -> tuple[str, ...]:
        """How a quantity leads back to itself; empty where it does not."""
        expression = self.written.get(path[-1])
        for name in expression.names if expression else ():
            if name == path[0]:
                return (*path, name)
            if name not in path and (found := self.circle((*path, name))):
                return found
        return ()

    def quantity(self, name: str) -> Any:
        """A quantity as an expression of parameters."""
        if name not in self.known:
            expression = self.written[name]
            self.known[name] = self.symbolic(expression) if expression else 0
        return self.known[name]

    def symbolic(self, expression: Expression) -> Any:
        """An expression in symbols, made when first met."""
        values = {}
        for name in expression.names:
            is_parameter = name not in self.written
            values[name] = self.symbols.setdefault(name, ca.SX.sym(name)) if is_parameter else self.quantity(name)
        with np.errstate(all="ignore"):  # what is not finite is found by the model
            return expression.symbolic(values)

    def parsed(self, text: str, key: tuple[str, ...], where: str) -> Expression | None:
        """An expression; None for one with a fault."""
        try:
            expression = parse_value(text, None, example="k1 + k2")
        except ExpressionError as error:
            self.fault(f"{where}{error}", *key)
            return None
        for name in expression.names:
            if why := unusable(name):
                self.fault(f"{where}'{name}' {why}; give the parameter another name", *key)
                return None
        return expression


def _is_finite(number: float) -> bool:
    try:
        return math.isfinite(number)
    except OverflowError:  # an integer of hundreds of digits
        return False
