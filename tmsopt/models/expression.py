"""Parser of the expressions in problem files; it never runs them as Python."""

import ast
import keyword
import math
import re
import threading
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache, partial, reduce
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from tmsopt.algebra import kinds
from tmsopt.algebra.formula import CONSTANT, PI, Formula, Kind, Node, constant, fold, formula, make_node, symbol
from tmsopt.errors import short, suggest
from tmsopt.models.advice import advice, call_advice
from tmsopt.models.names import CONSTANTS, FUNCTIONS, UNSUPPORTED
from tmsopt.models.stated.degree import DEGREES, Degree, DegreeTooHigh
from tmsopt.records import AnyNumbers

COMPARISONS = {ast.LtE: "<=", ast.GtE: ">=", ast.Eq: "=="}
_BINARY = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.Div: "div", ast.Pow: "pow"}
_STRICT_SIGNS = {ast.Lt: "<=", ast.Gt: ">="}

_ALLOWED_RANGES = {"<=": (-math.inf, 0.0), ">=": (0.0, math.inf), "==": (0.0, 0.0), "": (-math.inf, math.inf)}
"""Comparison → allowed range of left minus right. Other modules assume that its ends are 0 or infinite."""

SIGN = re.compile("|".join(COMPARISONS.values()))
"""Matches a comparison sign."""

_MAX_LENGTH = 2000  # largest number of characters of an expression; a longer text could exhaust the parser's stack
_MAX_DEPTH = 200  # largest number of nested levels of an expression
_MAX_QUOTED = 60  # largest number of characters of a quoted part in a message
_LANGUAGE = f"numbers, names, + - * / **, parentheses and {' '.join(FUNCTIONS)}"
_BAD_CHARACTER = re.compile(r"[^ -~]|#")  # letters that look like ASCII letters, line breaks, and comments


class ExpressionError(ValueError):
    """An expression cannot be used; the message says why.

    Example:
        >>> try:
        ...     tmsopt.models.parse_value("mu <= 1", ["mu"], example="mu")
        ... except tmsopt.models.ExpressionError as error:
        ...     print(error)
        'mu <= 1' is a comparison; accepted: a value, such as 'mu'

    More: docs/reference/problem_file.md
    """


class UnknownName(ExpressionError):
    """An expression uses a name that is not accepted."""

    def __init__(self, text: str, name: str, accepted: Iterable[str]) -> None:
        self.found, self.name = f"{_quote(text)} uses the unknown name '{name}'", name
        super().__init__(f"{self.found}; {suggest(name, accepted)}")


@dataclass(frozen=True)
class Expression:
    """A parsed expression.

    Attributes:
        text: the text as written.
        names: parameters and quantities in it, in order of appearance.
        comparison: ``<=``, ``>=`` or ``==`` for a constraint, empty for a plain value.

    Example:
        >>> tmsopt.models.parse_value("mu/3 + 1", ["mu"])({"mu": 6.0})
        3.0

    More: docs/reference/problem_file.md
    """

    text: str
    names: tuple[str, ...]
    comparison: str = ""
    formula: Formula = field(default=Formula((), (), ()), repr=False, compare=False)

    def __call__(self, values: AnyNumbers) -> Any:
        """The value for numbers of any kind; a comparison gives left minus right.

        Numbers in the text are exact fractions, and pi is π. A ball is nan where the value may not exist.
        """
        left, *right = self.sides(values)
        return left - right[0] if right else left

    def sides(self, values: AnyNumbers) -> tuple[Any, ...]:
        """(Left side, right side) of a comparison, or (value,)."""
        return tuple(float(x) if isinstance(x, np.float64) else x for x in kinds.values(self.formula, values))

    def difference(self, values: AnyNumbers, limit: Any) -> Any:
        """Left minus right, where `limit` replaces a side that is a constant."""
        are_constant = [self.formula.steps[k].op == CONSTANT for k in self.formula.outputs]
        left, right = (
            limit if is_constant else x for x, is_constant in zip(self.sides(values), are_constant, strict=True)
        )
        return left - right

    def of(self, values: AnyNumbers, kind: Kind) -> Any:
        """The value, or left minus right, in numbers of one kind."""
        left, *right = fold(self.formula, values, kind)
        return kind.operations["sub"](left, right[0]) if right else left

    def violation(self, values: AnyNumbers) -> float:
        """Violation of a comparison by a numeric design, relative to the size of the sides; nan if it is not finite."""
        left, right = self.sides(values)
        excess = float(self.excess(left - right))
        return excess / max(1.0, abs(left), abs(right)) if math.isfinite(left - right) else math.nan

    @property
    def equality(self) -> bool:
        """True if the comparison is an equality, which removes a degree of freedom."""
        return self.comparison == "=="

    @property
    def allowed(self) -> tuple[float, float]:
        """(Least, greatest) value of left minus right that the comparison allows."""
        return _ALLOWED_RANGES[self.comparison]

    @property
    def sign(self) -> float:
        """−1 for ``>=``, where a greater left minus right is better; else 1."""
        return -1.0 if self.comparison == ">=" else 1.0

    def excess(self, difference: Any) -> Any:
        """Distance of left minus right, a number or an array, from the allowed range."""
        return np.abs(difference) if self.equality else np.maximum(self.sign * difference, 0)

    def holds(self, difference: Any) -> Any:
        """True if the comparison allows left minus right; False for nan."""
        return self.excess(difference) <= 0


