"""A formula on large arrays: what has the shape of the whole grid is computed a block at a time, in the cache.

Shapes are those of NumPy's broadcasting. A step that depends on one axis of a grid alone is computed along that axis,
in shape (1, n) or (m, 1); what depends on no axis is one number.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from tmsopt.algebra.formula import Formula, fold
from tmsopt.algebra.kinds import BALLS, FLOATS
from tmsopt.algebra.rounding import Bounded, as_bounded

BLOCK = 2**14
"""Elements of a block: 128 kB an array."""


def evaluate_on_arrays(formula: Formula, given: Mapping[str, Any]) -> list[Any]:
    """The outputs for numbers and arrays, each of the shape that it depends on; nan and inf without a warning.

    With bounds of errors, where a column has them.
    """
    if Bounded in map(type, given.values()):
        with np.errstate(all="ignore"):
            return fold(formula, {n: as_bounded(given[n]) for n in formula.inputs}, BALLS)
    columns = {name: np.asarray(given[name], dtype=float)[()] for name in formula.inputs}
    shape = np.broadcast_shapes(*map(np.shape, columns.values()))
    with np.errstate(all="ignore"):
        if math.prod(shape) <= BLOCK:
            return fold(formula, columns, FLOATS)
        strides = {n: np.broadcast_to(x, shape).strides for n, x in columns.items()}  # 0 along axes of no influence
        axes = [k for k, n in enumerate(shape) if n != 1]
        large = set.intersection(*(formula.dependent_steps([n for n in columns if strides[n][k]]) for k in axes))
        names, small, rest = formula.split(large)
        known = columns | dict(zip(names, fold(small, columns, FLOATS), strict=True))
        found = [known[str(o)] if str(o) in known else np.empty(shape) for o in formula.outputs]
        filled = [k for k, o in enumerate(formula.outputs) if o in large]
        rest = rest.part([rest.outputs[k] for k in filled])
        for rows, along in _blocks(shape) if filled else ():
            near = {name: _cut(known[name], rows, along) for name in rest.inputs}
            for k, value in zip(filled, fold(rest, near, FLOATS), strict=True):
                _cut(found[k], rows, along)[...] = value
    return found


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
