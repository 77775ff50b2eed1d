"""Formulas as graphs with exact constants, and the function `fold`, which evaluates them in numbers of any kind.

A formula comes from a Python function on nodes (`trace`), from text (`tmsopt.models.expression`) or from a CasADi
function (`from_casadi`). A kind of number defines the operations; see `kinds`.
"""

import math
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache
from itertools import accumulate, chain
from typing import Any, NamedTuple, Union

import casadi as ca

INPUT, CONSTANT = "input", "constant"

Constant = Union[Fraction, float, "Formula"]
"""A fraction; a formula without inputs for an irrational number, as √2 or π; a float for nan and infinities only."""

_MAX_EXPONENT = 64  # a power of fractions with a larger exponent is not computed
_MAX_BITS = 2**12  # a power of fractions with more bits is not computed


class UnsupportedOperation(ValueError):
    """A kind of number lacks an operation; the message names the operation."""


class Step(NamedTuple):
    """One operation of a formula.

    Attributes:
        op: ``input``, ``constant``, or the name of an operation such as ``add``.
        operands: indices of the steps whose results the operation takes.
        value: the name of an input, or the constant.
    """

    op: str
    operands: tuple[int, ...] = ()
    value: Any = None


@dataclass(frozen=True, eq=True)
class Formula:
    """Outputs as functions of inputs, for numbers of any kind.

    Attributes:
        names: names of all inputs, even if no step uses them.
        steps: the inputs, constants and operations, each once; a step uses only results of earlier steps.
        outputs: indices of the steps whose results are the outputs.
    """

    names: tuple[str, ...]
    steps: tuple[Step, ...]
    outputs: tuple[int, ...]

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        return hash((self.names, self.steps, self.outputs))

    def extract(self, outputs: Sequence[int], inputs: Collection[int] = ()) -> "Formula":
        """The formula of some steps. The steps in `inputs` become inputs, and their indices become the names."""
        used_steps = set(outputs)
        for k in range(len(self.steps) - 1, -1, -1):
            if k in used_steps and k not in inputs:
                used_steps.update(self.steps[k].operands)
        new_index = {k: number for number, k in enumerate(sorted(used_steps))}
        steps = [
            Step(INPUT, (), str(k))
            if k in inputs
            else self.steps[k]._replace(operands=tuple(map(new_index.__getitem__, self.steps[k].operands)))
            for k in new_index
        ]
        return Formula(self.names, tuple(steps), tuple(map(new_index.__getitem__, outputs)))

    def split(self, late_steps: Collection[int]) -> tuple[tuple[str, ...], "Formula", "Formula"]:
        """Split the formula into late steps and all other steps, which are early.

        Constants stay with the late steps that use them: an exponent must stay a number, which has no derivative.

        Returns:
            Names of the early results that late steps and outputs use, the formula of these results, and the formula of
            the outputs with the early results as inputs.
        """
        operands = {o for k in late_steps for o in self.steps[k].operands if self.steps[o].op != CONSTANT}
        sources = sorted(k for k in operands | set(self.outputs) if k not in late_steps)
        return tuple(map(str, sources)), self.extract(sources), self.extract(self.outputs, sources)

    def dependent_steps(self, names: Collection[str]) -> set[int]:
        """Indices of the steps that depend on any of the named inputs."""
        dependent: set[int] = set()
        for k, step in enumerate(self.steps):
            if step.value in names if step.op == INPUT else not dependent.isdisjoint(step.operands):
                dependent.add(k)
        return dependent

    @cached_property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs that the steps use."""
        return tuple([step.value for step in self.steps if step.op == INPUT])

    @property
    def constants(self) -> list[Constant]:
        """The constants, each once."""
        return [step.value for step in self.steps if step.op == CONSTANT]

    @cached_property
    def last_used(self) -> tuple[tuple[int, ...], ...]:
        """For each step, the operands that no later step uses and that are not outputs."""
        last_step = {o: k for k, step in enumerate(self.steps) for o in step.operands}
        last_used: list[list[int]] = [[] for _ in self.steps]
        for o, k in last_step.items():
            if o not in self.outputs:
                last_used[k].append(o)
        return tuple(map(tuple, last_used))

    @cached_property
    def use_counts(self) -> tuple[int, ...]:
        """For each step, how often other steps use its result."""
        counts = Counter(chain.from_iterable([step.operands for step in self.steps]))
        return tuple(map(counts.__getitem__, range(len(self.steps))))


@dataclass(frozen=True)
class Kind:
    """A kind of number.

    Attributes:
        operations: name of an operation → function of its operands.
        constant: converts a constant.
        number: converts an input.
    """

    operations: Mapping[str, Callable[..., Any]]
    constant: Callable[[Constant], Any]
    number: Callable[[Any], Any] = lambda x: x


def fold(
    formula: Formula, values: Mapping[str, Any], kind: Kind, share: Callable[[Any], Any] | None = None
) -> list[Any]:
    """Evaluate a formula in numbers of one kind.

    Args:
        values: name of an input → number.
        share: function that replaces every result of an operation that is used more than once.

    Raises:
        UnsupportedOperation: if the kind does not have an operation of the formula.
    """
    operations, results = kind.operations, list[Any]()
    steps = zip(formula.steps, formula.last_used, formula.use_counts, strict=True)
    for (op, operands, value), last_used, use_count in steps:
        if op == INPUT:
            result = kind.number(values[value])
        elif op == CONSTANT:
            result = kind.constant(value)
        elif (operation := operations.get(op)) is None:
            raise UnsupportedOperation(op)
        else:
            if len(operands) == 2:  # the most frequent case; this is faster than the general code
                result = operation(results[operands[0]], results[operands[1]])
            else:
                result = operation(*map(results.__getitem__, operands))
            if share and use_count > 1:
                result = share(result)
        results.append(result)
        for o in last_used:
            results[o] = None  # frees arrays early, so that the other arrays stay in the cache
    return [results[o] for o in formula.outputs]


_TOTAL_OPERATIONS = {INPUT, CONSTANT, "add", "sub", "mul", "neg", "square"}
_TOTAL_OPERATIONS |= {"abs", "min", "max", "sin", "cos", "atan", "exp"}
"""Operations that have a value for all numbers."""


def _operators(op: str) -> tuple[Callable[["Node", Any], "Node"], Callable[["Node", Any], "Node"]]:
    """Two methods of `Node`: the operation with the node as the first operand, and with the node as the second one."""
    return lambda self, other: make_node(op, self, other), lambda self, other: make_node(op, other, self)


class Node:
    """An input, a constant, or an operation on other nodes, built by ordinary arithmetic.

    A node is simplified if the simplification holds for every number: 0 + x becomes x, fractions are computed, and 0 x
    becomes 0 if x always has a value. A factor 0.0 stays, since 0.0 times infinity is nan.

    Attributes:
        is_fixed: whether the node depends on no input.
        is_total: whether the node has a value wherever all inputs have one.
    """

    __slots__ = ("is_fixed", "is_total", "op", "operands", "value")

    def __init__(self, op: str, operands: tuple["Node", ...] = (), value: Any = None) -> None:
        self.op, self.operands, self.value = op, operands, value
        self.is_fixed: bool = op != INPUT
        self.is_total: bool = op in _TOTAL_OPERATIONS
        for o in operands:
            self.is_fixed, self.is_total = self.is_fixed and o.is_fixed, self.is_total and o.is_total

    def __bool__(self) -> bool:
        raise TypeError("a formula cannot branch on the value of a number; write choose(condition, a, b)")

    __add__, __radd__ = _operators("add")
    __sub__, __rsub__ = _operators("sub")
    __mul__, __rmul__ = _operators("mul")
    __truediv__, __rtruediv__ = _operators("div")
    __pow__, __rpow__ = _operators("pow")
    __lt__, __gt__ = _operators("less")
    __le__, __ge__ = _operators("at_most")
    __and__, __rand__ = _operators("and")
    __or__, __ror__ = _operators("or")
    __eq__ = _operators("equal")[0]  # type: ignore[assignment]

    def __ne__(self, other: object) -> "Node":  # type: ignore[override]
        return ~make_node("equal", self, other)

    def __neg__(self) -> "Node":
        return make_node("neg", self)

    def __abs__(self) -> "Node":
        return make_node("abs", self)

    def __invert__(self) -> "Node":
        return make_node("not", self)

    __hash__ = object.__hash__

    def __array_ufunc__(self, function: Any, method: str, *operands: Any) -> "Node":
        return _make_by_alias(function.__name__, *operands)

    @property
    def fraction(self) -> Fraction | None:
        """The value of a constant fraction, else None."""
        return self.value if self.op == CONSTANT and isinstance(self.value, Fraction) else None


def depends_on(x: Any, names: Collection[str]) -> bool:
    """Whether a node depends on any of the named inputs."""
    return bool(formula([x]).dependent_steps(names))


def symbol(name: str) -> Node:
    """An input."""
    return Node(INPUT, (), name)


PI = Node("pi")


def constant(x: Any) -> Node:
    """A number as a node. A float means its shortest decimal."""
    if isinstance(x, Node):
        return x
    if isinstance(x, float):
        return _fraction(Fraction(str(x))) if math.isfinite(x) else Node(CONSTANT, (), float(x))
    return _fraction(Fraction(x) if isinstance(x, int | Fraction) else Fraction(int(x.p), int(x.q)))


@lru_cache(maxsize=4096)
def _fraction(value: Fraction) -> Node:
    """A constant; the equal entries of a large matrix are one node, which is faster."""
    return Node(CONSTANT, (), value)


def make_node(op: str, *arguments: Any) -> Node:
    """An operation on nodes and numbers, in its simplest form."""
    operands, fractions, conditions = tuple[Node, ...](), list[Fraction | None](), _CONDITION_OPERANDS.get(op, 0)
    for k, x in enumerate(arguments):
        o = x if isinstance(x, Node) else constant(x)
        if conditions or o.op in _CONDITIONS:
            o = _as_condition(o) if k < conditions else _as_number(o)
        is_fraction = o.op == CONSTANT and isinstance(o.value, Fraction) and not (isinstance(x, float) and x == 0)
        operands += (o,)
        fractions.append(o.value if is_fraction else None)
    compute_fraction = _FRACTION_OPERATIONS.get(op) if None not in fractions else None
    if compute_fraction and (number := compute_fraction(*fractions)) is not None:
        return _fraction(number)
    simplified = _simplify(op, operands, fractions) if op in _SIMPLIFIABLE else None
    return Node(op, operands) if simplified is None else simplified


_CONDITIONS = {"less", "at_most", "equal", "negligible", "and", "or", "not"}
_CONDITION_OPERANDS = {"choose": 1, "and": 2, "or": 2, "not": 1}
"""Operation → how many operands, from the first on, are conditions; all other operands are numbers."""


def _as_condition(x: Node) -> Node:
    return x if x.op in _CONDITIONS else ~(x == 0)


def _as_number(x: Node) -> Node:
    """1 for a true condition, 0 for a false one, as CasADi's derivatives expect."""
    return make_node("choose", x, 1, 0) if x.op in _CONDITIONS else x


