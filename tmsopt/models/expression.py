"""Expressions of a problem file: parsed to a small checked tree, never run as Python."""

import ast
import keyword
import math
import re
import threading
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from tmsopt.errors import short, suggest
from tmsopt.models import arithmetics
from tmsopt.models.advice import advice, call_advice
from tmsopt.models.arithmetics import BALLS, BINARY, DEGREES, NUMERIC, SYMBOLIC, Arithmetic
from tmsopt.models.names import CONSTANTS, FUNCTIONS, OUTSIDE
from tmsopt.models.stated.degree import Degree, DegreeTooHigh

COMPARISONS = {ast.LtE: "<=", ast.GtE: ">=", ast.Eq: "=="}
_STRICT = {ast.Lt: "<=", ast.Gt: ">="}

_ALLOWED = {"<=": (-math.inf, 0.0), ">=": (0.0, math.inf), "==": (0.0, 0.0), "": (-math.inf, math.inf)}

_LONGEST = 2000  # characters; longer texts could exhaust the parser's stack
_DEEPEST = 200
_LEGIBLE = 60  # characters of a part at fault
_LANGUAGE = f"numbers, names, + - * / **, parentheses and {' '.join(FUNCTIONS)}"
_NOT_ACCEPTED = re.compile(r"[^ -~]|#")  # look-alike letters, line breaks and comments


class ExpressionError(ValueError):
    """An expression that cannot be used, with the reason."""


class UnknownName(ExpressionError):
    """An expression with a name that is not accepted."""

    def __init__(self, text: str, name: str, accepted: Iterable[str]) -> None:
        self.found, self.name = f"{_quoted(text)} uses the unknown name '{name}'", name
        super().__init__(f"{self.found}; {suggest(name, accepted)}")


@dataclass(frozen=True)
class Expression:
    """A parsed expression.

    Attributes:
        text: as written.
        names: parameters and quantities that it uses, in order of appearance.
        comparison: ``<=``, ``>=`` or ``==`` for a constraint, empty for a plain value.
    """

    text: str
    names: tuple[str, ...]
    comparison: str = ""

    def __call__(self, values: Mapping[str, Any]) -> Any:
        """Value for floats or arrays; of a comparison, left minus right."""
        return self.evaluate(values, NUMERIC)

    def symbolic(self, values: Mapping[str, Any], limit: Any = None) -> Any:
        """CasADi expression; of a comparison, left minus right, with `limit` in place of the number on one side."""
        if limit is None:
            return self.evaluate(values, SYMBOLIC)
        with np.errstate(all="ignore"):
            sides = [limit if _is_number(side) else _value(side, values, SYMBOLIC) for side in self._sides()]
        return sides[0] - sides[1]

    def enclosure(self, values: Mapping[str, Any]) -> Any:
        """Ball that certainly holds the value, for balls or exact fractions; of a comparison, left minus right.

        A number in the text is the fraction that its digits say, and pi the number π. The ball is nan where the value
        does not exist, or may not.
        """
        return self.evaluate(values, BALLS)

    def violation(self, values: Mapping[str, Any]) -> float:
        """By how much a numeric design violates a comparison, relative to the size of its sides; nan if undefined."""
        left, right = self.sides(values)
        difference = left - right
        excess = float(self.excess(difference))
        return excess / max(1.0, abs(left), abs(right)) if math.isfinite(difference) else math.nan

    @property
    def numbers(self) -> list[str]:
        """Texts of the parts without names."""
        return arithmetics.constant_texts(_parse(self.text))

    @property
    def equality(self) -> bool:
        """Whether a comparison allows one value alone, so that it takes away a degree of freedom."""
        return self.allowed[0] == self.allowed[1]

    @property
    def allowed(self) -> tuple[float, float]:
        """Least and greatest left minus right that a comparison allows."""
        return _ALLOWED[self.comparison]

    @property
    def sign(self) -> float:
        """−1 where left minus right is better the greater it is; else 1, for values and equalities too."""
        return -1.0 if self.allowed == (0.0, math.inf) else 1.0

    def excess(self, difference: Any) -> Any:
        """By how much left minus right, a number or an array of them, is beyond what a comparison allows."""
        return np.abs(difference) if self.equality else np.maximum(self.sign * difference, 0)

    def holds(self, difference: Any) -> Any:
        """Whether a comparison allows left minus right; not where that does not exist."""
        return self.excess(difference) <= 0

    def sides(self, values: Mapping[str, Any]) -> tuple[float, float]:
        """Both sides of a comparison for a numeric design."""
        left, right = map(float, self.each(values))
        return left, right

    def each(self, values: Mapping[str, Any]) -> list[Any]:
        """Both sides of a comparison for arrays."""
        with np.errstate(all="ignore"):
            return [_value(side, values, NUMERIC) for side in self._sides()]

    def _sides(self) -> list[ast.expr]:
        body = _parse(self.text)
        return [body.left, *body.comparators] if isinstance(body, ast.Compare) else [body]

    def evaluate(self, values: Mapping[str, Any], arithmetic: Arithmetic) -> Any:
        """Value in any arithmetic; of a comparison, left minus right."""
        with np.errstate(all="ignore"):  # what has no value, or no double, is nan or inf
            sides = [arithmetic.number(_value(side, values, arithmetic)) for side in self._sides()]
            return sides[0] - sides[1] if len(sides) == 2 else sides[0]


