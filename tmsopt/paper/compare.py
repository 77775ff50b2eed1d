"""A numeric optimum beside the closed-form laws, law by law, and beside the other formulation."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from tmsopt.checks.law_rows import LawRow, law_rows
from tmsopt.design.problem import Problem
from tmsopt.design.solution import Solution
from tmsopt.models import tms
from tmsopt.records import SCHEMA, Progress, plain
from tmsopt.roots import PATTERNS
from tmsopt.solver.multistart import STARTS
from tmsopt.solver.solve import solve


@dataclass(frozen=True)
class Comparison:
    """What `compare` found.

    Attributes:
        design: the solution of the problem as stated.
        laws: one row per law.
        other: the solution by the other formulation, if there is one.
        reason: why there is no other formulation to compare with; empty if there is.
    """

    design: Solution
    laws: tuple[LawRow, ...]
    other: Solution | None
    reason: str

    @property
    def differences(self) -> dict[str, float]:
        """Other formulation minus the design, for every free parameter and the abscissa."""
        if self.other is None:
            return {}
        free = {n: self.other.parameters[n] - self.design.parameters[n] for n in self.design.problem.free}
        return {**free, "abscissa": self.other.abscissa - self.design.abscissa}

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; numbers that do not exist are None."""
        formulations = {"formulation": self.design.formulation} | plain(self, "other differences reason")
        return {"schema": SCHEMA} | plain(self, "design laws") | {"formulations": formulations}


def compare(
    design: Solution | Problem,
    *,
    starts: int = STARTS,
    seed: int = 0,
    linear_solver: str = "mumps",
    progress: Progress | None = None,
) -> Comparison:
    """Set a design beside the laws of the paper, which are of skates alone, and solve it by the other formulation.

    The laws are of one design at one speed: scenarios and tolerances are left aside, and the problem is solved again.

    Args:
        design: a solution, or a problem to solve first.
        starts, seed, linear_solver, progress: as for `solve`, for the solves that this takes.
    """

    def solved(problem: Problem) -> Solution:
        return solve(problem, starts=starts, seed=seed, linear_solver=linear_solver, throw=False, progress=progress)

    problem = design if isinstance(design, Problem) else design.problem
    if problem.scenarios or problem.tolerances:
        design = problem.nominal
    if isinstance(design, Problem):
        design = solved(design)
    other, reason = _other_formulation(design, solved)
    return Comparison(design, tuple(law_rows(design)) if design.problem.model is tms else (), other, reason)


def _other_formulation(design: Solution, solved: Callable[[Problem], Solution]) -> tuple[Solution | None, str]:
    problem = design.problem
    if design.status != "optimal":
        return None, f"the design is {design.status}"
    if not problem.free:
        return None, "nothing is free"
    if problem.locate:
        restated = replace(problem, locate=None, minimize="abscissa", maximize=None, start={})
    elif design.structure not in PATTERNS:
        return None, f"the structure '{design.structure}' is not a pattern that can be matched"
    else:
        square = len(problem.free) == PATTERNS[design.structure].codimension and not problem.constraints
        restated = replace(problem, locate=design.structure, start={})
        if square:  # there may be several such designs: the one near this
            restated = replace(restated, minimize=None, maximize=None, start=_near(design))
    other = solved(restated)
    if other.status != "optimal":
        return None, f"the {other.formulation} formulation ended {other.status}"
    return other, ""


def _near(design: Solution) -> dict[str, float]:
    """The free parameters to two digits, within their box."""
    box = design.problem.free
    return {n: min(max(float(f"{design.parameters[n]:.2g}"), low), high) for n, (low, high) in box.items()}
