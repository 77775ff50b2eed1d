"""Decides whether a design is a local optimum, by the multipliers of its factors and limits.

The program minimises γ subject to p(t + γ; θ) = a0(θ) ∏ (t² + βᵢ t + κᵢ), βᵢ, κᵢ ≥ 0, and to the limits on θ. The
factors of the roots on the rightmost line are at their bounds (see `tmsopt.analysis.program`). The conditions are

    first order     ∇f = Σ yᵢ ∇hᵢ over all active rows hᵢ = 0, with yᵢ ≥ 0 where hᵢ may become positive;
    vertex          if the ∇hᵢ of equalities and of positive yᵢ span all variables, the design is a strict minimum,
                    and the objective grows at least in proportion to the distance;
    second order    otherwise the Hessian of f − y·h must be positive on the null space of these rows.

In p(t + γ) only c₁ depends on γ to first order, with the factor m, the multiplicity of the root. The multipliers of the
c₁ therefore satisfy Σ m y = 1 for the abscissa. Burke and Overton (2001) find the same −1/m for the subgradients of the
abscissa, with a weight ≥ 0 for Re c₂ and free weights for the other coefficients. If a4/a0 is given, an EP4 at −ω has
yₖ = 1/(4 ωᵏ⁻¹).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from tmsopt.analysis.conditions import POSITIVE, STATIONARY, Conditions, curvature_sign, evaluate_conditions
from tmsopt.analysis.descent import BetterDesign, find_better_design
from tmsopt.analysis.program import LocalProgram, NotCovered, build_program
from tmsopt.problem.dependence import demands_heavy_damping
from tmsopt.problem.files import ProblemSource
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ROOT_NAMES
from tmsopt.problem.real_form import RealForm, has_real_form, real_form
from tmsopt.problem.solution import Solution
from tmsopt.program.formulate import formulate
from tmsopt.program.starts import initial_point
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Printable, Table, plain
from tmsopt.search.solve import solve_if_needed

STRICT, NOT_MINIMAL, UNDECIDED, NOT_COVERED = "strict minimum", "not minimal", "undecided", "not covered"

_TOLERANCE = 1e-7
"""Largest value of an active row, relative to its size. Constraints count as satisfied to 1e-9 of their sides."""


@dataclass(frozen=True)
class RightmostRoot:
    """A root on the rightmost line, or the upper root of a complex pair, with the multipliers of its factors.

    Attributes:
        share: share of the root in the abscissa; the shares of all roots on the line add up to 1.
        beta: increase of the objective per unit of a βᵢ, which moves roots to the left of the line.
        kappa: increase per unit of the coefficient that splits a multiple root along the line: κᵢ for a real root,
            (κ₁ − κ₂)²/(16 ω²) for a complex root; nan for a simple root.
        ties: increase per unit of each further coefficient. These coefficients stay 0, so both signs are possible.
        eigenfrequency: ω = i s for a complex system, otherwise None.
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
        data = plain(self, "re im multiplicity share beta kappa ties")
        return data | (plain(self, "eigenfrequency") if self.eigenfrequency is not None else {})


