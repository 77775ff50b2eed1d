"""The [model] table of a problem file: the user's own system, by matrices or coefficients written as expressions."""

import math
from collections.abc import Mapping
from typing import Any

from tmsopt.errors import Fault, at_first, is_number, short, suggest, text_faults
from tmsopt.models import Model, Unfit, from_coefficients, from_matrices
from tmsopt.models.stated.hamiltonian import complex_texts, from_pairs, text_entry
from tmsopt.models.stated.pairs import Pair
from tmsopt.models.stated.texts import Texts
from tmsopt.models.stated.user_defined import square

_MATRICES = ("M", "D", "K", "A", "B", "C", "G", "H")
KEYS = {
    "name": "One line for reports.",
    "M": "Rows of the mass matrix of M q″ + D q′ + K q = 0, numbers or expressions.",
    "D": "Rows of its damping matrix; left out, it is 0.",
    "K": "Rows of its stiffness matrix.",
    "A": "Rows of the matrix of x′ = A x, in place of M, D and K.",
    "B": "Rows of the matrix of a controller's inputs u, of M q″ + D q′ + K q = B u or x′ = A x + B u.",
    "C": "Rows of what it measures, y = C x of the states, or of q and then q′; left out, all of them.",
    "G": "Rows of its gains, u = −G y.",
    "H": "Rows of the complex matrix of i psi' = H psi, such as 'w - 1j*g', in place of M, D, K and A.",
    "coefficients": "Of the characteristic polynomial, descending, in place of matrices.",
    "quantities": "Names for more expressions, to be used in objectives and constraints.",
}
"""Keys of the table → meaning."""

_DESCENDING = "accepted: expressions in brackets, by descending powers of s, such as ['1', 'c', 'k']"

_EXAMPLE = (
    "write M = [['m']], D = [['c']], K = [['k']], or A = [['a', '1'], ['b', '0']], "
    "or H = [['w - 1j*g', 'k'], ['k', 'w']], or coefficients = ['1', 'c', 'k']"
)


def stated_model(table: Mapping[str, Any]) -> tuple[list[Fault], Model | None]:
    """The model of a [model] table, and what is wrong with it.

    An entry is a number or an expression; each name in one is a parameter, unless it is one of ``[model.quantities]``,
    which may use one another.
    """
    reader = _Reader(table)
    given = [key for key in (*_MATRICES, "coefficients") if key in table]
    advice = at_first(suggest)
    for key in table:
        if key not in KEYS:
            reader.fault(f"unknown key {short(key)}; {advice(key, KEYS)}", key)
    name = table.get("name", "stated")
    if text_faults(name) or not name.strip():
        reader.fault(f"found {short(name)}; accepted: a text of one line in quotes", "name")
    if not given:
        reader.fault(f"states no system; {_EXAMPLE}")
    if "coefficients" in given and len(given) > 1:
        reader.fault(f"stands beside {given[0]}; keep coefficients, or the matrices", "coefficients")
    if "H" in given and len(given) > 1:
        beside = next(key for key in given if key != "H")
        reader.fault(f"stands beside {beside}; keep H, a complex system, or the matrices of a real one", "H")
    reader.read_quantities()
    entries = {key: reader.matrix(key) for key in given if key != "coefficients"}
    row = reader.row(table["coefficients"], ("coefficients",)) if "coefficients" in given else []
    quantities = {n: reader.texts.quantity(n) for n in reader.texts.written}
    if reader.faults:
        return reader.faults, None
    try:
        if "H" in entries:
            return [], from_pairs(square("H", entries["H"]), name.strip(), quantities)
        if row:
            return [], from_coefficients(row, name=name.strip(), quantities=quantities)
        return [], from_matrices(**entries, name=name.strip(), quantities=quantities)
    except Unfit as error:
        where, _, rest = error.message.partition(": ")
        if error.key == "quantities" and where in quantities:
            return [Fault(rest, ("model", "quantities", where))], None
        return [Fault(error.message, ("model", error.key))], None


def _square(entries: Any) -> str:
    """What to write for a list of n² entries; empty for anything else."""
    n = math.isqrt(len(entries)) if isinstance(entries, list) else 0
    if not n or n * n != len(entries) or any(isinstance(x, list) for x in entries):
        return ""
    return f"write {short([entries[k : k + n] for k in range(0, n * n, n)])}; "


class _Reader:
    """Reads the entries and collects what is wrong; discarded after one table."""

    def __init__(self, table: Mapping[str, Any]) -> None:
        self.table = table
        self.faults: list[Fault] = []
        self.texts = complex_texts(self.fault) if "H" in table else Texts(self.fault)

    def fault(self, message: str, *key: str) -> None:
        self.faults.append(Fault(message, ("model", *key)))

    def matrix(self, key: str) -> list[list[Any]]:
        rows = self.table[key]
        if not isinstance(rows, list) or not rows or not all(isinstance(row, list) for row in rows):
            accepted = "accepted: rows in brackets, such as [['m', 0], [0, 'm']], each expression in quotes of its own"
            self.fault(f"found {short(rows)}; {_square(rows)}{accepted}", key)
            return []
        return [self.row(row, (key, str(k))) for k, row in enumerate(rows, start=1)]

    def row(self, entries: Any, place: tuple[str, ...]) -> list[Any]:
        if not isinstance(entries, list) or not entries:
            self.fault(f"found {short(entries)}; {_DESCENDING}", place[0])
            return []
        many = len(place) > 1
        return [
            self.entry(entry, place[0], f"row {place[1]}, column {k}" if many else f"entry {k}")
            for k, entry in enumerate(entries, start=1)
        ]

    def entry(self, entry: Any, key: str, where: str) -> Any:
        """One entry as a number or CasADi expression."""
        if is_number(entry):
            return Pair(entry) if key == "H" else entry
        if not isinstance(entry, str):
            self.fault(f"{where}: found {short(entry)}; accepted: a finite number, or an expression in quotes", key)
            return Pair(0) if key == "H" else 0
        return text_entry(self.texts, entry, where) if key == "H" else self.texts.entry(entry, key, where)

    def read_quantities(self) -> None:
        """The formulas of the quantities."""
        written = self.table.get("quantities", {})
        if not isinstance(written, dict):
            self.fault(f"found {short(written)}; accepted: a table [model.quantities]", "quantities")
            return
        for name, text in written.items():
            if not isinstance(text, str):
                accepted = "an expression in quotes, such as 'k1/k2'"
                self.fault(f"found {short(text)}; accepted: {accepted}", "quantities", name)
        self.texts.read_quantities({n: text for n, text in written.items() if isinstance(text, str)})
