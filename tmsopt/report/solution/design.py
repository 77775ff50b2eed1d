"""The report of a solution: the answer on one screen, and all the rest on request, in one order."""

import math
from collections.abc import Iterator, Mapping

from tmsopt.analysis import Lever
from tmsopt.evaluation import abscissa_as_stored
from tmsopt.models import GRAVITY, tms, to_si
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import limit_text, show_at, unit_at, unit_of
from tmsopt.problem.verdict.stability import ROUNDED
from tmsopt.problem.verdict.status import status_in_words, verdict_in_words
from tmsopt.report.solution.explanation import diagnosis_lines, optimality_lines, rounding_line, rounding_rows
from tmsopt.report.solution.findings import Findings
from tmsopt.report.solution.infeasible import infeasible_lines
from tmsopt.report.solution.limits import bound_lines, case_lines, proof_line
from tmsopt.report.solution.robustness import robustness_line, robustness_table
from tmsopt.report.solution.rows import (
    ALL,
    NOTHING,
    at_worst,
    inertia_lines,
    loads,
    motion,
    parameter_rows,
    pitching,
    quantity_rows,
    role,
    roots_line,
    speed_in,
    structure_line,
    tidy,
)
from tmsopt.report.solution.screen import KEPT, Block, fitted, named, wrapped
from tmsopt.report.speeds import range_line
from tmsopt.report.text import HEIGHT, columns, model_lines

_DIGITS = 5
_ROWS = 8  # of free parameters one below the other
_APART = ("design", "motion", "limits", "robustness")
"""Parts with an empty line before them, where there is room."""

_ASKED = {"a0": "must not be 0", "coefficients": "must have values"}


def design_report(
    solution: Solution, found: Findings | None = None, full: bool = False, si: Mapping[str, float] | None = None
) -> str:
    """A design: how it ended, parameters, motion, loads, limits, warnings, robustness, rounding, proof.

    Args:
        found: what there is to say beside; nothing of it by default.
        full: all the rest as well, each part under its name.
        si: parameters in SI for a dimensionless problem, such as `si_parameters` gives; then shown beside.

    Example:
        >>> print(tmsopt.report.design_report(tmsopt.solve("problems/ep4.toml")))
        EP4 of the chi_H = 1 bicycle
        optimal, proved: stable
        minimize abscissa = -1.8803015; as stored ...; four roots meet in one (EP4)
        ...

    More: docs/how_to/report.md
    """
    found = found or Findings()
    scaled = si or si_parameters(solution)
    parts = [p for p in design_parts(solution, found, scaled, beside=si is not None) if p.lines or (full and p.rest)]
    title = wrapped([solution.problem.title or "untitled problem"])[0]
    if full:
        return "\n".join([title, *(line for part in parts for line in named(part))])
    blocks = {part.name: wrapped(part.lines) for part in fitted(parts)}
    room = HEIGHT - 2 - sum(map(len, blocks.values()))
    apart = [name for name in _APART if name in blocks][: max(room, 0)]
    lines = [line for name, block in blocks.items() for line in ([""] if name in apart else []) + block]
    return "\n".join(line.rstrip() for line in [title, *lines, _more(solution, found)])


def si_parameters(solution: Solution, w: float = 1.0, m_B: float = 1.0, g: float = GRAVITY) -> Mapping[str, float]:
    """SI parameters: as solved for, or of dimensionless skates for the given wheelbase, rear mass and gravity.

    Example:
        >>> design = tmsopt.solve("problems/ep4.toml")
        >>> round(tmsopt.report.si_parameters(design, w=1.2)["x_B"], 6)  # 1.2 times the square root of 2, in m
        1.697056

    More: docs/how_to/units.md
    """
    own = solution.problem.posed.parameter_set.rate is not None or len(solution.problem.model.sets) == 1
    return solution.parameters if own else to_si(solution.dimensionless, w, m_B, g)


