"""The solution of a problem as data."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from tmsopt.models import inertia_margin
from tmsopt.models.user_spectrum import distance_beyond_axis, eigenfrequencies
from tmsopt.problem.advice.remedies import Relaxation, RequiredValue
from tmsopt.problem.cases import Case, Cover
from tmsopt.problem.freedom import Freedom
from tmsopt.problem.problem import Problem
from tmsopt.problem.quantities import ROOT_NAMES
from tmsopt.problem.searches import Starts
from tmsopt.problem.unit_system import units_of
from tmsopt.problem.units import Reading
from tmsopt.problem.verdict.stability import STABLE, MultipleRoot, StabilityVerdict, roots_to_json, stability
from tmsopt.records import Printable, Table, call_documents, plain
from tmsopt.roots import Root

_GAIN_DIGITS = 6  # digits of gains and violations in JSON
_SIDE_DIGITS = 9  # digits of the best objective of each part of the box in JSON


@dataclass(frozen=True)
class Bound:
    """A value that no design in the box can beat.

    Attributes:
        value: the bound; −inf if there is none.
        gap: objective minus bound.
        proven: whether the gap is closed, so that the design is globally optimal: up to rounding, or by ``scip`` up to
            1e-4 of the objective. For an infeasible problem, whether infeasibility is proved.
        method: how the bound was found: ``omega0``, ``relation`` (of the coefficients), ``scip``, …; ``none``.
        seconds: time of branch and bound.
        nodes: nodes of branch and bound.
        tolerance: feasibility tolerance of branch and bound, which proves in floating-point arithmetic.
        solver: the solver that searched, such as ``SCIP``, even if another method gave the bound; empty without one.

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
    """Another solution of a square system, with the limits that exclude it."""

    parameters: Table[float]
    excluded_by: tuple[str, ...]


