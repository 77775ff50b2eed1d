"""Formulas as JavaScript: every step of a CasADi function, or of a traced one, as the text that computes it.

Results that are used once stand where they are used, the others get names t0, t1, …; no name comes from a file.
"""

import math
from collections import Counter
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca

from tmsopt.algebra import NotAccepted, Program, operation_name, program
from tmsopt.models.bicycles.bicycle import contact_path
from tmsopt.problem import array_function
from tmsopt.problem.expression import Expression
from tmsopt.problem.problem import Problem
from tmsopt.problem.quantities import RADIUS, ROOT_QUANTITIES


class Spelling(NamedTuple):
    """How an operation is written.

    Attributes:
        template: with {0}, {1}, … for the operands.
        binding: how strongly the text binds, from 1 (a choice) to 9 (a name, a number, a call).
        operands: how strongly that of each operand must bind, else it stands in parentheses.
        truth: whether the result is true or false.
        truths: operands that are taken as true or false.
    """

    template: str
    binding: int = 9
    operands: tuple[int, ...] = (0, 0, 0)
    truth: bool = False
    truths: tuple[int, ...] = ()


class Step(NamedTuple):
    """One operation, and the numbers of the steps whose results it takes."""

    spelling: Spelling
    operands: tuple[int, ...] = ()


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


def model_script(problem: Problem) -> Script:
    """The model of a problem: coefficients, derived quantities, margins of constraints, matrices, rate, ride.

    Quantities and constraints that CasADi cannot write are left out, and those with the robustness radius, which takes
    a search. The parameters are those of `problem.parameter_set`, in its order, in SI units and radians.
    """
    model, of = problem.model, problem.parameter_set
    coefficients = array_function(problem, {n: n for n in model.coefficient_names()}).program
    wanted = {_QUANTITY + q.name: problem.read(q.name) for q in (*model.quantities, *of.quantities)}
    wanted |= {_CONSTRAINT + n: c for n, c in problem.conditions.items() if RADIUS not in c.names}
    derived, written = _derived(problem, wanted)
    quantities, constraints = (
        tuple(n.removeprefix(kind) for n in written if n.startswith(kind)) for kind in (_QUANTITY, _CONSTRAINT)
    )
    turned = {k for k, n in enumerate(written) if wanted[n].comparison == "<="}  # a margin is what is left of a limit
    entries = [f"x[{k}]" for k in range(len(of.names))]
    roots = [f"r[{k}]" for k in range(len(ROOT_QUANTITIES))]
    pencil, size, order = _pencil(problem)
    rate = _program(problem, lambda p: [math.nan if of.rate is None else of.rate(p)])
    ride = _program(problem, lambda p: _ride(problem, p)) if is_bicycle(problem) else None
    parts = [
        f"degree: {model.degree}, size: {size}, order: {order}",
        function("coefficients", ("x", "a"), *_steps(coefficients, entries)),
        function("derived", ("x", "r", "y"), *_steps(derived, [*entries, *roots], turned)),
        function("pencil", ("x", "m"), *_steps(pencil, entries)) if pencil else "pencil: null",
        function("rate", ("x",), *_steps(rate, entries), fills=False),
        function("ride", ("x", "y"), *_steps(ride, entries)) if ride else "ride: null",
    ]
    text = ",\n".join(parts)
    return Script(f"const MODEL = {{\n{text}\n}};\n", quantities, constraints)


def is_bicycle(problem: Problem) -> bool:
    """Whether the coordinates of a problem's model are lean and steer, with a steer axis to draw."""
    model = problem.model
    return model.pencil is not None and model.statement is None and "lambda_s" in problem.parameter_set.names


def function(
    name: str, arguments: Sequence[str], steps: Sequence[Step], results: Sequence[int], fills: bool = True
) -> str:
    """A JavaScript function, or a method, that fills the array that it takes last, or returns its one result."""
    lines, texts = _written(steps, results)
    ends = [f"{arguments[-1]}[{k}]={t};" for k, t in enumerate(texts)] if fills else [f"return {texts[0]};"]
    return "\n".join([f"{name}({', '.join(arguments)}) {{", *lines, *ends, "}"])


def number(value: float) -> Spelling:
    """A double, to the last bit."""
    if math.isnan(value) or math.isinf(value):
        text = "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
    else:
        text = repr(float(value)).removesuffix(".0")
    return Spelling(text, 8 if text.startswith("-") else 9)


