"""The [model] table of a problem file: the user's own system, by matrices or coefficients written as expressions."""

import math
from collections.abc import Mapping
from typing import Any

import casadi as ca

from tmsopt.design.errors import Fault, short, suggest
from tmsopt.design.expression import CONSTANTS, FUNCTIONS, Expression, ExpressionError, parse_formula
from tmsopt.design.quantities import ROOT_NAMES
from tmsopt.models import Model, Unfit, from_coefficients, from_matrices

_MATRICES = ("M", "D", "K", "A")
_KEYS = ("name", *_MATRICES, "coefficients", "quantities")
_TAKEN = (*ROOT_NAMES, "structure", "objective", *FUNCTIONS, *CONSTANTS)

_EXAMPLE = (
    "write M = [['m']], D = [['c']], K = [['k']], or A = [['a', '1'], ['b', '0']], or coefficients = ['1', 'c', 'k']"
)


def stated_model(table: Mapping[str, Any]) -> tuple[list[Fault], Model | None]:
    """The model of a [model] table, and what is wrong with it.

    An entry is a number or an expression; each name in one is a parameter, unless it is one of ``[model.quantities]``.
    """
    reader = _Reader(table)
    given = [key for key in (*_MATRICES, "coefficients") if key in table]
    for key in table:
        if key not in _KEYS:
            reader.fault(f"unknown key '{key}'; {suggest(key, _KEYS)}", key)
    name = table.get("name", "stated")
    if not isinstance(name, str) or not name.strip():
        reader.fault(f"found {short(name)}; accepted: a text in quotes", "name")
    if not given:
        reader.fault(f"states no system; {_EXAMPLE}")
    if "coefficients" in given and len(given) > 1:
        reader.fault(f"stands beside {given[0]}; keep coefficients, or the matrices", "coefficients")
    entries = {key: reader.matrix(key) for key in given if key != "coefficients"}
    row = reader.row(table["coefficients"], ("coefficients",)) if "coefficients" in given else []
    quantities = reader.quantities()
    if reader.faults:
        return reader.faults, None
    try:
        if row:
            return [], from_coefficients(row, name=name.strip(), quantities=quantities)
        return [], from_matrices(**entries, name=name.strip(), quantities=quantities)
    except Unfit as error:
        return [Fault(str(error).partition(": ")[2], ("model", error.key))], None


class _Reader:
    """Turns texts into expressions of shared symbols, and collects what is wrong; discarded after one table."""

    def __init__(self, table: Mapping[str, Any]) -> None:
        self.table = table
        self.faults: list[Fault] = []
        self.symbols: dict[str, Any] = {}

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
        if isinstance(entry, int | float) and not isinstance(entry, bool) and math.isfinite(entry):
            return entry
        if not isinstance(entry, str):
            self.fault(f"{where}: found {short(entry)}; accepted: a number, or an expression in quotes", key)
            return 0
        expression = self.parsed(entry, (key,), f"{where}: ")
        return expression.symbolic(self.symbols) if expression else 0

    def quantities(self) -> dict[str, Any]:
        """Each quantity as an expression of parameters; it may use those above it."""
        written = self.table.get("quantities", {})
        if not isinstance(written, dict):
            self.fault(f"found {short(written)}; accepted: a table [model.quantities]", "quantities")
            return {}
        found: dict[str, Any] = {}
        for name, text in written.items():
            key = ("quantities", name)
            if name in self.symbols or name in _TAKEN or not name.isidentifier():
                what = "a parameter" if name in self.symbols else "taken" if name in _TAKEN else "no name"
                self.fault(f"'{name}' is {what}; give the quantity a name of its own", *key)
            elif not isinstance(text, str):
                self.fault(f"found {short(text)}; accepted: an expression in quotes, such as 'k1/k2'", *key)
            elif expression := self.parsed(text, key, "", known=found):
                found[name] = expression.symbolic({**self.symbols, **found})
        return found

    def parsed(self, text: str, key: tuple[str, ...], where: str, known: Mapping[str, Any] | None = None) -> Any:
        """An expression whose names are symbols from now on; None for one with a fault."""
        try:
            expression: Expression = parse_formula(text)
        except ExpressionError as error:
            self.fault(f"{where}{error}", *key)
            return None
        if taken := [n for n in expression.names if n in _TAKEN]:
            self.fault(
                f"{where}'{taken[0]}' is taken: it is what tmsopt computes; give the parameter another name", *key
            )
            return None
        for name in expression.names:
            if name not in (known or {}):
                self.symbols.setdefault(name, ca.SX.sym(name))
        return expression
