"""The report of a solution: the answer, the design, its motion, its limits, its robustness, and further commands."""

import math
from collections.abc import Iterator

from tmsopt import plots
from tmsopt.analysis import Explanation, Lever, bound_lines, proof_line, structure_line
from tmsopt.documents.analysis import Analysis
from tmsopt.documents.blocks import (
    ALL_DIGITS,
    Badge,
    Cell,
    Chapter,
    Figure,
    Level,
    Parts,
    Sentence,
    TableBlock,
    Tone,
    Verbatim,
    count_things,
)
from tmsopt.documents.design_rows import (
    BRIEF_DIGITS,
    PERCENT,
    convert_to_si,
    describe_abscissas,
    describe_inertia,
    describe_loads,
    describe_motion,
    describe_pitching,
    describe_roots,
    describe_speed,
    list_cases,
    list_parameters,
    list_quantities,
    parameters_of_worst_case,
    tabulate_parameters,
    write_other_heading,
)
from tmsopt.documents.explanation import describe_rounding, tabulate_rounding, write_diagnosis, write_optimality
from tmsopt.documents.motion import describe_range
from tmsopt.documents.robustness import describe_robustness, tabulate_boundaries
from tmsopt.documents.tables import remove_empty_columns
from tmsopt.evaluation import abscissa_as_stored
from tmsopt.guide import describe
from tmsopt.models import tms
from tmsopt.problem import NO_RADIUS, Case, Problem, amounts_text, common_unit, show_at, status_text, unit_of
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import limit_text, round_one_way
from tmsopt.problem.verdict.stability import ROUNDED, STABLE, UNSTABLE
from tmsopt.problem.verdict.status import describe_status, describe_verdict
from tmsopt.records import Numbers

_FOLD = 5
"""With more free parameters, a brief report lists them in several columns."""
_MAX_FIXED = 14
"""Maximum number of fixed parameters that a brief report names."""
_MAX_LIMITS = 3
"""Maximum number of limits in a brief report."""
_REQUIREMENTS = {"a0": "must not be 0", "coefficients": "must have values"}
"""Name of a violation that is no constraint → what is required."""


def _summarise(solution: Solution) -> tuple[Badge | str, ...]:
    """Return the badges of the headline: status, objective, structure, proof, stability."""
    problem, stability = solution.problem.posed, solution.stability
    objective = problem.minimize or problem.maximize
    name, value = (objective, solution.value) if objective else ("abscissa", solution.abscissa)
    rounded = ROUNDED if stability.on_edge and not solution.edge_is_exact else ""
    growth = f" as {stability.growth}" if stability.growth else ""
    return (
        Badge(status_text(problem, solution.status), "good" if solution.status == "optimal" else "bad"),
        f"{' '.join(name.split())} = {show_at(problem, name, solution.parameters, value)}",
        abscissa_as_stored(solution),
        f"misses {amounts_text(problem, solution.missed)}" if solution.missed else "",
        solution.structure,
        Badge("proved" if solution.bound.proven else "", "good"),
        Badge(f"{stability.verdict}{growth}{rounded}" if stability.verdict else "", choose_tone(solution)),
    )


def write_solution(
    solution: Solution,
    level: Level,
    *,
    full: bool = False,
    si: Numbers | None = None,
    tabulated: bool = False,
) -> Parts:
    """Write the parts of the report in order.

    Args:
        full: whether a page, too, includes slow analyses.
        si: parameters in SI for a scale of your own, as from `convert_to_si`; a brief report then shows them, too.
        tabulated: whether a brief report, too, lists every parameter with its meaning.
    """
    yield _summarise(solution)
    analysis, si_parameters = solution.analysis, si or convert_to_si(solution)
    full, page, brief = full or level == "full", level == "page", level == "brief"
    explanation = analysis.full_explanation if full else analysis.explanation
    yield Chapter("conflict" if solution.status == "infeasible" else "answer")
    yield from _write_answer(solution, analysis, brief, full)
    if page:
        yield from write_bicycle(solution)
    yield Chapter("design", "Parameters", "wide")
    yield from _write_design(solution, si_parameters, brief and not tabulated, si is not None)
    yield from (Sentence(note, "note") for note in solution.notes)
    yield Chapter("motion")
    yield from _write_motion(solution, analysis, brief)
    if page:
        yield from write_growth_picture(solution)
    yield Chapter("cases")
    if solution.worst is not None:
        yield from _write_cases(solution, solution.worst)
    yield Chapter("limits", width="wide")
    yield from _write_limits(solution, explanation, full, page)
    if not brief:
        yield Chapter("robustness", "Robustness, rounding and optimality")
    yield from _write_robustness(solution, explanation, brief, full)
    if brief:
        yield _suggest_more(solution, analysis)
        return
    if full:
        yield Chapter("roots")
        if solution.multiple_as_rounded:
            yield "roots coincide up to rounding errors; tmsopt prove decides whether they coincide exactly"
        for diagnosis in analysis.diagnoses:
            yield from write_diagnosis(diagnosis)
    yield Chapter("quantities", "Derived quantities", "wide")
    head = ("quantity", "value", "unit", write_other_heading(solution, si_parameters), "meaning")
    rows = (head, *list_quantities(solution, si_parameters))
    yield TableBlock(remove_empty_columns(rows), "Quantities of the design")
    yield Chapter("search")
    yield from _write_search(solution)


