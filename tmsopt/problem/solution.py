"""The solution of a design problem as data."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from tmsopt.models import inertia_margin
from tmsopt.models.user_spectrum import beyond_axis, eigenfrequencies, polynomial_structure
from tmsopt.problem.advice.remedies import Relaxation, RequiredValue
from tmsopt.problem.cases import Case, Cover
from tmsopt.problem.freedom import Freedom
from tmsopt.problem.problem import Problem
from tmsopt.problem.quantities import ROOT_NAMES
from tmsopt.problem.searches import Starts
from tmsopt.problem.unit_system import units_of
from tmsopt.problem.units import Reading
from tmsopt.problem.verdict.stability import STABLE, MultipleRoot, StabilityVerdict, roots_to_json, stability
from tmsopt.records import Printable, Table, asked_above, plain
from tmsopt.roots import Root, Structure

GAIN_DIGITS, SIDE_DIGITS = 6, 9


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
        tolerance: its feasibility tolerance; it is a proof in floating-point arithmetic.
        solver: who searched, such as ``SCIP``, whoever's bound it is; empty without a search.

    Example:
        >>> bound = tmsopt.solve("problems/ep4.toml").bound  # no abscissa is below -(a4/a0)^(1/4), which an EP4 attains
        >>> bound.proven, bound.gap < 1e-9
        (True, True)

    More: docs/explanation/proofs.md
    """

    value: float = -math.inf
    gap: float = math.inf
    proven: bool = False
    method: str = "none"
    seconds: float = 0.0
    nodes: int = 0
    tolerance: float = 0.0
    solver: str = ""

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        search = {"seconds": round(self.seconds, 4), "nodes": self.nodes, "feasibility_tolerance": self.tolerance}
        return plain(self, "value gap proven method") | (search if self.solver else {})


@dataclass(frozen=True)
class OtherBranch:
    """Another solution of a square system, and the limits that exclude it."""

    parameters: Table[float]
    excluded_by: tuple[str, ...]


