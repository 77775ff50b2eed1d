"""The unit in which the roots of a problem are near 1, so that coefficients of a high degree are alike in size."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tmsopt.arithmetic.sequence import golden_steps
from tmsopt.design.problem import Problem
from tmsopt.design.quantities import ARRAY_ROOT_QUANTITIES, regular
from tmsopt.models import Values
from tmsopt.roots import roots

_DESIGNS = 33
_ORDINARY = (1e-2, 1e3)


@dataclass(frozen=True)
class Scale:
    """Powers of 2, so that scaling does not round.

    Attributes:
        unit: of the roots.
        lead: of the leading coefficient.
    """

    unit: float = 1.0
    lead: float = 1.0

    def scaled(self, coefficients: Sequence[Any]) -> list[Any]:
        """Coefficients, descending, of the polynomial in s/unit, over the unit of the leading one."""
        if self == Scale():
            return list(coefficients)
        n = len(coefficients) - 1
        return [c / (self.lead * self.unit**k) for k, c in zip(range(n + 1), coefficients, strict=True)]


def scale_of(problem: Problem) -> Scale:
    """Median sizes of roots and leading coefficients over some designs of the box.

    Every unit is as exact as another; this one makes tolerances mean the same for all equations.
    """
    if problem.model.natural:
        return Scale()
    with np.errstate(all="ignore"):
        found = problem.model.coefficients(problem.ordered(_designs(problem)), problem.parameter_set)
        a = np.stack(np.broadcast_arrays(*(np.asarray(c, dtype=float) for c in found)), axis=-1)
    a = a.reshape(-1, a.shape[-1])
    a = a[np.all(np.isfinite(a), axis=1) & np.any(a != 0, axis=1)]
    if not len(a):
        return Scale()
    a = regular(a)
    size = np.abs(roots(a))
    size = size[(size > 0) & (size < 1e100)]
    return Scale(_power_of_two(size), _power_of_two(np.abs(a[:, 0])))


def objective_size(problem: Problem) -> float:
    """Size below which differences of the objective are none, relative: that of the roots where it is about these."""
    about = problem.objective.names if problem.objective else ()
    return min(1.0, scale_of(problem).unit) if about == ("abscissa",) else 1.0


def _designs(problem: Problem) -> dict[str, Any]:
    """Columns of designs spread over the box."""
    names = list(problem.free)
    share = (0.5 + np.arange(_DESIGNS)[:, None] * golden_steps(len(names))) % 1.0 if names else np.zeros((1, 0))
    lower, upper = (np.array([ends[k] for ends in problem.free.values()]) for k in (0, 1))
    return dict(zip(names, (lower + (upper - lower) * share).T, strict=True))


def objective_unit(problem: Problem) -> float:
    """A power of 2 near the size of a small objective: a solver brings large ones down by itself, but none up."""
    if problem.model.natural or problem.objective is None or not problem.free:
        return 1.0
    columns = {n: np.broadcast_to(x, _DESIGNS) for n, x in problem.ordered(_designs(problem)).items()}
    values = Values(problem.model, problem.parameter_set, columns, extra=ARRAY_ROOT_QUANTITIES)
    size = np.abs(np.atleast_1d(problem.objective(values)))
    size = size[np.isfinite(size) & (size > 0)]
    return _power_of_two(size) if len(size) and np.median(size) < _ORDINARY[0] else 1.0


def units_of(problem: Problem) -> tuple[float, ...]:
    """For each free parameter a power of 2 near the size of its range, or 1 where that is near enough."""
    if problem.model.natural:
        return ()
    sizes = [max(map(abs, ends)) for ends in problem.free.values()]
    return tuple(1.0 if _ORDINARY[0] <= size <= _ORDINARY[1] else _power_of_two(np.array([size])) for size in sizes)


def _power_of_two(sizes: Any) -> float:
    return float(2.0 ** np.round(np.log2(np.median(sizes)))) if len(sizes) else 1.0
