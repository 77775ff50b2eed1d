"""The rows of a report for any model: parameters and quantities, in the units in which the problem was written.

Of a model that is dimensionless and in SI, the number in the other set stands beside each.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from tmsopt.dynamics.speeds import speed_of
from tmsopt.evaluation.recheck import FEASIBLE
from tmsopt.models import INERTIAS, Model, Parameter, ParameterSet, Quantity, Values
from tmsopt.models.user_spectrum import eigenfrequencies, on_axis, structure_in_words
from tmsopt.problem.cases import Case
from tmsopt.problem.problem import Posed
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import Unit, unit_at, unit_of
from tmsopt.problem.units import frequencies
from tmsopt.problem.verdict.stability import ROUNDED, MultipleRoot, crossing_in_words
from tmsopt.roots import Root

TableRow = Sequence[str]

NOTHING = 1e-14
"""Of the size of a root, or of 1: less is rounding."""

_OF_RANGE = 1e-12  # likewise of a range
ALL = 12
"""Digits of a full report."""


def parameter_rows(solution: Solution, si: Mapping[str, float]) -> list[TableRow]:
    """Names, numbers, units, which are free, the number in the other set, and the meaning.

    Those that are 0 as by default are left out.

    Args:
        si: the parameters in SI; of a model without a dimensionless form those of the solution.

    Example:
        >>> design = tmsopt.solve("problems/benchmark.toml")
        >>> tmsopt.report.parameter_rows(design, tmsopt.report.si_parameters(design))[0]
        ('w', '1', 'm', 'fixed', '', '', '', 'wheelbase')

    More: docs/reference/quantities.md
    """
    problem = solution.problem.posed
    of, other = problem.parameter_set, _other(problem.model, problem.parameter_set)
    values = {} if other is None else solution.dimensionless if other.rate is None else si
    rows: list[TableRow] = []
    for p in of.parameters:
        x, how = tidy(solution, p.name), role(solution, p.name)
        if how == "fixed" and x == 0 == p.default:
            continue
        beside = None if other is None else _counterpart(p, other)
        unit = unit_of(problem, p.name)
        cells = () if beside is None else _cells(beside, values[beside.name], Unit(_own(beside.unit)))
        rows.append(
            (
                p.name,
                unit.number(x, ALL),
                unit.text,
                how,
                *(cells or ("", "", "")),
                "" if p.meaning == "parameter" else p.meaning,
            )
        )
    return rows


def quantity_rows(solution: Solution, si: Mapping[str, float]) -> list[TableRow]:
    """Those that exist: names, numbers, units, what they are in SI beside a dimensionless one, and the meaning.

    Example:
        >>> design = tmsopt.solve("problems/benchmark.toml")
        >>> rows = tmsopt.report.quantity_rows(design, tmsopt.report.si_parameters(design))
        >>> [row[:3] for row in rows if row[0] == "v_c"]
        [('v_c', '2.841008323...', 'm/s')]

    More: docs/reference/quantities.md
    """
    problem, found = solution.problem.posed, solution.quantities
    of = problem.parameter_set
    rows: list[TableRow] = []
    scaled = next((s for s in problem.model.sets if s.rate is not None), None)
    values = Values(problem.model, scaled, si) if scaled is not None and scaled is not of else None
    for q in (*problem.model.quantities, *of.quantities):
        x = float(found.get(q.name, math.nan))
        if not math.isfinite(x) or q.aside:
            continue
        beside = q.counterpart
        cells = (
            ("", "", "")
            if beside is None or values is None
            else _cells(beside, float(beside.value(values)), Unit(_own(beside.unit)))
        )
        rows.append((*_cells(q, x, unit_of(problem, q.name)), "", *cells, q.meaning))
    return rows


def tidy(solution: Solution, name: str) -> float:
    """A parameter; 0 where it differs from that by less than a rounding of its range."""
    x, (lower, upper) = solution.parameters[name], solution.problem.free.get(name, (0.0, 0.0))
    return 0.0 if abs(x) <= _OF_RANGE * (upper - lower) else x


def role(solution: Solution, name: str) -> str:
    """``free``, ``scenario`` or ``fixed``."""
    problem = solution.problem.posed
    return "free" if name in problem.free else "scenario" if name in problem.scenarios else "fixed"


def at_worst(solution: Solution) -> Mapping[str, float]:
    """The parameters in the case that roots and abscissa belong to: of a band the worst one, else the design's own."""
    return solution.worst.applied(solution.parameters) if solution.worst else solution.parameters


def clock(solution: Solution) -> tuple[float, Unit, Unit]:
    """What a rate of 1 is, and the units of times and of frequencies: s and Hz, or the model's own time."""
    of = solution.problem.posed.parameter_set
    if of.rate is not None:
        return float(of.rate(at_worst(solution))), Unit("s"), Unit("Hz")
    natural = any(s.rate is not None for s in solution.problem.model.sets)
    return 1.0, Unit("√(w/g)" if natural else ""), Unit("√(g/w)" if natural else "")


