"""Formulas as JavaScript: every operation as the text that computes it.

Results that are used once stand where they are used, the others get names t0, t1, …; no name comes from a file.
"""

import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

from tmsopt.algebra.formula import Formula, Kind, fold, formula, symbol, trace
from tmsopt.algebra.kinds import ROUNDING, as_double
from tmsopt.models.bicycles.bicycle import contact_path
from tmsopt.problem.evaluate import coefficient_formula, nodes_of
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import RADIUS, ROOT_QUANTITIES


class Text(NamedTuple):
    """A number or a truth as JavaScript.

    Attributes:
        binding: how strongly the text binds, from 1 (a choice) to 9 (a name, a number, a call).
    """

    text: str
    binding: int = 9


class Spelling(NamedTuple):
    """How an operation is written.

    Attributes:
        template: with {0}, {1}, … for the operands.
        binding: see `Text`.
        operands: how strongly that of each operand must bind, else it stands in parentheses.
    """

    template: str
    binding: int = 9
    operands: tuple[int, ...] = (0, 0, 0)


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
    derived = [*nodes_of(problem, dict(zip(quantities, quantities, strict=True))).values()]
    margins = zip(limits.values(), nodes_of(problem, limits).values(), strict=True)
    derived += [x if c.sign < 0 or c.equality else -x for c, x in margins]
    entries = {n: f"x[{k}]" for k, n in enumerate(of.names)}
    every = entries | {n: f"r[{k}]" for k, n in enumerate(q.name for q in ROOT_QUANTITIES)}
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
    lines: list[str] = []

    def named(given: Text) -> Text:
        lines.append(f"const t{len(lines)}={given.text};")
        return Text(f"t{len(lines) - 1}")

    operations = {op: partial(_spelled, spelling, named) for op, spelling in _OPERATIONS.items()}
    kind = Kind(operations | {"pow": partial(_power, named)}, lambda x: _number(as_double(x)), Text)
    texts = [x.text for x in fold(asked, inputs, kind, named)]
    ends = [f"{arguments[-1]}[{k}]={t};" for k, t in enumerate(texts)] if fills else [f"return {texts[0]};"]
    return "\n".join([f"{name}({', '.join(arguments)}) {{", *lines, *ends, "}"])


def _number(value: float) -> Text:
    """A double, to the last bit; JSON writes it as JavaScript does, NaN and infinities too."""
    text = json.dumps(float(value)).removesuffix(".0")
    return Text(text, 8 if text.startswith("-") else 9)


def _call(name: str, count: int = 1) -> Spelling:
    """A function of JavaScript's Math."""
    return Spelling(f"Math.{name}({', '.join(f'{{{k}}}' for k in range(count))})")


_POWERS = {
    "-1": Spelling("1/{0}", 7, (8,)),
    "3": Spelling("{0}*{0}*{0}", 7, (8,)),
    "4": Spelling("{0}*{0}*({0}*{0})", 7, (8,)),
}
"""Small powers, as floats have them."""

_QUOTIENT = "{1}===0?NaN:{0}/{1}"

_OPERATIONS: Mapping[str, Spelling] = {
    "add": Spelling("{0}+{1}", 6, (6, 7)),
    "sub": Spelling("{0}-{1}", 6, (6, 7)),
    "mul": Spelling("{0}*{1}", 7, (7, 8)),
    "div": Spelling("{0}/{1}", 7, (7, 8)),
    "neg": Spelling("-{0}", 8, (9,)),
    "square": Spelling("{0}*{0}", 7, (8,)),
    "less": Spelling("{0}<{1}", 5, (6, 6)),
    "at_most": Spelling("{0}<={1}", 5, (6, 6)),
    "equal": Spelling("{0}==={1}", 4, (6, 6)),
    "both": Spelling("{0}&&{1}", 3, (3, 4)),
    "either": Spelling("{0}||{1}", 2, (2, 3)),
    "not": Spelling("!{0}", 8, (9,)),
    "choose": Spelling("{0}?{1}:{2}", 1, (2, 1, 1)),
    "quotient": Spelling(_QUOTIENT, 1, (7, 8)),
    "ratio": Spelling(f"{{0}}===0?0:{_QUOTIENT}", 1, (7, 8)),
    "positive_part": Spelling("({0}+Math.abs({0}))/2", 7, (6,)),
    "negligible": Spelling(f"Math.abs({{0}})<={ROUNDING!r}*{{1}}", 5, (0, 8)),
    "min": _call("min", 2),  # NaN where either is
    "max": _call("max", 2),
    **{name: _call(name) for name in ("sqrt", "cbrt", "abs", "sign", "exp", "log")},
    **{name: _call(name) for name in ("sin", "cos", "tan", "asin", "acos", "atan")},
}

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


def _spelled(spelling: Spelling, named: Callable[[Text], Text], *given: Text) -> Text:
    """The text of an operation; operands that it takes twice, and what is long, are named."""
    twice = [spelling.template.count(f"{{{k}}}") > 1 and _is_result(x.text) for k, x in enumerate(given)]
    operands = [named(x) if often else x for x, often in zip(given, twice, strict=True)]
    text = spelling.template.format(*(_operand(spelling, k, x) for k, x in enumerate(operands)))
    found = Text(text, spelling.binding)
    return named(found) if len(text) > _LONGEST else found


def _power(named: Callable[[Text], Text], base: Text, exponent: Text) -> Text:
    small = _POWERS.get(exponent.text)
    return _spelled(small, named, base) if small else _spelled(_call("pow", 2), named, base, exponent)


def _is_result(text: str) -> bool:
    """Whether a text is neither a name, nor an entry such as ``x[3]``, nor a number."""
    return re.fullmatch(r"[\w.\[\]]+", text) is None


def _operand(spelling: Spelling, place: int, given: Text) -> str:
    """The text of an operand, in parentheses where it binds less than it must."""
    minus_minus = spelling.template == "{0}-{1}" and place == 1 and given.text.startswith("-")
    return f"({given.text})" if given.binding < spelling.operands[place] or minus_minus else given.text