def parse_value(text: str, accepted: Iterable[str] | None, example: str = "abscissa") -> Expression:
    """Parse an expression for a value, such as an objective; any name is accepted if `accepted` is None.

    Raises:
        ExpressionError: if the text is no such expression. The message names the part found and the accepted parts.

    Example:
        >>> tmsopt.models.parse_value("x_H - x_B", None).names
        ('x_H', 'x_B')

    More: docs/reference/problem_file.md
    """
    if isinstance(_parse(_check_text(text)), ast.Compare):
        raise ExpressionError(f"{_quote(text)} is a comparison; accepted: a value, such as '{example}'")
    return _check_names(_parse_value_text(text), accepted)


def parse_comparison(text: str, accepted: Iterable[str]) -> Expression:
    """Parse a constraint: two values joined by one of ``<= >= ==``.

    Raises:
        ExpressionError: if the text is no such constraint. The message names the part found and the accepted parts.

    Example:
        >>> tmsopt.models.parse_comparison("mu <= 2", ["mu"])({"mu": 6.0})  # left minus right
        4.0

    More: docs/reference/problem_file.md
    """
    return _check_names(_parse_comparison_text(_check_text(text)), accepted)


def _check_names(expression: Expression, accepted: Iterable[str] | None) -> Expression:
    """Check the names of an expression and return it. The cached parser cannot: accepted names differ between calls."""
    accepted_names = expression.names if accepted is None else tuple(accepted)
    for name in expression.names:
        if name not in accepted_names:
            raise UnknownName(expression.text, name, accepted_names)
    return expression


@lru_cache(maxsize=4096)
def _parse_value_text(text: str) -> Expression:
    names, value = _parse_tree(_parse(text), text)
    return Expression(text, names, formula=formula([value], names))


@lru_cache(maxsize=4096)
def _parse_comparison_text(text: str) -> Expression:
    body = _parse(text)
    if not isinstance(body, ast.Compare):
        raise ExpressionError(f"{_quote(text)} is not a comparison; write e.g. 'nu_H >= 0.02' with <=, >= or ==")
    if len(body.ops) > 1:
        texts = pairwise(_source_text(side, text) for side in (body.left, *body.comparators))
        signs = ({**COMPARISONS, **_STRICT_SIGNS}.get(type(op), "==") for op in body.ops)
        parts = " and ".join(f"'{a} {sign} {b}'" for (a, b), sign in zip(texts, signs, strict=True))
        raise ExpressionError(f"{_quote(text)} joins several comparisons; write one constraint for each, {parts}")
    sign = COMPARISONS.get(type(body.ops[0]))
    if sign is None:
        raise ExpressionError(f"{_quote(text)} compares with a sign other than <=, >= and =={_advice(text)}")
    sides = [_parse_tree(side, text) for side in (body.left, *body.comparators)]
    names = tuple(dict.fromkeys(name for side_names, _ in sides for name in side_names))
    if not names:
        raise ExpressionError(f"{_quote(text)} uses no parameter or quantity, so nothing can satisfy or violate it")
    return Expression(text, names, sign, formula([side for _, side in sides], names))


