"""A stated system in text: its entries and quantities as expressions of shared symbols."""

from collections.abc import Callable, Mapping
from graphlib import CycleError, TopologicalSorter
from types import MappingProxyType
from typing import Any

from tmsopt.algebra.formula import Kind, symbol
from tmsopt.algebra.kinds import NODES
from tmsopt.errors import short
from tmsopt.models.expression import Expression, ExpressionError, parse_value
from tmsopt.models.model import Matrix
from tmsopt.models.names import unusable
from tmsopt.models.stated.degree import DEGREES, Degree, DegreeTooHigh
from tmsopt.models.stated.pairs import BESIDE, PAIRS, Pair, as_pair, as_written, pair, real_text

MOST_QUANTITIES = 500
"""More take seconds to read."""

_CIRCLES = 8  # that are listed
_UNIT_NAMES = ("i", "j")


class Unfit(ValueError):
    """A statement that makes no model.

    Attributes:
        key: the part of it that is at fault, e.g. ``M``.
        message: what was found, and what is accepted.

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


class Texts:
    """Turns texts into nodes; discarded after one statement.

    Attributes:
        met: names in the texts so far.

    Args:
        fault: called with what is wrong with a text, and where: ``M``, or ``quantities`` and a name.
        known: quantities that are no texts.
        kind: of numbers that entries are made of.
        beside: names that mean something in it.
    """

    def __init__(
        self,
        fault: Callable[..., None],
        known: Mapping[str, Any] | None = None,
        kind: Kind = NODES,
        beside: Mapping[str, Any] = MappingProxyType({}),
    ) -> None:
        self.fault = fault
        self.kind, self.beside = kind, beside
        self.met: dict[str, None] = {}
        self.known = dict(known or {})
        self.written: dict[str, Expression | None] = {}
        self._degrees: dict[str, Degree] = {}
        self._order: tuple[str, ...] = ()

    def entry(self, text: str, key: str, where: str) -> Any:
        """One entry as a node, or what the kind makes of it; 0 for one with a fault."""
        expression = self._parsed(text, (key,), f"{where}: ")
        return self._symbolic(expression, (key,), f"{where}: ", self.kind)[0] if expression else 0

    def read_quantities(self, texts: Mapping[str, str]) -> None:
        """The formulas of the quantities, which may use one another, each to be had by `quantity`."""
        if len(texts) > MOST_QUANTITIES:
            self.fault(f"found {len(texts)} quantities; accepted: up to {MOST_QUANTITIES}", "quantities")
            texts = {}
        for name, text in texts.items():
            if why := unusable(name, bool(self.beside)):
                self.fault(f"'{name}' {why}; give the quantity a name of its own", "quantities", str(name))
            else:
                self.written[name] = self._parsed(text, ("quantities", name), "")
        for _ in range(_CIRCLES):
            uses = {n: [m for m in e.names if m in self.written] if e else [] for n, e in self.written.items()}
            try:
                self._order = tuple(TopologicalSorter(uses).static_order())
                return
            except CycleError as error:
                circle = error.args[1][:0:-1]  # which lists what is used first
                first = circle.index(next(n for n in self.written if n in circle))
                circle = [*circle[first:], *circle[: first + 1]]
                self.fault(f"uses itself: {' → '.join(circle)}; write it in parameters", "quantities", circle[0])
                self.written[circle[0]] = None
        self.written = dict.fromkeys(self.written)  # enough is known to be wrong

    def quantity(self, name: str) -> Any:
        """A quantity as an expression of parameters, made with those that it uses, each of them once."""
        if name not in self.known:
            for each in self._order or self.written:
                expression = self.written[each]
                self.known[each], self._degrees[each] = (
                    self._symbolic(expression, ("quantities", each), "") if expression else (0, Degree())
                )
        return self.known[name]

    def _symbolic(
        self, expression: Expression, key: tuple[str, ...], where: str, kind: Kind = NODES
    ) -> tuple[Any, Degree]:
        """An expression in symbols, made when first met, and its degree with the quantities in it written out."""
        values = {} if kind is NODES else dict(self.beside)
        for name in (n for n in expression.names if n not in values):
            derived = name in self.written or name in self.known
            self.met[name] = None
            values[name] = self.quantity(name) if derived else symbol(name)
        try:
            degree = expression.of({n: self._degrees.get(n, Degree()) for n in values}, DEGREES)
        except DegreeTooHigh as error:
            self.fault(f"{where}{error}", *key)
            return 0, Degree()
        try:
            return expression.of(values, kind), degree
        except DegreeTooHigh as error:
            self.fault(f"{where}'{expression.text}' {error}", *key)
            return 0, Degree()

    def _parsed(self, text: str, key: tuple[str, ...], where: str) -> Expression | None:
        """An expression; None for one with a fault."""
        try:
            expression = parse_value(text, None, example="k1 + k2")
        except ExpressionError as error:
            self.fault(f"{where}{error}", *key)
            return None
        for name in expression.names:
            if (why := unusable(name, bool(self.beside))) and name not in self.beside:
                self.fault(f"{where}'{name}' {why}; give the parameter another name", *key)
                return None
        return expression


def place(key: str, i: int, j: int) -> str:
    """Where an entry is, in words."""
    return f"entry {j}" if key == "coefficients" else f"row {i}, column {j}"


def parse_entries(
    matrices: Mapping[str, Matrix], derived: Mapping[Any, Any], fault: Callable[..., None]
) -> tuple[dict[str, Matrix], dict[Any, Any]]:
    """Texts in matrices and quantities as nodes; entries of a complex H as pairs, whatever they are."""
    written = {n: x for n, x in derived.items() if isinstance(x, str)}
    known, of_H = {n: x for n, x in derived.items() if n not in written}, "H" in matrices
    texts = Texts(fault, known)
    if of_H:
        texts = Texts(lambda message, *key: fault(as_written(message), *key), known, PAIRS, BESIDE)
    texts.read_quantities(written)

    def entry(x: Any, n: str, i: int, j: int) -> Any:
        where = place(n, i, j)
        if isinstance(x, str):
            return pair_of(x, where) if of_H else texts.entry(x, n, where)
        if of_H and isinstance(x, tuple) and len(x) != 2:
            fault(f"{where}: found {short(x)}; accepted: two, the real and the imaginary part", n)
        return as_pair(x) if of_H else x

    def pair_of(text: str, where: str) -> Pair:
        known = set(texts.met)
        found = pair(texts.entry(real_text(text), "H", where))
        for taken in (n for n in _UNIT_NAMES if n in texts.met and n not in known):
            fault(f"{where}: '{taken}' would be a parameter; write the imaginary unit as 1j", "H")
        return found

    read = {
        n: [[entry(x, n, i, j) for j, x in enumerate(row, start=1)] for i, row in enumerate(rows, start=1)]
        for n, rows in matrices.items()
    }
    return read, {n: texts.quantity(n) for n in derived if n in known or n in texts.written}