@dataclass(frozen=True, repr=False)
class Solution(Printable):
    """The answer of `solve`.

    Attributes:
        status: ``optimal``, ``infeasible`` or ``not_converged``; always decided by an independent recheck.
        value: value of the objective expression; nan without one.
        parameters: every parameter of the set that the problem is written in (rad, SI units).
        abscissa: largest real part of the roots, dimensionless (per √(w/g)). Like `roots`, it belongs to the ideal
            design, that is, to the design before its parameters are rounded to double precision.
        abscissa_realised: the abscissa of the parameters exactly as stored in double precision.
        roots: roots of the ideal design with multiplicities. They belong to the nearest polynomial with the structure,
            as `roots.enclosed.nearest` defines it; if all are simple, to the design's own polynomial.
        structure: the roots on the rightmost line, e.g. ``EP4``.
        active: constraint or bound (``Fr.max``) → gain of the objective per unit of relaxation.
        violations: name → violation above tolerance, in the limit's units (rad, SI); for a pattern, relative to the
            coefficients.
        missed: limit on the roots that the ideal design meets → violation by the stored parameters, in the limit's
            units. Empty if doubles near the ideal design meet all limits, because these doubles are stored.
        quantities: derived quantities; nan if undefined.
        dimensionless: the native parameters.
        formulation: ``abscissa``, ``matching`` or ``none``.
        freedom: count of parameters and conditions before solving.
        branches: other solutions of a square system.
        notes: sentences for the reader.
        worst: with scenarios or tolerances, the case with the largest abscissa; `abscissa` and `roots` belong to it.
        least_damped: with scenarios or tolerances, the case with the least damping ratio.
        fastest: with scenarios or tolerances, the case with the greatest angular frequency, if the problem uses it.
        cover: a bound on the roots over all cases, proven or not.
        sides: part of the box, such as ``normal rake`` → its best objective; nan without a feasible design.
        relaxation: the smallest relaxation of the limits that makes an infeasible problem feasible.
        need: the required speed, for an infeasible problem or an unstable design where stability was sought; None if
            the speed plays no part.
        stable_elsewhere: for an unstable design, whether branch and bound found a stable one: False if it proved that
            there is none, None if it did not run or did not decide.
        interrupted: whether the user stopped the work early.
        meetings: the multiple roots with their eigenvectors: the located ones, then the others, rightmost first.
        edges: boundaries of stability that contain the design: ``weave``, ``capsize``, ``infinity``.
        edge_is_exact: whether `edges` and the growth there are certain, not only up to rounding.
        multiple_as_rounded: without free parameters, whether roots are multiple only up to rounding.
        without_best: whether no design is the best, because designs improve without end, e.g. towards singular M.
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
        """The further parts of a report; each is computed on first use and kept."""
        return call_documents("analyse", self)

    @property
    def stability(self) -> StabilityVerdict:
        """The verdict in the worst case, with the power of t by which the motion grows."""
        largest = max((r.size for r in self.roots), default=0.0)
        return stability((self.abscissa, self.abscissa_realised), self.edges, self.meetings, largest)

    @property
    def stable(self) -> bool | None:
        """Whether all roots of the ideal design and of the stored parameters are left of the axis, in the worst case.

        None if a root is infinite.
        """
        verdict = self.stability.verdict
        return verdict == STABLE if verdict else None

    @property
    def beyond_axis(self) -> float | None:
        """Distance of the rightmost root to the right of the axis, for a located pattern on the axis; else None."""
        located = self.problem.posed.located if self.status == "optimal" else ()
        return distance_beyond_axis(self.problem.model, located, self.roots)

    @property
    def stability_sought(self) -> bool:
        """Whether stability was sought: parameters are free, and a violated limit or the objective uses the roots."""
        problem = self.problem.posed
        objective = () if problem.objective is None else problem.objective.names
        limits = set(self.violations) & set(problem.asked_of_roots)
        return bool(problem.free and (limits if self.violations else set(objective) & set(ROOT_NAMES)))

    @property
    def any_stable(self) -> bool | None:
        """Whether any design in the box is stable, ignoring limits on the roots; False if disproved, else None."""
        if self.stable:
            return True
        problem = self.problem.posed
        minimises_abscissa = (problem.minimize or "").strip() == "abscissa" and not problem.asked_of_roots
        is_excluded = minimises_abscissa and self.status == "optimal" and self.bound.value >= 0
        return False if is_excluded else self.stable_elsewhere

    @property
    def units(self) -> dict[str, str]:
        """Name → unit of a number as stored and in JSON (rad and SI), if it has one."""
        return units_of(self.problem.posed, filter(None, [self.problem.minimize or self.problem.maximize]))

    @property
    def eigenfrequencies(self) -> tuple[Root, ...]:
        """ω = i s of a complex system in the order of the roots, with multiplicities; empty for a real system."""
        return eigenfrequencies(self.problem.model, self.roots)

    @property
    def conditions(self) -> dict[str, int]:
        """The conditions of the located pattern on the parameters, and how many of them hold by symmetry."""
        pattern = self.problem.posed.pattern
        return {"real": pattern.codimension if pattern else 0, "by_symmetry": self.freedom.by_symmetry}

    @property
    def inertia_margin(self) -> Table[float | None] | None:
        """`models.inertia_margin` of a stable point-mass design in SI at its nominal values; else None."""
        in_si = self.problem.model.name == "tms" and self.problem.posed.parameter_set.rate is not None
        return inertia_margin(self.parameters) if in_si and self.stable else None

    def response(self, **arguments: Any) -> Any:
        """The motion of this design after a lean or a push, as a `tmsopt.Simulation`.

        Args:
            arguments: the arguments of `tmsopt.simulate`: ``lean=5`` (degrees), ``push=10`` (N m s), ``seconds=3``,
                ``noise=1`` …

        Raises:
            InputError: for a model without matrices, or an argument that it does not accept.
        """
        return call_documents("response", self, **arguments)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; undefined numbers are None.

        Objective, abscissae, roots, quantities, dimensionless parameters and readings follow from the parameters alone
        and are correctly rounded doubles (readings in mm, km/h and degrees: 15 digits). ``active`` comes from the
        optimisation and has 6 digits, confirmed by the first-order conditions solved independently at 60 digits;
        ``violations`` have 6 digits, and ``sides``, the objectives of designs that are not listed, 9.
        """
        problem = self.problem.posed
        text = problem.minimize or problem.maximize or problem.locate or "abscissa"
        cases = {"worst_case": self.worst, "least_damped_case": self.least_damped, "fastest_case": self.fastest}
        optional = {
            **{name: case and plain(case, "at offset") for name, case in cases.items()},
            **plain(self, "cover"),
            "sides": plain(self.sides, digits=_SIDE_DIGITS),
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
            "active": plain(self.active, digits=_GAIN_DIGITS),
            "violations": plain(self.violations, digits=_GAIN_DIGITS),
            **({"missed_as_stored": plain(self.missed, digits=_GAIN_DIGITS)} if self.missed else {}),
            **plain(self, "bound"),
            "starts": plain(self.starts, "tried converged at_best expected_unseen"),
            "looked": self.starts.looked,
            "seconds": round(self.seconds, 4),
            **plain(self, "quantities dimensionless formulation"),
            "freedom": plain(self.freedom, "free conditions count kind"),
            **({"conditions": self.conditions} if problem.pattern and problem.model.pencil else {}),
            **plain(self, "branches notes"),
            **{name: value for name, value in optional.items() if value},
            **(plain(self, "inertia_margin") if problem.model.omits and problem.parameter_set.rate else {}),
        }
