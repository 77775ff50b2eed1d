"""Rivals that search on until somebody stops them: SciPy's, CMA-ES and PyGRANSO, all on the eigenvalues.

Each is given the problem, the box and the constraints in the form that suits it, and restarts for ever; the race that
watches the evaluations decides when it is over.
"""

import contextlib
import io
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec
from itertools import count
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy.optimize import dual_annealing

from benchmarks.rivals.reduced import Reduced, Watch, cobyla, differential, nelder_mead, slsqp
from tmsopt.design.problem import Problem
from tmsopt.formulation.starts import designs
from tmsopt.records import Array

_MANY = 1_000_000
_STEP = 1e-6  # of the box, for central differences of smooth functions: right to some 1e-10


@dataclass(frozen=True)
class Seeker:
    """A search and the packages it needs beyond those of the project.

    Attributes:
        search: (problem, watch) → only when it gives up; watch is told of every evaluation and may end it.
    """

    search: Callable[[Problem, Watch], None]
    packages: tuple[str, ...] = ()

    @property
    def obstacle(self) -> str:
        """Why it cannot run; empty where it can. Its packages are imported, which is nobody's time."""
        absent = [name for name in self.packages if "." not in name and find_spec(name) is None]
        if absent:
            return f"not installed: {', '.join(absent)}"
        try:
            with _quiet():
                numeric = import_module("numpy.core.numeric")
                with patch.object(numeric, "Inf", np.inf, create=True):  # PyGRANSO 1.2 wants it, NumPy 2 dropped it
                    for name in self.packages:
                        import_module(name)
        except ImportError as error:
            return f"cannot be imported: {error}"
        return ""

    @property
    def versions(self) -> str:
        """Of its packages, as they are distributed."""
        return ", ".join(f"{n} {version(n)}" for n in self.packages if "." not in n)


def _local(rival: Callable[..., Any]) -> Seeker:
    return Seeker(lambda problem, watch: rival(problem, starts=_MANY, watch=watch))


def _evolution(problem: Problem, watch: Watch) -> None:
    for seed in count():
        differential(problem, seed, vectorized=True, watch=watch)


def _annealing(problem: Problem, watch: Watch) -> None:
    """SciPy's generalised simulated annealing with its local searches, violations as an exact penalty."""
    reduced = Reduced(problem, watch)
    for seed in count():
        with _quiet():
            dual_annealing(reduced.penalised, list(zip(reduced.lower, reduced.upper, strict=True)), rng=seed)


def _cma_es(problem: Problem, watch: Watch) -> None:
    """BIPOP-CMA-ES in the unit box, a population at once: bounds by its own transformation, violations as a penalty."""
    cma = import_module("cma")
    reduced = Reduced(problem, watch)
    width = reduced.upper - reduced.lower

    def generation(designs: Any) -> list[float]:
        return [float(v) for v in reduced.penalised(reduced.lower[:, None] + width[:, None] * np.array(designs).T)]

    for seed, start in enumerate(_starts(reduced), start=1):
        options = {"bounds": [0, 1], "seed": seed, "verbose": -9, "tolfun": 1e-13, "tolx": 1e-13, "tolflatfitness": 20}
        with _quiet():
            first = np.clip((start - reduced.lower) / width, 0.05, 0.95)
            cma.fmin2(None, first, 0.3, options, restarts=9, bipop=True, parallel_objective=generation)


def _pygranso(problem: Problem, watch: Watch) -> None:
    """BFGS-SQP for constrained nonsmooth functions, with exact gradients and the box as constraints."""
    torch = import_module("torch")
    torch.set_num_threads(1)  # a dozen numbers are not worth a second thread
    granso = import_module("pygranso.pygranso").pygranso
    struct = import_module("pygranso.pygransoStruct").pygransoStruct
    reduced = Reduced(problem, watch)
    width = reduced.upper - reduced.lower

    def tensor(a: Any) -> Any:
        return torch.tensor(np.asarray(a, dtype=float))

    def combined(variables: Any) -> list[Any]:
        x = reduced.lower + width * variables.x.detach().numpy().ravel()
        slope, row_slopes = slopes(reduced, x)
        share, unit = (x - reduced.lower) / width, np.eye(len(x))
        limits = np.concatenate([-reduced.rows(x), -share, share - 1])
        inward = np.concatenate([-row_slopes * width, -unit, unit]).T
        return [
            reduced.abscissa(x),
            tensor(slope * width)[:, None],
            tensor(limits)[:, None],
            tensor(inward),
            None,
            None,
        ]

    for start in _starts(reduced):
        options = struct()
        options.x0 = tensor((start - reduced.lower) / width)[:, None]
        options.globalAD, options.print_level, options.quadprog_info_msg = False, 0, False
        options.opt_tol, options.viol_ineq_tol, options.maxit = 1e-10, 1e-9, 1000
        # it ends the interpreter where a function is not finite: that is the end of one start
        with _quiet(), contextlib.suppress(SystemExit):
            granso(var_spec={"x": [len(start), 1]}, combined_fn=combined, user_opts=options)


SEEKERS: Mapping[str, Seeker] = {
    "SLSQP": _local(slsqp),
    "Nelder–Mead": _local(nelder_mead),
    "COBYLA": _local(cobyla),
    "differential evolution": Seeker(_evolution),
    "dual annealing": Seeker(_annealing),
    "CMA-ES": Seeker(_cma_es, ("cma",)),
    "PyGRANSO": Seeker(_pygranso, ("torch", "osqp", "gurobipy", "pygranso", "pygranso.pygranso")),
}
"""By name: local searches from one start after another, global ones from one seed after another."""


def slopes(reduced: Reduced, x: Array) -> tuple[Array, Array]:
    """Gradient of the abscissa (n,) and of the rows (rows, n) at one design.

    The rightmost root z moves by dz = −Σ da_k z^(4−k) / p'(z); the coefficients and rows are smooth, so central
    differences serve for them.
    """
    step = np.diag(_STEP * (reduced.upper - reduced.lower))
    around = np.concatenate([x[:, None] + step, x[:, None] - step], axis=1)
    forward, backward = np.split(reduced.coefficients(around), 2)
    with np.errstate(all="ignore"):
        a, twice = reduced.coefficients(x), 2 * np.diag(step)
        found = np.roots(a)
        z = found[int(np.argmax(found.real))]
        da = (forward - backward) / twice[:, None]
        slope = -(np.polyval(da.T, z) / np.polyval(np.polyder(a), z)).real
        above, below = np.split(reduced.rows(around), 2, axis=-1)
    return np.nan_to_num(slope, posinf=0.0, neginf=0.0), np.nan_to_num((above - below) / twice)


def _starts(reduced: Reduced) -> Iterator[Array]:
    for design in designs(reduced.problem, 0, _MANY):
        yield np.array([design[n] for n in reduced.names])


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Nothing printed and no warnings: a search that fails says so by its best value."""
    with warnings.catch_warnings(), np.errstate(all="ignore"), contextlib.redirect_stdout(io.StringIO()):
        warnings.simplefilter("ignore")
        yield
