"""A register machine, compiled by numba once and for all: it runs any tape of exactly rounded steps over a grid.

A step works on a block of a row at a time, which stays in the cache: reading the program costs little beside the
block's arithmetic, no code is made for a formula, and every number is the one that NumPy computes.
"""

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from tmsopt.errors import Fault, InputError
from tmsopt.records import Array

Program = Sequence[tuple[int, int, tuple[int, ...]]]
"""Steps in order: number of the result, CasADi's operation, numbers of the operands."""

ENGINES = ("auto", "numpy", "numba")
"""What computes arrays: numba where it is installed, or the one or the other."""

BLOCK = 512
"""Elements of a block: 4 kB, so that the registers of a long formula stay in a cache of 32 to 512 kB."""

# The machine's own numbers of operations: CasADi's may change, and compiled code is kept on disk.
_ADD, _SUB, _MUL, _DIV, _NEG, _SQRT, _ABS, _MIN, _MAX, _LT, _LE, _EQ, _NOT, _AND, _OR, _IF = range(16)

EXACT: Mapping[int, int] = {
    ca.OP_ADD: _ADD, ca.OP_SUB: _SUB, ca.OP_MUL: _MUL, ca.OP_DIV: _DIV, ca.OP_NEG: _NEG, ca.OP_SQRT: _SQRT,
    ca.OP_FABS: _ABS, ca.OP_FMIN: _MIN, ca.OP_FMAX: _MAX, ca.OP_LT: _LT, ca.OP_LE: _LE, ca.OP_EQ: _EQ,
    ca.OP_NOT: _NOT, ca.OP_AND: _AND, ca.OP_OR: _OR, ca.OP_IF_ELSE_ZERO: _IF,
}  # fmt: skip
"""Operations whose result does not depend on who computes it, as numbers of the machine."""


def engine_of(name: str) -> str:
    """``numpy`` or ``numba`` for one of `ENGINES`.

    Raises:
        InputError: for another name, or numba where it is not installed.
    """
    if name not in ENGINES:
        raise InputError([Fault(f"found {name!r}; accepted: {' '.join(ENGINES)}", ("engine",))])
    installed = find_spec("numba") is not None
    if name == "numba" and not installed:
        message = 'numba is not installed; run pip install "tmsopt[fast]", or take the engine numpy'
        raise InputError([Fault(message, ("engine",))])
    return "numba" if installed and name != "numpy" else "numpy"


@dataclass(frozen=True)
class Machine:
    """Runs programs by compiled code."""

    run: Callable[..., None]

    def __call__(self, program: Program, sources: Mapping[int, Any], wanted: Sequence[int], shape: Any) -> list[Array]:
        """Results of a program over a grid of one or two axes, each of the grid's shape.

        Args:
            sources: number → value of what the program takes, of any shape that broadcasts to the grid's.
            wanted: numbers of the results to return.
        """
        rows, columns = (1, *shape)[-2:]
        if columns == 1:
            rows, columns = 1, rows
        kinds = {k: _kind(np.size(v), np.shape(v), rows, columns) for k, v in sources.items()}
        given: list[int] = []
        arrays: list[Array] = []
        for kind, extent in ((_ROW, (rows,)), (_COLUMN, (columns,)), (_FULL, (rows, columns))):
            members = [k for k in sources if kinds[k] == kind]
            given += members
            arrays.append(_stacked([sources[k] for k in members], extent))
        results = np.empty((len(wanted), rows, columns))
        places = {k: place for place, k in enumerate((*given, *wanted))}
        code, scratch = _assembled(program, places, len(places))
        self.run(code, *arrays, results, np.empty((len(arrays[0]) + scratch, BLOCK)))
        return [r.reshape(shape) for r in results]


@cache
def machine() -> Machine:
    """The compiled machine.

    Raises:
        InputError: where numba is not installed.
    """
    engine_of("numba")
    with _ONE_AT_A_TIME:
        jit = import_module("numba").njit
        options = {"nogil": True, "error_model": "numpy"}
        try:
            return Machine(jit(_run, cache=True, **options))
        except RuntimeError:  # nowhere to keep compiled code
            return Machine(jit(_run, **options))


_ONE_AT_A_TIME = threading.Lock()


_ROW, _COLUMN, _FULL = range(3)


def _kind(size: int, shape: Any, rows: int, columns: int) -> int:
    if size == 1:
        return _ROW
    if size == rows * columns:
        return _FULL
    return _COLUMN if shape[-1] == columns else _ROW