@dataclass(frozen=True, repr=False)
class Optimality(Printable):
    """Local optimality of a design.

    Attributes:
        verdict: ``strict minimum`` (for a maximised objective, a strict maximum), ``not minimal``, ``undecided`` or
            ``not covered``.
        reason: the verdict in a sentence.
        order: order of the derivatives that decide, 1 or 2; 0 if undecided.
        goal: the objective, such as ``abscissa``.
        roots: roots on the rightmost line, with the multipliers of their factors; empty if not stationary.
        limits: constraint or bound → gain per unit of relaxation, as in ``Solution.active``; empty if not stationary.
        unknowns: number of free parameters with an effect, plus 1 for the abscissa.
        conditions: number of active coefficients of factors and active limits.
        residual: share of the gradient that the multipliers do not explain.
        curvature: smallest curvature in the null space of the conditions, relative to the largest; nan at a vertex.
        idle: free parameters without an effect.
        better: a better design nearby, which was rechecked, if the verdict is ``not minimal``.
        better_value: objective of the better design.

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
    roots: tuple[RightmostRoot, ...] = ()
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
        data = plain(self)
        return data if self.better else {n: x for n, x in data.items() if n not in ("better", "better_value")}


def optimality(design: ProblemSource, *, progress: Listener | None = None) -> Optimality:
    """Decide whether a design is a local optimum, by first- and, if needed, second-order conditions on its factors.

    If a pattern was located without an objective, the objective is the abscissa, within the ranges and constraints.

    Args:
        design: a solution, or a problem or its file, which is solved first.
        progress: called with a `tmsopt.Progress` now and then.

    Example:
        >>> tmsopt.optimality("problems/two_mass_spring.toml").verdict  # as Henrion and Overton (2006) prove
        'strict minimum'

    More: docs/how_to/report.md
    """
    solution = solve_if_needed(design, progress)
    start_steps(progress, "checking the optimum")
    if not has_real_form(solution.problem.model):
        return Optimality(NOT_COVERED, "the matrices are too large for the polynomial that these conditions use")
    form = real_form(solution.problem.posed)
    solution = form.to_real(solution)
    try:
        problem = _choose_problem(solution)
        program = build_program(problem, solution)
    except NotCovered as error:
        return Optimality(NOT_COVERED, str(error))
    conditions = evaluate_conditions(program)
    weight = sum(y for y, h in zip(conditions.scaled_multipliers, program.rows, strict=True) if h.name == "c1")
    if not conditions.descent_direction.any() and not weight > POSITIVE:
        return Optimality(NOT_COVERED, "the objective does not decrease with the abscissa")
    better_design = find_better_design(program, conditions, solution) if conditions.descent_direction.any() else None
    verdict, order, reason = _decide_verdict(
        solution, form.user_name(solution.structure), program, conditions, better_design
    )
    is_stationary = conditions.residual <= STATIONARY
    unknown_count, condition_count = _count_unknowns(program)
    return Optimality(
        verdict=verdict,
        reason=reason,
        order=order,
        goal=problem.goal,
        roots=_list_rightmost_roots(program, conditions, form) if is_stationary else (),
        limits=Table(_compute_limit_gains(solution, program, conditions) if is_stationary else {}),
        unknowns=unknown_count,
        conditions=condition_count,
        residual=conditions.residual,
        curvature=conditions.curvature,
        idle=program.idle,
        better=better_design.parameters if better_design else Table(),
        better_value=better_design.value if better_design else math.nan,
    )


def _choose_problem(solution: Solution) -> Posed:
    """The problem whose local optimum the design may be.

    Raises:
        NotCovered: if there is no such problem; the text is the reason.
    """
    problem = solution.problem.posed
    if not problem.free:
        raise NotCovered("nothing is free")
    if solution.status != "optimal":
        raise NotCovered("the design is not a solution")
    if problem.scenarios or problem.tolerances:
        raise NotCovered("the problem minimises the worst of several cases, and these conditions cover only one")
    if problem.asks_radius:
        raise NotCovered("the problem uses the robustness radius")
    if problem.locate and problem.objective is not None:
        raise NotCovered(f"the objective is optimised over the designs with {problem.locate}, whatever their abscissa")
    if solution.structure == "undecided":
        raise NotCovered("double precision cannot tell which roots meet")
    if problem.locate:
        problem = problem.derive(locate=None, minimize="abscissa")
    if demands_heavy_damping(problem):
        raise NotCovered("the problem requires heavy damping, which also keeps the roots real")
    nlp = formulate(problem)
    if set(nlp.contacts) & set(ROOT_NAMES):
        raise NotCovered(
            "an objective or constraint favours a large abscissa, a small damping ratio or a high frequency"
        )
    x = initial_point(nlp, problem, solution.parameters)
    if "abscissa" in nlp.variables:
        x[nlp.variables.index("abscissa")] = solution.abscissa / nlp.unit
    rows = nlp.evaluate(nlp.set_kinks(x))[1]
    if any(np.sort(rows[list(kink.rows)])[1] <= _TOLERANCE for kink in nlp.kinks if not kink.is_quotient):
        raise NotCovered("an abs, min or max has its kink there")
    return problem


def _decide_verdict(
    solution: Solution,
    structure: str,
    program: LocalProgram,
    conditions: Conditions,
    better_design: BetterDesign | None,
) -> tuple[str, int, str]:
    """The verdict, the order of the derivatives that decide it, and the verdict in a sentence."""
    problem, name = program.problem, f"this {structure} is"
    extreme = f"local {'maximum' if problem.sense == 'maximize' else 'minimum'} of {problem.goal}"
    extreme += ", though this was not asked for" if solution.problem.locate else ""
    if better_design is not None:
        reason = f"{_describe_descent(program, conditions)}; {_describe_better_design(solution, better_design)}"
        return NOT_MINIMAL, better_design.order, f"{name} no {extreme}: {reason}"
    if undecided_reason := _explain_undecided(program, conditions):
        return UNDECIDED, 0, f"undecided whether {name} a {extreme}: {undecided_reason}"
    unknown_count, condition_count = _count_unknowns(program)
    active_text = f"{condition_count} active condition{'s leave' if condition_count != 1 else ' leaves'}"
    idle_text = f"; without effect: {', '.join(program.idle)}" if program.idle else ""
    if np.isnan(conditions.curvature):
        reason = f"{active_text} none of the {unknown_count} unknowns free{idle_text}"
        return STRICT, 1, f"{name} a strict {extreme}: {reason}"
    direction = "downwards" if solution.problem.posed.sense == "maximize" else "upwards"
    conditions_text = f"{condition_count} active condition{'s' * (condition_count != 1)} for {unknown_count} unknowns"
    curvature_text = f"in every direction that these leave free the objective curves {direction}"
    return STRICT, 2, f"{name} a strict {extreme}: {conditions_text}, and {curvature_text}{idle_text}"


def _explain_undecided(program: LocalProgram, conditions: Conditions) -> str:
    """Why the conditions do not decide, although no better design was found; empty if they decide."""
    if conditions.residual > STATIONARY or (conditions.descent_direction.any() and np.isnan(conditions.curvature)):
        return f"{_describe_residual(conditions)}, but no better design was found downhill"
    deviations, sizes = np.abs(program.evaluate(program.x)[1]), np.array([h.size for h in program.rows])
    worst_deviation = float(
        np.divide(deviations, sizes, out=np.zeros_like(deviations), where=sizes > 0).max(initial=0.0)
    )
    if worst_deviation > _TOLERANCE:
        return f"the active conditions hold only to {worst_deviation:.1g}"
    loose_rows = [
        h for h, is_firm in zip(program.rows, conditions.is_firm, strict=True) if h.name == "c2" and not is_firm
    ]
    if any(program.rightmost_roots[h.root_index].multiplicity > 3 for h in loose_rows):
        return "no first-order condition keeps a multiple root together"  # c₄ ≤ c₂² may then outweigh c₂
    if curvature_sign(conditions.curvature) <= 0 and not np.isnan(conditions.curvature):
        change = "improves" if curvature_sign(conditions.curvature) else "is flat"
        return f"along the free directions the objective {change} to second order"
    return ""


def _describe_residual(conditions: Conditions) -> str:
    return f"the active conditions do not balance {conditions.residual:.1g} of the gradient"


def _count_unknowns(program: LocalProgram) -> tuple[int, int]:
    """Number of unknowns (parameters with an effect, and the abscissa); number of active rows that restrict them."""
    unknown_count = sum(name in program.problem.free for name in program.variables) + 1
    return unknown_count, len(program.rows) - (len(program.x) - unknown_count)


def _describe_descent(program: LocalProgram, conditions: Conditions) -> str:
    """How the objective improves: to first order, or by its curvature."""
    if curvature_sign(conditions.curvature) < 0:
        return "it is stationary, but second derivatives let it improve along the active conditions"
    if not conditions.is_independent or conditions.residual > STATIONARY:
        return _describe_residual(conditions)
    words_by_coefficient = {"c1": "roots move left of the others", "c2": "a multiple root splits"}
    scaled_rows = zip(program.rows, conditions.scaled_multipliers, strict=True)
    improvements = [
        words_by_coefficient.get(h.name, f"the design moves away from {h.name}")
        for h, y in scaled_rows
        if h.is_inequality and y < -POSITIVE
    ]
    return f"it improves if {' and if '.join(dict.fromkeys(improvements))}"


def _describe_better_design(solution: Solution, better_design: BetterDesign) -> str:
    """The parameters that change, and the better objective."""
    old, new = solution.parameters, better_design.parameters
    parts = [f"{n} {new[n]:.6g}" for n in solution.problem.free if abs(new[n] - old[n]) > 1e-9 * abs(old[n])]
    return f"{', '.join(parts)} gives {better_design.value:.6g}"


def _list_rightmost_roots(program: LocalProgram, conditions: Conditions, form: RealForm) -> tuple[RightmostRoot, ...]:
    """The roots on the rightmost line with their multipliers."""
    rightmost_roots, rows = [], list(zip(program.rows, conditions.multipliers.tolist(), strict=True))
    total_multiplier = sum(
        program.rightmost_roots[row.root_index].multiplicity * multiplier
        for row, multiplier in rows
        if row.name == "c1"
    )
    for k, root in enumerate(program.rightmost_roots):
        multipliers = {row.name: multiplier for row, multiplier in rows if row.root_index == k}
        c1, c2 = multipliers.pop("c1"), multipliers.pop("c2", math.nan)
        share = root.multiplicity * c1 / total_multiplier if total_multiplier else math.nan
        beta = c1 / 2 if root.im else c1  # β moves both roots of a pair by β/2
        # the user's root of a complex system is the conjugate
        (user_root,) = form.user_roots([root if form.carrier is None else replace(root, im=-root.im)])
        omega = (complex(-user_root.im, user_root.re),) if form.carrier is not None else ()
        ties = tuple(multipliers.values())
        rightmost_roots.append(
            RightmostRoot(user_root.re, user_root.im, root.multiplicity, share, beta, c2, ties, *omega)
        )
    return tuple(rightmost_roots)


def _compute_limit_gains(solution: Solution, program: LocalProgram, conditions: Conditions) -> Mapping[str, float]:
    """Gain of the objective per unit of relaxation; for an equality, per unit that is added to the right-hand side."""
    problem, gains = program.problem, dict[str, float]()
    for h, y, is_firm in zip(program.rows, conditions.multipliers.tolist(), conditions.is_firm, strict=True):
        if h.name in problem.constraints:
            gains[h.name] = y if h.is_inequality else problem.sign * y
        elif h.is_inequality and h.root_index < 0 and is_firm and (name := h.name.rsplit(".", 1)[0]) in problem.free:
            is_tangent = problem.parameter_set[name].tangent
            gains[h.name] = y * (1 + math.tan(solution.parameters[name]) ** 2 if is_tangent else 1.0)
    return gains
