"""Replaces abs, min and max in an NLP by variables, since a smooth solver cannot handle kinks.

Each of these functions follows from the greatest of several *pieces*: |e| is the greatest of e and −e; min(a, b) is
minus the greatest of −a and −b. The greatest piece becomes a variable t with a row t ≥ piece for every piece. This is
exact if a larger t is never an advantage. Otherwise a *contact* is needed: t is held equal to one piece at a time, and
the other pieces are below t.

A quotient or tangent with a pole in the box becomes a variable t with the equation t · denominator = numerator, which
is smooth on both sides of the pole.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.algebra.formula import Kind, UnsupportedOperation, depends_on, fold, formula, make_node, symbol
from tmsopt.algebra.intervals import ball, interval
from tmsopt.algebra.kinds import INTERVALS, NODES
from tmsopt.models import Values
from tmsopt.problem.dependence import WORSE_DIRECTION
from tmsopt.program.nlp import NLP, AddedVariable, Contact, MaximumVariable, variable_name
from tmsopt.roots.patterns.pattern import Roots

KINK = ".kink"
"""Name of the rows of kinks; no constraint has this name."""


def epigraph_form(nlp: NLP, needs_contacts: bool) -> NLP:
    """The NLP with its kinks as variables, and with the contacts that make it exact.

    Args:
        needs_contacts: whether root quantities need their contacts even without kinks.
    """
    smooth_nlp = nlp if needs_contacts else replace(nlp, contacts={})
    if not _may_have_kinks(nlp):
        return smooth_nlp
    build = _EpigraphBuilder(nlp)
    f, g = build.expressions()
    if not build.kinks:
        return smooth_nlp
    names = (*map(variable_name, range(len(nlp.variables) + len(build.kinks))), *nlp.numbers)
    count, first_row = len(build.kinks), len(nlp.rows)
    row_count = sum(len(kink.rows) for kink in build.kinks)
    smooth_nlp = replace(
        nlp,
        variables=(*nlp.variables, *[KINK] * count),
        formula=formula([f, *g], names),
        lower=(*nlp.lower, *[-np.inf] * count),
        upper=(*nlp.upper, *[np.inf] * count),
        rows=(*nlp.rows, *[KINK] * row_count),
        row_lower=(*nlp.row_lower, *[0.0] * row_count),
        row_upper=(*nlp.row_upper, *(0.0 if kink.is_quotient else np.inf for kink in build.kinks for _ in kink.rows)),
        lifts=(*nlp.lifts, *[AddedVariable(KINK, 1, _guess_later)] * count),
        kinks=tuple(build.kinks),
    )
    x = ca.SX.sym("x", len(smooth_nlp.variables))
    slopes = partial(_slopes, ca.jacobian(ca.vertcat(*smooth_nlp.symbolic(x)), x))
    contact_sets: dict[str, tuple[Contact, ...]] = {}
    equation_rows = set[int]()
    for kink in reversed(build.kinks):  # first the kinks that contain others
        if kink.is_quotient:
            equation_rows.update(kink.rows)
        elif not _never_improves(smooth_nlp, slopes(kink.variable), 1.0, equation_rows, kink.rows):
            contact_sets[f"{KINK}{kink.variable}"] = tuple(Contact(row=k) for k in kink.rows)
            equation_rows.update(kink.rows)
    kink_rows = range(first_row, first_row + row_count)
    for name, contacts in nlp.contacts.items():
        slope_of_row = slopes(nlp.variables.index(name))
        kink_slopes = {k: slope for k, slope in slope_of_row.items() if k in kink_rows}
        if needs_contacts or not _never_improves(smooth_nlp, kink_slopes, WORSE_DIRECTION[name], equation_rows):
            contact_sets[name] = contacts
    return replace(smooth_nlp, contacts=contact_sets)


def _may_have_kinks(nlp: NLP) -> bool:
    """Whether the box may contain a kink or a pole; for most NLPs interval arithmetic excludes this in one pass."""
    if not {step.op for step in nlp.formula.steps} & {*_PIECES, *_POLES}:
        return False
    operations = INTERVALS.operations

    def divide_off_pole(op: str, *operands: Any) -> Any:
        lower, upper = interval(operations["cos"](*operands) if op == "tan" else operands[-1])
        if lower <= 0 <= upper:
            raise UnsupportedOperation
        return operations[op](*operands)

    smooth_operations = {op: f for op, f in operations.items() if op not in _PIECES} | {
        op: partial(divide_off_pole, op) for op in _POLES
    }
    box = [ball(ends) for ends in zip(nlp.lower, nlp.upper, strict=True)]
    try:
        nlp.fold(box, Kind(smooth_operations, INTERVALS.constant))
    except UnsupportedOperation:
        return True
    return False


class _EpigraphBuilder:
    """Collects the kinks of one NLP."""

    def __init__(self, nlp: NLP) -> None:
        self.nlp, self.count = nlp, len(nlp.variables)
        self.rows: list[Any] = []
        self.kinks: list[MaximumVariable] = []

    def expressions(self) -> tuple[Any, list[Any]]:
        """Objective and rows without kinks."""
        replacements = {op: partial(self.replace_kink, op) for op in _PIECES} | {
            op: partial(self.replace_pole, op) for op in _POLES
        }
        kind = Kind({**NODES.operations, **replacements}, NODES.constant, NODES.number)
        f, *g = fold(self.nlp.formula, {n: symbol(n) for n in self.nlp.formula.names}, kind)
        return f, [*g, *self.rows]

    def replace_kink(self, op: str, *operands: Any) -> Any:
        """A new variable for a kink; the operation itself if it depends on no variable."""
        variables = set(map(variable_name, range(self.count)))
        if not any(depends_on(e, variables) for e in operands):
            return make_node(op, *operands)
        t = self.add_variable(pieces := _PIECES[op](*operands), is_quotient=False)
        self.rows += [t - piece for piece in pieces]
        return -t if op == "min" else t

    def add_variable(self, rows: Sequence[Any], is_quotient: bool) -> Any:
        """A new variable for the rows that the caller then adds."""
        first_row = len(self.nlp.rows) + len(self.rows)
        rows_of_kink = tuple(range(first_row, first_row + len(rows)))
        self.kinks.append(MaximumVariable(self.count, rows_of_kink, is_quotient))
        self.count += 1
        return symbol(variable_name(self.count - 1))

    def replace_pole(self, op: str, *operands: Any) -> Any:
        """A quotient or tangent, or a new variable for it if the denominator can vanish in the box."""
        numerator, denominator = _POLES[op](*operands)
        denominator_formula, quotient_node = formula([denominator]), make_node(op, *operands)
        if not denominator_formula.dependent_steps(self.nlp.inputs) or denominator_formula.dependent_steps(
            set(map(variable_name, range(len(self.nlp.inputs), self.count)))
        ):
            return quotient_node
        box = [ball(ends) for ends in zip(self.nlp.lower, self.nlp.upper, strict=True)]
        try:
            (denominator_range,) = replace(self.nlp, formula=denominator_formula).fold(box, INTERVALS)
        except UnsupportedOperation:
            return quotient_node
        lower, upper = interval(denominator_range)
        if lower > 0 or upper < 0:
            return quotient_node
        t = self.add_variable([None], is_quotient=True)
        self.rows.append(t * denominator - numerator)
        return t


_POLES: Mapping[str, Callable[..., tuple[Any, Any]]] = {
    "div": lambda a, b: (a, b),
    "tan": lambda e: (make_node("sin", e), make_node("cos", e)),
}
"""Operation → numerator and denominator."""

_PIECES: Mapping[str, Callable[..., Sequence[Any]]] = {
    "abs": lambda e: (e, -e),
    "max": lambda a, b: (a, b),
    "min": lambda a, b: (-a, -b),
}
"""Operation → pieces, the greatest of which is the result, or minus the result for min."""


def _slopes(jacobian: Any, variable: int) -> dict[int, Any]:
    """Index of a row, or −1 for the objective → its derivative with respect to a variable, if that is not 0."""
    column = jacobian[:, variable]
    return {k - 1: column[k] for k in range(column.size1()) if not column[k].is_zero()}


def _never_improves(
    nlp: NLP,
    slopes: Mapping[int, Any],
    worse_direction: float,
    equation_rows: set[int],
    ignored_rows: Sequence[int] = (),
) -> bool:
    """Whether raising a variable provably improves neither the objective nor a row.

    The slopes must be constant and have the right sign.

    Args:
        worse_direction: 1 if the variable is raised, −1 if it is lowered instead.
        equation_rows: rows that may be held as equations; a change in any direction can then be an improvement.
        ignored_rows: rows that are not considered.
    """
    for k, slope in slopes.items():
        if k in ignored_rows:
            continue
        has_no_lower, has_no_upper = (
            (True, False) if k < 0 else (np.isinf(nlp.row_lower[k]), np.isinf(nlp.row_upper[k]))
        )
        if k in equation_rows or has_no_lower == has_no_upper or not slope.is_constant():
            return False
        if worse_direction * float(slope) * (1 if has_no_lower else -1) < 0:
            return False
    return True


def _guess_later(values: Sequence[Values], z: Sequence[Roots]) -> list[list[float]]:
    """A placeholder; `NLP.set_kinks` computes the starting value of a kink from the variables that precede it."""
    return [[0.0]]