def structure_line(problem: Posed, structure: str, abscissa: float, known: Sequence[MultipleRoot]) -> str:
    """The structure of the roots in words, and what it is where eigenvectors do not meet, or nobody can tell.

    Args:
        known: what meets in each multiple root.

    Example:
        >>> design = tmsopt.solve("problems/ep4.toml")
        >>> tmsopt.report.structure_line(design.problem.posed, design.structure, design.abscissa, design.meetings)
        'four roots meet in one (EP4)'

    More: docs/how_to/report.md
    """
    words = structure_in_words(problem.model, structure, abscissa > 0)
    about = known if problem.pattern is not None else [m for m in known if m.re == known[0].re]
    if crossing := next((m for m in about if not m.exceptional), None):
        return f"{words}: {crossing_in_words(crossing)}"
    blind = problem.model.pencil is None and "EP" in f"{problem.locate or ''}{structure}"
    return f"{words}; coefficients cannot tell whether it is defective" if blind and known else words


def motion(solution: Solution) -> str:
    """How fast a disturbance dies out or grows, and at which frequencies it swings."""
    rate, time, hertz = clock(solution)
    abscissa = solution.abscissa * rate
    if solution.stable is None:
        return "no motion to describe: a root is at infinity"
    kind = "decay time" if abscissa < 0 else "growth time"
    found = solution.stability
    on_edge, growth = found.on_edge, f"grows as {found.growth}{'' if solution.edge_is_exact else ROUNDED}"
    lasts = growth if found.growth else "neither decay nor growth"
    lasts = lasts if on_edge else f"{kind} {time.show(1 / abs(abscissa), 4)}"
    if solution.problem.model.carrier is not None:
        words = (
            (growth if found.growth else "neither loss nor gain")
            if on_edge
            else f"{'least loss' if abscissa < 0 else 'gain'} {abs(abscissa):.4g} ({lasts})"
        )
        return f"{words}{_real(solution) if on_edge or solution.beyond_axis else ''}"
    swings = [f for f in frequencies(solution.roots, rate) if f * 2 * math.pi > 1e-9 * rate]
    if not swings:
        return f"{lasts}; nothing swings"
    shown = [f if hertz.text == "Hz" else 2 * math.pi * f for f in swings]
    name = ("" if hertz.text == "Hz" else "angular ") + ("frequency" if len(shown) == 1 else "frequencies")
    listed = " and ".join(f"{f:.4g}" for f in dict.fromkeys(shown))
    ratio, least = solution.quantities["damping_ratio"], speed_in(solution, solution.least_damped)
    return (
        f"{lasts}; {name} {listed} {hertz.text}".rstrip()
        + f"; damping ratio {ratio if abs(ratio) > NOTHING else 0:.4g}"
        + (f" at {least}" if least and least != speed_in(solution, solution.worst) else "")
    )


def speed_in(solution: Solution, case: Case | None) -> str:
    """The speed of a case, where speeds differ from case to case; else empty."""
    name = speed_of(solution.problem.posed.parameter_set)
    if name is None or case is None or name not in {**case.at, **case.offset}:
        return ""
    return f"{name} = {unit_of(solution.problem.posed, name).show(case.applied(solution.parameters)[name])}"


def _real(solution: Solution) -> str:
    """Which eigenfrequencies of a complex system are real."""
    model = solution.problem.model
    met = eigenfrequencies(model, on_axis(model, solution.roots))
    real = [frequency_of(z.re, 0.0, 5, z.multiplicity, abs(model.carrier or 0.0)) for z in met]
    return f"; {' and '.join(real)} {'is' if len(real) == 1 else 'are'} real" if real else ""


def loads(solution: Solution) -> str:
    """What each wheel carries."""
    found, problem = solution.quantities, solution.problem.posed
    named = [("front", "load_front", "N_F"), ("rear", "load_rear", "N_R")]
    at_rest = {
        n: x if abs(found[share]) > FEASIBLE else 0.0
        for _, share, of in named
        for n in (share, of)
        if (x := found.get(n, math.nan)) == x
    }
    shares = {wheel: f"{100 * at_rest[share]:.4g} %" for wheel, share, _ in named}
    newtons = {w: unit_of(problem, n).show(at_rest[n], 4) for w, _, n in named if n in at_rest}
    return ", ".join(f"{w} wheel {newtons[w]} ({s})" if w in newtons else f"{w} wheel {s}" for w, s in shares.items())


def inertia_lines(solution: Solution) -> list[str]:
    """How much of each moment of inertia a stable design of point masses bears, also as a radius of gyration √(I/m)."""
    length, words = unit_of(solution.problem.posed, "w"), []
    for name, inertia in (solution.inertia_margin or {}).items():
        radius = "" if inertia is None else length.show(math.sqrt(inertia / solution.parameters[INERTIAS[name]]), 3)
        words.append(f"{name} {inertia:.4g} kg m^2 ({radius})" if radius else f"{name} none")
    head = "inertia at which it is no longer stable, each alone (radius of gyration)"
    return [f"{head}: {', '.join(words)}"] if words else []


