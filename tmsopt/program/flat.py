"""Limits that are flat where they bind: what e⁴ ≤ 0 asks for is e = 0, and a solver sees that in e alone."""

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from tmsopt.algebra.formula import Node, fold, formula, symbol
from tmsopt.algebra.kinds import FLOATS, NODES
from tmsopt.program.nlp import NLP

FLAT = ".flat"
"""Name of the rows that stand for a flat limit: what that costs by its own measure is without bound."""


def remove_even_powers(nlp: NLP, names: Collection[str]) -> NLP:
    """An NLP in which powers, and sums of what is never below 0, that must be 0 give way to what they are powers of.

    Args:
        names: of the rows that are looked at.
    """
    looked = [k for k, name in enumerate(nlp.rows) if name in names and 0.0 in (nlp.row_lower[k], nlp.row_upper[k])]
    if not looked:
        return nlp
    f, *g = fold(nlp.formula, {n: symbol(n) for n in nlp.formula.names}, NODES)
    rows, form = list(zip(nlp.rows, g, nlp.row_lower, nlp.row_upper, strict=True)), _Form(nlp)
    more: list[tuple[str, Node, float, float]] = []
    for k in looked:
        _, row, lower, upper = rows[k]
        must = (form.vanishing(row) if upper == 0 else None) or (form.vanishing(-row) if lower == 0 else None)
        if must is None and lower == upper:
            must = [form.base(row)]
        new = [(e, 0.0, 0.0) for e in must] if must else [(form.signed(row), lower, upper)]
        if new[0][0] is not row and not _equal(new[0][0], row):
            rows[k], *others = ((FLAT, *limits) for limits in new)
            more += others
    if not any(name == FLAT for name, *_ in rows):
        return nlp
    every = [*rows, *more]
    return replace(
        nlp,
        formula=formula([f, *(e for _, e, _, _ in every)], nlp.formula.names),
        rows=tuple(name for name, *_ in every),
        row_lower=tuple(lower for *_, lower, _ in every),
        row_upper=tuple(upper for *_, upper in every),
    )


def _equal(one: Node, other: Node) -> bool:
    return formula([one]) == formula([other])


@dataclass(frozen=True)
class _Form:
    """What the form of an expression says of where it is 0."""

    nlp: NLP

    def vanishing(self, e: Node) -> list[Node] | None:
        """What is 0 where an expression is, if that is never below 0 and by its form; None for another one."""
        match e.op:
            case "square" | "abs" | "sqrt":
                return [self.base(e)]
            case "pow" if (n := self.number(e.operands[1])) and n > 0 and n % 2 == 0:
                return [self.base(e)]
            case "add":
                both = [self.vanishing(part) for part in e.operands]
                return [found for part in both if part for found in part] if all(both) else None
            case "mul" | "div" if (factor := self.factor(e)) is not None and factor[0] > 0:
                return self.vanishing(factor[1])
        return None

    def base(self, e: Node) -> Node:
        """The simplest part of an expression that is 0 where the whole is, and nowhere else."""
        match e.op:
            case "square" | "abs" | "sqrt" | "neg":
                return self.base(e.operands[0])
            case "pow" if (n := self.number(e.operands[1])) is not None and n > 0:
                return self.base(e.operands[0])
            case "mul" | "div" if (factor := self.factor(e)) is not None and factor[0] != 0:
                return self.base(factor[1])
            case "mul":
                one, other = map(self.base, e.operands)
                return one if _equal(one, other) else e
        return e

    def signed(self, e: Node) -> Node:
        """The same, of the sign of the whole: b of b³."""
        if e.op == "pow" and (n := self.number(e.operands[1])) and n > 0 and n % 2 == 1:
            return self.signed(e.operands[0])
        if e.op == "mul":
            for one, other in (e.operands, e.operands[::-1]):
                if other.op == "square" and _equal(self.base(one), self.base(other)):
                    return self.signed(one)
        return e

    def factor(self, e: Node) -> tuple[float, Node] | None:
        """A constant factor or divisor, as a factor, and the rest."""
        (one, other), (first, second) = e.operands, map(self.number, e.operands)
        if second:
            return (1 / second if e.op == "div" else second), one
        return (first, other) if first is not None and e.op == "mul" else None

    def number(self, e: Node) -> float | None:
        """The value of what depends on no variable."""
        asked = formula([e])
        if asked.depending(self.nlp.inputs):
            return None
        with np.errstate(all="ignore"):
            return float(fold(asked, self.nlp.numbers, FLOATS)[0])
