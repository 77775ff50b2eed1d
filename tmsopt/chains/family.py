"""The matrices of a problem as functions of its free parameters, with their derivatives."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np

from tmsopt.algebra.formula import Formula, fold, formula, symbol
from tmsopt.algebra.kinds import CASADI
from tmsopt.algebra.sequence import golden_steps
from tmsopt.models.stated.pairs import list_parts
from tmsopt.problem.problem import Posed
from tmsopt.records import Array, Complex, Numbers, Table
from tmsopt.roots.chains import eigenvalues_of

_SIZE_SAMPLES = 16  # designs from which the typical size of the eigenvalues is found


@dataclass(frozen=True, eq=False)
class Family:
    """A matrix polynomial L(s) = Σ Pₖ s^(d−k) whose entries depend on real parameters p.

    Attributes:
        names: the m parameters.
        box: least and greatest value of each parameter, shape (m, 2).
        is_complex: whether the entries are complex.
        expand: function from p to P₀ … P_d, shape (d + 1, n, n), and to their derivatives with respect to each
            parameter, shape (m, d + 1, n, n).
    """

    names: tuple[str, ...]
    box: Array
    is_complex: bool
    expand: Callable[[Array], tuple[Complex, Complex]]

    @property
    def widths(self) -> Array:
        """Width of each range."""
        return np.asarray(self.box[:, 1] - self.box[:, 0])

    def matrices(self, p: Array) -> Complex:
        """The matrices at a design."""
        return self.expand(p)[0]

    def at(self, p: Array) -> "Family":
        """The matrices of one design, as a family without parameters."""
        matrices, slopes = self.expand(p)
        return replace(self, names=(), box=np.empty((0, 2)), expand=lambda _: (matrices, slopes[:0]))

    @cached_property
    def typical_size(self) -> float:
        """Median over the box of the largest |s|; for complex matrices, of the largest distance of s from its mean."""
        points = (0.5 + np.arange(_SIZE_SAMPLES)[:, None] * golden_steps(len(self.names))) % 1.0
        sizes = list[float]()
        for p in self.box[:, 0] + self.widths * points:
            with suppress(np.linalg.LinAlgError):
                s = eigenvalues_of(self.matrices(p))
                sizes.append(float(np.abs(s - self.is_complex * s.mean()).max()))
        return float(np.median(sizes)) if sizes else 1.0


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
    names, box = tuple(problem.free), np.array([*problem.free.values()], dtype=float).reshape(-1, 2)
    parts, n = formula(list_parts(matrices), names), len(matrices[0])
    return Family(names, box, problem.model.is_complex, _compile(parts, (len(matrices), n, n)))


def _compile(parts: Formula, shape: tuple[int, ...]) -> Callable[[Array], tuple[Complex, Complex]]:
    """The function `Family.expand`, for the real and imaginary parts of all entries in turn."""
    varying_steps = parts.dependent_steps(parts.names)
    is_varying = np.array([o in varying_steps for o in parts.outputs], dtype=bool)
    p = ca.SX.sym("p", len(parts.names))
    values = fold(parts, dict(zip(parts.names, ca.vertsplit(p), strict=True)), CASADI)
    constants = np.array([0.0 if varies else float(x) for x, varies in zip(values, is_varying, strict=True)])
    column = ca.densify(ca.vertcat(ca.SX(0, 1), *(x for x, varies in zip(values, is_varying, strict=True) if varies)))
    function, places = ca.Function("matrices", [p], [column, ca.jacobian(column, p)]), np.flatnonzero(is_varying)

    def join(numbers: Array) -> Complex:
        with np.errstate(invalid="ignore"):  # nan where an entry is undefined
            return np.asarray((numbers[..., ::2] + 1j * numbers[..., 1::2]).reshape(*numbers.shape[:-1], *shape))

    @lru_cache(maxsize=8)
    def expand_at(p: tuple[float, ...]) -> tuple[Complex, Complex]:
        column, jacobian = function(p)
        entries, slopes = constants.copy(), np.zeros((len(parts.names), len(constants)))
        entries[places] = column.full().ravel()
        rows, columns = map(np.array, jacobian.sparsity().get_triplet())
        if len(rows):
            slopes[columns, places[rows]] = jacobian.nonzeros()
        return join(entries), join(slopes)

    return lambda p: expand_at(tuple(p.tolist()))