def write_bicycle(solution: Solution) -> Parts:
    """Write the bicycle to scale, or the sketch of its model."""
    yield Chapter("bicycle")
    if solution.problem.model is tms:
        caption = "The bicycle from its right side, to scale, in wheelbases; z points down"
        yield Figure(plots.draw_bicycle, solution, caption)
    elif sketch := describe(solution).sketch:
        yield Verbatim(sketch, "sketch of the model, not to scale")


def write_growth_picture(solution: Solution) -> Parts:
    """Write a picture of growth rates and frequencies over the speed, or over the first parameter."""
    from tmsopt.dynamics import growth

    try:
        curves = growth(solution)
    except Exception:  # a root is at infinity, or no parameter can vary: there is nothing to draw
        return
    yield Chapter("growth", "Growth and frequencies")
    caption = f"Growth rates and frequencies over {curves.over.name}; stable where it is shaded"
    yield Figure(plots.growth_figure, curves, caption)


def write_headline(solution: Solution) -> tuple[Sentence, Sentence]:
    """Write two sentences: how the computation ended, and the objective with its value and the structure."""
    problem = solution.problem.posed
    text = problem.minimize or problem.maximize
    value = show_at(problem, text, parameters_of_worst_case(solution), solution.value, 8) if text else ""
    located = f"locate {problem.locate}" if problem.locate else ""
    sense = f"{problem.sense} " if problem.free else ""  # without free parameters, nothing is minimized
    objective_text = f"{sense}{text.strip()}" + (f" = {value}" if math.isfinite(solution.value) else "") if text else ""
    verdict = "; ".join(part for part in (describe_status(solution), describe_verdict(solution)) if part)
    structure = structure_line(problem, solution.structure, solution.abscissa, solution.meetings)
    structure += ROUNDED if solution.multiple_as_rounded else ""
    facts = "; ".join(part for part in (located, objective_text, abscissa_as_stored(solution), structure) if part)
    return Sentence(verdict, tone=choose_tone(solution)), Sentence(facts, tone="answer")


def choose_tone(solution: Solution) -> Tone:
    """Choose the tone of the verdict on a solution."""
    if solution.status != "optimal" or solution.stability.verdict == UNSTABLE:
        return "bad"
    return "good" if solution.stability.verdict == STABLE else "doubt"


def _write_answer(solution: Solution, analysis: Analysis, brief: bool, full: bool) -> Parts:
    verdict, facts = write_headline(solution)
    obstacles, further_obstacles = analysis.obstacles
    if solution.status == "infeasible":
        is_joined = obstacles and ": " not in verdict.text  # the first obstacle follows the verdict on the same line
        yield Sentence(f"{verdict.text}: {obstacles[0]}" if is_joined else verdict.text, tone="bad")
        yield from obstacles[1:] if is_joined else obstacles
        for name, value in solution.violations.items():
            unit = unit_of(solution.problem.posed, name)
            excess = f" by {unit.show(value, 4)}" if math.isfinite(value) else ", which has no value"
            excess = "" if name in _REQUIREMENTS else excess
            yield Sentence(f"{name} ({_describe_limit(solution, name)}){excess}", "violated")
        yield Sentence(facts.text, "nearest design")
    else:
        yield verdict
        yield facts
        yield from obstacles
    yield from further_obstacles if full else ()
    yield Sentence(proof_line(solution), "proof")
    if brief:
        active = (f"{name} ({_describe_limit(solution, name)})".removesuffix(" ()") for name in solution.active)
        yield Sentence(", ".join(active), "active limits")


