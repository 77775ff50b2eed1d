"""Documents of Pareto fronts: points with their active limits, and gaps."""

from tmsopt import plots
from tmsopt.documents.blocks import (
    ALL_DIGITS,
    Badge,
    Chapter,
    Figure,
    Level,
    Parts,
    Row,
    Sentence,
    TableBlock,
    count_things,
    format_bool,
)
from tmsopt.documents.tables import list_headings, list_numbers, write_question
from tmsopt.evaluation import missed_note
from tmsopt.fronts.front import Front

_MAX_LABEL = 40
"""Maximum number of characters of a label in a brief report."""
_MAX_ROWS = 20
"""Maximum number of points in a brief report."""


def write_front(front: Front, level: Level) -> Parts:
    """Write a row for each point: objectives, stability, label, free parameters, structure, active limits."""
    unstable_count, points = sum(not point.stable for point in front.points), count_things(front, "point")
    yield ", ".join(front.objectives), points, Badge(f"{unstable_count} not stable" if unstable_count else "", "bad")
    problem, full = front.problem.posed, level != "brief"
    pattern = f", designs with {problem.locate}" if problem.locate else ""
    counts = "".join(f"{count_things(n, word)}, " for n, word in ((front.kinks, "kink"), (front.gaps, "gap")) if n)
    heading = f"Pareto front of {', '.join(t.strip() for t in front.objectives)}, each minimised{pattern}"
    effort = f"{front.solved} sub-problems; {front.seconds:.2f} s"
    yield Sentence(f"{heading}: {points}, {counts}{effort}", tone="answer")
    if level == "page":
        yield Chapter("picture", "Front")
        yield Figure(plots.front_figure, front, f"Front of {', '.join(front.objectives)}")
        yield from write_question(problem)
    yield Chapter("rows", "Points", "whole")
    labelled_rows = frozenset(k for k, p in enumerate(front.points) if p.label)
    rows = list_points(front, full)
    objective_count = len(front.objectives)
    priorities = [9] * objective_count + [7, 6] + [5] * (len(rows[0]) - objective_count - 4) + [4, 3]
    yield TableBlock(rows, "Points of the front", priorities, _MAX_ROWS, labelled_rows, "--full, --csv")
    yield Chapter("notes")
    yield from (Sentence(gap.reason, "gap") for gap in front.gaps)
    yield from (Sentence(note, "note") for note in front.notes)
    for k, p in enumerate(front.points, start=1):
        for note in missed_note(p.solution.problem.posed, p.solution.missed):
            yield Sentence(note, f"point {k}")


def list_points(front: Front, full: bool) -> list[Row]:
    """List headings and the cells of each point; if `full`, with all digits and whole labels."""
    problem, digits = front.problem.posed, ALL_DIGITS if full else 6
    texts = [t.strip() for t in front.objectives]
    free = [n for n in problem.free if n not in texts]
    objective_heads, free_heads = (list_headings(problem, names) for names in (texts, free))
    rows: list[Row] = [(*objective_heads, "stable", "event", *free_heads, "structure", "active limits")]
    for p in front.points:
        design = p.solution.parameters
        label = p.label if full or len(p.label) <= _MAX_LABEL else f"{p.label[: _MAX_LABEL - 1]}…"
        objectives = list_numbers(problem, texts, dict(zip(texts, p.objectives, strict=True)), design, digits)
        numbers = list_numbers(problem, free, design, design, digits)
        rows.append((*objectives, format_bool(p.stable), label, *numbers, p.structure, ", ".join(p.limits)))
    return rows
