"""Tables and lines of the report of a design: parameters, quantities, motion, roots, loads.

A model that is dimensionless and in SI has the number of the other set next to each.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from tmsopt.documents.blocks import ALL, Cell, Row, TableBlock
from tmsopt.dynamics.speeds import speed_of
from tmsopt.evaluation.recheck import FEASIBLE
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

BRIEF = 5
"""Digits of a number in a brief report."""
NOTHING = 1e-14
"""Share of the size of a root, or of 1: less is rounding."""
_OF_RANGE = 1e-12  # share of a range: less is rounding
PERCENT = Unit("%", 0.01)


def convert_to_si(solution: Solution, w: float = 1.0, m_B: float = 1.0, g: float = GRAVITY) -> Numbers:
    """SI parameters: as solved for, or of dimensionless skates for the given wheelbase, rear mass and gravity."""
    own = solution.problem.posed.parameter_set.rate is not None or len(solution.problem.model.sets) == 1
    return solution.parameters if own else to_si(solution.dimensionless, w, m_B, g)


def list_parameters(solution: Solution, si: Numbers, brief: bool = False) -> Iterator[tuple[str, Cell, str, str, str]]:
    """Name, number, role, what it is in the other set, and meaning of each parameter.

    Parameters that are 0 by default are left out.

    Args:
        si: the parameters in SI; of a model without a dimensionless form those of the solution.
        brief: with few digits, each number with its unit.
    """
    problem, digits = solution.problem.posed, BRIEF if brief else ALL
    others = [s for s in problem.model.sets if s is not problem.parameter_set]
    for p in problem.parameter_set.parameters:
        x, (lower, upper) = solution.parameters[p.name], problem.free.get(p.name, (0.0, 0.0))
        x = 0.0 if abs(x) <= _OF_RANGE * (upper - lower) else x
        role = "free" if p.name in problem.free else "scenario" if p.name in problem.scenarios else "fixed"
        if role == "fixed" and x == 0 == p.default:
            continue
        also = ""
        for other in others:
            values = solution.dimensionless if other.rate is None else si
            for q in other.parameters if p.name not in other.names else ():
                if p.counterpart == q.name or q.counterpart == p.name:
                    also = also or _describe_twin(q, values[q.name], digits)
        meaning = "" if p.meaning == "parameter" else p.meaning
        yield p.name, Cell(x, unit_of(problem, p.name), digits, named=brief), role, also, meaning


def tabulate_parameters(solution: Solution, si: Numbers) -> TableBlock:
    """Every parameter with its role, its range, what it is in the other set, and its meaning."""
    ranges = {w.name: w.given for of in describe(solution).sets for w in of.parameters}
    other = "without units" if solution.problem.posed.parameter_set.rate is not None else "in SI"
    rows: list[Row] = [("parameter", "value", "unit", "free or fixed", "range", other, "meaning")]
    for name, cell, role, also, meaning in list_parameters(solution, si):
        rows.append((name, cell, cell.unit.text, role, ranges[name] if role == "free" else "", also, meaning))
    return TableBlock(rows, "Parameters of the design")


def list_quantities(solution: Solution, si: Numbers) -> Iterator[Row]:
    """Name, number, unit, the same in SI for a dimensionless one, and meaning of each quantity that exists."""
    problem = solution.problem.posed
    of = problem.parameter_set
    scaled = next((s for s in problem.model.sets if s.rate is not None and s is not of), None)
    values = None if scaled is None else Values(problem.model, scaled, si)
    for q in (*problem.model.quantities, *of.quantities):
        x = float(solution.quantities.get(q.name, math.nan))
        if not math.isfinite(x) or q.aside:
            continue
        cell = Cell(x, unit_of(problem, q.name))
        if q.share:
            cell = Cell(x if abs(x) > FEASIBLE else 0.0, PERCENT, 6)
        twin = q.counterpart
        also = "" if twin is None or values is None else _describe_twin(twin, float(twin.value(values)))
        yield q.name, cell, cell.unit.text, also, q.meaning


def list_cases(solution: Solution) -> list[Case]:
    """The cases that the problem states, and the extreme ones that were found."""
    stated = [case for case in solution.problem.posed.cases if not case.direction]
    return stated + [case for case in (solution.worst, solution.least_damped, solution.fastest) if case is not None]


def parameters_of_worst_case(solution: Solution) -> Numbers:
    """The parameters in the case that roots and abscissa belong to: of a band the worst one, else the design's own."""
    return solution.worst.applied(solution.parameters) if solution.worst else solution.parameters


