"""Reads the [model] table of a problem file: the user's own system as matrices or coefficients of expressions."""

import math
from collections.abc import Callable
from typing import Any

from tmsopt.errors import Fault, is_number, limit_advice, short, suggest, text_faults
from tmsopt.models import Model, Unfit, from_coefficients, from_hamiltonian, from_matrices
from tmsopt.models.model import Matrix
from tmsopt.models.stated.texts import describe_position, parse_entries
from tmsopt.problem.toml import Tables

_MATRICES = ("M", "D", "K", "A", "B", "C", "G", "H")
KEYS = {
    "name": "One line for reports.",
    "M": "Rows of the mass matrix of M q″ + D q′ + K q = 0, numbers or expressions.",
    "D": "Rows of the damping matrix; 0 if left out.",
    "K": "Rows of the stiffness matrix.",
    "A": "Rows of the matrix of x′ = A x, instead of M, D and K.",
    "B": "Rows of the input matrix of a controller, M q″ + D q′ + K q = B u or x′ = A x + B u.",
    "C": "Rows of the measurement matrix, y = C x, with x = (q, q′) for M, D, K; the identity if left out.",
    "G": "Rows of the gain matrix, u = −G y.",
    "H": "Rows of the complex matrix of i psi' = H psi, such as 'w - 1j*g', instead of M, D, K and A.",
    "coefficients": "Coefficients of the characteristic polynomial, descending, instead of matrices.",
    "quantities": "Named expressions to use in objectives and constraints.",
}
"""Key of the table → meaning."""

_EXCLUSIVE_KEYS = {
    "coefficients": "coefficients, or the matrices",
    "H": "H, a complex system, or the matrices of a real one",
}
"""Key that excludes the other keys of a system → the alternatives, for messages."""

_ACCEPTED_COEFFICIENTS = "accepted: expressions in brackets, by descending powers of s, such as ['1', 'c', 'k']"

_EXAMPLE = (
    "write M = [['m']], D = [['c']], K = [['k']], or A = [['a', '1'], ['b', '0']], "
    "or H = [['w - 1j*g', 'k'], ['k', 'w']], or coefficients = ['1', 'c', 'k']"
)


def read_model_table(table: Tables) -> tuple[list[Fault], Model | None]:
    """The faults of a [model] table, and its model.

    An entry is a number or an expression. A name in an expression means a parameter, or a quantity of
    ``[model.quantities]``. These quantities may use one another.
    """
    faults: list[Fault] = []

    def fault(message: str, *key: str) -> None:
        faults.append(Fault(message, ("model", *key)))

    system_keys = [key for key in (*_MATRICES, "coefficients") if key in table]
    advice = limit_advice(suggest)
    for key in table:
        if key not in KEYS:
            fault(f"unknown key {short(key)}; {advice(key, KEYS)}", key)
    name = table.get("name", "stated")
    if text_faults(name) or not name.strip():
        fault(f"found {short(name)}; accepted: a text of one line in quotes", "name")
    if not system_keys:
        fault(f"states no system; {_EXAMPLE}")
    for exclusive_key, alternatives in _EXCLUSIVE_KEYS.items():
        if exclusive_key in system_keys and (other_keys := [key for key in system_keys if key != exclusive_key]):
            fault(f"found together with {other_keys[0]}; keep {alternatives}", exclusive_key)
    texts = _read_quantities(table.get("quantities", {}), fault)
    entries, quantities = parse_entries({key: _read_rows(table[key], key, fault) for key in system_keys}, texts, fault)
    if faults:
        return faults, None
    try:
        arguments: dict[str, Any] = {**entries, "name": name.strip(), "quantities": quantities}
        if "H" in entries:
            return [], from_hamiltonian(**arguments)
        if "coefficients" in entries:
            return [], from_coefficients(**arguments | {"coefficients": entries["coefficients"][0]})
        return [], from_matrices(**arguments)
    except Unfit as error:
        quantity, _, reason = error.message.partition(": ")
        if error.key == "quantities" and quantity in quantities:
            return [Fault(reason, ("model", "quantities", quantity))], None
        return [Fault(error.message, ("model", error.key))], None


def _suggest_rows(entries: Any) -> str:
    """The advice to write a list of n² entries as n rows; empty for any other value."""
    n = math.isqrt(len(entries)) if isinstance(entries, list) else 0
    if not n or n * n != len(entries) or any(isinstance(x, list) for x in entries):
        return ""
    return f"write {short([entries[k : k + n] for k in range(0, n * n, n)])}; "


def _read_quantities(table: Any, fault: Callable[..., None]) -> dict[str, str]:
    """Name → expression, without the faulty entries."""
    if not isinstance(table, dict):
        fault(f"found {short(table)}; accepted: a table [model.quantities]", "quantities")
        return {}
    for name, text in table.items():
        if not isinstance(text, str):
            fault(f"found {short(text)}; accepted: an expression in quotes, such as 'k1/k2'", "quantities", name)
    return {name: text for name, text in table.items() if isinstance(text, str)}


def _read_rows(entries: Any, key: str, fault: Callable[..., None]) -> Matrix:
    """Rows of numbers and texts, with 0 for a faulty entry; coefficients form one row."""
    rows = [entries] if key == "coefficients" else entries
    if not isinstance(rows, list) or not rows or (rows is entries and not all(isinstance(row, list) for row in rows)):
        accepted = "accepted: rows in brackets, such as [['m', 0], [0, 'm']], with quotes around each expression"
        fault(f"found {short(rows)}; {_suggest_rows(rows)}{accepted}", key)
        return []
    for row in rows:
        if not isinstance(row, list) or not row:
            fault(f"found {short(row)}; {_ACCEPTED_COEFFICIENTS}", key)
            return []
    for i, row in enumerate(rows, start=1):
        for j, x in enumerate(row, start=1):
            if not is_number(x) and not isinstance(x, str):
                message = f"{describe_position(key, i, j)}: found {short(x)}"
                fault(f"{message}; accepted: a finite number, or an expression in quotes", key)
    return [[x if is_number(x) or isinstance(x, str) else 0 for x in row] for row in rows]