def parse_value(text: str, accepted: Iterable[str] | None, example: str = "abscissa") -> Expression:
    """Parse an expression for a value, such as an objective; in names of the author's own where none are `accepted`.

    Raises:
        ExpressionError: with what was found and what is accepted.
    """
    body = _parse(_text(text))
    if isinstance(body, ast.Compare):
        raise ExpressionError(f"{_quoted(text)} is a comparison; accepted: a value, such as '{example}'")
    return Expression(text, _checked(body, text, None if accepted is None else list(accepted)))


def parse_comparison(text: str, accepted: Iterable[str]) -> Expression:
    """Parse a constraint, two values joined by one of ``<= >= ==``.

    Raises:
        ExpressionError: with what was found and what is accepted.
    """
    body = _parse(_text(text))
    if not isinstance(body, ast.Compare):
        raise ExpressionError(f"{_quoted(text)} is not a comparison; write e.g. 'nu_H >= 0.02' with <=, >= or ==")
    if len(body.ops) > 1:
        sides = pairwise(_source(side, text) for side in (body.left, *body.comparators))
        signs = ({**COMPARISONS, **_STRICT}.get(type(op), "==") for op in body.ops)
        each = " and ".join(f"'{a} {sign} {b}'" for (a, b), sign in zip(sides, signs, strict=True))
        raise ExpressionError(f"{_quoted(text)} joins several comparisons; write one constraint for each, {each}")
    symbol = COMPARISONS.get(type(body.ops[0]))
    if symbol is None:
        raise ExpressionError(f"{_quoted(text)} compares with another sign than <=, >= or =={_advice(text)}")
    known = list(accepted)
    left, right = _checked(body.left, text, known), _checked(body.comparators[0], text, known)
    names = tuple(dict.fromkeys(left + right))
    if not names:
        raise ExpressionError(f"{_quoted(text)} uses no parameter or quantity, so nothing can satisfy or violate it")
    return Expression(text, names, symbol)


def written_sides(text: str) -> tuple[str, str, str]:
    """Left side, sign and right side of a comparison, as written.

    Raises:
        ExpressionError: for anything else.
    """
    body = _parse(text)
    if not isinstance(body, ast.Compare) or len(body.ops) > 1 or type(body.ops[0]) not in COMPARISONS:
        raise ExpressionError(f"{_quoted(text)} is not a comparison by <=, >= or ==")
    return _source(body.left, text), COMPARISONS[type(body.ops[0])], _source(body.comparators[0], text)