def roots_line(solution: Solution, digits: int) -> str:
    """The roots, or of a complex system its eigenfrequencies."""
    if solution.problem.model.carrier is None:
        problem = solution.problem.posed
        unit, own = unit_at(problem, "abscissa", at_worst(solution)), unit_of(problem, "abscissa")
        named = f"  in {unit.text}" if unit.text else ""
        named += f"; √(g/w) = {1 / unit.one:.{digits}g} {unit.text}" if unit != own else ""
        return "roots: " + (", ".join(roots_of(solution.roots, digits, 1 / unit.one)) or "none") + named
    each, size = solution.eigenfrequencies, abs(solution.problem.model.carrier)
    middle = sum(z.re for z in each) / len(each) if each else 0.0
    spread = max((math.hypot(z.re - middle, z.im) for z in each), default=0.0) or 1.0
    digits = min(digits + max(0, math.ceil(math.log10(max(abs(middle), spread) / spread))), ALL)
    return "eigenfrequencies: " + ", ".join(frequency_of(z.re, z.im, digits, z.multiplicity, size) for z in each)


def frequency_of(re: float, im: float, digits: int, multiplicity: int = 1, size: float = 0.0) -> str:
    """An eigenfrequency as text; a part that is none but for rounding, beside a size, is 0."""
    size = max(size, math.hypot(re, im))
    re, im = (x if abs(x) > NOTHING * size else 0.0 for x in (re, im))
    parts = ([f"{re:.{digits}g}"] if re or not im else []) + ([f"{abs(im):.{digits}g}i"] if im else [])
    sign = "-" if im < 0 else "+"
    value = f" {sign} ".join(parts) if len(parts) > 1 else f"{'-' if im < 0 else ''}{parts[0]}"
    return value + (f" ({multiplicity}-fold)" if multiplicity > 1 else "")


def roots_of(roots: Sequence[Root], digits: int = 8, rate: float = 1.0) -> list[str]:
    """Roots as text, times a rate, a conjugate pair as one entry."""
    words = []
    for root in roots:
        if root.im < 0:
            continue
        size = root.size
        re, im = (x * rate if abs(x) > NOTHING * size else 0.0 for x in (root.re, root.im))
        value = f"{re:.{digits}g}" + (f" ± {im:.{digits}g}i" if im else "")
        words.append(value + (f" ({root.multiplicity}-fold)" if root.multiplicity > 1 else ""))
    return words


def _other(model: Model, of: ParameterSet) -> ParameterSet | None:
    """The other set of a model that is dimensionless and in SI."""
    return next((s for s in model.sets if s is not of), None)


def _counterpart(p: Parameter, other: ParameterSet) -> Parameter | None:
    """The parameter of the other set that says the same."""
    if p.name in other.names:
        return None
    return next((q for q in other.parameters if p.counterpart == q.name or q.counterpart == p.name), None)


def _cells(of: Parameter | Quantity, x: float, unit: Unit) -> tuple[str, str, str]:
    if isinstance(of, Quantity) and of.share:
        return of.name, f"{100 * x if abs(x) > FEASIBLE else 0.0:.6g}", "%"
    return of.name, unit.number(x, ALL), unit.text


def _own(unit: str) -> str:
    return "" if unit == "1" else unit


def pitching(solution: Solution, si: Mapping[str, float]) -> str:
    """Whether the bicycle pitches over, in any of its cases, and the ballast that prevents it."""
    problem, parameters = solution.problem.posed, solution.parameters
    listed = [case for case in problem.cases if not case.direction]
    listed += [case for case in (solution.worst, solution.least_damped) if case]
    each: list[Mapping[str, Any]] = [problem.values(case.applied(parameters)) for case in listed]
    each = each or [solution.quantities]
    in_case = " in the worst case" if listed else ""
    for lifted, over in (("rear", "front"), ("front", "rear")):
        load = min(float(values[f"load_{lifted}"]) for values in each)
        if abs(load) <= FEASIBLE:  # a limit chi_T <= 1 that binds is met within this
            return f"on the verge of pitching over the {over} wheel{in_case}; the {lifted} wheel carries no load"
        if load < 0:
            return f"pitches over the {over} wheel{in_case}{_prevented(solution, si, each, lifted)}"
    return "on both wheels in every case listed" if listed else "stands on both wheels"


def _prevented(solution: Solution, si: Mapping[str, float], each: Sequence[Mapping[str, Any]], lifted: str) -> str:
    """The ballast at a wheel's contact that has no part in the lateral motion: with trail, at the rear one alone."""
    problem = solution.problem.posed
    if f"m_ballast_{lifted}" in problem.vocabulary:
        mass = max(float(values[f"m_ballast_{lifted}"]) for values in each)
        needed = unit_of(problem, "m_B").show(mass, 4)
    elif f"ballast_{lifted}" in problem.vocabulary:
        needed = f"{max(float(values[f'ballast_{lifted}']) for values in each):.4g} m_B"
    else:
        return ""
    return f", unless ballast of {needed} is at the {lifted} contact, without effect on the motion"