def _describe_limit(solution: Solution, name: str) -> str:
    problem = solution.problem.posed
    return limit_text(problem, name) or ("pattern" if name in problem.located else _REQUIREMENTS.get(name, ""))


def _write_design(solution: Solution, si: Numbers, brief: bool, shows_si: bool) -> Parts:
    """Write all parameters in a table; if brief, only the free parameters, and the fixed parameters in a sentence."""
    if not brief:
        yield tabulate_parameters(solution, si)
        return
    listed = [*list_parameters(solution, si, brief=True)]
    rows = [(name, cell, si_text if shows_si else "") for name, cell, role, si_text, _ in listed if role == "free"]
    if rows:
        yield TableBlock((("", "", ""), *rows), fold=_FOLD, tone="answer")
    fixed_parameters = [f"{name} = {cell}" for name, cell, role, *_ in listed if role == "fixed"]
    excess = len(fixed_parameters) - _MAX_FIXED
    remainder = f", and {excess} more parameters" if excess > 0 else ""
    yield Sentence(", ".join(fixed_parameters[:_MAX_FIXED]) + remainder, "fixed", "dim")


def _write_motion(solution: Solution, analysis: Analysis, brief: bool) -> Parts:
    speed = describe_speed(solution, solution.worst)
    yield Sentence(f"{f'at {speed}: ' if speed else ''}{describe_motion(solution)}", "motion")
    if analysis.stable_speeds is not None:
        yield describe_range(analysis.stable_speeds, solution)
    label, text = describe_roots(solution, BRIEF_DIGITS)
    yield Sentence(text, label)
    if not brief:
        yield from describe_abscissas(solution)
    if "load_rear" in solution.quantities:
        yield Sentence(f"{describe_loads(solution)}; {describe_pitching(solution)}", "loads")
    yield Sentence(solution.problem.model.omits, "model")
    label = "largest moments of inertia of a stable design, each alone (radius of gyration)"
    yield Sentence(describe_inertia(solution), label)


def _write_cases(solution: Solution, worst: Case) -> Parts:
    """Write the worst case, other extreme cases, and a bound for all cases."""
    problem, cover, least_damped, fastest = solution.problem, solution.cover, solution.least_damped, solution.fastest
    case_text = "objective, motion and roots belong to this case, all other lines to the nominal design"
    yield Sentence(f"{_describe_case(problem, worst)}; {case_text}", "worst case")
    if least_damped not in (None, worst) and not problem.model.is_complex:
        label = "least damped case found" if problem.tolerances else "least damped case"
        yield Sentence(f"{_describe_case(problem, least_damped)}; the damping ratio belongs to this case", label)
    if fastest not in (None, worst):
        yield Sentence(
            f"{_describe_case(problem, fastest)}; limits on the frequency apply to this case", "fastest case"
        )
    if cover is not None:
        method = f"by interval arithmetic on {cover.boxes} boxes" if cover.proven else "by a search, not proved"
        unit = common_unit(problem.posed, "abscissa")
        limit = round_one_way(cover.limit / unit.factor, True, ALL_DIGITS) * unit.factor
        yield Sentence(f"abscissa at most {Cell(limit, unit, with_unit=True)}, {method}", "every case")


def _describe_case(problem: Problem, case: Case) -> str:
    """Write the values of scenarios and the errors of parameters in a case."""
    posed = problem.posed
    texts = [f"{n} = {unit_of(posed, n).show(v, 6)}" for n, v in case.at.items()]
    texts += [f"{n} {'+' if v >= 0 else '−'} {unit_of(posed, n).show(abs(v), 6)}" for n, v in case.offset.items()]
    return ", ".join(texts)


def _write_limits(solution: Solution, explanation: Explanation | None, full: bool, page: bool) -> Parts:
    names = dict.fromkeys((*solution.problem.constraints, *solution.violations))
    if page and names:
        rows = ((n, _describe_limit(solution, n), _describe_limit_status(solution, n)) for n in names)
        yield TableBlock((("limit", "condition", "status"), *rows), "Limits and their status")
    if explanation is None:
        return
    if explanation.levers:
        head = ("active limit", "value", "if relaxed by", "improvement (first order)")
        lever_rows = (_list_lever(solution, lever) for lever in explanation.levers)
        yield TableBlock((head, *lever_rows), "Effect of the active limits", max_rows=_MAX_LIMITS)
        yield from (lever.sentence for lever in explanation.levers if full)
    yield from (Sentence(text, "warning", "doubt") for text in explanation.warnings)


