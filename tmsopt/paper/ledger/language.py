"""The expressions of `claims.toml`: a small subset of Python. This module evaluates them; Python never executes them.

An expression has exact numbers (0.1 is 1/10), names, texts, ``+ - * / **``, comparisons, ``and or not``, lists, calls,
indices, fields such as ``ep4.Fr``, and ``[… for … in … if …]``. A name is looked up as a variable or definition of the
claim, then as a definition under ``[define]``, then as a word of `VOCABULARY`. Problem files have another parser,
because the ledger shares nothing with the code that it checks.
"""

import ast
import operator
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, partial
from importlib import resources
from typing import Any

import flint

from tmsopt.algebra.balls import rational
from tmsopt.paper.ledger.algebra import PRECISION, VOCABULARY, make_ring, match_factors

Scope = dict[str, Any]
"""Name → value, for the names that an expression may use."""

TomlTable = Mapping[str, Any]
"""A table of `claims.toml`."""

_OPERATORS: Mapping[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: lambda a, b: (rational(a) if isinstance(a, int) else a) / b,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.Not: operator.not_,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.And: all,
    ast.Or: any,
}


@cache
def read_tables() -> TomlTable:
    """The content of `claims.toml`."""
    return tomllib.loads(resources.files(__package__).joinpath("claims.toml").read_text(encoding="utf-8"))


@cache
def list_definitions() -> dict[str, tuple[list[str], TomlTable]]:
    """Name under ``[define]`` → its parameters and its table; a text becomes the ``value`` of a table."""
    definitions = {}
    for head, table in read_tables()["define"].items():
        name, *parameters = re.findall(r"\w+", head)
        definitions[name] = parameters, {"value": table} if isinstance(table, str) else table
    return definitions


def compute(text: str, scope: Scope) -> Any:
    """Value of an expression.

    Raises:
        SyntaxError: for text that is not an expression of this language.
    """
    return _evaluate(_parse(text).value, scope)


def are_true(texts: Iterable[str], scope: Scope) -> bool:
    """Whether all statements are certainly true; a value other than True counts as false."""
    return all(compute(text, scope) is True for text in texts)


def open_scope(table: TomlTable, scope: Scope) -> Scope:
    """Another scope with the variables and definitions of a table; the definitions of its setting come first."""
    tables = read_tables()["setting"].get(table.get("setting"), {}), table
    new_scope = scope | make_ring(" ".join(part.get("variables", "") for part in tables))
    for line in (line for part in tables for line in part.get("where", ())):
        assignment = _parse(line)
        new_scope |= _bind_names(assignment.targets[0], _evaluate(assignment.value, new_scope))
    return new_scope


@cache
def _parse(text: str) -> Any:
    return ast.parse(text).body[0]


def _look_up(name: str, scope: Scope) -> Any:
    if name in scope:
        return scope[name]
    if name not in list_definitions():
        return VOCABULARY[name]
    return partial(_apply, name) if list_definitions()[name][0] else _apply(name)


def _apply(name: str, *operands: Any) -> Any:
    """The result of a definition: a value, the truth of its statements, or a solved point."""
    parameters, table = list_definitions()[name]
    if "guess" in table:
        return _solve(name, *operands)
    new_scope = open_scope(table, dict(zip(parameters, operands, strict=True)))
    return compute(table["value"], new_scope) if "value" in table else are_true(table["holds"], new_scope)


@cache
def _solve(name: str, *operands: Any) -> dict[str, Any]:
    """Solve for a point: its known values, and the proved unknowns for which its polynomial has the given factors."""
    parameters, table = list_definitions()[name]
    scope = dict(zip(parameters, operands, strict=True))
    with flint.ctx.workdps(PRECISION):  # independent of the caller, because the result is cached
        known_values = {unknown: compute(text, scope) for unknown, text in table.get("known", {}).items()}
        guess = {unknown: float(compute(str(text), scope | known_values)) for unknown, text in table["guess"].items()}
        free = make_ring(" ".join([*guess, *known_values]))
        return known_values | match_factors(
            compute(table["polynomial"], free), compute(table["factors"], free), guess, known_values
        )


def _bind_names(target: Any, value: Any) -> Scope:
    """Names with their values, for an assignment to one or several names."""
    if hasattr(target, "elts"):
        return dict(zip((part.id for part in target.elts), value, strict=True))
    return {target.id: value}


def _evaluate_all(nodes: Iterable[ast.AST], scope: Scope) -> list[Any]:
    """Values of the elements of a list or a call, with starred elements unpacked."""
    values: list[Any] = []
    for node in nodes:
        values += _evaluate(node.value, scope) if isinstance(node, ast.Starred) else [_evaluate(node, scope)]
    return values


def _evaluate_loops(element: ast.expr, loops: Sequence[ast.comprehension], scope: Scope) -> list[Any]:
    scopes = [scope]
    for loop in loops:
        inner = [outer | _bind_names(loop.target, item) for outer in scopes for item in _evaluate(loop.iter, outer)]
        scopes = [scope for scope in inner if all(_evaluate(condition, scope) for condition in loop.ifs)]
    return [_evaluate(element, scope) for scope in scopes]


def _evaluate(node: ast.AST | None, scope: Scope) -> Any:  # noqa: PLR0911, PLR0912 - one case per kind of node
    match node:
        case None:
            return None
        case ast.Constant(value=value):
            return rational(repr(value)) if isinstance(value, float) else value
        case ast.Name(id=name):
            return _look_up(name, scope)
        case ast.Attribute(value=owner, attr=name):
            return _evaluate(owner, scope)[name]
        case ast.Subscript(value=owner, slice=index):
            return _evaluate(owner, scope)[_evaluate(index, scope)]
        case ast.Slice(lower=lower, upper=upper, step=None):
            return slice(_evaluate(lower, scope), _evaluate(upper, scope))
        case ast.List(elts=parts):
            return _evaluate_all(parts, scope)
        case ast.ListComp(elt=element, generators=loops):
            return _evaluate_loops(element, loops, scope)
        case ast.Call(func=function, args=parts, keywords=keyword_nodes):
            keywords = {str(keyword.arg): _evaluate(keyword.value, scope) for keyword in keyword_nodes}
            return _evaluate(function, scope)(*_evaluate_all(parts, scope), **keywords)
        case ast.BoolOp(op=sign, values=parts):
            return _OPERATORS[type(sign)](_evaluate(part, scope) for part in parts)
        case ast.UnaryOp(op=sign, operand=operand):
            return _OPERATORS[type(sign)](_evaluate(operand, scope))
        case ast.BinOp(left=left, op=sign, right=right):
            return _OPERATORS[type(sign)](_evaluate(left, scope), _evaluate(right, scope))
        case ast.Compare(left=left, ops=signs, comparators=operands):
            sides = _evaluate_all([left, *operands], scope)
            return all(_OPERATORS[type(sign)](*pair) for sign, *pair in zip(signs, sides, sides[1:], strict=False))
    raise SyntaxError(f"'{ast.unparse(node)}' is not an expression of the ledger")
