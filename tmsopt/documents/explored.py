"""The explorer on the page of a result, and the designs that its buttons show: the best one, then special ones."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from tmsopt.models import in_words_of
from tmsopt.problem import Posed, Solution, pose, unit_at
from tmsopt.problem.real_form import has_real_form

if TYPE_CHECKING:
    from tmsopt.charts import Chart
    from tmsopt.fronts import Front
    from tmsopt.proofs import Proof
    from tmsopt.search import Every
    from tmsopt.studies import Results, Row
    from tmsopt.tracing import Trace

NamedDesign = tuple[str, Mapping[str, float]]

_MAX_BUTTONS = 8
"""Maximum number of designs that have a button."""


def frame_explorer(result: Any, design: Solution | None) -> str:
    """Return the explorer in an isolated frame; empty for a result without a problem, and for large matrices."""
    base, designs = find_designs(result, design)
    problem: Any = getattr(base, "problem", None) or base
    if base is None or not has_real_form(problem.model):
        return ""
    from tmsopt.explorer import frame, page_of

    of_H = problem.model.is_complex
    roots, side = ("eigenfrequencies", "below the real axis") if of_H else ("roots", "left of the imaginary axis")
    return (
        f"<p>Move a parameter, and see the {roots} move: disturbances die out if all of them are {side}.</p>\n"
        f"{frame(page_of(base, designs, trace_curves=True), 'Explorer of this problem')}\n"
        '<p class="print">The explorer works in the file, not on paper.</p>'
    )


def find_designs(result: Any, design: Solution | None) -> tuple[Posed | Solution | None, list[NamedDesign]]:
    """Return the problem or solution at which the explorer opens (None if there is none), and named designs."""
    name = type(result).__name__
    holder = getattr(result, "study", result)
    base = result if name == "Solution" else design or getattr(holder, "problem", None)
    base = base or next(iter(getattr(result, "solutions", ())), None)
    if base is None or base is design or name not in _DESIGNS:
        return base, []
    problem = pose(base)
    names = set(problem.parameter_set.names)
    return base, _number_designs((n, values) for n, values in _DESIGNS[name](result) if names <= set(values))


def _number_designs(designs: Iterable[NamedDesign]) -> list[NamedDesign]:
    """Return the first designs, each set of values once; designs with the same name get numbers."""
    unique_designs: dict[tuple[float, ...], NamedDesign] = {}
    for name, values in designs:
        unique_designs.setdefault(tuple(values.values()), (name, values))
    buttons = [*unique_designs.values()][:_MAX_BUTTONS]
    counts, numbers, numbered_designs = Counter(name for name, _ in buttons), Counter[str](), []
    for name, values in buttons:
        numbers[name] += 1
        numbered_designs.append((f"{name}, {numbers[name]} of {counts[name]}" if counts[name] > 1 else name, values))
    return numbered_designs


def _list_front(front: "Front") -> Iterator[NamedDesign]:
    """List the point with the fastest decay, then all points with a label."""
    if front.points:
        best = min(front.points, key=lambda p: _replace_nan(_scale_abscissa(front.problem.posed, p.solution)))
        yield best.label or "least abscissa", best.solution.parameters
    yield from ((point.label, point.solution.parameters) for point in front.points if point.label)


def _scale_abscissa(problem: Posed, design: "Solution | Row") -> float:
    """Return the abscissa in 1/s, or without a unit if the model has none; more negative is faster decay."""
    return design.abscissa / unit_at(problem, "abscissa", design.parameters).factor


def _list_trace(trace: "Trace") -> Iterator[NamedDesign]:
    """List exceptional points, then the point with the fastest decay, then the other events except at limits."""
    events = [(e, branch) for branch in trace.branches for e in branch.events if e.name not in _LIMIT_EVENTS]
    events.sort(key=lambda pair: _replace_nan(pair[1].abscissa[pair[0].index]))
    designs = [("EP" in e.name, in_words_of(trace.problem.model, e.name), e.parameters) for e, _ in events]
    yield from ((name, values) for is_exceptional, name, values in designs if is_exceptional)
    points = [(branch, k) for branch in trace.branches for k in range(len(branch))]
    if points:
        branch, k = min(points, key=lambda point: _replace_nan(point[0].abscissa[point[1]]))
        yield "least abscissa", {n: float(column[k]) for n, column in branch.parameters.items()}
    yield from ((name, values) for is_exceptional, name, values in designs if not is_exceptional)


def _list_chart(chart: "Chart") -> Iterator[NamedDesign]:
    """List the design of the grid with the fastest decay."""
    if best := chart.to_json()["least_abscissa"]:
        yield "least abscissa", chart.problem.posed.ordered({n: best[n] for n in chart.axes})


def _list_results(results: "Results") -> Iterator[NamedDesign]:
    """List the best row, and the row that decays most slowly."""
    problem = results.study.problem.posed
    finite_rows = [row for row in results.rows if math.isfinite(row.abscissa)]
    rate = partial(_scale_abscissa, problem)
    if finite_rows:
        best, slowest = results.summary.best or min(finite_rows, key=rate), max(finite_rows, key=rate)
        yield f"best, row {best.number}", best.parameters
        yield f"greatest abscissa, row {slowest.number}", slowest.parameters


def _list_proof(proof: "Proof") -> Iterator[NamedDesign]:
    """List the proved design, rounded to doubles."""
    if proof.parameters:
        yield "proved", {n: float(number.value) for n, number in proof.parameters.items()}


def _list_every(all_designs: "Every") -> Iterator[NamedDesign]:
    """List all designs but the first, at which the page opens."""
    yield from ((f"design {k}", s.parameters) for k, s in enumerate(all_designs.solutions[1:], start=2))


def _replace_nan(value: float) -> float:
    return math.inf if math.isnan(value) else value


_LIMIT_EVENTS = ("end", "constraint")
"""Names of events at which a branch only meets a limit."""

_DESIGNS: Mapping[str, Callable[[Any], Iterator[NamedDesign]]] = {
    "Chart": _list_chart,
    "Every": _list_every,
    "Front": _list_front,
    "Proof": _list_proof,
    "Results": _list_results,
    "Trace": _list_trace,
}
"""Class of a result → function that lists the designs of its buttons."""