def _power(a: Fraction, b: Fraction) -> Fraction | None:
    is_computed = b.denominator == 1 and abs(b) <= _MAX_EXPONENT and (a != 0 or b > 0)
    bits = max(a.numerator.bit_length(), a.denominator.bit_length())
    return a ** int(b) if is_computed and bits * abs(b) <= _MAX_BITS else None


_FRACTION_OPERATIONS: Mapping[str, Callable[..., Fraction | None]] = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b if b else None,
    "neg": lambda a: -a,
    "square": lambda a: a * a,
    "abs": abs,
    "pow": _power,
}
"""Operation → its function of fractions, which returns None if the result is not a fraction."""

_SIMPLIFIABLE = {"add", "sub", "mul", "div", "pow", "neg", "exp", "sin", "cos", "tan", "asin", "atan"}


def _simplify(op: str, operands: tuple[Node, ...], fractions: Sequence[Fraction | None]) -> Node | None:  # noqa: PLR0911, PLR0912
    """A simpler node that is equal for all numbers; None if no rule applies."""
    first, last = operands[0], operands[-1]
    match op, *fractions:
        case ("add", 0, _) | ("mul", 1, _):
            return last
        case ("add" | "sub", _, 0) | ("mul" | "div" | "pow", _, 1) | ("sin" | "tan" | "asin" | "atan", 0):
            return first
        case ("mul", 0, _) | ("mul", _, 0) if first.is_total and last.is_total:
            return constant(0)
        case ("pow", _, 0) | ("exp" | "cos", 0) if first.is_total:
            return constant(1)
        case ("sub", _, _) if first is last and first.is_total:
            return constant(0)
        case ("sub", 0, _) | ("mul", -1, _):
            return -last
        case ("mul", _, -1):
            return -first
        case ("mul", _, _) if first is last:
            return Node("square", (first,))
        case ("pow", _, 2):
            return make_node("square", first)
        case ("pow", _, Fraction(numerator=1, denominator=2)):
            return Node("sqrt", (first,))
        case ("neg", _) if first.op == "neg":
            return first.operands[0]
        case ("tan", _) if first.op == "atan":
            return first.operands[0]
        case ("sin" | "cos", _) if first.op == "atan":
            t = first.operands[0]
            return (t if op == "sin" else 1) / make_node("sqrt", 1 + t * t)
    return None