def _text(given: object) -> str:
    if not isinstance(given, str):
        raise ExpressionError(f"found {short(given)}; accepted: an expression in quotes")
    return given


_ONE_AT_A_TIME = threading.Lock()
"""Neither ast.parse (python/cpython#106905) nor warnings.catch_warnings may run in two threads at once."""


@lru_cache(maxsize=4096)
def _parse(text: str) -> ast.expr:
    if len(text) > _LONGEST:
        raise ExpressionError(f"expression of {len(text)} characters; accepted: up to {_LONGEST}")
    if strange := _NOT_ACCEPTED.search(text.strip()):
        found = f"{_quoted(text)} contains {strange[0]!r}{_advice(text)}"
        raise ExpressionError(f"{found}; accepted: one line of {_LANGUAGE}")
    try:
        return _tree(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        column = f" at character {error.offset}" if isinstance(error, SyntaxError) and error.offset else ""
        kept = next((word for word in re.findall(r"[A-Za-z_]\w*", text) if keyword.iskeyword(word)), None)
        own = f"; '{kept}' is a reserved word, write e.g. {kept}_" if kept else ""
        own += f" (the tilt of a bicycle is lambda_s; of the eigenvalue: {OUTSIDE})" if kept == "lambda" else ""
        found = f"does not parse{column}{own}{_advice(text)}; accepted: {_LANGUAGE}"
        raise ExpressionError(f"{_quoted(text)} {found}") from None


def _tree(text: str) -> ast.expr:
    with _ONE_AT_A_TIME, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the tokenizer warns of texts like 1if, which fail below
        body = ast.parse(text.strip(), mode="eval").body
    arithmetics.note_constants(body, text.strip())
    return body


def _advice(text: str) -> str:
    """What to write instead."""

    def reads(mended: str) -> bool:
        try:
            return not isinstance(_tree(mended), ast.Tuple)
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            return False

    return advice(text, reads)


def _checked(node: ast.expr, text: str, accepted: list[str] | None) -> tuple[str, ...]:
    """Names that a value uses; raises where it is no accepted arithmetic, or too large to be computed exactly."""
    names = _checked_names(node, text, accepted)
    try:
        DEGREES.number(_value(node, dict.fromkeys(names, Degree()), DEGREES))
    except DegreeTooHigh as error:
        part = _source(error.part, text) if error.part else text
        whole = "" if part == text.strip() else f"{_quoted(text)}: "
        raise ExpressionError(f"{whole}{_quoted(part)} {error}") from None
    return names


def _quoted(text: str) -> str:
    return f"'{text}'" if len(text) <= _LEGIBLE else f"'{text[: _LEGIBLE - 1]}…'"


def _checked_names(  # noqa: PLR0912 - one case per kind of node
    node: ast.expr, text: str, accepted: list[str] | None, depth: int = 0
) -> tuple[str, ...]:
    """Names that an expression uses, of those accepted if these are given; raises on all but accepted arithmetic."""
    if depth > _DEEPEST:
        raise ExpressionError(f"'{text[:60]}…' is nested deeper than {_DEEPEST} levels")

    def names_in(*nodes: ast.expr) -> tuple[str, ...]:
        found = [name for n in nodes for name in _checked_names(n, text, accepted, depth + 1)]
        return tuple(dict.fromkeys(found))

    match node:
        case ast.Constant(value=bool()):
            raise ExpressionError(f"{_quoted(text)} uses {node.value!r}; accepted: numbers and names")
        case ast.Constant(value=int() | float()):
            _check_number(node, text)
            return ()
        case ast.Name(id=name):
            if name in CONSTANTS:
                return ()
            if name in FUNCTIONS:
                raise ExpressionError(f"{_quoted(text)} names the function {name} without argument; write {name}(…)")
            if accepted is not None and name not in accepted:
                raise UnknownName(text, name, accepted)
            return (name,)
        case ast.UnaryOp(op=ast.UAdd() | ast.USub(), operand=operand):
            return names_in(operand)
        case ast.BinOp(left=left, op=op, right=right):
            if type(op) not in BINARY:
                raise ExpressionError(f"{_quoted(text)} uses an operator other than + - * / **{_advice(text)}")
            return names_in(left, right)
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in FUNCTIONS:
            fewest, most = (2, 99) if name in ("min", "max") else (1, 1)
            if not fewest <= len(args) <= most:
                wanted = f"{fewest} to {most} arguments, {name}(a, b)" if most > 1 else "one argument"
                wanted += f"; of one number write {_source(args[0], text)} alone" if 0 < len(args) < fewest else ""
                raise ExpressionError(f"{_quoted(text)} calls {name} with {len(args)} arguments; accepted: {wanted}")
            return names_in(*args)
        case ast.Call():
            advised = call_advice(called := _source(node.func, text), [_source(a, text) for a in node.args])
            raise ExpressionError(f"{_quoted(text)} calls '{called}'{advised}; accepted: {' '.join(FUNCTIONS)}")
        case ast.Attribute():
            raise ExpressionError(f"{_quoted(text)} uses the attribute '{_source(node, text)}'; accepted: plain names")
        case _:
            found = f"contains '{_source(node, text)}'{_advice(text)}; accepted: {_LANGUAGE}"
            raise ExpressionError(f"{_quoted(text)} {found}")


def _is_number(node: ast.expr) -> bool:
    """Whether a side is a number and nothing else, but for its sign."""
    return isinstance(node.operand if isinstance(node, ast.UnaryOp) else node, ast.Constant)


def _source(node: ast.expr, text: str) -> str:
    """The part of an expression that a node was parsed from."""
    return ast.get_source_segment(text.strip(), node) or text


def _check_number(node: ast.Constant, text: str) -> None:
    try:
        number = float(node.value)  # type: ignore[arg-type]
    except OverflowError:
        number = math.inf
    if not math.isfinite(number) or (number == 0 and re.match(r"[0._]*[1-9]", _source(node, text))):
        message = f"contains {_source(node, text)[:_LEGIBLE]}, a number beyond double precision"
        raise ExpressionError(f"{_quoted(text)} {message}")


def _value(node: ast.expr, values: Mapping[str, Any], arithmetic: Arithmetic) -> Any:
    """Value of a checked tree; what is `DegreeTooHigh` knows the innermost part that is."""
    try:
        return _computed(node, values, arithmetic)
    except DegreeTooHigh as error:
        error.part = error.part or node
        raise


def _computed(node: ast.expr, values: Mapping[str, Any], arithmetic: Arithmetic) -> Any:
    number = arithmetic.number
    if arithmetic.constant and (text := arithmetics.constant_text(node)):
        return arithmetic.constant(text)
    match node:
        case ast.Constant(value=value):
            return arithmetic.literal(value, arithmetics.constant_text(node))
        case ast.Name(id=name):
            return arithmetic.pi() if name in CONSTANTS else values[name]
        case ast.UnaryOp(op=op, operand=operand):
            value = _value(operand, values, arithmetic)
            return -value if isinstance(op, ast.USub) else value
        case ast.BinOp(left=left, op=op, right=right):
            a, b = _value(left, values, arithmetic), _value(right, values, arithmetic)
            return arithmetic.operators[type(op)](number(a), number(b))
        case ast.Call(func=ast.Name(id=name), args=args):
            function = arithmetic.functions[name]
            operands = [number(_value(a, values, arithmetic)) for a in args]
            result = function(*operands[:2]) if len(operands) > 1 else function(operands[0])
            for operand in operands[2:]:
                result = function(result, operand)
            return result
    raise AssertionError(ast.dump(node))  # unreachable: the tree was checked when parsed
