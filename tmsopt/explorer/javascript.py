"""Formulas as JavaScript: every operation as the text that computes it.

Results that are used once stand where they are used, the others get names t0, t1, …; no name comes from a file.
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
from tmsopt.roots import lienard_chipart
from tmsopt.roots.numeric import GOOD
from tmsopt.roots.quartics import factors, quartic, signs


@dataclass(frozen=True)
class Script:
    """A model as JavaScript.

    Attributes:
        text: ``const MODEL = {…};``
        quantities: names of the derived quantities, in the order of what ``MODEL.derived`` fills in.
        constraints: names of the constraints, which follow them there.
    """

    text: str
    quantities: tuple[str, ...]
    constraints: tuple[str, ...]


def model_script(problem: Posed) -> Script:
    """The model of a problem: coefficients, derived quantities, margins of constraints, matrices, rate, ride.

    Constraints with the robustness radius are left out, which takes a search. The parameters are those of
    `problem.parameter_set`, in its order, in SI units and radians.
    """
    model, of = problem.model, problem.parameter_set
    coefficients = coefficient_formula(model, of.name)
    quantities = tuple(q.name for q in (*model.quantities, *of.quantities))
    limits = {n: c for n, c in problem.conditions.items() if RADIUS not in c.names}
    derived = [*nodes_of(problem, {n: n for n in quantities}).values()]
    for condition, node in zip(limits.values(), nodes_of(problem, limits).values(), strict=True):
        derived.append(node if condition.sign < 0 or condition.equality else -node)
    entries = {n: f"x[{k}]" for k, n in enumerate(of.names)}
    every = entries | {q.name: f"r[{k}]" for k, q in enumerate(ROOT_QUANTITIES)}
    pencil, size, order = _pencil(problem)
    rate = trace(lambda p: [math.nan if of.rate is None else of.rate(p)], of.names)
    ride = trace(partial(_ride, problem), of.names) if is_bicycle(problem) else None
    parts = [
        f"degree: {model.degree}, size: {size}, order: {order}",
        function("coefficients", ("x", "a"), coefficients, entries),
        function("derived", ("x", "r", "y"), formula(derived), every),
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


def function(name: str, arguments: Sequence[str], asked: Formula, inputs: Mapping[str, str], fills: bool = True) -> str:
    """A JavaScript function, or a method, that fills the array that it takes last, or returns its one result.

    Args:
        inputs: name of an input → its text.
    """
    results: list[str] = []

    def name_term(text: str) -> str:
        results.append(f"t{len(results)}={_bare(text)}")
        return f"t{len(results) - 1}"

    operations = {op: partial(_write_operation, template, name_term) for op, template in _OPERATIONS.items()}
    kind = Kind(operations | {"pow": partial(_power, name_term)}, lambda x: _number(as_double(x)))
    texts = map(_bare, fold(asked, inputs, kind, name_term))
    ends = [f"{arguments[-1]}[{k}]={t};" for k, t in enumerate(texts)] if fills else [f"return {next(texts)};"]
    if results:
        ends = [f"const {','.join(results)};", *ends]
    return "\n".join([f"{name}({', '.join(arguments)}) {{", *ends, "}"])


def _number(value: float) -> str:
    """A double, to the last bit; JSON writes it as JavaScript does, NaN and infinities too."""
    text = json.dumps(float(value)).removesuffix(".0")
    return f"({text})" if text.startswith("-") else text


_POWERS = {"(-1)": "(1/{0})", "3": "({0}*{0}*{0})", "4": "({0}*{0}*({0}*{0}))"}
"""Small powers, as floats have them."""

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
    "both": "({0}&&{1})",
    "either": "({0}||{1})",
    "not": "(!{0})",
    "choose": "({0}?{1}:{2})",
    "quotient": "({1}===0?NaN:{0}/{1})",
    "ratio": "({0}===0?0:{1}===0?NaN:{0}/{1})",
    "positive_part": "(({0}+Math.abs({0}))/2)",
    "negligible": f"(Math.abs({{0}})<={ROUNDING!r}*{{1}})",
    "min": "Math.min({0},{1})",  # NaN where either is
    "max": "Math.max({0},{1})",
    **{name: f"Math.{name}({{0}})" for name in ("sqrt", "cbrt", "abs", "sign", "exp", "log")},
    **{name: f"Math.{name}({{0}})" for name in ("sin", "cos", "tan", "asin", "acos", "atan")},
}
"""Operations with {0}, {1}, … for their operands; what is not a call stands in parentheses."""

_LONGEST = 160
"""Characters of a result that stands where it is used."""


def _pencil(problem: Posed) -> tuple[Formula | None, int, int]:
    """Entries of the matrices of a model, rows of each, and how many there are less one."""
    model, of = problem.model, problem.parameter_set
    if model.pencil is None or model.carrier is not None:  # whose carrier is no motion of the user's
        return None, 0, 0
    matrices = model.pencil(of.native({n: symbol(n) for n in of.names}))
    return formula(e for matrix in matrices for row in matrix for e in row), len(matrices[0]), len(matrices) - 1


def _ride(problem: Posed, p: Mapping[str, Any]) -> list[Any]:
    """Rates of lean and steer after an impulse of steer torque of 1, M⁻¹ (0, 1), and the path of the contacts.

    In the model's own unit of time; torque and lengths are those of the file.
    """
    model, of = problem.model, problem.parameter_set
    assert model.pencil is not None
    native = of.native(p)
    (a, b), (c, d) = model.feedback(native).mass if model.feedback else model.pencil(native)[0]
    impulse = 1 if of.rate is None or of.torque is None else of.rate(p) / of.torque(p)
    length = p["w"] if "w" in p and "w" not in native else 1
    yaw, yaw_of_rate, speed, ahead, aside = contact_path(native)
    scale = impulse / (a * d - b * c)
    return [-b * scale, a * scale, yaw, yaw_of_rate, speed * length, ahead * length, aside * length]


def _write_operation(template: str, name_term: Callable[[str], str], *given: str) -> str:
    """The text of an operation; operands that it takes twice, and what is long, are named."""
    often = [template.count(f"{{{k}}}") > 1 and _is_result(text) for k, text in enumerate(given)]
    text = template.format(*(name_term(text) if twice else text for text, twice in zip(given, often, strict=True)))
    return name_term(text) if len(text) > _LONGEST else text


def _power(name_term: Callable[[str], str], base: str, exponent: str) -> str:
    return _write_operation(_POWERS.get(exponent, "Math.pow({0},{1})"), name_term, base, exponent)


def _bare(text: str) -> str:
    """A result where nothing stands around it: without its parentheses."""
    return text[1:-1] if text.startswith("(") else text


def _is_result(text: str) -> bool:
    """Whether a text is neither a name, nor an entry such as ``x[3]``, nor a number."""
    return re.fullmatch(r"[\w.\[\]]+", text) is None


# The elementwise formulas of polynomials: traced, because they have no second home. The names `where` and `one` mean
# something else in these functions. Those of quartics are taken from `tmsopt.roots.quartics`; the conditions of
# stability of the lower degrees from `lienard_chipart`.

_QUARTIC = 4


def kernel_script(degree: int) -> str:
    """JavaScript functions for polynomials of a degree; arrays are filled, so that nothing is allocated.

    ``factorAbscissa(p, q)``, ``factorDamping(p, q)`` and ``factorRoots(p, q, z)``, real and imaginary parts, of
    s² + p s + q. Up to degree 4 ``stableBySigns(a0, …)``. Of quartics ``quarticStart(a0, …, f)``, which fills in
    b1 … b4, p1, q1, p2, q2 and the backward error; ``quarticStep(b1, …, q2, g)``, new factors and their error;
    ``quarticClass(a0, …)``, the code + 8 × the number of real roots, 64 where a sign is in doubt.
    """
    a = [f"a{k}" for k in range(degree + 1)]
    parts = [
        _trace_function("factorAbscissa", ["p", "q"], lambda p, q: [_OF.abscissa(p, q)]),
        _trace_function("factorDamping", ["p", "q"], lambda p, q: [_OF.damping_ratio(p, q)]),
        _trace_function("factorRoots", ["p", "q"], _OF.root_pair, "z"),
    ]
    if degree <= _QUARTIC:
        is_stable = _OF.stable if degree == _QUARTIC else _is_stable
        parts.append(_trace_function("stableBySigns", a, lambda *c: [is_stable(*c)]))
    if degree == _QUARTIC:
        rules = f"good: {GOOD}, accepted: {quartic.ACCEPTED}, steps: {quartic.STEPS}"
        parts += [
            f"const QUARTIC = {{{rules}}};",
            _trace_function("quarticClass", a, _pack_classes),
            _trace_function("quarticStart", a, _start_roots, "f"),
            _trace_function("quarticStep", ["b1", "b2", "b3", "b4", "p1", "q1", "p2", "q2"], _step_roots, "g"),
        ]
    return "\n".join(parts) + "\n"


_where = partial(make_node, "choose")
_KNOWN: dict[str, Any] = {**vars(factors), **vars(signs)}
for _name, _each in [*_KNOWN.items()]:
    if isinstance(_each, FunctionType):
        _KNOWN[_name] = FunctionType(_each.__code__, _KNOWN, _name)  # so that each calls the others here
_KNOWN |= {"where": _where, "one": lambda condition: _where(condition, 1, 0)}
_OF = SimpleNamespace(**_KNOWN)


def _start_roots(*a: Any) -> Sequence[Any]:
    monic = _OF.monic(*a)
    found = _OF.start(*monic)
    return [*monic, *found, _OF.error(*monic, *found)]


def _step_roots(*given: Any) -> list[Any]:
    found = _OF.newton(*given)
    return [*found, _OF.error(*given[:4], *found)]


def _pack_classes(*a: Any) -> list[Any]:
    kind, count, doubtful = _OF.classes(*a)
    return [_where(doubtful, 64.0, kind + 8.0 * count)]


def _is_stable(*c: Any) -> Any:
    """As `tmsopt.roots.is_stable` up to degree 4: the signs of the rounded conditions."""
    up, down = c[0] > 0.0, c[0] < 0.0
    sign = _where(up, 1.0, -1.0)
    conditions = (condition > 0.0 for condition in lienard_chipart([sign * x for x in c]))
    return reduce(operator.and_, conditions, up | down)


def _trace_function(name: str, arguments: Sequence[str], compute: Callable[..., Sequence[Any]], into: str = "") -> str:
    traced = trace(lambda x: compute(*x.values()), arguments)
    taken = [*arguments, into] if into else arguments
    return function(f"function {name}", taken, traced, {n: n for n in arguments}, fills=bool(into))
