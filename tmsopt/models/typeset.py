"""Formulas as LaTeX, for notebooks and papers."""

from collections.abc import Callable
from fractions import Fraction
from typing import NamedTuple

from tmsopt.algebra.formula import Constant, Formula, Kind, fold
from tmsopt.algebra.kinds import FLOATS

_SUM, _PRODUCT, _POWER, _ATOM = range(4)
"""Precedences, from the lowest to the highest."""


class Typeset(NamedTuple):
    """LaTeX of a part of a formula, and the precedence of its outermost operation; a single symbol has the highest."""

    text: str
    precedence: int = _ATOM

    def enclose(self, min_precedence: int) -> str:
        """The LaTeX, in parentheses if its precedence is below `min_precedence`."""
        return self.text if self.precedence >= min_precedence else rf"\left({self.text}\right)"


def _sum(a: Typeset, b: Typeset) -> Typeset:
    return Typeset(f"{a.text} - {b.text[1:]}" if b.text.startswith("-") else f"{a.text} + {b.text}", _SUM)


def _product(a: Typeset, b: Typeset) -> Typeset:
    dot = r" \cdot " if b.text[:1].isdigit() else r" \, "
    return Typeset(f"{a.enclose(_PRODUCT)}{dot}{b.enclose(_PRODUCT)}", _PRODUCT)


def _power(a: Typeset, b: Typeset) -> Typeset:
    return Typeset(f"{a.enclose(_ATOM)}^{{{b.text}}}", _POWER)


def _function(name: str) -> Callable[..., Typeset]:
    return lambda *operands: Typeset(rf"{name}\left({', '.join(x.text for x in operands)}\right)", _POWER)


def _relation(sign: str) -> Callable[[Typeset, Typeset], Typeset]:
    return lambda a, b: Typeset(f"{a.text} {sign} {b.text}", _SUM)


def _cases(condition: Typeset, a: Typeset, b: Typeset) -> Typeset:
    rows = rf"{a.text} & \text{{if }} {condition.text} \\ {b.text} & \text{{else}}"
    return Typeset(rf"\begin{{cases}} {rows} \end{{cases}}", _SUM)


def _number(x: Constant) -> Typeset:
    if isinstance(x, Formula):
        typeset: Typeset = fold(x, {}, LATEX)[0]
        return typeset
    if isinstance(x, Fraction) and Fraction(repr(float(x))) != x:
        sign, size = "-" * (x < 0), abs(x)
        return Typeset(rf"{sign}\frac{{{size.numerator}}}{{{size.denominator}}}", _SUM if sign else _POWER)
    text, _, power = repr(float(x)).removesuffix(".0").partition("e")
    scale = rf" \cdot 10^{{{int(power)}}}" if power else ""
    return Typeset(text + scale, _SUM if text.startswith("-") else _PRODUCT if scale else _ATOM)


LATEX = Kind(
    {
        **{name: _function(rf"\operatorname{{{name}}}") for name in FLOATS.operations},
        **{name: _function(rf"\{name}") for name in ("exp", "log", "sin", "cos", "tan", "min", "max")},
        **{f"a{name}": _function(rf"\arc{name}") for name in ("sin", "cos", "tan")},
        "add": _sum,
        "sub": lambda a, b: Typeset(f"{a.text} - {b.enclose(_PRODUCT)}", _SUM),
        "mul": _product,
        **dict.fromkeys(
            ("div", "quotient_or_nan", "quotient_or_zero"),
            lambda a, b: Typeset(rf"\frac{{{a.text}}}{{{b.text}}}", _POWER),
        ),
        "neg": lambda a: Typeset(f"-{a.enclose(_PRODUCT)}", _SUM),
        "pow": _power,
        "square": lambda a: _power(a, Typeset("2")),
        "sqrt": lambda a: Typeset(rf"\sqrt{{{a.text}}}"),
        "abs": lambda a: Typeset(rf"\left|{a.text}\right|"),
        "less": _relation("<"),
        "at_most": _relation(r"\leq"),
        "equal": _relation("="),
        "and": _relation(r"\wedge"),
        "or": _relation(r"\vee"),
        "not": lambda a: Typeset(rf"\neg {a.enclose(_ATOM)}", _POWER),
        "choose": _cases,
        "positive_part": lambda a: Typeset(rf"\max\left(0, {a.text}\right)", _POWER),
        "negligible": lambda a, size: Typeset(rf"{a.text} \approx 0", _SUM),
        "pi": lambda: Typeset(r"\pi"),
    },
    _number,
)
"""A kind whose numbers are LaTeX. To typeset a formula, `fold` it with this kind and a `Typeset` for each name."""


def polynomial_text(coefficients: list[Typeset], variable: str = "s") -> str:
    """LaTeX of a polynomial with descending coefficients."""
    terms = []
    for k, c in zip(range(len(coefficients) - 1, -1, -1), coefficients, strict=True):
        power = Typeset(variable if k == 1 else f"{variable}^{{{k}}}", _POWER)
        terms += [] if c.text == "0" else [c if k == 0 else power if c.text == "1" else _product(c, power)]
    text = terms[0].text if terms else "0"
    for term in terms[1:]:
        text = _sum(Typeset(text), term).text
    return text
