"""The plane of two free parameters of a problem, and the matrices over it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.errors import Fault, InputError, input_error, is_number, list_faults, short, table_faults
from tmsopt.problem import Posed, ProblemSource, Solution, pose
from tmsopt.progress import Listener
from tmsopt.records import Array, Complex, Table
from tmsopt.roots.chains import linearise
from tmsopt.search.solve import solve_if_needed

_SAME = 1e-9  # real parts that differ by less than this share of the largest eigenvalue are equal


@dataclass(frozen=True)
class ParameterPlane:
    """A plane of two parameters.

    Attributes:
        problem: the problem in which only these two parameters are free.
        centre: the values of both.
        solution: the solution of the problem, if the centre needs it.
    """

    problem: Posed
    centre: Array
    solution: Solution | None

    @property
    def names(self) -> tuple[str, ...]:
        """The two parameters, the horizontal one first."""
        return tuple(self.problem.free)

    @property
    def design(self) -> Table[float]:
        """Every parameter at the centre."""
        return Table(self.problem.ordered(self.name_values(self.centre)))

    def name_values(self, point: Array) -> dict[str, float]:
        """The two parameters at a point, by name."""
        return dict(zip(self.names, point.tolist(), strict=True))

    def matrices(self, points: Array) -> Any:
        """The linearised matrices at points, shape (k, N, N); nan where they are not defined.

        Args:
            points: shape (k, 2).
        """
        model, parameters = self.problem.model, self.problem.ordered(dict(zip(self.names, points.T, strict=True)))
        assert model.pencil is not None
        with np.errstate(all="ignore"):
            matrices = model.pencil(self.problem.parameter_set.native(parameters))
            entries = [[[np.broadcast_to(x, len(points)) for x in row] for row in P] for P in matrices]
            P = np.moveaxis(np.array(entries, dtype=complex), -1, 0)
            is_singular = np.linalg.slogdet(P[:, 0])[0] == 0
            M = linearise(np.where(is_singular[:, None, None, None], np.nan, P))
        return M if model.is_complex else M.real

    def user_values(self, s: Complex) -> Complex:
        """The eigenvalues that the user sees: ω = i s for a complex system."""
        return 1j * s if self.problem.model.is_complex else s


def split_complex(z: complex) -> list[float]:
    """Real and imaginary part."""
    return [z.real, z.imag]


def order_by_parts(values: Complex) -> NDArray[np.intp]:
    """Indices of eigenvalues along the last axis by their real parts; equal ones by their imaginary parts."""
    unit = _SAME * np.nanmax(np.abs(values), initial=0.0) or 1.0
    return np.asarray(np.lexsort((values.imag, np.round(values.real / unit)), axis=-1))


def plane_of(
    source: ProblemSource,
    key: str,
    names: Sequence[str] | None,
    centre: Mapping[str, float] | None,
    progress: Listener | None,
    faults: list[Fault],
) -> ParameterPlane:
    """The plane of two free parameters through a point, by default through the solution of a problem with a pattern.

    Args:
        key: the argument that has the names, for messages.
        centre: values of free parameters, instead of the solution, the start, or the middle of the range.
        faults: faults of other arguments.

    Raises:
        InputError: for a problem without matrices or with fewer than two free parameters, and for faults of arguments.
    """
    problem = pose(source).nominal
    free, given = [*problem.free], {} if centre is None else centre
    if problem.model.pencil is None:
        raise input_error("is given by coefficients, so it has no eigenvectors; accepted: matrices", "model")
    if len(free) < 2:
        found = f"found {len(free)} ({', '.join(free) or 'none'})"
        raise input_error(f"two parameters must be free, {found}; write NAME = {{ min = …, max = … }}", "parameters")
    chosen = free[:2] if names is None else names
    if list_faults(key, chosen, "") or len(chosen) != 2 or len({*free}.intersection(map(str, chosen))) != 2:
        faults.append(Fault(f"found {short(names)}; accepted: two of {' '.join(free)}", (key,)))
    if table_faults("centre", given, "") or not all(n in free and is_number(x) for n, x in given.items()):
        faults.append(
            Fault(f"found {short(given)}; accepted: finite numbers for some of {' '.join(free)}", ("centre",))
        )
    if faults:
        raise InputError(faults)
    is_needed = isinstance(source, Solution) or (problem.locate and not {*free} <= {*given})
    solution = solve_if_needed(source, progress) if is_needed else None
    middle = {n: problem.start.get(n, (low + high) / 2) for n, (low, high) in problem.free.items()}
    point = {**problem.fixed, **middle, **(solution.parameters if solution else {}), **given}
    plane = problem.derive(
        free={n: problem.free[n] for n in chosen}, fixed={n: x for n, x in point.items() if n not in chosen}, start={}
    )
    return ParameterPlane(plane, np.array([point[n] for n in chosen], dtype=float), solution)