def formula(outputs: Iterable[Any], names: Iterable[str] = ()) -> Formula:
    """The formula of nodes and numbers. Its inputs are `names`, then all other inputs in the order of their use."""
    return _list_steps([_as_number(constant(x)) for x in outputs], names)


def _list_steps(outputs: Sequence[Node], names: Iterable[str] = (), nested: bool = True) -> Formula:
    """The formula of nodes, with equal steps merged.

    Args:
        nested: whether a node that depends on no input becomes one constant, whose value is a formula.
    """
    indices: dict[Step, int] = {}
    node_indices: dict[int, int] = {}  # id of a node → index; the outputs keep the nodes alive
    pending_nodes = list(outputs[::-1])
    while pending_nodes:
        node = pending_nodes.pop()
        if id(node) in node_indices:
            continue
        if nested and node.is_fixed and node.op != CONSTANT:
            step = Step(CONSTANT, (), _list_steps([node], nested=False))
        elif node_indices.keys() >= set(map(id, node.operands)):
            step = Step(node.op, tuple(map(node_indices.__getitem__, map(id, node.operands))), node.value)
        else:
            pending_nodes += [node, *node.operands[::-1]]
            continue
        node_indices[id(node)] = indices.setdefault(step, len(indices))
    inputs = [step.value for step in indices if step.op == INPUT]
    output_indices = tuple(map(node_indices.__getitem__, map(id, outputs)))
    return Formula(tuple(dict.fromkeys((*names, *inputs))), tuple(indices), output_indices)


