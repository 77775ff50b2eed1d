"""The matrices of a problem as functions of its free parameters, with their derivatives."""

from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np

from tmsopt.algebra.formula import Formula, fold, formula, symbol
from tmsopt.algebra.kinds import CASADI
from tmsopt.algebra.sequence import golden_steps
from tmsopt.models.stated.pairs import Pair
from tmsopt.problem.problem import Posed
from tmsopt.records import Array, Complex, Numbers, Table
from tmsopt.roots.chains import linearise

_SIZE_SAMPLES = 16  # designs from which the unit of the eigenvalues is found


@dataclass(frozen=True, eq=False)
class Family:
    """A matrix polynomial L(s) = Σ Pₖ s^(d−k) whose entries depend on real parameters.

    Attributes:
        names: the free parameters.
        box: least and greatest value of each parameter, shape (m, 2).
        shape: d + 1, n, n.
        entries: real and imaginary part of each entry, as a formula of the parameters.
        is_complex: whether the entries are complex.
    """

    names: tuple[str, ...]
    box: Array
    shape: tuple[int, int, int]
    entries: Formula
    is_complex: bool

    @property
    def size(self) -> int:
        """Number of eigenvalues, if the leading matrix is regular."""
        return (self.shape[0] - 1) * self.shape[1]

    @property
    def widths(self) -> Array:
        """Width of each range."""
        return np.asarray(self.box[:, 1] - self.box[:, 0])

    @cached_property
    def typical_size(self) -> float:
        """Median over the box of the largest |s|; for complex matrices, of the largest distance of s from its mean."""
        steps = golden_steps(len(self.names))
        points = (0.5 + np.arange(_SIZE_SAMPLES)[:, None] * steps) % 1.0
        sizes = list[float]()
        for p in self.box[:, 0] + self.widths * points:
            with suppress(np.linalg.LinAlgError):
                eigenvalues = np.linalg.eigvals(linearise(self.matrices(p)))
                sizes.append(float(np.abs(eigenvalues - self.is_complex * eigenvalues.mean()).max()))
        return float(np.median(sizes)) if sizes else 1.0

    @cached_property
    def _varying(self) -> tuple[list[int], ca.Function]:
        """The outputs that depend on parameters, and the function p → (these outputs, their Jacobian)."""
        varying_steps = self.entries.dependent_steps(self.names)
        outputs = [k for k, o in enumerate(self.entries.outputs) if o in varying_steps]
        p = ca.SX.sym("p", len(self.names))
        varying = self.entries.extract([self.entries.outputs[k] for k in outputs])
        values = fold(varying, dict(zip(self.names, ca.vertsplit(p), strict=True)), CASADI)
        column = ca.densify(ca.vertcat(ca.SX(0, 1), *values))
        return outputs, ca.Function("matrices", [p], [column, ca.jacobian(column, p)])

    @cached_property
    def _constant(self) -> Array:
        """Values of the outputs, 0 for those that depend on parameters."""
        varying, values = set(self._varying[0]), np.zeros(len(self.entries.outputs))
        constants = [k for k in range(len(values)) if k not in varying]
        fixed = fold(self.entries.extract([self.entries.outputs[k] for k in constants]), {}, CASADI)
        values[constants] = [float(x) for x in fixed]
        return values

    def matrices(self, p: Array) -> Complex:
        """P₀ … P_d at a design, shape (d + 1, n, n)."""
        return self.expand(p)[0]

    def expand(self, p: Array) -> tuple[Complex, Complex]:
        """The matrices at a design, and their derivatives with respect to each parameter, shape (m, d + 1, n, n)."""
        outputs, function = self._varying
        column, jacobian = function(p.tolist())
        values = self._constant.copy()
        values[outputs] = column.full().ravel()
        rows, columns = jacobian.sparsity().get_triplet()
        slopes = np.zeros((len(self.names), len(values)))
        slopes[columns, np.array(outputs, dtype=int)[rows]] = jacobian.nonzeros()
        return self._assemble(values), self._assemble(slopes)

    def _assemble(self, parts: Array) -> Complex:
        return np.asarray((parts[..., ::2] + 1j * parts[..., 1::2]).reshape(*parts.shape[:-1], *self.shape))


def family_of(problem: Posed, parameters: Numbers = Table()) -> Family:
    """The matrices of a problem as functions of its free parameters. The problem must have matrices.

    Args:
        parameters: values of the other parameters, if they differ from those of the problem, as in its cases.
    """
    return _build_family(problem, tuple(float(parameters.get(n, x)) for n, x in problem.fixed.items()))


@lru_cache(maxsize=16)
def _build_family(problem: Posed, fixed: tuple[float, ...]) -> Family:
    assert problem.model.pencil is not None
    constants = problem.as_nodes(dict(zip(problem.fixed, fixed, strict=True)))
    parameters = problem.ordered({**constants, **{n: symbol(n) for n in problem.free}})
    matrices = problem.model.pencil(problem.parameter_set.native(parameters))
    parts = [y for P in matrices for row in P for x in row for y in ((x.re, x.im) if isinstance(x, Pair) else (x, 0))]
    n = len(matrices[0])
    names, box = tuple(problem.free), np.array([*problem.free.values()], dtype=float).reshape(-1, 2)
    return Family(names, box, (len(matrices), n, n), formula(parts, names), problem.model.is_complex)
