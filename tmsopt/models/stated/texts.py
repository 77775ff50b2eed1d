"""Parser of the entries and quantities of a system in text, which share their symbols."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from graphlib import CycleError, TopologicalSorter
from typing import Any

from tmsopt.algebra.formula import Kind, symbol
from tmsopt.algebra.kinds import NODES
from tmsopt.errors import short
from tmsopt.models.expression import Expression, ExpressionError, parse_value
from tmsopt.models.model import Matrix
from tmsopt.models.names import name_fault
from tmsopt.models.stated.degree import DEGREES, Degree, DegreeTooHigh
from tmsopt.models.stated.pairs import (
    IMAGINARY_UNIT,
    PAIRS,
    entry_pair,
    is_complex_entry,
    pair,
    replace_literals,
    restore_literals,
)
from tmsopt.records import Table

MAX_QUANTITIES = 500
"""Largest number of quantities; more would take seconds to parse."""

_MAX_CYCLES = 8  # largest number of cycles of quantities that are reported
_UNIT_NAMES = ("i", "j")


class Unfit(ValueError):
    """A system of the user's own cannot become a model.

    Attributes:
        key: the argument at fault, e.g. ``M``.
        message: the value found, and the values accepted.

    Example:
        >>> try:
        ...     tmsopt.models.from_matrices(A=[[1, 2]])
        ... except tmsopt.models.Unfit as error:
        ...     print(error.key)
        A

    More: docs/tutorials/own_system.md
    """

    def __init__(self, key: str, message: str) -> None:
        self.key, self.message = key, message
        super().__init__(key, message)

    def __str__(self) -> str:
        return f"{self.key}: {self.message}"


@dataclass
class Texts:
    """Turns the texts of one system into nodes.

    Attributes:
        fault: function that is called with a message and its place: ``M``, or ``quantities`` and a name.
        quantity_nodes: name → quantity, given as a node or already built from its text.
        kind: kind of numbers for entries.
        constants: name → fixed value of this kind, such as the imaginary unit.
        names: names in the texts that were read until now.
        expressions: name → parsed quantity; None if it has a fault.
    """

    fault: Callable[..., None]
    quantity_nodes: dict[str, Any]
    kind: Kind = NODES
    constants: Mapping[str, Any] = Table()
    names: dict[str, None] = field(default_factory=dict)
    expressions: dict[str, Expression | None] = field(default_factory=dict)
    _degrees: dict[str, Degree] = field(default_factory=dict)
    _order: tuple[str, ...] = ()

    def entry(self, text: str, key: str, position_text: str) -> Any:
        """One entry as a number of the kind; 0 if the text has a fault."""
        expression = self._parse(text, (key,), f"{position_text}: ")
        return self._build(expression, (key,), f"{position_text}: ", self.kind)[0] if expression else 0

    def read_quantities(self, texts: Mapping[str, str]) -> None:
        """Parse the quantities, which may use one another; `quantity` then returns them."""
        if len(texts) > MAX_QUANTITIES:
            self.fault(f"found {len(texts)} quantities; accepted: up to {MAX_QUANTITIES}", "quantities")
            texts = {}
        for name, text in texts.items():
            if reason := name_fault(name, bool(self.constants)):
                self.fault(f"'{name}' {reason}; give the quantity a name of its own", "quantities", str(name))
            else:
                self.expressions[name] = self._parse(text, ("quantities", name), "")
        for _ in range(_MAX_CYCLES):
            uses = {n: [m for m in e.names if m in self.expressions] if e else [] for n, e in self.expressions.items()}
            try:
                self._order = tuple(TopologicalSorter(uses).static_order())
                return
            except CycleError as error:
                cycle = error.args[1][:0:-1]  # each quantity uses the next one
                start_index = cycle.index(next(n for n in self.expressions if n in cycle))
                cycle = [*cycle[start_index:], *cycle[: start_index + 1]]
                self.fault(f"uses itself: {' → '.join(cycle)}; write it in parameters", "quantities", cycle[0])
                self.expressions[cycle[0]] = None
        self.expressions = dict.fromkeys(self.expressions)  # the other cycles are not reported

    def quantity(self, name: str) -> Any:
        """A quantity as a node that depends on parameters only; the first call builds all quantities."""
        if name not in self.quantity_nodes:
            for quantity_name in self._order or self.expressions:
                expression = self.expressions[quantity_name]
                self.quantity_nodes[quantity_name], self._degrees[quantity_name] = (
                    self._build(expression, ("quantities", quantity_name), "") if expression else (0, Degree())
                )
        return self.quantity_nodes[name]

    def _build(
        self, expression: Expression, key: tuple[str, ...], prefix: str, kind: Kind = NODES
    ) -> tuple[Any, Degree]:
        """An expression as a number of the kind, and its degree in the parameters."""
        values = {} if kind is NODES else dict(self.constants)
        for name in (n for n in expression.names if n not in values):
            is_quantity = name in self.expressions or name in self.quantity_nodes
            self.names[name] = None
            values[name] = self.quantity(name) if is_quantity else symbol(name)
        try:
            degree = expression.of({n: self._degrees.get(n, Degree()) for n in values}, DEGREES)
            return expression.of(values, kind), degree
        except DegreeTooHigh as error:
            self.fault(f"{prefix}'{expression.text}' {error}", *key)
            return 0, Degree()

    def _parse(self, text: str, key: tuple[str, ...], prefix: str) -> Expression | None:
        """The expression of a text; None if it has a fault."""
        try:
            expression = parse_value(text, None, example="k1 + k2")
        except ExpressionError as error:
            self.fault(f"{prefix}{error}", *key)
            return None
        for name in expression.names:
            if (reason := name_fault(name, bool(self.constants))) and name not in self.constants:
                self.fault(f"{prefix}'{name}' {reason}; give the parameter another name", *key)
                return None
        return expression


def describe_position(key: str, i: int, j: int) -> str:
    """The position of an entry in words, such as ``row 1, column 2``, for messages."""
    return f"entry {j}" if key == "coefficients" else f"row {i}, column {j}"


def are_complex(matrices: Mapping[str, Matrix]) -> bool:
    """Whether matrices are those of a complex system: H, or others with a complex entry."""
    return "H" in matrices or any(is_complex_entry(x) for rows in matrices.values() for row in rows for x in row)


def parse_entries(
    matrices: Mapping[str, Matrix], quantities: Mapping[Any, Any], fault: Callable[..., None]
) -> tuple[dict[str, Matrix], dict[Any, Any]]:
    """Matrices and quantities with nodes instead of texts; each entry of complex matrices becomes a pair (re, im)."""
    texts_by_name = {n: x for n, x in quantities.items() if isinstance(x, str)}
    given_nodes, of_H = {n: x for n, x in quantities.items() if n not in texts_by_name}, are_complex(matrices)
    texts = Texts(fault, dict(given_nodes))
    if of_H:
        texts = Texts(
            lambda message, *key: fault(restore_literals(message), *key), dict(given_nodes), PAIRS, IMAGINARY_UNIT
        )
    texts.read_quantities(texts_by_name)

    def entry(x: Any, n: str, i: int, j: int) -> Any:
        position_text, earlier_names = describe_position(n, i, j), set(texts.names)
        if isinstance(x, str) and not of_H:
            return texts.entry(x, n, position_text)
        if isinstance(x, str):
            x = pair(texts.entry(replace_literals(x), n, position_text))
            for name in (name for name in _UNIT_NAMES if name in texts.names and name not in earlier_names):
                fault(f"{position_text}: '{name}' would be a parameter; write the imaginary unit as 1j", n)
        elif of_H and isinstance(x, tuple) and len(x) != 2:
            fault(f"{position_text}: found {short(x)}; accepted: a real and an imaginary part", n)
        return entry_pair(x) if of_H else x

    parsed_matrices = {
        n: [[entry(x, n, i, j) for j, x in enumerate(row, start=1)] for i, row in enumerate(rows, start=1)]
        for n, rows in matrices.items()
    }
    return parsed_matrices, {n: texts.quantity(n) for n in quantities if n in given_nodes or n in texts.expressions}
