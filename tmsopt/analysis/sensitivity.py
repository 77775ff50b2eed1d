"""How sensitive each eigenvalue of a design is: phase rigidity, Petermann factor, and the nearest EP2."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tmsopt.chains import family_of, find_point, targets_of
from tmsopt.models.user_spectrum import eigenfrequencies
from tmsopt.problem.evaluate import evaluate_matrices
from tmsopt.problem.files import ProblemSource
from tmsopt.problem.problem import Posed, Problem
from tmsopt.progress import Listener
from tmsopt.records import Complex, Numbers, Table, Tabular, plain
from tmsopt.roots import Root, condition_eigenvalue
from tmsopt.roots.chains import linearise
from tmsopt.search.solve import solve_if_needed

_NAMES = "phase_rigidity petermann condition"  # names of the sensitivities, in JSON too
_DIGITS = 9  # digits of sensitivities in JSON; rounding errors grow with the condition number
_SAME_ROOT = 1e-9  # distance between a root and the same root in a list of multiple roots, divided by the largest root
_NEAR = 0.1  # an EP2 is near if the relative changes that lead to it are at most this
_ROUNDED_ZERO = 1e-9  # a value below this share of its range may be a rounded 0


@dataclass(frozen=True)
class Eigenvalue(Root):
    """An eigenvalue with its sensitivity, which `Eigenvalues` explains.

    Attributes:
        eigenfrequency: ω = i s for a complex system, otherwise None.
    """

    phase_rigidity: float = math.nan
    petermann: float = math.nan
    condition: float = math.nan
    eigenfrequency: complex | None = None

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; infinite numbers are None."""
        omega = "" if self.eigenfrequency is None else " eigenfrequency"
        return plain(self, f"re im multiplicity{omega}") | sensitivity_to_json(self)


@dataclass(frozen=True)
class NearbyPoint:
    """A point near a design at which two of its eigenvalues coincide with one eigenvector.

    Attributes:
        parameters, changes: the free parameters there, or all parameters if none is free; their changes.
        distance: root of the sum of squares of the relative changes. For a parameter that is 0, the change is divided
            by its range, or by 1 if it is fixed.
        angle: between the eigenvectors z of the two eigenvalues at the design, in radians, from 0 to π/2.
    """

    parameters: Table[float]
    changes: Table[float]
    distance: float
    angle: float


