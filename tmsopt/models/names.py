"""Names and formulas of a stated model in words: which names it may use, what they look like in figures."""

import keyword
import re
from collections.abc import Sequence
from typing import Any

import casadi as ca

from tmsopt.algebra.walk import operation_name, steps

FUNCTIONS = ("sin", "cos", "tan", "asin", "acos", "atan", "sqrt", "exp", "log", "abs", "min", "max")
CONSTANTS = ("pi",)
"""Names that mean the same in every expression."""

TAKEN = ("abscissa", "damping_ratio", "angular_frequency", "radius", "structure", "objective", *CONSTANTS, *FUNCTIONS)
"""Names that an expression of a problem uses for something else."""

OUTSIDE = (
    "a delay exp(-s*tau), as any nonlinear eigenproblem, is outside of what tmsopt does; approximate it by states "
    "(Padé: x(t - tau) = w - x with w' = (4*x - 2*w)/tau)"
)
_EIGENVALUE = (
    f"is the eigenvalue, on which no entry depends: its powers are coefficients, or go in M, D and K, and {OUTSIDE}"
)

MEANT = {
    "s": f"if s is the eigenvalue: {OUTSIDE}",
    "t": "if t is the time: a system that changes with time is outside of what tmsopt does; write its average",
    "z": "if z is that of discrete time: write p((1 + s)/(1 - s))*(1 - s)**n, whose roots are left where |z| < 1",
    "omega": f"if omega is the eigenfrequency: {OUTSIDE}",
    "e": "if e is Euler's number: write exp(1)",
    **dict.fromkeys(("i", "I", "j"), "if it is the imaginary unit: write 1j, in [model] H, for matrices are real"),
}
"""Names that may stand for more than a parameter → what to do then."""

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_GREEK = re.compile(
    "alpha|beta|gamma|delta|epsilon|zeta|eta|theta|kappa|lambda|mu|nu|xi|pi|rho|sigma|tau|phi|chi|psi|omega"
    "|Gamma|Delta|Theta|Lambda|Xi|Pi|Sigma|Phi|Psi|Omega"
)
_LONG = 80  # characters; what is longer has a number, and is written once
_INFIX = {ca.OP_ADD: "+", ca.OP_SUB: "-", ca.OP_MUL: "*", ca.OP_DIV: "/", ca.OP_POW: "**", ca.OP_CONSTPOW: "**"}
_SHORT = {ca.OP_NEG: "(-{})", ca.OP_SQ: "({}**2)", ca.OP_TWICE: "(2*{})", ca.OP_INV: "(1/{})"}


def unusable(name: Any, of_H: bool = False) -> str:
    """Why no parameter or quantity may have a name; empty where one may, as s in a complex H, which has ω."""
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        return "is no name: a letter, then letters, digits and _"
    if keyword.iskeyword(name):
        return "is a reserved word"
    if name == "s" and not of_H:
        return _EIGENVALUE
    return "is what tmsopt computes" if name in TAKEN else ""


def latex(name: str) -> str:
    """A name as a symbol: ``mu_1`` and ``mu1`` as μ with an index, ``k_max`` with an upright one.

    Example:
        >>> tmsopt.models.latex("x2")
        'x_{2}'

    More: docs/tutorials/own_system.md
    """
    first, *indices = filter(None, name.split("_"))
    if numbered := re.fullmatch(r"([A-Za-z]+)(\d+)", first):
        first, indices = numbered[1], [numbered[2], *indices]
    symbol = f"\\{first}" if _GREEK.fullmatch(first) else _upright(first)
    return f"{symbol}_{{{','.join(map(_upright, indices))}}}" if indices else symbol


def _upright(word: str) -> str:
    """A word, a letter or a number; only letters alone are slanted."""
    return word if len(word) == 1 or word.isdigit() else rf"\mathrm{{{word}}}"


def spelled(function: ca.Function, names: Sequence[str]) -> tuple[list[str], list[str]]:
    """The outputs of a function of one vector as texts, every number in full, and the parts that they share.

    Equal texts are equal formulas; CasADi's own leave out digits.
    """
    texts: list[str] = []
    shared: list[str] = []
    outputs = ["0"] * function.nnz_out(0)
    for step in steps(function):
        operands = [texts[k] for k in step.operands]
        match step.operation:
            case ca.OP_INPUT:
                text = names[step.place[1]]
            case ca.OP_CONST:
                text = repr(step.constant).removesuffix(".0")
            case ca.OP_OUTPUT:
                text = outputs[step.place[1]] = operands[0]
            case operation if operation in _INFIX:
                text = f"({operands[0]} {_INFIX[operation]} {operands[1]})"
            case operation if operation in _SHORT:
                text = _SHORT[operation].format(*operands)
            case operation:
                text = f"{operation_name(operation)}({', '.join(operands)})"
        if len(text) > _LONG and step.operation != ca.OP_OUTPUT:
            shared.append(text)
            text = f"[{len(shared)}]"
        texts.append(text)
    return outputs, shared