def design_parts(solution: Solution, found: Findings, si: Mapping[str, float], beside: bool = False) -> Iterator[Block]:
    """The parts of a report, in its order.

    Args:
        si: as `si_parameters` gives; shown beside the design's own where asked for.

    Example:
        >>> design = tmsopt.solve("problems/ep4.toml")
        >>> parts = tmsopt.report.design_parts(design, tmsopt.report.Findings(), tmsopt.report.si_parameters(design))
        >>> [part.lines for part in parts if part.name == "proof"]
        [['proof: no design in the box decays faster (omega0)']]

    More: docs/how_to/report.md
    """
    told, asked = headline(solution)
    helps, notes = infeasible_lines(solution), [f"note: {note}" for note in solution.notes]
    if solution.status == "infeasible":
        first = [f"{told}: {helps[0]}"] if helps and ": " not in told else [told, *helps[:1]]
        conflict = [*first, *helps[1:], *_violated(solution)]
        rest = tuple(infeasible_lines(solution, full=True)[len(helps) :])
        yield Block("conflict", [*conflict, f"nearest design: {asked}", *notes], rest, least=3)
    else:
        yield Block("answer", [told, asked, *helps, *notes], least=2)
    yield Block(
        "design",
        _design(solution, si if beside else None),
        tuple(columns(parameter_rows(solution, si))),
        replaces=True,
        least=3,
    )
    yield Block(
        "motion", _motion(solution, found), (*_stored(solution), *columns(quantity_rows(solution, si) or [("",)]))
    )
    if "load_rear" in solution.quantities:
        yield Block("loads", [f"{loads(solution)}; {pitching(solution, si)}"])
    yield Block("model", [*model_lines(solution.problem.model), *inertia_lines(solution)])
    yield Block("cases", case_lines(solution))
    explained = found.explanation
    if explained is not None and explained.levers:
        head = "limits that bind, and what a small move of each buys (to first order; --full solves again):"
        yield Block(
            "limits",
            [head, *columns([lever_cells(solution, lever) for lever in explained.levers])],
            tuple(lever.sentence for lever in explained.levers),
            least=3,
        )
    if explained is not None:
        yield Block("warnings", [f"warning: {text}" for text in explained.warnings])
    if found.robustness is not None:
        yield Block(
            "robustness",
            [f"robustness: {robustness_line(found.robustness, solution.stability.on_edge)}"],
            tuple(robustness_table(found.robustness).splitlines()[2:]),
        )
    if explained is not None and explained.precision:
        yield Block("rounding", [f"rounding: {rounding_line(explained)}"], tuple(columns(rounding_rows(explained))))
    local = () if explained is None else optimality_lines(explained.optimality)
    yield Block("proof", [proof_line(solution)], (*bound_lines(solution), *local))
    rounded = ["roots meet as far as rounding tells; tmsopt prove tells it of the numbers as typed"]
    diagnosed = diagnosis_lines(found.diagnoses, details=True)
    yield Block("roots", [], (*(rounded if solution.multiple_as_rounded else []), *diagnosed))
    yield Block("search", [], tuple(_search(solution)))


def headline(solution: Solution) -> tuple[str, str]:
    """How it ended, and what was asked, in words."""
    problem = solution.problem.posed
    text = problem.minimize or problem.maximize
    value = show_at(problem, text, at_worst(solution), solution.value, 8) if text else ""
    located = f"locate {problem.locate}" if problem.locate else ""
    sense = f"{problem.sense} " if problem.free else ""  # what is given is not sought
    asked = f"{sense}{text.strip()}" + (f" = {value}" if math.isfinite(solution.value) else "") if text else ""
    told = ": ".join(part for part in (status_in_words(solution), verdict_in_words(solution)) if part)
    structure = structure_line(problem, solution.structure, solution.abscissa, solution.meetings)
    structure += ROUNDED if solution.multiple_as_rounded else ""
    return told, "; ".join(part for part in (located, asked, abscissa_as_stored(solution), structure) if part)


def _violated(solution: Solution) -> list[str]:
    problem, lines = solution.problem.posed, []
    for name, value in solution.violations.items():
        asked = limit_text(problem, name) or ("pattern" if name in problem.located else _ASKED.get(name, ""))
        by = f" by {unit_of(problem, name).show(value, 4)}" if math.isfinite(value) else ", which has no value"
        lines.append(f"violated: {name} ({asked}){by if name not in _ASKED else ''}")
    return lines