def trace(function: Callable[[Mapping[str, Node]], Iterable[Any]], names: Sequence[str]) -> Formula:
    """The formula that a Python function of named numbers computes."""
    return formula(function({name: symbol(name) for name in names}), names)


def from_casadi(function: ca.Function, names: Sequence[str] = ()) -> Formula:
    """The formula of a CasADi function; the entries of all its inputs, and of all its outputs, form one list.

    Args:
        names: names of the inputs; by default their indices.
    """
    names = names or tuple(map(str, range(function.nnz_in())))
    return formula(nodes_from_casadi(function, names), names)


def nodes_from_casadi(function: ca.Function, names: Sequence[str]) -> list[Node]:
    """The entries of the outputs of a CasADi function, as nodes."""
    first_input = list(accumulate(map(function.nnz_in, range(function.n_in())), initial=0))
    first_output = list(accumulate(map(function.nnz_out, range(function.n_out())), initial=0))
    inputs, registers, outputs = [symbol(n) for n in names], dict[int, Node](), [constant(0)] * first_output[-1]
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        source, target = function.instruction_input(k), function.instruction_output(k)
        match operation:
            case ca.OP_INPUT:
                registers[target[0]] = inputs[first_input[source[0]] + source[1]]
            case ca.OP_OUTPUT:
                outputs[first_output[target[0]] + target[1]] = registers[source[0]]
            case ca.OP_CONST:
                registers[target[0]] = constant(function.instruction_constant(k))
            case _:
                registers[target[0]] = _convert_operation(operation, [registers[r] for r in source])
    return outputs


def _convert_operation(operation: int, operands: Sequence[Node]) -> Node:
    """A CasADi operation as a node. An unknown operation keeps its name, and no kind of number supports it."""
    if operation in _REWRITES:
        return _REWRITES[operation](operands[0], operands[-1])
    return _make_by_alias(_CASADI_NAMES.get(operation, f"operation {operation}"), *operands)


def _make_by_alias(name: str, *operands: Any) -> Node:
    return make_node(_ALIASES.get(name, name), *operands)


_REWRITES: Mapping[int, Callable[[Node, Node], Node]] = {
    ca.OP_ASSIGN: lambda a, b: a,
    ca.OP_TWICE: lambda a, b: 2 * a,
    ca.OP_INV: lambda a, b: 1 / a,
    ca.OP_NE: lambda a, b: a != b,
    ca.OP_SIGN: lambda a, b: make_node("sub", a > 0, a < 0),
    ca.OP_IF_ELSE_ZERO: lambda a, b: make_node("choose", a, b, 0),
}
"""Number of a CasADi operation that has no name here → a function that builds it from other operations."""

_CASADI_NAMES = {getattr(ca, name): name[3:].lower() for name in dir(ca) if name.startswith("OP_")}
"""Number of an operation in CasADi → its name."""

_ALIASES = {
    "subtract": "sub",
    "multiply": "mul",
    "divide": "div",
    "power": "pow",
    "constpow": "pow",
    "sq": "square",
    "absolute": "abs",
    "fabs": "abs",
    "maximum": "max",
    "minimum": "min",
    "fmin": "min",
    "fmax": "max",
    "lt": "less",
    "le": "at_most",
    "eq": "equal",
}
"""Name in NumPy or CasADi → name of the operation."""
