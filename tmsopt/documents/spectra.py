"""Documents of loops around exceptional points, and of Riemann sheets."""

import math

import numpy as np

from tmsopt import plots
from tmsopt.documents.blocks import Chapter, Figure, Level, Parts, Row, Sentence, TableBlock, count_things
from tmsopt.documents.design_rows import format_frequency
from tmsopt.documents.tables import write_question
from tmsopt.problem import Problem, unit_of
from tmsopt.records import Numbers
from tmsopt.spectra import Loop, Sheets

_DIGITS = 6
_MAX_ROWS = 12
"""Maximum number of rows of a table in a brief report."""
_ROUNDING = 1e-9
"""A number below this share of its scale (a range, the largest eigenvalue, π) is a rounding error and is shown as 0."""


def write_loop(loop: Loop, level: Level) -> Parts:
    """Write how eigenvalues exchange, with their phases, the circle, and the exceptional points inside."""
    nouns, size = _name_eigenvalues(loop.problem), _ROUNDING * float(np.abs(loop.eigenvalues).max())
    cycles = {c: " -> ".join(map(str, (*c.members, c.members[0]))) for c in loop.cycles}
    exchanges = ", ".join(text for c, text in cycles.items() if c.turns > 1)
    yield exchanges or "no exchange", f"{count_things(loop.inside, 'exceptional point')} inside"
    yield Sentence(exchanges or f"no {nouns} exchange", "after one turn", "answer")
    radii = (unit_of(loop.problem.posed, n).show(loop.radius, _DIGITS) for n in loop.plane)
    waves = zip(_list_values(loop.problem, loop.parameters), radii, ("cos", "sin"), strict=True)
    circle = ", ".join(f"{value} + {radius} {wave} t" for value, radius, wave in waves)
    yield Sentence(f"{circle}, counterclockwise", "circle")
    if level == "page":
        yield Chapter("picture", "Loop", "whole")
        yield Figure(plots.loop_figure, loop, f"{nouns.capitalize()} along the loop, and the loop")
    yield Chapter("cycles")
    rows: list[Row] = [("cycle", "turns", "phase / pi", f"{nouns} at the start")]
    for c, text in cycles.items():
        phase, start = complex(c.phase, c.phase_imaginary) / math.pi, loop.eigenvalues[0, list(c.members)].tolist()
        values = ", ".join(format_frequency(z.real, z.imag, _DIGITS, threshold=size) for z in start)
        rows.append(
            (text, str(c.turns), format_frequency(phase.real, phase.imag, _DIGITS, threshold=_ROUNDING), values)
        )
    yield TableBlock(rows, "Cycles, with their geometric phases after their turns", max_rows=_MAX_ROWS)
    yield Chapter("inside")
    total = sum(point.winding or 0 for point in loop.inside)
    doubt = f", but the points found inside add up to {total}; try more starts"
    winding = f"{loop.winding}{'' if loop.is_complete else doubt}"
    yield Sentence(winding, "winding number of the discriminant", "" if loop.is_complete else "doubt")
    for p in loop.inside:
        value = format_frequency(p.eigenvalue.real, p.eigenvalue.imag, _DIGITS, threshold=size)
        place = ", ".join(_list_values(loop.problem, p.parameters))
        part = "on a curve of such points" if p.winding is None else f"winding number {p.winding}"
        yield Sentence(f"{p.name} at {place}, {nouns} {value}, {part}", "inside")
    if level == "page":
        yield from write_question(loop.problem.posed)


def write_sheets(sheets: Sheets, level: Level) -> Parts:
    """Write the grid, and the multiple eigenvalues."""
    nouns, problem, (columns, rows) = _name_eigenvalues(sheets.problem), sheets.problem, map(len, sheets.grid)
    count, size = sheets.values.shape[2], _ROUNDING * float(np.nanmax(np.abs(sheets.values), initial=0.0))
    grid = f"{columns}×{rows} points over {' and '.join(sheets.axes)}"
    yield count_things(count, "sheet"), grid
    yield Sentence(f"{count_things(count, 'sheet')} of {nouns}, {grid}", tone="answer")
    yield Sentence("by real parts, so sheets meet along cuts that end at exceptional points", "numbering")
    for z in sheets.multiple:
        place = ", ".join(_list_values(problem, sheets.parameters))
        yield Sentence(f"{format_frequency(z.real, z.imag, _DIGITS, threshold=size)} at {place}", "multiple")
    if (drawn := len(sheets.picture_indices)) < count:
        chosen = "the nearest to the multiple one" if sheets.multiple else "the first"
        yield f"pictures show {drawn} sheets, {chosen}"
    if level == "page":
        yield Chapter("picture", "Sheets", "whole")
        yield Figure(plots.sheets_figure, sheets, f"Sheets of {nouns}")
        yield from write_question(problem.posed)


def _name_eigenvalues(problem: Problem) -> str:
    return "eigenfrequencies" if problem.model.is_complex else "roots"


def _list_values(problem: Problem, parameters: Numbers) -> list[str]:
    """Name and value of each free parameter, in its unit. A value far smaller than its range is 0."""
    units = {n: unit_of(problem.posed, n) for n in problem.free}
    errors = {n: _ROUNDING * (high - low) for n, (low, high) in problem.free.items()}
    return [f"{n} = {u.number(parameters[n], _DIGITS, errors[n])} {u.text}".rstrip() for n, u in units.items()]