def _stacked(parts: Sequence[Any], extent: tuple[int, ...]) -> Array:
    """One array of several; a single one is not copied, unless it is read-only, for which code is compiled apart."""
    if len(parts) == 1 and np.size(parts[0]) == np.prod(extent):
        alone = np.reshape(parts[0], (1, *extent))
        if alone.flags.c_contiguous and alone.flags.writeable:
            return alone
    stack = np.empty((len(parts), *extent))
    for place, part in zip(stack, parts, strict=True):
        place[...] = np.reshape(part, extent) if np.size(part) > 1 else part
    return stack


def _assembled(program: Program, places: Mapping[int, int], first: int) -> tuple[NDArray[np.int64], int]:
    """The program with places for numbers; places from `first` on are scratch. And how many of these it takes."""
    last = {o: k for k, _, operands in program for o in operands}
    where, free, most = dict(places), list[int](), 0
    code = np.zeros((len(program), 4), dtype=np.int64)
    for line, (k, operation, operands) in enumerate(program):
        taken = [where[o] for o in operands]
        if k not in where:  # never the place of an operand: loops whose arrays overlap are not vectorised
            where[k] = free.pop() if free else first + most
            most = max(most, where[k] - first + 1)
        free += [where[o] for o in set(operands) if last[o] == k and where[o] >= first]
        code[line] = EXACT[operation], where[k], taken[0], taken[-1]
    return code, most


def _run(code: Any, by_row: Any, by_column: Any, full: Any, results: Any, registers: Any) -> None:  # noqa: PLR0912, PLR0915
    """Compiled by numba. Places: values by row, by column, full, results, then scratch registers."""
    size = registers.shape[1]
    rows, columns = results.shape[1], results.shape[2]
    end_row = by_row.shape[0]
    end_column = end_row + by_column.shape[0]
    end_full = end_column + full.shape[0]
    end = end_full + results.shape[0]
    for i in range(rows):
        for r in range(end_row):
            if i == 0 or by_row[r, i] != by_row[r, i - 1]:
                registers[r, :] = by_row[r, i]
        for j in range(0, columns, size):
            n = min(size, columns - j)
            for line in range(code.shape[0]):
                operation, d, a, b = code[line, 0], code[line, 1], code[line, 2], code[line, 3]
                if a < end_row:
                    x = registers[a, :n]
                elif a < end_column:
                    x = by_column[a - end_row, j : j + n]
                elif a < end_full:
                    x = full[a - end_column, i, j : j + n]
                elif a < end:
                    x = results[a - end_full, i, j : j + n]
                else:
                    x = registers[a - end + end_row, :n]
                if b < end_row:
                    y = registers[b, :n]
                elif b < end_column:
                    y = by_column[b - end_row, j : j + n]
                elif b < end_full:
                    y = full[b - end_column, i, j : j + n]
                elif b < end:
                    y = results[b - end_full, i, j : j + n]
                else:
                    y = registers[b - end + end_row, :n]
                z = results[d - end_full, i, j : j + n] if d < end else registers[d - end + end_row, :n]
                if operation == _ADD:
                    for k in range(n):
                        z[k] = x[k] + y[k]
                elif operation == _SUB:
                    for k in range(n):
                        z[k] = x[k] - y[k]
                elif operation == _MUL:
                    for k in range(n):
                        z[k] = x[k] * y[k]
                elif operation == _DIV:
                    for k in range(n):
                        z[k] = x[k] / y[k]
                elif operation == _NEG:
                    for k in range(n):
                        z[k] = -x[k]
                elif operation == _SQRT:
                    for k in range(n):
                        z[k] = np.sqrt(x[k])
                elif operation == _ABS:
                    for k in range(n):
                        z[k] = np.abs(x[k])
                elif operation == _MIN:
                    for k in range(n):
                        z[k] = x[k] if (x[k] <= y[k]) | (x[k] != x[k]) else y[k]
                elif operation == _MAX:
                    for k in range(n):
                        z[k] = x[k] if (x[k] >= y[k]) | (x[k] != x[k]) else y[k]
                elif operation == _LT:
                    for k in range(n):
                        z[k] = 1.0 if x[k] < y[k] else 0.0
                elif operation == _LE:
                    for k in range(n):
                        z[k] = 1.0 if x[k] <= y[k] else 0.0
                elif operation == _EQ:
                    for k in range(n):
                        z[k] = 1.0 if x[k] == y[k] else 0.0
                elif operation == _NOT:
                    for k in range(n):
                        z[k] = 1.0 if x[k] == 0 else 0.0
                elif operation == _AND:
                    for k in range(n):
                        z[k] = 1.0 if (x[k] != 0) & (y[k] != 0) else 0.0
                elif operation == _OR:
                    for k in range(n):
                        z[k] = 1.0 if (x[k] != 0) | (y[k] != 0) else 0.0
                elif operation == _IF:
                    for k in range(n):
                        z[k] = y[k] if x[k] != 0 else 0.0
