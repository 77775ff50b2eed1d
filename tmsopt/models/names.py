"""Names and formulas of a stated model: accepted names, their LaTeX, and formulas as text."""

import keyword
import re
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

from tmsopt.algebra.formula import Constant, Formula, Kind, fold
from tmsopt.algebra.kinds import FLOATS, as_double
from tmsopt.models.tables import read_table

FUNCTIONS = ("sin", "cos", "tan", "asin", "acos", "atan", "sqrt", "exp", "log", "abs", "min", "max")
CONSTANTS = ("pi",)
"""Names with a fixed value in every expression."""

TAKEN = ("abscissa", "damping_ratio", "angular_frequency", "radius", "structure", "objective", *CONSTANTS, *FUNCTIONS)
"""Names that already have a meaning in expressions, so that no parameter may have them."""

_WORDS = read_table("advice")
UNSUPPORTED: str = _WORDS["outside"]
AMBIGUOUS_NAMES = {name: template.format(outside=UNSUPPORTED) for name, template in _WORDS["names"].items()}
"""Names that may have another meaning than a parameter → what to write in that case."""

_EIGENVALUE = f"is the eigenvalue, which no entry may use (its powers go in coefficients or M, D, K; {UNSUPPORTED})"

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_GREEK = re.compile(
    "alpha|beta|gamma|delta|epsilon|zeta|eta|theta|kappa|lambda|mu|nu|xi|pi|rho|sigma|tau|phi|chi|psi|omega"
    "|Gamma|Delta|Theta|Lambda|Xi|Pi|Sigma|Phi|Psi|Omega"
)
_MAX_INLINE = 80  # a part of a formula with more characters gets a number and is written once


def name_fault(name: Any, of_H: bool = False) -> str:
    """The reason why a parameter or quantity may not have a name; empty if it may. With a complex H it may be ``s``."""
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        return "is no name: a letter, then letters, digits and _"
    if keyword.iskeyword(name):
        return "is a reserved word"
    if name == "s" and not of_H:
        return _EIGENVALUE
    return "is what tmsopt computes" if name in TAKEN else ""


def latex(name: str) -> str:
    """A name as LaTeX: ``mu_1`` and ``mu1`` become μ with an index, and ``k_max`` gets an upright index.

    Example:
        >>> tmsopt.models.latex("x2")
        'x_{2}'

    More: docs/tutorials/own_system.md
    """
    base, *indices = filter(None, name.split("_"))
    if numbered := re.fullmatch(r"([A-Za-z]+)(\d+)", base):
        base, indices = numbered[1], [numbered[2], *indices]
    symbol = f"\\{base}" if _GREEK.fullmatch(base) else _upright(base)
    return f"{symbol}_{{{','.join(map(_upright, indices))}}}" if indices else symbol


def _upright(word: str) -> str:
    """The LaTeX of a word in upright letters; single letters and numbers stay unchanged."""
    return word if len(word) == 1 or word.isdigit() else rf"\mathrm{{{word}}}"


def _spell_call(name: str) -> Callable[..., str]:
    return lambda *operands: f"{name}({', '.join(operands)})"


def number_text(x: Constant) -> str:
    """A constant with every digit: a fraction as a decimal if a double holds it, such as 0.1; √2 as ``sqrt(2)``."""
    if isinstance(x, Formula):
        return re.sub(r"^\((.*)\)$", r"\1", fold(x, {}, Kind(_SPELLINGS, number_text))[0])
    double = repr(float(as_double(x))).removesuffix(".0")
    return double if isinstance(x, float) or Fraction(double) == x else str(x)


_SPELLINGS: Mapping[str, Callable[..., str]] = {
    **{name: _spell_call(name) for name in FLOATS.operations},
    "add": lambda a, b: f"({a} + {b})",
    "sub": lambda a, b: f"({a} - {b})",
    "mul": lambda a, b: f"({a} * {b})",
    "div": lambda a, b: f"({a} / {b})",
    "pow": lambda a, b: f"({a} ** {b})",
    "neg": lambda a: f"(-{a})",
    "square": lambda a: f"({a}**2)",
    "pi": lambda: "pi",
}


def spell_formula(formula: Formula) -> tuple[list[str], list[str]]:
    """The outputs of a formula as texts with all digits of their doubles, and the list of the long parts.

    Formulas with equal texts are equal.
    """
    long_parts: list[str] = []

    def number_if_long(text: str) -> str:
        if len(text) <= _MAX_INLINE:
            return text
        long_parts.append(text)
        return f"[{len(long_parts)}]"

    operations = {name: lambda *o, spell=spell: number_if_long(spell(*o)) for name, spell in _SPELLINGS.items()}
    kind = Kind(operations, lambda x: repr(float(as_double(x))).removesuffix(".0"))
    return fold(formula, {name: name for name in formula.names}, kind), long_parts
