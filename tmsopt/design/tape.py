"""A CasADi function as a tape of elementary steps over arrays: every step once, on the axes that it depends on.

Shapes are those of NumPy's broadcasting. A step that depends on one axis of a grid alone is computed along that axis,
in shape (1, n) or (m, 1); what depends on no axis is one number.
"""

import struct
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.arithmetic.operations import NUMPY
from tmsopt.arithmetic.walk import NotAccepted, operation_name, steps
from tmsopt.design.machine import EXACT, Machine

Shape = tuple[int, ...]


@dataclass(frozen=True)
class Node:
    """One value of a tape.

    Attributes:
        operation: CasADi's number of it; `ca.OP_INPUT` and `ca.OP_CONST` have no operands.
        operands: numbers of the nodes that it takes.
        content: name of an input; a number or an array of a constant.
    """

    operation: int
    operands: tuple[int, ...] = ()
    content: Any = None


@dataclass(frozen=True)
class Tape:
    """Nodes in an order in which they can be computed.

    Attributes:
        outputs: name → number of the node.
    """

    nodes: tuple[Node, ...]
    outputs: Mapping[str, int]

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs that the outputs depend on."""
        return tuple(n.content for n in self.nodes if n.operation == ca.OP_INPUT)

    def __call__(self, given: Mapping[str, Any], machine: Machine | None = None) -> dict[str, Any]:
        """The outputs for numbers and arrays, each of the shape that it depends on.

        Args:
            machine: runs the steps over the whole grid that are exactly rounded, instead of NumPy; the numbers are the
                same to the bit.
        """
        with np.errstate(all="ignore"):
            return _Run(self, given, machine).outputs()

    def settled(self, given: Mapping[str, Any]) -> "Tape":
        """The same tape with some inputs given for good: what depends on them alone becomes a constant."""
        known: dict[int, Any] = {}
        with np.errstate(all="ignore"):
            for k, node in enumerate(self.nodes):
                if node.operation == ca.OP_CONST:
                    known[k] = node.content
                elif node.operation == ca.OP_INPUT:
                    if node.content in given:
                        known[k] = np.asarray(given[node.content], dtype=float)[()]
                elif all(o in known for o in node.operands):
                    known[k] = NUMPY[node.operation](*(known[o] for o in node.operands))
        nodes = [Node(ca.OP_CONST, (), known[k]) if k in known else node for k, node in enumerate(self.nodes)]
        return _pruned(nodes, self.outputs)


def tape(function: ca.Function, inputs: Iterable[str], outputs: Iterable[str]) -> Tape:
    """The tape of a function of one vector, whose entries the inputs name, to scalars, which the outputs name.

    Raises:
        NotAccepted: for an operation that arrays do not have.
    """
    names = list(inputs)
    nodes: list[Node] = []
    numbers: dict[Any, int] = {}
    places: dict[int, int] = {}  # instruction → node
    found: dict[int, int] = {}  # output → node

    def put(operation: int, *operands: int, content: Any = None) -> int:
        bits = struct.pack("d", content) if operation == ca.OP_CONST else content
        key = (operation, operands, bits)
        if key not in numbers:
            numbers[key] = len(nodes)
            nodes.append(Node(operation, operands, content))
        return numbers[key]

    for k, step in enumerate(steps(function)):
        operands = [places[o] for o in step.operands]
        match step.operation:
            case ca.OP_INPUT:
                places[k] = put(ca.OP_INPUT, content=names[step.place[1]])
            case ca.OP_OUTPUT:
                found[step.place[0]] = operands[0]
            case ca.OP_CONST:
                places[k] = put(ca.OP_CONST, content=float(step.constant))
            case ca.OP_POW | ca.OP_CONSTPOW:
                places[k] = _power(put, operands[0], operands[1], nodes[operands[1]].content)
            case operation if operation in _IN_OTHERS:
                places[k] = _IN_OTHERS[operation](put, *operands)
            case operation if operation in NUMPY:
                places[k] = put(operation, *operands)
            case operation:
                raise NotAccepted(operation_name(operation))
    zero = [put(ca.OP_CONST, content=0.0)] if len(found) < function.n_out() else []  # of an output without an entry
    return _pruned(nodes, {name: found.get(k, *zero) for k, name in enumerate(outputs)})


_IN_OTHERS: Mapping[int, Callable[..., int]] = {
    ca.OP_ASSIGN: lambda put, x: x,
    ca.OP_SQ: lambda put, x: put(ca.OP_MUL, x, x),
    ca.OP_TWICE: lambda put, x: put(ca.OP_ADD, x, x),
    ca.OP_INV: lambda put, x: put(ca.OP_DIV, put(ca.OP_CONST, content=1.0), x),
    ca.OP_NE: lambda put, x, y: put(ca.OP_NOT, put(ca.OP_EQ, x, y)),
}
"""Operations that are others in the same numbers."""


def _power(put: Callable[..., int], base: int, exponent: int, number: Any) -> int:
    """Small powers as the products and roots that NumPy makes of them, exactly rounded each."""
    if number == 0.5:
        return put(ca.OP_SQRT, base)
    if number == -1:
        return put(ca.OP_DIV, put(ca.OP_CONST, content=1.0), base)
    if number not in (1.0, 2.0, 3.0, 4.0):
        return put(ca.OP_POW, base, exponent)
    if number == 1:
        return base
    square = put(ca.OP_MUL, base, base)
    return square if number == 2 else put(ca.OP_MUL, square, base if number == 3 else square)


def _pruned(nodes: Iterable[Node], outputs: Mapping[str, int]) -> Tape:
    """Without the nodes that no output needs."""
    every = list(nodes)
    needed = set(outputs.values())
    for k in range(len(every) - 1, -1, -1):
        if k in needed:
            needed.update(every[k].operands)
    place = {k: number for number, k in enumerate(sorted(needed))}
    kept = [Node(every[k].operation, tuple(place[o] for o in every[k].operands), every[k].content) for k in place]
    return Tape(tuple(kept), {name: place[k] for name, k in outputs.items()})


@dataclass
class _Run:
    """One evaluation of a tape; a value that is None is left to the machine until it is asked for."""

    tape: Tape
    given: Mapping[str, Any]
    machine: Machine | None
    values: list[Any] = field(default_factory=list)
    shape: Shape = ()

    def outputs(self) -> dict[str, Any]:
        """Everything computed, in order."""
        nodes = self.tape.nodes
        leaves = {k: self._leaf(node) for k, node in enumerate(nodes) if node.operation in (ca.OP_INPUT, ca.OP_CONST)}
        self.shape = np.broadcast_shapes(*(np.shape(v) for v in leaves.values()))
        machine = self.machine if len(self.shape) in (1, 2) else None
        last = {o: k for k, node in enumerate(nodes) for o in node.operands}
        last |= dict.fromkeys(self.tape.outputs.values(), len(nodes))
        shapes: list[Shape] = []
        for k, node in enumerate(nodes):
            value = leaves.pop(k, None)
            if value is None:
                shapes.append(np.broadcast_shapes(*(shapes[o] for o in node.operands)))
                if machine is None or node.operation not in EXACT or shapes[k] != self.shape:
                    self._compute([o for o in node.operands if self.values[o] is None])
                    value = NUMPY[node.operation](*(self.values[o] for o in node.operands))
            else:
                shapes.append(np.shape(value))
            self.values.append(value)
            if machine is None:
                for o in node.operands:
                    if last[o] == k:
                        self.values[o] = None  # so that few arrays are alive, and these in the cache
        wanted = list(dict.fromkeys(self.tape.outputs.values()))
        self._compute([k for k in wanted if self.values[k] is None])
        return {name: self.values[k] for name, k in self.tape.outputs.items()}

    def _leaf(self, node: Node) -> Any:
        content = self.given[node.content] if node.operation == ca.OP_INPUT else node.content
        return np.asarray(content, dtype=float)[()]

    def _compute(self, wanted: list[int]) -> None:
        """Let the machine compute nodes that were left to it, and what they need of the others."""
        if not wanted:
            return
        assert self.machine is not None
        needed, nodes = set(wanted), self.tape.nodes
        for k in range(max(wanted), -1, -1):
            if k in needed and self.values[k] is None:
                needed.update(nodes[k].operands)
        program = [(k, nodes[k].operation, nodes[k].operands) for k in sorted(needed) if self.values[k] is None]
        sources = {k: self.values[k] for k in needed if self.values[k] is not None}
        for k, array in zip(wanted, self.machine(program, sources, wanted, self.shape), strict=True):
            self.values[k] = array
