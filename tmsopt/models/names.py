"""Names and formulas of a stated model in words: which names it may use, what they look like in figures."""

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
"""Names that mean the same in every expression."""

TAKEN = ("abscissa", "damping_ratio", "angular_frequency", "radius", "structure", "objective", *CONSTANTS, *FUNCTIONS)
"""Names that an expression of a problem uses for something else."""

_WORDS = read_table("advice")
OUTSIDE: str = _WORDS["outside"]
AMBIGUOUS_NAMES = {name: meant.format(outside=OUTSIDE) for name, meant in _WORDS["names"].items()}
"""Names that may stand for more than a parameter → what to do then."""

_EIGENVALUE = (
    f"is the eigenvalue, on which no entry depends: its powers are coefficients, or go in M, D and K, and {OUTSIDE}"
)

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_GREEK = re.compile(
    "alpha|beta|gamma|delta|epsilon|zeta|eta|theta|kappa|lambda|mu|nu|xi|pi|rho|sigma|tau|phi|chi|psi|omega"
    "|Gamma|Delta|Theta|Lambda|Xi|Pi|Sigma|Phi|Psi|Omega"
)
_LONG = 80  # characters; what is longer has a number, and is written once


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


def _called(name: str) -> Callable[..., str]:
    return lambda *operands: f"{name}({', '.join(operands)})"


def number_text(x: Constant) -> str:
    """A constant in full: a fraction as a decimal if it ends soon, such as 0.1; √2 as ``sqrt(2)``."""
    if isinstance(x, Formula):
        return fold(x, {}, Kind(_SPELLED, number_text))[0].removeprefix("(").removesuffix(")")  # type: ignore[no-any-return]
    double = repr(float(as_double(x))).removesuffix(".0")
    return double if isinstance(x, float) or Fraction(double) == x else str(x)


_SPELLED: Mapping[str, Callable[..., str]] = {
    **{name: _called(name) for name in FLOATS.operations},
    "add": lambda a, b: f"({a} + {b})",
    "sub": lambda a, b: f"({a} - {b})",
    "mul": lambda a, b: f"({a} * {b})",
    "div": lambda a, b: f"({a} / {b})",
    "pow": lambda a, b: f"({a} ** {b})",
    "neg": lambda a: f"(-{a})",
    "square": lambda a: f"({a}**2)",
    "pi": lambda: "pi",
}


def spelled(formula: Formula) -> tuple[list[str], list[str]]:
    """The outputs of a formula as texts, every number a double in full, and the parts that they share.

    Equal texts are equal formulas.
    """
    shared: list[str] = []

    def part(text: str) -> str:
        if len(text) <= _LONG:
            return text
        shared.append(text)
        return f"[{len(shared)}]"

    operations = {name: lambda *o, spell=spell: part(spell(*o)) for name, spell in _SPELLED.items()}
    kind = Kind(operations, lambda x: repr(float(as_double(x))).removesuffix(".0"))
    return fold(formula, {name: name for name in formula.names}, kind), shared
