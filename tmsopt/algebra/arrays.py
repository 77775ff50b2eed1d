"""A CasADi function on arrays, by NumPy: every step once, on the axes that it depends on.

Shapes are those of NumPy's broadcasting. A step that depends on one axis of a grid alone is computed along that axis,
in shape (1, n) or (m, 1); what depends on no axis is one number. What has the shape of the grid is computed a block at
a time, whose arrays stay in the cache.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.algebra.operations import ARRAYS
from tmsopt.algebra.walk import Arithmetic, Instruction, NotAccepted, operation_name, steps

BLOCK = 2**14
"""Elements of a block: 128 kB an array."""

_POWERS: Mapping[float, Callable[[Any], Any]] = {
    -1.0: lambda x: np.divide(1.0, x),
    0.5: np.sqrt,
    1.0: lambda x: x,
    2.0: lambda x: x * x,
    3.0: lambda x: x * x * x,
    4.0: lambda x: (square := x * x) * square,
}


def _power(base: Any, exponent: Any) -> Any:
    """A small power that is written as a number, which is a float, as products and roots, exactly rounded each."""
    small = _POWERS.get(exponent) if type(exponent) is float else None
    return np.power(base, exponent) if small is None else small(base)


_OPERATIONS: Arithmetic = {**ARRAYS, ca.OP_POW: _power, ca.OP_CONSTPOW: _power}


@dataclass(frozen=True)
class Program:
    """Steps of a function of one vector to one vector, in an order in which they can be computed."""

    steps: tuple[Instruction, ...]

    @property
    def arguments(self) -> set[int]:
        """Entries of the vector that the results depend on."""
        return {step.place[1] for step in self.steps if step.operation == ca.OP_INPUT}

    def __call__(self, given: Mapping[int, Any]) -> list[Any]:
        """The results for numbers and arrays, each of the shape that it depends on.

        Args:
            given: entry of the vector → its value.
        """
        with np.errstate(all="ignore"):
            return self._results(given)

    def _results(self, given: Mapping[int, Any]) -> list[Any]:
        leaves = {k: _leaf(step, given) for k, step in enumerate(self.steps) if not step.operands}
        shape = np.broadcast_shapes(*(np.shape(v) for v in leaves.values()))
        whole, axes = _axes(shape), {k: _axes(np.shape(v)) for k, v in leaves.items()}
        values: list[Any] = []  # None where it is left to the blocks
        left, outputs = list[int](), dict[int, int]()
        for k, step in enumerate(self.steps):
            value = leaves.get(k)
            if step.operation == ca.OP_OUTPUT:
                outputs[step.place[1]] = step.operands[0]
            elif step.operands:
                axes[k] = 0
                for o in step.operands:
                    axes[k] |= axes[o]
                if whole and axes[k] == whole:
                    left.append(k)
                else:
                    value = _OPERATIONS[step.operation](*[values[o] for o in step.operands])
            values.append(value)
        for k in outputs.values():
            if values[k] is None:
                values[k] = np.empty(shape)
        self._fill(values, left, set(outputs.values()), shape)
        return [values[outputs[n]] for n in sorted(outputs)]

    def _fill(self, values: Sequence[Any], left: Sequence[int], wanted: set[int], shape: tuple[int, ...]) -> None:
        """Compute the steps that are left a block at a time, and put those that are wanted into their arrays."""
        last = {o: k for k in left for o in self.steps[k].operands}
        sources = last.keys() - set(left)
        lines = []
        for k in left:
            operands = self.steps[k].operands
            dead = [o for o in set(operands) if last[o] == k and o not in wanted]
            lines.append((k, _OPERATIONS[self.steps[k].operation], operands, dead))
        for rows, columns in _blocks(shape) if left else ():
            near = {o: _part(values[o], rows, columns) for o in sources}
            for k, function, operands, dead in lines:
                near[k] = function(*[near[o] for o in operands])
                for o in dead:
                    del near[o]  # so that few arrays are alive
            for k in wanted.intersection(left):
                _part(values[k], rows, columns)[...] = near[k]


def program(function: ca.Function) -> Program:
    """Of a function of one vector to one vector without empty entries.

    Raises:
        NotAccepted: for an operation that arrays do not have.
    """
    taken = list(steps(function))
    for step in taken:
        if step.operation not in (*_OPERATIONS, ca.OP_INPUT, ca.OP_OUTPUT):
            raise NotAccepted(operation_name(step.operation))
    return _pruned(taken)


def _pruned(taken: Sequence[Instruction]) -> Program:
    """Without the steps that no result needs."""
    needed: set[int] = set()
    for k in range(len(taken) - 1, -1, -1):
        if taken[k].operation == ca.OP_OUTPUT or k in needed:
            needed.update((k, *taken[k].operands))
    place = {k: number for number, k in enumerate(sorted(needed))}
    return Program(tuple(taken[k]._replace(operands=tuple(place[o] for o in taken[k].operands)) for k in place))


def _leaf(step: Instruction, given: Mapping[int, Any]) -> Any:
    return np.asarray(given[step.place[1]], dtype=float)[()] if step.operation == ca.OP_INPUT else step.constant


def _axes(shape: tuple[int, ...]) -> int:
    """The axes, from the last one on, along which there is more than one element, as bits."""
    return sum(1 << k for k, n in enumerate(reversed(shape)) if n != 1)


def _blocks(shape: tuple[int, ...]) -> Iterator[tuple[slice, slice]]:
    """Rows and columns of a grid, about so many elements at a time."""
    rows, columns = (1, *shape)[-2:]
    wide = max(1, min(columns, BLOCK))
    high = max(1, BLOCK // wide)
    for i in range(0, rows, high):
        for j in range(0, columns, wide):
            yield slice(i, i + high), slice(j, j + wide)


def _part(value: Any, rows: slice, columns: slice) -> Any:
    """What of a value belongs to a block."""
    shape = np.shape(value)
    if shape and shape[-1] != 1:
        value = value[..., columns]
    return value[..., rows, :] if len(shape) > 1 and shape[-2] != 1 else value
