"""The report of a solution: the answer, then the design, its motion, its limits, robustness, and further commands."""

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
    BRIEF,
    PERCENT,
    convert_to_si,
    describe_inertia,
    describe_loads,
    describe_motion,
    describe_pitching,
    describe_roots,
    describe_speed,
    describe_stored,
    head_other_form,
    list_cases,
    list_parameters,
    list_quantities,
    parameters_of_worst_case,
    tabulate_parameters,
)
from tmsopt.documents.explanation import describe_rounding, tabulate_rounding, write_diagnosis, write_optimality
from tmsopt.documents.motion import describe_range
from tmsopt.documents.robustness import describe_robustness, tabulate_boundaries
from tmsopt.documents.tables import without_empty_columns
from tmsopt.evaluation import abscissa_as_stored
from tmsopt.guide import describe
from tmsopt.models import tms
from tmsopt.problem import NO_RADIUS, Case, Problem, amounts_text, common_unit, show_at, status_text, unit_of
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import limit_text
from tmsopt.problem.verdict.stability import ROUNDED, STABLE, UNSTABLE
from tmsopt.problem.verdict.status import describe_status, describe_verdict
from tmsopt.records import Numbers

_FOLD, _MAX_FIXED = 5, 14  # in a brief report, free parameters in one column, and the most fixed parameters named
_MAX_LIMITS = 3  # a brief report shows at most so many limits
_OTHER = {"a0": "must not be 0", "coefficients": "must have values"}


def _summarise(solution: Solution) -> tuple[Badge | str, ...]:
    """Return the words of the headline: status, objective, structure, proof, stability."""
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
        Badge(f"{stability.verdict}{growth}{rounded}" if stability.verdict else "", judge_tone(solution)),
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
        full: whether a page includes slow analyses.
        si: parameters in SI for another scale, as from `si_parameters`. If given, a brief report shows them.
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
        yield Chapter("sureness", "Robustness, rounding and optimality")
    yield from _write_sureness(solution, explanation, brief, full)
    if brief:
        yield _suggest_more(solution, analysis)
        return
    if full:
        yield Chapter("roots")
        if solution.multiple_as_rounded:
            yield "roots coincide up to rounding errors; tmsopt prove decides it for the numbers as typed"
        for diagnosis in analysis.diagnoses:
            yield from write_diagnosis(diagnosis)
    yield Chapter("quantities", "Derived quantities", "wide")
    head = ("quantity", "value", "unit", head_other_form(solution, si_parameters), "meaning")
    rows = (head, *list_quantities(solution, si_parameters))
    yield TableBlock(without_empty_columns(rows), "Quantities of the design")
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
    return Sentence(verdict, tone=judge_tone(solution)), Sentence(facts, tone="answer")


def judge_tone(solution: Solution) -> Tone:
    if solution.status != "optimal" or solution.stability.verdict == UNSTABLE:
        return "bad"
    return "good" if solution.stability.verdict == STABLE else "doubt"


def _write_answer(solution: Solution, analysis: Analysis, brief: bool, full: bool) -> Parts:
    verdict, facts = write_headline(solution)
    obstacles, further = analysis.obstacles
    if solution.status == "infeasible":
        is_joined = ": " not in verdict.text and obstacles
        yield Sentence(f"{verdict.text}: {obstacles[0]}" if is_joined else verdict.text, tone="bad")
        yield from obstacles[1:] if is_joined else obstacles
        for name, value in solution.violations.items():
            unit = unit_of(solution.problem.posed, name)
            excess = f" by {unit.show(value, 4)}" if math.isfinite(value) else ", which has no value"
            excess = "" if name in _OTHER else excess
            yield Sentence(f"{name} ({_describe_limit(solution, name)}){excess}", "violated")
        yield Sentence(facts.text, "nearest design")
    else:
        yield verdict
        yield facts
        yield from obstacles
    yield from further if full else ()
    yield Sentence(proof_line(solution), "proof")
    if brief:
        active = (f"{name} ({_describe_limit(solution, name)})".removesuffix(" ()") for name in solution.active)
        yield Sentence(", ".join(active), "active limits")


