"""What a document says of each result, in the order of its page."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from tmsopt import plots, report as texts
from tmsopt.display.document_rows import (
    chart_rows,
    limit_rows,
    point_rows,
    range_rows,
    record_rows,
    spread,
    thinned,
)
from tmsopt.display.markup import Chapter, Rows, facts, paragraphs, table, verbatim, words
from tmsopt.display.pictures import picture, untitled
from tmsopt.display.writers import drawn, report
from tmsopt.guide import describe
from tmsopt.models import in_words_of, tms
from tmsopt.problem import Posed, unit_of

if TYPE_CHECKING:
    from tmsopt.charts import Chart
    from tmsopt.fronts import Front
    from tmsopt.problem import Solution
    from tmsopt.proofs import Proof
    from tmsopt.studies import Results
    from tmsopt.tracing import Trace

Chapters = Iterator[Chapter]

_POINTS = 800 * 800  # of a chart that a picture shows

_TOLD = ("motion", "loads", "model", "cases", "warnings", "robustness", "rounding", "proof", "search")
"""Parts of the report of a design that stand beside the answer."""


def of_solution(solution: "Solution", full: bool) -> Chapters:
    """A design: the answer, what it looks like, its parameters, motion, limits, proof, quantities."""
    found = texts.findings(solution, full)
    si = texts.si_parameters(solution)
    parts = {part.name: part for part in texts.design_parts(solution, found, si)}
    first = parts.get("answer") or parts["conflict"]
    told = [
        (n, "; ".join(line.removeprefix(f"{n}: ").removeprefix("warning: ") for line in (p.lines or p.rest)))
        for n in _TOLD
        if (p := parts.get(n))
    ]
    yield Chapter("answer", "Answer", _lead(first.lines) + facts((n, said.removeprefix(f"{n}: ")) for n, said in told))
    yield from _looks(solution)
    yield Chapter("parameters", "Parameters", table("Parameters of the design", _parameter_rows(solution, si)), "wide")
    yield from _growth(solution)
    body = _lead(parts["proof"].lines) + _bound(solution) + paragraphs(parts["proof"].rest)
    yield Chapter("good", "How good it is", body)
    yield Chapter("limits", "Limits", _limits(solution, found), "wide")
    rows = [(*row[:3], row[-1]) for row in texts.quantity_rows(solution, si)]
    body = table("Quantities of the design", [("quantity", "value", "unit", "meaning"), *rows])
    yield Chapter("quantities", "Derived quantities", body, "wide")


def of_proof(proof: "Proof", design: "Solution | None") -> Chapters:
    """What is proved, every digit, and of the design that it was proved of its pictures."""
    if proof.problem is None:
        yield from of_other(proof)
        return
    problem = proof.problem.posed
    yield Chapter("answer", "Answer", _opening(proof))
    digits = [("number", "decimal", "radius", "unit"), *texts.number_rows(problem, proof)]
    yield Chapter("digits", "Digits", table(f"Numbers that were proved, to {proof.digits} digits", digits), "wide")
    yield Chapter("roots", "Roots", picture(lambda: plots.draw_roots(untitled(proof)), "Roots in the complex plane"))
    if design is not None:
        si = texts.si_parameters(design)
        yield from _looks(design)
        body = table("Parameters of the design as stored", _parameter_rows(design, si))
        yield Chapter("parameters", "Parameters", body, "wide")
        yield from _growth(design)
    else:
        yield _asked(problem)


def of_chart(chart: "Chart") -> Chapters:
    """The classes with their shares, the plane, its corners, and designs of the grid."""
    yield Chapter("answer", "Answer", _opening(chart))
    met = {in_words_of(chart.problem.model, name): share for name, share in chart.shares.items() if share}
    shares = [("class", "share in %"), *((name, f"{100 * share:.2f}") for name, share in met.items())]
    corners = [("corner",)] if chart.domain is None else texts.corner_rows(chart.domain, chart.problem.posed)
    yield Chapter("classes", "Classes", table("Share of each class", shares) + table("Corners of the domains", corners))
    plain = spread(untitled(chart), _POINTS)
    yield Chapter(
        "picture",
        "Chart",
        _pictures(
            (lambda: plots.chart_figure(plain), f"Stability over {' and '.join(chart.axes)}"),
            (lambda: plots.chart_figure(plain, "abscissa"), f"Spectral abscissa over {' and '.join(chart.axes)}"),
        ),
        "wide",
    )
    yield _asked(chart.problem.posed)
    rows, note = chart_rows(chart)
    yield Chapter("rows", "Designs", note + table("Designs of the grid", rows), "whole")


def of_trace(trace: "Trace") -> Chapters:
    """The branches, their events, the picture, and points along them."""
    yield Chapter("answer", "Answer", _opening(trace))
    caption = f"Branches of {in_words_of(trace.problem.model, trace.pattern)}"
    yield Chapter("picture", "Branches", picture(lambda: drawn(untitled(trace)), caption))
    units = {n: unit_of(trace.problem.posed, n) for n in (*trace.problem.free, "abscissa")}
    listed = [texts.event_rows(branch, units, trace.problem.model) for branch in trace.branches]
    rows = [("branch", "event", *listed[0][0][1:])] if listed else [("branch",)]
    rows += [(str(k), *row) for k, found in enumerate(listed, start=1) for row in found[1:]]
    yield Chapter("events", "Events", table("Events along the branches, to all digits", rows), "whole")
    yield _asked(trace.problem.posed)
    rows, note = point_rows(trace)
    yield Chapter("rows", "Points", note + table("Points of the branches", rows), "whole")


def of_front(front: "Front") -> Chapters:
    """The front, its points with all digits, gaps and notes."""
    yield Chapter("answer", "Answer", _opening(front))
    caption = f"Front of {', '.join(front.objectives)}"
    yield Chapter("picture", "Front", picture(lambda: plots.front_figure(untitled(front)), caption))
    yield _asked(front.problem.posed)
    yield Chapter("rows", "Points", table("Points of the front", texts.front_rows(front, full=True)), "whole")


def of_results(results: "Results") -> Chapters:
    """What the rows say together, how they are distributed, and the rows."""
    study = results.study
    yield Chapter("answer", "Answer", _opening(results))
    caption = "How the designs are distributed" if study.method == "monte_carlo" else "The objective over what varies"
    yield Chapter("picture", "Rows together", picture(lambda: drawn(untitled(results)), caption))
    yield _asked(study.problem.posed)
    rows, note = thinned(results.rows, "rows", "tmsopt study FILE --export rows.csv writes all")
    yield Chapter("rows", "Rows", note + table("Rows of the study", texts.study_rows(study, rows)), "whole")


def of_other(result: Any) -> Chapters:
    """Any other result: its text begins the page, its picture and its table follow."""
    yield Chapter("answer", "Answer", _opening(result))
    name = type(result).__name__
    yield Chapter("picture", "Picture", picture(lambda: drawn(result), name))
    if hasattr(result, "records"):
        rows, note = record_rows(result)
        yield Chapter("rows", "Rows", note + table(name, rows), "whole")


def _lead(lines: Iterable[str]) -> str:
    """The first line as what is read first, the others below it."""
    first, *rest = [*lines] or ["nothing found"]
    return f'<p class="lead">{words(first)}</p>\n{paragraphs(rest)}'


def _opening(result: Any) -> str:
    """The sentences of the text of a result, without its title and its tables."""
    lines = report(untitled(result), full=True).splitlines()[1:]
    return _lead([line for line in lines if line.strip() and not line.startswith("  ")])


def _asked(problem: Posed) -> Chapter:
    """What was asked: parameters, values and ranges with their meaning, objective and limits."""
    asked = describe(problem).asked.items()
    said = ((part, "; ".join(f"{name}: {text}" for name, text in keys.items())) for part, keys in asked)
    body = table("Parameters, with values and ranges", range_rows(problem), "free or fixed") + facts(said)
    return Chapter("parameters", "Parameters", body, "wide")


def _looks(solution: "Solution") -> Chapters:
    """The bicycle to scale, or the sketch that its model has."""
    if solution.problem.model is tms:
        caption = "The bicycle from its right side, to scale, in wheelbases; z points down"
        yield Chapter("bicycle", "Bicycle", picture(lambda: plots.draw_bicycle(solution), caption))
    elif sketch := describe(solution).sketch:
        yield Chapter("bicycle", "Bicycle", verbatim(sketch.strip("\n"), "sketch of the model, not to scale"))


def _growth(solution: "Solution") -> Chapters:
    """Growth rates and frequencies over the speed, or the first parameter."""
    from tmsopt.dynamics import growth

    try:
        found = growth(untitled(solution))
    except Exception:  # a root at infinity, or nothing that could vary: nothing to draw
        return
    caption = f"Growth rates and frequencies over {found.over.name}; stable where it is shaded"
    yield Chapter("growth", "Growth and frequencies", picture(lambda: plots.growth_figure(found), caption))


def _limits(solution: "Solution", found: "texts.Findings") -> str:
    """Every limit that was stated and how it stands, then what a move of those that bind is worth."""
    held = table("Limits, and how they stand", limit_rows(solution))
    levers = found.explanation.levers if found.explanation else ()
    rows = [("limit", "stands at", "a move of it", "buys, to first order")]
    rows += [
        (name.rstrip(":"), at, by.removeprefix("by "), buys.removeprefix("buys "))
        for name, at, by, buys in (texts.lever_cells(solution, v) for v in levers)
    ]
    worth = table("What the limits that bind are worth", rows)
    again = [lever.sentence for lever in levers if math.isfinite(lever.resolved)]
    return (f'<div class="beside">\n{held}\n{worth}\n</div>' if held or worth else "") + paragraphs(again)


def _bound(solution: "Solution") -> str:
    """What no design can beat, by whom, to all digits; empty where nobody looked for it."""
    bound, problem = solution.bound, solution.problem.posed
    unit = unit_of(problem, problem.minimize or problem.maximize or "abscissa")
    if not (bound.proven or bound.solver or math.isfinite(bound.value)):
        return ""
    searched = f"{bound.solver}, {bound.nodes} nodes, {bound.seconds:.1f} s" if bound.solver else ""
    value, gap = (unit.show(x, n) if math.isfinite(x) else "" for x, n in ((bound.value, 12), (bound.gap, 2)))
    return facts(
        (
            ("proved", "yes" if bound.proven else "no"),
            ("bound", value),
            ("gap", gap),
            ("method", bound.method),
            ("branch and bound", searched),
            ("feasibility tolerance", f"{bound.tolerance:.0e}" if bound.tolerance else ""),
        )
    )


def _parameter_rows(solution: "Solution", si: Mapping[str, float]) -> Rows:
    """Those of the report, with the range of each that is free; of a problem in SI, without units beside."""
    ranges = {w.name: w.given for of in describe(solution).sets for w in of.parameters}
    own = solution.problem.posed.parameter_set.rate is not None
    heads = ("parameter", "value", "unit", "free or fixed", "range", "without units", "likewise", "meaning")
    rows: list[tuple[str, ...]] = [heads]
    for name, value, unit, how, other, number, _, meaning in texts.parameter_rows(solution, si):
        beside = (other, number) if own else ("", "")
        rows.append((name, value, unit, how, ranges[name] if how == "free" else "", *beside, meaning))
    return rows


def _pictures(*listed: tuple[Callable[[], Any], str]) -> str:
    drawn = "\n".join(filter(None, (picture(draw, caption) for draw, caption in listed)))
    return f'<div class="beside">\n{drawn}\n</div>' if drawn else ""
