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

from tmsopt.algebra.formula import Kind, NotAccepted, fold, from_casadi
from tmsopt.algebra.intervals import ball, interval, ranges
from tmsopt.algebra.kinds import CASADI, INTERVALS
from tmsopt.models import Values
from tmsopt.problem.dependence import WORSE_DIRECTION
from tmsopt.program.nlp import NLP, AddedVariable, Contact, MaximumVariable
from tmsopt.roots.patterns.pattern import Roots

KINK = ".kink"
"""Name of the rows of kinks: no constraint has it."""


def epigraph_form(nlp: NLP, overclaims: bool) -> NLP:
    """An NLP with its kinks as variables, and with the touches that it needs: where more is claimed without them.

    Args:
        overclaims: whether bounds on root quantities would, kinks aside.
    """
    plain = nlp if overclaims else replace(nlp, touches={})
    if not (nlp.settings or _suspect(nlp)):
        return plain
    build = _Unfolding(nlp)
    x, p, f, g = build.expressions()
    if not build.kinks:
        return plain
    inputs = {"x": x, "p": p} if nlp.settings else {"x": x}
    functions = ca.Function("nlp", [*inputs.values()], [f, g], [*inputs], ["f", "g"])
    count, first = len(build.kinks), len(nlp.rows)
    rows = sum(len(kink.rows) for kink in build.kinks)
    plain = replace(
        nlp,
        variables=(*nlp.variables, *[KINK] * count),
        functions=functions,
        lower=(*nlp.lower, *[-np.inf] * count),
        upper=(*nlp.upper, *[np.inf] * count),
        rows=(*nlp.rows, *[KINK] * rows),
        row_lower=(*nlp.row_lower, *[0.0] * rows),
        row_upper=(*nlp.row_upper, *(0.0 if kink.quotient else np.inf for kink in build.kinks for _ in kink.rows)),
        lifts=(*nlp.lifts, *[AddedVariable(KINK, 1, _filled_later)] * count),
        kinks=tuple(build.kinks),
    )
    slopes = partial(_slopes, ca.jacobian(ca.vertcat(f, g), x))
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
    """Whether there may be a kink, or a pole in the box: of most NLPs one look by interval arithmetic denies it.

    Not of those with settings, whose functions have two vectors.
    """

    if not {nlp.functions.instruction_id(k) for k in range(nlp.functions.n_instructions())} & _KINKED:
        return False
    known = INTERVALS.operations

    def divided(op: str, *operands: Any) -> Any:
        lower, upper = interval(known["cos"](*operands) if op == "tan" else operands[-1])
        if lower <= 0 <= upper:
            raise NotAccepted
        return known[op](*operands)

    smooth = {op: f for op, f in known.items() if op not in _PIECES} | {op: partial(divided, op) for op in _POLES}
    formula = from_casadi(nlp.functions)
    box = {name: ball(ends) for name, ends in zip(formula.names, zip(nlp.lower, nlp.upper, strict=True), strict=True)}
    try:
        fold(formula, box, Kind(smooth, INTERVALS.constant))
    except NotAccepted:
        return True
    return False


class _Unfolding:
    """Collects the kinks of one NLP; discarded once they are known."""

    def __init__(self, nlp: NLP) -> None:
        self.nlp = nlp
        self.x = list(ca.vertsplit(ca.SX.sym("x", len(nlp.variables))))
        self.p = list(ca.vertsplit(ca.SX.sym("p", len(nlp.settings)))) if nlp.settings else []
        self.rows: list[Any] = []
        self.kinks: list[MaximumVariable] = []

    def expressions(self) -> tuple[Any, Any, Any, Any]:
        """Variables, settings, objective and rows, without a kink."""
        x, p = ca.SX.sym("x", len(self.x)), ca.SX.sym("p", len(self.p))
        formula = from_casadi(ca.Function("stacked", [ca.vertcat(x, p)], self.nlp.at(x, p)))
        kind = Kind({op: partial(self.applied, op) for op in CASADI.operations}, CASADI.constant, CASADI.number)
        f, *g = fold(formula, dict(zip(formula.names, [*self.x, *self.p], strict=True)), kind)
        rows = ca.densify(ca.vertcat(*g, *self.rows))
        return ca.vertcat(*self.x), ca.vertcat(*self.p), ca.densify(ca.SX(f)), rows

    def applied(self, op: str, *operands: Any) -> Any:
        """The result of an operation; of a kink that depends on variables, a new one."""
        if op in _POLES:
            return self._divided(op, *operands)
        pieces = _PIECES.get(op)
        if pieces is None or not any(ca.depends_on(ca.SX(e), ca.vertcat(*self.x)) for e in operands):
            return CASADI.operations[op](*operands)
        first, t = len(self.nlp.rows) + len(self.rows), ca.SX.sym(KINK)
        every = pieces(*operands)
        self.kinks.append(MaximumVariable(len(self.x), tuple(range(first, first + len(every)))))
        self.x.append(t)
        self.rows += [t - piece for piece in every]
        return -t if op == "min" else t

    def _divided(self, op: str, *operands: Any) -> Any:
        """A quotient or tangent; as a new variable where the denominator may be 0 in the box."""
        numerator, denominator = map(ca.SX, _POLES[op](*operands))
        plain = CASADI.operations[op](*operands)
        known = self.x[: len(self.nlp.variables)]
        if not ca.depends_on(denominator, ca.vertcat(*known)) or ca.depends_on(
            denominator, ca.vertcat(*self.x[len(known) :], *self.p)
        ):
            return plain
        ends = list(zip(self.nlp.lower, self.nlp.upper, strict=True))
        try:
            ((lower, upper),) = ranges(ca.Function("d", [ca.vertcat(*known)], [denominator]), ends)
        except NotAccepted:
            return plain
        if lower > 0 or upper < 0:
            return plain
        t = ca.SX.sym(KINK)
        self.kinks.append(MaximumVariable(len(self.x), (len(self.nlp.rows) + len(self.rows),), quotient=True))
        self.x.append(t)
        self.rows.append(t * denominator - numerator)
        return t


_POLES: Mapping[str, Callable[..., tuple[Any, Any]]] = {
    "div": lambda a, b: (a, b),
    "tan": lambda e: (ca.sin(e), ca.cos(e)),
}
_KINKED = {ca.OP_DIV, ca.OP_INV, ca.OP_TAN, ca.OP_FABS, ca.OP_FMAX, ca.OP_FMIN}
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