def describe_motion(solution: Solution) -> str:
    """How fast a disturbance dies out or grows, and at which frequencies it swings."""
    rate, time, hertz = _time_units(solution)
    abscissa = solution.abscissa * rate
    if solution.stable is None:
        return "no motion to describe: a root is at infinity"
    found = solution.stability
    growth = f"grows as {found.growth}{'' if solution.edge_is_exact else ROUNDED}"
    lasts = growth if found.growth else "neither decay nor growth"
    if not found.on_edge:
        lasts = f"{'decay' if abscissa < 0 else 'growth'} time {time.show(1 / abs(abscissa), 4)}"
    if solution.problem.model.carrier is not None:
        edge = growth if found.growth else "neither loss nor gain"
        gain = f"{'least loss' if abscissa < 0 else 'gain'} {abs(abscissa):.4g} ({lasts})"
        real = _name_real(solution) if found.on_edge or solution.beyond_axis else ""
        return f"{edge if found.on_edge else gain}{real}"
    swings = [f for f in frequencies(solution.roots, rate) if f * 2 * math.pi > 1e-9 * rate]
    if not swings:
        return f"{lasts}; no oscillation"
    turn, angular = (1.0, "") if hertz.text == "Hz" else (2 * math.pi, "angular ")
    name = angular + ("frequency" if len(swings) == 1 else "frequencies")
    listed = " and ".join(f"{turn * f:.4g}" for f in dict.fromkeys(swings))
    ratio, least = solution.quantities["damping_ratio"], describe_speed(solution, solution.least_damped)
    at = f" at {least}" if least and least != describe_speed(solution, solution.worst) else ""
    damping = f"damping ratio {ratio if abs(ratio) > NOTHING else 0:.4g}{at}"
    return f"{lasts}; {name} {listed} {hertz.text}".rstrip() + f"; {damping}"


def describe_speed(solution: Solution, case: Case | None) -> str:
    """The speed of a case, where speeds differ from case to case; else empty."""
    name = speed_of(solution.problem.posed.parameter_set)
    if name is None or case is None or name not in {**case.at, **case.offset}:
        return ""
    return f"{name} = {unit_of(solution.problem.posed, name).show(case.applied(solution.parameters)[name])}"


def describe_loads(solution: Solution) -> str:
    """What each wheel carries."""
    found, problem = solution.quantities, solution.problem.posed
    parts = []
    for wheel, share, load in (("front", "load_front", "N_F"), ("rear", "load_rear", "N_R")):
        lifts = abs(found[share]) <= FEASIBLE
        percent = f"{0.0 if lifts else 100 * found[share]:.4g} %"
        if math.isfinite(newtons := found.get(load, math.nan)):
            percent = f"{unit_of(problem, load).show(0.0 if lifts else newtons, 4)} ({percent})"
        parts.append(f"{wheel} wheel {percent}")
    return ", ".join(parts)


def describe_pitching(solution: Solution) -> str:
    """Whether the bicycle pitches over, in any of its cases, and the ballast that prevents it."""
    listed = list_cases(solution)
    each: list[Mapping[str, Any]] = [
        solution.problem.posed.values(case.applied(solution.parameters)) for case in listed
    ]
    each = each or [solution.quantities]
    in_case = " in the worst case" if listed else ""
    for lifted, over in (("rear", "front"), ("front", "rear")):
        load = min(float(case[f"load_{lifted}"]) for case in each)
        if abs(load) <= FEASIBLE:  # a limit chi_T <= 1 that is active is met within this
            return f"on the verge of pitching over the {over} wheel{in_case}; the {lifted} wheel carries no load"
        if load < 0:
            return f"pitches over the {over} wheel{in_case}{_describe_ballast(solution, each, lifted)}"
    return "on both wheels in every case listed" if listed else "stands on both wheels"


def _describe_ballast(solution: Solution, each: Sequence[Mapping[str, Any]], lifted: str) -> str:
    """The ballast at a wheel's contact that has no part in the lateral motion: with trail, at the rear one alone."""
    problem = solution.problem.posed
    units = {f"m_ballast_{lifted}": unit_of(problem, "m_B"), f"ballast_{lifted}": Unit("m_B")}
    for name, unit in units.items():
        if name in problem.vocabulary:
            needed = unit.show(max(float(values[name]) for values in each), 4)
            return f"; ballast of {needed} at the {lifted} contact prevents this and does not change lean and steer"
    return ""


def describe_inertia(solution: Solution) -> str:
    """How much of each moment of inertia a stable design of point masses bears, also as a radius of gyration √(I/m)."""
    length, parts = unit_of(solution.problem.posed, "w"), []
    for name, inertia in (solution.inertia_margin or {}).items():
        radius = "" if inertia is None else length.show(math.sqrt(inertia / solution.parameters[INERTIAS[name]]), 3)
        parts.append(f"{name} {inertia:.4g} kg m^2 ({radius})" if radius else f"{name} without limit")
    return ", ".join(parts)


