"""A formula on large arrays: what has the shape of the whole grid is computed a block at a time, in the cache.

Shapes are those of NumPy's broadcasting. A step that depends on one axis of a grid alone is computed along that axis,
in shape (1, n) or (m, 1); what depends on no axis is one number.
"""

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from tmsopt.algebra.formula import INPUT, Formula, Step, fold
from tmsopt.algebra.kinds import FLOATS

BLOCK = 2**14
"""Elements of a block: 128 kB an array."""


def on_arrays(formula: Formula, given: Mapping[str, Any]) -> list[Any]:
    """The outputs for numbers and arrays, each of the shape that it depends on; nan and inf without a warning."""
    columns = {name: np.asarray(given[name], dtype=float)[()] for name in formula.inputs}
    shape = np.broadcast_shapes(*map(np.shape, columns.values()))
    with np.errstate(all="ignore"):
        if math.prod(shape) <= BLOCK:
            return fold(formula, columns, FLOATS)
        large, sources = _divided(formula, {n: _axes(np.shape(x)) for n, x in columns.items()}, _axes(shape))
        ends = dict.fromkeys((*sources, *(o for o in formula.outputs if o not in large)))
        known = dict(zip(map(str, ends), fold(_part(formula, list(ends)), columns, FLOATS), strict=True))
        found = {str(o): np.empty(shape) for o in formula.outputs if o in large}
        rest = _part(formula, [int(o) for o in found], sources)
        for rows, along in _blocks(shape) if found else ():
            near = {name: _cut({**columns, **known}[name], rows, along) for name in rest.inputs}
            for into, value in zip(found.values(), fold(rest, near, FLOATS), strict=True):
                _cut(into, rows, along)[...] = value
    return [{**known, **found}[str(o)] for o in formula.outputs]


def _divided(formula: Formula, given: Mapping[str, int], axes: int) -> tuple[set[int], set[int]]:
    """The steps that have all the axes of a grid, and those of others that they take."""
    own: list[int] = []
    for step in formula.steps:
        along = given[step.value] if step.op == INPUT else 0
        for o in step.operands:
            along |= own[o]
        own.append(along)
    large = {k for k, along in enumerate(own) if along == axes}
    return large, {o for k in large for o in formula.steps[k].operands} - large


def _part(formula: Formula, outputs: Sequence[int], known: Collection[int] = ()) -> Formula:
    """The formula of some steps, in what is known of others, as inputs that have their numbers for names."""
    needed = set(outputs)
    for k in range(len(formula.steps) - 1, -1, -1):
        if k in needed and k not in known:
            needed.update(formula.steps[k].operands)
    place = {k: number for number, k in enumerate(sorted(needed))}
    steps = [
        Step(INPUT, (), str(k)) if k in known else step._replace(operands=tuple(place[o] for o in step.operands))
        for k, step in enumerate(formula.steps)
        if k in needed
    ]
    return Formula(formula.names, tuple(steps), tuple(place[o] for o in outputs))


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


def _cut(value: Any, rows: slice, columns: slice) -> Any:
    """What of a value belongs to a block."""
    shape = np.shape(value)
    if shape and shape[-1] != 1:
        value = value[..., columns]
    return value[..., rows, :] if len(shape) > 1 and shape[-2] != 1 else value