def call(name: str, count: int = 1) -> Spelling:
    """A function of JavaScript's Math."""
    return Spelling(f"Math.{name}({', '.join(f'{{{k}}}' for k in range(count))})")


ADD, SUBTRACT = Spelling("{0}+{1}", 6, (6, 7)), Spelling("{0}-{1}", 6, (6, 7))
MULTIPLY, DIVIDE, NEGATE = Spelling("{0}*{1}", 7, (7, 8)), Spelling("{0}/{1}", 7, (7, 8)), Spelling("-{0}", 8, (9,))
LESS, AT_MOST = Spelling("{0}<{1}", 5, (6, 6), truth=True), Spelling("{0}<={1}", 5, (6, 6), truth=True)
EQUAL, UNEQUAL = Spelling("{0}==={1}", 4, (6, 6), truth=True), Spelling("{0}!=={1}", 4, (6, 6), truth=True)
SAME, DIFFERENT = EQUAL._replace(truths=(0, 1)), UNEQUAL._replace(truths=(0, 1))
AND, OR = Spelling("{0}&&{1}", 3, (3, 4), True, (0, 1)), Spelling("{0}||{1}", 2, (2, 3), True, (0, 1))
NOT, CHOOSE = Spelling("!{0}", 8, (9,), True, (0,)), Spelling("{0}?{1}:{2}", 1, (2, 1, 1), truths=(0,))

_POWERS = {
    -1.0: Spelling("1/{0}", 7, (8,)),
    0.5: call("sqrt"),
    1.0: Spelling("{0}", 1, (1,)),
    2.0: Spelling("{0}*{0}", 7, (8,)),
    3.0: Spelling("{0}*{0}*{0}", 7, (8,)),
    4.0: Spelling("{0}*{0}*({0}*{0})", 7, (8,)),
}
"""Small powers, as `tmsopt.algebra.arrays` has them."""

_OPERATIONS: Mapping[int, Spelling] = {
    ca.OP_ASSIGN: _POWERS[1.0],
    ca.OP_ADD: ADD,
    ca.OP_SUB: SUBTRACT,
    ca.OP_MUL: MULTIPLY,
    ca.OP_DIV: DIVIDE,
    ca.OP_NEG: NEGATE,
    ca.OP_SQ: _POWERS[2.0],
    ca.OP_TWICE: Spelling("2*{0}", 7, (8,)),
    ca.OP_INV: _POWERS[-1.0],
    ca.OP_LT: LESS,
    ca.OP_LE: AT_MOST,
    ca.OP_EQ: EQUAL,
    ca.OP_NE: UNEQUAL,
    ca.OP_NOT: NOT,
    ca.OP_AND: AND,
    ca.OP_OR: OR,
    ca.OP_IF_ELSE_ZERO: Spelling("{0}?{1}:0", 1, (2, 1), truths=(0,)),
    ca.OP_FMIN: call("min", 2),
    ca.OP_FMAX: call("max", 2),  # NaN where either is, as in `ARRAYS`
    ca.OP_FABS: call("abs"),
    ca.OP_POW: call("pow", 2),
    ca.OP_CONSTPOW: call("pow", 2),
    ca.OP_ATAN2: call("atan2", 2),
    ca.OP_HYPOT: call("hypot", 2),
    ca.OP_FMOD: Spelling("{0}%{1}", 7, (7, 8)),
    ca.OP_COPYSIGN: Spelling("Math.abs({0})*((1/{1}||{1})<0?-1:1)", 7, (0, 9)),
    **{
        getattr(ca, f"OP_{name.upper()}"): call(name)
        for name in (
            "sqrt",
            "sign",
            "floor",
            "ceil",
            "exp",
            "log",
            "log1p",
            "expm1",
            "sin",
            "cos",
            "tan",
            "asin",
            "acos",
            "atan",
            "sinh",
            "cosh",
            "tanh",
            "asinh",
            "acosh",
            "atanh",
        )
    },
}

_QUANTITY, _CONSTRAINT = "quantity ", "constraint "
"""Before the names of outputs, which users choose."""

_LONGEST = 160
"""Characters of a result that stands where it is used."""


def _derived(problem: Problem, wanted: Mapping[str, Expression]) -> tuple[Program, tuple[str, ...]]:
    """A program of all that CasADi can write, and its names: one that it cannot may keep others from being written."""
    found = array_function(problem, wanted)
    if found.others:
        found = array_function(problem, {n: e for n, e in wanted.items() if array_function(problem, {n: e}).written})
    return found.program, found.written


