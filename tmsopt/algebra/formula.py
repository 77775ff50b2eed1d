"""Formulas as graphs with exact constants, stated once as plain arithmetic, and one fold of them into any numbers.

A formula is made of a Python function on nodes (`trace`), of a text (`tmsopt.models.expression`), or of a function of
CasADi (`from_casadi`). What its operations mean is said by a kind of numbers; see `kinds`.
"""

import math
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import accumulate, chain
from typing import Any, NamedTuple, Union

import casadi as ca

INPUT, CONSTANT = "input", "constant"

Constant = Union[Fraction, float, "Formula"]
"""A fraction; a formula without names where the number is none, as √2 or π; nan and infinities alone as a float."""

_WHOLE = 64  # exponent up to which a power of fractions is multiplied out
_BITS = 2**12  # of such a power


class UnsupportedOperation(ValueError):
    """An operation that a kind of numbers lacks; the message is its name."""


class Step(NamedTuple):
    """One operation of a formula.

    Attributes:
        op: ``input``, ``constant``, or the name of an operation such as ``add``.
        operands: numbers of the steps whose results it takes.
        value: name of an input, or the constant.
    """

    op: str
    operands: tuple[int, ...] = ()
    value: Any = None


@dataclass(frozen=True, eq=True)
class Formula:
    """Numbers that depend on others, for numbers of any kind.

    Attributes:
        names: of the inputs, those that no step takes among them.
        steps: in an order in which they can be computed, each once.
        outputs: numbers of steps.
    """

    names: tuple[str, ...]
    steps: tuple[Step, ...]
    outputs: tuple[int, ...]

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        return hash((self.names, self.steps, self.outputs))

    def part(self, outputs: Sequence[int], known: Collection[int] = ()) -> "Formula":
        """The formula of some steps, in what is known of others, as inputs that have their numbers for names."""
        needed = set(outputs)
        for k in range(len(self.steps) - 1, -1, -1):
            if k in needed and k not in known:
                needed.update(self.steps[k].operands)
        place = {k: number for number, k in enumerate(sorted(needed))}
        steps = [
            Step(INPUT, (), str(k))
            if k in known
            else self.steps[k]._replace(operands=tuple(map(place.__getitem__, self.steps[k].operands)))
            for k in place
        ]
        return Formula(self.names, tuple(steps), tuple(map(place.__getitem__, outputs)))

    def split(self, late: Collection[int]) -> tuple[tuple[str, ...], "Formula", "Formula"]:
        """The formula in two: what late steps and outputs take of the others, by name; these; and the rest in them.

        Constants that late steps take stay with them: an exponent is to be a number, which has no slope.
        """
        taken = {o for k in late for o in self.steps[k].operands if self.steps[o].op != CONSTANT} | set(self.outputs)
        sources = sorted(k for k in taken if k not in late)
        return tuple(map(str, sources)), self.part(sources), self.part(self.outputs, sources)

    def dependent_steps(self, names: Collection[str]) -> set[int]:
        """The steps that depend on some of the inputs."""
        found: set[int] = set()
        for k, step in enumerate(self.steps):
            if step.value in names if step.op == INPUT else not found.isdisjoint(step.operands):
                found.add(k)
        return found

    @cached_property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs that it depends on."""
        return tuple([step.value for step in self.steps if step.op == INPUT])

    @property
    def constants(self) -> list[Constant]:
        """Its constants, each once."""
        return [step.value for step in self.steps if step.op == CONSTANT]

    @cached_property
    def dead(self) -> tuple[tuple[int, ...], ...]:
        """For each step the operands that nothing needs after it."""
        last = {o: k for k, step in enumerate(self.steps) for o in step.operands}
        found: list[list[int]] = [[] for _ in self.steps]
        for o, k in last.items():
            if o not in self.outputs:
                found[k].append(o)
        return tuple(map(tuple, found))

    @cached_property
    def uses(self) -> tuple[int, ...]:
        """How often the result of each step is taken by others."""
        counted = Counter(chain.from_iterable([step.operands for step in self.steps]))
        return tuple(map(counted.__getitem__, range(len(self.steps))))


@dataclass(frozen=True)
class Kind:
    """Numbers of one kind.

    Attributes:
        operations: name → what it makes of its operands.
        constant: what a constant is.
        number: what an input is taken for.
    """

    operations: Mapping[str, Callable[..., Any]]
    constant: Callable[[Constant], Any]
    number: Callable[[Any], Any] = lambda x: x


def fold(
    formula: Formula, values: Mapping[str, Any], kind: Kind, shared: Callable[[Any], Any] | None = None
) -> list[Any]:
    """The outputs of a formula for numbers of a kind.

    Args:
        values: name of an input → number.
        shared: applied to every result that is used more than once.

    Raises:
        NotAccepted: for an operation that the kind does not have.
    """
    operations, found = kind.operations, list[Any]()
    for (op, operands, value), dead, uses in zip(formula.steps, formula.dead, formula.uses, strict=True):
        if op == INPUT:
            result = kind.number(values[value])
        elif op == CONSTANT:
            result = kind.constant(value)
        elif (operation := operations.get(op)) is None:
            raise UnsupportedOperation(op)
        else:
            if len(operands) == 2:  # by far the most
                result = operation(found[operands[0]], found[operands[1]])
            else:
                result = operation(*map(found.__getitem__, operands))
            if shared and uses > 1:
                result = shared(result)
        found.append(result)
        for o in dead:
            found[o] = None  # so that few arrays are alive, and these in the cache
    return [found[o] for o in formula.outputs]


_TOTAL = {INPUT, CONSTANT, "add", "sub", "mul", "neg", "square", "abs", "min", "max", "sin", "cos", "atan", "exp"}


def _operators(op: str) -> tuple[Callable[["Node", Any], "Node"], Callable[["Node", Any], "Node"]]:
    """An operation as a method of its first operand, and of its second one."""
    return lambda self, other: make_node(op, self, other), lambda self, other: make_node(op, other, self)


class Node:
    """A number that is not known yet: an input, a constant, or an operation on others; made by arithmetic.

    What is certain for every number is left out: 0 + x is x, fractions are computed, and 0 x is 0 where x always has a
    value. A 0.0 stays, which makes of infinity what is no number.

    Attributes:
        fixed: whether no input is in it.
        total: whether it has a value wherever its inputs have.
    """

    __slots__ = ("fixed", "op", "operands", "total", "value")

    def __init__(self, op: str, operands: tuple["Node", ...] = (), value: Any = None) -> None:
        self.op, self.operands, self.value = op, operands, value
        self.fixed: bool = op != INPUT
        self.total: bool = op in _TOTAL
        for o in operands:
            self.fixed, self.total = self.fixed and o.fixed, self.total and o.total

    def __bool__(self) -> bool:
        raise TypeError("a formula does not ask what its numbers are; write choose(condition, a, b)")

    __add__, __radd__ = _operators("add")
    __sub__, __rsub__ = _operators("sub")
    __mul__, __rmul__ = _operators("mul")
    __truediv__, __rtruediv__ = _operators("div")
    __pow__, __rpow__ = _operators("pow")
    __lt__, __gt__ = _operators("less")
    __le__, __ge__ = _operators("at_most")
    __and__, __rand__ = _operators("both")
    __or__, __ror__ = _operators("either")
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

    def __array_ufunc__(self, function: Any, method: str, *given: Any) -> "Node":
        return _renamed(function.__name__, *given)

    @property
    def fraction(self) -> Fraction | None:
        """The number that it is, where that is a fraction."""
        return self.value if self.op == CONSTANT and isinstance(self.value, Fraction) else None


def depends_on(x: Any, names: Collection[str]) -> bool:
    """Whether a node has some of the inputs in it."""
    return bool(formula([x]).dependent_steps(names))


def symbol(name: str) -> Node:
    """An input."""
    return Node(INPUT, (), name)


PI = Node("pi")


def constant(x: Any) -> Node:
    """A number as it is written: a float stands for the decimal that prints it."""
    if isinstance(x, Node):
        return x
    if isinstance(x, float):
        return Node(CONSTANT, (), Fraction(str(x)) if math.isfinite(x) else float(x))
    return Node(CONSTANT, (), Fraction(x) if isinstance(x, int | Fraction) else Fraction(int(x.p), int(x.q)))


def make_node(op: str, *given: Any) -> Node:
    """An operation on nodes and numbers, in its simplest form."""
    operands, fractions, truths = tuple[Node, ...](), list[Fraction | None](), _LOGICAL.get(op, 0)
    for k, x in enumerate(given):
        o = x if isinstance(x, Node) else constant(x)
        if truths or o.op in _TRUTHS:
            o = _as_truth(o) if k < truths else _as_number(o)
        known = o.op == CONSTANT and isinstance(o.value, Fraction) and not (isinstance(x, float) and x == 0)
        operands += (o,)
        fractions.append(o.value if known else None)
    if op in _EXACT and None not in fractions and (number := _EXACT[op](*fractions)) is not None:
        return Node(CONSTANT, (), number)
    simplest = _simplest(op, operands, fractions) if op in _SIMPLEST else None
    return Node(op, operands) if simplest is None else simplest


_TRUTHS = {"less", "at_most", "equal", "negligible", "both", "either", "not"}
_LOGICAL = {"choose": 1, "both": 2, "either": 2, "not": 1}
"""How many of its operands, from the first on, an operation takes for true or false; all others are numbers."""


def _as_truth(x: Node) -> Node:
    return x if x.op in _TRUTHS else ~(x == 0)


def _as_number(x: Node) -> Node:
    """1 for what is true, 0 for what is false: slopes by CasADi reckon with them."""
    return make_node("choose", x, 1, 0) if x.op in _TRUTHS else x


def _power(a: Fraction, b: Fraction) -> Fraction | None:
    whole = b.denominator == 1 and abs(b) <= _WHOLE and (a != 0 or b > 0)
    size = max(a.numerator.bit_length(), a.denominator.bit_length())
    return a ** int(b) if whole and size * abs(b) <= _BITS else None


_EXACT: Mapping[str, Callable[..., Fraction | None]] = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b if b else None,
    "neg": lambda a: -a,
    "square": lambda a: a * a,
    "abs": abs,
    "pow": _power,
}
"""What fractions make a fraction of; None where they do not."""

_SIMPLEST = {"add", "sub", "mul", "div", "pow", "neg", "exp", "sin", "cos", "tan", "asin", "atan"}


def _simplest(op: str, operands: tuple[Node, ...], fractions: Sequence[Fraction | None]) -> Node | None:  # noqa: PLR0911, PLR0912
    """What an operation comes to, whatever the number is; None where that is no simpler."""
    first, last = operands[0], operands[-1]
    match op, *fractions:
        case ("add", 0, _) | ("mul", 1, _):
            return last
        case ("add" | "sub", _, 0) | ("mul" | "div" | "pow", _, 1) | ("sin" | "tan" | "asin" | "atan", 0):
            return first
        case ("mul", 0, _) | ("mul", _, 0) if first.total and last.total:
            return constant(0)
        case ("pow", _, 0) | ("exp" | "cos", 0) if first.total:
            return constant(1)
        case ("sub", _, _) if first is last and first.total:
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
    """The formula of nodes and numbers, in inputs of these names and those that appear."""
    return _listed([_as_number(constant(x)) for x in outputs], names)


def _listed(outputs: Sequence[Node], names: Iterable[str] = (), nested: bool = True) -> Formula:
    """The steps of nodes, equal ones once.

    Args:
        nested: whether a node without inputs is a constant that is a formula of its own.
    """
    places: dict[Step, int] = {}
    known: dict[int, int] = {}  # id of a node, which is kept alive by the outputs
    waiting = list(outputs[::-1])
    while waiting:
        node = waiting.pop()
        if id(node) in known:
            continue
        if nested and node.fixed and node.op != CONSTANT:
            step = Step(CONSTANT, (), _listed([node], nested=False))
        elif known.keys() >= set(map(id, node.operands)):
            step = Step(node.op, tuple(map(known.__getitem__, map(id, node.operands))), node.value)
        else:
            waiting += [node, *node.operands[::-1]]
            continue
        known[id(node)] = places.setdefault(step, len(places))
    met = [step.value for step in places if step.op == INPUT]
    return Formula(tuple(dict.fromkeys((*names, *met))), tuple(places), tuple(map(known.__getitem__, map(id, outputs))))


def trace(function: Callable[[Mapping[str, Node]], Iterable[Any]], names: Sequence[str]) -> Formula:
    """What a function of named numbers computes."""
    return formula(function({name: symbol(name) for name in names}), names)


def from_casadi(function: ca.Function, names: Sequence[str] = ()) -> Formula:
    """The formula of a function of CasADi, the entries of all its inputs in a row, and of its outputs.

    Args:
        names: of the inputs; by default their numbers.
    """
    names = names or tuple(map(str, range(function.nnz_in())))
    return formula(nodes_from_casadi(function, names), names)


def nodes_from_casadi(function: ca.Function, names: Sequence[str]) -> list[Node]:
    """The entries of its outputs as nodes."""
    firsts = list(accumulate(map(function.nnz_in, range(function.n_in())), initial=0))
    ends = list(accumulate(map(function.nnz_out, range(function.n_out())), initial=0))
    inputs, held, outputs = [symbol(n) for n in names], dict[int, Node](), [constant(0)] * ends[-1]
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        given, into = function.instruction_input(k), function.instruction_output(k)
        match operation:
            case ca.OP_INPUT:
                held[into[0]] = inputs[firsts[given[0]] + given[1]]
            case ca.OP_OUTPUT:
                outputs[ends[into[0]] + into[1]] = held[given[0]]
            case ca.OP_CONST:
                held[into[0]] = constant(function.instruction_constant(k))
            case _:
                held[into[0]] = _translated(operation, [held[r] for r in given])
    return outputs


def _translated(operation: int, operands: Sequence[Node]) -> Node:
    """An operation of CasADi; what there is not here keeps its name, and no kind of numbers takes it."""
    if operation in _WRITTEN:
        return _WRITTEN[operation](operands[0], operands[-1])
    return _renamed(_NAMES.get(operation, f"operation {operation}"), *operands)


def _renamed(name: str, *operands: Any) -> Node:
    return make_node(_RENAMED.get(name, name), *operands)


_WRITTEN: Mapping[int, Callable[[Node, Node], Node]] = {
    ca.OP_ASSIGN: lambda a, b: a,
    ca.OP_TWICE: lambda a, b: 2 * a,
    ca.OP_INV: lambda a, b: 1 / a,
    ca.OP_NE: lambda a, b: a != b,
    ca.OP_SIGN: lambda a, b: make_node("sub", a > 0, a < 0),
    ca.OP_IF_ELSE_ZERO: lambda a, b: make_node("choose", a, b, 0),
}
"""In other operations."""

_NAMES = {getattr(ca, name): name[3:].lower() for name in dir(ca) if name.startswith("OP_")}

_RENAMED = {
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
    "and": "both",
    "or": "either",
}
"""Functions of NumPy and CasADi whose names are not those of operations."""
