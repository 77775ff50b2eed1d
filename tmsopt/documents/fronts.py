"""Fronts: points, gaps, and the limits that are active at each."""

from tmsopt import plots
from tmsopt.documents.blocks import (
    ALL,
    Badge,
    Chapter,
    Figure,
    Level,
    Parts,
    Row,
    Sentence,
    TableBlock,
    count_things,
    say_whether,
)
from tmsopt.documents.tables import head_numbers, list_numbers, write_question
from tmsopt.evaluation import missed_note
from tmsopt.fronts.front import Front

_LABEL, _ROWS = 40, 20  # characters of what happens at a point, and points, of a brief report


def write_front(front: Front, level: Level) -> Parts:
    """Points one a row: objectives, structure, ends and kinks, active limits, free parameters, whether stable."""
    unstable, points = sum(not point.stable for point in front.points), count_things(front, "point")
    yield ", ".join(front.objectives), points, Badge(f"{unstable} not stable" if unstable else "", "bad")
    problem, full = front.problem.posed, level != "brief"
    where = f", designs with {problem.locate}" if problem.locate else ""
    special = ((len(front.kinks), "kink"), (len(front.gaps), "gap"))
    counted = "".join(f"{count_things(n, word)}, " for n, word in special if n)
    least = f"front of least {', '.join(t.strip() for t in front.objectives)}{where}"
    effort = f"{front.solved} sub-problems; {front.seconds:.2f} s"
    yield Sentence(f"{least}: {count_things(front, 'point')}, {counted}{effort}", tone="answer")
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
    problem, digits = front.problem.posed, ALL if full else 6
    texts = [t.strip() for t in front.objectives]
    free = [n for n in problem.free if n not in texts]
    first, last = (head_numbers(problem, names) for names in (texts, free))
    rows: list[Row] = [(*first, "stable", "special", *last, "structure", "active limits")]
    for p in front.points:
        design = p.solution.parameters
        label = p.label if full or len(p.label) <= _LABEL else f"{p.label[: _LABEL - 1]}…"
        objectives = list_numbers(problem, texts, dict(zip(texts, p.objectives, strict=True)), design, digits)
        numbers = list_numbers(problem, free, design, design, digits)
        rows.append((*objectives, say_whether(p.stable), label, *numbers, p.structure, ", ".join(p.limits)))
    return rows
