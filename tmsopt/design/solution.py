"""The solution of a design problem as data."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from tmsopt.design.cases import Case
from tmsopt.design.problem import Freedom, Problem
from tmsopt.design.units import Reading
from tmsopt.records import Table
from tmsopt.roots import Root


@dataclass(frozen=True)
class Cover:
    """What is known of every case together.

    Attributes:
        limit: no root of any case is right of it, if `proven`.
        proven: by interval arithmetic over all the boxes; else by a search for the worst case alone.
        boxes: parts that bands and tolerances were divided into.
    """

    limit: float
    proven: bool
    boxes: int


SCHEMA = 1
GAIN_DIGITS = 6
SIDE_DIGITS = 9


@dataclass(frozen=True)
class Bound:
    """A value that no design in the box can beat.

    Attributes:
        value: the bound, −inf where there is none.
        gap: objective minus bound.
        proven: whether the gap is closed, so that the design is globally optimal: up to rounding, by ``scip`` up to
            1e-4 of the objective; of an infeasible problem, whether it is certain that no design is feasible.
        method: how the bound was found: ``omega0``, ``relation`` (of the coefficients), ``scip``, …; ``none``.
        seconds: that branch and bound took.
        nodes: that it needed.
        tolerance: its feasibility tolerance; it is a proof in floating-point arithmetic. 0 without it.
    """

    value: float = -math.inf
    gap: float = math.inf
    proven: bool = False
    method: str = "none"
    seconds: float = 0.0
    nodes: int = 0
    tolerance: float = 0.0

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        known = {"value": _number(self.value), "gap": _number(self.gap), "proven": self.proven, "method": self.method}
        search = {"seconds": round(self.seconds, 4), "nodes": self.nodes, "feasibility_tolerance": self.tolerance}
        return known | (search if self.tolerance else {})


@dataclass(frozen=True)
class Starts:
    """How many starts were tried, converged to a feasible point, and ended at the best one."""

    tried: int = 0
    converged: int = 0
    at_best: int = 0


@dataclass(frozen=True)
class Branch:
    """Another solution of a square system, and the limits that exclude it."""

    parameters: Table[float]
    excluded_by: tuple[str, ...]


@dataclass(frozen=True)
class Relaxation:
    """The smallest move of limits that leaves a feasible design.

    Attributes:
        parameters: a design that is feasible once the limits are moved.
        amounts: limit → how far it is moved, in its own units; signed for an equality, else towards what it forbids.
        conflict: limits that keep the amounts from being smaller, those moved included.
        alone: limit → how far it must be moved if it is the only one, where that suffices.
    """

    parameters: Table[float] = field(default_factory=Table)
    amounts: Table[float] = field(default_factory=Table)
    conflict: tuple[str, ...] = ()
    alone: Table[float] = field(default_factory=Table)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        return {
            "amounts": dict(self.amounts),
            "conflict": list(self.conflict),
            "alone": dict(self.alone),
            "parameters": dict(self.parameters),
        }


@dataclass(frozen=True)
class Solution:
    """What `solve` found.

    Attributes:
        status: ``optimal``, ``infeasible`` or ``not_converged``; always decided by an independent recheck.
        value: value of the objective expression; nan where there is none.
        parameters: every parameter of the set the problem is written in (rad, SI units).
        abscissa: largest real part of the roots of the ideal design, dimensionless (per √(w/g)).
        abscissa_realised: the same for the parameters exactly as stored in double precision.
        roots: roots of the ideal design with multiplicities: of the polynomial nearest to the design's own that has
            the structure, as `roots.enclosed.nearest` defines it; for simple roots of the design's own.
        structure: which roots stand on the rightmost line, e.g. ``EP4``.
        active: constraint or bound (``Fr.max``) → gain of the objective per unit that the limit is relaxed.
        violations: name → violation relative to the size of the two sides, where beyond tolerance.
        quantities: derived quantities; nan where one does not exist.
        dimensionless: the native parameters.
        formulation: ``abscissa``, ``matching`` or ``none``.
        freedom: parameters against conditions, before solving.
        branches: other solutions of a square system.
        notes: sentences for the reader.
        worst: with scenarios or tolerances, the case with the largest abscissa, which is the one reported.
        least_damped: likewise, the case with the least damping ratio.
        cover: what is known of every case together, proven or not.
        sides: part of the box, such as ``forward tilt`` → its best objective, nan where it has no feasible design.
        relaxation: of an infeasible problem, the smallest move of its limits that leaves a feasible design.
        si: the design in s, Hz, mm, km/h, degrees, N and kg; empty unless the problem is written in SI.
    """

    problem: Problem
    status: str
    value: float
    parameters: Table[float]
    abscissa: float
    abscissa_realised: float
    roots: tuple[Root, ...]
    structure: str
    active: Table[float]
    violations: Table[float]
    bound: Bound
    starts: Starts
    seconds: float
    quantities: Table[float]
    dimensionless: Table[float]
    formulation: str
    freedom: Freedom
    branches: tuple[Branch, ...] = ()
    notes: tuple[str, ...] = field(default=())
    worst: Case | None = None
    least_damped: Case | None = None
    cover: Cover | None = None
    sides: Table[float] = field(default_factory=Table)
    relaxation: Relaxation | None = None
    si: Table[Reading] = field(default_factory=Table)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; numbers that do not exist are None.

        Objective, abscissae, roots, quantities, dimensionless parameters and readings follow from the parameters
        alone and are the doubles nearest to their true values (readings in mm, km/h and degrees: to 15 digits).
        ``active`` comes from the optimisation and has the 6 digits that the first-order conditions, solved
        independently at 60 digits, confirm; so have ``violations``. ``sides`` are objectives of designs that are not
        shown, to 9 digits.
        """
        problem = self.problem
        text = problem.minimize or problem.maximize or problem.locate or "abscissa"
        objective: dict[str, Any] = {"sense": problem.sense, "expression": text, "value": _number(self.value)}
        if problem.locate:
            objective["locate"] = problem.locate
        si = {name: list(x) if isinstance(x, tuple) else _number(x) for name, x in self.si.items()}
        return {
            "schema": SCHEMA,
            "title": problem.title,
            "model": problem.model.name,
            "status": self.status,
            "objective": objective,
            "parameters": _numbers(self.parameters),
            "abscissa": _number(self.abscissa),
            "abscissa_realised": _number(self.abscissa_realised),
            "roots": [{"re": r.re, "im": r.im, "multiplicity": r.multiplicity} for r in self.roots],
            "structure": self.structure,
            "active": _digits(self.active, GAIN_DIGITS),
            "violations": _digits(self.violations, GAIN_DIGITS),
            "bound": self.bound.to_json(),
            "starts": {
                "tried": self.starts.tried,
                "converged": self.starts.converged,
                "at_best": self.starts.at_best,
            },
            "seconds": round(self.seconds, 4),
            "quantities": _numbers(self.quantities),
            "dimensionless": _numbers(self.dimensionless),
            "formulation": self.formulation,
            "freedom": {
                "free": self.freedom.free,
                "conditions": self.freedom.conditions,
                "count": self.freedom.count,
                "kind": self.freedom.kind,
            },
            "branches": [
                {"parameters": _numbers(b.parameters), "excluded_by": list(b.excluded_by)} for b in self.branches
            ],
            "notes": list(self.notes),
            **({"worst_case": _case(self.worst)} if self.worst else {}),
            **({"least_damped_case": _case(self.least_damped)} if self.least_damped else {}),
            **({"cover": asdict(self.cover)} if self.cover else {}),
            **({"sides": _digits(self.sides, SIDE_DIGITS)} if self.sides else {}),
            **({"relaxation": self.relaxation.to_json()} if self.relaxation else {}),
            **({"si": si} if si else {}),
        }


class NotSolved(RuntimeError):
    """Raised by `solve` when there is no optimal design; `solution` holds the best point found."""

    def __init__(self, solution: Solution) -> None:
        self.solution = solution
        violated = ", ".join(f"{name} by {value:.3g}" for name, value in solution.violations.items())
        super().__init__(
            f"{solution.problem.title or 'problem'}: {solution.status}"
            + (f"; violated: {violated}" if violated else "")
            + "".join(f"; {note}" for note in solution.notes)
        )

    def __reduce__(self) -> tuple[type["NotSolved"], tuple[Solution]]:
        return NotSolved, (self.solution,)


def _case(case: Case) -> dict[str, dict[str, float]]:
    return {"at": dict(case.at), "offset": dict(case.offset)}


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _numbers(table: Mapping[str, float]) -> dict[str, float | None]:
    return {name: _number(value) for name, value in table.items()}


def _digits(table: Mapping[str, float], digits: int) -> dict[str, float | None]:
    """Numbers to so many significant digits."""
    return {name: _number(float(f"{value:.{digits}g}")) for name, value in table.items()}
