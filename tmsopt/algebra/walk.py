"""A CasADi function, one instruction after the other, in another arithmetic: balls, the expressions of SCIP, arrays."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import casadi as ca

Arithmetic = Mapping[int, Callable[..., Any]]
"""CasADi operation → what it does to its one or two operands; for `ca.OP_CONST`, to a float."""


class NotAccepted(ValueError):
    """An operation that an arithmetic lacks; the message is its name."""


def walk(
    function: ca.Function,
    arguments: Sequence[Any],
    arithmetic: Arithmetic,
    shared: Callable[[Any], Any] = lambda value: value,
) -> list[list[Any]]:
    """The outputs of a function of one vector, whose entries are given; each output as the list of its entries.

    Args:
        shared: applied to every result that is used more than once.

    Raises:
        NotAccepted: for an operation that the arithmetic does not have.
    """
    taken = _taken(function)
    left = Counter(k for step in taken for k in step.operands)
    values: list[Any] = []
    outputs: list[list[Any]] = [[arithmetic[ca.OP_CONST](0.0)] * function.nnz_out(k) for k in range(function.n_out())]
    for step in taken:
        match step.operation:
            case ca.OP_INPUT:
                value = arguments[step.place[1]]
            case ca.OP_OUTPUT:
                value = values[step.operands[0]]
                outputs[step.place[0]][step.place[1]] = value
            case ca.OP_CONST:
                value = arithmetic[ca.OP_CONST](step.constant)
            case operation if operation in arithmetic:
                value = arithmetic[operation](*[values[k] for k in step.operands])
                value = shared(value) if left[len(values)] > 1 else value
            case operation:
                raise NotAccepted(operation_name(operation))
        values.append(value)
        for k in step.operands:
            left[k] -= 1
            if not left[k]:
                values[k] = None  # so that few arrays are alive, and these in the cache
    return outputs


class Instruction(NamedTuple):
    """One instruction of a function.

    Attributes:
        operation: as CasADi numbers them, ``ca.OP_ADD`` and so on.
        operands: numbers of the steps whose results it takes.
        place: of an input or output, which one and which entry.
        constant: a number.
    """

    operation: int
    operands: tuple[int, ...] = ()
    place: tuple[int, int] = (0, 0)
    constant: Any = 0.0


def steps(function: ca.Function) -> Iterator[Instruction]:
    """The instructions, with the numbers of steps in place of registers, which CasADi uses again."""
    held: dict[int, int] = {}
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        inputs, outputs = function.instruction_input(k), function.instruction_output(k)
        match operation:
            case ca.OP_INPUT:
                yield Instruction(operation, place=(inputs[0], inputs[1]))
            case ca.OP_OUTPUT:
                yield Instruction(operation, (held[inputs[0]],), place=(outputs[0], outputs[1]))
                continue
            case ca.OP_CONST:
                yield Instruction(operation, constant=function.instruction_constant(k))
            case _:
                yield Instruction(operation, tuple(held[r] for r in inputs))
        held[outputs[0]] = k


@lru_cache(maxsize=8)
def _taken(function: ca.Function) -> tuple[Instruction, ...]:
    """The instructions of a function that is met again at once, as with the boxes of a branch and bound."""
    return tuple(steps(function))


def operation_name(operation: int) -> str:
    """Name of a CasADi operation, e.g. ``atan2``."""
    return _NAMES.get(operation, f"operation {operation}")


_NAMES = {getattr(ca, name): name[3:].lower() for name in dir(ca) if name.startswith("OP_")}