@dataclass(frozen=True, repr=False)
class Solution(Printable):
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
        violations: name → by how much it is violated, in its own units (rad, SI), where beyond tolerance; of a pattern,
            relative to the coefficients.
        missed: limit on the roots that the ideal design meets → by how much the parameters as stored miss it, in its
            own units; empty wherever doubles near the ideal design meet all limits, for those are stored then.
        quantities: derived quantities; nan where one does not exist.
        dimensionless: the native parameters.
        formulation: ``abscissa``, ``matching`` or ``none``.
        freedom: parameters against conditions, before solving.
        branches: other solutions of a square system.
        notes: sentences for the reader.
        worst: with scenarios or tolerances, the case with the largest abscissa, which is the one reported.
        least_damped: likewise, the case with the least damping ratio.
        fastest: likewise, the case with the greatest angular frequency, where the problem asks for that.
        cover: what is known of every case together, proven or not.
        sides: part of the box, such as ``normal rake`` → its best objective, nan where it has no feasible design.
        relaxation: of an infeasible problem, the smallest move of its limits that leaves a feasible design.
        need: of a problem without an answer, or of a design that is not stable though that was looked for, the speed
            that it takes; None where the speed plays no part.
        stable_elsewhere: of a design that is not stable, whether branch and bound found one that is: False where it
            proved that there is none, None where it was not asked or did not decide.
        interrupted: whether the user ended the work before it was done.
        meetings: what meets in each multiple root: the located ones, then the others, rightmost first.
        edges: boundaries of stability that it stands on: ``weave``, ``capsize``, ``infinity``; `edge_is_exact` where
            that and its growth are certain, and not only as far as rounding tells.
        multiple_as_rounded: where nothing is free, whether roots are multiple only as far as rounding tells.
        without_best: whether designs get better without an end, as towards a singular mass matrix: none is the best.
        si: the design in s, Hz, mm, km/h, degrees, N and kg; empty unless the problem is written in SI.

    Example:
        >>> design = tmsopt.solve("problems/ep4.toml")
        >>> f"{design.abscissa:.6f}", f"{tmsopt.laws.w01(-0.4, -0.2):.6f}"  # the law of the paper
        ('-1.880302', '-1.880302')

    More: docs/how_to/report.md
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
    missed: Table[float] = Table()
    branches: tuple[OtherBranch, ...] = ()
    notes: tuple[str, ...] = ()
    worst: Case | None = None
    least_damped: Case | None = None
    fastest: Case | None = None
    cover: Cover | None = None
    sides: Table[float] = Table()
    relaxation: Relaxation | None = None
    need: RequiredValue | None = None
    stable_elsewhere: bool | None = None
    interrupted: bool = False
    meetings: tuple[MultipleRoot, ...] = ()
    edges: tuple[str, ...] = ()
    edge_is_exact: bool = False
    multiple_as_rounded: bool = False
    without_best: bool = False
    si: Table[Reading] = Table()

    @cached_property
    def analysis(self) -> Any:
        """What a report says beyond these numbers, each part computed when it is first asked for, and kept."""
        return asked_above("analyse", self)

    @property
    def stability(self) -> StabilityVerdict:
        """The verdict, and the power of t by which the motion grows, in the worst case."""
        largest = max((r.size for r in self.of_polynomial.roots), default=0.0)
        return stability((self.abscissa, self.abscissa_realised), self.edges, self.meetings, largest)

    @property
    def stable(self) -> bool | None:
        """Whether all roots lie left of the axis: ideal and as stored, in the worst case; None where there are none."""
        verdict = self.stability.verdict
        return verdict == STABLE if verdict else None

    @property
    def beyond_axis(self) -> float | None:
        """The abscissa where the located pattern ties roots to the axis, 0 on the edge of stability; else None."""
        located = self.problem.posed.located if self.status == "optimal" else ()
        return beyond_axis(self.problem.model, located, self.roots)

    @property
    def stability_sought(self) -> bool:
        """Whether parameters are free for what a limit that is violated, or else the objective, says of the roots."""
        problem = self.problem.posed
        objective = () if problem.objective is None else problem.objective.names
        limits = set(self.violations) & set(problem.asked_of_roots)
        return bool(problem.free and (limits if self.violations else set(objective) & set(ROOT_NAMES)))

    @property
    def any_stable(self) -> bool | None:
        """Whether any design in the box is stable, limits on the roots aside: True, False where proved, or None."""
        if self.stable:
            return True
        problem = self.problem.posed
        least = (problem.minimize or "").strip() == "abscissa" and not problem.asked_of_roots
        bounded = least and self.status == "optimal" and self.bound.value >= 0
        return False if bounded else self.stable_elsewhere

    @property
    def units(self) -> dict[str, str]:
        """The unit of each number that has one, as they are kept and as JSON has them: rad and SI."""
        return units_of(self.problem.posed, filter(None, [self.problem.minimize or self.problem.maximize]))

    @property
    def eigenfrequencies(self) -> tuple[Root, ...]:
        """ω = i s of a complex system, in the order of the roots, each with its multiplicity; none of a real one."""
        return eigenfrequencies(self.problem.model, self.roots)

    @property
    def inertia_margin(self) -> Table[float | None] | None:
        """Of a stable design of point masses in SI, by `models.inertia_margin` at its nominal values; else None."""
        in_si = self.problem.model.name == "tms" and self.problem.posed.parameter_set.rate is not None
        return inertia_margin(self.parameters) if in_si and self.stable else None

    @property
    def of_polynomial(self) -> Structure:
        """Structure and roots of the model's polynomial: of a complex system, of the real one of twice the size."""
        return polynomial_structure(self.problem.model, self.structure, self.roots)

    def response(self, **asked: Any) -> Any:
        """The motion of this design after a lean or a push, a `tmsopt.Simulation`: what `tmsopt.simulate` gives.

        Args:
            asked: as there: ``lean=5`` (degrees), ``push=10`` (N m s), ``seconds=3``, ``noise=1`` …

        Raises:
            InputError: for a model without matrices, or what cannot be asked of it.
        """
        return asked_above("response", self, **asked)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; numbers that do not exist are None.

        Objective, abscissae, roots, quantities, dimensionless parameters and readings follow from the parameters
        alone and are the doubles nearest to their true values (readings in mm, km/h and degrees: to 15 digits).
        ``active`` comes from the optimisation and has the 6 digits that the first-order conditions, solved
        independently at 60 digits, confirm; so have ``violations``. ``sides`` are objectives of designs that are not
        shown, to 9 digits.
        """
        problem = self.problem.posed
        text = problem.minimize or problem.maximize or problem.locate or "abscissa"
        cases = {"worst_case": self.worst, "least_damped_case": self.least_damped, "fastest_case": self.fastest}
        optional = {
            **{name: case and plain(case, "at offset") for name, case in cases.items()},
            **plain(self, "cover"),
            "sides": plain(self.sides, digits=SIDE_DIGITS),
            **plain(self, "relaxation need interrupted si"),
        }
        return {
            **problem.heading,
            "status": self.status,
            "objective": {"sense": problem.sense, "expression": text, **plain(self, "value")}
            | ({"locate": problem.locate} if problem.locate else {}),
            "parameters": plain(self.parameters),
            "units": self.units,
            **plain(self, "abscissa abscissa_realised stable any_stable"),
            **self.stability.to_json(),
            **({"verdict_is_exact": self.edge_is_exact} if self.stability.on_edge else {}),
            **({"multiplicity_is_exact": False} if self.multiple_as_rounded else {}),
            **roots_to_json(self),
            **plain(self, "structure"),
            "active": plain(self.active, digits=GAIN_DIGITS),
            "violations": plain(self.violations, digits=GAIN_DIGITS),
            **({"missed_as_stored": plain(self.missed, digits=GAIN_DIGITS)} if self.missed else {}),
            **plain(self, "bound"),
            "starts": plain(self.starts, "tried converged at_best expected_unseen"),
            "looked": self.starts.looked,
            "seconds": round(self.seconds, 4),
            **plain(self, "quantities dimensionless formulation"),
            "freedom": plain(self.freedom, "free conditions count kind"),
            **plain(self, "branches notes"),
            **{name: value for name, value in optional.items() if value},
            **(plain(self, "inertia_margin") if problem.model.omits and problem.parameter_set.rate else {}),
        }
