"""How sensitive each eigenvalue of a design is: phase rigidity, Petermann factor and condition number."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from tmsopt.models.user_spectrum import eigenfrequencies
from tmsopt.problem.evaluate import evaluate_matrices
from tmsopt.problem.files import ProblemSource
from tmsopt.problem.problem import Problem
from tmsopt.progress import Listener
from tmsopt.records import Complex, Tabular, plain
from tmsopt.roots import Root, condition_eigenvalue
from tmsopt.search.solve import solve_if_needed

_NAMES = "phase_rigidity petermann condition"  # names of the sensitivities, in JSON too
_DIGITS = 9  # digits of sensitivities in JSON; rounding errors grow with the condition number
_SAME_ROOT = 1e-9  # distance between a root and the same root in a list of multiple roots, divided by the largest root


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

    Example:
        >>> found = tmsopt.eigenvalues("problems/ep4.toml")  # four roots coincide
        >>> [(s.multiplicity, s.phase_rigidity, s.petermann) for s in found.entries]
        [(4, 0.0, inf)]

    More: docs/explanation/exceptional_points.md
    """

    problem: Problem
    entries: tuple[Eigenvalue, ...]

    def records(self) -> Iterable[Mapping[str, Any]]:
        """One row for each eigenvalue."""
        return (vars(entry) for entry in self.entries)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; infinite numbers are None."""
        return {"eigenvalues": [entry.to_json() for entry in self.entries]}


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
    return Eigenvalues(solution.problem, tuple(entries))


def measure_sensitivity(matrices: Complex, s: complex, multiplicity: int, is_defective: bool) -> dict[str, float]:
    """The phase rigidity, the Petermann factor and the condition number of an eigenvalue, by name."""
    rigidity, condition = (0.0, math.inf) if is_defective else condition_eigenvalue(matrices, s, multiplicity)
    return dict(zip(_NAMES.split(), (rigidity, rigidity**-2 if rigidity else math.inf, condition), strict=True))


def sensitivity_to_json(record: Any) -> dict[str, Any]:
    """The sensitivities of an eigenvalue or a diagnosis as plain data; infinite numbers are None."""
    return plain(record, _NAMES, digits=_DIGITS)