@dataclass(frozen=True, repr=False)
class Eigenvalues(Tabular):
    """All eigenvalues of a design with their sensitivities.

    Let the matrices P₀ … P_d of L(s) = Σ Pₖ s^(d−k) be 1 and −A, 1 and iH, or M, D and K. Let z and w be the right and
    left eigenvectors of the state (for M, D and K it is (q, q′)), and let x and y be the null vectors of L(s). The
    phase rigidity is r = |w* z|/(|w| |z|), the Petermann factor is 1/r². The condition number is 1/r for A and H, and
    (‖M‖ |s|² + ‖D‖ |s| + ‖K‖) |x| |y|/|y* L′(s) x| for M, D and K (Tisseur 2000, there divided by |s|).

    Attributes:
        problem: the problem that the design solves.
        entries: the eigenvalues in the order of the roots of the solution. A defective eigenvalue has phase rigidity 0
            and infinite Petermann factor and condition number. A semisimple eigenvalue has one phase rigidity,
            1/‖Π‖ with the projector Π onto its eigenvectors. Without matrices, the companion matrix counts.
        nearest_EP2: the nearest EP2 that was found, if all eigenvalues are simple and it is within 10 %; else None.

    Example:
        >>> found = tmsopt.eigenvalues("problems/ep4.toml")  # four roots coincide
        >>> [(s.multiplicity, s.phase_rigidity, s.petermann) for s in found.entries]
        [(4, 0.0, inf)]

    More: docs/explanation/exceptional_points.md
    """

    problem: Problem
    entries: tuple[Eigenvalue, ...]
    nearest_EP2: NearbyPoint | None = None

    def records(self) -> Iterable[Mapping[str, Any]]:
        """One row for each eigenvalue."""
        return (vars(entry) for entry in self.entries)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; infinite numbers are None."""
        return plain({"eigenvalues": self.entries}) | plain(self, "nearest_EP2")


def eigenvalues(design: ProblemSource, *, progress: Listener | None = None) -> Eigenvalues:
    """All eigenvalues of a design with phase rigidity, Petermann factor and condition number.

    Args:
        design: a solution, or a problem or its file, which is solved first.
        progress: called with a `tmsopt.Progress` now and then.

    Example:
        >>> dimer = tmsopt.models.from_hamiltonian([["1j*g", "k"], ["k", "-1j*g"]])
        >>> found = tmsopt.eigenvalues(tmsopt.Problem(dimer, fixed={"g": 1.0, "k": 2.0}))
        >>> [f"{s.petermann:.9f}" for s in found.entries]  # k²/(k² - g²), which is 4/3
        ['1.333333333', '1.333333333']

    More: docs/explanation/exceptional_points.md
    """
    solution = solve_if_needed(design, progress)
    problem, roots = solution.problem.posed, solution.roots
    parameters = solution.worst.applied(solution.parameters) if solution.worst else dict(solution.parameters)
    matrices = evaluate_matrices(problem.model, problem.parameter_set, parameters).astype(complex)
    tolerance = _SAME_ROOT * max((r.size for r in solution.roots), default=0.0)
    semisimple = [complex(m.re, m.im) for m in solution.meetings if m.longest == 1]

    def measure(root: Root) -> dict[str, float]:
        s = complex(root.re, root.im)
        is_defective = root.multiplicity > 1 and all(abs(s - other) > tolerance for other in semisimple)
        return measure_sensitivity(matrices, s, root.multiplicity, is_defective)

    frequencies = (complex(z.re, z.im) for z in eigenfrequencies(problem.model, roots))
    entries = (
        Eigenvalue(r.re, r.im, r.multiplicity, **measure(r), eigenfrequency=next(frequencies, None)) for r in roots
    )
    is_simple = all(root.multiplicity == 1 for root in roots)
    return Eigenvalues(solution.problem, tuple(entries), _find_nearby(problem, parameters) if is_simple else None)


def _find_nearby(problem: Posed, parameters: Numbers) -> NearbyPoint | None:
    """The nearest EP2, from the two eigenvalues that are nearest each other; None if there is none near the design."""
    if problem.model.pencil is None:
        return None
    names = [*problem.free] or [*parameters]
    p, box = (np.array([x[n] for n in names]) for x in (parameters, dict.fromkeys(names, (0, 0)) | dict(problem.free)))
    widths = np.ptp(box, axis=1)
    widths = np.where(np.abs(p) > _ROUNDED_ZERO * widths, np.abs(p), widths + (widths == 0))
    box = p[:, None] + _NEAR * widths[:, None] * [-1, 1]
    fixed = {n: x for n, x in parameters.items() if n not in names}
    family = family_of(problem.derive(fixed=fixed, free=dict(zip(names, map(tuple, box), strict=True))))
    is_complex, points = family.is_complex, list[NearbyPoint]()
    for name in ("EP2",) if is_complex else ("EP2", "CEP2"):
        point = find_point(family, targets_of(name, is_complex), p)
        if point and point.is_found:
            s, vectors = np.linalg.eig(linearise(family.matrices(p)))
            x, y = vectors.T[np.argsort(np.abs(s - point.roots[0]))[:2]]
            overlap = np.vdot(x, y)
            angle = math.atan2(np.linalg.norm(y - overlap * x), abs(overlap))
            there, changes = (Table(dict(zip(names, q.tolist(), strict=True))) for q in (point.p, point.p - p))
            points.append(NearbyPoint(there, changes, float(np.linalg.norm((point.p - p) / widths)), angle))
    return min((q for q in points if q.distance <= _NEAR), key=lambda q: q.distance, default=None)


def measure_sensitivity(matrices: Complex, s: complex, multiplicity: int, is_defective: bool) -> dict[str, float]:
    """The phase rigidity, the Petermann factor and the condition number of an eigenvalue, by name."""
    rigidity, condition = (0.0, math.inf) if is_defective else condition_eigenvalue(matrices, s, multiplicity)
    return dict(zip(_NAMES.split(), (rigidity, rigidity**-2 if rigidity else math.inf, condition), strict=True))


def sensitivity_to_json(record: Any) -> dict[str, Any]:
    """The sensitivities of an eigenvalue or a diagnosis as plain data; infinite numbers are None."""
    return plain(record, _NAMES, digits=_DIGITS)
