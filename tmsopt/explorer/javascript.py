"""Writes formulas as JavaScript: each operation becomes the text that computes it.

A result that is used once is written where it is used; other results get the names t0, t1, …. No name comes from the
user's file. Functions that have an array as last argument write their results to it.
"""

import json
import math
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial, reduce
from types import FunctionType, SimpleNamespace
from typing import Any

from tmsopt.algebra.formula import Formula, Kind, fold, formula, make_node, symbol, trace
from tmsopt.algebra.kinds import ROUNDING, as_double
from tmsopt.models.bicycles.bicycle import contact_path
from tmsopt.problem.evaluate import coefficient_formula, nodes_of
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import RADIUS, ROOT_QUANTITIES
from tmsopt.problem.real_form import real_form
from tmsopt.roots import lienard_chipart
from tmsopt.roots.numeric import GOOD_ERROR
from tmsopt.roots.quartics import factors, quartic, signs


@dataclass(frozen=True)
class Script:
    """A model as JavaScript.

    Attributes:
        text: ``const MODEL = {…};``
        quantities: names of the derived quantities, in the order in which ``MODEL.derived`` returns them.
        constraints: names of the constraints, whose margins follow the quantities in the result of ``MODEL.derived``.
    """

    text: str
    quantities: tuple[str, ...]
    constraints: tuple[str, ...]


def model_script(problem: Posed) -> Script:
    """The model of a problem: coefficients, derived quantities, margins of constraints, matrices, unit of time, motion.

    Constraints on the robustness radius are left out, because the radius needs a search. The parameters are those of
    `problem.parameter_set`, in its order, in SI units and radians.
    """
    model, parameter_set = problem.model, problem.parameter_set
    coefficients = coefficient_formula(real_form(problem).problem.model, parameter_set.name)
    degree = len(coefficients.outputs) - 1
    quantities = tuple(q.name for q in (*model.quantities, *parameter_set.quantities))
    limits = {n: c for n, c in problem.conditions.items() if RADIUS not in c.names}
    derived = [*nodes_of(problem, {n: n for n in quantities}).values()]
    for condition, node in zip(limits.values(), nodes_of(problem, limits).values(), strict=True):
        derived.append(node if condition.sign < 0 or condition.equality else -node)
    entries = {n: f"x[{k}]" for k, n in enumerate(parameter_set.names)}
    all_inputs = entries | {q.name: f"r[{k}]" for k, q in enumerate(ROOT_QUANTITIES)}
    pencil, size, order = _make_pencil(problem)
    rate = trace(lambda p: [math.nan if parameter_set.rate is None else parameter_set.rate(p)], parameter_set.names)
    ride = trace(partial(_compute_ride, problem), parameter_set.names) if is_bicycle(problem) else None
    parts = [
        f"degree: {degree}, size: {size}, order: {order}",
        function("coefficients", ("x", "a"), coefficients, entries),
        function("derived", ("x", "r", "y"), formula(derived), all_inputs),
        function("pencil", ("x", "m"), pencil, entries) if pencil else "pencil: null",
        function("rate", ("x",), rate, entries, fills=False),
        function("ride", ("x", "y"), ride, entries) if ride else "ride: null",
    ]
    text = ",\n".join(parts)
    return Script(f"const MODEL = {{\n{text}\n}};\n", quantities, tuple(limits))


def is_bicycle(problem: Posed) -> bool:
    """Whether the coordinates of a problem's model are lean and steer, with a steer axis to draw."""
    model = problem.model
    return model.pencil is not None and model.statement is None and "lambda_s" in problem.parameter_set.names


def function(
    name: str, arguments: Sequence[str], expression: Formula, inputs: Mapping[str, str], fills: bool = True
) -> str:
    """A JavaScript function, or a method, that computes a formula.

    Args:
        inputs: name of an input of the formula → JavaScript text for this input.
        fills: whether the function writes its results to its last argument, an array. Otherwise it returns its result.
    """
    results: list[str] = []

    def name_term(text: str) -> str:
        results.append(f"t{len(results)}={_strip_parentheses(text)}")
        return f"t{len(results) - 1}"

    operations = {op: partial(_write_operation, template, name_term) for op, template in _OPERATIONS.items()}
    kind = Kind(operations | {"pow": partial(_write_power, name_term)}, lambda x: _format_number(as_double(x)))
    texts = map(_strip_parentheses, fold(expression, inputs, kind, name_term))
    lines = [f"{arguments[-1]}[{k}]={t};" for k, t in enumerate(texts)] if fills else [f"return {next(texts)};"]
    if results:
        lines = [f"const {','.join(results)};", *lines]
    return "\n".join([f"{name}({', '.join(arguments)}) {{", *lines, "}"])


