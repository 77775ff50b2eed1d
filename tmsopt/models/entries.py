"""One entry of a stated model as an expression that every arithmetic can evaluate."""

import math
from numbers import Real
from typing import Any

import casadi as ca

from tmsopt.arithmetic.operations import BALLS
from tmsopt.arithmetic.walk import operation_name, steps

_ACCEPTED = "accepted: finite numbers, and SX expressions of them"
_FINITE = "accepted: finite numbers, and expressions of them"


class Unfit(ValueError):
    """A statement that makes no model.

    Attributes:
        key: the part of it that is at fault, e.g. ``M``.
        message: what was found, and what is accepted.
    """

    def __init__(self, key: str, message: str) -> None:
        self.key, self.message = key, message
        super().__init__(key, message)

    def __str__(self) -> str:
        return f"{self.key}: {self.message}"


def scalar(key: str, where: str, value: Any) -> ca.SX:
    """An entry as an SX of one element.

    Raises:
        Unfit: for what is no number or SX, is not finite, or uses a function that balls do not have.
    """
    if isinstance(value, ca.MX):
        raise Unfit(key, f"{where}: is MX; make the symbols by ca.SX.sym")
    if isinstance(value, ca.SX | ca.DM):
        if value.numel() != 1:
            raise Unfit(key, f"{where}: is a matrix; accepted: scalar expressions")
        entry = ca.densify(ca.SX(value))
    else:
        entry = ca.SX(_number(key, where, value))
    symbols = ca.symvar(entry)
    for step in steps(ca.Function("entry", [ca.vertcat(*symbols) if symbols else ca.SX(0, 1)], [entry])):
        if step.operation == ca.OP_CONST and not math.isfinite(step.constant):
            raise Unfit(key, f"{where}: contains {step.constant}, as of a division by 0; {_FINITE}")
        if step.operation not in (*BALLS, ca.OP_INPUT, ca.OP_OUTPUT):
            known = "sin cos tan asin acos atan sqrt exp log fabs fmin fmax"
            raise Unfit(key, f"{where}: uses {operation_name(step.operation)}; accepted: + - * / ** and {known}")
    return entry


def _number(key: str, where: str, value: Any) -> float:
    known = isinstance(value, Real) and not isinstance(value, bool)
    try:
        number = float(value) if known else math.nan
    except OverflowError:
        number = math.inf
    if known and not math.isfinite(number):
        raise Unfit(key, f"{where}: is {number}; {_FINITE}")
    if not known:
        text = repr(value)
        raise Unfit(key, f"{where}: found {text if len(text) <= 60 else text[:57] + '…'}; {_ACCEPTED}")
    return number
