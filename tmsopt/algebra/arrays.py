"""Evaluates a formula on large arrays, one block after another, so that the data stay in the cache.

Shapes follow NumPy's broadcasting. A step of the formula that depends on a single axis is computed along
this axis, in shape (1, n) or (m, 1); a step that depends on no axis is one number.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from tmsopt.algebra.formula import Formula, fold
from tmsopt.algebra.kinds import BALLS, FLOATS
from tmsopt.algebra.rounding import Bounded, as_bounded

BLOCK = 2**14
"""Elements of a block: 128 kB for each array."""


def evaluate_on_arrays(formula: Formula, numbers: Mapping[str, Any]) -> list[Any]:
    """Outputs for numbers and arrays, each in the common shape of its inputs; nan and inf give no warning.

    If an input has error bounds, the outputs have error bounds too.
    """
    if Bounded in map(type, numbers.values()):
        with np.errstate(all="ignore"):
            return fold(formula, {n: as_bounded(numbers[n]) for n in formula.inputs}, BALLS)
    columns = {name: np.asarray(numbers[name], dtype=float)[()] for name in formula.inputs}
    shape = np.broadcast_shapes(*map(np.shape, columns.values()))
    with np.errstate(all="ignore"):
        if math.prod(shape) <= BLOCK:
            return fold(formula, columns, FLOATS)
        # A stride is 0 along an axis on which a column does not depend.
        strides = {n: np.broadcast_to(x, shape).strides for n, x in columns.items()}
        axes = [k for k, n in enumerate(shape) if n != 1]
        full_steps = set.intersection(*(formula.dependent_steps([n for n in columns if strides[n][k]]) for k in axes))
        names, partial_formula, full_formula = formula.split(full_steps)  # full_steps depend on all axes
        inputs = columns | dict(zip(names, fold(partial_formula, columns, FLOATS), strict=True))
        results = [inputs[str(o)] if str(o) in inputs else np.empty(shape) for o in formula.outputs]
        full_outputs = [k for k, o in enumerate(formula.outputs) if o in full_steps]
        full_formula = full_formula.extract([full_formula.outputs[k] for k in full_outputs])
        for block in _split_grid(shape) if full_outputs else ():
            block_inputs = {name: _slice_block(inputs[name], *block) for name in full_formula.inputs}
            for k, value in zip(full_outputs, fold(full_formula, block_inputs, FLOATS), strict=True):
                _slice_block(results[k], *block)[...] = value
    return results


def _split_grid(shape: tuple[int, ...]) -> Iterator[tuple[slice, slice]]:
    """Rows and columns of blocks of about `BLOCK` elements."""
    rows, columns = (1, *shape)[-2:]
    width = max(1, min(columns, BLOCK))
    height = max(1, BLOCK // width)
    for i in range(0, rows, height):
        for j in range(0, columns, width):
            yield slice(i, i + height), slice(j, j + width)


def _slice_block(value: Any, rows: slice, columns: slice) -> Any:
    """The elements of a block, for a value that may be constant along some axes."""
    shape = np.shape(value)
    if shape and shape[-1] != 1:
        value = value[..., columns]
    return value[..., rows, :] if len(shape) > 1 and shape[-2] != 1 else value
