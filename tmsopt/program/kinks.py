"""Kinks as variables: abs, min and max of an NLP, which a solver of smooth problems cannot look through.

Each becomes t with a row t ≥ piece for every piece: |e| is the greatest of e and −e, a minimum of a and b minus the
greatest of −a and −b. Where more of t is never an advantage, that is exact, as it is of a bound on a root quantity;
elsewhere t is held equal to one piece, the others below it, case by case.

A quotient or a tangent with a pole in the box becomes t with an equation t · denominator = numerator: on its own side
of the pole a solver then has nothing to look through, and the other side is infinitely far.
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
from tmsopt.program.nlp import NLP, AddedVariable, Contact, MaximumVariable, name_of
from tmsopt.roots.patterns.pattern import Roots

KINK = ".kink"
"""Name of the rows of kinks: no constraint has it."""


def epigraph_form(nlp: NLP, overclaims: bool) -> NLP:
    """An NLP with its kinks as variables, and with the touches that it needs: where more is claimed without them.

    Args:
        overclaims: whether bounds on root quantities would, kinks aside.
    """
    plain = nlp if overclaims else replace(nlp, touches={})
    if not _suspect(nlp):
        return plain
    build = _Unfolding(nlp)
    f, g = build.expressions()
    if not build.kinks:
        return plain
    names = (*map(name_of, range(len(nlp.variables) + len(build.kinks))), *nlp.numbers)
    count, first = len(build.kinks), len(nlp.rows)
    rows = sum(len(kink.rows) for kink in build.kinks)
    plain = replace(
        nlp,
        variables=(*nlp.variables, *[KINK] * count),
        formula=formula([f, *g], names),
        lower=(*nlp.lower, *[-np.inf] * count),
        upper=(*nlp.upper, *[np.inf] * count),
        rows=(*nlp.rows, *[KINK] * rows),
        row_lower=(*nlp.row_lower, *[0.0] * rows),
        row_upper=(*nlp.row_upper, *(0.0 if kink.quotient else np.inf for kink in build.kinks for _ in kink.rows)),
        lifts=(*nlp.lifts, *[AddedVariable(KINK, 1, _filled_later)] * count),
        kinks=tuple(build.kinks),
    )
    x = ca.SX.sym("x", len(plain.variables))
    slopes = partial(_slopes, ca.jacobian(ca.vertcat(*plain.symbolic(x)), x))
    held: dict[str, tuple[Contact, ...]] = {}
    equal = set[int]()
    for kink in reversed(build.kinks):  # what is made of others comes before them
        if kink.quotient:
            equal.update(kink.rows)
        elif not _worsens(plain, slopes(kink.variable), 1.0, equal, kink.rows):
            held[f"{KINK}{kink.variable}"] = tuple(Contact(row=k) for k in kink.rows)
            equal.update(kink.rows)
    rooted = range(first, first + rows)
    for name, touches in nlp.touches.items():
        at = slopes(nlp.variables.index(name))
        among = {k: slope for k, slope in at.items() if k in rooted}
        if overclaims or not _worsens(plain, among, WORSE_DIRECTION[name], equal):
            held[name] = touches
    return replace(plain, touches=held)


def _suspect(nlp: NLP) -> bool:
    """Whether there may be a kink, or a pole in the box: of most NLPs one look by interval arithmetic denies it."""
    if not {step.op for step in nlp.formula.steps} & {*_PIECES, *_POLES}:
        return False
    known = INTERVALS.operations

    def divided(op: str, *operands: Any) -> Any:
        lower, upper = interval(known["cos"](*operands) if op == "tan" else operands[-1])
        if lower <= 0 <= upper:
            raise UnsupportedOperation
        return known[op](*operands)

    smooth = {op: f for op, f in known.items() if op not in _PIECES} | {op: partial(divided, op) for op in _POLES}
    box = [ball(ends) for ends in zip(nlp.lower, nlp.upper, strict=True)]
    try:
        nlp.fold(box, Kind(smooth, INTERVALS.constant))
    except UnsupportedOperation:
        return True
    return False


class _Unfolding:
    """Collects the kinks of one NLP; discarded once they are known."""

    def __init__(self, nlp: NLP) -> None:
        self.nlp, self.count = nlp, len(nlp.variables)
        self.rows: list[Any] = []
        self.kinks: list[MaximumVariable] = []

    def expressions(self) -> tuple[Any, list[Any]]:
        """Objective and rows, without a kink."""
        own = {op: partial(self.applied, op) for op in _PIECES} | {op: partial(self.divided, op) for op in _POLES}
        kind = Kind({**NODES.operations, **own}, NODES.constant, NODES.number)
        f, *g = fold(self.nlp.formula, {n: symbol(n) for n in self.nlp.formula.names}, kind)
        return f, [*g, *self.rows]

    def applied(self, op: str, *operands: Any) -> Any:
        """A kink that depends on variables, as a new one."""
        every = set(map(name_of, range(self.count)))
        if not any(depends_on(e, every) for e in operands):
            return make_node(op, *operands)
        t = self.variable(pieces := _PIECES[op](*operands), quotient=False)
        self.rows += [t - piece for piece in pieces]
        return -t if op == "min" else t

    def variable(self, rows: Sequence[Any], quotient: bool) -> Any:
        """A new variable, and the rows that are to come."""
        first = len(self.nlp.rows) + len(self.rows)
        self.kinks.append(MaximumVariable(self.count, tuple(range(first, first + len(rows))), quotient=quotient))
        self.count += 1
        return symbol(name_of(self.count - 1))

    def divided(self, op: str, *operands: Any) -> Any:
        """A quotient or tangent; as a new variable where the denominator may be 0 in the box."""
        numerator, denominator = _POLES[op](*operands)
        own, plain = formula([denominator]), make_node(op, *operands)
        if not own.dependent_steps(self.nlp.inputs) or own.dependent_steps(
            set(map(name_of, range(len(self.nlp.inputs), self.count)))
        ):
            return plain
        box = [ball(ends) for ends in zip(self.nlp.lower, self.nlp.upper, strict=True)]
        try:
            (over,) = replace(self.nlp, formula=own).fold(box, INTERVALS)
        except UnsupportedOperation:
            return plain
        lower, upper = interval(over)
        if lower > 0 or upper < 0:
            return plain
        t = self.variable([None], quotient=True)
        self.rows.append(t * denominator - numerator)
        return t


_POLES: Mapping[str, Callable[..., tuple[Any, Any]]] = {
    "div": lambda a, b: (a, b),
    "tan": lambda e: (make_node("sin", e), make_node("cos", e)),
}
_PIECES: Mapping[str, Callable[..., Sequence[Any]]] = {
    "abs": lambda e: (e, -e),
    "max": lambda a, b: (a, b),
    "min": lambda a, b: (-a, -b),
}


def _slopes(jacobian: Any, variable: int) -> dict[int, Any]:
    """By how much the objective (−1) and the rows change with a variable, where they do."""
    column = jacobian[:, variable]
    return {k - 1: column[k] for k in range(column.size1()) if not column[k].is_zero()}


def _worsens(nlp: NLP, slopes: Mapping[int, Any], worse: float, equal: set[int], but: Sequence[int] = ()) -> bool:
    """Whether it is certain that nothing gets better as a variable moves up (or down: `worse` −1), rows `but` aside.

    It is where slopes are constants of the right sign. Rows that may be held `equal` get better either way.
    """
    for k, slope in slopes.items():
        if k in but:
            continue
        below, above = (True, False) if k < 0 else (np.isinf(nlp.row_lower[k]), np.isinf(nlp.row_upper[k]))
        if k in equal or below == above or not slope.is_constant():
            return False
        if worse * float(slope) * (1 if below else -1) < 0:
            return False
    return True


def _filled_later(values: Sequence[Values], z: Sequence[Roots]) -> list[list[float]]:
    """What a kink starts from is known once the variables before it are."""
    return [[0.0]]