def _describe_limit(solution: Solution, name: str) -> str:
    problem = solution.problem.posed
    return limit_text(problem, name) or ("pattern" if name in problem.located else _OTHER.get(name, ""))


def _write_design(solution: Solution, si: Numbers, brief: bool, shows_si: bool) -> Parts:
    """Write all parameters in a table; if brief, the free ones side by side and the fixed ones in a sentence."""
    if not brief:
        yield tabulate_parameters(solution, si)
        return
    listed = [*list_parameters(solution, si, brief=True)]
    rows = [(name, cell, also if shows_si else "") for name, cell, role, also, _ in listed if role == "free"]
    if rows:
        yield TableBlock((("", "", ""), *rows), fold=_FOLD, tone="answer")
    fixed_parameters = [f"{name} = {cell}" for name, cell, role, *_ in listed if role == "fixed"]
    excess = len(fixed_parameters) - _MAX_FIXED
    remainder = f", and {excess} more parameters" if excess > 0 else ""
    yield Sentence(", ".join(fixed_parameters[:_MAX_FIXED]) + remainder, "fixed", "dim")


def _write_motion(solution: Solution, analysis: Analysis, brief: bool) -> Parts:
    at = describe_speed(solution, solution.worst)
    yield Sentence(f"{f'at {at}: ' if at else ''}{describe_motion(solution)}", "motion")
    if analysis.stable_speeds is not None:
        yield describe_range(analysis.stable_speeds, solution)
    label, text = describe_roots(solution, BRIEF)
    yield Sentence(text, label)
    if not brief:
        yield from describe_stored(solution)
    if "load_rear" in solution.quantities:
        yield Sentence(f"{describe_loads(solution)}; {describe_pitching(solution)}", "loads")
    yield Sentence(solution.problem.model.omits, "model")
    inertia = "largest stable inertia, one at a time (radius of gyration)"
    yield Sentence(describe_inertia(solution), inertia)


def _write_cases(solution: Solution, worst: Case) -> Parts:
    """Write the worst case, other extreme cases, and a bound for all cases."""
    problem, cover, least_damped, fastest = solution.problem, solution.cover, solution.least_damped, solution.fastest
    case_text = "objective, motion and roots belong to this case, all else to the nominal design"
    yield Sentence(f"{_describe_case(problem, worst)}; {case_text}", "worst case")
    if least_damped not in (None, worst) and problem.model.carrier is None:
        label = "least damped case found" if problem.tolerances else "least damped case"
        yield Sentence(f"{_describe_case(problem, least_damped)}; the damping ratio belongs to this case", label)
    if fastest not in (None, worst):
        yield Sentence(
            f"{_describe_case(problem, fastest)}; limits on the frequency apply to this case", "fastest case"
        )
    if cover is not None:
        method = f"by interval arithmetic on {cover.boxes} boxes" if cover.proven else "by a search, not proved"
        unit = common_unit(problem.posed, "abscissa")
        yield Sentence(f"abscissa at most {Cell(cover.limit, unit, with_unit=True)}, {method}", "every case")


def _describe_case(problem: Problem, case: Case) -> str:
    """Write the values of scenarios and the errors of parameters in a case."""
    posed = problem.posed
    texts = [f"{n} = {unit_of(posed, n).show(v, 6)}" for n, v in case.at.items()]
    texts += [f"{n} {'+' if v >= 0 else '−'} {unit_of(posed, n).show(abs(v), 6)}" for n, v in case.offset.items()]
    return ", ".join(texts)


