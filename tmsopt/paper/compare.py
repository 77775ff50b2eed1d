"""A numeric optimum beside the closed-form laws, law by law, and beside the other formulation."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tmsopt import laws
from tmsopt.design.problem import Problem
from tmsopt.design.solution import Solution
from tmsopt.models import tms
from tmsopt.records import Progress
from tmsopt.roots import PATTERNS, is_stable
from tmsopt.solver.multistart import STARTS
from tmsopt.solver.solve import solve

SAME_LAW = 1e-9
"""Relative difference up to which number and law count as agreeing; coefficients are matched to 1e-10."""


@dataclass(frozen=True)
class LawRow:
    """One law beside the design.

    Attributes:
        label: equation label in the paper.
        subject: what the numbers are.
        numeric: the number of the design, found without the law.
        law: the number that the law gives.
        reason: why the law says nothing about this design; empty where it applies.
    """

    label: str
    subject: str
    numeric: float
    law: float
    reason: str = ""

    @property
    def applies(self) -> bool:
        """Whether the law's conditions hold for the design."""
        return not self.reason

    @property
    def residual(self) -> float:
        """Numeric minus law."""
        return self.numeric - self.law

    @property
    def relative(self) -> float:
        """Residual relative to the law, or to 1 where the law says 0."""
        return self.residual / (abs(self.law) or 1.0)

    @property
    def agrees(self) -> bool | None:
        """Whether number and law agree; None where the law does not apply."""
        return abs(self.relative) <= SAME_LAW if self.applies else None


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

        def number(x: float) -> float | None:
            return float(x) if math.isfinite(x) else None

        return {
            "schema": 1,
            "design": self.design.to_json(),
            "laws": [
                {
                    "label": row.label,
                    "subject": row.subject,
                    "numeric": number(row.numeric),
                    "law": number(row.law),
                    "residual": number(row.residual) if row.applies else None,
                    "relative": number(row.relative) if row.applies else None,
                    "applies": row.applies,
                    "agrees": row.agrees,
                    "reason": row.reason,
                }
                for row in self.laws
            ],
            "formulations": {
                "formulation": self.design.formulation,
                "other": None if self.other is None else self.other.to_json(),
                "differences": {name: number(x) for name, x in self.differences.items()},
                "reason": self.reason,
            },
        }


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


def law_rows(design: Solution) -> Iterator[LawRow]:
    """Every law, with the reason where its conditions do not hold."""
    p = {name: float(value) for name, value in design.dimensionless.items()}
    heights = {k: p[k] for k in ("zeta_B", "zeta_H")}
    tilt = {"lambda_s": p["lambda_s"]}
    not_ep4 = "" if design.structure == "EP4" else f"holds at EP4; {_why_not_ep4(design)}"
    not_one = "" if p["chi_H"] == 1 else f"needs chi_H = 1; here chi_H = {p['chi_H']:.6g}"
    special = not_one or not_ep4
    r, T = design.abscissa, math.tan(p["lambda_s"])

    yield LawRow("w0", "abscissa, the 4-fold root", r, _f(laws.w0(p["mu"], p["chi_H"], **heights, **tilt)), not_ep4)
    a = np.array([design.quantities[f"a{k}"] for k in range(5)])
    mismatch = np.max(np.abs(a / a[0] / laws.poly4(r) - 1)) if r and a[0] else math.nan
    yield LawRow("4poly", "largest relative mismatch of a coefficient", _f(mismatch), 0.0, not_ep4)
    yield LawRow("chib", "chi_B", p["chi_B"], _f(laws.chib(r, p["chi_H"], **heights)), not_ep4)
    a2 = laws.a2(p["Fr"], p["mu"], p["chi_H"], **heights, **tilt, omega0=r)
    yield LawRow("a2", "left minus right side", _f(a2), 0.0, not_ep4)

    general = not_ep4 or ("" if not_one else "at chi_H = 1 the mass ratio is free; see the laws for chi_H = 1")
    branch = _nearest(laws.ep4(r, **heights, chi_H=p["chi_H"]), p)
    closed = (("Fr", p["Fr"], branch.Fr), ("mu", p["mu"], branch.mu), ("tan(lambda_s)", T, branch.tan_lambda_s))
    for subject, numeric, law in closed:
        yield LawRow("a1a3, a2, w0", f"{subject}, closed form for any chi_H", numeric, _f(law), general)

    yield from _speed_rows(design, p, not_one)
    yield LawRow("w01", "abscissa, the 4-fold root", r, _f(laws.w01(**heights)), special)
    yield LawRow("chib1", "chi_B", p["chi_B"], _f(laws.chib1(**heights)), special)
    yield LawRow("tls", "tan(lambda_s)", T, _f(laws.tls(**heights)), special)
    yield LawRow("frep4", "Fr", p["Fr"], _f(laws.frep4(**heights)[0]), special)
    on_set = design.structure in ("EP4", "2EP2", "CEP2")
    off_set = not_one or ("" if on_set else f"holds on the EP set; the structure is '{design.structure}'")
    yield LawRow("epset", "Fr", p["Fr"], _f(laws.epset(**heights, **tilt)), off_set)


def _speed_rows(design: Solution, p: Mapping[str, float], not_one: str) -> Iterator[LawRow]:
    """Laws of stability and of the critical Froude number."""
    heights = {k: p[k] for k in ("zeta_B", "zeta_H")}
    tilt = {"lambda_s": p["lambda_s"]}
    shape = {k: p[k] for k in ("mu", "chi_B", "chi_H", "zeta_B", "zeta_H", "lambda_s")}
    stable = bool(is_stable([design.quantities[f"a{k}"] for k in range(5)]))
    printed = bool(np.all(laws.lscf(p["Fr"], **shape)))
    regime = "" if p["lambda_s"] > 0 else "stated for lambda_s > 0"
    if not regime and p["chi_H"] < 1:
        regime = "incomplete for chi_H < 1: a1 > 0 is missing"
    yield LawRow("lscf", "stable (1) or not (0)", float(stable), float(printed), regime)
    critical = design.quantities["Fr_c"]
    absent = "" if math.isfinite(critical) else "the design has no weave boundary"
    yield LawRow("flus", "Fr_c", critical, _f(laws.Fr_c(**shape)), absent)
    frc1 = math.sqrt(max(_f(laws.Frc1(p["chi_B"], **heights, **tilt)), 0.0))
    yield LawRow("Frc1", "Fr_c", critical, frc1, not_one or absent)
    optimal = _f(laws.chibm(**heights))
    off = "" if math.isclose(p["chi_B"], optimal, rel_tol=SAME_LAW) else f"holds at chi_B = {optimal:.6g}"
    yield LawRow("frm", "Fr_c, least over chi_B", critical, _f(laws.frm(**heights, **tilt)), not_one or absent or off)


def _why_not_ep4(design: Solution) -> str:
    binding = ", ".join(design.active)
    why = f" because {binding} bind{'s' if len(design.active) == 1 else ''}" if binding else ""
    if not design.problem.free:
        why = " and nothing is free"
    return f"the structure is '{design.structure}'{why}"


def _nearest(branches: tuple[laws.EP4, laws.EP4], p: Mapping[str, float]) -> laws.EP4:
    """The algebraic branch that the design is on."""
    T = math.tan(p["lambda_s"])
    distance = [abs(_f(b.tan_lambda_s) - T) + abs(_f(b.Fr) - p["Fr"]) for b in branches]
    return branches[1] if distance[1] < distance[0] else branches[0]


def _f(x: Any) -> float:
    return float(x)
