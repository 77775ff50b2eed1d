"""Tables and lines of a solution's report: parameters, quantities, motion, roots, loads.

Some models have two parameter sets, dimensionless and in SI. The report then shows each number also in the other set.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from tmsopt.documents.blocks import ALL_DIGITS, Cell, Row, TableBlock
from tmsopt.dynamics.speeds import speed_of
from tmsopt.evaluation.recheck import FEASIBILITY_TOLERANCE
from tmsopt.guide import describe
from tmsopt.models import GRAVITY, INERTIAS, Parameter, Quantity, Values, to_si
from tmsopt.models.user_spectrum import eigenfrequencies, roots_on_axis
from tmsopt.problem.cases import Case
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import Unit, show_at, unit_at, unit_of
from tmsopt.problem.units import frequencies
from tmsopt.problem.verdict.stability import ROUNDED
from tmsopt.records import Numbers
from tmsopt.roots import Root

BRIEF_DIGITS = 5
"""Significant digits of a number in a brief report."""
ZERO_SHARE = 1e-14
"""A number below this share of its scale (the size of a root, or 1) is only rounding and is shown as 0."""
_RANGE_ROUNDING = 1e-12
"""A value below this share of the length of its range is only rounding and is shown as 0."""
PERCENT = Unit("%", 0.01)


def convert_to_si(solution: Solution, w: float = 1.0, m_B: float = 1.0, g: float = GRAVITY) -> Numbers:
    """Convert dimensionless parameters to SI for a wheelbase, rear mass and gravity; SI parameters stay unchanged."""
    needs_no_conversion = solution.problem.posed.parameter_set.rate is not None or len(solution.problem.model.sets) == 1
    return solution.parameters if needs_no_conversion else to_si(solution.dimensionless, w, m_B, g)


def write_other_heading(solution: Solution, si: Numbers) -> str:
    """Write the heading of the numbers in the other parameter set: without units, or in SI with the scale used."""
    if solution.problem.posed.parameter_set.rate is not None:
        return "without units"
    return f"in SI if w = {si['w']:g} m, m_B = {si['m_B']:g} kg" if {"w", "m_B"} <= si.keys() else "in SI"


def list_parameters(solution: Solution, si: Numbers, brief: bool = False) -> Iterator[tuple[str, Cell, str, str, str]]:
    """List the name, number, role, value in the other set, and meaning of each parameter.

    Fixed parameters that are 0 by default are left out.

    Args:
        si: the parameters in SI; for a model with only one set, the parameters of the solution.
        brief: whether the numbers have few digits and are followed by their units.
    """
    problem, digits = solution.problem.posed, BRIEF_DIGITS if brief else ALL_DIGITS
    other_sets = [s for s in problem.model.sets if s is not problem.parameter_set]
    for p in problem.parameter_set.parameters:
        x, (lower, upper) = solution.parameters[p.name], problem.free.get(p.name, (0.0, 0.0))
        x = 0.0 if abs(x) <= _RANGE_ROUNDING * (upper - lower) else x
        role = "free" if p.name in problem.free else "scenario" if p.name in problem.scenarios else "fixed"
        if role == "fixed" and x == 0 == p.default:
            continue
        counterpart_text = ""
        for other_set in other_sets:
            values = solution.dimensionless if other_set.rate is None else si
            for q in other_set.parameters if p.name not in other_set.names else ():
                if p.counterpart == q.name or q.counterpart == p.name:
                    counterpart_text = counterpart_text or _describe_counterpart(q, values[q.name], digits)
        meaning = "" if p.meaning == "parameter" else p.meaning
        yield p.name, Cell(x, unit_of(problem, p.name), digits, with_unit=brief), role, counterpart_text, meaning


def tabulate_parameters(solution: Solution, si: Numbers) -> TableBlock:
    """Tabulate every parameter with its role, range, value in the other set, and meaning."""
    ranges = {w.name: w.given for parameter_set in describe(solution).sets for w in parameter_set.parameters}
    other_form = write_other_heading(solution, si)
    rows: list[Row] = [("parameter", "value", "unit", "free or fixed", "range", other_form, "meaning")]
    for name, cell, role, counterpart, meaning in list_parameters(solution, si):
        rows.append((name, cell, cell.unit.text, role, ranges[name] if role == "free" else "", counterpart, meaning))
    return TableBlock(rows, "Parameters of the design")


def list_quantities(solution: Solution, si: Numbers) -> Iterator[Row]:
    """List the name, number, unit, value in SI if the number is dimensionless, and meaning of each finite quantity."""
    problem = solution.problem.posed
    parameter_set = problem.parameter_set
    si_set = next((s for s in problem.model.sets if s.rate is not None and s is not parameter_set), None)
    values = None if si_set is None else Values(problem.model, si_set, si)
    for q in (*problem.model.quantities, *parameter_set.quantities):
        x = float(solution.quantities.get(q.name, math.nan))
        if not math.isfinite(x) or q.aside:
            continue
        cell = Cell(x, unit_of(problem, q.name))
        if q.share:
            cell = Cell(x if abs(x) > FEASIBILITY_TOLERANCE else 0.0, PERCENT, 6)
        text, counterpart = "", q.counterpart
        if counterpart is not None and values is not None:
            number = float(counterpart.value(values)) if cell.value else 0.0
            text = _describe_counterpart(counterpart, number)
        yield q.name, cell, cell.unit.text, text, q.meaning


def list_cases(solution: Solution) -> list[Case]:
    """List the cases that the problem states, and the extreme cases that the solver found."""
    stated_cases = [case for case in solution.problem.posed.cases if not case.direction]
    return stated_cases + [
        case for case in (solution.worst, solution.least_damped, solution.fastest) if case is not None
    ]


def parameters_of_worst_case(solution: Solution) -> Numbers:
    """Return the parameters that roots and abscissa belong to: those of the worst case, if there are cases."""
    return solution.worst.applied(solution.parameters) if solution.worst else solution.parameters


def describe_motion(solution: Solution) -> str:
    """Describe how fast a disturbance dies out or grows, and at which frequencies it oscillates."""
    rate, time_unit, frequency_unit = _find_time_units(solution)
    abscissa = solution.abscissa * rate
    if solution.stable is None:
        return "no motion to describe: a root is at infinity"
    stability = solution.stability
    growth = f"grows as {stability.growth}{'' if solution.edge_is_exact else ROUNDED}"
    decay_text = growth if stability.growth else "neither decay nor growth"
    if not stability.on_edge:
        decay_text = f"{'decay' if abscissa < 0 else 'growth'} time {time_unit.show(1 / abs(abscissa), 4)}"
    if solution.problem.model.is_complex:
        edge_text = growth if stability.growth else "neither loss nor gain"
        gain_text = f"{'least loss' if abscissa < 0 else 'gain'} {abs(abscissa):.4g} ({decay_text})"
        real_text = _name_real_eigenfrequencies(solution) if stability.on_edge or solution.beyond_axis else ""
        return f"{edge_text if stability.on_edge else gain_text}{real_text}"
    oscillations = [f for f in frequencies(solution.roots, rate) if f * 2 * math.pi > 1e-9 * rate]
    if not oscillations:
        return f"{decay_text}; no oscillation"
    factor, prefix = (1.0, "") if frequency_unit.text == "Hz" else (2 * math.pi, "angular ")
    name = prefix + ("frequency" if len(oscillations) == 1 else "frequencies")
    values = " and ".join(f"{factor * f:.4g}" for f in dict.fromkeys(oscillations))
    ratio, damped_speed = solution.quantities["damping_ratio"], describe_speed(solution, solution.least_damped)
    speed = f" at {damped_speed}" if damped_speed and damped_speed != describe_speed(solution, solution.worst) else ""
    damping = f"damping ratio {ratio if abs(ratio) > ZERO_SHARE else 0:.4g}{speed}"
    return f"{decay_text}; {name} {values} {frequency_unit.text}".rstrip() + f"; {damping}"


def describe_speed(solution: Solution, case: Case | None) -> str:
    """Write the speed of a case; empty unless the cases have different speeds."""
    name = speed_of(solution.problem.posed.parameter_set)
    if name is None or case is None or name not in {**case.at, **case.offset}:
        return ""
    return f"{name} = {unit_of(solution.problem.posed, name).show(case.applied(solution.parameters)[name])}"


def describe_loads(solution: Solution) -> str:
    """Describe the load on each wheel."""
    quantities, problem = solution.quantities, solution.problem.posed
    parts = []
    for wheel, share, load in (("front", "load_front", "N_F"), ("rear", "load_rear", "N_R")):
        is_lifted = abs(quantities[share]) <= FEASIBILITY_TOLERANCE
        percent = f"{0.0 if is_lifted else 100 * quantities[share]:.4g} %"
        if math.isfinite(newtons := quantities.get(load, math.nan)):
            percent = f"{unit_of(problem, load).show(0.0 if is_lifted else newtons, 4)} ({percent})"
        parts.append(f"{wheel} wheel {percent}")
    return ", ".join(parts)


def describe_pitching(solution: Solution) -> str:
    """Describe whether the bicycle pitches over in any case, and the ballast that prevents it."""
    cases = list_cases(solution)
    case_values: list[Mapping[str, Any]] = [
        solution.problem.posed.values(case.applied(solution.parameters)) for case in cases
    ]
    case_values = case_values or [solution.quantities]
    in_case = " in the worst case" if cases else ""
    for wheel, pivot in (("rear", "front"), ("front", "rear")):
        load = min(float(case[f"load_{wheel}"]) for case in case_values)
        if abs(load) <= FEASIBILITY_TOLERANCE:  # the tolerance of an active limit chi_T <= 1
            return f"on the verge of pitching over the {pivot} wheel{in_case}; the {wheel} wheel carries no load"
        if load < 0:
            return f"pitches over the {pivot} wheel{in_case}{_describe_ballast(solution, case_values, wheel)}"
    return "on both wheels in every case listed" if cases else "stands on both wheels"


def _describe_ballast(solution: Solution, case_values: Sequence[Mapping[str, Any]], wheel: str) -> str:
    """Describe the ballast at a contact point that does not change the lateral motion; with trail, only at the rear."""
    problem = solution.problem.posed
    units = {f"m_ballast_{wheel}": unit_of(problem, "m_B"), f"ballast_{wheel}": Unit("m_B")}
    for name, unit in units.items():
        if name in problem.vocabulary:
            needed = unit.show(max(float(values[name]) for values in case_values), 4)
            return (
                f"; ballast of {needed} at the {wheel} contact prevents this without changing the lean and steer motion"
            )
    return ""


def describe_inertia(solution: Solution) -> str:
    """List the largest moments of inertia for which the design stays stable, also as radii of gyration √(I/m)."""
    length_unit, parts = unit_of(solution.problem.posed, "w"), []
    for name, inertia in (solution.inertia_margin or {}).items():
        radius = (
            "" if inertia is None else length_unit.show(math.sqrt(inertia / solution.parameters[INERTIAS[name]]), 3)
        )
        parts.append(f"{name} {inertia:.4g} kg m^2 ({radius})" if radius else f"{name} without limit")
    return ", ".join(parts)


def describe_roots(solution: Solution, digits: int) -> tuple[str, str]:
    """Return a label and a text: the roots, or the eigenfrequencies of a complex system."""
    if not solution.problem.model.is_complex:
        problem = solution.problem.posed
        unit = unit_at(problem, "abscissa", parameters_of_worst_case(solution))
        unit_text = f"  in {unit.text}" if unit.text else ""
        unit_text += (
            f"; √(g/w) = {1 / unit.factor:.{digits}g} {unit.text}" if unit != unit_of(problem, "abscissa") else ""
        )
        return "roots", (", ".join(format_roots(solution.roots, digits, 1 / unit.factor)) or "none") + unit_text
    omegas = solution.eigenfrequencies
    middle = sum(z.re for z in omegas) / len(omegas) if omegas else 0.0
    spread = max((math.hypot(z.re - middle, z.im) for z in omegas), default=0.0) or 1.0
    digits = min(digits + max(0, math.ceil(math.log10(max(abs(middle), spread) / spread))), ALL_DIGITS)
    return "eigenfrequencies", ", ".join(format_frequency(z.re, z.im, digits, z.multiplicity) for z in omegas)


def format_root(root: Any, digits: int, multiplicity: int = 1, threshold: float = 0.0) -> str:
    """Write the eigenfrequency of a root if it has one, otherwise the root or the pair of roots."""
    if (omega := root.eigenfrequency) is not None:
        return format_frequency(omega.real, omega.imag, digits, multiplicity, threshold)
    return format_pair(root.re, root.im, digits, multiplicity, threshold)


def format_frequency(re: float, im: float, digits: int, multiplicity: int = 1, threshold: float = 0.0) -> str:
    """Write an eigenfrequency; a part that is only rounding, or at most the threshold, is 0."""
    re, im = _drop_noise(re, im, threshold)
    value = f"{im:.{digits}g}i" if im and not re else f"{re:.{digits}g}"
    value += f" {'-' if im < 0 else '+'} {abs(im):.{digits}g}i" if re and im else ""
    return value + format_multiplicity(multiplicity)


def format_pair(re: float, im: float, digits: int, multiplicity: int = 1, threshold: float = 0.0) -> str:
    """Write a root or a pair of roots; a part that is only rounding, or at most the threshold, is 0."""
    re, im = _drop_noise(re, im, threshold)
    return f"{re:.{digits}g}" + (f" ± {im:.{digits}g}i" if im else "") + format_multiplicity(multiplicity)


def _drop_noise(re: float, im: float, threshold: float) -> tuple[float, float]:
    threshold = max(threshold, ZERO_SHARE * math.hypot(re, im))
    return re if abs(re) > threshold else 0.0, im if abs(im) > threshold else 0.0


def format_roots(roots: Sequence[Root], digits: int = 8, rate: float = 1.0) -> list[str]:
    """Write the roots multiplied by a rate; a conjugate pair is one entry."""
    return [format_pair(r.re * rate, r.im * rate, digits, r.multiplicity) for r in roots if r.im >= 0]


def format_multiplicity(multiplicity: int) -> str:
    """Write the multiplicity that follows the value of a root; empty for a simple root."""
    return f" ({multiplicity}-fold)" if multiplicity > 1 else ""


def describe_abscissas(solution: Solution) -> Iterator[str]:
    """Describe the abscissa of the design, its abscissa after rounding to doubles, and its roots, to 12 digits."""
    problem, case_parameters = solution.problem.posed, parameters_of_worst_case(solution)
    size = max((r.size for r in solution.roots), default=1.0)
    abscissas = (solution.abscissa, solution.abscissa_realised)
    exact_abscissa, stored_abscissa = (x if abs(x) > ZERO_SHARE * size else 0.0 for x in abscissas)
    stored_text = unit_at(problem, "abscissa", case_parameters).number(stored_abscissa, ALL_DIGITS)
    exact_text = show_at(problem, "abscissa", case_parameters, exact_abscissa, ALL_DIGITS)
    yield f"abscissa {exact_text}; with the parameters rounded to doubles {stored_text}"
    label, text = describe_roots(solution, ALL_DIGITS)
    yield f"{label} to {ALL_DIGITS} digits: {text}"


def _find_time_units(solution: Solution) -> tuple[float, Unit, Unit]:
    """Return the factor from roots to 1/s (or 1), and the units of time and frequency: s and Hz, or the model's own."""
    parameter_set = solution.problem.posed.parameter_set
    if parameter_set.rate is not None:
        return float(parameter_set.rate(parameters_of_worst_case(solution))), Unit("s"), Unit("Hz")
    has_natural_time = any(s.rate is not None for s in solution.problem.model.sets)
    return 1.0, Unit("√(w/g)" if has_natural_time else ""), Unit("√(g/w)" if has_natural_time else "")


def _name_real_eigenfrequencies(solution: Solution) -> str:
    """Name the real eigenfrequencies of a complex system."""
    real_frequencies = eigenfrequencies(solution.problem.model, roots_on_axis(solution.roots))
    texts = [format_frequency(z.re, 0.0, 5, z.multiplicity) for z in real_frequencies]
    return f"; {' and '.join(texts)} {'is' if len(texts) == 1 else 'are'} real" if texts else ""


def _describe_counterpart(counterpart: Parameter | Quantity, x: float, digits: int = ALL_DIGITS) -> str:
    """Write a parameter or quantity of the other set with its value."""
    return f"{counterpart.name} = {Unit('' if counterpart.unit == '1' else counterpart.unit).show(x, digits)}"
