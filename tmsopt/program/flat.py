"""Limits that are flat where they bind: what e⁴ ≤ 0 asks for is e = 0, and a solver sees that in e alone."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

import casadi as ca

from tmsopt.program.nlp import NLP

FLAT = ".flat"
"""Name of the rows that stand for a flat limit: what that costs by its own measure is without bound."""

_DEEP = 99  # levels to which expressions are compared


def remove_even_powers(nlp: NLP, names: Collection[str]) -> NLP:
    """An NLP in which powers, and sums of what is never below 0, that must be 0 give way to what they are powers of.

    Args:
        names: of the rows that are looked at.
    """
    x, p = ca.SX.sym("x", len(nlp.variables)), ca.SX.sym("p", len(nlp.settings))
    f, g = nlp.at(x, p)
    rows = list(zip(nlp.rows, ca.vertsplit(g), nlp.row_lower, nlp.row_upper, strict=True))
    more: list[tuple[str, Any, float, float]] = []
    for k, (name, row, lower, upper) in enumerate(rows):
        if name in names and 0.0 in (lower, upper):
            must = (_vanishing(row) if upper == 0 else None) or (_vanishing(-row) if lower == 0 else None)
            if must is None and lower == upper:
                must = [_base(row)]
            new = [(e, 0.0, 0.0) for e in must] if must else [(_signed(row), lower, upper)]
            if new[0][0] is not row and not ca.is_equal(new[0][0], row, _DEEP):
                rows[k], *others = ((FLAT, *limits) for limits in new)
                more += others
    if not any(name == FLAT for name, *_ in rows):
        return nlp
    every, inputs = [*rows, *more], [x, p] if nlp.settings else [x]
    body = ca.densify(ca.vertcat(*(e for _, e, _, _ in every)))
    return replace(
        nlp,
        functions=ca.Function("nlp", inputs, [f, body], ["x", "p"][: len(inputs)], ["f", "g"]),
        rows=tuple(name for name, *_ in every),
        row_lower=tuple(lower for *_, lower, _ in every),
        row_upper=tuple(upper for *_, upper in every),
    )


def _vanishing(e: Any) -> list[Any] | None:
    """What is 0 where an expression is, if that is never below 0 and by its form; None for another one."""
    match e.op() if e.is_scalar() and not e.is_constant() else None:
        case ca.OP_SQ | ca.OP_FABS | ca.OP_SQRT:
            return [_base(e)]
        case ca.OP_ADD:
            both = [_vanishing(part) for part in _parts(e)]
            return [found for part in both if part for found in part] if all(both) else None
        case ca.OP_TWICE:
            return _vanishing(e.dep(0))
        case ca.OP_MUL | ca.OP_DIV if (factor := _factor(e)) is not None and factor[0] > 0:
            return _vanishing(factor[1])
    return None


def _base(e: Any) -> Any:
    """The simplest part of an expression that is 0 where the whole is, and nowhere else."""
    match e.op() if not e.is_constant() else None:
        case ca.OP_SQ | ca.OP_FABS | ca.OP_SQRT | ca.OP_NEG | ca.OP_TWICE:
            return _base(e.dep(0))
        case ca.OP_POW | ca.OP_CONSTPOW if e.dep(1).is_constant() and float(e.dep(1)) > 0:
            return _base(e.dep(0))
        case ca.OP_MUL | ca.OP_DIV if (factor := _factor(e)) is not None and factor[0] != 0:
            return _base(factor[1])
        case ca.OP_MUL:
            one, other = map(_base, _parts(e))
            return one if ca.is_equal(one, other, _DEEP) else e
    return e


def _signed(e: Any) -> Any:
    """The same, of the sign of the whole: b of b³."""
    if not e.is_constant() and e.op() == ca.OP_MUL:
        for one, other in (_parts(e), _parts(e)[::-1]):
            if other.op() == ca.OP_SQ and ca.is_equal(_base(one), _base(other), _DEEP):
                return _signed(one)
    return e


def _factor(e: Any) -> tuple[float, Any] | None:
    """A constant factor or divisor, as a factor, and the rest."""
    one, other = _parts(e)
    if other.is_constant() and float(other):
        return (1 / float(other) if e.op() == ca.OP_DIV else float(other)), one
    return (float(one), other) if one.is_constant() and e.op() == ca.OP_MUL else None


def _parts(e: Any) -> Sequence[Any]:
    return e.dep(0), e.dep(1)