def _format_number(value: float) -> str:
    """The exact text of a double; JSON writes numbers, NaN and infinities like JavaScript."""
    text = json.dumps(float(value)).removesuffix(".0")
    return f"({text})" if text.startswith("-") else text


_POWERS = {"(-1)": "(1/{0})", "3": "({0}*{0}*{0})", "4": "({0}*{0}*({0}*{0}))"}
"""Exponent → text of the power, which is computed as tmsopt computes powers of doubles."""

_OPERATIONS: Mapping[str, str] = {
    "add": "({0}+{1})",
    "sub": "({0}-{1})",
    "mul": "({0}*{1})",
    "div": "({0}/{1})",
    "neg": "(-{0})",
    "square": "({0}*{0})",
    "less": "({0}<{1})",
    "at_most": "({0}<={1})",
    "equal": "({0}==={1})",
    "and": "({0}&&{1})",
    "or": "({0}||{1})",
    "not": "(!{0})",
    "choose": "({0}?{1}:{2})",
    "quotient_or_nan": "({1}===0?NaN:{0}/{1})",
    "quotient_or_zero": "({0}===0?0:{1}===0?NaN:{0}/{1})",
    "positive_part": "(({0}+Math.abs({0}))/2)",
    "negligible": f"(Math.abs({{0}})<={ROUNDING!r}*{{1}})",
    "min": "Math.min({0},{1})",  # NaN if an operand is NaN
    "max": "Math.max({0},{1})",
    **{name: f"Math.{name}({{0}})" for name in ("sqrt", "cbrt", "abs", "sign", "exp", "log")},
    **{name: f"Math.{name}({{0}})" for name in ("sin", "cos", "tan", "asin", "acos", "atan")},
}
"""Operation → its JavaScript text, with {0}, {1}, … for the operands. All texts but calls have parentheses."""

_MAX_INLINE_LENGTH = 160
"""Largest number of characters of a result that is written where it is used."""


def _make_pencil(problem: Posed) -> tuple[Formula | None, int, int]:
    """Entries of the matrices of a model, number of rows of a matrix, and order (number of matrices minus one)."""
    model, parameter_set = problem.model, problem.parameter_set
    if model.pencil is None or model.is_complex:
        return None, 0, 0
    matrices = model.pencil(parameter_set.native({n: symbol(n) for n in parameter_set.names}))
    return formula(e for matrix in matrices for row in matrix for e in row), len(matrices[0]), len(matrices) - 1


def _compute_ride(problem: Posed, p: Mapping[str, Any]) -> list[Any]:
    """Rates of lean and steer after a unit impulse of steer torque, M⁻¹ (0, 1), and five numbers of `contact_path`.

    Time is in the unit of the model; torque and lengths are in the units of the file.
    """
    model, parameter_set = problem.model, problem.parameter_set
    assert model.pencil is not None
    native = parameter_set.native(p)
    (a, b), (c, d) = model.feedback(native).mass if model.feedback else model.pencil(native)[0]
    rate, torque = parameter_set.rate, parameter_set.torque
    impulse = 1 if rate is None or torque is None else rate(p) / torque(p)
    length = p["w"] if "w" in p and "w" not in native else 1
    yaw, yaw_of_rate, speed, forward, lateral = contact_path(native)
    scale = impulse / (a * d - b * c)
    return [-b * scale, a * scale, yaw, yaw_of_rate, speed * length, forward * length, lateral * length]


def _write_operation(template: str, name_term: Callable[[str], str], *operands: str) -> str:
    """The text of an operation. Operands that occur twice in it, and a long result, get a name."""
    is_repeated = [template.count(f"{{{k}}}") > 1 and _is_result(text) for k, text in enumerate(operands)]
    text = template.format(
        *(name_term(text) if is_named else text for text, is_named in zip(operands, is_repeated, strict=True))
    )
    return name_term(text) if len(text) > _MAX_INLINE_LENGTH else text


def _write_power(name_term: Callable[[str], str], base: str, exponent: str) -> str:
    return _write_operation(_POWERS.get(exponent, "Math.pow({0},{1})"), name_term, base, exponent)


def _strip_parentheses(text: str) -> str:
    """A result without its outer parentheses, for use where no operation is around it."""
    return text[1:-1] if text.startswith("(") else text