def written_sides(text: str) -> tuple[str, str, str]:
    """The texts of the left side, sign and right side of a comparison.

    Raises:
        ExpressionError: if the text is not one comparison.
    """
    sign, body = _parse_comparison_text(text).comparison, _parse(text)
    assert isinstance(body, ast.Compare)
    return _source_text(body.left, text), sign, _source_text(body.comparators[0], text)


def _check_text(value: object) -> str:
    if not isinstance(value, str):
        raise ExpressionError(f"found {short(value)}; accepted: an expression in quotes")
    return value


_PARSER_LOCK = threading.Lock()
"""Two threads may not run ast.parse (python/cpython#106905) or warnings.catch_warnings at the same time."""


@lru_cache(maxsize=4096)
def _parse(text: str) -> ast.expr:
    if len(text) > _MAX_LENGTH:
        raise ExpressionError(f"expression of {len(text)} characters; accepted: up to {_MAX_LENGTH}")
    if bad_character := _BAD_CHARACTER.search(text.strip()):
        message = f"{_quote(text)} contains {bad_character[0]!r}{_advice(text)}"
        raise ExpressionError(f"{message}; accepted: one line of {_LANGUAGE}")
    try:
        return _parse_syntax(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        column = f" at character {error.offset}" if isinstance(error, SyntaxError) and error.offset else ""
        reserved = next((word for word in re.findall(r"[A-Za-z_]\w*", text) if keyword.iskeyword(word)), None)
        hint = f"; '{reserved}' is a reserved word, write e.g. {reserved}_" if reserved else ""
        if reserved == "lambda":
            hint += f" (the tilt of a bicycle is lambda_s; if you mean the eigenvalue: {UNSUPPORTED})"
        message = f"does not parse{column}{hint}{_advice(text)}; accepted: {_LANGUAGE}"
        raise ExpressionError(f"{_quote(text)} {message}") from None


def _parse_syntax(text: str) -> ast.expr:
    with _PARSER_LOCK, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the tokenizer warns of texts like 1if, which then fail
        return ast.parse(text.strip(), mode="eval").body


def _advice(text: str) -> str:
    """The end of a message about a text: what to write instead; empty if there is no advice."""

    def can_parse(repaired_text: str) -> bool:
        try:
            return not isinstance(_parse_syntax(repaired_text), ast.Tuple)
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            return False

    return advice(text, can_parse)


class _Part(NamedTuple):
    """A parsed part of a text and its degree."""

    node: Node
    degree: Degree


def _combine(op: str, *parts: _Part) -> _Part:
    return _Part(make_node(op, *(p.node for p in parts)), DEGREES.operations[op](*(p.degree for p in parts)))


def _parse_tree(body: ast.expr, text: str) -> tuple[tuple[str, ...], Node]:
    """The names and the node of an expression; raises `ExpressionError` if a part is not accepted or too large."""
    parser = _Parser(text)
    try:
        node = parser.parse(body).node
        return tuple(parser.names), node
    except DegreeTooHigh as error:
        part = _source_text(error.part, text)
        prefix = "" if part == text.strip() else f"{_quote(text)}: "
        raise ExpressionError(f"{prefix}{_quote(part)} {error}") from None


def _quote(text: str) -> str:
    return f"'{text}'" if len(text) <= _MAX_QUOTED else f"'{text[: _MAX_QUOTED - 1]}…'"


@dataclass
class _Parser:
    """Turns the syntax tree of one text into nodes, with an input for each name."""

    text: str
    names: dict[str, Node] = field(default_factory=dict)

    def parse(self, node: ast.expr, depth: int = 0) -> _Part:  # noqa: PLR0911, PLR0912 - one case per kind
        """The node of a part; raises `ExpressionError` if the part is not accepted."""
        text = self.text
        if depth > _MAX_DEPTH:
            raise ExpressionError(f"'{text[:60]}…' is nested deeper than {_MAX_DEPTH} levels")

        match node:
            case ast.Constant(value=bool()):
                raise ExpressionError(f"{_quote(text)} uses {node.value!r}; accepted: numbers and names")
            case ast.Constant(value=int() | float() as value):
                return _Part(constant(_read_number(node, text)), DEGREES.constant(float(value)))
            case ast.Name(id=name) if name in CONSTANTS:
                return _Part(PI, DEGREES.constant(math.pi))
            case ast.Name(id=name) if name in FUNCTIONS:
                raise ExpressionError(f"{_quote(text)} names the function {name} without an argument; write {name}(…)")
            case ast.Name(id=name):
                return _Part(self.names.setdefault(name, symbol(name)), Degree())
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return self.parse(operand, depth + 1)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return self.apply("neg", node, [operand], depth)
            case ast.BinOp(left=left, op=op, right=right):
                if type(op) not in _BINARY:
                    raise ExpressionError(f"{_quote(text)} uses an operator other than + - * / **{_advice(text)}")
                return self.apply(_BINARY[type(op)], node, [left, right], depth)
            case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in FUNCTIONS:
                min_count, max_count = (2, 99) if name in ("min", "max") else (1, 1)
                if not min_count <= len(args) <= max_count:
                    accepted = (
                        f"{min_count} to {max_count} arguments, {name}(a, b)" if max_count > 1 else "one argument"
                    )
                    hint = (
                        f"; for one number write {_source_text(args[0], text)} alone"
                        if 0 < len(args) < min_count
                        else ""
                    )
                    message = f"calls {name} with {len(args)} arguments; accepted: {accepted}{hint}"
                    raise ExpressionError(f"{_quote(text)} {message}")
                return self.apply(name, node, args, depth)
            case ast.Call():
                hint = call_advice(
                    function := _source_text(node.func, text), [_source_text(a, text) for a in node.args]
                )
                raise ExpressionError(f"{_quote(text)} calls '{function}'{hint}; accepted: {' '.join(FUNCTIONS)}")
            case ast.Attribute():
                message = f"uses the attribute '{_source_text(node, text)}'; accepted: plain names"
                raise ExpressionError(f"{_quote(text)} {message}")
            case _:
                message = f"contains '{_source_text(node, text)}'{_advice(text)}; accepted: {_LANGUAGE}"
                raise ExpressionError(f"{_quote(text)} {message}")

    def apply(self, op: str, operation: ast.expr, operands: Sequence[ast.expr], depth: int) -> _Part:
        """Apply an operation to its operands; more than two operands are combined from left to right.

        Args:
            operation: the part of the syntax tree with this operation, for messages.
        """
        parts = [self.parse(operand, depth + 1) for operand in operands]
        try:
            return reduce(partial(_combine, op), parts[1:], parts[0]) if parts[1:] else _combine(op, *parts)
        except DegreeTooHigh as error:
            error.part = error.part or operation
            raise


def _source_text(node: ast.expr, text: str) -> str:
    """The text from which a node was parsed."""
    return ast.get_source_segment(text.strip(), node) or text


def _read_number(node: ast.Constant, text: str) -> Fraction:
    """The exact value of a number in the text. 0e999999 is 0: the power of ten is not computed."""
    value, source = node.value, _source_text(node, text)
    try:
        number = float(value)  # type: ignore[arg-type]
    except OverflowError:
        number = math.inf
    if not math.isfinite(number) or (number == 0 and re.match(r"[0._]*[1-9]", source)):
        raise ExpressionError(f"{_quote(text)} contains {source[:_MAX_QUOTED]}, a number beyond double precision")
    return Fraction(value) if isinstance(value, int) else Fraction(source.replace("_", "")) if number else Fraction(0)