def describe_roots(solution: Solution, digits: int) -> tuple[str, str]:
    """A label, and the roots, or of a complex system its eigenfrequencies."""
    if solution.problem.model.carrier is None:
        problem = solution.problem.posed
        unit, own = unit_at(problem, "abscissa", parameters_of_worst_case(solution)), unit_of(problem, "abscissa")
        named = f"  in {unit.text}" if unit.text else ""
        named += f"; √(g/w) = {1 / unit.one:.{digits}g} {unit.text}" if unit != own else ""
        return "roots", (", ".join(format_roots(solution.roots, digits, 1 / unit.one)) or "none") + named
    each, least = solution.eigenfrequencies, NOTHING * abs(solution.problem.model.carrier)
    middle = sum(z.re for z in each) / len(each) if each else 0.0
    spread = max((math.hypot(z.re - middle, z.im) for z in each), default=0.0) or 1.0
    digits = min(digits + max(0, math.ceil(math.log10(max(abs(middle), spread) / spread))), ALL)
    return "eigenfrequencies", ", ".join(format_frequency(z.re, z.im, digits, z.multiplicity, least) for z in each)


def format_root(root: Any, digits: int, multiplicity: int = 1, least: float = 0.0) -> str:
    """The eigenfrequency of a record that has one, else its root or pair of roots."""
    if (omega := root.eigenfrequency) is not None:
        return format_frequency(omega.real, omega.imag, digits, multiplicity, least)
    return format_pair(root.re, root.im, digits, multiplicity, least)


def format_frequency(re: float, im: float, digits: int, multiplicity: int = 1, least: float = 0.0) -> str:
    """An eigenfrequency as text; a part that is only rounding, or at most the least, is 0."""
    re, im = _drop_noise(re, im, least)
    value = f"{im:.{digits}g}i" if im and not re else f"{re:.{digits}g}"
    value += f" {'-' if im < 0 else '+'} {abs(im):.{digits}g}i" if re and im else ""
    return value + format_multiplicity(multiplicity)


def format_pair(re: float, im: float, digits: int, multiplicity: int = 1, least: float = 0.0) -> str:
    """A root, or a pair of roots, as text; a part that is only rounding, or at most the least, is 0."""
    re, im = _drop_noise(re, im, least)
    return f"{re:.{digits}g}" + (f" ± {im:.{digits}g}i" if im else "") + format_multiplicity(multiplicity)


def _drop_noise(re: float, im: float, least: float) -> tuple[float, float]:
    least = max(least, NOTHING * math.hypot(re, im))
    return re if abs(re) > least else 0.0, im if abs(im) > least else 0.0


def format_roots(roots: Sequence[Root], digits: int = 8, rate: float = 1.0) -> list[str]:
    """Roots as text, times a rate, a conjugate pair as one entry."""
    return [format_pair(r.re * rate, r.im * rate, digits, r.multiplicity) for r in roots if r.im >= 0]


def format_multiplicity(multiplicity: int) -> str:
    """The multiplicity of a root, behind its value; nothing of a simple one."""
    return f" ({multiplicity}-fold)" if multiplicity > 1 else ""


def describe_stored(solution: Solution) -> Iterator[str]:
    """To all digits: the abscissa, and that of the numbers as they are stored."""
    problem, at = solution.problem.posed, parameters_of_worst_case(solution)
    size = max((r.size for r in solution.of_polynomial.roots), default=1.0)
    ideal, stored = (x if abs(x) > NOTHING * size else 0.0 for x in (solution.abscissa, solution.abscissa_realised))
    realised = unit_at(problem, "abscissa", at).number(stored, ALL)
    shown = show_at(problem, "abscissa", at, ideal, ALL)
    yield f"abscissa {shown}; with the parameters rounded to doubles {realised}"
    yield ": ".join(describe_roots(solution, ALL))


def _time_units(solution: Solution) -> tuple[float, Unit, Unit]:
    """What a rate of 1 is, and the units of times and of frequencies: s and Hz, or the model's own time."""
    of = solution.problem.posed.parameter_set
    if of.rate is not None:
        return float(of.rate(parameters_of_worst_case(solution))), Unit("s"), Unit("Hz")
    natural = any(s.rate is not None for s in solution.problem.model.sets)
    return 1.0, Unit("√(w/g)" if natural else ""), Unit("√(g/w)" if natural else "")


def _name_real(solution: Solution) -> str:
    """Which eigenfrequencies of a complex system are real."""
    model = solution.problem.model
    met = eigenfrequencies(model, roots_on_axis(model, solution.roots))
    real = [format_frequency(z.re, 0.0, 5, z.multiplicity, NOTHING * abs(model.carrier or 0.0)) for z in met]
    return f"; {' and '.join(real)} {'is' if len(real) == 1 else 'are'} real" if real else ""


def _describe_twin(twin: Parameter | Quantity, x: float, digits: int = ALL) -> str:
    """What a parameter or quantity is in the other set."""
    return f"{twin.name} = {Unit('' if twin.unit == '1' else twin.unit).show(x, digits)}"