def _design(solution: Solution, si: Mapping[str, float] | None) -> list[str]:
    """Free parameters one a row, or side by side where they are many; the others in a sentence."""
    problem, of = solution.problem.posed, solution.problem.posed.parameter_set
    shown = {p.name: unit_of(problem, p.name).show(tidy(solution, p.name), _DIGITS) for p in of.parameters}
    free = [p for p in of.parameters if p.name in problem.free]
    full = parameter_rows(solution, si) if si is not None else []
    other = {row[0]: f"{row[4]} = {float(row[5]):.{_DIGITS}g} {row[6]}".rstrip() for row in full if row[4]}
    cells = [(p.name, shown[p.name], other.get(p.name, "")) for p in free]
    height = max(_ROWS, math.ceil(len(cells) / 3))
    blocks = [columns(cells[k : k + height]) for k in range(0, len(cells), height)]
    rows = (
        ["".join(block[k] if k < len(block) else "" for block in blocks).rstrip() for k in range(len(blocks[0]))]
        if blocks
        else []
    )
    rest = [
        f"{p.name} = {shown[p.name]}".replace(" ", KEPT)
        for p in of.parameters
        if role(solution, p.name) == "fixed" and not solution.parameters[p.name] == 0 == p.default
    ]
    most = 14
    more = f", and {len(rest) - most} more" if len(rest) > most else ""
    return rows + ([f"fixed: {', '.join(rest[:most])}{more}"] if rest else [])


def _motion(solution: Solution, found: Findings) -> list[str]:
    at = speed_in(solution, solution.worst)
    lines = [f"{f'at {at}: ' if at else ''}{motion(solution)}"]
    if found.stable is not None:
        lines.append(range_line(found.stable, solution))
    return [*lines, roots_line(solution, _DIGITS)]


def _more(solution: Solution, found: Findings) -> str:
    """How to see more, and the commands that have something to say of the same file."""
    problem, solved = solution.problem.posed, solution.status == "optimal"
    commands = {
        "prove": solved,
        "compare": problem.model is tms,
        "speeds": found.stable is not None,
        "chart": len(problem.free) in (2, 3),
        "trace": bool(problem.locate) and solution.freedom.count == 1,
    }
    named = ", ".join(name for name, answers in commands.items() if answers)
    return f"more: --full; then tmsopt {named} with the same file" if named else "more: --full"


def _stored(solution: Solution) -> Iterator[str]:
    """To all digits: the abscissa, and that of the numbers as they are stored."""
    problem, at = solution.problem.posed, at_worst(solution)
    size = max((r.size for r in solution.of_polynomial.roots), default=1.0)
    abscissa, stored = (x if abs(x) > NOTHING * size else 0.0 for x in (solution.abscissa, solution.abscissa_realised))
    realised = unit_at(problem, "abscissa", at).number(stored, ALL)
    shown = show_at(problem, "abscissa", at, abscissa, ALL)
    yield f"abscissa {shown}; of the parameters as rounded to doubles {realised}"
    yield roots_line(solution, ALL)


def lever_cells(solution: Solution, lever: Lever) -> tuple[str, ...]:
    """A limit that binds: its name, what it says, a small move of it, and what that buys to first order.

    Example:
        >>> design = tmsopt.solve("problems/least_speed.toml")
        >>> lever = tmsopt.explain(design, resolve=False).levers[0]
        >>> tmsopt.report.lever_cells(design, lever)
        ('decay:', 'abscissa <= -0.8', 'by 0.01', 'buys 0.0124')

    More: docs/how_to/report.md
    """
    limit = limit_text(solution.problem.posed, lever.name)
    if not lever.step:
        return f"{lever.name}:", limit, "a physical end", ""
    step = unit_of(solution.problem.posed, lever.name).show(abs(lever.step), 4)
    return f"{lever.name}:", limit, f"by {step}", f"buys {lever.gained.show(lever.predicted, 3)}"


def _search(solution: Solution) -> Iterator[str]:
    free, starts, problem = solution.freedom, solution.starts, solution.problem
    if problem.locate:
        parameters = "parameter" if free.free == 1 else "parameters"
        conditions = "condition" if free.conditions == 1 else "conditions"
        yield f"freedom: {free.kind}, {free.free} free {parameters} and {free.conditions} {conditions}"
    yield from branch_lines(solution)
    if starts.tried:
        looked = f"; {starts.looked} designs looked at" if starts.looked else ""
        led = starts.tried - starts.runs
        also = f", {led} of which lead{'s' * (led == 1)} straight to where others ended" if starts.runs and led else ""
        tried = f"starts: {starts.tried} tried{also}, {starts.converged} converged, {starts.at_best} at the best"
        yield f"{tried}{looked}; {solution.seconds:.2f} s"


def branch_lines(solution: Solution) -> list[str]:
    """Other designs that solve the same equations, and what excludes them."""
    problem, lines = solution.problem.posed, []
    for branch in solution.branches:
        where = ", ".join(f"{n} = {unit_of(problem, n).show(branch.parameters[n], ALL)}" for n in problem.free)
        lines.append(f"also solved by {where}; excluded by {', '.join(branch.excluded_by) or 'nothing'}")
    return lines