def _program(problem: Problem, formulas: Callable[[Mapping[str, Any]], Sequence[Any]]) -> Program:
    """A program of formulas in the parameters."""
    of = problem.parameter_set
    symbols = {n: ca.SX.sym(n) for n in of.names}
    column = ca.vertcat(*[ca.SX(e) for e in formulas(symbols)])
    return program(ca.Function("f", [ca.vertcat(*symbols.values())], [ca.densify(column)], {"cse": True}))


def _pencil(problem: Problem) -> tuple[Program | None, int, int]:
    """Entries of the matrices of a model, rows of each, and how many there are less one."""
    model, of = problem.model, problem.parameter_set
    if model.pencil is None or model.carrier is not None:  # whose carrier is no motion of the user's
        return None, 0, 0
    shape: tuple[int, int] = (0, 0)

    def entries(symbols: Mapping[str, Any]) -> list[Any]:
        nonlocal shape
        assert model.pencil is not None
        matrices = model.pencil(of.native(symbols))
        shape = len(matrices[0]), len(matrices) - 1
        return [e for matrix in matrices for row in matrix for e in row]

    return _program(problem, entries), *shape


def _ride(problem: Problem, p: Mapping[str, Any]) -> list[Any]:
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


def _steps(taken: Program, entries: Sequence[str], turned: Container[int] = ()) -> tuple[list[Step], list[int]]:
    """The steps of a program with the texts of its inputs, and where its results are, some of them times −1."""
    steps: list[Step] = []
    outputs: dict[int, int] = {}
    for k, instruction in enumerate(taken.steps):
        operands = instruction.operands
        match instruction.operation:
            case ca.OP_INPUT:
                spelling = Spelling(entries[instruction.place[1]])
            case ca.OP_CONST:
                spelling = number(instruction.constant)
            case ca.OP_OUTPUT:
                n, spelling = instruction.place[1], NEGATE
                outputs[n] = k if n in turned else operands[0]
            case ca.OP_POW | ca.OP_CONSTPOW if (small := _small_power(taken, operands[1])) is not None:
                spelling, operands = small, operands[:1]
            case operation if operation in _OPERATIONS:
                spelling = _OPERATIONS[operation]
            case operation:
                raise NotAccepted(operation_name(operation))
        steps.append(Step(spelling, operands))
    return steps, [outputs[n] for n in sorted(outputs)]


def _small_power(taken: Program, exponent: int) -> Spelling | None:
    step = taken.steps[exponent]
    return _POWERS.get(step.constant) if step.operation == ca.OP_CONST else None


def _written(steps: Sequence[Step], results: Sequence[int]) -> tuple[list[str], list[str]]:
    """Lines that name what is shared, and the text of each result."""
    uses = Counter(results)
    for k in range(len(steps) - 1, -1, -1):
        if uses[k]:
            for place, operand in enumerate(steps[k].operands):
                uses[operand] += steps[k].spelling.template.count(f"{{{place}}}")
    lines: list[str] = []
    found: dict[int, Spelling] = {}
    for k, step in enumerate(steps):
        if not uses[k]:
            continue
        spelling = step.spelling
        texts = [_operand(spelling, place, found[o]) for place, o in enumerate(step.operands)]
        text = spelling.template.format(*texts)
        if step.operands and ((uses[k] > 1 and spelling.template != "{0}") or len(text) > _LONGEST):
            lines.append(f"const t{len(lines)}={text};")
            found[k] = Spelling(f"t{len(lines) - 1}", truth=spelling.truth)
        else:
            found[k] = Spelling(text, spelling.binding, truth=spelling.truth)
    return lines, [_as_number(found[k]).template for k in results]


def _operand(spelling: Spelling, place: int, given: Spelling) -> str:
    """The text of an operand, in parentheses where it binds less than it must."""
    taken = _as_truth(given) if place in spelling.truths else _as_number(given)
    minus_minus = spelling is SUBTRACT and place == 1 and taken.template.startswith("-")
    return f"({taken.template})" if taken.binding < spelling.operands[place] or minus_minus else taken.template


def _as_truth(given: Spelling) -> Spelling:
    text = given.template if given.binding > UNEQUAL.binding else f"({given.template})"
    return given if given.truth else Spelling(f"{text}!==0", UNEQUAL.binding, truth=True)


def _as_number(given: Spelling) -> Spelling:
    return Spelling(f"{given.template}?1:0", 1) if given.truth else given
