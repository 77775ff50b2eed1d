"""Comparison of a numeric optimum with the closed-form laws, and with a second formulation of its problem.

One formulation minimises an objective; the other one locates the root pattern of the design.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Unpack

from tmsopt.evaluation.law_rows import LawRow, law_rows
from tmsopt.models import tms
from tmsopt.problem.files import ProblemSource, as_solvable
from tmsopt.problem.solution import Solution
from tmsopt.program.options import CommonOptions, Options, documents_options, make_options
from tmsopt.progress import begin
from tmsopt.records import Tabular, plain
from tmsopt.roots import PATTERNS
from tmsopt.search.solve import solve_any_status
from tmsopt.versions import SCHEMA


@dataclass(frozen=True, repr=False)
class Comparison(Tabular):
    """Comparison of a design with the laws of the paper.

    Attributes:
        design: the solution of the problem in its own formulation.
        laws: one row for each law.
        other: the solution of the other formulation; None if there is none.
        reason: why there is no solution of the other formulation; else empty.

    Example:
        >>> compared = tmsopt.compare("problems/ep4.toml")
        >>> law = next(row for row in compared.laws if row.label == "chib1")  # chi_B = sqrt(zeta_B/zeta_H)
        >>> f"{law.numeric:.6f}"
        '1.414214'

    More: docs/explanation/paper.md
    """

    design: Solution
    laws: tuple[LawRow, ...]
    other: Solution | None
    reason: str

    @property
    def differences(self) -> dict[str, float]:
        """Every free parameter and the abscissa in the other formulation, minus the value of the design."""
        if self.other is None:
            return {}
        free = {n: self.other.parameters[n] - self.design.parameters[n] for n in self.design.problem.free}
        return {**free, "abscissa": self.other.abscissa - self.design.abscissa}

    def records(self) -> Iterable[dict[str, Any]]:
        """One record for each law."""
        return (row.to_json() for row in self.laws)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; nan is None."""
        formulations = {"formulation": self.design.formulation} | plain(self, "other differences reason")
        return {"schema": SCHEMA} | plain(self, "design laws") | {"formulations": formulations}


@documents_options(CommonOptions)
def compare(design: ProblemSource, **options: Unpack[CommonOptions]) -> Comparison:
    """Compare a design with the laws of the paper, which hold only for skates, and solve it in another formulation.

    The laws describe one design at one speed. A problem with scenarios or tolerances is solved again without them.

    Args:
        design: a solution, or a problem or its file, which is solved first.
        options: options of `solve`.

    Example:
        >>> laws = {row.label: row for row in tmsopt.compare("problems/ep4.toml").laws}
        >>> all(abs(laws[label].residual) < 1e-9 for label in ("w01", "chib1", "tls", "frep4"))
        True

    More: docs/explanation/paper.md
    """
    common_options = make_options(options)
    problem = as_solvable(design)
    is_reusable = isinstance(design, Solution) and not (problem.scenarios or problem.tolerances)
    solution = solve_any_status(design if is_reusable else problem.nominal, common_options)
    other, reason = _solve_other_formulation(solution, common_options)
    begin(common_options.progress, "comparing")
    return Comparison(solution, tuple(law_rows(solution)) if solution.problem.model is tms else (), other, reason)


def _solve_other_formulation(design: Solution, options: Options) -> tuple[Solution | None, str]:
    problem = design.problem.posed
    if design.status != "optimal":
        return None, f"the design is {design.status}"
    if not problem.free:
        return None, "nothing is free"
    if problem.locate:
        reformulation = problem.derive(locate=None, minimize="abscissa", maximize=None, start={})
    elif design.structure not in PATTERNS:
        return None, f"the structure '{design.structure}' is not a pattern that can be matched"
    else:
        is_square = len(problem.free) == PATTERNS[design.structure].codimension and not problem.constraints
        reformulation = problem.derive(locate=design.structure, start={})
        if is_square:  # several designs may exist; the start selects the one near this design
            reformulation = reformulation.derive(minimize=None, maximize=None, start=_round_parameters(design))
    other = solve_any_status(reformulation, options)
    if other.status != "optimal":
        return None, f"the {other.formulation} formulation has the status {other.status}"
    return other, ""


def _round_parameters(design: Solution) -> dict[str, float]:
    """The free parameters rounded to two digits, within their ranges."""
    box = design.problem.free
    return {n: min(max(float(f"{design.parameters[n]:.2g}"), low), high) for n, (low, high) in box.items()}
