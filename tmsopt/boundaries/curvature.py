"""Second derivatives along large matrices: of a determinant they are products of entries of the inverse.

With B the inverse of P(s), the derivative of det P by its entries ij and kl is det P (B_ji B_lk − B_jk B_li). A sum of
coefficients is a sum of values of det P(s) on a circle, so the Hessian of a Lagrangian takes a few small matrix
products, where its expression has millions of terms. Solutions do not depend on its last digits: rows and gradients do
not come from here.
"""

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.boundaries.boundaries import Edge
from tmsopt.models import Model, ParameterSet
from tmsopt.records import Array

_WORTH = 50_000
"""Operations of the coefficients, times parameters that move, from which this is faster than an expression."""


class Curvature(ca.Callback):
    """The upper Hessian of the Lagrangian of a nearest point, for CasADi: (x, p, λ of the objective, λ of the rows)."""

    def __init__(self, edge: ca.Function, pencil: "_Pencil", parts: tuple[int, ...]) -> None:
        ca.Callback.__init__(self)
        self._edge, self._pencil, self._ends, self._n = edge, pencil, np.cumsum(parts)[:-1], parts[1]
        extra = edge.size1_in(0)
        self._sizes = (parts[1] + extra, sum(parts), 1, edge.size1_in(2))
        whole = ca.diagcat(ca.DM.ones(parts[1], parts[1]), ca.DM.ones(extra, extra))
        self._upper = ca.triu(ca.sparsify(whole)).sparsity()
        self._rows, self._columns = (np.array(k, dtype=int) for k in self._upper.get_triplet())
        self.construct("hess_lag")

    def get_n_in(self) -> int:
        """x, p, λ of the objective, λ of the rows."""
        return 4

    def get_n_out(self) -> int:
        """The Hessian."""
        return 1

    def get_sparsity_in(self, k: int) -> Any:
        """Columns."""
        return ca.Sparsity.dense(self._sizes[k], 1)

    def get_sparsity_out(self, k: int) -> Any:
        """Two blocks, of displacements and of factors."""
        return self._upper

    def eval(self, given: Any) -> list[Any]:
        """The Hessian in numbers; nan where the matrix is singular on the circle."""
        x, p, objective, rows = (np.array(part.elements()) for part in given)
        y, unknowns = x[: self._n], x[self._n :]
        numbers, weights, scale, sizes, (sign, size) = np.split(p, self._ends)
        by_coefficient, own = (part.full() for part in self._edge(unknowns, sizes, rows))
        with np.errstate(all="ignore"):  # far out in a line search: what is not finite is turned down
            moved = self._pencil.hessian(numbers, weights * size * y, sign * by_coefficient.ravel() / scale, scale)
        found = np.zeros((len(x), len(x)))
        found[: self._n, : self._n] = size**2 * np.outer(weights, weights) * moved + 2 * objective * np.eye(self._n)
        found[self._n :, self._n :] = own
        return [ca.DM(self._upper, found[self._rows, self._columns].tolist())]


class _Pencil:
    """Matrices P(s) = Σ Pᵣ sʳ of a model over its parameters, some of which move."""

    def __init__(self, blocks: Sequence[Sequence[Sequence[Any]]], symbols: ca.SX, moving: Sequence[int]) -> None:
        self._shape, self._moving = (len(blocks), len(blocks[0]), len(blocks[0])), list(moving)
        entries = ca.vertcat(*[ca.SX(e) for block in blocks for row in block for e in row])
        steps = ca.vertcat(*[symbols[k] for k in moving])
        slope = ca.jacobian(entries, steps)
        self._live = np.flatnonzero(np.any(ca.DM(slope.sparsity(), 1).full(), axis=1))
        slope = slope[self._live.tolist(), :]
        w = ca.SX.sym("w", entries.numel())
        bend = ca.hessian(ca.dot(w, entries), steps)[0]
        self._entries = ca.Function("entries", [symbols], [ca.densify(entries)])
        self._slope = ca.Function("slope", [symbols], [slope])
        self._straight = None if ca.depends_on(slope, symbols) else self._slope(0).full()  # on those that stay too
        self._bend = ca.Function("bend", [symbols, w], [bend])

    def hessian(self, numbers: Array, displacement: Array, by_coefficient: Array, scale: Array) -> Array:
        """Second derivatives of a sum of coefficients by the parameters that move."""
        at = numbers.copy()
        at[self._moving] += displacement
        blocks, n, _ = self._shape
        powers, most = np.arange(blocks)[::-1], n * (blocks - 1)
        count = most + 2 + most % 2  # of points on the circle, half of which are conjugate to the others
        s = scale[1] / scale[0] * np.exp(1j * np.pi * (2 * np.arange(count // 2) + 1) / count)
        share = by_coefficient @ s ** -np.arange(len(by_coefficient) - 1, -1, -1.0)[:, None] * (2 / count)
        matrix = np.tensordot(s[:, None] ** powers, np.array(self._entries(at).elements()).reshape(self._shape), axes=1)
        try:
            inverse = np.linalg.inv(matrix)
        except np.linalg.LinAlgError:
            inverse = np.full_like(matrix, np.nan)
        share = share * np.linalg.det(matrix)
        block, row, column = np.unravel_index(self._live, self._shape)
        kept = np.unique(block)  # those in which anything moves
        place = np.searchsorted(kept, block)
        every = (s[:, None, None, None] ** powers[kept][:, None, None] * inverse[:, None]).reshape(len(s), -1)
        z = ((every * share[:, None]).T @ every).real.reshape(len(kept), n, n, len(kept), n, n)
        i, j, k, m = row[:, None], column[:, None], row, column
        second = z[place[:, None], j, i, place, m, k] - z[place[:, None], j, k, place, m, i]
        if self._straight is not None:
            return np.asarray(self._straight.T @ second @ self._straight)
        slope = self._slope(at).full()
        first = np.zeros(np.prod(self._shape))
        first[self._live] = (share @ every).real.reshape(len(kept), n, n)[place, column, row]
        return np.asarray(slope.T @ second @ slope + self._bend(at, first).full())


def curvature(
    model: Model, of: ParameterSet, weights: tuple[str, ...], edge: Edge, operations: int
) -> Curvature | None:
    """The Hessian of nearest points of an edge; None where an expression is quicker, or where the edge is no sum."""
    if model.pencil is None or operations * len(weights) < _WORTH:
        return None
    c, unknowns = ca.SX.sym("c", model.degree + 1), ca.SX.sym("u", len(edge.unknowns))
    sizes = ca.SX.sym("sizes", model.degree + 1)
    column, own = ca.vertsplit(c), [unknowns[k] for k in range(len(edge.unknowns))]
    equations = [e / sizes[k] for e, k in zip(edge.equations(column, own), edge.powers, strict=True)]
    rows = ca.vertcat(*equations, *edge.nonnegative(column, own))
    pull = ca.SX.sym("pull", rows.numel())
    slope = ca.gradient(ca.dot(pull, rows), c)
    if ca.jacobian(slope, ca.vertcat(c, unknowns)).nnz():
        return None
    bend = ca.hessian(ca.dot(pull, rows), unknowns)[0]
    by_edge = ca.Function("edge", [unknowns, sizes, pull], [ca.densify(slope), ca.densify(bend)])
    symbols = ca.SX.sym("p", len(of.names))
    blocks = model.pencil(of.native(dict(zip(of.names, ca.vertsplit(symbols), strict=True))))
    pencil = _Pencil(blocks, symbols, [of.names.index(n) for n in weights])
    return Curvature(by_edge, pencil, (len(of.names), len(weights), model.degree + 1, model.degree + 1, 2))