def _write_limits(solution: Solution, explanation: Explanation | None, full: bool, page: bool) -> Parts:
    names = dict.fromkeys((*solution.problem.constraints, *solution.violations))
    if page and names:
        rows = ((n, _describe_limit(solution, n), _describe_standing(solution, n)) for n in names)
        yield TableBlock((("limit", "condition", "status"), *rows), "Limits and their status")
    if explanation is None:
        return
    if explanation.levers:
        head = ("active limit", "value", "if relaxed by", "improvement (first order)")
        lever_rows = (_list_lever(solution, lever) for lever in explanation.levers)
        yield TableBlock((head, *lever_rows), "Effect of the active limits", max_rows=_MAX_LIMITS)
        yield from (lever.sentence for lever in explanation.levers if full)
    yield from (Sentence(text, "warning", "doubt") for text in explanation.warnings)


def _describe_standing(solution: Solution, name: str) -> str:
    """Describe whether a limit holds, is active or is violated."""
    if name in solution.violations:
        by, unit = solution.violations[name], unit_of(solution.problem.posed, name)
        return f"violated by {unit.show(by, 4)}" if math.isfinite(by) else "has no value"
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
    """List name and text of an active limit, a small relaxation of it, and the improvement to first order."""
    limit = limit_text(solution.problem.posed, lever.name)
    if not lever.step:
        return lever.name, limit, "a physical limit", ""
    step = unit_of(solution.problem.posed, lever.name).show(abs(lever.step), 4)
    return lever.name, limit, step, lever.gained.show(lever.predicted, 3)


def _write_sureness(solution: Solution, explanation: Explanation | None, brief: bool, full: bool) -> Parts:
    robustness = solution.analysis.boundaries if full else solution.analysis.robustness
    if robustness is not None:
        yield Sentence(describe_robustness(robustness, solution.stability.on_edge), "robustness")
        if full:
            yield tabulate_boundaries(robustness)
    if explanation is not None and explanation.precision:
        yield Sentence(describe_rounding(explanation), "rounding")
        if not brief:
            yield tabulate_rounding(explanation)
    if not brief:
        yield from bound_lines(solution)
        yield from write_optimality(explanation.optimality) if explanation else ()


def _write_search(solution: Solution) -> Parts:
    free, starts, problem = solution.freedom, solution.starts, solution.problem
    if problem.locate:
        parameters, conditions = count_things(free.free, "free parameter"), count_things(free.conditions, "condition")
        yield Sentence(f"{free.kind}, {parameters} and {conditions}", "freedom")
    yield from list_branches(solution)
    if starts.tried:
        skipped_count = starts.tried - starts.runs
        skipped_text = (
            f" ({skipped_count} not run but counted, as they lead to a known optimum)"
            if starts.runs and skipped_count
            else ""
        )
        sample_text = f"; sample of {starts.looked} designs" if starts.looked else ""
        count_text = (
            f"{starts.tried}{skipped_text}, {starts.converged} converged, {starts.at_best} reached the best design"
        )
        yield Sentence(f"{count_text}{sample_text}; {solution.seconds:.2f} s", "starts")


def list_branches(solution: Solution) -> Iterator[str]:
    """List other designs that solve the same equations, and the limits that exclude them."""
    problem = solution.problem.posed
    for branch in solution.branches:
        where = ", ".join(f"{n} = {unit_of(problem, n).show(branch.parameters[n], ALL_DIGITS)}" for n in problem.free)
        yield f"also solved by {where}; excluded by {', '.join(branch.excluded_by) or 'nothing'}"


def _suggest_more(solution: Solution, analysis: Analysis) -> Sentence:
    """Suggest --full, and the commands that apply to the same file."""
    problem, solved = solution.problem.posed, solution.status == "optimal"
    commands = {
        "prove": solved,
        "compare": problem.model is tms,
        "speeds": analysis.stable_speeds is not None,
        "chart": len(problem.free) in (2, 3),
        "trace": bool(problem.locate) and solution.freedom.count == 1,
    }
    names = ", ".join(f"tmsopt {name}" for name, applies in commands.items() if applies)
    return Sentence("--full prints everything" + (f"; for the same file: {names}" if names else ""), "more", "dim")
