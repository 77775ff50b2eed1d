"""Why a design is a local optimum, and not only an exceptional point: multipliers of its factors and limits.

Minimise γ subject to p(t + γ; θ) = a0(θ) ∏ (t² + βᵢ t + κᵢ), βᵢ, κᵢ ≥ 0, and to the limits on θ. The factors of the
roots on the rightmost line stand at their bounds (`tmsopt.analysis.program` says which those are, however
a multiple root is shared out), and the conditions are

    first order     ∇f = Σ yᵢ ∇hᵢ over all that is held at 0, with yᵢ ≥ 0 where hᵢ may become positive;
    vertex          where the ∇hᵢ of equalities and of positive yᵢ span all variables, nothing else is needed: the
                    design is a strict minimum, and the objective grows at least in proportion to the distance;
    second order    elsewhere the Hessian of f − y·h must be positive along what these leave free.

In p(t + γ) only c₁ depends on γ to first order, by its multiplicity m, so the multipliers of the c₁ add up to Σ m y = 1
for the abscissa: −1/m is what Burke and Overton (2001) find for its subgradients, with Re c₂ to be weighed by a number
that is not negative, and free weights for the others. Where a4/a0 is given, an EP4 at −ω has yₖ = 1/(4 ωᵏ⁻¹).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from tmsopt.analysis.conditions import POSITIVE, STATIONARY, Conditions, conditions, curved
from tmsopt.analysis.descent import Better, better
from tmsopt.analysis.program import LocalProgram, NotCovered, program
from tmsopt.models.user_spectrum import eigenfrequencies, user_roots
from tmsopt.problem.dependence import demands_heavy_damping
from tmsopt.problem.files import Given
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ROOT_NAMES
from tmsopt.problem.solution import Solution
from tmsopt.program.formulate import formulate
from tmsopt.program.starts import initial_point
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Printable, Table, plain
from tmsopt.search.solve import solve_if_needed

STRICT, NOT_MINIMAL, UNDECIDED, NOT_COVERED = "strict minimum", "not minimal", "undecided", "not covered"

_MET = 1e-7
"""Part of a row's size by which what is held may be off 0: a constraint counts as met within 1e-9 of its sides."""


@dataclass(frozen=True)
class OnLine:
    """A root on the rightmost line, a complex pair by its upper one, and the multipliers of its factors.

    Attributes:
        share: part of the abscissa that hangs on it; all of them add up to 1.
        beta: rise of the objective per unit of a βᵢ, which moves roots left of the line.
        kappa: likewise of what moves a multiple root apart along the line: κᵢ of a real one, (κ₁ − κ₂)²/(16 ω²) of
            a complex one; nan for a simple root.
        ties: likewise of the other coefficients, of either sign, for they must stay 0.
        eigenfrequency: of a complex system ω = i s.
    """

    re: float
    im: float
    multiplicity: int
    share: float
    beta: float
    kappa: float
    ties: tuple[float, ...]
    eigenfrequency: complex | None = None

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        found = plain(self, "re im multiplicity share beta kappa ties")
        return found | (plain(self, "eigenfrequency") if self.eigenfrequency is not None else {})


