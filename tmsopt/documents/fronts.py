"""Fronts: points, gaps, and the limits that are active at each."""

from tmsopt import plots
from tmsopt.documents.blocks import (
    Badge,
    Cell,
    Chapter,
    Figure,
    Level,
    Parts,
    Row,
    Sentence,
    TableBlock,
    Words,
    count_things,
    say_whether,
)
from tmsopt.documents.tables import write_question
from tmsopt.evaluation import missed_note
from tmsopt.fronts.front import Front
from tmsopt.problem.unit_system import unit_at, unit_of

_LABEL, _ROWS = 40, 20  # characters of what happens at a point, and points, of a brief report


def summarise_front(front: Front) -> Words:
    """Objectives and the number of points."""
    yield ", ".join(front.objectives)
    yield count_things(len(front), "point")
    if unstable := sum(not point.stable for point in front.points):
        yield Badge(f"{unstable} not stable", "bad")


def write_front(front: Front, level: Level) -> Parts:
    """Points one a row: objectives, structure, ends and kinks, active limits, free parameters, whether stable."""
    problem, full = front.problem.posed, level != "brief"
    where = f", designs with {problem.locate}" if problem.locate else ""
    special = ((len(front.kinks), "kink"), (len(front.gaps), "gap"))
    counted = "".join(f"{count_things(n, word)}, " for n, word in special if n)
    least = f"front of least {', '.join(t.strip() for t in front.objectives)}{where}"
    effort = f"{front.solved} sub-problems; {front.seconds:.2f} s"
    yield Sentence(f"{least}: {count_things(len(front), 'point')}, {counted}{effort}", tone="answer")
    if level == "page":
        yield Chapter("picture", "Front")
        yield Figure(plots.front_figure, front, f"Front of {', '.join(front.objectives)}")
        yield from write_question(problem)
    yield Chapter("rows", "Points", "whole")
    labelled = frozenset(k for k, p in enumerate(front.points) if p.label)
    rows = list_points(front, full)
    objectives = len(front.objectives)
    needs = [9] * objectives + [7, 6] + [5] * (len(rows[0]) - objectives - 4) + [4, 3]
    yield TableBlock(rows, "Points of the front", needs, _ROWS, labelled, "--full, --csv")
    yield Chapter("notes")
    yield from (Sentence(gap.reason, "gap") for gap in front.gaps)
    yield from (Sentence(note, "note") for note in front.notes)
    for k, p in enumerate(front.points, start=1):
        for note in missed_note(p.solution.problem.posed, p.solution.missed):
            yield Sentence(note, f"point {k}")


def list_points(front: Front, full: bool) -> list[Row]:
    """Headings, and the cells of each point; all digits and whole labels where it is `full`."""
    texts = [t.strip() for t in front.objectives]
    free = [n for n in front.problem.free if n not in texts]
    units, digits = {n: unit_of(front.problem.posed, n) for n in (*texts, *free)}, 12 if full else 6
    some = dict.fromkeys(front.problem.posed.parameter_set.names, 1.0)  # a unit has one name for all designs
    heads = {n: f"{n} {unit_at(front.problem.posed, n, some).text}".rstrip() for n in units}
    head = (*(heads[t] for t in texts), "stable", "special", *(heads[n] for n in free), "structure", "active limits")
    rows: list[Row] = [head]
    for p in front.points:
        each = (unit_at(front.problem.posed, t, p.solution.parameters) for t in texts)
        numbers = [Cell(v, unit, digits) for unit, v in zip(each, p.objectives, strict=True)]
        design = [Cell(p.solution.parameters[n], units[n], digits) for n in free]
        label = p.label if full or len(p.label) <= _LABEL else f"{p.label[: _LABEL - 1]}…"
        rows.append((*numbers, say_whether(p.stable), label, *design, p.structure, ", ".join(p.limits)))
    return rows