def _is_result(text: str) -> bool:
    """Whether a text is an operation: not a name, an entry such as ``x[3]``, or a number."""
    return re.fullmatch(r"[\w.\[\]]+", text) is None


# The formulas for roots of polynomials are not written a second time in JavaScript. Instead, the Python functions are
# called with symbols, and their operations are recorded. The names `where` and `as_integer` in these functions then
# stand for operations on symbols. Formulas of quartics are from `tmsopt.roots.quartics`; the conditions of stability
# for lower degrees are from `lienard_chipart`.

_QUARTIC = 4


def kernel_script(degree: int) -> str:
    """JavaScript functions for polynomials of a degree. Several results go to an array, so that no memory is allocated.

    For s² + p s + q: ``factorAbscissa(p, q)``, ``factorDamping(p, q)``, and ``factorRoots(p, q, z)``, which writes real
    and imaginary parts. Up to degree 4: ``stableBySigns(a0, …)``. For quartics: ``quarticStart(a0, …, f)``, which
    writes b1 … b4, p1, q1, p2, q2 and the backward error; ``quarticStep(b1, …, q2, g)``, which writes better factors
    and their error; ``quarticClass(a0, …)``, which returns the class code + 8 × the number of real roots, or 64 if a
    sign is uncertain.
    """
    a = [f"a{k}" for k in range(degree + 1)]
    parts = [
        _trace_function("factorAbscissa", ["p", "q"], lambda p, q: [_FUNCTIONS.abscissa(p, q)]),
        _trace_function("factorDamping", ["p", "q"], lambda p, q: [_FUNCTIONS.damping_ratio(p, q)]),
        _trace_function("factorRoots", ["p", "q"], _FUNCTIONS.root_pair, "z"),
    ]
    if degree <= _QUARTIC:
        is_stable = _FUNCTIONS.is_stable_by_signs if degree == _QUARTIC else _is_stable
        parts.append(_trace_function("stableBySigns", a, lambda *c: [is_stable(*c)]))
    if degree == _QUARTIC:
        rules = f"good: {GOOD_ERROR}, accepted: {quartic.MAX_ERROR}, steps: {quartic.MAX_STEPS}"
        parts += [
            f"const QUARTIC = {{{rules}}};",
            _trace_function("quarticClass", a, _pack_classes),
            _trace_function("quarticStart", a, _start_roots, "f"),
            _trace_function("quarticStep", ["b1", "b2", "b3", "b4", "p1", "q1", "p2", "q2"], _step_roots, "g"),
        ]
    return "\n".join(parts) + "\n"


_where = partial(make_node, "choose")
_NAMESPACE: dict[str, Any] = {**vars(factors), **vars(signs)}
for _name, _value in [*_NAMESPACE.items()]:
    if isinstance(_value, FunctionType):
        # In this copy, the functions call one another in the new namespace.
        _NAMESPACE[_name] = FunctionType(_value.__code__, _NAMESPACE, _name)
_NAMESPACE |= {"where": _where, "as_integer": lambda condition: _where(condition, 1, 0)}
_FUNCTIONS = SimpleNamespace(**_NAMESPACE)


def _start_roots(*a: Any) -> Sequence[Any]:
    monic = _FUNCTIONS.monic(*a)
    quadratics = _FUNCTIONS.closed_form_factors(*monic)
    return [*monic, *quadratics, _FUNCTIONS.error(*monic, *quadratics)]


def _step_roots(*numbers: Any) -> list[Any]:
    quadratics = _FUNCTIONS.newton_step(*numbers)
    return [*quadratics, _FUNCTIONS.error(*numbers[:4], *quadratics)]


def _pack_classes(*a: Any) -> list[Any]:
    kind, count, doubtful = _FUNCTIONS.classes(*a)
    return [_where(doubtful, 64.0, kind + 8.0 * count)]


def _is_stable(*c: Any) -> Any:
    """Like `tmsopt.roots.is_stable` up to degree 4, by the signs of the rounded conditions."""
    up, down = c[0] > 0.0, c[0] < 0.0
    sign = _where(up, 1.0, -1.0)
    conditions = (condition > 0.0 for condition in lienard_chipart([sign * x for x in c]))
    return reduce(operator.and_, conditions, up | down)


def _trace_function(
    name: str, arguments: Sequence[str], compute: Callable[..., Sequence[Any]], output: str = ""
) -> str:
    traced = trace(lambda x: compute(*x.values()), arguments)
    all_arguments = [*arguments, output] if output else arguments
    return function(f"function {name}", all_arguments, traced, {n: n for n in arguments}, fills=bool(output))