@dataclass(frozen=True, repr=False)
class Optimality(Printable):
    """Whether a design is a local optimum.

    Attributes:
        verdict: ``strict minimum`` (of a maximised objective, maximum), ``not minimal``, ``undecided`` or
            ``not covered``.
        reason: the verdict in a sentence.
        order: derivatives that decide, 1 or 2; 0 where nothing is decided.
        goal: what is judged, such as ``abscissa``.
        roots: those on the rightmost line, with the multipliers of their factors; none where it is not stationary.
        limits: constraint or bound → gain per unit that it is relaxed, as ``Solution.active``; likewise.
        unknowns: free parameters that matter, and the abscissa.
        conditions: coefficients of factors and limits that are held.
        residual: part of the gradient that the multipliers do not explain.
        curvature: least curvature along what is not held, as a share of the largest; nan at a vertex.
        idle: free parameters without any part in it.
        better: of a design that is not minimal, one nearby that is better, rechecked.
        better_value: its objective.

    Example:
        >>> judged = tmsopt.optimality("problems/ep4.toml")
        >>> judged.verdict, judged.order
        ('strict minimum', 1)

    More: docs/how_to/report.md
    """

    verdict: str
    reason: str
    order: int = 0
    goal: str = ""
    roots: tuple[OnLine, ...] = ()
    limits: Table[float] = field(default_factory=Table)
    unknowns: int = 0
    conditions: int = 0
    residual: float = math.nan
    curvature: float = math.nan
    idle: tuple[str, ...] = ()
    better: Table[float] = field(default_factory=Table)
    better_value: float = math.nan

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; numbers that do not exist are None."""
        if self.verdict == NOT_COVERED:
            return plain(self, "verdict reason")
        found = plain(self)
        return found if self.better else {n: x for n, x in found.items() if n not in ("better", "better_value")}


def optimality(design: Given, *, progress: Listener | None = None) -> Optimality:
    """Judge a design by the first- and, where needed, second-order conditions on its factors.

    Of a pattern that was located without an objective the abscissa is judged, within the box and the constraints.

    Args:
        design: a solution; or a problem or its file, solved first.
        progress: called with a `tmsopt.Progress` now and then.

    Example:
        >>> tmsopt.optimality("problems/two_mass_spring.toml").verdict  # as Henrion and Overton (2006) prove
        'strict minimum'

    More: docs/how_to/report.md
    """
    solution = solve_if_needed(design, progress)
    start_steps(progress, "judging the optimum")
    try:
        problem = _judged(solution)
        around = program(problem, solution)
    except NotCovered as error:
        return Optimality(NOT_COVERED, str(error))
    found = conditions(around)
    bearing = sum(y for y, h in zip(found.scaled, around.held, strict=True) if h.name == "c1")
    if not found.downhill.any() and not bearing > POSITIVE:
        return Optimality(NOT_COVERED, "the objective does not fall with the abscissa")
    beyond = better(around, found, solution) if found.downhill.any() else None
    verdict, order, reason = _verdict(solution, around, found, beyond)
    stationary = found.residual <= STATIONARY
    unknowns, count = _counts(around)
    return Optimality(
        verdict=verdict,
        reason=reason,
        order=order,
        goal=problem.goal,
        roots=_on_line(around, found) if stationary else (),
        limits=Table(_limits(solution, around, found) if stationary else {}),
        unknowns=unknowns,
        conditions=count,
        residual=found.residual,
        curvature=found.curvature,
        idle=around.idle,
        better=beyond.parameters if beyond else Table(),
        better_value=beyond.value if beyond else math.nan,
    )


def _judged(solution: Solution) -> Posed:
    """The problem whose optimum the design may be.

    Raises:
        NotCovered: with the reason why there is none.
    """
    problem = solution.problem.posed
    if not problem.free:
        raise NotCovered("nothing is free")
    if solution.status != "optimal":
        raise NotCovered("the design is not a solution")
    if problem.scenarios or problem.tolerances:
        raise NotCovered("the worst of several cases is minimised, and these conditions are those of one design")
    if problem.asks_radius:
        raise NotCovered("the robustness radius is asked for")
    if problem.locate and problem.objective is not None:
        raise NotCovered(f"the objective is optimised over the designs with {problem.locate}, whatever their abscissa")
    if solution.structure == "undecided":
        raise NotCovered("double precision cannot tell which roots meet")
    if problem.locate:
        problem = problem.derive(locate=None, minimize="abscissa")
    if demands_heavy_damping(problem):
        raise NotCovered("heavy damping is asked for, which holds the roots on the real line as well")
    nlp = formulate(problem)
    if set(nlp.contacts) & set(ROOT_NAMES):
        raise NotCovered(
            "an objective or constraint asks for a large abscissa, a small damping ratio or a high frequency"
        )
    x = initial_point(nlp, problem, solution.parameters)
    if "abscissa" in nlp.variables:
        x[nlp.variables.index("abscissa")] = solution.abscissa / nlp.unit
    rows = nlp.evaluate(nlp.set_kinks(x))[1]
    if any(np.sort(rows[list(kink.rows)])[1] <= _MET for kink in nlp.kinks if not kink.quotient):
        raise NotCovered("two sides of an abs, min or max meet there")
    return problem


def _verdict(
    solution: Solution, around: LocalProgram, found: Conditions, beyond: Better | None
) -> tuple[str, int, str]:
    """Verdict, derivatives that decide it, and the sentence."""
    problem, name = around.problem, f"this {solution.structure} is"
    extreme = f"local {'maximum' if problem.sense == 'maximize' else 'minimum'} of {problem.goal}"
    extreme += ", which was not asked for" if solution.problem.locate else ""
    if beyond is not None:
        return NOT_MINIMAL, beyond.order, f"{name} no {extreme}: {_pays(around, found)}; {_way(solution, beyond)}"
    if doubt := _doubt(around, found):
        return UNDECIDED, 0, f"not decided whether {name} a {extreme}: {doubt}"
    unknowns, count = _counts(around)
    held = f"{count} condition{'s that bind leave' if count != 1 else ' that binds leaves'}"
    idle = f"; without effect: {', '.join(around.idle)}" if around.idle else ""
    if np.isnan(found.curvature):
        return STRICT, 1, f"{name} a strict {extreme}: {held} none of the {unknowns} unknowns free to move{idle}"
    bend = "downwards" if solution.problem.posed.sense == "maximize" else "upwards"
    free = f"{held} some of the {unknowns} unknowns free to move"
    return STRICT, 2, f"{name} a strict {extreme}: {free}, and along these it curves {bend}{idle}"


def _doubt(around: LocalProgram, found: Conditions) -> str:
    """Why nothing is decided where no better design was found; empty where the conditions decide."""
    if found.residual > STATIONARY or (found.downhill.any() and np.isnan(found.curvature)):
        return f"nothing that binds holds {found.residual:.1g} of its gradient, yet no better design was found downhill"
    left, sizes = np.abs(around.at(around.x)[1]), np.array([h.size for h in around.held])
    off = float(np.divide(left, sizes, out=np.zeros_like(left), where=sizes > 0).max(initial=0.0))
    if off > _MET:
        return f"what is held is met to {off:.1g} only"
    loose = [h for h, firm in zip(around.held, found.firm, strict=True) if h.name == "c2" and not firm]
    if any(around.line[h.cluster].multiplicity > 3 for h in loose):
        return "to first order nothing keeps a multiple root together"  # then c₄ ≤ c₂² may outweigh it
    if curved(found.curvature) <= 0 and not np.isnan(found.curvature):
        return f"along what is left free it {'gains' if curved(found.curvature) else 'is flat'} to second order"
    return ""


def _counts(around: LocalProgram) -> tuple[int, int]:
    """Free parameters that matter and the abscissa; what is held, less the equations that define other variables."""
    unknowns = sum(name in around.problem.free for name in around.variables) + 1
    return unknowns, len(around.held) - (len(around.x) - unknowns)


def _pays(around: LocalProgram, found: Conditions) -> str:
    """What pays, to first order or by its curvature."""
    if curved(found.curvature) < 0:
        return "stationary, but second derivatives let it improve along what binds"
    if not found.independent or found.residual > STATIONARY:
        return f"nothing that binds holds {found.residual:.1g} of its gradient"
    held = zip(around.held, found.scaled, strict=True)
    ways = {"c1": "move roots left of the others", "c2": "part a multiple root"}
    paying = [ways.get(h.name, f"leave the limit {h.name}") for h, y in held if h.signed and y < -POSITIVE]
    return f"it pays to {' and to '.join(dict.fromkeys(paying))}"


def _way(solution: Solution, beyond: Better) -> str:
    """The better design by what changes most."""
    now, then = solution.parameters, beyond.parameters
    parts = [f"{n} {then[n]:.6g}" for n in solution.problem.free if abs(then[n] - now[n]) > 1e-9 * abs(now[n])]
    return f"{', '.join(parts)} gives {beyond.value:.6g}"


def _on_line(around: LocalProgram, found: Conditions) -> tuple[OnLine, ...]:
    """The roots on the line with their multipliers."""
    listed, held = [], list(zip(around.held, found.multipliers.tolist(), strict=True))
    model = around.problem.model
    total = sum(around.line[h.cluster].multiplicity * y for h, y in held if h.name == "c1")
    for k, root in enumerate(around.line):
        own = {h.name: y for h, y in held if h.cluster == k}
        first, second = own.pop("c1"), own.pop("c2", math.nan)
        share = root.multiplicity * first / total if total else math.nan
        beta = first / 2 if root.im else first  # β moves two roots of a pair, by half of it
        # of a complex system the user reads the conjugate
        (shown,) = user_roots(model, [root if model.carrier is None else replace(root, im=-root.im)])
        omega = (complex(w.re, w.im) for w in eigenfrequencies(model, [shown]))
        listed.append(OnLine(shown.re, shown.im, root.multiplicity, share, beta, second, tuple(own.values()), *omega))
    return tuple(listed)


def _limits(solution: Solution, around: LocalProgram, found: Conditions) -> Mapping[str, float]:
    """Gain of the objective per unit that a limit is relaxed; of an equality, change per unit added on the right."""
    problem, limits = around.problem, dict[str, float]()
    for h, y, firm in zip(around.held, found.multipliers.tolist(), found.firm, strict=True):
        if h.name in problem.constraints:
            limits[h.name] = y if h.signed else problem.sign * y
        elif h.signed and h.cluster < 0 and firm and (name := h.name.rsplit(".", 1)[0]) in problem.free:
            tilt = problem.parameter_set[name].tangent
            limits[h.name] = y * (1 + math.tan(solution.parameters[name]) ** 2 if tilt else 1.0)
    return limits
