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
    say_whether,
)
from tmsopt.documents.tables import head_numbers, list_numbers, write_question
from tmsopt.evaluation import missed_note
from tmsopt.fronts.front import Front

_MAX_LABEL, _MAX_ROWS = 40, 20  # a brief report shows at most so many characters of a label, and points


def write_front(front: Front, level: Level) -> Parts:
    """Write a row for each point: objectives, stability, label, free parameters, structure, active limits."""
    unstable, points = sum(not point.stable for point in front.points), count_things(front, "point")
    yield ", ".join(front.objectives), points, Badge(f"{unstable} not stable" if unstable else "", "bad")
    problem, full = front.problem.posed, level != "brief"
    where = f", designs with {problem.locate}" if problem.locate else ""
    special = ((len(front.kinks), "kink"), (len(front.gaps), "gap"))
    counts = "".join(f"{count_things(n, word)}, " for n, word in special if n)
    heading = f"Pareto front of {', '.join(t.strip() for t in front.objectives)}, each minimised{where}"
    effort = f"{front.solved} sub-problems; {front.seconds:.2f} s"
    yield Sentence(f"{heading}: {count_things(front, 'point')}, {counts}{effort}", tone="answer")
    if level == "page":
        yield Chapter("picture", "Front")
        yield Figure(plots.front_figure, front, f"Front of {', '.join(front.objectives)}")
        yield from write_question(problem)
    yield Chapter("rows", "Points", "whole")
    labelled_rows = frozenset(k for k, p in enumerate(front.points) if p.label)
    rows = list_points(front, full)
    objectives = len(front.objectives)
    priorities = [9] * objectives + [7, 6] + [5] * (len(rows[0]) - objectives - 4) + [4, 3]
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
    objective_heads, free_heads = (head_numbers(problem, names) for names in (texts, free))
    rows: list[Row] = [(*objective_heads, "stable", "event", *free_heads, "structure", "active limits")]
    for p in front.points:
        design = p.solution.parameters
        label = p.label if full or len(p.label) <= _MAX_LABEL else f"{p.label[: _MAX_LABEL - 1]}…"
        objectives = list_numbers(problem, texts, dict(zip(texts, p.objectives, strict=True)), design, digits)
        numbers = list_numbers(problem, free, design, design, digits)
        rows.append((*objectives, say_whether(p.stable), label, *numbers, p.structure, ", ".join(p.limits)))
    return rows