def _describe_limit_status(solution: Solution, name: str) -> str:
    """Describe whether a limit holds, is active or is violated."""
    if name in solution.violations:
        excess, unit = solution.violations[name], unit_of(solution.problem.posed, name)
        return f"violated by {unit.show(excess, 4)}" if math.isfinite(excess) else "has no value"
    return "active" if name in solution.active else f"holds{_describe_margin(solution, name)}"


def _describe_margin(solution: Solution, name: str) -> str:
    """Write the smallest margin of an inequality over all cases of the design; empty if it is not finite."""
    problem, condition = solution.problem.posed, solution.problem.posed.conditions[name]
    if condition.equality:
        return ""
    # the radius is not computed again, because it needs a search
    radius = {n: x for n, x in solution.quantities.items() if n == NO_RADIUS.name}
    margin = min(
        -condition.sign * float(condition(problem.values(case.applied(solution.parameters)).with_known(radius)))
        for case in list_cases(solution) or [Case()]
    )
    quantities = (*problem.model.quantities, *problem.parameter_set.quantities)
    unit = unit_of(problem, name)
    if not unit.text and any(q.share and q.name in condition.names for q in quantities):
        unit = PERCENT
    return f" by {unit.show(margin, 4)}" if math.isfinite(margin) else ""


def _list_lever(solution: Solution, lever: Lever) -> tuple[str, ...]:
    """List the name and the text of an active limit, a small relaxation, and the improvement to first order."""
    limit = limit_text(solution.problem.posed, lever.name)
    if not lever.step:
        return lever.name, limit, "a physical limit", ""
    step = unit_of(solution.problem.posed, lever.name).show(abs(lever.step), 4)
    return lever.name, limit, step, lever.gained.show(lever.predicted, 3)


def _write_robustness(solution: Solution, explanation: Explanation | None, brief: bool, full: bool) -> Parts:
    robustness = solution.analysis.boundaries if full else solution.analysis.robustness
    if robustness is not None:
        yield Sentence(describe_robustness(robustness, solution.stability.on_edge), "robustness")
        if full:
            yield from tabulate_boundaries(robustness)
    if explanation is not None and explanation.precision:
        yield Sentence(describe_rounding(explanation, solution.problem.posed.model.noun), "rounding")
        if not brief:
            yield tabulate_rounding(explanation)
    if not brief:
        yield from bound_lines(solution)
        yield from write_optimality(explanation.optimality) if explanation else ()


def _write_search(solution: Solution) -> Parts:
    freedom, starts = solution.freedom, solution.starts
    if solution.problem.locate:
        parameters = count_things(freedom.free, "free parameter")
        count = count_things(freedom.conditions, "parameter suffices", "parameters suffice")
        needed = f": {count}" if freedom.by_symmetry else ""
        yield Sentence(f"{freedom.kind}, {parameters}; {freedom.describe_conditions()}{needed}", "freedom")
    yield from list_branches(solution)
    if starts.tried:
        skipped_count = starts.tried - starts.runs
        skipped_text = (
            f" ({skipped_count} not run, because they lead to a known optimum)" if starts.runs and skipped_count else ""
        )
        sample_text = f"; sample of {starts.looked} designs" if starts.looked else ""
        count_text = (
            f"{starts.tried}{skipped_text}; {starts.converged} lead to an optimum, {starts.at_best} to the best design"
        )
        yield Sentence(f"{count_text}{sample_text}; {solution.seconds:.2f} s", "starts")


def list_branches(solution: Solution) -> Iterator[str]:
    """List other designs that solve the same equations, and the limits that exclude them."""
    problem = solution.problem.posed
    for branch in solution.branches:
        design = ", ".join(f"{n} = {unit_of(problem, n).show(branch.parameters[n], ALL_DIGITS)}" for n in problem.free)
        yield f"also solved by {design}; excluded by {', '.join(branch.excluded_by) or 'nothing'}"


def _suggest_more(solution: Solution, analysis: Analysis) -> Sentence:
    """Suggest --full, and the commands that apply to the same file."""
    problem = solution.problem.posed
    commands = {
        "prove": solution.status == "optimal",
        "compare": problem.model is tms,
        "speeds": analysis.stable_speeds is not None,
        "chart": len(problem.free) in (2, 3),
        "trace": bool(problem.locate) and solution.freedom.count == 1,
    }
    names = ", ".join(f"tmsopt {name}" for name, applies in commands.items() if applies)
    return Sentence("--full prints everything" + (f"; for the same file: {names}" if names else ""), "more", "dim")
